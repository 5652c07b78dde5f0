//! A quantised reading as an interval: the motion was within this count.
//!
//! With a reading y of step w and an error of standard deviation s before the sensor counts, P(y | m) =
//! Phi((y + w/2 - m)/s) - Phi((y - w/2 - m)/s) for a prediction m. As a residual for least squares:
//! r^2 / 2 = ln P(y | y) - ln P(y | m), with the sign of m - y. Within the count r is nearly 0, without information; beyond its edges it grows as
//! the distance over s. The edges are the information of a coarse encoder, and their errors are not those of a white noise of
//! w / sqrt(12).

use statrs::function::erf::erfc;

/// Slacks in counts that are tried, one after the other.
pub(crate) const SLACKS: [f64; 4] = [0.3, 0.1, 0.05, 0.025];

/// A motion so many times the slack inside both edges fits as well as the middle does, to the last digit.
const INNER: f64 = 8.0;

/// -ln P(y | y): what the residual leaves out of the likelihood.
pub(crate) fn least(step: f64, slack: f64) -> f64 {
    -(-2.0 * ln_tail(0.5 * step / slack).exp()).ln_1p()
}

/// ln of the upper tail of the normal distribution.
fn ln_tail(z: f64) -> f64 {
    if z < 30.0 {
        (0.5 * erfc(z / std::f64::consts::SQRT_2)).ln()
    } else {
        -0.5 * z * z - (z * (2.0 * std::f64::consts::PI).sqrt()).ln() - 1.0 / (z * z)
    }
}

fn ln_density(z: f64) -> f64 {
    -0.5 * z * z - 0.5 * (2.0 * std::f64::consts::PI).ln()
}

/// Residual and its derivative by the prediction; `off` is prediction less reading, `step` one count, `slack` s.
pub(crate) fn residual(off: f64, step: f64, slack: f64) -> (f64, f64) {
    let h = 0.5 * step / slack;
    if off.abs() < (h - INNER) * slack {
        return (0.0, 0.0);
    }
    let ln_p = |a: f64, b: f64| {
        // Phi(b) - Phi(a): from the tail in which both are, else 1 less the two tails.
        if a > 0.0 {
            let (near, far) = (ln_tail(a), ln_tail(b));
            near + (-(far - near).exp()).ln_1p()
        } else {
            (-(ln_tail(-a).exp() + ln_tail(b).exp())).max(-1.0).ln_1p()
        }
    };
    let d = off.abs() / slack;
    let (a, b) = (d - h, d + h);
    let best = (1.0 - 2.0 * ln_tail(h).exp()).ln();
    let p = ln_p(a, b);
    let r = (2.0 * (best - p)).max(0.0).sqrt();
    let slope = if r > 1e-6 {
        ((ln_density(a) - p).exp() - (ln_density(b) - p).exp()) / r
    } else {
        (2.0 * h * (ln_density(h) - best).exp()).sqrt()
    };
    (r * off.signum(), slope / slack)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_the_derivative() {
        for slack in [0.03, 0.1, 0.5, 3.0] {
            for off in [-4.0, -0.7, -0.5, -0.3, -0.1, 0.05, 0.2, 0.49, 0.51, 0.9, 2.0, 30.0] {
                let eps = 1e-6 * slack;
                let difference =
                    (residual(off + eps, 1.0, slack).0 - residual(off - eps, 1.0, slack).0) / (2.0 * eps);
                let (r, slope) = residual(off, 1.0, slack);
                assert!(
                    (slope - difference).abs() < 1e-3 * difference.abs() + 1e-3,
                    "{off} {slack}: {r} {slope} {difference}"
                );
            }
        }
    }

    #[test]
    fn a_coarse_slack_is_a_normal_error() {
        let (r, _) = residual(2.0, 0.1, 5.0);
        let sigma = 5f64.hypot(0.1 / 12f64.sqrt());
        assert!((r - 2.0 / sigma).abs() < 1e-6, "{r}");
    }
}
