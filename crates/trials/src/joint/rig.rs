//! What is wrong with a rig rather than with its joint: the scale and the offset of the current, a load hardly known, a hand
//! that moves a joint at rest, friction that goes on changing from one repeat to the next; and rigs where nothing is.

use super::bench::{JointRecord, JointReplays, current_noise, scales, spread, times};
use super::choice::{JointEffectDraw, JointScales, draw_pulses};
use super::drive::{self, short};
use super::law::{JointLaw, JointLawEffect};
use super::scene::{BelievedJoint, JointScene, NominalJoint};
use super::size::{by_channel, floors, overall, size};
use super::values::{JointValues, NAMES};
use super::write::{key, write};
use crate::case::{DeclaredGuess, Moved, TrialCase, TrialSplit};
use crate::draw::SeededDraw;
use crate::motion::{Family, ReferenceMotion, family};

/// What a case is about, in turn.
#[derive(Clone, Copy, Debug, PartialEq)]
enum RigKind {
    Gain,
    Offset,
    Payload,
    Hand,
    Session,
    Nothing,
}

const KINDS: [RigKind; 6] =
    [RigKind::Gain, RigKind::Offset, RigKind::Payload, RigKind::Hand, RigKind::Session, RigKind::Nothing];
/// Of a rig where nothing is off: what the case declares uncertain.
const DOUBTED: [RigKind; 3] = [RigKind::Gain, RigKind::Offset, RigKind::Payload];

/// How much of the floor something that is off leaves when all else that is doubted is refitted.
const WEAKEST: f64 = 3.0;
const STRONGEST: f64 = 30.0;
/// What is off by the least that counts may leave more.
const PLAIN: f64 = 100.0;
/// Runs of one command.
const REPEATS: usize = 3;
/// loadInertia and torqueConstant in [`JointValues::list`].
const LOAD: usize = 1;
const CONSTANT: usize = 3;

/// What is off: the current as it is read, the nominal load.
#[derive(Clone, Copy, Debug)]
struct Off {
    gain: f64,
    /// A.
    offset: f64,
    /// kg.m2.
    load: f64,
}

impl Off {
    /// By the share `by`.
    fn new(kind: RigKind, by: f64, values: &JointValues, current: f64) -> Self {
        let mut off = Self { gain: 1.0, offset: 0.0, load: values.load_inertia };
        match kind {
            RigKind::Gain => off.gain = short(1.0 + by),
            RigKind::Offset => off.offset = short(by * current),
            // By logarithm: none is negative.
            RigKind::Payload => off.load = short(values.load_inertia * by.exp()),
            _ => {}
        }
        off
    }
}

impl RigKind {
    /// Least and most of its share. What is assumed known has a prior of 1 %: a smaller error of a gain would not be found.
    fn shares(self) -> [f64; 2] {
        match self {
            Self::Gain => [0.05, 0.3],
            Self::Offset => [0.02, 0.4],
            _ => [0.1, 0.9],
        }
    }
    /// Values that are declared known: as many as it takes for the others to have a scale.
    fn known(self) -> &'static [usize] {
        match self {
            Self::Gain => &[0, LOAD, CONSTANT],
            Self::Payload => &[LOAD, CONSTANT],
            _ => &[],
        }
    }
    fn doubted(self) -> Vec<usize> {
        [0, LOAD, CONSTANT, 4, 5, 6, 7].into_iter().filter(|i| !self.known().contains(i)).collect()
    }
}

/// One draw; nothing where it does not show.
pub(super) fn attempt(seed: u64, index: usize, d: &mut SeededDraw) -> Option<TrialCase> {
    let kind = KINDS[index % KINDS.len()];
    let mut scene = scene(kind, seed ^ ((index as u64) << 20), d);
    let values = scene.drive.values;
    let hangs = (kind == RigKind::Hand && d.chance(0.5)).then(|| {
        let torque = short(values.gear_ratio * values.coulomb * d.uniform(0.5, 2.0));
        (torque, short(d.uniform(-1.5, 1.5)))
    });
    scene.known.extend(hangs.map(|(torque, angle)| {
        JointLawEffect::new(JointLaw::Unbalance { x: torque * angle.cos(), y: -torque * angle.sin() }, 1.0)
    }));
    let plain = scene.run(values, &[], &[0, 1]);
    let s = moves(&scene, &plain)?;
    let noise = current_noise(&plain, d);
    let floor = floors(&scene, values, &plain, noise);

    let choice = cause(kind, &scene, &s, d);
    let believed = BelievedJoint { values, rigid: false, frictionless: false };
    let (mut effects, mut ratio) = (Vec::new(), 1.0);
    let current =
        (plain[0].current.iter().map(|u| u * u).sum::<f64>() / plain[0].current.len() as f64).sqrt();
    let mut runs = plain;
    if let Some(c) = &choice {
        let sized = size(&scene, values, &believed, c, &floor, d.log(WEAKEST, STRONGEST))?;
        (ratio, runs) = (sized.ratio, sized.runs);
        effects.push(sized.effect);
    }
    let rest: Vec<usize> = (runs.len()..scene.motions.len()).collect();
    runs.extend(scene.run(values, &effects, &rest));
    if runs.iter().any(|r| r.track.state.iter().any(|x| x.iter().any(|v| !v.is_finite()))) {
        return None;
    }
    let mut off = Off::new(RigKind::Nothing, 0.0, &values, current);
    if DOUBTED.contains(&kind) {
        (off, ratio) = sized(kind, &scene, &runs[..2], &floor, current, d)?;
    }
    if kind != RigKind::Nothing && !(0.8 * WEAKEST..PLAIN).contains(&ratio) {
        return None;
    }

    let doubted = if kind == RigKind::Nothing { DOUBTED[index / KINDS.len() % DOUBTED.len()] } else { kind };
    let mut nominal = believe(kind, doubted, &values, d);
    nominal.values[LOAD] = if doubted == RigKind::Payload { off.load } else { nominal.values[LOAD] };
    if doubted == RigKind::Payload {
        nominal.doubts.push((LOAD, doubt((off.load / values.load_inertia).ln(), d)));
    }
    let mut case = write(&scene, &effects, &runs, &nominal, &believed, noise, false, d);
    case.key =
        key(TrialSplit::Rig, seed, index, choice.as_slice(), &effects, ratio, values, &values, None, &s);
    case.key.drive = if scene.drive.small { "harmonic drive" } else { "geared motor" }.into();
    state(&mut case, kind, doubted, off, &values, d);
    if let Some((torque, angle)) = hangs {
        case.effects = hanging(torque, angle, d);
    }
    if kind == RigKind::Session {
        case.repeats = vec![(1..=REPEATS).map(|i| format!("train-{i}.csv")).collect()];
    }
    Some(case)
}

/// Its command: a hand acts on it at rest, repeats have one command.
fn scene(kind: RigKind, seeds: u64, d: &mut SeededDraw) -> JointScene {
    let drive = drive::draw(d, 0.0);
    let top = (drive.rate / 25.0).min(3.0);
    let speed = drive.speed / drive.values.gear_ratio;
    let (mut motions, mut all_times) = (Vec::<ReferenceMotion>::new(), Vec::new());
    let mut stands = None;
    for i in 0..REPEATS + 1 + d.below(2) {
        let t = times(&drive, d);
        let span = t[t.len() - 1];
        let mut m = ReferenceMotion::draw(d, Family::Multisine, speed, top, span);
        m.family = family(d, i);
        while kind == RigKind::Hand && m.family == Family::OpenLoop {
            m.family = family(d, i);
        }
        m.center = d.uniform(-0.3, 0.3);
        if kind == RigKind::Hand {
            let from = *stands.get_or_insert(d.uniform(0.2, 0.4) * span);
            m.stands = Some((from, from + 0.35 * span));
        }
        let again = motions.first().filter(|_| kind == RigKind::Session && i < REPEATS).cloned();
        motions.push(again.unwrap_or(m));
        all_times.push(t);
    }
    let span = all_times.iter().map(|t| t[t.len() - 1]).fold(0.0, f64::max);
    JointScene { drive, motions, times: all_times, seeds, span, rigid: false, known: Vec::new() }
}

/// How large things are; nothing where a run fails or hardly moves.
fn moves(scene: &JointScene, plain: &[JointRecord]) -> Option<JointScales> {
    if plain.iter().any(|r| r.track.state.iter().any(|x| !x[0].is_finite())) {
        return None;
    }
    let s = scales(&plain[0], &scene.drive.values);
    (s.speed >= 0.02 * scene.drive.speed).then_some(s)
}

/// The effect of a kind that has one.
fn cause(kind: RigKind, scene: &JointScene, s: &JointScales, d: &mut SeededDraw) -> Option<JointEffectDraw> {
    match kind {
        RigKind::Hand => {
            let (from, to) = scene.motions[0].stands?;
            let mut pushes = draw_pulses(d, s.span);
            pushes.truncate(1);
            for p in &mut pushes {
                p.length = d.uniform(0.2, 0.5) * (to - from);
                p.start = d.uniform(from + 0.5, to - p.length);
                p.height *= scene.drive.values.gear_ratio * s.torque;
            }
            Some(JointEffectDraw {
                id: "external-force",
                component: "load".into(),
                name: "hand",
                law: JointLaw::PushLoad { pulses: pushes },
                least: 5e-3,
                most: 3.0,
            })
        }
        RigKind::Session => Some(JointEffectDraw {
            id: "friction-drift",
            component: "motor-friction".into(),
            name: "session",
            law: JointLaw::Session { sign: d.sign(), runs: scene.motions.len() as f64, past: 0.0 },
            least: 0.03,
            most: 0.8,
        }),
        _ => None,
    }
}

/// So much off that refitting all else that is doubted leaves a gap.
fn sized(
    kind: RigKind,
    scene: &JointScene,
    runs: &[JointRecord],
    floor: &[f64],
    current: f64,
    d: &mut SeededDraw,
) -> Option<(Off, f64)> {
    let values = scene.drive.values;
    let (target, sign) = (d.log(WEAKEST, STRONGEST), d.sign());
    let [least, most] = kind.shares();
    let mut by = (least * most).sqrt();
    let mut best: Option<(f64, Off, f64)> = None;
    for _ in 0..6 {
        let off = Off::new(kind, sign * by, &values, current);
        let base = JointValues { load_inertia: off.load, ..values };
        let mut bench = JointReplays::new(&scene.drive, base, false, runs, true);
        bench.free.retain(|i| !kind.known().contains(i));
        bench.scale = floor.to_vec();
        let measured = bench.measured(runs, &[], scene.span);
        for (_, read) in &mut bench.runs {
            read.iter_mut().for_each(|u| *u = off.gain * *u + off.offset);
        }
        let rms: Vec<f64> = by_channel(&bench.left(&measured, runs), floor.len())
            .iter()
            .zip(floor)
            .map(|(r, f)| r * f)
            .collect();
        let reached = overall(&rms, floor, &spread(&scene.drive, runs));
        if !reached.is_finite() {
            return None;
        }
        let miss = (reached / target).ln().abs();
        if best.is_none_or(|b| miss < b.0) {
            best = Some((miss, off, reached));
        }
        let excess = (reached * reached - 1.0).max(1e-4).sqrt();
        let next = (by * ((target * target - 1.0).sqrt() / excess).clamp(0.1, 8.0)).clamp(least, most);
        if miss < 0.3 || (next / by).ln().abs() < 1e-3 {
            break;
        }
        by = next;
    }
    best.map(|(_, off, reached)| (off, reached))
}

/// The nominal model of the joint: all exact where nothing is off.
fn believe(kind: RigKind, doubted: RigKind, values: &JointValues, d: &mut SeededDraw) -> NominalJoint {
    let truth = values.list();
    let mut nominal = NominalJoint { values: truth, doubts: Vec::new() };
    let off = kind != RigKind::Nothing && d.chance(0.6);
    for i in doubted.doubted() {
        if off {
            nominal.values[i] = short(truth[i] * (1.0 + d.sign() * d.uniform(0.01, 0.05)));
        }
        nominal.doubts.push((i, d.pick(&[0.03, 0.05, 0.1])));
    }
    nominal
}

/// A standard deviation that fits the error; where there is none, a plausible one.
fn doubt(off: f64, d: &mut SeededDraw) -> f64 {
    let size = if off == 0.0 { d.log(0.03, 0.3) } else { off.abs() / d.uniform(0.5, 2.0) };
    short(size.max(0.01))
}

/// Current and key of what is off.
fn state(
    case: &mut TrialCase,
    kind: RigKind,
    doubted: RigKind,
    off: Off,
    values: &JointValues,
    d: &mut SeededDraw,
) {
    let input = case.sensors[0].name.clone();
    let runs = case.train.iter_mut().chain(&mut case.holdout).chain(&mut case.rest);
    for column in runs.flat_map(|r| &mut r.columns).filter(|c| c.name == input) {
        column.values.iter_mut().for_each(|u| *u = off.gain * *u + off.offset);
    }
    let sensor = &mut case.sensors[0];
    sensor.noise = sensor.noise.map(|n| short(off.gain * n));
    let mut moved = |name: String, from: f64, to: f64| {
        if kind == doubted {
            case.key.moved.insert(name, Moved { from, to });
        }
    };
    match doubted {
        RigKind::Gain => {
            sensor.gain = Some(DeclaredGuess::About(1.0, doubt(off.gain - 1.0, d)));
            moved(format!("{input}.gain"), 1.0, off.gain);
        }
        RigKind::Offset => {
            sensor.offset = Some(DeclaredGuess::Free);
            moved(format!("{input}.offset"), 0.0, off.offset);
        }
        RigKind::Payload => moved(NAMES[LOAD].into(), off.load, values.load_inertia),
        _ => {}
    }
    case.key.verdict = match kind {
        RigKind::Nothing => "no-gap",
        RigKind::Hand | RigKind::Session => "effects",
        _ => "parameters",
    }
    .into();
}

/// A load that hangs, with its weight and rest position known nearly.
fn hanging(torque: f64, angle: f64, d: &mut SeededDraw) -> toml::Table {
    let table = toml::Table::from_iter([
        ("gravityTorque".to_owned(), short(torque * (1.0 + 0.03 * d.normal())).into()),
        ("gravityAngle".to_owned(), short(angle + 0.02 * d.normal()).into()),
        ("doubt".to_owned(), 0.05.into()),
    ]);
    toml::Table::from_iter([("gravity-torque".to_owned(), toml::Value::Table(table))])
}
