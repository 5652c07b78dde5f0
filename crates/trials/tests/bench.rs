//! The sealed benchmark: what is published, what is refused, and what scores are worth.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use trueup_trials::{
    BENCH_FORMAT, BenchEntry, BenchNotice, BenchOrder, BenchTier, CaseScore, ScoredEntry, TrialPlant,
    TrialSplit, TruthKey, bench_markdown, make_bench, score_entry,
};

const HEADER: &str = "case,item,name,place,recording,time,value,low,high";

fn hash(bytes: &[u8]) -> String {
    use sha2::{Digest, Sha256};
    Sha256::digest(bytes).iter().map(|b| format!("{b:02x}")).collect()
}

/// A benchmark of made-up cases: a key for each, one hold-out recording of eleven samples with `loadAngle` = t, noise 0.01.
fn made_up(directory: &Path, keys: &[(&str, TrialSplit, &str, &[&str])]) {
    let (public, sealed) = (directory.join("public"), directory.join("sealed"));
    fs::create_dir_all(sealed.join("keys")).unwrap();
    fs::create_dir_all(&public).unwrap();
    let (mut seals, mut tiers) = (String::from("case,key_sha256\n"), String::from("case,tier\n"));
    let mut requested = String::from("case,recording,time\n");
    for (name, split, verdict, effects) in keys {
        let key = TruthKey {
            case: (*name).into(),
            plant: TrialPlant::Joint,
            split: *split,
            verdict: (*verdict).into(),
            effects: effects.iter().map(|e| (*e).into()).collect(),
            components: Vec::new(),
            joints: Vec::new(),
            class: Vec::new(),
            drive: String::new(),
            ratio: 10.0,
            seed: 1,
            index: 0,
            law: Vec::new(),
            amplitudes: BTreeMap::new(),
            parameters: BTreeMap::from([("stiffness".into(), 100.0), ("damping".into(), 2.0)]),
            moved: BTreeMap::new(),
        };
        let text = toml::to_string(&key).unwrap();
        seals += &format!("{name},{}\n", hash(text.as_bytes()));
        fs::write(sealed.join("keys").join(format!("{name}.toml")), text).unwrap();
        let case = sealed.join("cases").join(name);
        fs::create_dir_all(&case).unwrap();
        fs::write(case.join("case.toml"), "model = 'TwoMassJoint'\n[channels.loadAngle]\nnoise = 1e-2\n")
            .unwrap();
        let mut rows = String::from("time,motorCurrent,loadAngle\n");
        for k in 0..=10 {
            let t = 0.1 * f64::from(k);
            rows += &format!("{t:.5},0.0,{t:.4}\n");
            if k > 2 {
                requested += &format!("{name},holdout-1.csv,{t:.5}\n");
            }
        }
        fs::write(case.join("holdout-1.csv"), rows).unwrap();
        tiers += &format!("{name},joint\n");
    }
    fs::write(sealed.join("seals.csv"), &seals).unwrap();
    fs::write(public.join("seals.csv"), &seals).unwrap();
    fs::write(public.join("cases.csv"), tiers).unwrap();
    fs::write(public.join("requested.csv"), requested).unwrap();
    let notice = BenchNotice {
        format: BENCH_FORMAT.into(),
        tiers: vec![BenchTier::Joint],
        cases: keys.len(),
        generator: String::new(),
        seals: hash(seals.as_bytes()),
    };
    fs::write(public.join("bench.toml"), toml::to_string(&notice).unwrap()).unwrap();
}

const KEYS: [(&str, TrialSplit, &str, &[&str]); 5] = [
    ("joint-0", TrialSplit::None, "no-gap", &[]),
    ("joint-1", TrialSplit::Single, "effects", &["backlash"]),
    ("joint-2", TrialSplit::Pairs, "effects", &["gravity-torque", "backlash"]),
    ("joint-3", TrialSplit::Outside, "unknown", &["magnet"]),
    ("joint-4", TrialSplit::Unidentifiable, "ambiguous", &["gravity-torque"]),
];

fn entry(directory: &Path, rows: &str) -> PathBuf {
    let file = directory.join("entry.csv");
    fs::write(&file, format!("{HEADER}\n{rows}")).unwrap();
    file
}

fn scores(rows: &str) -> Vec<CaseScore> {
    let directory = tempfile::tempdir().unwrap();
    made_up(directory.path(), &KEYS);
    score_entry(directory.path(), &entry(directory.path(), rows)).unwrap()
}

const VERDICTS: &str = "joint-0,verdict,no-gap,,,,,,\njoint-1,verdict,effects,,,,,,\njoint-2,verdict,effects,,,,,,\n\
    joint-3,verdict,unknown,,,,,,\njoint-4,verdict,ambiguous,,,,,,\n\
    joint-1,effect,backlash,motor/1,,,0.9,,\njoint-2,effect,backlash,,,,,,\njoint-2,effect,gravity-torque,,,,,,\n\
    joint-4,effect,cable-stiffness,,,,0.5,,\njoint-4,effect,gravity-torque,,,,0.5,,\n";

#[test]
fn scores_are_those_of_their_formulas() {
    let answers = "joint-0,answer,no-gap,,,,0.8,,\njoint-0,answer,unknown,,,,0.2,,\n";
    let intervals = "joint-0,parameter,stiffness,,,,101,99,103\njoint-0,parameter,damping,,,,3,2.5,3.5\n";
    let outputs: String = (3..=10)
        .map(|k| {
            format!(
                "joint-0,output,loadAngle,,holdout-1.csv,{:.2},{:.3},,\n",
                0.1 * f64::from(k),
                0.1 * f64::from(k) + 0.02
            )
        })
        .collect();
    let all = scores(&format!("{VERDICTS}{answers}{intervals}{outputs}joint-0,cost,,,,,7.5,,\n"));
    assert_eq!(all.iter().map(|s| s.right).collect::<Vec<_>>(), [true; 5]);
    let truths: Vec<&str> = all.iter().map(|s| s.truth.as_str()).collect();
    assert_eq!(truths, ["no-gap", "backlash", "backlash+gravity-torque", "unknown", "gravity-torque"]);
    let first = &all[0];
    assert!((first.log_score - (0.99f64 * 0.8 + 0.01 / 50.0).ln()).abs() < 1e-12);
    assert!((first.brier - (0.2f64.powi(2) + 0.2f64.powi(2))).abs() < 1e-12);
    assert_eq!((first.covered, first.intervals, first.processor_seconds), (1, 2, Some(7.5)));
    // Readings 0 to 1 in eleven steps have a variance of 0.1.
    assert!((first.gap.unwrap() - 0.02 / 0.1f64.sqrt()).abs() < 1e-9);
    assert!((first.floor.unwrap() - 0.01 / 0.1f64.sqrt()).abs() < 1e-9);
    // A verdict without answers is one with certainty; an ambiguous one shares it.
    assert!((all[1].log_score - (0.99f64 + 0.01 / 50.0).ln()).abs() < 1e-12 && all[1].brier == 0.0);
    assert!((all[4].brier - 0.5).abs() < 1e-12 && (all[4].confidence - 1.0).abs() < 1e-12);
    let page = bench_markdown(&[ScoredEntry { name: "mine".into(), cases: all }]);
    assert!(page.contains("| right verdicts | 100.0 % (5/5; 56.6 to 100.0 %) |"), "{page}");
    assert!(page.contains("| 95 % intervals that cover | 50.0 % (1/2;"), "{page}");
    assert!(page.contains("| - within twice the floor | 100.0 % (1/1;"), "{page}");
}

/// In the mean over truths drawn from p the Brier score is least for p itself.
#[test]
fn an_honest_probability_has_the_best_brier_score() {
    let brier = |q: f64, truth: &str| {
        let rows =
            format!("{VERDICTS}joint-0,answer,no-gap,,,,{q},,\njoint-0,answer,backlash,,,,{},,\n", 1.0 - q);
        let s = &scores(&rows)[0];
        // The same answers if the truth were the other one.
        if truth == "no-gap" { s.brier } else { 2.0 * q * q }
    };
    for p in [0.1, 0.35, 0.7] {
        let mean = |q: f64| p * brier(q, "no-gap") + (1.0 - p) * brier(q, "backlash");
        for q in [0.0, 0.2, 0.5, 0.9, 1.0] {
            assert!(mean(p) < mean(q), "{p} {q}");
        }
    }
}

#[test]
fn what_is_wrong_with_an_entry_is_named_with_its_line() {
    let directory = tempfile::tempdir().unwrap();
    made_up(directory.path(), &KEYS);
    let public = directory.path().join("public");
    for (rows, wanted) in [
        ("joint-9,verdict,no-gap,,,,,,\n", "line 2: case `joint-9` is not in this benchmark"),
        ("joint-0,verdict,nogap,,,,,,\n", "line 2: verdict `nogap` is none of no-gap, parameters"),
        (
            "joint-0,verdict,no-gap,,,,,,\njoint-0,verdict,no-gap,,,,,,\n",
            "line 3: a second verdict of case joint-0",
        ),
        ("joint-0,guess,no-gap,,,,,,\n", "line 2: item `guess` is none of verdict, answer"),
        ("joint-0,answer,no-gap,,,,1.5,,\n", "line 2: a probability of 1.5; it is between 0 and 1"),
        ("joint-0,answer,no-gap,,,,,,\n", "line 2: `answer` has no value"),
        ("joint-0,answer,no-gap,,,,NaN,,\n", "line 2: `answer` has no value"),
        ("joint-0,answer,a+b,,,,0.1,,\njoint-0,answer,b+a,,,,0.1,,\n", "line 3: a second answer `a+b`"),
        (
            "joint-0,parameter,stiffness,,,,1,3,2\n",
            "line 2: the interval of `stiffness` ends before it begins",
        ),
        ("joint-0,output,loadAngle,,holdout-1.csv,0.15,1,,\n", "line 2: 0.15 s was not requested"),
        (
            "joint-0,output,loadAngle,,train-1.csv,0.5,1,,\n",
            "line 2: `train-1.csv` is no hold-out recording of joint-0",
        ),
        ("joint-0,output,loadAngle,,holdout-1.csv,,1,,\n", "line 2: `output` has no time"),
        ("joint-0,cost,,,,,-1,,\n", "line 2: -1 s of processor time"),
        ("joint-1,effect,backlash,motor/x,,,1,,\n", "line 2: `motor/x`: the joint is a number"),
        ("joint-0,answer,no-gap,,,,one,,\n", "line 2: "),
        ("joint-0,verdict,no-gap,,,,,,\n", "4 of 5 cases have no verdict, joint-1 is the first"),
        ("joint-0,answer,no-gap,,,,1,,\n", "case joint-0: it has items, but no verdict"),
        (
            "joint-0,verdict,effects,,,,,,\n",
            "case joint-0: its verdict is `effects`, but there is no row `effect`",
        ),
        (
            "joint-0,verdict,no-gap,,,,,,\njoint-0,effect,backlash,,,,,,\n",
            "its verdict is `no-gap`, but there are rows",
        ),
        (
            "joint-0,verdict,unknown,,,,,,\njoint-0,answer,a,,,,0.7,,\njoint-0,answer,b,,,,0.7,,\n",
            "add up to 1.4, more than 1",
        ),
        (
            "joint-0,verdict,no-gap,,,,,,\njoint-0,output,loadAngle,,holdout-1.csv,0.5,1,,\n",
            "1 of 8 times of `loadAngle` in holdout-1.csv",
        ),
    ] {
        let said = BenchEntry::read(&public, &entry(directory.path(), rows)).unwrap_err().to_string();
        assert!(said.contains("entry.csv: ") && said.contains(wanted), "{rows}: {said}");
    }
    let file = directory.path().join("entry.csv");
    fs::write(&file, "case,item\n").unwrap();
    let said = BenchEntry::read(&public, &file).unwrap_err().to_string();
    assert!(said.contains("line 1: there is no column `name`; the columns are case,item,"), "{said}");
    fs::write(&file, format!("{HEADER},more\n")).unwrap();
    let said = BenchEntry::read(&public, &file).unwrap_err().to_string();
    assert!(said.contains("line 1: column `more` is none of case,item,"), "{said}");
    let said = BenchNotice::read(directory.path()).unwrap_err().to_string();
    assert!(said.contains("no `bench.toml` in it: name the folder `public`"), "{said}");
}

#[test]
fn a_key_that_was_changed_after_its_hash_was_out_is_refused() {
    let directory = tempfile::tempdir().unwrap();
    made_up(directory.path(), &KEYS);
    let file = entry(directory.path(), VERDICTS);
    assert!(score_entry(directory.path(), &file).is_ok());
    let key = directory.path().join("sealed/keys/joint-1.toml");
    let text = fs::read_to_string(&key).unwrap();
    fs::write(&key, text.replace("backlash", "hysteresis")).unwrap();
    let said = score_entry(directory.path(), &file).unwrap_err().to_string();
    assert!(said.contains("joint-1.toml: this key is not the one that was sealed"), "{said}");
    // With its seal changed as well, it is not what the public folder commits to.
    let seals = directory.path().join("sealed/seals.csv");
    fs::write(&seals, fs::read_to_string(&seals).unwrap().replace("joint-1,", "joint-1,0")).unwrap();
    let said = score_entry(directory.path(), &file).unwrap_err().to_string();
    assert!(said.contains("not those that public/bench.toml commits to"), "{said}");
    fs::remove_dir_all(directory.path().join("sealed")).unwrap();
    let said = score_entry(directory.path(), &file).unwrap_err().to_string();
    assert!(said.contains("there are no keys in it: they are published when the entries are in"), "{said}");
}

#[test]
fn a_public_case_ends_its_hold_out_readings_early_and_holds_no_key() {
    let directory = tempfile::tempdir().unwrap();
    let order = BenchOrder { tiers: vec![BenchTier::Joint], cases: 1, seed: Some(17) };
    let notice = make_bench(directory.path(), None, &order, |_, _| {}).unwrap();
    let (public, sealed) = (directory.path().join("public"), directory.path().join("sealed"));
    assert_eq!(BenchNotice::read(&public).unwrap(), notice);
    let name = fs::read_dir(public.join("cases")).unwrap().next().unwrap().unwrap().file_name();
    let (shown, whole) = (public.join("cases").join(&name), sealed.join("cases").join(&name));
    let read = |folder: &Path, file: &str| fs::read_to_string(folder.join(file)).unwrap();
    for file in ["case.toml", "train-1.csv", "train-3.csv"] {
        assert_eq!(read(&shown, file), read(&whole, file));
    }
    let key: TruthKey =
        toml::from_str(&read(&sealed, &format!("keys/{}.toml", name.to_string_lossy()))).unwrap();
    for entry in fs::read_dir(&shown).unwrap() {
        assert!(!fs::read_to_string(entry.unwrap().path()).unwrap().contains(&key.effects[0]));
    }
    let (part, all) = (read(&shown, "holdout-1.csv"), read(&whole, "holdout-1.csv"));
    let requested = read(&public, "requested.csv");
    let times: Vec<f64> =
        requested.lines().skip(1).filter_map(|l| l.rsplit(',').next()?.parse().ok()).collect();
    let end: f64 = all.lines().last().unwrap().split(',').next().unwrap().parse().unwrap();
    assert!(
        (100..=400).contains(&times.len()) && times.iter().all(|t| *t > 0.2 * end - 1e-9),
        "{}",
        times.len()
    );
    for (a, b) in part.lines().zip(all.lines()).skip(1) {
        let (a, b): (Vec<&str>, Vec<&str>) = (a.split(',').collect(), b.split(',').collect());
        let time: f64 = a[0].parse().unwrap();
        assert_eq!((a[0], a[1], a.len()), (b[0], b[1], b.len()));
        let kept = if time <= 0.2 * end { &b[2..] } else { &vec![""; b.len() - 2][..] };
        assert_eq!(&a[2..], kept, "{time}");
    }
    // Continued it is the same; another order is refused.
    assert_eq!(make_bench(directory.path(), None, &order, |_, _| {}).unwrap(), notice);
    let other = BenchOrder { cases: 2, ..order };
    let said = make_bench(directory.path(), None, &other, |_, _| {}).unwrap_err().to_string();
    assert!(said.contains("order.toml: a benchmark of other tiers, another number of cases"), "{said}");
}
