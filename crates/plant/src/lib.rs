//! A plant as an object: what identification, estimation and diagnosis require of a model, whichever it is.
//!
//! * [`Plant`]: variables, coordinates, and a hybrid system's equations at `f64` and at [`Lanes`] (eight derivatives at once),
//!   under generalised forces on its coordinates.
//! * [`PlantScalar`]: code over either scalar, for any plant.
//! * [`tangent`], [`force_sensitivity`], [`InverseMass`]: what follows from the equations by dual numbers.
//!
//! It holds no physics and names no model: models implement the trait, and are compiled once.

mod coordinate;
mod insertion;
mod lanes;
mod linear;
mod plant;
mod scalar;
mod variable;

pub use coordinate::{Coordinate, CoordinateKind, Follows};
pub use insertion::{InsertedAs, InsertionPoint, insertion_points};
pub use lanes::{LANES, Lanes};
pub use linear::{InverseMass, PlantTangent, force_of_changes, force_sensitivity, tangent};
pub use plant::{Plant, PlantError};
pub use scalar::PlantScalar;
pub use variable::{ChosenAs, PlantQuantity, QuantityRole, StructureChoice, VariableTable, elements};
