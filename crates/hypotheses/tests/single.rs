//! What only some recordings have, and channels that the filter does not read. Checks EST-16, EST-18, EST-19.

use trueup_estimation::innovations::joint_frame::joint_frame;
use trueup_estimation::innovations::null::fit_null;
use trueup_hypotheses::innovations::findings::search_case;
use trueup_hypotheses::innovations::levels::PARAMETERS;
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_models::joint::parameter as q;
use trueup_signals::{Loaded, ParameterValue, PriorGuess};

use crate::made::MadeJoint;
use crate::rig::{WEIGHT, alone, gained, known, value};

/// Two recordings, the second of another joint that has these parameters by itself: nats by which the evidence is higher with them, and
/// those that a refit of the parameters gains then.
fn of_two(mut case: Loaded, second: &Loaded, own: &[(&str, f64)]) -> [f64; 2] {
    let mut b = second.recordings["a"].clone();
    b.name = "b".into();
    case.case.train.push("b".into());
    case.recordings.insert("b".into(), b.clone());
    let common = alone(&case).evidence;
    b.parameters.extend(own.iter().map(|(n, v)| ((*n).to_owned(), ParameterValue::Number(*v))));
    case.recordings.insert("b".into(), b);
    let own = alone(&case);
    [own.evidence - common, gained(&own)]
}

/// Dry friction, or a known weight, that only one of two recordings has.
#[test]
fn what_only_one_recording_has_is_its_own() {
    let none = [(q::COULOMB_FRICTION, 0.0), (q::STATIC_FRICTION, 0.0)];
    let made = MadeJoint { seed: 61, recordings: (1, 500), values: &none, ..MadeJoint::default() };
    let braked = MadeJoint { seed: 62, recordings: (1, 500), ..MadeJoint::default() };
    let own = [("coulombFriction", 5.2e-3), ("staticFriction", 5.2e-3)];
    let [more, gained] = of_two(made.case(), &braked.case(), &own);
    println!("friction: {more} nats more with it, which refitted parameters gain {gained}");
    assert!(more > 100.0 && gained < PARAMETERS, "{more}, {gained}");
    let effects = [WEIGHT];
    let made = MadeJoint { seed: 63, recordings: (1, 500), ..MadeJoint::default() };
    let hangs = MadeJoint { seed: 64, effects: &effects, ..made };
    let without: [(&str, &[(&str, f64)]); 1] =
        [("gravity-torque", &[("gravityTorque", 0.0), ("gravityAngle", 0.4)])];
    let made = MadeJoint { seed: 63, recordings: (1, 500), ..MadeJoint::default() };
    let [more, gained] = of_two(known(made.case(), &without, 0.0), &hangs.case(), &[("gravityTorque", 0.6)]);
    println!("weight: {more} nats more with it, which refitted parameters gain {gained}");
    assert!(more > 100.0 && gained < PARAMETERS, "{more}, {gained}");
}

/// Gain, offset and delay of the current that only the second of two recordings has, and the gain of a reading.
#[test]
fn rigs_of_single_recordings_are_found() {
    let made = MadeJoint { seed: 70, recordings: (2, 400), ..MadeJoint::default() };
    for (channel, [gain, offset, delay]) in [
        ("motorCurrent", [1.2, 0.0, 0.0]),
        ("motorCurrent", [1.0, 0.08, 0.0]),
        ("motorCurrent", [1.0, 0.0, 0.009]),
        ("loadAngle", [1.03, 0.0, 0.0]),
    ] {
        let mut case = made.case();
        let b = case.recordings.get_mut("b").unwrap();
        let c = b.channels.iter_mut().find(|c| c.name == channel).unwrap();
        c.values.iter_mut().for_each(|u| *u = gain * *u + offset);
        c.time.iter_mut().for_each(|t| *t += delay);
        let guess = |value, doubt| Some(PriorGuess { value, doubt });
        let (figure, truth) = if gain != 1.0 {
            c.sensor.gain = guess(1.0, Some(0.3));
            ("gain", gain)
        } else if offset != 0.0 {
            c.sensor.offset = guess(0.0, None);
            ("offset", offset)
        } else {
            c.sensor.late = guess(0.0, None);
            ("delay", delay)
        };
        let null = alone(&case);
        let all = null.rig.reported_of_single(&null.theta[null.names.len()..], &null.zeros);
        println!("{channel}.{figure}: {all:?}, {} nats", gained(&null));
        assert!(all.len() == 1 && (&*all[0].0, all[0].1) == (&*format!("{channel}.{figure}"), 1), "{all:?}");
        assert!((all[0].2 - truth).abs() < if figure == "delay" { 5e-4 } else { 0.02 }, "{all:?} of {truth}");
        assert!(gained(&null) > 20.0, "{}", gained(&null));
    }
}

/// A torque sensor whose gain and offsets are not known: the filter does not read it.
#[test]
fn the_figures_of_a_torque_sensor_are_found() {
    let all = &["motorCurrent", "motorAngle", "loadAngle", "transmissionTorque"];
    let made = MadeJoint { seed: 71, recordings: (2, 400), channels: all, ..MadeJoint::default() };
    for (gain, offsets) in [(1.15, [2e-3, -1e-3]), (1.0, [0.0; 2])] {
        let mut case = made.case();
        for (r, offset) in case.recordings.values_mut().zip(offsets) {
            for c in r.channels.iter_mut().filter(|c| c.name == "transmissionTorque") {
                c.values.iter_mut().for_each(|y| *y = gain * *y + offset);
                c.sensor.gain = Some(PriorGuess { value: 1.0, doubt: Some(0.2) });
                c.sensor.offset = Some(PriorGuess { value: 0.0, doubt: Some(2e-3) });
            }
        }
        let found = search_case(&case).unwrap();
        let n = value(&found, "transmissionTorque.gain");
        println!("{:?}: gain {n}, {:?}", found.judged.verdict, found.alone.offsets);
        let right = if gain == 1.0 { EvidenceVerdict::NoGap } else { EvidenceVerdict::Parameters };
        assert_eq!(found.judged.verdict, right);
        assert!((n / gain - 1.0).abs() < 0.01, "{n}");
        for ((name, _, o), truth) in found.alone.offsets.iter().zip(offsets) {
            assert!(
                name == "transmissionTorque.offset" && (o - truth).abs() < 2e-4,
                "{name}: {o} of {truth}"
            );
        }
    }
}

/// A motor that only static friction holds.
#[test]
fn static_friction_alone_is_no_gap() {
    let values = [(q::COULOMB_FRICTION, 0.0), (q::STATIC_FRICTION, 8e-3)];
    let rests = [0.0, 0.6];
    let made = MadeJoint { seed: 65, recordings: (1, 500), values: &values, rests, ..MadeJoint::default() };
    let (mut f, _) = joint_frame(&made.case()).unwrap();
    let null = fit_null(&mut f);
    let resting: usize = f.runs[0].signs.mode.iter().map(|m| usize::from(*m)).sum();
    println!("{resting} nodes at rest, {} nats", gained(&null));
    assert!(resting > 20 && gained(&null) < PARAMETERS, "{resting}, {}", gained(&null));
}
