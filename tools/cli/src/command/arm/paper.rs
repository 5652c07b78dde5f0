//! What S3 prints of DELIAN in its Tables 4 and 5.

use trueup_flexibility::elements::FlexibleElement::{self, Joint, Link};
use trueup_models::flexible_arm::presets::{DELIAN, RAISED};

use super::asked::ArmRequest;

/// An element: deflection, deg (Table 4); rise of the first frequency when it is 20 % stiffer (Table 5).
pub(super) struct PaperRow {
    pub(super) element: FlexibleElement,
    pub(super) deflection: f64,
    pub(super) rise: f64,
}

const fn row(element: FlexibleElement, deflection: f64, rise: f64) -> PaperRow {
    PaperRow { element, deflection, rise }
}

pub(super) const TABLES: [PaperRow; 5] = [
    row(Joint(2), 0.17, 0.022),
    row(Joint(3), 0.08, 0.017),
    row(Joint(5), 0.02, 0.007),
    row(Link(1), 0.49, 0.079),
    row(Link(2), 1.09, 0.046),
];

/// The posture of Table 4, as far as it can be had.
pub(super) const POSTURE: [f64; 6] = [0.0, RAISED, -RAISED, 0.0, 0.0, 0.0];
/// Angles that are this near are the same, rad.
const NEAR: f64 = 1e-3;

/// Whether this is DELIAN as it was when the tables were made, but for the pose.
pub(super) fn loaded_so(asked: &ArmRequest<'_>) -> bool {
    asked.args.robot.to_str() == Some(DELIAN) && asked.args.payload == 0.0 && asked.args.gravity.is_none()
}

/// Whether the tables are of this arm at this pose.
pub(super) fn applies(asked: &ArmRequest<'_>) -> bool {
    loaded_so(asked)
        && asked.motors.len() == POSTURE.len()
        && asked.motors.iter().zip(POSTURE).all(|(q, p)| (q - p).abs() < NEAR)
}
