//! All contacts of a hand in space at one instant.

use super::body::{BodyFrame, PointWrench};
use super::layout::{HandParameters, SolidShape, SpatialGripperStructure};
use super::solid::Solid;
use crate::contact::MAX_BALLS;
use crate::contact::closing::Jaws;
use crate::contact::law::{ContactLaw, ContactPair, touches};
use crate::space::attitude::unit;
use crate::space::vector::{Vector3, add, cross, dot, scale, sub};
use trueup_numerics::Scalar;

/// Forces and powers at one instant; inertial axes, SI.
#[derive(Clone, Copy, Debug)]
pub(super) struct HandContacts<T> {
    /// Centres of the balls.
    pub balls: [Vector3<T>; MAX_BALLS],
    pub pairs: [ContactPair<T, 3>; MAX_BALLS],
    pub forces: [T; MAX_BALLS],
    /// On the target, about the port.
    pub on_port: PointWrench<T>,
    /// On the end effector, about its reference point.
    pub on_host: PointWrench<T>,
    /// Of the contacts, J.
    pub elastic: T,
    /// Taken by dampers and friction, W.
    pub loss: T,
    /// Of what moves the jaws, W.
    pub jaw_power: T,
    /// Largest force against a jaw's way, N.
    pub jaw_force: T,
}

pub(super) fn vector<T: Copy>(values: &[T], at: usize) -> Vector3<T> {
    [values[at], values[at + 1], values[at + 2]]
}

/// What is about the port, in its axes.
pub(super) fn solid<T: Scalar>(s: &SpatialGripperStructure, at: &HandParameters, p: &[T]) -> Solid<T> {
    let axis = || unit(vector(p, at.port_axis));
    match s.against {
        SolidShape::Ball => Solid::Ball(p[at.port_radius]),
        SolidShape::Plate => Solid::Plate(axis()),
        SolidShape::Bar => Solid::Bar(axis(), p[at.port_radius], p[at.port_half]),
        SolidShape::Cylinder => Solid::Cylinder(axis(), p[at.port_radius], p[at.port_half]),
        SolidShape::Ring => Solid::Ring(axis(), p[at.ring_radius], p[at.port_radius]),
    }
}

/// The law with its constants.
fn law<T: Scalar>(p: &[T], at: &HandParameters) -> ContactLaw<T> {
    ContactLaw::chosen(p[at.stiffness], p[at.damping], p[at.damping_law], p[at.reference])
}

/// Everything at that instant; the modes are those of the balls.
pub(super) fn contacts<T: Scalar>(
    (s, at, p): (&SpatialGripperStructure, &HandParameters, &[T]),
    (host, port): (&BodyFrame<T>, &BodyFrame<T>),
    jaws: &Jaws<T>,
    modes: &[i32],
) -> HandContacts<T> {
    let (law, solid, o) = (law(p, at), solid(s, at, p), T::zero());
    let none = ContactPair { normal: [o; 3], penetration: o, approach: o };
    let mut all = HandContacts {
        balls: [[o; 3]; MAX_BALLS],
        pairs: [none; MAX_BALLS],
        forces: [o; MAX_BALLS],
        on_port: PointWrench::none(),
        on_host: PointWrench::none(),
        elastic: o,
        loss: o,
        jaw_power: o,
        jaw_force: o,
    };
    for i in 0..s.balls {
        let (open, closed) = (vector(p, at.open + 3 * i), vector(p, at.closed + 3 * i));
        let way = sub(closed, open);
        let fixed = host.at(add(open, scale(jaws.position, way)));
        let moving = host.out(scale(jaws.rate, way));
        let (place, velocity) = (fixed.position, add(fixed.velocity, moving));
        let radius = p[at.ball_radius + i];
        let met = solid.meet(port.inward(sub(place, port.position)), radius);
        let normal = port.out(met.normal);
        let mode = modes[i];
        // Halfway into the overlap: the force acts on both bodies there.
        let depth = if touches(mode) { met.penetration * 0.5 } else { o };
        let arm = scale(radius - depth, normal);
        let where_met = add(place, arm);
        // The ball's centre and its surface approach alike: it turns about its centre.
        let apart = sub(port.velocity_at(where_met), velocity);
        let pair = ContactPair { approach: -dot(normal, apart), normal, penetration: met.penetration };
        let normal_force = law.force(mode, pair.penetration, pair.approach);
        all.elastic += law.energy(mode, pair.penetration);
        if touches(mode) {
            let surface = add(velocity, cross(host.rate, arm));
            let slipping = sub(port.velocity_at(where_met), surface);
            let slip = sub(slipping, scale(dot(normal, slipping), normal));
            let smooth = p[at.slip_speed];
            let level = p[at.friction] * normal_force / (dot(slip, slip) + smooth * smooth).sqrt();
            let on_target = sub(scale(normal_force, normal), scale(level, slip));
            all.on_port.add(on_target, sub(where_met, port.position));
            all.on_host.add(on_target.map(|f| -f), sub(where_met, host.position));
            all.loss += level * dot(slip, slip);
            all.loss += (normal_force - law.stiffness * pair.penetration) * pair.approach;
            all.jaw_power += dot(on_target, moving);
            let length = dot(way, way).sqrt();
            if length.value() > 0.0 {
                all.jaw_force = all.jaw_force.max(dot(on_target, host.out(way)) / length);
            }
        }
        (all.balls[i], all.pairs[i], all.forces[i]) = (place, pair, normal_force);
    }
    all
}
