//! A gripper's structure with the places of its values, and its view at one instant.

use super::frame::PointFrame;
use super::layout::{Command, GripperStructure, Outputs, Parameters, States};

/// A gripper's structure, and where its values are; its parameters, states and outputs come first in the vectors of the models
/// that have one.
#[derive(Clone, Debug)]
pub(super) struct Gripper {
    pub structure: GripperStructure,
    pub parameters: Parameters,
    pub command: Command,
    pub outputs: Outputs,
    pub states: States,
}

/// What a gripper sees at one instant.
#[derive(Clone, Copy)]
pub(super) struct GripperView<'a, T> {
    pub t: T,
    pub p: &'a [T],
    pub x: &'a [T],
    pub u: &'a [T],
    pub modes: &'a [i32],
    /// The end effector.
    pub host: PointFrame<T>,
    /// The target's port.
    pub port: PointFrame<T>,
}
