//! `SpaceController` as a hybrid model: the law continuous or sampled.

use super::super::attitude::unit;
use super::super::design::RobotDesign;
use super::super::model::SpatialFreeFlyer;
use super::super::structure::RobotStructure;
use super::super::vector::three;
use super::super::{MAX_MODES_OF_ALL, MAX_THRUSTERS, layout as robot};
use super::law::{ControlLaw, ControlReferences, ControlSettings, ResolvedRates, SpaceCommand};
use super::layout::{BaseControl, Inputs, Outputs, Parameters, States, THRUSTERS};
use super::pose::{ControlledPose, RobotMeasurements};
use super::thrusters::{ControlledThruster, STANDARD_GRAVITY, ThrusterMemory, fires};
use crate::layout::{LayoutEntry, Parameter};
use crate::sampling::{is_due, last_sample, next_sample, set_next_sample};
use arrayvec::ArrayVec;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// Largest velocityGain times samplePeriod: the held law is stable up to 2, without a delay.
const LARGEST_STEP: f64 = 1.0;

/// Controller of the hands and joints of a robot in space, of the same structure and values as its
/// [`SpatialFreeFlyer`]; what it gets wrong: joints and links are rigid for it, appendages straight.
///
/// Parameters: those of the robot, then [`Parameters`]. Limits are kinks of its outputs and rates, no jumps, and no events.
#[derive(Clone, Debug)]
pub struct SpaceController {
    plant: SpatialFreeFlyer,
    own: Parameters,
    input: Inputs,
    output: Outputs,
    state: States,
    sizes: ModelSizes,
}

/// Values of the controller's own parameters while they are not set, in the order of their list.
const DEFAULTS: [(&str, f64); 18] = [
    ("baseControl", 1.0),
    ("taskWeight", 1.0),
    ("singularityThreshold", 0.1),
    ("dampingFactor", 0.1),
    ("jointVelocityLimit", 1.0),
    ("velocityGain", 40.0),
    ("trackingGain", 400.0),
    ("torqueLimit", 100.0),
    ("baseVelocityGain", 2.0),
    ("baseTrackingGain", 1.0),
    ("baseTorqueLimit", 100.0),
    ("baseActuator", 1.0),
    ("contactDamping", 100.0),
    ("contactNormal", 1.0),
    ("thrusterForceLimit", 10.0),
    ("minimumImpulse", 0.1),
    ("specificImpulse", 220.0),
    ("samplePeriod", 0.0),
];

impl SpaceController {
    /// The model's name.
    pub const NAME: &'static str = "SpaceController";

    /// A controller of robots of that structure, whose joints it takes as rigid.
    ///
    /// # Errors
    /// What of it cannot be, with the remedy.
    pub fn new(structure: RobotStructure) -> Result<Self, String> {
        let flexible = vec![false; structure.flexible.len()];
        let s = RobotStructure { flexible, analysis: false, ..structure };
        if s.bodies() == 0 {
            return Err("the robot has no joints: there is nothing to control; give it an arm".to_owned());
        }
        let plant = SpatialFreeFlyer::new(s)?;
        let s = plant.structure();
        let own = Parameters::new(s).behind(Self::of_robot(&plant));
        let (input, output, state) = (Inputs::new(s), Outputs::new(s), States::new(s));
        let sizes = ModelSizes {
            states: state.count,
            inputs: input.count,
            parameters: own.count,
            outputs: output.count,
            modes: 2,
            indicators: 0,
        };
        Ok(Self { own, input, output, state, sizes, plant })
    }

    /// How many of the robot's parameters it has: not those of how a run begins, but for where a held base is.
    fn of_robot(plant: &SpatialFreeFlyer) -> usize {
        let at = &plant.parameter;
        if plant.structure().held { at.initial_base_velocity } else { at.initial_base_position }
    }

    /// Structure of the robot, joints rigid.
    pub fn structure(&self) -> &RobotStructure {
        self.plant.structure()
    }

    /// The robot's parameters that it has, in order; the controller's own ones, of [`Parameters::list`], are behind them.
    pub fn robot_parameters(&self) -> Vec<LayoutEntry<Parameter>> {
        let mut left = Self::of_robot(&self.plant);
        let mut all = robot::Parameters::list(self.structure());
        all.retain(|e| {
            let kept = left >= e.len();
            left = if kept { left - e.len() } else { 0 };
            kept
        });
        all
    }

    /// Start values of the controller's own parameters.
    fn own_defaults(&self) -> Vec<f64> {
        let of = |name: &str| DEFAULTS.iter().find(|d| d.0 == name).map_or(0.0, |d| d.1);
        let list = Parameters::list(self.structure());
        // Hands push along x.
        let start = |e: &LayoutEntry<Parameter>, k: usize| {
            if e.name == "contactNormal" && !k.is_multiple_of(3) { 0.0 } else { of(e.name) }
        };
        list.iter().flat_map(|e| (0..e.len()).map(move |k| start(e, k))).collect()
    }

    fn behind(&self, mut robot: Vec<f64>) -> Vec<f64> {
        robot.truncate(Self::of_robot(&self.plant));
        robot.extend(self.own_defaults());
        robot
    }

    /// Start values of all parameters of a model that is no robot's yet.
    pub fn defaults(&self) -> Vec<f64> {
        self.behind(self.plant.defaults())
    }

    /// Start values of all parameters for this robot, which has to have the structure of this model.
    pub fn parameters(&self, design: &RobotDesign) -> Vec<f64> {
        let mut plain = design.clone();
        plain.analysis = false;
        plain.links.iter_mut().for_each(|l| l.motor.flexible = false);
        self.behind(plain.parameters())
    }

    /// Conditions on parameters that no single bound can state.
    ///
    /// # Errors
    /// The index of the parameter that is at fault, and the error with its remedy.
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        let count = Self::of_robot(&self.plant);
        let mut robot = self.plant.defaults();
        robot[..count].copy_from_slice(&p[..count]);
        self.plant.check(&robot)?;
        let own = &self.own;
        if !self.structure().held && BaseControl::from_number(p[own.base_control]).is_none() {
            let message = format!(
                "baseControl is {}: choose 1 (free), 2 (attitude), 3 (moving), 4 (fixed) or 5 (reactionless)",
                p[own.base_control]
            );
            return Err((own.base_control, message));
        }
        if self.controlled_thrusters() > 0 && ![1.0, THRUSTERS].contains(&p[own.base_actuator]) {
            let message =
                format!("baseActuator is {}: choose 1 (wheels) or 2 (thrusters)", p[own.base_actuator]);
            return Err((own.base_actuator, message));
        }
        for a in 0..self.structure().tips.len() {
            let at = own.contact_normal + 3 * a;
            if three(p, at) == [0.0; 3] {
                let message = format!(
                    "contactNormal[{},1] to [{0},3] are all 0, which is no direction: give that of the hand's force",
                    a + 1
                );
                return Err((at, message));
            }
        }
        let period = p[own.sample_period];
        for j in 0..self.structure().bodies() {
            let gain = p[own.velocity_gain + j];
            if gain * period > LARGEST_STEP {
                let message = format!(
                    "samplePeriod {period} s is too long for velocityGain[{}] = {gain} 1/s, whose sampled loop would overshoot or be unstable: take at most {:.3e} s, or a smaller gain",
                    j + 1,
                    LARGEST_STEP / gain
                );
                return Err((own.sample_period, message));
            }
        }
        Ok(())
    }

    fn measured<'a, T: Scalar>(&self, u: &'a [T]) -> RobotMeasurements<'a, T> {
        let (n, input) = (self.structure().bodies(), &self.input);
        let mut base = [T::zero(); 10];
        if !self.structure().held {
            base[..4].copy_from_slice(&u[input.base_quaternion..][..4]);
            base[4..7].copy_from_slice(&u[input.base_velocity..][..3]);
            base[7..].copy_from_slice(&u[input.base_angular_velocity..][..3]);
        }
        let mut modes = [T::zero(); MAX_MODES_OF_ALL];
        let bent = &u[input.modal_coordinate..][..self.bends()];
        modes[..bent.len()].copy_from_slice(bent);
        RobotMeasurements {
            modes,
            angles: &u[input.joint_angle..][..n],
            rates: &u[input.joint_velocity..][..n],
            base,
        }
    }

    /// The law at these inputs, with what it makes of the references.
    fn at<T: Scalar, V>(
        &self,
        at: &At<T>,
        read: impl FnOnce(&ControlLaw<'_, T>, &ResolvedRates<T>) -> V,
    ) -> V {
        let (s, p, u, own) = (self.structure(), at.p, at.u, &self.own);
        let n = s.bodies();
        let measured = self.measured(u);
        let pose = ControlledPose::new(&self.plant, p, &measured);
        let held = (BaseControl::Fixed, [T::zero(); 3], [T::zero(); 3]);
        let (base, of_base, reference) = if s.held {
            held
        } else {
            let number = p[own.base_control].value();
            (
                BaseControl::from_number(number).unwrap_or(BaseControl::Free),
                [p[own.base_velocity_gain], p[own.base_tracking_gain], p[own.base_torque_limit]],
                three(u, self.input.base_rate_reference),
            )
        };
        let thrusters = self.thrusters(p);
        let [vibration, base_vibration] = [own.vibration_gain, own.base_vibration_gain]
            .map(|i| if self.bends() > 0 { p[i] } else { T::zero() });
        let law = ControlLaw {
            plant: &self.plant,
            p,
            measured,
            settings: ControlSettings {
                base,
                weight: &p[own.task_weight..][..6 * s.tips.len()],
                threshold: p[own.threshold],
                damping: p[own.damping],
                rate_limit: &p[own.rate_limit..][..n],
                velocity_gain: &p[own.velocity_gain..][..n],
                tracking_gain: &p[own.tracking_gain..][..n],
                torque_limit: &p[own.torque_limit..][..n],
                of_base,
                thrusters: (!thrusters.is_empty()).then_some(&thrusters),
                wheel: if thrusters.is_empty() { [T::zero(); 3] } else { unit(three(p, own.wheel_axis)) },
                normal: &p[own.contact_normal..][..3 * s.tips.len()],
                contact_damping: &p[own.contact_damping..][..s.tips.len()],
                vibration,
                base_vibration,
            },
            reference: ControlReferences {
                tips: &u[self.input.tip_velocity_reference..][..6 * s.tips.len()],
                joints: &u[self.input.joint_velocity_reference..][..n],
                torques: &u[self.input.torque_feedforward..][..n],
                base: reference,
                forces: &u[self.input.contact_force_reference..][..s.tips.len()],
            },
            pose: &pose,
            tracking: &at.x[self.state.tracking..][..n],
            base_tracking: if s.held { &[] } else { &at.x[self.state.base_tracking..][..3] },
        };
        let resolved = law.resolved();
        read(&law, &resolved)
    }

    /// Thrusters, where they turn the base.
    fn thrusters<T: Scalar>(&self, p: &[T]) -> ArrayVec<ControlledThruster<T>, MAX_THRUSTERS> {
        let (own, robot, count) = (&self.own, &self.plant.parameter, self.structure().thrusters);
        if self.structure().held || count == 0 || p[own.base_actuator].value() != THRUSTERS {
            return ArrayVec::new();
        }
        let thruster = |k: usize| ControlledThruster {
            position: three(p, robot.thruster_position + 3 * k),
            direction: unit(three(p, robot.thruster_direction + 3 * k)),
            force: p[own.thruster_level + k],
        };
        (0..count).map(thruster).collect()
    }

    /// Modal coordinates of the appendages of a base that is free.
    fn bends(&self) -> usize {
        let s = self.structure();
        if s.held { 0 } else { s.modes() - s.linked() }
    }

    /// Thrusters of a base that is free.
    fn controlled_thrusters(&self) -> usize {
        if self.structure().held { 0 } else { self.structure().thrusters }
    }

    /// Propellant per time, kg/s, at these forces.
    fn consumption<T: Scalar>(&self, p: &[T], forces: &[T]) -> T {
        let sum = forces.iter().fold(T::zero(), |sum, f| sum + *f);
        sum / (p[self.own.specific_impulse] * STANDARD_GRAVITY)
    }

    fn command<T: Scalar>(&self, at: &At<T>) -> (SpaceCommand<T>, ResolvedRates<T>) {
        self.at(at, |law, resolved| (law.command(resolved), resolved.clone()))
    }

    fn period<T: Scalar>(&self, p: &[T]) -> f64 {
        p[self.own.sample_period].value()
    }
}

impl SpaceController {
    /// Whether thruster `k` is on for the sample that begins, and what it then remembers.
    fn fires<T: Scalar>(&self, at: &At<T>, k: usize, wanted: f64) -> (bool, ThrusterMemory) {
        let (x, p, own) = (at.x, at.p, &self.own);
        let memory =
            ThrusterMemory { owed: x[self.state.owed + k].value(), left: x[self.state.left + k].value() };
        let [force, least] = [own.thruster_level, own.least_impulse].map(|i| p[i + k].value());
        fires(memory, wanted, (force, least, self.period(p)))
    }

    /// Turns thrusters on and off for the sample that begins.
    fn fire(&self, x: &mut [f64], p: &[f64], command: &SpaceCommand<f64>) {
        let (state, period) = (&self.state, self.period(p));
        let count = self.controlled_thrusters();
        for k in 0..count {
            let (on, memory) = self.fires(&At { t: 0.0, x, u: &[], p, modes: &[] }, k, command.thrusters[k]);
            // One that goes on from the pulse before is not turned on.
            let pulse = on && x[state.held_thruster + k] == 0.0;
            x[state.pulses + k] += f64::from(u8::from(pulse));
            x[state.held_thruster + k] = if on { p[self.own.thruster_level + k] } else { 0.0 };
            (x[state.owed + k], x[state.left + k]) = (memory.owed, memory.left);
        }
        if count > 0 {
            x[state.propellant] += period * self.consumption(p, &x[state.held_thruster..][..count]);
        }
    }
}

impl Hybrid for SpaceController {
    fn sizes(&self) -> ModelSizes {
        self.sizes
    }

    fn start<T: Scalar>(&self, _p: &[T], x: &mut [T]) {
        x.fill(T::zero());
    }

    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        modes.fill(0);
        let period = self.period(at.p);
        if period > 0.0 {
            set_next_sample(modes, last_sample(at.t, period));
        }
    }

    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        dx.fill(T::zero());
        if self.period(at.p) > 0.0 {
            return;
        }
        let (command, _) = self.command(&at);
        let n = self.structure().bodies();
        dx[self.state.tracking..][..n].copy_from_slice(&command.tracking[..n]);
        if !self.structure().held {
            dx[self.state.base_tracking..][..3].copy_from_slice(&command.base_tracking);
        }
        let count = self.controlled_thrusters();
        if count > 0 {
            dx[self.state.propellant] = self.consumption(at.p, &command.thrusters[..count]);
        }
    }

    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let (s, out) = (self.structure(), &self.output);
        let (n, rows) = (s.bodies(), 6 * s.tips.len());
        let (command, resolved) = self.command(&at);
        let period = self.period(at.p);
        let held = period > 0.0 && !is_due(at.t.value(), period, at.modes);
        if held {
            y[out.joint_torque..][..n].copy_from_slice(&at.x[self.state.held_torque..][..n]);
        } else {
            y[out.joint_torque..][..n].copy_from_slice(&command.torques[..n]);
        }
        if !s.held {
            let torque = if held { three(at.x, self.state.held_base_torque) } else { command.base_torque };
            y[out.base_torque..][..3].copy_from_slice(&torque);
        }
        let count = self.controlled_thrusters();
        if count > 0 {
            for k in 0..count {
                y[out.thruster_force + k] = if held {
                    at.x[self.state.held_thruster + k]
                } else if period > 0.0 {
                    let fires = self.fires(&at, k, command.thrusters[k].value()).0;
                    if fires { at.p[self.own.thruster_level + k] } else { T::zero() }
                } else {
                    command.thrusters[k]
                };
            }
            y[out.thruster_pulses..][..count].copy_from_slice(&at.x[self.state.pulses..][..count]);
            y[out.propellant] = at.x[self.state.propellant];
        }
        y[out.joint_velocity_command..][..n].copy_from_slice(&resolved.rates[..n]);
        y[out.tip_velocity_error..][..rows].copy_from_slice(&resolved.error[..rows]);
        y[out.smallest_singular_value] = resolved.smallest;
        y[out.damping_used] = resolved.damping;
    }

    fn indicators<T: Scalar>(&self, _at: At<T>, _z: &mut [T]) {}

    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let period = self.period(p);
        if !is_due(t, period, modes) {
            return EventUpdate::default();
        }
        let (command, _) = self.command(&At { t, x, u, p, modes });
        let n = self.structure().bodies();
        let mut step = |row: usize, rates: &[f64]| {
            x[row..].iter_mut().zip(rates).for_each(|(x, rate)| *x += period * rate);
        };
        step(self.state.tracking, &command.tracking[..n]);
        if !self.structure().held {
            step(self.state.base_tracking, &command.base_tracking);
            x[self.state.held_base_torque..][..3].copy_from_slice(&command.base_torque);
        }
        x[self.state.held_torque..][..n].copy_from_slice(&command.torques[..n]);
        self.fire(x, p, &command);
        set_next_sample(modes, last_sample(t, period) + 1.0);
        EventUpdate { modes: true, states: true }
    }

    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        let period = self.period(p);
        (period > 0.0).then(|| next_sample(modes) * period)
    }
}
