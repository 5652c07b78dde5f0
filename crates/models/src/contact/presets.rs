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
    /// Force at which the jaws stop, N.
    pub hold_force: f64,
    /// Of jaws with a motor: inertia in kg.m2, friction in N.m.s, the motor's limit in N.m.
    pub jaw: [f64; 3],
    /// Depth at which the damping hunt-crossley is eta_n, m.
    pub reference: f64,
    /// Of an end ball's mount, N/m and N.s/m.
    pub mount: [f64; 2],
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

/// The gripper of S2 section 3.1 with carriages. It is not scaled with the rest, in S2 either.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarriageGripper {
    /// k between a roller and the ring, N/m.
    pub stiffness: f64,
    /// eta_n there, N.s/m.
    pub damping: f64,
    /// K_s in N/m and C_s in N.s/m between carriage and jaw.
    pub spring: [f64; 2],
    /// Of a carriage to its stops, m.
    pub travel: f64,
    /// Of the rollers and of half the bar, m.
    pub radius: f64,
    /// Of each roller with its share of the carriage, kg.
    pub roller_mass: f64,
    /// Rollers on P2's jaw, closed, from the end effector, m: between its ends, before the bar, behind it.
    pub rollers: [[f64; 2]; 3],
    /// Way of a jaw, m.
    pub stroke: f64,
    /// Bar to either side of the port, m.
    pub bar_half: f64,
    /// Force at which the jaws stop, N.
    pub hold_force: f64,
    /// Turns of the spindle over the stroke; its motor's limit, N.m.
    pub spindle: [f64; 2],
    /// The port from the end effector at the start, m.
    pub port_offset: [f64; 2],
}

/// SIM1 of S2: the values of Table 4 within their ranges, stroke and time of Table 2; the rest is assumed.
pub const SIM1: CarriageGripper = CarriageGripper {
    stiffness: 5e4,
    damping: 1e5,
    spring: [100.0, 1000.0],
    travel: 0.03,
    radius: 0.01,
    roller_mass: 0.5,
    rollers: [[0.06, 0.05], [0.039, 0.03], [0.081, 0.03]],
    stroke: 0.07,
    bar_half: 0.03,
    hold_force: 5000.0,
    spindle: [35.0, 2.0],
    port_offset: [0.075, 0.005],
};

/// SIM2 of S2.
pub const SIM2: Capture = Capture {
    stiffness: 20000.0,
    damping: 900.0,
    ball_radius: 0.05,
    ball_mass: 1.0,
    open: [0.25, 0.2],
    closed: [0.06, 0.085],
    closing_time: 5.0,
    hold_force: 1000.0,
    jaw: [0.5, 2.0, 20.0],
    reference: 1e-3,
    mount: [2000.0, 30.0],
    target_mass: 7900.0,
    target_inertia: 129112.2,
    target_center: [5.0, 1.3],
    chaser_mass: 1778.7,
    chaser_inertia: 762.0,
    end_effector: [3.32, 0.0],
    speed: 0.005,
    port_offset: [0.12, 0.01],
};

impl Capture {
    /// The same at another size: a length goes with lambda, so does a time, a mass with its third power (CON-7); speeds stay.
    #[must_use]
    pub fn scaled(&self, lambda: f64) -> Self {
        let [area, volume] = [lambda * lambda, lambda * lambda * lambda];
        let length = |v: [f64; 2]| v.map(|v| v * lambda);
        Self {
            stiffness: self.stiffness * lambda,
            damping: self.damping * area,
            ball_radius: self.ball_radius * lambda,
            ball_mass: self.ball_mass * volume,
            open: length(self.open),
            closed: length(self.closed),
            closing_time: self.closing_time * lambda,
            hold_force: self.hold_force * area,
            jaw: [self.jaw[0] * area * volume, self.jaw[1] * area * area, self.jaw[2] * volume],
            reference: self.reference * lambda,
            mount: [self.mount[0] * lambda, self.mount[1] * area],
            target_mass: self.target_mass * volume,
            target_inertia: self.target_inertia * area * volume,
            target_center: length(self.target_center),
            chaser_mass: self.chaser_mass * volume,
            chaser_inertia: self.chaser_inertia * area * volume,
            end_effector: length(self.end_effector),
            speed: self.speed,
            port_offset: length(self.port_offset),
        }
    }
}
