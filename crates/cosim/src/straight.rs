//! The plainest runs as one program: FMUs in Co-Simulation that hold their inputs over regular steps and exchange doubles
//! without loops. Whatever is out of the ordinary in such a step is left to [`Coupling`], from where it stopped.

use trueup_fmi_import::program::{Either, Instances, Outcome, Program, Stopped};

use crate::couple::{Coupling, join};
use crate::error::Error;
use crate::grid::Grid;
use crate::node::Node;
use crate::slave::Slave;
use crate::stepper::{Advance, Within};

/// A step that stopped at its `at`-th unit.
pub(crate) struct Mid {
    at: usize,
    outcome: Outcome,
}

struct Owners<'a>(&'a mut [Node]);

impl Instances for Owners<'_> {
    fn instance(&mut self, index: usize) -> Option<Either<'_>> {
        self.0.get_mut(index).map(either)
    }
}

fn either(node: &mut Node) -> Either<'_> {
    match &mut node.slave {
        Slave::V2(it) => Either::V2(it),
        Slave::V3(it) => Either::V3(it),
    }
}

/// x - x is 0 but for what is not finite; this way several are looked at with one instruction.
#[expect(clippy::eq_op, reason = "not equal for what is not finite")]
fn all_finite(values: &[f64]) -> bool {
    values.iter().fold(0, |bits, x| bits | (x - x).to_bits()) == 0
}

impl Coupling {
    /// The program of this system, if it is plain enough.
    pub(crate) fn straight(&mut self) -> Option<Program> {
        let mut program = Program::default();
        if !self.is_plain() {
            return None;
        }
        for stepper in &self.steppers {
            let [node] = stepper.nodes() else { return None };
            if !stepper.is_plain() || !program.step(*node, either(&mut self.nodes[*node])) {
                return None;
            }
        }
        self.exchange.program(&mut program, &mut Owners(&mut self.nodes)).then_some(program)
    }

    /// Steps from point `first` until `until`, or until something is out of the ordinary: how many steps were made whole,
    /// and the step that was not. The steps between these points are regular ones.
    ///
    /// # Errors
    /// A call of the exchange that failed; a value that is not finite.
    pub(crate) fn race(
        &mut self,
        program: &Program,
        grid: &Grid,
        first: u64,
        until: u64,
    ) -> Result<(u64, Option<Mid>), Error> {
        let mut owners = Owners(&mut self.nodes);
        let Some(mut bound) = program.bind(&mut owners) else { return Ok((0, None)) };
        let values = self.exchange.reals_mut();
        let (mut at, mut finite) = (first, true);
        let mut stopped = None;
        while at < until {
            stopped = bound.round(grid.time(at), grid.step, true, values).err();
            finite = all_finite(values);
            if stopped.is_some() || !finite {
                break;
            }
            at += 1;
        }
        self.stand_at(grid.time(at), grid.step);
        let time = grid.time(at + 1);
        match stopped {
            Some(Stopped::Step { at: unit, outcome }) => Ok((at - first, Some(Mid { at: unit, outcome }))),
            // What was not finite may have made the call fail.
            _ if !finite => Err(self.exchange.first_not_finite(&self.nodes, time)),
            Some(Stopped::Call { at: call, status }) => {
                let node = &mut self.nodes[program.called(call)];
                match program.failure(either(node), call, status) {
                    Some(source) => Err(Error::Call { time, source }),
                    None => Ok((at - first, None)),
                }
            }
            None => Ok((at - first, None)),
        }
    }

    /// Makes the rest of a step that stopped.
    ///
    /// # Errors
    /// As [`Coupling::step`].
    pub(crate) fn finish(&mut self, mid: Mid, to: f64, step: f64) -> Result<Advance, Error> {
        let mut all = Advance { time: to, ..Advance::default() };
        for (u, (stepper, turn)) in self.steppers.iter_mut().zip(&mut self.turns).enumerate() {
            let from = turn.time;
            let done = if u < mid.at {
                None
            } else if u == mid.at {
                let node = stepper.nodes()[0];
                let explained = Program::explain(either(&mut self.nodes[node]), mid.outcome, from, step);
                match explained.map_err(|source| Error::Call { time: from, source: *source })? {
                    None => None,
                    Some(first) => Some(stepper.resume(&mut self.nodes, from, to, *first)?),
                }
            } else {
                stepper.pace(&mut self.nodes, from, to, Within::Held)?.map(|done| *done)
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
