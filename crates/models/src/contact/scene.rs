//! `CaptureScene`: chaser, gripper and target in one model. Nothing is exchanged between FMUs, so contacts are located and the
//! error is the integrator's: the reference that couplings are judged by, and the fast way to maps of captures.
//!
//! The vectors have the gripper's values first, then the chaser's, then the target's.
//! Positive directions: inertial frame; angles, rates and torques from x to y. What it gets wrong: as its chaser and as
//! `GripperContact`; the target is one rigid body.

use super::bodies::{BodyMotionIndices, Inertia, add_momenta, carry, put, put_rates};
use super::chaser::{Chaser, RigidChaser};
use super::frame::{ContactWrench, PointFrame, frame, sub, two};
use super::gripper_contact::{MOST_MODES, copies};
use super::layout::{GripperStructure, Mount, PortShape, SceneOutputs, SceneParameters, SceneStates};
use super::parameters;
use super::presets::SIM1;
use super::touch::{ContactState, touch};
use super::view::{Gripper, GripperView};
use crate::arm::{MAX_LINKS, input};
use trueup_numerics::Scalar;
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// Most inputs of a chaser, with those of an effect of each joint.
const MOST_INPUTS: usize = input::count(MAX_LINKS) + MAX_LINKS;

/// The structure of a capture.
#[derive(Clone, Debug)]
pub struct CaptureScene<C = RigidChaser> {
    gripper: Gripper,
    chaser: C,
    /// Of the chaser's values: where they begin, behind the gripper's, and how many there are.
    begin: ModelSizes,
    length: ModelSizes,
    parameters: SceneParameters,
    outputs: SceneOutputs,
    states: SceneStates,
}

/// Hand and target at one instant.
struct Poses<T> {
    hand: PointFrame<T>,
    target: PointFrame<T>,
}

impl<C: Chaser> CaptureScene<C> {
    /// With this chaser and this gripper.
    ///
    /// # Errors
    /// A structure that is not possible, with the remedy.
    pub fn new(chaser: C, structure: GripperStructure) -> Result<Self, String> {
        let gripper = Gripper::new(structure)?;
        let (begin, length) = (gripper.sizes(), chaser.sizes());
        if length.inputs > MOST_INPUTS {
            return Err(format!("a chaser has at most {MOST_INPUTS} inputs, not {}", length.inputs));
        }
        let parameters = SceneParameters::new(&()).behind(begin.parameters + length.parameters);
        let outputs = SceneOutputs::new(&()).behind(begin.outputs + length.outputs);
        let states = SceneStates::new(&()).behind(begin.states + length.states);
        Ok(Self { gripper, chaser, begin, length, parameters, outputs, states })
    }
    /// Its gripper's structure.
    pub fn structure(&self) -> &GripperStructure {
        &self.gripper.structure
    }
    /// Its chaser.
    pub fn chaser(&self) -> &C {
        &self.chaser
    }
    /// Values of the chaser's capture.
    pub fn defaults(&self) -> Vec<f64> {
        let (at, of) = (&self.parameters, self.chaser.capture());
        let mut p = parameters::defaults(&self.gripper.structure, &of);
        p.extend(self.chaser.approaching());
        p.resize(at.count, 0.0);
        p[at.port_offset..at.port_offset + 2].copy_from_slice(&of.port_offset);
        if self.gripper.structure.sliding() {
            p[at.port_offset..at.port_offset + 2].copy_from_slice(&SIM1.port_offset);
        }
        if self.gripper.structure.against == PortShape::Plate {
            // As far before the foremost ball as the port's ball before P1.
            let g = &self.gripper.parameters;
            let fronts = (0..self.gripper.structure.balls).map(|i| p[g.open + 2 * i] + p[g.ball_radius + i]);
            p[at.port_offset] =
                fronts.fold(f64::NEG_INFINITY, f64::max) + of.port_offset[0] - 2.0 * of.ball_radius;
        }
        p
    }
    /// Whether the parameters fit each other.
    ///
    /// # Errors
    /// Where they contradict each other: the index of one of them, and the remedy.
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        parameters::check(&self.gripper, p)?;
        self.chaser.fits(self.own_parameters(p)).map_err(|(i, why)| (i + self.begin.parameters, why))?;
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
        self.gripper.overlap_at_start(&self.view(at, &self.poses(at)))
    }
    /// Why values are not numbers, where balls are concentric.
    pub fn fault(&self, at: &At<'_, f64>) -> Option<String> {
        self.gripper.fault(&self.view(at, &self.poses(at)))
    }
    /// Shows the start to somebody.
    fn at_start(&self, p: &[f64], mut see: impl FnMut(&GripperView<'_, f64>)) {
        let n = self.sizes();
        let (mut x, u, modes) = (vec![0.0; n.states], vec![0.0; n.inputs], vec![0; n.modes]);
        self.start(p, &mut x);
        let at = At { t: 0.0, x: &x, u: &u, p, modes: &modes };
        see(&self.view(&at, &self.poses(&at)));
    }

    fn own_parameters<'a, T>(&self, p: &'a [T]) -> &'a [T] {
        &p[self.begin.parameters..][..self.length.parameters]
    }
    fn own_states<'a, T>(&self, x: &'a [T]) -> &'a [T] {
        &x[self.begin.states..][..self.length.states]
    }
    /// What the chaser sees, with these inputs.
    fn own<'a, T: Scalar>(&self, at: &At<'a, T>, u: &'a [T]) -> At<'a, T> {
        At {
            t: at.t,
            x: self.own_states(at.x),
            u: &u[..self.length.inputs],
            p: self.own_parameters(at.p),
            // Before the start the caller need not have modes.
            modes: at.modes.get(self.begin.modes..).unwrap_or_default(),
        }
    }
    /// The chaser's inputs from outside and from the contact.
    fn pushed<T: Scalar>(&self, at: &At<'_, T>, on_host: &ContactWrench<T>) -> [T; MOST_INPUTS] {
        let mut u = [T::zero(); MOST_INPUTS];
        u[..self.length.inputs].copy_from_slice(&at.u[self.begin.inputs..]);
        self.chaser.push(self.own_states(at.x), self.own_parameters(at.p), on_host, &mut u);
        u
    }
    fn poses<T: Scalar>(&self, at: &At<'_, T>) -> Poses<T> {
        Poses {
            hand: self.chaser.hand(self.own_states(at.x), self.own_parameters(at.p)),
            target: frame(at.x, self.target_moved()),
        }
    }
    fn target_moved(&self) -> BodyMotionIndices {
        let s = &self.states;
        [s.target_position, s.target_attitude, s.target_velocity, s.target_rate]
    }
    fn view<'a, T: Scalar>(&self, at: &At<'a, T>, poses: &Poses<T>) -> GripperView<'a, T> {
        let center = two(at.p, self.gripper.parameters.target_center);
        GripperView {
            t: at.t,
            p: at.p,
            x: at.x,
            u: at.u,
            modes: at.modes,
            host: poses.hand,
            port: poses.target.at(center.map(|c| -c)),
        }
    }
    fn look<'a, T: Scalar>(&self, at: &At<'a, T>) -> (Poses<T>, GripperView<'a, T>, ContactState<T>) {
        let poses = self.poses(at);
        let view = self.view(at, &poses);
        let here = touch(&self.gripper, &view);
        (poses, view, here)
    }
    fn target<T: Scalar>(&self, p: &[T]) -> Inertia<T> {
        let at = &self.gripper.parameters;
        Inertia { mass: p[at.target_mass], inertia: p[at.target_inertia] }
    }
    /// Adds the momenta and energies of the masses other than the chaser to the chaser's outputs.
    fn add_beside<T: Scalar>(&self, at: &At<'_, T>, poses: &Poses<T>, here: &ContactState<T>, y: &mut [T]) {
        let places = self.chaser.momenta();
        add_momenta(y, places, &self.target(at.p), &poses.target);
        if self.gripper.structure.mount == Mount::Elastic {
            let ball = Inertia { mass: at.p[self.gripper.parameters.ball_mass], inertia: T::zero() };
            let velocity = two(at.x, self.gripper.states.ball_velocity);
            add_momenta(y, places, &ball, &PointFrame::new(here.balls[0], T::zero(), velocity, T::zero()));
        }
    }
}

impl<C: Chaser> Hybrid for CaptureScene<C> {
    fn sizes(&self) -> ModelSizes {
        ModelSizes {
            states: self.states.count,
            inputs: self.begin.inputs + self.length.inputs,
            parameters: self.parameters.count,
            outputs: self.outputs.count,
            modes: self.begin.modes + self.length.modes,
            indicators: self.begin.indicators + self.length.indicators,
        }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        x.fill(T::zero());
        let (from, own) = (&self.parameters, self.own_parameters(p));
        self.chaser.start(own, &mut x[self.begin.states..][..self.length.states]);
        let hand = self.chaser.hand(self.own_states(x), own);
        let port = hand.at(two(p, from.port_offset));
        let attitude = hand.attitude + p[from.port_angle];
        let target =
            PointFrame::new(port.position, attitude, two(p, from.target_velocity), p[from.target_rate]);
        let center = target.at(two(p, self.gripper.parameters.target_center)).position;
        let placed = PointFrame::new(center, attitude, target.velocity, target.rate);
        put(x, self.target_moved(), &placed);
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        let zeros = [0; MOST_MODES];
        let (of_gripper, of_chaser) = modes.split_at_mut(self.begin.modes);
        let unset = At { modes: &zeros[..of_gripper.len()], ..at };
        let view = self.view(&unset, &self.poses(&unset));
        self.gripper.start_modes(&view, of_gripper);
        let here = touch(&self.gripper, &GripperView { modes: of_gripper, ..view });
        let u = self.pushed(&at, &here.on_host);
        self.chaser.start_modes(self.own(&at, &u), of_chaser);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let (poses, view, here) = self.look(&at);
        self.gripper.rates(&view, &here, dx);
        let u = self.pushed(&at, &here.on_host);
        self.chaser.rates(self.own(&at, &u), &mut dx[self.begin.states..][..self.length.states]);
        let mut on_target = ContactWrench::default();
        carry(&mut on_target, &here.on_port, view.port.position, poses.target.position);
        put_rates(dx, self.target_moved(), &poses.target, &self.target(at.p), &on_target);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let (poses, view, here) = self.look(&at);
        self.gripper.write(&view, &here, y);
        let u = self.pushed(&at, &here.on_host);
        let of_chaser = &mut y[self.begin.outputs..][..self.length.outputs];
        self.chaser.outputs(self.own(&at, &u), of_chaser);
        self.add_beside(&at, &poses, &here, of_chaser);
        let to = &self.outputs;
        let motion = [to.target_position, to.target_attitude, to.target_velocity, to.target_rate];
        put(y, motion, &poses.target);
        let offset = view.host.inward(sub(view.port.position, view.host.position));
        y[to.port_offset..to.port_offset + 2].copy_from_slice(&offset);
        y[to.port_angle] = poses.target.attitude - poses.hand.attitude;
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        let (_, view, here) = self.look(&at);
        self.gripper.indicate(&view, &here, z);
        if self.length.indicators > 0 {
            let u = self.pushed(&at, &here.on_host);
            self.chaser.indicators(self.own(&at, &u), &mut z[self.begin.indicators..]);
        }
    }
    fn direction(&self, indicator: usize) -> Direction {
        match indicator.checked_sub(self.begin.indicators) {
            Some(own) => self.chaser.direction(own),
            None => Direction::Both,
        }
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let (of_gripper, of_chaser) = modes.split_at_mut(self.begin.modes);
        // Of the states, a gripper reads and changes its own.
        let (before, frozen) = copies(&x[..self.begin.states], of_gripper);
        let poses = self.poses(&At { t, x, u, p, modes: &[] });
        let at = At { t, x: &before[..self.begin.states], u, p, modes: &frozen[..self.begin.modes] };
        let done = self.gripper.update(&self.view(&at, &poses), &mut x[..self.begin.states], of_gripper);
        if !done.settled() || self.length.modes == 0 {
            return done;
        }
        let at = At { t, x, u, p, modes: of_gripper };
        let u = self.pushed(&at, &self.look(&at).2.on_host);
        let own = self.own_parameters(p);
        let x = &mut x[self.begin.states..][..self.length.states];
        self.chaser.update(t, x, &u[..self.length.inputs], own, of_chaser)
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        self.chaser.next_event(self.own_parameters(p), &modes[self.begin.modes..])
    }
}
