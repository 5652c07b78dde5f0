//! What is known of a joint, and its state.

/// Parameters that the case may declare known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct JointValues {
    pub(crate) motor_inertia: f64,
    pub(crate) load_inertia: f64,
    pub(crate) gear_ratio: f64,
    pub(crate) torque_constant: f64,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    pub(crate) coulomb: f64,
    pub(crate) viscous: f64,
}

/// Names in the order of [`JointValues::list`].
pub(crate) const NAMES: [&str; 8] = [
    "motorInertia",
    "loadInertia",
    "gearRatio",
    "torqueConstant",
    "stiffness",
    "damping",
    "coulombFriction",
    "viscousFriction",
];

impl JointValues {
    pub(crate) fn list(&self) -> [f64; 8] {
        let v = self;
        [
            v.motor_inertia,
            v.load_inertia,
            v.gear_ratio,
            v.torque_constant,
            v.stiffness,
            v.damping,
            v.coulomb,
            v.viscous,
        ]
    }
    pub(crate) fn of(v: [f64; 8]) -> Self {
        let [motor_inertia, load_inertia, gear_ratio, torque_constant, stiffness, damping, coulomb, viscous] =
            v;
        Self {
            motor_inertia,
            load_inertia,
            gear_ratio,
            torque_constant,
            stiffness,
            damping,
            coulomb,
            viscous,
        }
    }
}

/// motor angle, motor velocity, load angle, load velocity, then the effects' own.
pub(crate) type JointState = [f64; 12];
