//! One message and an exit code.

/// Why a command did not do its work.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum CliError {
    /// The command line names something that does not exist: exit code 2.
    Usage(String),
    /// The work could not be done: exit code 1.
    Failed(String),
    /// Everything is reported already: exit code 1.
    Said,
    /// Another process has done or reported everything, with this exit code.
    Elsewhere(u8),
}

impl From<trueup_robot::RobotReadError> for CliError {
    fn from(e: trueup_robot::RobotReadError) -> Self {
        Self::Failed(e.0)
    }
}

impl CliError {
    pub(crate) fn message(&self) -> Option<&str> {
        match self {
            Self::Usage(m) | Self::Failed(m) => Some(m),
            Self::Said | Self::Elsewhere(_) => None,
        }
    }
    pub(crate) fn status(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Failed(_) | Self::Said => 1,
            Self::Elsewhere(status) => *status,
        }
    }
    /// A failure that concerns this file.
    pub(crate) fn at(path: &std::path::Path, why: impl std::fmt::Display) -> Self {
        Self::Failed(format!("{}: {why}", path.display()))
    }
}
