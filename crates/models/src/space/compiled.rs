//! The robot in space as a [`Plant`](trueup_plant::Plant).

use super::instant::RobotInstant;
use super::layout::{Inputs, Outputs, Parameters, States};
use super::model::SpatialFreeFlyer;
use super::prescribed::PrescribedAccelerations;
use super::tree::JointType;
use crate::compiled::{self, PlantModel};
use crate::effect::{EffectSet, PlantKind as EffectPlant};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_plant::{
    ChosenAs, Coordinate, CoordinateKind, Follows, Lanes, PlantError, PlantScalar, QuantityRole,
    StructureChoice, VariableTable, elements,
};

impl SpatialFreeFlyer {
    /// Rates of the states with forces on the coordinates, where some accelerations are given: of a base that floats the force
    /// on its centre of mass, inertial axes, and the torque, base axes; of each joint; of each motor that moves by itself. Empty:
    /// none. They do not act on prescribed motors.
    pub(crate) fn rates_under<T: Scalar>(
        &self,
        at: At<T>,
        prescribed: PrescribedAccelerations<'_, T>,
        force: &[T],
        dx: &mut [T],
    ) {
        let mut now = RobotInstant::new();
        now.set(self, &at);
        now.push(self, force);
        now.prescribe(self, &prescribed);
        self.accelerate_prescribed(&now, &at, &prescribed, dx, &mut []);
    }

    /// What was chosen of its joints.
    pub(crate) fn choices(&self) -> Vec<StructureChoice> {
        let flexible = elements("jointFlexible", &[self.structure().bodies()]).into_iter();
        flexible.map(|name| StructureChoice { name, is: ChosenAs::Flag }).collect()
    }

    /// What is never known exactly: masses, inertias, centres of mass, springs, rotors, friction that slides. Of an inertia its diagonal: an
    /// element off it is twice in the matrix, and changes with both.
    fn declare_dynamics(&self, t: &mut VariableTable) {
        let (s, from) = (self.structure(), Parameters::new(self.structure()));
        let n = s.bodies();
        let diagonals = (0..n).flat_map(|j| [0, 4, 8].map(|k| from.body_inertia + 9 * j + k));
        let base = [from.base_mass, from.base_inertia, from.base_inertia + 4, from.base_inertia + 8];
        let base = base.into_iter().filter(|_| !s.held);
        let springs = (0..n).filter(|j| self.motor_row(*j).is_some());
        let springs = springs.flat_map(|j| [from.joint_stiffness + j, from.joint_damping + j]);
        let own = (from.body_mass..from.body_mass + n)
            .chain(from.body_center..from.body_center + 3 * n)
            .chain(from.motor_inertia..from.motor_inertia + n);
        for k in own.chain(diagonals).chain(base).chain(springs) {
            t.parameters[k].role = QuantityRole::Dynamics;
        }
        for k in (0..n).flat_map(|j| [0, 4, 8].map(|k| from.body_inertia + 9 * j + k)) {
            t.parameters[k].min = 0.0;
        }
        let Some((dry, _)) = self.friction else { return };
        // Friction comes with an effect, and is not there where its levels are 0.
        for k in 0..n {
            [dry.coulomb, dry.breakaway, dry.viscous]
                .into_iter()
                .for_each(|begin| t.parameters[begin + k].neutral = Some(0.0));
            // Levels of what slides are refitted as masses are; what breaks away is not seen where it moves.
            for begin in [dry.coulomb, dry.viscous] {
                t.parameters[begin + k].role = QuantityRole::Dynamics;
            }
        }
    }

    /// Parameters of its springs and rotors, which are estimated unless chosen otherwise.
    pub(crate) fn usual(&self) -> Vec<usize> {
        let (n, from) = (self.structure().bodies(), Parameters::new(self.structure()));
        let of = |begin: usize| (0..n).filter(|j| self.motor_row(*j).is_some()).map(move |j| begin + j);
        [from.motor_inertia, from.joint_stiffness, from.joint_damping].into_iter().flat_map(of).collect()
    }
}

impl PlantModel for SpatialFreeFlyer {
    const NAME: &'static str = "SpatialFreeFlyer";

    fn table(&self) -> VariableTable {
        let s = self.structure();
        let servo = self.effects().servo();
        let drive = servo.map_or(Inputs::new(s).joint_torque, |servo| servo.begin.inputs);
        let friction = self.friction_lists();
        let mut t = VariableTable {
            parameters: compiled::parameters(&[Parameters::list(s), friction.0].concat(), &self.defaults()),
            inputs: compiled::inputs(&Inputs::list(s)),
            outputs: compiled::outputs(&[Outputs::list(s), friction.1].concat()),
            states: compiled::states(&States::list(s)),
            choices: self.choices(),
            driving: (drive..drive + s.bodies()).collect(),
            usual: self.usual(),
        };
        compiled::positive(&mut t);
        self.declare_dynamics(&mut t);
        compiled::rates_of(&self.coordinates(), &mut t);
        let to = Outputs::new(s);
        t.joint_angles((0..s.bodies()).flat_map(|j| [to.joint_angle + j, to.motor_angle + j]));
        compiled::add_effects(self.effects(), EffectPlant::Space, &mut t);
        t
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        let s = self.structure();
        let (row, from, to) = (States::new(s), Parameters::new(s), Outputs::new(s));
        // `joint`: whose drive moves by it.
        let own = |joint: Option<usize>,
                   name: String,
                   kind,
                   force_unit,
                   states: (Option<usize>, usize),
                   begin: [usize; 2],
                   shown: [usize; 2]| {
            Coordinate {
                name,
                kind,
                force_unit,
                position: states.0,
                rate: states.1,
                initial_position: begin[0],
                initial_rate: begin[1],
                position_output: shown[0],
                rate_output: shown[1],
                friction_mode: joint.filter(|_| self.friction.is_some()),
                dry_friction: joint
                    .and_then(|j| self.friction.map(|(p, _)| [p.coulomb + j, p.breakaway + j])),
                follows: None,
            }
        };
        let mut all = Vec::new();
        if !s.held {
            for (i, name) in elements("base", &[3]).into_iter().enumerate() {
                let states = (Some(row.base_position + i), row.base_velocity + i);
                let begin = [from.initial_base_position + i, from.initial_base_velocity + i];
                let shown = [to.base_position + i, to.base_velocity + i];
                all.push(own(None, name, CoordinateKind::Base, "N", states, begin, shown));
            }
            for (i, name) in elements("baseRotation", &[3]).into_iter().enumerate() {
                let states = (None, row.base_angular_velocity + i);
                let begin = [from.initial_base_quaternion + 1 + i, from.initial_base_angular_velocity + i];
                let shown = [to.base_quaternion + 1 + i, to.base_angular_velocity + i];
                all.push(own(None, name, CoordinateKind::Base, "N.m", states, begin, shown));
            }
        }
        let first = all.len();
        let unit = |j: usize| if s.tree.joint[j] == JointType::Prismatic { "N" } else { "N.m" };
        for (j, name) in elements("joint", &[s.bodies()]).into_iter().enumerate() {
            let (kind, drive) = match self.motor_row(j) {
                Some(_) => (CoordinateKind::Link, None),
                None => (CoordinateKind::Motor, Some(j)),
            };
            let states = (Some(row.joint_angle + j), row.joint_velocity + j);
            let begin = [from.initial_joint_angle + j, from.initial_joint_velocity + j];
            let shown = [to.joint_angle + j, to.joint_velocity + j];
            all.push(own(drive, name, kind, unit(j), states, begin, shown));
        }
        for (j, name) in elements("motor", &[s.bodies()]).into_iter().enumerate() {
            let Some(position) = self.motor_row(j) else { continue };
            let states = (Some(position), position - row.motor_angle + row.motor_velocity);
            let begin = [from.initial_motor_angle + j, from.initial_motor_velocity + j];
            let shown = [to.motor_angle + j, to.motor_velocity + j];
            let follows = Some(Follows { coordinate: first + j, ratio: None });
            let motor = own(Some(j), name, CoordinateKind::Motor, unit(j), states, begin, shown);
            all.push(Coordinate { follows, ..motor });
        }
        all
    }

    fn rates_under<T: Scalar>(&self, at: At<T>, force: &[T], dx: &mut [T]) {
        SpatialFreeFlyer::rates_under(self, at, PrescribedAccelerations::none(), force, dx);
    }

    fn with(&self, effects: &[&str]) -> Result<Self, PlantError> {
        Self::with_effects(self.structure().clone(), effects).map_err(PlantError)
    }

    fn effect_set(&self) -> Option<&EffectSet> {
        Some(self.effects())
    }
}

/// What a robot computes in addition to what every plant does, at either scalar of a plant. Not inlined, so that it is compiled here alone.
pub trait RobotScalar: PlantScalar {
    /// See [`SpatialFreeFlyer::mass_matrix`].
    fn mass_matrix(robot: &SpatialFreeFlyer, at: &At<Self>, m: &mut [Self]) -> usize;
    /// See [`SpatialFreeFlyer::rates_prescribed`].
    fn rates_prescribed(
        robot: &SpatialFreeFlyer,
        at: At<Self>,
        prescribed: PrescribedAccelerations<'_, Self>,
        dx: &mut [Self],
    );
}

macro_rules! robot_scalar {
    ($($scalar:ty)*) => {$(
        impl RobotScalar for $scalar {
            #[inline(never)]
            fn mass_matrix(robot: &SpatialFreeFlyer, at: &At<Self>, m: &mut [Self]) -> usize {
                robot.mass_matrix(at, m)
            }
            #[inline(never)]
            fn rates_prescribed(
                robot: &SpatialFreeFlyer,
                at: At<Self>,
                prescribed: PrescribedAccelerations<'_, Self>,
                dx: &mut [Self],
            ) {
                robot.rates_prescribed(at, prescribed, dx);
            }
        }
    )*};
}
robot_scalar!(f64 Lanes);
