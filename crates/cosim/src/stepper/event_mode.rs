//! One FMU in Co-Simulation of FMI 3.0 whose events the master handles: event mode and early return.

use trueup_fmi_import::pace::Pace;
use trueup_fmi_import::{AnyInstance, interrupt};

use super::{Advance, EventSettled, SLOTS, SlaveStepper, StepLimit, SystemStepper};
use crate::buffer::{BlockAccess, VariableBlock};
use crate::calls::CallCounts;
use crate::error::CosimError;
use crate::grid;
use crate::node::InstanceNode;
use crate::plan::PlannedComponent;
use crate::system::ComponentInterface;

/// An event is located within this part of the step, and no closer than this part of the time.
const LOCATED: f64 = 1e-9;
const ROUNDING: f64 = 1e-12;
/// Place for the state at the beginning of a step, in addition to that of units that go back as a whole.
const START: usize = 1;
/// Events in a row at which time does not go on, after which they are assumed to be endless.
const CHATTER: u32 = 100;

/// A [`SlaveStepper`] to which events are reported.
pub(crate) struct EventStepper {
    pace: Pace,
    /// Length of the run in s.
    span: f64,
    notes: Vec<String>,
    inner: SlaveStepper,
    node: usize,
    /// Discrete inputs that are connected or driven: they may be set in event mode only.
    inputs: Vec<VariableBlock>,
    /// The FMU is in event mode.
    open: bool,
    /// An event waits there.
    pending: bool,
    /// Discrete states were updated there.
    updated: bool,
    /// An event whose time was known beforehand came up in the last step.
    jumps: bool,
    next_event: Option<f64>,
    ended: bool,
    stop: bool,
    chatter: (f64, u32),
    /// The step under way can be gone back to its beginning, to locate an event.
    locates: bool,
    /// As stored.
    saved: [(Option<f64>, (f64, u32), bool); SLOTS],
}

/// The FMU has event mode, and steps of any length, so that it may return early.
pub(crate) fn has_event_mode(planned: &PlannedComponent) -> bool {
    let co_simulation = planned.interface == ComponentInterface::CoSimulation;
    let offered = planned.description().co_simulation.as_ref().filter(|_| co_simulation);
    offered.is_some_and(|i| i.has_event_mode && i.can_handle_variable_communication_step_size)
}

impl EventStepper {
    /// In a run from `start` of `span` s.
    pub(crate) fn new(
        inner: SlaveStepper,
        node: usize,
        inputs: Vec<VariableBlock>,
        [start, span]: [f64; 2],
    ) -> Self {
        Self {
            pace: Pace::at(start),
            span,
            notes: Vec::new(),
            inner,
            node,
            inputs,
            open: true,
            pending: false,
            updated: false,
            jumps: false,
            next_event: None,
            ended: false,
            stop: false,
            chatter: (f64::NEG_INFINITY, 0),
            locates: false,
            saved: [(None, (f64::NEG_INFINITY, 0), false); SLOTS],
        }
    }

    fn slave<'a>(&self, nodes: &'a mut [InstanceNode]) -> &'a mut AnyInstance {
        &mut nodes[self.node].slave
    }

    fn open(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        if !self.open {
            self.slave(nodes).enter_event_mode().map_err(|source| CosimError::Call { time, source })?;
            (self.open, self.updated) = (true, false);
            self.changed(nodes, time)?;
        }
        Ok(())
    }

    /// To step mode; what has changed since it was opened is an event.
    fn close(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        if self.open {
            if self.changed(nodes, time)? || self.pending || !self.updated {
                self.iterate(nodes, time)?;
            }
            if !self.ended {
                self.slave(nodes).enter_step_mode().map_err(|source| CosimError::Call { time, source })?;
                self.open = false;
            }
        }
        Ok(())
    }

    /// A step of the FMU, from a place to which [`locate`](Self::locate) can go back.
    fn go(
        &mut self,
        nodes: &mut [InstanceNode],
        from: f64,
        to: f64,
        within: StepLimit,
    ) -> Result<Advance, CosimError> {
        self.locates =
            self.stop && self.inner.can_restore(nodes) && self.inner.holds(&nodes[self.node], within);
        if self.locates {
            self.inner.save_in(START, nodes, from)?;
        }
        self.inner.step(nodes, from, to, within)
    }

    /// After a step from `from` that stopped at `stopped` on the way to `to` with inputs held in parts, where they are not what they are on
    /// their lines: goes back, and to where there is an event with inputs on their lines. `None`: it is where it stopped.
    fn locate(
        &mut self,
        nodes: &mut [InstanceNode],
        [from, to]: [f64; 2],
        stopped: f64,
        within: StepLimit,
    ) -> Result<Option<Advance>, CosimError> {
        let least = (LOCATED * (to - from)).max(ROUNDING * from.abs().max(1.0));
        // One that its inputs do not move.
        let known = self.next_event.is_some_and(|next| (next - stopped).abs() <= least);
        if !self.locates || known {
            return Ok(None);
        }
        // No event up to `low`, one up to `high`.
        let (mut low, mut high) = (from, to);
        while high - low > least {
            let middle = 0.5 * (low + high);
            self.inner.restore_from(START, nodes, from)?;
            let done = self.inner.step(nodes, from, middle, within)?;
            if done.terminate {
                return Ok(Some(done));
            }
            let stopped = done.event || self.inner.is_event(&mut nodes[self.node], middle, least)?;
            *(if stopped { &mut high } else { &mut low }) = middle;
        }
        self.inner.restore_from(START, nodes, from)?;
        if low == from {
            // From here on inputs are held as they are: ahead on their lines they are an event before time goes on.
            nodes[self.node].set_on_line(from)?;
            return self
                .inner
                .step(nodes, from, high, StepLimit::Held)
                .map(|done| Some(Advance { event: true, ..done }));
        }
        let done = self.inner.step(nodes, from, high, within)?;
        if done.time >= low {
            return Ok(Some(Advance { event: true, ..done }));
        }
        // It stops only for inputs that are held elsewhere than on their lines: up to here there is no event.
        self.inner.restore_from(START, nodes, from)?;
        self.inner.step(nodes, from, low, within).map(|done| Some(Advance { event: true, ..done }))
    }

    fn iterate(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        if self.pending {
            if let Some(storm) = self.pace.event(time, self.span) {
                self.notes.push(format!("{storm}, of instance \"{}\"", nodes[self.node].slave.name()));
            }
            let (last, count) = self.chatter;
            self.chatter = (time, if time - last <= 1e-9 * time.abs().max(1.0) { count + 1 } else { 0 });
        }
        (self.pending, self.updated) = (false, true);
        let slave = self.slave(nodes);
        let info = slave.iterate_events().map_err(|source| CosimError::Call { time, source })?;
        (self.next_event, self.ended) = (info.next_event, info.terminate);
        if self.chatter.1 <= CHATTER {
            return Ok(());
        }
        let slave = &nodes[self.node].slave;
        let reason = format!("instance \"{}\": events do not end: {CHATTER} in a row at once", slave.name());
        Err(CosimError::Stuck { time, reason, log: slave.log() })
    }

    /// Reads the discrete inputs back: has one another value than last time?
    fn changed(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<bool, CosimError> {
        let mut changed = false;
        for block in &mut self.inputs {
            let slave = &mut nodes[self.node].slave;
            changed |= slave.get_changed(block).map_err(|source| CosimError::Call { time, source })?;
        }
        Ok(changed)
    }
}

impl SystemStepper for EventStepper {
    fn nodes(&self) -> &[usize] {
        self.inner.nodes()
    }

    fn begin(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        self.iterate(nodes, time)
    }

    fn stop_at_events(&mut self) {
        self.stop = true;
    }

    fn step(
        &mut self,
        nodes: &mut [InstanceNode],
        from: f64,
        to: f64,
        within: StepLimit,
    ) -> Result<Advance, CosimError> {
        let mut all = Advance { time: from, ..Advance::default() };
        self.jumps = false;
        loop {
            if interrupt::requested() {
                return Err(CosimError::Interrupted { time: all.time });
            }
            self.close(nodes, all.time)?;
            if self.ended {
                return Ok(Advance { terminate: true, ..all });
            }
            let rounding = grid::ROUNDING * (to - from);
            let next = self.next_event.filter(|next| *next > all.time && to - *next > rounding);
            let next = next.filter(|next| self.inner.allows(next - all.time));
            let mut done = self.go(nodes, all.time, next.unwrap_or(to), within)?;
            if let Some(event) =
                done.event.then(|| self.locate(nodes, [all.time, next.unwrap_or(to)], done.time, within))
            {
                done = event?.unwrap_or(done);
            }
            // Its clock and ours differ by rounding, which is no step of its own.
            all.time = if to - done.time <= rounding { to } else { done.time };
            all.discarded += done.discarded;
            if done.terminate {
                return Ok(Advance { terminate: true, ..all });
            }
            let due = self.next_event.is_some_and(|next| next <= all.time + rounding);
            self.jumps |= due;
            self.pending = done.event || due;
            if self.pending && !(self.stop || all.time >= to) {
                all.events += 1;
                self.open(nodes, all.time)?;
            } else if self.pending || all.time >= to {
                break;
            }
        }
        Ok(Advance { event: self.pending && all.time < to, ..all })
    }

    fn jumps(&self) -> bool {
        self.jumps
    }

    fn calls(&self) -> Option<(&CallCounts, &'static str)> {
        self.inner.calls()
    }

    fn may_stop(&self, nodes: &[InstanceNode]) -> bool {
        let d = nodes[self.node].description();
        // An FMU for Co-Simulation alone need not list indicators.
        self.stop && (d.model_exchange.is_none() || d.event_indicators() > 0)
    }

    fn next_event(&self, time: f64) -> Option<f64> {
        self.next_event.filter(|next| *next > time)
    }

    fn stay(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        let waits = self.pending || !self.inputs.is_empty();
        if waits && !self.ended { self.open(nodes, time) } else { Ok(()) }
    }

    fn has_events(&self) -> bool {
        true
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn settle(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<EventSettled, CosimError> {
        if !self.open || self.ended || !(self.changed(nodes, time)? || self.pending) {
            return Ok(EventSettled::default());
        }
        let events = u64::from(self.pending);
        self.iterate(nodes, time)?;
        Ok(EventSettled { changed: true, events, terminated: self.ended })
    }

    fn can_restore(&self, nodes: &[InstanceNode]) -> bool {
        self.inner.can_restore(nodes)
    }

    /// In step mode, in which it is restored too.
    fn save_in(&mut self, slot: usize, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        self.close(nodes, time)?;
        self.saved[slot] = (self.next_event, self.chatter, self.ended);
        self.inner.save_in(slot, nodes, time)
    }

    fn restore_from(&mut self, slot: usize, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        if self.open && !self.ended {
            self.slave(nodes).enter_step_mode().map_err(|source| CosimError::Call { time, source })?;
        }
        (self.next_event, self.chatter, self.ended) = self.saved[slot];
        (self.open, self.pending) = (false, false);
        self.inner.restore_from(slot, nodes, time)
    }
}
