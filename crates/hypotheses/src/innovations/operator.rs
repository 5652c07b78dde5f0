//! Operators along a series that laws share.

use trueup_estimation::innovations::numeric::sign;

/// Dahl's operator of length `length` along `x`: dz = (1 - sign(dx) z) dx / length, from 0.
pub fn dahl(x: &[f64], length: f64) -> Vec<f64> {
    let mut z = 0.0;
    let mut out = Vec::with_capacity(x.len());
    out.push(0.0);
    for w in x.windows(2) {
        let u = (w[1] - w[0]) / length;
        let kept = (-u.abs()).exp();
        // (COL-1)
        z = if u > 0.0 { 1.0 - (1.0 - z) * kept } else { (1.0 + z) * kept - 1.0 };
        out.push(z);
    }
    out
}

/// Parts of a step in which a resonator is integrated.
const PARTS: u32 = 4;

/// u'' of u'' + 2 zeta w u' + w^2 u = -a from rest, `a` linear within the steps of `dt` s.
pub fn resonator(a: &[f64], dt: f64, w: f64, zeta: f64) -> Vec<f64> {
    let (mut u, mut v) = (0.0, 0.0);
    let h = dt / f64::from(PARTS);
    let mut out = Vec::with_capacity(a.len());
    for k in 0..a.len() {
        let next = a[(k + 1).min(a.len() - 1)];
        for part in 0..PARTS {
            let now = a[k] + (next - a[k]) * f64::from(part) / f64::from(PARTS);
            let acceleration = -now - 2.0 * zeta * w * v - w * w * u;
            if part == 0 {
                out.push(acceleration);
            }
            v += h * acceleration;
            u += h * v;
        }
    }
    out
}

/// u'' and u of u'' + 2 zeta w u' + w^2 u = -a from rest by the midpoint rule, `a` linear within the steps (each of its own length, s), which
/// are cut such that w h is below 1/8.
pub fn resonance(a: &[f64], steps: &[f64], w: f64, zeta: f64) -> (Vec<f64>, Vec<f64>) {
    let (mut u, mut v) = (0.0, 0.0);
    let acceleration = |drive: f64, u: f64, v: f64| -drive - 2.0 * zeta * w * v - w * w * u;
    let (mut accelerations, mut places) = (Vec::with_capacity(a.len()), Vec::with_capacity(a.len()));
    for (k, dt) in steps.iter().enumerate().take(a.len()) {
        accelerations.push(acceleration(a[k], u, v)); // (COL-16)
        places.push(u);
        let next = a[(k + 1).min(a.len() - 1)];
        let parts = 1.0 + (8.0 * w * dt).floor();
        let h = dt / parts;
        for part in 0..parts as usize {
            let drive = |x: f64| a[k] + (next - a[k]) * (part as f64 + x) / parts;
            let (um, vm) = (u + 0.5 * h * v, v + 0.5 * h * acceleration(drive(0.0), u, v));
            u += h * vm;
            v += h * acceleration(drive(0.5), um, vm);
        }
    }
    (accelerations, places)
}

/// Force of dry friction of level `level` that balances `torque` at rest: below `rest` in speed it takes as much of it as it
/// can.
pub fn balancing(speed: f64, torque: f64, level: f64, rest: f64) -> f64 {
    if speed.abs() < rest { -torque.clamp(-level, level) } else { -level * sign(speed) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dahls_operator_saturates_and_turns() {
        let there: Vec<f64> = (0..100).map(f64::from).collect();
        let z = dahl(&there, 5.0);
        assert!((z[5] - (1.0 - (-1.0f64).exp())).abs() < 1e-12);
        let back: Vec<f64> = there.iter().rev().copied().collect();
        assert!((dahl(&back, 5.0)[99] + 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_resonator_rings_with_its_frequency() {
        let mut kick = vec![0.0; 2000];
        kick[1] = 1.0;
        let u = resonator(&kick, 1e-3, 2.0 * std::f64::consts::PI * 10.0, 0.0);
        let turns = u.windows(2).skip(5).filter(|w| w[0] < 0.0 && w[1] >= 0.0).count();
        assert!((19..=20).contains(&turns), "{turns}");
    }

    /// The step response of a damped oscillator in closed form, over steps of two lengths. Checks COL-16.
    #[test]
    fn a_resonance_has_its_step_response() {
        let (w, zeta): (f64, f64) = (2.0 * std::f64::consts::PI, 0.1);
        let steps: Vec<f64> = (0..600).map(|k| if k % 2 == 0 { 2e-3 } else { 5e-3 }).collect();
        let (accelerations, places) = resonance(&vec![1.0; 600], &steps, w, zeta);
        let damped = w * (1.0 - zeta * zeta).sqrt();
        let mut t = 0.0;
        for (k, dt) in steps.iter().enumerate() {
            let (decay, ratio) = ((-zeta * w * t).exp(), zeta * w / damped);
            let place = -(1.0 - decay * ((damped * t).cos() + ratio * (damped * t).sin())) / (w * w);
            let acceleration = -decay * ((damped * t).cos() - ratio * (damped * t).sin());
            assert!((places[k] - place).abs() < 5e-3 / (w * w), "{k}: {}, {place}", places[k]);
            assert!(
                (accelerations[k] - acceleration).abs() < 1e-2,
                "{k}: {}, {acceleration}",
                accelerations[k]
            );
            t += dt;
        }
    }
}
