//! The plainest runs as one program: FMUs in Co-Simulation that hold their inputs over regular steps, or follow them on
//! lines, and exchange doubles without loops. Whatever is out of the ordinary in such a step is left to [`Coupling`], from where it stopped.

use std::ops::Range;

use trueup_fmi_import::AnyInstance;
use trueup_fmi_import::program::{InputLines, Instances, Program, ProgramStop, StepOutcome};

use crate::couple::{Coupling, join};
use crate::error::CosimError;
use crate::grid::CommunicationGrid;
use crate::node::InstanceNode;
use crate::stepper::{Advance, StepLimit};

/// A step that stopped at its `at`-th unit.
pub(crate) struct SegmentMiddle {
    at: usize,
    part: usize,
    outcome: StepOutcome,
}

/// A system as a program.
pub(crate) struct StraightSegment {
    program: Program,
    /// Inputs on lines; `None`: held.
    lines: Option<InputLines>,
    /// Where the inputs on lines are among the exchange's reals, and of which node they are.
    slots: Vec<usize>,
    spans: Vec<(usize, Range<usize>)>,
}

struct Owners<'a>(&'a mut [InstanceNode]);

impl Instances for Owners<'_> {
    fn instance(&mut self, index: usize) -> Option<&mut AnyInstance> {
        self.0.get_mut(index).map(|node| &mut node.slave)
    }
}

/// x - x is 0 but for what is not finite; this way several are looked at with one instruction.
#[expect(clippy::eq_op, reason = "not equal for what is not finite")]
fn all_finite(values: &[f64]) -> bool {
    values.iter().fold(0, |bits, x| bits | (x - x).to_bits()) == 0
}

impl Coupling {
    /// The program of this system, if it is plain enough.
    pub(crate) fn straight(&mut self, within: StepLimit) -> Option<StraightSegment> {
        let (mut program, mut slots, mut spans) = (Program::default(), Vec::new(), Vec::new());
        if !self.is_plain() {
            return None;
        }
        for stepper in &self.steppers {
            let [n] = *stepper.nodes() else { return None };
            if !stepper.is_plain() || !program.step(n, &mut self.nodes[n].slave) {
                return None;
            }
            if within == StepLimit::Held || self.nodes[n].line.slots.is_empty() {
                continue;
            }
            let span = slots.len()..slots.len() + self.nodes[n].line.slots.len();
            let references = self.nodes[n].line.references.take();
            let follows = match (stepper.following(), &references) {
                (Some(how), Some(block)) => {
                    program.follow(n, &mut self.nodes[n].slave, block, how, span.clone())
                }
                _ => false,
            };
            self.nodes[n].line.references = references;
            if !follows {
                return None;
            }
            slots.extend_from_slice(&self.nodes[n].line.slots);
            spans.push((n, span));
        }
        let lines = (within == StepLimit::Line).then(|| InputLines::new(slots.len(), self.steppers.len()));
        // Slopes of inputs are drawn from their own values.
        let whole = self.exchange.program(&mut program, &mut Owners(&mut self.nodes), lines.is_some());
        whole.then_some(StraightSegment { program, lines, slots, spans })
    }

    /// Steps from point `first` until `until`, or until something is out of the ordinary: how many steps were made whole,
    /// and the step that was not. The steps between these points are regular ones.
    ///
    /// # Errors
    /// A call that failed; a value that is not finite.
    pub(crate) fn race(
        &mut self,
        straight: &mut StraightSegment,
        grid: &CommunicationGrid,
        first: u64,
        until: u64,
    ) -> Result<(u64, Option<SegmentMiddle>), CosimError> {
        let StraightSegment { program, lines, slots, spans } = straight;
        if let Some(lines) = lines.as_mut() {
            for (n, span) in spans.iter() {
                lines.value[span.clone()].copy_from_slice(&self.nodes[*n].line.value);
                lines.slope[span.clone()].copy_from_slice(&self.nodes[*n].line.slope);
            }
        }
        let Self { nodes, exchange, slopes, previous, smooth, .. } = self;
        let mut owners = Owners(nodes);
        let Some(mut bound) = program.bind(&mut owners) else { return Ok((0, None)) };
        let values = exchange.reals_mut();
        let (mut at, mut finite) = (first, true);
        let mut stopped = None;
        while at < until {
            stopped = match lines.as_mut() {
                None => bound.round(grid.time(at), grid.step, true, values).err(),
                Some(lines) => {
                    let span = [grid.time(at), grid.time(at + 1), grid.step];
                    bound.round_on_lines(span, true, values, lines).err()
                }
            };
            finite = all_finite(values);
            if stopped.is_some() || !finite {
                break;
            }
            at += 1;
            // As `draw_lines` does for all units at once.
            if let Some(lines) = lines.as_mut() {
                let last = grid.time(at) - grid.time(at - 1);
                let rate = if last > 0.0 { 1.0 / last } else { 0.0 };
                let all = slopes.iter_mut().zip(previous.iter_mut()).zip(values.iter()).zip(smooth.iter());
                for (((slope, previous), x), smooth) in all {
                    *slope = (x - *previous) * rate * smooth;
                    *previous = *x;
                }
                for ((slot, value), slope) in slots.iter().zip(&mut lines.value).zip(&mut lines.slope) {
                    (*value, *slope) = (values[*slot], slopes[*slot]);
                }
            }
        }
        if let Some(lines) = lines.as_ref() {
            for (n, span) in spans.iter() {
                let line = &mut self.nodes[*n].line;
                line.value.copy_from_slice(&lines.value[span.clone()]);
                line.slope.copy_from_slice(&lines.slope[span.clone()]);
                (line.from, line.dirty) = (grid.time(at), false);
            }
        }
        if at > first {
            self.stand_at(grid.time(at), grid.time(at) - grid.time(at - 1));
        }
        let in_parts = lines.as_mut().map(|lines| &mut lines.in_parts[..]);
        self.count(at - first, stopped.as_ref(), finite, in_parts);
        let time = grid.time(at + 1);
        match stopped {
            Some(ProgramStop::Step { at: unit, part, outcome }) => {
                Ok((at - first, Some(SegmentMiddle { at: unit, part, outcome })))
            }
            Some(ProgramStop::Ahead { at: unit, status }) => {
                let node = &mut self.nodes[program.stepped(unit)];
                match program.failure_ahead(&mut node.slave, unit, status) {
                    Some(source) => Err(CosimError::Call { time: grid.time(at), source }),
                    None => Ok((at - first, None)),
                }
            }
            // What was not finite may have made the call fail.
            _ if !finite => Err(self.exchange.first_not_finite(&self.nodes, time)),
            Some(ProgramStop::Call { at: call, status }) => {
                let node = &mut self.nodes[program.called(call)];
                match program.failure(&mut node.slave, call, status) {
                    Some(source) => Err(CosimError::Call { time, source }),
                    None => Ok((at - first, None)),
                }
            }
            None => Ok((at - first, None)),
        }
    }

    /// Counts the calls of `rounds` whole steps, and of the one that stopped. Apart from the loop, which has to stay small.
    #[inline(never)]
    fn count(
        &mut self,
        rounds: u64,
        stopped: Option<&ProgramStop>,
        finite: bool,
        mut in_parts: Option<&mut [u64]>,
    ) {
        for (u, stepper) in self.steppers.iter_mut().enumerate() {
            // Those before the step that stopped have made the last one too; where a call stopped, all have.
            let last = match stopped {
                Some(ProgramStop::Step { at, .. } | ProgramStop::Ahead { at, .. }) => u < *at,
                Some(ProgramStop::Call { .. }) => true,
                None => !finite,
            };
            let split = in_parts.as_mut().map_or(0, |all| std::mem::take(&mut all[u]));
            stepper.made(rounds + u64::from(last), split);
        }
    }

    /// Makes the rest of a step that stopped.
    ///
    /// # Errors
    /// As [`Coupling::step`].
    pub(crate) fn finish(
        &mut self,
        mid: SegmentMiddle,
        to: f64,
        within: StepLimit,
    ) -> Result<Advance, CosimError> {
        let mut all = Advance { time: to, ..Advance::default() };
        for (u, (stepper, turn)) in self.steppers.iter_mut().zip(&mut self.turns).enumerate() {
            let from = turn.time;
            let done = if u < mid.at {
                None
            } else if u == mid.at {
                let node = stepper.nodes()[0];
                let explained = Program::explain(&mut self.nodes[node].slave, mid.outcome);
                let first = explained.map_err(|source| CosimError::Call { time: from, source: *source })?;
                let first = first.map(|first| *first);
                Some(stepper.resume(&mut self.nodes, [from, to], within, mid.part, first)?)
            } else {
                stepper.pace(&mut self.nodes, from, to, within)?.map(|done| *done)
            };
            let end = done.map_or(to, |done| done.time);
            if let Some(done) = done {
                turn.terminated |= done.terminate;
                join(&mut all, done);
            }
            (turn.last, turn.time) = (end - from, end);
        }
        Ok(all)
    }
}
