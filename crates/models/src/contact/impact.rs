//! One impact under the law of [`law`](super::law) in closed form: two masses on a line, and the effective masses in an oblique impact of two
//! bodies.

use super::frame::{ContactVector, cross};
use trueup_numerics::Scalar;

/// A central impact: reduced mass mu in kg, k in N/m, eta_n in N.s/m, approach v in m/s.
#[derive(Clone, Copy, Debug)]
pub struct Impact {
    /// mu = m_1 m_2 / (m_1 + m_2).
    pub mass: f64,
    /// k.
    pub stiffness: f64,
    /// eta_n.
    pub damping: f64,
    /// v.
    pub speed: f64,
}

impl Impact {
    /// omega = sqrt(k/mu) in rad/s.
    pub fn frequency(&self) -> f64 {
        (self.stiffness / self.mass).sqrt()
    }
    /// zeta = eta_n / (2 sqrt(k mu)).
    pub fn damping_ratio(&self) -> f64 {
        self.damping / (2.0 * (self.stiffness * self.mass).sqrt()) // (CON-4)
    }
    /// acos(zeta)/sqrt(1 - zeta^2), continued to zeta >= 1: omega times the time of compression.
    fn phase(&self) -> f64 {
        let zeta = self.damping_ratio();
        let s = 1.0 - zeta * zeta;
        if s > 1e-8 {
            zeta.acos() / s.sqrt()
        } else if s < -1e-8 {
            zeta.acosh() / (-s).sqrt()
        } else {
            // About zeta = 1: acos(zeta)/sqrt(1 - zeta^2) = 1 + s/6 + ..
            1.0 + s / 6.0
        }
    }
    /// From contact to rest, s.
    pub fn compression(&self) -> f64 {
        self.phase() / self.frequency() // (CON-4)
    }
    /// From rest to release, s.
    pub fn restitution_time(&self) -> f64 {
        core::f64::consts::FRAC_PI_2 / self.frequency() // (CON-4)
    }
    /// e: speed of parting over speed of approach; no speed changes it.
    pub fn restitution(&self) -> f64 {
        (-self.damping_ratio() * self.phase()).exp() // (CON-4)
    }
    /// delta_max in m.
    pub fn deepest(&self) -> f64 {
        self.speed * self.restitution() / self.frequency() // (CON-4)
    }
    /// Energy lost in J.
    pub fn loss(&self) -> f64 {
        let e = self.restitution();
        (1.0 - e * e) * self.mass * self.speed * self.speed * 0.5 // (CON-4)
    }
    /// Largest force in N: before rest, or at the onset where zeta is 1/2 and above.
    pub fn largest_force(&self) -> f64 {
        let zeta = self.damping_ratio();
        if zeta >= 0.5 {
            return self.damping * self.speed;
        }
        let phase = (3.0 * zeta.acos() - core::f64::consts::PI) / (1.0 - zeta * zeta).sqrt();
        self.mass * self.speed * self.frequency() * (-zeta * phase).exp() // (CON-4)
    }
}

/// 1/mu in 1/kg that one body adds to an oblique contact: its mass, its inertia about its centre of mass, the contact from there,
/// the normal.
pub fn mobility<T: Scalar>(mass: T, inertia: T, r: ContactVector<T>, normal: ContactVector<T>) -> T {
    let lever = cross(r, normal);
    T::one() / mass + lever * lever / inertia // (CON-5)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIM2: Impact = Impact {
        mass: 1778.7 * 7900.0 / (1778.7 + 7900.0),
        stiffness: 20000.0,
        damping: 900.0,
        speed: 0.005,
    };
    const S: f64 = 0.3;
    const SIM3: Impact = Impact {
        mass: SIM2.mass * S * S * S,
        stiffness: SIM2.stiffness * S,
        damping: SIM2.damping * S * S,
        speed: SIM2.speed,
    };

    fn near(value: f64, want: f64, tolerance: f64) {
        assert!((value - want).abs() <= tolerance, "{value} is not {want}");
    }

    /// Checks CON-4: golden facts C11, C36, C38 and C39.
    #[test]
    fn sim2_and_sim3_are_the_golden_facts() {
        near(SIM2.damping_ratio(), 0.08351050926729962, 1e-9);
        near(SIM2.restitution(), 0.8828224150146118, 1e-9);
        near(SIM2.compression(), 0.402093524991876, 1e-9);
        near(SIM2.restitution_time(), 0.42321520564268034, 1e-9);
        near(SIM2.deepest(), 0.0011892817150862924, 1e-9);
        near(SIM2.loss(), 0.004003839719404061, 1e-12);
        near(SIM3.loss(), 0.00010810367242390964, 1e-12);
        near(SIM2.largest_force(), 24.121294050977983, 1e-8);
        near(SIM3.largest_force(), 2.170916464588018, 1e-8);
    }

    /// C16 and C37: the ratios do not change with the scale, times and depths do as it.
    #[test]
    fn ratios_do_not_change_with_the_scale() {
        near(SIM3.damping_ratio(), SIM2.damping_ratio(), 1e-12);
        near(SIM3.restitution(), SIM2.restitution(), 1e-12);
        near(SIM3.compression() / S, SIM2.compression(), 1e-14);
        near(SIM3.restitution_time() / S, SIM2.restitution_time(), 1e-14);
        near(SIM3.deepest() / S, SIM2.deepest(), 1e-14);
    }

    /// About and above zeta = 1 the functions go on without a seam, and the limits of no damping hold.
    #[test]
    fn strong_damping_and_none() {
        let of = |zeta: f64| Impact { mass: 1.0, stiffness: 1.0, damping: 2.0 * zeta, speed: 1.0 };
        near(of(1.0).restitution(), (-1.0f64).exp(), 1e-15);
        near(of(1.0 + 1e-6).restitution(), of(1.0 - 1e-6).restitution(), 1e-5);
        near(of(1.0 + 1e-6).compression(), 1.0, 1e-6);
        assert!(of(5.0).restitution() < of(2.0).restitution());
        near(of(0.0).restitution(), 1.0, 0.0);
        near(of(0.0).largest_force(), 1.0, 1e-15);
        near(of(0.5).largest_force(), 1.0, 1e-15);
        near(of(0.499999).largest_force(), 1.0, 1e-5);
    }

    /// Checks CON-5: golden fact C40, the ring's ball next to the target's centre of mass.
    #[test]
    fn an_oblique_contact_feels_less_than_both_masses() {
        let target = mobility(7900.0, 129112.2, [-5.0, 1.3], [1.0, 0.0]);
        let chaser = mobility(1778.7, 762.0, [3.32, 0.0], [1.0, 0.0]);
        let oblique = Impact { mass: 1.0 / (target + chaser), ..SIM2 };
        near(oblique.mass, 1424.7449232210847, 1e-9);
        near(oblique.damping_ratio(), 0.08430026830665255, 1e-9);
        near(oblique.restitution(), 0.8818342227274125, 1e-9);
    }
}
