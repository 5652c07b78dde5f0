//! Default values of the contact models, and what their parameters may not be.

use super::frame::{dot, sub, two};
use super::layout::{Closing, GripperStructure, HUNT_CROSSLEY, LOCKS, Mount, Parameters, PortShape};
use super::presets::{Capture, SIM1};
use super::view::Gripper;

/// Values of that capture in the order of [`Parameters`]; balls beyond three are further along the hand, in pairs.
pub(super) fn defaults(s: &GripperStructure, of: &Capture) -> Vec<f64> {
    let at = Parameters::new(s);
    let mut p = vec![0.0; at.count];
    p[at.stiffness] = of.stiffness;
    p[at.damping] = of.damping;
    p[at.damping_law] = 1.0;
    p[at.reference] = of.reference;
    p[at.slip_speed] = 1e-4;
    for i in 0..s.balls {
        p[at.ball_radius + i] = of.ball_radius;
        p[at.ball_mass + i] = of.ball_mass;
        if i > 0 {
            let pair = ((i - 1) / 2) as f64;
            let (side, further) = (if i % 2 == 1 { 1.0 } else { -1.0 }, 2.4 * of.ball_radius * pair);
            for (begin, place) in [(at.open, of.open), (at.closed, of.closed)] {
                p[begin + 2 * i] = place[0] + further;
                p[begin + 2 * i + 1] = side * place[1];
            }
        }
    }
    if s.closing == Closing::Schedule {
        p[at.closing_time] = of.closing_time;
        p[at.hold_force] = of.hold_force;
    }
    if s.closing == Closing::Motor {
        [p[at.jaw_inertia], p[at.jaw_friction], p[at.motor_limit]] = of.jaw;
    }
    match s.against {
        PortShape::Ball => p[at.port_radius] = of.ball_radius,
        PortShape::Bar => (p[at.port_radius], p[at.bar_half]) = (SIM1.radius, SIM1.bar_half),
        PortShape::Plate => p[at.port_normal] = -1.0,
    }
    if s.mount == Mount::Elastic {
        p[at.mount_stiffness..at.mount_stiffness + 2].fill(of.mount[0]);
        p[at.mount_damping..at.mount_damping + 2].fill(of.mount[1]);
    }
    if s.sliding() {
        carriages(s, &at, &mut p);
    }
    p[at.target_mass] = of.target_mass;
    p[at.target_inertia] = of.target_inertia;
    p[at.target_center..at.target_center + 2].copy_from_slice(&of.target_center);
    p
}

/// Values of the gripper with carriages; further rollers are behind the third of their jaw.
fn carriages(s: &GripperStructure, at: &Parameters, p: &mut [f64]) {
    (p[at.stiffness], p[at.damping]) = (SIM1.stiffness, SIM1.damping);
    [p[at.carriage_stiffness], p[at.carriage_damping]] = SIM1.spring;
    p[at.carriage_travel] = SIM1.travel;
    p[at.carriage_direction] = -1.0;
    p[at.rigidization] = LOCKS;
    for i in 0..s.balls {
        (p[at.ball_radius + i], p[at.ball_mass + i]) = (SIM1.radius, SIM1.roller_mass);
        let Some(k) = i.checked_sub(1) else { continue };
        let (side, row) = (if k % 2 == 0 { 1.0 } else { -1.0 }, k / 2);
        let last = SIM1.rollers.len() - 1;
        let [x, y] = SIM1.rollers[row.min(last)];
        let x = x + 2.4 * SIM1.radius * row.saturating_sub(last) as f64;
        for (begin, out) in [(at.open, SIM1.stroke), (at.closed, 0.0)] {
            (p[begin + 2 * i], p[begin + 2 * i + 1]) = (x, side * (y + out));
        }
    }
    if s.closing == Closing::Schedule {
        p[at.hold_force] = SIM1.hold_force;
    }
    if s.closing == Closing::Motor {
        [p[at.spindle_turns], p[at.motor_limit]] = SIM1.spindle;
    }
}

/// Parameters that contradict each other: the first of them, and the remedy.
pub(super) fn check(g: &Gripper, p: &[f64]) -> Result<(), (usize, String)> {
    let (at, s) = (&g.parameters, &g.structure);
    for i in 0..s.balls {
        for j in 0..i {
            let apart = sub(two(p, at.closed + 2 * i), two(p, at.closed + 2 * j));
            let (distance, radii) = (dot(apart, apart).sqrt(), p[at.ball_radius + i] + p[at.ball_radius + j]);
            if distance < radii {
                return Err((
                    at.closed + 2 * i,
                    format!(
                        "closed, ball {} would overlap ball {} of the hand: their centres are {distance:.4} m apart, \
                         their radii add up to {radii:.4} m; move it or take smaller balls",
                        i + 1,
                        j + 1
                    ),
                ));
            }
        }
    }
    if s.against == PortShape::Plate && two(p, at.port_normal) == [0.0; 2] {
        return Err((at.port_normal, "a plate requires a normal; give a vector that is not 0".into()));
    }
    if s.sliding() {
        if two(p, at.carriage_direction) == [0.0; 2] {
            return Err((
                at.carriage_direction,
                "a carriage requires a way; give a vector that is not 0".into(),
            ));
        }
        if p[at.friction] > 0.0 {
            let why = "rollers of a carriage have no friction; give 0, or pack with endBallMount=rigid";
            return Err((at.friction, why.into()));
        }
        if p[at.damping_law] == HUNT_CROSSLEY {
            let why = "carriages have the damping printed; give that, or pack with endBallMount=rigid";
            return Err((at.damping_law, why.into()));
        }
    }
    if s.mount == Mount::Elastic {
        if two(p, at.open) != two(p, at.closed) {
            return Err((
                at.closed,
                "the mount of an elastic ball does not move: give the position of the open jaws".into(),
            ));
        }
        if p[at.ball_mass] == 0.0 {
            if let Some(i) = (0..2).find(|i| p[at.mount_damping + i] == 0.0) {
                return Err((
                    at.mount_damping + i,
                    "a ball without mass requires a damper on its mount: give one above 0, or a ballMass"
                        .into(),
                ));
            }
            if p[at.friction] > 0.0 {
                return Err((
                    at.friction,
                    "a ball without mass on a mount has no friction: give 0, or a ballMass".into(),
                ));
            }
        }
    }
    Ok(())
}

/// How deep a pair overlaps at the start: no deeper than the smaller radius, or the error.
pub(super) fn deepest(ball: usize, penetration: f64, radii: [f64; 2]) -> Result<(), String> {
    let smaller = radii[0].min(radii[1]);
    if penetration > smaller {
        return Err(format!(
            "ball {ball} begins {penetration:.4} m deep in the port, deeper than the smaller radius of {smaller:.4} m; begin further apart"
        ));
    }
    Ok(())
}
