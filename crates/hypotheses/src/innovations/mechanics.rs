//! What laws need of the mechanics of a chain along its trajectory.

use std::rc::Rc;

/// A passive hinge inside a link, held along the trajectory. Series by node: the tip's as it is there, others means over both ends of
/// the step.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HingeAlong {
    /// Torque n_0 that it carries, N.m.
    pub torque: Vec<f64>,
    /// (M^-1)_ee, M with the hinge and all other coordinates, 1/(kg.m2).
    pub mobility: Vec<f64>,
    /// Its column of M, by coordinate of the trajectory.
    pub inertia: Vec<Vec<f64>>,
    /// Derivative of the tip's place (x, y, attitude) with respect to its angle.
    pub tip: [Vec<f64>; 3],
}

/// Mechanics of a chain along the trajectory in hand, at the parameters in hand and the model's own accelerations. `None`: the chain
/// cannot have it.
pub trait ChainMechanics {
    /// Forces of a uniform field of 1 m/s2 along axis 0 or 1, means over the steps by coordinate and node, of a recording.
    fn field(&self, recording: usize, axis: usize) -> Option<Vec<Vec<f64>>>;
    /// Derivative of the tip's place along an axis, from 0, with respect to each coordinate, by coordinate and node.
    fn tip(&self, recording: usize, axis: usize) -> Option<Rc<Vec<Vec<f64>>>>;
    /// A hinge in link `link` (from 0) at this share of its length.
    fn hinge(&self, recording: usize, link: usize, at: f64) -> Option<Rc<HingeAlong>>;
}
