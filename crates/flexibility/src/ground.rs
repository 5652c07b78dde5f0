//! An arm of a design, standing on the ground.

use trueup_models::flexible_arm::{FlexibleArm, FlexibleArmStructure};
use trueup_models::space::design::RobotDesign;
use trueup_models::space::layout::Parameters;
use trueup_models::space::spatial::Rigid;

/// On Earth, z up, m/s2.
pub const EARTH: [f64; 3] = [0.0, 0.0, -9.81];

/// An arm and values of its parameters.
#[derive(Clone, Debug)]
pub struct Standing {
    /// Its structure.
    pub arm: FlexibleArm,
    /// All its parameters.
    pub parameters: Vec<f64>,
}

/// The arm of this design on a base that is held, in this field of gravity, m/s2, inertial axes.
///
/// # Errors
/// A structure or values that `FlexibleArm` refuses, with the remedy.
pub fn standing(design: &RobotDesign, gravity: [f64; 3]) -> Result<Standing, String> {
    let design = RobotDesign { held: true, ..design.clone() };
    let arm = FlexibleArm::new(FlexibleArmStructure { robot: design.structure(), by_current: false })?;
    let mut parameters = arm.defaults();
    let of_bodies = design.parameters();
    parameters[..of_bodies.len()].copy_from_slice(&of_bodies);
    parameters[Parameters::new(&arm.structure().robot).gravity..][..3].copy_from_slice(&gravity);
    arm.check(&parameters).map_err(|(_, why)| why)?;
    Ok(Standing { arm, parameters })
}

/// The design with a point of this mass, kg, at its first tip; `None` where it has no tip on a moving body.
pub fn loaded(design: &RobotDesign, mass: f64) -> Option<RobotDesign> {
    let tip = design.tips.first()?;
    let mut design = design.clone();
    let body = design.links.get_mut(tip.body.checked_sub(1)?)?;
    let own = Rigid::new(body.mass, body.center_of_mass, &body.inertia);
    let whole = own.plus(&Rigid::new(mass, tip.offset, &[[0.0; 3]; 3]));
    let center = whole.first.map(|h| h / whole.mass);
    // About the common centre: what a point of the whole mass there would have is taken away.
    let point = Rigid::new(whole.mass, center, &[[0.0; 3]; 3]);
    body.inertia = [0, 1, 2].map(|i| [0, 1, 2].map(|j| whole.inertia[i][j] - point.inertia[i][j]));
    (body.mass, body.center_of_mass) = (whole.mass, center);
    Some(design)
}
