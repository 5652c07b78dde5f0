//! modelDescription.xml: [`mod@write`] it from a model's variable table, [`pack`] an FMU, and for anybody's FMU:
//! open the [`archive`], [`read`] its description, [`check`] it against the standards.
//! Loads no library.

pub mod archive;
pub mod check;
pub mod description;
pub mod documentation;
pub mod pack;
pub mod read;
pub mod whole;
pub mod write;

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
    /// Name of this machine's folder under `binaries/`.
    pub fn platform(self) -> &'static str {
        let os = if cfg!(target_os = "windows") {
            ["win", "windows"]
        } else if cfg!(target_os = "macos") {
            ["darwin", "darwin"]
        } else {
            ["linux", "linux"]
        };
        match (self, os, cfg!(target_arch = "aarch64")) {
            (Self::V2, ["linux", _], false) => "linux64",
            (Self::V2, ["darwin", _], false) => "darwin64",
            (Self::V2, ["win", _], false) => "win64",
            (_, [_, "linux"], false) => "x86_64-linux",
            (_, [_, "darwin"], false) => "x86_64-darwin",
            (_, _, false) => "x86_64-windows",
            // FMI 2.0 has no names of its own for these; tools use the platform tuple of 3.0.
            (_, [_, "linux"], true) => "aarch64-linux",
            (_, [_, "darwin"], true) => "aarch64-darwin",
            (_, _, true) => "aarch64-windows",
        }
    }
}
