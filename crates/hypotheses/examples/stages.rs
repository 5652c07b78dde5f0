//! Stages of the innovations engine of cases: `stages FOLDER..` prints a JSON object for each, a line each.

mod folders;

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Instant;

use serde_json::{Map, Value, json};
use trueup_estimation::innovations::evidence::log_evidence;
use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::joint_frame::joint_frame;
use trueup_estimation::innovations::null::{FittedNull, fit_null};
use trueup_estimation::innovations::two_mass::TwoMassPlant;
use trueup_hypotheses::innovations::candidate::ScreenedShape;
use trueup_hypotheses::innovations::hypothesis::FittedEffect;
use trueup_hypotheses::innovations::joint_along::UsualSizes;
use trueup_hypotheses::innovations::pairs::FittedPair;
use trueup_hypotheses::innovations::screen::{all_shapes, sift};
use trueup_hypotheses::innovations::search::search_from;
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_hypotheses::innovations::verdict::judge;
use trueup_signals::Case;

use folders::{Said, print_each};

fn main() {
    print_each(stages);
}

fn stages(folder: &str) -> Said {
    let begun = Instant::now();
    let (loaded, _) = Case::load(std::path::Path::new(folder), |_| Ok(Vec::new()))?;
    let (mut frame, plant) = joint_frame(&loaded)?;
    let mut ticks = vec![begun.elapsed().as_secs_f64()];
    let mut tick = || ticks.push(begun.elapsed().as_secs_f64());
    let fitted = fit_null(&mut frame);
    tick();
    let frozen = frozen(&mut frame, &fitted);
    tick();
    let sizes = UsualSizes::of(&frame);
    let mut candidates = all_shapes(&frame, &sizes);
    tick();
    let alone = sift(&mut frame, &mut candidates, &fitted.begin, &[]);
    tick();
    let screened = screened(&candidates, alone);
    let names: Vec<&str> = named(&plant);
    let shared = Rc::new(RefCell::new(frame));
    let found = search_from(&shared, Some(&plant), fitted.clone(), sizes, candidates, alone);
    tick();
    let judged = judge(&found).map(|j| {
        json!({ "verdict": j.verdict.name(), "set": j.set, "p": j.probability, "p_second": j.second, "G": j.gain,
            "margin": j.margin, "numbers": j.numbers })
    });
    let effects: Vec<Value> = found.effects.iter().map(|h| effect(h, &names)).collect();
    let pairs: Vec<Value> = found.pairs.iter().map(|p| pair(p, &names)).collect();
    Ok(json!({
        "frozen": frozen, "screen_base": alone, "screen": screened,
        "nominal_L": { "L": fitted.nominal.0, "q": fitted.nominal.1 },
        "parameters_L": { "L": fitted.evidence, "q": fitted.q, "theta": values(&names, &fitted.theta), "rss": fitted.squares,
            "count": fitted.count, "farthest": fitted.farthest, "latents_worth": fitted.latents },
        "hypotheses": effects, "alone": { "L": found.null.evidence, "farthest": found.null.farthest, "latents_worth": found.null.latents },
        "pairs": pairs, "verdict": judged, "seconds": ticks,
    }))
}

fn named(plant: &TwoMassPlant) -> Vec<&'static str> {
    use trueup_estimation::innovations::plant::ForcedPlant;
    plant.parameters().iter().map(|p| p.name).collect()
}

fn values(names: &[&str], theta: &[f64]) -> Value {
    Value::Object(names.iter().zip(theta).map(|(n, v)| ((*n).to_owned(), json!(v))).collect::<Map<_, _>>())
}

fn shape(s: &LawShape) -> Value {
    json!({ "form": s.form, "values": s.values, "pulses": s.pulses })
}

fn effect(h: &FittedEffect, names: &[&str]) -> Value {
    json!({ "effect": h.id, "place": h.place, "shape": shape(&h.shape), "L": h.evidence, "penalised": h.penalised(), "q": h.fit.q,
        "theta": values(names, &h.fit.theta), "amplitudes": h.fit.amplitudes })
}

fn pair(p: &FittedPair, names: &[&str]) -> Value {
    json!({ "first": p.first.0, "second": p.second.0, "place": p.second.1, "shape": shape(&p.shape), "L": p.evidence,
        "q": p.fit.q, "theta": values(names, &p.fit.theta), "amplitudes": p.fit.amplitudes })
}

/// The trajectory along which the screen is made, and the evidence of the model alone along it.
fn frozen(frame: &mut InnovationsFrame, fitted: &FittedNull) -> Value {
    let (packed, priors) = frame.packed(&[]);
    let passed = frame.pass_base(&packed, &fitted.begin);
    let run = &frame.runs[0];
    let nodes = [0, 1, 2, run.nodes / 2];
    let size = run.states.len() / run.nodes;
    let width = run.scores.len() / run.nodes;
    let some = |all: &[f64], w: usize| nodes.map(|t| all[w * t..w * (t + 1)].to_vec());
    json!({
        "rest": frame.rest, "white": frame.white, "scale": frame.scale, "release": frame.release,
        "q": fitted.begin, "parameters": frame.theta, "x": some(&run.states, size), "score": some(&run.scores, width),
        "base": { "count": passed.gram.count, "log_S_sum": passed.gram.log_variance, "G00": passed.gram.product(0, 0),
            "L": log_evidence(&passed.gram, &priors).log },
    })
}

fn screened(candidates: &[ScreenedShape], alone: f64) -> Vec<Value> {
    let mut all: Vec<&ScreenedShape> = candidates.iter().filter(|c| c.is_possible()).collect();
    all.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let one = |c: &&ScreenedShape| {
        json!({ "effect": c.law.id(), "place": c.shape.place, "shape": shape(&c.shape), "gain": c.evidence - alone,
            "q": c.intensities, "amplitudes": c.amplitudes })
    };
    all.iter().take(20).map(one).collect()
}
