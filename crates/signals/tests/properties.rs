//! Whatever is written reads back as it was; whatever bytes come, an answer comes.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use proptest::collection::vec;
use proptest::prelude::*;
use trueup_signals::{Case, Channel, DeclaredFigures, Recording, SignalUnit};

fn finite() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("finite", |x| x.is_finite())
}

/// Channels at rates of their own: each sample of a common clock is there or not.
fn recording() -> impl Strategy<Value = Recording> {
    (vec(finite(), 1..40), 1_usize..4).prop_flat_map(|(mut time, n)| {
        time.sort_unstable_by(f64::total_cmp);
        time.dedup();
        let rows = time.len();
        vec(vec(proptest::option::of(finite()), rows), n).prop_map(move |columns| {
            let channels = columns.iter().enumerate().filter_map(|(k, column)| {
                let (t, x): (Vec<_>, Vec<_>) =
                    time.iter().zip(column).filter_map(|(t, x)| Some((*t, (*x)?))).unzip();
                let name = format!("jointTorque[{}]", k + 1);
                (!t.is_empty()).then(|| Channel::new(&name, "", t, x))
            });
            Recording { channels: channels.collect(), ..Recording::default() }
        })
    })
}

fn bits(run: &Recording) -> Vec<(String, Vec<u64>, Vec<u64>)> {
    let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect();
    run.channels.iter().map(|c| (c.name.clone(), bits(&c.time), bits(&c.values))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_double_reads_back_bit_equal(run in recording()) {
        prop_assume!(!run.channels.is_empty());
        let folder = tempfile::tempdir().unwrap();
        for name in ["run.csv", "run.parquet"] {
            let file = folder.path().join(name);
            run.write(&file).unwrap();
            let (read, _) = Recording::read(&file, &[], &DeclaredFigures::default()).unwrap();
            prop_assert_eq!(bits(&read), bits(&run), "{}", name);
        }
        // Nothing but the two is left.
        prop_assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[test]
    fn hostile_bytes_get_an_answer(bytes in vec(any::<u8>(), 0..400)) {
        let folder = tempfile::tempdir().unwrap();
        let mut mat = b"MATLAB 5.0 MAT-file".to_vec();
        mat.resize(124, b' ');
        mat.extend(b"\x00\x01IM");
        mat.extend(&bytes);
        let parquet = [b"PAR1", bytes.as_slice(), b"PAR1"].concat();
        for (name, bytes) in [("a.csv", &bytes), ("a.mat", &mat), ("b.mat", &bytes), ("a.parquet", &parquet)] {
            let file = folder.path().join(name);
            std::fs::write(&file, bytes).unwrap();
            let _ = Recording::read(&file, &[], &DeclaredFigures::default());
        }
    }

    #[test]
    fn hostile_texts_get_an_answer(text in "(time|a|[0-9.,;\"\n\t eE+-]|\\[|\\]|=|nan|True){0,80}") {
        let _ = Recording::parse_csv("run.csv", text.as_bytes(), &[]);
        let _ = Case::parse(Path::new("case.toml"), &text, &[]);
        let _ = SignalUnit::parse(&text);
    }

    #[test]
    fn a_value_lies_between_its_neighbours(run in recording(), at in finite()) {
        for c in &run.channels {
            let (low, high) = c.range().unwrap();
            // Differences of the largest doubles overflow.
            prop_assume!(low.abs() < 1e300 && high.abs() < 1e300 && c.time.iter().all(|t| t.abs() < 1e300));
            let x = c.at(at);
            let slack = 1e-12 * low.abs().max(high.abs());
            prop_assert!((low - slack..=high + slack).contains(&x), "{} of {}..{}", x, low, high);
        }
    }
}
