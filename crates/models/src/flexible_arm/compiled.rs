//! The arm on the ground as a [`Plant`](trueup_plant::Plant).

use super::FlexibleArm;
use super::layout::{Parameters, inputs, outputs, parameters};
use crate::compiled::{self, PlantModel};
use crate::space::PrescribedAccelerations;
use crate::space::layout::{Inputs, States};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, Hybrid};
use trueup_plant::{Coordinate, PlantError, VariableTable};

impl PlantModel for FlexibleArm {
    const NAME: &'static str = "FlexibleArm";

    fn table(&self) -> VariableTable {
        let s = self.structure();
        let drive = Inputs::new(&s.robot).joint_torque;
        let mut t = VariableTable {
            parameters: compiled::parameters(&parameters(s), &self.defaults()),
            inputs: compiled::inputs(&inputs(s)),
            outputs: compiled::outputs(&outputs(s)),
            states: compiled::states(&States::list(&s.robot)),
            choices: self.bodies().choices(),
            driving: (drive..drive + self.joints()).collect(),
            usual: self.bodies().usual(),
        };
        compiled::positive(&mut t);
        compiled::rates_of(&self.coordinates(), &mut t);
        let angles = self.bodies().table().outputs.into_iter().enumerate();
        t.joint_angles(angles.filter(|(_, q)| q.is_joint_angle()).map(|(k, _)| k));
        t
    }

    /// Those of its bodies, the motors with their friction.
    fn coordinates(&self) -> Vec<Coordinate> {
        let own = Parameters::new(self.structure()).behind(self.bodies().sizes().parameters);
        let mut all = self.bodies().coordinates();
        let motors = (0..self.joints()).filter(|j| self.bodies().motor_row(*j).is_some());
        for (j, motor) in motors.zip(&mut all[self.joints()..]) {
            motor.friction_mode = Some(j);
            motor.dry_friction = Some([own.coulomb_friction + j, own.static_friction + j]);
        }
        all
    }

    fn rates_under<T: Scalar>(&self, at: At<T>, force: &[T], dx: &mut [T]) {
        let (u, stuck) = self.driven(&at);
        let own = At { u: &u[..at.u.len()], ..at };
        self.bodies().rates_under(
            own,
            PrescribedAccelerations { base: None, joints: &[], motors: &stuck },
            force,
            dx,
        );
    }

    fn with(&self, effects: &[&str]) -> Result<Self, PlantError> {
        compiled::no_effects(Self::NAME, effects).map(|()| self.clone())
    }
}
