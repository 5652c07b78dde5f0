//! Stages of a case compared with golden numbers.

use std::cell::RefCell;
use std::error::Error;
use std::rc::Rc;

use serde_json::Value;
use trueup_estimation::innovations::column::FilterColumn;
use trueup_estimation::innovations::evidence::log_evidence;
use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::joint_frame::joint_frame;
use trueup_estimation::innovations::linear::{Feedback, LinearPoint, PlantStep};
use trueup_estimation::innovations::null::{FittedNull, fit_null};
use trueup_hypotheses::innovations::candidate::ScreenedShape;
use trueup_hypotheses::innovations::joint_along::{UsualSizes, along_joint};
use trueup_hypotheses::innovations::laws::law_of;
use trueup_hypotheses::innovations::levels::LogisticWeights;
use trueup_hypotheses::innovations::screen::{all_shapes, sift};
use trueup_hypotheses::innovations::search::{JointFindings, search_from};
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_hypotheses::innovations::verdict::judge_by;
use trueup_signals::Loaded;

/// Names that the goldens have for the parameters, in our order.
const PARAMETERS: [&str; 7] = ["Jl", "K", "D", "tc", "Dm", "Kt", "Jm"];

/// What is off, one line each.
pub(super) struct Complaints(Vec<String>);

impl Complaints {
    fn say(&mut self, wrong: bool, what: impl FnOnce() -> String) {
        if wrong {
            self.0.push(what());
        }
    }
    /// Within a tolerance, relative to the largest of the golden numbers.
    fn close(&mut self, what: &str, own: &[f64], golden: &Value, tolerance: f64) {
        let golden = flat(golden);
        let size = golden.iter().fold(1e-300, |m: f64, g| m.max(g.abs()));
        let off = own.iter().zip(&golden).map(|(a, b)| (a - b).abs() / size).fold(0.0, f64::max);
        let length = own.len() != golden.len();
        self.say(length, || format!("{what}: {} numbers, golden {}", own.len(), golden.len()));
        self.say(!(off <= tolerance), || format!("{what}: off by {off:.1e}, {tolerance:.0e} is allowed"));
    }
    fn within(&mut self, what: &str, own: f64, golden: &Value, tolerance: f64) {
        let golden = golden.as_f64().unwrap_or(f64::NAN);
        self.say(!((own - golden).abs() <= tolerance), || format!("{what}: {own}, golden {golden}"));
    }
}

/// All numbers of an array of arrays, row by row.
fn flat(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(all) => all.iter().flat_map(flat).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}

fn list(v: &Value) -> &[Value] {
    v.as_array().map_or(&[], Vec::as_slice)
}

fn text<'a>(v: &'a Value, key: &str) -> &'a str {
    v[key].as_str().unwrap_or("")
}

pub(super) fn stages(loaded: &Loaded, golden: &Value) -> Result<Vec<String>, Box<dyn Error>> {
    let mut said = Complaints(Vec::new());
    let (mut frame, plant) = joint_frame(loaded)?;
    intake(&frame, golden, &mut said);
    step(&frame, golden, &mut said);
    let mut settled = frame.clone();
    settled.settle(false);
    modes(&settled, golden, &mut said);
    gains(&settled, golden, &mut said);
    let null = fit_null(&mut frame);
    said.within("nominal L", null.nominal.0, &golden["nominal_L"]["L"], 1.0);
    let sizes = UsualSizes::of(&frame);
    parameters(&null, golden, &mut said);
    frozen(&mut frame, (&null, &sizes), golden, &mut said);
    columns(&mut frame, (&null, &sizes), golden, &mut said);
    let mut candidates = all_shapes(&frame, &sizes);
    let alone = sift(&mut frame, &mut candidates, &null.begin, &[]);
    screen(&candidates, alone, golden, &mut said);
    let shared = Rc::new(RefCell::new(frame));
    let found = search_from(&shared, Some(&plant), null, sizes, candidates, alone);
    effects(&found, golden, &mut said);
    verdict(&found, golden, &mut said);
    Ok(said.0)
}

fn intake(frame: &InnovationsFrame, golden: &Value, said: &mut Complaints) {
    let channels = frame.channels();
    for (k, (r, g)) in frame.runs.iter().zip(list(&golden["intake"])).enumerate() {
        let sums = |f: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..channels).map(|c| (0..r.nodes).map(|t| f(channels * t + c)).sum()).collect()
        };
        let current = &frame.intake.recordings[k].means[0];
        let own: [(&str, Vec<f64>); 8] = [
            ("N", vec![r.nodes as f64]),
            ("dt", vec![r.dt]),
            ("readings", sums(&|i| r.count[i])),
            ("counted", sums(&|i| f64::from(u8::from(r.counted[i])))),
            ("y_sum", sums(&|i| r.readings[i])),
            ("current_sum", vec![current.iter().sum()]),
            ("current_squares", vec![current.iter().map(|u| u * u).sum()]),
            ("x0", [&r.first[..], &[0.0; 2]].concat()),
        ];
        own.iter().for_each(|(name, own)| said.close(&format!("intake {k} {name}"), own, &g[*name], 1e-10));
        for i in 0..4 {
            let variance = r.first_variance[5 * i];
            let golden = g["P0"][i][i].as_f64().unwrap_or(f64::NAN);
            said.within(&format!("intake {k} P0"), variance / golden, &Value::from(1.0), 1e-9);
        }
    }
}

fn step(frame: &InnovationsFrame, golden: &Value, said: &mut Complaints) {
    let feedback = Feedback::default();
    let point = LinearPoint { plant: &*frame.plant, theta: &frame.theta, feedback: &feedback };
    let modes = [vec![false, false], vec![true, frame.plant.held_with(0, 1)]];
    let steps = modes.map(|m| PlantStep::new(&point, &m, frame.runs[0].dt));
    for (k, s) in steps.iter().enumerate() {
        said.close(&format!("step A {k}"), &s.a, &golden["step"]["A"][k], 1e-9);
        said.close(&format!("step B {k}"), &s.b, &golden["step"]["B"][k], 1e-9);
    }
}

fn modes(frame: &InnovationsFrame, golden: &Value, said: &mut Complaints) {
    let g = &golden["modes"];
    let own =
        [("rest", frame.rest), ("white", frame.white), ("scale", frame.scale), ("release", frame.release)];
    own.iter().for_each(|(name, own)| said.close(&format!("modes {name}"), &[*own], &g[*name], 1e-9));
    said.close("modes q", &frame.q, &g["q"], 1e-9);
    said.within("modes L", frame.evidence, &g["L"], 0.1);
    for (k, (r, g)) in frame.runs.iter().zip(list(&g["records"])).enumerate() {
        let stick = r.signs.mode.iter().filter(|m| **m == 1).count() as f64;
        let misplaced = r.signs.misplaced.iter().filter(|m| **m).count() as f64;
        said.close(
            &format!("modes {k} stick"),
            &[stick, misplaced],
            &Value::from(vec![g["stick"].clone(), g["misplaced"].clone()]),
            0.0,
        );
        let squares: f64 = r.signs.mean.iter().map(|m| m * m).sum();
        said.close(&format!("modes {k} mean sign"), &[squares], &g["mean_sign_squares"], 1e-9);
        said.close(&format!("modes {k} extra"), &[r.signs.unknown.iter().sum()], &g["extra_sum"], 1e-9);
    }
}

fn gains(frame: &InnovationsFrame, golden: &Value, said: &mut Complaints) {
    let g = &golden["gains"];
    let own = frame.gains(0, &frame.q, false);
    let (channels, size) = (frame.channels(), own.input.size());
    let nodes: Vec<usize> = flat(&g["nodes"]).iter().map(|n| *n as usize).collect();
    let some = |all: &[f64], width: usize| -> Vec<f64> {
        nodes.iter().flat_map(|t| all[width * t..width * (t + 1)].to_vec()).collect()
    };
    said.close("gains H", &some(&own.input.rows.h, channels * size), &g["H"], 1e-9);
    said.close("gains K", &some(&own.gain, channels * size), &g["K"], 1e-9);
    said.close("gains S", &some(&own.variance, channels), &g["S"], 1e-9);
    said.close("gains R", &some(&own.input.variance, channels), &g["R"], 1e-9);
    let log: f64 = own.input.counted_rows().iter().map(|k| own.variance[*k].ln()).sum();
    said.close("gains sum of log S", &[log], &g["log_S_sum"], 1e-9);
}

fn theta_off(own: &[f64], golden: &Value) -> f64 {
    let off = |(name, own): (&&str, &f64)| {
        let golden = golden[*name].as_f64().unwrap_or(0.0);
        if golden > 0.0 { (own / golden - 1.0).abs() } else { 0.0 }
    };
    PARAMETERS.iter().zip(own).map(off).fold(0.0, f64::max)
}

fn parameters(null: &FittedNull, golden: &Value, said: &mut Complaints) {
    let g = &golden["parameters_L"];
    let low = null.evidence < g["L"].as_f64().unwrap_or(f64::NAN) - 1.0;
    said.say(low, || format!("parameters L: {}, golden {}", null.evidence, g["L"]));
    let off = theta_off(&null.theta, &g["theta"]);
    said.say(!(off < 1e-3), || format!("parameters: off by {off:.1e}"));
    said.within("farthest parameter", null.farthest, &g["farthest"], 0.01);
    said.close("what latents are worth", &[null.latents], &g["latents_worth"], 1e-3);
}

fn frozen(
    frame: &mut InnovationsFrame,
    (null, s): (&FittedNull, &UsualSizes),
    golden: &Value,
    said: &mut Complaints,
) {
    let g = &golden["frozen"];
    said.close("frozen q", &null.begin, &g["q"], 1e-9);
    said.say(!(theta_off(&frame.start, &g["parameters"]) < 1e-6), || "frozen parameters".into());
    // Columns in single precision give refitted parameters to about 1e-7; at the same parameters all is the same.
    let own = frame.start.clone();
    let golden_parameters =
        PARAMETERS.iter().zip(&own).map(|(n, own)| g["parameters"][*n].as_f64().unwrap_or(*own));
    frame.start = golden_parameters.collect();
    frame.reset(&null.begin);
    let r = &frame.runs[0];
    let (size, width) = (r.states.len() / r.nodes, r.scores.len() / r.nodes);
    let nodes: Vec<usize> = flat(&g["nodes"]).iter().map(|t| *t as usize).collect();
    let some = |all: &[f64], of: usize, i: usize| nodes.iter().map(|t| all[of * t + i]).collect::<Vec<_>>();
    let column = |all: &Value, i: usize| list(all).iter().map(|row| row[i].clone()).collect::<Value>();
    for i in 0..size {
        said.close(&format!("frozen state {i}"), &some(&r.states, size, i), &column(&g["x"], i), 1e-7);
        let squares: f64 = r.state(i).iter().map(|x| x * x).sum();
        said.close(&format!("frozen squares of state {i}"), &[squares], &g["x_squares"][i], 1e-7);
    }
    for i in 0..width {
        said.close(&format!("frozen score {i}"), &some(&r.scores, width, i), &column(&g["score"], i), 1e-7);
        if let Some(golden) = g["score_sum"][i].as_f64() {
            let (sum, size) = r.score(i).iter().fold((0.0, 0.0), |(a, b), s| (a + s, b + s.abs()));
            let off = (sum - golden).abs();
            said.say(!(off <= 1e-7 * size), || {
                format!("frozen sum of score {i}: off by {off:.1e} of {size:.1e}")
            });
        }
    }
    let sizes = [
        ("i", s.current),
        ("v", s.motor_speed),
        ("w", s.load_speed),
        ("ql", s.load_angle),
        ("t", s.twist),
        ("tv", s.twist_rate),
        ("range", s.range),
        ("T", s.duration),
    ];
    sizes
        .iter()
        .for_each(|(name, own)| said.close(&format!("size {name}"), &[*own], &g["scales"][*name], 1e-7));
    let (packed, priors) = frame.packed(&[]);
    let base = frame.pass_base(&packed, &null.begin).gram;
    said.close("base G00", &[base.product(0, 0)], &golden["base"]["G00"], 1e-7);
    said.close("base sum of log S", &[base.log_variance], &golden["base"]["log_S_sum"], 1e-9);
    said.within("base L", log_evidence(&base, &priors).log, &golden["base"]["L"], 0.1);
    frame.start = own;
    frame.reset(&null.begin);
}

/// Our shape of a golden one.
fn shape_of(effect: &str, place: &str, golden: &Value) -> LawShape {
    const PLACES: [&str; 6] =
        ["actuator", "motor-friction", "transmission", "load", "sensor:motorAngle", "sensor:loadAngle"];
    const NAMES: [(&str, &str); 4] = [("L", "limit"), ("vs", "speed"), ("T", "time"), ("b", "bend")];
    let place = PLACES.iter().find(|p| **p == place).copied().unwrap_or("");
    let mut values = Vec::new();
    for (name, value) in golden.as_object().into_iter().flatten() {
        const OWN: [&str; 12] = ["lag", "delay", "h", "k", "x", "p", "gap", "f", "z", "v", "a", "d"];
        let renamed = NAMES.iter().find(|n| n.0 == name).map(|n| n.1);
        let own = renamed.or_else(|| OWN.iter().find(|o| *o == name).copied());
        if let (Some(own), Some(value)) = (own, value.as_f64()) {
            values.push((own, value));
        }
    }
    let has = |name: &str| values.iter().any(|v| v.0 == name);
    let form = match effect {
        "current-saturation" => "limit",
        "actuator-lag" if has("lag") => "lag",
        "actuator-lag" | "sensor-delay" => "delay",
        "torque-ripple" | "kinematic-error" | "sensor-eccentricity" => "order",
        "stribeck-friction" => "stribeck",
        "load-dependent-friction" => "torque",
        "asymmetric-friction" => "asymmetry",
        "presliding-friction" | "transmission-hysteresis" => "length",
        "backlash" => "gap",
        "nonlinear-stiffness" if has("bend") => "slopes",
        "nonlinear-stiffness" | "nonlinear-damping" | "nonlinear-viscous-friction" => "power",
        "load-friction" if has("a") => "level",
        "load-friction" if has("x") => "length",
        "load-friction" => "speed",
        "gravity-torque" => "weight",
        "cable-stiffness" => "powers",
        "flexible-link" if has("m") => "states",
        "flexible-link" => "pole",
        "friction-drift" => "time",
        "sensor-drift" if has("time") => "time",
        "sensor-drift" => "later",
        _ => "",
    };
    LawShape::new(place, form, &values)
}

/// Nuisances and named candidates: sums of their forces and readings, and their products.
fn columns(
    frame: &mut InnovationsFrame,
    (null, sizes): (&FittedNull, &UsualSizes),
    golden: &Value,
    said: &mut Complaints,
) {
    let (packed, priors) = frame.packed(&[]);
    let base = frame.pass_base(&packed, &null.begin);
    let nuisances = frame.nuisances().0;
    let mut all: Vec<FilterColumn> = nuisances.clone();
    let golden = list(&golden["columns"]);
    let along = along_joint(frame, sizes);
    for g in golden.iter().skip(nuisances.len()).filter(|g| g["amplitude"] == 0) {
        let effect = text(g, "name");
        let made = law_of(effect)
            .and_then(|law| law.terms(&along, &shape_of(effect, text(g, "place"), &g["shape"])));
        all.extend(made.map_or_else(Vec::new, |m| m.applied.columns));
    }
    let count = golden.len();
    said.say(all.len() != count, || format!("columns: {}, golden {count}", all.len()));
    let groups: Vec<&[FilterColumn]> = all.chunks(1).collect();
    let grams = frame.pass_groups(&packed, &base, &groups);
    for ((column, gram), g) in all.iter().zip(&grams).zip(golden) {
        let name = format!("column {} {}", text(g, "name"), g["amplitude"]);
        let sum = |on: usize| -> Vec<f64> {
            let parts = column.iter().map(|p| p.forces.iter().filter(|s| s.on == on));
            parts.map(|p| p.map(|s| s.weight * s.values.iter().sum::<f64>()).sum()).collect()
        };
        let size = |on: usize| -> f64 {
            let all = column.iter().flat_map(|p| &p.forces).filter(|s| s.on == on);
            all.flat_map(|s| s.values.iter().map(|v| (s.weight * v).abs())).sum()
        };
        for (on, key) in [(0, "motor_sum"), (1, "load_sum")] {
            if !flat(&g[key]).is_empty() {
                let off = sum(on).iter().zip(flat(&g[key])).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                said.say(!(off <= 1e-6 * size(on)), || format!("{name} {key}: off by {off:e}"));
            }
        }
        for (channel, sums) in g["reading"].as_object().into_iter().flatten() {
            let own: Vec<f64> = column
                .iter()
                .map(|p| p.readings.iter().map(|s| s.values.iter().sum::<f64>()).sum())
                .collect();
            let size: f64 =
                column.iter().flat_map(|p| &p.readings).flat_map(|s| s.values.iter().map(|v| v.abs())).sum();
            let off = own.iter().zip(flat(&sums["sum"])).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            said.say(!(off <= 1e-6 * size), || format!("{name} of {channel}: off by {off:e}"));
        }
        said.close(&format!("{name} G"), &[gram.own[0]], &g["G"], 1e-4);
        // A product with the data is off by rounding of both.
        let both = (gram.own[0] * base.gram.product(0, 0)).sqrt();
        said.within(&format!("{name} G0"), gram.base[0], &g["G0"], 1e-4 * both);
    }
    said.say(priors.parameters + 1 < nuisances.len(), || "columns: more than one zero".into());
}

fn same_shape(own: &LawShape, golden: &LawShape, tolerance: f64) -> bool {
    own.place == golden.place
        && golden.values.iter().all(|(name, v)| (own.value(name) - v).abs() <= tolerance * v.abs())
}

fn screen(candidates: &[ScreenedShape], alone: f64, golden: &Value, said: &mut Complaints) {
    // The program that made the numbers sums a screen in single precision: at its base it shows how far that is off.
    let base = golden["screen_base"].as_f64().unwrap_or(f64::NAN);
    let rounding = (base - golden["base"]["L"].as_f64().unwrap_or(f64::NAN)).abs();
    said.within("screen base", alone, &golden["screen_base"], 0.1 + rounding);
    for g in list(&golden["screen"]) {
        let shape = shape_of(text(g, "effect"), text(g, "place"), &g["shape"]);
        let same = |c: &&ScreenedShape| {
            c.law.id() == text(g, "effect")
                && c.shape.form == shape.form
                && same_shape(&c.shape, &shape, 1e-6)
        };
        let own = candidates.iter().find(same).map_or(f64::NAN, |c| c.evidence - alone);
        let allowed = (1e-4 * g["gain"].as_f64().unwrap_or(0.0).abs()).max(0.1) + rounding;
        said.within(&format!("screen {} {:?}", text(g, "effect"), shape.values), own, &g["gain"], allowed);
    }
}

fn effects(found: &JointFindings, golden: &Value, said: &mut Complaints) {
    for (k, g) in list(&golden["hypotheses"]).iter().enumerate() {
        let key = (text(g, "effect"), text(g, "place"));
        let Some(own) = found.effects.iter().find(|h| (h.id, h.place) == key) else {
            said.0.push(format!("effects: no {key:?}"));
            continue;
        };
        said.say(k == 0 && found.effects[0].id != key.0, || {
            format!("leader: {}, golden {key:?}", found.effects[0].id)
        });
        let level = g["L"].as_f64().unwrap_or(f64::NAN);
        said.say(!(own.evidence > level - 1.0), || format!("{key:?}: L {}, golden {level}", own.evidence));
        let off = theta_off(&own.fit.theta, &g["theta"]);
        let higher = own.evidence > level + 1.0;
        said.say(!(off < 1e-3 || higher), || format!("{key:?}: parameters off by {off:.1e}"));
    }
    for g in list(&golden["pairs"]) {
        let same = |p: &&trueup_hypotheses::innovations::pairs::FittedPair| {
            p.first.0 == text(g, "first") && p.second == (text(g, "second"), text(g, "place"))
        };
        let own = found.pairs.iter().find(same).map_or(f64::NEG_INFINITY, |p| p.evidence);
        let level = g["L"].as_f64().unwrap_or(f64::NAN);
        said.say(!(own > level - 1.0), || {
            format!("pair {} {}: L {own}, golden {level}", text(g, "first"), text(g, "second"))
        });
    }
}

/// Weights of the program that made the goldens.
const GOLDEN_RIGHT: LogisticWeights = &[
    ("bias", -13.657_457_150_587_987),
    ("gain", 3.797_237_734_998_746),
    ("power", 0.896_448_806_093_905_9),
    ("left", -0.933_316_051_614_741_5),
    ("rate", -1.199_337_434_690_606),
    ("had", -0.185_688_339_888_601_62),
];
const GOLDEN_SECOND: LogisticWeights = &[
    ("bias", -6.986_940_783_750_443),
    ("gain", 0.912_721_903_742_204_9),
    ("share", 10.647_341_121_528_513),
    ("power", 0.898_230_870_771_200_2),
    ("left", -0.701_845_359_859_537),
    ("same", -3.594_084_483_797_503),
];

fn verdict(found: &JointFindings, golden: &Value, said: &mut Complaints) {
    let g = &golden["verdict"];
    let Some(own) = judge_by(found, GOLDEN_RIGHT, GOLDEN_SECOND) else {
        return said.0.push("verdict: none".into());
    };
    said.say(own.verdict.name() != text(g, "verdict"), || {
        format!("verdict: {:?}, golden {}", own.verdict, g["verdict"])
    });
    let set: Vec<(&str, &str)> =
        list(&g["set"]).iter().map(|s| (s[0].as_str().unwrap_or(""), s[1].as_str().unwrap_or(""))).collect();
    let named: Vec<(&str, &str)> = own.set.iter().map(|(id, place)| (*id, &**place)).collect();
    said.say(named != set, || format!("verdict: {:?}, golden {set:?}", own.set));
    said.within("verdict p", own.probability, &g["p"], 0.01);
    if let (Some(own), true) = (own.second, g["p_second"].is_number()) {
        said.within("verdict p of the second", own, &g["p_second"], 0.01);
    }
}
