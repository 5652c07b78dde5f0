//! Stages of an arm's case compared with golden numbers.

use std::error::Error;
use std::path::Path;

use serde_json::Value;
use trueup_estimation::innovations::evidence::AmplitudePriors;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::TrajectoryPlant;
use trueup_models::plants::{self, PlantStructure};
use trueup_signals::{Loaded, ParameterValue};

/// What is off, one line each.
#[derive(Default)]
pub(super) struct OffNumbers(pub(super) Vec<String>);

impl OffNumbers {
    /// Within a tolerance, relative to the largest of the golden numbers.
    pub(super) fn close(&mut self, what: &str, own: &[f64], golden: &Value, tolerance: f64) {
        let golden = flat(golden);
        let size = golden.iter().fold(1e-300, |m: f64, g| m.max(g.abs()));
        let off = own.iter().zip(&golden).map(|(a, b)| (a - b).abs() / size).fold(0.0, f64::max);
        if own.len() != golden.len() {
            self.0.push(format!("{what}: {} numbers, golden {}", own.len(), golden.len()));
        } else if !(off <= tolerance) {
            self.0.push(format!("{what}: off by {off:.1e}, {tolerance:.0e} is allowed"));
        }
    }
    pub(super) fn within(&mut self, what: &str, own: f64, golden: &Value, tolerance: f64) {
        let golden = golden.as_f64().unwrap_or(f64::NAN);
        if !((own - golden).abs() <= tolerance) {
            self.0.push(format!("{what}: {own}, golden {golden}"));
        }
    }
}

fn flat(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(all) => all.iter().flat_map(flat).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}

fn list(v: &Value) -> &[Value] {
    v.as_array().map_or(&[], Vec::as_slice)
}

/// Our name of a golden parameter.
fn parameter(golden: &str) -> String {
    let begin = golden.trim_end_matches(|c: char| c.is_ascii_digit());
    let of = &golden[begin.len()..];
    match (begin, of) {
        ("m", "0") => "baseMass".into(),
        ("I", "0") => "baseInertia".into(),
        ("m", j) => format!("linkMass[{j}]"),
        ("I", j) => format!("linkInertia[{j}]"),
        ("sx", j) => format!("linkCenterOfMass[{j},1]"),
        ("sy", j) => format!("linkCenterOfMass[{j},2]"),
        ("Im", j) => format!("motorInertia[{j}]"),
        ("K", j) => format!("jointStiffness[{j}]"),
        ("D", j) => format!("jointDamping[{j}]"),
        _ => golden.into(),
    }
}

/// A frame of an arm's case.
pub(super) fn frame_of(loaded: &Loaded) -> Result<TrajectoryFrame, Box<dyn Error>> {
    let case = &loaded.case;
    let flexible: Vec<bool> = case.elements("jointFlexible").iter().filter_map(|v| v.boolean()).collect();
    let text = |name: &str| match case.parameters.get(name) {
        Some(ParameterValue::Text(item)) => Some(item.as_str()),
        _ => None,
    };
    let plant = plants::build(&PlantStructure {
        model: case.model.clone(),
        flexible,
        fixed_base: text("base") == Some("fixed"),
        payload: case.payload.map(|l| l - 1),
        ..PlantStructure::default()
    })
    .map_err(|e| format!("{e:?}"))?;
    let theta: Vec<f64> = (plant.table().parameters.iter())
        .map(|q| {
            let item = text(&q.name).and_then(|t| q.items.iter().position(|i| i.0 == t));
            let number = case.number(&q.name).or_else(|| item.map(|k| k as f64 + 1.0));
            number.unwrap_or_else(|| q.neutral.unwrap_or(q.start))
        })
        .collect();
    let plant = TrajectoryPlant::new(plant, &theta)?;
    Ok(TrajectoryFrame::new(loaded, plant, &theta, &[])?)
}

fn intake(frame: &TrajectoryFrame, golden: &Value, said: &mut OffNumbers) {
    let names: Vec<&str> = frame.intake.channels.iter().map(|c| c.name.as_str()).collect();
    let golden_names: Vec<&str> = list(&golden["channels"]).iter().filter_map(Value::as_str).collect();
    if names != golden_names {
        said.0.push(format!("channels {names:?}, golden {golden_names:?}"));
    }
    let variance: Vec<f64> = frame.intake.channels.iter().map(|c| c.variance).collect();
    said.close("R", &variance, &golden["R"], 1e-10);
    said.close("usual torque", &frame.intake.usual_torque, &golden["usual_torque"], 1e-10);
    let indices = |all: &[usize]| all.iter().map(|k| *k as f64).collect::<Vec<_>>();
    said.close("joints", &indices(&frame.plant.joints), &golden["coordinates"]["joints"], 0.0);
    said.close("motors", &indices(&frame.plant.drives), &golden["coordinates"]["motors"], 0.0);
    for (name, members) in golden["groups"].as_object().into_iter().flatten() {
        let own = frame.intake.groups.iter().find(|g| g.0 == *name);
        said.close(&format!("group {name}"), &own.map_or_else(Vec::new, |g| indices(&g.1)), members, 0.0);
    }
    let table = &frame.plant.plant().table().parameters;
    let own: Vec<(String, f64, f64, bool)> = frame
        .unknown
        .iter()
        .map(|u| (table[u.index].name.clone(), u.unit, u.deviation, u.logarithm))
        .collect();
    let all = list(&golden["unknowns"]);
    if own.len() != all.len() {
        said.0.push(format!("{} unknowns, golden {}: {own:?}", own.len(), all.len()));
    }
    for u in all {
        let name = parameter(u["name"].as_str().unwrap_or(""));
        let golden = (name.clone(), u["unit"].as_f64(), u["doubt"].as_f64(), u["logarithm"].as_bool());
        if !own.iter().any(|o| (o.0.clone(), Some(o.1), Some(o.2), Some(o.3)) == golden) {
            said.0.push(format!("unknown {golden:?} is not there"));
        }
    }
    for (k, (run, g)) in frame.runs.iter().zip(list(&golden["recordings"])).enumerate() {
        let (r, n, width) = (&run.readings, &run.nodes, frame.channels());
        let by = |f: &dyn Fn(usize) -> f64, width: usize, length: usize| -> Vec<f64> {
            (0..width).map(|c| (0..length).map(|t| f(width * t + c)).sum()).collect()
        };
        let inputs = n.inputs.len();
        let of_readings = |f: &dyn Fn(usize) -> f64| by(f, width, n.len());
        let of_torque = |f: &dyn Fn(usize) -> f64| by(f, inputs, n.len() * n.parts);
        let own: [(&str, Vec<f64>, &Value); 16] = [
            ("N", vec![n.len() as f64], &g["N"]),
            ("parts", vec![n.parts as f64], &g["parts"]),
            ("t", n.time[..3].to_vec(), &g["t"]["first"]),
            ("t sum", vec![n.time.iter().sum()], &g["t"]["sum"]),
            ("dt sum", vec![n.step.iter().sum()], &g["dt_sum"]),
            ("torque", n.torque[..3 * n.parts * inputs].to_vec(), &g["torque"]["first"]),
            ("torque sum", of_torque(&|i| n.torque[i]), &g["torque"]["sum"]),
            ("torque squares", of_torque(&|i| n.torque[i].powi(2)), &g["torque"]["squares"]),
            ("y", r.mean[..3 * width].to_vec(), &g["y"]["first"]),
            ("y sum", of_readings(&|i| r.mean[i]), &g["y"]["sum"]),
            ("n sum", of_readings(&|i| r.count[i]), &g["n"]["sum"]),
            ("m1", r.moments[..3 * width].iter().map(|m| m[0]).collect(), &g["m1"]["first"]),
            ("m1 squares", of_readings(&|i| r.moments[i][0].powi(2)), &g["m1"]["squares"]),
            ("m2 sum", of_readings(&|i| r.moments[i][1]), &g["m2_sum"]),
            ("counted", of_readings(&|i| f64::from(u8::from(r.counted[i]))), &g["counted"]),
            ("averaged", vec![r.merged], &g["averaged"]),
        ];
        // Golden numbers have twelve digits.
        own.iter().for_each(|(name, own, g)| said.close(&format!("intake {k} {name}"), own, g, 2e-11));
    }
}

/// Puts the golden trajectory and its parameters into a frame.
pub(super) fn freeze(
    frame: &mut TrajectoryFrame,
    golden: &Value,
    said: &mut OffNumbers,
) -> Result<(), Box<dyn Error>> {
    let table = frame.plant.plant().table().clone();
    for (name, value) in golden["parameters"].as_object().into_iter().flatten() {
        let Some(k) = table.parameter(&parameter(name)) else { continue };
        frame.theta[k] = value.as_f64().unwrap_or(f64::NAN);
    }
    let floors: Vec<f64> = frame.bounds().iter().map(|b| b[0]).collect();
    said.close("floors", &floors, &golden["floors"], 1e-10);
    said.close("white", &frame.white, &golden["white"], 1e-10);
    said.close("P0", &frame.first_deviation, &golden["P0"], 0.0);
    frame.intensities = flat(&golden["intensities"]);
    for (run, g) in frame.runs.iter_mut().zip(list(&golden["recordings"])) {
        run.put(flat(&g["X"]), flat(&g["G"]), flat(&g["own"]));
    }
    frame.linearise(&[])?;
    Ok(())
}

/// Products of columns in single precision, relative to their sizes; what they decide has a condition of some hundreds.
const SINGLE: f64 = 1e-5;

/// Steps, readings, gains, scores, columns and evidence along the frozen trajectory; `of_gains`: tolerance of gains.
fn linear(
    frame: &mut TrajectoryFrame,
    golden: &Value,
    of_gains: f64,
    said: &mut OffNumbers,
) -> Result<(), Box<dyn Error>> {
    let (n, channels) = (frame.coordinates(), frame.channels());
    let size = 3 * n + channels;
    let (columns, priors) = frame.nuisances();
    let q = frame.intensities.clone();
    let gains = frame.all_gains(&q, true);
    let packed = frame.packed(&columns);
    let (gram, found) = frame.evidence_with(&packed, &priors, &gains);
    let extra = frame.own_forces(&columns, &found.amplitudes);
    let smoothed = frame.smoothed(&gains, Some(&extra));
    for g in list(&golden["nodes"]) {
        let (k, t) =
            (g["recording"].as_u64().unwrap_or(0) as usize, g["node"].as_u64().unwrap_or(0) as usize);
        let (run, gain) = (&frame.runs[k], &gains[k]);
        let step = &gain.input.steps[t];
        let rows = |all: &[f64], width: usize, kept: usize, count: usize| -> Vec<f64> {
            (0..count).flat_map(|i| all[width * i..width * i + kept].to_vec()).collect()
        };
        let at = channels * t;
        let mut close = |what: &str, own: &[f64], tolerance: f64| {
            said.close(&format!("{what} of recording {k} at node {t}"), own, &g[what], tolerance);
        };
        close("acceleration", &run.accelerations[2 * n * t..2 * n * (t + 1)], 1e-8);
        close("A", &rows(&step.a, size, 2 * n, 2 * n), 1e-5);
        close("B", &step.b[..2 * n * n], 1e-5);
        close("H", &rows(&gain.input.rows.h[size * at..], size, 2 * n, channels), 1e-9);
        close("model_reads", &run.model_readings[at..at + channels], 1e-9);
        close("gains", &gain.gain[size * at..size * (at + channels)], of_gains);
        let variance =
            (at..at + channels).map(|i| if gain.input.variance[i] > 0.0 { gain.variance[i] } else { 0.0 });
        close("innovation_variance", &variance.collect::<Vec<_>>(), of_gains);
        let scores = &smoothed[k].scores[(n + channels) * t..(n + channels) * (t + 1)];
        close("score_force", &scores[..n], of_gains.max(1e-4));
        close("score_reading", &scores[n..], of_gains.max(1e-4));
        let residual: Vec<f64> =
            (at..at + channels)
                .map(|i| {
                    if run.readings.count[i] > 0.0 {
                        run.readings.mean[i] - run.model_readings[i]
                    } else {
                        0.0
                    }
                })
                .collect();
        // Differences of numbers of twelve digits.
        let size = run.model_readings[at..at + channels].iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let off = residual.iter().zip(flat(&g["residual"])).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        said.within(&format!("residual of recording {k} at node {t}"), off / size, &Value::from(0.0), 1e-10);
        let state = run.state(t).iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        let off = step.defect.iter().zip(flat(&g["c"])).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        said.within(&format!("c of recording {k} at node {t}"), off / state, &Value::from(0.0), 1e-9);
    }
    let table = &frame.plant.plant().table().parameters;
    let of = |name: &str| {
        let name = parameter(name);
        frame.unknown.iter().position(|u| table[u.index].name == name)
    };
    for (name, g) in golden["parameter_columns_of_recording_1"].as_object().into_iter().flatten() {
        let Some(k) = of(name) else {
            said.0.push(format!("{name} is no unknown"));
            continue;
        };
        let mut series = vec![vec![0.0; frame.runs[0].nodes.len()]; n];
        for s in &columns[k][0].forces {
            series[s.on] = s.values.to_vec();
        }
        let first: Vec<f64> = (0..3).flat_map(|t| series.iter().map(move |s| s[t])).collect();
        let sums: Vec<f64> = series.iter().map(|s| s.iter().sum()).collect();
        said.close(&format!("column of {name}"), &first, &g["first"], 1e-6);
        said.close(&format!("sum of the column of {name}"), &sums, &g["sum"], 1e-6);
    }
    // Our parameters are in another order.
    let order: Vec<usize> = golden["order"]
        .as_array()
        .map_or_else(Vec::new, |names| names.iter().filter_map(|g| of(g.as_str().unwrap_or(""))).collect());
    let own = |all: &[f64]| order.iter().map(|k| all[*k]).collect::<Vec<_>>();
    let AmplitudePriors { mean, deviation, .. } = &priors;
    said.close("prior mean", &own(mean), &golden["prior_mean"], 1e-9);
    said.close("prior deviation", &own(deviation), &golden["prior_sd"], 1e-9);
    let place: Vec<usize> = std::iter::once(0).chain(order.iter().map(|k| k + 1)).collect();
    let all = list(&golden["gram"]);
    for (i, row) in all.iter().enumerate() {
        let row = flat(row);
        for (j, g) in row.iter().enumerate() {
            let size = (flat(&all[i])[i] * flat(&all[j])[j]).sqrt().max(1e-300);
            let own = gram.product(place[i], place[j]);
            if !((own - g).abs() <= SINGLE * size) {
                said.0
                    .push(format!("Gram {i} {j}: {own}, golden {g}, off by {:.1e}", (own - g).abs() / size));
            }
        }
    }
    said.within("sum of log S", gram.log_variance, &golden["log_S"], 1e-2);
    said.within("counted", found.count as f64, &golden["counted"], 0.0);
    said.within("evidence", found.log, &golden["evidence"], 0.1);
    said.close("amplitudes", &own(&found.amplitudes), &golden["amplitudes"], 1e3 * SINGLE);
    Ok(())
}

/// From the readings on: nominal and refitted model.
fn fits(frame: &mut TrajectoryFrame, golden: &Value, said: &mut OffNumbers) -> Result<(), Box<dyn Error>> {
    frame.start()?;
    let q = frame.intensities.clone();
    let mut higher = |what: &str, own: f64, golden: &Value| {
        let golden = golden.as_f64().unwrap_or(f64::NAN);
        if !(own >= golden - 1.0) {
            said.0.push(format!("{what}: {own}, golden {golden}"));
        }
    };
    let nominal = frame.clone().fit(&|_| Vec::new(), None, &q, 4, true)?;
    higher("L of the nominal model", nominal.evidence, &golden["L_nominal"]);
    let refitted = frame.fit(&|_| Vec::new(), None, &q, 7, false)?;
    higher("L of the refitted model", refitted.evidence, &golden["L_parameters"]);
    Ok(())
}

/// What is off; `whole`: with fits from the readings on.
pub(super) fn stages(
    loaded: &Loaded,
    folder: &Path,
    of_gains: f64,
    whole: bool,
) -> Result<Vec<String>, Box<dyn Error>> {
    let read = |name: &str| -> Result<Value, Box<dyn Error>> {
        Ok(serde_json::from_str(&std::fs::read_to_string(folder.join(name))?)?)
    };
    let mut said = OffNumbers::default();
    let mut frame = frame_of(loaded)?;
    let unknowns = read("intake.json")?;
    intake(&frame, &unknowns, &mut said);
    let mut frozen = frame.clone();
    freeze(&mut frozen, &read("trajectory.json")?, &mut said)?;
    let mut numbers = read("linear.json")?;
    numbers["order"] = list(&unknowns["unknowns"]).iter().map(|u| u["name"].clone()).collect();
    linear(&mut frozen, &numbers, of_gains, &mut said)?;
    if whole {
        fits(&mut frame, &read("verdict.json")?, &mut said)?;
    }
    Ok(said.0)
}
