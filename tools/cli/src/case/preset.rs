//! Which parameters a case leaves out.

use trueup_identification::model::Model;
use trueup_signals::{Case, base_name};

/// Names of the parameters that the case leaves out, of arrays that lack as a whole theirs. First states are found anyway.
pub(crate) fn left_out<'a>(model: &'a Model, case: &Case) -> Vec<&'a str> {
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
    names
}

/// `case.toml: left out, so of the preset (..): damping, linkMass[2]`; `None` if the case has all of them.
pub(super) fn line(model: &Model, case: &Case) -> Option<String> {
    let names = left_out(model, case);
    let preset = if model.joint().is_some() { "joint 1 of DELIAN" } else { "the CBK PAN test-bed" };
    (!names.is_empty()).then(|| {
        format!("{}: left out, so of the preset ({preset}): {}", case.file.display(), names.join(", "))
    })
}
