//! Thrusters that turn the base by pulses.

use super::loops::{BENT, largest_turn, off, pace};
use super::{Controlled, RunSample, run};
use crate::space::flyer::Flyer;
use trueup_models::space::presets;

/// Checks CTS-10 and CTS-11: thrusters hold the attitude while the hand moves, twelve of them alone or eight with a wheel about the
/// axis that those leave; each pulse is its smallest impulse at least, and what is used is the impulse over what a specific impulse
/// gives; the table of what that costs.
#[test]
fn thrusters_hold_the_attitude_by_pulses() {
    hold_by_pulses(&[(12, 0.0, 0.1), (8, 1.0, 0.5)]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn thrusters_hold_the_attitude_the_worse_the_larger_the_smallest_impulse() {
    let worst = hold_by_pulses(&[
        (12, 0.0, 0.1),
        (12, 0.0, 0.5),
        (12, 0.0, 2.0),
        (8, 1.0, 0.1),
        (8, 1.0, 0.5),
        (8, 1.0, 2.0),
    ]);
    assert!(worst[0] < worst[1] && worst[1] < worst[2], "{worst:?}");
}

/// How far the base turns at most, with so many thrusters, with wheels or without, with this smallest impulse in N.s.
fn hold_by_pulses(cases: &[(usize, f64, f64)]) -> Vec<f64> {
    let way = [-0.3, 0.6, -0.4];
    println!(
        "thrusters, smallest impulse (N.s), turned by (rad), off the line (m), pulses, impulse (N.s), propellant (kg)"
    );
    let mut worst = Vec::new();
    for &(count, wheel, least) in cases {
        let mut design = presets::chaser();
        // Eight turn about x and z.
        design.thrusters.truncate(count);
        let (mut plant, mut control) = (Flyer::of(&design), Controlled::of(&design));
        let (own, period) = (control.own, 0.01);
        plant.start(plant.parameter.initial_joint_angle, &BENT);
        control.p[own.base_control] = 2.0;
        control.p[own.base_actuator] = 2.0;
        control.p[own.wheel_axis + 1] = wheel;
        control.p[own.least_impulse..][..count].fill(least);
        let at = control.input.tip_velocity_reference;
        let rows = run(&mut plant, &mut control, (12.0, period), |t, u| {
            (0..3).for_each(|i| u[at + i] = way[i] * pace(t, 10.0));
        });
        let turned = largest_turn(&plant, &rows);
        let (across, _) = off(&plant, &rows, way);
        let force = |row: &RunSample, k: usize| row.2[control.output.thruster_force + k];
        let (mut pulses, mut impulse) = (0.0, 0.0);
        // The last row is not run any more.
        let (last, before) = (&rows[rows.len() - 1], &rows[..rows.len() - 1]);
        for k in 0..count {
            let level = control.p[own.thruster_level + k];
            let (mut length, mut own_pulses) = (0.0, 0.0);
            for row in before {
                let now = force(row, k);
                assert!(now == 0.0 || now == level, "{now}");
                if now == 0.0 && length > 0.0 {
                    assert!(length * level >= least * (1.0 - 1e-9), "{length} s at {least} N.s");
                    length = 0.0;
                }
                if now > 0.0 {
                    own_pulses += f64::from(u8::from(length == 0.0));
                    length += period;
                    impulse += level * period;
                }
            }
            assert_eq!(own_pulses, last.2[control.output.thruster_pulses + k], "{count} {least}: {k}");
            pulses += own_pulses;
        }
        let propellant = last.2[control.output.propellant];
        println!("{count} {least} {turned:.1e} {across:.1e} {pulses} {impulse:.1} {propellant:.4}");
        assert!((propellant - impulse / (220.0 * 9.806_65)).abs() < 1e-12, "{propellant} {impulse}");
        let torque: Vec<_> = before.iter().map(|r| &r.2[control.output.base_torque..][..3]).collect();
        assert_eq!(torque.iter().any(|t| t.iter().any(|v| *v != 0.0)), wheel > 0.0);
        assert!(pulses > 3.0 && turned < 5e-3 && across < 0.01, "{pulses} {turned} {across}");
        worst.push(turned);
    }
    worst
}
