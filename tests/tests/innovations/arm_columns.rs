//! Columns of effects along an arm's frozen trajectory compared with golden numbers.

use std::error::Error;
use std::path::Path;

use serde_json::Value;
use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::TrajectoryPlant;
use trueup_hypotheses::innovations::chain_along::{ChainSizes, FrameMechanics, along_chain};
use trueup_hypotheses::innovations::laws::arm_law_of;
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_models::plants;
use trueup_signals::Loaded;

use super::trajectory::{OffNumbers, frame_of, freeze};

/// Relative to the largest value of a series.
const TOLERANCE: f64 = 1e-6;
/// Of products of columns: single precision on both sides.
const PRODUCTS: f64 = 1e-5;

fn numbers(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(all) => all.iter().flat_map(numbers).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}

fn list(v: &Value) -> &[Value] {
    v.as_array().map_or(&[], Vec::as_slice)
}

fn text<'a>(v: &'a Value, key: &str) -> &'a str {
    v[key].as_str().unwrap_or("")
}

/// Our shape of a golden one; `duration`: of the longest recording.
fn shape_of(effect: &str, place: &str, golden: &Value, duration: f64) -> LawShape {
    const PLACES: [&str; 6] = ["actuator", "motor-friction", "transmission", "load", "base", "tip"];
    let place = PLACES.iter().find(|p| **p == place).copied().unwrap_or("sensor");
    let number = |name: &str| golden[name].as_f64();
    let indices = |v: &Value| numbers(v).iter().map(|k| *k as usize).collect::<Vec<_>>();
    const NAMES: [(&str, &str); 16] = [
        ("d", "d"),
        ("lag", "lag"),
        ("two", "two"),
        ("L", "limit"),
        ("h", "h"),
        ("x", "x"),
        ("vs", "speed"),
        ("p", "p"),
        ("gap", "gap"),
        ("b", "b"),
        ("b2", "b2"),
        ("f", "f"),
        ("z", "z"),
        ("at", "at"),
        ("v0", "v0"),
        ("n", "n"),
    ];
    let mut values: Vec<(&str, f64)> =
        NAMES.iter().filter_map(|(golden, own)| Some((*own, number(golden)?))).collect();
    let form = match (effect, text(golden, "kind")) {
        ("actuator-lag", _) => {
            let form = ["lag", "two"].into_iter().find(|f| number(f).is_some()).unwrap_or("delay");
            values.iter_mut().filter(|v| v.0 == "d").for_each(|v| v.0 = "delay");
            form
        }
        ("sensor-delay", _) => "delay",
        ("sensor-drift", kind) => {
            match (kind, number("T")) {
                ("late", Some(time)) => values.push(("k", time / duration)),
                (_, Some(time)) => values.push(("time", time)),
                _ => {}
            }
            ["late", "wander"].into_iter().find(|f| *f == kind).unwrap_or(if kind == "settle" {
                "time"
            } else {
                "line"
            })
        }
        ("nonlinear-stiffness", kind) => if kind == "knees" { "knees" } else { "power" },
        ("base-drag", kind) => ["viscous", "both"].into_iter().find(|f| *f == kind).unwrap_or("dry"),
        ("base-thrust", _) => if number("body") == Some(1.0) { "body" } else { "ground" },
        ("load-friction" | "motor-friction", _) => "length",
        ("stribeck-friction", _) => {
            values.push(("k", 1.0));
            "stribeck"
        }
        ("flexible-link", _) => "hinge",
        _ => "",
    };
    let mut shape = LawShape::new(place, form, &values).at(&indices(&golden["j"])).of(&indices(&golden["ch"]));
    for p in list(&golden["pulses"]) {
        let p = numbers(p);
        shape.pulses.push([p[1], p[2]]);
        if p[0] >= 0.0 {
            shape.only.push(p[0] as usize);
        }
    }
    shape
}

/// Forces and errors of one part against golden ones: first values, sums, squares.
fn part(own: &ColumnPart, golden: &Value, what: &str, said: &mut OffNumbers) {
    for (all, key) in [(&own.forces, "forces"), (&own.readings, "errors")] {
        let golden = golden[key].as_object();
        let series = |on: usize| -> Vec<f64> {
            let mut sum = Vec::new();
            for s in all.iter().filter(|s| s.on == on) {
                sum.resize(s.values.len(), 0.0);
                sum.iter_mut().zip(s.values.iter()).for_each(|(x, v): (&mut f64, &f64)| *x += s.weight * v);
            }
            sum
        };
        for (on, g) in golden.into_iter().flatten() {
            let own = series(on.parse().unwrap_or(usize::MAX));
            let size = own.iter().fold(1e-300, |m: f64, v| m.max(v.abs()));
            let first = numbers(&g["first"]);
            let begins = own.iter().zip(&first).map(|(a, b)| (a - b).abs() / size).fold(0.0, f64::max);
            let total: f64 = own.iter().map(|v| v.abs()).sum();
            let sum = g["sum"].as_f64().unwrap_or(f64::NAN);
            let sums = (own.iter().sum::<f64>() - sum).abs() / total.max(1e-300);
            let squares: f64 = own.iter().map(|v| v * v).sum();
            let golden = g["squares"].as_f64().unwrap_or(f64::NAN);
            let squared = if golden == 0.0 { squares } else { (squares / golden - 1.0).abs() };
            for (name, off) in [("first values", begins), ("sum", sums), ("squares", 0.5 * squared)] {
                if !(off <= TOLERANCE) {
                    said.0.push(format!("{what}, {key} {on}: {name} off by {off:.1e}"));
                }
            }
        }
        let there = |on: usize| golden.is_some_and(|g| g.contains_key(&on.to_string()));
        for s in all.iter().filter(|s| !there(s.on) && s.values.iter().any(|v| *v != 0.0)) {
            said.0.push(format!("{what}: {key} {} are none of the golden ones", s.on));
        }
    }
}

/// Order of our amplitudes by golden ones: companions of a cable at the load stand in another order.
fn order(effect: &str, place: &str, count: usize) -> Vec<usize> {
    if (effect, place) == ("cable-stiffness", "load") { vec![0, 1, 3, 2] } else { (0..count).collect() }
}

fn sizes(own: &ChainSizes, golden: &Value, said: &mut OffNumbers) {
    let all = [
        ("speed", &own.speed),
        ("torque", &own.torque),
        ("middle", &own.middle),
        ("width", &own.reach),
        ("twist", &own.twist),
        ("twist_rate", &own.twist_rate),
    ];
    for (name, own) in all {
        for (own, golden) in own.iter().zip(numbers(&golden[name])) {
            if !((own - golden).abs() <= 1e-9 * golden.abs()) {
                said.0.push(format!("usual {name}: {own}, golden {golden}"));
            }
        }
    }
}

/// Columns of all named candidates; how many were compared.
pub(super) fn columns(
    frame: &mut TrajectoryFrame,
    golden: &Value,
    said: &mut OffNumbers,
) -> Result<usize, Box<dyn Error>> {
    let usual = ChainSizes::of(frame);
    sizes(&usual, &golden["usual"], said);
    let q = numbers(&golden["intensities"]);
    let (nuisances, _) = frame.nuisances()?;
    let packed = frame.packed(&nuisances);
    let base = frame.pass_base(&packed, &q)?;
    let hinged = |theta: &[f64], link: usize, at: f64| {
        let (plant, theta) = plants::hinged(frame.plant.plant(), theta, link, at)?;
        Some((TrajectoryPlant::new(plant, &theta).ok()?, theta))
    };
    let mechanics = FrameMechanics::new(frame, &hinged);
    let along = along_chain(frame, &usual, &mechanics);
    let all = list(&golden["candidates"]);
    for g in all {
        let (effect, place) = (text(g, "effect"), text(g, "place"));
        let shape = shape_of(effect, place, &g["shape"], along.duration);
        let Some(terms) = arm_law_of(effect, place).and_then(|law| law.terms(&along, &shape)) else {
            said.0.push(format!("{effect} at {place} has no columns"));
            continue;
        };
        let golden_columns = list(&g["columns"]);
        let columns: &[FilterColumn] = &terms.applied.columns;
        if columns.len() != golden_columns.len() {
            said.0.push(format!("{effect}: {} columns, golden {}", columns.len(), golden_columns.len()));
            continue;
        }
        let order = order(effect, place, columns.len());
        let of = |all: &[f64]| order.iter().map(|k| all[*k]).collect::<Vec<_>>();
        let priors = [&terms.applied.mean, &terms.applied.deviation].map(|p| of(p));
        let positive: Vec<usize> = numbers(&g["positive"]).iter().map(|k| *k as usize).collect();
        let same = priors[0] == numbers(&g["prior_mean"]) && priors[1] == numbers(&g["prior_sd"]);
        if !same || terms.positive != positive {
            said.0.push(format!("{effect}: priors {priors:?}, positive {:?}", terms.positive));
        }
        for (k, golden) in golden_columns.iter().enumerate() {
            for (r, golden) in list(golden).iter().enumerate() {
                let what = format!("{effect} at {place}, amplitude {k}, recording {r}");
                part(&columns[order[k]][r], golden, &what, said);
            }
        }
        let group = frame.pass_groups(&packed, &base, &[columns], &q)?.remove(0);
        let product = |i: usize, j: usize| group.own[group.size * order[i] + order[j]];
        for (i, row) in list(&g["gram"]).iter().enumerate() {
            for (j, golden) in numbers(row).iter().enumerate().take(i + 1) {
                let size = (product(i, i) * product(j, j)).sqrt();
                let off = (product(i, j) - golden).abs();
                if !(off <= PRODUCTS * size) {
                    said.0.push(format!("{effect}: product {i} {j} off by {:.1e}", off / size));
                }
            }
        }
    }
    Ok(all.len())
}

/// Columns of a case along its frozen trajectory.
pub(super) fn compared(loaded: &Loaded, folder: &Path) -> Result<Vec<String>, Box<dyn Error>> {
    let read = |name: &str| -> Result<Value, Box<dyn Error>> {
        Ok(serde_json::from_str(&std::fs::read_to_string(folder.join(name))?)?)
    };
    let mut said = OffNumbers::default();
    let mut frame = frame_of(loaded)?;
    freeze(&mut frame, &read("trajectory.json")?, &mut said)?;
    let count = columns(&mut frame, &read("columns.json")?, &mut said)?;
    if count == 0 {
        said.0.push("no candidates".into());
    }
    Ok(said.0)
}
