//! Commands as a shell takes them.

/// A command line, quoted where a shell requires it.
pub fn command_line<S: AsRef<str>>(arguments: impl IntoIterator<Item = S>) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=+,./:@%".contains(c);
    let quoted = |a: S| match !a.as_ref().is_empty() && a.as_ref().chars().all(plain) {
        true => a.as_ref().to_owned(),
        false => format!("'{}'", a.as_ref().replace('\'', "'\\''")),
    };
    arguments.into_iter().map(quoted).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_line_can_be_typed_again() {
        assert_eq!(
            command_line(["trueup", "diagnose", "my case", "-o", "out"]),
            "trueup diagnose 'my case' -o out"
        );
        assert_eq!(command_line(["trueup", "it's"]), "trueup 'it'\\''s'");
        assert_eq!(command_line(["--set", "linkMass[1]=2.0"]), "--set 'linkMass[1]=2.0'");
    }
}
