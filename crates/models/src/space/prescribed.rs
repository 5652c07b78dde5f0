//! Accelerations that are prescribed.

use super::vector::Vector3;

/// Rows whose accelerations are given, whatever forces that takes.
#[derive(Clone, Copy, Debug)]
pub struct PrescribedAccelerations<'a, T> {
    /// The base's: d(v)/dt in inertial axes, d(omega)/dt in base axes; `None`: it is free.
    pub base: Option<(Vector3<T>, Vector3<T>)>,
    /// Joints (from 0) and their accelerations.
    pub joints: &'a [(usize, T)],
    /// Motors of flexible joints (by joint, from 0; others are not prescribed) and their accelerations, joint side.
    pub motors: &'a [(usize, T)],
}

impl<T> PrescribedAccelerations<'_, T> {
    /// None.
    pub fn none() -> Self {
        Self { base: None, joints: &[], motors: &[] }
    }
}
