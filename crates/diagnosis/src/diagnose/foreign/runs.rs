//! Free runs of an FMU, alone and with an effect through its ports.

use std::sync::Arc;

use trueup_hypotheses::innovations::findings::{FoundCause, FoundEffect};
use trueup_hypotheses::innovations::foreign::{JointFigures, KnownEffects, KnownPoint};
use trueup_identification::fmu::{FmuSubject, InsertedForces, InsertedLaw};
use trueup_identification::model::NamedVariables;
use trueup_identification::predict::PredictError;
use trueup_identification::run::IdentificationRun;
use trueup_models::compiled::PlantModel;
use trueup_models::joint::TwoMassJoint;
use trueup_plant::Plant;
use trueup_signals::{Case, KnownEffect, ParameterValue};

use super::names::ForeignNames;
use crate::diagnose::evidence_claims::EvidenceNames;
use crate::diagnose::free_runs::{FreeReadings, FreeRuns};

/// Speed below which friction of an effect fades, in usual ones: the FMU itself holds what rests.
const FADES: f64 = 1e-3;

/// An FMU with the recordings that it is compared with.
pub(super) struct ForeignRuns {
    pub subject: FmuSubject,
    pub runs: Vec<IdentificationRun>,
    plant: Arc<dyn Plant>,
}

impl ForeignRuns {
    pub(super) fn new(subject: FmuSubject, plant: Arc<dyn Plant>, runs: Vec<IdentificationRun>) -> Self {
        Self { subject, runs, plant }
    }

    /// With these parameters; `late`: a channel that shows everything so much later, s.
    pub(super) fn run(
        &self,
        values: &[f64],
        late: Option<(&str, f64)>,
    ) -> Result<FreeReadings, PredictError> {
        FreeRuns { subject: &self.subject, runs: &self.runs }.run(values, late)
    }

    /// With an effect.
    ///
    /// # Errors
    /// What of it cannot be simulated.
    pub(super) fn with(
        &self,
        names: &ForeignNames<'_>,
        values: &[f64],
        effect: &FoundEffect,
    ) -> Result<FreeReadings, String> {
        let (sensed, acting): (Vec<&FoundCause>, Vec<&FoundCause>) =
            effect.causes.iter().partition(|c| c.place.starts_with("sensor:"));
        let mut late = None;
        for c in sensed {
            let delay = c.values.iter().find(|v| v.name == "delay");
            let (true, Some(delay)) = (c.id == "sensor-delay", delay) else { return Err(c.id.to_owned()) };
            late = Some((names.place(&c.place), delay.value));
        }
        let late = late.as_ref().map(|(place, by)| (place.trim_start_matches("sensor:"), *by));
        if acting.is_empty() {
            return self.run(values, late).map_err(|e| format!("{} ({e})", effect.key.0));
        }
        let law = EffectForces::new(names, (effect, &acting), self)?;
        let coordinates = self.plant.coordinates().iter().flat_map(|c| [c.position_output, c.rate_output]);
        let outputs = coordinates.filter_map(|k| self.subject.output(&self.plant.table().outputs[k].name));
        let inserted = InsertedForces { outputs: outputs.collect(), law: Arc::new(law) };
        let subject = self.subject.with_inserted(inserted);
        let with = Self { subject, runs: self.runs.clone(), plant: self.plant.clone() };
        with.run(values, late).map_err(|e| format!("{} ({e})", effect.key.0))
    }
}

/// Effects between the ports of a joint: what the two-mass joint with its figures accelerates more with them than without, times its
/// inertias (EST-18), through the FMU's inputs.
#[derive(Debug)]
struct EffectForces {
    effects: KnownEffects,
    parameters: Vec<f64>,
    figures: JointFigures,
    /// Speed below which friction fades, rad/s.
    slow: f64,
    drive: usize,
    /// The external torque's input, and N.m a unit of it.
    external: Option<(usize, f64)>,
}

impl EffectForces {
    fn new(
        names: &ForeignNames<'_>,
        (effect, causes): (&FoundEffect, &[&FoundCause]),
        of: &ForeignRuns,
    ) -> Result<Self, String> {
        let (figures, friction) = names.figures(effect);
        let plant = [
            ("motorInertia", figures.motor_inertia),
            ("loadInertia", figures.load_inertia),
            ("stiffness", figures.stiffness),
            ("damping", figures.damping),
            ("coulombFriction", friction),
            ("staticFriction", friction),
            ("viscousFriction", figures.viscous),
            ("torqueConstant", figures.torque_constant),
            ("gearRatio", figures.gear_ratio),
        ];
        let mut case = Case { model: TwoMassJoint::NAME.into(), ..Case::default() };
        let mut put = |name: String, value: f64| case.parameters.insert(name, ParameterValue::Number(value));
        plant.iter().for_each(|(name, value)| {
            put((*name).to_owned(), *value);
        });
        let mut ids = Vec::new();
        for c in causes {
            let no = || c.id.to_owned();
            if c.impulses > 1 || c.is_of_single_recordings() {
                return Err(no());
            }
            let choice = names.choice(c.id, &c.place).ok_or_else(no)?;
            for v in &c.values {
                let own = choice.parameters().iter().any(|p| p.name == v.name);
                let name = if own { choice.variable(v.name) } else { v.name.to_owned() };
                if own || v.name == "staticFriction" {
                    put(name, v.value);
                }
            }
            ids.push(choice.id());
        }
        let known = |id: &String| KnownEffect { id: id.clone(), joint: None, given: Vec::new() };
        case.effects = ids.iter().map(known).collect();
        let effects = KnownEffects::of(&case, friction > 0.0);
        let effects = effects.map_err(|e| e.0)?.ok_or_else(|| ids.join(", "))?;
        let parameters = effects.parameters(&vec![1.0; effects.numbers.len()], &[]);
        let input = |name: &str| names.variable(name).and_then(|v| of.subject.input(v));
        let slow = FADES * names.usual_speed;
        let law = Self {
            slow,
            drive: input("motorCurrent").ok_or_else(|| ids.join(", "))?,
            external: input("externalTorque").map(|k| (k, names.external_unit(figures.gear_ratio))),
            effects,
            parameters,
            figures,
        };
        // States of their own would have to be integrated with those of the FMU.
        match law.effects.have_memory(&law.point(0.0, &[0.0; 4], &[0.0; 2], 0.0)) {
            true => Err(ids.join(", ")),
            false => Ok(law),
        }
    }

    fn point<'a>(&'a self, time: f64, state: &'a [f64], input: &'a [f64], sign: f64) -> KnownPoint<'a> {
        let rigid = self.figures.stiffness == 0.0;
        KnownPoint { time, parameters: &self.parameters, state, inner: &[], input, sign, rigid }
    }
}

impl InsertedLaw for EffectForces {
    fn add(&self, time: f64, outputs: &[f64], inputs: &mut [f64]) {
        let n = self.figures.gear_ratio;
        let state = match *outputs {
            [q, v, load, rate, ..] => [q, v, n * load, n * rate],
            [q, v, ..] => [q, v, q, v],
            _ => return,
        };
        let input = [inputs[self.drive], self.external.map_or(0.0, |(k, unit)| unit * inputs[k])];
        let sign = (state[1] / self.slow).tanh();
        let [motor, load] = self.effects.motion(&self.point(time, &state, &input, sign), &[]).0.forces;
        match self.external.filter(|_| self.figures.stiffness > 0.0) {
            Some((k, unit)) => {
                inputs[self.drive] += motor / self.figures.torque_constant;
                inputs[k] += n * load / unit;
            }
            None => inputs[self.drive] += (motor + load) / self.figures.torque_constant,
        }
    }
}
