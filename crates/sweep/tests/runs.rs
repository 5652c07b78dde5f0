//! Runs of a compiled FMU with a known solution: an undamped oscillator of 2 rad/s.

use std::path::{Path, PathBuf};

use tempfile::TempDir;
use trueup_cosim::{Master, SeriesMemory, check};
use trueup_sweep::{Runner, Shard, Tally, merge, read_log};
use trueup_testkit::{BlockFmu, BlockVersion, Dynamics, compiler};

const SWEEP: &str = r#"system = "mass.fmi3.fmu"
design = "grid"

[run]
stop = 1
step = 0.01

[factors]
xStart = { from = 0.5, to = 2, points = 4 }
fault = { values = [0, 3, 5] }

[outputs]
x = {}
fall = { variable = "x", take = "time", below = 0 }
never = { variable = "x", take = "time", above = 50 }
"#;

/// A folder with the FMU and the sweep; `None`, with a message, without a C compiler.
fn desk(sweep: &str) -> Option<(TempDir, PathBuf)> {
    if !compiler() {
        eprintln!("SKIPPED: no C compiler (cc)");
        return None;
    }
    let folder = tempfile::tempdir().unwrap();
    let rows = |m: &[&[f64]]| m.iter().map(|r| r.to_vec()).collect::<Vec<_>>();
    let dynamics = Dynamics::Linear {
        a: rows(&[&[0.0, 1.0], &[-4.0, 0.0]]),
        b: rows(&[&[0.0], &[1.0]]),
        c: rows(&[&[1.0, 0.0], &[0.0, 1.0]]),
        d: rows(&[&[0.0], &[0.0]]),
    };
    let block = BlockFmu::new("mass", &["F"], &["x", "v"], &[("xStart", 1.0), ("vStart", 0.0)], dynamics);
    block.build(BlockVersion::Three, folder.path()).unwrap();
    let file = folder.path().join("sweep.toml");
    std::fs::write(&file, sweep).unwrap();
    Some((folder, file))
}

fn done(file: &Path, index: u64, of: u64) -> Tally {
    Runner::open(file).unwrap().shard(Shard { index, of }, |_| {}).unwrap()
}

fn table(file: &Path) -> Vec<u8> {
    let to = file.with_extension("parquet");
    merge(&Runner::open(file).unwrap(), &to).unwrap();
    std::fs::read(to).unwrap()
}

/// Begins again.
fn forget(file: &Path) {
    std::fs::remove_dir_all(file.with_extension("runs")).unwrap();
}

#[test]
fn runs_give_the_known_solution_and_failures_are_rows_with_their_reason() {
    let Some((_folder, file)) = desk(SWEEP) else { return };
    let mut runner = Runner::open(&file).unwrap();
    assert_eq!(runner.design().runs(), 12);
    for run in 1..=12 {
        let x0 = 0.5 + 0.5 * ((run - 1) / 3) as f64;
        let record = runner.run(run);
        match (run - 1) % 3 {
            0 => {
                let values = record.result.unwrap();
                assert!((values[0].unwrap() - x0 * 2f64.cos()).abs() < 1e-12, "{run}: {values:?}");
                // On a line between rows that are 0.01 s apart.
                assert!((values[1].unwrap() - std::f64::consts::FRAC_PI_4).abs() < 1e-4, "{run}: {values:?}");
                assert_eq!(values[2], None);
            }
            1 => {
                let why = record.result.unwrap_err();
                assert!(why.starts_with("at t = ") && why.contains("fmi3DoStep"), "{why}");
            }
            _ => {
                let why = record.result.unwrap_err();
                assert!(why.contains("x of instance") && why.contains("NaN"), "{why}");
            }
        }
    }
}

#[test]
fn the_table_is_the_same_however_the_runs_were_shared_out_or_interrupted() {
    let Some((_folder, file)) = desk(SWEEP) else { return };
    let all = done(&file, 1, 1);
    assert_eq!((all.ran, all.kept, all.failed), (12, 0, 8));
    let whole = table(&file);
    assert_eq!((done(&file, 1, 1).ran, done(&file, 2, 3).kept), (0, 4), "nothing is repeated");
    forget(&file);
    for index in [3, 1, 5, 2, 4] {
        done(&file, index, 5);
    }
    assert!(table(&file) == whole, "five shares");
    // A log that ends in the middle of a line, then another sharing.
    forget(&file);
    done(&file, 1, 1);
    let log = file.with_extension("runs").join("1-of-1.log");
    let bytes = std::fs::read(&log).unwrap();
    for length in [0, 30, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(&log, &bytes[..length]).unwrap();
        let before = read_log(&log, Runner::open(&file).unwrap().print()).unwrap().records.len() as u64;
        let (one, two) = (done(&file, 1, 2), done(&file, 2, 2));
        assert_eq!((one.kept + two.kept, one.ran + two.ran), (before, 12 - before), "{length}");
        assert!(table(&file) == whole, "torn after {length} bytes");
        std::fs::remove_file(file.with_extension("runs").join("1-of-2.log")).unwrap();
        std::fs::remove_file(file.with_extension("runs").join("2-of-2.log")).unwrap();
    }
}

#[test]
fn nothing_is_merged_that_is_not_whole() {
    let Some((_folder, file)) = desk(SWEEP) else { return };
    let merged = |file: &Path| {
        let to = file.with_extension("parquet");
        let why = merge(&Runner::open(file).unwrap(), &to).unwrap_err().to_string();
        assert!(!to.exists());
        why
    };
    assert!(merged(&file).contains("no run is done yet"), "{}", merged(&file));
    done(&file, 1, 2);
    let why = merged(&file);
    assert!(
        why.contains("6 of 12 runs are not done (2, 4, 6, 8, 10, ...)") && why.contains("goes on"),
        "{why}"
    );
    // The same run with another result, as of an FMU that does not repeat itself.
    done(&file, 2, 2);
    let folder = file.with_extension("runs");
    let (print, other) = (Runner::open(&file).unwrap().print().to_owned(), folder.join("1-of-1.log"));
    let mut log = trueup_sweep::SweepLog::open(&other, &print).unwrap();
    log.add(&trueup_sweep::RunRecord { run: 4, result: Err("by chance".into()) }).unwrap();
    drop(log);
    let why = merged(&file);
    assert!(why.contains("run 4 gave something else in another log"), "{why}");
    std::fs::remove_file(other).unwrap();
    // Another state of the sweep.
    std::fs::write(&file, format!("{SWEEP}# changed\n")).unwrap();
    let why = merged(&file);
    assert!(why.contains("another state") && why.contains("move the folder sweep.runs away"), "{why}");
}

#[test]
fn a_run_is_the_same_alone_and_in_the_system_that_it_stands_for() {
    let Some((_folder, file)) = desk(SWEEP) else { return };
    let mut runner = Runner::open(&file).unwrap();
    let record = runner.run(10);
    let mut memory = SeriesMemory::default();
    let plan = check(&runner.system(10).unwrap()).unwrap();
    Master::new(plan).unwrap().run(&mut memory).unwrap();
    assert_eq!(memory.column("x").unwrap().last().copied(), record.result.unwrap()[0]);
    assert_eq!(memory.columns().len(), 2, "all outputs");
    let none = runner.system(13).unwrap_err().to_string();
    assert_eq!(none, "there is no run 13: the sweep has runs 1 to 12");
}

/// What is wrong with names is reported before anything runs, with the sweep's line.
#[test]
fn names_are_looked_up_first() {
    let Some((folder, file)) = desk(SWEEP) else { return };
    for (from, to, said) in [
        (
            "xStart =",
            "xStrat =",
            "sweep.toml:9: start of `xStrat`: the FMU has no variable `xStrat`; did you mean `xStart`?",
        ),
        ("xStart =", "v =", "sweep.toml:9: start of `v`: it is an output"),
        ("\"x\", take = \"time\", below", "\"y\", take = \"time\", below", "sweep.toml:14: `y`"),
        ("mass.fmi3", "mess.fmi3", "did you mean `mass.fmi3.fmu`?"),
        ("stop = 1", "stop = -1", "no run from 0.0 s to -1.0 s"),
    ] {
        let text = SWEEP.replacen(from, to, 1);
        assert_ne!(text, SWEEP, "{from}");
        std::fs::write(&file, text).unwrap();
        let why = Runner::open(&file).err().unwrap().to_string();
        assert!(why.contains(said), "{from}: {why}");
        assert!(!folder.path().join("sweep.runs").exists());
    }
}

/// The reason of a failure does not depend on where the program was started.
#[test]
fn rows_do_not_know_the_folder() {
    let Some((folder, file)) = desk(SWEEP) else { return };
    done(&file, 1, 1);
    let text = std::fs::read_to_string(file.with_extension("runs").join("1-of-1.log")).unwrap();
    assert!(!text.contains(&*folder.path().to_string_lossy()), "{text}");
}

#[test]
fn shares_are_each_run_once() {
    for (all, of) in [(12, 5), (3, 7), (1, 1), (100, 3)] {
        let mut runs: Vec<u64> = (1..=of).flat_map(|index| Shard { index, of }.runs(all)).collect();
        runs.sort_unstable();
        assert_eq!(runs, (1..=all).collect::<Vec<_>>());
    }
}
