//! The rotors of the motors: J* (S0 eq. 6, 11, 17-20), and the same for a rotor behind a gear.
//!
//! A rotor's kinetic energy is 1/2 I_m (sigma Omega + d(q_m)/dt)^2, Omega being the rate of the body that
//! carries it. As printed sigma = 1 (ARM-5). Behind a gear of ratio N the rotor turns at Omega + N d(q_m)/dt
//! with I_r = I_m/N^2, so sigma = 1/N (ARM-6).

use super::solve::Symmetric;
use trueup_numerics::Scalar;

/// Value of the parameter `motorCoupling`: as the paper prints it.
pub const PAPER: f64 = 1.0;
/// Value of the parameter `motorCoupling`: a rotor behind a gear.
pub const GEARED: f64 = 2.0;

/// How much of the carrier's rate the rotor's equation sees, sigma.
pub fn share<T: Scalar>(coupling: T, gear_ratio: T) -> T {
    if coupling.value() == GEARED { T::one() / gear_ratio } else { T::one() }
}

/// Adds the rotor of joint `joint` (from 0) to `m`; `row` is that of its angle q_m (of a rigid joint: of q),
/// q_0 is row 2.
pub fn add_inertia<T: Scalar>(m: &mut Symmetric<T>, joint: usize, row: usize, inertia: T, share: T) {
    let (once, twice) = (inertia * share, inertia * share * share);
    for a in 2..=2 + joint {
        m.add(row, a, once);
        for b in 2..=a {
            m.add(a, b, twice);
        }
    }
    m.add(row, row, inertia);
}
