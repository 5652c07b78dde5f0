//! The page of `trueup simulate --plot`: the moving picture, one chart per vector and per unit of scalars, a table, the log of the run.

use trueup_cosim::{ColumnKind, SeriesMemory};
use trueup_report::{Chart, Page, Style, escape, number};

use crate::moving::{self, PlantInRun};

/// Curves that can be distinguished in one chart.
const MOST: usize = 8;

/// A curve so many times smaller than another one is drawn apart from it.
const FLAT: f64 = 200.0;

/// One HTML file.
pub(crate) fn page(title: &str, results: &SeriesMemory, plants: &[PlantInRun], log: &str) -> String {
    let time = results.time();
    let (first, last) = (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0));
    let lead = format!("{} rows from {} s to {} s.", time.len(), number(first), number(last));
    let mut page = Page::new(title, &lead);
    moving::section(&mut page, plants, results);
    page.section("Results", "Drag to zoom, double click to see all, click a name to hide its curve.");
    for group in groups(results) {
        let columns = group.iter().map(|k| &results.columns()[*k]);
        let named: Vec<&str> = columns.clone().map(|c| c.name.as_str()).collect();
        let title = match &named[..] {
            [first, second, third, _, ..] => format!("{first}, {second}, {third}, …"),
            few => few.join(", "),
        };
        let unit = columns.clone().next().map_or("", |c| c.unit.as_str());
        let chart = group.iter().zip(columns).fold(Chart::over_time(&title, unit), |chart, (k, column)| {
            let float = matches!(column.kind, ColumnKind::Real | ColumnKind::Single);
            let style = if float { Style::Line } else { Style::Step };
            chart.series(&column.name, time, &results.series()[*k], style)
        });
        page.chart(&chart);
    }
    page.section("Ranges", "");
    page.table(&["variable", "unit", "least", "greatest", "last"], &ranges(results));
    if !log.is_empty() {
        page.section("Run", "");
        page.html(&format!("<pre>{}</pre>", escape(log)));
    }
    page.finish()
}

/// The elements of a vector, and scalars of the same unit and sort, in the order of the columns, cut into charts.
fn groups(results: &SeriesMemory) -> Vec<Vec<usize>> {
    let sort = |k: &usize| {
        let column = &results.columns()[*k];
        (
            vector(&column.name),
            column.unit.as_str(),
            matches!(column.kind, ColumnKind::Real | ColumnKind::Single),
            column.kind == ColumnKind::Boolean,
        )
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for k in (0..results.columns().len()).filter(|k| results.columns()[*k].kind != ColumnKind::Text) {
        match groups.iter_mut().find(|g| sort(&g[0]) == sort(&k)) {
            Some(group) => group.push(k),
            None => groups.push(vec![k]),
        }
    }
    let groups = groups.into_iter().flat_map(|group| match vector(&results.columns()[group[0]].name) {
        Some(_) => vec![group],
        None => magnitudes(results, group),
    });
    let even = |group: &Vec<usize>| group.len().div_ceil(group.len().div_ceil(MOST));
    groups.flat_map(|g| g.chunks(even(&g)).map(<[usize]>::to_vec).collect::<Vec<_>>()).collect()
}

/// Of which vector this is an element: `jointAngle[2]` of `jointAngle`, `tipPosition[1,3]` of row 1 of `tipPosition`.
fn vector(column: &str) -> Option<&str> {
    let (row, _) = column.split_once('[')?;
    Some(column.rsplit_once(',').map_or(row, |(row, _)| row))
}

/// Cuts a group so that no curve is flat next to another one: an angle before a gear and one behind it.
fn magnitudes(results: &SeriesMemory, mut group: Vec<usize>) -> Vec<Vec<usize>> {
    let size = |k: &usize| {
        let finite = results.series()[*k].iter().filter(|v| v.is_finite());
        finite.fold(0.0, |m: f64, v| m.max(v.abs()))
    };
    let mut cut = Vec::new();
    while let Some(largest) = group.iter().map(size).reduce(f64::max) {
        let (with, rest): (Vec<_>, Vec<_>) =
            group.into_iter().partition(|k| size(k) == 0.0 || size(k) * FLAT >= largest);
        cut.push(with);
        group = rest;
    }
    cut
}

fn ranges(results: &SeriesMemory) -> Vec<Vec<String>> {
    let row = |(column, values): (&trueup_cosim::ResultColumn, &Vec<f64>)| {
        let finite = || values.iter().copied().filter(|v| v.is_finite());
        let shown = |v: Option<f64>| v.map_or_else(String::new, number);
        vec![
            column.name.clone(),
            column.unit.clone(),
            shown(finite().reduce(f64::min)),
            shown(finite().reduce(f64::max)),
            shown(finite().next_back()),
        ]
    };
    results.columns().iter().zip(results.series()).map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_cosim::{ResultColumn, ResultRow, ResultSink, RowValues};

    #[test]
    fn one_chart_per_unit_and_no_more_curves_than_colours() {
        let mut columns: Vec<ResultColumn> =
            (0..10).map(|k| ResultColumn::new(format!("a[{k}]"), ColumnKind::Real, "rad")).collect();
        columns.push(ResultColumn::new("stuck", ColumnKind::Boolean, ""));
        columns.push(ResultColumn::new("says", ColumnKind::Text, ""));
        columns.push(ResultColumn::new("v", ColumnKind::Real, "rad/s"));
        let (mut results, values) = (SeriesMemory::default(), RowValues::of(&columns));
        assert!(results.begin(&columns).is_ok());
        assert!(results.row(ResultRow { time: 0.0, point: Some(0), values: &values }).is_ok());
        let sizes: Vec<usize> = groups(&results).iter().map(Vec::len).collect();
        assert_eq!(sizes, [5, 5, 1, 1]);
        for (column, wanted) in [("q[2]", Some("q")), ("a.b[1,3]", Some("a.b[1")), ("a.b", None)] {
            assert_eq!(vector(column), wanted);
        }
        let html = page("<run>", &results, &[], "log & all");
        assert_eq!(html.matches("<svg").count(), 4);
        assert!(html.contains("&lt;run&gt;") && html.contains("log &amp; all"));
    }
}
