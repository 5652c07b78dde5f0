//! What is wrong in what a user wrote: all of it at once, each with its place.

use std::fmt;

use crate::place::SourceSpan;

/// One mistake.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InputMistake {
    /// Where.
    pub place: SourceSpan,
    /// The error and the remedy.
    pub message: String,
}

impl fmt::Display for InputMistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place.file.as_os_str().is_empty() {
            true => f.write_str(&self.message),
            false => write!(f, "{}: {}", self.place, self.message),
        }
    }
}

/// `; did you mean X?`, or what there is if that is little, or nothing.
pub fn suggestion<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let plain = |text: &str| text.to_lowercase();
    // Names of very different length are never near; this keeps a look through a large FMU cheap.
    let near = known
        .iter()
        .filter(|k| k.len().abs_diff(name.len()) <= 3 + name.len() / 3)
        .map(|k| (strsim::jaro_winkler(&plain(k), &plain(name)), *k))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    match near {
        Some((_, k)) => format!("; did you mean `{k}`?"),
        None if (1..=12).contains(&known.len()) => format!("; there is {}", quoted(&known)),
        None => String::new(),
    }
}

/// `a`, `b`.
pub(crate) fn quoted<T: AsRef<str>>(names: &[T]) -> String {
    names.iter().map(|n| format!("`{}`", n.as_ref())).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_offered() {
        let known = ["motorAngle", "motorVelocity", "loadAngle"];
        assert_eq!(suggestion("motorangel", known), "; did you mean `motorAngle`?");
        assert_eq!(suggestion("xyz", known), "; there is `motorAngle`, `motorVelocity`, `loadAngle`");
        assert_eq!(suggestion("xyz", []), "");
    }
}
