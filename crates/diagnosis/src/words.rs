//! Effects in words, as the library of effects has them.

use trueup_models::effect::ALL;

/// An effect's id as a noun phrase, `backlash in the transmission`; an id that is not known as it is.
pub fn noun(id: &str) -> &str {
    ALL.iter().map(|e| e.spec()).find(|s| s.id == id).map_or(id, |s| s.noun)
}

/// How an effect is looked for on the rig; nothing of an id that is not known.
pub fn check(id: &str) -> Option<&'static str> {
    ALL.iter().map(|e| e.spec()).find(|s| s.id == id).map(|s| s.check)
}

/// How many effects there are to be tried.
pub fn known() -> usize {
    ALL.iter().filter(|e| !e.spec().installed).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "The model lacks ... ." is a sentence with each of them: a phrase that begins with no verb's subject, and no full stop.
    #[test]
    fn every_effect_is_a_noun_phrase_and_has_a_check() {
        for spec in ALL.iter().map(|e| e.spec()) {
            let noun = noun(spec.id);
            assert!(noun.len() > 5 && noun != spec.id || noun.starts_with(spec.id), "{}: {noun}", spec.id);
            assert!(!noun.ends_with('.'), "{noun}");
            for verb in [" saturates", " lags ", " ripples", " is ", " are "] {
                assert!(!noun.contains(verb) || noun.contains(" that "), "{}: `{noun}` is a clause", spec.id);
            }
            let check = check(spec.id).unwrap_or_default();
            assert!(check.ends_with(['.', '?']) && check.len() > 30, "{}: {check}", spec.id);
        }
        assert_eq!((noun("of-tomorrow"), check("of-tomorrow")), ("of-tomorrow", None));
    }
}
