//! What logging costs per communication step, compared with keeping the same rows in memory: all outputs of a TwoMassJoint and
//! its controller (nine floats and a Boolean, one float). `cargo bench -p trueup-cosim --bench results`
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

use std::time::Instant;

use trueup_cosim::{ColumnKind, ResultColumn, ResultRow, ResultSink, Results, RowValues, SeriesMemory};

const ROWS: u64 = 1_000_000;
const ROUNDS: usize = 5;

fn columns() -> Vec<ResultColumn> {
    let mut columns: Vec<_> =
        (0..10).map(|k| ResultColumn::new(format!("y[{k}]"), ColumnKind::Real, "rad")).collect();
    columns.push(ResultColumn::new("sticking", ColumnKind::Boolean, ""));
    columns
}

/// ns per row; the least of the rounds.
fn cost(mut begin: impl FnMut() -> Box<dyn ResultSink>, mut end: impl FnMut()) -> f64 {
    let columns = columns();
    let mut values = RowValues::of(&columns);
    let round = |_| {
        let mut sink = begin();
        let clock = Instant::now();
        sink.begin(&columns).unwrap();
        for point in 0..ROWS {
            let time = 1e-3 * point as f64;
            values.reals.iter_mut().enumerate().for_each(|(k, v)| *v = (time + k as f64) * 0.123_456_789);
            values.integers[0] = (point % 2) as i64;
            sink.row(ResultRow { time, point: Some(point), values: &values }).unwrap();
        }
        drop(sink);
        end();
        clock.elapsed().as_secs_f64() * 1e9 / ROWS as f64
    };
    (0..ROUNDS).map(round).fold(f64::INFINITY, f64::min)
}

/// Finishes its file when it is dropped.
struct Whole(Option<Results>);

impl ResultSink for Whole {
    fn begin(&mut self, columns: &[ResultColumn]) -> Result<(), trueup_cosim::CosimError> {
        self.0.begin(columns)
    }
    fn row(&mut self, row: ResultRow<'_>) -> Result<(), trueup_cosim::CosimError> {
        self.0.row(row)
    }
}

impl Drop for Whole {
    fn drop(&mut self) {
        self.0.take().unwrap().finish().unwrap();
    }
}

fn main() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| {
        let path = folder.path().join(name);
        let remove = path.clone();
        cost(
            || Box::new(Whole(Some(Results::create(&path).unwrap()))),
            move || std::fs::remove_file(&remove).unwrap(),
        )
    };
    let memory = cost(|| Box::new(SeriesMemory::default()), || ());
    println!("{ROWS} rows of 11 columns, ns per row, least of {ROUNDS} rounds");
    for (name, cost) in [("memory", memory), ("Parquet", file("r.parquet")), ("CSV", file("r.csv"))] {
        println!("{name:8} {cost:8.1} ns   {:6.2} x memory", cost / memory);
    }
}
