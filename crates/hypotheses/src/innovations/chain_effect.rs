//! A hypothesis about a chain where its fit ended.

use trueup_estimation::innovations::trajectory::fit::TrajectoryFit;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;

use super::candidate::best_of_alike;
use super::chain_form::EffectForm;
use super::law::DryFriction;
use super::levels::CHAIN_SEARCH;
use super::shape::LawShape;

/// Latents that a hypothesis leaves, in their floors.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LatentLevels {
    /// Forces.
    pub forces: Vec<f64>,
    /// Errors of readings.
    pub readings: Vec<f64>,
}

impl LatentLevels {
    /// Of intensities in a frame.
    pub fn of(frame: &TrajectoryFrame, q: &[f64]) -> Self {
        let levels: Vec<f64> = q.iter().zip(frame.bounds()).map(|(q, [floor, _])| q / floor).collect();
        let (forces, readings) = levels.split_at(frame.coordinates().min(levels.len()));
        Self { forces: forces.to_vec(), readings: readings.to_vec() }
    }
    /// Forces, and errors of readings by their weight.
    pub fn weighted(&self) -> Vec<f64> {
        self.forces
            .iter()
            .copied()
            .chain(self.readings.iter().map(|e| CHAIN_SEARCH.of_readings * e))
            .collect()
    }
    /// The largest of the weighted ones.
    pub fn largest(&self) -> f64 {
        self.weighted().into_iter().fold(0.0, f64::max)
    }
    /// The largest of all, readings without their weight.
    pub fn largest_of_all(&self) -> f64 {
        self.forces.iter().chain(&self.readings).copied().fold(0.0, f64::max)
    }
    /// Power above the floors, 1 where all are there.
    pub fn power(&self) -> f64 {
        self.weighted().into_iter().map(|w| w.max(1.0).powi(2) - 1.0).sum::<f64>() + 1.0
    }
    fn strength(&self) -> f64 {
        self.weighted().into_iter().map(|w| w * w).sum()
    }
}

/// Effect, place and channels of a hypothesis.
pub type EffectKey<'a> = (&'static str, &'static str, &'a [usize]);

/// An effect of a chain, fitted.
#[derive(Clone)]
pub struct ChainEffect {
    /// Its id.
    pub id: &'static str,
    /// Its shape, as it is reported.
    pub shape: LawShape,
    /// The law in force in the fit; `None`: the structure of its plant is the effect.
    pub form: Option<EffectForm>,
    /// Log evidence with the priors of the shape, nats.
    pub evidence: f64,
    /// What of it is that of the fit.
    pub of_fit: f64,
    /// Where the fit ended.
    pub fit: TrajectoryFit,
    /// The latents that it leaves.
    pub left: LatentLevels,
    /// The frame where the fit ended.
    pub frame: TrajectoryFrame,
    /// Whether that frame has readings or a structure of its own.
    pub apart: bool,
}

impl ChainEffect {
    /// A law in the frame of all.
    pub fn of_law(form: EffectForm, fit: TrajectoryFit, frame: TrajectoryFrame) -> Self {
        Self {
            id: form.law.id(),
            shape: form.shape().clone(),
            evidence: fit.evidence - CHAIN_SEARCH.each_push * form.pulses() as f64,
            of_fit: fit.evidence,
            left: LatentLevels::of(&frame, &fit.intensities),
            form: Some(form),
            fit,
            frame,
            apart: false,
        }
    }
    /// In a frame of its own, whose prior costs so many nats.
    pub fn apart(
        id: &'static str,
        shape: LawShape,
        form: Option<EffectForm>,
        fit: TrajectoryFit,
        frame: TrajectoryFrame,
        cost: f64,
    ) -> Self {
        let left = LatentLevels::of(&frame, &fit.intensities);
        let (evidence, of_fit) = (fit.evidence - cost, fit.evidence);
        Self { id, shape, form, evidence, of_fit, fit, left, frame, apart: true }
    }
    /// Effect, place and channels.
    pub fn key(&self) -> EffectKey<'_> {
        (self.id, self.shape.place, &self.shape.channels)
    }
    /// Whether it is impulses.
    pub fn is_impulses(&self) -> bool {
        self.form.as_ref().is_some_and(EffectForm::is_pushes)
    }
    /// Which dry friction of a motor it is.
    pub fn dry_friction(&self) -> Option<DryFriction> {
        self.form.as_ref().and_then(EffectForm::dry_friction)
    }
    /// Joints at which it acts.
    pub fn joints(&self) -> Vec<usize> {
        match &self.form {
            Some(form) => form.parts.iter().flat_map(|p| p.shape.joints.clone()).collect(),
            None => self.shape.joints.clone(),
        }
    }
    /// Its place as it is reported: a sensor with its channels, or with the name of what reads them.
    pub fn place(&self) -> String {
        place_of(&self.frame, &self.shape)
    }
}

/// A place as it is reported.
pub fn place_of(frame: &TrajectoryFrame, shape: &LawShape) -> String {
    if shape.place != "sensor" {
        return shape.place.to_owned();
    }
    let group = frame.intake.groups.iter().find(|g| g.1 == shape.channels).map(|g| g.0.clone());
    let channel =
        || shape.channels.first().and_then(|c| frame.intake.channels.get(*c)).map(|c| c.name.clone());
    format!("sensor:{}", group.or_else(channel).unwrap_or_default())
}

/// The best of each effect and place, best first.
pub fn best_of_each(all: Vec<ChainEffect>) -> Vec<ChainEffect> {
    best_of_alike(all, |a, b| a.key() == b.key(), |h| h.evidence)
}

/// A hypothesis to which Stribeck's rule applies: which friction it is, its evidence and what it leaves.
pub type RankedEvidence<'a> = (Option<DryFriction>, &'a mut f64, &'a LatentLevels);

/// Stribeck's friction contains the plain one: it has to be worth it, and to leave less to the latents. `null`: evidence without any.
pub fn rank_friction(all: Vec<RankedEvidence<'_>>, null: f64) {
    let plain = all.iter().find(|h| h.0 == Some(DryFriction::Plain)).map(|h| (*h.1, h.2.clone()));
    let Some((evidence, left)) = plain else { return };
    let ([nats, share], [power, calm]) = (CHAIN_SEARCH.falling, CHAIN_SEARCH.falling_leaves);
    let cost = nats.max(share * (evidence - null));
    for h in all.into_iter().filter(|h| h.0 == Some(DryFriction::Falling)) {
        let largest = h.2.forces.iter().copied().fold(0.0, f64::max);
        let less = h.2.strength() < power * left.strength() || largest < calm;
        *h.1 = if less { *h.1 } else { h.1.min(evidence) } - cost;
    }
}
