//! Coordinates and readings of an FMU, where its variables are known to be that (`ports.toml`): its forces are inputs.

use trueup_numerics::Scalar;
use trueup_numerics::hybrid::ModelSizes;
use trueup_plant::{Coordinate, InsertedAs, InsertionPoint, VariableTable, insertion_points};

/// The input through which a generalised force acts: u + `per_force` * force / parameter `divisor`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceInput {
    /// Index of the input.
    pub input: usize,
    /// In units of the input per unit of force; with a divisor times its unit.
    pub per_force: f64,
    /// Parameter, by index: the torque constant of an input that is a current.
    pub divisor: Option<usize>,
}

/// What is known of an FMU's variables.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HybridPorts {
    /// Its coordinates.
    pub coordinates: Vec<Coordinate>,
    /// One for each coordinate.
    pub forces: Vec<ForceInput>,
    /// Outputs that are readings, by index; none: all are.
    pub readings: Option<Vec<usize>>,
}

impl HybridPorts {
    /// Inputs with these forces (one for each coordinate); `None`: no forces.
    pub(super) fn with_forces<T: Scalar>(&self, u: &[T], p: &[T], force: &[T]) -> Option<Vec<T>> {
        if force.is_empty() || self.forces.is_empty() {
            return None;
        }
        let mut u = u.to_vec();
        for (enters, force) in self.forces.iter().zip(force) {
            let by = T::constant(enters.per_force) * *force;
            let by = enters.divisor.map_or(by, |k| by / p[k]);
            u[enters.input] += by;
        }
        Some(u)
    }

    pub(super) fn insertion_points(&self, table: &VariableTable) -> Vec<InsertionPoint> {
        let read = |i: &usize| self.readings.as_ref().is_none_or(|all| all.contains(i));
        let mut all = insertion_points(table, &self.coordinates);
        all.retain(|point| point.acts != InsertedAs::Reading || read(&point.at));
        all
    }

    /// A message where these are not ports of an FMU of these sizes.
    pub(super) fn mistake(&self, sizes: &ModelSizes) -> Option<String> {
        let coordinates = &self.coordinates;
        if coordinates.len() != self.forces.len() {
            return Some(format!(
                "{} coordinates and {} forces; give one for each",
                coordinates.len(),
                self.forces.len()
            ));
        }
        for (c, enters) in coordinates.iter().zip(&self.forces) {
            let states = c.position.into_iter().chain([c.rate]).all(|i| i < sizes.states);
            let outputs = [c.position_output, c.rate_output].into_iter().all(|i| i < sizes.outputs);
            let ratio = c.follows.and_then(|f| f.ratio);
            let own = [c.initial_position, c.initial_rate].into_iter().chain(ratio).chain(enters.divisor);
            let parameters = own.chain(c.dry_friction.into_iter().flatten()).all(|i| i < sizes.parameters);
            let modes =
                c.friction_mode.is_none() && c.follows.is_none_or(|f| f.coordinate < coordinates.len());
            if !(states && outputs && parameters && modes && enters.input < sizes.inputs) {
                return Some(format!(
                    "coordinate `{}` names a variable that the FMU does not have; take its indices from the table",
                    c.name
                ));
            }
        }
        let reading = self.readings.iter().flatten().find(|i| **i >= sizes.outputs)?;
        Some(format!("reading {reading} of {} outputs; take its index from the table", sizes.outputs))
    }
}
