//! The calls of Model Exchange, the same for either version of the standard.

use std::sync::Arc;

use crate::{Completed, Error, EventInfo, Experiment, Fmu, Interface, Options, fmi2, fmi3};
use trueup_fmi_description::Version;
use trueup_fmi_description::description::{Description, Type};

/// An instance for Model Exchange of either version. All methods return whatever the FMU returns.
pub enum ModelExchange {
    /// FMI 2.0.
    V2(Box<fmi2::Instance>),
    /// FMI 3.0.
    V3(Box<fmi3::Instance>),
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

/// Calls the method of either version.
macro_rules! either {
    ($slave:expr, $i:ident => $call:expr) => {
        either!($slave, $i => $call, $call)
    };
    ($slave:expr, $i:ident => $v2:expr, $v3:expr) => {
        match $slave {
            ModelExchange::V2($i) => $v2,
            ModelExchange::V3($i) => $v3,
        }
    };
}

#[allow(clippy::missing_errors_doc, reason = "one sentence at the type says it")]
impl ModelExchange {
    /// Instantiates.
    pub fn new(fmu: &Arc<Fmu>) -> Result<Self, Error> {
        let options = Options::default();
        Ok(match fmu.description().version {
            Version::V2 => Self::V2(Box::new(fmi2::Instance::new(fmu, Interface::ModelExchange, options)?)),
            Version::V3 => Self::V3(Box::new(fmi3::Instance::model_exchange(fmu, options)?)),
        })
    }
    /// Numbers of states and event indicators.
    pub fn counts(&mut self) -> Result<(usize, usize), Error> {
        either!(self, i => {
            let d = i.fmu().description();
            Ok((d.structure.derivatives.len(), d.event_indicators()))
        }, Ok((i.number_of_states()?, i.number_of_event_indicators()?)))
    }
    /// Sets `Float64` variables (`Real`), all elements of each.
    pub fn set(&mut self, references: &[u32], values: &[f64]) -> Result<(), Error> {
        either!(self, i => i.set_real(references, values), i.set_float64(references, values))
    }
    /// Reads them.
    pub fn get(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), Error> {
        either!(self, i => i.get_real(references, values), i.get_float64(references, values))
    }
    /// A parameter that is no real number.
    pub fn choose(&mut self, reference: u32, kind: Type, value: f64) -> Result<(), Error> {
        let r = [reference];
        match (self, kind) {
            (Self::V2(i), Type::Boolean) => i.set_boolean(&r, &[value != 0.0]),
            (Self::V2(i), _) => i.set_integer(&r, &[value as i32]),
            (Self::V3(i), Type::Boolean) => i.set_boolean(&r, &[value != 0.0]),
            (Self::V3(i), Type::Float32) => i.set_float32(&r, &[value as f32]),
            (Self::V3(i), Type::Int8) => i.set_int8(&r, &[value as i8]),
            (Self::V3(i), Type::UInt8) => i.set_uint8(&r, &[value as u8]),
            (Self::V3(i), Type::Int16) => i.set_int16(&r, &[value as i16]),
            (Self::V3(i), Type::UInt16) => i.set_uint16(&r, &[value as u16]),
            (Self::V3(i), Type::Int32) => i.set_int32(&r, &[value as i32]),
            (Self::V3(i), Type::UInt32) => i.set_uint32(&r, &[value as u32]),
            (Self::V3(i), Type::UInt64) => i.set_uint64(&r, &[value as u64]),
            (Self::V3(i), _) => i.set_int64(&r, &[value as i64]),
        }
    }
    /// Enters initialization mode.
    pub fn enter_initialization_mode(&mut self, experiment: Experiment) -> Result<(), Error> {
        either!(self, i => i.enter_initialization_mode(experiment))
    }
    /// Leaves it.
    pub fn exit_initialization_mode(&mut self) -> Result<(), Error> {
        either!(self, i => i.exit_initialization_mode())
    }
    /// Back to where it was after instantiation.
    pub fn reset(&mut self) -> Result<(), Error> {
        either!(self, i => i.reset())
    }
    /// Time in s.
    pub fn set_time(&mut self, time: f64) -> Result<(), Error> {
        either!(self, i => i.set_time(time))
    }
    /// Sets the states.
    pub fn set_states(&mut self, x: &[f64]) -> Result<(), Error> {
        either!(self, i => i.set_continuous_states(x))
    }
    /// Reads them.
    pub fn get_states(&mut self, x: &mut [f64]) -> Result<(), Error> {
        either!(self, i => i.get_continuous_states(x))
    }
    /// Rates of the states.
    pub fn derivatives(&mut self, dx: &mut [f64]) -> Result<(), Error> {
        either!(self, i => i.get_derivatives(dx))
    }
    /// Nominal values of the states.
    pub fn nominals(&mut self, nominal: &mut [f64]) -> Result<(), Error> {
        either!(self, i => i.get_nominals(nominal))
    }
    /// Event indicators.
    pub fn indicators(&mut self, z: &mut [f64]) -> Result<(), Error> {
        either!(self, i => i.get_event_indicators(z))
    }
    /// Enters event mode.
    pub fn enter_event_mode(&mut self) -> Result<(), Error> {
        either!(self, i => i.enter_event_mode())
    }
    /// One event iteration.
    pub fn update_discrete_states(&mut self) -> Result<EventInfo, Error> {
        either!(self, i => i.new_discrete_states(), i.update_discrete_states())
    }
    /// Enters continuous-time mode.
    pub fn enter_continuous_time_mode(&mut self) -> Result<(), Error> {
        either!(self, i => i.enter_continuous_time_mode())
    }
    /// Says that a step is accepted.
    pub fn completed_integrator_step(&mut self) -> Result<Completed, Error> {
        either!(self, i => i.completed_integrator_step(true))
    }
    /// (d of / d by) seed.
    pub fn directional(
        &mut self,
        of: &[u32],
        by: &[u32],
        seed: &[f64],
        column: &mut [f64],
    ) -> Result<(), Error> {
        either!(self, i => i.directional_derivative(of, by, seed, column), {
            i.directional_derivative(fmi3::DerivativeOf { unknowns: of, knowns: by }, seed, column)
        })
    }
}
