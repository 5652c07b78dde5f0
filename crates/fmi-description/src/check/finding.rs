//! What a check found.

/// How much it matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DescriptionSeverity {
    /// Against the standard.
    Error,
    /// Allowed, but it will surprise somebody.
    Warning,
}

/// One thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DescriptionFinding {
    /// How much it matters.
    pub severity: DescriptionSeverity,
    /// File inside the FMU.
    pub file: String,
    /// Line in that file.
    pub line: Option<u32>,
    /// What is wrong, and what to do.
    pub message: String,
}

impl std::fmt::Display for DescriptionFinding {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let severity = if self.severity == DescriptionSeverity::Error { "error" } else { "warning" };
        match self.line {
            Some(line) => write!(f, "{severity}: {}, line {line}: {}", self.file, self.message),
            None => write!(f, "{severity}: {}: {}", self.file, self.message),
        }
    }
}

/// The findings in the making.
#[derive(Default)]
pub(super) struct Findings(pub(super) Vec<DescriptionFinding>);

impl Findings {
    pub(super) fn error(&mut self, line: impl Into<Option<u32>>, message: impl Into<String>) {
        self.add(DescriptionSeverity::Error, "modelDescription.xml", line.into(), message.into());
    }
    pub(super) fn warning(&mut self, line: impl Into<Option<u32>>, message: impl Into<String>) {
        self.add(DescriptionSeverity::Warning, "modelDescription.xml", line.into(), message.into());
    }
    pub(super) fn add(
        &mut self,
        severity: DescriptionSeverity,
        file: &str,
        line: Option<u32>,
        message: String,
    ) {
        self.0.push(DescriptionFinding { severity, file: file.to_owned(), line, message });
    }
}
