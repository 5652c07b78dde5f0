//! Screens cases: `screen FOLDER..` prints what leads, what a refit makes of it, and how long each part took.

use std::time::Instant;

use trueup_hypotheses::baseline::Baseline;
use trueup_hypotheses::refit::refit;
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
        for s in seen.iter().take(6) {
            let fit = refit(&baseline, s);
            let gain = fit.as_ref().map_or(f64::NEG_INFINITY, |f| f.log_evidence - baseline.fit.log_evidence);
            let left = fit.map_or([f64::NAN; 2], |f| {
                [0, 1].map(|k| f.latent[k].deviation / baseline.sizes.torques()[k])
            });
            all.push((s.cause.label(), s.gain, gain, left));
        }
        let refitted = begun.elapsed().as_secs_f64();
        all.sort_by(|a, b| b.2.total_cmp(&a.2));
        println!("{folder}: latent {share:.4?} of torque; {fitted:.1} + {screened:.1} + {refitted:.1} s");
        for (label, screened, gain, left) in all {
            println!("    {label:32} {screened:10.1} -> {gain:10.1}   latent {left:.4?}");
        }
    }
    Ok(())
}
