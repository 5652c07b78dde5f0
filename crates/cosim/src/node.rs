//! An FMU of a running system, as an exchange of values sees it.

use trueup_fmi_description::description::{Description, InterfaceCapabilities as Offered};
use trueup_fmi_import::{AnyInstance, ExperimentSetup, InstanceOptions, PreparedReferences, fmi3};

use crate::buffer::{BlockAccess, configure};
use crate::error::CosimError;
use crate::plan::{ElementIndex, PlannedComponent};
use crate::step_rule::StepRule;
use crate::system::ComponentInterface;
use crate::value;

/// An instance with what is known about it. Values are read from and set on Co-Simulation and Model Exchange alike; only
/// the [`SystemStepper`](crate::stepper::SystemStepper) differs.
pub struct InstanceNode {
    /// What was planned; its start values stay for arrays that are driven in part.
    pub planned: PlannedComponent,
    /// The instance.
    pub slave: AnyInstance,
    /// Its continuous inputs over a step.
    pub line: InputLine,
    /// Its steps in Co-Simulation, where a master runs it.
    pub(crate) rule: Option<StepRule>,
}

impl InstanceNode {
    /// An instance of what was planned; `how` is for Co-Simulation of FMI 3.0.
    ///
    /// # Errors
    /// The FMU gives no instance.
    pub fn instantiate(
        planned: &PlannedComponent,
        how: fmi3::CoSimulationOptions,
    ) -> Result<AnyInstance, CosimError> {
        let options = InstanceOptions::named(planned.name.clone());
        let mut slave = match planned.interface {
            ComponentInterface::CoSimulation => AnyInstance::co_simulation(&planned.fmu, options, how)?,
            ComponentInterface::ModelExchange => AnyInstance::model_exchange(&planned.fmu, options)?,
        };
        slave.request_reasons(&planned.description().log_categories);
        Ok(slave)
    }

    /// With the instance made of it.
    pub fn new(planned: PlannedComponent, slave: AnyInstance) -> Self {
        Self { planned, slave, line: InputLine::default(), rule: None }
    }

    /// Sets what was planned and initializes at `time` (s), without a stop, of an FMU that nothing is connected to.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub(crate) fn initialize(&mut self, time: f64, tolerance: Option<f64>) -> Result<(), CosimError> {
        let (slave, planned) = (&mut self.slave, &self.planned);
        let call = |source| CosimError::Call { time, source };
        configure(slave, &planned.structural).map_err(call)?;
        planned.start.iter().try_for_each(|block| slave.set(block)).map_err(call)?;
        let experiment = ExperimentSetup { tolerance, start: time, stop: None };
        slave.enter_initialization_mode(experiment).map_err(call)?;
        slave.exit_initialization_mode().map_err(call)
    }

    /// Its description, arrays sized as they are in this system.
    pub fn description(&self) -> &Description {
        self.planned.description()
    }

    /// What its interface can do.
    pub fn offered(&self) -> Option<&Offered> {
        match self.planned.interface {
            ComponentInterface::CoSimulation => self.description().co_simulation.as_ref(),
            ComponentInterface::ModelExchange => self.description().model_exchange.as_ref(),
        }
    }

    /// It makes samples: see [`StepRule::samples`].
    pub(crate) fn samples(&self) -> bool {
        self.rule.is_some_and(|rule| rule.samples())
    }

    /// It may be given steps of any length.
    pub(crate) fn allows_any_step(&self) -> bool {
        self.rule.is_none_or(|rule| rule.allows_any())
    }

    /// Its state can be stored and restored.
    pub fn can_restore(&self) -> bool {
        self.offered().is_some_and(|i| i.can_get_and_set_fmu_state)
    }
}

/// `component.variable[1]`, for messages.
pub(crate) fn name(nodes: &[InstanceNode], element: ElementIndex) -> String {
    let node = &nodes[element.component];
    let name = variable(node.description(), element.variable, element.element);
    if node.planned.name.is_empty() { name } else { format!("{}.{name}", node.planned.name) }
}

/// Name of an element within its FMU.
pub(crate) fn variable(d: &Description, variable: usize, element: usize) -> String {
    let v = &d.variables[variable];
    let names = value::elements(d, v).unwrap_or_default();
    names.into_iter().nth(element).unwrap_or_else(|| v.name.clone())
}

/// Continuous inputs of an FMU (`Float64`, driven by others or by a file) over a step: `value + slope (t - from)`, in the
/// order of `references`, arrays with all their elements.
#[derive(Default)]
pub struct InputLine {
    /// The inputs; `None`: there are none.
    pub references: Option<PreparedReferences>,
    /// Where the values of the inputs are among the exchange's reals.
    pub slots: Vec<usize>,
    /// Start of the step in s.
    pub from: f64,
    /// Values then.
    pub value: Vec<f64>,
    /// Slopes in 1/s.
    pub slope: Vec<f64>,
    /// What is set on the FMU is not `value`: it must be set first.
    pub dirty: bool,
    now: Vec<f64>,
}

impl InputLine {
    /// Of these inputs, all zero.
    pub(crate) fn new(references: PreparedReferences, slots: Vec<usize>) -> Self {
        let zeros = || vec![0.0; slots.len()];
        let (value, slope, now) = (zeros(), zeros(), zeros());
        Self { references: Some(references), slots, from: 0.0, value, slope, dirty: false, now }
    }

    /// Values at `time`.
    pub fn at(&mut self, time: f64) -> &[f64] {
        let t = time - self.from;
        for ((now, value), slope) in self.now.iter_mut().zip(&self.value).zip(&self.slope) {
            *now = value + slope * t;
        }
        &self.now
    }
}

impl InstanceNode {
    /// Sets the continuous inputs to what their lines say at `time`.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn set_on_line(&mut self, time: f64) -> Result<(), CosimError> {
        self.line.at(time);
        let Some(references) = &self.line.references else { return Ok(()) };
        self.slave
            .write(references, &self.line.now)
            .map_err(|source| CosimError::Call { time, source: *source })
    }
}
