//! A step of all units that ends for all where an event stops one of them.

use super::{Coupling, join};
use crate::error::CosimError;
use crate::grid::ROUNDING;
use crate::stepper::{Advance, StepLimit};

/// How often a step may turn out to be shorter yet. What stops earlier each time is left where it is then.
const PASSES: u32 = 100;

/// How units come to their inputs over a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum EventTreatment {
    /// All with what was exchanged at its beginning.
    Together(StepLimit),
    /// Each with what those before it have reached.
    InOrder,
}

/// Who may stop on the way, and who then goes back.
pub(super) struct SharedEvents {
    /// All units as they step. Where that is free, those that may stop come first, so that no other has to go back if only one
    /// of them may.
    order: Vec<usize>,
    /// Per unit: it can go back, and another one behind it may stop.
    goes_back: Vec<bool>,
    /// Per unit: time at the beginning of the step in s, and whether it has gone on since.
    begun: Vec<(f64, bool)>,
    /// Per unit: what it did in the step.
    did: Vec<Advance>,
    /// Per unit that could not go back: how often it was behind an event of another, and by how much at most, in s.
    behind: Vec<(u64, f64)>,
}

impl SharedEvents {
    fn new(coupling: &Coupling, in_order: bool) -> Self {
        let may_stop = |u: usize| coupling.steppers[u].may_stop(&coupling.nodes);
        let can_restore = |u: usize| coupling.steppers[u].can_restore(&coupling.nodes);
        let mut order = coupling.order.clone();
        if !in_order {
            order.sort_by_key(|u| match (may_stop(*u), can_restore(*u)) {
                (true, false) => 0,
                (true, true) => 1,
                (false, _) => 2,
            });
        }
        let n = order.len();
        let mut goes_back = vec![false; n];
        for (at, u) in order.iter().enumerate() {
            goes_back[*u] = can_restore(*u) && order[at + 1..].iter().any(|v| may_stop(*v));
        }
        Self {
            order,
            goes_back,
            begun: vec![(0.0, false); n],
            did: vec![Advance::default(); n],
            behind: vec![(0, 0.0); n],
        }
    }

    /// All go to `to`, or to the first event on the way.
    fn step(&mut self, all: &mut Coupling, to: f64, how: EventTreatment) -> Result<Advance, CosimError> {
        for ((begun, did), turn) in self.begun.iter_mut().zip(&mut self.did).zip(&all.turns) {
            (*begun, *did) = ((turn.time, false), Advance::default());
        }
        // Events whose time is known beforehand need no unit to go back.
        let known = all.steppers.iter().zip(&all.turns).filter_map(|(s, turn)| {
            s.next_event(turn.time).filter(|next| to - next > ROUNDING * (to - turn.time))
        });
        let mut end = known.fold(to, f64::min);
        for _ in 0..PASSES {
            match self.pass(all, end, how)? {
                None => break,
                Some(earlier) => end = earlier,
            }
        }
        let mut total = Advance { time: end, event: end < to, ..Advance::default() };
        for u in 0..self.did.len() {
            let (turn, (begun, gone)) = (&mut all.turns[u], self.begun[u]);
            turn.last = turn.time - begun;
            turn.terminated |= self.did[u].terminate;
            if gone && turn.time > end {
                self.behind[u] = (self.behind[u].0 + 1, self.behind[u].1.max(turn.time - end));
            }
            join(&mut total, Advance { event: false, ..self.did[u] });
            all.steppers[u].stay(&mut all.nodes, turn.time)?;
        }
        Ok(total)
    }

    /// Brings all units to `end`; where one of them stopped before.
    fn pass(&mut self, all: &mut Coupling, end: f64, how: EventTreatment) -> Result<Option<f64>, CosimError> {
        for &u in &self.order {
            let (begun, gone) = self.begun[u];
            if gone && all.turns[u].time > end && self.goes_back[u] {
                all.steppers[u].restore(&mut all.nodes, begun)?;
                all.turns[u].time = begun;
            }
            if all.turns[u].time >= end {
                continue;
            }
            if !gone {
                if how == EventTreatment::InOrder {
                    all.take_inputs(u)?;
                }
                if self.goes_back[u] {
                    all.steppers[u].save(&mut all.nodes, begun)?;
                }
                self.begun[u].1 = true;
            }
            let from = all.turns[u].time;
            let within = if let EventTreatment::Together(within) = how { within } else { StepLimit::Line };
            if how == EventTreatment::InOrder {
                all.aim_lines(u, from, end);
            }
            let done = match all.steppers[u].pace(&mut all.nodes, from, end, within) {
                Ok(done) => done.map_or(Advance { time: end, ..Advance::default() }, |done| *done),
                Err(error) => return Err(*error),
            };
            (all.turns[u].time, self.did[u]) = (done.time, done);
            if how == EventTreatment::InOrder {
                all.hand_outputs(u, done.time)?;
            }
            if done.time < end {
                return Ok(Some(done.time));
            }
        }
        Ok(None)
    }
}

impl Coupling {
    /// From now on an event that stops one unit ends the step of all. All of them step to every communication point, at any
    /// length. `in_order`: by [`Coupling::step_in_order`] only, else by [`Coupling::step`] only.
    pub(crate) fn share_events(&mut self, in_order: bool) {
        self.shared = Some(SharedEvents::new(self, in_order));
    }

    /// A step to `to`, or to the first event on the way; `None`: events are not shared.
    #[inline]
    pub(super) fn step_to_event(
        &mut self,
        to: f64,
        how: EventTreatment,
    ) -> Result<Option<Advance>, CosimError> {
        let Some(mut shared) = self.shared.take() else { return Ok(None) };
        let done = shared.step(self, to, how);
        self.shared = Some(shared);
        done.map(Some)
    }

    /// What could not be shared.
    pub(super) fn unshared(&self) -> impl Iterator<Item = String> {
        let behind = self.shared.iter().flat_map(|s| s.behind.iter().enumerate());
        behind.filter(|(_, (times, _))| *times > 0).map(|(u, (times, by))| {
            let names: Vec<_> =
                self.steppers[u].nodes().iter().map(|n| self.nodes[*n].planned.name.as_str()).collect();
            format!(
                "{}: cannot go back (canGetAndSetFMUState is not true), so that it was up to {} s behind the event of another FMU, {times} times; \
                 a shorter step makes that less",
                names.join(", "),
                trueup_numerics::ShortNumber(*by)
            )
        })
    }
}
