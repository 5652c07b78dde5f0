//! Packs an FMU: a copy of a template library with the configuration written into it, the description, the
//! documentation. The same input gives the same bytes.

use std::io::{Cursor, Write};
use std::path::Path;

use trueup_fmi::configuration::{BLOCK_SIZE, Configuration, ConfigurationError, MARKER};
use trueup_fmi::table::ModelTable;
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

use crate::write::{self, WriteError, terminals};
use crate::{Version, documentation};

/// What goes into an FMU.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// The table of this configuration.
    pub table: &'a ModelTable,
    /// Its token is assigned here.
    pub configuration: &'a Configuration,
    /// For this version of the standard.
    pub version: Version,
    /// The template library.
    pub library: &'a [u8],
    /// HTML fragment: the equations, of the effects packed in too.
    pub equations: &'a str,
    /// SVG: the mechanism or block diagram.
    pub picture: &'a str,
    /// The equations as Modelica, where they are written.
    pub modelica: Option<&'a str>,
    /// Icon.
    pub icon_svg: &'a str,
    /// The same, rendered.
    pub icon_png: &'a [u8],
    /// File names and texts.
    pub licences: &'a [(&'a str, &'a str)],
    /// The default experiment; `None`: these values cannot be simulated with it.
    pub reference: Option<Reference<'a>>,
}

/// What an importer should get.
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    /// CSV: what goes in.
    pub inputs: &'a str,
    /// CSV: what comes out.
    pub outputs: &'a str,
}

/// An FMU that cannot be packed.
#[derive(Debug, thiserror::Error)]
pub enum PackError {
    /// The variable table is not consistent.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The configuration does not fit into its block.
    #[error(transparent)]
    Configuration(#[from] ConfigurationError),
    /// Not exactly one configuration block.
    #[error(
        "the template library has {0} configuration blocks instead of one: build it anew with `cargo build --release`"
    )]
    Blocks(usize),
    /// The archive or file cannot be written.
    #[error("{path}: {source}")]
    Io {
        /// File.
        path: String,
        /// Why.
        source: std::io::Error,
    },
}

/// The bytes of the .fmu file.
///
/// # Errors
/// [`PackError`]
pub fn archive(parts: &Parts) -> Result<Vec<u8>, PackError> {
    let Parts { table, version, .. } = *parts;
    let (xml, token) = write::with_token(table, parts.configuration, version)?;
    let configuration = Configuration { token, ..parts.configuration.clone() };
    let library = configure(parts.library, &configuration)?;

    let mut files: Vec<(String, Vec<u8>)> = vec![
        ("modelDescription.xml".to_owned(), xml.into_bytes()),
        (format!("binaries/{}/{}{}", version.platform(), table.name, std::env::consts::DLL_SUFFIX), library),
        (
            "documentation/index.html".to_owned(),
            documentation::html(table, parts.equations, parts.picture).into_bytes(),
        ),
        ("resources/configuration.txt".to_owned(), configuration.to_text().into_bytes()),
    ];
    for (kind, text) in parts.reference.iter().flat_map(|r| [("ref", r.outputs), ("in", r.inputs)]) {
        files.push((format!("documentation/{}_{kind}.csv", table.name), text.as_bytes().to_vec()));
    }
    files.extend(parts.modelica.map(|text| ("documentation/Trueup.mo".to_owned(), text.as_bytes().to_vec())));
    let names: Vec<&str> = parts.licences.iter().map(|(name, _)| *name).collect();
    let entry = format!(
        "{}\nThe full texts lie beside this file: {}.\n",
        env!("CARGO_PKG_LICENSE"),
        names.join(", ")
    );
    files.push(("documentation/licenses/license.txt".to_owned(), entry.into_bytes()));
    for (name, text) in parts.licences {
        files.push((format!("documentation/licenses/{name}"), text.as_bytes().to_vec()));
    }
    match version {
        Version::V2 => files.push(("model.png".to_owned(), parts.icon_png.to_vec())),
        Version::V3 => files.extend([
            ("terminalsAndIcons/icon.png".to_owned(), parts.icon_png.to_vec()),
            ("terminalsAndIcons/icon.svg".to_owned(), parts.icon_svg.as_bytes().to_vec()),
            (
                "terminalsAndIcons/terminalsAndIcons.xml".to_owned(),
                terminals::terminals_and_icons(table)?.into_bytes(),
            ),
        ]),
    }
    compress(&files).map_err(|source| PackError::Io { path: format!("{}.fmu", table.name), source })
}

/// Writes the file under a temporary name beside it and renames it: nothing half-written stands under the
/// final name.
///
/// # Errors
/// [`PackError::Io`]
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), PackError> {
    crate::whole::write(path, bytes)
        .map_err(|source| PackError::Io { path: path.display().to_string(), source })
}

/// The library with the configuration in its block.
fn configure(library: &[u8], configuration: &Configuration) -> Result<Vec<u8>, PackError> {
    let block = configuration.to_block()?;
    // The marker alone is also a constant of the program; a block is the marker followed by zeros.
    let is_block = |at: &usize| {
        let bytes = library.get(at + MARKER.len()..at + BLOCK_SIZE);
        bytes.is_some_and(|b| b.iter().all(|b| *b == 0))
    };
    let starts: Vec<usize> = library
        .windows(MARKER.len())
        .enumerate()
        .filter(|(_, window)| *window == MARKER)
        .map(|(at, _)| at)
        .filter(is_block)
        .collect();
    let [start] = starts[..] else { return Err(PackError::Blocks(starts.len())) };
    let mut out = library.to_vec();
    out[start..start + BLOCK_SIZE].copy_from_slice(&block);
    Ok(out)
}

fn compress(files: &[(String, Vec<u8>)]) -> std::io::Result<Vec<u8>> {
    // The default time stamp is 1980-01-01, so packing is reproducible. Level 6 keeps to the fast encoder.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .compression_level(Some(6))
        .last_modified_time(zip::DateTime::default());
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        let executable = name.starts_with("binaries/");
        zip.start_file(name.as_str(), options.unix_permissions(if executable { 0o755 } else { 0o644 }))?;
        zip.write_all(bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn template() -> Vec<u8> {
        let mut library = b"\x7fELF head ".to_vec();
        library.extend_from_slice(MARKER);
        library.extend_from_slice(b"a constant that happens to be there");
        library.extend_from_slice(MARKER);
        library.resize(library.len() + BLOCK_SIZE - MARKER.len(), 0);
        library.extend_from_slice(b" tail");
        library
    }

    #[test]
    fn the_configuration_goes_into_the_one_block_and_nowhere_else() {
        let template = template();
        let mut c = Configuration::of("TwoMassJoint");
        c.token = "t".to_owned();
        let packed = configure(&template, &c).unwrap();
        assert_eq!(packed.len(), template.len());
        let start = template.len() - 5 - BLOCK_SIZE;
        assert_eq!(packed[..start], template[..start]);
        assert_eq!(packed[start + BLOCK_SIZE..], *b" tail");
        assert_eq!(Configuration::from_block(&packed[start..start + BLOCK_SIZE]), Ok(c));
    }

    #[test]
    fn a_library_without_block_or_already_packed_is_refused() {
        let c = Configuration::of("TwoMassJoint");
        assert!(matches!(configure(b"no block here", &c), Err(PackError::Blocks(0))));
        let packed = configure(&template(), &c).unwrap();
        assert!(matches!(configure(&packed, &c), Err(PackError::Blocks(0))));
    }

    #[test]
    fn a_file_that_cannot_be_written_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("taken.fmu")).unwrap();
        assert!(write_file(&dir.path().join("taken.fmu"), b"x").is_err());
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
