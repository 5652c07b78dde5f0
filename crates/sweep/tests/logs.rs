//! Logs: what is whole is read, what is torn or damaged never is.

use std::path::Path;

use proptest::prelude::*;
use trueup_sweep::{RunRecord, SweepLog, read_log};

fn records() -> Vec<RunRecord> {
    let done = |run, values: &[Option<f64>]| RunRecord { run, result: Ok(values.to_vec()) };
    vec![
        done(1, &[Some(0.1), None]),
        done(2, &[Some(-0.0), Some(f64::MIN_POSITIVE / 8.0)]),
        RunRecord { run: 3, result: Err("at t = 0.2 s: \"left\" failed\u{e9}".into()) },
        done(40, &[Some(1.0 / 3.0), Some(1e300)]),
    ]
}

fn write(path: &Path, records: &[RunRecord]) {
    let mut log = SweepLog::open(path, "p").unwrap();
    records.iter().for_each(|r| log.add(r).unwrap());
    log.sync().unwrap();
}

#[test]
fn what_was_written_is_read_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1-of-1.log");
    write(&path, &records());
    let found = read_log(&path, "p").unwrap();
    assert_eq!((found.records, found.damage.len(), found.known), (records(), 0, true));
}

/// However much of the file is left: the records before are there, and it goes on behind them.
#[test]
fn torn_anywhere_it_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1-of-1.log");
    write(&path, &records());
    let whole = std::fs::read(&path).unwrap();
    for length in 0..whole.len() {
        std::fs::write(&path, &whole[..length]).unwrap();
        let before = read_log(&path, "p").unwrap().records;
        assert_eq!(before[..], records()[..before.len()], "{length}");
        // A record lacks nothing once all but the end of its line is there.
        let ended = whole[..(length + 1).min(whole.len())].iter().filter(|b| **b == b'\n').count();
        assert_eq!(before.len(), ended.saturating_sub(1), "{length}");
        write(&path, &records()[before.len()..]);
        assert_eq!(read_log(&path, "p").unwrap().records, records(), "{length}");
    }
}

#[test]
fn of_another_sweep_or_in_use_it_is_refused_and_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1-of-1.log");
    write(&path, &records());
    let before = std::fs::read(&path).unwrap();
    let said = |why: String, words: &[&str]| words.iter().for_each(|w| assert!(why.contains(w), "{why}"));
    said(read_log(&path, "q").unwrap_err().to_string(), &["1-of-1.log", "another state", "move the folder"]);
    said(SweepLog::open(&path, "q").err().unwrap().to_string(), &["another state"]);
    let _in_use = SweepLog::open(&path, "p").unwrap();
    said(SweepLog::open(&path, "p").err().unwrap().to_string(), &["another process"]);
    assert_eq!(std::fs::read(&path).unwrap(), before);
}

proptest! {
    /// A byte that a disk changed never makes another result: its record is missing, and its line is named.
    #[test]
    fn a_changed_byte_is_found(at in 0_usize..200, with in 1_u8..=255) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("1-of-1.log");
        write(&path, &records());
        let mut bytes = std::fs::read(&path).unwrap();
        let at = at % bytes.len();
        bytes[at] ^= with;
        std::fs::write(&path, &bytes).unwrap();
        let found = read_log(&path, "p").unwrap();
        prop_assert!(found.records.iter().all(|r| records().contains(r)));
        prop_assert!(found.records.len() < records().len());
        let last_line_torn = at + 1 == bytes.len();
        prop_assert!(!found.damage.is_empty() || last_line_torn);
    }

    /// Letters of the sum in another case are damage, too.
    #[test]
    fn a_sum_in_capitals_is_damage(at in 0_usize..8) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("1-of-1.log");
        write(&path, &records());
        let text = std::fs::read_to_string(&path).unwrap();
        let Some((begin, digit)) = text.match_indices('\n').find_map(|(n, _)| {
            let digit = text.as_bytes().get(n + 1 + at).copied()?;
            digit.is_ascii_lowercase().then_some((n + 1 + at, digit))
        }) else { return Ok(()) };
        let mut bytes = text.into_bytes();
        bytes[begin] = digit.to_ascii_uppercase();
        std::fs::write(&path, &bytes).unwrap();
        let found = read_log(&path, "p").unwrap();
        prop_assert_eq!(found.records.len() + 1, records().len());
        prop_assert_eq!(found.damage.len(), 1);
    }
}
