//! Text of XML, URIs and archives.

use std::io::{Cursor, Write};
use std::path::Path;

use quick_xml::escape::escape;
use trueup_fmi_description::archive::{Archive, MAX_TOTAL};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// An unpacked FMU as an archive.
pub(super) fn packed(folder: &Path) -> std::io::Result<Vec<u8>> {
    let mut archive = Archive::open(folder).map_err(std::io::Error::other)?;
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let names: Vec<String> = archive.entries().iter().map(|e| e.name.clone()).collect();
    for name in names {
        let bytes = archive.read(&name, MAX_TOTAL).map_err(std::io::Error::other)?;
        zip.start_file(&*name, SimpleFileOptions::default())?;
        zip.write_all(&bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// A file name as part of a URI.
pub(super) fn percent(name: &str) -> String {
    let plain = |b: u8| b.is_ascii_alphanumeric() || b"-._~+".contains(&b);
    name.bytes().map(|b| if plain(b) { char::from(b).to_string() } else { format!("%{b:02X}") }).collect()
}

/// Text in the making, with the elements that are open.
#[derive(Default)]
pub(super) struct SspXml {
    pub(super) text: String,
    open: Vec<String>,
}

impl SspXml {
    fn tag(&mut self, name: &str, attributes: &[(&str, &str)], end: &str) {
        let indent = "  ".repeat(self.open.len() + usize::from(name != "ssd:SystemStructureDescription"));
        self.text += &format!("{indent}<{name}");
        for (key, value) in attributes {
            self.text +=
                &format!(" {key}=\"{}\"", escape(*value).replace('\n', "&#10;").replace('\t', "&#9;"));
        }
        self.text += end;
        self.text.push('\n');
    }
    pub(super) fn open(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.tag(name, attributes, ">");
        self.open.push(name.to_owned());
    }
    pub(super) fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) {
        self.tag(name, attributes, "/>");
    }
    pub(super) fn close(&mut self) {
        if let Some(name) = self.open.pop() {
            self.text += &format!("{}</{name}>\n", "  ".repeat(self.open.len() + 1));
        }
    }
}
