//! Effects in a robot: at its drives, at its base and first tip, in its readings; with the dry friction that some bring along.
//!
//! A robot without effects calls none of this.

use super::articulated::SweepResult;
use super::composite::composite_bodies;
use super::flexible::Modal;
use super::instant::RobotInstant;
use super::joint_drive::{JointDrive, Moves, Rotor};
use super::layout::{FrictionOutputs, FrictionParameters};
use super::model::SpatialFreeFlyer;
use super::spatial::SpatialWrench;
use super::stick::StickSlip;
use super::tree::{Joints, PlacedBody, subspace};
use super::vector::times;
use super::{MAX_BODIES, MAX_MODES, MAX_STATES, MAX_TIPS};
use crate::arm::rotor;
use crate::drive::{DriveTrain, FlyerBase, Spring};
use crate::effect::{EffectError, EffectSet, Scope};
use crate::friction::{self, Levels, SMOOTH, STUCK};
use crate::layout::{LayoutEntry, Parameter, Shows};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate};

/// Start values of friction that an effect brings along: of tau_c, tau_s, D_m, small but visible.
const FRICTION: [f64; 3] = [0.005, 0.008, 0.01];

/// Outputs of base, joints and tips, which come first, at most.
const MAX_READINGS: usize = 13 + 4 * MAX_BODIES + 13 * MAX_TIPS;

impl SpatialFreeFlyer {
    /// Its effects.
    pub fn effects(&self) -> &EffectSet {
        &self.effects
    }

    /// Start values of what friction and effects add to the parameters: small but visible.
    pub fn effect_defaults(&self) -> Vec<f64> {
        let mut p = Vec::new();
        if self.friction.is_some() {
            FRICTION.iter().for_each(|start| p.resize(p.len() + self.structure.bodies(), *start));
        }
        for e in self.effects.iter() {
            for spec in e.choice.parameters() {
                p.resize(p.len() + e.sites, spec.arm_start);
            }
        }
        p
    }

    /// The parameters and the outputs of the friction that an effect brings along: behind the robot's own.
    pub fn friction_lists(&self) -> (Vec<LayoutEntry<Parameter>>, Vec<LayoutEntry<Shows>>) {
        let n = self.structure.bodies();
        match self.friction {
            Some(_) => (FrictionParameters::list(&n), FrictionOutputs::list(&n)),
            None => (Vec::new(), Vec::new()),
        }
    }

    /// Whether each effect has something to act on, and fits.
    pub(super) fn check_effects(&self) -> Result<(), String> {
        let s = &self.structure;
        for e in self.effects.iter() {
            let missing = match (e.choice.component(), e.choice.scope()) {
                _ if e.spec().compliant && s.springs() == 0 => {
                    "all joints are rigid; make one flexible (jointFlexible), or add joint-flexibility"
                }
                ("base", _) if s.held => "the base is held; leave the effect out, or let the base float",
                ("tip", _) if s.tips.is_empty() => "the robot has no tip; give it one",
                (_, Scope::Joint) if s.bodies() == 0 => "the robot has no joint; leave the effect out",
                _ => continue,
            };
            return Err(EffectError::Nothing(e.spec().id, missing).to_string());
        }
        let states = self.sizes.states;
        if states > MAX_STATES {
            return Err(format!("{states} states cannot be had, at most {MAX_STATES}: use fewer effects"));
        }
        Ok(())
    }

    /// Joint `j` as effects see it.
    pub(super) fn drive_train<T: Scalar>(&self, at: &At<T>, j: usize) -> DriveTrain<T> {
        let row = &self.state;
        let (joint, joint_rate) = (at.x[row.joint_angle + j], at.x[row.joint_velocity + j]);
        let (theta, omega) = match self.spring[j] {
            Some(k) => (at.x[row.motor_angle + k], at.x[row.motor_velocity + k]),
            None => (joint, joint_rate),
        };
        // There is none at the start.
        let command = at.u.get(self.input.joint_torque + j).copied().unwrap_or_else(T::zero);
        let mut d = DriveTrain {
            t: at.t,
            command,
            torque: command,
            theta,
            omega,
            ratio: T::one(),
            shaft: at.p[self.parameter.gear_ratio + j],
            epsilon: theta - joint,
            epsilon_dot: omega - joint_rate,
            joint_rate,
            ..DriveTrain::default()
        };
        self.effects.gear(at, j, &mut d);
        if self.friction.is_some() {
            d.carried = match self.spring[j] {
                Some(_) => self.affected_spring(at, j, &d).torque(),
                None => self.effects.actuator(at, j, &d),
            };
            d.levels = self.levels(at, j, &d, friction::direction(SMOOTH, d.omega));
        }
        d
    }

    /// The spring of joint `j`.
    pub(super) fn affected_spring<T: Scalar>(&self, at: &At<T>, j: usize, d: &DriveTrain<T>) -> Spring<T> {
        let p = &self.parameter;
        let linear = Spring::linear(at.p[p.joint_stiffness + j], at.p[p.joint_damping + j], d);
        self.effects.spring(at, j, d, linear)
    }

    /// Friction in direction +1 or -1.
    fn levels<T: Scalar>(&self, at: &At<T>, j: usize, d: &DriveTrain<T>, way: f64) -> Levels<T> {
        let Some((p, _)) = &self.friction else { return Levels::default() };
        let [coulomb, breakaway, viscous] = [p.coulomb, p.breakaway, p.viscous].map(|begin| at.p[begin + j]);
        self.effects.friction(at, j, d, way, friction::paper(coulomb, breakaway, viscous, d.omega * way))
    }

    /// Friction's mode; without modes yet: smooth.
    fn friction_mode(&self, modes: &[i32], j: usize) -> i32 {
        self.friction.and_then(|_| modes.get(j).copied()).unwrap_or(SMOOTH)
    }

    /// Friction against the motion of a drive that slides; 0 of one that sticks.
    fn sliding<T: Scalar>(&self, at: &At<T>, j: usize, d: &DriveTrain<T>) -> T {
        match self.friction_mode(at.modes, j) {
            _ if self.friction.is_none() => T::zero(),
            STUCK => T::zero(),
            mode => {
                let way = friction::direction(mode, d.omega);
                self.levels(at, j, d, way).braking() * way
            }
        }
    }

    /// What drives joint `j` and its rotor, but for friction: of a rigid joint both are one.
    fn torques<T: Scalar>(&self, at: &At<T>, j: usize, d: &DriveTrain<T>) -> [T; 2] {
        let (motor, own) = (self.effects.actuator(at, j, d), self.effects.joint_torque(at, j, d));
        if self.spring[j].is_none() {
            return [motor + own; 2];
        }
        let pull = self.affected_spring(at, j, d).torque();
        [pull + own, motor - pull * (-d.slope + 1.0)]
    }

    /// A joint with its motor.
    #[cold]
    #[inline(never)]
    pub(super) fn affected_drive<T: Scalar>(&self, at: &At<T>, j: usize) -> JointDrive<T> {
        let d = self.drive_train(at, j);
        let sticks = self.friction_mode(at.modes, j) == STUCK;
        let ([joint, motor], braking) = (self.torques(at, j, &d), self.sliding(at, j, &d));
        let (moves, rotor) = match self.spring[j] {
            None if sticks => (Moves::Prescribed(T::zero()), Rotor::Geared),
            None => (Moves::Driven(joint - braking), Rotor::Geared),
            Some(_) if sticks => (Moves::Driven(joint), Rotor::Prescribed(T::zero())),
            Some(_) => (Moves::Driven(joint), Rotor::Driven(motor - braking)),
        };
        let p = &self.parameter;
        JointDrive {
            moves,
            rotor,
            inertia: at.p[p.motor_inertia + j],
            share: rotor::share(at.p[p.motor_coupling], at.p[p.gear_ratio + j]),
            rate: d.omega,
        }
    }

    /// On the base at its centre of mass, and on the body of the first tip at that tip; inertial axes.
    pub(super) fn effect_wrenches<T: Scalar>(
        &self,
        at: &At<T>,
        base: &PlacedBody<T>,
    ) -> (SpatialWrench<T>, SpatialWrench<T>) {
        let rotation = base.frame.rotation;
        let b = FlyerBase {
            t: at.t,
            rotation,
            velocity: times(&rotation, base.velocity.linear),
            rate: times(&rotation, base.velocity.angular),
        };
        (self.effects.space_base(at, &b), self.effects.space_tip(at, &b))
    }

    /// Energy of springs and effects, J.
    #[cold]
    #[inline(never)]
    pub(super) fn affected_energy<T: Scalar>(&self, at: &At<T>) -> T {
        let mut sum = T::zero();
        for j in 0..self.structure.bodies() {
            let d = self.drive_train(at, j);
            if self.spring[j].is_some() {
                sum += self.affected_spring(at, j, &d).energy();
            }
            sum += self.effects.energy(at, j, &d)[1];
        }
        sum
    }

    /// Rates of the effects' states.
    #[cold]
    #[inline(never)]
    pub(super) fn effect_rates<T: Scalar>(&self, at: &At<T>, dx: &mut [T]) {
        for j in 0..self.structure.bodies() {
            let d = self.drive_train(at, j);
            let spring = self.spring[j].map(|_| self.affected_spring(at, j, &d)).unwrap_or_default();
            self.effects.rates(at, j, &d, &spring, dx);
        }
        if self.effects.sensors_have_states() {
            let mut y = [T::zero(); MAX_READINGS];
            self.readings(at, &mut y);
            self.effects.sensor_rates(at, &mut y, dx);
        }
    }

    /// Their initial states, behind those of the robot.
    #[cold]
    #[inline(never)]
    pub(super) fn start_effects<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        for j in 0..self.structure.bodies() {
            let d = self.drive_train(&At { t: T::zero(), x, u: &[], p, modes: &[] }, j);
            self.effects.start(p, j, &d, x);
        }
        if self.effects.sensors_have_states() {
            let mut y = [T::zero(); MAX_READINGS];
            self.readings(&At { t: T::zero(), x, u: &[], p, modes: &[] }, &mut y);
            self.effects.sensor_start(p, &mut y, x);
        }
    }

    /// The effects' modes that fit this instant; true where one changed.
    fn fit_modes(&self, at: &At<f64>, modes: &mut [i32]) -> bool {
        (0..self.structure.bodies().max(1)).fold(false, |changed, j| {
            let d = if j < self.structure.bodies() {
                self.drive_train(at, j)
            } else {
                DriveTrain { t: at.t, ..DriveTrain::default() }
            };
            self.effects.update(at, j, &d, modes) || changed
        })
    }

    /// Modes at the start.
    pub(super) fn start_effect_modes(&self, at: At<f64>, modes: &mut [i32]) {
        // The caller need not have modes yet.
        let none = [0; MAX_MODES];
        let at = At { modes: &none[..modes.len()], ..at };
        self.fit_modes(&at, modes);
        if self.friction.is_some() {
            self.start_friction(&at, modes);
        }
    }

    /// One pass of event iteration.
    pub(super) fn update_effects(
        &self,
        t: f64,
        x: &mut [f64],
        u: &[f64],
        p: &[f64],
        modes: &mut [i32],
    ) -> EventUpdate {
        let mut frozen = [0; MAX_MODES];
        let frozen = &mut frozen[..modes.len()];
        frozen.copy_from_slice(modes);
        let changed = self.fit_modes(&At { t, x, u, p, modes: frozen }, modes);
        if changed || self.friction.is_none() {
            return EventUpdate { modes: changed, states: false };
        }
        self.update_friction(t, x, u, p, modes)
    }

    /// Indicators of friction, then of effects.
    pub(super) fn effect_indicators<T: Scalar>(&self, at: &At<T>, z: &mut [T]) {
        if self.friction.is_some() {
            self.friction_indicators(at, z);
        }
        for j in 0..self.structure.bodies() {
            self.effects.indicators(at, j, &self.drive_train(at, j), z);
        }
    }

    /// Outputs of friction and effects, and what sensors show of the others. `needed`: torques that prescribed motions take.
    #[cold]
    #[inline(never)]
    pub(super) fn effect_outputs<T: Scalar>(&self, at: &At<T>, needed: &[T], y: &mut [T]) {
        for j in 0..self.structure.bodies() {
            let d = self.drive_train(at, j);
            if let Some((_, to)) = &self.friction {
                let sticks = self.friction_mode(at.modes, j) == STUCK;
                let held = self.torques(at, j, &d)[1] - needed[j];
                y[to.torque + j] = if sticks { held } else { self.sliding(at, j, &d) };
                y[to.sticking + j] = T::constant(if sticks { 1.0 } else { 0.0 });
            }
            self.effects.outputs(at, j, &d, y);
        }
        self.effects.sense(at, y);
    }
}

impl StickSlip for SpatialFreeFlyer {
    fn joints(&self) -> usize {
        self.structure.bodies()
    }
    fn rate_row(&self, joint: usize) -> usize {
        self.spring[joint].map_or(self.state.joint_velocity + joint, |k| self.state.motor_velocity + k)
    }
    fn both_levels<T: Scalar>(&self, at: &At<T>, joint: usize) -> [Levels<T>; 2] {
        let d = self.drive_train(at, joint);
        [1.0, -1.0].map(|way| self.levels(at, joint, &d, way))
    }
    fn dry(&self, p: &[f64], joint: usize) -> bool {
        let own = |begin: usize| p[begin + joint] > 0.0;
        self.friction.is_some_and(|(at, _)| own(at.coulomb) || own(at.breakaway))
            || self.effects.dry(p, joint)
    }
    fn overstep(&self, at: &At<f64>, joint: usize) -> f64 {
        let d = self.drive_train(at, joint);
        let torque = self.levels(at, joint, &d, 1.0).breakaway + self.torques(at, joint, &d)[1].abs();
        let inertia = if self.spring[joint].is_some() {
            at.p[self.parameter.motor_inertia + joint]
        } else {
            let mut now = RobotInstant::new();
            now.set(self, at);
            let along = subspace(self.structure.tree.joint[joint], now.axis(joint + 1));
            let carried = composite_bodies(&now.snapshot(self))[joint + 1];
            along.power(carried.times(along)) + now.drives[joint].inertia
        };
        friction::overstep(torque, inertia)
    }
    fn balanced<T: Scalar>(&self, at: &At<T>) -> Joints<T> {
        let mut now = RobotInstant::new();
        now.set(self, at);
        let mut joint = Joints::from_iter((0..self.joints()).map(|_| T::zero()));
        let mut rotor = joint.clone();
        let mut modal = Modal::from_iter((0..self.structure.modes()).map(|_| T::zero()));
        now.accelerations(self, SweepResult { joint: &mut joint, rotor: &mut rotor, modal: &mut modal });
        let held = |j: usize| match self.friction_mode(at.modes, j) {
            STUCK => self.torques(at, j, &self.drive_train(at, j))[1] - rotor[j],
            _ => T::zero(),
        };
        (0..self.joints()).map(held).collect()
    }
    fn jump(&self, at: At<f64>, drives: &[(usize, f64)], jump: &mut [f64]) {
        self.impulse(at, drives, jump);
    }
}
