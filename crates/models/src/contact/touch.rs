//! All contacts of a gripper at one instant: forces, energies, powers.

use super::ball::{Ball, MovedBall, moved, pair};
use super::carriage::{self, CarriageSlide};
use super::closing::Jaws;
use super::frame::{ContactVector, ContactWrench, PointFrame, add, cross, dot, scale, sub, turned, two};
use super::law::{ContactLaw, ContactPair, touches};
use super::layout::Mount;
use super::view::{Gripper, GripperView};
use super::{MAX_BALLS, layout};
use trueup_numerics::Scalar;

/// Forces and powers at one instant; inertial axes, SI.
#[derive(Clone, Copy, Debug)]
pub(super) struct ContactState<T> {
    pub jaws: Jaws<T>,
    /// Centres of the balls.
    pub balls: [ContactVector<T>; MAX_BALLS],
    pub pairs: [ContactPair<T>; MAX_BALLS],
    pub forces: [T; MAX_BALLS],
    /// On the target, about the port.
    pub on_port: ContactWrench<T>,
    /// On the end effector, about its reference point.
    pub on_host: ContactWrench<T>,
    /// Of contacts and mounts, J.
    pub elastic: T,
    /// Taken by dampers and friction, W.
    pub loss: T,
    /// Of what moves the jaws, W.
    pub jaw_power: T,
    /// Largest force against a jaw's way, N.
    pub jaw_force: T,
    /// What contacts do against jawPosition, N.m: their virtual work.
    pub jaw_load: T,
    /// Of the jaws against the hand: sum of m c'^2, 2 J.
    pub jaw_motion: T,
    /// Rates of the end ball's displacement (end effector's axes) and velocity.
    pub mounted: [ContactVector<T>; 2],
    /// The carriages; at rest where there are none.
    pub slides: [CarriageSlide<T>; 2],
}

impl<T: Scalar> ContactState<T> {
    /// All 0.
    fn none(jaws: Jaws<T>) -> Self {
        let (o, v) = (T::zero(), [T::zero(); 2]);
        let pair = ContactPair { normal: v, penetration: o, approach: o };
        Self {
            jaws,
            balls: [v; MAX_BALLS],
            pairs: [pair; MAX_BALLS],
            forces: [o; MAX_BALLS],
            on_port: ContactWrench::default(),
            on_host: ContactWrench::default(),
            elastic: o,
            loss: o,
            jaw_power: o,
            jaw_force: o,
            jaw_load: o,
            jaw_motion: o,
            mounted: [v; 2],
            slides: [CarriageSlide::none(); 2],
        }
    }
}

/// The law with its constants.
pub(super) fn law<T: Scalar>(p: &[T], at: &layout::Parameters) -> ContactLaw<T> {
    ContactLaw::chosen(p[at.stiffness], p[at.damping], p[at.damping_law], p[at.reference])
}

/// Everything at that instant.
pub(super) fn touch<T: Scalar>(g: &Gripper, v: &GripperView<'_, T>) -> ContactState<T> {
    let (at, law) = (&g.parameters, law(v.p, &g.parameters));
    let mut all = ContactState::none(g.jaws(v));
    if g.structure.sliding() {
        all.slides = carriage::slides(g, v, &law, &all.jaws);
        for slide in &all.slides {
            all.elastic += slide.energy;
            all.loss += slide.loss;
        }
    }
    for i in 0..g.structure.balls {
        let slide = carriage::of_ball(i).filter(|_| g.structure.sliding()).map(|c| &all.slides[c]);
        let shift = slide.map(|s| scale(s.position, s.way));
        let MovedBall { way, mut moving, fixed, mut ball } = moved(g, v, &all.jaws, i, shift);
        let jaw = moving;
        if let Some(slide) = slide {
            moving = add(moving, scale(slide.rate, slide.way));
            ball.velocity = add(fixed.velocity, v.host.out(moving)); // (CON-12)
        }
        let radius = ball.radius;
        let mut spring = [T::zero(); 2];
        if g.structure.mount == Mount::Elastic {
            spring = mounted(g, v, &law, &fixed, &mut ball, &mut all);
        }
        let pair = pair(&g.structure, v.p, at, &v.port, &ball);
        let mode = v.modes[i];
        let normal_force = law.force(mode, pair.penetration, pair.approach);
        // Halfway into the overlap, on the line of the centres: the force acts on both bodies there.
        let depth = if touches(mode) { pair.penetration * 0.5 } else { T::zero() };
        let arm = scale(radius - depth, pair.normal);
        let place = add(ball.place, arm);
        let surface = add(ball.velocity, turned(v.host.rate, arm));
        let tangent = [-pair.normal[1], pair.normal[0]];
        let slip = dot(tangent, sub(v.port.velocity_at(place), surface));
        let (friction, rub) = friction(v.p[at.friction] * normal_force, slip, v.p[at.slip_speed]);
        let on_target = if touches(mode) {
            add(scale(normal_force, pair.normal), scale(friction, tangent))
        } else {
            [T::zero(); 2]
        };
        all.on_port.add(on_target, sub(place, v.port.position));
        if g.structure.mount == Mount::Elastic {
            all.on_host.add(spring.map(|f| -f), sub(ball.place, v.host.position)); // (CON-8)
            // A mount does not let its ball turn.
            all.on_host.torque -= cross(arm, on_target);
            let mass = v.p[at.ball_mass + i];
            if mass.value() > 0.0 {
                all.mounted[1] = scale(T::one() / mass, sub(spring, on_target)); // (CON-8)
            }
            all.jaw_motion += mass * dot(all.mounted[0], all.mounted[0]);
        } else {
            all.on_host.add(on_target.map(|f| -f), sub(place, v.host.position));
            all.jaw_motion += v.p[at.ball_mass + i] * dot(moving, moving);
        }
        all.elastic += law.energy(mode, pair.penetration);
        all.loss += rub;
        if touches(mode) {
            all.loss += (normal_force - law.stiffness * pair.penetration) * pair.approach;
        }
        all.jaw_power += dot(on_target, v.host.out(jaw));
        all.jaw_load += dot(on_target, v.host.out(way)); // (CON-11)
        let length = dot(way, way).sqrt();
        if length.value() > 0.0 {
            all.jaw_force = all.jaw_force.max(dot(on_target, v.host.out(way)) / length);
        }
        (all.balls[i], all.pairs[i], all.forces[i]) = (ball.place, pair, normal_force);
    }
    all
}

/// Smoothed friction of this level at this slip: force along the slip's tangent in N, power in W.
fn friction<T: Scalar>(level: T, slip: T, smooth: T) -> (T, T) {
    let force = -level * slip / (slip * slip + smooth * smooth).sqrt();
    (force, -force * slip)
}

/// The end ball on its mount (CON-8): moves the ball to the position of its state, and returns the mount's force on it.
fn mounted<T: Scalar>(
    g: &Gripper,
    v: &GripperView<'_, T>,
    law: &ContactLaw<T>,
    fixed: &PointFrame<T>,
    ball: &mut Ball<T>,
    all: &mut ContactState<T>,
) -> ContactVector<T> {
    let at = &g.parameters;
    let displaced = two(v.x, g.states.ball_displacement);
    let (k, c) = (two(v.p, at.mount_stiffness), two(v.p, at.mount_damping));
    let here = fixed.at(displaced);
    ball.place = here.position;
    let rate = if v.p[at.ball_mass].value() > 0.0 {
        ball.velocity = two(v.x, g.states.ball_velocity);
        v.host.inward(sub(ball.velocity, here.velocity)) // (CON-8)
    } else {
        // Without mass the contact's force is the mount's: (C + c n n^T) d' = -K d - n (k delta + c a).
        ball.velocity = here.velocity;
        let still = pair(&g.structure, v.p, at, &v.port, ball);
        let n = v.host.inward(still.normal);
        let damper = law.damping(v.modes[0], still.penetration);
        let push = law.force(v.modes[0], still.penetration, still.approach);
        let free: [T; 2] = core::array::from_fn(|i| (-k[i] * displaced[i] - n[i] * push) / c[i]);
        let soft: [T; 2] = core::array::from_fn(|i| n[i] / c[i]);
        let rate = sub(free, scale(damper * dot(n, free) / (damper * dot(n, soft) + 1.0), soft)); // (CON-8)
        ball.velocity = add(here.velocity, v.host.out(rate));
        rate
    };
    all.mounted[0] = rate;
    let force: [T; 2] = core::array::from_fn(|i| -k[i] * displaced[i] - c[i] * rate[i]); // (CON-8)
    for i in 0..2 {
        all.elastic += k[i] * displaced[i] * displaced[i] * 0.5;
        all.loss += c[i] * rate[i] * rate[i];
    }
    v.host.out(force)
}

/// Twice the kinetic energy of target and jaws against the end effector (S2 21, 22), `sign` 1; with -1 as S2 prints (21).
pub(super) fn relative_motion<T: Scalar>(g: &Gripper, v: &GripperView<'_, T>, jaws: T, sign: f64) -> T {
    let at = &g.parameters;
    let target = v.port.at(two(v.p, at.target_center));
    let r = sub(target.position, v.host.position);
    let carried = turned(v.host.rate, r);
    let velocity = sub(target.velocity, add(v.host.velocity, carried.map(|c| c * sign))); // (CON-6)
    let rate = v.port.rate - v.host.rate;
    v.p[at.target_mass] * dot(velocity, velocity) + v.p[at.target_inertia] * rate * rate + jaws // (CON-6)
}
