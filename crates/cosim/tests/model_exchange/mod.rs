//! FMUs of Model Exchange, integrated by the master.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod coupled;
mod faults;
mod reference;

use std::path::Path;
use std::sync::Arc;

use crate::compiled::compiled;
use trueup_cosim::model_exchange::{
    GroupSurroundings, IntegrationSettings, Integrator, StepperGroup, TOLERANCE,
};
use trueup_cosim::node::InstanceNode;
use trueup_cosim::plan::PlannedComponent;
use trueup_cosim::system::{ComponentInterface, CosimSystem};
use trueup_cosim::{
    BlockAccess, CosimError, Master, RunLog, SeriesMemory, ValueBuffer, VariableBlock, check,
};
use trueup_fmi_description::FmiVersion;
use trueup_fmi_import::{ExperimentSetup, UnpackedFmu, fmi3};

/// One FMU under way.
struct Single {
    nodes: Vec<InstanceNode>,
    group: StepperGroup,
}

impl Single {
    fn new(fmu: &Arc<UnpackedFmu>, integrator: Integrator, tolerance: f64) -> Self {
        let planned = PlannedComponent {
            name: "model".into(),
            fmu: Arc::clone(fmu),
            interface: ComponentInterface::ModelExchange,
            structural: Vec::new(),
            resized: None,
            start: Vec::new(),
            every: 1,
        };
        let slave = InstanceNode::instantiate(&planned, fmi3::CoSimulationOptions::default()).unwrap();
        let mut node = InstanceNode::new(planned, slave);
        node.slave.enter_initialization_mode(ExperimentSetup::default()).unwrap();
        node.slave.exit_initialization_mode().unwrap();
        let mut nodes = vec![node];
        let settings = IntegrationSettings { integrator, tolerance, ..IntegrationSettings::default() };
        let (group, _) = StepperGroup::start(&mut nodes, &[0], 0.0, settings, Vec::new(), &mut ()).unwrap();
        Self { nodes, group }
    }

    /// Goes on to `time` and handles an event there too; `events` are given their times.
    fn to(
        &mut self,
        time: f64,
        around: &mut dyn GroupSurroundings,
        events: &mut Vec<f64>,
    ) -> Result<(), CosimError> {
        loop {
            let reached = self.group.advance(&mut self.nodes, around, time, true)?;
            if !reached.event {
                return Ok(());
            }
            events.push(self.group.time());
            self.group.settle(&mut self.nodes, around)?;
        }
    }

    fn reals(&mut self, references: &[u32]) -> Vec<f64> {
        let mut block = VariableBlock {
            references: references.into(),
            values: ValueBuffer::Float64(vec![0.0; references.len()]),
        };
        self.nodes[0].slave.get(&mut block).unwrap();
        let ValueBuffer::Float64(values) = block.values else { unreachable!() };
        values
    }
}

const BALL: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="ball" guid="g" numberOfEventIndicators="1">
  <ModelExchange modelIdentifier="ball" completedIntegratorStepNotNeeded="true" canGetAndSetFMUstate="true"/>
  <ModelVariables>
    <ScalarVariable name="h" valueReference="0" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="v" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="der(h)" valueReference="4"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="der(v)" valueReference="5"><Real derivative="2"/></ScalarVariable>
    <ScalarVariable name="bounces" valueReference="0" causality="output" variability="discrete"><Integer/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1" dependencies=""/><Unknown index="2" dependencies=""/><Unknown index="5" dependencies=""/></Outputs>
    <Derivatives><Unknown index="3"/><Unknown index="4"/></Derivatives>
  </ModelStructure>
</fmiModelDescription>"#;

const SENSOR: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="sensor" guid="g" numberOfEventIndicators="1">
  <ModelExchange modelIdentifier="sensor" completedIntegratorStepNotNeeded="true" canGetAndSetFMUstate="true"/>
  <ModelVariables>
    <ScalarVariable name="y" valueReference="0" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="der(y)" valueReference="4"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="u" valueReference="2" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="T" valueReference="3" causality="parameter" variability="fixed"><Real start="0.1"/></ScalarVariable>
    <ScalarVariable name="bounces" valueReference="0" causality="input" variability="discrete"><Integer start="0"/></ScalarVariable>
    <ScalarVariable name="crossings" valueReference="1" causality="output" variability="discrete"><Integer/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1" dependencies=""/><Unknown index="6" dependencies="3"/></Outputs>
    <Derivatives><Unknown index="2"/></Derivatives>
  </ModelStructure>
</fmiModelDescription>"#;

const TROUBLE: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="trouble" guid="g" numberOfEventIndicators="1">
  <ModelExchange modelIdentifier="trouble" completedIntegratorStepNotNeeded="true"/>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="der(x)" valueReference="4"><Real derivative="1"/></ScalarVariable>
    <ScalarVariable name="fault" valueReference="2" causality="parameter" variability="fixed"><Integer start="0"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1" dependencies=""/></Outputs>
    <Derivatives><Unknown index="2"/></Derivatives>
  </ModelStructure>
</fmiModelDescription>"#;

/// Unpacked FMUs made of `hybrid.c` here, `ball.fmu`, `sensor.fmu` and `trouble.fmu`; `None`, with a message, without a
/// C compiler.
fn made() -> Option<tempfile::TempDir> {
    let desk = tempfile::tempdir().unwrap();
    for (name, description) in [("ball", BALL), ("sensor", SENSOR), ("trouble", TROUBLE)] {
        let folder = desk.path().join(format!("{name}.fmu"));
        let binaries = folder.join("binaries").join(FmiVersion::V2.platform());
        std::fs::create_dir_all(&binaries).unwrap();
        std::fs::write(folder.join("modelDescription.xml"), description).unwrap();
        let kind = format!("-DKIND={}", name.to_uppercase());
        compiled("model_exchange/hybrid.c", &[&kind], &binaries.join(format!("{name}.so")))?;
    }
    Some(desk)
}

/// Runs a system in TOML next to the FMUs.
fn run(desk: &Path, toml: &str) -> (Result<RunLog, CosimError>, SeriesMemory) {
    let file = desk.join("system.toml");
    std::fs::write(&file, toml).unwrap();
    let plan = check(&CosimSystem::read(&file).unwrap()).unwrap();
    let mut memory = SeriesMemory::default();
    let result = Master::new(plan).unwrap().run(&mut memory);
    (result, memory)
}

/// Median, 95 % quantile and largest of absolute values.
fn quantiles(errors: impl Iterator<Item = f64>) -> [f64; 3] {
    let mut all: Vec<f64> = errors.map(f64::abs).collect();
    all.sort_by(f64::total_cmp);
    [0.5, 0.95, 1.0].map(|q| all[((all.len() - 1) as f64 * q) as usize])
}
