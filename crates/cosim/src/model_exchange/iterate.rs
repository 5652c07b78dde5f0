//! Events: all FMUs of a group iterate until none of them, and nothing that they exchange, changes any more.

use super::{Group, Settled, Surroundings};
use crate::error::Error;
use crate::node::Node;

/// Passes of one event iteration after which it is held to be without end.
const PASSES: u32 = 100;

impl Group {
    /// At the end of an interval, once inputs have been set from outside: an event iteration if an event waits or an
    /// input has another value than before.
    ///
    /// # Errors
    /// Whatever an FMU returns; an event iteration without end.
    pub fn settle(&mut self, nodes: &mut [Node], around: &mut dyn Surroundings) -> Result<Settled, Error> {
        if !self.mode.open || !(self.changed(nodes)? || self.mode.pending) {
            return Ok(Settled::default());
        }
        let events = u64::from(self.mode.pending);
        let terminated = self.iterate(nodes, around)?;
        Ok(Settled { changed: true, events, terminated })
    }

    /// Enters event mode.
    pub(super) fn open(&mut self, nodes: &mut [Node]) -> Result<(), Error> {
        if !self.mode.open {
            for member in &self.members {
                nodes[member.node].slave.enter_event_mode().map_err(self.call())?;
            }
            (self.mode.open, self.mode.updated) = (true, false);
            self.changed(nodes)?;
        }
        Ok(())
    }

    /// Enters continuous-time mode; the standard wants one update of discrete states before. Returns whether an FMU
    /// ended the run.
    pub(super) fn close(&mut self, nodes: &mut [Node], around: &mut dyn Surroundings) -> Result<bool, Error> {
        if !self.mode.open {
            return Ok(false);
        }
        let cause = self.mode.pending || self.changed(nodes)?;
        if cause || !self.mode.updated {
            let fresh = self.mode.fresh || cause;
            if self.iterate(nodes, around)? {
                return Ok(true);
            }
            // Without an event there was nothing to update.
            self.mode.fresh = fresh || self.mode.states || self.mode.nominals;
        }
        let call = self.call();
        for member in &self.members {
            let slave = &mut nodes[member.node].slave;
            slave.enter_continuous_time_mode().map_err(&call)?;
            let states = member.states.clone();
            if self.mode.states && !states.is_empty() {
                slave.get_states(&mut self.x[states.clone()]).map_err(&call)?;
            }
            if self.mode.nominals && !states.is_empty() {
                let nominal = &mut self.stepper.nominal_mut()[states];
                slave.nominals(nominal).map_err(&call)?;
                // One that is not known counts as 1; 0 would ask for exact zeros.
                nominal.iter_mut().for_each(|x| *x = if x.is_finite() && *x != 0.0 { x.abs() } else { 1.0 });
            }
        }
        (self.mode.open, self.mode.states, self.mode.nominals) = (false, false, false);
        match self.x.iter().position(|x| !x.is_finite()) {
            Some(at) => Err(self.not_finite(nodes, at, false, self.x[at])),
            None => Ok(false),
        }
    }

    /// In event mode: updates the discrete states of every FMU, and hands values on, until all have settled. Returns
    /// whether an FMU ended the run.
    pub(super) fn iterate(
        &mut self,
        nodes: &mut [Node],
        around: &mut dyn Surroundings,
    ) -> Result<bool, Error> {
        let (call, mut terminate) = (self.call(), false);
        if self.mode.pending {
            self.statistics.events += 1;
            // Events that come ever faster must not slip through between the samples of a long step: the step follows
            // their distance, at a length that costs nothing otherwise.
            let since = self.time - self.memory.change_time;
            if since > 0.0 {
                self.memory.step = self.memory.step.min(1e4 * since);
                self.memory.change_time = self.time;
            }
        }
        (self.mode.pending, self.mode.updated, self.mode.fresh) = (false, true, true);
        around.exchange(nodes, self.time, true)?;
        self.changed(nodes)?;
        for pass in 0.. {
            let mut again = None;
            for member in &mut self.members {
                let info = nodes[member.node].slave.update_discrete_states().map_err(&call)?;
                member.next_event = info.next_event.filter(|t| t.is_finite());
                self.mode.states |= info.states_changed;
                self.mode.nominals |= info.nominals_changed;
                terminate |= info.terminate;
                if info.again {
                    again = Some(member.node);
                }
            }
            around.exchange(nodes, self.time, true)?;
            if terminate || !(self.changed(nodes)? || again.is_some()) {
                break;
            }
            if pass >= PASSES {
                let reason = match again {
                    Some(node) => format!(
                        "event iteration of instance \"{}\" does not end: it asked for another pass {PASSES} times",
                        nodes[node].slave.name()
                    ),
                    None => format!(
                        "event iteration does not end: values that FMUs exchange still changed after {PASSES} passes"
                    ),
                };
                let log = again.map(|node| nodes[node].slave.log()).unwrap_or_default();
                return Err(Error::Stuck { time: self.time, reason, log });
            }
        }
        Ok(terminate)
    }

    /// Reads the inputs back: has one another value than last time?
    fn changed(&mut self, nodes: &mut [Node]) -> Result<bool, Error> {
        let (call, mut changed) = (self.call(), false);
        for (node, block) in &mut self.settings.inputs {
            let before = block.values.clone();
            nodes[*node].slave.get(block).map_err(&call)?;
            changed |= before != block.values;
        }
        Ok(changed)
    }

    /// The next time event of all FMUs in s.
    pub fn next_event(&self) -> Option<f64> {
        self.members.iter().filter_map(|m| m.next_event).min_by(f64::total_cmp)
    }

    /// A state or its derivative that is not finite.
    pub(super) fn not_finite(&self, nodes: &[Node], at: usize, derivative: bool, value: f64) -> Error {
        let Some(member) = self.members.iter().find(|m| m.states.contains(&at)) else {
            let reason = format!("state {at} is {value}");
            return Error::Stuck { time: self.time, reason, log: Vec::new() };
        };
        let node = &nodes[member.node];
        Error::NotFinite {
            time: self.time,
            instance: node.slave.name().to_owned(),
            variable: node.state_name(at - member.states.start, derivative),
            value,
            log: node.slave.log(),
        }
    }
}
