//! `TwoMassJoint`: motor and load, joined by a gear with a spring and a damper (S3 section 3.2, Spong 1987).
//!
//! | id | equation |
//! |---|---|
//! | TMJ-1 | J_motor dd(q_m) = K_t I - tau_lm - tau_fr |
//! | TMJ-2 | tau_lm = K_eq (q_m - n q_l) + D_eq (d(q_m) - n d(q_l)) |
//! | TMJ-3 | J_load dd(q_l) = n tau_lm + tau_ext |
//! | TMJ-4 | tau_fr = D_m d(q_m) + tau_c sign(d(q_m)) while sliding; while sticking it balances, up to tau_s |
//! | TMJ-5 | rigid: (J_motor + J_load/n^2) dd(q_m) = K_t I + tau_ext/n - tau_fr, q_l = q_m/n |
//!
//! The states are q_m, d(q_m), the twist epsilon = q_m - n q_l and d(q_l): with n q_l and q_m both of thousands
//! of rad, a twist formed from a load angle that an integrator carries would have lost its digits.
//!
//! Positive directions: motor and load turn the same way for the same sign; the current drives the motor
//! forward; tau_ext drives the load forward; tau_lm drives the load forward and brakes the motor.
//! What it gets wrong: one linear spring for the whole gear, friction at the motor alone, a current that is
//! there at once. Effects add what lacks.

mod compiled;
mod layout;
mod two_stage;

pub use layout::{JointLayout, input, output, parameter, states};
pub use two_stage::{GEARBOX, GEARBOX_CHOICE, TWO_STAGES, TwoStageJoint, TwoStageParameters};

use crate::drive::{BaseMotion, DriveTrain, Spring};
use crate::effect::{EffectError, EffectSet, PlantKind};
use crate::friction::{self, Levels, STUCK};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// Most modes: friction, and every effect in every place.
const MAX_MODES: usize = 32;

/// The structure of a two-mass joint.
#[derive(Clone, Debug)]
pub struct TwoMassJoint {
    /// Without the effect that makes it flexible.
    declared_flexible: bool,
    flexible: bool,
    effects: EffectSet,
    sizes: ModelSizes,
}

/// All torques and accelerations at one instant; motor side unless stated.
#[derive(Clone, Copy, Debug)]
struct JointForces<T> {
    spring: Spring<T>,
    motor_torque: T,
    transmission_torque: T,
    friction_torque: T,
    /// What friction has to balance for the motor to stick.
    applied: T,
    motor_acceleration: T,
    load_acceleration: T,
}

impl TwoMassJoint {
    /// A joint; `flexible` false makes it one rigid geared mass (TMJ-5), unless the effect
    /// `joint-flexibility` gives it its spring.
    pub fn new<S: AsRef<str>>(flexible: bool, effects: &[S]) -> Result<Self, EffectError> {
        let declared_flexible = flexible;
        let flexible = flexible || effects.iter().any(|id| id.as_ref() == "joint-flexibility");
        let mut sizes = ModelSizes {
            states: if flexible { 4 } else { 2 },
            inputs: input::COUNT,
            parameters: parameter::COUNT,
            outputs: output::COUNT,
            modes: 1,
            indicators: 2,
        };
        let effects = EffectSet::place(effects, PlantKind::Joint, 1, &mut sizes)?;
        Ok(Self { declared_flexible, flexible, effects, sizes })
    }
    /// Whether the joint has its spring.
    pub fn flexible(&self) -> bool {
        self.flexible
    }
    /// Its effects.
    pub fn effects(&self) -> &EffectSet {
        &self.effects
    }

    fn drive<T: Scalar>(&self, at: &At<T>) -> DriveTrain<T> {
        let n = at.p[parameter::GEAR_RATIO];
        let (q_m, w_m) = (at.x[0], at.x[1]);
        let (epsilon, w_l) = if self.flexible { (at.x[2], at.x[3]) } else { (T::zero(), w_m / n) };
        let command = at.p[parameter::TORQUE_CONSTANT] * at.u[input::MOTOR_CURRENT];
        let mut d = DriveTrain {
            t: at.t,
            command,
            torque: command,
            theta: q_m,
            omega: w_m,
            ratio: n,
            shaft: T::one(),
            epsilon,
            epsilon_dot: w_m - n * w_l,
            link_angle: (q_m - epsilon) / n,
            link_rate: w_l,
            joint_rate: w_l,
            base: BaseMotion { t: at.t, ..BaseMotion::default() },
            ..DriveTrain::default()
        };
        self.effects.gear(at, 0, &mut d);
        if self.effects.needs_carried() {
            d.carried =
                if self.flexible { self.spring(at, &d).torque() } else { self.effects.actuator(at, 0, &d) };
        }
        d
    }

    fn spring<T: Scalar>(&self, at: &At<T>, d: &DriveTrain<T>) -> Spring<T> {
        let linear = Spring::linear(at.p[parameter::STIFFNESS], at.p[parameter::DAMPING], d);
        self.effects.spring(at, 0, d, linear)
    }

    fn levels<T: Scalar>(&self, at: &At<T>, d: &DriveTrain<T>, direction: f64) -> Levels<T> {
        let own = friction::paper(
            at.p[parameter::COULOMB_FRICTION],
            at.p[parameter::STATIC_FRICTION],
            at.p[parameter::VISCOUS_FRICTION],
            d.omega * direction,
        );
        self.effects.friction(at, 0, d, direction, own)
    }

    fn balance<T: Scalar>(&self, at: &At<T>, d: &DriveTrain<T>) -> JointForces<T> {
        self.balance_under(at, d, &[])
    }

    /// The same with forces on the coordinates, N.m: motor, and the load of a joint with a spring; empty: none.
    fn balance_under<T: Scalar>(&self, at: &At<T>, d: &DriveTrain<T>, force: &[T]) -> JointForces<T> {
        let p = at.p;
        let (n, j_l) = (p[parameter::GEAR_RATIO], p[parameter::LOAD_INERTIA]);
        let motor_torque = self.effects.actuator(at, 0, d);
        let mut tau_load = at.u[input::EXTERNAL_TORQUE]
            + self.effects.link_torque(at, 0, d)
            + self.effects.joint_torque(at, 0, d);
        if let [_, on_load] = force {
            tau_load += *on_load;
        }
        let pushed = |applied: T| if let [on_motor, ..] = force { applied + *on_motor } else { applied };
        let spring = self.spring(at, d);
        let mode = at.modes[0];
        // Sticking, the friction torque is what is applied and the motor's acceleration is 0.
        let slide = |applied: T, inertia: T| {
            if mode == STUCK {
                return (applied, T::zero());
            }
            let direction = friction::direction(mode, d.omega);
            let friction_torque = self.levels(at, d, direction).braking() * direction; // (TMJ-4)
            (friction_torque, (applied - friction_torque) / inertia)
        };
        if self.flexible {
            let tau_lm = spring.torque(); // (TMJ-2)
            let applied = pushed(motor_torque - tau_lm * (-d.slope + 1.0));
            let (friction_torque, motor_acceleration) = slide(applied, self.inertia(p)); // (TMJ-1)
            let load_acceleration = (n * tau_lm + tau_load) / j_l; // (TMJ-3)
            JointForces {
                spring,
                motor_torque,
                transmission_torque: tau_lm,
                friction_torque,
                applied,
                motor_acceleration,
                load_acceleration,
            }
        } else {
            let applied = pushed(motor_torque + tau_load / n);
            let (friction_torque, motor_acceleration) = slide(applied, self.inertia(p)); // (TMJ-5)
            let load_acceleration = motor_acceleration / n;
            let transmission_torque = (j_l * load_acceleration - tau_load) / n;
            JointForces {
                spring,
                motor_torque,
                transmission_torque,
                friction_torque,
                applied,
                motor_acceleration,
                load_acceleration,
            }
        }
    }

    /// The outputs before the sensors.
    fn true_outputs<T: Scalar>(&self, at: &At<T>, b: &JointForces<T>, d: &DriveTrain<T>, y: &mut [T]) {
        y[output::MOTOR_ANGLE] = d.theta;
        y[output::MOTOR_VELOCITY] = d.omega;
        y[output::MOTOR_ACCELERATION] = b.motor_acceleration;
        y[output::LOAD_ANGLE] = d.link_angle;
        y[output::LOAD_VELOCITY] = d.link_rate;
        y[output::LOAD_ACCELERATION] = b.load_acceleration;
        y[output::MOTOR_TORQUE] = b.motor_torque;
        y[output::TRANSMISSION_TORQUE] = b.transmission_torque;
        y[output::FRICTION_TORQUE] = b.friction_torque;
        y[output::STICKING] = T::constant(if at.modes[0] == STUCK { 1.0 } else { 0.0 });
    }

    /// Rates of the states with forces on the coordinates, N.m: motor, and the load of a joint with a spring; empty: none. A
    /// motor that sticks balances what acts on it.
    pub(crate) fn rates_under<T: Scalar>(&self, at: At<T>, force: &[T], dx: &mut [T]) {
        let mut d = self.drive(&at);
        if self.effects.strains_by_friction() {
            d.levels = self.levels(&at, &d, friction::direction(friction::SMOOTH, d.omega));
        }
        let b = self.balance_under(&at, &d, force);
        dx[0] = d.omega;
        dx[1] = b.motor_acceleration;
        if self.flexible {
            // The twist itself, whatever a gear makes of it.
            dx[2] = d.omega - at.p[parameter::GEAR_RATIO] * d.link_rate;
            dx[3] = b.load_acceleration;
        }
        self.effects.rates(&at, 0, &d, &b.spring, dx);
        if self.effects.sensors_have_states() {
            let mut y = [T::zero(); output::COUNT];
            self.true_outputs(&at, &b, &d, &mut y);
            self.effects.sensor_rates(&at, &mut y, dx);
        }
    }

    /// What friction brakes, motor side, kg.m2.
    fn inertia<T: Scalar>(&self, p: &[T]) -> T {
        let (j_m, n) = (p[parameter::MOTOR_INERTIA], p[parameter::GEAR_RATIO]);
        if self.flexible { j_m } else { j_m + p[parameter::LOAD_INERTIA] / (n * n) }
    }
    fn dry(&self, at: &At<f64>) -> bool {
        at.p[parameter::COULOMB_FRICTION] > 0.0
            || at.p[parameter::STATIC_FRICTION] > 0.0
            || self.effects.dry(at.p, 0)
    }
    fn both_levels<T: Scalar>(&self, at: &At<T>, d: &DriveTrain<T>) -> [Levels<T>; 2] {
        [self.levels(at, d, 1.0), self.levels(at, d, -1.0)]
    }
}

impl Hybrid for TwoMassJoint {
    fn sizes(&self) -> ModelSizes {
        self.sizes
    }

    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        x[0] = p[parameter::INITIAL_MOTOR_ANGLE];
        x[1] = p[parameter::INITIAL_MOTOR_VELOCITY];
        if self.flexible {
            x[2] = x[0] - p[parameter::GEAR_RATIO] * p[parameter::INITIAL_LOAD_ANGLE];
            x[3] = p[parameter::INITIAL_LOAD_VELOCITY];
        }
        let none = [T::zero(); input::COUNT];
        let d = self.drive(&At { t: T::zero(), x, u: &none, p, modes: &[] });
        self.effects.start(p, 0, &d, x);
        if self.effects.sensors_have_states() {
            let mut y = [T::zero(); output::COUNT];
            let at = At { t: T::zero(), x, u: &none, p, modes: &[0] };
            self.true_outputs(&at, &self.balance(&at, &d), &d, &mut y);
            self.effects.sensor_start(p, &mut y, x);
        }
    }

    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        let d = self.drive(&at);
        self.effects.update(&at, 0, &d, modes);
        let (kept, rest) = modes.split_at_mut(1);
        let mut with_effects = [0; MAX_MODES];
        with_effects[1..=rest.len()].copy_from_slice(rest);
        let at = At { modes: &with_effects[..=rest.len()], ..at };
        let dry = self.dry(&at);
        kept[0] = friction::moving_mode(d.omega, dry).unwrap_or_else(|| {
            let applied = self.balance(&at, &d).applied;
            friction::from_rest(applied, &self.both_levels(&at, &d))
        });
    }

    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        self.rates_under(at, &[], dx);
    }

    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let d = self.drive(&at);
        let b = self.balance(&at, &d);
        self.true_outputs(&at, &b, &d, y);
        self.effects.sense(&at, y);
        self.effects.outputs(&at, 0, &d, y);
    }

    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        let d = self.drive(&at);
        [z[0], z[1]] = friction::moving_indicators(at.modes[0], d.omega).unwrap_or_else(|| {
            friction::holding_indicators(self.balance(&at, &d).applied, &self.both_levels(&at, &d))
        });
        self.effects.indicators(&at, 0, &d, z);
    }

    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let before = modes[0];
        let d = self.drive(&At { t, x, u, p, modes });
        let mut frozen = [0; MAX_MODES];
        let frozen = &mut frozen[..modes.len()];
        frozen.copy_from_slice(modes);
        let effects_changed = self.effects.update(&At { t, x, u, p, modes: frozen }, 0, &d, modes);
        if let Some(mode) = friction::mode_by_velocity(before, d.omega, self.dry(&At { t, x, u, p, modes })) {
            modes[0] = mode;
            return EventUpdate { modes: effects_changed || mode != before, states: false };
        }
        // Friction decides on the torque that the new effect modes make.
        frozen.copy_from_slice(modes);
        let at = At { t, x, u, p, modes: frozen };
        let (applied, levels) = (self.balance(&at, &d).applied, self.both_levels(&at, &d));
        let braking = levels[0].breakaway.max(levels[1].breakaway) + applied.abs();
        let oversteps = friction::overstep(braking, self.inertia(p));
        let (mode, stopped) =
            friction::next_mode(before, d.omega, applied, &levels, self.dry(&at), oversteps);
        modes[0] = mode;
        if stopped {
            x[1] = 0.0;
        }
        EventUpdate { modes: effects_changed || mode != before, states: stopped }
    }

    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        self.effects.next_event(p, modes)
    }
}
