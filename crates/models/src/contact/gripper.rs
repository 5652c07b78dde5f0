//! A gripper between an end effector and a target's port: what holds at every instant, and at events.

use super::MAX_BALLS;
use super::carriage::LOCKED;
use super::closing::{self, CLOSED, CLOSING, HandModes, JAMMED, Jaws, OPEN};
use super::frame::{dot, sub, two};
use super::law::{self, FREE, touches};
use super::layout::{
    Closing, Command, GripperStructure, LOCKS, Mount, Outputs, Parameters, PortShape, States,
};
use super::outcome::{CaptureFacts, CaptureOutcome, caged};
use super::touch::{ContactState, relative_motion, touch};
use super::view::{Gripper, GripperView};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{EventUpdate, ModelSizes};

impl Gripper {
    pub(super) fn new(structure: GripperStructure) -> Result<Self, String> {
        let GripperStructure { balls, mount, .. } = structure;
        if balls == 0 || balls > MAX_BALLS {
            return Err(format!("a gripper of {balls} balls: it has 1 to {MAX_BALLS}; give numberOfBalls"));
        }
        if mount == Mount::Carriages && balls < 3 {
            return Err(format!(
                "a gripper of {balls} balls has no rollers on both of its carriages: pack it with numberOfBalls=3 or more"
            ));
        }
        if mount == Mount::Elastic && balls != 1 {
            return Err(format!(
                "a mount that is elastic is for one ball, not for {balls}: pack it with numberOfBalls=1"
            ));
        }
        Ok(Self {
            parameters: Parameters::new(&structure),
            command: Command::new(&structure),
            outputs: Outputs::new(&structure),
            states: States::new(&structure),
            structure,
        })
    }
    fn hand_modes(&self) -> HandModes {
        HandModes::of(self.structure.balls)
    }
    /// Of the carriages, behind all others.
    pub(super) fn carriage_modes(&self) -> usize {
        self.hand_modes().count
    }
    fn modes(&self) -> usize {
        self.hand_modes().count + if self.structure.sliding() { 2 } else { 0 }
    }
    /// Two for each ball, two of the jaws, one of the outcome; two for each carriage, one of their lock.
    fn indicators(&self) -> usize {
        2 * self.structure.balls + 3 + if self.structure.sliding() { 5 } else { 0 }
    }

    /// Of a gripper alone.
    pub(super) fn sizes(&self) -> ModelSizes {
        ModelSizes {
            states: self.states.count,
            inputs: self.command.count,
            parameters: self.parameters.count,
            outputs: self.outputs.count,
            modes: self.modes(),
            indicators: self.indicators(),
        }
    }

    pub(super) fn start_modes(&self, v: &GripperView<'_, f64>, modes: &mut [i32]) {
        let here = touch(self, v);
        for i in 0..self.structure.balls {
            modes[i] = law::next_mode(FREE, &here.pairs[i]);
        }
    }
    /// Of the port's ball, m.
    pub(super) fn port_radius(&self, p: &[f64]) -> Option<f64> {
        (self.structure.against != PortShape::Plate).then(|| p[self.parameters.port_radius])
    }

    pub(super) fn jaws<T: Scalar>(&self, v: &GripperView<'_, T>) -> Jaws<T> {
        match self.structure.closing {
            Closing::Schedule => closing::scheduled(
                v.x[self.states.closing],
                v.p[self.parameters.closing_time],
                v.modes[self.hand_modes().jaws],
            ),
            Closing::Command => closing::commanded(v.u[self.command.close], v.u[self.command.close_rate]),
            Closing::Motor => closing::driven(
                v.x[self.states.jaw],
                v.x[self.states.jaw_rate],
                v.modes[self.hand_modes().jaws],
            ),
        }
    }
    /// Of the motor against jawPosition, within its limit, N.m.
    fn motor_torque<T: Scalar>(&self, v: &GripperView<'_, T>) -> T {
        let most = v.p[self.parameters.motor_limit];
        let own = v.u[self.command.motor_torque].min(most).max(-most);
        if !self.structure.sliding() {
            return own;
        }
        own * v.p[self.parameters.spindle_turns] * (2.0 * core::f64::consts::PI) // (CON-14)
    }
    /// The jaws are closed.
    fn closed<T: Scalar>(&self, v: &GripperView<'_, T>, jaws: &Jaws<T>) -> bool {
        match self.structure.closing {
            Closing::Schedule | Closing::Motor => v.modes[self.hand_modes().jaws] == CLOSED,
            Closing::Command => jaws.position.value() >= 1.0,
        }
    }
    /// The carriages are to be locked, and closed jaws with them.
    fn locks<T: Scalar>(&self, v: &GripperView<'_, T>, jaws: &Jaws<T>) -> bool {
        self.structure.sliding() && v.p[self.parameters.rigidization].value() == LOCKS && self.closed(v, jaws) // (CON-14)
    }
    /// What moves jaws with a motor, N.m: at their stop and locked, contacts do not.
    fn net_torque<T: Scalar>(&self, v: &GripperView<'_, T>, touch: &ContactState<T>) -> T {
        let motor = self.motor_torque(v);
        if self.locks(v, &touch.jaws) { motor } else { motor - touch.jaw_load }
    }

    pub(super) fn rates<T: Scalar>(&self, v: &GripperView<'_, T>, touch: &ContactState<T>, dx: &mut [T]) {
        let at = &self.states;
        dx[at.dissipated_energy] = touch.loss;
        dx[at.jaw_work] = touch.jaw_power;
        if self.structure.closing == Closing::Motor {
            let (rate, motor) = (touch.jaws.rate, self.motor_torque(v));
            let friction = v.p[self.parameters.jaw_friction] * rate;
            let moves = v.modes[self.hand_modes().jaws] == CLOSING;
            let net = motor - friction - touch.jaw_load; // (CON-11)
            dx[at.jaw] = rate;
            dx[at.jaw_rate] = if moves { net / v.p[self.parameters.jaw_inertia] } else { T::zero() };
            dx[at.jaw_work] = motor * rate;
            dx[at.dissipated_energy] += friction * rate;
        }
        for i in [at.first_speed, at.first_angle, at.begin, at.last_contact] {
            dx[i] = T::zero();
        }
        if self.structure.sliding() {
            for (c, slide) in touch.slides.iter().enumerate() {
                dx[at.carriage + c] = slide.rate;
            }
        }
        if self.structure.closing == Closing::Schedule {
            let closes = v.modes[self.hand_modes().jaws] == CLOSING;
            dx[at.closing] = if closes { T::one() / v.p[self.parameters.closing_time] } else { T::zero() };
        }
        if self.structure.mount == Mount::Elastic {
            for i in 0..2 {
                dx[at.ball_displacement + i] = touch.mounted[0][i];
                dx[at.ball_velocity + i] = touch.mounted[1][i];
            }
        }
    }

    pub(super) fn write<T: Scalar>(&self, v: &GripperView<'_, T>, touch: &ContactState<T>, y: &mut [T]) {
        let at = &self.outputs;
        for i in 0..2 {
            y[at.host_force + i] = touch.on_host.force[i];
            y[at.port_force + i] = touch.on_port.force[i];
        }
        y[at.host_torque] = touch.on_host.torque;
        y[at.port_torque] = touch.on_port.torque;
        for i in 0..self.structure.balls {
            y[at.force + i] = touch.forces[i];
            y[at.penetration + i] = touch.pairs[i].penetration;
            y[at.approach + i] = touch.pairs[i].approach;
            y[at.in_contact + i] = T::constant(if touches(v.modes[i]) { 1.0 } else { 0.0 });
        }
        y[at.jaw_position] = touch.jaws.position;
        if self.structure.closing == Closing::Motor {
            y[at.jaw_energy] = v.p[self.parameters.jaw_inertia] * touch.jaws.rate * touch.jaws.rate * 0.5;
        }
        if self.structure.sliding() {
            for (c, slide) in touch.slides.iter().enumerate() {
                y[at.carriage_position + c] = slide.position;
            }
            let locked = self.carriage_mode(v.modes, 0) == LOCKED;
            y[at.operation] = T::constant(if locked { 2.0 } else { 1.0 });
        }
        y[at.elastic_energy] = touch.elastic;
        y[at.dissipated_energy] = v.x[self.states.dissipated_energy];
        y[at.jaw_work] = v.x[self.states.jaw_work];
        y[at.relative_energy] = relative_motion(self, v, touch.jaw_motion, 1.0) * 0.5;
        y[at.relative_energy_printed] = relative_motion(self, v, touch.jaw_motion, -1.0) * 0.5;
        // Before the first event there is none yet.
        let outcome = match v.modes[self.hand_modes().outcome] {
            0 => CaptureOutcome::Open as i32,
            known => known,
        };
        y[at.outcome] = T::constant(f64::from(outcome));
    }

    /// Indicators: of each pair; jaws closed; jaws at their limit; whether the outcome is still that of its mode.
    pub(super) fn indicate<T: Scalar>(&self, v: &GripperView<'_, T>, touch: &ContactState<T>, z: &mut [T]) {
        let n = self.structure.balls;
        for i in 0..n {
            [z[2 * i], z[2 * i + 1]] = law::indicators(v.modes[i], &touch.pairs[i]);
        }
        (z[2 * n], z[2 * n + 1]) = (T::one(), T::one());
        if self.structure.closing == Closing::Schedule && v.modes[self.hand_modes().jaws] == CLOSING {
            z[2 * n] = -v.x[self.states.closing] + 1.0;
            z[2 * n + 1] = v.p[self.parameters.hold_force] - touch.jaw_force;
        }
        if self.structure.closing == Closing::Motor {
            let (position, net) = (touch.jaws.position, self.net_torque(v, touch));
            match v.modes[self.hand_modes().jaws] {
                CLOSED => z[2 * n] = -net, // they leave where it is above 0
                OPEN => z[2 * n + 1] = net,
                _ => (z[2 * n], z[2 * n + 1]) = (position - 1.0, -position),
            }
        }
        let same = self.outcome(v, touch) as i32 == v.modes[self.hand_modes().outcome];
        z[2 * n + 2] = T::constant(if same { 1.0 } else { -1.0 });
        if self.structure.sliding() {
            let locks = self.locks(v, &touch.jaws);
            self.indicate_carriages(v, &touch.slides, locks, &mut z[2 * n + 3..]);
        }
    }

    /// One pass of event iteration; `x` and `modes` are those that `v` shows.
    pub(super) fn update(&self, v: &GripperView<'_, f64>, x: &mut [f64], modes: &mut [i32]) -> EventUpdate {
        let at = &self.states;
        let mut done = EventUpdate::default();
        let here = touch(self, v);
        let touched = self.touching(v.modes).count() > 0;
        for i in 0..self.structure.balls {
            let mode = law::next_mode(modes[i], &here.pairs[i]);
            done.modes |= mode != modes[i];
            modes[i] = mode;
        }
        if touched && self.touching(modes).count() == 0 {
            x[at.last_contact] = v.t;
            done.states = true;
        }
        let jaws = &mut modes[self.hand_modes().jaws];
        if self.structure.closing == Closing::Schedule && *jaws == CLOSING {
            if v.x[at.closing] >= 1.0 {
                (*jaws, x[at.closing], done) = (CLOSED, 1.0, EventUpdate { modes: true, states: true });
            } else if here.jaw_force >= v.p[self.parameters.hold_force] {
                (*jaws, done.modes) = (JAMMED, true);
            }
        }
        if self.structure.closing == Closing::Motor {
            self.stops(v, self.net_torque(v, &here), x, modes, &mut done);
        }
        if self.structure.sliding() {
            let locks = self.locks(v, &here.jaws);
            let changed = self.update_carriages(v, &here.slides, locks, (&mut *x, &mut *modes));
            done.modes |= changed;
            done.states |= changed;
        }
        if v.modes[self.hand_modes().begun] == 0 {
            modes[self.hand_modes().begun] = 1;
            x[at.first_speed] = self.relative_speed(v);
            x[at.first_angle] = v.port.attitude - v.host.attitude;
            (x[at.begin], x[at.last_contact]) = (v.t, v.t);
            if self.structure.mount == Mount::Elastic {
                let start = v.host.at(two(v.p, self.parameters.open)).velocity;
                x[at.ball_velocity..at.ball_velocity + 2].copy_from_slice(&start);
            }
            done = EventUpdate { modes: true, states: true };
        }
        if done.settled() {
            let outcome = self.outcome(v, &here) as i32;
            let slot = &mut modes[self.hand_modes().outcome];
            done.modes = *slot != outcome;
            *slot = outcome;
        }
        done
    }

    /// Jaws with a motor stay at a stop that they run into, and while they are pressed against it (CON-11).
    fn stops(
        &self,
        v: &GripperView<'_, f64>,
        net: f64,
        x: &mut [f64],
        modes: &mut [i32],
        done: &mut EventUpdate,
    ) {
        let (at, mode) = (&self.states, &mut modes[self.hand_modes().jaws]);
        let (position, rate) = (v.x[at.jaw], v.x[at.jaw_rate]);
        let into = |beyond: bool, way: f64| beyond && (way * rate > 0.0 || (rate == 0.0 && way * net >= 0.0));
        let next = match *mode {
            CLOSED if net < 0.0 => CLOSING,
            OPEN if net > 0.0 => CLOSING,
            CLOSING if into(position >= 1.0, 1.0) => CLOSED,
            CLOSING if into(position <= 0.0, -1.0) => OPEN,
            same => same,
        };
        if next == *mode {
            return;
        }
        if next != CLOSING {
            x[at.dissipated_energy] += 0.5 * v.p[self.parameters.jaw_inertia] * rate * rate;
            x[at.jaw] = if next == CLOSED { 1.0 } else { 0.0 };
        }
        x[at.jaw_rate] = 0.0;
        *mode = next;
        *done = EventUpdate { modes: true, states: true };
    }

    fn touching<'m>(&self, modes: &'m [i32]) -> impl Iterator<Item = usize> + 'm {
        modes[..self.structure.balls].iter().enumerate().filter(|(_, m)| touches(**m)).map(|(i, _)| i)
    }
    /// Of the port against the hand, m/s.
    fn relative_speed<T: Scalar>(&self, v: &GripperView<'_, T>) -> f64 {
        let relative = sub(v.port.velocity, v.host.velocity_at(v.port.position)).map(Scalar::value);
        dot(relative, relative).sqrt()
    }

    fn outcome<T: Scalar>(&self, v: &GripperView<'_, T>, touch: &ContactState<T>) -> CaptureOutcome {
        let at = &self.states;
        let n = self.structure.balls;
        let t = v.t.value();
        let touches_palm = touches(v.modes[0]);
        let touching = self.touching(v.modes).count();
        let balls: [_; MAX_BALLS] = core::array::from_fn(|i| touch.balls[i].map(Scalar::value));
        let apart = sub(v.port.position, v.host.position).map(Scalar::value);
        let going = sub(v.port.velocity, v.host.velocity).map(Scalar::value);
        let since_contact = if touching > 0 { 0.0 } else { t - v.x[at.last_contact].value() };
        CaptureFacts {
            closed: self.closed(v, &touch.jaws),
            jammed: v.modes[self.hand_modes().jaws] == JAMMED,
            caged: caged(v.port.position.map(Scalar::value), &balls[..n]),
            speed: [self.relative_speed(v), v.x[at.first_speed].value()],
            turn: (v.port.attitude - v.host.attitude - v.x[at.first_angle]).value(),
            touches_palm,
            touching_jaws: touching - usize::from(touches_palm),
            since: [since_contact, t - v.x[at.begin].value()],
            parting: dot(apart, going) > 0.0,
        }
        .outcome()
    }
}
