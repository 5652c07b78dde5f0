//! Default values of a capture in space, and what its parameters may not be.

use super::layout::{HandParameters, SolidShape, SpatialGripperStructure, TargetParameters};
use super::touch::vector;
use crate::contact::layout::Closing;
use crate::contact::presets::{SIM1, SIM2};
use crate::space::attitude::IDENTITY;
use crate::space::vector::{dot, matrix, sub};
use crate::space::{inertia_fault, off_unit};

/// Values of SIM2 in space: its hand in the x-y plane of the tip's body, its target with one inertia about all axes.
pub(super) fn defaults(s: &SpatialGripperStructure) -> Vec<f64> {
    let at = HandParameters::new(s);
    let mut p = vec![0.0; at.count];
    (p[at.stiffness], p[at.damping], p[at.damping_law]) = (SIM2.stiffness, SIM2.damping, 1.0);
    (p[at.reference], p[at.slip_speed]) = (SIM2.reference, 1e-4);
    for i in 0..s.balls {
        p[at.ball_radius + i] = SIM2.ball_radius;
        let Some(k) = i.checked_sub(1) else { continue };
        let (side, further) = (if k % 2 == 0 { 1.0 } else { -1.0 }, 2.4 * SIM2.ball_radius * (k / 2) as f64);
        for (begin, place) in [(at.open, SIM2.open), (at.closed, SIM2.closed)] {
            (p[begin + 3 * i], p[begin + 3 * i + 1]) = (place[0] + further, side * place[1]);
        }
    }
    if s.closing == Closing::Schedule {
        (p[at.closing_time], p[at.hold_force]) = (SIM2.closing_time, SIM2.hold_force);
    }
    match s.against {
        SolidShape::Ball => p[at.port_radius] = SIM2.ball_radius,
        SolidShape::Plate => p[at.port_axis] = -1.0,
        SolidShape::Bar | SolidShape::Cylinder => {
            (p[at.port_radius], p[at.port_half]) = (SIM1.radius, 3.0 * SIM1.bar_half);
            p[at.port_axis + 2] = 1.0;
        }
        // Its nearest section is at the port's place of the other shapes, its plane across the hand's x.
        SolidShape::Ring => {
            (p[at.port_radius], p[at.ring_radius]) = (SIM1.radius, RING);
            p[at.port_axis] = 1.0;
        }
    }
    p[at.target_mass] = SIM2.target_mass;
    (0..3).for_each(|i| p[at.target_inertia + 4 * i] = SIM2.target_inertia);
    p[at.target_center..at.target_center + 2].copy_from_slice(&SIM2.target_center);
    p
}

/// Radius of the middle circle of a ring, m.
const RING: f64 = 0.6;

/// Values of the target at the start.
pub(super) fn placed(s: &SpatialGripperStructure, at: &TargetParameters, p: &mut [f64]) {
    p[at.port_offset..at.port_offset + 2].copy_from_slice(&SIM2.port_offset);
    if s.against == SolidShape::Plate {
        // As far before the foremost ball as the port's ball before P1.
        let hand = HandParameters::new(s);
        let fronts = (0..s.balls).map(|i| p[hand.open + 3 * i] + p[hand.ball_radius + i]);
        let gap = SIM2.port_offset[0] - 2.0 * SIM2.ball_radius;
        p[at.port_offset] = fronts.fold(f64::NEG_INFINITY, f64::max) + gap;
    }
    if s.against == SolidShape::Ring {
        p[at.port_offset + 1] += RING;
    }
    p[at.port_quaternion..at.port_quaternion + 4].copy_from_slice(&IDENTITY);
}

/// Parameters that contradict each other: the first of them, and the remedy.
pub(super) fn check(
    (s, at): (&SpatialGripperStructure, &HandParameters),
    target: &TargetParameters,
    p: &[f64],
) -> Result<(), (usize, String)> {
    for i in 0..s.balls {
        for j in 0..i {
            let apart = sub(vector(p, at.closed + 3 * i), vector(p, at.closed + 3 * j));
            let (distance, radii) = (dot(apart, apart).sqrt(), p[at.ball_radius + i] + p[at.ball_radius + j]);
            if distance < radii {
                let (i1, j1) = (i + 1, j + 1);
                let why = format!(
                    "closed, ball {i1} would overlap ball {j1} of the hand: their centres are {distance:.4} m apart, their radii add up to {radii:.4} m; move it or take smaller balls"
                );
                return Err((at.closed + 3 * i, why));
            }
        }
    }
    if s.against != SolidShape::Ball && vector(p, at.port_axis) == [0.0; 3] {
        return Err((
            at.port_axis,
            "portAxis is 0, which is no direction; give a vector that is not 0".into(),
        ));
    }
    if s.against == SolidShape::Ring && p[at.ring_radius] <= p[at.port_radius] {
        let why = format!(
            "portRingRadius = {} is no ring: its section has a radius of {} m; give a larger one",
            p[at.ring_radius], p[at.port_radius]
        );
        return Err((at.ring_radius, why));
    }
    if let Some(why) = inertia_fault(&matrix(p, at.target_inertia)) {
        return Err((at.target_inertia, format!("targetInertia: {why}")));
    }
    let q = [0, 1, 2, 3].map(|i| p[target.port_quaternion + i]);
    if off_unit(q) {
        let why = format!("initialPortQuaternion = {q:?} has not length 1: give a unit quaternion, w first");
        return Err((target.port_quaternion, why));
    }
    Ok(())
}
