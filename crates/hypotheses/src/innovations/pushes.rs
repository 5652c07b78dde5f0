//! Impulses at the same times in all recordings: matching pursuit on the score of the force, each refined by evidence.

use std::f64::consts::PI;

use trueup_estimation::innovations::column::{AppliedLaw, FilterColumn};
use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::intake::START;

use super::candidate::ScreenedShape;
use super::joint_along::{UsualSizes, along_joint};
use super::laws::{PUSHES, pushes_at};
use super::screen::{Screening, bank};

/// Widths that are looked for, s.
const WIDTHS: [f64; 5] = [0.1, 0.2, 0.35, 0.55, 0.85];
/// Most impulses.
const MOST: usize = 4;
/// Places of each width, and as many more at rest.
const PLACES: usize = 3;
/// Nats that one more push has to gain.
const GAIN: f64 = 25.0;
/// Nats that the prior of each push costs.
pub const EACH: f64 = 8.0;
/// Steps of begin (in widths) and factors of width of the refinement.
const STEPS: [[f64; 2]; 3] = [[0.3, 1.3], [0.15, 1.15], [0.07, 1.07]];

/// The impulses on a place that explain most in addition to accepted laws (columns, with amplitudes as their priors have them).
pub fn pursue(
    frame: &mut InnovationsFrame,
    sizes: &UsualSizes,
    q: &[f64],
    place: &'static str,
    standing: &[AppliedLaw],
) -> Option<ScreenedShape> {
    let id = PUSHES.id();
    if frame.plant.known_effects().is_some_and(|k| k.has(id)) || frame.plant.refuses(id, place) {
        return None;
    }
    let score = usize::from(place != "actuator");
    let standing_columns: Vec<FilterColumn> = standing.iter().flat_map(|l| l.columns.clone()).collect();
    let standing_amplitudes: Vec<f64> = standing.iter().flat_map(|l| l.mean.clone()).collect();
    let mut best: Option<ScreenedShape> = None;
    let make = |frame: &InnovationsFrame, all: &[Vec<[f64; 2]>]| -> Vec<ScreenedShape> {
        let along = along_joint(frame, sizes);
        let shapes = all.iter().map(|p| pushes_at(place, p.clone()));
        shapes.filter_map(|s| ScreenedShape::new(PUSHES, &along, s)).collect()
    };
    for _ in 0..MOST {
        let got = best.as_ref().map_or_else(Vec::new, |b| b.shape.pulses.clone());
        let current = best.as_ref().map_or_else(|| q.to_vec(), |b| b.intensities.clone());
        if let Some(b) = &best {
            let columns: Vec<&FilterColumn> =
                b.terms.applied.columns.iter().chain(&standing_columns).collect();
            let amplitudes: Vec<f64> = b.amplitudes.iter().chain(&standing_amplitudes).copied().collect();
            let own = frame.own_forces(&columns, &amplitudes);
            frame.smooth(&current, Some(own));
        }
        let sets: Vec<Vec<[f64; 2]>> =
            places(frame, score).into_iter().map(|p| [&got[..], &[p]].concat()).collect();
        let mut all = make(frame, &sets);
        let mut screening = Screening::of_joint(frame, standing);
        screening.look(frame, &mut all, &bank(&current, &[1.0]));
        let Some(mut found) = all.into_iter().reduce(ScreenedShape::or_better) else { break };
        for step in STEPS {
            let Some(pulse) = found.shape.pulses.last().copied() else { break };
            let sets: Vec<Vec<[f64; 2]>> =
                neighbours(pulse, step).into_iter().map(|p| [&got[..], &[p]].concat()).collect();
            let mut all = make(frame, &sets);
            screening.look(frame, &mut all, &[found.intensities.clone()]);
            found = all.into_iter().fold(found, |a, b| if b.evidence >= a.evidence { b } else { a });
        }
        if best.as_ref().is_some_and(|b| found.evidence - b.evidence < GAIN) {
            break;
        }
        best = Some(found);
    }
    let columns: Vec<&FilterColumn> = standing_columns.iter().collect();
    let own = (!columns.is_empty()).then(|| frame.own_forces(&columns, &standing_amplitudes));
    frame.smooth(q, own);
    if let Some(b) = &mut best {
        b.evidence -= EACH * b.shape.pulses.len() as f64;
    }
    best
}

/// Impulses around one: its begin moved by a step in widths, its width by a factor, about the same middle.
pub(super) fn neighbours([begin, width]: [f64; 2], [by, factor]: [f64; 2]) -> Vec<[f64; 2]> {
    let moves = [-1.0, 0.0, 1.0].into_iter().flat_map(|i| [1.0 / factor, 1.0, factor].map(|x| (i, x)));
    let others = moves.filter(|(i, x)| *i != 0.0 || *x != 1.0);
    others.map(|(i, x)| [begin + i * by * width + 0.5 * width * (1.0 - x), width * x]).collect()
}

/// A raised cosine over so many nodes.
pub(super) fn raised_cosine(nodes: usize) -> Vec<f64> {
    (0..nodes).map(|j| 0.5 * (1.0 - (2.0 * PI * j as f64 / nodes as f64).cos())).collect()
}

/// Begin and width of raised cosines that match the score of a force best.
fn places(frame: &InnovationsFrame, score: usize) -> Vec<[f64; 2]> {
    let Some(longest) = frame.runs.iter().max_by_key(|r| r.nodes) else { return Vec::new() };
    let (dt, nodes) = (longest.dt, longest.nodes);
    let mut g = vec![0.0; nodes];
    for r in &frame.runs {
        g.iter_mut().zip(r.score(score)).for_each(|(g, s)| *g += s);
    }
    let first = ((START / dt) as usize).min(nodes);
    g[..first].fill(0.0);
    let share = |t: usize| {
        let rest = frame.runs.iter().filter(|r| r.signs.mode.get(t) == Some(&1)).count();
        rest as f64 / frame.runs.len() as f64
    };
    best_places(&g, &(0..nodes).map(share).collect::<Vec<_>>(), dt)
}

/// Those where the sum of scores by node matches best, and those of them at rest, where so large a share of the recordings rests: a joint
/// at rest shows a force by the deflection of its spring alone, so that its scores are small next to those in motion however sure they
/// are.
fn best_places(scores: &[f64], rests: &[f64], dt: f64) -> Vec<[f64; 2]> {
    let nodes = scores.len();
    let mut before = vec![0.0; nodes + 1];
    (0..nodes).for_each(|t| before[t + 1] = before[t] + rests[t]);
    let mut out = Vec::new();
    for width in WIDTHS {
        let m = ((width / dt) as usize).max(3);
        if m > nodes {
            continue;
        }
        let shape = raised_cosine(m);
        let match_at = |i: usize| shape.iter().zip(&scores[i..]).map(|(a, b)| a * b).sum::<f64>().abs();
        let all: Vec<f64> = (0..=nodes - m).map(match_at).collect();
        let rests = |i: usize| before[i + m] - before[i] > 0.5 * m as f64;
        let at_rest = all.iter().enumerate().map(|(i, z)| if rests(i) { *z } else { 0.0 }).collect();
        for mut z in [all, at_rest] {
            for _ in 0..PLACES {
                let top = (0..z.len()).fold(0, |a, b| if z[b] > z[a] { b } else { a });
                let place = [top as f64 * dt, width];
                if z[top] > 0.0 && !out.contains(&place) {
                    out.push(place);
                }
                let end = (top + m / 2).min(z.len());
                z[top.saturating_sub(m / 2)..end].fill(0.0);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In motion scores are ten times as large.
    #[test]
    fn a_push_at_rest_is_among_the_places_however_loud_motion_is() {
        let (dt, nodes) = (5e-3, 2000);
        let moves = |t: usize| !(800..1400).contains(&t);
        let mut seed = 5u64;
        let mut draw = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut scores: Vec<f64> = (0..nodes).map(|t| draw() * if moves(t) { 10.0 } else { 0.1 }).collect();
        let push = raised_cosine(110);
        scores[1000..1110].iter_mut().zip(&push).for_each(|(s, p)| *s += 0.2 * p);
        let rests: Vec<f64> = (0..nodes).map(|t| f64::from(u8::from(!moves(t)))).collect();
        let near = |places: &[[f64; 2]]| {
            places.iter().any(|[begin, width]| (begin + 0.5 * width - 5.275).abs() < 0.1 && *width > 0.3)
        };
        assert!(near(&best_places(&scores, &rests, dt)));
        // Of all alone it is none.
        assert!(!near(&best_places(&scores, &vec![0.0; nodes], dt)));
    }
}
