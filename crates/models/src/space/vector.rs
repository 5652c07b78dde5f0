//! Vectors and matrices of three rows.

use trueup_numerics::Scalar;

/// A vector in some axes.
pub type Vector3<T> = [T; 3];
/// A matrix, row by row.
pub type Matrix3<T> = [[T; 3]; 3];

/// The vector 0.
#[inline]
pub fn zero<T: Scalar>() -> Vector3<T> {
    [T::zero(); 3]
}
/// a + b.
#[inline]
pub fn add<T: Scalar>(a: Vector3<T>, b: Vector3<T>) -> Vector3<T> {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}
/// a - b.
#[inline]
pub fn sub<T: Scalar>(a: Vector3<T>, b: Vector3<T>) -> Vector3<T> {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
/// s a.
#[inline]
pub fn scale<T: Scalar>(s: T, a: Vector3<T>) -> Vector3<T> {
    [s * a[0], s * a[1], s * a[2]]
}
/// a . b.
#[inline]
pub fn dot<T: Scalar>(a: Vector3<T>, b: Vector3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
/// a x b.
#[inline]
pub fn cross<T: Scalar>(a: Vector3<T>, b: Vector3<T>) -> Vector3<T> {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
/// M a.
#[inline]
pub fn times<T: Scalar>(m: &Matrix3<T>, a: Vector3<T>) -> Vector3<T> {
    [dot(m[0], a), dot(m[1], a), dot(m[2], a)]
}
/// M^T a.
#[inline]
pub fn transposed_times<T: Scalar>(m: &Matrix3<T>, a: Vector3<T>) -> Vector3<T> {
    let column = |k: usize| m[0][k] * a[0] + m[1][k] * a[1] + m[2][k] * a[2];
    [column(0), column(1), column(2)]
}
/// A B.
#[inline]
pub fn product<T: Scalar>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    a.map(|row| transposed_times(b, row))
}
/// A B^T.
#[inline]
pub fn product_transposed<T: Scalar>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    a.map(|row| times(b, row))
}
/// M^T.
#[inline]
pub fn transposed<T: Scalar>(m: &Matrix3<T>) -> Matrix3<T> {
    [[m[0][0], m[1][0], m[2][0]], [m[0][1], m[1][1], m[2][1]], [m[0][2], m[1][2], m[2][2]]]
}
/// The matrix 1.
#[inline]
pub fn identity<T: Scalar>() -> Matrix3<T> {
    let (o, i) = (T::zero(), T::one());
    [[i, o, o], [o, i, o], [o, o, i]]
}
/// A + B.
#[inline]
pub fn plus<T: Scalar>(a: &Matrix3<T>, b: &Matrix3<T>) -> Matrix3<T> {
    [add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])]
}
/// a x (each column of M).
#[inline]
pub fn cross_columns<T: Scalar>(a: Vector3<T>, m: &Matrix3<T>) -> Matrix3<T> {
    let row = |i: usize, j: usize| {
        [a[i] * m[j][0] - a[j] * m[i][0], a[i] * m[j][1] - a[j] * m[i][1], a[i] * m[j][2] - a[j] * m[i][2]]
    };
    [row(1, 2), row(2, 0), row(0, 1)]
}
/// Adds 2 b . u 1 - b u^T - u b^T: what an inertia gets when matter with the moment b is shifted by u.
#[inline]
pub(super) fn spread<T: Scalar>(inertia: &mut Matrix3<T>, b: Vector3<T>, u: Vector3<T>) {
    let twice = dot(b, u) * 2.0;
    for i in 0..3 {
        for j in 0..3 {
            inertia[i][j] -= b[i] * u[j] + u[i] * b[j];
        }
        inertia[i][i] += twice;
    }
}

/// Three elements.
pub(super) fn three<T: Copy>(v: &[T], at: usize) -> Vector3<T> {
    [v[at], v[at + 1], v[at + 2]]
}

/// Nine elements, row by row.
pub(crate) fn matrix<T: Copy>(v: &[T], at: usize) -> Matrix3<T> {
    [three(v, at), three(v, at + 3), three(v, at + 6)]
}
