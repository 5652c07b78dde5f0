//! What steps: one FMU in Co-Simulation, or a group in Model Exchange that is integrated as one.

mod event_mode;
mod group;
mod slave;

use trueup_fmi_import::CoSimulationStep;
use trueup_fmi_import::program::Following;

use crate::calls::CallCounts;
use crate::error::CosimError;
use crate::node::InstanceNode;
pub(crate) use event_mode::{EventStepper, has_event_mode};
pub(crate) use group::GroupStepper;
pub(crate) use slave::{SharedInstance, SlaveStepper, intermediate};

/// How inputs go within a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepLimit {
    /// Held as they were set last.
    Held,
    /// Continuous ones on [`InstanceNode::line`], which holds for the whole step; all others held.
    Line,
}

/// What a step did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Advance {
    /// Time reached in s: the end of the step, or less if `terminate` or `event`.
    pub time: f64,
    /// The FMU requests to end the run.
    pub terminate: bool,
    /// It stopped at an event before the end of the step, see [`SystemStepper::stop_at_events`].
    pub event: bool,
    /// Steps that an FMU refused at their full length on the way.
    pub discarded: u64,
    /// Events on the way.
    pub events: u64,
}

pub use crate::model_exchange::EventSettled;

/// Places for stored states: an algorithm may carry on more than one solution.
pub const SLOTS: usize = 4;

/// A part of the system that goes from one communication point to the next by itself.
///
/// The master owns all [`InstanceNode`]s and lends them to the steppers; each node belongs to one stepper ([`SystemStepper::nodes`]).
/// Over a communication step the master calls, in this order:
///
/// 1. [`save`](SystemStepper::save), if the algorithm may roll back;
/// 2. [`step`](SystemStepper::step). All inputs have been set to their values at `from` (not so if `nodes[i].line.dirty`). With [`StepLimit::Line`] the
///    continuous inputs that come from outside are in `nodes[i].line` of each of its nodes (`line.at(t)`,
///    [`InstanceNode::set_on_line`]); what is connected inside the stepper is on the line too and is overwritten by a stepper
///    that contains a better estimate;
/// 3. [`stay`](SystemStepper::stay) and the exchange: outputs of all nodes are read, inputs set, loops solved, as of `to`;
/// 4. [`settle`](SystemStepper::settle) and the exchange again, until nothing changes any more: events at `to`;
/// 5. [`restore`](SystemStepper::restore), if the step is to be repeated or was rejected; then from 2.
///
/// A step goes to `to` exactly: events on the way, and steps that an FMU discards, are the stepper's own affair. It ends earlier
/// only if an FMU requests to end the run. What cannot be recovered is an [`CosimError`] with FMU, call and time.
pub trait SystemStepper: Send {
    /// Indices of its nodes.
    fn nodes(&self) -> &[usize];

    /// Called once, when all FMUs have left initialization mode and before anything is read: event iteration, first
    /// states.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn begin(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        let _ = (nodes, time);
        Ok(())
    }

    /// Goes from `from` to `to` (s).
    ///
    /// # Errors
    /// An error of an FMU that shorter steps do not avoid.
    fn step(
        &mut self,
        nodes: &mut [InstanceNode],
        from: f64,
        to: f64,
        within: StepLimit,
    ) -> Result<Advance, CosimError>;

    /// As [`step`](SystemStepper::step); `None`: `to` was reached and nothing is to be reported.
    ///
    /// # Errors
    /// As [`step`](SystemStepper::step).
    fn pace(
        &mut self,
        nodes: &mut [InstanceNode],
        from: f64,
        to: f64,
        within: StepLimit,
    ) -> Result<Option<Box<Advance>>, Box<CosimError>> {
        match self.step(nodes, from, to, within) {
            Ok(done) => Ok(Some(Box::new(done))),
            Err(error) => Err(Box::new(error)),
        }
    }

    /// It is one FMU whose regular steps with inputs held are its doStep and nothing else.
    fn is_plain(&self) -> bool {
        false
    }

    /// How its FMU follows inputs on lines over a regular step, of one that [is plain](SystemStepper::is_plain); `None`: by other
    /// means than calls before and between its steps.
    fn following(&self) -> Option<Following> {
        None
    }

    /// Of one that [is plain](SystemStepper::is_plain): so many regular steps have been made for it, `in_parts` of them in the parts
    /// that [`following`](SystemStepper::following) returns.
    fn made(&mut self, steps: u64, in_parts: u64) {
        let _ = (steps, in_parts);
    }

    /// The calls of doStep so far, and how inputs on lines go within them; `None`: it makes none.
    fn calls(&self) -> Option<(&CallCounts, &'static str)> {
        None
    }

    /// Goes on to `to` from part `part` of a step from `from`, of one that [is plain](SystemStepper::is_plain): `first` is what the
    /// part came to if it did not go its whole way; `None`: it did.
    ///
    /// # Errors
    /// As [`step`](SystemStepper::step).
    fn resume(
        &mut self,
        nodes: &mut [InstanceNode],
        [from, to]: [f64; 2],
        within: StepLimit,
        part: usize,
        first: Option<CoSimulationStep>,
    ) -> Result<Advance, CosimError> {
        let _ = (part, first);
        self.step(nodes, from, to, within)
    }

    /// [`settle`](SystemStepper::settle) has something to do.
    fn has_events(&self) -> bool {
        false
    }

    /// From now on a step ends at an event, before it is handled; [`settle`](SystemStepper::settle) then does.
    fn stop_at_events(&mut self) {}

    /// A step may stop at an event whose time is not known beforehand.
    fn may_stop(&self, nodes: &[InstanceNode]) -> bool {
        let _ = nodes;
        false
    }

    /// The next event after `time` (s) that will come whatever the inputs do.
    fn next_event(&self, time: f64) -> Option<f64> {
        let _ = time;
        None
    }

    /// An event that came whatever the inputs did is in its last step, or at its end, where outputs may show what comes of it before it is handled, as
    /// those of a sampled controller do: by how much they changed is no slope.
    fn jumps(&self) -> bool {
        false
    }

    /// After a step: it is not taken back any more, and its outputs are about to be read and its inputs to be set, as of
    /// `time`. [`restore`](SystemStepper::restore) is for before.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn stay(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        let _ = (nodes, time);
        Ok(())
    }

    /// After an exchange at the end of a step: handles an event that waits there, and what discrete inputs that have
    /// changed make of it. Outputs may then have changed, and are to be exchanged again.
    ///
    /// # Errors
    /// Whatever an FMU returns; an event iteration without end.
    fn settle(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<EventSettled, CosimError> {
        let _ = (nodes, time);
        Ok(EventSettled::default())
    }

    /// What it chose and did, to be reported to the user.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// It can save and restore.
    fn can_restore(&self, nodes: &[InstanceNode]) -> bool;

    /// Stores everything that a step changes, in place of what was stored before in this place (below [`SLOTS`]).
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn save_in(&mut self, slot: usize, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError>;

    /// Goes back to what was stored in this place.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn restore_from(&mut self, slot: usize, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError>;

    /// [`Self::save_in`] the first place.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn save(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        self.save_in(0, nodes, time)
    }

    /// [`Self::restore_from`] the first place.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn restore(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        self.restore_from(0, nodes, time)
    }
}
