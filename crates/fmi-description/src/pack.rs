//! Packs an FMU: copies of template libraries with the configuration written into them, the description, the
//! documentation. The same input gives the same bytes.

use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::Path;

use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use zip::CompressionMethod;
use zip::write::{SimpleFileOptions, ZipWriter};

use crate::template::{Template, TemplateError};
use crate::write::{self, WriteError, related, terminals};
use crate::{FmiVersion, documentation, macho};

/// What goes into an FMU.
#[derive(Clone, Copy, Debug)]
pub struct FmuParts<'a> {
    /// The table of this configuration.
    pub table: &'a ModelTable,
    /// Its token is assigned here.
    pub configuration: &'a Configuration,
    /// For this version of the standard.
    pub version: FmiVersion,
    /// A template library for each platform.
    pub templates: &'a [Template],
    /// The stamp that they must have: from which sources the packing program is built.
    pub stamp: &'a str,
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
    pub reference: Option<ReferenceResults<'a>>,
}

/// What an importer should get.
#[derive(Clone, Copy, Debug)]
pub struct ReferenceResults<'a> {
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
    /// A template that cannot become this FMU.
    #[error(transparent)]
    Template(#[from] TemplateError),
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
pub fn archive(parts: &FmuParts) -> Result<Vec<u8>, PackError> {
    let FmuParts { table, version, .. } = *parts;
    let (xml, token) = write::with_token(table, parts.configuration, version)?;
    let configuration = Configuration { token, ..parts.configuration.clone() };

    let mut files: Vec<(String, Vec<u8>)> = vec![
        ("modelDescription.xml".to_owned(), xml.into_bytes()),
        (
            "documentation/index.html".to_owned(),
            documentation::html(table, parts.equations, parts.picture).into_bytes(),
        ),
        ("resources/configuration.txt".to_owned(), configuration.to_text().into_bytes()),
    ];
    for (folder, suffix, library) in binaries(parts, &configuration)? {
        files.push((format!("binaries/{folder}/{}{suffix}", table.name), library));
    }
    for (kind, text) in parts.reference.iter().flat_map(|r| [("ref", r.outputs), ("in", r.inputs)]) {
        files.push((format!("documentation/{}_{kind}.csv", table.name), text.as_bytes().to_vec()));
    }
    if parts.reference.is_some() {
        let related = related::files(table)?
            .map(|(name, text)| (format!("{}/{name}", related::FOLDER), text.into_bytes()));
        files.extend(related);
    }
    files.extend(parts.modelica.map(|text| ("documentation/Trueup.mo".to_owned(), text.as_bytes().to_vec())));
    let names: Vec<&str> = parts.licences.iter().map(|(name, _)| *name).collect();
    let entry = format!(
        "{}\nThe full texts are next to this file: {}.\n",
        env!("CARGO_PKG_LICENSE"),
        names.join(", ")
    );
    files.push(("documentation/licenses/license.txt".to_owned(), entry.into_bytes()));
    for (name, text) in parts.licences {
        files.push((format!("documentation/licenses/{name}"), text.as_bytes().to_vec()));
    }
    match version {
        FmiVersion::V2 => files.push(("model.png".to_owned(), parts.icon_png.to_vec())),
        FmiVersion::V3 => files.extend([
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

/// Writes the file under a temporary name next to it and renames it: nothing half-written is under the
/// final name.
///
/// # Errors
/// [`PackError::Io`]
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), PackError> {
    crate::whole::write(path, bytes)
        .map_err(|source| PackError::Io { path: path.display().to_string(), source })
}

/// Folder, suffix and bytes of each library.
type Binary = (&'static str, &'static str, Vec<u8>);

/// The libraries with their configuration. Those that share a folder (both kinds of Mac in FMI 2.0) become one file.
fn binaries(parts: &FmuParts, configuration: &Configuration) -> Result<Vec<Binary>, PackError> {
    let mut folders: BTreeMap<&str, Vec<&Template>> = BTreeMap::new();
    for (i, template) in parts.templates.iter().enumerate() {
        if parts.templates[..i].iter().any(|t| t.platform == template.platform) {
            return Err(TemplateError::Twice(template.platform).into());
        }
        folders.entry(template.platform.folder(parts.version)).or_default().push(template);
    }
    let one = |(folder, templates): (&'static str, Vec<&Template>)| {
        let suffix = templates[0].platform.suffix();
        let configured: Result<Vec<_>, _> =
            templates.iter().map(|t| t.configured(configuration, parts.stamp)).collect();
        Ok((folder, suffix, macho::universal(configured?)))
    };
    folders.into_iter().map(one).collect()
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

    #[test]
    fn a_file_that_cannot_be_written_leaves_nothing_behind() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::create_dir(dir.path().join("taken.fmu")).unwrap();
        assert!(write_file(&dir.path().join("taken.fmu"), b"x").is_err());
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
    }
}
