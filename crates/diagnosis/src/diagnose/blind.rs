//! Recordings of which balances of accelerations give no information.

use crate::engine::search::CaseSearch;
use crate::outcome::Verdict;

/// Reports for which recordings for fitting balances give no information, where no cause is found.
pub(super) fn note(search: &CaseSearch<'_>, verdict: Verdict) -> Option<String> {
    let all = &search.prescribed[..search.case.train.len()];
    let blind: Vec<&str> = all.iter().filter(|l| l.is_bridged()).map(|l| l.name.as_str()).collect();
    (verdict == Verdict::Unknown && !blind.is_empty()).then(|| text(&blind, all.len()))
}

fn text(blind: &[&str], all: usize) -> String {
    let which = if blind.len() == all { "all recordings for fitting".to_owned() } else { blind.join(", ") };
    format!(
        "for {which} accelerations give no information, only free runs do: more than three quarters of the time a joint with dry friction \
         is within a reversal, as far as rate and counts of its encoders can show; slower motions that go further, or finer \
         encoders, would give more"
    )
}

#[cfg(test)]
mod tests {
    use super::text;

    #[test]
    fn recordings_without_information_are_named() {
        assert!(
            text(&["a.csv", "c.csv"], 3).starts_with("for a.csv, c.csv accelerations give no information")
        );
        assert!(text(&["a.csv"], 1).starts_with("for all recordings for fitting accelerations"));
    }
}
