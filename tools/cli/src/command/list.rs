//! `trueup fmu list`

use crate::catalog;
use crate::error::Error;

pub(crate) fn run() -> Result<(), Error> {
    let models: Vec<_> = catalog::models().collect();
    println!("Models");
    for m in &models {
        println!("  {:<30}{}", m.name, m.description);
    }
    println!("\nPresets (--preset)");
    for p in models.iter().flat_map(|m| catalog::presets(m.name)) {
        println!("  {:<30}{}: {}", p.name, p.model, p.source);
    }
    println!("\nEffects (--effect)");
    let mut listed: Vec<catalog::Effect> = Vec::new();
    for e in models.iter().flat_map(|m| catalog::effects(m.name)) {
        match listed.iter_mut().find(|l| l.id == e.id) {
            Some(l) => l.models.extend(e.models),
            None => listed.push(e),
        }
    }
    for e in &listed {
        println!("  {:<30}{} [{}]", e.id, e.description, e.models.join(", "));
    }
    Ok(())
}
