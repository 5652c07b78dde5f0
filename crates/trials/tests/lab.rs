//! A sealed rig: rounds become recordings of its case, limits are kept.

use std::fs;
use std::path::Path;

use trueup_trials::{TrialSplit, new_lab, run_lab};

fn proposal(directory: &Path, rows: &[(f64, f64)]) -> std::path::PathBuf {
    let file = directory.join("proposal.csv");
    let rows: String = rows.iter().map(|(t, u)| format!("{t},{u}\n")).collect();
    fs::write(&file, format!("time,motorCurrent\n{rows}")).unwrap();
    file
}

fn columns(path: &Path) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|l| l.split(',').map(|c| c.parse().unwrap_or(f64::NAN)).collect()).collect()
}

#[test]
fn a_round_is_a_recording_of_the_case_and_the_same_round_is_the_same() {
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let notice = new_lab(a.path(), Some(TrialSplit::Single), Some(17)).unwrap();
    assert_eq!(new_lab(b.path(), Some(TrialSplit::Single), Some(17)).unwrap().seal, notice.seal);
    let limits = notice.limits;
    let rows: Vec<(f64, f64)> = (0..200)
        .map(|k| (0.01 * f64::from(k), 0.8 * limits.motor_current * (0.2 * f64::from(k)).sin()))
        .collect();
    let file = proposal(a.path(), &rows);
    let round = run_lab(a.path(), &file).unwrap();
    assert_eq!((round.number, round.file.as_str(), round.tripped), (1, "round-1.csv", false));
    let first = fs::read(a.path().join("case/round-1.csv")).unwrap();
    run_lab(b.path(), &file).unwrap();
    assert_eq!(first, fs::read(b.path().join("case/round-1.csv")).unwrap());
    // The current is the proposed one, with its noise; the load begins at rest where the limits say.
    let read = columns(&a.path().join("case/round-1.csv"));
    assert!((read[0][3] - limits.begin).abs() < 1e-2, "{} {}", read[0][3], limits.begin);
    let off = read.iter().map(|r| (r[1] - rows[((r[0] + 5e-6) / 0.01) as usize].1).abs()).fold(0.0, f64::max);
    assert!(off < 0.1 * limits.motor_current, "{off}");
    // Another one is another recording, with noise of its own.
    assert_eq!(run_lab(a.path(), &file).unwrap().file, "round-2.csv");
    assert_ne!(first, fs::read(a.path().join("case/round-2.csv")).unwrap());
    let case = fs::read_to_string(a.path().join("case/case.toml")).unwrap();
    assert!(case.contains(r#""train-3.csv", "round-1.csv", "round-2.csv"]"#), "{case}");
    let rounds = fs::read_to_string(a.path().join("rounds.csv")).unwrap();
    assert_eq!(rounds.lines().count(), 3);
    // No file outside `sealed` has the key.
    let key = fs::read_dir(a.path().join("sealed/keys")).unwrap().next().unwrap().unwrap().path();
    let key: trueup_trials::TruthKey = toml::from_str(&fs::read_to_string(key).unwrap()).unwrap();
    for entry in fs::read_dir(a.path().join("case")).unwrap() {
        assert!(!fs::read_to_string(entry.unwrap().path()).unwrap().contains(&key.effects[0]));
    }
}

#[test]
fn what_breaks_a_limit_is_not_run_and_a_load_that_leaves_its_range_ends_the_recording() {
    let rig = tempfile::tempdir().unwrap();
    let limits = new_lab(rig.path(), Some(TrialSplit::None), Some(17)).unwrap().limits;
    let most = limits.motor_current;
    for (rows, wanted) in [
        (vec![(0.0, 0.0), (0.1, 1.1 * most)], "line 3: "),
        (vec![(0.0, 0.0), (0.1, 1.1 * most)], "A; limits.toml allows"),
        (vec![(0.0, 0.0), (20.5, 0.0)], "line 3: 20.5 s; limits.toml allows 20 s"),
        (vec![(0.5, 0.0), (1.0, 0.0)], "line 2: it begins at 0.5 s"),
        (vec![(0.0, 0.0), (0.0, 0.0)], "line 3: 0 s is not after 0 s"),
        (vec![(0.0, f64::NAN), (1.0, 0.0)], "line 2: `NaN` of `motorCurrent` is no number"),
        (vec![(0.0, 0.0)], "fewer than two rows"),
    ] {
        let said = run_lab(rig.path(), &proposal(rig.path(), &rows)).unwrap_err().to_string();
        assert!(said.contains("proposal.csv: ") && said.contains(wanted), "{said}");
    }
    let file = rig.path().join("proposal.csv");
    fs::write(&file, "time,externalTorque\n0,1\n1,1\n").unwrap();
    let said = run_lab(rig.path(), &file).unwrap_err().to_string();
    assert!(said.contains("line 1: there is no column `motorCurrent`"), "{said}");
    fs::write(&file, "time,motorCurrent,externalTorque\n0,0,0\n1,0,1\n").unwrap();
    let said = run_lab(rig.path(), &file).unwrap_err().to_string();
    assert!(said.contains("line 3: `externalTorque` is not 0"), "{said}");
    assert!(!rig.path().join("case/round-1.csv").exists() && !rig.path().join("rounds.csv").exists());
    assert!(new_lab(rig.path(), None, None).unwrap_err().to_string().contains("a rig is here already"));
    let nowhere = tempfile::tempdir().unwrap();
    assert!(run_lab(nowhere.path(), &file).unwrap_err().to_string().contains("no rig is here"));
    // Full current one way.
    let round = run_lab(rig.path(), &proposal(rig.path(), &[(0.0, most), (20.0, most)])).unwrap();
    let read = columns(&rig.path().join("case/round-1.csv"));
    assert!(round.tripped && round.seconds < 20.0);
    assert!(read.iter().all(|r| r[3].is_nan() || r[3] < limits.load_angle[1] + 1e-2));
}
