//! Co-Simulation: runs from the FMU's start.

use std::sync::Arc;

use trueup_fmi_import::{
    AnyInstance, ExperimentSetup, ImportError, InstanceOptions, UnpackedFmu, UsedInterface, fmi3,
};

use super::{Experiment, FmuCapabilities, ObservedMotion, SensitivityRows, effort, failed, velocity};
use crate::error::PortsError;
use crate::kind::PortKind;
use crate::quantity::FmuQuantities;
use crate::words::{self, NamedSite};

/// Steps of an input that are tried, in its nominal value.
const LADDER: std::ops::RangeInclusive<i32> = -4..=6;
/// Change of a velocity that is enough, rad/s or m/s.
const ENOUGH: f64 = 1e-3;
/// Steps of all inputs together, in those that move something: friction that is smoothed about rest is at its level, too.
const TOGETHER: f64 = 10.0;
/// Growth of a velocity from one step to two: 2 where the input accelerates it at once, 4 through a damper, 8 through a spring.
const AT_ONCE: f64 = 3.0;
/// Steps of a run that shows motion.
const LONG: usize = 100;

/// Runs one instance again and again.
pub(super) struct RepeatedRun<'a> {
    fmu: &'a Arc<UnpackedFmu>,
    all: &'a FmuQuantities,
    start: f64,
    used: Option<AnyInstance>,
}

impl<'a> RepeatedRun<'a> {
    pub(super) fn new(fmu: &'a Arc<UnpackedFmu>, all: &'a FmuQuantities) -> Self {
        Self { fmu, all, start: fmu.description().experiment.start_time.unwrap_or(0.0), used: None }
    }

    /// Initialised with these inputs.
    pub(super) fn begin(&mut self, u: &[f64]) -> Result<AnyInstance, ImportError> {
        // One that cannot be reset is dropped.
        let again = self.used.take().and_then(|mut i| i.reset().is_ok().then_some(i));
        let mut instance = match again {
            Some(instance) => instance,
            None => AnyInstance::co_simulation(
                self.fmu,
                InstanceOptions::default(),
                fmi3::CoSimulationOptions::default(),
            )?,
        };
        instance
            .enter_initialization_mode(ExperimentSetup { start: self.start, ..ExperimentSetup::default() })?;
        if !u.is_empty() {
            instance.set_float64(&self.all.references[0], u)?;
        }
        instance.exit_initialization_mode()?;
        Ok(instance)
    }

    pub(super) fn outputs(&self, instance: &mut AnyInstance) -> Result<Vec<f64>, ImportError> {
        let mut y = vec![0.0; self.all.outputs.len()];
        if !y.is_empty() {
            instance.get_float64(&self.all.references[1], &mut y)?;
        }
        y.iter_mut().zip(&self.all.outputs).for_each(|(y, q)| *y *= q.factor);
        Ok(y)
    }

    /// Outputs at the start and after each step; fewer where the FMU ends the run.
    fn run(&mut self, u: &[f64], steps: usize, step: f64) -> Result<SensitivityRows, ImportError> {
        let mut instance = self.begin(u)?;
        let mut rows = vec![self.outputs(&mut instance)?];
        for k in 0..steps {
            let done = instance.step(self.start + k as f64 * step, step, true).map_err(|e| *e)?;
            if done.is_some_and(|s| s.terminate || s.discarded || s.early) {
                break;
            }
            let y = self.outputs(&mut instance)?;
            if y.iter().any(|v| !v.is_finite()) {
                break;
            }
            rows.push(y);
        }
        self.used = Some(instance);
        Ok(rows)
    }
}

pub(super) fn run(fmu: &Arc<UnpackedFmu>, all: &FmuQuantities) -> Result<Experiment, PortsError> {
    let fail = failed(fmu);
    let d = fmu.description();
    let e = &d.experiment;
    let span =
        e.stop_time.map(|stop| stop - e.start_time.unwrap_or(0.0)).filter(|s| *s > 0.0 && s.is_finite());
    let interface = d.co_simulation.clone().unwrap_or_default();
    let given = interface.fixed_internal_step_size.or(e.step_size).filter(|h| *h > 0.0 && h.is_finite());
    let long = given.unwrap_or_else(|| span.map_or(1e-3, |s| s / 1000.0));
    // An FMU that steps on a grid of its own shows nothing between its points.
    let fixed = interface.fixed_internal_step_size.is_some()
        || !interface.can_handle_variable_communication_step_size;
    let mut short = if fixed { long } else { long / 10.0 };

    let mut runs = RepeatedRun::new(fmu, all);
    let u0: Vec<f64> = all.inputs.iter().map(|q| q.start).collect();
    let mut base = runs.run(&u0, 2, short).map_err(&fail)?;
    if base.len() < 3 && short < long {
        short = long;
        base = runs.run(&u0, 2, short).map_err(&fail)?;
    }
    if base.len() < 3 {
        let why =
            "it does not make two steps from its start, or its outputs are not finite; see `trueup simulate`";
        return Err(PortsError::Fmu(format!("{}: {why}", fmu.file().display())));
    }
    let (inputs, outputs) = (all.inputs.len(), all.outputs.len());
    let known = all.outputs.iter().any(velocity);
    let watched: Vec<usize> = (0..outputs).filter(|k| !known || velocity(&all.outputs[*k])).collect();
    let mut mobility = vec![vec![0.0; inputs]; outputs];
    let mut direct = mobility.clone();
    let (mut amplitudes, mut late) = (vec![None; inputs], vec![false; inputs]);
    let efforts: Vec<usize> = (0..inputs).filter(|j| effort(&all.inputs[*j])).collect();
    loop {
        for j in &efforts {
            let by = amplitude(&mut runs, &u0, &base, *j, short, &watched).map_err(&fail)?;
            amplitudes[*j] = by.map(|by| by * all.inputs[*j].factor);
        }
        if efforts.is_empty() || short >= long || amplitudes.iter().any(Option::is_some) {
            break;
        }
        short = long;
        base = runs.run(&u0, 2, short).map_err(&fail)?;
    }
    let stepped = |from: &[f64], j: usize, times: f64| -> Vec<f64> {
        let mut u = from.to_vec();
        u[j] += times * amplitudes[j].unwrap_or(1.0) / all.inputs[j].factor;
        u
    };
    // All of them together: friction holds nothing, and is in both runs, so that their difference is without it.
    let moving: Vec<usize> = (0..inputs).filter(|j| amplitudes[*j].is_some()).collect();
    let together = moving.iter().fold(u0.clone(), |u, j| stepped(&u, *j, TOGETHER));
    let rows = runs.run(&together, 2, short).map_err(&fail)?;
    for j in &moving {
        let more = runs.run(&stepped(&together, *j, 1.0), 2, short).map_err(&fail)?;
        if rows.len() < 3 || more.len() < 3 {
            continue;
        }
        let by = amplitudes[*j].unwrap_or(1.0);
        let difference = |k: usize, step: usize| more[step][k] - rows[step][k];
        let largest = |step: usize| watched.iter().map(|k| difference(*k, step).abs()).fold(0.0, f64::max);
        late[*j] = largest(2) > 0.0 && largest(1) < 1e-6 * largest(2);
        let at = if late[*j] { 2 } else { 1 };
        for k in 0..outputs {
            direct[k][*j] = difference(k, 0) / by;
            let [first, second] = [difference(k, 1), difference(k, 2)].map(|d| (d - difference(k, 0)).abs());
            if at == 2 || second <= AT_ONCE * first {
                mobility[k][*j] = (difference(k, at) - difference(k, at - 1)) / (by * short);
            }
        }
    }
    let mut alone = vec![None; inputs];
    let mut paths = vec![(short, runs.run(&together, LONG, short).map_err(&fail)?)];
    for j in &moving {
        let u = stepped(&u0, *j, 2.0);
        paths.push((short, runs.run(&u, LONG, short).map_err(&fail)?));
        // A joint's spring shows itself later; a body has none.
        let q = &all.inputs[*j];
        let body = matches!(words::site(&q.name), Some(NamedSite::Base | NamedSite::Tip));
        if matches!(q.kind, PortKind::Torque | PortKind::Current) && !body {
            alone[*j] = Some((long, runs.run(&u, LONG, long).map_err(&fail)?));
        }
    }
    let offers = FmuCapabilities {
        directional: interface.provides_directional_derivatives,
        indicators: d.event_indicators(),
        ..FmuCapabilities::default()
    };
    Ok(Experiment {
        interface: UsedInterface::CoSimulation,
        offers,
        mobilities: vec![mobility],
        direct,
        amplitudes,
        late,
        motion: ObservedMotion::Paths(paths),
        rest: None,
        alone,
    })
}

/// The first step of this input that moves a velocity, in its unit.
fn amplitude(
    runs: &mut RepeatedRun,
    u0: &[f64],
    base: &SensitivityRows,
    j: usize,
    step: f64,
    watched: &[usize],
) -> Result<Option<f64>, ImportError> {
    for power in LADDER {
        let by = runs.all.inputs[j].nominal * 10f64.powi(power);
        let mut u = u0.to_vec();
        u[j] += by;
        let rows = runs.run(&u, 2, step)?;
        let (Some(row), Some(first)) = (rows.get(2), base.get(2)) else { return Ok(None) };
        if watched.iter().any(|k| (row[*k] - first[*k]).abs() >= ENOUGH) {
            return Ok(Some(by));
        }
    }
    Ok(None)
}
