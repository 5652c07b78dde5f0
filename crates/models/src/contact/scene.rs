//! `CaptureScene`: chaser, gripper and target in one model. Nothing is exchanged between FMUs, so contacts are located and the
//! error is the integrator's: the reference that couplings are judged by, and the fast way to maps of captures.
//!
//! Positive directions: inertial frame; angles, rates and torques from x to y. What it gets wrong: the chaser is one rigid body
//! with its arm (S2 section 3.2: the manipulator holds its configuration); beyond that as `GripperContact`.

use super::bodies::{Inertia, both, carry};
use super::frame::{Frame, Vector, Wrench, add, sub};
use super::gripper::{Gripper, View};
use super::gripper_contact::{MOST_MODES, copies};
use super::layout::{Against, Mount, SceneInputs, SceneOutputs, SceneParameters, SceneStates, Structure};
use super::parameters;
use super::presets::SIM2;
use super::touch::{Touch, frame, touch, two};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, Hybrid, Sizes, Update};

/// The structure of a capture.
#[derive(Clone, Debug)]
pub struct CaptureScene {
    gripper: Gripper,
    parameters: SceneParameters,
    inputs: SceneInputs,
    outputs: SceneOutputs,
    states: SceneStates,
}

/// Both bodies at one instant.
struct Bodies<T> {
    chaser: Frame<T>,
    target: Frame<T>,
}

impl CaptureScene {
    /// With this gripper.
    ///
    /// # Errors
    /// A structure that cannot be had, with the mend.
    pub fn new(structure: Structure) -> Result<Self, String> {
        let gripper = Gripper::new(structure)?;
        let parameters = SceneParameters::new(&()).behind(gripper.parameters.count);
        let inputs = SceneInputs::new(&()).behind(gripper.command.count);
        let outputs = SceneOutputs::new(&()).behind(gripper.outputs.count);
        let states = SceneStates::new(&()).behind(gripper.states.count);
        Ok(Self { gripper, parameters, inputs, outputs, states })
    }
    /// Its gripper's structure.
    pub fn structure(&self) -> &Structure {
        &self.gripper.structure
    }
    /// Values of SIM2.
    pub fn defaults(&self) -> Vec<f64> {
        let at = &self.parameters;
        let mut p = parameters::defaults(&self.gripper.structure);
        p.resize(at.count, 0.0);
        (p[at.chaser_mass], p[at.chaser_inertia]) = (SIM2.chaser_mass, SIM2.chaser_inertia);
        p[at.chaser_velocity] = SIM2.speed;
        for i in 0..2 {
            p[at.end_effector + i] = SIM2.end_effector[i];
            p[at.port_offset + i] = SIM2.port_offset[i];
        }
        if self.gripper.structure.against == Against::Plate {
            // As far before the foremost ball as SIM2's port before P1.
            let g = &self.gripper.parameters;
            let fronts = (0..self.gripper.structure.balls).map(|i| p[g.open + 2 * i] + p[g.ball_radius + i]);
            p[at.port_offset] =
                fronts.fold(f64::NEG_INFINITY, f64::max) + SIM2.port_offset[0] - 2.0 * SIM2.ball_radius;
        }
        p
    }
    /// Whether the parameters fit each other.
    ///
    /// # Errors
    /// Where they contradict each other: the index of one of them, and the mend.
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        parameters::check(&self.gripper, p)?;
        let mut refused = Ok(());
        self.at_start(p, |v| {
            if let Some(fault) = self.gripper.fault(v) {
                refused = Err((self.parameters.port_offset, fault));
            } else if let Some((ball, depth)) = self.gripper.deepest(v) {
                let at = &self.gripper.parameters;
                let own = p[at.ball_radius + ball];
                let other = self.gripper.port_radius(p).unwrap_or(own);
                refused = parameters::deepest(ball + 1, depth, [own, other])
                    .map_err(|e| (self.parameters.port_offset, e));
            }
        });
        refused
    }
    /// A command beyond its ends, and how it is taken.
    pub fn clipped(&self, at: &At<'_, f64>) -> Option<String> {
        self.gripper.clipped(at)
    }
    /// Balls that overlap where the run begins.
    pub fn overlap(&self, at: &At<'_, f64>) -> Option<String> {
        self.gripper.overlap_at_start(&self.view(at, &self.bodies(at.x)))
    }
    /// Why values are not numbers, where balls are concentric.
    pub fn fault(&self, at: &At<'_, f64>) -> Option<String> {
        self.gripper.fault(&self.view(at, &self.bodies(at.x)))
    }
    /// Shows the start to somebody.
    fn at_start(&self, p: &[f64], mut see: impl FnMut(&View<'_, f64>)) {
        let n = self.sizes();
        let (mut x, u) = (vec![0.0; n.states], vec![0.0; n.inputs]);
        self.start(p, &mut x);
        let modes = [0; MOST_MODES];
        let at = At { t: 0.0, x: &x, u: &u, p, modes: &modes[..n.modes] };
        see(&self.view(&at, &self.bodies(&x)));
    }

    fn bodies<T: Scalar>(&self, x: &[T]) -> Bodies<T> {
        let at = &self.states;
        Bodies {
            chaser: frame(x, [at.chaser_position, at.chaser_attitude, at.chaser_velocity, at.chaser_rate]),
            target: frame(x, [at.target_position, at.target_attitude, at.target_velocity, at.target_rate]),
        }
    }
    fn view<'a, T: Scalar>(&self, at: &At<'a, T>, bodies: &Bodies<T>) -> View<'a, T> {
        let center = two(at.p, self.gripper.parameters.target_center);
        View {
            t: at.t,
            p: at.p,
            x: at.x,
            u: at.u,
            modes: at.modes,
            host: bodies.chaser.at(two(at.p, self.parameters.end_effector)),
            port: bodies.target.at(center.map(|c| -c)),
        }
    }
    fn look<'a, T: Scalar>(&self, at: &At<'a, T>) -> (Bodies<T>, View<'a, T>, Touch<T>) {
        let bodies = self.bodies(at.x);
        let view = self.view(at, &bodies);
        let here = touch(&self.gripper, &view);
        (bodies, view, here)
    }
    fn inertias<T: Scalar>(&self, p: &[T]) -> [Inertia<T>; 2] {
        let g = &self.gripper.parameters;
        [
            Inertia { mass: p[self.parameters.chaser_mass], inertia: p[self.parameters.chaser_inertia] },
            Inertia { mass: p[g.target_mass], inertia: p[g.target_inertia] },
        ]
    }
    /// Momentum, angular momentum and twice the kinetic energy of everything that has mass.
    fn momenta<T: Scalar>(&self, at: &At<'_, T>, bodies: &Bodies<T>, here: &Touch<T>) -> (Vector<T>, T, T) {
        let [chaser, target] = self.inertias(at.p);
        let sum = both(chaser.momenta(&bodies.chaser), target.momenta(&bodies.target));
        if self.gripper.structure.mount == Mount::Rigid {
            return sum;
        }
        let ball = Inertia { mass: at.p[self.gripper.parameters.ball_mass], inertia: T::zero() };
        let velocity = two(at.x, self.gripper.states.ball_velocity);
        both(sum, ball.momenta(&Frame::new(here.balls[0], T::zero(), velocity, T::zero())))
    }
}

impl Hybrid for CaptureScene {
    fn sizes(&self) -> Sizes {
        Sizes {
            states: self.states.count,
            inputs: self.inputs.count,
            parameters: self.parameters.count,
            outputs: self.outputs.count,
            modes: self.gripper.modes(),
            indicators: self.gripper.indicators(),
        }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        x.fill(T::zero());
        let (from, to) = (&self.parameters, &self.states);
        let chaser =
            frame(p, [from.chaser_position, from.chaser_attitude, from.chaser_velocity, from.chaser_rate]);
        let port = chaser.at(add(two(p, from.end_effector), two(p, from.port_offset)));
        let attitude = chaser.attitude + p[from.port_angle];
        let target = Frame::new(port.position, attitude, two(p, from.target_velocity), p[from.target_rate]);
        let center = target.at(two(p, self.gripper.parameters.target_center)).position;
        for i in 0..2 {
            x[to.chaser_position + i] = chaser.position[i];
            x[to.chaser_velocity + i] = chaser.velocity[i];
            x[to.target_position + i] = center[i];
            x[to.target_velocity + i] = target.velocity[i];
        }
        (x[to.chaser_attitude], x[to.chaser_rate]) = (chaser.attitude, chaser.rate);
        (x[to.target_attitude], x[to.target_rate]) = (attitude, target.rate);
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        let zeros = [0; MOST_MODES];
        let bodies = self.bodies(at.x);
        self.gripper.start_modes(&self.view(&At { modes: &zeros[..modes.len()], ..at }, &bodies), modes);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let (bodies, view, here) = self.look(&at);
        self.gripper.rates(&view, &here, dx);
        let pushed = Wrench { force: two(at.u, self.inputs.force), torque: at.u[self.inputs.torque] };
        let (mut on_chaser, mut on_target) = (pushed, Wrench::default());
        carry(&mut on_chaser, &here.on_host, view.host.position, bodies.chaser.position);
        carry(&mut on_target, &here.on_port, view.port.position, bodies.target.position);
        let [chaser, target] = self.inertias(at.p);
        let (to, of_chaser, of_target) =
            (&self.states, chaser.accelerated(&on_chaser), target.accelerated(&on_target));
        for i in 0..2 {
            dx[to.chaser_position + i] = bodies.chaser.velocity[i];
            dx[to.chaser_velocity + i] = of_chaser.0[i];
            dx[to.target_position + i] = bodies.target.velocity[i];
            dx[to.target_velocity + i] = of_target.0[i];
        }
        (dx[to.chaser_attitude], dx[to.chaser_rate]) = (bodies.chaser.rate, of_chaser.1);
        (dx[to.target_attitude], dx[to.target_rate]) = (bodies.target.rate, of_target.1);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let (bodies, view, here) = self.look(&at);
        self.gripper.write(&view, &here, y);
        let to = &self.outputs;
        let offset = view.host.inward(sub(view.port.position, view.host.position));
        let (momentum, angular, energy) = self.momenta(&at, &bodies, &here);
        for i in 0..2 {
            y[to.chaser_position + i] = bodies.chaser.position[i];
            y[to.chaser_velocity + i] = bodies.chaser.velocity[i];
            y[to.target_position + i] = bodies.target.position[i];
            y[to.target_velocity + i] = bodies.target.velocity[i];
            y[to.port_offset + i] = offset[i];
            y[to.linear_momentum + i] = momentum[i];
        }
        (y[to.chaser_attitude], y[to.chaser_rate]) = (bodies.chaser.attitude, bodies.chaser.rate);
        (y[to.target_attitude], y[to.target_rate]) = (bodies.target.attitude, bodies.target.rate);
        y[to.port_angle] = bodies.target.attitude - bodies.chaser.attitude;
        (y[to.angular_momentum], y[to.kinetic_energy]) = (angular, energy * 0.5);
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        let (_, view, here) = self.look(&at);
        self.gripper.indicate(&view, &here, z);
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> Update {
        let (before, frozen) = copies(x, modes);
        let at = At { t, x: &before[..x.len()], u, p, modes: &frozen[..modes.len()] };
        self.gripper.update(&self.view(&at, &self.bodies(at.x)), x, modes)
    }
}
