//! A body's link that bends, in a file of a robot.

use serde::Deserialize;
use trueup_models::space::appendage::Shapes;
use trueup_models::space::design::Flexure;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Bends {
    /// Shapes along its x, along its y, of torsion.
    #[serde(default = "usual")]
    shapes: [usize; 3],
    #[serde(default)]
    position: [f64; 3],
    #[serde(default = "super::unturned")]
    orientation: [f64; 4],
    length: f64,
    mass_per_length: f64,
    youngs_modulus: f64,
    area_moment: [f64; 2],
    #[serde(default = "metal")]
    poisson_ratio: f64,
    torsion_constant: f64,
    polar_inertia_per_length: f64,
    #[serde(default)]
    damping_ratio: f64,
}

fn usual() -> [usize; 3] {
    [2, 2, 1]
}
/// Poisson's ratio of aluminium.
fn metal() -> f64 {
    0.33
}

impl Bends {
    /// Of the body of this number (from 1).
    pub(super) fn of(self, body: usize) -> Flexure {
        let [x, y, torsion] = self.shapes;
        Flexure {
            body,
            shapes: Shapes { x, y, torsion },
            position: self.position,
            orientation: self.orientation,
            length: self.length,
            mass_per_length: self.mass_per_length,
            youngs_modulus: self.youngs_modulus,
            area_moment: self.area_moment,
            poisson_ratio: self.poisson_ratio,
            torsion_constant: self.torsion_constant,
            polar_inertia_per_length: self.polar_inertia_per_length,
            damping_ratio: self.damping_ratio,
        }
    }
}
