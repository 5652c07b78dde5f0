//! The arm, its base, gravity and pose requested by the command line.

use trueup_flexibility::elements::FlexibleElement;
use trueup_flexibility::equilibrium::EquilibriumError;
use trueup_flexibility::ground::{EARTH, Standing, loaded, standing};
use trueup_models::flexible_arm::presets::{DELIAN, delian};
use trueup_models::space::design::RobotDesign;
use trueup_models::space::tree::JointType;

use crate::args::ArmMap;
use crate::error::CliError;
use crate::voice;

/// The requested arm.
pub(super) struct ArmRequest<'a> {
    pub(super) args: &'a ArmMap,
    pub(super) design: RobotDesign,
    pub(super) on: Standing,
    pub(super) gravity: [f64; 3],
    /// Angles of all motors.
    pub(super) motors: Vec<f64>,
}

impl<'a> ArmRequest<'a> {
    pub(super) fn of(args: &'a ArmMap) -> Result<Self, CliError> {
        let own = args.robot.to_str() == Some(DELIAN);
        let mut design = if own {
            delian()
        } else {
            let read = trueup_robot::read_among(&args.robot, false, &[DELIAN])?;
            read.notes.iter().for_each(|note| voice::note(note));
            let design = RobotDesign { held: true, ..read.design };
            design.unstiffened().iter().for_each(|note| voice::note(note));
            design
        };
        let gravity = match args.gravity.as_deref() {
            None => EARTH,
            Some(&[x, y, z]) if [x, y, z].iter().all(|g| g.is_finite()) => [x, y, z],
            Some(_) => {
                return Err(CliError::Usage(
                    "--gravity: give three finite numbers in m/s2, as in --gravity 0,0,-9.81".into(),
                ));
            }
        };
        if args.payload > 0.0 {
            design = loaded(&design, args.payload).ok_or_else(|| {
                let robot = args.robot.display();
                CliError::Usage(format!(
                    "--payload: {robot} has no tip on a moving body; add a [[tip]] with the `body` that it is fixed to"
                ))
            })?;
        }
        let n = design.links.len();
        if !args.pose.is_empty() && (args.pose.len() != n || args.pose.iter().any(|q| !q.is_finite())) {
            return Err(CliError::Usage(format!(
                "--pose has {} numbers, the arm {n} joints; give one finite number each, in rad (m of prismatic joints)",
                args.pose.len()
            )));
        }
        let motors = if args.pose.is_empty() { vec![0.0; n] } else { args.pose.clone() };
        let on = standing(&design, gravity).map_err(|why| CliError::at(&args.robot, why))?;
        let asked = Self { args, design, on, gravity, motors };
        asked.mixed();
        Ok(asked)
    }

    /// Deflections in m and in rad have no common unit, so no shares.
    fn mixed(&self) {
        let slides = |l: &trueup_models::space::design::DesignLink| {
            l.joint == JointType::Prismatic && l.motor.flexible
        };
        if let Some(k) = self.design.links.iter().position(slides) {
            voice::note(&format!(
                "joint {} slides: its deflection is in m, and shares take it as if it were rad",
                k + 1
            ));
        }
    }

    /// Of the arm as a whole.
    pub(super) fn refused(&self, e: &EquilibriumError) -> CliError {
        CliError::at(&self.args.robot, e)
    }

    /// The joint of an element (from 1), or the body whose link it is.
    pub(super) fn body(&self, element: FlexibleElement) -> usize {
        match element {
            FlexibleElement::Joint(j) => j,
            FlexibleElement::Link(l) => self.on.arm.structure().robot.bending().nth(l - 1).map_or(0, |b| b.0),
        }
    }

    /// An element with the name of its body, as in `joint 2, shoulder pitch`.
    pub(super) fn named(&self, element: FlexibleElement) -> String {
        let body = self.body(element).checked_sub(1).and_then(|k| self.design.links.get(k));
        body.map_or_else(|| element.to_string(), |b| format!("{element}, {}", b.name))
    }

    /// What the arm carries and where, for people.
    pub(super) fn loads(&self) -> String {
        let [x, y, z] = self.gravity;
        let load = self.args.payload;
        let load = if load > 0.0 { format!(", {load} kg at the tip") } else { String::new() };
        format!("gravity ({x}, {y}, {z}) m/s2{load}")
    }
}

/// Of an element's size of deflection, deg (rad of the kernel).
pub(super) fn degrees(rad: f64) -> f64 {
    rad.abs().to_degrees()
}
