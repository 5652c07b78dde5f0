//! Rust source as the rules see it: code without comments, literals and test modules.

use std::collections::HashMap;
use std::sync::{Arc, Mutex};

use super::File;

/// A source file taken apart. Both texts have the lines of the file.
pub(crate) struct Source {
    /// Code alone; comments, literals and `#[cfg(test)]` modules are blank.
    pub(crate) code: String,
    /// The content of string literals outside test modules; everything else is blank.
    pub(crate) literals: String,
}

/// The file holds nothing that is built into a library or program.
pub(crate) fn is_test_file(path: &str) -> bool {
    path.split('/').any(|part| ["tests", "examples", "benches"].contains(&part))
        || path.ends_with("/tests.rs")
        || path.ends_with("/build.rs")
}

impl Source {
    /// Taken apart once for all rules.
    pub(crate) fn of(file: &File) -> Arc<Self> {
        static KNOWN: Mutex<Option<HashMap<String, Arc<Source>>>> = Mutex::new(None);
        let mut known = KNOWN.lock().expect("no rule panics here");
        let known = known.get_or_insert_default();
        known.entry(file.text.clone()).or_insert_with(|| Arc::new(Self::take_apart(&file.text))).clone()
    }
    fn take_apart(text: &str) -> Self {
        let (code, literals) = split(text);
        let tests = test_modules(&code);
        let without = |text: String| {
            let inside = |i: usize| tests.iter().any(|t| t.contains(&i));
            text.bytes()
                .enumerate()
                .map(|(i, b)| if inside(i) && b != b'\n' { ' ' } else { b as char })
                .collect()
        };
        Self { code: without(code), literals: without(literals) }
    }
    /// 1-based lines of the code on which `word` is a word.
    pub(crate) fn lines_with(&self, word: &str) -> Vec<usize> {
        let part_of_word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
        let on = |line: &str| {
            line.match_indices(word).any(|(i, w)| {
                !part_of_word(line[..i].chars().next_back())
                    && (word.ends_with('!') || !part_of_word(line[i + w.len()..].chars().next()))
            })
        };
        self.code.lines().enumerate().filter(|(_, l)| on(l)).map(|(i, _)| i + 1).collect()
    }
}

/// Code alone, test modules too; comments and literals are blank.
pub(crate) fn code_of(file: &File) -> String {
    split(&file.text).0
}

/// Code and string literals; non-ASCII bytes become blanks, so that positions stay.
fn split(text: &str) -> (String, String) {
    let b = text.as_bytes();
    let (mut code, mut literals) = (vec![b' '; b.len()], vec![b' '; b.len()]);
    let at = |i: usize, s: &str| b[i..].starts_with(s.as_bytes());
    let mut i = 0;
    while i < b.len() {
        let end = if at(i, "//") {
            b[i..].iter().position(|c| *c == b'\n').map_or(b.len(), |n| i + n)
        } else if at(i, "/*") {
            block_comment_end(b, i)
        } else if let Some((open, close)) = string(b, i) {
            literals[open..close].copy_from_slice(&b[open..close]);
            close + 1
        } else if b[i] == b'\'' && (b.get(i + 1) == Some(&b'\\') || b.get(i + 2) == Some(&b'\'')) {
            let from = i + if b[i + 1] == b'\\' { 3 } else { 2 };
            b[from..].iter().position(|c| *c == b'\'').map_or(b.len(), |n| from + n + 1)
        } else {
            code[i] = if b[i].is_ascii() { b[i] } else { b' ' };
            i + 1
        };
        for k in i..end.min(b.len()) {
            if b[k] == b'\n' {
                (code[k], literals[k]) = (b'\n', b'\n');
            }
        }
        i = end;
    }
    let text = |v: Vec<u8>| v.iter().map(|c| if c.is_ascii() { *c as char } else { ' ' }).collect();
    (text(code), text(literals))
}

fn block_comment_end(b: &[u8], start: usize) -> usize {
    let (mut depth, mut i) = (0, start);
    while i < b.len() {
        if b[i..].starts_with(b"/*") {
            (depth, i) = (depth + 1, i + 2);
        } else if b[i..].starts_with(b"*/") {
            (depth, i) = (depth - 1, i + 2);
            if depth == 0 {
                return i;
            }
        } else {
            i += 1;
        }
    }
    b.len()
}

/// Where the content of a string literal that begins at `i` begins and ends.
fn string(b: &[u8], i: usize) -> Option<(usize, usize)> {
    let part_of_word = i > 0 && (b[i - 1].is_ascii_alphanumeric() || b[i - 1] == b'_');
    if b[i] == b'r' && (!part_of_word || (b[i - 1] == b'b' || b[i - 1] == b'c')) {
        let hashes = b[i + 1..].iter().take_while(|c| **c == b'#').count();
        let open = i + 1 + hashes;
        if b.get(open) != Some(&b'"') {
            return None;
        }
        let close = [b"\"".as_slice(), &vec![b'#'; hashes]].concat();
        let length = b[open + 1..].windows(close.len()).position(|w| w == close);
        // The hashes after the closing quote pass as code, which does no harm.
        return Some((open + 1, length.map_or(b.len() - 1, |n| open + 1 + n)));
    }
    if b[i] != b'"' {
        return None;
    }
    let mut k = i + 1;
    while k < b.len() && b[k] != b'"' {
        k += if b[k] == b'\\' { 2 } else { 1 };
    }
    Some((i + 1, k.min(b.len() - 1)))
}

/// Byte ranges of the modules under `#[cfg(test)]`.
fn test_modules(code: &str) -> Vec<core::ops::Range<usize>> {
    let mut ranges = Vec::new();
    for (start, attribute) in code.match_indices("#[cfg(test)]") {
        let after = start + attribute.len();
        let Some(open) = code[after..].find(['{', ';']).map(|n| after + n) else { continue };
        let (mut depth, mut end) = (0, open + 1);
        for (k, c) in code[open..].char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
            if depth == 0 {
                end = open + k + 1;
                break;
            }
        }
        ranges.push(start..end);
    }
    ranges
}

#[test]
fn comments_literals_and_test_modules_are_told_apart() {
    let text = r##"
//! println! in a comment /* "
let a = "unsafe \" /home/x"; let q = '"'; let n = '\''; fn f<'a>() {} /* println! /* */ "*/ unsafe {}
let b = r#"a "quoted" path"#;
#[cfg(test)]
mod tests { fn g() { println!("}"); } }
fn after() { eprint!("/home/y"); my_print!(); }
"##;
    let s = Source::of(&File { path: "x.rs".into(), text: text.into() });
    assert_eq!(s.lines_with("println!"), [0usize; 0]);
    assert_eq!(s.lines_with("unsafe"), [3]);
    assert_eq!(s.lines_with("eprint!"), [7]);
    assert_eq!(s.lines_with("print!"), [0usize; 0]);
    let literal = |line: usize| s.literals.lines().nth(line - 1).unwrap().trim();
    assert_eq!(literal(3), r#"unsafe \" /home/x"#);
    assert_eq!(literal(4), r#"a "quoted" path"#);
    assert_eq!((literal(6), literal(7)), ("", "/home/y"));
    assert!(is_test_file("crates/a/tests/b.rs") && is_test_file("crates/a/src/b/tests.rs"));
    assert!(!is_test_file("crates/a/src/contests.rs"));
}
