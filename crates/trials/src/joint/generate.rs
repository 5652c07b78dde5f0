//! A case of a joint from its numbers.

use super::bench::{JointRecord, JointReplays, current_noise, scales, spread, times};
use super::choice::{IDS, JointEffectDraw, JointScales, OUTSIDE, choose};
use super::drive::{self, short};
use super::law::JointLaw;
use super::rig;
use super::scene::{BelievedJoint, JointScene, NominalJoint};
use super::sealed::SealedJoint;
use super::size::{by_channel, floors, left, overall, size};
use super::values::JointValues;
use super::write::{key, write};
use crate::case::{TrialCase, TrialSplit};
use crate::draw::SeededDraw;
use crate::error::TrialError;
use crate::motion::{Family, ReferenceMotion, family};

/// Attempts until a case is given up.
const ATTEMPTS: usize = 40;

/// Pairs of effects that data of this kind cannot separate, with the way they are made to look alike.
const MIMICS: [(&[&str], Mimic); 4] = [
    (&["actuator-lag", "sensor-delay"], Mimic::OneChannel),
    (&["gravity-torque", "cable-stiffness"], Mimic::SmallMotion),
    (&["asymmetric-friction", "gravity-torque"], Mimic::ConstantPull),
    (&["motor-friction", "load-friction"], Mimic::OneBody),
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Mimic {
    OneChannel,
    SmallMotion,
    ConstantPull,
    OneBody,
}

/// Draws until the effect shows.
pub(crate) fn generate(split: TrialSplit, seed: u64, index: usize) -> Result<TrialCase, TrialError> {
    for attempt in 0..ATTEMPTS {
        let mut d = SeededDraw::new(&format!("joint/{}", split.name()), seed, index, attempt);
        // An effect that does not show on this drive gets a few drives, then the next one has its turn.
        let case = match split {
            TrialSplit::Rig => rig::attempt(seed, index, &mut d),
            _ => attempt_one(split, seed, index, index + attempt / 8, &mut d).map(|(case, _)| case),
        };
        if let Some(case) = case {
            return Ok(case);
        }
    }
    Err(TrialError::Useless { split: split.name(), seed, index })
}

/// A case and the rig that it was recorded on, which more can be recorded on.
pub(crate) fn generate_rig(
    split: TrialSplit,
    seed: u64,
    index: usize,
) -> Result<(TrialCase, SealedJoint), TrialError> {
    (0..ATTEMPTS)
        .find_map(|attempt| {
            let mut d = SeededDraw::new(&format!("joint/{}", split.name()), seed, index, attempt);
            attempt_one(split, seed, index, index + attempt / 8, &mut d)
        })
        .ok_or(TrialError::Useless { split: split.name(), seed, index })
}

fn attempt_one(
    split: TrialSplit,
    seed: u64,
    index: usize,
    turn: usize,
    d: &mut SeededDraw,
) -> Option<(TrialCase, SealedJoint)> {
    let rests = d.chance(0.25);
    let color = if rests && d.chance(0.6) { d.uniform(0.3, 0.8) } else { 0.0 };
    let mut drive = drive::draw(d, color);
    let mimic = (split == TrialSplit::Unidentifiable).then(|| MIMICS[turn % MIMICS.len()]);
    if mimic.is_some() {
        drive.channels = vec![0];
    }
    let top = (drive.rate / 25.0).min(3.0);
    let holdouts = 1 + d.below(2);
    let (mut motions, mut all_times) = (Vec::new(), Vec::new());
    let load_speed = drive.speed / drive.values.gear_ratio;
    for i in 0..3 + holdouts {
        let t = times(&drive, d);
        let span = t[t.len() - 1];
        let family = family(d, i);
        let mut m = ReferenceMotion::draw(d, family, load_speed, top, span);
        match mimic {
            Some((_, Mimic::SmallMotion)) => {
                m = ReferenceMotion::draw(d, Family::Multisine, 0.02 * load_speed.max(0.2), top, span);
            }
            Some((_, Mimic::ConstantPull)) => {
                m = ReferenceMotion::draw(d, Family::Reversals, 0.2 * load_speed.min(0.3), top, span);
            }
            _ => {}
        }
        m.center = if mimic.is_some() { 0.0 } else { d.uniform(-0.3, 0.3) };
        motions.push(m);
        all_times.push(t);
    }
    let span = all_times.iter().map(|t| t[t.len() - 1]).fold(0.0, f64::max);
    // Without a spring motor and load are one body.
    let rigid = matches!(mimic, Some((_, Mimic::OneBody)));
    let scene = JointScene {
        drive,
        motions,
        times: all_times,
        seeds: seed ^ ((index as u64) << 20),
        span,
        rigid,
        known: Vec::new(),
    };
    let values = scene.drive.values;

    let plain = scene.run(values, &[], &[0, 1]);
    if plain.iter().any(|r| r.track.state.iter().any(|x| !x[0].is_finite())) {
        return None;
    }
    let s = scales(&plain[0], &values);
    if s.speed < 0.02 * scene.drive.speed {
        return None;
    }
    let current_noise = current_noise(&plain, d);
    let floor = floors(&scene, values, &plain, current_noise);

    // The truth, and the nominal model.
    let ids: Vec<&'static str> = match split {
        TrialSplit::None | TrialSplit::Parameters | TrialSplit::Rig => Vec::new(),
        TrialSplit::Single => vec![IDS[turn % IDS.len()]],
        TrialSplit::Pairs => {
            let few = &IDS[..IDS.len() - 2];
            let a = turn % few.len();
            let b = (a + 1 + d.below(few.len() - 1)) % few.len();
            vec![few[a], few[b]]
        }
        TrialSplit::Outside => vec![OUTSIDE[turn % OUTSIDE.len()]],
        TrialSplit::Unidentifiable => {
            let class = mimic.map(|(class, _)| class)?;
            vec![class[(turn / MIMICS.len()) % class.len()]]
        }
    };
    let mut choices = Vec::new();
    for id in &ids {
        choices.push(choose(id, d, &values, &s, scene.drive.small)?);
    }
    if let [a, b] = &choices[..]
        && (a.component == b.component || a.id == b.id)
    {
        return None;
    }
    if let (Some((_, kind)), [c]) = (mimic, &mut choices[..]) {
        imitate(kind, c, d, &values, &s)?;
    }
    let strongest = if split == TrialSplit::Single { 30.0 } else { 15.0 };
    let weakest = if split == TrialSplit::Single { 1.5 } else { 4.0 };
    let mut effects = Vec::new();
    let mut believed = BelievedJoint { values, rigid, frictionless: rigid };
    let mut truth = values;
    for c in &choices {
        believed.rigid |= c.id == "joint-flexibility";
        believed.frictionless |= c.id == "motor-friction";
    }
    if believed.frictionless {
        (truth.coulomb, truth.viscous) = (0.0, 0.0);
    }
    let mut ratio = 1.0;
    // The first two runs with the effects so far; with more than one effect they are not known.
    let mut first = plain;
    for c in &choices {
        let target = d.log(weakest, strongest);
        let sized = size(&scene, truth, &believed, c, &floor, target)?;
        if sized.ratio < 0.85 * weakest || sized.ratio > 1.6 * strongest {
            return None;
        }
        ratio = sized.ratio;
        first = if effects.is_empty() { sized.runs } else { Vec::new() };
        effects.push(sized.effect);
    }
    let rest: Vec<usize> = (first.len()..scene.motions.len()).collect();
    let mut runs = first;
    runs.extend(scene.run(truth, &effects, &rest));
    if runs.iter().any(|r| r.track.state.iter().any(|x| x.iter().any(|v| !v.is_finite()))) {
        return None;
    }
    if effects.len() > 1 {
        ratio = left(&scene, truth, &believed, &effects, &runs[..2], &floor);
        if ratio < 0.8 * weakest {
            return None;
        }
    }
    let nominal = believe(split, &scene, &values, &runs, &floor, &mut ratio, d)?;
    let mut case = write(&scene, &effects, &runs, &nominal, &believed, current_noise, rests, d);
    case.key = key(split, seed, index, &choices, &effects, ratio, truth, &values, mimic.map(|m| m.0), &s);
    case.key.drive = if scene.drive.small { "harmonic drive" } else { "geared motor" }.into();
    Some((case, SealedJoint { scene, effects, truth, current_noise }))
}

/// Makes an effect look like another.
fn imitate(
    kind: Mimic,
    c: &mut JointEffectDraw,
    d: &mut SeededDraw,
    v: &JointValues,
    s: &JointScales,
) -> Option<()> {
    let g = v.gear_ratio * s.torque;
    match (kind, c.id) {
        (Mimic::OneChannel, "actuator-lag") => (c.law, c.name) = (JointLaw::DeadTime, "dead-time"),
        (Mimic::OneChannel, _) => {
            c.law = JointLaw::Late { channel: 0 };
            c.component = "sensor:motorAngle".into();
        }
        (Mimic::SmallMotion, "gravity-torque") => c.law = JointLaw::Unbalance { x: g, y: 0.0 },
        (Mimic::SmallMotion, _) => {
            c.law = JointLaw::Cable { torque: g, center: s.center, width: 20.0 * s.reach };
            c.most = 20.0;
        }
        (Mimic::ConstantPull, "gravity-torque") => {
            c.law = JointLaw::Unbalance { x: 0.0, y: g * d.sign() };
        }
        _ => {}
    }
    Some(())
}

fn believe(
    split: TrialSplit,
    scene: &JointScene,
    values: &JointValues,
    runs: &[JointRecord],
    floor: &[f64],
    ratio: &mut f64,
    d: &mut SeededDraw,
) -> Option<NominalJoint> {
    let truth = values.list();
    let mut nominal = NominalJoint { values: truth, doubts: Vec::new() };
    let declared = d.chance(0.75);
    match split {
        TrialSplit::None => {
            if declared {
                nominal.doubts =
                    [0, 1, 3, 4, 5, 6, 7].iter().map(|i| (*i, d.pick(&[0.02, 0.05, 0.1]))).collect();
            }
        }
        TrialSplit::Parameters => {
            let candidates = [0, 1, 3, 4, 6, 7];
            let count = 1 + d.below(3);
            let mut moved: Vec<(usize, f64)> = Vec::new();
            for _ in 0..count {
                let i = d.pick(&candidates);
                if moved.iter().all(|(j, _)| *j != i) {
                    moved.push((i, d.sign() * d.uniform(0.5, 1.0)));
                }
            }
            let target = d.log(2.0, 30.0);
            let mut size = 0.05;
            let mut reached = 0.0;
            for _ in 0..6 {
                let mut v = truth;
                moved.iter().for_each(|(i, m)| v[*i] = short(truth[*i] * (1.0 + size * m)));
                let mut bench = JointReplays::new(&scene.drive, JointValues::of(v), false, &runs[..2], false);
                bench.scale = floor.to_vec();
                let measured = bench.measured(&runs[..2], &[], scene.span);
                let residual = bench.left(&measured, &runs[..2]);
                let rms: Vec<f64> =
                    by_channel(&residual, floor.len()).iter().zip(floor).map(|(r, s)| r * s).collect();
                reached = overall(&rms, floor, &spread(&scene.drive, runs));
                nominal.values = v;
                if (reached / target).ln().abs() < 0.3 {
                    break;
                }
                let next = size
                    * ((target * target - 1.0) / (reached * reached - 1.0).max(1e-4)).sqrt().clamp(0.1, 8.0);
                size = next.clamp(2e-4, 0.3);
            }
            if reached < 1.5 {
                return None;
            }
            // The key's ratio is what a refit leaves: the floor.
            *ratio = 1.0;
            for (i, m) in &moved {
                if d.chance(0.85) {
                    nominal.doubts.push((*i, short((size * m.abs() / d.uniform(0.5, 2.0)).max(0.005))));
                }
            }
        }
        _ => {
            if d.chance(0.6) {
                for i in [0, 1, 3, 4, 5, 6, 7] {
                    let off = d.sign() * d.uniform(0.01, 0.05);
                    nominal.values[i] = short(truth[i] * (1.0 + off));
                    nominal.doubts.push((i, d.pick(&[0.03, 0.05, 0.1])));
                }
            } else if declared {
                nominal.doubts = [0, 1, 3, 4, 5, 6, 7].iter().map(|i| (*i, d.pick(&[0.02, 0.05]))).collect();
            }
        }
    }
    Some(nominal)
}
