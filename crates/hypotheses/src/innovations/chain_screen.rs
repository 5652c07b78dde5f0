//! All shapes of a chain's laws at once: the best evidence of each together with what is refitted, over a few intensities.

use trueup_estimation::innovations::column::{AppliedLaw, FilterColumn};
use trueup_estimation::innovations::evidence::AmplitudePriors;
use trueup_estimation::innovations::gram::{GroupGram, PackedColumns, PassedBase};
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;

use super::along::PlantAlong;
use super::candidate::ScreenedShape;
use super::laws::{ARM_LAWS, LawRef};
use super::screen::{ScreenRules, ScreenedFrame, Screening, best_of_families, survey};
use super::shape::LawShape;
use super::spectrum::OrderPeaks;

/// What is looked at again.
const AGAIN: ScreenRules = ScreenRules { shapes: 3, families: 20, below: 3.0, each_form: false };

/// Candidates of all laws along a trajectory, of the shapes that `wanted` takes.
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

impl ScreenedFrame for TrajectoryFrame {
    const TAILS: &'static [u8] = &[0, 1];
    fn pass(&self, packed: &PackedColumns, bank: &[Vec<f64>]) -> Vec<PassedBase> {
        bank.iter().map(|q| self.pass_base(packed, q)).collect()
    }
    fn pass_groups(
        &self,
        packed: &PackedColumns,
        base: &PassedBase,
        groups: &[&[FilterColumn]],
    ) -> Vec<GroupGram> {
        TrajectoryFrame::pass_groups(self, packed, base, groups)
    }
}

/// What is refitted along the present trajectory of a frame, and fitted laws, to which candidates are compared.
pub fn chain_screening(frame: &mut TrajectoryFrame, standing: &[AppliedLaw]) -> Screening {
    let (columns, priors) = with_laws(frame, standing);
    Screening::new(frame.packed(&columns), priors)
}

/// Columns of all that is refitted and of laws, with their priors.
pub fn with_laws(frame: &mut TrajectoryFrame, laws: &[AppliedLaw]) -> (Vec<FilterColumn>, AmplitudePriors) {
    let (mut columns, priors) = frame.nuisances();
    let priors = priors.with_laws(laws, &mut columns);
    (columns, priors)
}

/// Factors of the intensities of a survey: of the first look at all shapes, and of the second one at the best.
pub const LOOKS: (f64, &[f64]) = (0.3, &[1.0, 0.1]);

/// Surveys candidates at these factors of the intensities; returns the evidence of the base.
pub fn chain_survey(
    frame: &TrajectoryFrame,
    screening: &mut Screening,
    candidates: &mut [ScreenedShape],
    q: &[f64],
    (first, rest): (f64, &[f64]),
) -> f64 {
    let (first, rest) = (chain_bank(frame, q, &[first]), chain_bank(frame, q, rest));
    survey(frame, screening, candidates, [&first, &rest], AGAIN)
}

/// The best of each family, best first.
pub fn best_of_chain(candidates: &[ScreenedShape]) -> Vec<ScreenedShape> {
    best_of_families(candidates, |a, b| a.family(false) == b.family(false))
}
