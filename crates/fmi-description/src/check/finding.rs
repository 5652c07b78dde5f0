//! What a check found.

/// How much it matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Against the standard.
    Error,
    /// Allowed, but it will surprise somebody.
    Warning,
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// How much it matters.
    pub severity: Severity,
    /// File inside the FMU.
    pub file: String,
    /// Line in that file.
    pub line: Option<u32>,
    /// What is wrong, and what to do.
    pub message: String,
}

impl std::fmt::Display for Finding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let severity = if self.severity == Severity::Error { "error" } else { "warning" };
        match self.line {
            Some(line) => write!(f, "{severity}: {}, line {line}: {}", self.file, self.message),
            None => write!(f, "{severity}: {}: {}", self.file, self.message),
        }
    }
}

/// The findings in the making.
#[derive(Default)]
pub(super) struct Findings(pub(super) Vec<Finding>);

impl Findings {
    pub(super) fn error(&mut self, line: impl Into<Option<u32>>, message: impl Into<String>) {
        self.add(Severity::Error, "modelDescription.xml", line.into(), message.into());
    }
    pub(super) fn warning(&mut self, line: impl Into<Option<u32>>, message: impl Into<String>) {
        self.add(Severity::Warning, "modelDescription.xml", line.into(), message.into());
    }
    pub(super) fn add(&mut self, severity: Severity, file: &str, line: Option<u32>, message: String) {
        self.0.push(Finding { severity, file: file.to_owned(), line, message });
    }
}
