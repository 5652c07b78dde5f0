//! What the examples of both engines do with the folders of cases.

use serde_json::{Value, json};

/// Stages of a case, or why there are none.
pub(crate) type Said = Result<Value, Box<dyn std::error::Error>>;

/// Prints the stages of each folder that is named, a line each.
#[allow(clippy::print_stdout)]
pub(crate) fn print_each(stages: fn(&str) -> Said) {
    for folder in std::env::args().skip(1) {
        let said = stages(&folder).unwrap_or_else(|e| json!({ "error": e.to_string() }));
        println!("{}", json!({ "case": folder, "stages": said }));
    }
}
