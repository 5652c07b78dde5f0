//! Joints that move and do not turn the base (CTS-12).

use super::super::MAX_BODIES;
use super::super::measures::DEPENDENT;
use arrayvec::ArrayVec;
use trueup_numerics::Scalar;

/// Rates of all joints, or what multiplies them.
pub(super) type JointRow<T> = [T; MAX_BODIES];

pub(super) fn along<T: Scalar>(a: &JointRow<T>, b: &JointRow<T>) -> T {
    a.iter().zip(b).fold(T::zero(), |sum, (a, b)| sum + *a * *b)
}

/// What of `row` is across all of `kept`, which are orthonormal; twice, for rounding's sake.
fn across<T: Scalar>(kept: &[JointRow<T>], mut row: JointRow<T>) -> JointRow<T> {
    for _ in 0..2 {
        for k in kept {
            let share = along(k, &row);
            row.iter_mut().zip(k).for_each(|(r, k)| *r -= share * *k);
        }
    }
    row
}

/// Of those rows the one with the longest part across `kept`, that part, and its square.
fn longest<T: Scalar>(
    kept: &[JointRow<T>],
    rows: impl Iterator<Item = JointRow<T>>,
) -> Option<(usize, JointRow<T>, T)> {
    let rest = rows.map(|r| across(kept, r));
    let measured = rest.enumerate().map(|(i, r)| (i, r, along(&r, &r)));
    measured.max_by(|a, b| a.2.value().total_cmp(&b.2.value()))
}

/// The rates of joint `j` alone.
pub(super) fn axis<T: Scalar>(j: usize) -> JointRow<T> {
    core::array::from_fn(|k| if k == j { T::one() } else { T::zero() })
}

/// Changes `rates` by as little as makes `turning` times them `wanted`, and puts into `kept`, which is empty, an orthonormal basis of the
/// rates of the `n` joints for which `turning` gives 0 (CTS-12). Rows of `turning` that depend on the others are left out.
#[inline(never)] // arrays for the largest robot do not add up on the stack
pub(super) fn not_turning<T: Scalar>(
    turning: &[JointRow<T>; 3],
    wanted: [T; 3],
    rates: &mut JointRow<T>,
    n: usize,
    kept: &mut ArrayVec<JointRow<T>, MAX_BODIES>,
) {
    let size = turning.iter().map(|r| along(r, r).value()).fold(0.0, f64::max);
    let missing: [T; 3] = core::array::from_fn(|i| wanted[i] - along(&turning[i], rates));
    let mut more = [T::zero(); MAX_BODIES];
    while kept.len() < n.min(3) {
        let Some((i, rest, square)) = longest(kept, turning.iter().copied()) else { break };
        if square.value() <= DEPENDENT * size {
            break;
        }
        let length = square.sqrt();
        let share = (missing[i] - along(&turning[i], &more)) / length;
        let unit = rest.map(|r| r / length);
        more.iter_mut().zip(&unit).for_each(|(m, u)| *m += share * *u); // (CTS-12)
        kept.push(unit);
    }
    rates.iter_mut().zip(&more).for_each(|(r, m)| *r += *m);
    let turns = kept.len();
    while kept.len() < n {
        let Some((_, rest, square)) = longest(kept, (0..n).map(axis)) else { break };
        let length = square.sqrt();
        kept.push(rest.map(|r| r / length));
    }
    kept.drain(..turns);
}
