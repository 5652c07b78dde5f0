//! Which figures the verdict of a page has, and which parameters are folded away.

use trueup_diagnosis::outcome::*;
use trueup_report::{Evidence, diagnosis_page, sentence};

use crate::diagnosis::{VERDICTS, diagnosis, gap};

/// Whatever the figures are, the first sentence has "falls" of two figures only where the second one is less, and reports windows
/// where whole runs with what was found diverge.
#[test]
fn a_gap_falls_only_where_it_is_less_and_windows_stand_for_runs_that_diverge() {
    let sizes = [0.0, 0.004, 0.0131, 0.2, 0.9, 1.0, 9.4, 20.0, f64::INFINITY, f64::NAN];
    for verdict in [Verdict::Effects, Verdict::Ambiguous, Verdict::Parameters] {
        for (before, after) in sizes.iter().flat_map(|a| sizes.iter().map(move |b| (*a, *b))) {
            let mut d = diagnosis(verdict);
            let window =
                WindowGap { seconds: 2.5, before: 0.3, tuned: 0.1, after: 0.1, floor: 0.05, closed: None };
            let whole = match verdict {
                Verdict::Parameters => HeldOutGap { before, tuned: after, ..gap() },
                _ => HeldOutGap { before, after, ..gap() },
            };
            d.gap.overall = Some(whole.clone());
            let text = sentence(&d);
            let less = after.is_finite() && !(before <= after);
            assert_eq!(text.contains("falls from"), less, "{before} {after}: {text}");
            assert_eq!(
                text.contains("grows from") || text.contains("stays at"),
                !less,
                "{before} {after}: {text}"
            );

            d.gap.overall = Some(HeldOutGap { window: Some(window), ..whole });
            let text = sentence(&d).replace('\u{a0}', " ");
            let windows = text.contains("the gap on windows of 2.5 s of recordings never used for fitting falls from 30.0 % to 10.0 %");
            let diverges = !after.is_finite() || after >= 1.0 || after > before;
            assert_eq!(windows, diverges, "{before} {after}: {text}");
        }
    }
}

#[test]
fn parameters_that_hardly_moved_are_folded_away() {
    let mut d = diagnosis(Verdict::Parameters);
    let reason = Some("the comparison gives no interval".to_owned());
    let of = |value| ClaimedAmount {
        value,
        unit: "kg".into(),
        nominal: Some(2.0),
        nominal_deviation: Some(0.2),
        reason: reason.clone(),
        ..Default::default()
    };
    d.parameters = [("mass[1]".to_owned(), of(2.05)), ("mass[2]".to_owned(), of(2.15))].into();
    let html = diagnosis_page(&d, &Evidence::default());
    let folded = html.find("1 more that hardly moved").unwrap();
    let first = |name: &str| html.find(&format!(">{name}</td>")).unwrap();
    assert!(first("mass[2]") < folded && folded < first("mass[1]"));
    let now = &html[html.find("<h2>What to do now").unwrap()..];
    let use_it = &now[..now.find("</dd>").unwrap()];
    assert!(use_it.contains("mass[2]") && !use_it.contains("mass[1]"), "{use_it}");
}

/// Every sentence with figures over windows has "windows" next to them, whatever the verdict.
#[test]
fn figures_over_windows_are_named_as_such() {
    let window =
        WindowGap { seconds: 2.5, before: 0.31, tuned: 0.17, after: 0.11, floor: 0.05, closed: None };
    let diverges = HeldOutGap { before: 9.4, tuned: 20.0, after: 30.0, window: Some(window), ..gap() };
    for (verdict, _) in VERDICTS {
        for why in [None, Some("the model cannot be simulated".to_owned())] {
            let mut d = diagnosis(verdict);
            d.gap.overall = Some(diverges.clone());
            d.not_compared = why;
            let html = diagnosis_page(&d, &Evidence::default()).replace('\u{a0}', " ");
            let verdict =
                &html[html.find("class=\"verdict\"").unwrap()..html.find("<h2>What to do now").unwrap()];
            let figures = verdict.matches("31.0 %").count() + verdict.matches("17.0 %").count();
            assert!(figures > 0 && verdict.contains("on windows of 2.5 s of recordings"), "{verdict}");
            assert!(!verdict.contains("times the signal"), "{verdict}");
            assert!(html.contains("The verdict has the figures over windows"));
        }
    }
}

#[test]
fn a_value_at_the_bound_of_the_search_is_not_folded_away() {
    let amount = ClaimedAmount {
        value: 2.01,
        unit: "kg".into(),
        nominal: Some(2.0),
        nominal_deviation: Some(0.2),
        reason: Some(AT_BOUND.to_owned()),
        ..Default::default()
    };
    assert!(!amount.hardly_moved());
    assert!(ClaimedAmount { reason: Some(NOT_DETERMINED.to_owned()), ..amount.clone() }.hardly_moved());
    assert!(!ClaimedAmount { reason: None, ..amount }.hardly_moved());
}
