//! What was found next to the user's values.

use trueup_diagnosis::outcome::{ClaimedAmount, Diagnosis, EstimateCorrelation};

use super::words::{amount, at, effect_name, interval, with_unit};
use crate::number::number;
use crate::page::Page;

/// A value that is reported: its name, the effect it is of, the value.
struct ReportedValue<'a> {
    name: String,
    amount: &'a ClaimedAmount,
}

/// Of effects first, then the plant's own.
fn values(d: &Diagnosis) -> Vec<ReportedValue<'_>> {
    let of_effects = d.effects.iter().flat_map(|e| {
        let place = at(d, &e.component, e.joint);
        e.parameters.iter().map(move |(name, amount)| ReportedValue {
            name: format!("{name} ({}, {place})", effect_name(&e.id)),
            amount,
        })
    });
    let own = d.parameters.iter().map(|(name, amount)| ReportedValue { name: name.clone(), amount });
    of_effects.chain(own).collect()
}

const HEAD: [&str; 6] = [
    "parameter",
    "yours",
    "found",
    "change in %",
    "in standard deviations of yours",
    "95 % interval of found",
];

/// Yours, found, change in percent and in standard deviations of yours; both sides of the gear; correlations.
pub(super) fn table(page: &mut Page, d: &Diagnosis) {
    let all = values(d);
    if all.is_empty() {
        return;
    }
    page.html("<h3>Yours and found</h3>");
    let (near, moved): (Vec<_>, Vec<_>) = all.iter().partition(|v| v.amount.hardly_moved());
    let rows = |of: Vec<&ReportedValue<'_>>| of.into_iter().map(row).collect::<Vec<_>>();
    let near = rows(near);
    if !moved.is_empty() {
        page.table(&HEAD, &rows(moved));
    }
    if !near.is_empty() {
        page.html(&format!(
            "<details><summary>{} more that hardly moved: by less than half a standard deviation of yours, or by 1 % where it has none</summary>",
            near.len()
        ));
        page.table(&HEAD, &near);
        page.html("</details>");
    }
    if all.iter().any(|v| v.amount.nominal.is_some() && v.amount.nominal_deviation.is_none()) {
        page.text(
            "Without standard deviations: the case gives none under [uncertain], so the value was assumed known and refitted with a \
             narrow prior.",
        );
    }
    sides(page, &all);
    if let Some(c) = &d.correlation {
        correlations(page, c);
    }
}

fn row(v: &ReportedValue<'_>) -> Vec<String> {
    let a = v.amount;
    let nominal = a.nominal.map_or_else(|| "not in your model".to_owned(), |n| with_unit(number(n), &a.unit));
    let change = a.nominal.filter(|n| *n != 0.0).map(|n| signed(100.0 * (a.value - n) / n.abs()));
    let deviations = a.nominal.zip(a.nominal_deviation.filter(|s| *s > 0.0));
    let deviations = deviations.map(|(n, s)| signed((a.value - n) / s));
    let none = || "–".to_owned();
    vec![
        v.name.clone(),
        nominal,
        amount(a),
        change.unwrap_or_else(none),
        deviations.unwrap_or_else(none),
        interval(a),
    ]
}

/// With three digits and its sign.
fn signed(x: f64) -> String {
    // Of the rounded number: 9.9999 is 10.0.
    let digits = match (100.0 * x).round().abs() {
        hundredths if hundredths >= 10_000.0 => 0,
        hundredths if hundredths >= 1000.0 => 1,
        _ => 2,
    };
    format!("{x:+.digits$}")
}

/// The same values seen from the motor and from the load.
fn sides(page: &mut Page, all: &[ReportedValue<'_>]) {
    let row = |v: &ReportedValue<'_>| {
        let sides = v.amount.sides?;
        let of = |x: f64| with_unit(number(x), &v.amount.unit);
        let degrees = |x: f64| {
            if v.amount.unit == "rad" { format!("{} deg", number(x.to_degrees())) } else { String::new() }
        };
        let both = |x: f64| match degrees(x).as_str() {
            "" => of(x),
            text => format!("{} ({text})", of(x)),
        };
        Some(vec![v.name.clone(), both(sides.motor), both(sides.load)])
    };
    let rows: Vec<Vec<String>> = all.iter().filter_map(row).collect();
    if !rows.is_empty() {
        page.html("<details open><summary>On both sides of the gear</summary>");
        page.table(&["parameter", "seen from the motor", "seen from the load"], &rows);
        page.html("</details>");
    }
}

/// The largest in a sentence, all of them as a table.
fn correlations(page: &mut Page, c: &EstimateCorrelation) {
    let pairs = (0..c.names.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let Some((i, j)) = pairs.max_by(|a, b| c.matrix[a.0][a.1].abs().total_cmp(&c.matrix[b.0][b.1].abs()))
    else {
        return;
    };
    let largest = c.matrix[i][j];
    page.text(&format!(
        "The errors of the estimates are correlated most between {} and {}: {largest:+.3}. The nearer to 1 or -1, the less these \
         recordings determine each of the two alone.",
        c.names[j], c.names[i]
    ));
    page.html("<details><summary>Correlations of the estimates</summary>");
    let mut head = vec![""];
    head.extend(c.names.iter().map(String::as_str));
    let row = |(name, values): (&String, &Vec<f64>)| {
        std::iter::once(name.clone()).chain(values.iter().map(|r| format!("{r:+.2}"))).collect()
    };
    let rows: Vec<Vec<String>> = c.names.iter().zip(&c.matrix).map(row).collect();
    page.table(&head, &rows);
    page.html("</details>");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_in_percent_and_in_deviations_of_the_users_value() {
        let of = |nominal, nominal_deviation| {
            let unit = "N.m".into();
            let amount = ClaimedAmount { value: 3.3, unit, nominal, nominal_deviation, ..Default::default() };
            row(&ReportedValue { name: "k".into(), amount: &amount })[1..5].to_vec()
        };
        let plain = |v: Vec<String>| v.iter().map(|s| s.replace('\u{a0}', " ")).collect::<Vec<_>>();
        assert_eq!(plain(of(Some(3.0), Some(0.1))), ["3 N.m", "3.3 N.m", "+10.0", "+3.00"]);
        assert_eq!(plain(of(Some(3.0), None)), ["3 N.m", "3.3 N.m", "+10.0", "–"]);
        assert_eq!(plain(of(Some(0.0), Some(2.0))), ["0 N.m", "3.3 N.m", "–", "+1.65"]);
        assert_eq!(plain(of(None, None)), ["not in your model", "3.3 N.m", "–", "–"]);
    }
}
