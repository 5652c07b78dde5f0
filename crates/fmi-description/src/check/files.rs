//! The archive: structure, binaries, terminals.

use std::collections::BTreeSet;

use super::binary;
use super::finding::{DescriptionFinding, DescriptionSeverity, Findings};
use crate::FmiVersion;
use crate::archive::Archive;
use crate::description::Description;
use crate::read;

/// Largest library that is looked into.
const MAX_BINARY: u64 = 1 << 30;

/// Checks a whole FMU.
pub fn archive(archive: &mut Archive) -> Vec<DescriptionFinding> {
    let mut f = Findings::default();
    for e in archive.entries() {
        if e.name.contains('\\') {
            f.add(
                DescriptionSeverity::Error,
                &e.name,
                None,
                "the path has a backslash: pack it with forward slashes".to_owned(),
            );
        }
        if !e.portable {
            f.add(
                DescriptionSeverity::Error,
                &e.name,
                None,
                "compressed by a method other than deflate or store: pack it again".to_owned(),
            );
        }
    }
    let bytes = match archive.description() {
        Ok(bytes) => bytes,
        Err(e) => {
            let inside = archive.entries().iter().find(|e| e.name.ends_with("/modelDescription.xml"));
            let hint =
                inside.map_or_else(String::new, |e| format!("; it is at {} but must be at the top", e.name));
            f.error(None, format!("{e}{hint}"));
            return f.0;
        }
    };
    match read::read(&bytes) {
        Ok(d) => {
            f.0.extend(super::whole::description(&d));
            binaries(archive, &d, &mut f);
            terminals(archive, &d, &mut f);
            licences(archive, &d, &mut f);
        }
        Err(e) => f.error(e.line, e.message),
    }
    f.0
}

fn binaries(archive: &mut Archive, d: &Description, f: &mut Findings) {
    let platform = d.version.platform();
    let folders: BTreeSet<String> = archive
        .entries()
        .iter()
        .filter_map(|e| Some(e.name.strip_prefix("binaries/")?.split_once('/')?.0.to_owned()))
        .collect();
    let sources = archive.entries().iter().any(|e| e.name.starts_with("sources/"));
    if folders.is_empty() && !sources {
        f.add(
            DescriptionSeverity::Error,
            "binaries",
            None,
            "neither binaries nor sources: this FMU cannot be run".to_owned(),
        );
        return;
    }
    if !folders.contains(platform) {
        let there: Vec<_> = folders.into_iter().collect();
        let there = if there.is_empty() { "sources only".to_owned() } else { there.join(", ") };
        f.add(
            DescriptionSeverity::Warning,
            &format!("binaries/{platform}"),
            None,
            format!("no binary for this machine (there: {there}): it cannot be run here"),
        );
        return;
    }
    let identifiers: BTreeSet<&str> = d.interfaces().map(|(_, i)| i.model_identifier.as_str()).collect();
    for id in identifiers {
        let file = format!("binaries/{platform}/{id}{}", std::env::consts::DLL_SUFFIX);
        let mut error = |message: String| f.add(DescriptionSeverity::Error, &file, None, message);
        if !archive.has(&file) {
            error("the library is missing: its name must be the modelIdentifier".to_owned());
            continue;
        }
        match archive.read(&file, MAX_BINARY).map_err(|e| e.to_string()).and_then(|b| binary::missing(d, &b))
        {
            Ok(missing) if missing.is_empty() => {}
            Ok(missing) => error(format!(
                "{} of the functions that FMI {} demands are missing: {}",
                missing.len(),
                d.version.as_str(),
                missing.join(", ")
            )),
            Err(e) => error(e),
        }
    }
}

fn terminals(archive: &mut Archive, d: &Description, f: &mut Findings) {
    let file = "terminalsAndIcons/terminalsAndIcons.xml";
    if d.version == FmiVersion::V2 || !archive.has(file) {
        return;
    }
    let mut error = |line, message| f.add(DescriptionSeverity::Error, file, line, message);
    let text = match archive.read(file, crate::archive::MAX_DESCRIPTION).map(String::from_utf8) {
        Ok(Ok(text)) => text,
        Ok(Err(_)) => return error(None, "not UTF-8: save it as UTF-8".to_owned()),
        Err(e) => return error(None, e.to_string()),
    };
    let document = match roxmltree::Document::parse(&text) {
        Ok(document) => document,
        Err(e) => return error(Some(e.pos().row), format!("not well-formed XML: {e}")),
    };
    for n in document.descendants().filter(|n| n.has_tag_name("TerminalMemberVariable")) {
        let name = n.attribute("variableName").unwrap_or_default();
        if d.find(name).is_none() {
            let line = document.text_pos_at(n.range().start).row;
            error(Some(line), format!("the terminal's variable `{name}` is not in modelDescription.xml"));
        }
    }
}

fn licences(archive: &Archive, d: &Description, f: &mut Findings) {
    let folder = "documentation/licenses/";
    let has = |suffix: &str| archive.has(&format!("{folder}license.{suffix}"));
    let entry = has("txt") || has("html") || d.version == FmiVersion::V3 && has("spdx");
    if archive.entries().iter().any(|e| e.name.starts_with(folder) && e.name != folder) && !entry {
        f.add(
            DescriptionSeverity::Warning,
            folder,
            None,
            "there is no license.txt or license.html, where users start to look: add one".to_owned(),
        );
    }
}
