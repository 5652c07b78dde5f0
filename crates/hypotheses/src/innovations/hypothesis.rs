//! A hypothesis where its fit ended.

use std::cell::RefCell;
use std::rc::Rc;

use trueup_estimation::innovations::column::AppliedLaw;
use trueup_estimation::innovations::fixed_point::FixedPoint;
use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::intensity::power;

use super::candidate::{ScreenedShape, applied, best_of_alike};
use super::joint_along::UsualSizes;
use super::laws::LawRef;
use super::levels::TAIL;
use super::pushes::EACH;
use super::shape::LawShape;

/// A frame that several hypotheses use one after the other.
pub type SharedFrame = Rc<RefCell<InnovationsFrame>>;

/// An effect at a place, fitted.
#[derive(Clone)]
pub struct FittedEffect {
    /// Its id.
    pub id: &'static str,
    /// Where it acts.
    pub place: &'static str,
    /// Shape, as it is reported.
    pub shape: LawShape,
    /// Laws that are in force in the fit; none where the frame's structure is the effect.
    pub parts: Vec<(LawRef, LawShape)>,
    /// Log evidence with the priors of the shape, nats.
    pub evidence: f64,
    /// What of it is that of the fit.
    pub of_fit: f64,
    /// Where the fit ended.
    pub fit: FixedPoint,
    /// In which frame.
    pub frame: SharedFrame,
}

impl FittedEffect {
    /// A law in the frame of all.
    pub fn of_law(frame: &SharedFrame, law: LawRef, shape: LawShape, fit: FixedPoint) -> Self {
        let evidence = fit.evidence - cost(&shape);
        let parts = vec![(law, shape.clone())];
        let (id, place, of_fit) = (law.id(), shape.place, fit.evidence);
        Self { id, place, shape, parts, evidence, of_fit, fit, frame: frame.clone() }
    }
    /// Effect and place.
    pub fn key(&self) -> (&'static str, &'static str) {
        (self.id, self.place)
    }
    /// Power of the latents that are left.
    pub fn power(&self) -> f64 {
        power(&self.fit.q)
    }
    /// Log likelihood with the squares of the priors, nats: how well it fits, whatever the width of its priors.
    pub fn penalised(&self) -> f64 {
        self.fit.penalised + self.evidence - self.of_fit
    }
    /// Laws along the present trajectory of the frame.
    pub fn laws(&self, sizes: &UsualSizes) -> Vec<AppliedLaw> {
        applied(&self.parts, &self.frame.borrow(), sizes)
    }
    /// Whether it is impulses.
    pub fn is_impulses(&self) -> bool {
        self.parts.first().is_some_and(|(law, _)| law.is_impulses())
    }
    /// Whether it is one law whose shape determines all, so that both shapes of a pair can be refined.
    pub fn is_plain(&self) -> bool {
        matches!(&self.parts[..], [(law, _)] if law.id() == self.id && !law.is_late())
    }
}

/// Nats that the priors of a shape cost beyond those of its amplitudes: of its impulses, and of its heavy tail.
pub(super) fn cost(shape: &LawShape) -> f64 {
    EACH * shape.pulses.len() as f64 + TAIL.cost * f64::from(shape.widened)
}

/// Slope inside the bend, over that outside, below which a spring of two slopes is play.
const PLAY: f64 = 0.12;

/// A spring of two slopes that has none inside is play.
pub fn play(effect: FittedEffect) -> FittedEffect {
    let Some(bend) = effect.shape.get("bend").filter(|_| effect.id == "nonlinear-stiffness") else {
        return effect;
    };
    let a = &effect.fit.amplitudes;
    if a.len() == 2 && 1.0 + a[0] + a[1] < PLAY * (1.0 + a[1]) {
        let shape = LawShape::new("transmission", "gap", &[("gap", 2.0 * bend)]);
        return FittedEffect { id: "backlash", shape, ..effect };
    }
    effect
}

/// The best of each effect and place, best first.
pub fn best_each(all: Vec<FittedEffect>) -> Vec<FittedEffect> {
    best_of_alike(all, |a, b| a.key() == b.key(), |h| h.evidence)
}

/// Fits a candidate from the start of its frame.
pub fn fit_candidate(
    frame: &SharedFrame,
    candidate: &ScreenedShape,
    sizes: &UsualSizes,
    rounds: usize,
) -> FittedEffect {
    let parts = [(candidate.law, candidate.shape.clone())];
    let make = |f: &InnovationsFrame| applied(&parts, f, sizes);
    let fit = frame.borrow_mut().fit(&make, &candidate.intensities, rounds, true);
    FittedEffect::of_law(frame, candidate.law, candidate.shape.clone(), fit)
}

/// The effect whose structure a frame has.
pub fn of_structure(
    frame: InnovationsFrame,
    id: &'static str,
    shape: LawShape,
    fit: FixedPoint,
    evidence: f64,
) -> FittedEffect {
    let fit = FixedPoint { amplitudes: Vec::new(), laws: Vec::new(), ..fit };
    let (place, of_fit) = (shape.place, fit.evidence);
    let frame = Rc::new(RefCell::new(frame));
    FittedEffect { id, place, shape, parts: Vec::new(), evidence, of_fit, fit, frame }
}
