//! The variable table of `PlanarManipulator`.

use crate::builder::Builder;
use crate::experiment::TOLERANCE;
use trueup_fmi::table::{Depends, Enumeration, Experiment, Kind, ModelTable};
use trueup_models::arm::{BASE, BASE_CHOICE, FIXED_BASE, PlanarManipulator};
use trueup_models::effect::Plant;
use trueup_numerics::hybrid::Hybrid;

const ONE: &[usize] = &[];
const XY: &[usize] = &[2];

fn from_states() -> Depends {
    Depends::StatesAnd(Vec::new())
}
/// Of each joint.
fn joints(model: &PlanarManipulator) -> [usize; 1] {
    [model.links()]
}
/// How many joints are flexible.
fn motors(model: &PlanarManipulator) -> usize {
    model.flexible().iter().filter(|f| **f).count()
}

/// The table of a manipulator of that structure with those start values (in the model's order).
pub(crate) fn table(model: &PlanarManipulator, start: &[f64]) -> ModelTable {
    let experiment = Experiment { stop_time: 10.0, tolerance: TOLERANCE, step_size: 1e-2 };
    let mut b = Builder::new(
        "PlanarManipulator",
        "Planar free-floating manipulator with flexible joints (CBK PAN test-bed, eq. 1-23)",
        experiment,
    );
    constants(&mut b, model);
    parameters(&mut b, model, start);
    inputs(&mut b, model);
    outputs(&mut b, model);
    states(&mut b, model);
    b.effects(model.effects(), Plant::Arm);
    drive(&mut b);
    b.terminal(
        "tip",
        "What is held at the tip",
        &["tipForce", "tipTorque", "tipPosition", "tipAttitude", "tipVelocity"],
    );
    b.finish(model.sizes().indicators)
}

/// What is fixed when packed.
pub(crate) fn constants(b: &mut Builder, model: &PlanarManipulator) {
    let flexible: Vec<f64> = model.flexible().iter().map(|f| f64::from(*f)).collect();
    let n = flexible.len();
    let joints = &joints(model);
    b.constant("numberOfLinks", Kind::Integer, ONE, &[n as f64], "Number of links, n (fixed when packed)");
    b.constant(
        "jointFlexible",
        Kind::Boolean,
        joints,
        &flexible,
        "The joint has its spring (fixed when packed)",
    );
    let kind = b.items(&BASE);
    let item = if model.has_fixed_base() { FIXED_BASE } else { 1 };
    b.constant(BASE_CHOICE, kind, ONE, &[f64::from(item)], "What becomes of the base (fixed when packed)");
}

/// Parameters with those start values, in the model's order.
pub(crate) fn parameters(b: &mut Builder, model: &PlanarManipulator, start: &[f64]) {
    let n = model.links();
    let (joints, coms): (&[usize], &[usize]) = (&[n], &[n, 2]);
    let coupling = b.enumeration(Enumeration {
        name: "MotorCoupling",
        description: "How a motor's rotor is coupled to the body that carries it",
        items: vec![
            ("paper", "as printed: I_m turns with the motor angle, the carrier feels all of I_m"),
            ("geared", "rotor behind a gear: the carrier feels I_m/N and I_m/N^2"),
        ],
    });

    let mut rest = start;
    let mut next = |len: usize| {
        let (head, tail) = rest.split_at(len.min(rest.len()));
        rest = tail;
        head
    };
    b.tunable("baseMass", "kg", ONE, next(1), "Satellite, m_0 (ARM-1)").bounded_above(0.0);
    b.tunable("baseInertia", "kg.m2", ONE, next(1), "Satellite about its centre of mass, I_0 (ARM-1)")
        .bounded_above(0.0);
    b.tunable(
        "mountPosition",
        "m",
        XY,
        next(2),
        "Joint 1 from the satellite's centre of mass, in the satellite's axes, p_m (eq. 21)",
    );
    b.tunable("linkMass", "kg", joints, next(n), "m_i (eq. 5)").bounded_above(0.0);
    b.tunable("linkInertia", "kg.m2", joints, next(n), "About the link's centre of mass, I_i (eq. 5)")
        .bounded_above(0.0);
    b.tunable("linkLength", "m", joints, next(n), "From joint to joint, l_i (eq. 21)").bounded(0.0);
    b.tunable("linkCenterOfMass", "m", coms, next(2 * n), "From the link's joint, in the link's axes");
    b.tunable(
        "motorInertia",
        "kg.m2",
        joints,
        next(n),
        "Gear ratio squared included, I_mi (eq. 6); of a rigid joint: turns with it",
    )
    .bounded(0.0);
    b.fixed("gearRatio", "1", joints, next(n), "Motor turns per joint turn, N; used by the geared coupling")
        .bounded(1.0);
    b.tunable("jointStiffness", "N.m/rad", joints, next(n), "k_i (eq. 7); unused for a rigid joint")
        .bounded(0.0);
    b.tunable("jointDamping", "N.m.s/rad", joints, next(n), "b_i (eq. 8); unused for a rigid joint")
        .bounded(0.0);
    b.fixed("initialBasePosition", "m", XY, next(2), "x_0, y_0 at the start");
    b.fixed("initialBaseAttitude", "rad", ONE, next(1), "q_0 at the start");
    b.fixed("initialBaseVelocity", "m/s", XY, next(2), "d(x_0), d(y_0) at the start");
    b.fixed("initialBaseRate", "rad/s", ONE, next(1), "d(q_0) at the start");
    b.fixed("initialJointAngle", "rad", joints, next(n), "q_i at the start");
    b.fixed("initialJointVelocity", "rad/s", joints, next(n), "d(q_i) at the start");
    b.fixed(
        "initialMotorAngle",
        "rad",
        joints,
        next(n),
        "q_mi at the start; unset: the joint's angle, so that the spring is unstrained",
    )
    .follows = Some("initialJointAngle".into());
    b.fixed(
        "initialMotorVelocity",
        "rad/s",
        joints,
        next(n),
        "d(q_mi) at the start; unset: the joint's velocity",
    )
    .follows = Some("initialJointVelocity".into());
    b.fixed("motorCoupling", "", ONE, next(1), "How the rotors are coupled to the bodies that carry them")
        .kind = coupling;
    b.tunable(
        "gravity",
        "m/s2",
        XY,
        next(2),
        "Acceleration of free fall, inertial frame (ARM-13); 0 where the base floats",
    );
    if model.has_friction() {
        b.tunable("coulombFriction", "N.m", joints, next(n), "At the motor, joint side, tau_c (EF-1)")
            .bounded(0.0);
        b.tunable(
            "staticFriction",
            "N.m",
            joints,
            next(n),
            "Break-away level, tau_s (EF-1); taken as tau_c where it is below",
        )
        .bounded(0.0);
        b.tunable("viscousFriction", "N.m.s/rad", joints, next(n), "At the motor, joint side, D_m (EF-1)")
            .bounded(0.0);
    }
}

/// Inputs.
pub(crate) fn inputs(b: &mut Builder, model: &PlanarManipulator) {
    let joints = &joints(model);
    b.input(
        "jointTorque",
        "N.m",
        joints,
        "Motor torques, tau (eq. 2), joint side; positive turns the joint forward",
    );
    b.input("baseForce", "N", XY, "Force on the satellite at its centre of mass, inertial frame");
    b.input("baseTorque", "N.m", ONE, "Torque on the satellite");
    b.input("tipForce", "N", XY, "Force on the last link at its tip, inertial frame");
    b.input("tipTorque", "N.m", ONE, "Torque on the last link");
}

/// Outputs without those of effects.
pub(crate) fn outputs(b: &mut Builder, model: &PlanarManipulator) {
    let joints = &joints(model);
    let all_flexible = motors(model) == model.links();
    let motor_angle = if all_flexible { Depends::copy("state.motorAngle") } else { from_states() };
    let motor_velocity = if all_flexible { Depends::copy("state.motorVelocity") } else { from_states() };
    b.output(
        "basePosition",
        "m",
        XY,
        Depends::copy("state.basePosition"),
        "Satellite's centre of mass, x_0, y_0, inertial frame",
    );
    b.output("baseAttitude", "rad", ONE, Depends::copy("state.baseAttitude"), "Satellite's attitude, q_0");
    b.output("baseVelocity", "m/s", XY, Depends::copy("state.baseVelocity"), "d(x_0)/dt, d(y_0)/dt");
    b.output("baseRate", "rad/s", ONE, Depends::copy("state.baseRate"), "d(q_0)/dt");
    b.output(
        "jointAngle",
        "rad",
        joints,
        Depends::copy("state.jointAngle"),
        "Link against the link before, q_i",
    );
    b.output("jointVelocity", "rad/s", joints, Depends::copy("state.jointVelocity"), "d(q_i)/dt");
    b.output(
        "motorAngle",
        "rad",
        joints,
        motor_angle,
        "Motor, joint side, against the link before, q_mi; of a rigid joint: the joint's",
    );
    b.output("motorVelocity", "rad/s", joints, motor_velocity, "d(q_mi)/dt");
    b.output("tipPosition", "m", XY, from_states(), "End-effector, x_e, y_e, inertial frame (eq. 21)");
    b.output("tipAttitude", "rad", ONE, from_states(), "Attitude of the last link");
    b.output("tipVelocity", "m/s", XY, from_states(), "d(x_e)/dt, d(y_e)/dt");
    b.output("linearMomentum", "kg.m/s", XY, from_states(), "Of the whole system, inertial frame");
    b.output(
        "angularMomentum",
        "kg.m2/s",
        ONE,
        from_states(),
        "Of the whole system about the inertial origin, rotors included",
    );
    b.output("kineticEnergy", "J", ONE, from_states(), "T (eq. 4-6), rotors included");
    b.output("potentialEnergy", "J", ONE, from_states(), "V (eq. 7)");
    b.output("tipRate", "rad/s", ONE, from_states(), "Of the last link");
    if model.has_friction() {
        b.output(
            "frictionTorque",
            "N.m",
            joints,
            Depends::All,
            "At the motors, joint side; positive against forward motion (EF-1)",
        );
        b.flag("sticking", joints, "The motor sticks (EF-1)");
    }
}

/// States without those of effects.
pub(crate) fn states(b: &mut Builder, model: &PlanarManipulator) {
    let joints = &joints(model)[..];
    let flexible_joints = [motors(model)];
    let mut states = vec![
        (
            "basePosition",
            "m",
            "m/s",
            XY,
            0.001,
            Depends::copy("state.baseVelocity"),
            "satellite's position, x_0, y_0",
        ),
        (
            "baseAttitude",
            "rad",
            "rad/s",
            ONE,
            0.001,
            Depends::copy("state.baseRate"),
            "satellite's attitude, q_0",
        ),
        (
            "jointAngle",
            "rad",
            "rad/s",
            joints,
            0.01,
            Depends::copy("state.jointVelocity"),
            "joint angles, q_i",
        ),
    ];
    let spring: &[usize] = &flexible_joints;
    if flexible_joints[0] > 0 {
        states.push((
            "motorAngle",
            "rad",
            "rad/s",
            spring,
            0.01,
            Depends::copy("state.motorVelocity"),
            "motor angles of the flexible joints, q_mi",
        ));
    }
    states.push(("baseVelocity", "m/s", "m/s2", XY, 0.001, Depends::All, "satellite's velocity (eq. 9)"));
    states.push(("baseRate", "rad/s", "rad/s2", ONE, 0.001, Depends::All, "satellite's rate (eq. 9)"));
    states.push((
        "jointVelocity",
        "rad/s",
        "rad/s2",
        joints,
        0.001,
        Depends::All,
        "joint velocities (eq. 9)",
    ));
    if flexible_joints[0] > 0 {
        states.push((
            "motorVelocity",
            "rad/s",
            "rad/s2",
            spring,
            0.001,
            Depends::All,
            "motor velocities of the flexible joints (eq. 9)",
        ));
    }
    b.states(&states);
}

/// What a controller is wired to.
pub(crate) fn drive(b: &mut Builder) {
    b.terminal(
        "drive",
        "What a manipulator controller is wired to",
        &["jointTorque", "motorAngle", "motorVelocity", "jointAngle", "jointVelocity"],
    );
}
