//! Operating systems and processors for which an FMU can have a library.

use object::{Architecture, BinaryFormat, Object};

use crate::FmiVersion;

/// One of them; its name is the platform tuple of FMI 3.0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Platform {
    /// Linux on x86-64.
    X86Linux,
    /// Linux on 64-bit ARM.
    ArmLinux,
    /// Windows on x86-64.
    X86Windows,
    /// macOS on Apple silicon.
    ArmDarwin,
    /// macOS on Intel.
    X86Darwin,
}

impl Platform {
    /// All.
    pub const ALL: [Self; 5] =
        [Self::X86Linux, Self::ArmLinux, Self::X86Windows, Self::ArmDarwin, Self::X86Darwin];

    /// That of this program; `None`: one that is not in the list.
    pub fn host() -> Option<Self> {
        let os = if std::env::consts::OS == "macos" { "darwin" } else { std::env::consts::OS };
        Self::named(&format!("{}-{os}", std::env::consts::ARCH))
    }

    /// The one of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// The one for which this shared library is made; `None`: no library, or of another platform.
    pub fn of_library(bytes: &[u8]) -> Option<Self> {
        let file = object::File::parse(bytes).ok()?;
        match (file.format(), file.architecture()) {
            (BinaryFormat::Elf, Architecture::X86_64) => Some(Self::X86Linux),
            (BinaryFormat::Elf, Architecture::Aarch64) => Some(Self::ArmLinux),
            (BinaryFormat::Pe, Architecture::X86_64) => Some(Self::X86Windows),
            (BinaryFormat::MachO, Architecture::Aarch64) => Some(Self::ArmDarwin),
            (BinaryFormat::MachO, Architecture::X86_64) => Some(Self::X86Darwin),
            _ => None,
        }
    }

    /// Platform tuple.
    pub fn name(self) -> &'static str {
        match self {
            Self::X86Linux => "x86_64-linux",
            Self::ArmLinux => "aarch64-linux",
            Self::X86Windows => "x86_64-windows",
            Self::ArmDarwin => "aarch64-darwin",
            Self::X86Darwin => "x86_64-darwin",
        }
    }

    /// Name of its folder under `binaries/`. FMI 2.0 names operating systems alone: both kinds of Mac read `darwin64`, where one
    /// file may serve both. It has no name for Linux on ARM; tools use that of 3.0.
    pub fn folder(self, version: FmiVersion) -> &'static str {
        match (version, self) {
            (FmiVersion::V2, Self::X86Linux) => "linux64",
            (FmiVersion::V2, Self::X86Windows) => "win64",
            (FmiVersion::V2, Self::ArmDarwin | Self::X86Darwin) => "darwin64",
            _ => self.name(),
        }
    }

    /// How names of shared libraries begin.
    pub fn prefix(self) -> &'static str {
        if self == Self::X86Windows { "" } else { "lib" }
    }

    /// How names of shared libraries end.
    pub fn suffix(self) -> &'static str {
        match self {
            Self::X86Linux | Self::ArmLinux => ".so",
            Self::X86Windows => ".dll",
            Self::ArmDarwin | Self::X86Darwin => ".dylib",
        }
    }
}

impl std::fmt::Display for Platform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl FmiVersion {
    /// Name of this machine's folder under `binaries/`; on a machine for which FMUs are not packed, one that no FMU has.
    pub fn platform(self) -> &'static str {
        Platform::host().map_or("no-platform", |p| p.folder(self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_itself_is_for_its_own_platform() {
        let program = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        assert_eq!(Platform::of_library(&program), Platform::host());
        assert_eq!(Platform::of_library(b"no library"), None);
    }

    #[test]
    fn names_are_read_back_and_folders_are_those_of_the_standards() {
        for p in Platform::ALL {
            assert_eq!(Platform::named(p.name()), Some(p));
            assert_eq!(p.folder(FmiVersion::V3), p.name());
        }
        assert_eq!(Platform::named("linux64"), None);
        let folders = Platform::ALL.map(|p| p.folder(FmiVersion::V2));
        assert_eq!(folders, ["linux64", "aarch64-linux", "win64", "darwin64", "darwin64"]);
    }
}
