//! A diagnosis in words.

use trueup_diagnosis::outcome::{Claimed, Diagnosis, Verdict};

use crate::number::number;

/// Effects by id, as one would say them.
const EFFECTS: &[(&str, &str)] = &[
    ("current-saturation", "the amplifier saturates"),
    ("actuator-lag", "the actuator lags behind its command"),
    ("torque-ripple", "motor torque ripples with position"),
    ("stribeck-friction", "break-away (Stribeck) friction"),
    ("asymmetric-friction", "friction that differs between directions"),
    ("load-dependent-friction", "friction that grows with the load"),
    ("nonlinear-viscous-friction", "friction not proportional to speed"),
    ("friction-drift", "friction that changes over the run"),
    ("presliding-friction", "spring-like friction before sliding"),
    ("motor-friction", "motor friction"),
    ("backlash", "backlash"),
    ("nonlinear-stiffness", "a spring that hardens or softens"),
    ("transmission-hysteresis", "hysteresis of the transmission"),
    ("nonlinear-damping", "damping not proportional to rate"),
    ("kinematic-error", "kinematic error of the gear"),
    ("joint-flexibility", "flexibility of a joint held to be rigid"),
    ("load-friction", "friction on the load side"),
    ("gravity-torque", "an unbalanced load or tilted axis"),
    ("flexible-link", "a flexible link"),
    ("cable-stiffness", "a cable that pulls back"),
    ("external-force", "an unrecorded push from outside"),
    ("base-drag", "drag of the base"),
    ("table-tilt", "a tilted table"),
    ("base-thrust", "a steady force on the base"),
    ("appendage-mode", "a flexible appendage"),
    ("sensor-delay", "a late sensor"),
    ("sensor-eccentricity", "an eccentric encoder"),
    ("sensor-drift", "a drifting sensor"),
];

/// An effect's id in words; an id that is not known as it is.
pub fn effect_name(id: &str) -> &str {
    EFFECTS.iter().find(|(known, _)| *known == id).map_or(id, |(_, name)| name)
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

/// `transmission, joint 2`
pub(super) fn place(component: &str, joint: Option<usize>) -> String {
    match joint {
        Some(joint) => format!("{component}, joint {joint}"),
        None => component.to_owned(),
    }
}

fn named(c: &Claimed, arm: bool) -> String {
    let at = place(&c.component, c.joint.filter(|_| arm));
    format!("{} ({at}, probability {})", effect_name(&c.id), percent(c.probability))
}

fn list(items: &[String], last: &str) -> String {
    match items {
        [] => String::new(),
        [one] => one.clone(),
        [first @ .., end] => format!("{} {last} {end}", first.join(", ")),
    }
}

/// The verdict in one sentence.
pub fn sentence(d: &Diagnosis) -> String {
    let arm = d.model != "TwoMassJoint";
    let effects: Vec<String> = d.effects.iter().map(|c| named(c, arm)).collect();
    let overall = d.gap.overall.as_ref();
    let figures = |after: f64, with: &str| {
        overall.map_or_else(String::new, |g| {
            format!(
                " {with} the gap on recordings never used for fitting falls from {} to {}; the sensors' noise alone leaves {}.",
                percent(g.before),
                percent(after),
                percent(g.floor)
            )
        })
    };
    let after = overall.map_or(f64::NAN, |g| g.after);
    if d.capped {
        return "The recordings are not what they seem (see below): nothing is concluded from them until that is mended."
            .to_owned();
    }
    match d.verdict {
        Verdict::NoGap => {
            let size = overall.map_or_else(String::new, |g| {
                format!(" (gap {}, noise alone leaves {})", percent(g.before), percent(g.floor))
            });
            format!(
                "The simulation agrees with the recordings: nothing is left beyond the sensors' noise{size}."
            )
        }
        Verdict::Parameters => {
            let text = "The model has all that is needed, but parameters are off.";
            format!("{text}{}", figures(overall.map_or(f64::NAN, |g| g.tuned), "With them refitted"))
        }
        Verdict::Effects => {
            let what = list(&effects, "and");
            format!("What the simulation lacks is {what}.{}", figures(after, "With it"))
        }
        Verdict::Ambiguous => {
            let what = list(&effects, "or");
            format!(
                "One of these is missing, and these recordings cannot say which: {what}.{}",
                figures(after, "With any of them")
            )
        }
        Verdict::Unknown => {
            let at = d.location.components.first();
            let at = at.map_or_else(String::new, |c| {
                format!(" It acts at: {} ({} of the excess).", place(&c.id, c.joint), percent(c.share))
            });
            format!(
                "Something is missing that no known effect explains (probability {}).{at}",
                percent(d.unknown.probability)
            )
        }
    }
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
