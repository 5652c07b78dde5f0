//! `PlanarManipulator` in the form that every model takes.

use super::chain::Chain;
use super::layout::{input, output, parameter};
use super::motion::ArmMotion;
use super::payload::PAYLOAD;
use super::solve::Symmetric;
use super::{ArmError, MAX_DOFS, MAX_LINKS, MAX_MODES, kinematics, rotor};
use crate::drive::Spring;
use crate::effect::{EffectChoice, EffectError, EffectSet, PlantKind};
use crate::friction::STUCK;
use crate::presets;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// The structure of a manipulator: its links, which joints are flexible, its effects.
///
/// Continuous states: x_0, y_0 \[m\], q_0, q_1 .. q_n, q_m of the flexible joints \[rad\], the velocities of all
/// these in the same order, then those of the effects.
#[derive(Clone, Debug)]
pub struct PlanarManipulator {
    /// Without the effect that makes all of them flexible.
    pub(super) declared_flexible: Vec<bool>,
    flexible: Vec<bool>,
    /// Row of each joint's motor among the coordinates (of a rigid joint: the joint's own).
    motor: [usize; MAX_LINKS],
    dofs: usize,
    friction: bool,
    fixed: bool,
    /// Which link carries a body more, from 0.
    payload: Option<usize>,
    effects: EffectSet,
    sizes: ModelSizes,
}

/// Rows of the base: x_0, y_0, q_0.
pub(super) const BASE_ROWS: usize = 3;

impl PlanarManipulator {
    /// A manipulator on a base that floats, with one link per entry of `flexible` (`joint-flexibility` makes all joints
    /// flexible), and with the effects of those ids.
    ///
    /// # Errors
    /// No link or more than [`super::MAX_LINKS`]; an effect that is unknown, named twice, or not for this plant or base.
    pub fn new<S: AsRef<str>>(flexible: &[bool], effects: &[S]) -> Result<Self, ArmError> {
        Self::on_base(false, flexible, effects)
    }
    /// The same on a base that stays where it begins (ARM-15), or floats.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn on_base<S: AsRef<str>>(fixed: bool, flexible: &[bool], effects: &[S]) -> Result<Self, ArmError> {
        let n = flexible.len();
        if n == 0 || n > MAX_LINKS {
            return Err(ArmError::Links(n));
        }
        let all = effects.iter().any(|id| id.as_ref() == "joint-flexibility");
        let declared_flexible = flexible.to_vec();
        let flexible: Vec<bool> = flexible.iter().map(|f| *f || all).collect();
        let mut motor = [0; MAX_LINKS];
        let mut dofs = 3 + n;
        for (j, flexible) in flexible.iter().enumerate() {
            motor[j] = if *flexible { dofs } else { 3 + j };
            dofs += usize::from(*flexible);
        }
        let friction = effects
            .iter()
            .any(|id| EffectChoice::parse(id.as_ref(), PlantKind::Arm).is_ok_and(|c| c.spec().friction));
        let mut sizes = ModelSizes {
            states: 2 * dofs,
            inputs: input::count(n),
            parameters: if friction { parameter::count_with_friction(n) } else { parameter::count(n) },
            outputs: if friction { output::count_with_friction(n) } else { output::count(n) },
            modes: if friction { n } else { 0 },
            indicators: if friction { 2 * n } else { 0 },
        };
        let effects = EffectSet::place(effects, PlantKind::Arm, n, &mut sizes)?;
        if let Some(e) = effects.iter().find(|e| !e.spec().acts_in(PlantKind::Arm, fixed)) {
            return Err(EffectError::Floats(e.spec().id).into());
        }
        if sizes.modes > MAX_MODES {
            return Err(ArmError::Modes(sizes.modes));
        }
        Ok(Self { declared_flexible, flexible, motor, dofs, friction, fixed, payload: None, effects, sizes })
    }
    /// The same with a body fixed to a link (from 0; ARM-16): its parameters [`PAYLOAD`] are the last ones.
    pub fn with_payload(mut self, link: Option<usize>) -> Self {
        let own = |payload: Option<usize>| if payload.is_some() { PAYLOAD.len() } else { 0 };
        let link = link.filter(|l| *l < self.links());
        self.sizes.parameters = self.sizes.parameters + own(link) - own(self.payload);
        self.payload = link;
        self
    }
    /// Which link carries a body more, from 0.
    pub fn payload(&self) -> Option<usize> {
        self.payload
    }
    /// The chain's constants, what a link carries among them.
    pub fn chain<T: Scalar>(&self, p: &[T]) -> Chain<T> {
        let mut chain = Chain::new(self.links(), p);
        if let (Some(link), [.., mass, x, y, inertia]) = (self.payload, p) {
            chain.carry(link + 1, *mass, [*x, *y], *inertia);
        }
        chain
    }
    /// The same arm's parameters without a payload: the link and what it carries in one (ARM-16); `p` as it is where there is
    /// none.
    pub fn merged(&self, p: &[f64]) -> Vec<f64> {
        let (Some(link), [own @ .., mass, x, y, inertia]) = (self.payload, p) else { return p.to_vec() };
        let (n, mut q) = (self.links(), own.to_vec());
        let (m, i) = (parameter::link_mass(n) + link, parameter::link_inertia(n) + link);
        let c = parameter::link_center_of_mass(n) + 2 * link;
        let whole = q[m] + mass;
        let apart = [x - q[c], y - q[c + 1]];
        q[i] += inertia + q[m] * mass / whole * (apart[0] * apart[0] + apart[1] * apart[1]);
        for k in 0..2 {
            q[c + k] += mass / whole * apart[k];
        }
        q[m] = whole;
        q
    }
    /// Its base stays where it begins.
    pub fn has_fixed_base(&self) -> bool {
        self.fixed
    }
    /// Which joints have a spring.
    pub fn flexible(&self) -> &[bool] {
        &self.flexible
    }
    /// Number of links, n.
    pub fn links(&self) -> usize {
        self.flexible.len()
    }
    /// Number of coordinates: 3 + n + flexible joints.
    pub fn dofs(&self) -> usize {
        self.dofs
    }
    /// Row of the motor of joint `joint` (from 0) among the coordinates.
    pub fn motor(&self, joint: usize) -> usize {
        self.motor[joint]
    }
    /// An effect brings motor friction with it: friction parameters, `frictionTorque`, `sticking`.
    pub fn has_friction(&self) -> bool {
        self.friction
    }
    /// Its effects.
    pub fn effects(&self) -> &EffectSet {
        &self.effects
    }

    /// Start values of all parameters: the test-bed's ([`presets::cbk_pan`]), those of friction and effects
    /// small but visible.
    pub fn defaults(&self) -> Vec<f64> {
        let n = self.links();
        let mut p = presets::cbk_pan(&self.flexible);
        if self.friction {
            for start in [0.005, 0.008, 0.01] {
                p.resize(p.len() + n, start); // tau_c, tau_s, D_m
            }
        }
        for e in self.effects.iter() {
            for spec in e.choice.parameters() {
                p.resize(p.len() + e.sites, spec.arm_start);
            }
        }
        p.resize(p.len() + self.payload.map_or(0, |_| PAYLOAD.len()), 0.0);
        p
    }

    /// Conditions on parameters that no single bound can say.
    ///
    /// # Errors
    /// The index of the parameter that is at fault, and the error with its remedy.
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        let n = self.links();
        for j in 0..n {
            let positive = |name: &str, at: usize, why: &str| {
                if p[at] > 0.0 {
                    return Ok(());
                }
                let (i, value) = (j + 1, p[at]);
                Err((
                    at,
                    format!("{name}[{i}] = {value} is refused: {why}; give {name}[{i}] a value above 0"),
                ))
            };
            if self.flexible[j] {
                let or = "or pack the model with a rigid joint there";
                positive(
                    "jointStiffness",
                    parameter::joint_stiffness(n) + j,
                    &format!("the joint is flexible and its spring must hold the link ({or})"),
                )?;
                positive(
                    "motorInertia",
                    parameter::motor_inertia(n) + j,
                    &format!("the joint is flexible and its motor moves by itself ({or})"),
                )?;
            }
            if p[parameter::motor_coupling(n)] == rotor::GEARED {
                positive("gearRatio", parameter::gear_ratio(n) + j, "motorCoupling geared divides by it")?;
            }
        }
        let gravity = &p[parameter::gravity(n)..][..2];
        if let (false, Some(i)) = (self.fixed, gravity.iter().position(|g| *g != 0.0)) {
            let (axis, value) = (i + 1, gravity[i]);
            return Err((
                parameter::gravity(n) + i,
                format!(
                    "gravity[{axis}] = {value} is refused: the base floats and would fall; give 0, or pack the model with base = fixed"
                ),
            ));
        }
        let mut x = vec![0.0; self.sizes.states];
        self.start(p, &mut x);
        let mass = self.mass_matrix(&x, p);
        let rows: Vec<usize> = (self.fixed_rows()..self.dofs).collect();
        let Err(row) = mass.solve(&rows, &mut [0.0; MAX_DOFS]) else { return Ok(()) };
        // The one to blame: a value that is not positive, else the one in the row that shows it.
        let shown = match row {
            0 | 1 => (parameter::base_mass(n), "baseMass", None),
            2 => (parameter::base_inertia(n), "baseInertia", None),
            row if row < 3 + n => (parameter::link_inertia(n), "linkInertia", Some(row - 3)),
            row => (parameter::motor_inertia(n), "motorInertia", (0..n).find(|j| self.motor[*j] == row)),
        };
        let one =
            [(parameter::base_mass(n), "baseMass", None), (parameter::base_inertia(n), "baseInertia", None)];
        let each = (0..n).flat_map(|j| {
            [
                (parameter::link_mass(n), "linkMass", Some(j)),
                (parameter::link_inertia(n), "linkInertia", Some(j)),
            ]
        });
        let place = |(begin, _, joint): &(usize, &str, Option<usize>)| begin + joint.unwrap_or(0);
        let wrong = one.into_iter().chain(each).find(|v| p[place(v)].is_nan() || p[place(v)] <= 0.0);
        let blamed = wrong.unwrap_or(shown);
        let at = place(&blamed);
        let name = match blamed.2 {
            Some(j) => format!("{}[{}]", blamed.1, j + 1),
            None => blamed.1.to_owned(),
        };
        let value = p[at];
        Err((
            at,
            format!(
                "{name} = {value} leaves the mass matrix at the initial state not positive definite; give masses and inertias values above 0"
            ),
        ))
    }

    /// How many of the first rows do not move: those of a base that is fixed.
    pub(super) fn fixed_rows(&self) -> usize {
        if self.fixed { BASE_ROWS } else { 0 }
    }

    /// Acceleration that pulls at all bodies: gravity and what effects make of the ground, m/s2, inertial frame (ARM-13).
    pub(super) fn field<T: Scalar>(&self, at: &At<T>) -> [T; 2] {
        let (own, g) = (self.effects.field(at), &at.p[parameter::gravity(self.links())..]);
        [own[0] + g[0], own[1] + g[1]]
    }

    /// The tip at states `x` (ARM-10), and the rate of the last link in rad/s.
    pub fn tip<T: Scalar>(&self, x: &[T], p: &[T]) -> (kinematics::TipMotion<T>, T) {
        let (q, v) = x.split_at(self.dofs);
        let turned = self.chain(p).turned(q, v);
        (kinematics::tip(&turned, q, v), turned.rate[self.links()])
    }

    /// M* + J* at states `x` (S0 eq. 10, 11); rows x_0, y_0, q_0, q_1 .. q_n, q_m of the flexible joints.
    pub fn mass_matrix<T: Scalar>(&self, x: &[T], p: &[T]) -> Symmetric<T> {
        let none = [T::zero(); input::count(MAX_LINKS)];
        let motion = self.motion(&At { t: T::zero(), x, u: &none, p, modes: &[] });
        self.mass(p, &motion)
    }

    /// Rates of the states where these rows (x_0, y_0, q_0, q_1 .., motors) have accelerations that are given, whatever force
    /// that takes (ARM-14); a row that sticks has none.
    pub fn rates_prescribed<T: Scalar>(&self, at: At<T>, led: &[(usize, T)], dx: &mut [T]) {
        self.rates_under(at, led, &[], dx);
    }

    /// The same with forces on the rows that a base has free, in their order, N and N.m; empty: none.
    pub(super) fn rates_under<T: Scalar>(&self, at: At<T>, led: &[(usize, T)], force: &[T], dx: &mut [T]) {
        let mut motion = ArmMotion::unmoved(&at);
        self.move_to(&at, &mut motion);
        let b = self.balance_prescribed(&at, &motion, led, force);
        dx[..self.dofs].copy_from_slice(motion.v);
        dx[..self.fixed_rows()].fill(T::zero());
        dx[self.dofs..2 * self.dofs].copy_from_slice(&b.acceleration[..self.dofs]);
        self.effect_rates(&at, &motion, &b.springs, dx);
    }

    /// An effect shapes motor friction.
    pub(super) fn friction_effects(&self) -> bool {
        self.effects.needs_friction()
    }

    /// Rates of the effects' states.
    pub(super) fn effect_rates<T: Scalar>(
        &self,
        at: &At<T>,
        motion: &ArmMotion<T>,
        springs: &[Spring<T>; MAX_LINKS],
        dx: &mut [T],
    ) {
        for j in 0..self.links() {
            self.effects.rates(at, j, &motion.drives[j], &springs[j], dx);
        }
        if self.effects.sensors_have_states() {
            let mut y = [T::zero(); output::count(MAX_LINKS)];
            self.true_motion(motion, &mut y);
            self.effects.sensor_rates(at, &mut y, dx);
        }
    }

    /// What the sensors look at, before they do.
    fn true_motion<T: Scalar>(&self, motion: &ArmMotion<T>, y: &mut [T]) {
        let n = self.links();
        let (q, v, t) = (motion.q, motion.v, &motion.turned);
        for i in 0..2 {
            y[output::base_position(n) + i] = q[i];
            y[output::base_velocity(n) + i] = v[i];
        }
        y[output::base_attitude(n)] = q[2];
        y[output::base_rate(n)] = v[2];
        for j in 0..n {
            y[output::joint_angle(n) + j] = q[3 + j];
            y[output::joint_velocity(n) + j] = v[3 + j];
            y[output::motor_angle(n) + j] = motion.drives[j].theta;
            y[output::motor_velocity(n) + j] = motion.drives[j].omega;
        }
        let tip = kinematics::tip(t, q, v);
        y[output::tip_position(n)..][..2].copy_from_slice(&tip.position);
        y[output::tip_attitude(n)] = tip.attitude;
        y[output::tip_velocity(n)..][..2].copy_from_slice(&tip.velocity);
    }

    /// The effects' modes that fit this instant; true where one changed.
    fn update_effects(&self, at: &At<f64>, modes: &mut [i32]) -> bool {
        let drives = self.motion(at).drives;
        let mut changed = false;
        for j in 0..self.links() {
            changed |= self.effects.update(at, j, &drives[j], modes);
        }
        changed
    }
}

impl Hybrid for PlanarManipulator {
    fn sizes(&self) -> ModelSizes {
        self.sizes
    }

    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        let n = self.links();
        let dofs = self.dofs;
        let put = |x: &mut [T], row: usize, angle: T, velocity: T| {
            x[row] = angle;
            x[dofs + row] = velocity;
        };
        for i in 0..2 {
            put(x, i, p[parameter::initial_base_position(n) + i], p[parameter::initial_base_velocity(n) + i]);
        }
        put(x, 2, p[parameter::initial_base_attitude(n)], p[parameter::initial_base_rate(n)]);
        if self.fixed {
            (0..BASE_ROWS).for_each(|row| x[self.dofs + row] = T::zero());
        }
        for j in 0..n {
            if self.flexible[j] {
                let (angle, velocity) =
                    (parameter::initial_motor_angle(n), parameter::initial_motor_velocity(n));
                put(x, self.motor[j], p[angle + j], p[velocity + j]);
            }
            let (angle, velocity) = (parameter::initial_joint_angle(n), parameter::initial_joint_velocity(n));
            put(x, 3 + j, p[angle + j], p[velocity + j]);
        }
        let none = [T::zero(); input::count(MAX_LINKS)];
        let drives = self.motion(&At { t: T::zero(), x, u: &none, p, modes: &[] }).drives;
        for j in 0..n {
            self.effects.start(p, j, &drives[j], x);
        }
        if self.effects.sensors_have_states() {
            let mut y = [T::zero(); output::count(MAX_LINKS)];
            self.true_motion(&self.motion(&At { t: T::zero(), x, u: &none, p, modes: &[] }), &mut y);
            self.effects.sensor_start(p, &mut y, x);
        }
    }

    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        // The caller need not have modes yet.
        let none = [0; MAX_MODES];
        let at = At { modes: &none[..modes.len()], ..at };
        self.update_effects(&at, modes);
        if self.friction {
            self.start_friction(&at, modes);
        }
    }

    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        self.rates_prescribed(at, &[], dx);
    }

    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let n = self.links();
        let motion = self.motion(&at);
        let (q, v, t) = (motion.q, motion.v, &motion.turned);
        self.true_motion(&motion, y);
        self.effects.sense(&at, y);

        let mut own = [T::zero(); 3]; // kinetic and potential energy, angular momentum of springs and effects
        for j in 0..n {
            let d = &motion.drives[j];
            if self.flexible[j] {
                own[1] += self.spring(&at, j, d).energy(); // (eq. 7)
            }
            let energy = self.effects.energy(&at, j, d);
            own[0] += energy[0];
            own[1] += energy[1];
            own[2] += self.effects.angular_momentum(&at, j, d);
            self.effects.outputs(&at, j, d, y);
        }
        // Generalized momenta; that of q_0 is the angular momentum about the satellite's centre of mass (ARM-12).
        let mass = self.mass(at.p, &motion);
        let mut momentum = [T::zero(); MAX_DOFS];
        let mut twice = T::zero();
        for i in 0..self.dofs {
            momentum[i] = mass.row_times(i, v);
            twice += momentum[i] * v[i];
        }
        y[output::linear_momentum(n)] = momentum[0];
        y[output::linear_momentum(n) + 1] = momentum[1];
        y[output::angular_momentum(n)] = q[0] * momentum[1] - q[1] * momentum[0] + momentum[2] + own[2];
        y[output::kinetic_energy(n)] = twice * 0.5 + own[0];
        // The field pulls at the centre of mass of the whole (ARM-13).
        let field = self.field(&at);
        for i in 0..2 {
            let first_moment = (0..=n).fold(motion.chain.mass * q[i], |sum, k| sum + t.gamma[k][i]);
            own[1] -= first_moment * field[i];
        }
        y[output::potential_energy(n)] = own[1];
        y[output::tip_rate(n)] = t.rate[n];

        if self.friction {
            let b = self.balance(&at, &motion);
            for j in 0..n {
                y[output::friction_torque(n) + j] = b.friction[j];
                y[output::sticking(n) + j] = T::constant(if at.modes[j] == STUCK { 1.0 } else { 0.0 });
            }
        }
    }

    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        if self.sizes.indicators == 0 {
            return;
        }
        let motion = self.motion(&at);
        if self.friction {
            self.friction_indicators(&at, &motion, z);
        }
        for j in 0..self.links() {
            self.effects.indicators(&at, j, &motion.drives[j], z);
        }
    }

    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let mut frozen = [0; MAX_MODES];
        let frozen = &mut frozen[..modes.len()];
        frozen.copy_from_slice(modes);
        let changed = !modes.is_empty() && self.update_effects(&At { t, x, u, p, modes: frozen }, modes);
        if changed || !self.friction {
            return EventUpdate { modes: changed, states: false };
        }
        self.update_friction(t, x, u, p, modes)
    }

    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        self.effects.next_event(p, modes)
    }
}
