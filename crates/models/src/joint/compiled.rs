//! The joint as a [`Plant`](trueup_plant::Plant).

use super::{JointLayout, TwoMassJoint, input, output, parameter, states};
use crate::compiled::{self, PlantModel};
use crate::effect::{EffectSet, PlantKind as EffectPlant};
use crate::presets;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_plant::{
    ChosenAs, Coordinate, CoordinateKind, Follows, PlantError, StructureChoice, VariableTable,
};

impl TwoMassJoint {
    /// What decides which variables it has; `gear_ratio` is the one packed, if it is another than the preset's.
    pub fn layout(&self, gear_ratio: Option<f64>) -> JointLayout {
        let preset = presets::delian(1).unwrap_or_default();
        JointLayout {
            flexible: self.flexible(),
            plain: self.effects().iter().next().is_none(),
            gear_ratio: gear_ratio.unwrap_or(preset[parameter::GEAR_RATIO]),
        }
    }
}

impl PlantModel for TwoMassJoint {
    const NAME: &'static str = "TwoMassJoint";

    fn table(&self) -> VariableTable {
        let s = self.layout(None);
        let start = presets::delian(1).unwrap_or_default();
        let spring: &[usize] = if s.flexible { &[parameter::STIFFNESS, parameter::DAMPING] } else { &[] };
        let friction = [parameter::COULOMB_FRICTION, parameter::VISCOUS_FRICTION, parameter::STATIC_FRICTION];
        let mut t = VariableTable {
            parameters: compiled::parameters(&parameter::list(&s), &start),
            inputs: compiled::inputs(&input::list(&s)),
            outputs: compiled::outputs(&output::list(&s)),
            states: compiled::states(&states(&s)),
            choices: vec![StructureChoice { name: "jointFlexible".into(), is: ChosenAs::Flag }],
            driving: vec![self.effects().servo().map_or(input::MOTOR_CURRENT, |servo| servo.begin.inputs)],
            usual: [spring, &friction].concat(),
        };
        for k in [parameter::GEAR_RATIO, parameter::LOAD_INERTIA, parameter::MOTOR_INERTIA] {
            t.parameters[k].positive = true;
        }
        compiled::rates_of(&self.coordinates(), &mut t);
        // The load's too, whose position is no state; of a rigid joint it is no coordinate.
        let (rate, of) = (parameter::INITIAL_LOAD_VELOCITY, parameter::INITIAL_LOAD_ANGLE);
        VariableTable::rate(&mut t.parameters, rate, of);
        VariableTable::rate(&mut t.outputs, output::LOAD_VELOCITY, output::LOAD_ANGLE);
        t.joint_angles([output::MOTOR_ANGLE, output::LOAD_ANGLE]);
        VariableTable::rate(&mut t.outputs, output::MOTOR_ACCELERATION, output::MOTOR_VELOCITY);
        VariableTable::rate(&mut t.outputs, output::LOAD_ACCELERATION, output::LOAD_VELOCITY);
        compiled::add_effects(self.effects(), EffectPlant::Joint, &mut t);
        t
    }

    fn coordinates(&self) -> Vec<Coordinate> {
        let motor = Coordinate {
            name: "motor".into(),
            kind: CoordinateKind::Motor,
            force_unit: "N.m",
            position: Some(0),
            rate: 1,
            initial_position: parameter::INITIAL_MOTOR_ANGLE,
            initial_rate: parameter::INITIAL_MOTOR_VELOCITY,
            position_output: output::MOTOR_ANGLE,
            rate_output: output::MOTOR_VELOCITY,
            friction_mode: Some(0),
            dry_friction: Some([parameter::COULOMB_FRICTION, parameter::STATIC_FRICTION]),
            follows: None,
        };
        let load = Coordinate {
            name: "load".into(),
            kind: CoordinateKind::Link,
            force_unit: "N.m",
            position: None,
            rate: 3,
            initial_position: parameter::INITIAL_LOAD_ANGLE,
            initial_rate: parameter::INITIAL_LOAD_VELOCITY,
            position_output: output::LOAD_ANGLE,
            rate_output: output::LOAD_VELOCITY,
            friction_mode: None,
            dry_friction: None,
            follows: Some(Follows { coordinate: 0, ratio: Some(parameter::GEAR_RATIO) }),
        };
        if self.flexible() { vec![motor, load] } else { vec![motor] }
    }

    fn rates_under<T: Scalar>(&self, at: At<T>, force: &[T], dx: &mut [T]) {
        TwoMassJoint::rates_under(self, at, force, dx);
    }

    fn with(&self, effects: &[&str]) -> Result<Self, PlantError> {
        Self::new(self.declared_flexible, effects).map_err(|e| PlantError(e.to_string()))
    }

    fn effect_set(&self) -> Option<&EffectSet> {
        Some(self.effects())
    }

    fn affine(&self) -> bool {
        self.effects().iter().all(|e| e.spec().affine)
    }

    fn followers(&self) -> Vec<usize> {
        compiled::followers(self.effects())
    }

    /// Both velocities 0, the spring carries the external torque; the motor angle stays, friction holds it.
    fn rest<T: Scalar>(&self, p: &mut [T], u: &[T]) {
        p[parameter::INITIAL_MOTOR_VELOCITY] = T::zero();
        p[parameter::INITIAL_LOAD_VELOCITY] = T::zero();
        let n = p[parameter::GEAR_RATIO];
        let twist = if self.flexible() {
            -u[input::EXTERNAL_TORQUE] / (n * p[parameter::STIFFNESS])
        } else {
            T::zero()
        };
        p[parameter::INITIAL_LOAD_ANGLE] = (p[parameter::INITIAL_MOTOR_ANGLE] - twist) / n;
    }
}
