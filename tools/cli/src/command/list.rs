//! `trueup fmu list`

use crate::catalog;
use crate::error::CliError;
use crate::output::say;

pub(crate) fn run() -> Result<(), CliError> {
    let models: Vec<_> = catalog::models().collect();
    let mut out = String::from("Models\n");
    for m in &models {
        out += &format!("  {:<30}{}\n", m.name, m.description);
    }
    out += "\nPresets (--preset)\n";
    for m in &models {
        for (name, source) in catalog::preset_names(m.name) {
            out += &format!("  {name:<30}{}: {source}\n", m.name);
        }
    }
    out += "\nStructure (--structure NAME=VALUE)\n";
    for m in &models {
        for c in catalog::choices(m.name) {
            out += &format!("  {:<30}{}: {}: {}\n", c.name, m.name, c.text, c.range());
        }
    }
    out += "\nEffects (--effect)\n";
    for e in catalog::effects() {
        out += &format!("  {:<30}{} [{}]\n", e.id, e.description, e.models.join(", "));
        if !e.places.is_empty() {
            out += &format!("{:34}as {}:PLACE, PLACE one of {}\n", "", e.id, e.places.join(", "));
        }
    }
    say(&out)
}
