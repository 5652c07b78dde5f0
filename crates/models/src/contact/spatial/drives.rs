//! Effects on the drives of a robot that captures in space: they change the torque that its motors have.

use crate::contact::MAX_BALLS;
use crate::drive::{DriveTrain, Spring};
use crate::effect::{EffectSet, PUSHES, PlantKind};
use crate::space::layout::{Inputs, Parameters, States};
use crate::space::{MAX_BODIES, SpatialFreeFlyer};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, ModelSizes};

/// Effects that act here. The others of an arm change springs, friction, links, the base or readings in the plane.
pub const DRIVE_EFFECTS: [&str; 5] =
    ["actuator-lag", "current-saturation", "external-force:actuator", "position-servo", "torque-ripple"];

/// Most modes of a scene: those of a hand, and of the forces of external-force at every joint.
const MOST_MODES: usize = MAX_BALLS + 3 + 2 * PUSHES * MAX_BODIES;

/// The drives of a robot whose values begin at these places of a scene's vectors, and their effects, whose values are behind all others.
#[derive(Clone, Debug)]
pub(super) struct SpaceDrives {
    pub effects: EffectSet,
    robot: SpatialFreeFlyer,
    /// Begin of the robot's values.
    begin: ModelSizes,
    torque: usize,
    gear_ratio: usize,
    state: States,
}

impl SpaceDrives {
    /// Of this robot; the scene's sizes grow by the effects.
    pub(super) fn new<S: AsRef<str>>(
        robot: &SpatialFreeFlyer,
        begin: ModelSizes,
        ids: &[S],
        sizes: &mut ModelSizes,
    ) -> Result<Self, String> {
        if let Some(id) = ids.iter().map(AsRef::as_ref).find(|id| !DRIVE_EFFECTS.contains(id)) {
            return Err(format!(
                "the effect `{id}` does not act in CaptureScene with chaser=spatial; {} do, all effects of an arm with chaser=planar",
                DRIVE_EFFECTS.join(", ")
            ));
        }
        let s = robot.structure();
        let effects = EffectSet::place(ids, PlantKind::Arm, s.bodies(), sizes).map_err(|e| e.to_string())?;
        Ok(Self {
            effects,
            begin,
            torque: Inputs::new(s).joint_torque,
            gear_ratio: Parameters::new(s).gear_ratio,
            state: States::new(s),
            robot: robot.clone(),
        })
    }
    /// Joint `j` at an instant of the scene.
    fn drive<T: Scalar>(&self, at: &At<T>, j: usize) -> DriveTrain<T> {
        let x = &at.x[self.begin.states..];
        let (joint, joint_rate) = (x[self.state.joint_angle + j], x[self.state.joint_velocity + j]);
        let (theta, omega) = match self.robot.motor_row(j) {
            Some(row) => (x[row], x[row - self.state.motor_angle + self.state.motor_velocity]),
            None => (joint, joint_rate),
        };
        let command = at.u.get(self.begin.inputs + self.torque + j).copied().unwrap_or_else(T::zero);
        DriveTrain {
            t: at.t,
            command,
            torque: command,
            theta,
            omega,
            ratio: T::one(),
            shaft: at.p[self.begin.parameters + self.gear_ratio + j],
            epsilon: theta - joint,
            epsilon_dot: omega - joint_rate,
            joint_rate,
            ..DriveTrain::default()
        }
    }
    fn each<T: Scalar>(&self, at: &At<T>, mut see: impl FnMut(usize, DriveTrain<T>)) {
        if self.effects.iter().next().is_some() {
            (0..self.robot.structure().bodies()).for_each(|j| see(j, self.drive(at, j)));
        }
    }
    /// Start values of their parameters.
    pub(super) fn defaults(&self, p: &mut Vec<f64>) {
        for e in self.effects.iter() {
            for spec in e.choice.parameters() {
                p.resize(p.len() + e.sites, spec.arm_start);
            }
        }
    }
    /// The torques of the motors instead of those commanded, among the robot's inputs.
    pub(super) fn actuate<T: Scalar>(&self, at: &At<T>, u: &mut [T]) {
        self.each(at, |j, d| u[self.torque + j] = self.effects.actuator(at, j, &d));
    }
    pub(super) fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        for j in 0..self.robot.structure().bodies() {
            let d = self.drive(&At { t: T::zero(), x, u: &[], p, modes: &[] }, j);
            self.effects.start(p, j, &d, x);
        }
    }
    pub(super) fn rates<T: Scalar>(&self, at: &At<T>, dx: &mut [T]) {
        self.each(at, |j, d| self.effects.rates(at, j, &d, &Spring::default(), dx));
    }
    pub(super) fn outputs<T: Scalar>(&self, at: &At<T>, y: &mut [T]) {
        self.each(at, |j, d| self.effects.outputs(at, j, &d, y));
    }
    pub(super) fn indicators<T: Scalar>(&self, at: &At<T>, z: &mut [T]) {
        self.each(at, |j, d| self.effects.indicators(at, j, &d, z));
    }
    /// One pass of event iteration; whether a mode changed.
    pub(super) fn update(&self, t: f64, x: &[f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> bool {
        let mut frozen = [0; MOST_MODES];
        let before = &mut frozen[..modes.len()];
        before.copy_from_slice(modes);
        let at = At { t, x, u, p, modes: before };
        let mut changed = false;
        self.each(&at, |j, d| changed |= self.effects.update(&at, j, &d, modes));
        changed
    }
}
