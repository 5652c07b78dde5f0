//! What a capture in space has come to: the definitions of the plane, by what corresponds to them in space.

use super::body::BodyFrame;
use crate::contact::outcome::caged;
use crate::space::vector::{Matrix3, Vector3, product, sub, transposed};

/// The port's centre is within the hull of the balls as seen along the hand's z, and no further from the hand's x-y plane than `reach`, m
/// (CON-17).
pub(super) fn within(host: &BodyFrame<f64>, port: Vector3<f64>, balls: &[Vector3<f64>], reach: f64) -> bool {
    let flat = |point: Vector3<f64>| {
        let [x, y, z] = host.inward(sub(point, host.position));
        ([x, y], z)
    };
    let (point, height) = flat(port);
    let mut seen = [[0.0; 2]; crate::contact::MAX_BALLS];
    for (seen, ball) in seen.iter_mut().zip(balls) {
        *seen = flat(*ball).0;
    }
    height.abs() <= reach && caged(point, &seen[..balls.len()]) // (CON-17)
}

/// The target's axes in those of the hand.
pub(super) fn relative(host: &Matrix3<f64>, port: &Matrix3<f64>) -> Matrix3<f64> {
    product(&transposed(host), port)
}

/// Angle of the turn from one rotation to another, rad: (trace - 1) / 2 is its cosine.
pub(super) fn turn(from: &Matrix3<f64>, to: &Matrix3<f64>) -> f64 {
    let trace: f64 = from.iter().flatten().zip(to.iter().flatten()).map(|(a, b)| a * b).sum();
    ((trace - 1.0) * 0.5).clamp(-1.0, 1.0).acos() // (CON-17)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::attitude::about;

    /// Checks CON-17: the cage of a hand that is turned, the port in it and above it; the angle between two attitudes.
    #[test]
    fn a_cage_is_flat_and_a_turn_is_an_angle() {
        let axis = [0.36, 0.48, 0.8];
        let rotation = about(axis, 0.7);
        let host = BodyFrame { position: [1.0, 2.0, 3.0], rotation, velocity: [0.0; 3], rate: [0.0; 3] };
        let at = |local| host.at(local).position;
        let balls = [at([0.0; 3]), at([0.15, 0.086, 0.0]), at([0.15, -0.086, 0.0])];
        assert!(within(&host, at([0.1, 0.01, 0.02]), &balls, 0.1));
        assert!(!within(&host, at([0.1, 0.01, 0.11]), &balls, 0.1));
        assert!(!within(&host, at([0.16, 0.0, 0.0]), &balls, 0.1));
        for angle in [0.0, 0.05, 1.0, 3.0] {
            let further = product(&rotation, &about([0.0, 0.6, 0.8], angle));
            assert!((turn(&rotation, &further) - angle).abs() < 1e-7, "{angle}");
        }
    }
}
