//! Launch and return waves: the split of a motion at the actuator (S3 eq. 10, 11).
//!
//! The motion θ0 of the actuator is the launch wave a0 plus the return wave b0; a mass further on sees the
//! launch wave through the wave transfer function G, and the return wave reaches the actuator through G:
//!
//! ```text
//! a0 = θ0 − b0,   b0 = G (θ1 − G a0)     (CTL-3)
//! G = ω²/(s² + ω s + ω²)                  (CTL-2)
//! ```
//!
//! Both filters are strictly proper: there is no algebraic loop.

use trueup_numerics::Scalar;

/// States of the split: b0, its rate, G a0, its rate.
pub type Split<T> = [T; 4];

/// Largest ω h with which [`step`] may be used: it is stable up to ω h = 2.68, and leaves the continuous law
/// long before.
pub const LARGEST_STEP: f64 = 2.0;

/// The split that belongs to rest at θ0 = θ1 = `theta`: a0 = b0 = θ/2.
pub fn at_rest<T: Scalar>(theta: T) -> Split<T> {
    let half = theta * 0.5;
    [half, T::zero(), half, T::zero()]
}

/// Rates of the split of the motions `theta0` (actuator) and `theta1` (load); `omega` = ω in rad/s.
pub fn rates<T: Scalar>(s: &Split<T>, theta0: T, theta1: T, omega: T) -> Split<T> {
    let accelerate = |y: T, rate: T, u: T| omega * (omega * (u - y) - rate);
    let [b0, b0_rate, ga0, ga0_rate] = *s;
    [b0_rate, accelerate(b0, b0_rate, theta1 - ga0), ga0_rate, accelerate(ga0, ga0_rate, theta0 - b0)]
}

/// The split `h` seconds later when the input of each G is held: exact for each filter.
pub fn step<T: Scalar>(s: &Split<T>, theta0: T, theta1: T, omega: T, h: T) -> Split<T> {
    // ω_d = ω √3/2 and decay rate ω/2, as the damping ratio of G is 1/2.
    let root3 = 3f64.sqrt();
    let (sin, cos) = (omega * h * (root3 / 2.0)).sin_cos();
    let decay = (omega * h * -0.5).exp();
    let (sin, cos) = (decay * sin / root3, decay * cos);
    let advance = |y: T, rate: T, u: T| {
        let off = y - u;
        [u + off * (cos + sin) + rate * sin * 2.0 / omega, rate * (cos - sin) - off * omega * sin * 2.0]
    };
    let [b0, b0_rate, ga0, ga0_rate] = *s;
    let [b, b_rate] = advance(b0, b0_rate, theta1 - ga0);
    let [g, g_rate] = advance(ga0, ga0_rate, theta0 - b0);
    [b, b_rate, g, g_rate]
}

/// The wave transfer function of an endless uniform chain of masses and springs, at s/ω >= 0:
/// G = 1 + x²/2 − x √(1 + x²/4), so that G + 1/G = 2 + x². The split's G has its value and slope at 0, not its
/// curvature.
pub fn exact_transfer<T: Scalar>(x: T) -> T {
    // The same as the square of (√(1 + x²/4) − x/2), written without cancellation.
    let half = x * 0.5;
    T::one() / (half + (half * half + 1.0).sqrt()).powi(2)
}
