//! When: stretches of time that hold more than their share.

use super::ResidualSeries;
use trueup_numerics::order::descending;

/// A stretch of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Interval {
    /// The recording's name.
    pub recording: String,
    /// Time of its first sample, s.
    pub start: f64,
    /// Time of the first sample after it (or of the last of all), s.
    pub end: f64,
    /// Share of the whole excess.
    pub share: f64,
    /// Excess per time over that of all recordings.
    pub lift: f64,
}

/// Prominent stretches: an excess per time of at least `LIFT` times the mean.
const LIFT: f64 = 1.5;
/// Of such stretches those with less of the whole than this are not reported.
const LEAST: f64 = 0.02;
/// Searched at once; longer series are searched in blocks, then at the edges sample by sample.
const SEARCHED: usize = 4000;

/// Stretches of time in which the residual has a mean or a power of its own, and more of it than the rest: most excess
/// first. There is no such stretch in an excess that is there all the time. `shortest` in s is the shortest stretch looked for.
pub fn intervals(residuals: &[ResidualSeries<'_>], shortest: f64) -> Vec<Interval> {
    let power = |w: &[f64]| w.iter().map(|w| w * w - 1.0).sum::<f64>();
    let whitened: Vec<Vec<f64>> = residuals.iter().map(ResidualSeries::whitened).collect();
    let samples: usize = whitened.iter().map(Vec::len).sum();
    let whole: f64 = whitened.iter().map(|w| power(w).max(0.0)).sum();
    if samples == 0 || whole <= 0.0 {
        return Vec::new();
    }
    let mean = whole / samples as f64;
    let mut found: Vec<Interval> = Vec::new();
    for (r, w) in residuals.iter().zip(&whitened) {
        let step = (r.time.last().unwrap_or(&0.0) - r.time.first().unwrap_or(&0.0)) / w.len().max(2) as f64;
        let least = ((shortest / step).round() as usize).max(3);
        let mut edges = vec![0];
        edges.extend(change_points(w, least));
        edges.push(w.len());
        let mut last_end = None;
        for pair in edges.windows(2) {
            let part = &w[pair[0]..pair[1]];
            let lift = power(part) / part.len().max(1) as f64 / mean;
            if lift < LIFT {
                continue;
            }
            let end = r.time.get(pair[1]).or(r.time.last()).copied().unwrap_or(0.0);
            let share = power(part) / whole;
            match found.last_mut() {
                Some(before) if last_end == Some(pair[0]) => {
                    let lengths = (before.end - before.start, end - before.end);
                    before.lift = (before.lift * lengths.0 + lift * lengths.1) / (lengths.0 + lengths.1);
                    (before.end, before.share) = (end, before.share + share);
                }
                _ => found.push(Interval {
                    recording: r.recording.into(),
                    start: r.time[pair[0]],
                    end,
                    share,
                    lift,
                }),
            }
            last_end = Some(pair[1]);
        }
    }
    // What is quieter than the floor elsewhere is no share of an excess.
    let sum: f64 = found.iter().map(|i| i.share).sum();
    found.iter_mut().filter(|_| sum > 1.0).for_each(|i| i.share /= sum);
    found.retain(|i| i.share >= LEAST);
    descending(&mut found, |item| item.share);
    found
}

/// Indices at which the mean or the variance of `x` changes, by optimal segmentation (PELT; R. Killick et al., JASA 107,
/// 2012) with the normal cost and a penalty of 3 ln n per change, raised by the correlation of the samples. No stretch is
/// shorter than `least` samples, except that long series lose those shorter than n / 2000.
pub fn change_points(x: &[f64], least: usize) -> Vec<usize> {
    let n = x.len();
    let least = least.max(2);
    if n < 2 * least || x.iter().any(|x| !x.is_finite()) {
        return Vec::new();
    }
    let sums = RunningSums::new(x);
    let block = n.div_ceil(SEARCHED);
    let penalty = 3.0 * (n as f64).ln() * correlation(x);
    let coarse = pelt(&sums, n, block, least.div_ceil(block), penalty);
    refine(&sums, &coarse, n, block, least)
}

/// How many samples say as much as one independent one, whatever few changes of level there are: medians of differences
/// over doubled lags grow until the samples forget each other; what they grow later on is not noise.
fn correlation(x: &[f64]) -> f64 {
    let structure = |k: usize| {
        let mut d: Vec<f64> = x.iter().zip(&x[k..]).map(|(a, b)| (a - b).abs()).collect();
        let middle = d.len() / 2;
        let (_, median, _) = d.select_nth_unstable_by(middle, f64::total_cmp);
        *median * *median
    };
    let mut seen = vec![(1, structure(1))];
    let mut lag = 1;
    while 2 * lag <= (x.len() / 10).max(1) {
        lag *= 2;
        let (d, before) = (structure(lag), seen[seen.len() - 1].1);
        if d <= 1.1 * before {
            break;
        }
        seen.push((lag, d));
    }
    let plateau = seen[seen.len() - 1].1;
    let mut tau = 1.0;
    for pair in seen.windows(2) {
        let forgotten = |d: f64| 1.0 - d / plateau;
        let mean = 0.5 * (forgotten(pair[0].1) + forgotten(pair[1].1));
        tau += 2.0 * (pair[1].0 - pair[0].0) as f64 * mean;
    }
    if plateau > 0.0 { tau + 2.0 * (1.0 - seen[0].1 / plateau) } else { 1.0 }
}

/// Running sums of x and x^2.
struct RunningSums {
    one: Vec<f64>,
    two: Vec<f64>,
    /// No stretch has less variance: else a short constant one would be free.
    least: f64,
}

impl RunningSums {
    fn new(x: &[f64]) -> Self {
        let run = |f: fn(f64) -> f64| {
            let sums = x.iter().scan(0.0, |s, x| {
                *s += f(*x);
                Some(*s)
            });
            std::iter::once(0.0).chain(sums).collect::<Vec<f64>>()
        };
        // Noise by neighbours; it is not required to be more than a hundredth of that.
        let mut steps: Vec<f64> = x.windows(2).map(|w| (w[1] - w[0]).powi(2)).collect();
        let middle = steps.len() / 2;
        let (_, median, _) = steps.select_nth_unstable_by(middle, f64::total_cmp);
        let all = x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64;
        Self { one: run(|x| x), two: run(|x| x * x), least: (0.01 * *median).max(1e-6 * all).max(1e-300) }
    }

    /// -2 log likelihood of a stretch with its own mean and variance.
    fn cost(&self, from: usize, to: usize) -> f64 {
        let n = (to - from) as f64;
        let (one, two) = (self.one[to] - self.one[from], self.two[to] - self.two[from]);
        let squares = (two - one * one / n).max(0.0);
        // A variance below the least is taken to be it.
        let variance = (squares / n).max(self.least);
        n * variance.ln() + squares / variance
    }
}

/// Optimal edges on the grid of blocks.
fn pelt(sums: &RunningSums, n: usize, block: usize, least: usize, penalty: f64) -> Vec<usize> {
    let blocks = n / block;
    let at = |k: usize| if k == blocks { n } else { k * block };
    let least = least.max(1);
    let mut best = vec![f64::INFINITY; blocks + 1];
    let mut from = vec![0; blocks + 1];
    best[0] = -penalty;
    let mut candidates: Vec<usize> = vec![0];
    for to in least..=blocks {
        if to >= 2 * least {
            candidates.push(to - least);
        }
        let mut cost = Vec::with_capacity(candidates.len());
        for &c in &candidates {
            let total = best[c] + sums.cost(at(c), at(to)) + penalty;
            cost.push(total);
            if total < best[to] {
                (best[to], from[to]) = (total, c);
            }
        }
        let keep = best[to];
        let mut k = 0;
        candidates.retain(|_| {
            k += 1;
            cost[k - 1] - penalty <= keep
        });
    }
    let mut edges = Vec::new();
    let mut to = blocks;
    while to > 0 {
        to = from[to];
        if to > 0 {
            edges.push(at(to));
        }
    }
    edges.reverse();
    edges
}

/// Each edge at the sample where it fits best between its neighbours.
fn refine(sums: &RunningSums, coarse: &[usize], n: usize, block: usize, least: usize) -> Vec<usize> {
    let mut edges = coarse.to_vec();
    for _ in 0..2 {
        for i in 0..edges.len() {
            let before = if i == 0 { 0 } else { edges[i - 1] };
            let after = edges.get(i + 1).copied().unwrap_or(n);
            let low = (edges[i].saturating_sub(2 * block + 2)).max(before + least.min(edges[i] - before));
            let high = (edges[i] + 2 * block + 2).min(after - least.min(after - edges[i]));
            let cost = |e: usize| sums.cost(before, e) + sums.cost(e, after);
            if let Some(e) = (low..=high).min_by(|a, b| cost(*a).total_cmp(&cost(*b))) {
                edges[i] = e;
            }
        }
    }
    edges
}
