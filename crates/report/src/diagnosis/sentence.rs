//! The verdict in one sentence.

use trueup_diagnosis::outcome::{Claimed, Diagnosis, Verdict};

use super::summary_gap::SummaryGap;
use super::words::{LEAST_SHARE, at, effect_name, list, percent, place, sets, size, times, together};

/// The verdict in one sentence.
pub fn sentence(d: &Diagnosis) -> String {
    let gap = SummaryGap::of(d);
    let figures = |with: &str| gap.map_or_else(String::new, |g| g.sentence(d, with));
    if d.capped {
        return "The recordings are not what they seem (see below): nothing is concluded from them until that is corrected."
            .to_owned();
    }
    if let Some(why) = &d.not_compared {
        let gap = gap.map_or_else(String::new, |g| {
            format!(
                " The model as it is misses {} on {}; the sensors' noise alone leaves {}.",
                size(g.before),
                g.judged_on(d),
                size(g.floor)
            )
        });
        return format!("Causes were not compared: {why}.{gap}");
    }
    match d.verdict {
        Verdict::NoGap => {
            let figures = gap.map_or_else(String::new, |g| {
                format!(
                    " (gap {} on {}, noise alone leaves about {})",
                    size(g.before),
                    g.judged_on(d),
                    size(g.floor)
                )
            });
            format!(
                "The simulation agrees with the recordings: nothing is left beyond the sensors' noise{figures}."
            )
        }
        Verdict::Parameters => {
            let text = "The model has all that is needed, but parameters are off.";
            format!("{text}{}", figures("With them refitted"))
        }
        Verdict::Effects => {
            let what: Vec<String> = sets(d).iter().map(|set| named(d, set)).collect();
            let with = if what.len() > 1 { "With them" } else { "With it" };
            let with = &format!("{with}, and the model's own parameters refitted,");
            format!("What the simulation lacks is {}.{}", list(&what, "and"), figures(with))
        }
        Verdict::Ambiguous => {
            let what: Vec<String> = sets(d).iter().map(|set| named(d, set)).collect();
            format!(
                "What the simulation lacks is {}.{}",
                list(&what, "and, in addition,"),
                figures("With the likeliest, and the model's own parameters refitted,")
            )
        }
        Verdict::Unknown => {
            let most = d.location.components.first().filter(|c| c.share >= LEAST_SHARE);
            let most = most.map_or_else(String::new, |c| {
                format!(
                    " Most of it shows at: {} ({} of the excess).",
                    place(&c.id, c.joint),
                    percent(c.share)
                )
            });
            let left = gap.filter(|g| g.floor > 0.0 && g.tuned > g.floor).map_or_else(String::new, |g| {
                format!(
                    " With its own parameters refitted the model still misses {} on {}, {} times what noise alone leaves.",
                    size(g.tuned),
                    g.judged_on(d),
                    times(g.tuned / g.floor)
                )
            });
            format!(
                "Something is missing that no known effect explains (probability {}).{left}{most}",
                percent(d.unknown.probability)
            )
        }
    }
}

fn named(d: &Diagnosis, set: &[&Claimed]) -> String {
    let of = |c: &&Claimed| format!("{} ({})", effect_name(&c.id), at(d, &c.component, c.joint));
    match set {
        [one] => {
            let place = at(d, &one.component, one.joint);
            format!("{} ({place}, probability {})", effect_name(&one.id), percent(one.probability))
        }
        set => {
            let members = list(&set.iter().map(of).collect::<Vec<_>>(), "or");
            let all = if set.len() > 2 { "one of" } else { "either" };
            let sure = percent(together(set));
            format!(
                "{all} {members}, which these recordings cannot distinguish (together probability {sure})"
            )
        }
    }
}
