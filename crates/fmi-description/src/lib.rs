//! modelDescription.xml: [`mod@write`] it from a model's variable table, [`pack`] an FMU, and for anybody's FMU:
//! open the [`archive`], [`read`] its description, [`check`] it against the standards.
//! Loads no library.

pub mod archive;
pub mod check;
pub mod description;
pub mod documentation;
mod macho;
pub mod pack;
pub mod platform;
pub mod read;
pub mod template;
pub mod whole;
pub mod write;

use platform::Platform;

/// Version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Version {
    /// FMI 2.0.
    V2,
    /// FMI 3.0.
    V3,
}

impl Version {
    /// Both.
    pub const ALL: [Self; 2] = [Self::V2, Self::V3];
    /// 2 or 3.
    pub fn major(self) -> u32 {
        match self {
            Self::V2 => 2,
            Self::V3 => 3,
        }
    }
    /// As it stands in `fmiVersion`.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::V2 => "2.0",
            Self::V3 => "3.0",
        }
    }
    /// Name of this machine's folder under `binaries/`; on a machine for which FMUs are not packed, one that no FMU has.
    pub fn platform(self) -> &'static str {
        Platform::host().map_or("no-platform", |p| p.folder(self))
    }
}
