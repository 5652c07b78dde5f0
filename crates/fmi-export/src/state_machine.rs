//! Which function may be called when, for both versions and both interface types.

use crate::fault::{CallOutcome, error};

/// Version of the standard that an instance was made with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InstanceVersion {
    /// FMI 2.0.
    Fmi2,
    /// FMI 3.0.
    Fmi3,
}

/// Interface type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InterfaceType {
    /// The importer integrates.
    ModelExchange,
    /// The FMU integrates.
    CoSimulation,
}

/// State of an instance; the names of FMI 3.0 (FMI 2.0's "step complete" is `Step`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum InstanceState {
    /// After instantiation or reset.
    Instantiated = 0,
    /// FMI 3.0 configuration mode.
    Configuration = 1,
    /// Initialization mode.
    Initialization = 2,
    /// Event mode.
    Event = 3,
    /// Continuous-time mode.
    ContinuousTime = 4,
    /// Between two steps.
    Step = 5,
    /// A step ended before its end (FMI 2.0 Discard).
    StepFailed = 6,
    /// Inside the intermediate update callback.
    IntermediateUpdate = 7,
    /// After termination.
    Terminated = 8,
    /// Inside a step.
    Stepping = 9,
    /// A panic was caught: only freeing is left.
    Fatal = 10,
}

impl InstanceState {
    const ALL: [Self; 11] = [
        Self::Instantiated,
        Self::Configuration,
        Self::Initialization,
        Self::Event,
        Self::ContinuousTime,
        Self::Step,
        Self::StepFailed,
        Self::IntermediateUpdate,
        Self::Terminated,
        Self::Stepping,
        Self::Fatal,
    ];
    /// From its number.
    pub fn from_number(n: u8) -> Option<Self> {
        Self::ALL.get(usize::from(n)).copied()
    }
    fn name(self) -> &'static str {
        match self {
            Self::Instantiated => "instantiated",
            Self::Configuration => "configuration mode",
            Self::Initialization => "initialization mode",
            Self::Event => "event mode",
            Self::ContinuousTime => "continuous-time mode",
            Self::Step => "step mode",
            Self::StepFailed => "after a step that could not be completed",
            Self::IntermediateUpdate => "intermediate update mode",
            Self::Terminated => "terminated",
            Self::Stepping => "inside a step",
            Self::Fatal => "after a fatal error",
        }
    }
}

/// Groups of functions with the same rule.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallGroup {
    /// Possible in every state: logging, FMU states, reset, counts, dependencies.
    Any,
    /// fmi2SetupExperiment.
    SetupExperiment,
    /// fmi3EnterConfigurationMode.
    EnterConfiguration,
    /// fmi3ExitConfigurationMode.
    ExitConfiguration,
    /// fmiXEnterInitializationMode.
    EnterInitialization,
    /// fmiXExitInitializationMode.
    ExitInitialization,
    /// fmiXEnterEventMode.
    EnterEvent,
    /// fmiXTerminate.
    Terminate,
    /// fmiXGet of values.
    Get,
    /// fmiXSet of values.
    Set,
    /// Directional and adjoint derivatives.
    Derivatives,
    /// fmi2NewDiscreteStates, fmi3UpdateDiscreteStates, fmi3EvaluateDiscreteStates.
    UpdateDiscreteStates,
    /// fmiXEnterContinuousTimeMode.
    EnterContinuousTime,
    /// fmi3EnterStepMode.
    EnterStep,
    /// fmiXCompletedIntegratorStep, fmiXSetContinuousStates.
    Integrator,
    /// fmiXSetTime.
    SetTime,
    /// States, rates, indicators.
    Evaluate,
    /// Nominals of the states.
    Nominals,
    /// fmi2SetRealInputDerivatives.
    InputDerivatives,
    /// fmi2GetRealOutputDerivatives, fmi3GetOutputDerivatives.
    OutputDerivatives,
    /// fmiXDoStep.
    DoStep,
    /// fmi2GetStatus and its kind.
    StepStatus,
}

impl CallGroup {
    /// States in which the call is legal.
    fn states(self, version: InstanceVersion, interface: InterfaceType) -> &'static [InstanceState] {
        use InstanceState::{
            Configuration, ContinuousTime, Event, Initialization, Instantiated, IntermediateUpdate, Step,
            StepFailed, Terminated,
        };
        let three = version == InstanceVersion::Fmi3;
        match self {
            Self::Any => &[
                Instantiated,
                Configuration,
                Initialization,
                Event,
                ContinuousTime,
                Step,
                StepFailed,
                Terminated,
            ],
            Self::SetupExperiment | Self::EnterConfiguration | Self::EnterInitialization => &[Instantiated],
            Self::ExitConfiguration => &[Configuration],
            Self::ExitInitialization => &[Initialization],
            Self::EnterEvent if interface == InterfaceType::CoSimulation => &[Step],
            Self::EnterEvent => &[Event, ContinuousTime],
            Self::Terminate => &[Event, ContinuousTime, Step, StepFailed],
            Self::Get if three => &[
                Instantiated,
                Configuration,
                Initialization,
                Event,
                ContinuousTime,
                Step,
                StepFailed,
                IntermediateUpdate,
                Terminated,
            ],
            Self::Get | Self::Derivatives => {
                &[Initialization, Event, ContinuousTime, Step, StepFailed, Terminated]
            }
            Self::Set => &[
                Instantiated,
                Configuration,
                Initialization,
                Event,
                ContinuousTime,
                Step,
                IntermediateUpdate,
            ],
            Self::UpdateDiscreteStates | Self::EnterContinuousTime | Self::EnterStep => &[Event],
            Self::Integrator => &[ContinuousTime],
            Self::SetTime => &[Event, ContinuousTime],
            Self::Evaluate => &[Initialization, Event, ContinuousTime, Terminated],
            Self::Nominals => &[Instantiated, Initialization, Event, ContinuousTime, Terminated],
            Self::InputDerivatives => &[Instantiated, Initialization, Step],
            Self::OutputDerivatives => &[Step, StepFailed, IntermediateUpdate, Terminated],
            Self::DoStep => &[Step],
            Self::StepStatus => &[Step, StepFailed, Terminated],
        }
    }
    /// The interface type that the call belongs to, if not to both.
    fn interface(self) -> Option<InterfaceType> {
        match self {
            Self::EnterContinuousTime
            | Self::Integrator
            | Self::SetTime
            | Self::Evaluate
            | Self::Nominals => Some(InterfaceType::ModelExchange),
            Self::EnterStep
            | Self::InputDerivatives
            | Self::OutputDerivatives
            | Self::DoStep
            | Self::StepStatus => Some(InterfaceType::CoSimulation),
            _ => None,
        }
    }
    /// Whether it is legal now; otherwise an error that names the legal states.
    pub fn permit(
        self,
        version: InstanceVersion,
        interface: InterfaceType,
        state: InstanceState,
    ) -> CallOutcome {
        let states = self.states(version, interface);
        if states.contains(&state) && self.interface().is_none_or(|i| i == interface) {
            return Ok(());
        }
        if let Some(i) = self.interface().filter(|i| *i != interface) {
            let of = |i| match i {
                InterfaceType::ModelExchange => "Model Exchange",
                InterfaceType::CoSimulation => "Co-Simulation",
            };
            return error(format!(
                "belongs to {}, but this instance was made for {}: instantiate another one",
                of(i),
                of(interface)
            ));
        }
        let legal: Vec<_> = states.iter().map(|s| s.name()).collect();
        error(format!(
            "not allowed while the instance is in state `{}`; allowed in: {}",
            state.name(),
            legal.join(", ")
        ))
    }
}
