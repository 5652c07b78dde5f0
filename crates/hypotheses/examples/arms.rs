//! Stages of the innovations engine of arms: `arms FOLDER..` prints a JSON object for each, a line each.

mod folders;

use std::time::Instant;

use serde_json::{Value, json};
use trueup_estimation::innovations::trajectory::structures::PlantStructures;
use trueup_hypotheses::innovations::chain_effect::{ChainEffect, place_of};
use trueup_hypotheses::innovations::chain_form::EffectForm;
use trueup_hypotheses::innovations::chain_pairs::ChainPair;
use trueup_hypotheses::innovations::chain_search::search_chain;
use trueup_hypotheses::innovations::chain_verdict::judge_chain;
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_signals::Case;

use folders::{Said, print_each};

fn main() {
    print_each(stages);
}

fn stages(folder: &str) -> Said {
    let begun = Instant::now();
    let (loaded, _) = Case::load(std::path::Path::new(folder), |_| Ok(Vec::new()))?;
    let structures = PlantStructures::of(&loaded.case)?;
    let found = search_chain(&loaded, &structures)?;
    let judged = judge_chain(&found);
    let screen = found.screen.iter().take(6);
    let screen: Vec<Value> = screen
        .map(|c| json!([c.law.id(), c.shape.place, c.evidence - found.base, shape(&c.shape)]))
        .collect();
    let alone = &found.null;
    Ok(json!({
        "nominal_L": alone.nominal,
        "rig": found.effects.first().map(|h| h.frame.reported(&alone.fit.doubted)),
        "offsets": found.effects.first().map(|h| h.frame.reported_of_single(&alone.fit.doubted)),
        "parameters_L": { "L": alone.fit.evidence, "floors": [alone.left.forces, alone.left.readings] },
        "screen_base": found.base, "screen": screen,
        "hypotheses": found.effects.iter().map(|h| effect(h, alone.fit.evidence)).collect::<Vec<_>>(),
        "pairs": found.pairs.iter().map(|p| pair(p, alone.fit.evidence)).collect::<Vec<_>>(),
        "verdict": { "verdict": judged.verdict.name(), "set": judged.set, "G": judged.gain, "margin": judged.margin,
            "numbers": judged.numbers },
        "seconds": begun.elapsed().as_secs_f64(),
    }))
}

fn shape(s: &LawShape) -> Value {
    json!({ "form": s.form, "joints": s.joints, "channels": s.channels, "values": s.values, "pulses": s.pulses, "only": s.only })
}

fn parts(form: &EffectForm) -> Vec<Value> {
    form.parts
        .iter()
        .map(|p| json!({ "shape": shape(&p.shape), "widened": p.shape.widened, "left_out": p.left_out }))
        .collect()
}

fn effect(h: &ChainEffect, null: f64) -> Value {
    json!({ "effect": h.id, "place": h.place(), "shape": shape(&h.shape), "parts": h.form.as_ref().map(parts), "L": h.evidence,
        "gain": h.evidence - null, "floors": [h.left.forces, h.left.readings], "amplitudes": h.fit.amplitudes })
}

fn pair(p: &ChainPair, null: f64) -> Value {
    json!({ "first": p.first.id, "second": p.second.law.id(), "place": place_of(&p.first.frame, p.second.shape()),
        "parts": parts(&p.second), "L": p.evidence, "gain": p.evidence - null, "floors": [p.left.forces, p.left.readings],
        "amplitudes": p.fit.amplitudes })
}
