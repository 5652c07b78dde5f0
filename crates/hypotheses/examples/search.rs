//! Searches cases: `search FOLDER..` prints a line of JSON for each, all that a verdict is made from, in nats.

use std::time::Instant;

use serde_json::{Value, json};
use trueup_estimation::fit::Fit;
use trueup_hypotheses::refit::Refitted;
use trueup_hypotheses::search::{Found, search};
use trueup_signals::Case;

#[allow(clippy::print_stdout)]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    for folder in std::env::args().skip(1) {
        let (loaded, _) = Case::load(std::path::Path::new(&folder), |_| Ok(Vec::new()))?;
        let begun = Instant::now();
        let found = search(&loaded);
        let seconds = begun.elapsed().as_secs_f64();
        let line = match found {
            Ok(f) => json!({ "case": folder, "s": seconds, "found": said(&f) }),
            Err(e) => json!({ "case": folder, "error": e.to_string() }),
        };
        println!("{line}");
    }
    Ok(())
}

fn said(f: &Found) -> Value {
    let torques = f.baseline.sizes.torques();
    let own = f.baseline.parametric.unknowns.len();
    let fit = |fit: &Fit| {
        let latent: Vec<f64> = fit.latent.iter().zip(torques).map(|(l, t)| l.deviation / t).collect();
        json!({ "L": fit.log_evidence, "latent": latent, "theta": fit.theta, "sd": fit.deviations })
    };
    let one = |r: &Refitted| json!({ "id": r.seen.cause.label(), "screen": r.seen.gain, "fit": fit(&r.fit) });
    let pair = |(k, r): &(usize, Refitted)| json!({ "first": k, "second": one(r) });
    json!({
        "own": own,
        "baseline": fit(&f.baseline.fit),
        "held": f.baseline.held.as_ref().map(fit),
        "doubted": f.doubted.as_ref().map(fit),
        "ideal": f.ideal,
        "singles": f.singles.iter().map(one).collect::<Vec<_>>(),
        "pairs": f.pairs.iter().map(pair).collect::<Vec<_>>(),
    })
}
