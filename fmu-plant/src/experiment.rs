//! The default experiments: what the reference results in the FMUs are made with.

use crate::space_controller;
use crate::structure::{PLANAR, SPATIAL, carried_by};
use trueup_fmi::configuration::Configuration;
use trueup_fmi_export::reference::Schedule;
use trueup_models::space::control::SpaceController;

/// Relative tolerance of the default experiments. Importers that hold sampled inputs between communication
/// points and do not restart their solver there (FMPy with CVode) give up when it is tighter: inputs that jump are no part of a
/// smooth solution. Each model has the tightest that all of its sampled runs pass (table in docs/benchmarks.md).
/// Co-Simulation has a tolerance of its own where the importer requests none.
pub(crate) const TOLERANCE: f64 = 1e-5;
/// Of a body that floats, and of a capture by one.
pub(crate) const CAPTURE_TOLERANCE: f64 = 1e-7;

/// Inputs of the reference experiment of a configuration's model.
pub fn schedule(c: &Configuration) -> Option<Schedule<'static>> {
    Some(match c.model.as_str() {
        // Break-away forward, coasting to a stop, break-away backward, a push on the load while it sticks.
        "TwoMassJoint" => &[
            (0.1, "motorCurrent", 0.018),
            (0.25, "motorCurrent", 0.0),
            (0.9, "motorCurrent", -0.017),
            (1.0, "motorCurrent", 0.0),
            (1.6, "externalTorque", 2.0),
        ],
        // Joint torques out and back, of one array only: FMPy replays inputs of one shape.
        "PlanarManipulator" => &[
            (0.5, "jointTorque[1]", 0.2),
            (0.5, "jointTorque[2]", -0.02),
            (2.0, "jointTorque[1]", -0.2),
            (2.0, "jointTorque[2]", 0.02),
            (3.5, "jointTorque[1]", 0.0),
            (3.5, "jointTorque[2]", 0.0),
            (5.0, "jointTorque[3]", 0.01),
            (6.0, "jointTorque[3]", -0.02),
            (7.0, "jointTorque[3]", 0.0),
        ],
        // Joint torques out and back; the base is free.
        "SpatialFreeFlyer" => &[
            (0.5, "jointTorque[1]", 2.0),
            (0.5, "jointTorque[2]", -3.0),
            (0.5, "jointTorque[3]", 1.5),
            (2.0, "jointTorque[1]", -2.0),
            (2.0, "jointTorque[2]", 3.0),
            (2.0, "jointTorque[3]", -1.5),
            (3.5, "jointTorque[1]", 0.0),
            (3.5, "jointTorque[2]", 0.0),
            (3.5, "jointTorque[3]", 0.0),
            (5.0, "jointTorque[5]", 0.02),
            (6.0, "jointTorque[5]", -0.02),
            (7.0, "jointTorque[5]", 0.0),
        ],
        SpaceController::NAME => space_controller::schedule(c),
        // The upper arm is held against its weight, then driven up and let go; the shoulder turns.
        "FlexibleArm" => &[
            (0.0, "motorCurrent[2]", 0.0732),
            (0.0, "motorCurrent[3]", 0.0517),
            (0.04, "motorCurrent[1]", 0.03),
            (0.08, "motorCurrent[2]", 0.1),
            (0.12, "motorCurrent[1]", -0.03),
            (0.16, "motorCurrent[1]", 0.0),
            (0.16, "motorCurrent[2]", 0.0732),
        ],
        // A push at the docking point and back.
        "FreeBody" => &[
            (0.5, "portForce[1,1]", 100.0),
            (0.5, "portForce[1,2]", -40.0),
            (3.0, "portForce[1,1]", -100.0),
            (5.5, "portForce[1,1]", 0.0),
            (5.5, "portForce[1,2]", 0.0),
        ],
        // The target comes nearer and goes back while the jaws close.
        "GripperContact" => &[
            (1.0, "portPosition[1]", 0.099),
            (2.0, "portPosition[1]", 0.12),
            (7.0, "portPosition[2]", -0.01),
        ],
        // The same push, on the satellite that carries the manipulator.
        "CaptureScene" if carried_by(c, PLANAR) || carried_by(c, SPATIAL) => &[
            (2.0, "baseForce[1]", 0.1),
            (6.0, "baseForce[1]", 0.0),
            (6.0, "baseForce[2]", -0.03),
            (9.0, "baseForce[2]", 0.0),
        ],
        // The chaser's thrusters push while the target bounces in the hand.
        "CaptureScene" => &[
            (2.0, "chaserForce[1]", 3.0),
            (6.0, "chaserForce[1]", 0.0),
            (6.0, "chaserForce[2]", -1.0),
            (9.0, "chaserForce[2]", 0.0),
        ],
        _ => return None,
    })
}
