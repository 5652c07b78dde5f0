//! Steps whose inputs go on lines: set again for each part of a step, or given as derivatives.

use std::ffi::c_int;
use std::ops::Range;

use trueup_fmi::abi::fmi2;

use super::{Bound, DoubleBlock, Program, ProgramCall, ProgramStop, do_step, good};
use crate::core::{PreparedReferences, lent};
use crate::exit;
use crate::instance::AnyInstance;

/// How an FMU follows its inputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Following {
    /// The step in as many parts, inputs held in each at these places of the whole step (0 to 1).
    Parts(&'static [f64]),
    /// `fmi2SetRealInputDerivatives` before the step.
    Derivatives,
}

/// Where inputs that do not move are held: the step is one part then.
const MIDDLE: &[f64] = &[0.5];

/// What is done about the inputs of a step; ranges among [`InputLines`].
#[derive(Clone, Copy)]
pub(super) enum RangeHandling {
    Held,
    Parts(&'static [f64], ProgramCall, (usize, usize)),
    Derivatives(fmi2::pointer::fmi2SetRealInputDerivatives, DoubleBlock, (usize, usize)),
}

/// All inputs on lines, in the order in which [`Program::follow`] took them: `value + slope (t - from)`.
#[derive(Clone, Debug, Default)]
pub struct InputLines {
    /// At the start of the step.
    pub value: Vec<f64>,
    /// In 1/s.
    pub slope: Vec<f64>,
    held: Vec<f64>,
    ones: Vec<c_int>,
    /// Per step how often it was made in more than one part, which are counted as one here.
    pub in_parts: Vec<u64>,
}

impl InputLines {
    /// For so many inputs, all 0, of so many steps.
    pub fn new(count: usize, steps: usize) -> Self {
        let zeros = || vec![0.0; count];
        Self { value: zeros(), slope: zeros(), held: zeros(), ones: vec![1; count], in_parts: vec![0; steps] }
    }
}

impl Program {
    /// The inputs of the step that was added last go on lines: `block` names them, `lines` is their place among [`InputLines`].
    /// `false`: there is no such function, or the block is not of this length.
    pub fn follow(
        &mut self,
        index: usize,
        instance: &mut AnyInstance,
        block: &PreparedReferences,
        how: Following,
        lines: Range<usize>,
    ) -> bool {
        let Some(at) = self.steps.len().checked_sub(1) else { return false };
        let Some((block, references)) = Self::block(instance, block, &lines) else { return false };
        let range = (lines.start, lines.end);
        let ahead = match (how, &*instance) {
            (Following::Parts(places), AnyInstance::V2(i)) => i
                .core
                .functions
                .fmi2SetReal
                .map(|f| RangeHandling::Parts(places, ProgramCall::Set2(f, block), range)),
            (Following::Parts(places), AnyInstance::V3(i)) => i
                .core
                .functions
                .fmi3SetFloat64
                .map(|f| RangeHandling::Parts(places, ProgramCall::Set3(f, block), range)),
            (Following::Derivatives, AnyInstance::V2(i)) => {
                let f = i.core.functions.fmi2SetRealInputDerivatives;
                f.map(|f| RangeHandling::Derivatives(f, block, range))
            }
            (Following::Derivatives, AnyInstance::V3(_)) => None,
        };
        let Some(ahead) = ahead else { return false };
        self.know(index, instance);
        self.references.push(references);
        self.ahead.resize(at, RangeHandling::Held);
        self.ahead.push(ahead);
        true
    }

    /// The function that sets the inputs of a step that is on lines.
    pub(super) fn setter(&self, at: usize) -> &'static str {
        match self.ahead.get(at) {
            Some(RangeHandling::Parts(_, ProgramCall::Set3(..), _)) => "fmi3SetFloat64",
            Some(RangeHandling::Derivatives(..)) => "fmi2SetRealInputDerivatives",
            _ => "fmi2SetReal",
        }
    }
}

impl<I: ?Sized> Bound<'_, I> {
    /// As [`Bound::round`], from `from` to `to` by steps of `step` s (the same but for rounding), inputs on `lines`.
    ///
    /// # Errors
    /// As [`Bound::round`].
    #[inline]
    pub fn round_on_lines(
        &mut self,
        [from, to, step]: [f64; 3],
        no_rollback: bool,
        values: &mut [f64],
        lines: &mut InputLines,
    ) -> Result<(), ProgramStop> {
        let program = self.program;
        for (at, stepping) in program.steps.iter().enumerate() {
            let mut whole = MIDDLE;
            match program.ahead.get(at).copied().unwrap_or(RangeHandling::Held) {
                RangeHandling::Held => {}
                RangeHandling::Derivatives(f, b, (first, end)) => {
                    exit::calls(b.id);
                    let slopes = &lines.slope[first..end];
                    let ones = &lines.ones[first..end];
                    // SAFETY: the signature is the standard's; the instance is live and exclusively ours, see `bind`; as many
                    // orders and slopes as references, see `follow`.
                    let status = unsafe {
                        b.lent(|r| lent(ones, |o| lent(slopes, |s| f(b.component, r, b.count, o, s).0)))
                    };
                    if !good(status) {
                        return Err(ProgramStop::Ahead { at, status });
                    }
                }
                RangeHandling::Parts(places, set, (first, end)) => {
                    let (value, slope) = (&lines.value[first..end], &lines.slope[first..end]);
                    if slope.iter().any(|s| *s != 0.0) {
                        whole = places;
                    }
                    let n = whole.len() as f64;
                    for (k, place) in whole.iter().enumerate() {
                        let t = from + place * (to - from) - from;
                        let held = &mut lines.held[first..end];
                        for ((held, value), slope) in held.iter_mut().zip(value).zip(slope) {
                            *held = value + slope * t;
                        }
                        let (ProgramCall::Set2(_, b) | ProgramCall::Set3(_, b)) = set else { break };
                        exit::calls(b.id);
                        // SAFETY: the instance is live and exclusively ours, see `bind`; as many values as the block has, see
                        // `follow`.
                        let status = unsafe { set.set(held.as_ptr()) };
                        if !good(status) {
                            return Err(ProgramStop::Ahead { at, status });
                        }
                        let begin = from + (to - from) * k as f64 / n;
                        if let Some(outcome) = do_step(*stepping, begin, step / n, no_rollback) {
                            return Err(ProgramStop::Step { at, part: k, outcome });
                        }
                    }
                    lines.in_parts[at] += u64::from(whole.len() > 1);
                    continue;
                }
            }
            if let Some(outcome) = do_step(*stepping, from, step, no_rollback) {
                return Err(ProgramStop::Step { at, part: 0, outcome });
            }
        }
        self.exchange(values)
    }
}
