//! Systems from files to plans: what is read, what is chosen, and the message of every mistake. The FMUs have no libraries.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

mod document;
mod elements;
mod hostile;
mod inputs;
mod mistakes;
mod plans;
mod round_trip;
mod ssp;

use std::path::{Path, PathBuf};

use tempfile::TempDir;
use trueup_cosim::plan::MasterPlan;
use trueup_cosim::system::CosimSystem;
use trueup_cosim::{CosimError, check};

/// A folder with FMUs (unpacked, descriptions only) and a system.
pub(crate) struct Desk(TempDir);

/// Variables of the FMU `all.fmu` (FMI 3.0): one of everything.
const ALL: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="3.0" modelName="all" instantiationToken="t">
  <CoSimulation modelIdentifier="all" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions>
    <Unit name="rad"><BaseUnit rad="1"/><DisplayUnit name="deg" factor="57.29577951308232"/></Unit>
    <Unit name="deg"><BaseUnit rad="1" factor="0.017453292519943295"/></Unit>
    <Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>
    <Unit name="K"><BaseUnit K="1"/></Unit>
    <Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
    <Unit name="Hz"><BaseUnit s="-1"/></Unit>
    <Unit name="rad/s"><BaseUnit s="-1" rad="1"/></Unit>
    <Unit name="furlong"/>
  </UnitDefinitions>
  <TypeDefinitions>
    <EnumerationType name="Mode"><Item name="off" value="1"/><Item name="on" value="2"/></EnumerationType>
    <EnumerationType name="Gear"><Item name="park" value="1"/><Item name="drive" value="5"/></EnumerationType>
  </TypeDefinitions>
  <DefaultExperiment stopTime="4" stepSize="0.01"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="angle" valueReference="1" causality="output" unit="rad"/>
    <Float64 name="degrees" valueReference="2" causality="input" unit="deg" start="0"/>
    <Float64 name="force" valueReference="3" causality="input" unit="N" start="0"/>
    <Float64 name="warm" valueReference="4" causality="output" unit="K"/>
    <Float64 name="celsius" valueReference="5" causality="input" unit="degC" start="0"/>
    <Float64 name="odd" valueReference="6" causality="input" unit="furlong" start="0"/>
    <Float64 name="rate" valueReference="7" causality="output" unit="Hz"/>
    <Float64 name="speed" valueReference="8" causality="input" unit="rad/s" start="0"/>
    <Float64 name="x" valueReference="9" causality="output"/>
    <Float64 name="u" valueReference="10" causality="input" start="0"/>
    <Float32 name="single" valueReference="11" causality="input" start="0"/>
    <Float32 name="singleOut" valueReference="12" causality="output"/>
    <Int32 name="count" valueReference="13" causality="output"/>
    <Int8 name="small" valueReference="14" causality="input" start="0"/>
    <Int64 name="wide" valueReference="15" causality="input" start="0"/>
    <Boolean name="flag" valueReference="16" causality="output"/>
    <Boolean name="enable" valueReference="17" causality="input" start="false"/>
    <Enumeration name="mode" valueReference="18" causality="input" declaredType="Mode" start="1"/>
    <Enumeration name="gear" valueReference="19" causality="output" declaredType="Gear"/>
    <String name="text" valueReference="20" causality="output"/>
    <String name="label" valueReference="21" causality="input"><Start value="a"/></String>
    <Binary name="blob" valueReference="22" causality="output"/>
    <Float64 name="gain" valueReference="23" causality="parameter" variability="fixed" start="2" min="0" max="10" unit="rad"/>
    <Float64 name="fixed" valueReference="24" causality="local" variability="constant" initial="exact" start="2"/>
    <UInt64 name="n" valueReference="25" causality="structuralParameter" variability="fixed" start="2" max="8"/>
    <Float64 name="vector" valueReference="26" causality="output"><Dimension valueReference="25"/></Float64>
    <Float64 name="target" valueReference="27" causality="input" start="0 0"><Dimension valueReference="25"/></Float64>
    <Float64 name="matrix" valueReference="28" causality="parameter" variability="fixed" start="1 2 3 4 5 6"><Dimension start="2"/><Dimension start="3"/></Float64>
    <Float64 name="bare" valueReference="29" causality="input"><Dimension start="2"/></Float64>
    <Float64 name="der(x)" valueReference="30" causality="output"/>
    <UInt64 name="huge" valueReference="31" causality="input" start="0"/>
    <Float64 name="knob" valueReference="32" causality="parameter" variability="tunable" unit="m" start="1"/>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"#;

/// `old.fmu` (FMI 2.0): Model Exchange only, arrays flattened.
const OLD: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="old" guid="g">
  <ModelExchange modelIdentifier="old"/>
  <ModelVariables>
    <ScalarVariable name="v[1]" valueReference="0" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="v[2]" valueReference="1" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="w[1]" valueReference="2" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="w[2]" valueReference="3" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="m[1,1]" valueReference="4" causality="parameter" variability="fixed"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="m[1,2]" valueReference="5" causality="parameter" variability="fixed"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="whole" valueReference="0" causality="output"><Integer/></ScalarVariable>
  </ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"#;

/// `even.fmu` (FMI 2.0): equal steps, one instance per process.
const EVEN: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="2.0" modelName="even" guid="g">
  <CoSimulation modelIdentifier="even" canBeInstantiatedOnlyOncePerProcess="true"/>
  <ModelVariables><ScalarVariable name="u" valueReference="0" causality="input"><Real start="0"/></ScalarVariable></ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"#;

impl Desk {
    pub(crate) fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        for (name, text) in [("all", ALL), ("old", OLD), ("even", EVEN)] {
            desk.fmu(name, text);
        }
        desk
    }
    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }
    pub(crate) fn fmu(&self, name: &str, description: &str) {
        let folder = self.path().join(format!("{name}.fmu"));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("modelDescription.xml"), description).unwrap();
    }
    pub(crate) fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let file = self.path().join(name);
        std::fs::write(&file, text).unwrap();
        file
    }
    pub(crate) fn system(&self, toml: &str) -> Result<CosimSystem, CosimError> {
        CosimSystem::read(&self.write("system.toml", toml))
    }
    pub(crate) fn plan(&self, toml: &str) -> Result<MasterPlan, CosimError> {
        check(&self.system(toml)?)
    }
    /// The mistakes as `line: message`, without the path.
    pub(crate) fn mistakes(&self, toml: &str) -> Vec<String> {
        said(self.plan(toml), self.path())
    }
}

pub(crate) fn said(result: Result<MasterPlan, CosimError>, folder: &Path) -> Vec<String> {
    match result {
        Ok(_) => Vec::new(),
        Err(CosimError::System(list)) => list
            .iter()
            .map(|m| {
                format!("{}: {}", m.place.line, m.message).replace(&format!("{}/", folder.display()), "")
            })
            .collect(),
        Err(other) => panic!("{other}"),
    }
}
