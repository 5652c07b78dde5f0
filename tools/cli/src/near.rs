//! The name that was meant.

/// `did you mean X?` of the nearest of these names, or `otherwise`.
pub(crate) fn suggestion<'a>(
    name: &str,
    known: impl IntoIterator<Item = &'a str>,
    otherwise: &str,
) -> String {
    let plain = |text: &str| text.to_lowercase();
    let near = known
        .into_iter()
        .map(|k| (strsim::jaro_winkler(&plain(k), &plain(name)), k))
        .filter(|(likeness, _)| *likeness > 0.85)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    near.map_or_else(|| otherwise.to_owned(), |(_, k)| format!("did you mean `{k}`?"))
}

#[cfg(test)]
mod tests {
    use super::suggestion;

    #[test]
    fn the_nearest_or_something_else() {
        let of = |name| suggestion(name, ["backlash", "base-drag"], "see the list");
        assert_eq!(of("backlsh"), "did you mean `backlash`?");
        assert_eq!(of("Base-Drag"), "did you mean `base-drag`?");
        assert_eq!(of("xyz"), "see the list");
    }
}
