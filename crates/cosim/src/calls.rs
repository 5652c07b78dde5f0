//! Calls of doStep, counted by their length.

use std::fmt;

use trueup_numerics::ShortNumber;

use crate::grid::ROUNDING;

/// Lengths that are counted one by one.
const LENGTHS: usize = 4;

/// What one FMU in Co-Simulation was given over a run.
#[derive(Clone, Debug, PartialEq)]
pub struct FmuCalls {
    /// Name of its component.
    pub component: String,
    /// Its calls of doStep.
    pub calls: CallCounts,
    /// How its inputs went within a step.
    pub inputs: &'static str,
}

/// Calls of doStep by length; those that were taken back are counted too.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CallCounts {
    /// Length in s and how many, in the order in which they came.
    lengths: Vec<(f64, u64)>,
    /// Of all other lengths: how many, the shortest and the longest in s.
    others: (u64, f64, f64),
}

impl CallCounts {
    /// Adds `count` calls of `length` s.
    #[inline]
    pub(crate) fn add(&mut self, length: f64, count: u64) {
        if count == 0 {
            return;
        }
        let same = |l: f64| (l - length).abs() <= ROUNDING * l;
        if let Some(known) = self.lengths.iter_mut().find(|(l, _)| same(*l)) {
            known.1 += count;
        } else if self.lengths.len() < LENGTHS {
            self.lengths.push((length, count));
        } else {
            let (n, least, most) = self.others;
            self.others = match n {
                0 => (count, length, length),
                _ => (n + count, least.min(length), most.max(length)),
            };
        }
    }

    /// All of them.
    pub fn total(&self) -> u64 {
        self.lengths.iter().map(|(_, n)| n).sum::<u64>() + self.others.0
    }

    /// Those of `length` s, to rounding; of the lengths that are counted one by one.
    pub fn of(&self, length: f64) -> u64 {
        self.lengths.iter().filter(|(l, _)| (l - length).abs() <= 1e-6 * l).map(|(_, n)| n).sum()
    }
}

impl fmt::Display for CallCounts {
    /// `50 calls of 0.1 s, 1 of 0.05 s`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(((length, count), more)) = self.lengths.split_first() else {
            return f.write_str("no calls");
        };
        let calls = if *count == 1 { "call" } else { "calls" };
        write!(f, "{count} {calls} of {} s", ShortNumber(*length))?;
        for (length, count) in more {
            write!(f, ", {count} of {} s", ShortNumber(*length))?;
        }
        match self.others {
            (0, ..) => Ok(()),
            (n, least, most) => write!(f, ", {n} of {} to {} s", ShortNumber(least), ShortNumber(most)),
        }
    }
}
