//! What is known of a rig up to a number: gain and offset of an input; a delay that is declared. Checks EST-16.

use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_hypotheses::innovations::findings::{CaseFindings, search_case};
use trueup_hypotheses::innovations::search::frame_of;
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_signals::{Channel, Loaded, PriorGuess};

use crate::made::MadeJoint;

fn channels<'a>(l: &'a mut Loaded, name: &'a str) -> impl Iterator<Item = &'a mut Channel> {
    l.recordings.values_mut().flat_map(|r| &mut r.channels).filter(move |c| c.name == name)
}

/// Its current is read as gain times what acts, and an offset more; both are to be estimated.
fn misread(mut l: Loaded, [gain, offset]: [f64; 2], doubt: f64) -> Loaded {
    for c in channels(&mut l, "motorCurrent") {
        c.values.iter_mut().for_each(|u| *u = gain * *u + offset);
        c.sensor.gain = Some(PriorGuess { value: 1.0, doubt: Some(doubt) });
        c.sensor.offset = Some(PriorGuess { value: 0.0, doubt: None });
    }
    l
}

fn forces(f: &InnovationsFrame, recording: usize) -> Vec<Vec<f64>> {
    f.data().swap_remove(recording).forces
}

/// Columns are derivatives of the known forces.
#[test]
fn columns_of_a_rig_are_differences_of_its_forces() {
    let made = MadeJoint { seed: 41, recordings: (2, 200), ..MadeJoint::default() };
    let case = misread(made.case(), [1.1, 0.05], 0.2);
    let (mut f, _) = frame_of(&case).unwrap();
    f.settle(true);
    let own = f.plant.parameters().len();
    let names: Vec<&str> = f.intake.rig.terms.iter().map(|t| &*t.name).collect();
    assert_eq!(names, ["motorCurrent.gain", "motorCurrent.offset"]);
    // About a point where no number is 1.
    for (k, by) in [0.8, 1.1].iter().enumerate() {
        f.theta[own + k] = *by;
    }
    let columns = f.nuisances().0;
    for k in own..f.theta.len() {
        let at = f.unknown.iter().position(|u| *u == k).unwrap();
        for run in 0..2 {
            let moved = |by: f64| {
                let mut f = f.clone();
                f.theta[k] *= 1.0 + by;
                forces(&f, run)
            };
            let (up, down) = (moved(1e-5), moved(-1e-5));
            let mut column = vec![vec![0.0; f.runs[run].nodes]; 2];
            for s in &columns[at][run].forces {
                column[s.on].iter_mut().zip(s.values.iter()).for_each(|(x, v)| *x += s.weight * v);
            }
            let size = column.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
            assert!(size > 0.0, "{}", names[k - own]);
            for (c, t) in (0..2).flat_map(|c| (0..f.runs[run].nodes).map(move |t| (c, t))) {
                let difference = (up[c][t] - down[c][t]) / 2e-5;
                assert!((difference - column[c][t]).abs() < 1e-7 * size, "{} at {t}", names[k - own]);
            }
        }
    }
}

/// What a channel shows later, with its delay declared, is what it would show at once.
#[test]
fn a_declared_delay_is_taken_from_the_times_of_a_channel() {
    let made = MadeJoint { seed: 42, recordings: (1, 200), ..MadeJoint::default() };
    let at_once = made.case();
    for name in ["motorAngle", "motorCurrent"] {
        let mut late = at_once.clone();
        for c in channels(&mut late, name) {
            c.time.iter_mut().for_each(|t| *t += 0.0123);
            c.sensor.delay = 0.0123;
        }
        let [a, b] = [&at_once, &late].map(|l| frame_of(l).unwrap().0.intake.recordings[0].clone());
        assert_eq!(a.nodes, b.nodes, "{name}");
        let alike = |a: &[f64], b: &[f64]| {
            assert_eq!(a.len(), b.len(), "{name}");
            a.iter().zip(b).for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{name}: {a}, {b}"));
        };
        alike(&a.means[0], &b.means[0]);
        for (x, y) in a.readings.iter().zip(&b.readings) {
            assert_eq!(x.node, y.node, "{name}");
            alike(&x.time, &y.time);
            alike(&x.mean, &y.mean);
        }
    }
}

fn value(found: &CaseFindings, name: &str) -> f64 {
    found.alone.theta[found.names.iter().position(|n| n == name).unwrap()]
}

/// A gain and an offset are other numbers of the rig, not an effect.
#[test]
fn a_gain_and_an_offset_of_the_current_are_found() {
    let made = MadeJoint { seed: 43, recordings: (1, 500), ..MadeJoint::default() };
    let found = search_case(&misread(made.case(), [1.2, 0.1], 0.3)).unwrap();
    let [gain, offset] = ["motorCurrent.gain", "motorCurrent.offset"].map(|n| value(&found, n));
    println!("{:?}: gain {gain}, offset {offset}", found.judged.verdict);
    assert_eq!(found.judged.verdict, EvidenceVerdict::Parameters);
    assert!((gain / 1.2 - 1.0).abs() < 0.03 && (offset - 0.1).abs() < 0.02, "{gain}, {offset}");
}
