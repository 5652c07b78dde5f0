//! Whole searches of the innovations engine on short recordings of made joints.

use trueup_estimation::innovations::joint_frame::joint_frame;
use trueup_estimation::innovations::two_mass::parameter;
use trueup_hypotheses::innovations::candidate::applied;
use trueup_hypotheses::innovations::joint_along::UsualSizes;
use trueup_hypotheses::innovations::laws::law_of;
use trueup_hypotheses::innovations::search::{JointFindings, search_joint};
use trueup_hypotheses::innovations::shape::LawShape;
use trueup_hypotheses::innovations::verdict::{EvidenceJudgement, EvidenceVerdict, judge};
use trueup_signals::{Channel, KnownEffect, Loaded, ParameterValue, PriorGuess};

use crate::made::{MadeJoint, Sampling};

fn told(name: &str, made: &MadeJoint<'_>) -> (JointFindings, EvidenceJudgement) {
    let found = search_joint(&made.case()).unwrap();
    let judged = judge(&found).unwrap();
    let effects: Vec<String> = found
        .effects
        .iter()
        .take(3)
        .map(|h| format!("{} {:+.1}", h.id, h.evidence - found.null.evidence))
        .collect();
    println!("{name}, seed {}: {:?} {:?}, {effects:?}", made.seed, judged.verdict, judged.set);
    (found, judged)
}

/// The whole way on two seconds of record: nothing is named where nothing lacks, and what lacks where it does.
#[test]
fn a_search_of_two_seconds_names_what_lacks_and_nothing_else() {
    let short = MadeJoint { seed: 11, recordings: (1, 500), ..MadeJoint::default() };
    let (_, judged) = told("nothing", &short);
    assert_eq!(judged.verdict, EvidenceVerdict::NoGap);
    let ripple: &[(&str, &[f64])] = &[("torque-ripple", &[1.5e-3, 1e-3, 2.0, 0.0, 0.0])];
    let (found, judged) = told("ripple", &MadeJoint { effects: ripple, ..short });
    assert_eq!(
        (judged.verdict, &judged.set[..]),
        (EvidenceVerdict::Effects, &[("torque-ripple", "actuator".to_owned())][..])
    );
    let order = found.effects[0].shape.value("h");
    assert!((order - 2.0).abs() < 0.02, "{order}");
}

/// A refit may end at a damping below 0: a law of the spring is put in force all the same.
#[test]
fn a_damping_below_zero_ends_no_search() {
    let made = MadeJoint { seed: 12, recordings: (1, 200), ..MadeJoint::default() };
    let (mut f, _) = joint_frame(&made.case()).unwrap();
    f.settle(true);
    let sizes = UsualSizes::of(&f);
    let law = law_of("nonlinear-stiffness").unwrap();
    let laws = applied(&[(law, LawShape::new("transmission", "power", &[]))], &f, &sizes);
    for k in [parameter::DAMPING, parameter::STIFFNESS] {
        let kept = f.theta[k];
        f.theta[k] = -kept;
        let q = f.q.clone();
        f.put_in_force(&laws, &[0.3, 0.1], &[0.0], &q);
        f.theta[k] = kept;
    }
}

/// Cogging: an order far above those of a gear, on a motor so slow that its readings show it.
#[test]
fn a_ripple_of_order_sixty_has_its_order() {
    let ripple: &[(&str, &[f64])] = &[("torque-ripple", &[3e-3, 2e-3, 60.0, 0.0, 0.0])];
    let slow =
        MadeJoint { seed: 12, recordings: (1, 1000), rate: 500.0, viscous: 6e-4, ..MadeJoint::default() };
    let (found, judged) = told("ripple of order 60", &MadeJoint { effects: ripple, ..slow });
    assert_eq!(
        (judged.verdict, &judged.set[..]),
        (EvidenceVerdict::Effects, &[("torque-ripple", "actuator".to_owned())][..])
    );
    let order = found.effects[0].shape.value("h");
    assert!((order - 60.0).abs() < 0.1, "{order}");
}

/// What the recordings cannot distinguish is ambiguous, and no more than that: a late drive with a late reading of the only angle, dry
/// friction of two bodies that are one, a slow force that one law has as well as another.
#[test]
fn what_recordings_do_not_distinguish_is_ambiguous() {
    let late: &[(&str, &[f64])] = &[("actuator-lag", &[0.0, 8e-3])];
    let asymmetric: &[(&str, &[f64])] = &[("asymmetric-friction", &[1e-4, 0.0])];
    let none = ParameterValue::Number(0.0);
    let frictionless = [("coulombFriction", none.clone()), ("staticFriction", none)];
    let angle = &["motorCurrent", "motorAngle"];
    let made = || MadeJoint { seed: 13, recordings: (1, 500), ..MadeJoint::default() };
    let all = [
        (["actuator-lag", "sensor-delay"], MadeJoint { effects: late, channels: angle, ..made() }),
        (
            ["motor-friction", "load-friction"],
            MadeJoint { flexible: false, believed: &frictionless, channels: angle, ..made() },
        ),
        (
            ["asymmetric-friction", "gravity-torque"],
            MadeJoint { effects: asymmetric, channels: angle, ..made() },
        ),
    ];
    for (ids, made) in all {
        let (_, judged) = told(ids[0], &made);
        assert_eq!(judged.verdict, EvidenceVerdict::Ambiguous, "{ids:?}");
        assert!(ids.iter().all(|id| judged.set.iter().any(|s| s.0 == *id)), "{ids:?}: {:?}", judged.set);
    }
    // With the load's angle too the drive is late, and nothing else.
    let (_, judged) = told("both angles", &MadeJoint { effects: late, ..made() });
    assert_eq!(
        (judged.verdict, &judged.set[..]),
        (EvidenceVerdict::Effects, &[("actuator-lag", "actuator".to_owned())][..])
    );
}

/// What the engine has no words for is refused at once, with a word for it.
#[test]
fn what_the_engine_lacks_words_for_is_refused_by_name() {
    type Change = fn(&mut Loaded);
    let changes: [(&str, Change); 5] = [
        ("PlanarManipulator", |l| l.case.model = "PlanarManipulator".into()),
        ("as a spring does", |l| {
            let id = "transmission-hysteresis".into();
            l.case.effects.push(KnownEffect { id, joint: None, given: Vec::new() });
        }),
        ("of other channels", |l| {
            let first = l.recordings.values_mut().next().unwrap();
            let mut torque = Channel { name: "transmissionTorque".into(), ..first.channels[0].clone() };
            torque.sensor.late = Some(PriorGuess { value: 0.0, doubt: None });
            first.channels.push(torque);
        }),
        ("single recordings", |l| {
            let first = l.recordings.values_mut().next().unwrap();
            first.parameters.insert("gearRatio".into(), ParameterValue::Number(100.0));
        }),
        ("motorInertia", |l| {
            l.case.parameters.insert("motorInertia".into(), ParameterValue::Number(0.0));
        }),
    ];
    let case = MadeJoint { recordings: (1, 100), ..MadeJoint::default() }.case();
    assert!(joint_frame(&case).is_ok());
    let refused = |what: &str, l: &Loaded| {
        let why = joint_frame(l).err().map(|e| e.to_string());
        assert!(why.as_ref().is_some_and(|w| w.contains(what)), "{what}: {why:?}");
    };
    for (what, change) in changes {
        let mut own = case.clone();
        change(&mut own);
        refused(what, &own);
    }
    // Where a recording begins is estimated.
    let mut begins = case.clone();
    let first = begins.recordings.values_mut().next().unwrap();
    first.parameters.insert("initialMotorAngle".into(), ParameterValue::Number(0.0));
    assert!(joint_frame(&begins).is_ok());
}

/// One sensor only, a rigid joint, a torque on the load that is recorded: no false cause where nothing lacks.
#[test]
#[ignore = "ten searches: ./test --full runs it"]
fn nothing_is_named_on_joints_of_other_structures() {
    let external: &[&str] = &["motorCurrent", "externalTorque", "motorAngle", "loadAngle"];
    for seed in 21..23 {
        let made = || MadeJoint { seed, ..MadeJoint::default() };
        let all = [
            ("motor angle only", MadeJoint { channels: &["motorCurrent", "motorAngle"], ..made() }),
            ("load angle only", MadeJoint { channels: &["motorCurrent", "loadAngle"], ..made() }),
            ("rigid", MadeJoint { flexible: false, ..made() }),
            (
                "rigid, motor angle only",
                MadeJoint { flexible: false, channels: &["motorCurrent", "motorAngle"], ..made() },
            ),
            ("external torque", MadeJoint { external: 0.5, channels: external, ..made() }),
        ];
        for (name, made) in all {
            let (_, judged) = told(name, &made);
            assert_eq!(judged.verdict, EvidenceVerdict::NoGap, "{name}, seed {seed}");
        }
    }
}

/// Dry friction and the spring of a joint whose nominal model has none lead in frames of their own.
#[test]
#[ignore = "four searches: ./test --full runs it"]
fn what_a_joint_has_for_the_first_time_leads() {
    for seed in 31..33 {
        let made = || MadeJoint { seed, ..MadeJoint::default() };
        let none = ParameterValue::Number(0.0);
        let frictionless = [("coulombFriction", none.clone()), ("staticFriction", none)];
        let rigid = [("jointFlexible", ParameterValue::Boolean(false))];
        let all = [
            ("motor-friction", MadeJoint { believed: &frictionless, ..made() }),
            ("joint-flexibility", MadeJoint { believed: &rigid, ..made() }),
        ];
        for (id, made) in all {
            let (found, judged) = told(id, &made);
            assert_eq!(found.effects[0].id, id, "seed {seed}");
            assert_eq!(judged.verdict, EvidenceVerdict::Effects, "seed {seed}");
        }
    }
}

/// Lost readings, uneven ones, a coarse clock, slow and fast sampling: no false cause where nothing lacks, and the cause where one does.
#[test]
#[ignore = "ten searches: ./test --full runs it"]
fn readings_at_any_times_name_what_lacks_and_nothing_else() {
    let ripple: &[(&str, &[f64])] = &[("torque-ripple", &[1.5e-3, 1e-3, 2.0, 0.0, 0.0])];
    let made = || MadeJoint { seed: 41, ..MadeJoint::default() };
    let all = [
        ("missing", MadeJoint { sampling: Sampling::Missing, ..made() }),
        ("jitter", MadeJoint { sampling: Sampling::Jitter, ..made() }),
        ("coarse clock", MadeJoint { sampling: Sampling::Coarse, ..made() }),
        ("50 Hz", MadeJoint { rate: 50.0, recordings: (2, 300), ..made() }),
        ("10 kHz", MadeJoint { rate: 1e4, recordings: (2, 20_000), ..made() }),
    ];
    for (name, made) in all {
        let (_, judged) = told(name, &made);
        assert_eq!(judged.verdict, EvidenceVerdict::NoGap, "{name}");
        let (found, judged) = told(name, &MadeJoint { effects: ripple, ..made });
        assert_eq!(
            (judged.verdict, found.effects[0].id),
            (EvidenceVerdict::Effects, "torque-ripple"),
            "{name}"
        );
    }
}
