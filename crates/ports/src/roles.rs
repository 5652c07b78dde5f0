//! Roles that variables can have, and the ports of one FMU.

use trueup_fmi_description::description::DescriptionCausality;

use crate::kind::PortKind;

/// Where a port is.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PortPlace {
    /// A joint, by its number or name.
    Joint(String),
    /// The base.
    Base,
    /// The tip.
    Tip,
}

impl PortPlace {
    /// The table of `ports.toml`: `joint.1`, `base`, `tip`.
    pub fn table(&self) -> String {
        match self {
            Self::Joint(name) => format!("joint.{name}"),
            Self::Base => "base".into(),
            Self::Tip => "tip".into(),
        }
    }
    /// For reports.
    pub fn title(&self) -> String {
        match self {
            Self::Joint(name) => format!("joint {name}"),
            other => other.table(),
        }
    }
}

/// What a variable is at its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum PortRole {
    /// Torque of the motor, conjugate to the motor's velocity.
    Torque,
    /// Current of the motor.
    Current,
    /// Angle of the motor.
    MotorAngle,
    /// Its derivative.
    MotorVelocity,
    /// Angle of the link against the body that carries the joint.
    LinkAngle,
    /// Its derivative.
    LinkVelocity,
    /// Torque on the link, conjugate to the link's velocity.
    ExternalTorque,
    /// Torque of the transmission.
    TransmissionTorque,
    /// Parameter: stiffness of the transmission.
    Stiffness,
    /// Parameter: damping of the transmission.
    Damping,
    /// Force on a body, element by element.
    BodyForce,
    /// Torque on a body.
    BodyTorque,
    /// Position of the point where the force acts.
    BodyPosition,
    /// Velocity of that point, conjugate to the force.
    BodyVelocity,
    /// Attitude of the body: an angle, or a quaternion.
    BodyAttitude,
    /// Angular velocity, conjugate to the torque.
    BodyRate,
}

use PortRole::*;

/// Roles at a joint and on a body, in the order of the file.
pub const JOINT_ROLES: &[PortRole] = &[
    Torque,
    Current,
    MotorAngle,
    MotorVelocity,
    LinkAngle,
    LinkVelocity,
    ExternalTorque,
    TransmissionTorque,
    Stiffness,
    Damping,
];
/// Lists of variables.
pub const BODY_ROLES: &[PortRole] =
    &[BodyForce, BodyTorque, BodyPosition, BodyVelocity, BodyAttitude, BodyRate];

impl PortRole {
    /// Key in the file.
    pub fn key(self) -> &'static str {
        match self {
            Torque | BodyTorque => "torque",
            Current => "current",
            MotorAngle => "motorAngle",
            MotorVelocity => "motorVelocity",
            LinkAngle => "linkAngle",
            LinkVelocity => "linkVelocity",
            ExternalTorque => "externalTorque",
            TransmissionTorque => "transmissionTorque",
            Stiffness => "stiffness",
            Damping => "damping",
            BodyForce => "force",
            BodyPosition => "position",
            BodyVelocity => "velocity",
            BodyAttitude => "attitude",
            BodyRate => "rate",
        }
    }

    /// What the variable has to be.
    pub fn causality(self) -> DescriptionCausality {
        match self {
            Torque | Current | ExternalTorque | BodyForce | BodyTorque => DescriptionCausality::Input,
            Stiffness | Damping => DescriptionCausality::Parameter,
            _ => DescriptionCausality::Output,
        }
    }

    /// Kinds that fit.
    pub fn kinds(self) -> &'static [PortKind] {
        match self {
            // A joint may slide.
            Torque | ExternalTorque => &[PortKind::Torque, PortKind::Force],
            TransmissionTorque => &[PortKind::Torque, PortKind::Force],
            Current => &[PortKind::Current],
            MotorAngle | LinkAngle => &[PortKind::Angle, PortKind::Position],
            MotorVelocity | LinkVelocity => &[PortKind::AngularVelocity, PortKind::Velocity],
            Stiffness => &[PortKind::Stiffness, PortKind::Torque],
            Damping => &[PortKind::Damping, PortKind::AngularMomentum],
            BodyForce => &[PortKind::Force],
            BodyTorque => &[PortKind::Torque],
            BodyPosition => &[PortKind::Position],
            BodyVelocity => &[PortKind::Velocity],
            BodyAttitude => &[PortKind::Angle, PortKind::Number],
            BodyRate => &[PortKind::AngularVelocity],
        }
    }
}

/// A variable in its role.
#[derive(Clone, Debug, PartialEq)]
pub struct PortVariable {
    /// Where.
    pub place: PortPlace,
    /// As what.
    pub role: PortRole,
    /// Name of the variable or of an array's element.
    pub variable: String,
    /// Why it is guessed; empty: it was given.
    pub reason: String,
    /// Line in the file; 0: guessed.
    pub line: u32,
}

/// A number of a place.
#[derive(Clone, Debug, PartialEq)]
pub struct PortFigure {
    /// Where.
    pub place: PortPlace,
    /// `gearRatio`, `torqueConstant`, `mass`.
    pub key: &'static str,
    /// In SI.
    pub value: f64,
    /// Why it is guessed; empty: it was given.
    pub reason: String,
}

/// A reading.
#[derive(Clone, Debug, PartialEq)]
pub struct PortSensor {
    /// The output.
    pub variable: String,
    /// One of [`SENSOR_KINDS`](crate::keys::SENSOR_KINDS).
    pub kind: String,
    /// Line in the file; 0: guessed.
    pub line: u32,
}

/// All ports of one FMU.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FmuPorts {
    /// The FMU's file name.
    pub fmu: String,
    /// Variables.
    pub variables: Vec<PortVariable>,
    /// Numbers.
    pub figures: Vec<PortFigure>,
    /// Readings.
    pub sensors: Vec<PortSensor>,
    /// What a draft leaves open, in sentences.
    pub open: Vec<String>,
}

impl FmuPorts {
    /// The variable in a role.
    pub fn variable(&self, place: &PortPlace, role: PortRole) -> Option<&PortVariable> {
        self.variables.iter().find(|v| v.place == *place && v.role == role)
    }
    /// All variables in a role, in their order.
    pub fn list<'a>(
        &'a self,
        place: &'a PortPlace,
        role: PortRole,
    ) -> impl Iterator<Item = &'a PortVariable> {
        self.variables.iter().filter(move |v| v.place == *place && v.role == role)
    }
    /// There is a variable in that role.
    pub fn has(&self, place: &PortPlace, role: PortRole) -> bool {
        self.variable(place, role).is_some()
    }
    /// A number.
    pub fn figure(&self, place: &PortPlace, key: &str) -> Option<&PortFigure> {
        self.figures.iter().find(|f| f.place == *place && f.key == key)
    }
    /// All places, joints first, in the order of the file.
    pub fn places(&self) -> Vec<PortPlace> {
        let mut all: Vec<PortPlace> = Vec::new();
        for v in &self.variables {
            if !all.contains(&v.place) {
                all.push(v.place.clone());
            }
        }
        all.sort_by_key(|p| match p {
            PortPlace::Joint(_) => 0,
            PortPlace::Base => 1,
            PortPlace::Tip => 2,
        });
        all
    }
    /// The input that drives a joint.
    pub fn drive(&self, place: &PortPlace) -> Option<&PortVariable> {
        self.variable(place, Torque).or_else(|| self.variable(place, Current))
    }
}
