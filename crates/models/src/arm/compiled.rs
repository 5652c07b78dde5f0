//! The manipulator as a [`Plant`](trueup_plant::Plant), and one whose motors have prescribed motion.

use super::layout::{ArmLayout, BASE_CHOICE, input, output, parameter, states};
use super::model::BASE_ROWS;
use super::payload::PAYLOAD;
use super::solve::Symmetric;
use super::{PlanarManipulator, Replay};
use crate::compiled::{self, PlantModel};
use crate::effect::{EffectSet, PlantKind as EffectPlant};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_plant::{
    ChosenAs, Coordinate, CoordinateKind, Follows, Lanes, PlantError, PlantQuantity, PlantScalar,
    QuantityRole, StructureChoice, VariableTable, elements,
};

impl PlanarManipulator {
    /// What decides which variables it has.
    pub fn layout(&self) -> ArmLayout {
        let motors = self.flexible().iter().filter(|f| **f).count();
        ArmLayout { links: self.links(), motors, friction: self.has_friction() }
    }

    /// What was chosen of its structure.
    fn choices(&self) -> Vec<StructureChoice> {
        let choice = |name: &str, is| StructureChoice { name: name.into(), is };
        let flexible = elements("jointFlexible", &[self.links()]);
        let flexible = flexible.iter().map(|name| choice(name, ChosenAs::Flag));
        let links = choice("numberOfLinks", ChosenAs::Count(self.links()));
        flexible.chain([links, choice(BASE_CHOICE, ChosenAs::Item)]).collect()
    }

    /// A joint's motor and its friction, at this row of the coordinates.
    fn moved_by_motor(&self, joint: usize, own: Coordinate) -> Coordinate {
        let n = self.links();
        let dry = [parameter::coulomb_friction(n) + joint, parameter::static_friction(n) + joint];
        Coordinate {
            kind: CoordinateKind::Motor,
            friction_mode: self.has_friction().then_some(joint),
            dry_friction: self.has_friction().then_some(dry),
            ..own
        }
    }
}

impl PlantModel for PlanarManipulator {
    const NAME: &'static str = "PlanarManipulator";

    fn table(&self) -> VariableTable {
        let s = self.layout();
        let n = s.links;
        let flexible = || (0..n).filter(|j| self.flexible()[*j]);
        let servo = self.effects().servo();
        let driven = servo.map_or(input::joint_torque(n), |servo| servo.begin.inputs);
        let mut t = VariableTable {
            parameters: compiled::parameters(&parameter::list(&s), &self.defaults()),
            inputs: compiled::inputs(&input::list(&s)),
            outputs: compiled::outputs(&output::list(&s)),
            states: compiled::states(&states(&s)),
            choices: self.choices(),
            driving: (0..n).map(|j| driven + j).collect(),
            usual: [parameter::motor_inertia(n), parameter::joint_stiffness(n), parameter::joint_damping(n)]
                .into_iter()
                .flat_map(|begin| flexible().map(move |j| begin + j))
                .collect(),
        };
        let base = (!self.has_fixed_base()).then_some([parameter::base_mass(n), parameter::base_inertia(n)]);
        let each = [parameter::gear_ratio(n), parameter::link_mass(n), parameter::link_inertia(n)];
        let each = each.into_iter().flat_map(|begin| begin..begin + n);
        let dynamics = [
            parameter::base_mass(n)..parameter::mount_position(n),
            parameter::link_mass(n)..parameter::link_length(n),
            parameter::link_center_of_mass(n)..parameter::gear_ratio(n),
            parameter::joint_stiffness(n)..parameter::initial_base_position(n),
        ];
        dynamics.into_iter().flatten().for_each(|k| t.parameters[k].role = QuantityRole::Dynamics);
        // The rotor of a rigid joint may be neglected.
        let rotors = flexible().map(|j| parameter::motor_inertia(n) + j);
        for k in base.into_iter().flatten().chain(each).chain(rotors) {
            t.parameters[k].positive = true;
        }
        // Friction comes with an effect, and is not there where its levels are 0.
        let dry = parameter::count(n)..t.parameters.len();
        t.parameters[dry.clone()].iter_mut().for_each(|q| q.neutral = Some(0.0));
        // Levels of what slides are refitted as masses are; what breaks away is not seen where it moves.
        let slides = [parameter::coulomb_friction(n), parameter::viscous_friction(n)];
        let slides = slides.into_iter().flat_map(|begin| begin..begin + n).filter(|k| dry.contains(k));
        slides.for_each(|k| t.parameters[k].role = QuantityRole::Dynamics);
        compiled::rates_of(&self.coordinates(), &mut t);
        for k in 0..n {
            let (rate, of) = (parameter::initial_motor_velocity(n), parameter::initial_motor_angle(n));
            VariableTable::rate(&mut t.parameters, rate + k, of + k);
            VariableTable::rate(&mut t.outputs, output::motor_velocity(n) + k, output::motor_angle(n) + k);
        }
        // Of a base that is fixed too, which has no coordinates.
        for (rate, of) in [
            (parameter::initial_base_velocity(n), parameter::initial_base_position(n)),
            (parameter::initial_base_velocity(n) + 1, parameter::initial_base_position(n) + 1),
            (parameter::initial_base_rate(n), parameter::initial_base_attitude(n)),
        ] {
            VariableTable::rate(&mut t.parameters, rate, of);
        }
        for (rate, of) in [
            (output::base_velocity(n), output::base_position(n)),
            (output::base_velocity(n) + 1, output::base_position(n) + 1),
            (output::base_rate(n), output::base_attitude(n)),
            (output::tip_velocity(n), output::tip_position(n)),
            (output::tip_velocity(n) + 1, output::tip_position(n) + 1),
            (output::tip_rate(n), output::tip_attitude(n)),
        ] {
            VariableTable::rate(&mut t.outputs, rate, of);
        }
        t.joint_angles((0..n).flat_map(|k| [output::joint_angle(n) + k, output::motor_angle(n) + k]));
        compiled::add_effects(self.effects(), EffectPlant::Arm, &mut t);
        if self.payload().is_some() {
            let carried = |p: &super::PayloadParameter| PlantQuantity {
                neutral: Some(0.0),
                absolute_deviation: p.absolute_doubt,
                role: QuantityRole::Dynamics,
                ..PlantQuantity::new(p.name, p.unit).at_least(p.min)
            };
            t.parameters.extend(PAYLOAD.iter().map(carried));
        }
        t
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        let n = self.links();
        let own = |name: String,
                   row: usize,
                   force_unit,
                   [initial_position, position_output]: [usize; 2],
                   [initial_rate, rate_output]: [usize; 2]| Coordinate {
            name,
            kind: CoordinateKind::Base,
            force_unit,
            position: Some(row),
            rate: self.dofs() + row,
            initial_position,
            initial_rate,
            position_output,
            rate_output,
            friction_mode: None,
            dry_friction: None,
            follows: None,
        };
        let mut all = Vec::new();
        if !self.has_fixed_base() {
            for (i, name) in elements("base", &[2]).into_iter().enumerate() {
                let position = [parameter::initial_base_position(n) + i, output::base_position(n) + i];
                let rate = [parameter::initial_base_velocity(n) + i, output::base_velocity(n) + i];
                all.push(own(name, i, "N", position, rate));
            }
            let position = [parameter::initial_base_attitude(n), output::base_attitude(n)];
            let rate = [parameter::initial_base_rate(n), output::base_rate(n)];
            all.push(own("baseAttitude".into(), 2, "N.m", position, rate));
        }
        let first = all.len();
        for (j, name) in elements("joint", &[n]).into_iter().enumerate() {
            let position = [parameter::initial_joint_angle(n) + j, output::joint_angle(n) + j];
            let rate = [parameter::initial_joint_velocity(n) + j, output::joint_velocity(n) + j];
            let joint = own(name, BASE_ROWS + j, "N.m", position, rate);
            let link = Coordinate { kind: CoordinateKind::Link, ..joint.clone() };
            all.push(if self.flexible()[j] { link } else { self.moved_by_motor(j, joint) });
        }
        for (j, name) in elements("motor", &[n]).into_iter().enumerate().filter(|(j, _)| self.flexible()[*j])
        {
            let position = [parameter::initial_motor_angle(n) + j, output::motor_angle(n) + j];
            let rate = [parameter::initial_motor_velocity(n) + j, output::motor_velocity(n) + j];
            let motor = own(name, self.motor(j), "N.m", position, rate);
            let follows = Some(Follows { coordinate: first + j, ratio: None });
            all.push(Coordinate { follows, ..self.moved_by_motor(j, motor) });
        }
        all
    }

    fn rates_under<T: Scalar>(&self, at: At<T>, force: &[T], dx: &mut [T]) {
        PlanarManipulator::rates_under(self, at, &[], force, dx);
    }

    fn effect_set(&self) -> Option<&EffectSet> {
        Some(self.effects())
    }

    fn followers(&self) -> Vec<usize> {
        compiled::followers(self.effects())
    }

    fn with(&self, effects: &[&str]) -> Result<Self, PlantError> {
        let made = Self::on_base(self.has_fixed_base(), &self.declared_flexible, effects);
        Ok(made.map_err(|e| PlantError(e.to_string()))?.with_payload(self.payload()))
    }
}

impl PlantModel for Replay {
    const NAME: &'static str = PlanarManipulator::NAME;

    fn table(&self) -> VariableTable {
        let mut t = self.arm.table();
        let names = elements("motorAcceleration", &[self.arm.links()]);
        t.inputs.extend(self.led.iter().map(|j| PlantQuantity {
            description: "Measured; the torque for it is not computed".into(),
            ..PlantQuantity::new(names[*j].clone(), "rad/s2")
        }));
        t
    }
    fn coordinates(&self) -> Vec<Coordinate> {
        self.arm.coordinates()
    }
    fn rates_under<T: Scalar>(&self, at: At<T>, force: &[T], dx: &mut [T]) {
        Replay::rates_under(self, at, force, dx);
    }
    fn effect_set(&self) -> Option<&EffectSet> {
        Some(self.arm.effects())
    }
    fn followers(&self) -> Vec<usize> {
        self.arm.followers()
    }
    fn with(&self, effects: &[&str]) -> Result<Self, PlantError> {
        Self::new(self.arm.with(effects)?, &self.led).ok_or_else(|| {
            PlantError("a manipulator with friction cannot follow measured motion; record jointTorque".into())
        })
    }
}

/// What an arm computes in addition to what every plant does, at either scalar of a plant. Not inlined, so that it is compiled here alone.
pub trait ArmScalar: PlantScalar {
    /// See [`PlanarManipulator::rates_prescribed`].
    fn rates_prescribed(arm: &PlanarManipulator, at: At<Self>, led: &[(usize, Self)], dx: &mut [Self]);
    /// See [`PlanarManipulator::mass_matrix`].
    fn mass_matrix(arm: &PlanarManipulator, x: &[Self], p: &[Self]) -> Symmetric<Self>;
}

macro_rules! arm_scalar {
    ($($scalar:ty)*) => {$(
        impl ArmScalar for $scalar {
            #[inline(never)]
            fn rates_prescribed(arm: &PlanarManipulator, at: At<Self>, led: &[(usize, Self)], dx: &mut [Self]) {
                arm.rates_prescribed(at, led, dx);
            }
            #[inline(never)]
            fn mass_matrix(arm: &PlanarManipulator, x: &[Self], p: &[Self]) -> Symmetric<Self> {
                arm.mass_matrix(x, p)
            }
        }
    )*};
}
arm_scalar!(f64 Lanes);
