//! What the studies of closed loops share: DELIAN with a payload, and the settings of its controllers.

use trueup_models::controller::parameter;
use trueup_models::flexible_arm::presets::{delian, parameters};
use trueup_models::flexible_arm::{FlexibleArm, FlexibleArmStructure};
use trueup_models::space::design::RobotDesign;
use trueup_models::space::layout::Parameters;

pub(crate) const N: usize = 6;

/// DELIAN as the figures in `docs/flexible-arm-control.md` have it: weight along its links neither stiffens nor softens them.
pub(crate) fn arm() -> Result<FlexibleArm, String> {
    let design = RobotDesign { axial_stiffening: Some(false), ..delian() };
    FlexibleArm::new(FlexibleArmStructure { robot: design.structure(), by_current: false })
}

/// Parameters of DELIAN with this payload, kg, in its hand; without weight in orbit.
pub(crate) fn with_payload(arm: &FlexibleArm, payload: f64, orbit: bool) -> Vec<f64> {
    let mut design = delian();
    // A hand of 0.5 kg at 0.06 m and a point at 0.15 m.
    let hand = &mut design.links[N - 1];
    let mass = 0.5 + payload;
    let apart = 0.5 * payload / mass * 0.09 * 0.09;
    hand.mass = mass;
    hand.center_of_mass = [(0.03 + 0.15 * payload) / mass, 0.0, 0.0];
    hand.inertia = [[2e-3, 0.0, 0.0], [0.0, 2e-3 + apart, 0.0], [0.0, 0.0, 2e-3 + apart]];
    let mut p = parameters(arm, &design);
    if orbit {
        p[Parameters::new(&arm.structure().robot).gravity..][..3].fill(0.0);
    }
    p
}

/// Of the controller of joint `j`: K_p in 1/s, omega_n in rad/s; the velocity loop at 60 rad/s, T_i = 0.1 s, 0.5 A at most.
pub(crate) fn settings(
    arm: &FlexibleArm,
    p: &[f64],
    j: usize,
    gain: f64,
    omega: f64,
) -> [f64; parameter::COUNT] {
    let at = Parameters::new(&arm.structure().robot);
    let limit = 0.5 * 0.02 * p[at.gear_ratio + j];
    [gain, 60.0 * p[at.motor_inertia + j], 0.1, 1.0, 1.0, limit, omega, 1.0]
}
