//! Plant and controller together.

use super::{Controlled, RunSample, run};
use crate::space::flyer::Flyer;
use trueup_models::space::design::RobotDesign;
use trueup_models::space::presets;

/// Bent, away from singularities.
pub(super) const BENT: [f64; 6] = [0.3, -0.8, 1.4, 0.2, -0.9, 0.3];

/// A speed that begins and ends smoothly: its integral over 0 .. `stop` is 1.
pub(super) fn pace(t: f64, stop: f64) -> f64 {
    let s = (t / stop).clamp(0.0, 1.0);
    30.0 * s * s * (1.0 - s) * (1.0 - s) / stop
}

/// The hand goes by `way` (m, inertial axes) in 10 s without turning, and 2 s pass.
fn straight(
    design: &RobotDesign,
    control_base: f64,
    angles: &[f64],
    way: [f64; 3],
) -> (Flyer, Controlled, Vec<RunSample>) {
    let (mut plant, mut control) = (Flyer::of(design), Controlled::of(design));
    plant.start(plant.parameter.initial_joint_angle, angles);
    control.p[control.own.base_control] = control_base;
    let at = control.input.tip_velocity_reference;
    let rows = run(&mut plant, &mut control, (12.0, 0.01), |t, u| {
        (0..3).for_each(|i| u[at + i] = way[i] * pace(t, 10.0));
    });
    (plant, control, rows)
}

/// Largest distance of the hand from the line that it is to follow, m, and from its end.
pub(super) fn off(plant: &Flyer, rows: &[RunSample], way: [f64; 3]) -> (f64, f64) {
    let at = plant.output.tip_position;
    let tip = |row: &RunSample| [0, 1, 2].map(|i| row.1[at + i]);
    let begin = tip(&rows[0]);
    let length = way.iter().map(|w| w * w).sum::<f64>().sqrt();
    let mut worst: f64 = 0.0;
    for row in rows {
        let moved = [0, 1, 2].map(|i| tip(row)[i] - begin[i]);
        let along: f64 = (0..3).map(|i| moved[i] * way[i] / length).sum();
        let across: f64 = (0..3).map(|i| (moved[i] - along * way[i] / length).powi(2)).sum::<f64>().sqrt();
        worst = worst.max(across);
    }
    let end = tip(&rows[rows.len() - 1]);
    let missed = (0..3).map(|i| (end[i] - begin[i] - way[i]).powi(2)).sum::<f64>().sqrt();
    (worst, missed)
}

/// Checks CTS-2: the generalized Jacobian leads the hand of a free base along a straight line, the arm's alone does not.
#[test]
fn the_hand_goes_straight_on_a_free_base() {
    let way = [-0.3, 0.6, -0.4];
    let design = presets::chaser();
    let (plant, _, rows) = straight(&design, 1.0, &BENT, way);
    let (across, missed) = off(&plant, &rows, way);
    let (_, _, alone) = straight(&design, 4.0, &BENT, way);
    let (across_alone, missed_alone) = off(&plant, &alone, way);
    println!(
        "free: {across:.2e} m off the line, {missed:.2e} m off its end; J_M: {across_alone:.3}, {missed_alone:.3}"
    );
    assert!(across < 1e-3 && missed < 1e-3, "{across} {missed}");
    assert!(across_alone > 0.01 && missed_alone > 0.03, "{across_alone} {missed_alone}");
    for (begin, what) in [(plant.output.linear_momentum, "P"), (plant.output.angular_momentum, "L")] {
        let most = rows.iter().flat_map(|r| r.1[begin..][..3].to_vec()).fold(0.0_f64, |m, v| m.max(v.abs()));
        println!("{what}: {most:.1e}");
        assert!(most < 1e-9, "{what} {most}");
    }
}

/// Checks CTS-3: with wheels that hold the base's attitude the hand goes straight, too, and the base does not turn.
#[test]
fn wheels_hold_the_attitude_while_the_hand_goes_straight() {
    let way = [-0.3, 0.6, -0.4];
    let (plant, _, rows) = straight(&presets::chaser(), 2.0, &BENT, way);
    let (across, missed) = off(&plant, &rows, way);
    let turned = rows
        .iter()
        .map(|r| 2.0 * r.1[plant.output.base_quaternion + 1..][..3].iter().map(|v| v * v).sum::<f64>().sqrt())
        .fold(0.0, f64::max);
    println!("attitude: {across:.2e} m off, {missed:.2e} m off the end, turned by {turned:.1e} rad");
    assert!(across < 1e-3 && missed < 1e-3 && turned < 1e-4, "{across} {missed} {turned}");
}

/// Checks CTS-6: pulled beyond its reach, the arm keeps bounded rates; the table that chose the default.
#[test]
fn a_singularity_is_crossed_with_bounded_rates() {
    let design = presets::chaser();
    // Nearly stretched: the hand is pulled outwards by more than the arm is long.
    let angles = [0.0, -0.15, 0.3, 0.1, 0.3, 0.0];
    let mut most = Vec::new();
    println!(
        "sigma_0 = lambda_0, largest rate (rad/s), largest velocity given up (m/s), farthest from the line (m)"
    );
    for setting in [0.02, 0.05, 0.1, 0.2] {
        let (mut plant, mut control) = (Flyer::of(&design), Controlled::of(&design));
        plant.start(plant.parameter.initial_joint_angle, &angles);
        (control.p[control.own.threshold], control.p[control.own.damping]) = (setting, setting);
        control.p[control.own.rate_limit..][..6].fill(1e9);
        let at = control.input.tip_velocity_reference;
        let rows = run(&mut plant, &mut control, (12.0, 0.01), |t, u| u[at] = 0.5 * pace(t, 10.0));
        let rate = |r: &RunSample| {
            r.2[control.output.joint_velocity_command..][..6].iter().map(|v| v * v).sum::<f64>().sqrt()
        };
        let given_up = |r: &RunSample| {
            r.2[control.output.tip_velocity_error..][..3].iter().map(|v| v * v).sum::<f64>().sqrt()
        };
        let largest = |of: &dyn Fn(&RunSample) -> f64| rows.iter().map(of).fold(0.0, f64::max);
        let (across, _) = off(&plant, &rows, [0.5, 0.0, 0.0]);
        println!("{setting} {:.3} {:.3} {across:.4}", largest(&rate), largest(&given_up));
        assert!(rows.iter().all(|r| r.1.iter().chain(&r.2).all(|v| v.is_finite())));
        let damped = rows.iter().filter(|r| r.2[control.output.damping_used] > 0.0).count();
        assert!(damped > 100, "{damped}");
        // s / (s^2 + (1 - s^2)^2) is 1.066 at most: that over sigma_0, times the hand's largest speed of 0.094 m/s.
        assert!(largest(&rate) < 1.07 * 0.094 / setting, "{setting} {}", largest(&rate));
        most.push(largest(&rate));
    }
    assert!(most.windows(2).all(|w| w[1] < w[0]), "{most:?}");
}

/// Checks CTS-9: a joint that cannot follow does not remember what it missed.
#[test]
fn an_integral_does_not_wind_up_at_the_limit() {
    let design = presets::chaser();
    let (mut plant, mut control) = (Flyer::of(&design), Controlled::of(&design));
    plant.start(plant.parameter.initial_joint_angle, &BENT);
    control.p[control.own.task_weight..][..6].fill(0.0);
    control.p[control.own.torque_limit] = 2.0;
    let at = control.input.joint_velocity_reference;
    let rows = run(&mut plant, &mut control, (8.0, 0.01), |t, u| u[at] = if t < 2.0 { 0.3 } else { 0.0 });
    let torque = |r: &RunSample| r.2[control.output.joint_torque];
    let rate = |r: &RunSample| r.1[plant.output.joint_velocity];
    assert!(rows.iter().all(|r| torque(r).abs() <= 2.0));
    let (at_limit, reached) = (rows.iter().filter(|r| torque(r) == 2.0).count(), rate(&rows[200]));
    let (back, after) = (rows[200..].iter().map(rate).fold(f64::MAX, f64::min), rate(&rows[rows.len() - 1]));
    println!(
        "{at_limit} samples at the limit, {reached:.4} rad/s then, back by {back:.1e}, {after:.1e} at the end"
    );
    assert!(at_limit > 150 && reached < 0.29, "{at_limit} {reached}");
    assert!(back > -0.1 * reached && after.abs() < 1e-3 * reached, "{back} {after}");
}

/// Checks CTS-12: the hand of a floating base goes straight, a second arm keeps the base from turning; the same motion by the
/// generalized Jacobian turns it.
#[test]
fn a_reactionless_hand_leaves_the_attitude_alone() {
    let way = [-0.3, 0.2, 0.3];
    let mut design = presets::chaser();
    // A second arm on the other side, turned about y by half a turn: what it moves is opposite to what the first one moves.
    for mut link in design.links.clone() {
        link.name = format!("second {}", link.name);
        link.parent = if link.parent == 0 { 0 } else { link.parent + 6 };
        if link.parent == 0 {
            link.position = link.position.map(|v| -v);
            link.orientation = [0.0, 0.0, 1.0, 0.0];
        }
        design.links.push(link);
    }
    let mut turned = Vec::new();
    for base in [1.0, 5.0] {
        let (mut plant, mut control) = (Flyer::of(&design), Controlled::of(&design));
        plant.start(
            plant.parameter.initial_joint_angle,
            &[[0.0; 1].as_slice(), &BENT[1..], &[0.0], &BENT[1..]].concat(),
        );
        control.p[control.own.base_control] = base;
        control.p[control.own.task_weight + 3..][..3].fill(0.0);
        let at = control.input.tip_velocity_reference;
        let rows = run(&mut plant, &mut control, (12.0, 0.01), |t, u| {
            (0..3).for_each(|i| u[at + i] = way[i] * pace(t, 10.0));
        });
        let (across, missed) = off(&plant, &rows, way);
        let sigma = rows.iter().map(|r| r.2[control.output.smallest_singular_value]).fold(9.0, f64::min);
        let angle = largest_turn(&plant, &rows);
        println!(
            "{base}: {across:.1e} m off the line, {missed:.1e} m off its end, turned by {angle:.1e} rad, singular value {sigma:.3} at least"
        );
        assert!(across < 1e-3 && missed < 1e-3, "{across} {missed}");
        turned.push(angle);
    }
    assert!(turned[1] < 1e-2 * turned[0], "{turned:?}");
}

/// Largest angle by which the base was turned, rad.
pub(super) fn largest_turn(plant: &Flyer, rows: &[RunSample]) -> f64 {
    let sine = |r: &RunSample| {
        r.1[plant.output.base_quaternion + 1..][..3].iter().map(|v| v * v).sum::<f64>().sqrt()
    };
    rows.iter().map(|r| 2.0 * sine(r).asin()).fold(0.0, f64::max)
}
