//! `SpatialFreeFlyer` at one instant: parameters and states become bodies, places, forces.

use super::appendage::Beam;
use super::articulated::{SweepResult, accelerations};
use super::attitude::{Quaternion, four, normalized, rotation, unit};
use super::bent::DeformedAppendages;
use super::flexible::Appendages;
use super::joint_drive::{JointDrive, Moves, Rotor};
use super::model::SpatialFreeFlyer;
use super::prescribed::PrescribedAccelerations;
use super::snapshot::RobotSnapshot;
use super::spatial::{Rigid, SpatialFrame, SpatialMotion, SpatialWrench};
use super::tree::{Joints, PerBody, PlacedBody, Tree, TreeBody};
use super::vector::{Vector3, add, cross, matrix, scale, three, transposed_times, zero};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

/// The robot at one instant.
pub(super) struct RobotInstant<T> {
    base: Rigid<T>,
    bodies: PerBody<TreeBody<T>>,
    /// Element 0 is the base.
    pub(super) placed: PerBody<PlacedBody<T>>,
    /// On each body, own axes and origin.
    pub(super) applied: PerBody<SpatialWrench<T>>,
    pub(super) drives: Joints<JointDrive<T>>,
    /// Acceleration that a base is held at, own axes.
    pub(super) held: Option<SpatialMotion<T>>,
    pub(super) appendages: Appendages<T>,
    bent: DeformedAppendages<T>,
}

/// A wrench in inertial axes at the origin of a body's frame, in that frame: turned from body to body, which takes fewer
/// products than frames of all bodies.
fn turned<T: Scalar>(
    tree: &Tree,
    placed: &[PlacedBody<T>],
    body: usize,
    force: Vector3<T>,
    torque: Vector3<T>,
) -> SpatialWrench<T> {
    let outer = match body {
        0 => SpatialWrench { torque, force },
        _ => turned(tree, placed, tree.parent[body - 1], force, torque),
    };
    let rotation = &placed[body].frame.rotation;
    SpatialWrench {
        torque: transposed_times(rotation, outer.torque),
        force: transposed_times(rotation, outer.force),
    }
}

impl<T: Scalar> RobotInstant<T> {
    /// Memory for [`Self::set`], which fills it in place: lists that are moved cost as much as a sweep.
    #[inline]
    pub(super) fn new() -> Self {
        Self {
            base: Rigid { mass: T::zero(), first: zero(), inertia: [zero(); 3] },
            bodies: PerBody::new(),
            placed: PerBody::new(),
            applied: PerBody::new(),
            drives: Joints::new(),
            held: None,
            appendages: Appendages::new(),
            bent: DeformedAppendages::new(),
        }
    }

    /// Where everything is and what acts on it; of a new one.
    pub(super) fn set(&mut self, model: &SpatialFreeFlyer, at: &At<T>) {
        self.place(model, at);
        let (s, p, row) = (model.structure(), &model.parameter, &model.state);
        let n = s.bodies();
        self.applied.extend((0..=n).map(|_| SpatialWrench::zero()));
        (0..n).for_each(|j| self.drives.push(model.drive(at, j)));
        self.held = s.held.then(|| {
            // A field of gravity is a base that accelerates the other way.
            let up = scale(T::constant(-1.0), three(at.p, p.gravity));
            SpatialMotion { angular: zero(), linear: transposed_times(&self.placed[0].frame.rotation, up) }
        });
        if s.panels() > 0 || s.links() > 0 {
            let modes = s.modes();
            let eta = &at.x[row.modal_coordinate..][..modes];
            let rates = &at.x[row.modal_velocity..][..modes];
            self.appendages.bend(&self.placed, eta, rates, &mut self.bent);
        }
        apply(model, at, &self.placed, &mut self.applied, &mut self.bent);
    }

    /// Where all bodies and ends of links are and how they move, and nothing else; of a new one.
    pub(super) fn place(&mut self, model: &SpatialFreeFlyer, at: &At<T>) {
        let (s, p, row) = (model.structure(), &model.parameter, &model.state);
        let n = s.bodies();
        let (frame, velocity) = base(model, at);
        self.base = Rigid::new(at.p[p.base_mass], zero(), &matrix(at.p, p.base_inertia));
        self.bodies.push(TreeBody { rigid: self.base, mount: SpatialFrame::identity(), axis: zero() });
        for j in 0..n {
            let center = three(at.p, p.body_center + 3 * j);
            self.bodies.push(TreeBody {
                rigid: Rigid::new(at.p[p.body_mass + j], center, &matrix(at.p, p.body_inertia + 9 * j)),
                mount: SpatialFrame {
                    rotation: rotation(four(at.p, p.joint_orientation + 4 * j)),
                    origin: three(at.p, p.joint_position + 3 * j),
                },
                axis: unit(three(at.p, p.joint_axis + 3 * j)),
            });
        }
        let (angles, rates) = (&at.x[row.joint_angle..][..n], &at.x[row.joint_velocity..][..n]);
        if s.panels() > 0 || s.links() > 0 {
            self.shape(model, at);
        }
        let ends = (s.links() > 0).then_some(&self.bent.ends);
        s.tree.place_into(&self.bodies, (frame, velocity), (angles, rates), ends, &mut self.placed);
    }

    /// What bends, and where the ends of links are.
    fn shape(&mut self, model: &SpatialFreeFlyer, at: &At<T>) {
        let (s, row, modes) = (model.structure(), &model.state, model.structure().modes());
        let (appendages, bent) = (&mut self.appendages, &mut self.bent);
        for (k, shapes) in s.appendages.iter().enumerate() {
            if appendages.add_beam(0, *shapes, &model.beam(at, k)).is_err() {
                // A length or a mass that is none: there is no motion, which the caller refuses.
                self.base.mass = T::constant(f64::NAN);
            }
        }
        let mut first = 0;
        for (k, count) in s.tables.iter().enumerate() {
            let (frame, rigid) = model.table(at.p, k);
            let modes = model.table_modes(at.p, first, *count).map(|m| (m, SpatialMotion::zero()));
            if appendages.put_table(0, &frame, &rigid, modes, None).is_err() {
                self.base.mass = T::constant(f64::NAN);
            }
            first += count;
        }
        for (k, (body, shapes)) in s.beams().enumerate() {
            if appendages.add_link(body, shapes, &model.link(at, k), s.axial_stiffening).is_err() {
                self.base.mass = T::constant(f64::NAN);
            }
        }
        let mut first = 0;
        for (k, (body, count)) in s.link_tables().enumerate() {
            let (frame, rigid, end) = model.link_table(at.p, k);
            let modes = model.link_table_modes(at.p, first, count);
            if appendages.put_table(body, &frame, &rigid, modes, Some(end)).is_err() {
                self.base.mass = T::constant(f64::NAN);
            }
            first += count;
        }
        if s.links() > 0 {
            let eta = &at.x[row.modal_coordinate..][..modes];
            let rates = &at.x[row.modal_velocity..][..modes];
            bent.ends.set(appendages, eta, rates);
        }
    }

    /// As the algorithms over bodies read it.
    pub(super) fn snapshot<'a>(&'a self, model: &'a SpatialFreeFlyer) -> RobotSnapshot<'a, T> {
        RobotSnapshot {
            tree: &model.structure().tree,
            base: &self.base,
            bodies: &self.bodies,
            placed: &self.placed,
            drives: &self.drives,
            flexing: self.bent.of(&self.appendages),
        }
    }

    /// The axis of the joint of this body (from 1), own axes.
    pub(super) fn axis(&self, body: usize) -> Vector3<T> {
        self.bodies[body].axis
    }
    /// Velocity of what hangs on this body, its axes and origin.
    pub(super) fn carrier_velocity(&self, body: usize) -> SpatialMotion<T> {
        let own = self.placed[body].velocity;
        self.bent.ends.of(body).map_or(own, |(_, e)| own.plus(e.velocity))
    }
    /// A point that is fixed to what hangs on this body, from its unbent position to its present one, body axes.
    pub(super) fn displaced(&self, body: usize, place: Vector3<T>) -> Vector3<T> {
        self.bent.ends.displaced(body, place)
    }
    /// How what hangs on this body is turned by the bending of its link.
    pub(super) fn end_turn(&self, body: usize) -> Quaternion<T> {
        let (o, i) = (T::zero(), T::one());
        self.bent
            .ends
            .of(body)
            .map_or([i, o, o, o], |(_, e)| normalized([i, e.gibbs[0], e.gibbs[1], e.gibbs[2]]))
    }
    /// Axes of what hangs on this body, whose own are `frame`, where that is written.
    pub(super) fn carried(&self, body: usize, frame: &SpatialFrame<T>) -> SpatialFrame<T> {
        self.bent.ends.of(body).map_or(*frame, |(_, end)| frame.then(&end.frame))
    }
    /// Of all bodies in the inertial frame; element 0 is the base.
    pub(super) fn frames(&self, model: &SpatialFreeFlyer) -> PerBody<SpatialFrame<T>> {
        model.structure().tree.inertial(&self.placed)
    }

    /// Some accelerations are given.
    pub(super) fn prescribe(
        &mut self,
        model: &SpatialFreeFlyer,
        prescribed: &PrescribedAccelerations<'_, T>,
    ) {
        let base = self.placed[0];
        if let Some((linear, angular)) = prescribed.base.filter(|_| !model.structure().held) {
            let own = transposed_times(&base.frame.rotation, linear);
            let (v, omega) = (base.velocity.linear, base.velocity.angular);
            self.held = Some(SpatialMotion { angular, linear: add(own, cross(v, omega)) });
        }
        prescribed.joints.iter().for_each(|(j, a)| self.drives[*j].moves = Moves::Prescribed(*a));
        for (j, a) in prescribed.motors.iter().filter(|(j, _)| model.motor_row(*j).is_some()) {
            self.drives[*j].rotor = Rotor::Prescribed(*a);
        }
    }

    /// Forces on the coordinates in addition to what acts on it, in their order ([`SpatialFreeFlyer::rates_under`]); of one that is set.
    pub(super) fn push(&mut self, model: &SpatialFreeFlyer, force: &[T]) {
        let mut rest = force;
        if let ([x, y, z, torque @ ..], false) = (force, model.structure().held)
            && let [a, b, c, others @ ..] = torque
        {
            let force = transposed_times(&self.placed[0].frame.rotation, [*x, *y, *z]);
            self.applied[0] = self.applied[0].plus(SpatialWrench { torque: [*a, *b, *c], force });
            rest = others;
        }
        let n = self.drives.len().min(rest.len());
        let (joints, motors) = rest.split_at(n);
        for (drive, force) in self.drives.iter_mut().zip(joints) {
            if let Moves::Driven(torque) = &mut drive.moves {
                *torque += *force;
            }
        }
        let own = (0..n).filter(|j| model.motor_row(*j).is_some());
        for (j, force) in own.zip(motors) {
            if let Rotor::Driven(torque) = &mut self.drives[j].rotor {
                *torque += *force;
            }
        }
    }

    /// Only prescribed motion acts on it. It must not move.
    pub(super) fn rest(&mut self, held: bool) {
        self.held = held.then(SpatialMotion::zero);
        self.applied.iter_mut().for_each(|w| *w = SpatialWrench::zero());
        self.bent.force.iter_mut().for_each(|f| *f = T::zero());
        for drive in &mut self.drives {
            drive.moves = Moves::Driven(T::zero());
            if drive.rotor != Rotor::Geared {
                drive.rotor = Rotor::Driven(T::zero());
            }
        }
    }

    /// How all of it accelerates; gives that of the base, own axes, spatial.
    pub(super) fn accelerations(
        &self,
        model: &SpatialFreeFlyer,
        out: SweepResult<'_, T>,
    ) -> SpatialMotion<T> {
        accelerations(&self.snapshot(model), &self.applied, self.held, out)
    }
}

/// Frame of the base and its velocity, own axes.
fn base<T: Scalar>(model: &SpatialFreeFlyer, at: &At<T>) -> (SpatialFrame<T>, SpatialMotion<T>) {
    let (p, row) = (&model.parameter, &model.state);
    if model.structure().held {
        let rotation = rotation(four(at.p, p.initial_base_quaternion));
        return (
            SpatialFrame { rotation, origin: three(at.p, p.initial_base_position) },
            SpatialMotion::zero(),
        );
    }
    let rotation = rotation(four(at.x, row.base_quaternion));
    let linear = transposed_times(&rotation, three(at.x, row.base_velocity));
    let velocity = SpatialMotion { angular: three(at.x, row.base_angular_velocity), linear };
    (SpatialFrame { rotation, origin: three(at.x, row.base_position) }, velocity)
}

/// Puts on each body what thrusters and wrenches put there.
fn apply<T: Scalar>(
    model: &SpatialFreeFlyer,
    at: &At<T>,
    placed: &[PlacedBody<T>],
    all: &mut [SpatialWrench<T>],
    bent: &mut DeformedAppendages<T>,
) {
    let (s, p, input) = (model.structure(), &model.parameter, &model.input);
    for k in (0..s.thrusters).filter(|k| !at.u[input.thruster_force + k].vanishes()) {
        let along = unit(three(at.p, p.thruster_direction + 3 * k));
        let force = scale(at.u[input.thruster_force + k], along);
        let torque = cross(three(at.p, p.thruster_position + 3 * k), force);
        all[0] = all[0].plus(SpatialWrench { torque, force });
    }
    if !s.held {
        let force = three(at.u, input.base_force);
        all[0] = all[0].plus(turned(&s.tree, placed, 0, force, three(at.u, input.base_torque)));
    }
    for (a, tip) in s.tips.iter().enumerate() {
        let (force, torque) = (three(at.u, input.tip_force + 3 * a), three(at.u, input.tip_torque + 3 * a));
        if force.iter().chain(&torque).all(|c| c.vanishes()) {
            continue;
        }
        at_tip(model, at, (a, *tip), placed, (force, torque), (all, bent));
    }
    if !model.effects().is_empty() {
        affect(model, at, placed, (all, bent));
    }
}

/// A force and a torque in inertial axes at tip `a`, which is on this body.
#[inline]
fn at_tip<T: Scalar>(
    model: &SpatialFreeFlyer,
    at: &At<T>,
    (a, body): (usize, usize),
    placed: &[PlacedBody<T>],
    (force, torque): (Vector3<T>, Vector3<T>),
    (all, bent): (&mut [SpatialWrench<T>], &mut DeformedAppendages<T>),
) {
    let mut w = turned(&model.structure().tree, placed, body, force, torque);
    let offset = three(at.p, model.parameter.tip_offset + 3 * a);
    w.torque = add(w.torque, cross(bent.ends.displaced(body, offset), w.force));
    all[body] = all[body].plus(w);
    bent.push(body, w);
}

/// Puts on the base and on the body of the first tip what effects put there.
#[cold]
#[inline(never)]
fn affect<T: Scalar>(
    model: &SpatialFreeFlyer,
    at: &At<T>,
    placed: &[PlacedBody<T>],
    (all, bent): (&mut [SpatialWrench<T>], &mut DeformedAppendages<T>),
) {
    let (on_base, on_tip) = model.effect_wrenches(at, &placed[0]);
    let tree = &model.structure().tree;
    all[0] = all[0].plus(turned(tree, placed, 0, on_base.force, on_base.torque));
    if let Some(body) = model.structure().tips.first() {
        at_tip(model, at, (0, *body), placed, (on_tip.force, on_tip.torque), (all, bent));
    }
}

impl SpatialFreeFlyer {
    /// Axes of link `k` of those that bend (from 0): beams, then tables.
    pub(super) fn link_frame<T: Scalar>(&self, p: &[T], k: usize) -> SpatialFrame<T> {
        let at = &self.parameter;
        SpatialFrame {
            rotation: rotation(four(p, at.link_orientation + 4 * k)),
            origin: three(p, at.link_position + 3 * k),
        }
    }
    /// Link `k` of those that are beams (from 0).
    pub(super) fn link<T: Scalar>(&self, at: &At<T>, k: usize) -> Beam<T> {
        let p = &self.parameter;
        let modulus = at.p[p.youngs_modulus + k];
        let shear = modulus / ((at.p[p.poisson_ratio + k] + 1.0) * 2.0);
        Beam {
            frame: self.link_frame(at.p, k),
            length: at.p[p.link_length + k],
            mass_per_length: at.p[p.link_mass + k],
            bending_stiffness: [0, 1].map(|side| modulus * at.p[p.area_moment + 2 * k + side]),
            torsion_stiffness: shear * at.p[p.torsion_constant + k],
            polar_inertia_per_length: at.p[p.link_polar + k],
            damping_ratio: at.p[p.link_damping + k],
        }
    }
    /// Appendage `k` (from 0).
    pub(super) fn beam<T: Scalar>(&self, at: &At<T>, k: usize) -> Beam<T> {
        let p = &self.parameter;
        Beam {
            frame: SpatialFrame {
                rotation: rotation(four(at.p, p.appendage_orientation + 4 * k)),
                origin: three(at.p, p.appendage_position + 3 * k),
            },
            length: at.p[p.appendage_length + k],
            mass_per_length: at.p[p.mass_per_length + k],
            bending_stiffness: [at.p[p.bending_x + k], at.p[p.bending_y + k]],
            torsion_stiffness: at.p[p.torsion + k],
            polar_inertia_per_length: at.p[p.polar_inertia + k],
            damping_ratio: at.p[p.damping_ratio + k],
        }
    }
}
