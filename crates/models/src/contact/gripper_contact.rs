//! `GripperContact`: a gripper of balls between an end effector and a target's port, whose motions come in as inputs.
//!
//! Positive directions: inertial frame; angles, rates and torques from x to y. Forces come out for both bodies, equal and
//! opposite as wrenches about any point.
//! What it gets wrong: points and balls, no shape of a ring; friction is smoothed; jaws without mass, which a schedule or a
//! command moves however large the force, but for `holdForceLimit`; with a motor (CON-11) their inertia does not act back on the hand.

use super::frame::frame;
use super::layout::{Closing, GripperStructure, HostParameters, Mount, PortShape, Poses};
use super::presets::SIM2;
use super::touch::touch;
use super::view::{Gripper, GripperView};
use super::{MAX_BALLS, parameters};
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};
use trueup_numerics::{Scalar, ShortNumber};

/// Least number of communication steps per period of the contact.
const STEPS_PER_PERIOD: f64 = 5.0;
/// Most states of a gripper.
pub(super) const MOST_STATES: usize = 24;
/// Most modes.
pub(super) const MOST_MODES: usize = MAX_BALLS + 5;

/// The structure of a gripper between two bodies that others move.
#[derive(Clone, Debug)]
pub struct GripperContact {
    gripper: Gripper,
    poses: Poses,
    host: HostParameters,
}

impl GripperContact {
    /// With this structure.
    ///
    /// # Errors
    /// A structure that is not possible, with the remedy.
    pub fn new(structure: GripperStructure) -> Result<Self, String> {
        let gripper = Gripper::new(structure)?;
        let host = HostParameters::new(&()).behind(gripper.parameters.count);
        Ok(Self { gripper, poses: Poses::new(&structure), host })
    }
    /// Its structure.
    pub fn structure(&self) -> &GripperStructure {
        &self.gripper.structure
    }
    /// Values of SIM2.
    pub fn defaults(&self) -> Vec<f64> {
        let mut p = parameters::defaults(&self.gripper.structure, &SIM2);
        p.push(SIM2.chaser_mass);
        p
    }
    /// Whether the parameters fit each other.
    ///
    /// # Errors
    /// Where they contradict each other: the index of one of them, and the remedy.
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        parameters::check(&self.gripper, p)
    }
    fn view<'a, T: Scalar>(&self, at: &At<'a, T>) -> GripperView<'a, T> {
        let (u, led) = (&at.u[self.gripper.command.count..], &self.poses);
        GripperView {
            t: at.t,
            p: at.p,
            x: at.x,
            u: at.u,
            modes: at.modes,
            host: frame(u, [led.host_position, led.host_attitude, led.host_velocity, led.host_rate]),
            port: frame(u, [led.port_position, led.port_attitude, led.port_velocity, led.port_rate]),
        }
    }
    /// A command beyond its ends, and how it is taken.
    pub fn clipped(&self, at: &At<'_, f64>) -> Option<String> {
        self.gripper.clipped(at)
    }
    /// Balls that overlap where the run begins.
    pub fn overlap(&self, at: &At<'_, f64>) -> Option<String> {
        self.gripper.overlap_at_start(&self.view(at))
    }
    /// Why values are not numbers, where balls are concentric.
    pub fn fault(&self, at: &At<'_, f64>) -> Option<String> {
        self.gripper.fault(&self.view(at))
    }
    /// A communication step of `h` s that is long against the contact: forces that lag by it feed energy in.
    pub fn long_step(&self, h: f64, p: &[f64]) -> Option<String> {
        let period = self.gripper.period(p, p[self.host.mass]);
        let most = period / STEPS_PER_PERIOD;
        (h > most).then(|| {
            format!(
                "the communication step of {} s is longer than {} s, a fifth of the period of the contact, {} s: forces \
                 that lag by a step feed energy in; take shorter steps",
                ShortNumber(h),
                ShortNumber(most),
                ShortNumber(period)
            )
        })
    }
}

impl Hybrid for GripperContact {
    fn sizes(&self) -> ModelSizes {
        let own = self.gripper.sizes();
        ModelSizes { inputs: own.inputs + self.poses.count, parameters: self.host.count, ..own }
    }
    fn start<T: Scalar>(&self, _p: &[T], x: &mut [T]) {
        x.fill(T::zero());
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        let zeros = [0; MOST_MODES];
        self.gripper.start_modes(&self.view(&At { modes: &zeros[..modes.len()], ..at }), modes);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let v = self.view(&at);
        self.gripper.rates(&v, &touch(&self.gripper, &v), dx);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let v = self.view(&at);
        self.gripper.write(&v, &touch(&self.gripper, &v), y);
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        let v = self.view(&at);
        self.gripper.indicate(&v, &touch(&self.gripper, &v), z);
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let (before, frozen) = copies(x, modes);
        let at = At { t, x: &before[..x.len()], u, p, modes: &frozen[..modes.len()] };
        self.gripper.update(&self.view(&at), x, modes)
    }
}

/// States and modes as they are before an update.
pub(super) fn copies(x: &[f64], modes: &[i32]) -> ([f64; MOST_STATES], [i32; MOST_MODES]) {
    let (mut before, mut frozen) = ([0.0; MOST_STATES], [0; MOST_MODES]);
    before[..x.len()].copy_from_slice(x);
    frozen[..modes.len()].copy_from_slice(modes);
    (before, frozen)
}

impl Gripper {
    pub(super) fn clipped(&self, at: &At<'_, f64>) -> Option<String> {
        let (name, value, [least, most]) = match self.structure.closing {
            Closing::Schedule => return None,
            Closing::Command => ("close", at.u[self.command.close], [0.0, 1.0]),
            Closing::Motor => {
                let most = at.p[self.parameters.motor_limit];
                ("motorTorque", at.u[self.command.motor_torque], [-most, most])
            }
        };
        (!(least..=most).contains(&value)).then(|| {
            format!("`{name}` = {value} at t = {} s is taken as {}", at.t, value.max(least).min(most))
        })
    }
    pub(super) fn overlap_at_start(&self, v: &GripperView<'_, f64>) -> Option<String> {
        (v.t == v.x[self.states.begin]).then(|| self.overlap(v)).flatten()
    }
    /// The deepest overlap of a ball with the port, in words.
    fn overlap(&self, v: &GripperView<'_, f64>) -> Option<String> {
        let (ball, depth) = self.deepest(v)?;
        Some(format!(
            "ball {} begins {depth:.6} m deep in the port: the first contact is no impact",
            ball + 1
        ))
    }
    /// The ball that is deepest in the port, and how deep.
    pub(super) fn deepest(&self, v: &GripperView<'_, f64>) -> Option<(usize, f64)> {
        let here = touch(self, v);
        (0..self.structure.balls)
            .map(|i| (i, here.pairs[i].penetration))
            .filter(|(_, depth)| *depth > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }
    pub(super) fn fault(&self, v: &GripperView<'_, f64>) -> Option<String> {
        let what = match self.structure.against {
            PortShape::Ball => "the port's ball are concentric",
            PortShape::Bar => "the middle line of the port's bar meet",
            PortShape::Plate => return None,
        };
        let here = touch(self, v);
        let ball = (0..self.structure.balls).find(|i| here.balls[*i] == self.nearest(v, here.balls[*i]))?;
        Some(format!(
            "ball {} and {what} at t = {} s: their contact has no normal; \
             connect or set hostPosition and portPosition, or begin further apart",
            ball + 1,
            v.t
        ))
    }
    /// 2 pi sqrt(m/k) in s, m what moves of both sides (CON-5, without levers, which make it shorter): of the ball on its mount,
    /// else of the target, against a host of `host_mass` kg (0: endless).
    fn period(&self, p: &[f64], host_mass: f64) -> f64 {
        let at = &self.parameters;
        let (target, mut stiffness) = (p[at.target_mass], p[at.stiffness]);
        let mut mass = if host_mass > 0.0 { 1.0 / (1.0 / target + 1.0 / host_mass) } else { target }; // (CON-5)
        if self.structure.mount == Mount::Elastic && p[at.ball_mass] > 0.0 {
            mass = p[at.ball_mass];
            stiffness += p[at.mount_stiffness].max(p[at.mount_stiffness + 1]);
        }
        2.0 * core::f64::consts::PI * (mass / stiffness).sqrt()
    }
}
