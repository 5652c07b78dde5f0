//! Values of the parameters of [`SpatialFreeFlyer`]: of a design, by themselves, and what they may not be.

use super::attitude::{IDENTITY, four, square};
use super::body_check::{NOT_UNIT, inertia_fault};
use super::design::RobotDesign;
use super::layout::Parameters;
use super::model::SpatialFreeFlyer;
use super::shapes::Shapes;
use super::structure::RobotStructure;
use super::tree::Tree;
use super::vector::{Matrix3, dot};
use crate::arm::rotor;

/// Motor inertia and stiffness of a flexible joint that is not described.
const SPRING: (f64, f64) = (0.1, 100.0);

/// Young's modulus, Pa (S3 2), and Poisson's ratio of a link that is not described.
const ALUMINIUM: (f64, f64) = (78e9, 0.33);

/// Diagonal of a matrix of 3 x 3, row by row.
const DIAGONAL: [usize; 3] = [0, 4, 8];

impl RobotDesign {
    /// What of it is fixed when it is packed.
    pub fn structure(&self) -> RobotStructure {
        RobotStructure {
            tree: Tree {
                parent: self.links.iter().map(|l| l.parent).collect(),
                joint: self.links.iter().map(|l| l.joint).collect(),
            },
            flexible: self.links.iter().map(|l| l.motor.flexible).collect(),
            tips: self.tips.iter().map(|t| t.body).collect(),
            thrusters: self.thrusters.len(),
            appendages: self.appendages.iter().map(|a| a.shapes).collect(),
            tables: self.tables.iter().map(|t| t.modes.len()).collect(),
            links: self.link_shapes(),
            tabled_links: self.tabled_links(),
            axial_stiffening: self.stiffens(),
            held: self.held,
            analysis: self.analysis,
        }
    }

    /// Per body the shapes of its link; none at all where every link is rigid.
    fn link_shapes(&self) -> Vec<Shapes> {
        let mut all = vec![Shapes::default(); if self.flexures.is_empty() { 0 } else { self.links.len() }];
        for f in &self.flexures {
            if let Some(shapes) = f.body.checked_sub(1).and_then(|b| all.get_mut(b)) {
                *shapes = f.shapes;
            }
        }
        all
    }

    /// Per body the modes of its link that is a table; none at all where no link is.
    fn tabled_links(&self) -> Vec<usize> {
        let mut all = vec![0; if self.link_tables.is_empty() { 0 } else { self.links.len() }];
        for t in &self.link_tables {
            if let Some(modes) = t.body.checked_sub(1).and_then(|b| all.get_mut(b)) {
                *modes = t.table.modes.len();
            }
        }
        all
    }

    /// Gives these joints a spring and these none; a joint that had no spring gets a motor of 0.1 kg.m2 behind 100 N.m/rad.
    ///
    /// # Errors
    /// Not one entry per joint.
    pub fn flex(&mut self, flexible: &[bool]) -> Result<(), String> {
        let n = self.links.len();
        if flexible.len() != n {
            return Err(format!(
                "jointFlexible has {} entries; {} has {n} joints, give one each",
                flexible.len(),
                self.name
            ));
        }
        for (motor, flexible) in self.links.iter_mut().map(|l| &mut l.motor).zip(flexible) {
            motor.flexible = *flexible;
            if *flexible && motor.stiffness == 0.0 {
                (motor.inertia, motor.stiffness) = (SPRING.0, SPRING.1);
            }
        }
        Ok(())
    }

    /// Values of all parameters of a model of it.
    pub fn parameters(&self) -> Vec<f64> {
        let s = self.structure();
        let at = Parameters::new(&s);
        let mut p = plain(&s, &at);
        p[at.motor_coupling] = if self.geared { rotor::GEARED } else { rotor::PAPER };
        p[at.base_mass] = self.base_mass;
        put(&mut p, at.base_inertia, self.base_inertia.as_flattened());
        for (j, l) in self.links.iter().enumerate() {
            p[at.body_mass + j] = l.mass;
            put(&mut p, at.body_center + 3 * j, &l.center_of_mass);
            put(&mut p, at.body_inertia + 9 * j, l.inertia.as_flattened());
            put(&mut p, at.joint_position + 3 * j, &l.position);
            put(&mut p, at.joint_orientation + 4 * j, &l.orientation);
            put(&mut p, at.joint_axis + 3 * j, &l.axis);
            p[at.motor_inertia + j] = l.motor.inertia;
            p[at.gear_ratio + j] = l.motor.gear_ratio;
            p[at.joint_stiffness + j] = l.motor.stiffness;
            p[at.joint_damping + j] = l.motor.damping;
        }
        for (a, t) in self.tips.iter().enumerate() {
            put(&mut p, at.tip_offset + 3 * a, &t.offset);
            if s.analysis {
                put(&mut p, at.arm_mount + 3 * a, &t.mount);
            }
        }
        for (k, t) in self.thrusters.iter().enumerate() {
            put(&mut p, at.thruster_position + 3 * k, &t.position);
            put(&mut p, at.thruster_direction + 3 * k, &t.direction);
        }
        for (k, a) in self.appendages.iter().enumerate() {
            put(&mut p, at.appendage_position + 3 * k, &a.position);
            put(&mut p, at.appendage_orientation + 4 * k, &a.orientation);
            p[at.appendage_length + k] = a.length;
            p[at.mass_per_length + k] = a.mass_per_length;
            p[at.bending_x + k] = a.bending_stiffness[0];
            p[at.bending_y + k] = a.bending_stiffness[1];
            p[at.torsion + k] = a.torsion_stiffness;
            p[at.polar_inertia + k] = a.polar_inertia_per_length;
            p[at.damping_ratio + k] = a.damping_ratio;
        }
        for (k, (body, _)) in s.beams().enumerate() {
            let Some(f) = self.flexures.iter().rfind(|f| f.body == body) else { continue };
            put(&mut p, at.link_position + 3 * k, &f.position);
            put(&mut p, at.link_orientation + 4 * k, &f.orientation);
            put(&mut p, at.area_moment + 2 * k, &f.area_moment);
            for (begin, value) in [
                (at.link_length, f.length),
                (at.link_mass, f.mass_per_length),
                (at.youngs_modulus, f.youngs_modulus),
                (at.poisson_ratio, f.poisson_ratio),
                (at.torsion_constant, f.torsion_constant),
                (at.link_polar, f.polar_inertia_per_length),
                (at.link_damping, f.damping_ratio),
            ] {
                p[begin + k] = value;
            }
        }
        let mut m = 0;
        for (k, t) in self.tables.iter().enumerate() {
            let part = self.appendages.len() + k;
            put(&mut p, at.appendage_position + 3 * part, &t.position);
            put(&mut p, at.appendage_orientation + 4 * part, &t.orientation);
            p[at.table_mass + k] = t.mass;
            put(&mut p, at.table_center + 3 * k, &t.center_of_mass);
            put(&mut p, at.table_inertia + 9 * k, t.inertia.as_flattened());
            for mode in &t.modes {
                p[at.mode_frequency + m] = mode.frequency;
                p[at.mode_damping + m] = mode.damping_ratio;
                put(&mut p, at.mode_participation + 6 * m, &mode.participation);
                m += 1;
            }
        }
        let (beams, mut m) = (s.beams().count(), 0);
        for (k, (body, _)) in s.link_tables().enumerate() {
            let Some(link) = self.link_tables.iter().rfind(|t| t.body == body) else { continue };
            let t = &link.table;
            put(&mut p, at.link_position + 3 * (beams + k), &t.position);
            put(&mut p, at.link_orientation + 4 * (beams + k), &t.orientation);
            p[at.link_table_mass + k] = t.mass;
            put(&mut p, at.link_table_center + 3 * k, &t.center_of_mass);
            put(&mut p, at.link_table_inertia + 9 * k, t.inertia.as_flattened());
            put(&mut p, at.link_end + 3 * k, &link.end);
            for (mode, reach) in t.modes.iter().zip(&link.reach) {
                p[at.link_mode_frequency + m] = mode.frequency;
                p[at.link_mode_damping + m] = mode.damping_ratio;
                put(&mut p, at.link_mode_participation + 6 * m, &mode.participation);
                put(&mut p, at.link_mode_shift + 3 * m, &reach.shift);
                put(&mut p, at.link_mode_turn + 3 * m, &reach.turn);
                m += 1;
            }
        }
        p
    }
}

fn put(p: &mut [f64], begin: usize, values: &[f64]) {
    p[begin..][..values.len()].copy_from_slice(values);
}

/// A base of 100 kg with bodies of 1 kg in a row, all axes along z.
fn plain(s: &RobotStructure, at: &Parameters) -> Vec<f64> {
    let mut p = vec![0.0; at.count];
    p[at.base_mass] = 100.0;
    DIAGONAL.iter().for_each(|i| p[at.base_inertia + i] = 10.0);
    for j in 0..s.bodies() {
        p[at.body_mass + j] = 1.0;
        DIAGONAL.iter().for_each(|i| p[at.body_inertia + 9 * j + i] = 0.1);
        p[at.joint_orientation + 4 * j] = 1.0;
        p[at.joint_axis + 3 * j + 2] = 1.0;
        p[at.gear_ratio + j] = 1.0;
        if s.flexible[j] {
            (p[at.motor_inertia + j], p[at.joint_stiffness + j]) = SPRING;
        }
    }
    (0..s.thrusters).for_each(|k| p[at.thruster_direction + 3 * k] = 1.0);
    (0..s.panels()).for_each(|k| p[at.appendage_orientation + 4 * k] = 1.0);
    for k in 0..s.tables.len() {
        p[at.table_mass + k] = 1.0;
        DIAGONAL.iter().for_each(|i| p[at.table_inertia + 9 * k + i] = 0.1);
    }
    (0..s.tabled()).for_each(|m| p[at.mode_frequency + m] = 10.0);
    for k in 0..s.appendages.len() {
        for begin in [at.appendage_length, at.mass_per_length, at.polar_inertia] {
            p[begin + k] = 1.0;
        }
        for begin in [at.bending_x, at.bending_y, at.torsion] {
            p[begin + k] = 100.0;
        }
    }
    (0..s.links()).for_each(|k| p[at.link_orientation + 4 * k] = 1.0);
    for k in 0..s.link_tables().count() {
        p[at.link_table_mass + k] = 1.0;
        DIAGONAL.iter().for_each(|i| p[at.link_table_inertia + 9 * k + i] = 0.1);
    }
    (0..s.linked_tabled()).for_each(|m| p[at.link_mode_frequency + m] = 10.0);
    for k in 0..s.beams().count() {
        p[at.youngs_modulus + k] = ALUMINIUM.0;
        p[at.poisson_ratio + k] = ALUMINIUM.1;
        for begin in [at.link_length, at.link_mass] {
            p[begin + k] = 1.0;
        }
        for begin in [at.area_moment + 2 * k, at.area_moment + 2 * k + 1, at.torsion_constant + k] {
            p[begin] = 1e-8;
        }
        p[at.link_polar + k] = 1e-3;
    }
    p[at.motor_coupling] = rotor::GEARED;
    put(&mut p, at.initial_base_quaternion, &IDENTITY);
    p
}

impl SpatialFreeFlyer {
    /// Start values of all parameters of a model that is no robot's yet.
    pub fn defaults(&self) -> Vec<f64> {
        let mut p = plain(self.structure(), &self.parameter);
        p.extend(self.effect_defaults());
        p
    }

    /// Conditions on parameters that no single bound can say.
    ///
    /// # Errors
    /// The index of the parameter that is at fault, and the error with its remedy.
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        let (s, at) = (self.structure(), &self.parameter);
        let inertia =
            |begin: usize| -> Matrix3<f64> { [0, 3, 6].map(|r| [0, 1, 2].map(|c| p[begin + r + c])) };
        if let Some(why) = inertia_fault(&inertia(at.base_inertia)) {
            return Err((at.base_inertia, format!("baseInertia: {why}")));
        }
        for j in 0..s.bodies() {
            let i = j + 1;
            let begin = at.body_inertia + 9 * j;
            if let Some(why) = inertia_fault(&inertia(begin)) {
                return Err((begin, format!("bodyInertia of body {i}: {why}")));
            }
            let begin = at.joint_axis + 3 * j;
            let axis = [p[begin], p[begin + 1], p[begin + 2]];
            if dot(axis, axis) == 0.0 {
                return Err((begin, format!("jointAxis of body {i} has length 0: give it a direction")));
            }
            let begin = at.joint_orientation + 4 * j;
            quaternion(p, begin, &format!("jointOrientation of body {i}"))?;
            if s.flexible[j] {
                let or = "or pack the model with a rigid joint there";
                for (name, begin, why) in [
                    ("jointStiffness", at.joint_stiffness, "its spring must hold the body"),
                    ("motorInertia", at.motor_inertia, "its motor moves by itself"),
                ] {
                    let value = p[begin + j];
                    if value <= 0.0 {
                        let message = format!(
                            "{name}[{i}] = {value} is refused: the joint is flexible and {why} ({or}); give {name}[{i}] a value above 0"
                        );
                        return Err((begin + j, message));
                    }
                }
            }
        }
        for k in 0..s.thrusters {
            let begin = at.thruster_direction + 3 * k;
            let along = [p[begin], p[begin + 1], p[begin + 2]];
            if dot(along, along) == 0.0 {
                let message = format!("thrusterDirection of thruster {} has length 0: give it one", k + 1);
                return Err((begin, message));
            }
        }
        for k in 0..s.panels() {
            quaternion(
                p,
                at.appendage_orientation + 4 * k,
                &format!("appendageOrientation of appendage {}", k + 1),
            )?;
        }
        for k in 0..s.links() {
            quaternion(p, at.link_orientation + 4 * k, &format!("linkOrientation of link {}", k + 1))?;
        }
        for k in 0..s.tables.len() {
            let begin = at.table_inertia + 9 * k;
            if let Some(why) = inertia_fault(&inertia(begin)) {
                return Err((begin, format!("appendageInertia of table {}: {why}", k + 1)));
            }
        }
        for k in 0..s.link_tables().count() {
            let begin = at.link_table_inertia + 9 * k;
            if let Some(why) = inertia_fault(&inertia(begin)) {
                return Err((begin, format!("linkInertia of table {}: {why}", k + 1)));
            }
        }
        for (name, begin, fault) in [
            ("modeParticipation", at.mode_participation, self.table_fault(p)),
            ("linkModeParticipation", at.link_mode_participation, self.link_table_fault(p)),
        ] {
            if let Some((k, first, why)) = fault {
                let message = format!("{name} of table {}, from mode {}: {why}", k + 1, first + 1);
                return Err((begin + 6 * first, message));
            }
        }
        let begin = at.initial_base_quaternion;
        if p[begin..begin + 4].iter().all(|v| *v == 0.0) {
            let message = "initialBaseQuaternion is 0, 0, 0, 0, which is no attitude; give w, x, y, z, 1, 0, 0, 0 for base axes along the inertial ones";
            return Err((begin, message.to_owned()));
        }
        Ok(())
    }
}

impl SpatialFreeFlyer {
    /// What of these parameters is taken otherwise than it is written.
    pub fn remark(&self, p: &[f64]) -> Option<String> {
        let [w, x, y, z] = four(p, self.parameter.initial_base_quaternion);
        let length = square([w, x, y, z]).sqrt();
        ((length - 1.0).abs() > NOT_UNIT).then(|| {
            format!(
                "initialBaseQuaternion = {w}, {x}, {y}, {z} has length {length:.4}: it is taken with length 1"
            )
        })
    }
}

/// Of a parameter that has to be of length 1.
fn quaternion(p: &[f64], begin: usize, name: &str) -> Result<(), (usize, String)> {
    let q = [p[begin], p[begin + 1], p[begin + 2], p[begin + 3]];
    let length = square(q).sqrt();
    if (length - 1.0).abs() <= NOT_UNIT {
        return Ok(());
    }
    let [w, x, y, z] = q;
    Err((
        begin,
        format!("{name} = {w}, {x}, {y}, {z} has length {length:.4}: give a unit quaternion, w first"),
    ))
}
