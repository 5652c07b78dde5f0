//! A current that is recorded in another unit or with the opposite sign, and gaps that are none of that.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use crate::made::Joint;
use trueup_diagnosis::diagnose::input_scale::mistaken;
use trueup_diagnosis::engine::recordings::Prepared;
use trueup_diagnosis::engine::search::Search;
use trueup_diagnosis::outcome::{Noticed, Severity};

/// Of a joint whose spring gives way by `slack` to both sides, N.m/rad by that deflection; 0: nothing is missing.
fn found(current_gain: f64, slack: f64) -> Vec<Noticed> {
    let j = Joint { current_gain, ..Joint::default() };
    let loaded = j.recorded(|current, [q, w, l, v]| {
        let twist = q - l;
        let spring = j.stiffness * (twist - twist.clamp(-slack, slack)) + j.damping * (w - v);
        let drive = j.torque_constant * current - j.coulomb * (w / 0.05).tanh() - j.viscous * w;
        [*w, (drive - spring) / j.motor_inertia, *v, spring / j.reflected()]
    });
    let case = Prepared::new(&loaded).unwrap();
    mistaken(&Search::new(&case, 1).unwrap())
}

#[test]
fn a_current_in_another_unit_or_turned_is_told() {
    let (milli, turned) = ("thousandths were taken", "opposite sign");
    for (gain, slack, said) in [
        (1e3, 0.0, milli),
        (1e3, 0.1, milli),
        (1e3, 0.3, milli),
        (1e3, 2.0, milli),
        (1e-3, 0.0, "units were taken"),
        (1e-3, 0.1, "units were taken"),
        (1e-3, 0.3, "units were taken"),
        (-1.0, 0.0, turned),
        (-1.0, 0.1, turned),
    ] {
        let all = found(gain, slack);
        let [told] = &all[..] else { panic!("times {gain}, slack {slack}: {all:?}") };
        println!("times {gain}, slack {slack}: {}", told.text);
        assert_eq!((told.severity, told.channel.as_deref()), (Severity::Grave, Some("motorCurrent")));
        assert!(told.text.contains(said), "{}", told.text);
    }
}

#[test]
fn what_is_missing_is_no_unit() {
    for slack in [0.0, 0.3, 2.0] {
        assert_eq!(found(1.0, slack), [], "slack {slack}");
    }
    // A motor that is a third weaker than its owner believes has no other unit.
    assert_eq!(found(1.5, 0.3), []);
}
