//! A link that bends, as a beam.

use super::appendage::rod;
use super::attitude::{Quaternion, rotation};
use super::body_check::off_unit;
use super::shapes::Shapes;
use super::spatial::Rigid;
use super::vector::Vector3;

/// A body's link that bends, z along it: what the body carries hangs on its end (S3 3.1). The body's own mass and inertia are
/// what sits at its joint, without the link.
#[derive(Clone, Debug, PartialEq)]
pub struct Flexure {
    /// The body, from 1.
    pub body: usize,
    /// Numbers of its shapes.
    pub shapes: Shapes,
    /// Its root, body axes, m.
    pub position: Vector3<f64>,
    /// Own axes to the body's: w, x, y, z.
    pub orientation: Quaternion<f64>,
    /// m.
    pub length: f64,
    /// kg/m.
    pub mass_per_length: f64,
    /// Pa.
    pub youngs_modulus: f64,
    /// Of bending along x and along y, m4.
    pub area_moment: [f64; 2],
    /// Of the material.
    pub poisson_ratio: f64,
    /// Torsion stiffness over shear modulus, m4.
    pub torsion_constant: f64,
    /// rho I_p, kg.m.
    pub polar_inertia_per_length: f64,
    /// Of every mode.
    pub damping_ratio: f64,
}

impl Flexure {
    /// Whether it can be.
    ///
    /// # Errors
    /// What cannot be.
    pub(super) fn check(&self) -> Result<(), String> {
        let values = [
            self.length,
            self.mass_per_length,
            self.youngs_modulus,
            self.torsion_constant,
            self.polar_inertia_per_length,
        ];
        if values.iter().chain(&self.area_moment).any(|v| !(*v > 0.0 && v.is_finite())) {
            let message = "length, mass per length, Young's modulus, area moments, torsion constant and polar inertia per length of its link must be above 0";
            return Err(message.into());
        }
        if off_unit(self.orientation) || self.position.iter().any(|v| !v.is_finite()) {
            let message = "give its link a finite position, and a unit quaternion as orientation, w first";
            return Err(message.into());
        }
        Ok(())
    }

    /// Unbent, about its body's origin, axes of the body.
    pub(super) fn rigid(&self) -> Rigid<f64> {
        let along = rotation(self.orientation).map(|row| row[2]);
        let (mass, polar) = (self.mass_per_length * self.length, self.polar_inertia_per_length * self.length);
        rod(mass, self.length, polar, along).shifted(self.position)
    }
}
