//! Columns of effects along an arm's frozen trajectory, and the screen of all shapes, compared with golden numbers.

use std::error::Error;
use std::path::Path;

use serde_json::Value;
use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};
use trueup_estimation::innovations::evidence::{AmplitudePriors, log_evidence};
use trueup_estimation::innovations::gram::BaseGram;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::TrajectoryPlant;
use trueup_hypotheses::innovations::along::PlantAlong;
use trueup_hypotheses::innovations::candidate::ScreenedShape;
use trueup_hypotheses::innovations::chain_along::{ChainSizes, FrameMechanics, along_chain};
use trueup_hypotheses::innovations::chain_orders::chain_orders;
use trueup_hypotheses::innovations::chain_screen::{LOOKS, best_of_chain, chain_shapes, chain_survey};
use trueup_hypotheses::innovations::laws::arm_law_of;
use trueup_hypotheses::innovations::screen::Screening;
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_models::plants;
use trueup_signals::Loaded;

use super::trajectory::{OffNumbers, frame_of, freeze};

/// Relative to the largest value of a series.
const TOLERANCE: f64 = 1e-6;
/// A series below this share of the largest one of its column is rounding.
const ROUNDING: f64 = 1e-7;
/// Of gains, nats or a share: columns pass in single precision, and steps of the other program are differences good to 1e-5.
const NATS: f64 = 0.1;
const RELATIVE: f64 = 1e-4;

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

/// Our shape of a golden one.
fn shape_of(effect: &str, place: &str, golden: &Value, along: &PlantAlong<'_>) -> LawShape {
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
                ("late", Some(time)) => values.push(("k", time / along.duration)),
                (_, Some(time)) => values.push(("time", time)),
                _ => {}
            }
            ["late", "wander"].into_iter().find(|f| *f == kind).unwrap_or(if kind == "settle" {
                "time"
            } else {
                "line"
            })
        }
        ("nonlinear-stiffness", kind) => {
            if kind == "knees" {
                "knees"
            } else {
                "power"
            }
        }
        ("base-drag", kind) => ["viscous", "both"].into_iter().find(|f| *f == kind).unwrap_or("dry"),
        ("base-thrust", _) => {
            if number("body") == Some(1.0) {
                "body"
            } else {
                "ground"
            }
        }
        ("load-friction" | "motor-friction", _) => "length",
        ("stribeck-friction", _) => {
            let joint = indices(&golden["j"]).first().copied().unwrap_or(0);
            let usual = along.joints[joint].motor_speed;
            values.iter_mut().filter(|v| v.0 == "speed").for_each(|v| v.1 *= usual);
            values.push(("k", 1.0));
            "stribeck"
        }
        ("flexible-link", _) => "hinge",
        _ => "",
    };
    let mut shape =
        LawShape::new(place, form, &values).at(&indices(&golden["j"])).of(&indices(&golden["ch"]));
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
fn part(own: &ColumnPart, golden: &Value, nodes: usize, what: &str, said: &mut OffNumbers) {
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
        // What is 0 but for rounding is compared with the largest.
        let values = all.iter().flat_map(|s| s.values.iter().map(|v| (s.weight * v).abs()));
        let least = ROUNDING * values.fold(1e-300, f64::max);
        for (on, g) in golden.into_iter().flatten() {
            let mut own = series(on.parse().unwrap_or(usize::MAX));
            own.resize(nodes, 0.0);
            let size = own.iter().fold(least, |m: f64, v| m.max(v.abs()));
            let first = numbers(&g["first"]);
            let begins = own.iter().zip(&first).map(|(a, b)| (a - b).abs() / size).fold(0.0, f64::max);
            let total: f64 = own.iter().map(|v| v.abs().max(least)).sum();
            let sum = g["sum"].as_f64().unwrap_or(f64::NAN);
            let sums = (own.iter().sum::<f64>() - sum).abs() / total;
            let squares: f64 = own.iter().map(|v| v * v).sum();
            let golden = g["squares"].as_f64().unwrap_or(f64::NAN);
            let all = golden.max(own.len() as f64 * least * least);
            let squared = if squares == golden { 0.0 } else { (squares - golden).abs() / all };
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

/// Order of our amplitudes by golden ones: companions of a cable at the load are in another order.
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

/// What columns gain on the data alone, nats, by their Gram matrix with the data first.
fn gained(products: Vec<f64>, size: usize, priors: &AmplitudePriors) -> f64 {
    let data = products.first().copied().unwrap_or(f64::NAN);
    log_evidence(&BaseGram { size, products, ..BaseGram::default() }, priors).log + 0.5 * data
}

/// The arm of a frame with a hinge inside a link.
fn hinged(
    frame: &TrajectoryFrame,
    theta: &[f64],
    link: usize,
    at: f64,
) -> Option<(TrajectoryPlant, Vec<f64>)> {
    let (plant, theta) = plants::hinged(frame.plant.plant(), theta, link, at)?;
    Some((TrajectoryPlant::new(plant, &theta).ok()?, theta))
}

/// Columns of all named candidates; how many were compared.
fn columns(
    frame: &mut TrajectoryFrame,
    golden: &Value,
    said: &mut OffNumbers,
) -> Result<usize, Box<dyn Error>> {
    let usual = ChainSizes::of(frame);
    sizes(&usual, &golden["usual"], said);
    let q = numbers(&golden["intensities"]);
    let (nuisances, _) = frame.nuisances();
    let packed = frame.packed(&nuisances);
    let base = frame.pass_base(&packed, &q);
    let with_hinge = |theta: &[f64], link: usize, at: f64| hinged(frame, theta, link, at);
    let mechanics = FrameMechanics::new(frame, &with_hinge);
    let along = along_chain(frame, &usual, &mechanics);
    let all = list(&golden["candidates"]);
    let (mut together, mut alone): (Vec<FilterColumn>, Vec<(usize, f64, f64)>) = (Vec::new(), Vec::new());
    for g in all {
        let (effect, place) = (text(g, "effect"), text(g, "place"));
        let shape = shape_of(effect, place, &g["shape"], &along);
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
                part(&columns[order[k]][r], golden, frame.runs[r].nodes.len(), &what, said);
            }
        }
        let group = frame.pass_groups(&packed, &base, &[columns]).remove(0);
        // The data come first.
        let product = |i: usize, j: usize| match (i, j) {
            (0, 0) => base.gram.product(0, 0),
            (i, 0) => group.base[order[i - 1]],
            (i, j) => group.own[group.size * order[i - 1] + order[j - 1]],
        };
        let of_group = |i: usize, j: usize| group.own[group.size * i + j];
        alone.extend((0..group.size).map(|i| (i, of_group(i, i), of_group(i, 0))));
        together.extend(columns.iter().cloned());
        let size = columns.len() + 1;
        let own = (0..size).flat_map(|i| (0..size).map(move |j| (i.max(j), i.min(j))));
        let own = own.map(|(i, j)| product(i, j)).collect();
        let priors = AmplitudePriors::default().with(&priors[0], &priors[1]);
        let [own, golden] = [own, numbers(&g["gram"])].map(|products| gained(products, size, &priors));
        if !((own - golden).abs() <= NATS.max(RELATIVE * golden.abs())) {
            said.0.push(format!("{effect} at {place} gains {own} nats, golden {golden}"));
        }
    }
    // One group of more columns than pass side by side has the same products.
    let whole = frame.pass_groups(&packed, &base, &[&together]).remove(0);
    for (k, (within, own, with_first)) in alone.into_iter().enumerate() {
        let at = |i: usize, j: usize| whole.own[whole.size * i + j];
        let first = k - within;
        let size = (own * at(first, first)).sqrt();
        if !((at(k, k) - own).abs() <= 1e-9 * own && (at(k, first) - with_first).abs() <= 1e-9 * size) {
            said.0.push(format!("column {k} of {} has other products than alone", whole.size));
        }
    }
    Ok(all.len())
}

/// The screen of all shapes: how many there are, the gains of the best, and the best families.
fn screen(frame: &mut TrajectoryFrame, golden: &Value, said: &mut OffNumbers) -> Result<(), Box<dyn Error>> {
    let usual = ChainSizes::of(frame);
    let q = frame.intensities.clone();
    let (nuisances, priors) = frame.nuisances();
    let packed = frame.packed(&nuisances);
    let scores: Vec<Vec<f64>> = {
        let gains = frame.all_gains(&q, true);
        let found = frame.evidence_with(&packed, &priors, &gains).1;
        let extra = frame.own_forces(&nuisances, &found.amplitudes);
        frame.smoothed(&gains, Some(&extra)).into_iter().map(|s| s.scores).collect()
    };
    frame.runs.iter_mut().zip(scores).for_each(|(r, s)| r.scores = s);
    let orders = chain_orders(frame);
    for (joint, golden) in golden["orders"].as_object().into_iter().flatten() {
        let own = &orders[joint.parse::<usize>()?].ripple;
        for golden in numbers(golden) {
            if !own.iter().any(|o| (o - golden).abs() < 1e-6 * golden) {
                said.0.push(format!("orders of joint {joint}: {own:?}, golden {golden}"));
            }
        }
    }
    let with_hinge = |theta: &[f64], link: usize, at: f64| hinged(frame, theta, link, at);
    let mechanics = FrameMechanics::new(frame, &with_hinge);
    let along = along_chain(frame, &usual, &mechanics);
    let mut all = chain_shapes(&along, &orders, |_, _| true);
    let count = |what: &str, own: usize, said: &mut OffNumbers| {
        if golden[what].as_u64() != Some(own as u64) {
            said.0.push(format!("{what}: {own}, golden {}", golden[what]));
        }
    };
    count("shapes", all.len(), said);
    count("columns", all.iter().map(|c| c.terms.applied.columns.len()).sum(), said);
    let base = chain_survey(frame, &mut Screening::new(packed, priors), &mut all, &q, LOOKS);
    let golden_base = golden["base"].as_f64().unwrap_or(f64::NAN);
    if !((base - golden_base).abs() <= NATS) {
        said.0.push(format!("screen: base {base}, golden {golden_base}"));
    }
    let best = best_of_chain(&all);
    let named = |c: &ScreenedShape, g: &Value| {
        let shape = shape_of(text(g, "effect"), text(g, "place"), &g["shape"], &along);
        let joints = shape.joints.is_empty() || shape.joints() == c.shape.joints();
        let close = |(name, v): &(&str, f64)| (c.shape.value(name) - v).abs() <= 1e-4 * v.abs();
        let same = c.shape.place == shape.place && c.shape.channels == shape.channels && joints;
        c.law.id() == text(g, "effect") && same && shape.values.iter().all(close)
    };
    let gain = |g: &Value| g["gain"].as_f64().unwrap_or(f64::NAN);
    let allowed = |gain: f64| NATS.max(RELATIVE * gain.abs());
    for g in list(&golden["best"]) {
        let own = all.iter().filter(|c| named(c, g)).map(|c| c.evidence - base).collect::<Vec<_>>();
        if !own.iter().any(|o| (o - gain(g)).abs() <= allowed(gain(g))) {
            let (effect, place) = (text(g, "effect"), text(g, "place"));
            said.0.push(format!("screen of {effect} at {place} {}: {own:?}, golden {}", g["shape"], gain(g)));
        }
    }
    for (k, (own, g)) in best.iter().zip(list(&golden["families"])).enumerate() {
        let off = (own.evidence - base - gain(g)).abs();
        if !(off <= allowed(gain(g))) || (k == 0 && own.law.id() != text(g, "effect")) {
            let own = (own.law.id(), own.shape.place, own.evidence - base);
            said.0.push(format!("family {k}: {own:?}, golden {} {}", text(g, "effect"), gain(g)));
        }
    }
    Ok(())
}

/// Columns and screen of a case along its frozen trajectory.
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
    screen(&mut frame, &read("screen.json")?, &mut said)?;
    Ok(said.0)
}
