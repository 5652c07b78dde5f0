//! Names and figures of the engine as those of an FMU.

use trueup_hypotheses::innovations::findings::{CaseFindings, FoundCause, FoundEffect};
use trueup_hypotheses::innovations::foreign::{BREAKAWAY, ForcedPlant, ForeignJoint, JointFigures};
use trueup_identification::fmu::FmuSubject;
use trueup_identification::model::{CoordinateIndices, NamedVariables};
use trueup_models::effect::{EffectChoice, PlantKind};
use trueup_signals::Case;

use crate::diagnose::evidence_claims::{ComparedParameter, EvidenceNames};

/// A channel of the engine, and the FMU's variable that it is.
pub type ChannelVariable = (&'static str, String);

/// Where a motion begins: names of the parameters that are its position and rate at the start, and of the outputs that show them.
#[derive(Clone, Debug)]
pub struct NamedStart {
    /// Parameter and output of the position.
    pub position: [String; 2],
    /// The same of the rate.
    pub rate: [String; 2],
}

impl NamedStart {
    /// By the subject's own indices.
    pub(super) fn of(&self, subject: &FmuSubject) -> Option<CoordinateIndices> {
        Some(CoordinateIndices {
            angle: subject.parameter(&self.position[0])?,
            velocity: subject.parameter(&self.rate[0])?,
            angle_output: subject.output(&self.position[1])?,
            velocity_output: subject.output(&self.rate[1])?,
            follows: None,
        })
    }
}

/// Names of the engine and those of the FMU.
#[derive(Debug)]
pub(super) struct ForeignNames<'a> {
    pub case: &'a Case,
    pub channels: &'a [ChannelVariable],
    pub joint: &'a ForeignJoint,
    /// Usual speed of its motor, rad/s.
    pub usual_speed: f64,
}

impl EvidenceNames for ForeignNames<'_> {
    fn place(&self, place: &str) -> String {
        let named = |channel: &str| self.variable(channel).unwrap_or(channel).to_owned();
        place.strip_prefix("sensor:").map_or_else(|| place.to_owned(), |c| format!("sensor:{}", named(c)))
    }
    fn joint(&self, _cause: &FoundCause) -> Option<usize> {
        Some(1)
    }
    fn choice(&self, id: &str, place: &str) -> Option<EffectChoice> {
        let place = if place.starts_with("sensor:") { None } else { Some(place) };
        let is = |c: &EffectChoice| c.spec().id == id && place.is_none_or(|p| c.component() == p);
        EffectChoice::all(PlantKind::Joint).find(is)
    }
    fn is_of_plant(&self, cause: &FoundCause, value: &str) -> bool {
        self.of_plant(cause, value).is_some()
    }
    fn parameters(&self, found: &CaseFindings, effect: &FoundEffect) -> Vec<ComparedParameter> {
        let own = self.joint.parameters();
        let one = |(name, value): (String, f64)| {
            let known = own.iter().find(|p| p.name == name);
            let doubt = known.and_then(|p| Some(self.case.doubt(p.name)? * p.value.abs()));
            ComparedParameter {
                unit: known.map_or("", |p| p.unit).to_owned(),
                nominal: known.map(|p| p.value),
                deviation: doubt,
                share: known.map_or(0.0, |p| p.deviation),
                name,
                value,
            }
        };
        self.found(found, effect).into_iter().map(one).collect()
    }
}

impl ForeignNames<'_> {
    /// The FMU's variable that is a channel of the engine.
    pub(super) fn variable(&self, channel: &str) -> Option<&str> {
        self.channels.iter().find(|c| c.0 == channel).map(|c| c.1.as_str())
    }
    /// A parameter, or what is estimated of a channel: `motorCurrent.gain`.
    pub(super) fn parameter(&self, name: &str) -> String {
        let of_channel = name.rsplit_once('.').and_then(|(c, what)| Some((self.variable(c)?, what)));
        of_channel.map_or_else(|| name.to_owned(), |(c, what)| format!("{c}.{what}"))
    }
    /// Figures of the joint, and the level of its dry friction (N.m), with what was found.
    pub(super) fn figures(&self, effect: &FoundEffect) -> (JointFigures, f64) {
        let own = self.joint.parameters().len().min(effect.theta.len());
        let dry = self.joint.coordinates().first().and_then(|c| c.dry);
        let mut figures = self.joint.figures(&effect.theta[..own]);
        let mut level = dry.map_or(0.0, |k| effect.theta[k]);
        for v in effect.causes.iter().flat_map(|c| &c.values) {
            let at = match v.name {
                "stiffness" => &mut figures.stiffness,
                "damping" => &mut figures.damping,
                "coulombFriction" => &mut level,
                "viscousFriction" => &mut figures.viscous,
                _ => continue,
            };
            *at = v.value;
        }
        (figures, level)
    }
    /// N.m of one unit of the external torque's input, with gear ratio `n`.
    pub(super) fn external_unit(&self, n: f64) -> f64 {
        self.joint.input_forces().iter().find(|f| f.name == "externalTorque").map_or(1.0, |f| n * f.factor)
    }
    /// Values of the FMU's parameters that were found. Those that come with an effect take precedence.
    pub(super) fn found(&self, found: &CaseFindings, effect: &FoundEffect) -> Vec<(String, f64)> {
        let mut all: Vec<(String, f64)> =
            found.names.iter().map(|n| self.parameter(n)).zip(effect.theta.iter().copied()).collect();
        // Where it breaks away follows what it slides with, as the engine has it.
        let motor = self.joint.coordinates().first();
        let level = motor.and_then(|c| Some(effect.theta.get(c.dry?)? * c.breakaway));
        if let (Some(level), Some((index, per_unit))) = (level, self.joint.counterpart(BREAKAWAY)) {
            all.push((self.joint.name_of(index).to_owned(), level / per_unit));
        }
        for (cause, v) in effect.causes.iter().flat_map(|c| c.values.iter().map(move |v| (c, v))) {
            let Some((name, per_unit)) = self.of_plant(cause, v.name) else { continue };
            all.iter_mut().filter(|a| a.0 == name).for_each(|a| a.1 = v.value / per_unit);
        }
        all
    }
    /// The FMU's parameter that a value of an effect belongs to, where it is one of the plant, with its factor.
    pub(super) fn of_plant(&self, cause: &FoundCause, value: &str) -> Option<(&str, f64)> {
        let own = |c: &EffectChoice| c.parameters().iter().any(|p| p.name == value);
        let (index, per_unit) = self.joint.counterpart(value)?;
        let of_effect = self.choice(cause.id, &cause.place).is_some_and(|c| own(&c));
        (!of_effect).then(|| (self.joint.name_of(index), per_unit))
    }
    /// All parameters of the FMU with those that were found, as far as it accepts them.
    pub(super) fn values(
        &self,
        subject: &FmuSubject,
        nominal: &[f64],
        found: &CaseFindings,
        effect: &FoundEffect,
    ) -> Vec<f64> {
        let mut values = nominal.to_vec();
        for (name, value) in self.found(found, effect) {
            if let Some(k) = subject.parameter(&name) {
                let q = &subject.parameters()[k];
                values[k] = value.max(q.min).min(q.max);
            }
        }
        values
    }
}
