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
pub type WaveSplit<T> = [T; 4];

/// Largest ω h with which [`step`] may be used: it is stable up to ω h = 2.68, and leaves the continuous law
/// long before.
pub const LARGEST_STEP: f64 = 2.0;

/// The split that belongs to rest at θ0 = θ1 = `theta`: a0 = b0 = θ/2.
pub fn at_rest<T: Scalar>(theta: T) -> WaveSplit<T> {
    let half = theta * 0.5;
    [half, T::zero(), half, T::zero()]
}

/// Rates of the split of the motions `theta0` (actuator) and `theta1` (load); `omega` = ω in rad/s.
pub fn rates<T: Scalar>(s: &WaveSplit<T>, theta0: T, theta1: T, omega: T) -> WaveSplit<T> {
    let accelerate = |y: T, rate: T, u: T| omega * (omega * (u - y) - rate);
    let [b0, b0_rate, ga0, ga0_rate] = *s;
    [b0_rate, accelerate(b0, b0_rate, theta1 - ga0), ga0_rate, accelerate(ga0, ga0_rate, theta0 - b0)]
}

/// Sine, over √3, and cosine of G's free motion after `angle` = ω h.
fn free<T: Scalar>(angle: T) -> (T, T) {
    // ω_d = ω √3/2 and decay rate ω/2, as the damping ratio of G is 1/2.
    let root3 = 3f64.sqrt();
    let (sin, cos) = (angle * (root3 / 2.0)).sin_cos();
    let decay = (angle * -0.5).exp();
    (decay * sin / root3, decay * cos)
}

/// The split `h` seconds later when the input of each G is held: exact for each filter.
pub fn step<T: Scalar>(s: &WaveSplit<T>, theta0: T, theta1: T, omega: T, h: T) -> WaveSplit<T> {
    let (sin, cos) = free(omega * h);
    let advance = |y: T, rate: T, u: T| {
        let off = y - u;
        [u + off * (cos + sin) + rate * sin * 2.0 / omega, rate * (cos - sin) - off * omega * sin * 2.0]
    };
    let [b0, b0_rate, ga0, ga0_rate] = *s;
    let [b, b_rate] = advance(b0, b0_rate, theta1 - ga0);
    let [g, g_rate] = advance(ga0, ga0_rate, theta0 - b0);
    [b, b_rate, g, g_rate]
}

/// What a changing ω adds to [`rates`], with `growth` = ω'/ω in 1/s.
///
/// The difference of the two filters has no spring: d = b0 − G a0 obeys d'' = −ω² (θ0 − θ1) − ω d', an integral over
/// the twist that stays wherever it ends. Taken as d = ω D, d' = −ω² R with R' = θ0 − θ1 − ω R and D' = −ω R, D − R
/// integrates the twist and does not depend on ω: one that has come and gone leaves no offset behind. With ω inside the
/// integral, a change on the way would.
pub fn growth_rates<T: Scalar>(s: &WaveSplit<T>, growth: T) -> WaveSplit<T> {
    let [b0, b0_rate, ga0, ga0_rate] = *s;
    let (d, d_rate) = ((b0 - ga0) * growth * 0.5, (b0_rate - ga0_rate) * growth); // (CTL-15)
    [d, d_rate, -d, -d_rate]
}

/// The split as it goes on when `omega` has become `next` between two steps of `h` s, likewise.
///
/// [`step`] takes θ0 − θ1 times β off d + α d', so (d + α d')/β is the sum over the twist that a change leaves alone.
pub fn changed<T: Scalar>(s: &WaveSplit<T>, omega: T, next: T, h: T) -> WaveSplit<T> {
    let sum = |omega: T| {
        let (sin, cos) = free(omega * h);
        let (off, share) = (-cos + 1.0, -cos + 1.0 + sin);
        (sin * 2.0 / (omega * share), (off * off + sin * sin * 3.0) / share)
    };
    let ((alpha, beta), (alpha_next, beta_next)) = (sum(omega), sum(next));
    let [b0, b0_rate, ga0, ga0_rate] = *s;
    let (d, d_rate) = (b0 - ga0, b0_rate - ga0_rate);
    let rate = d_rate * (next / omega).powi(2);
    let half = ((d + d_rate * alpha) * beta_next / beta - rate * alpha_next - d) * 0.5; // (CTL-15)
    let half_rate = (rate - d_rate) * 0.5;
    [b0 + half, b0_rate + half_rate, ga0 - half, ga0_rate - half_rate]
}

/// The wave transfer function of an endless uniform chain of masses and springs, at s/ω >= 0:
/// G = 1 + x²/2 − x √(1 + x²/4), so that G + 1/G = 2 + x². The split's G has its value and slope at 0, not its
/// curvature.
pub fn exact_transfer<T: Scalar>(x: T) -> T {
    // The same as the square of (√(1 + x²/4) − x/2), written without cancellation.
    let half = x * 0.5;
    T::one() / (half + (half * half + 1.0).sqrt()).powi(2)
}
