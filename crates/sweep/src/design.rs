//! The numbered list of runs.

pub(crate) mod sobol;

use rand::RngCore;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::file::{FactorValues, Range, SweepFactor, SweepFile, SweepKind};
use crate::value::FactorValue;
pub use sobol::MOST as MOST_SOBOL;

/// The values of all factors in all runs, a pure function of the sweep's file.
#[derive(Clone, Debug)]
pub struct SweepDesign {
    kind: SweepKind,
    runs: u64,
    factors: Vec<SweepFactor>,
    /// Of a grid: runs after which a factor takes its next value.
    strides: Vec<u64>,
    /// Of a Latin hypercube: where each run is in its factor, 0 to 1.
    drawn: Vec<Vec<f64>>,
    /// Of a Sobol sequence: its shift, bit by bit.
    shifts: Vec<u32>,
}

/// Where a run is within a factor.
enum FactorSpot {
    /// At the k-th value.
    Level(u64),
    /// In [0, 1).
    Part(f64),
}

impl SweepDesign {
    /// Of this sweep.
    pub fn of(sweep: &SweepFile) -> Self {
        let SweepFile { kind, runs, factors, seed, .. } = sweep;
        let lengths = factors.iter().map(|f| match &f.values {
            FactorValues::Range(r) => r.points,
            FactorValues::List(list) => list.len() as u64,
        });
        let mut strides: Vec<u64> = Vec::with_capacity(factors.len());
        let mut stride = 1_u64;
        for length in lengths.rev() {
            strides.push(stride);
            stride = stride.saturating_mul(length);
        }
        strides.reverse();
        let stream = |factor: usize, seed: u64| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(factor as u64);
            random
        };
        let each = 0..factors.len();
        let drawn = match kind {
            SweepKind::LatinHypercube => {
                each.clone().map(|f| layers(*runs, stream(f, seed.unwrap_or(0)))).collect()
            }
            _ => Vec::new(),
        };
        let shifts = match (kind, seed) {
            (SweepKind::Sobol, Some(seed)) => each.map(|f| stream(f, *seed).next_u32()).collect(),
            _ => vec![0; factors.len()],
        };
        Self { kind: *kind, runs: *runs, factors: factors.clone(), strides, drawn, shifts }
    }

    /// How many runs there are.
    pub fn runs(&self) -> u64 {
        self.runs
    }

    /// The value of a factor (from 0) in a run (from 1).
    pub fn value(&self, factor: usize, run: u64) -> FactorValue {
        let at = run - 1;
        let spot = match self.kind {
            SweepKind::Grid => FactorSpot::Level(at / self.strides[factor]),
            SweepKind::List => FactorSpot::Level(at),
            SweepKind::LatinHypercube => FactorSpot::Part(self.drawn[factor][at as usize]),
            SweepKind::Sobol => FactorSpot::Part(sobol::part(factor, at as u32, self.shifts[factor])),
        };
        match (&self.factors[factor].values, spot) {
            (FactorValues::Range(range), FactorSpot::Level(level)) => {
                FactorValue::Number(range.level(level % range.points))
            }
            (FactorValues::Range(range), FactorSpot::Part(part)) => FactorValue::Number(range.part(part)),
            (FactorValues::List(list), FactorSpot::Level(level)) => {
                list[(level % list.len() as u64) as usize].clone()
            }
            (FactorValues::List(list), FactorSpot::Part(part)) => {
                list[(part * list.len() as f64) as usize].clone()
            }
        }
    }
}

/// One point in each of as many layers as runs, in an order that is drawn.
fn layers(runs: u64, mut random: ChaCha8Rng) -> Vec<f64> {
    let mut order: Vec<u64> = (0..runs).collect();
    // Fisher and Yates; written out so that a list of runs never depends on a library's version.
    for i in (1..order.len()).rev() {
        order.swap(i, (part(&mut random) * (i + 1) as f64) as usize);
    }
    let below_one = 1.0 - f64::EPSILON / 2.0;
    order.into_iter().map(|layer| ((layer as f64 + part(&mut random)) / runs as f64).min(below_one)).collect()
}

/// In [0, 1): the upper 53 bits.
fn part(random: &mut ChaCha8Rng) -> f64 {
    (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
}

impl Range {
    fn level(&self, level: u64) -> f64 {
        match level {
            0 => self.from,
            last if last + 1 == self.points => self.to,
            _ => self.part(level as f64 / (self.points - 1) as f64),
        }
    }

    fn part(&self, part: f64) -> f64 {
        let Self { from, to, .. } = *self;
        if self.log { from * (to / from).powf(part) } else { from + (to - from) * part }
    }
}
