//! Values of S2's simulations. Masses and the law are from its Table 7; the geometry of hand and port, which S2 does not give, is
//! assumed (docs/parameters.md).

/// A capture: SI, angles in rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capture {
    /// k in N/m.
    pub stiffness: f64,
    /// eta_n in N.s/m.
    pub damping: f64,
    /// Of the balls of hand and port, m.
    pub ball_radius: f64,
    /// Of each jaw, kg.
    pub ball_mass: f64,
    /// P2 from the end effector, open; P3 is mirrored, P1 is there. m.
    pub open: [f64; 2],
    /// P2 closed.
    pub closed: [f64; 2],
    /// s.
    pub closing_time: f64,
    /// kg.
    pub target_mass: f64,
    /// kg.m2.
    pub target_inertia: f64,
    /// Centre of mass from the port, target's axes, m.
    pub target_center: [f64; 2],
    /// With the arm, kg.
    pub chaser_mass: f64,
    /// kg.m2.
    pub chaser_inertia: f64,
    /// From the chaser's centre of mass, m.
    pub end_effector: [f64; 2],
    /// Of the chaser along x at the start, m/s.
    pub speed: f64,
    /// The port from the end effector at the start, m.
    pub port_offset: [f64; 2],
}

/// SIM2 of S2.
pub const SIM2: Capture = Capture {
    stiffness: 20000.0,
    damping: 900.0,
    ball_radius: 0.05,
    ball_mass: 1.0,
    open: [0.25, 0.2],
    closed: [0.06, 0.085],
    closing_time: 5.0,
    target_mass: 7900.0,
    target_inertia: 129112.2,
    target_center: [5.0, 1.3],
    chaser_mass: 1778.7,
    chaser_inertia: 762.0,
    end_effector: [3.32, 0.0],
    speed: 0.005,
    port_offset: [0.12, 0.01],
};
