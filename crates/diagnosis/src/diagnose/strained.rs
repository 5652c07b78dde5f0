//! Parameters whose estimates are far from their priors: either is wrong, and that is reported.

use crate::engine::problem::{BalanceTarget, BalanceUnknown};
use crate::engine::recordings::PreparedCase;
use crate::engine::search::FittedSet;
use crate::engine::unknown::KNOWN;
use crate::outcome::{NoticedMistake, OutcomeSeverity};
use trueup_identification::unknown::Scale;

/// Prior standard deviations beyond which a parameter is far off.
const FAR: f64 = 10.0;

/// A finding for each of the plant's own parameters that is far from what the case declares.
pub(super) fn findings(fitted: &FittedSet, case: &PreparedCase) -> Vec<NoticedMistake> {
    let stated = &fitted.stated;
    let own = stated.begin.first().copied().unwrap_or(stated.unknowns.len());
    let plain = stated.unknowns[..own].iter().zip(&fitted.theta);
    let parameters = plain.filter(|(u, _)| {
        u.run.is_none() && matches!(u.target, BalanceTarget::Parameter(_)) && u.scale == Scale::Log
    });
    parameters.filter_map(|(u, x)| one(u, *x, case.doubt.get(&u.name).copied())).collect()
}

fn one(u: &BalanceUnknown, x: f64, doubt: Option<f64>) -> Option<NoticedMistake> {
    let moved = x - u.coordinate();
    let times = moved.abs() / doubt.unwrap_or(KNOWN);
    if times <= FAR {
        return None;
    }
    let share = 100.0 * (moved.exp() - 1.0);
    let which = if share > 0.0 { "larger" } else { "smaller" };
    let of = match doubt {
        Some(d) => {
            format!("{times:.0} times the standard deviation of {} % that the case gives it", 100.0 * d)
        }
        None => "which the case holds to be known".to_owned(),
    };
    Some(NoticedMistake {
        severity: OutcomeSeverity::Warning,
        kind: "far-from-belief".into(),
        file: "case.toml".into(),
        line: None,
        channel: None,
        text: format!(
            "{} would have to be {:.0} % {which}, {of}: look at its value, or at what is missing that acts as it does",
            u.name,
            share.abs()
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_of_ten_standard_deviations_is_reported_with_its_share() {
        let u = BalanceUnknown {
            name: "torqueConstant".into(),
            unit: "N.m/A".into(),
            target: BalanceTarget::Parameter(3),
            run: None,
            start: 0.04,
            scale: Scale::Log,
            lower: 1e-3,
            upper: 1.0,
            prior: None,
        };
        let at = |factor: f64, doubt| one(&u, u.coordinate() + f64::ln(factor), doubt).map(|n| n.text);
        let findings = at(0.73, None).unwrap();
        assert!(
            findings.contains("torqueConstant would have to be 27 % smaller") && findings.contains("known"),
            "{findings}"
        );
        let findings = at(1.9, Some(0.05)).unwrap();
        assert!(findings.contains("90 % larger, 13 times the standard deviation of 5 %"), "{findings}");
        assert_eq!((at(0.95, None), at(1.5, Some(0.05))), (None, None));
    }
}
