//! Searches cases: `search FOLDER..` prints a line of JSON for each.

use std::time::Instant;

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
        let took = begun.elapsed().as_secs_f64();
        match found {
            Ok(f) => println!("{}", line(&folder, took, &f)),
            Err(e) => println!("{{\"case\":\"{folder}\",\"error\":\"{e}\"}}"),
        }
    }
    Ok(())
}

fn line(folder: &str, took: f64, f: &Found) -> String {
    let torques = f.baseline.sizes.torques();
    let latent = |fit: &Fit| [0, 1].map(|k| fit.latent[k].deviation / torques[k]);
    let own = f.baseline.parametric.unknowns.len();
    let moved = |fit: &Fit| -> Vec<f64> {
        let of =
            |(u, t): (&trueup_estimation::unknown::Unknown, &f64)| (t - u.prior.mean) / u.prior.deviation;
        f.baseline.parametric.unknowns.iter().zip(&fit.theta).map(of).collect()
    };
    let one = |r: &Refitted| {
        format!(
            "{{\"id\":\"{}\",\"screen\":{:.1},\"L\":{:.2},\"latent\":{:.5?},\"moved\":{:.2?},\"theta\":{:.4?},\"sd\":{:.4?}}}",
            r.seen.cause.label(),
            r.seen.gain,
            r.fit.log_evidence,
            latent(&r.fit),
            moved(&r.fit),
            &r.fit.theta[own..],
            &r.fit.deviations[own..],
        )
    };
    let singles: Vec<String> = f.singles.iter().map(one).collect();
    let pairs: Vec<String> =
        f.pairs.iter().map(|(k, r)| format!("{{\"first\":{k},\"second\":{}}}", one(r))).collect();
    let base = &f.baseline.fit;
    let doubted = f.doubted.as_ref().map_or("null".to_owned(), |d| {
        format!("{{\"L\":{:.2},\"latent\":{:.5?},\"moved\":{:.2?}}}", d.log_evidence, latent(d), moved(d))
    });
    format!(
        "{{\"case\":\"{folder}\",\"s\":{took:.2},\"L0\":{:.2},\"latent\":{:.5?},\"moved\":{:.2?},\"held\":{:.2},\"doubted\":{doubted},\"ideal\":{:.2},\"singles\":[{}],\"pairs\":[{}]}}",
        base.log_evidence,
        latent(base),
        moved(base),
        f.baseline.held.as_ref().map_or(f64::NEG_INFINITY, |h| h.log_evidence).max(-1e15),
        f.ideal,
        singles.join(","),
        pairs.join(","),
    )
}
