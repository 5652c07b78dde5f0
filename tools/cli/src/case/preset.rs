//! Which parameters a case leaves out, in one line.

use trueup_identification::model::Model;
use trueup_signals::{Case, base_name};

/// `case.toml: damping, linkMass[2] ... are those of the preset`; `None` if the case has all of them. First states are found
/// anyway.
pub(super) fn left_out(model: &Model, case: &Case) -> Option<String> {
    let all: Vec<&str> = model.parameters().iter().map(|q| q.name.as_str()).collect();
    let missing = |name: &&str| !name.starts_with("initial") && !case.parameters.contains_key(*name);
    let whole = |base: &str| all.iter().filter(|n| base_name(n) == base).all(&missing);
    let mut names: Vec<&str> = Vec::new();
    for name in all.iter().filter(|n| missing(n)) {
        let base = base_name(name);
        let shown = if whole(base) { base } else { name };
        if !names.contains(&shown) {
            names.push(shown);
        }
    }
    let preset = if model.joint().is_some() { "joint 1 of DELIAN" } else { "the CBK PAN test-bed" };
    (!names.is_empty()).then(|| {
        format!("{}: left out, so of the preset ({preset}): {}", case.file.display(), names.join(", "))
    })
}
