//! Tables of keys in documents are those of the readers.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::{Path, PathBuf};

use trueup_signals::keys::{self, Keys};

fn path(page: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs").join(page)
}

/// A page below docs/.
pub(crate) fn document(page: &str) -> String {
    std::fs::read_to_string(path(page)).unwrap()
}

/// The table as the page has it, below its head.
fn rows(keys: &Keys) -> String {
    let row =
        |k: &keys::CaseFileKey| format!("| `{}` | {} | {} | {} |\n", k.name, k.meaning, k.unit, k.default);
    keys.list.iter().map(row).collect::<String>().replace("|  |", "| |")
}

/// Lines of the rows of each table below a `<!-- keys of: NAME -->`.
fn told(document: &str) -> BTreeMap<String, Range<usize>> {
    let mark = "<!-- keys of: ";
    let of = |(at, _): (usize, &str)| {
        let (name, rest) = document[at + mark.len()..].split_once(" -->").unwrap();
        let table = rest.trim_start();
        let lines = || table.split_inclusive('\n').take_while(|l| l.starts_with('|'));
        let begin = document.len() - table.len();
        let length = |n: usize| lines().take(n).map(str::len).sum::<usize>();
        (name.to_owned(), begin + length(2)..begin + length(usize::MAX))
    };
    document.match_indices(mark).map(of).collect()
}

/// Every table of the reader is in the page, and no other; `TRUEUP_BLESS=1` writes the tables again.
pub(crate) fn compare(page: &str, all: &[Keys]) {
    let (mut document, there) = (document(page), told(&document(page)));
    let tables: BTreeSet<_> = all.iter().map(|k| k.of).collect();
    assert_eq!(tables.len(), all.len(), "each table once");
    assert_eq!(
        tables.into_iter().collect::<Vec<_>>(),
        there.keys().collect::<Vec<_>>(),
        "tables of the reader, then those of docs/{page}"
    );
    if std::env::var_os("TRUEUP_BLESS").is_some() {
        for keys in all {
            let range = told(&document).remove(keys.of).unwrap();
            document.replace_range(range, &rows(keys));
        }
        std::fs::write(path(page), document).unwrap();
        return;
    }
    for keys in all {
        assert_eq!(
            document[there[keys.of].clone()],
            rows(keys),
            "docs/{page}, keys of {}: TRUEUP_BLESS=1 writes them again",
            keys.of
        );
    }
}

#[test]
fn the_rows_of_a_table_are_found() {
    let text = "<!-- keys of: a -->\n\n| key | m |\n|---|---|\n| `x` | 1 |\n| `y` | 2 |\n\n<!-- keys of: b -->\n| k |\n|---|\n| `z` |";
    let found: Vec<_> = told(text).into_values().map(|range| &text[range]).collect();
    assert_eq!(found, ["| `x` | 1 |\n| `y` | 2 |\n", "| `z` |"]);
}
