//! A law with a shape along a trajectory, and its evidence.

use trueup_estimation::innovations::column::AppliedLaw;
use trueup_estimation::innovations::frame::InnovationsFrame;

use super::along::PlantAlong;
use super::joint_along::{UsualSizes, along_joint};
use super::law::LawTerms;
use super::laws::LawRef;
use super::levels::TAIL;
use super::shape::LawShape;

/// A law with a shape, and its evidence.
#[derive(Clone)]
pub struct ScreenedShape {
    /// Which law.
    pub law: LawRef,
    /// Its shape.
    pub shape: LawShape,
    /// Columns along the trajectory, with priors.
    pub terms: LawTerms,
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
        Self { law, shape, terms, evidence: f64::NEG_INFINITY, amplitudes, intensities }
    }
    /// Whether it explains anything with amplitudes that can be.
    pub fn is_possible(&self) -> bool {
        self.evidence > f64::NEG_INFINITY
    }
    /// The same along the present trajectory of a joint's frame, its evidence kept.
    pub fn again(&self, frame: &InnovationsFrame, sizes: &UsualSizes) -> Option<Self> {
        let made = Self::new(self.law, &along_joint(frame, sizes), self.shape.clone())?;
        Some(Self { terms: made.terms, ..self.clone() })
    }
    /// Effect and place.
    pub fn key(&self) -> (&'static str, &'static str) {
        (self.law.id(), self.shape.place)
    }
    /// The one with more evidence; this one where both have the same.
    pub(super) fn or_better(self, other: Self) -> Self {
        if other.evidence > self.evidence { other } else { self }
    }
    /// Effect and place, of readings the channels; the form where forms are apart, or where each form is a family.
    pub fn family(&self, each_form: bool) -> (&'static str, &'static str, &[usize], &'static str) {
        let form = if each_form || self.law.forms_apart() { self.shape.form } else { "" };
        (self.law.id(), self.shape.place, &self.shape.channels, form)
    }
    /// Prior standard deviations, so often widened.
    pub fn deviations(&self, widened: u8) -> Vec<f64> {
        deviations(&self.terms.applied, widened)
    }
    /// Whether amplitudes that can only be positive are.
    pub(super) fn can_be(&self, amplitudes: &[f64]) -> bool {
        self.terms.positive.iter().all(|k| amplitudes.get(*k).is_some_and(|a| *a > 0.0))
    }
}

/// The best by evidence of those that are alike, best first.
pub(super) fn best_of_alike<H>(
    all: Vec<H>,
    alike: impl Fn(&H, &H) -> bool,
    evidence: impl Fn(&H) -> f64,
) -> Vec<H> {
    let mut best: Vec<H> = Vec::new();
    for h in all {
        match best.iter_mut().find(|b| alike(b, &h)) {
            Some(b) if evidence(&h) > evidence(b) => *b = h,
            Some(_) => {}
            None => best.push(h),
        }
    }
    best.sort_by(|a, b| evidence(b).total_cmp(&evidence(a)));
    best
}

/// Laws with shapes along the present trajectory of a frame.
pub fn applied(
    parts: &[(LawRef, LawShape)],
    frame: &InnovationsFrame,
    sizes: &UsualSizes,
) -> Vec<AppliedLaw> {
    let along = along_joint(frame, sizes);
    let one = |(law, shape): &(LawRef, LawShape)| {
        let applied = law.terms(&along, shape)?.applied;
        Some(AppliedLaw { deviation: deviations(&applied, shape.widened), ..applied })
    };
    parts.iter().filter_map(one).collect()
}

/// Prior standard deviations, so often widened: an amplitude whose mean is 1 is that of a law whose shape determines its size, and keeps it.
fn deviations(law: &AppliedLaw, widened: u8) -> Vec<f64> {
    let factor = TAIL.wide.powi(widened.into()); // (EST-24)
    law.deviation.iter().zip(&law.mean).map(|(d, mean)| if *mean == 1.0 { *d } else { factor * d }).collect()
}
