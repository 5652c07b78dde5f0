//! What is printed on standard error: `error: ...`, `warning: ...`, `note: ...`, in one voice, coloured where a person reads it.

#[cfg(unix)]
use std::fs::File;
use std::io::{IsTerminal, Write};
#[cfg(unix)]
use std::sync::OnceLock;

/// Standard error as it was when the program began: an FMU may close or redirect it.
#[cfg(unix)]
static KEPT: OnceLock<Option<File>> = OnceLock::new();

/// Keeps standard error, before any FMU is loaded.
#[cfg(unix)]
pub(crate) fn keep() {
    use std::os::fd::AsFd;
    KEPT.get_or_init(|| std::io::stderr().as_fd().try_clone_to_owned().ok().map(File::from));
}

#[cfg(not(unix))]
pub(crate) fn keep() {}

/// Words that begin a line, with the codes of their colours (SGR).
const WORDS: [(&str, &str); 3] = [("error", "1;31"), ("warning", "1;33"), ("note", "1;36")];

pub(crate) fn error(message: &str) {
    line(&format!("error: {message}"));
}

pub(crate) fn note(message: &str) {
    line(&format!("note: {message}"));
}

/// A line that may begin with one of the words. Its reader may be gone (`2>&1 | head`), or the disk full: that changes nothing of the run.
pub(crate) fn line(text: &str) {
    let text = painted(text, coloured());
    #[cfg(unix)]
    if let Some(Some(mut kept)) = KEPT.get().map(Option::as_ref) {
        let _ = writeln!(kept, "{text}");
        return;
    }
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Only a terminal, and only where colour was not refused (<https://no-color.org>).
fn coloured() -> bool {
    let said = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty());
    std::io::stderr().is_terminal() && said("NO_COLOR").is_none() && said("TERM").is_none_or(|t| t != "dumb")
}

fn painted(text: &str, colour: bool) -> String {
    let begun = WORDS.iter().filter(|_| colour).find_map(|(word, code)| {
        let rest = text.strip_prefix(word).filter(|rest| rest.starts_with(':'))?;
        Some(format!("\u{1b}[{code}m{word}\u{1b}[0m{rest}"))
    });
    begun.unwrap_or_else(|| text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::painted;

    #[test]
    fn a_word_has_its_colour_and_nothing_else_has() {
        assert_eq!(painted("error: no", true), "\u{1b}[1;31merror\u{1b}[0m: no");
        assert_eq!(painted("note: a note: b", true), "\u{1b}[1;36mnote\u{1b}[0m: a note: b");
        for (text, colour) in [("error: no", false), ("errors: no", true), ("a warning: b", true)] {
            assert_eq!(painted(text, colour), text);
        }
    }
}
