//! A joint of two masses (Comi et al., section 3.2), written from the paper: motor and load angle, a spring between
//! them behind a gear, dry and viscous friction at the motor. Motor-side quantities unless stated.

use super::law::{JointLaw, JointLawEffect};
use super::values::{JointState, JointValues};
use crate::slip::Slip;

/// How the motor moves: dry friction holds it, or works against this direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StickMode {
    Stuck,
    Slides(f64),
}

/// All torques at one instant.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Torques {
    /// On the motor, without its friction.
    pub(crate) motor: f64,
    /// In the spring, motor side.
    pub(crate) spring: f64,
    /// Level of dry friction in the way that it would slide.
    pub(crate) dry: f64,
    /// Break-away level.
    pub(crate) held: f64,
    /// Speed-dependent friction, with the sign of the speed.
    pub(crate) viscous: f64,
}

/// The joint with what its simulation lacks.
#[derive(Clone, Debug)]
pub(crate) struct TrialJoint {
    pub(crate) values: JointValues,
    /// No spring: the load turns with the motor.
    pub(crate) rigid: bool,
    pub(crate) effects: Vec<JointLawEffect>,
    /// One bank per effect; empty where it has none.
    pub(crate) slips: Vec<Slip>,
    /// Length of the recording in s, for what changes along it.
    pub(crate) span: f64,
}

impl TrialJoint {
    pub(crate) fn new(values: JointValues, rigid: bool, mut effects: Vec<JointLawEffect>, span: f64) -> Self {
        let mut at = 4;
        for e in &mut effects {
            e.at = at;
            at += e.law.states();
        }
        let slips = effects.iter().map(|e| Slip::new(e.yields(&values))).collect();
        Self { values, rigid, effects, slips, span }
    }

    /// Torque of the spring, and by how much the gear's error grows with the motor's angle.
    pub(crate) fn spring(&self, t: f64, x: &JointState) -> (f64, f64) {
        let v = &self.values;
        let n = v.gear_ratio;
        let (theta, omega) = (x[0], x[1]);
        let (mut eps, mut rate, mut slope) = (theta - n * x[2], omega - n * x[3], 0.0);
        for e in &self.effects {
            let (error, de) = e.gear_error(theta);
            eps -= error;
            rate -= de * omega;
            slope += de;
        }
        let mut stiffness = v.stiffness;
        for e in &self.effects {
            stiffness *= e.stiffness_factor(t, self.span);
        }
        let mut spring = stiffness * eps + v.damping * rate;
        for e in &self.effects {
            spring = e.spring(v, eps, rate, spring);
        }
        for (e, s) in self.effects.iter().zip(&self.slips) {
            if matches!(e.law, JointLaw::Hysteresis { .. }) {
                spring += s.torque(eps);
            }
        }
        (if self.rigid { 0.0 } else { spring }, slope)
    }

    /// Torques at time `t` under the current `u`; `past` gives the current at an earlier time.
    pub(crate) fn torques(
        &self,
        t: f64,
        x: &JointState,
        mode: StickMode,
        past: impl Fn(f64) -> f64,
    ) -> Torques {
        let v = &self.values;
        let (theta, omega) = (x[0], x[1]);
        // Actuator: what comes late first, then what clips, then what adds.
        let late: f64 = self.effects.iter().map(|e| e.dead_time()).sum();
        let mut drive = v.torque_constant * past(t - late);
        for e in &self.effects {
            drive = e.lagged(x, drive);
        }
        for e in &self.effects {
            drive = e.clipped(t, drive);
        }
        for e in &self.effects {
            drive += e.on_motor(t, theta);
        }
        let (spring, slope) = self.spring(t, x);
        // Motor friction.
        let way = match mode {
            StickMode::Slides(d) => d,
            StickMode::Stuck => (drive - spring).signum(),
        };
        let speed = omega * way;
        let mut dry = v.coulomb;
        let mut viscous = v.viscous * omega;
        let carried = if self.rigid { drive } else { spring };
        for e in &self.effects {
            (dry, viscous) = e.friction(v, speed, way, carried, dry, viscous);
        }
        let mut scale = 1.0;
        for e in &self.effects {
            scale *= e.friction_factor(t, self.span, x);
        }
        (dry, viscous) = (dry.max(0.0) * scale, viscous * scale);
        let mut motor = drive - spring * (1.0 - slope);
        for (e, s) in self.effects.iter().zip(&self.slips) {
            if matches!(e.law, JointLaw::Presliding { .. }) {
                motor -= s.torque(theta) * scale;
                dry = 0.0;
            }
        }
        Torques { motor, spring, dry, held: dry, viscous }
    }

    /// Torque on the load from outside the drive train, load side.
    fn on_load(&self, t: f64, x: &JointState) -> f64 {
        self.effects.iter().zip(&self.slips).map(|(e, s)| e.on_load(t, x, s, self.span)).sum()
    }

    /// Rates of all states.
    pub(crate) fn rates(
        &self,
        t: f64,
        x: &JointState,
        mode: StickMode,
        past: impl Fn(f64) -> f64,
    ) -> JointState {
        let v = &self.values;
        let f = self.torques(t, x, mode, &past);
        let friction = match mode {
            StickMode::Slides(way) => f.viscous + f.dry * way,
            StickMode::Stuck => 0.0,
        };
        let mut load = self.on_load(t, x);
        let mut inertia = v.load_inertia;
        let mut inertia_rate = 0.0;
        for e in &self.effects {
            let (change, slope) = e.inertia(v, t, self.span);
            inertia += change;
            inertia_rate += slope;
        }
        load -= inertia_rate * x[3];
        // Modes of the link: J dv/dt + sum g dd(eta) = torque, dd(eta) + g dv/dt = own.
        let mut stiff = inertia;
        for e in &self.effects {
            e.modes(v, x, |g, own, _| {
                stiff -= g * g;
                load -= g * own;
            });
        }
        let n = v.gear_ratio;
        let (motor_acceleration, load_acceleration) = if self.rigid {
            let a = match mode {
                StickMode::Stuck => 0.0,
                StickMode::Slides(_) => (f.motor - friction + load / n) / (v.motor_inertia + stiff / (n * n)),
            };
            (a, a / n)
        } else {
            let a = match mode {
                StickMode::Stuck => 0.0,
                StickMode::Slides(_) => (f.motor - friction) / v.motor_inertia,
            };
            (a, (n * f.spring + load) / stiff)
        };
        let mut dx = [0.0; 12];
        dx[0] = if mode == StickMode::Stuck { 0.0 } else { x[1] };
        dx[1] = motor_acceleration;
        dx[2] = if self.rigid { dx[0] / n } else { x[3] };
        dx[3] = load_acceleration;
        for e in &self.effects {
            e.modes(v, x, |g, own, at| {
                dx[at] = x[at + 1];
                dx[at + 1] = own - g * load_acceleration;
            });
            e.own_rates(x, v.torque_constant * past(t), friction, &mut dx);
        }
        dx
    }

    /// Torque that friction has to hold, and the level up to which it can.
    pub(crate) fn hold(&self, t: f64, x: &JointState, past: impl Fn(f64) -> f64) -> (f64, f64) {
        let f = self.torques(t, x, StickMode::Stuck, past);
        let load = if self.rigid { self.on_load(t, x) / self.values.gear_ratio } else { 0.0 };
        (f.motor + load, f.held)
    }

    /// The state is reached: what remembers moves on.
    pub(crate) fn commit(&mut self, x: &JointState) {
        let n = self.values.gear_ratio;
        for (e, s) in self.effects.iter().zip(&mut self.slips) {
            match e.law {
                JointLaw::Hysteresis { .. } => s.commit(x[0] - n * x[2]),
                JointLaw::Presliding { .. } => s.commit(x[0]),
                _ => s.commit(x[2]),
            }
        }
    }
    /// All that remembers is relaxed at this state.
    pub(crate) fn rest(&mut self, x: &JointState) {
        let n = self.values.gear_ratio;
        for (e, s) in self.effects.iter().zip(&mut self.slips) {
            match e.law {
                JointLaw::Hysteresis { .. } => s.rest(x[0] - n * x[2]),
                JointLaw::Presliding { .. } => s.rest(x[0]),
                _ => s.rest(x[2]),
            }
        }
    }
}
