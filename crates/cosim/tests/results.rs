//! Files of results: every value reads back as it was, and no file bears a name that it does not deserve.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use trueup_cosim::{
    ColumnKind, CosimError, ResultColumn, ResultRow, ResultSink, Results, RowValues, SeriesMemory,
};

fn columns() -> Vec<ResultColumn> {
    let mut columns = vec![
        ResultColumn::new("plant.angle", ColumnKind::Real, "rad"),
        ResultColumn::new("a[1,2]", ColumnKind::Single, ""),
        ResultColumn::new("signed", ColumnKind::Integer, ""),
        ResultColumn::new("stuck", ColumnKind::Boolean, ""),
        ResultColumn::new("unsigned", ColumnKind::Unsigned, ""),
        ResultColumn::new("state", ColumnKind::Text, ""),
        ResultColumn::new("seldom", ColumnKind::Real, "N.m"),
    ];
    columns[6].every = 3;
    columns
}

/// Doubles of all magnitudes, from their bits.
fn double(k: u64) -> f64 {
    let mut bits = k.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = f64::from_bits(bits ^ (bits >> 27));
    if x.is_finite() { x } else { f64::MIN_POSITIVE }
}

fn texts(k: u64) -> String {
    ["plain", "a,b", "say \"no\"", "", "two\nlines"][(k % 5) as usize].to_owned()
}

fn values(k: u64) -> RowValues {
    RowValues {
        reals: vec![double(k), f64::from(double(k) as f32).clamp(-1e30, 1e30), double(k + 1000)],
        integers: vec![i64::MIN + k as i64, (k % 2) as i64, (u64::MAX - k) as i64],
        texts: vec![texts(k)],
    }
}

/// `rows` points, and an event between the second and the third.
fn fill(sink: &mut dyn ResultSink, rows: u64) -> Result<(), CosimError> {
    sink.begin(&columns())?;
    for k in 0..rows {
        sink.row(ResultRow { time: 0.1 * k as f64, point: Some(k), values: &values(k) })?;
        if k == 1 {
            sink.row(ResultRow { time: 0.1, point: None, values: &values(k) })?;
        }
    }
    Ok(())
}

fn written(folder: &Path, name: &str, rows: u64) -> std::path::PathBuf {
    let file = folder.join(name);
    let mut results = Results::create(&file).unwrap();
    fill(&mut results, rows).unwrap();
    assert!(!file.exists(), "a run under way has its name already");
    results.finish().unwrap();
    file
}

/// What is expected at row `i`: point (`None`: the event) and its values.
fn row(i: usize) -> (Option<u64>, RowValues) {
    let k = if i < 2 { i as u64 } else { i as u64 - 1 };
    ((i != 2).then_some(k), values(k))
}

#[test]
fn csv_reads_back_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let file = written(folder.path(), "r.csv", 5000);
    let mut reader = csv::Reader::from_path(&file).unwrap();
    let header: Vec<String> = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let names = columns().into_iter().map(|c| c.name);
    assert_eq!(header, std::iter::once("time".to_owned()).chain(names).collect::<Vec<_>>());
    let mut rows = 0;
    for (i, record) in reader.records().enumerate() {
        let (record, (point, v)) = (record.unwrap(), row(i));
        let number = |at: usize| record[at].parse::<f64>().unwrap().to_bits();
        assert_eq!(number(0), (0.1 * point.unwrap_or(1) as f64).to_bits());
        assert_eq!(number(1), v.reals[0].to_bits());
        assert_eq!(record[2].parse::<f32>().unwrap(), v.reals[1] as f32);
        assert_eq!(record[3].parse::<i64>().unwrap(), v.integers[0]);
        assert_eq!(&record[4], if v.integers[1] == 1 { "1" } else { "0" });
        assert_eq!(record[5].parse::<u64>().unwrap(), v.integers[2] as u64);
        assert_eq!(record[6], v.texts[0]);
        match point.is_none_or(|k| k % 3 == 0) {
            true => assert_eq!(number(7), v.reals[2].to_bits()),
            false => assert_eq!(&record[7], ""),
        }
        rows += 1;
    }
    assert_eq!(rows, 5001);
}

#[test]
fn parquet_reads_back_bit_for_bit_over_several_groups() {
    reads_back(150_000);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn parquet_reads_back_bit_for_bit_over_more_groups() {
    reads_back(300_000);
}

fn reads_back(points: u64) {
    let folder = tempfile::tempdir().unwrap();
    let file = written(folder.path(), "r.parquet", points);
    let reader = SerializedFileReader::new(std::fs::File::open(&file).unwrap()).unwrap();
    assert!(reader.num_row_groups() > 1);
    let metadata = reader.metadata().file_metadata().key_value_metadata().unwrap();
    assert!(
        metadata.iter().any(|m| m.key == "unit.plant.angle" && m.value.as_deref() == Some("rad")),
        "{metadata:?}"
    );
    let mut rows = 0;
    for (i, record) in reader.get_row_iter(None).unwrap().enumerate() {
        let (record, (point, v)) = (record.unwrap(), row(i));
        let cells: Vec<Field> = record.get_column_iter().map(|(_, field)| field.clone()).collect();
        let due = point.is_none_or(|k| k % 3 == 0);
        let expected = [
            Field::Double(0.1 * point.unwrap_or(1) as f64),
            Field::Double(v.reals[0]),
            Field::Float(v.reals[1] as f32),
            Field::Long(v.integers[0]),
            Field::Bool(v.integers[1] == 1),
            Field::ULong(v.integers[2] as u64),
            Field::Str(v.texts[0].clone()),
            if due { Field::Double(v.reals[2]) } else { Field::Null },
        ];
        assert_eq!(cells, expected, "row {i}");
        rows += 1;
    }
    assert_eq!(rows, points + 1);
}

#[test]
fn memory_keeps_what_was_given() {
    let mut memory = (SeriesMemory::default(), None::<SeriesMemory>);
    fill(&mut memory, 10).unwrap();
    let (memory, _) = memory;
    assert_eq!(memory.time().len(), 11);
    assert_eq!(memory.column("plant.angle").unwrap()[4], double(3));
    assert_eq!(memory.column("unsigned").unwrap()[0], u64::MAX as f64);
    let seldom: Vec<usize> = (0..11).filter(|i| !memory.column("seldom").unwrap()[*i].is_nan()).collect();
    assert_eq!(seldom, [0, 2, 4, 7, 10]); // points 0, 3, 6, 9 and the event
    assert_eq!(memory.column("nothing"), None);
}

#[test]
fn a_failed_run_keeps_a_readable_file_of_another_name() {
    for name in ["r.csv", "r.parquet"] {
        let folder = tempfile::tempdir().unwrap();
        let files = || std::fs::read_dir(folder.path()).unwrap().count();
        let file = folder.path().join(name);
        let mut results = Results::create(&file).unwrap();
        fill(&mut results, 7).unwrap();
        let kept = results.keep_partial().unwrap().unwrap();
        assert_eq!((kept.exists(), file.exists(), files()), (true, false, 1));
        assert!(kept.to_string_lossy().contains("r.partial."), "{kept:?}");
        let rows = if name.ends_with("csv") {
            csv::Reader::from_path(&kept).unwrap().records().filter(Result::is_ok).count()
        } else {
            let reader = SerializedFileReader::new(std::fs::File::open(&kept).unwrap()).unwrap();
            reader.metadata().file_metadata().num_rows() as usize
        };
        assert_eq!(rows, 8);
        // Nothing to keep, and nothing is left when a run is dropped.
        std::fs::remove_file(kept).unwrap();
        let mut results = Results::create(&file).unwrap();
        results.begin(&columns()).unwrap();
        assert_eq!(results.keep_partial().unwrap(), None);
        let mut results = Results::create(&file).unwrap();
        fill(&mut results, 3).unwrap();
        drop(results);
        assert_eq!(files(), 0);
        // No column at all is a file all the same.
        let mut results = Results::create(&file).unwrap();
        results.begin(&[]).unwrap();
        results.row(ResultRow { time: 0.0, point: Some(0), values: &RowValues::default() }).unwrap();
        results.finish().unwrap();
        assert!(file.exists());
    }
}

#[test]
fn a_name_or_folder_that_cannot_be_is_refused_at_once() {
    for (name, says) in [("r.mat", ".parquet"), ("nowhere/r.csv", "nowhere"), ("r", ".csv")] {
        let folder = tempfile::tempdir().unwrap();
        let error = Results::create(&folder.path().join(name)).err().unwrap().to_string();
        assert!(error.contains(says), "{error}");
    }
}
