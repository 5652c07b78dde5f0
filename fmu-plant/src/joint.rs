//! The variable table of `TwoMassJoint`.

use crate::builder::Builder;
use crate::experiment::TOLERANCE;
use trueup_fmi::table::Factor::{Constant, Fixed, Tunable};
use trueup_fmi::table::{Depends, Experiment, Factor, Kind, ModelTable};
use trueup_models::effect::Plant;
use trueup_models::joint::{TwoMassJoint, parameter as p};
use trueup_models::presets;
use trueup_numerics::hybrid::Hybrid;

/// The table of a joint of that structure; start values: DELIAN's joint 1. `gear_ratio` is the one packed, if
/// it is another, for the nominal values.
pub(crate) fn table(model: &TwoMassJoint, gear_ratio: Option<f64>) -> ModelTable {
    let delian = presets::delian(1).unwrap_or_default();
    let experiment = Experiment { stop_time: 2.0, tolerance: TOLERANCE, step_size: 1e-3 };
    let mut b = Builder::new(
        "TwoMassJoint",
        "Two-mass flexible joint with stick-slip friction (Comi et al., DELIAN, section 3.2)",
        experiment,
    );
    let no: &[usize] = &[];
    // Linear without effects; with one, it is what it would be with any.
    let plain = model.effects().iter().next().is_none();
    let linear = |terms: &[(&str, Factor)], with_effects: Depends| {
        if plain { Depends::linear(terms) } else { with_effects }
    };
    let flexible = model.flexible();

    b.constant("jointFlexible", Kind::Boolean, no, &[f64::from(flexible)], "The joint has its spring; false: one rigid geared mass, motorAngle = n loadAngle (fixed when packed)");

    b.tunable(
        "motorInertia",
        "kg.m2",
        no,
        &[delian[p::MOTOR_INERTIA]],
        "Motor with planetary stage, J_motor (TMJ-1)",
    )
    .bounded_above(0.0);
    b.tunable(
        "loadInertia",
        "kg.m2",
        no,
        &[delian[p::LOAD_INERTIA]],
        "Load, load side, J_load (TMJ-3); with a flexible link its hub",
    )
    .bounded_above(0.0);
    b.fixed("gearRatio", "1", no, &[delian[p::GEAR_RATIO]], "Motor turns per load turn, n_eq (TMJ-2)")
        .bounded_above(0.0);
    b.tunable(
        "torqueConstant",
        "N.m/A",
        no,
        &[delian[p::TORQUE_CONSTANT]],
        "Motor torque per current, K_t (TMJ-1)",
    );
    let spring = if flexible { "" } else { " (unused: the joint is rigid)" };
    let stiffness = b.tunable(
        "stiffness",
        "N.m/rad",
        no,
        &[delian[p::STIFFNESS]],
        &format!("Transmission, motor side, K_eq (TMJ-2){spring}"),
    );
    stiffness.min = Some(0.0);
    stiffness.exclusive = flexible;
    b.tunable(
        "damping",
        "N.m.s/rad",
        no,
        &[delian[p::DAMPING]],
        &format!("Transmission, motor side, D_eq (TMJ-2){spring}"),
    )
    .bounded(0.0);
    b.tunable("coulombFriction", "N.m", no, &[delian[p::COULOMB_FRICTION]], "At the motor, tau_c (TMJ-4)")
        .bounded(0.0);
    b.tunable(
        "staticFriction",
        "N.m",
        no,
        &[delian[p::STATIC_FRICTION]],
        "Break-away level at the motor, tau_s (TMJ-4); taken as tau_c where it is below",
    )
    .bounded(0.0);
    b.tunable(
        "viscousFriction",
        "N.m.s/rad",
        no,
        &[delian[p::VISCOUS_FRICTION]],
        "At the motor, D_m (TMJ-4)",
    )
    .bounded(0.0);
    let unused = if flexible { "" } else { " (unused: the joint is rigid, the load follows the motor)" };
    b.fixed("initialMotorAngle", "rad", no, &[0.0], "q_m at the start");
    b.fixed("initialMotorVelocity", "rad/s", no, &[0.0], "d(q_m)/dt at the start");
    b.fixed("initialLoadAngle", "rad", no, &[0.0], &format!("q_l at the start{unused}"));
    b.fixed("initialLoadVelocity", "rad/s", no, &[0.0], &format!("d(q_l)/dt at the start{unused}"));

    b.input("motorCurrent", "A", no, "Motor current, I (TMJ-1); positive drives the motor forward");
    b.input(
        "externalTorque",
        "N.m",
        no,
        "Torque on the load, tau_ext (TMJ-3); positive drives the load forward",
    );

    let on = |names: &[&str]| Depends::On(names.iter().map(|s| (*s).to_owned()).collect());
    let (angle, velocity) = ("state.motorAngle", "state.motorVelocity");
    let (twist, load) = ("state.twist", "state.loadVelocity");
    let (load_angle, load_velocity) = if flexible {
        (
            linear(&[(angle, Fixed), (twist, Fixed)], on(&[angle, twist])),
            linear(&[(load, Constant)], on(&[load])),
        )
    } else {
        (linear(&[(angle, Fixed)], on(&[angle])), linear(&[(velocity, Fixed)], on(&[velocity])))
    };
    let spring = [(twist, Tunable), (velocity, Tunable), (load, Tunable)];
    let pushed = [&spring[..], &[("externalTorque", Tunable)]].concat();
    let load_acceleration = if flexible { linear(&pushed, Depends::All) } else { Depends::All };
    let transmission = if flexible { linear(&spring, Depends::StatesAnd(Vec::new())) } else { Depends::All };
    b.output("motorAngle", "rad", no, Depends::copy(angle), "Motor angle, q_m");
    b.output("motorVelocity", "rad/s", no, Depends::copy(velocity), "Motor velocity, d(q_m)/dt");
    b.output("motorAcceleration", "rad/s2", no, Depends::All, "Motor acceleration, dd(q_m)/dt2 (TMJ-1)");
    b.output("loadAngle", "rad", no, load_angle, "Load angle, q_l");
    b.output("loadVelocity", "rad/s", no, load_velocity, "Load velocity, d(q_l)/dt");
    b.output("loadAcceleration", "rad/s2", no, load_acceleration, "Load acceleration, dd(q_l)/dt2 (TMJ-3)");
    b.output(
        "motorTorque",
        "N.m",
        no,
        linear(&[("motorCurrent", Tunable)], Depends::StatesAnd(vec!["motorCurrent".into()])),
        "Torque of the motor, K_t I (TMJ-1)",
    );
    b.output(
        "transmissionTorque",
        "N.m",
        no,
        transmission,
        "Motor side, tau_lm (TMJ-2); positive drives the load forward",
    );
    b.output(
        "frictionTorque",
        "N.m",
        no,
        Depends::All,
        "At the motor, tau_fr (TMJ-4); positive against forward motion",
    );
    b.flag("sticking", no, "The motor sticks (TMJ-4)");

    // What a solver should resolve, not what the joint reaches: tolerances are relative to it near zero.
    let n = gear_ratio.unwrap_or(delian[p::GEAR_RATIO]);
    let mut states = vec![
        ("motorAngle", "rad", "rad/s", no, 0.1, Depends::copy(velocity), "motor angle, q_m"),
        ("motorVelocity", "rad/s", "rad/s2", no, 1.0, Depends::All, "motor velocity, d(q_m)/dt (TMJ-1)"),
    ];
    if flexible {
        let pushed = linear(&pushed, Depends::StatesAnd(vec!["externalTorque".into()]));
        let turning = linear(&[(velocity, Constant), (load, Fixed)], on(&[velocity, load]));
        states.push(("twist", "rad", "rad/s", no, 0.01, turning, "twist, motor side, epsilon = q_m - n q_l"));
        states.push((
            "loadVelocity",
            "rad/s",
            "rad/s2",
            no,
            1.0 / n,
            pushed,
            "load velocity, d(q_l)/dt (TMJ-3)",
        ));
    }
    b.states(&states);
    b.effects(model.effects(), Plant::Joint);
    b.terminal(
        "drive",
        "What a joint controller is wired to",
        &["motorCurrent", "motorAngle", "motorVelocity", "loadAngle", "loadVelocity"],
    );
    b.terminal("load", "What acts on the load", &["externalTorque", "loadAngle", "loadVelocity"]);
    b.finish(model.sizes().indicators)
}
