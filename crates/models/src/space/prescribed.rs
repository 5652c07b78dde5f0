//! Accelerations that are prescribed.

use super::vector::Vector;

/// Rows whose accelerations are given, whatever forces that takes.
#[derive(Clone, Copy, Debug)]
pub struct Led<'a, T> {
    /// The base's: d(v)/dt in inertial axes, d(omega)/dt in base axes; `None`: it is free.
    pub base: Option<(Vector<T>, Vector<T>)>,
    /// Joints (from 0) and their accelerations.
    pub joints: &'a [(usize, T)],
    /// Motors of flexible joints (by joint, from 0; others are not prescribed) and their accelerations, joint side.
    pub motors: &'a [(usize, T)],
}

impl<T> Led<'_, T> {
    /// None.
    pub fn none() -> Self {
        Self { base: None, joints: &[], motors: &[] }
    }
}
