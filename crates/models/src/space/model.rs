//! `SpatialFreeFlyer`: its structure and where its values are.

use super::MAX_BODIES;
use super::attitude::{about, four, rotation, unit};
use super::joint_drive::{JointDrive, Moves, Rotor};
use super::layout::{FrictionOutputs, FrictionParameters, Inputs, Outputs, Parameters, States};
use super::structure::RobotStructure;
use super::tree::JointType;
use super::vector::{Vector3, add, scale, three, times};
use crate::arm::rotor;
use crate::effect::{EffectChoice, EffectSet, PlantKind};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, ModelSizes};

/// A base with arms and panels in space (S1 eq. 9-17, S2 eq. 1-18): its structure and where its values are.
///
/// Continuous states: r \[m\], Q, q_1 .. q_n \[rad; m\], q_m of the flexible joints, eta of the panels \[m; rad\], the velocity
/// of the base \[m/s, inertial axes\], its rate \[rad/s, base axes\], the rates of joints, those motors and modes; see
/// [`super::layout::States`].
///
/// What it gets wrong: nothing stiffens a panel that spins, no orbit, no gravity gradient, no air; bodies do not touch, plumes
/// do not push.
#[derive(Clone, Debug)]
pub struct SpatialFreeFlyer {
    pub(super) structure: RobotStructure,
    pub(super) state: States,
    pub(super) parameter: Parameters,
    pub(super) input: Inputs,
    pub(super) output: Outputs,
    /// Per joint: which of the springs is its own.
    pub(super) spring: [Option<usize>; MAX_BODIES],
    pub(super) effects: EffectSet,
    /// Of the friction that one of them brings along.
    pub(super) friction: Option<(FrictionParameters, FrictionOutputs)>,
    pub(super) sizes: ModelSizes,
}

impl SpatialFreeFlyer {
    /// A model of that structure.
    ///
    /// # Errors
    /// What of it cannot be, with the remedy.
    pub fn new(structure: RobotStructure) -> Result<Self, String> {
        Self::with_effects::<&str>(structure, &[])
    }

    /// The same with the effects of those ids; `joint-flexibility` makes all joints flexible. Their values are behind the robot's, those of
    /// the friction that some bring along between.
    ///
    /// # Errors
    /// What of it cannot be, with the remedy.
    pub fn with_effects<S: AsRef<str>>(mut structure: RobotStructure, ids: &[S]) -> Result<Self, String> {
        if ids.iter().any(|id| id.as_ref() == "joint-flexibility") {
            structure.flexible.fill(true);
        }
        structure.check()?;
        let (state, parameter) = (States::new(&structure), Parameters::new(&structure));
        let (input, output) = (Inputs::new(&structure), Outputs::new(&structure));
        let mut spring = [None; MAX_BODIES];
        let flexible = structure.flexible.iter().enumerate().filter(|(_, f)| **f);
        flexible.enumerate().for_each(|(k, (j, _))| spring[j] = Some(k));
        let mut sizes = ModelSizes {
            states: state.count,
            inputs: input.count,
            parameters: parameter.count,
            outputs: output.count,
            modes: 0,
            indicators: 0,
        };
        let choices = ids.iter().filter_map(|id| EffectChoice::parse(id.as_ref(), PlantKind::Space).ok());
        let mut friction = None;
        if choices.into_iter().any(|c| c.spec().friction) {
            let n = structure.bodies();
            let of = (
                FrictionParameters::new(&n).behind(sizes.parameters),
                FrictionOutputs::new(&n).behind(sizes.outputs),
            );
            (sizes.parameters, sizes.outputs) = (of.0.count, of.1.count);
            (sizes.modes, sizes.indicators) = (n, 2 * n);
            friction = Some(of);
        }
        let span = |name: &str| {
            let mut first = 0;
            for e in Outputs::list(&structure) {
                if e.name == name {
                    return Some((first, e.len()));
                }
                first += e.len();
            }
            None
        };
        let effects = EffectSet::place_with(ids, PlantKind::Space, structure.bodies(), span, &mut sizes)
            .map_err(|e| e.to_string())?;
        let model = Self { structure, state, parameter, input, output, spring, effects, friction, sizes };
        model.check_effects().map(|()| model)
    }

    /// What is fixed.
    pub fn structure(&self) -> &RobotStructure {
        &self.structure
    }

    /// Row of the angle of this joint's motor among the states, if it moves by itself.
    pub fn motor_row(&self, joint: usize) -> Option<usize> {
        self.spring[joint].map(|k| self.state.motor_angle + k)
    }

    /// A joint with its motor.
    pub(super) fn drive<T: Scalar>(&self, at: &At<T>, j: usize) -> JointDrive<T> {
        if !self.effects.is_empty() {
            return self.affected_drive(at, j);
        }
        let p = &self.parameter;
        let torque = at.u[self.input.joint_torque + j];
        let (moves, rotor, rate) = match self.spring[j] {
            None => (torque, Rotor::Geared, at.x[self.state.joint_velocity + j]),
            Some(k) => {
                let spring = self.spring_torque(at, j, k);
                (spring, Rotor::Driven(torque - spring), at.x[self.state.motor_velocity + k])
            }
        };
        JointDrive {
            moves: Moves::Driven(moves),
            rotor,
            inertia: at.p[p.motor_inertia + j],
            share: rotor::share(at.p[p.motor_coupling], at.p[p.gear_ratio + j]),
            rate,
        }
    }

    /// Of spring `k`, that of joint `j`, on the body: k (q_m - q) + b (d(q_m) - d(q)) (S0 eq. 2).
    fn spring_torque<T: Scalar>(&self, at: &At<T>, j: usize, k: usize) -> T {
        let (x, row) = (at.x, &self.state);
        at.p[self.parameter.joint_stiffness + j] * (x[row.motor_angle + k] - x[row.joint_angle + j])
            + at.p[self.parameter.joint_damping + j] * (x[row.motor_velocity + k] - x[row.joint_velocity + j])
    }

    /// Energy of the springs, J; with effects theirs too.
    pub(super) fn spring_energy<T: Scalar>(&self, at: &At<T>) -> T {
        if !self.effects.is_empty() {
            return self.affected_energy(at);
        }
        let mut sum = T::zero();
        for (j, k) in self.spring.iter().enumerate().filter_map(|(j, k)| k.map(|k| (j, k))) {
            let twist = at.x[self.state.motor_angle + k] - at.x[self.state.joint_angle + j];
            sum += at.p[self.parameter.joint_stiffness + j] * twist * twist * 0.5;
        }
        sum
    }

    /// Of the spring and damper of a joint on its body, N.m (N); 0 of a rigid joint.
    pub fn transmission_torque<T: Scalar>(&self, at: &At<T>, joint: usize) -> T {
        let linear = |k| self.spring_torque(at, joint, k);
        let affected = |_| self.affected_spring(at, joint, &self.drive_train(at, joint)).torque();
        let of = self.spring[joint];
        if self.effects.is_empty() { of.map(linear) } else { of.map(affected) }.unwrap_or_else(T::zero)
    }

    /// Where the first tip of a robot whose base is held would be at these coordinates of its joints, links straight, inertial
    /// axes, m.
    pub fn straight_tip<T: Scalar>(&self, p: &[T], q: &[T]) -> Vector3<T> {
        let (s, at) = (&self.structure, &self.parameter);
        let mut point = three(p, at.tip_offset);
        for j in s.tree.arm(s.tips.first().copied().unwrap_or(0)).map(|body| body - 1) {
            let axis = unit(three(p, at.joint_axis + 3 * j));
            let moved = match s.tree.joint[j] {
                JointType::Revolute => times(&about(axis, q[j]), point),
                JointType::Prismatic => add(point, scale(q[j], axis)),
            };
            let mount = rotation(four(p, at.joint_orientation + 4 * j));
            point = add(three(p, at.joint_position + 3 * j), times(&mount, moved));
        }
        add(three(p, at.initial_base_position), times(&rotation(four(p, at.initial_base_quaternion)), point))
    }
}
