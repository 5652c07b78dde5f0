//! The joint against exact solutions.

use super::plant::TrialJoint;
use super::run::{JointRun, replay};
use super::values::JointValues;

const V: JointValues = JointValues {
    motor_inertia: 2e-5,
    load_inertia: 0.5,
    gear_ratio: 100.0,
    torque_constant: 0.05,
    stiffness: 0.05,
    damping: 0.0,
    coulomb: 0.0,
    viscous: 0.0,
};

#[test]
fn a_free_joint_swings_at_its_exact_frequency_and_keeps_its_momentum() {
    let (j, l) = (V.motor_inertia, V.load_inertia / 1e4);
    let w = (V.stiffness * (1.0 / j + 1.0 / l)).sqrt();
    let mut x = [0.0; 12];
    (x[0], x[1]) = (0.3, 7.0);
    let time: Vec<f64> = (0..=2000).map(|i| f64::from(i) * 1e-3).collect();
    let track = replay(TrialJoint::new(V, false, Vec::new(), 2.0), x, &time, &vec![0.0; 2001], 2e-4);
    // Motor and load (motor side): the mean moves straight, the difference swings.
    let mean = |t: f64| (j * 0.3 + j * 7.0 * t) / (j + l);
    let apart = |t: f64| 0.3 * (w * t).cos() + 7.0 / w * (w * t).sin();
    for t in [0.5, 1.3, 2.0] {
        let exact = mean(t) + l / (j + l) * apart(t);
        assert!((track.at(t, 0) - exact).abs() < 1e-7, "{} {exact}", track.at(t, 0));
    }
}

#[test]
fn dry_friction_stops_a_rigid_motor_at_the_exact_time_and_holds_it() {
    let v = JointValues { coulomb: 4e-3, ..V };
    let total = v.motor_inertia + v.load_inertia / 1e4;
    let mut x = [0.0; 12];
    (x[1], x[3]) = (20.0, 0.2);
    let mut run = JointRun::new(TrialJoint::new(v, true, Vec::new(), 1.0), 0.0, x, 2e-4);
    run.hold(1.0, 0.0);
    // omega^2 J / (2 tau_c), then nothing moves; 90 % of the break-away torque moves nothing either.
    let exact = 20.0 * 20.0 * total / (2.0 * 4e-3);
    assert!((run.state[0] - exact).abs() < 1e-9 * exact, "{} {exact}", run.state[0]);
    assert_eq!(run.state[1], 0.0);
    run.hold(2.0, 0.9 * 4e-3 / v.torque_constant);
    assert!((run.state[0] - exact).abs() < 1e-9 * exact);
    // 1.5 times of it accelerates by the excess.
    run.hold(2.5, 1.5 * 4e-3 / v.torque_constant);
    let way = 0.5 * (0.5 * 4e-3 / total) * 0.25;
    assert!((run.state[0] - exact - way).abs() < 1e-6 * way, "{}", run.state[0] - exact);
}

#[test]
fn viscous_friction_under_steady_current_ends_at_the_exact_speed() {
    let v = JointValues { coulomb: 1e-3, viscous: 1e-4, damping: 1e-4, ..V };
    let mut run = JointRun::new(TrialJoint::new(v, false, Vec::new(), 1.0), 0.0, [0.0; 12], 2e-4);
    run.hold(20.0, 0.1);
    let exact = (0.1 * v.torque_constant - 1e-3) / 1e-4;
    assert!((run.state[1] - exact).abs() < 1e-3 * exact, "{} {exact}", run.state[1]);
    assert!((run.state[3] * 100.0 - exact).abs() < 1e-3 * exact);
}
