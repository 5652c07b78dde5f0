//! How long a fit of long recordings will take, reported before it begins.

use std::time::Instant;

use crate::lsq::LeastSquares;
use crate::output_error::OutputError;
use crate::run::IdentificationRun;

/// Readings from which on it is made.
const LONG: usize = 200_000;
/// s: what takes less with its derivatives is not worth a word.
const SHORT: f64 = 0.5;

/// Times one simulation with derivatives. Nothing is reported where recordings are short, or cannot be simulated (which the fit reports).
pub(super) fn tell(problem: &OutputError, progress: &dyn Fn(&str)) {
    let readings: usize = problem.runs().iter().map(IdentificationRun::len).sum();
    if readings < LONG {
        return;
    }
    progress(&format!("timing one simulation of {readings} readings"));
    let begun = Instant::now();
    let simulated = problem.evaluate(&problem.start(), true).is_ok();
    let seconds = begun.elapsed().as_secs_f64();
    if simulated && seconds >= SHORT {
        progress(&format!(
            "one simulation of {readings} readings with its derivatives takes {seconds:.1} s here; a fit takes dozens of them, with \
             profiles hundreds ({:.0} s for a hundred); for less record at a lower rate, leave recordings out of `train`, give --fast, \
             or end it by --deadline",
            100.0 * seconds
        ));
    }
}
