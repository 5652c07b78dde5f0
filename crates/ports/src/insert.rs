//! Which effects can be inserted between which ports, and why the others cannot.

use trueup_fmi_import::UsedInterface;

use crate::check::{ONE_COORDINATE, PortCheck, contradicted};
use crate::experiment::Experiment;
use crate::roles::{FmuPorts, PortPlace, PortRole};

/// Whether an effect can act at a place.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectInsertion {
    /// Id of the effect, with its place where it has several.
    pub id: String,
    /// Port where it acts: `joint.1`, `base`, `sensors.NAME`.
    pub port: String,
    /// How: `before an input`, `at an input`, `after an output`, `between motor and link`.
    pub how: &'static str,
    /// `None`: it can. Else why not, with the remedy.
    pub obstacle: Option<String>,
}

/// Where a wrapper acts.
const BEFORE: &str = "before an input";
const AT: &str = "at an input";
const AFTER: &str = "after an output";
const BETWEEN: &str = "between motor and link";
const INSIDE: &str = "inside the FMU";

/// What an effect needs.
#[derive(Clone, Copy, Debug)]
enum InsertionNeed {
    /// The input that drives the motor.
    Drive,
    /// And the motor's angle.
    DriveAngle,
    /// Motor's velocity, and a torque in N.m.
    MotorFriction {
        /// It sticks: the torque that holds the motor has to be known.
        sticks: bool,
        /// The transmission's torque is needed, too.
        carried: bool,
    },
    /// A torque on the link and its angle, or its velocity, or neither.
    Link(Option<PortRole>),
    /// Torques on both sides of the transmission and both angles; `own`: its own spring has to be taken out.
    Transmission { own: bool },
    /// A drive that holds an angle by itself.
    Servo,
    /// A force or torque on the body, and this of its motion for each.
    Body { base: bool, motion: bool },
    /// All bodies.
    Tilt,
    /// Never from outside.
    Never(&'static str),
    /// Any output, or one that is an angle.
    Output { angle: bool },
}

use InsertionNeed::*;

/// Needs by id and place. The ids are those of `trueup fmu list`; a test compares both.
const NEEDS: &[(&str, InsertionNeed)] = &[
    ("external-force:actuator", Drive),
    ("external-force:load", Link(None)),
    ("external-force:tip", Body { base: false, motion: false }),
    ("external-force:base", Body { base: true, motion: false }),
    ("position-servo", Servo),
    ("current-saturation", Drive),
    ("actuator-lag", Drive),
    ("torque-ripple", DriveAngle),
    ("motor-friction", MotorFriction { sticks: true, carried: false }),
    ("stribeck-friction", MotorFriction { sticks: true, carried: false }),
    ("asymmetric-friction", MotorFriction { sticks: true, carried: false }),
    ("load-dependent-friction", MotorFriction { sticks: true, carried: true }),
    ("nonlinear-viscous-friction", MotorFriction { sticks: false, carried: false }),
    ("friction-drift", MotorFriction { sticks: true, carried: false }),
    ("presliding-friction", MotorFriction { sticks: false, carried: false }),
    ("kinematic-error", Transmission { own: true }),
    (
        "joint-flexibility",
        Never(
            "a rigid joint has one coordinate, and from outside none can be added; export the FMU with the joint's spring, as stiff as is needed",
        ),
    ),
    ("backlash", Transmission { own: true }),
    ("nonlinear-stiffness", Transmission { own: false }),
    ("transmission-hysteresis", Transmission { own: false }),
    ("nonlinear-damping", Transmission { own: false }),
    (
        "flexible-link",
        Never(
            "the link's inertia would have to be divided, and from outside it cannot be; export the FMU with the link's mode",
        ),
    ),
    ("load-friction", Link(Some(PortRole::LinkVelocity))),
    ("gravity-torque", Link(Some(PortRole::LinkAngle))),
    ("cable-stiffness:load", Link(Some(PortRole::LinkAngle))),
    ("cable-stiffness:base", Body { base: true, motion: true }),
    ("table-tilt", Tilt),
    ("base-drag", Body { base: true, motion: true }),
    ("base-thrust", Body { base: true, motion: false }),
    ("appendage-mode", Body { base: true, motion: true }),
    ("sensor-eccentricity", Output { angle: true }),
    ("sensor-drift", Output { angle: false }),
    ("sensor-delay", Output { angle: false }),
];

/// Ids of the effects that have rules, with their places where an effect has a rule for each.
pub fn rules() -> impl Iterator<Item = &'static str> {
    NEEDS.iter().map(|(id, _)| *id)
}

struct InsertionRules<'a> {
    ports: &'a FmuPorts,
    e: &'a Experiment,
    checks: &'a [PortCheck],
}

/// Of all effects at all places.
pub fn insertions(ports: &FmuPorts, e: &Experiment, checks: &[PortCheck]) -> Vec<EffectInsertion> {
    let r = InsertionRules { ports, e, checks };
    let joints: Vec<PortPlace> =
        ports.places().into_iter().filter(|p| matches!(p, PortPlace::Joint(_))).collect();
    let mut all = Vec::new();
    for (id, need) in NEEDS {
        let mut put = |port: String, how, obstacle: Result<(), String>| {
            all.push(EffectInsertion { id: (*id).to_owned(), port, how, obstacle: obstacle.err() });
        };
        match *need {
            Body { base, motion } => {
                let place = if base { PortPlace::Base } else { PortPlace::Tip };
                put(place.table(), AT, r.body(&place, motion));
            }
            Tilt => put("base".into(), AT, r.tilt(&joints)),
            Output { angle } => {
                let fits = |kind: &str| !angle || kind == "encoder";
                let sensors: Vec<_> = ports.sensors.iter().filter(|s| fits(&s.kind)).collect();
                if sensors.is_empty() {
                    let what = if angle {
                        "there is no encoder under [sensors]"
                    } else {
                        "there is nothing under [sensors]"
                    };
                    put("sensors".into(), AFTER, Err(format!("{what}; name outputs that are readings")));
                }
                sensors.into_iter().for_each(|s| put(format!("sensors.{}", s.variable), AFTER, Ok(())));
            }
            _ if joints.is_empty() => {
                put(
                    "joint".into(),
                    how(*need),
                    Err("there is no [joint.1]; name its torque or current and its velocity".into()),
                );
            }
            _ => joints.iter().for_each(|place| put(place.table(), how(*need), r.joint(place, *need))),
        }
    }
    all
}

fn how(need: InsertionNeed) -> &'static str {
    match need {
        Drive | DriveAngle | Servo => BEFORE,
        Transmission { .. } => BETWEEN,
        Never(_) => INSIDE,
        Output { .. } => AFTER,
        _ => AT,
    }
}

impl InsertionRules<'_> {
    /// What is contradicted is no ground to build on.
    fn sound(&self, place: &PortPlace) -> Result<(), String> {
        let wrong = contradicted(self.checks, place).next();
        wrong.map_or(Ok(()), |c| Err(format!("[{}] is contradicted: {}", place.table(), c.text)))
    }

    fn needs(&self, place: &PortPlace, role: PortRole, why: &str) -> Result<(), String> {
        match self.ports.has(place, role) {
            true => Ok(()),
            false => Err(format!("it needs {why}: `{}` of [{}]", role.key(), place.table())),
        }
    }

    fn joint(&self, place: &PortPlace, need: InsertionNeed) -> Result<(), String> {
        if let Never(why) = need {
            return Err(why.into());
        }
        self.sound(place)?;
        match need {
            Drive => self.drive(place),
            DriveAngle => {
                self.drive(place)?;
                self.needs(place, PortRole::MotorAngle, "the angle that the torque repeats with")
            }
            Servo => {
                self.torque(place)?;
                self.needs(place, PortRole::MotorVelocity, "the motor's velocity")?;
                self.link_motion(place, PortRole::LinkAngle, "the angle that it holds")
            }
            MotorFriction { sticks, carried } => self.motor_friction(place, sticks, carried),
            Link(motion) => self.link(place, motion),
            Transmission { own } => self.transmission(place, own),
            _ => Ok(()),
        }
    }

    fn drive(&self, place: &PortPlace) -> Result<(), String> {
        let drive = self.ports.drive(place);
        drive.map_or_else(
            || Err(format!("[{}] has neither `torque` nor `current`", place.table())),
            |_| Ok(()),
        )
    }

    /// A torque can be added to the motor's.
    fn torque(&self, place: &PortPlace) -> Result<(), String> {
        self.drive(place)?;
        let known =
            self.ports.has(place, PortRole::Torque) || self.ports.figure(place, "torqueConstant").is_some();
        match known {
            true => Ok(()),
            false => {
                Err(format!("a torque enters as a current only with `torqueConstant` of [{}]", place.table()))
            }
        }
    }

    /// Motor and link are one coordinate.
    fn rigid(&self, place: &PortPlace) -> bool {
        let of = |role| self.ports.variable(place, role).map(|v| v.variable.as_str());
        let link = of(PortRole::LinkVelocity);
        let as_one = |c: &PortCheck| c.check == ONE_COORDINATE && c.place.as_ref() == Some(place);
        link.is_none() || link == of(PortRole::MotorVelocity) || self.checks.iter().any(as_one)
    }

    fn link_motion(&self, place: &PortPlace, role: PortRole, why: &str) -> Result<(), String> {
        let motor = if role == PortRole::LinkAngle { PortRole::MotorAngle } else { PortRole::MotorVelocity };
        if self.rigid(place) && self.ports.has(place, motor) { Ok(()) } else { self.needs(place, role, why) }
    }

    fn motor_friction(&self, place: &PortPlace, sticks: bool, carried: bool) -> Result<(), String> {
        self.torque(place)?;
        self.needs(place, PortRole::MotorVelocity, "the velocity that is conjugate to the torque")?;
        if carried {
            self.needs(place, PortRole::TransmissionTorque, "the torque that is carried")?;
        }
        // The torque that holds the motor is -a0 / (da/dtau): by a derivative, or by a trial step that is taken back.
        let by_trial = self.e.interface == UsedInterface::ModelExchange
            || self.e.offers.fmu_state_restored == Some(Ok(true));
        match sticks && !by_trial {
            true => Err("friction that sticks needs the torque that holds the motor: Model Exchange, or an FMU state that can be restored".into()),
            false => Ok(()),
        }
    }

    fn link(&self, place: &PortPlace, motion: Option<PortRole>) -> Result<(), String> {
        if !self.ports.has(place, PortRole::ExternalTorque) {
            if !self.rigid(place) {
                return self.needs(
                    place,
                    PortRole::ExternalTorque,
                    "a torque on the link, which a spring separates from the motor",
                );
            }
            // One coordinate: the motor's torque reaches the link.
            self.torque(place)?;
        }
        motion.map_or(Ok(()), |role| self.link_motion(place, role, "the motion of the link"))
    }

    fn transmission(&self, place: &PortPlace, own: bool) -> Result<(), String> {
        if self.rigid(place) {
            return Err(
                "the joint is rigid: there is no deflection; export the FMU with the joint's spring".into()
            );
        }
        self.torque(place)?;
        self.needs(place, PortRole::ExternalTorque, "torques on both sides of the spring")?;
        for role in
            [PortRole::MotorAngle, PortRole::LinkAngle, PortRole::MotorVelocity, PortRole::LinkVelocity]
        {
            self.needs(place, role, "the deflection and its rate")?;
        }
        match own {
            true => self.needs(
                place,
                PortRole::Stiffness,
                "the spring as a parameter that can be set to 0, to put another one in its place",
            ),
            false => Ok(()),
        }
    }

    fn body(&self, place: &PortPlace, motion: bool) -> Result<(), String> {
        self.sound(place)?;
        let (force, torque) =
            (self.ports.has(place, PortRole::BodyForce), self.ports.has(place, PortRole::BodyTorque));
        if !force && !torque {
            return Err(format!("it needs an input on the body: `force` or `torque` of [{}]", place.table()));
        }
        if motion && force {
            self.needs(place, PortRole::BodyVelocity, "the motion of the point where the force acts")?;
        }
        if motion && !force {
            self.needs(place, PortRole::BodyRate, "the motion of the body")?;
        }
        Ok(())
    }

    /// A uniform pull acts on all bodies.
    fn tilt(&self, joints: &[PortPlace]) -> Result<(), String> {
        if !joints.is_empty() {
            return Err("it pulls on every body, and links have no force inputs here; export the FMU with its gravity as a parameter".into());
        }
        self.body(&PortPlace::Base, false)?;
        match self.ports.figure(&PortPlace::Base, "mass") {
            Some(_) => Ok(()),
            None => Err("it needs `mass` of [base]".into()),
        }
    }
}
