//! Looks at cases from the inside.
#![allow(clippy::print_stdout, clippy::expect_used, missing_docs)]
use std::path::Path;
use std::time::Instant;
use trueup_diagnosis::engine::recordings::Prepared;
use trueup_diagnosis::engine::search::Search;
use trueup_diagnosis::engine::select::Effort;
use trueup_signals::Case;

fn main() {
    for folder in std::env::args().skip(1) {
        let begin = Instant::now();
        let (loaded, _) = match Case::load(Path::new(&folder), |_| Ok(Vec::new())) {
            Ok(l) => l,
            Err(e) => {
                println!("{folder}: {e}");
                continue;
            }
        };
        let case = match Prepared::new(&loaded) {
            Ok(c) => c,
            Err(e) => {
                println!("{folder}: {e}");
                continue;
            }
        };
        let mut search = Search::new(&case);
        let level: f64 = std::env::var("LEVEL").ok().and_then(|s| s.parse().ok()).unwrap_or(0.03);
        search.tune_to(&vec![level; case.coordinates.len()]);
        println!("== {folder}: read {:.2} s", begin.elapsed().as_secs_f64());
        match search.select(Effort::default(), |s| println!("   {s}")) {
            Ok(found) => {
                for f in found.sets.iter().take(7) {
                    println!(
                        "    {:50} excess {:8.4} prior2 {:8.1} evidence {:9.1}",
                        format!("{:?}", f.labels()),
                        f.excess(),
                        f.prior2,
                        f.evidence(1.0) - found.plain.evidence(1.0)
                    );
                }
                let b = &found.best;
                println!(
                    "  best {:?} {:?}  {:.1} s",
                    b.labels(),
                    b.stated
                        .unknowns
                        .iter()
                        .zip(&b.theta)
                        .map(|(u, x)| format!("{}={:.4e}", u.name, u.scale.value(*x).0))
                        .collect::<Vec<_>>(),
                    begin.elapsed().as_secs_f64()
                );
            }
            Err(e) => println!("  {e}"),
        }
    }
}
