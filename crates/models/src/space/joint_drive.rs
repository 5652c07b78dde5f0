//! How a joint and its motor move at one instant.

/// How the rotor of a joint's motor moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Rotor<T> {
    /// With the joint: no spring between.
    #[default]
    Geared,
    /// By itself, driven by this torque, N.m.
    Driven(T),
    /// By itself, with this acceleration, rad/s2, whatever torque that takes.
    Prescribed(T),
}

/// How a joint moves.
#[derive(Clone, Copy, Debug)]
pub enum Moves<T> {
    /// Driven by this torque (force), N.m (N).
    Driven(T),
    /// With this acceleration, rad/s2 (m/s2), whatever torque that takes.
    Prescribed(T),
}

/// One joint with its motor at one instant.
#[derive(Clone, Copy, Debug)]
pub struct JointDrive<T> {
    /// How the joint moves.
    pub moves: Moves<T>,
    /// How its rotor moves.
    pub rotor: Rotor<T>,
    /// Inertia of the rotor, joint side of the gear (gear ratio squared included), kg.m2.
    pub inertia: T,
    /// Share of the carrier's rate that the rotor's equation sees, sigma.
    pub share: T,
    /// Rate of the rotor, joint side, rad/s.
    pub rate: T,
}
