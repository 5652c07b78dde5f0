//! Events: all FMUs of a group iterate until none of them, and nothing that they exchange, changes any more.

use super::{Group, Surroundings};
use crate::error::Error;
use crate::node::Node;

/// Passes of one event iteration after which it is held to be without end.
const PASSES: u32 = 100;

impl Group {
    /// Handles an event at the group's time: [`Self::iterate`] from continuous-time mode.
    pub(super) fn event(
        &mut self,
        nodes: &mut [Node],
        around: &mut dyn Surroundings,
    ) -> Result<bool, Error> {
        for member in &self.members {
            nodes[member.node].enter_event_mode().map_err(self.call())?;
        }
        self.statistics.events += 1;
        self.iterate(nodes, around)
    }

    /// From event mode to continuous-time mode: updates the discrete states of every FMU, and hands values on, until
    /// all have settled. Returns whether an FMU ended the run.
    pub(super) fn iterate(
        &mut self,
        nodes: &mut [Node],
        around: &mut dyn Surroundings,
    ) -> Result<bool, Error> {
        let (call, mut terminate) = (self.call(), false);
        let [mut states, mut nominals] = [self.fresh; 2];
        around.exchange(nodes, self.time, true)?;
        for pass in 0.. {
            let mut again = None;
            for member in &mut self.members {
                let info = nodes[member.node].update_discrete_states().map_err(&call)?;
                member.next_event = info.next_event;
                states |= info.states_changed;
                nominals |= info.nominals_changed;
                terminate |= info.terminate;
                if info.again {
                    again = Some(member.node);
                }
            }
            let exchanged = around.exchange(nodes, self.time, true)?;
            if terminate || (again.is_none() && !exchanged) {
                break;
            }
            if pass >= PASSES {
                let reason = match again {
                    Some(slave) => format!(
                        "event iteration of instance \"{}\" does not end: it asked for another pass {PASSES} times",
                        nodes[slave].name()
                    ),
                    None => format!(
                        "event iteration does not end: values that FMUs exchange still changed after {PASSES} passes"
                    ),
                };
                let log = again.map(|slave| nodes[slave].log()).unwrap_or_default();
                return Err(Error::Stuck { time: self.time, reason, log });
            }
        }
        if terminate {
            return Ok(true);
        }
        for member in &self.members {
            let slave = &mut nodes[member.node];
            slave.enter_continuous_time_mode().map_err(&call)?;
            if states {
                slave.get_states(&mut self.x[member.states.clone()]).map_err(&call)?;
            }
            if nominals {
                let nominal = &mut self.stepper.nominal_mut()[member.states.clone()];
                slave.nominals(nominal).map_err(&call)?;
                // One that is not known counts as 1, as the standard says; 0 would ask for exact zeros.
                nominal.iter_mut().for_each(|x| *x = if x.is_finite() && *x != 0.0 { x.abs() } else { 1.0 });
            }
        }
        let bad = self.x.iter().position(|x| !x.is_finite());
        if let Some(at) = bad {
            return Err(self.not_finite(nodes, at, false, self.x[at]));
        }
        self.fresh = true;
        Ok(false)
    }

    /// The next time event of all FMUs in s.
    pub(super) fn next_event(&self) -> Option<f64> {
        self.members.iter().filter_map(|m| m.next_event).min_by(f64::total_cmp)
    }

    /// A state or its derivative that is not finite.
    pub(super) fn not_finite(&self, nodes: &[Node], at: usize, derivative: bool, value: f64) -> Error {
        let Some(member) = self.members.iter().find(|m| m.states.contains(&at)) else {
            let reason = format!("state {at} is {value}");
            return Error::Stuck { time: self.time, reason, log: Vec::new() };
        };
        let slave = &nodes[member.node];
        Error::NotFinite {
            time: self.time,
            instance: slave.name().to_owned(),
            variable: slave.state_name(at - member.states.start, derivative),
            value,
            log: slave.log(),
        }
    }
}
