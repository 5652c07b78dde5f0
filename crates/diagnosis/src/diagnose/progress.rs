//! What the search reports, as text for the user.

/// `line` is a line of the search, with labels and figures: `1: ["backlash[1]"]: excess 0.013`.
pub(super) fn words(line: &str) -> String {
    let depth: Option<usize> = line.split(':').next().and_then(|d| d.parse().ok());
    match depth {
        None if line.starts_with("exchanged") => "trying other causes instead of each".to_owned(),
        None => "looking at every cause alone".to_owned(),
        Some(1) => "looking at causes in pairs".to_owned(),
        Some(n) => format!("looking at sets of {} causes", n.saturating_add(1)),
    }
}

#[cfg(test)]
mod tests {
    use super::words;

    #[test]
    fn no_label_and_no_figure() {
        let line = [
            "nothing added: excess 166039489.123",
            "1: [\"backlash[1]\"]: excess 0.013",
            "2: x",
            "exchanged: y",
        ];
        let lines = line.map(words);
        let expected = [
            "looking at every cause alone",
            "looking at causes in pairs",
            "looking at sets of 3 causes",
            "trying other causes instead of each",
        ];
        assert_eq!(lines, expected);
    }
}
