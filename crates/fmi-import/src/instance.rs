//! An instance of an FMU of either version of the standard and of either interface: the calls that both have.

use std::sync::Arc;

use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::description::{Description, VariableType};

use crate::{
    CoSimulationStep, CompletedStep, EventInfo, ExperimentSetup, FmiStatus, ImportError, InstanceOptions,
    PreparedReferences, StateId, UnpackedFmu, UsedInterface, fmi2, fmi3,
};

/// An instance of either version. All methods return whatever the FMU returns.
pub enum AnyInstance {
    /// FMI 2.0.
    V2(Box<fmi2::Fmi2Instance>),
    /// FMI 3.0.
    V3(fmi3::Fmi3Instance),
}

/// Calls the method of either version.
macro_rules! either {
    ($instance:expr, $i:ident => $call:expr) => {
        either!($instance, $i => $call, $call)
    };
    ($instance:expr, $i:ident => $v2:expr, $v3:expr) => {
        match $instance {
            AnyInstance::V2($i) => $v2,
            AnyInstance::V3($i) => $v3,
        }
    };
}

/// Different warnings of one FMU that are reported.
const WARNINGS: usize = 3;
/// Messages of an FMU that an error quotes.
const MESSAGES: usize = 10;
/// Categories of messages on what went wrong (FMI 2.0, section 2.2.4; FMI 3.0, section 2.4.5).
const REASONS: [&str; 4] = ["logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"];

/// Numbers in a description whose arrays are sized as they are in an instance.
#[derive(Clone, Copy, Debug)]
pub struct DescribedCounts {
    /// Of continuous states; `None` where a dimension cannot be resolved.
    pub states: Option<usize>,
    /// Of event indicators.
    pub indicators: usize,
}

impl From<&Description> for DescribedCounts {
    fn from(d: &Description) -> Self {
        Self { states: d.states(), indicators: d.event_indicators() }
    }
}

/// Either interface.
#[allow(clippy::missing_errors_doc, reason = "one sentence at the type states it")]
impl AnyInstance {
    /// Instantiates for Co-Simulation; `how` is for FMI 3.0.
    pub fn co_simulation(
        fmu: &Arc<UnpackedFmu>,
        options: InstanceOptions,
        how: fmi3::CoSimulationOptions,
    ) -> Result<Self, ImportError> {
        Ok(match fmu.description().version {
            FmiVersion::V2 => {
                Self::V2(Box::new(fmi2::Fmi2Instance::new(fmu, UsedInterface::CoSimulation, options)?))
            }
            FmiVersion::V3 => Self::V3(fmi3::Fmi3Instance::co_simulation(fmu, options, how)?),
        })
    }
    /// Instantiates for Model Exchange.
    pub fn model_exchange(fmu: &Arc<UnpackedFmu>, options: InstanceOptions) -> Result<Self, ImportError> {
        Ok(match fmu.description().version {
            FmiVersion::V2 => {
                Self::V2(Box::new(fmi2::Fmi2Instance::new(fmu, UsedInterface::ModelExchange, options)?))
            }
            FmiVersion::V3 => Self::V3(fmi3::Fmi3Instance::model_exchange(fmu, options)?),
        })
    }
    /// The FMU.
    pub fn fmu(&self) -> &Arc<UnpackedFmu> {
        either!(self, i => i.fmu())
    }
    /// Name of the instance.
    pub fn name(&self) -> &str {
        either!(self, i => i.name())
    }
    /// The instance's last messages.
    pub fn log(&self) -> Vec<String> {
        let messages = either!(self, i => i.log());
        messages.iter().rev().take(MESSAGES).rev().map(ToString::to_string).collect()
    }
    /// What the FMU has warned of, each thing once, the first ones.
    pub fn warnings(&self) -> Vec<String> {
        let mut texts: Vec<String> = Vec::new();
        for message in either!(self, i => i.log()).into_iter().filter(|m| m.status == FmiStatus::Warning) {
            if texts.len() < WARNINGS && !texts.contains(&message.text) {
                texts.push(message.text);
            }
        }
        texts
    }
    /// Requests messages on what the FMU refuses, where it offers them by the names of the standard: without them an error has
    /// no reason. Other messages may be many.
    pub fn request_reasons(&mut self, offered: &[(String, String)]) {
        let names = offered.iter().map(|c| c.0.as_str()).filter(|name| REASONS.contains(name));
        let names: Vec<&str> = names.collect();
        if !names.is_empty() {
            // An FMU that does not give them runs as well.
            let _ = either!(self, i => i.set_debug_logging(true, &names));
        }
    }
    /// Enters configuration mode (FMI 3.0); FMI 2.0 has none.
    pub fn enter_configuration_mode(&mut self) -> Result<(), ImportError> {
        either!(self, _i => Ok(()), _i.enter_configuration_mode())
    }
    /// Leaves it.
    pub fn exit_configuration_mode(&mut self) -> Result<(), ImportError> {
        either!(self, _i => Ok(()), _i.exit_configuration_mode())
    }
    /// Enters initialization mode.
    pub fn enter_initialization_mode(&mut self, experiment: ExperimentSetup) -> Result<(), ImportError> {
        either!(self, i => i.enter_initialization_mode(experiment))
    }
    /// Leaves it.
    pub fn exit_initialization_mode(&mut self) -> Result<(), ImportError> {
        either!(self, i => i.exit_initialization_mode())
    }
    /// Ends the run.
    pub fn terminate(&mut self) -> Result<(), ImportError> {
        either!(self, i => i.terminate())
    }
    /// Back to where it was after instantiation.
    pub fn reset(&mut self) -> Result<(), ImportError> {
        either!(self, i => i.reset())
    }
    /// Reads `Float64` variables (`Real`), all elements of each.
    pub fn get_float64(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), ImportError> {
        either!(self, i => i.get_real(references, values), i.get_float64(references, values))
    }
    /// Sets them.
    pub fn set_float64(&mut self, references: &[u32], values: &[f64]) -> Result<(), ImportError> {
        either!(self, i => i.set_real(references, values), i.set_float64(references, values))
    }
    /// Sets a scalar parameter of another type to a number.
    pub fn set_number(&mut self, reference: u32, kind: VariableType, value: f64) -> Result<(), ImportError> {
        let r = [reference];
        match (self, kind) {
            (Self::V2(i), VariableType::Boolean) => i.set_boolean(&r, &[value != 0.0]),
            (Self::V2(i), _) => i.set_integer(&r, &[value as i32]),
            (Self::V3(i), VariableType::Boolean) => i.set_boolean(&r, &[value != 0.0]),
            (Self::V3(i), VariableType::Float32) => i.set_float32(&r, &[value as f32]),
            (Self::V3(i), VariableType::Int8) => i.set_int8(&r, &[value as i8]),
            (Self::V3(i), VariableType::UInt8) => i.set_uint8(&r, &[value as u8]),
            (Self::V3(i), VariableType::Int16) => i.set_int16(&r, &[value as i16]),
            (Self::V3(i), VariableType::UInt16) => i.set_uint16(&r, &[value as u16]),
            (Self::V3(i), VariableType::Int32) => i.set_int32(&r, &[value as i32]),
            (Self::V3(i), VariableType::UInt32) => i.set_uint32(&r, &[value as u32]),
            (Self::V3(i), VariableType::UInt64) => i.set_uint64(&r, &[value as u64]),
            (Self::V3(i), _) => i.set_int64(&r, &[value as i64]),
        }
    }
    /// A block of `Float64` (`Real`) to be read or written again and again: such a call costs the FMU's function and
    /// its checks.
    pub fn prepare(&mut self, references: &[u32]) -> Result<PreparedReferences, ImportError> {
        either!(self, i => i.prepare(references))
    }
    /// Reads a prepared block.
    #[inline]
    pub fn read(&mut self, block: &PreparedReferences, values: &mut [f64]) -> Result<(), Box<ImportError>> {
        either!(self, i => i.read(block, values))
    }
    /// Sets a prepared block.
    #[inline]
    pub fn write(&mut self, block: &PreparedReferences, values: &[f64]) -> Result<(), Box<ImportError>> {
        either!(self, i => i.write(block, values))
    }
    /// Stores the state, in place of `slot`'s if there is one.
    pub fn save(&mut self, slot: &mut Option<StateId>) -> Result<(), ImportError> {
        match slot {
            Some(id) => either!(self, i => i.save_over(id)),
            None => {
                *slot = Some(either!(self, i => i.save())?);
                Ok(())
            }
        }
    }
    /// Goes back to a stored state.
    pub fn restore(&mut self, id: &StateId) -> Result<(), ImportError> {
        either!(self, i => i.restore(id))
    }
    /// Partial derivatives of `of` with respect to `by` (value references), times `seed`.
    pub fn directional(
        &mut self,
        of: &[u32],
        by: &[u32],
        seed: &[f64],
        column: &mut [f64],
    ) -> Result<(), ImportError> {
        either!(self, i => i.directional_derivative(of, by, seed, column), {
            i.directional_derivative(fmi3::DerivativeOf { unknowns: of, knowns: by }, seed, column)
        })
    }
    /// Enters event mode.
    pub fn enter_event_mode(&mut self) -> Result<(), ImportError> {
        either!(self, i => i.enter_event_mode())
    }
    /// One event iteration.
    pub fn update_discrete_states(&mut self) -> Result<EventInfo, ImportError> {
        either!(self, i => i.new_discrete_states(), i.update_discrete_states())
    }
}

/// Co-Simulation.
#[allow(clippy::missing_errors_doc, reason = "one sentence at the type states it")]
impl AnyInstance {
    /// Steps from `time` by `step` s; `None`: the whole step was made and there is nothing to report. A Discard is no error.
    #[inline]
    pub fn step(
        &mut self,
        time: f64,
        step: f64,
        no_rollback: bool,
    ) -> Result<Option<Box<CoSimulationStep>>, Box<ImportError>> {
        either!(self, i => i.step(time, step, no_rollback))
    }
    /// Enters step mode (FMI 3.0); FMI 2.0 has no other.
    pub fn enter_step_mode(&mut self) -> Result<(), ImportError> {
        either!(self, _i => Ok(()), _i.enter_step_mode())
    }
    /// First derivatives of `Float64` inputs with respect to time, for the next step; FMI 3.0 has no such function.
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        ones: &[i32],
        slopes: &[f64],
    ) -> Result<(), ImportError> {
        either!(self, i => i.set_input_derivatives(references, ones, slopes), {
            Err(ImportError::NotSupported { function: "fmi2SetRealInputDerivatives", instance: i.name().into() })
        })
    }
}

/// Model Exchange.
#[allow(clippy::missing_errors_doc, reason = "one sentence at the type states it")]
impl AnyInstance {
    /// Numbers of states and event indicators. FMI 3.0 gives them by functions: a number of states other than the described one, with
    /// which some would never change, or fewer event indicators, whose events would be missed, is an error.
    pub fn counts(&mut self, described: DescribedCounts) -> Result<(usize, usize), ImportError> {
        either!(self, i => {
            let d = i.fmu().description();
            Ok((d.structure.derivatives.len(), d.event_indicators()))
        }, {
            let (states, indicators) = (i.number_of_states()?, i.number_of_event_indicators()?);
            if let Some(n) = described.states.filter(|n| *n != states) {
                let function = "fmi3GetNumberOfContinuousStates";
                return Err(i.miscounted(function, states, n, "ContinuousStateDerivative"));
            }
            if indicators < described.indicators {
                let function = "fmi3GetNumberOfEventIndicators";
                return Err(i.miscounted(function, indicators, described.indicators, "EventIndicator"));
            }
            Ok((states, indicators))
        })
    }
    /// Time in s.
    pub fn set_time(&mut self, time: f64) -> Result<(), ImportError> {
        either!(self, i => i.set_time(time))
    }
    /// Sets the states.
    pub fn set_states(&mut self, x: &[f64]) -> Result<(), ImportError> {
        either!(self, i => i.set_continuous_states(x))
    }
    /// Reads them.
    pub fn get_states(&mut self, x: &mut [f64]) -> Result<(), ImportError> {
        either!(self, i => i.get_continuous_states(x))
    }
    /// Rates of the states.
    pub fn derivatives(&mut self, dx: &mut [f64]) -> Result<(), ImportError> {
        either!(self, i => i.get_derivatives(dx))
    }
    /// Nominal values of the states.
    pub fn nominals(&mut self, nominal: &mut [f64]) -> Result<(), ImportError> {
        either!(self, i => i.get_nominals(nominal))
    }
    /// Event indicators.
    pub fn indicators(&mut self, z: &mut [f64]) -> Result<(), ImportError> {
        either!(self, i => i.get_event_indicators(z))
    }
    /// Enters continuous-time mode.
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), ImportError> {
        either!(self, i => i.enter_continuous_time_mode())
    }
    /// Reports an accepted step of the integrator, behind which no state will be restored.
    pub fn completed_integrator_step(&mut self) -> Result<CompletedStep, ImportError> {
        either!(self, i => i.completed_integrator_step(true))
    }
}

/// Value references of states and their derivatives, where directional derivatives can be had.
#[derive(Clone, Debug, Default)]
pub struct StateColumns {
    /// States.
    pub states: Vec<u32>,
    /// Their derivatives, in the same order.
    pub derivatives: Vec<u32>,
}

impl StateColumns {
    /// Of an FMU that offers directional derivatives and whose states are known scalars; none else.
    pub fn of(d: &Description) -> Option<Self> {
        d.model_exchange.as_ref().filter(|i| i.provides_directional_derivatives)?;
        let mut columns = Self::default();
        for unknown in &d.structure.derivatives {
            let rate = d.variables.get(d.resolve(unknown.reference)?)?;
            let state = d.variables.get(d.resolve(rate.derivative?)?)?;
            if !(rate.dimensions.is_empty() && state.dimensions.is_empty()) {
                return None;
            }
            columns.states.push(state.value_reference);
            columns.derivatives.push(rate.value_reference);
        }
        Some(columns)
    }
}

/// Value references of the event indicators, where all `count` of them are scalar variables (FMI 3.0); `None`: they are not.
pub(crate) fn indicator_references(d: &Description, count: usize) -> Option<Vec<u32>> {
    let variables =
        d.structure.event_indicators.iter().filter_map(|u| d.variables.get(d.resolve(u.reference)?));
    let scalars: Vec<u32> =
        variables.filter(|v| v.dimensions.is_empty()).map(|v| v.value_reference).collect();
    (scalars.len() == count).then_some(scalars)
}
