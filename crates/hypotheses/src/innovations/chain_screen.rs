//! All shapes of a chain's laws at once: the best evidence of each together with what is refitted, over a few intensities.

use trueup_estimation::innovations::column::{AppliedLaw, FilterColumn};
use trueup_estimation::innovations::evidence::{AmplitudePriors, log_evidence};
use trueup_estimation::innovations::gram::{PackedColumns, PassedBase};
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::TrajectoryError;

use super::along::PlantAlong;
use super::law::LawTerms;
use super::laws::{ARM_LAWS, LawRef};
use super::shape::LawShape;
use super::spectrum::OrderPeaks;

/// Shapes of each family, and families, that are looked at again.
const AGAIN: (usize, usize) = (3, 20);
/// Nats below the base from which on a shape is not looked at again.
const BELOW: f64 = 3.0;
/// Heavy tail of sizes: so many usual widths of the prior. This and the three below are the values of the reference program for arms,
/// of which [`CHAIN`](super::levels::CHAIN) is, too.
const WIDE: f64 = 6.0;
/// Nats that the tail costs.
const COST: f64 = 1.0;
/// Nats by which a tail has to be better than the usual width, in addition to its cost.
const BETTER: f64 = 0.5;
/// Nats below the base from which on the tail is not tried.
const HOPELESS: f64 = 5.0;

/// A law with a shape, and its evidence.
#[derive(Clone)]
pub struct ScreenedShape {
    /// Which law.
    pub law: LawRef,
    /// Its shape.
    pub shape: LawShape,
    /// Columns along the trajectory, with priors.
    pub terms: LawTerms,
    /// Whether sizes have the heavy tail's prior: mean-1 amplitudes excepted.
    pub wide: bool,
    /// Best log evidence with the prior of the tail; minus infinity: none with amplitudes that can be.
    pub evidence: f64,
    /// Amplitudes there.
    pub amplitudes: Vec<f64>,
    /// Intensities there.
    pub intensities: Vec<f64>,
}

impl ScreenedShape {
    /// Along a trajectory; `None`: the plant cannot have it.
    pub fn new(law: LawRef, along: &PlantAlong<'_>, shape: LawShape) -> Option<Self> {
        let terms = law.terms(along, &shape)?;
        Some(Self { terms, ..Self::empty(law, shape) })
    }
    /// Without columns.
    pub(super) fn empty(law: LawRef, shape: LawShape) -> Self {
        let (amplitudes, intensities, terms) = (Vec::new(), Vec::new(), LawTerms::default());
        Self { law, shape, terms, wide: false, evidence: f64::NEG_INFINITY, amplitudes, intensities }
    }
    /// Whether it explains anything with amplitudes that can be.
    pub fn is_possible(&self) -> bool {
        self.evidence > f64::NEG_INFINITY
    }
    /// The one with more evidence; this one where both have the same.
    pub(super) fn or_better(self, other: Self) -> Self {
        if other.evidence > self.evidence { other } else { self }
    }
    /// Effect and place, of readings the channels; the forms of a spring are separate.
    pub fn family(&self) -> (&'static str, &'static str, &[usize], &'static str) {
        let form = if self.law.id() == "nonlinear-stiffness" { self.shape.form } else { "" };
        (self.law.id(), self.shape.place, &self.shape.channels, form)
    }
    /// Prior standard deviations, `wide` or not: a law whose shape determines its size keeps it.
    pub fn deviations(&self, wide: bool) -> Vec<f64> {
        let pairs = self.terms.applied.deviation.iter().zip(&self.terms.applied.mean);
        pairs.map(|(d, mean)| if wide && *mean != 1.0 { WIDE * d } else { *d }).collect()
    }
    fn can_be(&self, amplitudes: &[f64]) -> bool {
        self.terms.positive.iter().all(|k| amplitudes.get(*k).is_some_and(|a| *a > 0.0))
    }
}

/// Candidates of all laws along a trajectory whose columns are wanted.
pub fn chain_shapes(
    along: &PlantAlong<'_>,
    orders: &[OrderPeaks],
    wanted: impl Fn(LawRef, &LawShape) -> bool,
) -> Vec<ScreenedShape> {
    let shapes = ARM_LAWS.iter().flat_map(|l| l.shapes(along, orders).into_iter().map(move |s| (*l, s)));
    let wanted = shapes.filter(|(law, shape)| wanted(*law, shape));
    wanted.filter_map(|(law, shape)| ScreenedShape::new(law, along, shape)).collect()
}

/// Intensities at these factors, no lower than their floors.
pub fn chain_bank(frame: &TrajectoryFrame, q: &[f64], factors: &[f64]) -> Vec<Vec<f64>> {
    let floors = frame.bounds();
    let at = |f: &f64| q.iter().zip(&floors).map(|(q, [low, _])| (f * q).max(*low)).collect();
    factors.iter().map(at).collect()
}

/// What is refitted along the present trajectory of a frame, and fitted laws, to which candidates are compared. What was passed
/// at some intensities is kept: the frame must not change meanwhile.
pub struct ChainScreening {
    packed: PackedColumns,
    priors: AmplitudePriors,
    passed: Vec<(Vec<f64>, PassedBase)>,
}

impl ChainScreening {
    /// Data, what is refitted, and fitted laws.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn new(frame: &mut TrajectoryFrame, standing: &[AppliedLaw]) -> Result<Self, TrajectoryError> {
        let (columns, priors) = with_laws(frame, standing)?;
        Ok(Self::of(frame.packed(&columns), priors))
    }
    /// What is packed along the present trajectory.
    pub fn of(packed: PackedColumns, priors: AmplitudePriors) -> Self {
        Self { packed, priors, passed: Vec::new() }
    }

    /// Looks at candidates at these intensities; returns the best evidence without any.
    pub fn look(
        &mut self,
        frame: &TrajectoryFrame,
        candidates: &mut [ScreenedShape],
        bank: &[Vec<f64>],
    ) -> f64 {
        let mut alone = f64::NEG_INFINITY;
        candidates.iter_mut().for_each(|c| c.evidence = f64::NEG_INFINITY);
        // What needs the tail once keeps it.
        let tails: Vec<&[bool]> =
            candidates.iter().map(|c| if c.wide { &[true][..] } else { &[false, true] }).collect();
        for q in bank {
            let known = self.passed.iter().position(|p| p.0 == *q);
            let k = match known {
                Some(k) => k,
                None => {
                    self.passed.push((q.clone(), frame.pass_base(&self.packed, q)));
                    self.passed.len() - 1
                }
            };
            let base = &self.passed[k].1;
            alone = alone.max(log_evidence(&base.gram, &self.priors).log);
            let groups: Vec<&[FilterColumn]> =
                candidates.iter().map(|c| &c.terms.applied.columns[..]).collect();
            let groups = frame.pass_groups(&self.packed, base, &groups, q);
            for ((c, group), tails) in candidates.iter_mut().zip(&groups).zip(&tails) {
                let gram = base.gram.with(group);
                for wide in tails.iter().copied() {
                    let with = self.priors.with(&c.terms.applied.mean, &c.deviations(wide));
                    let found = log_evidence(&gram, &with);
                    let own = &found.amplitudes[self.priors.mean.len()..];
                    let cost = if wide { COST } else { 0.0 };
                    // A tail that was not needed before has to be better.
                    let more = if wide && tails.len() > 1 { BETTER } else { 0.0 };
                    if found.log - cost > c.evidence + more && c.can_be(own) {
                        (c.evidence, c.amplitudes, c.wide) = (found.log - cost, own.to_vec(), wide);
                        c.intensities.clone_from(q);
                    }
                    if found.log < alone - HOPELESS {
                        break;
                    }
                }
            }
        }
        alone
    }
}

/// Columns of all that is refitted and of laws, with their priors.
///
/// # Errors
/// See [`TrajectoryError`].
pub fn with_laws(
    frame: &mut TrajectoryFrame,
    laws: &[AppliedLaw],
) -> Result<(Vec<FilterColumn>, AmplitudePriors), TrajectoryError> {
    let (mut columns, priors) = frame.nuisances()?;
    let priors = priors.with_laws(laws, &mut columns);
    Ok((columns, priors))
}

/// Factors of the intensities of a survey: of the first look at all shapes, and of the second one at the best.
pub const LOOKS: (f64, &[f64]) = (0.3, &[1.0, 0.1]);

/// Looks at all candidates at the first intensities, then at the best of each family at the others; returns the evidence of the base.
pub fn survey(
    frame: &TrajectoryFrame,
    screening: &mut ChainScreening,
    candidates: &mut [ScreenedShape],
    q: &[f64],
    looks: (f64, &[f64]),
) -> f64 {
    let mut alone = screening.look(frame, candidates, &chain_bank(frame, q, &[looks.0]));
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order.retain(|k| candidates[*k].is_possible());
    order.sort_by(|a, b| candidates[*b].evidence.total_cmp(&candidates[*a].evidence));
    let mut families: Vec<(usize, usize)> = Vec::new();
    let mut kept = Vec::new();
    for k in order {
        let same = families.iter_mut().find(|f| candidates[f.0].family() == candidates[k].family());
        let count = match same {
            Some(family) => {
                family.1 += 1;
                family.1
            }
            None => {
                families.push((k, 1));
                1
            }
        };
        let near = candidates[k].evidence > alone - BELOW;
        if count <= AGAIN.0 && families.len() <= AGAIN.1 && near {
            kept.push(k);
        }
    }
    let mut again: Vec<ScreenedShape> = kept.iter().map(|k| candidates[*k].clone()).collect();
    alone = alone.max(screening.look(frame, &mut again, &chain_bank(frame, q, looks.1)));
    for (k, c) in kept.into_iter().zip(again) {
        if c.evidence > candidates[k].evidence {
            candidates[k] = c;
        }
    }
    alone
}

/// The best of each family, best first.
pub fn best_of_families(candidates: &[ScreenedShape]) -> Vec<&ScreenedShape> {
    let mut order: Vec<&ScreenedShape> = candidates.iter().filter(|c| c.is_possible()).collect();
    order.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let mut best: Vec<&ScreenedShape> = Vec::new();
    for c in order {
        if !best.iter().any(|b| b.family() == c.family()) {
            best.push(c);
        }
    }
    best
}
