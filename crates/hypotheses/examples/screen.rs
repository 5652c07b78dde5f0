//! Screens cases: `screen FOLDER..` prints what leads, what a refit makes of it, and how long each part took.

use std::time::Instant;

use trueup_hypotheses::baseline::Baseline;
use trueup_hypotheses::refit::refits;
use trueup_hypotheses::screen::screen;
use trueup_signals::Case;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    for folder in std::env::args().skip(1) {
        let (loaded, _) = Case::load(std::path::Path::new(&folder), |_| Ok(Vec::new()))?;
        let begun = Instant::now();
        let baseline = match Baseline::new(&loaded) {
            Ok(p) => p,
            Err(e) => {
                println!("{folder}: {e}");
                continue;
            }
        };
        let fitted = begun.elapsed().as_secs_f64();
        let share = [0, 1].map(|k| baseline.fit.latent[k].deviation / baseline.sizes.torques()[k]);
        let begun = Instant::now();
        let seen = screen(&baseline);
        let screened = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        let mut all: Vec<(String, f64, f64, [f64; 2])> = Vec::new();
        for r in refits(&baseline, &seen) {
            let left = [0, 1].map(|k| r.fit.latent[k].deviation / baseline.sizes.torques()[k]);
            let gain = r.fit.log_evidence - baseline.fit.log_evidence;
            all.push((r.seen.cause.label(), r.seen.gain, gain, left));
        }
        let refitted = begun.elapsed().as_secs_f64();
        println!("{folder}: latent {share:.4?} of torque; {fitted:.1} + {screened:.1} + {refitted:.1} s");
        for (label, screened, gain, left) in all {
            println!("    {label:32} {screened:10.1} -> {gain:10.1}   latent {left:.4?}");
        }
    }
    Ok(())
}
