//! A hypothesis about a chain: a law with its shape, at one joint or at several of them, each with a shape of its own.

use trueup_estimation::innovations::column::AppliedLaw;

use super::along::PlantAlong;
use super::candidate::ScreenedShape;
use super::law::{DryFriction, LawTerms};
use super::laws::{LawRef, SLIP};
use super::levels::CHAIN_SEARCH;
use super::shape::LawShape;
use super::slope::LawSlopes;

/// A law at one place.
#[derive(Clone)]
pub struct FormPart {
    /// Its shape.
    pub shape: LawShape,
    /// Terms that are left out.
    pub left_out: Vec<usize>,
}

/// The same law at one place or at several: one effect.
#[derive(Clone)]
pub struct EffectForm {
    /// Which law.
    pub law: LawRef,
    /// Where.
    pub parts: Vec<FormPart>,
}

impl EffectForm {
    /// At one place.
    pub fn new(law: LawRef, shape: LawShape) -> Self {
        Self { law, parts: vec![FormPart { shape, left_out: Vec::new() }] }
    }
    /// As a screen found it.
    pub fn of(found: &ScreenedShape) -> Self {
        Self::new(found.law, found.shape.clone())
    }
    /// The shape of its first part.
    pub fn shape(&self) -> &LawShape {
        &self.parts[0].shape
    }
    /// Which dry friction it is in place of that of the nominal model; in addition to that it is none.
    pub fn dry_friction(&self) -> Option<DryFriction> {
        let instead = self.parts.iter().all(|p| p.shape.get(SLIP).is_none());
        self.law.dry_friction().filter(|_| instead)
    }
    /// Whether it is impulses, which have no shape to refine.
    pub fn is_pushes(&self) -> bool {
        self.law.is_impulses()
    }
    /// Impulses.
    pub fn pulses(&self) -> usize {
        self.parts.iter().map(|p| p.shape.pulses.len()).sum()
    }
    /// The same with another law at the same places, its shapes made from these.
    pub fn with_law(&self, law: LawRef, shape: impl Fn(&LawShape) -> LawShape) -> Self {
        let part = |p: &FormPart| FormPart { shape: shape(&p.shape), left_out: Vec::new() };
        Self { law, parts: self.parts.iter().map(part).collect() }
    }

    /// Columns along a trajectory, sizes with the prior of each part (`widened`) or with the usual one.
    fn terms(&self, along: &PlantAlong<'_>, widened: bool) -> Option<LawTerms> {
        let mut all = LawTerms::default();
        for part in &self.parts {
            let one = ScreenedShape::new(self.law, along, part.shape.clone())?;
            let deviations = one.deviations(if widened { part.shape.widened } else { 0 });
            let LawTerms { applied, positive } = one.terms;
            let terms = applied.columns.into_iter().zip(applied.mean).zip(deviations);
            for (k, ((column, mean), deviation)) in terms.enumerate() {
                if part.left_out.contains(&k) {
                    continue;
                }
                if positive.contains(&k) {
                    all.positive.push(all.applied.columns.len());
                }
                all.applied.columns.push(column);
                all.applied.mean.push(mean);
                all.applied.deviation.push(deviation);
            }
        }
        Some(all)
    }
    /// What a fit takes.
    pub fn applied(&self, along: &PlantAlong<'_>) -> Option<AppliedLaw> {
        self.terms(along, true).map(|t| t.applied)
    }
    /// What a screen takes: sizes of a single part with the usual prior, as the screen tries the heavy tail too.
    pub fn candidate(&self, along: &PlantAlong<'_>) -> Option<ScreenedShape> {
        let terms = self.terms(along, self.parts.len() > 1)?;
        let shape = LawShape { widened: 0, ..self.shape().clone() };
        Some(ScreenedShape { terms, ..ScreenedShape::empty(self.law, shape) })
    }
    /// What its forces change with the states at these amplitudes.
    pub fn slopes(&self, along: &PlantAlong<'_>, amplitudes: &[f64]) -> Option<LawSlopes> {
        let mut all: Option<LawSlopes> = None;
        let mut own = amplitudes.iter();
        for part in &self.parts {
            let count = self.law.terms(along, &part.shape)?.applied.columns.len();
            let value =
                |k: usize| if part.left_out.contains(&k) { 0.0 } else { own.next().copied().unwrap_or(0.0) };
            let amplitudes: Vec<f64> = (0..count).map(value).collect();
            let Some(slopes) = self.law.slopes(along, &part.shape, &amplitudes) else { continue };
            match &mut all {
                Some(all) => all.iter_mut().zip(slopes).for_each(|(a, s)| a.extend(s)),
                None => all = Some(slopes),
            }
        }
        all
    }
    /// Without the companions of dry friction that came out negative; `None`: there are none.
    pub fn trimmed(&self, amplitudes: &[f64]) -> Option<Self> {
        let (count, longer) = self.law.companions();
        let mut less = self.clone();
        let mut own = amplitudes.iter();
        let mut any = false;
        for part in &mut less.parts {
            let kept: Vec<usize> = (0..count).filter(|k| !part.left_out.contains(k)).collect();
            let values: Vec<(usize, f64)> =
                kept.into_iter().map(|k| (k, own.next().copied().unwrap_or(0.0))).collect();
            let level = values.first().map_or(0.0, |v| v.1.abs());
            let negative =
                values.iter().filter(|(k, v)| longer.contains(k) && *v <= CHAIN_SEARCH.companion * level);
            for (k, _) in negative {
                part.left_out.push(*k);
                any = true;
            }
        }
        any.then_some(less)
    }
}
