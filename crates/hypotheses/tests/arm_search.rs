//! What the search finds in arms, and its verdict, compared with another program of the same method.

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use trueup_estimation::innovations::trajectory::structures::PlantStructures;
use trueup_hypotheses::innovations::chain_effect::ChainEffect;
use trueup_hypotheses::innovations::chain_search::{chain_null, search_chain};
use trueup_hypotheses::innovations::chain_verdict::judge_chain;
use trueup_hypotheses::innovations::findings::{FoundEffect, of_chain, search_case};
use trueup_hypotheses::innovations::levels::CHAIN_RIGHT;
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_signals::{Case, Channel, Loaded, ParameterValue, PriorGuess};

/// Nats below the golden evidence.
const BELOW: f64 = 1.0;

fn list(v: &Value) -> &[Value] {
    v.as_array().map_or(&[], Vec::as_slice)
}

/// What is off.
fn compared(case: &Path, golden: &Value) -> Result<Vec<String>, Box<dyn Error>> {
    let (loaded, _) = Case::load(case, |_| Ok(Vec::new()))?;
    let found = search_chain(&loaded, &PlantStructures::of(&loaded.case)?)?;
    let judged = judge_chain(&found);
    let mut off = Vec::new();
    let lower = |what: &str, own: f64, golden: &Value| {
        let golden = golden.as_f64().unwrap_or(f64::NAN);
        (!(own >= golden - BELOW)).then(|| format!("L of {what}: {own}, golden {golden}"))
    };
    off.extend(lower("the nominal model", found.null.nominal, &golden["L_nominal"]));
    off.extend(lower("the refitted model", found.null.fit.evidence, &golden["L_parameters"]));
    let text = |v: &Value, key: &str| v[key].as_str().unwrap_or("").to_owned();
    for (k, g) in list(&golden["hypotheses"]).iter().enumerate() {
        let (effect, place) = (text(g, "effect"), text(g, "place"));
        match found.effects.iter().find(|h| h.id == effect && h.place() == place) {
            Some(h) => off.extend(lower(&format!("{effect} at {place}"), h.evidence, &g["L"])),
            // Below the first ones it depends on the last nat who is fitted at all.
            None if k == 0 => off.push(format!("no {effect} at {place}")),
            None => {}
        }
    }
    if let Some(g) = list(&golden["hypotheses"]).first() {
        let lead = found.effects.first().map(|h| (h.id.to_owned(), h.place()));
        if lead != Some((text(g, "effect"), text(g, "place"))) {
            off.push(format!("{lead:?} leads, golden {} at {}", g["effect"], g["place"]));
        }
    }
    let set: Vec<Vec<String>> =
        judged.set.iter().map(|(id, place)| vec![(*id).to_owned(), place.clone()]).collect();
    let golden_set: Vec<Vec<String>> = serde_json::from_value(golden["told"].clone())?;
    if judged.verdict.name() != text(golden, "verdict") || set != golden_set {
        let (own, verdict) = (judged.verdict.name(), &golden["verdict"]);
        off.push(format!("{own} {set:?}, golden {verdict} {golden_set:?}"));
    }
    Ok(off)
}

fn complaints(case: &Path, golden: &Path) -> Vec<String> {
    let golden: Value = serde_json::from_str(&fs::read_to_string(golden).unwrap()).unwrap();
    let off = compared(case, &golden).unwrap_or_else(|e| vec![e.to_string()]);
    off.into_iter().map(|c| format!("{}: {c}", case.display())).collect()
}

/// Cases with their numbers, in `engine/goldens/arm` in the folder that TRUEUP_DATA names, or next to it.
#[test]
#[ignore = "searches twelve arms: minutes"]
fn every_search_of_an_arm_ends_as_high_as_the_golden_one_with_its_verdict() {
    let data = std::env::var_os("TRUEUP_DATA").map(PathBuf::from);
    let places = data.iter().flat_map(|d| [d.clone(), d.join("..")]).map(|d| d.join("engine/goldens/arm"));
    let Some(folder) = places.into_iter().find(|d| d.is_dir()) else {
        eprintln!("SKIPPED: TRUEUP_DATA does not name the folder with the golden numbers of arms");
        return;
    };
    let mut cases: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    cases.sort();
    assert!(!cases.is_empty());
    let off: Vec<String> = cases.iter().flat_map(|c| complaints(c, &c.join("golden/verdict.json"))).collect();
    assert!(off.is_empty(), "\n{}", off.join("\n"));
}

/// The recordings are those that every stage of an arm is compared with.
#[test]
fn the_search_of_a_short_arm_ends_with_the_golden_leader_shape_and_verdict() {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let (case, golden) = (own.join("../../tests/tests/innovations/arm"), own.join("tests/short_arm.json"));
    let off = complaints(&case, &golden);
    assert!(off.is_empty(), "\n{}", off.join("\n"));
    let (loaded, _) = Case::load(&case, |_| Ok(Vec::new())).unwrap();
    let found = search_chain(&loaded, &PlantStructures::of(&loaded.case).unwrap()).unwrap();
    let lead = found.effects[0].clone();
    assert_eq!((lead.joints(), lead.shape.form), (vec![2], "two"));
    assert!((lead.shape.value("two") - 0.043).abs() < 1e-6, "{:?}", lead.shape);
    // Everything that the torque does too late is explained: nothing is left for a second.
    assert!(found.pairs.is_empty() && lead.left.largest() < 2.5, "{:?}", lead.left);
    // How sure it is follows from how far the power of the latents fell.
    let judged = judge_chain(&found);
    let (name, fall) = judged.numbers[0];
    let expected = (found.null.left.power() / lead.left.power()).log10().min(4.0);
    assert!(name == "fall" && (fall - expected).abs() < 1e-12 && fall > 0.5, "{:?}", judged.numbers);
    let weight = |name: &str| CHAIN_RIGHT.iter().find(|w| w.0 == name).unwrap().1;
    let odds = weight("bias") + weight("fall") * fall;
    assert!((judged.probability - 1.0 / (1.0 + (-odds).exp())).abs() < 1e-12, "{}", judged.probability);
    // A report has what was fitted and, behind it, what gained in the screen, each place once.
    let listed = of_chain(&found);
    assert!(!listed.screened.is_empty());
    let gains: Vec<f64> = listed.screened.iter().map(|h| h.evidence - listed.alone.evidence).collect();
    assert!(gains.is_sorted_by(|a, b| a >= b) && gains.iter().all(|g| *g > 0.0), "{gains:?}");
    let twice = |h: &FoundEffect| listed.effects.iter().any(|o| o.key == h.key);
    assert!(!listed.screened.iter().any(twice));
    let places = |h: &FoundEffect| h.causes.iter().map(|c| c.place.clone()).collect::<Vec<_>>();
    assert!(
        listed.screened.iter().all(|h| !h.causes.is_empty() && !places(h).contains(&"sensor".to_owned()))
    );
    // A nonlinear spring with its line alone is another stiffness: amplitudes of an arm whose spring was 33 % stiffer.
    let mut found = found;
    let mut spring = |amplitudes: &[f64]| {
        let shape = LawShape::new("transmission", "knees", &[("b", 0.02), ("b2", 0.02)]).at(&[1]);
        let mut h = ChainEffect { id: "nonlinear-stiffness", shape, form: None, ..lead.clone() };
        (h.fit.amplitudes, h.evidence) = (amplitudes.to_vec(), lead.evidence + 50.0);
        found.effects = vec![h];
        (judge_chain(&found), of_chain(&found))
    };
    let (judged, listed) = spring(&[0.0, 0.0, 0.333]);
    assert_eq!((judged.verdict, judged.set.len()), (EvidenceVerdict::Parameters, 0));
    let at = listed.names.iter().position(|n| n == "jointStiffness[2]").unwrap();
    assert_eq!(listed.alone.theta[at], 1.333 * lead.fit.theta[at]);
    assert_eq!(spring(&[0.2, 0.1, 0.333]).0.verdict, EvidenceVerdict::Effects);
    // A structure of its own has no amplitudes: no other stiffness.
    let flexible = spring(&[]).0;
    assert_eq!((flexible.verdict, flexible.set.len()), (EvidenceVerdict::Effects, 1));
    assert!(flexible.gain > 0.0, "{}", flexible.gain);
}

/// A drive with a few samples is there: what lacks are samples.
#[test]
fn a_drive_with_too_few_samples_is_reported_by_their_number() {
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/tests/innovations/arm");
    let (loaded, _) = Case::load(&case, |_| Ok(Vec::new())).unwrap();
    for samples in [0, 7, 20] {
        let mut own = loaded.clone();
        let drives = own.recordings.values_mut().flat_map(|r| &mut r.channels);
        let drive = drives.into_iter().find(|c| c.name == "jointTorque[2]").unwrap();
        drive.time.truncate(samples);
        drive.values.truncate(samples);
        let why = search_case(&own).err().map(|e| e.to_string()).unwrap_or_default();
        let expected =
            if samples == 0 { "was not recorded".to_owned() } else { format!("has {samples} samples") };
        assert!(why.contains("jointTorque[2]") && why.contains(&expected), "{samples}: {why}");
    }
}

fn short_arm() -> Loaded {
    let case = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/tests/innovations/arm");
    Case::load(&case, |_| Ok(Vec::new())).unwrap().0
}
fn channels<'a>(l: &'a mut Loaded, name: &'a str) -> impl Iterator<Item = &'a mut Channel> {
    l.recordings.values_mut().flat_map(|r| &mut r.channels).filter(move |c| c.name == name)
}
fn nominal(l: &Loaded) -> f64 {
    chain_null(l, &PlantStructures::of(&l.case).unwrap()).unwrap().1.nominal
}

/// What a channel of an arm shows later, with its delay declared, and what it shows with assumed gain and offset, is what it would show
/// without.
#[test]
fn a_declared_delay_and_assumed_figures_are_taken_from_the_readings_of_an_arm() {
    let mut case = short_arm();
    let as_it_is = nominal(&case);
    for name in ["jointAngle[1]", "jointTorque[2]"] {
        channels(&mut case, name).for_each(|c| c.time.iter_mut().for_each(|t| *t += 0.0321));
    }
    let not_declared = nominal(&case);
    for name in ["jointAngle[1]", "jointTorque[2]"] {
        channels(&mut case, name).for_each(|c| c.sensor.delay = 0.0321);
    }
    let late = nominal(&case);
    // A reading midway between two nodes goes to either one by rounding.
    println!("{as_it_is}, late {late}, not declared {not_declared}");
    assert!((late - as_it_is).abs() < 0.2 && not_declared < as_it_is - 10.0);
    for c in channels(&mut case, "jointAngle[3]") {
        c.values.iter_mut().for_each(|y| *y = -1.7 * *y + 0.3);
        c.sensor.noise = c.sensor.noise.map(|s| 1.7 * s);
        c.sensor.resolution = c.sensor.resolution.map(|s| 1.7 * s);
        c.sensor.gain = Some(PriorGuess { value: -1.7, doubt: Some(1e-6) });
        c.sensor.offset = Some(PriorGuess { value: 0.3, doubt: Some(1e-6) });
    }
    let scaled = nominal(&case);
    assert!((scaled - late).abs() < 0.05, "{scaled}, {late}");
}

/// A mass that each recording has by itself is known there, whatever the case assumes.
#[test]
fn a_mass_of_single_recordings_is_known_there() {
    let right = short_arm();
    let mass = right.case.number("baseMass").unwrap();
    let mut wrong = right.clone();
    wrong.case.parameters.insert("baseMass".into(), ParameterValue::Number(1.5 * mass));
    let mut own = wrong.clone();
    for r in own.recordings.values_mut() {
        r.parameters.insert("baseMass".into(), ParameterValue::Number(mass));
    }
    let [right, wrong, own] = [&right, &wrong, &own].map(nominal);
    assert!((own - right).abs() < 0.5 && right > wrong + 3.0, "{own}, {right}, {wrong}");
}
