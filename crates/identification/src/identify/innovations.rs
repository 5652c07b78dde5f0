//! Parameters by the innovations of a filter: the model alone, as a diagnosis fits it (crate `estimation`).

use nalgebra::DMatrix;
use trueup_estimation::innovations::estimate::{ChannelInnovations, EstimatedNumber, InnovationsEstimate};
use trueup_estimation::innovations::joint_frame::{JointFrameError, joint_frame_to_estimate};
use trueup_estimation::innovations::null::fit_null;
use trueup_estimation::innovations::plant::ForcedPlant;
use trueup_estimation::innovations::sensed::without_sensor_effects;
use trueup_estimation::innovations::trajectory::case_frame::{chain_frame, fit_alone, prepared};
use trueup_estimation::innovations::trajectory::structures::PlantStructures;
use trueup_models::joint::parameter as joint;
use trueup_signals::Loaded;

use super::error::IdentifyError;
use super::found::{FoundParameter, found};
use super::identified::{Identified, IdentifySettings};
use super::leverage::Leverage;
use super::unknowns::CommonUnknown;
use crate::covariance::correlation;
use crate::estimate::{ChannelFit, ParameterEstimate, Z95, whiteness};
use crate::fit::free_run;
use crate::model::SimulatedPlant;
use crate::run::IdentificationRun;
use crate::unknown::{FitTarget, FitUnknown, Scale};

/// Relative standard deviation of the prior of what is to be fitted and has none.
const WIDE: f64 = 3.0;
/// Standard deviation of a latent force, in usual forces, above which the model lacks something.
const LACKS: f64 = 0.01;
/// Relative standard error above which the data do not determine a number.
const HOPELESS: f64 = 1.0;

/// The model alone by the innovations.
pub(super) fn by_innovations(
    model: &SimulatedPlant,
    nominal: &[f64],
    loaded: &Loaded,
    train: &[IdentificationRun],
    fitted: &[CommonUnknown],
    settings: &IdentifySettings,
) -> Result<Identified, IdentifyError> {
    (settings.progress)("innovations");
    let found = estimate(loaded, fitted)?;
    let reports = Reports { model, nominal, found: &found };
    let mut notes = reports.notes();
    let mut values = nominal.to_vec();
    let (mut parameters, mut uncertain, mut sensors) = (Vec::new(), Vec::new(), Vec::new());
    let mut order: [Vec<Option<usize>>; 2] = Default::default();
    for f in fitted {
        let at = found.numbers.iter().position(|n| n.recording.is_none() && n.name == f.unknown.name);
        let estimate = reports.estimate(&f.unknown, at);
        match f.unknown.target {
            FitTarget::Parameter(k) => values[k] = estimate.value,
            target => sensors.push((target, estimate.value)),
        }
        let one = FoundParameter { doubt: f.doubt, ..reports.found(&estimate, &f.unknown) };
        if f.asked_for { &mut parameters } else { &mut uncertain }.push(one);
        order[usize::from(!f.asked_for)].push(at.filter(|_| estimate.standard_error.is_some()));
    }
    if model.joint().is_some() {
        // Only its ratio to the sliding level is part of the equations.
        let level = values[joint::COULOMB_FRICTION];
        let ratio = nominal[joint::STATIC_FRICTION] / nominal[joint::COULOMB_FRICTION];
        if level > 0.0 && ratio.is_finite() {
            values[joint::STATIC_FRICTION] = level * ratio;
        }
    }
    let order = order.concat();
    let of = correlation(&found.covariance);
    let same = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
    let correlated =
        |i: usize, j: usize| order[i].zip(order[j]).map_or_else(|| same(i, j), |(i, j)| of[(i, j)]);
    let determined = order.iter().flatten().count();
    let channels = found.innovations.iter().filter(|c| !c.whitened.is_empty()).map(residuals).collect();
    if !found.ended {
        notes.push("the search ran out of iterations: the estimate may not be the best one".into());
    }
    let mut read = train.to_vec();
    for run in &mut read {
        sensors.iter().for_each(|(target, value)| run.calibrate(*target, *value));
    }
    let training = free_run(model, &values, &read)?;
    Ok(Identified {
        model: model.structure().model.clone(),
        fmu: None,
        outputs: model.outputs().to_vec(),
        method: settings.method,
        parameters,
        uncertain,
        nuisance: train
            .iter()
            .enumerate()
            .map(|(k, r)| (r.name.clone(), reports.nuisance(k, fitted)))
            .collect(),
        fit: Vec::new(),
        held_out: false,
        before: Vec::new(),
        without: Vec::new(),
        channels,
        training,
        compared: Vec::new(),
        names: Default::default(),
        correlation: DMatrix::from_fn(order.len(), order.len(), correlated),
        rank: (determined, order.len()),
        condition: condition(&of, &order),
        leverage: Leverage::default(),
        starts: Vec::new(),
        stop: if found.ended { "the parameters no longer move" } else { "it ran out of iterations" },
        iterations: found.rounds,
        notes,
        values,
        pack: None,
        sensors,
        design: None,
    })
}

/// The fit, in the frame of a joint or of a chain.
fn estimate(loaded: &Loaded, fitted: &[CommonUnknown]) -> Result<InnovationsEstimate, IdentifyError> {
    let refused = |why: String| IdentifyError::Innovations { why };
    let mut own = without_sensor_effects(loaded).into_owned();
    let names: Vec<&str> = fitted.iter().map(|f| f.unknown.name.as_str()).collect();
    for f in fitted.iter().filter(|f| matches!(f.unknown.target, FitTarget::Parameter(_))) {
        if own.case.doubt(&f.unknown.name).is_none() {
            own.case.uncertain.insert(f.unknown.name.clone(), WIDE);
        }
    }
    match joint_frame_to_estimate(&own) {
        Ok((mut frame, plant)) => {
            let parameters = plant.parameters();
            frame.unknown.retain(|k| parameters.get(*k).is_none_or(|p| names.contains(&p.name)));
            let null = fit_null(&mut frame);
            frame.theta.clone_from(&null.theta);
            frame.q.clone_from(&null.q);
            Ok(frame.estimate(null.zeros))
        }
        Err(JointFrameError::Model { .. }) => {
            let structures = PlantStructures::of(&own.case).map_err(|e| refused(e.to_string()))?;
            let own = prepared(&own, &structures).map_err(|e| refused(e.to_string()))?;
            let found = chain_frame(&own, &structures).and_then(|mut frame| {
                frame.only(&names);
                let (mut frame, _, fit) = fit_alone(frame)?;
                frame.estimate(&fit)
            });
            found.map_err(|e| refused(e.to_string()))
        }
        Err(e) => Err(refused(e.to_string())),
    }
}

/// What is reported of an estimate.
struct Reports<'a> {
    model: &'a SimulatedPlant,
    nominal: &'a [f64],
    found: &'a InnovationsEstimate,
}

impl Reports<'_> {
    fn found(&self, estimate: &ParameterEstimate, unknown: &FitUnknown) -> FoundParameter {
        found(self.model, self.nominal, estimate, unknown)
    }

    /// An unknown by its number `at`; `None`: it was not estimated.
    fn estimate(&self, unknown: &FitUnknown, at: Option<usize>) -> ParameterEstimate {
        let before = match unknown.target {
            FitTarget::Parameter(k) => self.nominal[k],
            _ => unknown.start,
        };
        let mut estimate = ParameterEstimate {
            name: unknown.name.clone(),
            run: unknown.run,
            value: before,
            standard_error: None,
            cramer_rao: None,
            ci95: [None, None],
            reason: None,
        };
        let Some(at) = at else {
            let why = match self.model.joint() {
                Some(_) if unknown.name == joint::NAMES[joint::STATIC_FRICTION].0 => {
                    "innovations keep its ratio to the Coulomb friction; use output-error to estimate it"
                }
                _ => {
                    "innovations do not estimate it: it is 0 in the case, or no motion of this model depends on it"
                }
            };
            estimate.reason = Some(why.into());
            return estimate;
        };
        let value = self.found.numbers[at].value;
        let error = self.found.covariance[(at, at)].sqrt();
        let size = match unknown.scale {
            Scale::Log => value.abs(),
            Scale::Linear(size) => size.abs(),
        };
        estimate.value = value;
        if !error.is_finite() {
            estimate.reason = Some("the recordings do not determine it".into());
            return estimate;
        }
        if error > HOPELESS * size {
            let percent = 100.0 * error / size;
            estimate.reason = Some(format!("its standard error would be {percent:.0} % of its size"));
            return estimate;
        }
        estimate.standard_error = Some(error);
        estimate.cramer_rao = Some(error);
        let end = |sign: f64| match unknown.scale {
            Scale::Log => value * (sign * Z95 * error / value).exp(),
            Scale::Linear(_) => value + sign * Z95 * error,
        };
        estimate.ci95 = [Some(end(-1.0)), Some(end(1.0))];
        estimate
    }

    /// What a recording has by itself, and offsets of inputs that all of them have.
    fn nuisance(&self, recording: usize, fitted: &[CommonUnknown]) -> Vec<FoundParameter> {
        let here = |n: &&EstimatedNumber| match n.recording {
            Some(of) => of == recording,
            None => n.name.ends_with(".offset") && !fitted.iter().any(|f| f.unknown.name == n.name),
        };
        let numbers = self.found.numbers.iter().enumerate();
        let one = |(at, n): (usize, &EstimatedNumber)| {
            let channel = n.name.rsplit_once('.').map_or(n.name.as_str(), |c| c.0);
            let (of_input, of_output) = (self.model.input(channel), self.model.output(channel));
            let target = of_input.map(FitTarget::InputOffset).or(of_output.map(FitTarget::Offset))?;
            let unknown = FitUnknown::free(&n.name, target, Some(recording), f64::INFINITY);
            Some(self.found(&self.estimate(&unknown, Some(at)), &unknown))
        };
        numbers.filter(|(_, n)| here(n)).filter_map(one).collect()
    }

    fn notes(&self) -> Vec<String> {
        let lacks = self.found.latents.iter().filter(|(_, q)| *q > LACKS);
        let lacks: Vec<String> = lacks.map(|(name, q)| format!("{name} {:.1} %", 100.0 * q)).collect();
        if lacks.is_empty() {
            return Vec::new();
        }
        vec![format!(
            "forces that the model lacks, as standard deviations in usual forces: {}; see `trueup diagnose` for what that is. Standard errors are wider for that, but do not include the bias of a wrong model",
            lacks.join(", ")
        )]
    }
}

/// Condition number of the Jacobian with columns of unit length, for what is determined.
fn condition(correlation: &DMatrix<f64>, order: &[Option<usize>]) -> f64 {
    let at: Vec<usize> = order.iter().flatten().copied().collect();
    if at.is_empty() {
        return f64::INFINITY;
    }
    let own = DMatrix::from_fn(at.len(), at.len(), |i, j| correlation[(at[i], at[j])]);
    let eigenvalues = own.symmetric_eigenvalues();
    (eigenvalues.max() / eigenvalues.min().max(f64::MIN_POSITIVE)).sqrt()
}

fn residuals(c: &ChannelInnovations) -> ChannelFit {
    let power = c.whitened.iter().map(|e| e * e).sum::<f64>() / c.whitened.len() as f64;
    let (lag1, whiteness) = whiteness(&c.whitened);
    ChannelFit {
        run: c.recording,
        channel: c.channel.clone(),
        above_floor: c.noise * power.sqrt(),
        lag1,
        whiteness,
    }
}
