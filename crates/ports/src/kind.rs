//! Kinds of quantities.

/// What a variable measures, by its unit, else by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum PortKind {
    Angle,
    AngularVelocity,
    AngularAcceleration,
    Torque,
    Force,
    Current,
    Position,
    Velocity,
    Acceleration,
    /// kg.m2/s.
    AngularMomentum,
    Energy,
    /// N.m/rad.
    Stiffness,
    /// N.m.s/rad.
    Damping,
    /// N.m/A.
    TorqueConstant,
    /// A number: a ratio, an element of a quaternion.
    Number,
    /// Another unit, or none and a name that gives no hint.
    Other,
}

/// Kinds by the exponents of kg, m, s, A, rad.
pub(crate) const BY_UNIT: &[([i32; 5], PortKind)] = &[
    ([0, 0, 0, 0, 1], PortKind::Angle),
    ([0, 0, -1, 0, 1], PortKind::AngularVelocity),
    ([0, 0, -2, 0, 1], PortKind::AngularAcceleration),
    ([1, 2, -2, 0, 0], PortKind::Torque),
    ([1, 1, -2, 0, 0], PortKind::Force),
    ([0, 0, 0, 1, 0], PortKind::Current),
    ([0, 1, 0, 0, 0], PortKind::Position),
    ([0, 1, -1, 0, 0], PortKind::Velocity),
    ([0, 1, -2, 0, 0], PortKind::Acceleration),
    ([1, 2, -1, 0, 0], PortKind::AngularMomentum),
    ([1, 2, -2, 0, -1], PortKind::Stiffness),
    ([1, 2, -1, 0, -1], PortKind::Damping),
    ([1, 2, -2, -1, 0], PortKind::TorqueConstant),
    ([0, 0, 0, 0, 0], PortKind::Number),
];

impl PortKind {
    /// For messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Angle => "an angle",
            Self::AngularVelocity => "an angular velocity",
            Self::AngularAcceleration => "an angular acceleration",
            Self::Torque => "a torque",
            Self::Force => "a force",
            Self::Current => "a current",
            Self::Position => "a position",
            Self::Velocity => "a velocity",
            Self::Acceleration => "an acceleration",
            Self::AngularMomentum => "an angular momentum",
            Self::Energy => "an energy",
            Self::Stiffness => "a stiffness",
            Self::Damping => "a damping",
            Self::TorqueConstant => "a torque constant",
            Self::Number => "a number",
            Self::Other => "of a unit that no port has",
        }
    }

    /// The kind that its derivative by time has.
    pub fn derivative(self) -> Option<Self> {
        Some(match self {
            Self::Angle => Self::AngularVelocity,
            Self::AngularVelocity => Self::AngularAcceleration,
            Self::Position => Self::Velocity,
            Self::Velocity => Self::Acceleration,
            _ => return None,
        })
    }
}
