//! A case of an arm from its numbers.

use super::choice::{IDS, OUTSIDE, choose};
use super::plant::{ArmValues, LINKS};
use super::rig;
use super::scene::{ArmRecord, ArmScene, finite, scales, scene};
use super::size::{ALL, NONE, floors, get, ratio, set, size};
use super::write::write;
use crate::case::{TrialCase, TrialSplit};
use crate::draw::SeededDraw;
use crate::error::TrialError;
use crate::joint::short;

const ATTEMPTS: usize = 40;

/// Effects that these data cannot separate, and the channels that there are then.
const MIMICS: [(&[&str], &[usize]); 2] =
    [(&["actuator-lag", "sensor-delay"], &[6]), (&["table-tilt", "base-thrust"], &[0, 1])];

/// Draws until the effect shows.
pub(crate) fn generate(split: TrialSplit, seed: u64, index: usize) -> Result<TrialCase, TrialError> {
    for attempt in 0..ATTEMPTS {
        let mut d = SeededDraw::new(&format!("manipulator/{}", split.name()), seed, index, attempt);
        let case = match split {
            TrialSplit::Rig => rig::attempt(seed, index, &mut d),
            _ => one(split, seed, index, index + attempt / 8, &mut d),
        };
        if let Some(case) = case {
            return Ok(case);
        }
    }
    Err(TrialError::Useless { split: split.name(), seed, index })
}

fn one(split: TrialSplit, seed: u64, index: usize, turn: usize, d: &mut SeededDraw) -> Option<TrialCase> {
    let mimic = (split == TrialSplit::Unidentifiable).then(|| MIMICS[turn % MIMICS.len()]);
    let s = scene(d, seed, index, mimic.map(|m| m.1), true);
    let values = s.values;
    let plain = s.runs(values, &[], &[0, 1]);
    if !finite(&plain) {
        return None;
    }
    let sizes = scales(&plain, &s);
    let noise: [f64; LINKS] = std::array::from_fn(|j| short(sizes.torque[j] * d.log(3e-4, 3e-3)));
    let floor = floors(&s, &plain, noise);
    let ids: Vec<&'static str> = match split {
        TrialSplit::None | TrialSplit::Parameters | TrialSplit::Rig => Vec::new(),
        TrialSplit::Single => vec![IDS[turn % IDS.len()]],
        TrialSplit::Pairs => {
            let few = &IDS[..IDS.len() - 1];
            let a = turn % few.len();
            vec![few[a], few[(a + 1 + d.below(few.len() - 1)) % few.len()]]
        }
        TrialSplit::Outside => vec![OUTSIDE[turn % OUTSIDE.len()]],
        TrialSplit::Unidentifiable => {
            let class = mimic?.0;
            vec![class[(turn / MIMICS.len()) % class.len()]]
        }
    };
    let mut choices = Vec::new();
    for id in &ids {
        choices.push(choose(id, turn / IDS.len() + d.below(3), d, &values, &sizes, &s.channels)?);
    }
    if let [a, b] = &choices[..]
        && (a.component == b.component || a.id == b.id)
    {
        return None;
    }
    if let (Some(_), [c]) = (mimic, &mut choices[..]) {
        c.joint = 0;
    }
    let (weakest, strongest) = if split == TrialSplit::Single { (1.5, 30.0) } else { (4.0, 15.0) };
    let mut base = values;
    if choices.iter().any(|c| c.id == "joint-flexibility") {
        base.flexible[0] = false;
    }
    let (mut effects, mut left) = (Vec::new(), 1.0);
    // The first two runs with the effects so far; with more than one effect they are not known.
    let mut first = plain;
    for c in &choices {
        let target = d.log(weakest, strongest);
        let sized = size(&s, base, c, &floor, target)?;
        if sized.ratio < 0.85 * weakest || sized.ratio > 1.6 * strongest {
            return None;
        }
        left = sized.ratio;
        first = if effects.is_empty() { sized.runs } else { Vec::new() };
        effects.push(sized.effect);
    }
    let rest: Vec<usize> = (first.len()..s.motions.len()).collect();
    let mut runs = first;
    runs.extend(s.runs(values, &effects, &rest));
    if !finite(&runs) {
        return None;
    }
    if effects.len() > 1 {
        left = ratio(&s, &values, base, &effects, &runs[..2], &floor, ALL);
        if left.is_nan() || left < 0.8 * weakest {
            return None;
        }
    }
    let (nominal, doubts) = believe(split, &s, &base, &runs, &floor, d)?;
    Some(write(
        split,
        seed,
        index,
        &s,
        &choices,
        &effects,
        &runs,
        &nominal,
        &doubts,
        noise,
        left,
        mimic.map(|m| m.0),
        d,
    ))
}

fn believe(
    split: TrialSplit,
    s: &ArmScene,
    base: &ArmValues,
    runs: &[ArmRecord],
    floor: &[f64],
    d: &mut SeededDraw,
) -> Option<(ArmValues, Vec<(usize, f64)>)> {
    let mut nominal = *base;
    let mut doubts = Vec::new();
    let here: Vec<usize> = (0..8).filter(|i| get(base, *i) != 0.0 && (*i < 6 || base.flexible[0])).collect();
    match split {
        TrialSplit::Parameters => {
            let mut moved: Vec<(usize, f64)> = Vec::new();
            for _ in 0..1 + d.below(3) {
                let i = d.pick(&here);
                if moved.iter().all(|(k, _)| *k != i) {
                    moved.push((i, d.sign() * d.uniform(0.5, 1.0)));
                }
            }
            let target = d.log(2.0, 30.0);
            let (mut size, mut reached) = (0.05, 0.0);
            for _ in 0..6 {
                nominal = *base;
                moved
                    .iter()
                    .for_each(|(i, m)| set(&mut nominal, *i, short(get(base, *i) * (1.0 + size * m))));
                reached = ratio(s, base, nominal, &[], &runs[..2], floor, NONE);
                if (reached / target).ln().abs() < 0.3 {
                    break;
                }
                let factor = ((target * target - 1.0) / (reached * reached - 1.0).max(1e-4)).sqrt();
                size = (size * factor.clamp(0.1, 8.0)).clamp(2e-4, 0.4);
            }
            if reached < 1.5 {
                return None;
            }
            for (i, m) in moved {
                if d.chance(0.85) {
                    doubts.push((i, short((size * m.abs() / d.uniform(0.5, 2.0)).max(0.005))));
                }
            }
        }
        _ => {
            let off = split != TrialSplit::None && d.chance(0.6);
            if off || d.chance(0.7) {
                for i in here {
                    if off {
                        set(&mut nominal, i, short(get(base, i) * (1.0 + d.sign() * d.uniform(0.01, 0.05))));
                    }
                    doubts.push((i, d.pick(&[0.03, 0.05, 0.1])));
                }
            }
        }
    }
    Some((nominal, doubts))
}
