//! The files of a description: found, opened, parsed; where one points to.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use roxmltree::Document;
use trueup_fmi_description::read::decode;

use super::xml::{SspNode, SspText};
use crate::mistake::InputMistake;
use crate::store::{Store, inside};
use crate::system::SourceSpan;

pub(super) struct SspReader {
    pub(super) store: Store,
    pub(super) mistakes: Vec<InputMistake>,
    pub(super) notes: Vec<String>,
}

impl SspReader {
    pub(super) fn new() -> Self {
        Self { store: Store::default(), mistakes: Vec::new(), notes: Vec::new() }
    }

    /// Parses a file and hands its root on.
    pub(super) fn with<T>(
        &mut self,
        file: &Path,
        at: &SourceSpan,
        work: impl for<'d> FnOnce(&mut Self, SspNode<'d>, &'d Document<'d>) -> Result<T, InputMistake>,
    ) -> Option<T> {
        let fail = |place: SourceSpan, message: String| InputMistake { place, message };
        let bytes = match self.store.read(file) {
            Ok(bytes) => bytes,
            Err(why) => {
                self.mistakes.push(fail(at.clone(), format!("{}: {why}", file.display())));
                return None;
            }
        };
        let in_file = |line| SourceSpan { file: file.into(), line };
        let text = match decode(&bytes) {
            Ok(text) => text,
            Err(e) => {
                self.mistakes.push(fail(in_file(e.line), e.message));
                return None;
            }
        };
        if let Some(why) = nested_too_deeply(&text) {
            self.mistakes.push(fail(in_file(why), "elements are nested too deeply".into()));
            return None;
        }
        let text = declared(text);
        let document = match Document::parse(&text) {
            Ok(document) => document,
            Err(e) => {
                self.mistakes.push(fail(in_file(e.pos().row), format!("not well-formed XML: {e}")));
                return None;
            }
        };
        let source = SspText::new(file, &text);
        let root = SspNode { node: document.root_element(), source: &source };
        let done = work(self, root, &document);
        done.map_err(|mistake| self.mistakes.push(mistake)).ok()
    }

    /// The file that a URI means, seen from a file. What is in an archive stays in it.
    pub(super) fn locate(&mut self, uri: &str, from: &Path) -> Result<PathBuf, String> {
        let text = match uri.split_once(':') {
            Some(("file", rest)) => rest.trim_start_matches("//"),
            Some((scheme, _)) if scheme.len() > 1 && scheme.chars().all(|c| c.is_ascii_alphanumeric()) => {
                return Err(format!("{uri}: only files can be read, nothing over {scheme}"));
            }
            _ => uri,
        };
        let text = percent(text).ok_or_else(|| format!("{uri} is no valid URI"))?;
        let folder = from.parent().unwrap_or(Path::new(""));
        let path = folder.join(text.replace('\\', "/"));
        let archive = from.ancestors().skip(1).find(|p| {
            p.is_file() || p.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp")) && !p.is_dir()
        });
        match archive {
            Some(archive) => {
                inside(archive, &path).ok_or_else(|| format!("{uri} leads out of {}", archive.display()))
            }
            None => Ok(path),
        }
    }
}

/// The description that a component refers to, `None` for an FMU.
///
/// # Errors
/// Its type, which can be neither.
pub(super) fn described<'d>(
    component: SspNode<'d>,
    file: &Path,
    fragment: &str,
) -> Result<Option<PathBuf>, &'d str> {
    let kind = component.attribute("type").unwrap_or("application/x-fmu-sharedlibrary");
    let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match (kind.split(';').next().unwrap_or(kind).trim(), extension.as_str()) {
        ("application/x-ssp-package", _) | ("application/x-fmu-sharedlibrary", "ssp") => {
            Ok(Some(file.join(if fragment.is_empty() { "SystemStructure.ssd" } else { fragment })))
        }
        ("application/x-ssp-definition", _) | ("application/x-fmu-sharedlibrary", "ssd") => {
            Ok(Some(file.to_owned()))
        }
        ("application/x-fmu-sharedlibrary", _) => Ok(None),
        (other, _) => Err(other),
    }
}

/// The system of this id in a file.
pub(super) fn system_by_id<'d>(document: &'d Document<'d>, id: &str) -> Option<roxmltree::Node<'d, 'd>> {
    let is = |n: &roxmltree::Node| n.is_element() && n.attribute("id") == Some(id);
    document.descendants().find(is).filter(|n| n.tag_name().name() == "System")
}

/// Prefixes that a file uses without a declaration, which other tools do not notice, are declared in its
/// root element.
fn declared(mut text: Cow<str>) -> Cow<str> {
    for _ in 0..8 {
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = Document::parse(&text) else { break };
        let Some(root) = root_name(&text) else { break };
        let name = text[root..].find(|c: char| c.is_whitespace() || c == '>' || c == '/');
        let Some(name) = name else { break };
        text.to_mut().insert_str(root + name, &format!(" xmlns:{prefix}=\"urn:undeclared:{prefix}\""));
    }
    text
}

/// Where the name of the root element begins, behind comments and instructions.
fn root_name(text: &str) -> Option<usize> {
    let mut at = 0;
    loop {
        let open = at + text[at..].find('<')?;
        let rest = &text[open..];
        let end = match rest.get(..4) {
            Some("<!--") => "-->",
            Some(other) if other.starts_with("<?") => "?>",
            _ => return Some(open + 1),
        };
        at = open + rest.find(end)?;
    }
}

/// `%20` and so on.
fn percent(text: &str) -> Option<String> {
    let (mut bytes, mut rest) = (Vec::new(), text.as_bytes());
    while let Some((first, tail)) = rest.split_first() {
        match first {
            b'%' => {
                let hex = tail.get(..2).and_then(|h| std::str::from_utf8(h).ok())?;
                bytes.push(u8::from_str_radix(hex, 16).ok()?);
                rest = &tail[2..];
            }
            other => {
                bytes.push(*other);
                rest = tail;
            }
        }
    }
    String::from_utf8(bytes).ok().filter(|t| !t.contains('\0'))
}

/// The line where a hostile file nests deeper than any stack allows; a count of tags, not a parse.
fn nested_too_deeply(text: &str) -> Option<u32> {
    let (mut depth, mut line) = (0_i64, 1);
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'\n' => line += 1,
            b'<' => match text.as_bytes().get(at + 1) {
                Some(b'/') => depth -= 1,
                Some(b'?' | b'!') | None => {}
                Some(_) => depth += 1,
            },
            b'>' if at > 0 && text.as_bytes()[at - 1] == b'/' => depth -= 1,
            _ => {}
        }
        if depth > 1000 {
            return Some(line);
        }
    }
    None
}
