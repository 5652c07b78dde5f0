//! FMUs as this test sees them: unpacked, described, and their C functions as raw pointers.
#![allow(dead_code, unsafe_code)] // shared with the benchmarks; calls of C functions

use libloading::Library as Shared;
use std::ffi::CString;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use trueup_fmi_description::{FmiVersion, archive::Archive, description as md, read::read};

/// A structure of function pointers from a list of functions.
macro_rules! functions {
    ($(fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {
        #[allow(non_snake_case)]
        pub struct Functions {
            $(pub $name: pointer::$name,)*
            _library: super::Shared,
        }
        impl Functions {
            pub fn load(path: &std::path::Path) -> Self {
                // SAFETY: libraries of FMUs have no initializers that matter; the types are those of the header.
                unsafe {
                    let library = super::Shared::new(path).unwrap();
                    Self {
                        $($name: *library.get(stringify!($name).as_bytes()).unwrap(),)*
                        _library: library,
                    }
                }
            }
        }
    };
}
pub mod two {
    use trueup_fmi::abi::fmi2::*;
    trueup_fmi::fmi2_functions!(functions);
}
pub mod three {
    use trueup_fmi::abi::fmi3::*;
    trueup_fmi::fmi3_functions!(functions);
}

#[allow(clippy::large_enum_variant)]
pub enum Library {
    Two(two::Functions),
    Three(three::Functions),
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Kind {
    Real,
    Boolean,
    Integer,
    Enumeration,
}

pub struct Variable {
    pub name: String,
    pub reference: u32,
    /// Number of elements.
    pub len: usize,
    pub kind: Kind,
    pub causality: md::DescriptionCausality,
    pub variability: md::DescriptionVariability,
    pub start: Vec<f64>,
    /// Of an enumeration: its last item, the first being 1.
    pub items: i64,
}

pub struct Fmu {
    pub name: String,
    pub token: CString,
    pub library: Library,
    pub variables: Vec<Variable>,
    pub states: usize,
    pub indicators: usize,
    _folder: tempfile::TempDir,
}

impl Fmu {
    pub fn load(path: &Path) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut archive = Archive::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        archive.extract(folder.path()).unwrap();
        let d = read(&archive.description().unwrap()).unwrap();
        let interface = d.model_exchange.as_ref().or(d.co_simulation.as_ref()).unwrap();
        let platform = if d.version == FmiVersion::V2 { "linux64" } else { "x86_64-linux" };
        let library = folder.path().join(format!("binaries/{platform}/{}.so", interface.model_identifier));
        let library = match d.version {
            FmiVersion::V2 => Library::Two(two::Functions::load(&library)),
            FmiVersion::V3 => Library::Three(three::Functions::load(&library)),
        };
        let variables = d.variables.iter().map(|v| Variable {
            name: v.name.clone(),
            reference: v.value_reference,
            len: d.elements(v).unwrap(),
            kind: match v.kind {
                md::VariableType::Boolean => Kind::Boolean,
                md::VariableType::Enumeration => Kind::Enumeration,
                t if t.is_float() => Kind::Real,
                _ => Kind::Integer,
            },
            causality: v.causality,
            variability: v.variability,
            start: v.start.as_ref().and_then(md::StartValues::as_f64).unwrap_or_default(),
            items: v.declared_type.as_deref().and_then(|t| d.declared_type(t)).map_or(0, |t| t.items.len())
                as i64,
        });
        let states = d.structure.derivatives.iter();
        let states = states.map(|u| &d.variables[d.resolve(u.reference).unwrap()]);
        Self {
            name: path.file_name().unwrap().to_string_lossy().into_owned(),
            token: CString::new(d.token.clone()).unwrap(),
            variables: variables.collect(),
            states: states.map(|v| d.elements(v).unwrap()).sum(),
            indicators: d.event_indicators(),
            library,
            _folder: folder,
        }
    }
    pub fn is_fmi3(&self) -> bool {
        matches!(self.library, Library::Three(_))
    }
    pub fn find(&self, name: &str) -> &Variable {
        self.variables.iter().find(|v| v.name == name).unwrap_or_else(|| panic!("{}: no {name}", self.name))
    }
    /// Variables of a causality and data type.
    pub fn of(&self, causality: md::DescriptionCausality, kind: Kind) -> Vec<&Variable> {
        self.variables.iter().filter(|v| v.causality == causality && v.kind == kind).collect()
    }
}

/// Reports that something was left out; not println!, which the test runner keeps to itself.
pub fn skipped(why: &str) {
    let _ = writeln!(std::io::stderr(), "SKIPPED: {why}");
}

/// Every FMU file in a folder, sorted.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<_> = entries.map(|e| e.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "fmu"));
    files.sort();
    files
}

/// Packs with the program (`TRUEUP_BIN`), if there is one.
pub fn pack(arguments: &[&str], folder: &Path) -> bool {
    let Some(program) = std::env::var_os("TRUEUP_BIN").filter(|p| Path::new(p).exists()) else {
        return false;
    };
    let done = Command::new(program).args(["fmu", "pack"]).args(arguments).arg("-o").arg(folder).output();
    let done = done.unwrap();
    assert!(done.status.success(), "fmu pack: {}", String::from_utf8_lossy(&done.stderr));
    true
}

/// The default FMUs: those in `TRUEUP_FMUS`, or freshly packed ones; none without either.
pub fn packed() -> Vec<PathBuf> {
    if let Some(folder) = std::env::var_os("TRUEUP_FMUS") {
        return files(Path::new(&folder));
    }
    // Left in place: the paths are handed out.
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fmus");
    if pack(&[], &folder) { files(&folder) } else { Vec::new() }
}
