//! Numbers in a TOML text, changed in place; comments and order stay.

use std::ops::Range;
use std::path::Path;

use toml_edit::{Document, Item, TableLike, Value};
use trueup_cosim::InputMistake;
use trueup_cosim::system::SourceSpan;

use crate::error::ScalingError;
use crate::law::AffineScale;

/// A parsed text with its lines.
pub(crate) struct Parsed<'a> {
    file: &'a Path,
    text: &'a str,
    pub(crate) document: Document<String>,
}

impl<'a> Parsed<'a> {
    pub(crate) fn of(text: &'a str, file: &'a Path) -> Result<Self, ScalingError> {
        match Document::parse(text.to_owned()) {
            Ok(document) => Ok(Self { file, text, document }),
            Err(e) => {
                let place = place(file, text, e.span());
                Err(ScalingError::Mistakes(vec![InputMistake {
                    place,
                    message: e.message().replace('\n', "; "),
                }]))
            }
        }
    }

    pub(crate) fn place(&self, span: Option<Range<usize>>) -> SourceSpan {
        place(self.file, self.text, span)
    }
}

fn place(file: &Path, text: &str, span: Option<Range<usize>>) -> SourceSpan {
    SourceSpan::of(file, text, span.map_or(0, |s| s.start))
}

/// A number, whole or not.
pub(crate) fn number(value: &Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|n| n as f64))
}

/// A number, or a list of them.
pub(crate) fn is_numbers(value: &Value) -> bool {
    match value.as_array() {
        Some(list) => list.iter().all(is_numbers),
        None => number(value).is_some(),
    }
}

/// 0, or a list of that: the same at any size.
pub(crate) fn is_zero(value: &Value) -> bool {
    match value.as_array() {
        Some(list) => list.iter().all(is_zero),
        None => number(value) == Some(0.0),
    }
}

/// Scales a number or all numbers of a list; what surrounds them stays. Returns whether all of it was numbers.
pub(crate) fn scale(value: &mut Value, by: AffineScale) -> bool {
    if let Some(list) = value.as_array_mut() {
        return list.iter_mut().all(|v| scale(v, by));
    }
    let Some(x) = number(value) else { return false };
    if !by.is_one() {
        put(value, by.apply(x));
    }
    true
}

/// Another number in the same place.
pub(crate) fn put(value: &mut Value, x: f64) {
    let decor = value.decor().clone();
    *value = of(x);
    *value.decor_mut() = decor;
}

/// A number in as few characters as read back as the same bits: `2.916e-10`.
pub(crate) fn of(x: f64) -> Value {
    format!("{x:?}").parse().unwrap_or_else(|_| Value::from(x))
}

/// The value that a table has under this key.
pub(crate) fn value_mut<'t>(table: &'t mut dyn TableLike, key: &str) -> Option<&'t mut Value> {
    table.get_mut(key).and_then(Item::as_value_mut)
}
