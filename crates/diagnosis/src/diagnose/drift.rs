//! Nominal runs that drift away: how much of such a gap is closed is no figure.

use crate::outcome::{Diagnosis, HeldOutGap, NoticedMistake, OutcomeSeverity};

/// A gap beyond this is larger than the motion itself.
const AWAY: f64 = 1.0;

/// Removes the closed share where the nominal run drifts away, and reports it.
pub(super) fn clear_shares(d: &mut Diagnosis) {
    let clear = |g: &mut HeldOutGap| {
        let away = g.before > AWAY;
        if away {
            (g.closed, g.ci95) = (None, None);
        }
        away
    };
    let text = |what: &str, g: &HeldOutGap| {
        format!(
            "the nominal run drifts away: its error{what} is {:.3} times the motion, so how much of it is closed is no \
             figure; compare `after` with `floor`",
            g.before
        )
    };
    let finding = |channel: Option<&String>, text| NoticedMistake {
        severity: OutcomeSeverity::Warning,
        kind: "drifts-away".into(),
        // There the nominal parameters are kept.
        file: "case.toml".into(),
        line: None,
        channel: channel.cloned(),
        text,
    };
    if let Some(g) = d.gap.overall.as_mut()
        && clear(g)
    {
        d.findings.push(finding(None, text("", g)));
        d.effects.iter_mut().for_each(|e| e.closed_alone = None);
    }
    for (name, g) in &mut d.gap.channels {
        if clear(g) {
            d.findings.push(finding(Some(name), text(&format!(" in {name}"), g)));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::{GapReport, UnknownShare, Verdict};

    #[test]
    fn what_drifts_away_is_not_closed_by_a_share_and_is_reported() {
        let gap = |before| HeldOutGap {
            before,
            tuned: 0.5,
            after: 0.02,
            floor: 0.01,
            closed: Some(0.99),
            ci95: Some([0.98, 1.0]),
            ..Default::default()
        };
        let mut d = Diagnosis {
            schema: String::new(),
            model: "TwoMassJoint".into(),
            verdict: Verdict::Unknown,
            gap: GapReport {
                overall: Some(gap(3.8)),
                channels: [("a".to_owned(), gap(5.3)), ("b".to_owned(), gap(0.9))].into(),
                left_out: Vec::new(),
                derived: Default::default(),
            },
            sensors: Default::default(),
            location: Default::default(),
            effects: Vec::new(),
            candidates: Vec::new(),
            parameters: Default::default(),
            correlation: None,
            budget: Vec::new(),
            pack: None,
            indistinguishable: Vec::new(),
            watch: None,
            unknown: UnknownShare::default(),
            next_experiment: None,
            augmented: None,
            capped: false,
            not_compared: None,
            findings: Vec::new(),
            inputs: None,
            notes: Vec::new(),
        };
        clear_shares(&mut d);
        let closed = |g: &HeldOutGap| (g.closed, g.ci95);
        assert_eq!(d.gap.overall.as_ref().map(closed), Some((None, None)));
        assert_eq!(closed(&d.gap.channels["a"]), (None, None));
        assert_eq!(closed(&d.gap.channels["b"]), (Some(0.99), Some([0.98, 1.0])));
        let named: Vec<_> = d.findings.iter().map(|f| f.channel.as_deref()).collect();
        assert_eq!(named, [None, Some("a")]);
        assert!(d.findings[0].text.contains("3.800 times the motion"), "{}", d.findings[0].text);
    }
}
