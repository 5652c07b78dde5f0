//! A trial from end to end: sealed cases, a diagnosis that is made up, the scorecard.

#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};

use trueup_trials::{
    Answers, CaseEnd, CaseFailure, Folders, JudgedRun, PairedCounts, TimeTaken, TrialOrder, TrialPlant,
    TrialSplit, TruthKey, compare, fill_corpus, generate, generate_corpus, generate_truth, markdown,
    read_corpus, run, score, write_corpus,
};

/// Its first cases are made quickly.
const SEED: u64 = 17;

fn order(plant: TrialPlant, split: TrialSplit, count: usize) -> TrialOrder {
    TrialOrder { plant, split, count, seed: SEED, shard: (1, 1) }
}

fn to(directory: &Path) -> Folders<'_> {
    Folders { directory, cache: None }
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
    twice(TrialPlant::Manipulator);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_case_of_a_joint_depends_on_its_numbers_alone_and_does_not_hold_its_key() {
    twice(TrialPlant::Joint);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_case_of_a_held_arm_depends_on_its_numbers_alone_and_does_not_hold_its_key() {
    twice(TrialPlant::HeldArm);
}

#[test]
fn what_a_plant_does_not_have_is_refused_with_the_remedy() {
    let dir = tempfile::tempdir().unwrap();
    let rig = order(TrialPlant::HeldArm, TrialSplit::Rig, 1);
    let said = generate(to(dir.path()), &rig, |_, _| {}).unwrap_err().to_string();
    assert_eq!(said, "plant held-arm has no cases of split rig; choose another split");
    let joint = order(TrialPlant::Joint, TrialSplit::None, 1);
    let said = generate_truth(dir.path(), &joint).unwrap_err().to_string();
    assert!(said.contains("plant joint gives no noise-free recordings; leave --truth out"), "{said}");
}

/// Two cases, made in one go and in two shards.
fn twice(plant: TrialPlant) {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let all = order(plant, TrialSplit::Single, 2);
    std::thread::scope(|scope| {
        scope.spawn(|| generate(to(a.path()), &all, |_, _| {}).unwrap());
        // In two shards, the second one first.
        for i in [2, 1] {
            generate(to(b.path()), &TrialOrder { shard: (i, 2), ..all }, |_, _| {}).unwrap();
        }
    });
    let (first, second) = (contents(a.path()), contents(b.path()));
    assert_eq!(first.len(), second.len());
    for ((name, x), (other, y)) in first.iter().zip(&second) {
        assert_eq!(name, other);
        assert!(x == y, "{} differs", name.display());
    }
    for key in files(&a.path().join("keys")) {
        let key: TruthKey = toml::from_str(&fs::read_to_string(key).unwrap()).unwrap();
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

/// Cases and keys by hand: name, split, effects, verdict.
fn by_hand(dir: &Path, all: &[(&str, &str, &[&str], &str)]) {
    let keys = dir.join("keys");
    fs::create_dir_all(&keys).unwrap();
    let mut seals = String::from("case,key_sha256\n");
    for (name, split, effects, verdict) in all {
        fs::create_dir_all(dir.join("cases").join(name)).unwrap();
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
    }
    fs::write(dir.join("seals.csv"), &seals).unwrap();
}

#[test]
fn the_scorer_counts_what_was_said_and_refuses_a_key_that_was_changed() {
    let dir = tempfile::tempdir().unwrap();
    let keys = dir.path().join("keys");
    // Four single effects, two without a gap, one pair, one not identifiable.
    let single = |name, id| (name, "single", id, "effects");
    by_hand(
        dir.path(),
        &[
            single("a", &["backlash"][..]),
            single("b", &["backlash"]),
            single("c", &["stribeck-friction"]),
            single("d", &["sensor-delay"]),
            ("e", "none", &[], "no-gap"),
            ("f", "none", &[], "no-gap"),
            ("g", "pairs", &["backlash", "actuator-lag"], "effects"),
            ("h", "unidentifiable", &["gravity-torque"], "ambiguous"),
        ],
    );

    let answer = |case: &Path, out: &Path| -> Result<TimeTaken, CaseFailure> {
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
            "d" => return Err(CaseFailure::Said("no".into())),
            "e" => says(out, "no-gap", &[], "[]", 0.0),
            "f" => says(out, "effects", &["backlash"], "[]", 0.0),
            "g" => says(out, "effects", &["actuator-lag", "backlash"], "[]", 0.9),
            _ => says(out, "ambiguous", &["cable-stiffness", "gravity-torque"], "[]", 0.9),
        }
        Ok(TimeTaken::default())
    };
    let results = dir.path().join("results");
    let all = JudgedRun { trials: dir.path(), results: &results, shard: (1, 1), limit: None };
    run(&all, answer, |_, _| {}).unwrap();
    // Again: only what failed is tried.
    let mut tried = Vec::new();
    run(&all, answer, |name, ran| {
        if *ran != CaseEnd::Kept {
            tried.push(name.to_owned());
        }
    })
    .unwrap();
    assert_eq!(tried, ["d"]);

    let answers = Answers::find(dir.path()).unwrap();
    let cards = score(&answers).unwrap();
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
    assert!(score(&answers).unwrap_err().to_string().contains("not the one that was sealed"));
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_rig_says_what_it_doubts_and_its_key_what_is_off() {
    let dir = tempfile::tempdir().unwrap();
    // The second of its kinds alone: the offset of a current.
    let one = TrialOrder { shard: (2, 6), ..order(TrialPlant::Joint, TrialSplit::Rig, 6) };
    generate(to(dir.path()), &one, |_, _| {}).unwrap();
    let key = fs::read_to_string(&files(&dir.path().join("keys"))[0]).unwrap();
    let key: TruthKey = toml::from_str(&key).unwrap();
    let off = key.moved["motorCurrent.offset"];
    assert!(key.verdict == "parameters" && key.effects.is_empty() && off.from == 0.0 && off.to != 0.0);
    let case = fs::read_to_string(dir.path().join("cases").join(&key.case).join("case.toml")).unwrap();
    let case: toml::Table = case.parse().unwrap();
    assert_eq!(case["channels"]["motorCurrent"]["offset"].as_str(), Some("estimate"));
    // Each kind in its turn; a rig of whose load little is known.
    let one = TrialOrder { shard: (3, 6), ..one };
    generate(to(dir.path()), &one, |_, _| {}).unwrap();
    let mut kinds: Vec<String> = files(&dir.path().join("keys"))
        .iter()
        .flat_map(|f| toml::from_str::<TruthKey>(&fs::read_to_string(f).unwrap()).unwrap().moved.into_keys())
        .collect();
    kinds.sort();
    assert_eq!(kinds, ["loadInertia", "motorCurrent.offset"]);
}

#[test]
fn a_case_that_is_kept_is_not_made_again() {
    let [cache, a, b] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let one = order(TrialPlant::Joint, TrialSplit::None, 1);
    let into = |directory| Folders { directory, cache: Some(cache.path()) };
    generate(into(a.path()), &one, |_, _| {}).unwrap();
    generate(into(b.path()), &one, |_, _| {}).unwrap();
    assert_eq!(contents(a.path()), contents(b.path()));
    // What is kept is taken: a line more there is a line more here. The links to it are those of the first two.
    let kept = files(cache.path()).into_iter().find(|f| f.ends_with("case.toml")).unwrap();
    let text = fs::read_to_string(&kept).unwrap();
    fs::remove_file(&kept).unwrap();
    fs::write(&kept, text + "# kept\n").unwrap();
    let c = tempfile::tempdir().unwrap();
    generate(into(c.path()), &one, |_, _| {}).unwrap();
    let taken = files(c.path()).into_iter().find(|f| f.ends_with("case.toml")).unwrap();
    assert!(fs::read_to_string(taken).unwrap().ends_with("# kept\n"));
}

#[test]
fn a_case_that_was_stopped_is_a_miss_until_it_gets_more_time() {
    let dir = tempfile::tempdir().unwrap();
    by_hand(dir.path(), &[("a", "none", &[], "no-gap"), ("b", "none", &[], "no-gap")]);
    let results = dir.path().join("results");
    let with = |limit: f64| {
        let mut tried = Vec::new();
        let all = JudgedRun { trials: dir.path(), results: &results, shard: (1, 1), limit: Some(limit) };
        let answer = |case: &Path, out: &Path| {
            if case.ends_with("a") && limit < 8.0 {
                return Err(CaseFailure::Stopped(limit));
            }
            says(out, "no-gap", &[], "[]", 0.0);
            Ok(TimeTaken { seconds: 0.0, processor_seconds: Some(2.0) })
        };
        run(&all, answer, |name, ran| {
            if *ran != CaseEnd::Kept {
                tried.push(name.to_owned());
            }
        })
        .unwrap();
        let rows = Answers::find(dir.path()).unwrap().tabulate().unwrap();
        let told: Vec<_> = rows.into_iter().map(|r| (r.verdict, r.right, r.processor_seconds)).collect();
        (tried, told)
    };
    let [stopped, done] = [("stopped".to_owned(), false, Some(5.0)), ("no-gap".to_owned(), true, Some(2.0))];
    let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
    assert_eq!(with(5.0), (names(&["a", "b"]), vec![stopped.clone(), done.clone()]));
    assert_eq!(with(5.0), (names(&[]), vec![stopped, done.clone()]));
    assert_eq!(with(10.0), (names(&["a"]), vec![done.clone(), done]));
    let table = fs::read_to_string(results.join("table.csv")).unwrap();
    assert!(table.starts_with("case,plant,split,") && table.lines().count() == 3, "{table}");
}

#[test]
fn two_programs_are_compared_on_the_same_cases_alone() {
    let dir = tempfile::tempdir().unwrap();
    let gap = |name| (name, "single", &["backlash"][..], "effects");
    by_hand(dir.path(), &[gap("a"), gap("b"), gap("c"), gap("d"), ("e", "none", &[], "no-gap")]);
    let [a, b] = ["results", "other"].map(|name| dir.path().join(name));
    // Who is right of whom: the last but one is answered by the first alone.
    for (results, right) in [(&a, "abde"), (&b, "ac")] {
        let all = JudgedRun { trials: dir.path(), results, shard: (1, 1), limit: None };
        let answer = |case: &Path, out: &Path| {
            let name = case.file_name().unwrap().to_str().unwrap();
            match (name, right.contains(name)) {
                ("d", false) => return Err(CaseFailure::Said("no".into())),
                ("e", true) => says(out, "no-gap", &[], "[]", 0.0),
                (_, true) => says(out, "effects", &["backlash"], "[]", 0.9),
                (_, false) => says(out, "unknown", &[], "[]", 0.0),
            }
            let processor_seconds = Some(if right == "ac" { 1.0 } else { 4.0 });
            Ok(TimeTaken { seconds: 0.0, processor_seconds })
        };
        run(&all, answer, |_, _| {}).unwrap();
    }
    fs::remove_file(b.join("d.error")).unwrap();
    let [of_a, of_b] = [dir.path(), b.as_path()].map(|folder| Answers::find(folder).unwrap());
    let found = compare(&of_a, &of_b).unwrap();
    assert_eq!(found.counts(TrialPlant::Joint), PairedCounts { both: 1, only_a: 2, only_b: 1, neither: 0 });
    assert_eq!(found.only, [vec!["d".to_owned()], vec![]]);
    let text = found.text();
    for words in [
        "joint: 4 cases by both",
        "3 discordant cases: p = 1.000",
        "B/A median 0.25",
        "  b single backlash, , ratio 5.0: A effects backlash@x; B unknown",
        "  c single",
        "1 cases have an answer of A alone",
    ] {
        assert!(text.contains(words), "{words:?} is missing in {text}");
    }
    // Cases that were chosen by how they came out rank no program.
    fs::write(dir.path().join("corpus.csv"), "").unwrap();
    let text = compare(&of_a, &of_b).unwrap().text();
    assert!(text.contains("chosen by how they came out") && !text.contains("p = "), "{text}");
    // The same names of another generator.
    let other = tempfile::tempdir().unwrap();
    by_hand(other.path(), &[("a", "single", &["gravity-torque"], "effects")]);
    let results = other.path().join("results");
    let all = JudgedRun { trials: other.path(), results: &results, shard: (1, 1), limit: None };
    let answer = |_: &Path, out: &Path| {
        says(out, "unknown", &[], "[]", 0.0);
        Ok(TimeTaken::default())
    };
    run(&all, answer, |_, _| {}).unwrap();
    let of_c = Answers::find(other.path()).unwrap();
    assert!(compare(&of_a, &of_c).unwrap_err().to_string().contains("another generator"));
    assert!(Answers::find(&other.path().join("cases")).unwrap_err().to_string().contains("trial run"));
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_corpus_is_made_again_case_by_case_or_not_at_all() {
    let [first, again] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    generate(to(first.path()), &order(TrialPlant::Joint, TrialSplit::None, 2), |_, _| {}).unwrap();
    let results = first.path().join("results");
    let all = JudgedRun { trials: first.path(), results: &results, shard: (1, 1), limit: None };
    let answer = |_: &Path, out: &Path| {
        says(out, "unknown", &[], "[]", 0.0);
        Ok(TimeTaken::default())
    };
    run(&all, answer, |_, _| {}).unwrap();
    let mut corpus = Vec::new();
    fill_corpus(&mut corpus, &Answers::find(first.path()).unwrap().rows().unwrap(), 40, "abc");
    assert!(corpus.len() == 2 && corpus.iter().all(|e| !e.right && e.said == "unknown"));
    let file = first.path().join("watched.csv");
    write_corpus(&file, &corpus).unwrap();
    generate_corpus(to(again.path()), &file, (1, 1), |_, _| {}).unwrap();
    for folder in ["cases", "keys"] {
        assert_eq!(contents(&first.path().join(folder)), contents(&again.path().join(folder)));
    }
    assert!(again.path().join("corpus.csv").is_file());
    corpus[1].seal = "0".repeat(64);
    write_corpus(&file, &corpus).unwrap();
    let wrong = generate_corpus(to(again.path()), &file, (1, 1), |_, _| {}).unwrap_err().to_string();
    assert!(wrong.contains(&corpus[1].case) && wrong.contains(&format!("seed {SEED}")), "{wrong}");
}

/// The corpora of this project are cases of this generator: the first of joints without a gap here, which is made quickly,
/// all of them with --full.
fn made_again(plant: &str, all: bool) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../tests/corpus/{plant}.csv"));
    let mut corpus = read_corpus(&file).unwrap();
    if !all {
        corpus.retain(|e| e.truth.is_empty());
        corpus.truncate(1);
    }
    assert!(!corpus.is_empty(), "{}", file.display());
    let folder = tempfile::tempdir().unwrap();
    let part = folder.path().join("part.csv");
    write_corpus(&part, &corpus).unwrap();
    generate_corpus(to(folder.path()), &part, (1, 1), |_, _| {}).unwrap();
}

#[test]
fn the_corpus_of_joints_is_of_this_generator() {
    made_again("joint", false);
}

#[test]
#[ignore = "generates all cases of both corpora: ./test --full"]
fn both_corpora_are_of_this_generator() {
    made_again("joint", true);
    made_again("manipulator", true);
}
