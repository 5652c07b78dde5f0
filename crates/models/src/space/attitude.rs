//! Attitude by quaternions (w, x, y, z), from body axes to those of the parent or the inertial frame.

use super::vector::{Matrix3, Vector3, dot};
use trueup_numerics::Scalar;

/// A quaternion, w first.
pub type Quaternion<T> = [T; 4];

/// No turn.
pub const IDENTITY: Quaternion<f64> = [1.0, 0.0, 0.0, 0.0];

/// How fast a quaternion's length comes back to 1, 1/s. The length that matters is held by this; the rotation itself takes
/// the quaternion as if normalised.
const KAPPA: f64 = 1.0;

/// |Q|^2.
#[inline]
pub fn square<T: Scalar>(q: Quaternion<T>) -> T {
    q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
}

/// The rotation matrix of Q / |Q|: body axes to the parent's.
pub fn rotation<T: Scalar>(q: Quaternion<T>) -> Matrix3<T> {
    let s = T::constant(2.0) / square(q);
    let [w, x, y, z] = q;
    let (xs, ys, zs) = (x * s, y * s, z * s);
    let (wx, wy, wz) = (w * xs, w * ys, w * zs);
    let (xx, xy, xz) = (x * xs, x * ys, x * zs);
    let (yy, yz, zz) = (y * ys, y * zs, z * zs);
    let one = T::one();
    [[one - yy - zz, xy - wz, xz + wy], [xy + wz, one - xx - zz, yz - wx], [xz - wy, yz + wx, one - xx - yy]]
}

/// Q / |Q|.
pub fn normalized<T: Scalar>(q: Quaternion<T>) -> Quaternion<T> {
    let length = square(q).sqrt();
    q.map(|v| v / length)
}

/// A B: the turn B, then A.
pub fn product<T: Scalar>(a: Quaternion<T>, b: Quaternion<T>) -> Quaternion<T> {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// The turn about a unit axis by an angle.
pub fn about_axis<T: Scalar>(axis: Vector3<T>, angle: T) -> Quaternion<T> {
    let (sin, cos) = (angle * 0.5).sin_cos();
    [cos, axis[0] * sin, axis[1] * sin, axis[2] * sin]
}

/// The quaternion of a rotation, by its largest element, so that nothing is divided by what nearly vanishes (Shepperd 1978).
pub fn quaternion(r: &Matrix3<f64>) -> Quaternion<f64> {
    let trace = r[0][0] + r[1][1] + r[2][2];
    let squares = [trace, r[0][0], r[1][1], r[2][2]];
    let most = (0..4).fold(0, |b, k| if squares[k] > squares[b] { k } else { b });
    let mut q = [0.0; 4];
    q[most] = 0.5 * (1.0 + 2.0 * squares[most] - trace).max(0.0).sqrt();
    let f = 0.25 / q[most];
    if most == 0 {
        (0..3).for_each(|i| q[1 + i] = (r[(i + 2) % 3][(i + 1) % 3] - r[(i + 1) % 3][(i + 2) % 3]) * f);
    } else {
        let (i, j, k) = (most - 1, most % 3, (most + 1) % 3);
        q[0] = (r[k][j] - r[j][k]) * f;
        q[1 + j] = (r[i][j] + r[j][i]) * f;
        q[1 + k] = (r[i][k] + r[k][i]) * f;
    }
    q
}

/// d(Q)/dt for the rate omega in body axes: 1/2 Q (0, omega), and back to length 1 (SFF-1).
pub fn rate<T: Scalar>(q: Quaternion<T>, omega: Vector3<T>) -> Quaternion<T> {
    let [w, x, y, z] = q;
    let [a, b, c] = omega;
    let back = (square(q) - 1.0) * (-0.5 * KAPPA); // (SFF-1)
    [
        (-(x * a + y * b + z * c)) * 0.5 + back * w,
        (w * a + y * c - z * b) * 0.5 + back * x,
        (w * b + z * a - x * c) * 0.5 + back * y,
        (w * c + x * b - y * a) * 0.5 + back * z,
    ]
}

/// The rotation about a unit axis by an angle: turned axes to the axes before (Rodrigues).
pub fn about<T: Scalar>(axis: Vector3<T>, angle: T) -> Matrix3<T> {
    let (sin, cos) = angle.sin_cos();
    let v = -cos + 1.0;
    let [x, y, z] = axis;
    let (xv, yv, zv) = (x * v, y * v, z * v);
    let (xs, ys, zs) = (x * sin, y * sin, z * sin);
    let (xy, xz, yz) = (x * yv, x * zv, y * zv);
    [[x * xv + cos, xy - zs, xz + ys], [xy + zs, y * yv + cos, yz - xs], [xz - ys, yz + xs, z * zv + cos]]
}

/// a / |a|; 0 stays 0.
pub fn unit<T: Scalar>(a: Vector3<T>) -> Vector3<T> {
    let square = dot(a, a);
    if square.value() == 1.0 || square.value() == 0.0 {
        return a;
    }
    let length = square.sqrt();
    [a[0] / length, a[1] / length, a[2] / length]
}

/// Four elements.
pub(super) fn four<T: Copy>(v: &[T], at: usize) -> Quaternion<T> {
    [v[at], v[at + 1], v[at + 2], v[at + 3]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quaternions_are_those_of_their_rotations() {
        for q in [[1.0, 0.0, 0.0, 0.0], [0.1, 0.9, -0.3, 0.2], [0.0, 0.1, 0.9, 0.2], [-0.3, 0.2, 0.1, 0.9]] {
            let r = rotation(q);
            let again = rotation(quaternion(&r));
            let off = r.iter().flatten().zip(again.iter().flatten()).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-15, "{q:?}");
        }
    }
}
