//! What is fixed of a flexible arm.

/// What is fixed when a model is packed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Structure {
    /// Bodies, joints, links that bend, tips; the base is held.
    pub robot: crate::space::Structure,
    /// Motors are driven by their currents, else by torques.
    pub by_current: bool,
}
