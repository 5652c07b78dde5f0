//! A law with a shape along a trajectory, and its evidence.

use trueup_estimation::innovations::column::AppliedLaw;
use trueup_estimation::innovations::frame::InnovationsFrame;

use super::along::PlantAlong;
use super::joint_along::{UsualSizes, along_joint};
use super::laws::LawRef;
use super::shape::LawShape;

/// A law with a shape.
#[derive(Clone)]
pub struct EffectCandidate {
    /// Which law.
    pub law: LawRef,
    /// Its shape.
    pub shape: LawShape,
    /// Columns along the trajectory, with priors.
    pub applied: AppliedLaw,
    /// Amplitudes that can only be positive.
    pub positive: Vec<usize>,
    /// Best log evidence in addition to the base; minus infinity: none with an amplitude that can be.
    pub evidence: f64,
    /// Amplitudes there.
    pub amplitudes: Vec<f64>,
    /// Intensities there.
    pub q: Vec<f64>,
}

impl EffectCandidate {
    /// Along a trajectory; `None` where a channel that it needs was not recorded.
    pub fn new(law: LawRef, along: &PlantAlong<'_>, shape: LawShape) -> Option<Self> {
        let terms = law.terms(along, &shape)?;
        Some(Self {
            law,
            shape,
            applied: terms.applied,
            positive: terms.positive,
            evidence: f64::NEG_INFINITY,
            amplitudes: Vec::new(),
            q: Vec::new(),
        })
    }
    /// The same along the present trajectory of a frame, its evidence kept.
    pub fn again(&self, frame: &InnovationsFrame, sizes: &UsualSizes) -> Option<Self> {
        let made = Self::new(self.law, &along_joint(frame, sizes), self.shape.clone())?;
        Some(Self { applied: made.applied, ..self.clone() })
    }
    /// Whether any amplitude was found that can be.
    pub fn is_possible(&self) -> bool {
        self.evidence > f64::NEG_INFINITY
    }
    /// Effect and place.
    pub fn key(&self) -> (&'static str, &'static str) {
        (self.law.id(), self.shape.place)
    }
}

/// Laws with shapes along the present trajectory of a frame.
pub fn applied(
    parts: &[(LawRef, LawShape)],
    frame: &InnovationsFrame,
    sizes: &UsualSizes,
) -> Vec<AppliedLaw> {
    let along = along_joint(frame, sizes);
    let terms = parts.iter().filter_map(|(law, shape)| law.terms(&along, shape));
    terms.map(|t| t.applied).collect()
}
