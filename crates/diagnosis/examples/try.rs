//! Looks at cases from the inside.
#![allow(clippy::print_stdout, missing_docs)]
use std::path::Path;
use std::time::Instant;
use trueup_diagnosis::diagnose::{Options, diagnose};
use trueup_signals::Case;

fn main() {
    let verbose = std::env::var("VERBOSE").is_ok();
    for folder in std::env::args().skip(1) {
        let begin = Instant::now();
        let loaded = match Case::load(Path::new(&folder), |_| Ok(Vec::new())) {
            Ok((l, _)) => l,
            Err(e) => {
                println!("{folder}: {e}");
                continue;
            }
        };
        let mut options = Options::default();
        if let Some(level) = std::env::var("LEVEL").ok().and_then(|s| s.parse().ok()) {
            options.index = level;
        }
        let found = diagnose(&loaded, &options, &mut |_, what| {
            if verbose {
                println!("   {what}");
            }
        });
        match found {
            Ok(d) => {
                let d = d.diagnosis;
                let effects: Vec<String> = d
                    .effects
                    .iter()
                    .map(|e| format!("{}({}{:?}) p={:.3}", e.id, e.component, e.joint, e.probability))
                    .collect();
                let gap = d.gap.overall.as_ref();
                println!(
                    "{folder}: {:?} {effects:?} before {:.4} tuned {:.4} after {:.4} floor {:.4} closed {:?} unknown {:.2} ({:.1} s)",
                    d.verdict,
                    gap.map_or(f64::NAN, |g| g.before),
                    gap.map_or(f64::NAN, |g| g.tuned),
                    gap.map_or(f64::NAN, |g| g.after),
                    gap.map_or(f64::NAN, |g| g.floor),
                    gap.and_then(|g| g.closed),
                    d.unknown.probability,
                    begin.elapsed().as_secs_f64()
                );
                if verbose {
                    for c in d.candidates.iter().take(8) {
                        println!(
                            "      {:28} {:20} {:?} p {:.3} evidence {:.1}",
                            c.id, c.component, c.joint, c.probability, c.evidence
                        );
                    }
                    println!("      {:?}", d.location);
                    println!("      {:?}", d.parameters);
                }
            }
            Err(e) => println!("{folder}: {e}"),
        }
    }
}
