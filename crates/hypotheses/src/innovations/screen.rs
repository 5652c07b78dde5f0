//! All shapes at once: the best evidence of each in addition to the base, over a few intensities.

use trueup_estimation::innovations::column::{AppliedLaw, FilterColumn};
use trueup_estimation::innovations::evidence::{AmplitudePriors, log_evidence};
use trueup_estimation::innovations::frame::{INTENSITY, InnovationsFrame};
use trueup_estimation::innovations::gram::{PackedColumns, PassedBase};

use super::candidate::EffectCandidate;
use super::joint_along::{UsualSizes, along_joint};
use super::law::Refinement;
use super::laws::LAWS;
use super::spectrum::OrderPeaks;

/// Intensity of the second look of a screen, over that of the first.
const QUIETER: f64 = 0.3;
/// Candidates of each form that are looked at with all intensities.
const OF_EACH: usize = 4;

/// Intensities with each latent at these factors, and all of them at 0.3; increasing.
pub fn bank(q: &[f64], factors: &[f64]) -> Vec<Vec<f64>> {
    let mut all: Vec<Vec<f64>> = vec![Vec::new()];
    for q in q {
        all = all
            .into_iter()
            .flat_map(|v| factors.iter().map(move |f| [&v[..], &[(f * q).max(INTENSITY[0])]].concat()))
            .collect();
    }
    all.push(quieter(q));
    all.sort_by(|a, b| a.partial_cmp(b).unwrap_or(std::cmp::Ordering::Equal));
    all.dedup();
    all
}

fn quieter(q: &[f64]) -> Vec<f64> {
    q.iter().map(|q| (QUIETER * q).max(INTENSITY[0])).collect()
}

/// Candidates of all laws along the present trajectory of a frame.
pub fn all_shapes(frame: &InnovationsFrame, sizes: &UsualSizes) -> Vec<EffectCandidate> {
    let along = along_joint(frame, sizes);
    let orders = [OrderPeaks::of(frame, &along)];
    let shapes = LAWS.iter().flat_map(|l| l.shapes(&along, &orders).into_iter().map(move |s| (*l, s)));
    shapes.filter_map(|(l, s)| EffectCandidate::new(l, &along, s)).collect()
}

/// A base along the present trajectory of a frame, to which candidates are compared. What was passed at an intensity is kept:
/// the frame must not change meanwhile.
pub struct Screening {
    packed: PackedColumns,
    priors: AmplitudePriors,
    passed: Vec<(Vec<f64>, PassedBase)>,
}

impl Screening {
    /// Data, nuisances and accepted laws.
    pub fn new(frame: &InnovationsFrame, standing: &[AppliedLaw]) -> Self {
        let (packed, priors) = frame.packed(standing);
        Self { packed, priors, passed: Vec::new() }
    }

    /// Looks at candidates at these intensities; returns the evidence of the base alone.
    pub fn look(
        &mut self,
        frame: &mut InnovationsFrame,
        candidates: &mut [EffectCandidate],
        bank: &[Vec<f64>],
    ) -> f64 {
        let mut alone = f64::NEG_INFINITY;
        candidates.iter_mut().for_each(|c| c.evidence = f64::NEG_INFINITY);
        let new = bank.iter().filter(|q| !self.passed.iter().any(|p| p.0 == **q));
        let new: Vec<Vec<f64>> = new.cloned().collect();
        let passed = frame.pass_bank(&self.packed, &new);
        self.passed.extend(new.into_iter().zip(passed));
        for q in bank {
            let Some((_, base)) = self.passed.iter().find(|p| p.0 == *q) else { continue };
            let groups: Vec<&[FilterColumn]> = candidates.iter().map(|c| &c.applied.columns[..]).collect();
            let groups = frame.pass_groups(&self.packed, base, &groups, q);
            alone = alone.max(log_evidence(&base.gram, &self.priors).log);
            for (c, group) in candidates.iter_mut().zip(&groups) {
                let with = self.priors.with(&c.applied.mean, &c.applied.deviation);
                let found = log_evidence(&base.gram.with(group), &with);
                let own = &found.amplitudes[self.priors.mean.len()..];
                let can_be = c.positive.iter().all(|i| own.get(*i).is_some_and(|a| *a > 0.0));
                if found.log > c.evidence && can_be {
                    (c.evidence, c.amplitudes, c.q) = (found.log, own.to_vec(), q.clone());
                }
            }
        }
        alone
    }
}

/// Looks at all candidates at two intensities, then at the best of each form at the others too.
pub fn sift(
    frame: &mut InnovationsFrame,
    candidates: &mut [EffectCandidate],
    q: &[f64],
    standing: &[AppliedLaw],
) -> f64 {
    let first = bank(q, &[1.0]);
    let rest: Vec<Vec<f64>> = bank(q, &[1.0, 0.1]).into_iter().filter(|b| !first.contains(b)).collect();
    let mut screening = Screening::new(frame, standing);
    let mut alone = screening.look(frame, candidates, &first);
    let mut order: Vec<usize> = (0..candidates.len()).filter(|k| candidates[*k].is_possible()).collect();
    order.sort_by(|a, b| candidates[*b].evidence.total_cmp(&candidates[*a].evidence));
    let mut kept: Vec<usize> = Vec::new();
    for k in order {
        let same = |j: &&usize| {
            let (a, b) = (&candidates[**j], &candidates[k]);
            a.key() == b.key() && a.shape.form == b.shape.form
        };
        if kept.iter().filter(same).count() < OF_EACH {
            kept.push(k);
        }
    }
    if rest.is_empty() || kept.is_empty() {
        return alone;
    }
    let mut again: Vec<EffectCandidate> = kept.iter().map(|k| candidates[*k].clone()).collect();
    alone = alone.max(screening.look(frame, &mut again, &rest));
    for (k, c) in kept.into_iter().zip(again) {
        if c.evidence >= candidates[k].evidence {
            candidates[k] = c;
        }
    }
    alone
}

/// The best of each effect and place, best first; and the best of their other forms.
pub fn families(candidates: &[EffectCandidate]) -> (Vec<EffectCandidate>, Vec<EffectCandidate>) {
    let mut all: Vec<&EffectCandidate> = candidates.iter().filter(|c| c.is_possible()).collect();
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let (mut first, mut others): (Vec<EffectCandidate>, Vec<EffectCandidate>) = (Vec::new(), Vec::new());
    for c in all {
        let same = |o: &EffectCandidate| o.key() == c.key() && o.shape.form == c.shape.form;
        if !first.iter().any(|o| o.key() == c.key()) {
            first.push(c.clone());
        } else if !first.iter().chain(&others).any(same) {
            others.push(c.clone());
        }
    }
    (first, others)
}

/// Steps of a pattern search, relative to its first one.
const AROUND: [f64; 4] = [-1.0, -0.5, 0.5, 1.0];
/// The same of an order.
const AROUND_ORDER: [f64; 6] = [-1.0, -0.5, -0.25, 0.25, 0.5, 1.0];

/// Shape by pattern search at the candidate's intensities, all neighbours in one pass.
pub fn refine(
    frame: &mut InnovationsFrame,
    candidate: EffectCandidate,
    sizes: &UsualSizes,
    standing: &[AppliedLaw],
    rounds: usize,
) -> EffectCandidate {
    let mut best = candidate;
    let mut screening = Screening::new(frame, standing);
    for Refinement { name, step, order } in best.law.refined(&best.shape) {
        let mut step = if order { step * sizes.order() } else { step };
        for _ in 0..rounds {
            let along = along_joint(frame, sizes);
            let value = best.shape.value(name);
            let near: Vec<f64> = if order {
                AROUND_ORDER.iter().map(|d| value + d * step).collect()
            } else {
                AROUND.iter().map(|d| value * (1.0 + d * step)).collect()
            };
            let shapes = near.into_iter().map(|v| best.law.bounded(&along, &best.shape, name, v));
            let shapes = shapes.map(|v| best.shape.with(name, v)).chain([best.shape.clone()]);
            let made = shapes.filter_map(|s| EffectCandidate::new(best.law, &along, s));
            let mut all: Vec<EffectCandidate> = made.collect();
            let q = [best.q.clone()];
            screening.look(frame, &mut all, &q);
            step *= 0.5;
            let found = all.into_iter().filter(EffectCandidate::is_possible);
            if let Some(found) = found.reduce(|a, b| if b.evidence > a.evidence { b } else { a }) {
                best = found;
            }
        }
    }
    best
}
