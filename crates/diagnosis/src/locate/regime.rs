//! In which operating regimes: a shallow regression tree of the residual's power.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::floor::correlation;
use trueup_numerics::order::descending;

/// What may make the residual large, sample by sample (speed, |speed|, angle, acceleration, torque, time since reversal).
#[derive(Clone, Copy, Debug)]
pub struct Feature<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its values.
    pub value: &'a [f64],
}

/// A regime: samples within bounds of one or more features.
#[derive(Clone, Debug, PartialEq)]
pub struct Regime {
    /// Feature, lower and upper bound (`None`: open), the most telling first.
    pub bounds: Vec<(String, Option<f64>, Option<f64>)>,
    /// Share of the whole excess.
    pub share: f64,
    /// Excess per sample over the mean of all.
    pub lift: f64,
    /// Chance of a regime that explains as much if power and features had nothing to do with each other.
    pub p_value: f64,
}

impl Regime {
    /// The most telling bound alone, |x| <= h as -h <= x <= h: variable, lower and upper bound.
    pub fn main(&self) -> Option<(String, Option<f64>, Option<f64>)> {
        let (name, low, high) = self.bounds.first()?;
        let inner = name.strip_prefix('|').and_then(|n| n.strip_suffix('|'));
        Some(match (inner, low, high) {
            (Some(inner), None, Some(h)) => (inner.to_owned(), Some(-h), Some(*h)),
            _ => (name.clone(), *low, *high),
        })
    }
}

/// Depth of the tree.
const DEPTH: usize = 3;
/// Values of a feature are sorted into so many bins of equally many samples.
const BINS: usize = 40;
/// Leaves hold at least this part of the samples.
const LEAST: f64 = 0.02;
/// Regimes have at least this lift.
const LIFT: f64 = 2.0;
/// A split takes at least this part of the power's scatter.
const GAIN: f64 = 0.01;
const DRAWS: usize = 99;

/// Regimes of large residuals: leaves with a lift of at least 2 whose like chance would give in at most one of 20 cases,
/// most excess first. `whitened` is the residual over its floor.
///
/// Chance is what comes of the power in shuffled blocks, five times as long as it is correlated.
pub fn regimes(features: &[Feature<'_>], whitened: &[f64], seed: u64) -> Vec<Regime> {
    let n = features.iter().map(|f| f.value.len()).chain([whitened.len()]).min().unwrap_or(0);
    if n < 100 || features.is_empty() {
        return Vec::new();
    }
    // A few giants must not make the tree.
    let mut power: Vec<f64> = whitened[..n].iter().map(|w| w * w - 1.0).collect();
    let mut sorted = power.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let most = sorted[(n - 1) * 98 / 100];
    power.iter_mut().for_each(|p| *p = p.min(most));
    let mean = power.iter().sum::<f64>() / n as f64;
    if mean <= 0.0 {
        return Vec::new();
    }
    let binned: Vec<Binned> = features.iter().map(|f| Binned::new(&f.value[..n])).collect();
    let all: Vec<u32> = (0..n as u32).collect();
    let mut leaves = Vec::new();
    grow(&binned, &power, &all, DEPTH, n, scatter(&power), &mut Vec::new(), &mut leaves);
    let lift = |leaf: &Leaf| leaf.mean / mean;
    // What a leaf takes of the scatter; a lift alone is easily had by few samples.
    let explained = |leaf: &Leaf| leaf.samples as f64 * (leaf.mean - mean).max(0.0).powi(2);
    let whole: f64 = leaves.iter().map(|leaf| leaf.mean.max(0.0) * leaf.samples as f64).sum();
    leaves.retain(|leaf| lift(leaf) >= LIFT);
    if leaves.is_empty() {
        return Vec::new();
    }
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let block = ((5.0 * correlation(&power)) as usize).clamp(4, n / 20);
    let chance: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let shuffled = shuffle(&power, block, &mut rng);
            let mut found = Vec::new();
            grow(&binned, &shuffled, &all, DEPTH, n, scatter(&shuffled), &mut Vec::new(), &mut found);
            found.iter().map(explained).fold(0.0, f64::max)
        })
        .collect();
    let mut regimes: Vec<Regime> = leaves
        .iter()
        .map(|leaf| Regime {
            bounds: bounds(&leaf.path, features, &binned),
            share: leaf.mean * leaf.samples as f64 / whole,
            lift: lift(leaf),
            p_value: (1 + chance.iter().filter(|c| **c >= explained(leaf)).count()) as f64
                / (DRAWS + 1) as f64,
        })
        .filter(|r| r.p_value <= 0.05)
        .collect();
    descending(&mut regimes, |item| item.share);
    regimes
}

/// Blocks of a series in another order.
fn shuffle(x: &[f64], block: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut blocks: Vec<&[f64]> = x.chunks(block).collect();
    for i in (1..blocks.len()).rev() {
        blocks.swap(i, rng.random_range(0..=i));
    }
    blocks.concat()
}

/// A feature in bins of equally many samples.
struct Binned {
    bin: Vec<u8>,
    /// Upper bound of each bin but the last.
    edge: Vec<f64>,
}

impl Binned {
    fn new(value: &[f64]) -> Self {
        let mut sorted: Vec<f64> = value.iter().copied().filter(|v| v.is_finite()).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let mut edge: Vec<f64> = match sorted.len() {
            0 => Vec::new(),
            n => (1..BINS).map(|k| sorted[k * n / BINS]).collect(),
        };
        edge.dedup();
        let bin = value.iter().map(|v| edge.partition_point(|e| e <= v) as u8).collect();
        Self { bin, edge }
    }
}

struct RegimeSplit {
    feature: usize,
    /// The upper side begins with this bin.
    bin: u8,
    gain: f64,
}

struct Leaf {
    path: Vec<(usize, u8, bool, f64)>,
    samples: usize,
    mean: f64,
}

fn scatter(power: &[f64]) -> f64 {
    let mean = power.iter().sum::<f64>() / power.len() as f64;
    power.iter().map(|p| (p - mean).powi(2)).sum()
}

/// Splits where the means differ most, down to `depth`.
fn grow(
    features: &[Binned],
    power: &[f64],
    rows: &[u32],
    depth: usize,
    n: usize,
    scatter: f64,
    path: &mut Vec<(usize, u8, bool, f64)>,
    leaves: &mut Vec<Leaf>,
) {
    let sum: f64 = rows.iter().map(|i| power[*i as usize]).sum();
    let best = (depth > 0).then(|| split(features, power, rows, sum, n)).flatten();
    let Some(best) = best.filter(|s| s.gain > GAIN * scatter) else {
        let samples = rows.len();
        leaves.push(Leaf { path: path.clone(), samples, mean: sum / samples.max(1) as f64 });
        return;
    };
    let is_upper = |i: &u32| features[best.feature].bin[*i as usize] >= best.bin;
    let (upper, lower): (Vec<u32>, Vec<u32>) = rows.iter().partition(|i| is_upper(i));
    for (rows, is_upper) in [(upper, true), (lower, false)] {
        path.push((best.feature, best.bin, is_upper, best.gain));
        grow(features, power, &rows, depth - 1, n, scatter, path, leaves);
        path.pop();
    }
}

fn split(features: &[Binned], power: &[f64], rows: &[u32], sum: f64, n: usize) -> Option<RegimeSplit> {
    let least = ((n as f64 * LEAST).ceil() as usize).max(10);
    let mut best: Option<RegimeSplit> = None;
    for (feature, f) in features.iter().enumerate() {
        let mut bins = [(0.0, 0_usize); BINS];
        for i in rows {
            let bin = &mut bins[f.bin[*i as usize] as usize];
            bin.0 += power[*i as usize];
            bin.1 += 1;
        }
        let (mut below, mut count) = (0.0, 0);
        for bin in 1..BINS {
            below += bins[bin - 1].0;
            count += bins[bin - 1].1;
            let rest = rows.len() - count;
            if count < least || rest < least {
                continue;
            }
            let (low, high) = (below / count as f64, (sum - below) / rest as f64);
            let gain = (low - high).powi(2) * count as f64 * rest as f64 / rows.len() as f64;
            if best.as_ref().is_none_or(|b| gain > b.gain) {
                best = Some(RegimeSplit { feature, bin: bin as u8, gain });
            }
        }
    }
    best
}

/// A path as bounds, one entry per feature.
fn bounds(
    path: &[(usize, u8, bool, f64)],
    features: &[Feature<'_>],
    binned: &[Binned],
) -> Vec<(String, Option<f64>, Option<f64>)> {
    let mut by: Vec<(usize, f64, Option<f64>, Option<f64>)> = Vec::new();
    for (feature, bin, upper, gain) in path {
        let edge = binned[*feature].edge.get(usize::from(*bin) - 1).copied();
        let k = by.iter().position(|b| b.0 == *feature).unwrap_or_else(|| {
            by.push((*feature, 0.0, None, None));
            by.len() - 1
        });
        let entry = &mut by[k];
        entry.1 += gain;
        if *upper {
            entry.2 = edge;
        } else {
            entry.3 = edge;
        }
    }
    descending(&mut by, |item| item.1);
    by.into_iter().map(|(f, _, low, high)| (features[f].name.to_owned(), low, high)).collect()
}
