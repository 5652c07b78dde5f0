//! What a robot is made of, as a file or a preset gives it: numbers with names, checked, before they become a [`RigidRobot`].

use super::MAX_BODIES;
use super::analysis::RigidRobot;
use super::appendage::Beam;
use super::attitude::{Quaternion, rotation, square, unit};
use super::body_check::{inertia_doubt, inertia_fault, off_unit};
use super::flexible::Appendages;
pub use super::flexure::Flexure;
use super::shapes::Shapes;
use super::spatial::{Rigid, SpatialFrame};
use super::table::{LinkTable, ModeTable};
use super::tree::{JointType, Tree, TreeBody};
use super::vector::{Matrix3, Vector3, dot};

/// What drives a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DesignMotor {
    /// There is a spring between motor and body.
    pub flexible: bool,
    /// Of the rotor, joint side (gear ratio squared included), kg.m2 (kg of a prismatic joint).
    pub inertia: f64,
    /// Motor turns per joint turn.
    pub gear_ratio: f64,
    /// Of the spring, N.m/rad (N/m).
    pub stiffness: f64,
    /// In parallel with it, N.m.s/rad (N.s/m).
    pub damping: f64,
}

impl Default for DesignMotor {
    /// A torque that is there, without a rotor.
    fn default() -> Self {
        Self { flexible: false, inertia: 0.0, gear_ratio: 1.0, stiffness: 0.0, damping: 0.0 }
    }
}

/// A thruster of the base, base axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thruster {
    /// From the base's centre of mass, m.
    pub position: Vector3<f64>,
    /// Of the force on the base.
    pub direction: Vector3<f64>,
}

/// A beam on the base that bends (S1 3, 4), z along it from root to tip.
#[derive(Clone, Debug, PartialEq)]
pub struct Appendage {
    /// Its name.
    pub name: String,
    /// Numbers of its shapes.
    pub shapes: Shapes,
    /// Its root, base axes, m.
    pub position: Vector3<f64>,
    /// Own axes to the base's: w, x, y, z.
    pub orientation: Quaternion<f64>,
    /// m.
    pub length: f64,
    /// kg/m.
    pub mass_per_length: f64,
    /// E I of bending along x and along y, N.m2.
    pub bending_stiffness: [f64; 2],
    /// G J, N.m2.
    pub torsion_stiffness: f64,
    /// rho I_p, kg.m.
    pub polar_inertia_per_length: f64,
    /// Of every mode.
    pub damping_ratio: f64,
}

impl Appendage {
    /// As the kernels have it.
    pub fn beam(&self) -> Beam<f64> {
        Beam {
            frame: SpatialFrame { rotation: rotation(self.orientation), origin: self.position },
            length: self.length,
            mass_per_length: self.mass_per_length,
            bending_stiffness: self.bending_stiffness,
            torsion_stiffness: self.torsion_stiffness,
            polar_inertia_per_length: self.polar_inertia_per_length,
            damping_ratio: self.damping_ratio,
        }
    }
}

/// A moving body and the joint that it hangs on.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignLink {
    /// Its name.
    pub name: String,
    /// The body that carries it: 0 the base, 1 .. those before.
    pub parent: usize,
    /// What the joint leaves free.
    pub joint: JointType,
    /// kg.
    pub mass: f64,
    /// Centre of mass, own axes, m.
    pub center_of_mass: Vector3<f64>,
    /// About the centre of mass, own axes, kg.m2.
    pub inertia: Matrix3<f64>,
    /// The joint in the carrier's axes, m.
    pub position: Vector3<f64>,
    /// Own axes at angle 0 to the carrier's: w, x, y, z.
    pub orientation: Quaternion<f64>,
    /// The joint's axis, own axes.
    pub axis: Vector3<f64>,
    /// What drives the joint.
    pub motor: DesignMotor,
}

/// The hand of an arm.
#[derive(Clone, Debug, PartialEq)]
pub struct DesignTip {
    /// Its name.
    pub name: String,
    /// The body that it is fixed to.
    pub body: usize,
    /// Where, own axes, m.
    pub offset: Vector3<f64>,
    /// The point of the base that the arm's pull is given about, base axes, m.
    pub mount: Vector3<f64>,
}

/// A robot: a base, whose axes have their origin in its centre of mass, bodies on joints, hands.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotDesign {
    /// Its name.
    pub name: String,
    /// kg.
    pub base_mass: f64,
    /// About the centre of mass, kg.m2.
    pub base_inertia: Matrix3<f64>,
    /// Bodies, each after its carrier.
    pub links: Vec<DesignLink>,
    /// Hands.
    pub tips: Vec<DesignTip>,
    /// Thrusters of the base.
    pub thrusters: Vec<Thruster>,
    /// What bends on the base.
    pub appendages: Vec<Appendage>,
    /// What bends on the base by tables of modes.
    pub tables: Vec<ModeTable>,
    /// Links that bend, by their beams.
    pub flexures: Vec<Flexure>,
    /// Links that bend, by their tables of modes.
    pub link_tables: Vec<LinkTable>,
    /// Bending shortens links that bend, so that loads along them stiffen or soften them (LNK-4); `None`: as
    /// [`RobotDesign::stiffens`] decides.
    pub axial_stiffening: Option<bool>,
    /// The base does not move.
    pub held: bool,
    /// Rotors sit behind their gears; else they are as S0 prints them.
    pub geared: bool,
    /// Its model has outputs of what a pose is worth: measures, singular values.
    pub analysis: bool,
}

/// A design that cannot be: which body and value, and the remedy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DesignError {
    /// Name of the body (or hand) at fault; the base is `base`.
    pub body: String,
    /// What is wrong, with the remedy.
    pub message: String,
}

impl std::fmt::Display for DesignError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}`: {}", self.body, self.message)
    }
}
impl std::error::Error for DesignError {}

impl RobotDesign {
    /// Where the arm that this body (from 1; 0 is the base) is on is mounted on the base, base axes, m: its first joint. A parent that
    /// does not come before its child ends the way.
    pub fn mount(&self, mut body: usize) -> Vector3<f64> {
        while body > 0 && (1..body).contains(&self.links[body - 1].parent) {
            body = self.links[body - 1].parent;
        }
        body.checked_sub(1).map_or([0.0; 3], |k| self.links[k].position)
    }

    /// Bodies with an inertia that no body of matter has, though the equations of motion do with it.
    pub fn doubts(&self) -> Vec<DesignError> {
        let base = std::iter::once(("base", &self.base_inertia)).filter(|_| !self.held);
        let tables = self.tables.iter().chain(self.link_tables.iter().map(|l| &l.table));
        let all = base.chain(self.links.iter().map(|l| (l.name.as_str(), &l.inertia)));
        let all = all.chain(tables.map(|t| (t.name.as_str(), &t.inertia)));
        let doubt = |(body, inertia): (&str, &Matrix3<f64>)| {
            inertia_doubt(inertia).map(|message| DesignError { body: body.into(), message })
        };
        all.filter_map(doubt).collect()
    }

    /// Every mass and inertia that cannot be; `Ok` where there is none.
    ///
    /// # Errors
    /// All of them, from the base outwards.
    pub fn check_bodies(&self) -> Result<(), Vec<DesignError>> {
        let mut faults = Vec::new();
        let base = ("base", self.base_mass, &self.base_inertia);
        let links = self.links.iter().map(|l| (l.name.as_str(), l.mass, &l.inertia));
        for (body, mass, inertia) in std::iter::once(base).chain(links) {
            let mut fault = |message: String| faults.push(DesignError { body: body.into(), message });
            if !(mass > 0.0 && mass.is_finite()) {
                fault(format!("mass = {mass}: give it a mass above 0"));
            }
            inertia_fault(inertia).into_iter().for_each(&mut fault);
        }
        if faults.is_empty() { Ok(()) } else { Err(faults) }
    }

    /// Whether this can be a robot.
    ///
    /// # Errors
    /// The first body or hand that cannot be.
    pub fn check(&self) -> Result<(), DesignError> {
        let fault = |body: &str, message: String| Err(DesignError { body: body.into(), message });
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        if self.links.len() > MAX_BODIES {
            let message =
                format!("there are {} moving bodies, at most {MAX_BODIES} can be had", self.links.len());
            return fault(&self.name, message);
        }
        self.check_bodies().map_err(|mut faults| faults.swap_remove(0))?;
        for (k, link) in self.links.iter().enumerate() {
            if link.parent > k {
                let message = format!(
                    "its parent is body {}, which does not come before it (it is body {}); write bodies from the base outwards",
                    link.parent,
                    k + 1
                );
                return fault(&link.name, message);
            }
            let length = dot(link.axis, link.axis).sqrt();
            if !(length > 0.0 && length.is_finite()) {
                let [x, y, z] = link.axis;
                return fault(&link.name, format!("axis = [{x}, {y}, {z}]: an axis has a length above 0"));
            }
            if off_unit(link.orientation) {
                let [w, x, y, z] = link.orientation;
                let message = format!(
                    "orientation = [{w}, {x}, {y}, {z}] has length {:.4}: give a unit quaternion, w first",
                    square(link.orientation).sqrt()
                );
                return fault(&link.name, message);
            }
            if !finite(&link.position) || !finite(&link.center_of_mass) {
                return fault(&link.name, "position and center-of-mass must be finite numbers".into());
            }
        }
        for tip in &self.tips {
            if tip.body > self.links.len() {
                let message = format!("it is fixed to body {}; there are {}", tip.body, self.links.len());
                return fault(&tip.name, message);
            }
            if !finite(&tip.offset) || !finite(&tip.mount) {
                return fault(&tip.name, "offset and mount must be finite numbers".into());
            }
        }
        let mut appendages = Appendages::<f64>::new();
        for a in &self.appendages {
            let values = [a.length, a.mass_per_length, a.torsion_stiffness, a.polar_inertia_per_length];
            if values.iter().chain(&a.bending_stiffness).any(|v| !(*v > 0.0 && v.is_finite())) {
                let message =
                    "length, mass per length, stiffnesses and polar inertia per length must be above 0";
                return fault(&a.name, message.into());
            }
            if off_unit(a.orientation) || !finite(&a.position) {
                let message = "give a finite position, and a unit quaternion as orientation, w first";
                return fault(&a.name, message.into());
            }
            if let Err(why) = appendages.add_beam(0, a.shapes, &a.beam()) {
                return fault(&a.name, why.to_string());
            }
        }
        for t in &self.tables {
            t.check().or_else(|why| fault(&t.name, why))?;
            if let Err(why) = appendages.add_table(0, &t.frame(), &t.rigid(), &t.rows()) {
                return fault(&t.name, why.to_string());
            }
        }
        self.check_links()?;
        for (k, t) in self.thrusters.iter().enumerate() {
            if !finite(&t.position) || !finite(&t.direction) || dot(t.direction, t.direction) == 0.0 {
                let message = "position and direction must be finite numbers, the direction not 0";
                return fault(&format!("thruster {}", k + 1), message.into());
            }
        }
        Ok(())
    }

    /// The robot with its appendages as they are unbent, parts of the base.
    pub fn unbent(&self) -> RigidRobot<f64> {
        let mut appendages = Appendages::<f64>::new();
        let fit = self.appendages.iter().all(|a| appendages.add_beam(0, a.shapes, &a.beam()).is_ok())
            && self.tables.iter().all(|t| appendages.add_table(0, &t.frame(), &t.rigid(), &t.rows()).is_ok());
        let mut robot = self.robot();
        if fit {
            appendages.parts().iter().for_each(|part| robot.base = robot.base.plus(&part.rigid));
        }
        robot
    }

    /// The robot with these values, without its appendages.
    pub fn robot(&self) -> RigidRobot<f64> {
        let body = |l: &DesignLink| TreeBody {
            rigid: Rigid::new(l.mass, l.center_of_mass, &l.inertia),
            mount: SpatialFrame { rotation: rotation(l.orientation), origin: l.position },
            axis: unit(l.axis),
        };
        let nothing = TreeBody {
            rigid: Rigid { mass: 0.0, first: [0.0; 3], inertia: [[0.0; 3]; 3] },
            mount: SpatialFrame { rotation: super::vector::identity(), origin: [0.0; 3] },
            axis: [0.0, 0.0, 1.0],
        };
        let bodies = std::iter::once(nothing).chain(self.links.iter().map(body)).collect();
        RigidRobot {
            tree: Tree {
                parent: self.links.iter().map(|l| l.parent).collect(),
                joint: self.links.iter().map(|l| l.joint).collect(),
            },
            base: Rigid::new(self.base_mass, [0.0; 3], &self.base_inertia),
            bodies,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::presets;

    #[test]
    fn what_no_body_can_be_is_refused_with_its_name_and_value() {
        type Change = fn(&mut RobotDesign);
        let wrong: [(Change, &str, &str); 8] = [
            (|d| d.links[0].inertia[0][1] = 0.3, "link 1", "inertia[1,2] = 0.3 but inertia[2,1] = 0"),
            (|d| d.links[2].inertia[0][0] = -1.0, "link 3", "all must be above 0"),
            (|d| d.links[1].parent = 3, "link 2", "its parent is body 3, which does not come before it"),
            (|d| d.links[1].axis = [0.0; 3], "link 2", "an axis has a length above 0"),
            (|d| d.links[1].orientation = [0.0; 4], "link 2", "has length 0.0000: give a unit quaternion"),
            (|d| d.links[0].mass = f64::NAN, "link 1", "mass = NaN: give it a mass above 0"),
            (|d| d.base_mass = 0.0, "base", "mass = 0: give it a mass above 0"),
            (|d| d.tips[0].body = 9, "tool", "it is fixed to body 9; there are 6"),
        ];
        for (change, body, message) in wrong {
            let mut design = presets::chaser();
            assert_eq!(design.check(), Ok(()));
            change(&mut design);
            let e = design.check().unwrap_err();
            assert!(e.body == body && e.message.contains(message), "{e}");
        }
    }
}
