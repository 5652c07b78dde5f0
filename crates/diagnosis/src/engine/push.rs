//! When a push may have come: where what is missing has a mean of its own for longest and most.

use std::borrow::Borrow;

use trueup_identification::parallel;
use trueup_models::effect::{PUSHES, PlantKind};

use super::hypothesis::{Hypothesis, HypothesisClaim, Times};
use super::problem::BalanceUnknown;
use super::search::{CaseSearch, FittedSet};

/// What is missing counts up to so many times its scatter.
const FAR: f64 = 8.0;
/// Share of a stretch that its edges are thought to take.
const EDGE: f64 = 0.3;

/// A stretch of time in s, and the significance of its mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stretch {
    start: f64,
    length: f64,
    score: f64,
}

impl Stretch {
    pub(super) fn is_apart(&self, other: &Self) -> bool {
        self.start >= other.start + other.length || other.start >= self.start + self.length
    }
}

/// Missing acceleration over time, in units of its own scatter.
struct Missing {
    t: Vec<f64>,
    a: Vec<f64>,
}

impl CaseSearch<'_> {
    /// Values of the unknowns of a push to look from, for the best stretches.
    pub(crate) fn push_looks(
        &self,
        base: &FittedSet,
        h: &Hypothesis,
        unknowns: &[BalanceUnknown],
    ) -> Vec<Vec<f64>> {
        let coordinates = self.pushed(h);
        let runs: Vec<Vec<Missing>> = (0..self.case.train.len())
            .map(|run| coordinates.iter().filter_map(|c| self.missing(base, run, *c)).collect())
            .collect();
        if runs.iter().all(Vec::is_empty) {
            return self.tried_pushes(base, h, unknowns);
        }
        let all: Vec<&Missing> = runs.iter().flatten().collect();
        let each: Vec<Option<Stretch>> = runs.iter().map(|missing| best(&scan(missing))).collect();
        match h.times {
            Times::EachRun => {
                let own = |u: &BalanceUnknown| each.get(u.run?).copied().flatten();
                vec![unknowns.iter().map(|u| value(u, own(u))).collect()]
            }
            // Seen in all together, or in the recording that shows them best.
            Times::Several => {
                let score = |run: usize| each[run].map_or(0.0, |s| s.score);
                let clearest = (0..runs.len()).max_by(|a, b| score(*a).total_cmp(&score(*b)));
                let alone = clearest.map(|run| runs[run].iter().collect());
                alone.iter().chain([&all]).map(|all| filled(h, unknowns, &one_by_one(all))).collect()
            }
            // Seen in all together, the best and the next, or best in one.
            Times::Once => {
                let mut stretches = scan(&all);
                let first = best(&stretches);
                stretches.retain(|s| first.is_some_and(|first| s.is_apart(&first)));
                let stretches = [first, best(&stretches)].into_iter().chain(each).flatten();
                stretches.map(|s| filled(h, unknowns, &[s])).collect()
            }
        }
    }

    /// Where no channel prescribes what is pushed, its answer comes late and lasts: every time and length is tried.
    fn tried_pushes(&self, base: &FittedSet, h: &Hypothesis, unknowns: &[BalanceUnknown]) -> Vec<Vec<f64>> {
        let mut set = base.stated.set.clone();
        set.push(Hypothesis { times: Times::Once, ..h.clone() });
        let Ok(stated) = self.state(&set) else { return Vec::new() };
        let Some(&begin) = stated.begin.last() else { return Vec::new() };
        let problem = self.compare(&stated);
        let segments = problem.begins();
        let from = self.begin_with(&stated, base);
        let tries = self.tries();
        // By stretch and recording: by how much it would fall.
        let gains: Vec<Vec<f64>> = parallel::map(&tries, |stretch| {
            let mut theta = from.clone();
            for (k, u) in stated.unknowns[begin..].iter().enumerate() {
                theta[begin + k] = u.scale.coordinate(value(u, Some(*stretch)));
            }
            let Ok(there) = problem.residuals(&theta) else { return vec![0.0; segments.len() - 1] };
            segments
                .windows(2)
                .map(|s| {
                    let (mut cross, mut own) = (0.0, f64::MIN_POSITIVE);
                    for (b, a) in there[s[0]..s[1]].iter().zip(&base.residuals.as_slice()[s[0]..s[1]]) {
                        let d = b - a;
                        (cross, own) = (cross + d * a, own + d * d);
                    }
                    cross * cross / own
                })
                .collect()
        });
        let best = |score: &dyn Fn(&Vec<f64>) -> f64| {
            let at = (0..tries.len()).max_by(|a, b| score(&gains[*a]).total_cmp(&score(&gains[*b])));
            at.map(|i| tries[i])
        };
        if h.times == Times::EachRun {
            return vec![unknowns.iter().map(|u| value(u, best(&|g| g[u.run.unwrap_or(0)]))).collect()];
        }
        let mut order: Vec<usize> = (0..tries.len()).collect();
        trueup_numerics::order::descending(&mut order, |item| gains[*item].iter().sum());
        let mut apart: Vec<Stretch> = Vec::new();
        for s in order.into_iter().map(|i| tries[i]) {
            if apart.len() < pushes(h) && apart.iter().all(|a| s.is_apart(a)) {
                apart.push(s);
            }
        }
        vec![filled(h, unknowns, &apart)]
    }

    /// Stretches of two lengths all along what counts.
    pub(super) fn tries(&self) -> Vec<Stretch> {
        let (first, last) = self.prescribed[..self.case.train.len()]
            .iter()
            .map(|l| (l.t[l.counts.start], l.t[l.counts.end - 1]))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |m, e| (m.0.min(e.0), m.1.max(e.1)));
        let span = last - first;
        [0.06, 0.2]
            .into_iter()
            .flat_map(|length| {
                let count = (1.0 / length * 1.5) as usize;
                (0..count).map(move |i| Stretch {
                    start: first + span * (i as f64 / count as f64),
                    length: span * length,
                    score: 0.0,
                })
            })
            .collect()
    }

    /// The coordinates that a push moves at once.
    fn pushed(&self, h: &Hypothesis) -> Vec<usize> {
        let HypothesisClaim::Effect(choice) = h.claim else { return Vec::new() };
        let place = choice.place().map_or("", |p| p.name);
        let count = self.case.coordinates.len();
        match (self.case.subject.plant, place) {
            (PlantKind::Joint, "load") => vec![count - 1],
            (PlantKind::Joint, _) => vec![0],
            (PlantKind::Arm, "base") => vec![0, 1, 2],
            (PlantKind::Arm, "actuator") => {
                let before = self.case.subject.flexible[..h.site].iter().filter(|f| **f).count();
                let own = usize::from(self.case.subject.flexible[h.site]);
                vec![3 + h.site + before + own]
            }
            _ => (0..count).collect(),
        }
    }

    fn missing(&self, base: &FittedSet, run: usize, coordinate: usize) -> Option<Missing> {
        let problem = self.compare(&base.stated);
        let series = problem.missing(run, &base.theta).ok()?;
        let prescribed = &self.prescribed[run];
        let c = problem.prescribed.get(run)?.1.lead_of(coordinate)?;
        let here = &series[c][prescribed.counts.clone()];
        let mut sizes: Vec<f64> = here.iter().map(|r| r.abs()).collect();
        let middle = sizes.len() / 2;
        let scatter = *sizes.select_nth_unstable_by(middle, f64::total_cmp).1 / 0.6745;
        // Simulated less measured: what lacks has the other sign, which the amplitude takes.
        let a = here.iter().map(|r| r / scatter.max(1e-300)).collect();
        Some(Missing { t: prescribed.t[prescribed.counts.clone()].to_vec(), a })
    }
}

/// How many impulses a recording has.
fn pushes(h: &Hypothesis) -> usize {
    if h.times == Times::Several { PUSHES } else { 1 }
}

/// The unknowns of the impulses, one after the other; those without a stretch of their own stay where they were.
pub(super) fn filled(h: &Hypothesis, unknowns: &[BalanceUnknown], stretches: &[Stretch]) -> Vec<f64> {
    let each = (unknowns.len() / pushes(h)).max(1);
    unknowns.iter().enumerate().map(|(k, u)| value(u, stretches.get(k / each).copied())).collect()
}

/// As many stretches as there may be impulses, each once those before it are taken out.
fn one_by_one(all: &[&Missing]) -> Vec<Stretch> {
    let mut left: Vec<Missing> = all.iter().map(|m| Missing { t: m.t.clone(), a: m.a.clone() }).collect();
    let mut found = Vec::new();
    while let (true, Some(s)) = (found.len() < PUSHES, best(&scan(&left))) {
        for m in &mut left {
            let within = |t: f64| t >= s.start && t < s.start + s.length;
            let (mut sum, mut count) = (0.0, 0.0);
            for (_, a) in m.t.iter().zip(&m.a).filter(|(t, _)| within(**t)) {
                (sum, count) = (sum + a.clamp(-FAR, FAR), count + 1.0);
            }
            let mean = sum / f64::max(count, 1.0);
            m.t.iter().zip(&mut m.a).filter(|(t, _)| within(**t)).for_each(|(_, a)| *a -= mean);
        }
        found.push(s);
    }
    found
}

/// The quantity of an impulse that an unknown gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PushPart {
    Start,
    Duration,
    Edge,
    /// Its torque or a component of its force.
    Size,
}

impl PushPart {
    pub(crate) fn of(u: &BalanceUnknown) -> Self {
        // As `external-force` names them, whatever its place and the number of the push.
        match u.stem() {
            name if name.ends_with("Start") => Self::Start,
            name if name.ends_with("Duration") => Self::Duration,
            name if name.ends_with("Edge") => Self::Edge,
            _ => Self::Size,
        }
    }
}

/// What an unknown of a push is for a stretch; its force is of the typical size.
fn value(u: &BalanceUnknown, found: Option<Stretch>) -> f64 {
    match PushPart::of(u) {
        PushPart::Start => found.map_or(u.start, |s| s.start),
        PushPart::Duration => found.map_or(u.start, |s| s.length).clamp(u.lower, u.upper),
        PushPart::Edge => found.map_or(u.start, |s| EDGE * s.length).clamp(u.lower, u.upper),
        PushPart::Size => match u.scale {
            trueup_identification::unknown::Scale::Linear(s) => s,
            trueup_identification::unknown::Scale::Log => u.start,
        },
    }
}

/// The most significant stretch.
fn best(stretches: &[Stretch]) -> Option<Stretch> {
    stretches.iter().copied().max_by(|a, b| a.score.total_cmp(&b.score))
}

/// Stretches of all lengths with the significance of their mean, over all series at the same times since the first start.
fn scan<M: Borrow<Missing>>(all: &[M]) -> Vec<Stretch> {
    let all: Vec<&Missing> = all.iter().map(Borrow::borrow).collect();
    let Some(first) = all.first() else { return Vec::new() };
    let sums: Vec<Vec<f64>> = all
        .iter()
        .map(|m| {
            let mean = m.a.iter().sum::<f64>() / m.a.len().max(1) as f64;
            let mut sum = vec![0.0];
            m.a.iter().for_each(|a| sum.push(sum[sum.len() - 1] + (a - mean).clamp(-FAR, FAR)));
            sum
        })
        .collect();
    let n = sums.iter().map(Vec::len).min().unwrap_or(1) - 1;
    let mut found: Vec<Stretch> = Vec::new();
    let mut length = 4;
    while length < n / 2 {
        // Noise is not white here: a stretch counts by what its like usually sum up to.
        let begin = found.len();
        for i in (0..n - length).step_by((length / 8).max(1)) {
            let score: f64 = sums.iter().map(|s| (s[i + length] - s[i]).powi(2)).sum();
            let (start, end) = (first.t[i], first.t[i + length]);
            found.push(Stretch { start, length: end - start, score });
        }
        let mut usual: Vec<f64> = found[begin..].iter().map(|f| f.score).collect();
        let middle = usual.len() / 2;
        if let Some((_, usual, _)) =
            (!usual.is_empty()).then(|| usual.select_nth_unstable_by(middle, f64::total_cmp))
        {
            let usual = usual.max(f64::MIN_POSITIVE);
            found[begin..].iter_mut().for_each(|f| f.score /= usual);
        }
        length = (length as f64 * 1.4).ceil() as usize;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn the_stretch_with_another_mean_is_found() {
        let t: Vec<f64> = (0..1000).map(|i| f64::from(i) * 0.01).collect();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let a = (0..1000)
            .map(|i| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                noise + if (400..460).contains(&i) { 2.0 } else { 0.0 }
            })
            .collect();
        let found = best(&scan(&[Missing { t, a }])).unwrap();
        assert!((found.start - 4.0).abs() < 0.1 && (found.length - 0.6).abs() < 0.15, "{found:?}");
    }
}
