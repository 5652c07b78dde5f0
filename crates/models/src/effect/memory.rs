//! A signal's recent past as a polynomial: what dead times and late sensors read from.
//!
//! The last W seconds of u are carried as Legendre coefficients x_i (Voelker et al. 2019; read at the far end it is
//! Pade's approximant of the delay): W dx_i/dt = (2i+1) ((-1)^i u - sum_j a_ij x_j), a_ij = 1 for i < j, else
//! (-1)^(i-j). At r = d/W of the window it reads sum_i P_i(2r - 1) x_i.
//!
//! With W^2 = d^2 + w^2 all depends smoothly on the delay d down to 0, where the signal itself is passed exactly: what
//! the polynomial lacks of the present is added, with the weight (w/W)^4.
//!
//! What it gets wrong: what changes within a third of the window is rounded off.

use super::{EffectScale, SearchRange};
use trueup_numerics::Scalar;

/// Number of coefficients.
pub(super) const ORDER: usize = 4;
/// w, s: shortest window.
const SHORTEST: f64 = 5e-3;

/// Size of a delay, s.
pub(super) const DELAY: EffectScale = EffectScale::plain(0.01);
/// Where a delay is looked for: one that is not small against the motion is not found from a distant start.
pub(super) const IN_A_DRIVE: SearchRange =
    SearchRange { looks: &[0.2, 1.0, 3.0, 7.0], most: 0.2, ..SearchRange::USUAL };
/// Cameras and links of a free-flyer are slower than a drive's wires.
pub(super) const ON_A_FREE_FLYER: SearchRange =
    SearchRange { looks: &[0.5, 3.0, 10.0, 30.0], most: 0.5, ..SearchRange::USUAL };

fn window<T: Scalar>(delay: T) -> T {
    (delay * delay + SHORTEST * SHORTEST).sqrt()
}

/// P_i(s), i < ORDER.
fn legendre<T: Scalar>(s: T) -> [T; ORDER] {
    let square = s * s;
    [T::one(), s, (square * 3.0 - 1.0) * 0.5, s * (square * 5.0 - 3.0) * 0.5]
}

/// The coefficients of a signal that has always been `u`.
pub(super) fn start<T: Scalar>(u: T, x: &mut [T]) {
    x[..ORDER].fill(T::zero());
    x[0] = u;
}

/// Their rates.
pub(super) fn rates<T: Scalar>(x: [T; ORDER], u: T, delay: T, dx: &mut [T]) {
    let w = window(delay);
    for (i, rate) in dx[..ORDER].iter_mut().enumerate() {
        let sign = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let past = (0..ORDER).fold(T::zero(), |sum, j| sum + x[j] * if i < j { 1.0 } else { sign(i - j) });
        *rate = (u * sign(i) - past) * (2 * i + 1) as f64 / w;
    }
}

/// The signal `delay` seconds ago; `u` is its present value.
pub(super) fn read<T: Scalar>(x: [T; ORDER], u: T, delay: T) -> T {
    let w = window(delay);
    let at = |r: T| legendre(r * 2.0 - 1.0).iter().zip(x).fold(T::zero(), |sum, (p, x)| sum + *p * x);
    let (past, present) = (at(delay / w), at(T::zero()));
    let weight = T::constant(SHORTEST) / w;
    past + (u - present) * weight.powi(4)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine through the memory against the sine itself, late by `delay`: largest error after the start.
    fn error(delay: f64, omega: f64) -> f64 {
        let (h, mut x, mut worst) = (2e-5, [0.0; ORDER], 0.0f64);
        start(0.0, &mut x);
        let n = (4.0 / omega * core::f64::consts::PI / h) as usize + (6.0 * delay / h) as usize;
        for k in 0..n {
            let t = k as f64 * h;
            let u = |t: f64| (omega * t).sin();
            let mut k1 = [0.0; ORDER];
            rates(x, u(t), delay, &mut k1);
            let mut k2 = [0.0; ORDER];
            rates(core::array::from_fn(|i| x[i] + 0.5 * h * k1[i]), u(t + 0.5 * h), delay, &mut k2);
            (0..ORDER).for_each(|i| x[i] += h * k2[i]);
            if k > n / 2 {
                let now = t + h;
                worst = worst.max((read(x, u(now), delay) - u(now - delay)).abs());
            }
        }
        worst
    }

    #[test]
    fn a_sine_comes_late_by_the_delay() {
        for (delay, omega) in [(0.0, 100.0), (1e-4, 40.0), (0.005, 40.0), (0.02, 40.0), (0.05, 20.0)] {
            // What is left out is of the size of the first coefficient that is left out, (omega W/2)^4 / (1 3 5 7).
            let within = (0.5 * omega * window(delay)).powi(4) / 105.0;
            let error = error(delay, omega);
            assert!(error < within, "{delay} s at {omega} rad/s: {error:e}, not {within:e}");
            assert!(delay > 0.0 || error < 1e-15);
        }
    }
}
