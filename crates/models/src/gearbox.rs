//! From the two stages of a gearbox to the equivalent one (S3 section 3.2).

/// One reduction stage: planetary gear or harmonic drive. Stiffness and damping on the stage's input side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Moment of inertia at the stage's input, kg.m2.
    pub inertia: f64,
    /// Stiffness K, N.m/rad.
    pub stiffness: f64,
    /// Damping D, N.m.s/rad.
    pub damping: f64,
    /// Gear ratio n >= 1.
    pub ratio: f64,
}

/// What the two-mass model needs, on the motor side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equivalent {
    /// K_eq, N.m/rad.
    pub stiffness: f64,
    /// D_eq, N.m.s/rad.
    pub damping: f64,
    /// n_eq.
    pub ratio: f64,
    /// J_motor = J_m + J_pl, kg.m2.
    pub motor_inertia: f64,
    /// J_load = J_l + J_hd n_hd^2, kg.m2.
    pub load_inertia: f64,
}

/// Two stages in series, the planetary gear on the motor (GB-1).
///
/// K_eq = K_pl K_hd / (K_hd + K_pl n_pl^2) as printed in S3. The printed D_eq is no series damping (twice too
/// large for two equal stages); to first order in the damping the right one is
/// D_eq = (K_hd^2 D_pl + n_pl^2 K_pl^2 D_hd) / (K_hd + K_pl n_pl^2)^2.
/// Checked by golden facts D01-D03.
pub fn series(
    planetary: &Stage,
    harmonic_drive: &Stage,
    motor_inertia: f64,
    load_inertia: f64,
) -> Equivalent {
    let (pl, hd) = (planetary, harmonic_drive);
    let sum = hd.stiffness + pl.stiffness * pl.ratio * pl.ratio;
    let weighted = hd.stiffness.powi(2) * pl.damping + (pl.ratio * pl.stiffness).powi(2) * hd.damping;
    Equivalent {
        stiffness: pl.stiffness * hd.stiffness / sum,
        damping: weighted / (sum * sum),
        ratio: pl.ratio * hd.ratio,
        motor_inertia: motor_inertia + pl.inertia,
        load_inertia: load_inertia + hd.inertia * hd.ratio * hd.ratio,
    }
}
