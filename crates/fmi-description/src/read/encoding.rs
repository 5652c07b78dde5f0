//! Bytes to text: UTF-8 with or without byte order mark, UTF-16, ISO-8859-1.

use std::borrow::Cow;

use super::error::ReadError;

/// The text of an XML file: UTF-8, UTF-16 or ISO-8859-1, as its first bytes and its declaration say.
///
/// # Errors
/// [`ReadError`] with the place of what cannot be decoded.
pub fn decode(bytes: &[u8]) -> Result<Cow<'_, str>, ReadError> {
    if let Some(rest) = bytes.strip_prefix(b"\xef\xbb\xbf") {
        return utf8(rest);
    }
    if let Some(rest) = bytes.strip_prefix(b"\xff\xfe") {
        return utf16(rest, u16::from_le_bytes);
    }
    if let Some(rest) = bytes.strip_prefix(b"\xfe\xff") {
        return utf16(rest, u16::from_be_bytes);
    }
    // The XML parser does not look at it, others do.
    if let Some(version) = declaration(bytes, "version").filter(|v| !v.starts_with("1.")) {
        return Err(error(1, 1, format!("the XML version \"{version}\" is not understood: write \"1.0\"")));
    }
    match declared(bytes).as_deref() {
        None | Some("utf-8" | "utf8" | "us-ascii" | "ascii") => utf8(bytes),
        // Windows-1252 differs in 27 signs (typographic quotes) that no name may contain.
        Some(
            "iso-8859-1" | "iso_8859-1" | "iso-8859-15" | "latin1" | "latin-1" | "windows-1252" | "cp1252",
        ) => Ok(Cow::Owned(bytes.iter().map(|b| char::from(*b)).collect())),
        Some(other) => {
            Err(error(1, 1, format!("the encoding \"{other}\" is not understood: save it as UTF-8")))
        }
    }
}

/// The encoding in the XML declaration.
fn declared(bytes: &[u8]) -> Option<String> {
    declaration(bytes, "encoding").map(|e| e.to_ascii_lowercase())
}

/// A pseudo-attribute of the XML declaration.
fn declaration(bytes: &[u8], name: &str) -> Option<String> {
    let head: String = bytes.iter().take(200).map(|b| char::from(*b)).collect();
    let declaration = head.strip_prefix("<?xml")?.split("?>").next()?;
    let value = declaration.split(name).nth(1)?.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    Some(value[1..].split(quote).next()?.to_owned())
}

fn utf8(bytes: &[u8]) -> Result<Cow<'_, str>, ReadError> {
    std::str::from_utf8(bytes).map(Cow::Borrowed).map_err(|e| {
        let before = &bytes[..e.valid_up_to()];
        let line = before.iter().filter(|b| **b == b'\n').count() + 1;
        let column = before.iter().rev().take_while(|b| **b != b'\n').count() + 1;
        error(
            line as u32,
            column as u32,
            "a byte that is not UTF-8: declare the encoding or save as UTF-8".to_owned(),
        )
    })
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<Cow<'_, str>, ReadError> {
    let units = bytes.chunks_exact(2).map(|c| unit([c[0], c[1]]));
    char::decode_utf16(units)
        .collect::<Result<String, _>>()
        .map(Cow::Owned)
        .map_err(|_| error(1, 1, "not valid UTF-16: save it as UTF-8".to_owned()))
}

fn error(line: u32, column: u32, message: String) -> ReadError {
    ReadError { line, column, message }
}
