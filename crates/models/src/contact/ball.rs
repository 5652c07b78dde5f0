//! A ball of the gripper where jaws and carriages bring it, and the pair that it makes with what is about the port.

use super::closing::Jaws;
use super::frame::{ContactVector, PointFrame, add, dot, scale, sub, two};
use super::law::{self, ContactPair};
use super::layout::{self, GripperStructure, PortShape};
use super::view::{Gripper, GripperView};
use trueup_numerics::Scalar;

/// A ball that the jaws move.
pub(super) struct MovedBall<T> {
    /// From open to closed, and its rate, hand's axes.
    pub way: ContactVector<T>,
    pub moving: ContactVector<T>,
    /// The point of the hand where the ball is.
    pub fixed: PointFrame<T>,
    pub ball: Ball<T>,
}

/// Ball `i` as the jaws move it, which its carriage shifts by so much (hand's axes).
pub(super) fn moved<T: Scalar>(
    g: &Gripper,
    v: &GripperView<'_, T>,
    jaws: &Jaws<T>,
    i: usize,
    shift: Option<ContactVector<T>>,
) -> MovedBall<T> {
    let at = &g.parameters;
    let (open, closed) = (two(v.p, at.open + 2 * i), two(v.p, at.closed + 2 * i));
    let way = sub(closed, open);
    let mut centre = add(open, scale(jaws.position, way));
    if let Some(shift) = shift {
        centre = add(centre, shift); // (CON-12)
    }
    let moving = scale(jaws.rate, way);
    let fixed = v.host.at(centre);
    let velocity = add(fixed.velocity, v.host.out(moving));
    let ball = Ball { radius: v.p[at.ball_radius + i], place: fixed.position, velocity };
    MovedBall { way, moving, fixed, ball }
}

/// The pair that a ball makes with what is about the port.
pub(super) fn pair<T: Scalar>(
    s: &GripperStructure,
    p: &[T],
    at: &layout::Parameters,
    port: &PointFrame<T>,
    ball: &Ball<T>,
) -> ContactPair<T> {
    let apart = sub(port.position, ball.place);
    match s.against {
        PortShape::Ball => {
            law::balls(apart, sub(port.velocity, ball.velocity), ball.radius + p[at.port_radius])
        }
        PortShape::Plate => {
            let normal = two(p, at.port_normal);
            let length = dot(normal, normal).sqrt();
            let outward = port.out(normal.map(|n| n / length));
            law::plate(apart, sub(port.velocity_at(ball.place), ball.velocity), outward, ball.radius)
        }
        PortShape::Bar => {
            let nearest = on_bar(port, p[at.bar_half], ball.place);
            let velocity = sub(port.velocity_at(nearest), ball.velocity);
            law::balls(sub(nearest, ball.place), velocity, ball.radius + p[at.port_radius]) // (CON-13)
        }
    }
}

/// The point of a bar's middle line, `half` long to either side, that is nearest to a point.
fn on_bar<T: Scalar>(port: &PointFrame<T>, half: T, point: ContactVector<T>) -> ContactVector<T> {
    let axis = port.out([T::zero(), T::one()]);
    let along = dot(sub(point, port.position), axis).max(-half).min(half);
    add(port.position, scale(along, axis)) // (CON-13)
}

impl Gripper {
    /// The centre of the port's ball, or the point of its bar's middle line, that is nearest to a point.
    pub(super) fn nearest<T: Scalar>(
        &self,
        v: &GripperView<'_, T>,
        point: ContactVector<T>,
    ) -> ContactVector<T> {
        match self.structure.against {
            PortShape::Bar => on_bar(&v.port, v.p[self.parameters.bar_half], point),
            PortShape::Ball | PortShape::Plate => v.port.position,
        }
    }
}

pub(super) struct Ball<T> {
    pub radius: T,
    pub place: ContactVector<T>,
    pub velocity: ContactVector<T>,
}
