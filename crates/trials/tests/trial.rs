//! A trial from end to end: sealed cases, a diagnosis that is made up, the scorecard.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use trueup_trials::{Key, Order, Plant, Ran, Split, generate, markdown, run, score};

fn order(plant: Plant, split: Split, count: usize) -> Order {
    Order { plant, split, count, seed: 11, shard: (1, 1) }
}

fn files(path: &Path) -> Vec<PathBuf> {
    let mut list = Vec::new();
    for entry in fs::read_dir(path).unwrap() {
        let p = entry.unwrap().path();
        if p.is_dir() { list.extend(files(&p)) } else { list.push(p) }
    }
    list.sort();
    list
}

fn contents(path: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    files(path).into_iter().map(|f| (f.strip_prefix(path).unwrap().into(), fs::read(&f).unwrap())).collect()
}

#[test]
#[ignore = "generates cases of an arm: ./test --full"]
fn a_case_of_an_arm_depends_on_its_numbers_alone_and_does_not_hold_its_key() {
    twice(Plant::Manipulator);
}

#[test]
fn a_case_of_a_joint_depends_on_its_numbers_alone_and_does_not_hold_its_key() {
    twice(Plant::Joint);
}

/// Two cases, made in one go and in two shards.
fn twice(plant: Plant) {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let all = order(plant, Split::Single, 2);
    generate(a.path(), &all, |_, _| {}).unwrap();
    // In two shards, the second one first.
    for i in [2, 1] {
        generate(b.path(), &Order { shard: (i, 2), ..all }, |_, _| {}).unwrap();
    }
    let (first, second) = (contents(a.path()), contents(b.path()));
    assert_eq!(first.len(), second.len());
    for ((name, x), (other, y)) in first.iter().zip(&second) {
        assert_eq!(name, other);
        assert!(x == y, "{} differs", name.display());
    }
    for key in files(&a.path().join("keys")) {
        let key: Key = toml::from_str(&fs::read_to_string(key).unwrap()).unwrap();
        assert!(key.ratio > 1.1 && key.effects.len() == 1);
        let case = a.path().join("cases").join(&key.case);
        for file in files(&case) {
            let text = fs::read_to_string(&file).unwrap();
            assert!(!text.contains(&key.effects[0]) && !file.ends_with("key.toml"));
        }
    }
}

/// A diagnosis of these words.
fn says(out: &Path, verdict: &str, ids: &[&str], sets: &str, closed: f64) {
    let claims: Vec<String> =
        ids.iter().map(|id| format!(r#"{{"id": "{id}", "component": "x", "probability": 0.8}}"#)).collect();
    let claims = claims.join(", ");
    let text = format!(
        r#"{{"schema": "trueup.diagnosis/1", "verdict": "{verdict}", "gap": {{"overall": {{"closed": {closed}}}}},
            "effects": [{claims}], "candidates": [{claims}], "indistinguishable": {sets}, "unknown": null}}"#
    );
    fs::write(out.join("diagnosis.json"), text).unwrap();
}

#[test]
fn the_scorer_counts_what_was_said_and_refuses_a_key_that_was_changed() {
    let dir = tempfile::tempdir().unwrap();
    let keys = dir.path().join("keys");
    // Keys and cases by hand: four single effects, two without a gap, one pair, one not identifiable.
    let mut seals = String::from("case,key_sha256\n");
    let mut put = |name: &str, split: &str, effects: &[&str], verdict: &str| {
        fs::create_dir_all(dir.path().join("cases").join(name)).unwrap();
        fs::create_dir_all(&keys).unwrap();
        let text = format!(
            "case = \"{name}\"\nplant = \"joint\"\nsplit = \"{split}\"\nverdict = \"{verdict}\"\neffects = {effects:?}\n\
             components = [\"x\"]\nratio = 5.0\nseed = 1\nindex = 0\n"
        );
        fs::write(keys.join(format!("{name}.toml")), &text).unwrap();
        let hash: String = <sha2::Sha256 as sha2::Digest>::digest(text.as_bytes())
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect();
        seals.push_str(&format!("{name},{hash}\n"));
    };
    for (name, id) in
        [("a", "backlash"), ("b", "backlash"), ("c", "stribeck-friction"), ("d", "sensor-delay")]
    {
        put(name, "single", &[id], "effects");
    }
    put("e", "none", &[], "no-gap");
    put("f", "none", &[], "no-gap");
    put("g", "pairs", &["backlash", "actuator-lag"], "effects");
    put("h", "unidentifiable", &["gravity-torque"], "ambiguous");
    fs::write(dir.path().join("seals.csv"), &seals).unwrap();

    let answer = |case: &Path, out: &Path| -> Result<(), String> {
        match case.file_name().unwrap().to_str().unwrap() {
            "a" => says(out, "effects", &["backlash"], "[]", 0.9),
            // The wrong id, but of a class with the right one.
            "b" => says(
                out,
                "effects",
                &["nonlinear-stiffness"],
                r#"[["nonlinear-stiffness", "backlash"]]"#,
                0.8,
            ),
            "c" => says(out, "ambiguous", &["presliding-friction", "stribeck-friction"], "[]", 0.7),
            "d" => return Err("no".into()),
            "e" => says(out, "no-gap", &[], "[]", 0.0),
            "f" => says(out, "effects", &["backlash"], "[]", 0.0),
            "g" => says(out, "effects", &["actuator-lag", "backlash"], "[]", 0.9),
            _ => says(out, "ambiguous", &["cable-stiffness", "gravity-torque"], "[]", 0.9),
        }
        Ok(())
    };
    run(dir.path(), (1, 1), answer, |_, _| {}).unwrap();
    // Again: only what failed is tried.
    let mut tried = Vec::new();
    run(dir.path(), (1, 1), answer, |name, ran| {
        if *ran != Ran::Kept {
            tried.push(name.to_owned());
        }
    })
    .unwrap();
    assert_eq!(tried, ["d"]);

    let cards = score(dir.path()).unwrap();
    let share = |what: &str| {
        let line = cards[0].lines.iter().find(|l| l.what.starts_with(what)).unwrap();
        line.share.map(|s| (s.hits, s.of)).unwrap()
    };
    assert_eq!(share("effect named first"), (2, 4));
    assert_eq!(share("- by its exact id"), (1, 4));
    assert_eq!(share("first, or in an ambiguous"), (3, 4));
    assert_eq!(share("among the first three"), (2, 4));
    assert_eq!(share("ambiguous though"), (1, 4));
    assert_eq!(share("gap detected"), (3, 4));
    assert_eq!(share("false alarm"), (1, 2));
    assert_eq!(share("two effects: exactly"), (1, 1));
    assert_eq!(share("not identifiable"), (1, 1));
    assert_eq!(share("diagnoses that failed"), (1, 8));
    // Five claims at 0.8: a, f and both of g and b's; three of the five are true.
    let error = cards[0].lines.iter().find(|l| l.what.starts_with("expected calibration")).unwrap();
    assert!((error.value.unwrap() - (0.8 - 3.0 / 5.0)).abs() < 1e-12, "{error:?}");
    // Wilson's interval of 2 in 4, by hand: centre 1/2, half width z sqrt(1/16 + z^2/64) / (1 + z^2/4).
    let line = cards[0].lines.iter().find(|l| l.what.starts_with("effect named first")).unwrap();
    let [low, high] = line.share.unwrap().interval().unwrap();
    assert!((low - 0.150_036).abs() < 1e-5 && (high - 0.849_964).abs() < 1e-5, "{low} {high}");
    assert!(markdown(&cards, Some("abc")).contains("| false alarm where there is no gap | 50.0 % (1/2;"));

    fs::write(keys.join("a.toml"), "case = \"a\"\n").unwrap();
    assert!(score(dir.path()).unwrap_err().to_string().contains("not the one that was sealed"));
}
