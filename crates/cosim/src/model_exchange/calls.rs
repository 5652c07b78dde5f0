//! The calls of Model Exchange, the same for either version of the standard.

use trueup_fmi_import::{Completed, Error, EventInfo};

use crate::node::{self, Node};
use crate::slave::Slave;

/// Calls the method of either version.
macro_rules! either {
    ($slave:expr, $instance:ident => $call:expr) => {
        either!($slave, $instance => $call, $call)
    };
    ($slave:expr, $instance:ident => $v2:expr, $v3:expr) => {
        match $slave {
            Slave::V2($instance) => $v2,
            Slave::V3($instance) => $v3,
        }
    };
}

/// Model Exchange. All return whatever the FMU returns.
impl Slave {
    /// Numbers of states and event indicators.
    pub(super) fn counts(&mut self) -> Result<(usize, usize), Error> {
        either!(self, i => {
            let d = i.fmu().description();
            Ok((d.structure.derivatives.len(), d.event_indicators()))
        }, Ok((i.number_of_states()?, i.number_of_event_indicators()?)))
    }

    pub(super) fn set_time(&mut self, time: f64) -> Result<(), Error> {
        either!(self, i => i.set_time(time))
    }

    pub(super) fn set_states(&mut self, x: &[f64]) -> Result<(), Error> {
        either!(self, i => i.set_continuous_states(x))
    }

    pub(super) fn get_states(&mut self, x: &mut [f64]) -> Result<(), Error> {
        either!(self, i => i.get_continuous_states(x))
    }

    pub(super) fn derivatives(&mut self, dx: &mut [f64]) -> Result<(), Error> {
        either!(self, i => i.get_derivatives(dx))
    }

    pub(super) fn nominals(&mut self, nominal: &mut [f64]) -> Result<(), Error> {
        either!(self, i => i.get_nominals(nominal))
    }

    pub(super) fn indicators(&mut self, z: &mut [f64]) -> Result<(), Error> {
        either!(self, i => i.get_event_indicators(z))
    }

    pub(crate) fn enter_event_mode(&mut self) -> Result<(), Error> {
        either!(self, i => i.enter_event_mode())
    }

    pub(crate) fn update_discrete_states(&mut self) -> Result<EventInfo, Error> {
        either!(self, i => i.new_discrete_states(), i.update_discrete_states())
    }

    /// Co-Simulation of FMI 3.0; FMI 2.0 has no other mode.
    pub(crate) fn enter_step_mode(&mut self) -> Result<(), Error> {
        match self {
            Self::V2(_) => Ok(()),
            Self::V3(i) => i.enter_step_mode(),
        }
    }

    pub(super) fn enter_continuous_time_mode(&mut self) -> Result<(), Error> {
        either!(self, i => i.enter_continuous_time_mode())
    }

    pub(super) fn completed_integrator_step(&mut self, no_rollback: bool) -> Result<Completed, Error> {
        either!(self, i => i.completed_integrator_step(no_rollback))
    }
}

/// What the description tells, with arrays as they are sized in the system.
impl Node {
    /// Value references of states and derivatives; `None` if the FMU gives no directional derivatives, or one of these
    /// is an array or not known.
    pub(super) fn columns(&self) -> Option<Columns> {
        let d = self.description();
        self.offered().filter(|i| i.provides_directional_derivatives)?;
        let mut columns = Columns::default();
        for unknown in &d.structure.derivatives {
            let derivative = d.variables.get(d.resolve(unknown.reference)?)?;
            let state = d.variables.get(d.resolve(derivative.derivative?)?)?;
            if !(derivative.dimensions.is_empty() && state.dimensions.is_empty()) {
                return None;
            }
            columns.states.push(state.value_reference);
            columns.derivatives.push(derivative.value_reference);
        }
        Some(columns)
    }

    /// Name of a state or its derivative, for messages.
    pub(super) fn state_name(&self, mut at: usize, derivative: bool) -> String {
        let d = self.description();
        let variables = d.structure.derivatives.iter().map(|u| d.resolve(u.reference));
        for rate in variables.map_while(|at| at) {
            let n = d.elements(&d.variables[rate]).unwrap_or(usize::MAX);
            if at >= n {
                at -= n;
                continue;
            }
            let state = d.variables[rate].derivative.and_then(|r| d.resolve(r));
            return match (derivative, state) {
                (false, Some(state)) => node::variable(d, state, at),
                (false, None) => format!("the state behind {}", node::variable(d, rate, at)),
                (true, _) => node::variable(d, rate, at),
            };
        }
        format!("{} {}", if derivative { "derivative" } else { "state" }, at + 1)
    }

    /// Name of an event indicator, for messages.
    pub(super) fn indicator_name(&self, mut at: usize) -> String {
        let d = self.description();
        let variables = d.structure.event_indicators.iter().map(|u| d.resolve(u.reference));
        for indicator in variables.map_while(|at| at) {
            let n = d.elements(&d.variables[indicator]).unwrap_or(usize::MAX);
            if at < n {
                return format!("event indicator {}", node::variable(d, indicator, at));
            }
            at -= n;
        }
        format!("event indicator {}", at + 1)
    }
}

/// Value references of the states and their derivatives.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    pub(super) states: Vec<u32>,
    pub(super) derivatives: Vec<u32>,
}
