//! Instants at which a sampled law is evaluated: k times its period, whatever steps lead there.

const LOW_BITS: u32 = 30;

/// A time short of a sample instant by this share of the period counts as that instant: what adding up a
/// step, again and again, makes of k T_s.
const EARLY: f64 = 1e-6;

/// The last sample instant at or before `t` is this times `period`.
pub(crate) fn last_sample(t: f64, period: f64) -> f64 {
    (t / period + EARLY).floor()
}

/// The number of the next sample, kept in two modes: its high and its low part.
pub(crate) fn next_sample(modes: &[i32]) -> f64 {
    f64::from(modes[0]) * f64::from(1u32 << LOW_BITS) + f64::from(modes[1])
}

/// Whether a sample is due at `t`; with a period of 0 there are none. In between the outputs of the last sample are held.
pub(crate) fn is_due(t: f64, period: f64, modes: &[i32]) -> bool {
    period > 0.0 && last_sample(t, period) >= next_sample(modes)
}

/// Keeps that number.
pub(crate) fn set_next_sample(modes: &mut [i32], number: f64) {
    let high = (number / f64::from(1u32 << LOW_BITS)).floor();
    modes[0] = high as i32;
    modes[1] = (number - high * f64::from(1u32 << LOW_BITS)) as i32;
}
