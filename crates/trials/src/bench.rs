//! The sealed benchmark: cases whose hold-out readings and keys are withheld, submissions of one CSV, proper scores.
//!
//! `public/` is what an entrant gets: cases, `requested.csv` (when outputs are to be predicted), `seals.csv` (SHA-256 of every key) and
//! `bench.toml`. `sealed/` is a folder of trials with the keys and whole recordings; it is published when the entries are in.

pub(crate) mod card;
pub(crate) mod entry;
pub(crate) mod make;
pub(crate) mod scores;
pub(crate) mod submission;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::case::{TrialPlant, TrialSplit};
use crate::error::TrialError;
use crate::files;

/// Version of the benchmark's formats.
pub const BENCH_FORMAT: &str = "trueup.bench/1";

/// A group of cases of one kind of machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BenchTier {
    /// Single joints, `TwoMassJoint`.
    Joint,
    /// Planar arms on a free or held base, `PlanarManipulator`.
    Arm,
}

impl BenchTier {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Joint, Self::Arm];
    /// By its name on the command line.
    pub fn parse(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Joint => "joint",
            Self::Arm => "arm",
        }
    }
    pub(crate) fn plant(self) -> TrialPlant {
        match self {
            Self::Joint => TrialPlant::Joint,
            Self::Arm => TrialPlant::Manipulator,
        }
    }
    /// Columns of a recording that drive it; all others but `time` are readings.
    pub(crate) fn is_input(self, column: &str) -> bool {
        match self {
            Self::Joint => column == "motorCurrent" || column == "externalTorque",
            Self::Arm => column.starts_with("jointTorque["),
        }
    }
}

/// Cases of a split in a hundred.
const MIX: [(TrialSplit, usize); 6] = [
    (TrialSplit::None, 25),
    (TrialSplit::Parameters, 10),
    (TrialSplit::Single, 35),
    (TrialSplit::Pairs, 10),
    (TrialSplit::Outside, 10),
    (TrialSplit::Unidentifiable, 10),
];

/// How many cases of each split make `count`: by largest remainder, earlier splits first.
pub(crate) fn mix(count: usize) -> Vec<(TrialSplit, usize)> {
    let mut parts: Vec<_> = MIX.iter().map(|(split, share)| (*split, count * share / 100)).collect();
    let mut rest: Vec<usize> = (0..MIX.len()).collect();
    rest.sort_by_key(|k| std::cmp::Reverse(count * MIX[*k].1 % 100));
    let missing = count - parts.iter().map(|p| p.1).sum::<usize>();
    rest.iter().take(missing).for_each(|k| parts[*k].1 += 1);
    parts
}

/// `public/bench.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BenchNotice {
    /// [`BENCH_FORMAT`].
    pub format: String,
    /// The tiers.
    pub tiers: Vec<BenchTier>,
    /// Cases of each tier.
    pub cases: usize,
    /// What made the cases.
    pub generator: String,
    /// SHA-256 of `seals.csv`: it commits to every key, and is published before any entry.
    pub seals: String,
}

impl BenchNotice {
    /// Reads that of a public folder, and checks it against the seals next to it.
    ///
    /// # Errors
    /// There is none, it has another format, or the seals are not those that it commits to.
    pub fn read(public: &Path) -> Result<Self, TrialError> {
        let path = public.join("bench.toml");
        if !path.is_file() {
            let why = "no `bench.toml` in it: name the folder `public` of a benchmark that `trueup bench make` made";
            return Err(TrialError::at(public, why));
        }
        let notice: Self = toml::from_str(&files::text(&path)?).map_err(|e| TrialError::at(&path, e))?;
        if notice.format != BENCH_FORMAT {
            let why = format!("its format is `{}`, this program reads `{BENCH_FORMAT}`", notice.format);
            return Err(TrialError::at(&path, why));
        }
        let seals = public.join("seals.csv");
        if files::hash(files::text(&seals)?.as_bytes()) != notice.seals {
            return Err(TrialError::at(
                &seals,
                "not the seals that bench.toml commits to; get the benchmark again",
            ));
        }
        Ok(notice)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_count_is_spread_over_the_splits() {
        for count in 0..=250 {
            let parts = mix(count);
            assert_eq!(parts.iter().map(|p| p.1).sum::<usize>(), count);
            for ((_, n), (_, share)) in parts.iter().zip(MIX) {
                assert!((*n as f64 - count as f64 * share as f64 / 100.0).abs() < 1.0, "{count}");
            }
        }
    }
}
