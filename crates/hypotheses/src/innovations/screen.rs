//! All shapes at once: the best evidence of each in addition to the base, over a few intensities.

use trueup_estimation::innovations::column::{AppliedLaw, FilterColumn};
use trueup_estimation::innovations::evidence::{AmplitudePriors, log_evidence};
use trueup_estimation::innovations::frame::{INTENSITY, InnovationsFrame};
use trueup_estimation::innovations::gram::{GroupGram, PackedColumns, PassedBase};

use super::candidate::{ScreenedShape, best_of_alike};
use super::joint_along::{UsualSizes, along_joint};
use super::law::Refinement;
use super::laws::{LAWS, LawRef};
use super::levels::{ALIKE, TAIL};
use super::spectrum::OrderPeaks;

/// How often the prior of a size that is far out is widened.
const WIDENED: [u8; 2] = [1, 2];
/// Intensity of the second look of a screen, over that of the first.
const QUIETER: f64 = 0.3;
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
pub fn all_shapes(frame: &InnovationsFrame, sizes: &UsualSizes) -> Vec<ScreenedShape> {
    let along = along_joint(frame, sizes);
    let orders = [OrderPeaks::of(frame, &along)];
    let known = |l: &&LawRef| frame.plant.known_effects().is_some_and(|k| k.has(l.id()));
    let shapes = LAWS
        .iter()
        .filter(|l| !known(l))
        .flat_map(|l| l.shapes(&along, &orders).into_iter().map(move |s| (*l, s)));
    let shapes = shapes.filter(|(l, s)| !frame.plant.refuses(l.id(), s.place));
    shapes.filter_map(|(l, s)| ScreenedShape::new(l, &along, s)).collect()
}

/// A frame along whose present trajectory candidates are compared with a base.
pub trait ScreenedFrame {
    /// How often the prior of sizes is widened in a first look, increasing: what is tried.
    const TAILS: &'static [u8];
    /// Passes a base at each of these intensities.
    fn pass(&self, packed: &PackedColumns, bank: &[Vec<f64>]) -> Vec<PassedBase>;
    /// Gram matrices of groups in addition to a base that was passed.
    fn pass_groups(
        &self,
        packed: &PackedColumns,
        base: &PassedBase,
        groups: &[&[FilterColumn]],
    ) -> Vec<GroupGram>;
}

impl ScreenedFrame for InnovationsFrame {
    const TAILS: &'static [u8] = &[0];
    fn pass(&self, packed: &PackedColumns, bank: &[Vec<f64>]) -> Vec<PassedBase> {
        self.pass_bank(packed, bank)
    }
    fn pass_groups(
        &self,
        packed: &PackedColumns,
        base: &PassedBase,
        groups: &[&[FilterColumn]],
    ) -> Vec<GroupGram> {
        InnovationsFrame::pass_groups(self, packed, base, groups)
    }
}

/// A base along the present trajectory of a frame, to which candidates are compared. What was passed at an intensity is kept:
/// the frame must not change meanwhile.
pub struct Screening {
    packed: PackedColumns,
    priors: AmplitudePriors,
    passed: Vec<(Vec<f64>, PassedBase)>,
}

impl Screening {
    /// Of data, nuisances and accepted laws.
    pub fn new(packed: PackedColumns, priors: AmplitudePriors) -> Self {
        Self { packed, priors, passed: Vec::new() }
    }
    /// The same in a joint's frame.
    pub fn of_joint(frame: &mut InnovationsFrame, standing: &[AppliedLaw]) -> Self {
        frame.linearise();
        let (packed, priors) = frame.packed(standing);
        Self::new(packed, priors)
    }

    /// Looks at candidates at these intensities; returns the best evidence of the base alone.
    pub fn look<F: ScreenedFrame>(
        &mut self,
        frame: &F,
        candidates: &mut [ScreenedShape],
        bank: &[Vec<f64>],
    ) -> f64 {
        let mut alone = f64::NEG_INFINITY;
        candidates.iter_mut().for_each(|c| c.evidence = f64::NEG_INFINITY);
        // What needs the tail once keeps it.
        let wider = |w: u8| F::TAILS.iter().copied().filter(move |t| *t > w);
        let tails = |c: &ScreenedShape| [c.shape.widened].into_iter().chain(wider(c.shape.widened));
        let tails: Vec<Vec<u8>> = candidates.iter().map(|c| tails(c).collect()).collect();
        let new = bank.iter().filter(|q| !self.passed.iter().any(|p| p.0 == **q));
        let new: Vec<Vec<f64>> = new.cloned().collect();
        let passed = frame.pass(&self.packed, &new);
        self.passed.extend(new.into_iter().zip(passed));
        for q in bank {
            let Some((_, base)) = self.passed.iter().find(|p| p.0 == *q) else { continue };
            let groups: Vec<&[FilterColumn]> =
                candidates.iter().map(|c| &c.terms.applied.columns[..]).collect();
            let groups = frame.pass_groups(&self.packed, base, &groups);
            alone = alone.max(log_evidence(&base.gram, &self.priors).log);
            for ((c, group), tails) in candidates.iter_mut().zip(&groups).zip(&tails) {
                let gram = base.gram.with(group);
                for widened in tails.iter().copied() {
                    let with = self.priors.with(&c.terms.applied.mean, &c.deviations(widened));
                    let found = log_evidence(&gram, &with);
                    let own = &found.amplitudes[self.priors.mean.len()..];
                    let cost = TAIL.cost * f64::from(widened);
                    // A tail that was not needed before has to be better.
                    let more = if widened > tails[0] { TAIL.better } else { 0.0 };
                    if found.log - cost > c.evidence + more && c.can_be(own) {
                        (c.evidence, c.amplitudes, c.shape.widened) =
                            (found.log - cost, own.to_vec(), widened);
                        c.intensities.clone_from(q);
                    }
                    if found.log < alone - TAIL.hopeless {
                        break;
                    }
                }
            }
        }
        alone
    }
}

/// What a screen looks at again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScreenRules {
    /// Shapes of each family.
    pub shapes: usize,
    /// Families.
    pub families: usize,
    /// Nats below the base from which on a shape is not.
    pub below: f64,
    /// Whether each form of an effect at a place is a family.
    pub each_form: bool,
}

/// Of joints: the best of each form.
const AGAIN: ScreenRules =
    ScreenRules { shapes: 4, families: usize::MAX, below: f64::INFINITY, each_form: true };

/// Looks at all candidates at the first intensities, then at the best of each family at the others; returns the evidence of the base.
pub fn survey<F: ScreenedFrame>(
    frame: &F,
    screening: &mut Screening,
    candidates: &mut [ScreenedShape],
    [first, rest]: [&[Vec<f64>]; 2],
    rules: ScreenRules,
) -> f64 {
    let mut alone = screening.look(frame, candidates, first);
    let mut order: Vec<usize> = (0..candidates.len()).filter(|k| candidates[*k].is_possible()).collect();
    order.sort_by(|a, b| candidates[*b].evidence.total_cmp(&candidates[*a].evidence));
    let mut families: Vec<(usize, usize)> = Vec::new();
    let mut kept = Vec::new();
    for k in order {
        let family = |k: usize| candidates[k].family(rules.each_form);
        let count = match families.iter_mut().find(|f| family(f.0) == family(k)) {
            Some((_, count)) => {
                *count += 1;
                *count
            }
            None => {
                families.push((k, 1));
                1
            }
        };
        let near = candidates[k].evidence > alone - rules.below;
        if count <= rules.shapes && families.len() <= rules.families && near {
            kept.push(k);
        }
    }
    let mut again: Vec<ScreenedShape> = kept.iter().map(|k| candidates[*k].clone()).collect();
    alone = alone.max(screening.look(frame, &mut again, rest));
    for (k, c) in kept.into_iter().zip(again) {
        if c.evidence > candidates[k].evidence {
            candidates[k] = c;
        }
    }
    alone
}

/// Surveys candidates in a joint's frame: at two intensities first.
pub fn sift(
    frame: &mut InnovationsFrame,
    candidates: &mut [ScreenedShape],
    q: &[f64],
    standing: &[AppliedLaw],
) -> f64 {
    let first = bank(q, &[1.0]);
    let rest: Vec<Vec<f64>> = bank(q, &[1.0, 0.1]).into_iter().filter(|b| !first.contains(b)).collect();
    let mut screening = Screening::of_joint(frame, standing);
    survey(frame, &mut screening, candidates, [&first, &rest], AGAIN)
}

/// Those of a screen at intensities `q` whose size is far out, with the heavy tail of its prior: where a size of the usual width is
/// worth less by more than what is alike. Best first.
pub fn far_out(
    frame: &mut InnovationsFrame,
    candidates: &[ScreenedShape],
    q: &[f64],
    standing: &[AppliedLaw],
) -> Vec<ScreenedShape> {
    let mut screening = Screening::of_joint(frame, standing);
    let mut best: Vec<ScreenedShape> = candidates.to_vec();
    for widened in WIDENED {
        let mut wide = candidates.to_vec();
        wide.iter_mut().for_each(|c| c.shape.widened = widened);
        screening.look(frame, &mut wide, &bank(q, &[1.0, 0.1]));
        best = best.into_iter().zip(wide).map(|(best, wide)| best.or_better(wide)).collect();
    }
    let pairs = best.into_iter().zip(candidates);
    let far = pairs.filter(|(best, c)| best.evidence > c.evidence + ALIKE[0]).map(|(best, _)| best);
    let mut far: Vec<ScreenedShape> = far.collect();
    far.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    far
}

/// The best of those that are alike, best first.
pub fn best_of_families(
    candidates: &[ScreenedShape],
    alike: impl Fn(&ScreenedShape, &ScreenedShape) -> bool,
) -> Vec<ScreenedShape> {
    let possible = candidates.iter().filter(|c| c.is_possible()).collect();
    let best = best_of_alike(possible, |a: &&ScreenedShape, b| alike(a, b), |c| c.evidence);
    best.into_iter().cloned().collect()
}

/// The best of each effect and place, best first; and the best of their other forms.
pub fn families(candidates: &[ScreenedShape]) -> (Vec<ScreenedShape>, Vec<ScreenedShape>) {
    let first = best_of_families(candidates, |a, b| a.key() == b.key());
    let each = |a: &ScreenedShape, b: &ScreenedShape| a.family(true) == b.family(true);
    let mut others = best_of_families(candidates, each);
    others.retain(|c| !first.iter().any(|f| each(f, c)));
    (first, others)
}

/// Steps of a pattern search, relative to its first one.
const AROUND: [f64; 4] = [-1.0, -0.5, 0.5, 1.0];
/// The same of an order.
const AROUND_ORDER: [f64; 6] = [-1.0, -0.5, -0.25, 0.25, 0.5, 1.0];

/// Shape by pattern search at the candidate's intensities, all neighbours in one pass.
pub fn refine(
    frame: &mut InnovationsFrame,
    candidate: ScreenedShape,
    sizes: &UsualSizes,
    standing: &[AppliedLaw],
    rounds: usize,
) -> ScreenedShape {
    let mut best = candidate;
    let mut screening = Screening::of_joint(frame, standing);
    for Refinement { name, step, order } in best.law.refined(&best.shape) {
        let mut step = if order { step * sizes.order() } else { step };
        for _ in 0..rounds {
            let along = along_joint(frame, sizes);
            let value = best.shape.value(name);
            let near: Vec<f64> = if order {
                // Of less than a period in all recordings nothing shows that it is one.
                let least = sizes.order().min(value);
                AROUND_ORDER.iter().map(|d| value + d * step).filter(|h| *h >= least).collect()
            } else {
                AROUND.iter().map(|d| value * (1.0 + d * step)).collect()
            };
            let shapes = near.into_iter().map(|v| best.law.bounded(&along, &best.shape, name, v));
            let shapes = shapes.map(|v| best.shape.with(name, v)).chain([best.shape.clone()]);
            let made = shapes.filter_map(|s| ScreenedShape::new(best.law, &along, s));
            let mut all: Vec<ScreenedShape> = made.collect();
            let q = [best.intensities.clone()];
            screening.look(frame, &mut all, &q);
            step *= 0.5;
            let found = all.into_iter().filter(ScreenedShape::is_possible);
            best = found.reduce(ScreenedShape::or_better).unwrap_or(best);
        }
    }
    best
}
