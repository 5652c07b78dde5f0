//! Code over a plant that holds for numbers and for numbers with derivatives.

use crate::lanes::Lanes;
use crate::plant::Plant;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

/// A scalar that every [`Plant`] computes with: `f64` or [`Lanes`]. Its methods are those of the plant.
pub trait PlantScalar: Scalar {
    /// See [`Plant::start`].
    fn start(plant: &dyn Plant, p: &[Self], x: &mut [Self]);
    /// See [`Plant::rest`].
    fn rest(plant: &dyn Plant, p: &mut [Self], u: &[Self]);
    /// See [`Plant::rates`].
    fn rates(plant: &dyn Plant, at: At<Self>, force: &[Self], dx: &mut [Self]);
    /// See [`Plant::outputs`].
    fn outputs(plant: &dyn Plant, at: At<Self>, y: &mut [Self]);
    /// See [`Plant::indicators`].
    fn indicators(plant: &dyn Plant, at: At<Self>, z: &mut [Self]);
}

macro_rules! plant_scalar {
    ($scalar:ty: $start:ident $rest:ident $rates:ident $outputs:ident $indicators:ident) => {
        impl PlantScalar for $scalar {
            fn start(plant: &dyn Plant, p: &[Self], x: &mut [Self]) {
                plant.$start(p, x);
            }
            fn rest(plant: &dyn Plant, p: &mut [Self], u: &[Self]) {
                plant.$rest(p, u);
            }
            fn rates(plant: &dyn Plant, at: At<Self>, force: &[Self], dx: &mut [Self]) {
                plant.$rates(at, force, dx);
            }
            fn outputs(plant: &dyn Plant, at: At<Self>, y: &mut [Self]) {
                plant.$outputs(at, y);
            }
            fn indicators(plant: &dyn Plant, at: At<Self>, z: &mut [Self]) {
                plant.$indicators(at, z);
            }
        }
    };
}
plant_scalar!(f64: start rest rates outputs indicators);
plant_scalar!(Lanes: start_lanes rest_lanes rates_lanes outputs_lanes indicators_lanes);
