//! A diagnosis in words.

use trueup_diagnosis::outcome::{
    AT_BOUND, Claimed, ClaimedAmount, Diagnosis, HeldOutGap, NO_HOLDOUT, NextExperiment, Verdict,
};
use trueup_diagnosis::words::noun;

use crate::number::number;

/// Shares below this are not worth a line.
pub(super) const LEAST_SHARE: f64 = 0.05;

/// An effect's id as a noun phrase; an id that is not known as it is.
pub fn effect_name(id: &str) -> &str {
    noun(id)
}

/// A share as a percentage, which no line end tears apart.
pub(super) fn percent(x: f64) -> String {
    let p = 100.0 * x;
    match p.abs() {
        a if a >= 99.95 || a == 0.0 => format!("{p:.0}\u{a0}%"),
        a if a >= 10.0 => format!("{p:.1}\u{a0}%"),
        a if a >= 0.1 => format!("{p:.2}\u{a0}%"),
        a if a >= 0.001 => format!("{p:.3}\u{a0}%"),
        a if a.is_finite() => "<\u{a0}0.001\u{a0}%".to_owned(),
        _ => format!("{}\u{a0}%", number(p)),
    }
}

/// A gap: a percentage of the signal, or how many times the signal.
pub(super) fn size(gap: f64) -> String {
    match gap {
        g if !g.is_finite() => "no figure (the run diverges)".to_owned(),
        g if g >= 1.0 => format!("{}\u{a0}times the signal", times(g)),
        g => percent(g),
    }
}

/// A ratio with two or three digits.
pub(super) fn times(x: f64) -> String {
    match x.abs() {
        a if a >= 100.0 => {
            number((x / 10f64.powf(a.log10().floor() - 1.0)).round() * 10f64.powf(a.log10().floor() - 1.0))
        }
        a if a >= 10.0 => format!("{x:.0}"),
        _ => format!("{x:.1}"),
    }
}

/// How much of a gap is closed.
pub(super) fn closed(g: &HeldOutGap) -> String {
    let Some(closed) = g.closed else {
        return match g.before > 1.0 {
            true => "no figure: the nominal run drifts away".to_owned(),
            false => "–".to_owned(),
        };
    };
    let part = |x: f64| percent(x.clamp(0.0, 1.0));
    match g.ci95 {
        _ if closed < 0.0 => "nothing: it grew".to_owned(),
        Some([a, b]) if part(a) != part(b) => format!("{} ({} to {})", part(closed), part(a), part(b)),
        _ => part(closed),
    }
}

/// A value with its unit.
pub(super) fn amount(a: &ClaimedAmount) -> String {
    with_unit(number(a.value), &a.unit)
}

pub(super) fn with_unit(value: String, unit: &str) -> String {
    match unit {
        "" | "1" => value,
        unit => format!("{value}\u{a0}{unit}"),
    }
}

/// Its interval with the unit; open ends as words, and why there is none.
pub(super) fn interval(a: &ClaimedAmount) -> String {
    let end = |x: f64| with_unit(number(x), &a.unit);
    match (&a.reason, a.ci95) {
        (Some(reason), _) => reason.clone(),
        (None, [Some(low), Some(high)]) if number(low) == number(high) => {
            with_unit(format!("within rounding of {}", number(low)), &a.unit)
        }
        (None, [Some(low), Some(high)]) => format!("{} to {}", number(low), end(high)),
        (None, [Some(low), None]) => format!("at least {}", end(low)),
        (None, [None, Some(high)]) => format!("at most {}", end(high)),
        (None, [None, None]) => "not bounded by these recordings".to_owned(),
    }
}

/// Whether a value is at a bound of the search.
pub(super) fn at_bound(a: &ClaimedAmount) -> bool {
    a.reason.as_deref() == Some(AT_BOUND)
}

/// `transmission, joint 2`
pub(super) fn place(component: &str, joint: Option<usize>) -> String {
    match joint {
        Some(joint) => format!("{component}, joint {joint}"),
        None => component.to_owned(),
    }
}

/// Where, with the joint where there are several.
pub(super) fn at(d: &Diagnosis, component: &str, joint: Option<usize>) -> String {
    place(component, joint.filter(|_| d.model != "TwoMassJoint"))
}

/// `a, b and c`
pub(super) fn list(items: &[String], last: &str) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., end] => format!("{} {last} {end}", first.join(", ")),
    }
}

/// What the figures are of.
pub(super) fn judged_on(d: &Diagnosis) -> &'static str {
    match d.notes.iter().any(|n| n == NO_HOLDOUT) {
        true => "the recordings that were fitted (none was held out)",
        false => "recordings never used for fitting",
    }
}

/// The claims, as sets of causes that cannot be distinguished; a cause that is identified is a set of one.
pub(super) fn sets(d: &Diagnosis) -> Vec<Vec<&Claimed>> {
    if d.verdict != Verdict::Ambiguous {
        return d.effects.iter().map(|e| vec![e]).collect();
    }
    let mut all: Vec<(Option<usize>, Vec<&Claimed>)> = Vec::new();
    for e in &d.effects {
        let set = d.indistinguishable.iter().position(|set| set.contains(&e.id));
        match all.iter_mut().find(|(s, _)| set.is_some() && *s == set) {
            Some((_, members)) => members.push(e),
            None => all.push((set, vec![e])),
        }
    }
    // Where no set is given, all claims are one set.
    if d.indistinguishable.is_empty() && !d.effects.is_empty() {
        return vec![d.effects.iter().collect()];
    }
    all.into_iter().map(|(_, members)| members).collect()
}

/// That one of them is there.
pub(super) fn together(set: &[&Claimed]) -> f64 {
    set.iter().map(|e| e.probability).sum::<f64>().min(1.0)
}

/// What an experiment distinguishes and how likely, as sentences after others; empty where nothing is known of it.
pub(super) fn told_by(n: &NextExperiment) -> String {
    let names: Vec<String> = n.separates.iter().map(|id| effect_name(id).to_owned()).collect();
    let apart =
        if names.is_empty() { String::new() } else { format!(" It distinguishes {}.", list(&names, "and")) };
    let chance = n
        .probability
        .map_or_else(String::new, |p| format!(" Predicted to decide with probability {}.", percent(p)));
    apart + &chance
}

/// The verdict in one word.
pub(super) fn badge(v: Verdict) -> &'static str {
    match v {
        Verdict::NoGap => "no gap",
        Verdict::Parameters => "parameters",
        Verdict::Effects => "effects",
        Verdict::Ambiguous => "ambiguous",
        Verdict::Unknown => "unknown",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beyond_the_signal_a_gap_is_so_many_times_the_signal() {
        let plain = |x| size(x).replace('\u{a0}', " ");
        assert_eq!(plain(0.9996), "100 %");
        assert_eq!(plain(0.0123), "1.23 %");
        assert_eq!(plain(1.04), "1.0 times the signal");
        assert_eq!(plain(77.3), "77 times the signal");
        assert_eq!(plain(7730.0), "7700 times the signal");
        assert_eq!(plain(f64::NAN), plain(f64::INFINITY));
    }

    #[test]
    fn an_interval_has_a_unit_or_a_reason() {
        let told = |value, ci| {
            interval(&ClaimedAmount::within([0.0, 10.0], value, "N.m".into(), ci)).replace('\u{a0}', " ")
        };
        assert_eq!(told(3.0, [2.0, 4.0]), "2 to 4 N.m");
        assert_eq!(told(3.0, [0.0, 4.0]), "at most 4 N.m");
        assert_eq!(told(10.0, [9.0, 11.0]), "at the bound of the search");
        assert_eq!(told(3.0, [3.0, 3.0]), "not determined by these recordings");
        assert_eq!(told(3.0, [2.99999, 3.00001]), "within rounding of 3 N.m");
    }

    #[test]
    fn what_is_closed_is_never_more_than_all_or_less_than_nothing() {
        let told = |before, closed: Option<f64>, ci95| {
            let g = HeldOutGap {
                before,
                tuned: 0.1,
                after: 0.1,
                floor: 0.01,
                closed,
                ci95,
                ..Default::default()
            };
            super::closed(&g).replace('\u{a0}', " ")
        };
        assert_eq!(told(0.5, Some(0.9), Some([0.8, 1.1])), "90.0 % (80.0 % to 100 %)");
        assert_eq!(told(0.5, Some(1.02), Some([1.01, 1.05])), "100 %");
        assert_eq!(told(0.5, Some(-0.3), None), "nothing: it grew");
        assert_eq!(told(3.8, None, None), "no figure: the nominal run drifts away");
        assert_eq!(told(0.5, None, None), "–");
    }
}
