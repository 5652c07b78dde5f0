//! `break-away`: tau_s from recordings of slow current ramps (S3 section 4.2), one ramp each.

use nalgebra::DMatrix;
use trueup_models::joint::{input, output, parameter as p};

use super::error::IdentifyError;
use super::found::FoundParameter;
use super::identified::Identified;
use super::leverage::Leverage;
use super::method::IdentifyMethod;
use crate::estimate::ParameterEstimate;
use crate::model::SimulatedPlant;
use crate::quasi_static::{Breakaway, StaticError, breakaway, static_friction};
use crate::run::{IdentificationRun, InputDrive};

/// Value of a measured input, on a line between its samples.
fn at(drive: &InputDrive, t: f64) -> f64 {
    let k = drive.t.partition_point(|s| *s <= t).clamp(1, drive.t.len().max(1));
    let (before, after) = (k - 1, k.min(drive.t.len() - 1));
    let span = drive.t[after] - drive.t[before];
    let share = if span > 0.0 { ((t - drive.t[before]) / span).clamp(0.0, 1.0) } else { 0.0 };
    drive.u[before] + share * (drive.u[after] - drive.u[before])
}

fn of_run(nominal: &[f64], run: &IdentificationRun) -> Result<Breakaway, IdentifyError> {
    let wrong = |what| IdentifyError::Static { run: run.name.clone(), what };
    let current = run.drives.iter().find(|d| d.input == input::MOTOR_CURRENT && !d.t.is_empty());
    let angle = run.channels.iter().find(|c| c.output == output::MOTOR_ANGLE);
    let (Some(current), Some(angle)) = (current, angle) else {
        let text = "break-away needs motorCurrent and motorAngle; record both".to_owned();
        return Err(wrong(StaticError::Shape(text)));
    };
    let t: Vec<f64> = angle.t.iter().map(|t| t - angle.delay).collect();
    let u: Vec<f64> = t.iter().map(|t| at(current, *t)).collect();
    // Through the spring the motor holds the torque on the load at rest.
    let load = run.drives.iter().find(|d| d.input == input::EXTERNAL_TORQUE && !d.t.is_empty());
    let external = load.map_or(0.0, |d| at(d, run.start)) / nominal[p::GEAR_RATIO];
    let noise = (angle.sigma.powi(2) - angle.resolution.powi(2) / 12.0).max(0.0).sqrt();
    let threshold = (2.0 * angle.resolution).max(8.0 * noise);
    breakaway(&t, &u, &angle.y, nominal[p::TORQUE_CONSTANT], external, threshold).map_err(wrong)
}

pub(super) fn found(
    model: &SimulatedPlant,
    nominal: &[f64],
    runs: &[IdentificationRun],
) -> Result<Identified, IdentifyError> {
    if model.joint().is_none() {
        return Err(IdentifyError::Method { method: IdentifyMethod::BreakAway });
    }
    let all: Vec<Breakaway> = runs.iter().map(|r| of_run(nominal, r)).collect::<Result<_, _>>()?;
    let (value, standard_error) = static_friction(&all);
    let one = |name: &str, run: Option<usize>, value: f64, error: Option<f64>| ParameterEstimate {
        name: name.into(),
        run,
        value,
        standard_error: error,
        cramer_rao: None,
        ci95: error.map_or([None, None], |e| [Some(value - 1.96 * e), Some(value + 1.96 * e)]),
        reason: None,
    };
    let shown = |estimate: ParameterEstimate, unit, nominal: f64| FoundParameter {
        estimate,
        unit,
        nominal,
        doubt: None,
    };
    let reason =
        standard_error.is_none().then(|| "one ramp does not show its spread; record several".to_owned());
    let estimate = ParameterEstimate { reason, ..one("staticFriction", None, value, standard_error) };
    let nuisance = (runs.iter().zip(&all).enumerate())
        .map(|(r, (run, b))| {
            let own = vec![
                shown(one("staticFriction", Some(r), b.static_friction, Some(b.late)), "N.m", value),
                shown(one("breakAwayCurrent", Some(r), b.current, None), "A", 0.0),
                shown(one("breakAwayTime", Some(r), b.time, None), "s", 0.0),
            ];
            (run.name.clone(), own)
        })
        .collect();
    let mut values = nominal.to_vec();
    values[p::STATIC_FRICTION] = value;
    Ok(Identified {
        model: model.structure().model.clone(),
        fmu: None,
        outputs: model.outputs().to_vec(),
        method: IdentifyMethod::BreakAway,
        parameters: vec![shown(estimate, "N.m", nominal[p::STATIC_FRICTION])],
        uncertain: Vec::new(),
        nuisance,
        fit: Vec::new(),
        held_out: false,
        before: Vec::new(),
        without: Vec::new(),
        channels: Vec::new(),
        training: Vec::new(),
        compared: Vec::new(),
        names: Default::default(),
        correlation: DMatrix::identity(1, 1),
        rank: (1, 1),
        condition: 1.0,
        leverage: Leverage::default(),
        starts: Vec::new(),
        stop: "closed form",
        iterations: all.len(),
        notes: vec![
            "of each ramp the error is what the current adds within one sample; that of the mean comes from their spread".into(),
        ],
        values,
        pack: None,
        sensors: Vec::new(),
        design: None,
    })
}
