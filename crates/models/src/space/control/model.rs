//! `SpaceController` as a hybrid model: the law continuous or sampled.

use super::super::design::RobotDesign;
use super::super::layout as robot;
use super::super::model::SpatialFreeFlyer;
use super::super::structure::RobotStructure;
use super::super::vector::three;
use super::law::{ControlLaw, ControlReferences, ControlSettings, ResolvedRates, SpaceCommand};
use super::layout::{BaseControl, Inputs, Outputs, Parameters, States};
use super::pose::{ControlledPose, RobotMeasurements};
use crate::layout::{LayoutEntry, Parameter};
use crate::sampling::{is_due, last_sample, next_sample, set_next_sample};
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
const DEFAULTS: [(&str, f64); 12] = [
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
        list.iter().flat_map(|e| vec![of(e.name); e.len()]).collect()
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
                "baseControl is {}: choose 1 (free), 2 (attitude), 3 (moving) or 4 (fixed)",
                p[own.base_control]
            );
            return Err((own.base_control, message));
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
        RobotMeasurements {
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
            },
            reference: ControlReferences {
                tips: &u[self.input.tip_velocity_reference..][..6 * s.tips.len()],
                joints: &u[self.input.joint_velocity_reference..][..n],
                torques: &u[self.input.torque_feedforward..][..n],
                base: reference,
            },
            pose: &pose,
        };
        let resolved = law.resolved();
        read(&law, &resolved)
    }

    fn command<T: Scalar>(&self, at: &At<T>) -> (SpaceCommand<T>, ResolvedRates<T>) {
        let tracking = &at.x[self.state.tracking..][..self.structure().bodies()];
        let base: &[T] = if self.structure().held { &[] } else { &at.x[self.state.base_tracking..][..3] };
        self.at(at, |law, resolved| (law.command(resolved, tracking, base), resolved.clone()))
    }

    fn period<T: Scalar>(&self, p: &[T]) -> f64 {
        p[self.own.sample_period].value()
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
        set_next_sample(modes, last_sample(t, period) + 1.0);
        EventUpdate { modes: true, states: true }
    }

    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        let period = self.period(p);
        (period > 0.0).then(|| next_sample(modes) * period)
    }
}
