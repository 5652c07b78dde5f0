//! What is wrong in a robot's file, and where.

/// Error and remedy, and the byte of the file where it begins, where that is known.
pub(super) struct RobotFileError {
    pub(super) at: Option<usize>,
    pub(super) why: String,
}

impl RobotFileError {
    pub(super) fn at(byte: usize, why: String) -> Self {
        Self { at: Some(byte), why }
    }
}

impl From<String> for RobotFileError {
    fn from(why: String) -> Self {
        Self { at: None, why }
    }
}
