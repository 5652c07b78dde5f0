//! `SpatialFreeFlyer` in the form that every model takes.

use super::appendage::Shapes;
use super::articulated::{Drive, Found, Moves, Rotor};
use super::attitude::{self, about, rotation, unit};
use super::composite::{forces, mass_matrix, rotor_rows};
use super::instant::{Instant, four, three};
use super::layout::{Inputs, Outputs, Parameters, States};
use super::ritz::MAX_LINK_SHAPES;
use super::shapes::MAX_SHAPES;
use super::spatial::Motion;
use super::tree::{Joint, Joints, Tree};
use super::vector::{Vector, add, cross, scale, times};
use super::{
    MAX_APPENDAGES, MAX_BODIES, MAX_DOFS, MAX_MODES_OF_ALL, MAX_MODES_OF_LINK, MAX_THRUSTERS, MAX_TIPS,
};
use crate::arm::rotor;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, Hybrid, Sizes, Update};

/// What is fixed when a model is packed.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Structure {
    /// Bodies and joints.
    pub tree: Tree,
    /// Per moving body: its joint has a spring between motor and body.
    pub flexible: Vec<bool>,
    /// Per end effector the body that it is fixed to (from 1).
    pub tips: Vec<usize>,
    /// Thrusters of the base.
    pub thrusters: usize,
    /// Per appendage of the base the numbers of its shapes.
    pub appendages: Vec<Shapes>,
    /// Per appendage that is a table of modes, behind those: their number.
    pub tables: Vec<usize>,
    /// Per moving body the numbers of shapes of its link, on whose end hangs what the body carries; empty: all links are rigid.
    pub links: Vec<Shapes>,
    /// Per moving body the number of modes of its link that is a table; 0: it is none; empty: there are none.
    pub tabled_links: Vec<usize>,
    /// Bending shortens links, so that loads along them stiffen or soften them.
    pub axial_stiffening: bool,
    /// The base does not move.
    pub held: bool,
    /// There are outputs of what a pose is worth.
    pub analysis: bool,
}

impl Structure {
    /// Moving bodies.
    pub fn bodies(&self) -> usize {
        self.tree.bodies()
    }
    /// Flexible joints.
    pub fn springs(&self) -> usize {
        self.flexible.iter().filter(|f| **f).count()
    }
    fn most_shapes(&self) -> usize {
        self.appendages.iter().flat_map(|a| [a.x, a.y, a.torsion]).max().unwrap_or(0)
    }
    /// Appendages, beams and tables.
    pub fn panels(&self) -> usize {
        self.appendages.len() + self.tables.len()
    }
    /// Modes of tables.
    pub fn tabled(&self) -> usize {
        self.tables.iter().sum()
    }
    /// Modal coordinates.
    pub fn modes(&self) -> usize {
        self.appendages.iter().map(Shapes::modes).chain(self.tables.iter().copied()).sum::<usize>()
            + self.linked()
    }
    /// Bodies (from 1) whose link is a beam that bends, with its shapes.
    pub fn beams(&self) -> impl Iterator<Item = (usize, Shapes)> + '_ {
        self.links.iter().enumerate().filter(|(_, s)| s.modes() > 0).map(|(k, s)| (k + 1, *s))
    }
    /// Bodies (from 1) whose link is a table of modes, with their number.
    pub fn link_tables(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.tabled_links.iter().enumerate().filter(|(_, m)| **m > 0).map(|(k, m)| (k + 1, *m))
    }
    /// Bodies (from 1) whose link bends, with the number of its modes: beams, then tables.
    pub fn bending(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.beams().map(|(body, s)| (body, s.modes())).chain(self.link_tables())
    }
    /// Links that bend.
    pub fn links(&self) -> usize {
        self.bending().count()
    }
    /// Modal coordinates of links: the last ones.
    pub fn linked(&self) -> usize {
        self.bending().map(|b| b.1).sum()
    }
    /// Modes of links that are tables: the last of those.
    pub fn linked_tabled(&self) -> usize {
        self.tabled_links.iter().sum()
    }

    /// Whether there can be such a model.
    ///
    /// # Errors
    /// What cannot be, with the mend.
    pub fn check(&self) -> Result<(), String> {
        let n = self.bodies();
        for (what, there, most) in [
            ("moving bodies", n, MAX_BODIES),
            ("tips", self.tips.len(), MAX_TIPS),
            ("thrusters", self.thrusters, MAX_THRUSTERS),
            ("appendages and links that bend", self.panels() + self.links(), MAX_APPENDAGES),
            ("modal coordinates", self.modes(), MAX_MODES_OF_ALL),
            ("shapes in a direction", self.most_shapes(), MAX_SHAPES),
        ] {
            if there > most {
                return Err(format!("{there} {what} cannot be had, at most {most}"));
            }
        }
        if self.tree.joint.len() != n || self.flexible.len() != n {
            return Err(format!(
                "{n} bodies have {} joint types and {} entries of jointFlexible; give one of each per body",
                self.tree.joint.len(),
                self.flexible.len()
            ));
        }
        if !self.links.is_empty() && self.links.len() != n {
            let rows = self.links.len();
            return Err(format!(
                "linkModes has {rows} rows for {n} bodies; give one per body, 0, 0, 0 for a rigid link"
            ));
        }
        self.check_link_tables()?;
        for (body, s) in self.beams() {
            let most = s.x.max(s.y).max(s.torsion);
            if most > MAX_LINK_SHAPES {
                return Err(format!(
                    "linkModes[{body}] asks for {most} shapes in one direction, at most {MAX_LINK_SHAPES} can be had"
                ));
            }
            if s.x != s.y && s.x.min(s.y) > 0 {
                return Err(format!(
                    "linkModes[{body}] = {}, {}, {}: give the link the same number of shapes along x and along y, or 0 along one",
                    s.x, s.y, s.torsion
                ));
            }
        }
        if let Some(k) = (0..n).find(|k| self.tree.parent[*k] > *k) {
            return Err(format!(
                "parent[{}] = {}: a body comes after the one that carries it; number bodies from the base (0) outwards",
                k + 1,
                self.tree.parent[k]
            ));
        }
        match self.tips.iter().position(|t| *t == 0 || *t > n) {
            Some(a) if self.tips[a] == 0 => {
                let why = "it is fixed to the base, whose motion has outputs of its own";
                Err(format!("tip {}: {why}; fix it to a moving body, or leave it out", a + 1))
            }
            Some(a) => {
                Err(format!("tip[{}] = {}: the moving bodies are 1 to {n}; name one", a + 1, self.tips[a]))
            }
            None => Ok(()),
        }
    }
}

impl Structure {
    fn check_link_tables(&self) -> Result<(), String> {
        let (n, rows) = (self.bodies(), self.tabled_links.len());
        if rows > 0 && rows != n {
            return Err(format!(
                "modesOfLinkTable has {rows} entries for {n} bodies; give one per body, 0 where its link is no table"
            ));
        }
        for (body, modes) in self.link_tables() {
            if modes > MAX_MODES_OF_LINK {
                return Err(format!(
                    "the link of body {body} has {modes} modes, at most {MAX_MODES_OF_LINK} can be had; leave out those of the highest frequencies"
                ));
            }
            if self.beams().any(|b| b.0 == body) {
                return Err(format!(
                    "the link of body {body} is a beam and a table of modes; give one of both"
                ));
            }
            if self.axial_stiffening {
                return Err(format!(
                    "axial stiffening needs beams, and the link of body {body} is a table of modes, which does not tell how bending shortens it; switch axial-stiffening (axialStiffening) off, or give that link as a beam"
                ));
            }
        }
        Ok(())
    }
}

/// A base with arms and panels in space (S1 eq. 9-17, S2 eq. 1-18): its structure and where its values lie.
///
/// Continuous states: r \[m\], Q, q_1 .. q_n \[rad; m\], q_m of the flexible joints, eta of the panels \[m; rad\], the velocity
/// of the base \[m/s, inertial axes\], its rate \[rad/s, base axes\], the rates of joints, those motors and modes; see
/// [`super::layout::States`].
///
/// What it gets wrong: nothing stiffens a panel that spins, no orbit, no gravity gradient, no air; bodies do not touch, plumes
/// do not push.
#[derive(Clone, Debug)]
pub struct SpatialFreeFlyer {
    structure: Structure,
    pub(super) state: States,
    pub(super) parameter: Parameters,
    pub(super) input: Inputs,
    pub(super) output: Outputs,
    /// Per joint: which of the springs is its own.
    spring: [Option<usize>; MAX_BODIES],
    sizes: Sizes,
}

/// Most states.
const MAX_STATES: usize = 13 + 2 * (2 * MAX_BODIES + MAX_MODES_OF_ALL);

/// Rows whose accelerations are given, whatever forces that takes.
#[derive(Clone, Copy, Debug)]
pub struct Led<'a, T> {
    /// The base's: d(v)/dt in inertial axes, d(omega)/dt in base axes; `None`: it is free.
    pub base: Option<(Vector<T>, Vector<T>)>,
    /// Joints (from 0) and their accelerations.
    pub joints: &'a [(usize, T)],
    /// Motors of flexible joints (by joint, from 0; others are not led) and their accelerations, joint side.
    pub motors: &'a [(usize, T)],
}

impl<T> Led<'_, T> {
    /// None.
    pub fn none() -> Self {
        Self { base: None, joints: &[], motors: &[] }
    }
}

impl SpatialFreeFlyer {
    /// A model of that structure.
    ///
    /// # Errors
    /// What of it cannot be, with the mend.
    pub fn new(structure: Structure) -> Result<Self, String> {
        structure.check()?;
        let (state, parameter) = (States::new(&structure), Parameters::new(&structure));
        let (input, output) = (Inputs::new(&structure), Outputs::new(&structure));
        let mut spring = [None; MAX_BODIES];
        let flexible = structure.flexible.iter().enumerate().filter(|(_, f)| **f);
        flexible.enumerate().for_each(|(k, (j, _))| spring[j] = Some(k));
        let sizes = Sizes {
            states: state.count,
            inputs: input.count,
            parameters: parameter.count,
            outputs: output.count,
            modes: 0,
            indicators: 0,
        };
        Ok(Self { structure, state, parameter, input, output, spring, sizes })
    }

    /// What is fixed.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Row of the angle of this joint's motor among the states, if it moves by itself.
    pub fn motor_row(&self, joint: usize) -> Option<usize> {
        self.spring[joint].map(|k| self.state.motor_angle + k)
    }

    /// A joint with its motor.
    pub(super) fn drive<T: Scalar>(&self, at: &At<T>, j: usize) -> Drive<T> {
        let p = &self.parameter;
        let torque = at.u[self.input.joint_torque + j];
        let (moves, rotor, rate) = match self.spring[j] {
            None => (torque, Rotor::Geared, at.x[self.state.joint_velocity + j]),
            Some(k) => {
                let spring = self.spring_torque(at, j, k);
                (spring, Rotor::Driven(torque - spring), at.x[self.state.motor_velocity + k])
            }
        };
        Drive {
            moves: Moves::Driven(moves),
            rotor,
            inertia: at.p[p.motor_inertia + j],
            share: rotor::share(at.p[p.motor_coupling], at.p[p.gear_ratio + j]),
            rate,
        }
    }

    /// Of spring `k`, that of joint `j`, on the body: k (q_m - q) + b (d(q_m) - d(q)) (S0 eq. 2).
    fn spring_torque<T: Scalar>(&self, at: &At<T>, j: usize, k: usize) -> T {
        let (x, row) = (at.x, &self.state);
        at.p[self.parameter.joint_stiffness + j] * (x[row.motor_angle + k] - x[row.joint_angle + j])
            + at.p[self.parameter.joint_damping + j] * (x[row.motor_velocity + k] - x[row.joint_velocity + j])
    }

    /// Energy of the springs, J.
    pub(super) fn spring_energy<T: Scalar>(&self, at: &At<T>) -> T {
        let mut sum = T::zero();
        for (j, k) in self.spring.iter().enumerate().filter_map(|(j, k)| k.map(|k| (j, k))) {
            let twist = at.x[self.state.motor_angle + k] - at.x[self.state.joint_angle + j];
            sum += at.p[self.parameter.joint_stiffness + j] * twist * twist * 0.5;
        }
        sum
    }

    /// M (SFF-8) into `m`, row by row; returns the number of its rows. They are the base's velocity and its rate, both in
    /// **base axes**, the joints, the motors of flexible joints, the modes.
    pub fn mass_matrix<T: Scalar>(&self, at: &At<T>, m: &mut [T]) -> usize {
        let mut now = Instant::new();
        now.set(self, at);
        mass_matrix(&now.snapshot(self), m);
        rotor_rows(&self.structure.tree, &now.drives).1 + self.structure.modes()
    }

    /// C v (SFF-11) into `out`: the forces of a motion without accelerations, rows as in [`Self::mass_matrix`].
    pub fn bias<T: Scalar>(&self, at: &At<T>, out: &mut [T]) {
        let mut now = Instant::new();
        now.set(self, at);
        let none = [T::zero(); MAX_DOFS];
        forces(&now.snapshot(self), (Motion::zero(), &none, &none), &none, out);
    }

    /// Of the spring and damper of a joint on its body, N.m (N); 0 of a rigid joint.
    pub fn transmission_torque<T: Scalar>(&self, at: &At<T>, joint: usize) -> T {
        self.spring[joint].map_or(T::zero(), |k| self.spring_torque(at, joint, k))
    }

    /// Where the first tip of a robot whose base is held would be at these coordinates of its joints, links straight, inertial
    /// axes, m.
    pub fn straight_tip<T: Scalar>(&self, p: &[T], q: &[T]) -> Vector<T> {
        let (s, at) = (&self.structure, &self.parameter);
        let mut point = three(p, at.tip_offset);
        for j in s.tree.arm(s.tips.first().copied().unwrap_or(0)).map(|body| body - 1) {
            let axis = unit(three(p, at.joint_axis + 3 * j));
            let moved = match s.tree.joint[j] {
                Joint::Revolute => times(&about(axis, q[j]), point),
                Joint::Prismatic => add(point, scale(q[j], axis)),
            };
            let mount = rotation(four(p, at.joint_orientation + 4 * j));
            point = add(three(p, at.joint_position + 3 * j), times(&mount, moved));
        }
        add(three(p, at.initial_base_position), times(&rotation(four(p, at.initial_base_quaternion)), point))
    }

    /// Stiffness of all modes, N/m (N.m/rad), in the order of the coordinates.
    pub fn modal_stiffness(&self, p: &[f64]) -> Vec<f64> {
        let mut now = Instant::new();
        let (x, u) = (self.at_rest(p), vec![0.0; self.sizes.inputs]);
        now.set(self, &At { t: 0.0, x: &x, u: &u, p, modes: &[] });
        now.appendages.modes().iter().map(|m| m.stiffness).collect()
    }

    /// How far the end of the link of this body (from 1) is turned by bending, rad; twist counts.
    pub fn end_turn(&self, x: &[f64], p: &[f64], body: usize) -> f64 {
        let mut now = Instant::new();
        let u = vec![0.0; self.sizes.inputs];
        now.set(self, &At { t: 0.0, x, u: &u, p, modes: &[] });
        let [w, a, b, c] = now.end_turn(body);
        2.0 * (a * a + b * b + c * c).sqrt().atan2(w)
    }

    fn at_rest(&self, p: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; self.sizes.states];
        self.start(p, &mut x);
        x
    }

    /// How velocities jump where motors of flexible joints (by joint, from 0) change theirs by so much at once: an impulse at
    /// each of them, everything else free. The other rows of `jump` are 0.
    pub fn impulse(&self, at: At<f64>, motors: &[(usize, f64)], jump: &mut [f64]) {
        let mut x = [0.0; MAX_STATES];
        x[..self.state.base_velocity].copy_from_slice(&at.x[..self.state.base_velocity]);
        let x = &x[..at.x.len()];
        let mut now = Instant::new();
        now.set(self, &At { x, ..at });
        now.rest(self.structure.held);
        for (j, change) in motors.iter().filter(|(j, _)| self.spring[*j].is_some()) {
            now.drives[*j].rotor = Rotor::Led(*change);
        }
        self.accelerate(&now, &At { x, ..at }, jump);
        jump[..self.state.base_velocity].fill(0.0);
        for (j, change) in motors {
            if let Some(k) = self.spring[*j] {
                jump[self.state.motor_velocity + k] = *change;
            }
        }
    }

    /// Rates of the states where some accelerations are given.
    #[inline(never)]
    pub fn rates_led<T: Scalar>(&self, at: At<T>, led: Led<'_, T>, dx: &mut [T]) {
        self.rates_with_torques(at, led, dx, &mut []);
    }

    /// The same, and the torques on the motors that are led beside those of their springs, N.m, joint side, where there is room
    /// for all joints; 0 of the others.
    #[inline(never)]
    pub fn rates_with_torques<T: Scalar>(&self, at: At<T>, led: Led<'_, T>, dx: &mut [T], needed: &mut [T]) {
        let mut now = Instant::new();
        now.set(self, &at);
        now.lead(self, &led);
        self.accelerate_led(&now, &at, &led, dx, needed);
    }

    /// The same at an instant that leads those.
    pub(super) fn accelerate_led<T: Scalar>(
        &self,
        now: &Instant<T>,
        at: &At<T>,
        led: &Led<'_, T>,
        dx: &mut [T],
        needed: &mut [T],
    ) {
        let rotor = self.accelerate(now, at, dx);
        needed.fill(T::zero());
        for (j, acceleration) in led.motors {
            let Some(k) = self.spring[*j] else { continue };
            dx[self.state.motor_velocity + k] = *acceleration;
            if let Some(needed) = needed.get_mut(*j) {
                *needed = rotor[*j];
            }
        }
    }

    /// Rates of the states of the robot at this instant; gives what was found of the rotors.
    #[inline]
    fn accelerate<T: Scalar>(&self, now: &Instant<T>, at: &At<T>, dx: &mut [T]) -> Joints<T> {
        let (row, n, base) = (&self.state, self.structure.bodies(), now.placed[0]);
        let (omega, v) = (base.velocity.angular, base.velocity.linear);
        let modes = self.structure.modes();
        let mut rotor = Joints::new();
        rotor.extend((0..n).map(|_| T::zero()));
        let (before, modal) = dx.split_at_mut(row.modal_velocity);
        let joint = &mut before[row.joint_velocity..][..n];
        let out = Found { joint, rotor: &mut rotor, modal: &mut modal[..modes] };
        let found = now.accelerations(self, out);
        if !self.structure.held {
            dx[row.base_position..][..3].copy_from_slice(&at.x[row.base_velocity..][..3]);
            let turning = attitude::rate(four(at.x, row.base_quaternion), omega);
            dx[row.base_quaternion..][..4].copy_from_slice(&turning);
            let own = add(found.linear, cross(omega, v));
            dx[row.base_velocity..][..3].copy_from_slice(&times(&base.frame.rotation, own));
            dx[row.base_angular_velocity..][..3].copy_from_slice(&found.angular);
        }
        for j in 0..n {
            dx[row.joint_angle + j] = at.x[row.joint_velocity + j];
            if let Some(k) = self.spring[j] {
                dx[row.motor_angle + k] = at.x[row.motor_velocity + k];
                dx[row.motor_velocity + k] = rotor[j];
            }
        }
        dx[row.modal_coordinate..][..modes].copy_from_slice(&at.x[row.modal_velocity..][..modes]);
        rotor
    }
}

impl Hybrid for SpatialFreeFlyer {
    fn sizes(&self) -> Sizes {
        self.sizes
    }

    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        let (from, to) = (&self.parameter, &self.state);
        let mut copy = |from: usize, to: usize, count: usize| {
            x[to..][..count].copy_from_slice(&p[from..][..count]);
        };
        let n = self.structure.bodies();
        copy(from.initial_joint_angle, to.joint_angle, n);
        copy(from.initial_joint_velocity, to.joint_velocity, n);
        for (j, k) in self.spring.iter().enumerate().filter_map(|(j, k)| k.map(|k| (j, k))) {
            copy(from.initial_motor_angle + j, to.motor_angle + k, 1);
            copy(from.initial_motor_velocity + j, to.motor_velocity + k, 1);
        }
        let (linked, of_base) = (self.structure.linked(), self.structure.modes() - self.structure.linked());
        copy(from.initial_modal_coordinate, to.modal_coordinate, of_base);
        copy(from.initial_modal_velocity, to.modal_velocity, of_base);
        copy(from.initial_link_coordinate, to.link_coordinate, linked);
        copy(from.initial_link_velocity, to.link_velocity, linked);
        if !self.structure.held {
            copy(from.initial_base_position, to.base_position, 3);
            copy(from.initial_base_velocity, to.base_velocity, 3);
            copy(from.initial_base_angular_velocity, to.base_angular_velocity, 3);
            let q = attitude::normalized(four(p, from.initial_base_quaternion));
            x[to.base_quaternion..][..4].copy_from_slice(&q);
        }
    }

    fn start_modes(&self, _at: At<f64>, _modes: &mut [i32]) {}

    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        self.rates_led(at, Led::none(), dx);
    }

    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        self.outputs_led(at, Led::none(), y, &mut []);
    }

    fn indicators<T: Scalar>(&self, _at: At<T>, _z: &mut [T]) {}

    fn update(&self, _t: f64, _x: &mut [f64], _u: &[f64], _p: &[f64], _modes: &mut [i32]) -> Update {
        Update::default()
    }
}
