//! What is fixed of a flexible arm.

/// What is fixed when a model is packed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FlexibleArmStructure {
    /// Bodies, joints, links that bend, tips; the base is held.
    pub robot: crate::space::RobotStructure,
    /// Motors are driven by their currents, else by torques.
    pub by_current: bool,
}
