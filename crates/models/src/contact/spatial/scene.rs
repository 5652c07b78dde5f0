//! `CaptureScene` in space: a robot with a free base, a hand of balls at its first tip, a target.
//!
//! The vectors have the hand's values first, then the robot's, then the target's.
//! Positive directions: inertial axes unless a variable names others. What it gets wrong: as the robot; one contact per ball; friction is
//! smoothed; jaws without mass, which a schedule or a command moves however large the force, but for `holdForceLimit`; the target is
//! one rigid body.

use super::body::{BodyFrame, FloatingMass, FloatingRates, PointWrench, floating};
use super::layout::{
    HandCommand, HandOutputs, HandParameters, HandStates, SpatialGripperStructure, TargetOutputs,
    TargetParameters, TargetStates,
};
use super::touch::{HandContacts, contacts, vector};
use super::{outcome, parameters};
use crate::contact::MAX_BALLS;
use crate::contact::closing::{self, CLOSED, CLOSING, HandModes, JAMMED, Jaws};
use crate::contact::law::{self, FREE, touches};
use crate::contact::layout::Closing;
use crate::contact::outcome::{CaptureFacts, CaptureOutcome};
use crate::contact::presets::SIM2;
use crate::space::attitude::{self, rotation};
use crate::space::layout::{Inputs, Outputs, Parameters};
use crate::space::vector::{add, dot, matrix, sub, times};
use crate::space::{MAX_BODIES, MAX_MODES, MAX_THRUSTERS, MAX_TIPS, RobotStructure, SpatialFreeFlyer};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// Most inputs of a robot: joints, thrusters, wrenches on base and tips, references of servos.
const MOST_INPUTS: usize = 2 * MAX_BODIES + MAX_THRUSTERS + 6 + 6 * MAX_TIPS;

/// Most modes of a scene: those of a hand and of a robot's effects.
const MOST_MODES: usize = MAX_BALLS + 3 + MAX_MODES;

/// The structure of a capture in space.
#[derive(Clone, Debug)]
pub struct SpatialCaptureScene {
    structure: SpatialGripperStructure,
    robot: SpatialFreeFlyer,
    /// Of the robot's values: where they begin, behind the hand's, and how many there are.
    begin: ModelSizes,
    length: ModelSizes,
    hand: HandParameters,
    command: HandCommand,
    shown: HandOutputs,
    state: HandStates,
    target: TargetParameters,
    target_shown: TargetOutputs,
    target_state: TargetStates,
    sizes: ModelSizes,
    /// Of the robot's tip wrench among its inputs, its momenta and its kinetic energy among its outputs.
    tip: [usize; 2],
    momenta: [usize; 3],
}

/// What is at one instant.
struct HandInstant<T> {
    host: BodyFrame<T>,
    target: BodyFrame<T>,
    port: BodyFrame<T>,
    jaws: Jaws<T>,
    met: HandContacts<T>,
}

impl SpatialCaptureScene {
    /// With this robot, whose first tip has the hand; its effects act here.
    ///
    /// # Errors
    /// A structure that is not possible, with the remedy.
    pub fn new(robot: SpatialFreeFlyer, structure: SpatialGripperStructure) -> Result<Self, String> {
        let (balls, of) = (structure.balls, robot.structure());
        if balls == 0 || balls > MAX_BALLS {
            return Err(format!("a hand of {balls} balls: it has 1 to {MAX_BALLS}; give numberOfBalls"));
        }
        if structure.closing == Closing::Motor {
            return Err("in space jaws have no motor: give closing=schedule or closing=command".into());
        }
        if of.tips.is_empty() {
            return Err("a robot without a tip carries no hand: give it one".into());
        }
        let (command, shown) = (HandCommand::new(&structure), HandOutputs::new(&structure));
        let (hand, state) = (HandParameters::new(&structure), HandStates::new(&structure));
        let begin = ModelSizes {
            states: state.count,
            inputs: command.count,
            parameters: hand.count,
            outputs: shown.count,
            modes: HandModes::of(balls).count,
            indicators: 2 * balls + 3,
        };
        let (inputs, outputs, length) = (Inputs::new(of), Outputs::new(of), robot.sizes());
        let target = TargetParameters::new(&()).behind(begin.parameters + length.parameters);
        let target_shown = TargetOutputs::new(&()).behind(begin.outputs + length.outputs);
        let target_state = TargetStates::new(&()).behind(begin.states + length.states);
        let sizes = ModelSizes {
            states: target_state.count,
            inputs: begin.inputs + length.inputs,
            parameters: target.count,
            outputs: target_shown.count,
            modes: begin.modes + length.modes,
            indicators: begin.indicators + length.indicators,
        };
        Ok(Self {
            structure,
            begin,
            sizes,
            length,
            hand,
            command,
            shown,
            state,
            target,
            target_shown,
            target_state,
            tip: [inputs.tip_force, inputs.tip_torque],
            momenta: [outputs.linear_momentum, outputs.angular_momentum, outputs.kinetic_energy],
            robot,
        })
    }
    /// Its hand's structure.
    pub fn structure(&self) -> &SpatialGripperStructure {
        &self.structure
    }
    /// Its robot.
    pub fn robot(&self) -> &SpatialFreeFlyer {
        &self.robot
    }
    /// Values of SIM2 with these of the robot, whose hand comes nearer along its x; a base that is held does not.
    pub fn defaults(&self, of_robot: &[f64]) -> Vec<f64> {
        let mut p = parameters::defaults(&self.structure);
        p.extend_from_slice(of_robot);
        p.resize(self.target.count, 0.0);
        parameters::placed(&self.structure, &self.target, &mut p);
        let s: &RobotStructure = self.robot.structure();
        if !s.held {
            let mut x = vec![0.0; self.length.states];
            self.robot.start(of_robot, &mut x);
            let axis = self.host(&x, of_robot).rotation.map(|row| row[0] * SIM2.speed);
            let velocity = self.begin.parameters + Parameters::new(s).initial_base_velocity;
            p[velocity..velocity + 3].copy_from_slice(&axis);
        }
        p
    }
    /// Whether the parameters fit each other.
    ///
    /// # Errors
    /// Where they contradict each other: the index of one of them, and the remedy.
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        parameters::check((&self.structure, &self.hand), &self.target, p)?;
        self.robot.check(self.own_parameters(p)).map_err(|(i, why)| (i + self.begin.parameters, why))?;
        let n = self.sizes();
        let (mut x, u, modes) = (vec![0.0; n.states], vec![0.0; n.inputs], vec![0; n.modes]);
        self.start(p, &mut x);
        let at = At { t: 0.0, x: &x, u: &u, p, modes: &modes };
        let refused = |why| Err((self.target.port_offset, why));
        if let Some(fault) = self.fault(&at) {
            return refused(fault);
        }
        let Some((ball, depth)) = self.deepest(&at) else { return Ok(()) };
        let radius = p[self.hand.ball_radius + ball];
        if depth <= radius {
            return Ok(());
        }
        refused(format!(
            "ball {} begins {depth:.4} m deep in the port, deeper than its radius of {radius:.4} m; begin further apart",
            ball + 1
        ))
    }
    /// A command beyond its ends, and how it is taken.
    pub fn clipped(&self, at: &At<'_, f64>) -> Option<String> {
        if self.structure.closing != Closing::Command {
            return None;
        }
        let (t, close) = (at.t, at.u[self.command.close]);
        let end = close.clamp(0.0, 1.0);
        (close != end).then(|| format!("`close` = {close} at t = {t} s is taken as {end}"))
    }
    /// Balls that overlap where the run begins.
    pub fn overlap(&self, at: &At<'_, f64>) -> Option<String> {
        if at.t != at.x[self.state.begin] {
            return None;
        }
        let (ball, depth) = self.deepest(at)?;
        Some(format!(
            "ball {} begins {depth:.6} m deep in the port: the first contact is no impact",
            ball + 1
        ))
    }
    /// Why values are not numbers, where no direction is nearest.
    pub fn fault(&self, at: &At<'_, f64>) -> Option<String> {
        let now = self.look(at);
        let ball = (0..self.structure.balls).find(|i| now.met.pairs[*i].normal[0].is_nan())?;
        Some(format!(
            "ball {} is where no point of the port's {:?} is nearest at t = {} s: their contact has no normal; set \
             initialPortOffset further from its middle",
            ball + 1,
            self.structure.against,
            at.t
        ))
    }
    fn deepest(&self, at: &At<'_, f64>) -> Option<(usize, f64)> {
        let now = self.look(at);
        (0..self.structure.balls)
            .map(|i| (i, now.met.pairs[i].penetration))
            .filter(|(_, depth)| *depth > 0.0)
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn own_parameters<'a, T>(&self, p: &'a [T]) -> &'a [T] {
        &p[self.begin.parameters..][..self.length.parameters]
    }
    fn own_modes<'a>(&self, modes: &'a [i32]) -> &'a [i32] {
        modes.get(self.begin.modes..).unwrap_or_default()
    }
    fn own_states<'a, T>(&self, x: &'a [T]) -> &'a [T] {
        &x[self.begin.states..][..self.length.states]
    }
    /// The end effector by the robot's states and parameters.
    fn host<T: Scalar>(&self, x: &[T], p: &[T]) -> BodyFrame<T> {
        let (frame, velocity, rate) = self.robot.first_tip(x, p);
        BodyFrame { position: frame.origin, rotation: frame.rotation, velocity, rate }
    }
    fn target_places(&self) -> [usize; 4] {
        let s = &self.target_state;
        [s.position, s.quaternion, s.velocity, s.rate]
    }
    fn hand_modes(&self) -> HandModes {
        HandModes::of(self.structure.balls)
    }
    fn jaws<T: Scalar>(&self, at: &At<'_, T>) -> Jaws<T> {
        match self.structure.closing {
            Closing::Command => closing::commanded(at.u[self.command.close], at.u[self.command.close_rate]),
            Closing::Schedule | Closing::Motor => closing::scheduled(
                at.x[self.state.closing],
                at.p[self.hand.closing_time],
                at.modes[self.hand_modes().jaws],
            ),
        }
    }
    fn look<T: Scalar>(&self, at: &At<'_, T>) -> HandInstant<T> {
        let host = self.host(self.own_states(at.x), self.own_parameters(at.p));
        let target = floating(at.x, self.target_places());
        let center = vector(at.p, self.hand.target_center);
        let port = target.at(center.map(|c| -c));
        let jaws = self.jaws(at);
        let met = contacts((&self.structure, &self.hand, at.p), (&host, &port), &jaws, at.modes);
        HandInstant { host, target, port, jaws, met }
    }
    /// The robot's inputs from outside and from the contact.
    fn pushed<T: Scalar>(&self, at: &At<'_, T>, on_host: &PointWrench<T>) -> [T; MOST_INPUTS] {
        let mut u = [T::zero(); MOST_INPUTS];
        u[..self.length.inputs].copy_from_slice(&at.u[self.begin.inputs..][..self.length.inputs]);
        for i in 0..3 {
            u[self.tip[0] + i] += on_host.force[i];
            u[self.tip[1] + i] += on_host.torque[i];
        }
        u
    }
    /// What the robot sees, with these inputs.
    fn own<'a, T: Scalar>(&self, at: &At<'a, T>, u: &'a [T]) -> At<'a, T> {
        At {
            t: at.t,
            x: self.own_states(at.x),
            u: &u[..self.length.inputs],
            p: self.own_parameters(at.p),
            modes: self.own_modes(at.modes),
        }
    }
    fn mass<T: Scalar>(&self, p: &[T]) -> FloatingMass<T> {
        FloatingMass { mass: p[self.hand.target_mass], inertia: matrix(p, self.hand.target_inertia) }
    }
    fn touching<'m>(&self, modes: &'m [i32]) -> impl Iterator<Item = usize> + 'm {
        modes[..self.structure.balls].iter().enumerate().filter(|(_, m)| touches(**m)).map(|(i, _)| i)
    }
    /// Of the port against the hand, m/s.
    fn relative_speed<T: Scalar>(&self, now: &HandInstant<T>) -> f64 {
        let relative = sub(now.port.velocity, now.host.velocity_at(now.port.position)).map(Scalar::value);
        dot(relative, relative).sqrt()
    }
    fn outcome<T: Scalar>(&self, at: &At<'_, T>, now: &HandInstant<T>) -> CaptureOutcome {
        let s = &self.state;
        let (t, n) = (at.t.value(), self.structure.balls);
        let (host, port) = (now.host.values(), now.port.values());
        let balls: [_; MAX_BALLS] = core::array::from_fn(|i| now.met.balls[i].map(Scalar::value));
        let first: [f64; 9] = core::array::from_fn(|i| at.x[s.first_attitude + i].value());
        let touches_palm = touches(at.modes[0]);
        let touching = self.touching(at.modes).count();
        let apart = sub(port.position, host.position);
        let going = sub(port.velocity, host.velocity);
        let own = |begin: usize| at.p[begin].value();
        let reach = own(self.hand.ball_radius)
            + if self.structure.against == super::SolidShape::Plate {
                0.0
            } else {
                own(self.hand.port_radius)
            };
        let since_contact = if touching > 0 { 0.0 } else { t - at.x[s.last_contact].value() };
        CaptureFacts {
            closed: match self.structure.closing {
                Closing::Command => now.jaws.position.value() >= 1.0,
                Closing::Schedule | Closing::Motor => at.modes[self.hand_modes().jaws] == CLOSED,
            },
            jammed: at.modes[self.hand_modes().jaws] == JAMMED,
            caged: outcome::within(&host, port.position, &balls[..n], reach),
            speed: [self.relative_speed(now), at.x[s.first_speed].value()],
            turn: outcome::turn(&matrix(&first, 0), &outcome::relative(&host.rotation, &port.rotation)),
            touches_palm,
            touching_jaws: touching - usize::from(touches_palm),
            since: [since_contact, t - at.x[s.begin].value()],
            parting: dot(apart, going) > 0.0,
        }
        .outcome()
    }

    fn write<T: Scalar>(&self, at: &At<'_, T>, now: &HandInstant<T>, y: &mut [T]) {
        let (to, met) = (&self.shown, &now.met);
        for i in 0..3 {
            y[to.host_force + i] = met.on_host.force[i];
            y[to.host_torque + i] = met.on_host.torque[i];
            y[to.port_force + i] = met.on_port.force[i];
            y[to.port_torque + i] = met.on_port.torque[i];
        }
        for i in 0..self.structure.balls {
            y[to.force + i] = met.forces[i];
            y[to.normal + 3 * i..][..3].copy_from_slice(&met.pairs[i].normal);
            y[to.penetration + i] = met.pairs[i].penetration;
            y[to.approach + i] = met.pairs[i].approach;
            y[to.in_contact + i] = T::constant(if touches(at.modes[i]) { 1.0 } else { 0.0 });
        }
        y[to.jaw_position] = now.jaws.position;
        y[to.elastic_energy] = met.elastic;
        y[to.dissipated_energy] = at.x[self.state.dissipated_energy];
        y[to.jaw_work] = at.x[self.state.jaw_work];
        y[to.relative_energy] = self.relative_energy(at, now);
        // Before the first event there is none yet.
        let outcome = match at.modes[self.hand_modes().outcome] {
            0 => CaptureOutcome::Open as i32,
            known => known,
        };
        y[to.outcome] = T::constant(f64::from(outcome));
    }
    fn relative_energy<T: Scalar>(&self, at: &At<'_, T>, now: &HandInstant<T>) -> T {
        let mass = self.mass(at.p);
        let velocity = sub(now.target.velocity, now.host.velocity_at(now.target.position)); // (CON-6)
        let rate = now.target.inward(sub(now.target.rate, now.host.rate));
        (mass.mass * dot(velocity, velocity) + dot(rate, times(&mass.inertia, rate))) * 0.5 // (CON-6)
    }
}

impl Hybrid for SpatialCaptureScene {
    fn sizes(&self) -> ModelSizes {
        self.sizes
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        x.fill(T::zero());
        let (from, own) = (&self.target, self.own_parameters(p));
        self.robot.start(own, &mut x[self.begin.states..][..self.length.states]);
        let host = self.host(self.own_states(x), own);
        let of_hand = self.robot.first_tip_quaternion(self.own_states(x), own);
        let turn = core::array::from_fn(|i| p[from.port_quaternion + i]);
        let quaternion = attitude::normalized(attitude::product(of_hand, turn));
        let rotation = rotation(quaternion);
        let port = host.at(vector(p, from.port_offset)).position;
        let center = add(port, times(&rotation, vector(p, self.hand.target_center)));
        let to = &self.target_state;
        x[to.position..to.position + 3].copy_from_slice(&center);
        x[to.quaternion..to.quaternion + 4].copy_from_slice(&quaternion);
        x[to.velocity..to.velocity + 3].copy_from_slice(&vector(p, from.velocity));
        x[to.rate..to.rate + 3].copy_from_slice(&vector(p, from.rate));
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        modes.fill(0);
        let unset = [FREE; MAX_BALLS + 3];
        let begin = At { modes: &unset[..self.begin.modes], ..at };
        let now = self.look(&begin);
        for i in 0..self.structure.balls {
            modes[i] = law::next_mode(FREE, &now.met.pairs[i]);
        }
        if self.begin.modes < modes.len() {
            let u = self.pushed(&begin, &now.met.on_host);
            self.robot.start_modes(self.own(&begin, &u), &mut modes[self.begin.modes..]);
        }
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let now = self.look(&at);
        let to = &self.state;
        dx[..self.begin.states].fill(T::zero());
        dx[to.dissipated_energy] = now.met.loss;
        dx[to.jaw_work] = now.met.jaw_power;
        if self.structure.closing == Closing::Schedule && at.modes[self.hand_modes().jaws] == CLOSING {
            dx[to.closing] = T::one() / at.p[self.hand.closing_time];
        }
        let u = self.pushed(&at, &now.met.on_host);
        self.robot.rates(self.own(&at, &u), &mut dx[self.begin.states..][..self.length.states]);
        let mut by = PointWrench::none();
        by.add(now.met.on_port.force, sub(now.port.position, now.target.position));
        by.torque = add(by.torque, now.met.on_port.torque);
        let q = core::array::from_fn(|i| at.x[self.target_state.quaternion + i]);
        let FloatingRates { position, quaternion, velocity, rate } =
            self.mass(at.p).rates(&now.target, q, &by);
        let to = &self.target_state;
        dx[to.position..to.position + 3].copy_from_slice(&position);
        dx[to.quaternion..to.quaternion + 4].copy_from_slice(&quaternion);
        dx[to.velocity..to.velocity + 3].copy_from_slice(&velocity);
        dx[to.rate..to.rate + 3].copy_from_slice(&rate);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let now = self.look(&at);
        self.write(&at, &now, y);
        let u = self.pushed(&at, &now.met.on_host);
        let of_robot = &mut y[self.begin.outputs..][..self.length.outputs];
        self.robot.outputs(self.own(&at, &u), of_robot);
        let (momentum, angular, kinetic) = self.mass(at.p).momenta(&now.target);
        for i in 0..3 {
            of_robot[self.momenta[0] + i] += momentum[i];
            of_robot[self.momenta[1] + i] += angular[i];
        }
        of_robot[self.momenta[2]] += kinetic;
        let (to, from) = (&self.target_shown, &self.target_state);
        for i in 0..3 {
            y[to.position + i] = at.x[from.position + i];
            y[to.velocity + i] = at.x[from.velocity + i];
            y[to.rate + i] = at.x[from.rate + i];
        }
        let q = attitude::normalized(core::array::from_fn(|i| at.x[from.quaternion + i]));
        y[to.quaternion..to.quaternion + 4].copy_from_slice(&q);
        let offset = now.host.inward(sub(now.port.position, now.host.position));
        y[to.port_offset..to.port_offset + 3].copy_from_slice(&offset);
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        let (now, n) = (self.look(&at), self.structure.balls);
        for i in 0..n {
            [z[2 * i], z[2 * i + 1]] = law::indicators(at.modes[i], &now.met.pairs[i]);
        }
        (z[2 * n], z[2 * n + 1]) = (T::one(), T::one());
        if self.structure.closing == Closing::Schedule && at.modes[self.hand_modes().jaws] == CLOSING {
            z[2 * n] = -at.x[self.state.closing] + 1.0;
            z[2 * n + 1] = at.p[self.hand.hold_force] - now.met.jaw_force;
        }
        let same = self.outcome(&at, &now) as i32 == at.modes[self.hand_modes().outcome];
        z[2 * n + 2] = T::constant(if same { 1.0 } else { -1.0 });
        if self.begin.indicators < z.len() {
            let u = self.pushed(&at, &now.met.on_host);
            self.robot.indicators(self.own(&at, &u), &mut z[self.begin.indicators..]);
        }
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let mut frozen = [0; MOST_MODES];
        let before = &mut frozen[..modes.len()];
        before.copy_from_slice(modes);
        let at = At { t, x, u, p, modes: before };
        let now = self.look(&at);
        let outcome = self.outcome(&at, &now) as i32;
        let s = &self.state;
        let mut done = EventUpdate::default();
        for i in 0..self.structure.balls {
            let mode = law::next_mode(modes[i], &now.met.pairs[i]);
            done.modes |= mode != modes[i];
            modes[i] = mode;
        }
        if self.touching(before).count() > 0 && self.touching(modes).count() == 0 {
            (x[s.last_contact], done.states) = (t, true);
        }
        let jaws = &mut modes[self.hand_modes().jaws];
        if self.structure.closing == Closing::Schedule && *jaws == CLOSING {
            if x[s.closing] >= 1.0 {
                (*jaws, x[s.closing], done) = (CLOSED, 1.0, EventUpdate { modes: true, states: true });
            } else if now.met.jaw_force >= p[self.hand.hold_force] {
                (*jaws, done.modes) = (JAMMED, true);
            }
        }
        if before[self.hand_modes().begun] == 0 {
            modes[self.hand_modes().begun] = 1;
            x[s.first_speed] = self.relative_speed(&now);
            let first = outcome::relative(&now.host.rotation, &now.port.rotation);
            x[s.first_attitude..s.first_attitude + 9].copy_from_slice(first.as_flattened());
            (x[s.begin], x[s.last_contact]) = (t, t);
            done = EventUpdate { modes: true, states: true };
        }
        if done.settled() {
            let slot = &mut modes[self.hand_modes().outcome];
            done.modes = *slot != outcome;
            *slot = outcome;
        }
        if self.begin.modes < modes.len() {
            let u = self.pushed(&At { t, x, u, p, modes: before }, &now.met.on_host);
            let (x, modes) = (&mut x[self.begin.states..], &mut modes[self.begin.modes..]);
            let (x, u) = (&mut x[..self.length.states], &u[..self.length.inputs]);
            let own = self.robot.update(t, x, u, self.own_parameters(p), modes);
            (done.modes, done.states) = (done.modes || own.modes, done.states || own.states);
        }
        done
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        self.robot.next_event(self.own_parameters(p), self.own_modes(modes))
    }
}
