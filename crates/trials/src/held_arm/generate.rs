//! A case of an arm from its numbers.

use super::chain::JOINTS;
use super::choice::{IDS, OUTSIDE, choose, needs_spring};
use super::law::HeldLawEffect;
use super::named::free_values;
use super::nominal::nominal;
use super::scene::{HeldSceneOrder, TRAIN, finite, scales, scene};
use super::size::{gauge, ratio, size};
use super::write::{HeldHappening, HeldOrigin, write};
use crate::case::{TrialCase, TrialPlant, TrialSplit};
use crate::draw::SeededDraw;
use crate::error::TrialError;
use crate::joint::short;

const ATTEMPTS: usize = 40;

/// Effects that the reading of a single joint, the only one that moves, does not separate.
const MIMIC: &[&str] = &["actuator-lag", "sensor-delay"];

/// Draws until the effect shows.
pub(crate) fn generate(split: TrialSplit, seed: u64, index: usize) -> Result<TrialCase, TrialError> {
    if split == TrialSplit::Rig {
        return Err(TrialError::Absent { plant: TrialPlant::HeldArm.name(), split: split.name() });
    }
    for attempt in 0..ATTEMPTS {
        let mut d = SeededDraw::new(&format!("held-arm/{}", split.name()), seed, index, attempt);
        if let Some(case) = one(HeldOrigin { split, seed, index }, index + attempt / 6, &mut d) {
            return Ok(case);
        }
    }
    Err(TrialError::Useless { split: split.name(), seed, index })
}

fn ids_of(split: TrialSplit, turn: usize, d: &mut SeededDraw) -> Vec<&'static str> {
    match split {
        TrialSplit::None | TrialSplit::Parameters | TrialSplit::Rig => Vec::new(),
        TrialSplit::Single => vec![IDS[turn % IDS.len()]],
        TrialSplit::Pairs => {
            let few = &IDS[..IDS.len() - 1];
            let a = turn % few.len();
            vec![few[a], few[(a + 1 + d.below(few.len() - 1)) % few.len()]]
        }
        TrialSplit::Outside => vec![OUTSIDE[turn % OUTSIDE.len()]],
        TrialSplit::Unidentifiable => vec![MIMIC[turn % MIMIC.len()]],
    }
}

fn one(of: HeldOrigin, turn: usize, d: &mut SeededDraw) -> Option<TrialCase> {
    let split = of.split;
    let mimic = split == TrialSplit::Unidentifiable;
    let ids = ids_of(split, turn, d);
    let springs = match mimic {
        true => Some(false),
        false => ids.iter().any(|id| needs_spring(id)).then_some(true),
    };
    let alone = mimic.then(|| d.below(JOINTS));
    let mut s = scene(d, of.seed, of.index, HeldSceneOrder { springs, alone });
    if ids.contains(&"stribeck-friction") {
        // What breaks away above where it slides is the effect's own.
        s.arm.values.breakaway = s.arm.values.coulomb;
    }
    let values = s.arm.values;
    let first: Vec<usize> = (0..TRAIN).collect();
    let plain = s.runs(values, &[], &first);
    if !finite(&plain) {
        return None;
    }
    let sizes = scales(&plain, &s);
    let noise: [f64; JOINTS] = std::array::from_fn(|j| short(sizes.torque[j] * d.log(5e-4, 5e-3)));
    let mut choices = Vec::new();
    for id in &ids {
        let kind = turn / IDS.len() + d.below(3);
        choices.push(choose(id, kind, d, &values, &sizes, &s.channels, alone)?);
    }
    if let [a, b] = &choices[..]
        && (a.component == b.component || a.id == b.id)
    {
        return None;
    }
    if choices.iter().any(|c| HeldLawEffect::in_spells(&c.law)) {
        s.windows = usize::MAX;
    }
    let mut base = values;
    for c in choices.iter().filter(|c| c.id == "joint-flexibility") {
        base.flexible[c.joint] = false;
        // Its link's angle would be a second reading of one motion.
        s.channels.retain(|k| *k != JOINTS + c.joint);
    }
    // Where nothing is off none of it is used.
    let gauge = (split != TrialSplit::None).then(|| gauge(&s, &base, &plain, noise));
    let (weakest, strongest) = if split == TrialSplit::Single { (1.5, 30.0) } else { (4.0, 15.0) };
    let (mut effects, mut left) = (Vec::new(), 1.0);
    // The runs for fitting with the effects so far; with more than one effect they are not known.
    let mut known = plain;
    for c in &choices {
        let target = d.log(weakest, strongest);
        let sized = size(&s, base, c, gauge.as_ref()?, target)?;
        if sized.ratio < 0.7 * weakest || sized.ratio > 1.8 * strongest {
            return None;
        }
        known = if effects.is_empty() { sized.runs } else { Vec::new() };
        effects.push(sized.effect);
    }
    let rest: Vec<usize> = (known.len()..s.courses.len()).collect();
    let mut runs = known;
    runs.extend(s.runs(values, &effects, &rest));
    if !finite(&runs) {
        return None;
    }
    let floor = gauge.map_or_else(Vec::new, |g| g.floor);
    if !effects.is_empty() {
        left = ratio(&s, &values, base, &effects, &runs, &floor, &free_values(&base));
        if !(0.85 * weakest..1.8 * strongest).contains(&left) {
            return None;
        }
    }
    let own = nominal(split, &s, &base, &runs, &floor, d)?;
    let happens = HeldHappening {
        choices: &choices,
        effects: &effects,
        runs: &runs,
        noise,
        left,
        class: if mimic { MIMIC } else { &[] },
    };
    Some(write(of, &s, &happens, &own, d))
}
