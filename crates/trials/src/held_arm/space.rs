//! Vectors of three components and rotations.

/// Three components.
pub(crate) type Arrow = [f64; 3];
/// Three rows.
pub(crate) type Turning = [Arrow; 3];

pub(super) const LEVEL: Turning = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

#[inline]
pub(super) fn dot(a: Arrow, b: Arrow) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
#[inline]
pub(super) fn cross(a: Arrow, b: Arrow) -> Arrow {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
#[inline]
pub(super) fn plus(a: Arrow, b: Arrow) -> Arrow {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
#[inline]
pub(super) fn minus(a: Arrow, b: Arrow) -> Arrow {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
#[inline]
pub(super) fn times(s: f64, a: Arrow) -> Arrow {
    [s * a[0], s * a[1], s * a[2]]
}
#[inline]
pub(super) fn apply(m: &Turning, a: Arrow) -> Arrow {
    [dot(m[0], a), dot(m[1], a), dot(m[2], a)]
}
/// The transpose of `m` times `a`.
#[inline]
pub(super) fn apply_back(m: &Turning, a: Arrow) -> Arrow {
    plus(plus(times(a[0], m[0]), times(a[1], m[1])), times(a[2], m[2]))
}
/// The rotation `a` after `b`.
#[inline]
pub(super) fn after(a: &Turning, b: &Turning) -> Turning {
    [apply_back(b, a[0]), apply_back(b, a[1]), apply_back(b, a[2])]
}
/// By `angle` rad about a unit vector (Rodrigues).
#[inline]
pub(super) fn about(e: Arrow, angle: f64) -> Turning {
    let (s, c) = angle.sin_cos();
    let (x, y, z, v) = (e[0], e[1], e[2], 1.0 - c);
    [
        [c + v * x * x, v * x * y - s * z, v * x * z + s * y],
        [v * x * y + s * z, c + v * y * y, v * y * z - s * x],
        [v * x * z - s * y, v * y * z + s * x, c + v * z * z],
    ]
}
/// The rotation of a quaternion w, x, y, z of length 1.
pub(super) fn of_quaternion(q: [f64; 4]) -> Turning {
    let [w, x, y, z] = q;
    [
        [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
    ]
}
/// `m` of a body seen from axes that it is turned by `r` against: r m r'.
#[inline]
pub(super) fn seen(r: &Turning, m: &Turning) -> Turning {
    let half = after(r, m);
    let row = |i: usize| [dot(half[i], r[0]), dot(half[i], r[1]), dot(half[i], r[2])];
    [row(0), row(1), row(2)]
}
