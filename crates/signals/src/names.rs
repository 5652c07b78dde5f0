//! Names of variables and their elements, and of files of recordings.

use std::io::ErrorKind;

/// `linkMass` of `linkMass[1]`; a name without an index as it is.
pub fn base_name(name: &str) -> &str {
    match name.strip_suffix(']').and_then(|n| n.split_once('[')) {
        Some((base, index))
            if !index.is_empty() && index.bytes().all(|b| b.is_ascii_digit() || b == b',') =>
        {
            base
        }
        _ => name,
    }
}

/// `linkCenterOfMass[2,1]` of a base name and indices from 1.
pub fn element_name(base: &str, indices: &[usize]) -> String {
    let indices: Vec<_> = indices.iter().map(ToString::to_string).collect();
    format!("{base}[{}]", indices.join(","))
}

/// The nearest of these names, if one is near.
pub(crate) fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase();
    known
        .into_iter()
        .filter(|k| k.len().abs_diff(name.len()) <= 3 + name.len() / 3)
        .map(|k| (strsim::jaro_winkler(&plain(k), &plain(name)), k))
        .filter(|(likeness, _)| *likeness > 0.85)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, k)| k)
}

/// `did you mean X?` of the nearest of these names, or `otherwise`.
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>, otherwise: &str) -> String {
    nearest(name, known).map_or_else(|| otherwise.to_owned(), |near| format!("did you mean `{near}`?"))
}

/// Why a file of text cannot be read.
pub fn unreadable(e: &std::io::Error) -> String {
    match e.kind() {
        ErrorKind::NotFound | ErrorKind::NotADirectory => "there is no such file".into(),
        ErrorKind::IsADirectory => "it is a folder, not a file".into(),
        ErrorKind::InvalidData => "it is no text in UTF-8".into(),
        _ => format!("it cannot be read: {e}"),
    }
}

/// `did you mean X?`, or what there is if that is little, or this.
pub(crate) fn suggestion<'a>(
    name: &str,
    known: impl IntoIterator<Item = &'a str>,
    otherwise: &str,
) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if (1..=12).contains(&known.len()) => {
            let names: Vec<_> = known.iter().map(|k| format!("`{k}`")).collect();
            format!("there is {}", names.join(", "))
        }
        None => otherwise.into(),
    }
}

/// A number as a message shows it: six digits.
pub(crate) fn short(x: f64) -> String {
    let x: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    let plain = x == 0.0 || (1e-4..1e7).contains(&x.abs());
    if plain { format!("{x}") } else { format!("{x:e}") }
}

/// Ends of names of recordings.
pub const RECORDING_ENDS: [&str; 9] =
    [".csv", ".txt", ".tsv", ".parquet", ".mat", ".h5", ".hdf5", ".mcap", ".zst"];

/// Whether a recording may have this name: it has one of the [`RECORDING_ENDS`], in upper or lower case.
pub fn names_recording(name: &str) -> bool {
    let lower = name.to_lowercase();
    RECORDING_ENDS.iter().any(|end| lower.ends_with(end))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_and_their_bases() {
        assert_eq!(
            [base_name("a[1,2]"), base_name("a"), base_name("a[x]"), base_name("a[]")],
            ["a", "a", "a[x]", "a[]"]
        );
        assert_eq!(element_name("a", &[2, 1]), "a[2,1]");
    }
}
