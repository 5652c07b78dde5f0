//! The reference result that an FMU carries: its model run natively, without the C boundary.

use crate::FmuModel;
use std::fmt::Write as _;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{Causality, ModelTable, Storage, TableVariable};
use trueup_numerics::driver::{
    DriveError, Driver, DriverMemory, DriverOptions, DriverState, Flow, StepInputs,
};
use trueup_numerics::hybrid::At;

/// An input gets a value at a time and keeps it; times in s, in order.
pub type Schedule<'a> = &'a [(f64, &'a str, f64)];

/// Inputs and outputs as CSV: one column per element, every double so that it reads back bit-equal. A jump of
/// an input is two rows of one time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReferenceSeries {
    /// `time` and the inputs.
    pub inputs: String,
    /// `time` and the outputs.
    pub outputs: String,
}

/// Relative tolerance of the native run.
const TOLERANCE: f64 = 1e-13;

/// Steps, accepted and rejected, times states after which the run of an untested robot is given up: a second or two.
pub const WORK: usize = 500_000;

/// Largest change of a rate of the model by a unit of the input `name` at its start, in SI units; `None`: there is no such
/// input, or it acts on no rate there.
///
/// # Errors
/// A configuration that cannot be had.
pub fn response<M: FmuModel>(configuration: &Configuration, name: &str) -> Result<Option<f64>, String> {
    let model = M::build(configuration)?;
    let mut table = model.table();
    table.apply(&configuration.start)?;
    let (p, n) = (table.parameter_starts(), model.sizes());
    let Some((input, _)) = elements(&table, Causality::Input).into_iter().find(|(_, e)| e == name) else {
        return Ok(None);
    };
    let (mut x, mut u, mut modes) = (vec![0.0; n.states], table.input_starts(), vec![0; n.modes]);
    model.start(&p, &mut x);
    model.start_modes(At { t: 0.0, x: &x, u: &u, p: &p, modes: &vec![0; n.modes] }, &mut modes);
    let mut rates = [vec![0.0; n.states], vec![0.0; n.states]];
    for dx in &mut rates {
        model.rates(At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes }, dx);
        u[input] += 1.0;
    }
    let change = rates[0].iter().zip(&rates[1]).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max);
    Ok(Some(change).filter(|change| change.is_finite() && *change > 0.0))
}

/// Runs the model of a configuration over its default experiment under `schedule`, with at most `work` steps times states.
///
/// # Errors
/// The configuration or the run failed: why.
pub fn reference<M: FmuModel>(
    configuration: &Configuration,
    schedule: Schedule,
    work: usize,
) -> Result<ReferenceSeries, String> {
    let model = M::build(configuration)?;
    let mut table = model.table();
    table.apply(&configuration.start)?;
    let p = table.parameter_starts();
    model.check(&p).map_err(|(_, message)| message)?;
    let steps = (table.experiment.stop_time / table.experiment.step_size).round() as usize;
    let times: Vec<f64> = (0..=steps).map(|k| k as f64 * table.experiment.step_size).collect();
    let start = table.input_starts();
    let elements = elements(&table, Causality::Input);
    let inputs_at = |t: f64, u: &mut [f64]| {
        u.copy_from_slice(&start);
        for (_, name, value) in schedule.iter().filter(|(time, _, _)| *time <= t) {
            if let Some((i, _)) = elements.iter().find(|(_, element)| element == name) {
                u[*i] = *value;
            }
        }
    };
    let n = model.sizes();
    let most = work / n.states.max(1);
    let options = DriverOptions { tolerance: TOLERANCE, ..DriverOptions::default() };
    let options = DriverOptions { max_steps: most.min(options.max_steps), ..options };
    let mut taken = 0;
    let mut driver = Driver::new(n, &nominals(&table), options);
    let (mut t, mut memory) = (0.0, DriverMemory::default());
    let (mut x, mut u, mut modes) = (vec![0.0; n.states], vec![0.0; n.inputs], vec![0; n.modes]);
    let mut y = vec![0.0; n.outputs];
    let mut s =
        DriverState { t: &mut t, x: &mut x, u: &mut u, p: &p, modes: &mut modes, memory: &mut memory };
    let failed = |e: DriveError| e.to_string();

    let outputs = self::elements(&table, Causality::Output);
    let mut csv = header(&outputs);
    for (k, time) in times.iter().enumerate() {
        // Inputs are held from one row to the next: they jump between steps, never within one.
        if k == 0 {
            inputs_at(0.0, s.u);
            driver.initialise(&model, &mut s).map_err(failed)?;
        } else {
            let reached = driver
                .advance_to(&model, &mut s, *time, StepInputs::Hold, &mut |_| Flow::Continue)
                .map_err(failed)?;
            taken += reached.accepted + reached.rejected;
            if taken > most {
                return Err(failed(DriveError::MaxSteps { t: *time, steps: most }));
            }
            inputs_at(*time, s.u);
            driver.handle_event(&model, &mut s).map_err(failed)?;
        }
        model.outputs(At { t: *s.t, x: s.x, u: s.u, p: s.p, modes: s.modes }, &mut y);
        row(&mut csv, *time, outputs.iter().map(|(i, _)| y[*i]));
    }
    Ok(ReferenceSeries {
        inputs: stairs(schedule, &elements, &start, &inputs_at, table.experiment.stop_time),
        outputs: csv,
    })
}

/// Storage index and name of every element of that causality.
fn elements(table: &ModelTable, causality: Causality) -> Vec<(usize, String)> {
    let base = |v: &TableVariable| match v.storage {
        Storage::Input(i) | Storage::Output(i) => Some(i),
        _ => None,
    };
    let of = |v: &TableVariable| {
        base(v).map(|b| (0..v.len()).map(|i| (b + i, v.element_name(i))).collect::<Vec<_>>())
    };
    table.variables.iter().filter(|v| v.causality == causality).filter_map(of).flatten().collect()
}

/// Typical magnitude of each state.
pub fn nominals(table: &ModelTable) -> Vec<f64> {
    let states = table.variables.iter().filter(|v| matches!(v.storage, Storage::State(_)));
    let mut placed: Vec<(usize, f64)> = states
        .flat_map(|v| {
            let Storage::State(first) = v.storage else { return Vec::new() };
            (0..v.len()).map(|i| (first + i, v.nominal.unwrap_or(1.0))).collect()
        })
        .collect();
    placed.sort_by_key(|(i, _)| *i);
    placed.into_iter().map(|(_, nominal)| nominal).collect()
}

fn header(elements: &[(usize, String)]) -> String {
    let mut csv = String::from("time");
    for (_, name) in elements {
        // Names with a comma (two indices) are quoted.
        let _ = if name.contains(',') { write!(csv, ",\"{name}\"") } else { write!(csv, ",{name}") };
    }
    csv.push('\n');
    csv
}

fn row(csv: &mut String, t: f64, values: impl Iterator<Item = f64>) {
    let _ = write!(csv, "{t:?}");
    values.for_each(|v| {
        let _ = write!(csv, ",{v:?}");
    });
    csv.push('\n');
}

fn stairs(
    schedule: Schedule,
    elements: &[(usize, String)],
    start: &[f64],
    inputs_at: &dyn Fn(f64, &mut [f64]),
    stop: f64,
) -> String {
    let mut csv = header(elements);
    let mut now = start.to_vec();
    inputs_at(0.0, &mut now);
    row(&mut csv, 0.0, elements.iter().map(|(i, _)| now[*i]));
    let mut changes: Vec<f64> =
        schedule.iter().map(|(t, _, _)| *t).filter(|t| *t > 0.0 && *t < stop).collect();
    changes.dedup();
    for t in changes {
        row(&mut csv, t, elements.iter().map(|(i, _)| now[*i]));
        inputs_at(t, &mut now);
        row(&mut csv, t, elements.iter().map(|(i, _)| now[*i]));
    }
    row(&mut csv, stop, elements.iter().map(|(i, _)| now[*i]));
    csv
}
