//! Impulses on a chain, at the same times in all recordings or in each by itself: matched filter of the scores, then evidence.

use trueup_estimation::innovations::column::AppliedLaw;
use trueup_estimation::innovations::numeric::median;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::nodes::START;

use super::candidate::ScreenedShape;
use super::chain_effect::LatentLevels;
use super::chain_fits::{ChainFits, scored};
use super::chain_form::EffectForm;
use super::chain_screen::{chain_bank, chain_screening};
use super::laws::ARM_PUSHES;
use super::levels::CHAIN_SEARCH;
use super::pushes::{neighbours, raised_cosine};
use super::screen::Screening;
use super::shape::LawShape;

/// Widths that are looked for, s, and places of each.
const WIDTHS: ([f64; 4], usize) = ([0.12, 0.25, 0.45, 0.8], 3);
/// Most impulses: in all recordings, and in one.
const MOST: [usize; 2] = [4, 3];
/// Steps of begin (in widths) and factors of width of the refinement.
const STEPS: [[f64; 2]; 3] = [[0.5, 1.5], [0.25, 1.25], [0.1, 1.1]];

/// A place that may be pushed, and its joint.
pub type PushedPlace = (&'static str, usize);

/// Places of a chain with latent forces above their floors.
fn pushed_places(frame: &TrajectoryFrame, q: &[f64]) -> Vec<PushedPlace> {
    let plant = &frame.plant;
    let strong: Vec<bool> =
        LatentLevels::of(frame, q).forces.iter().map(|h| *h > CHAIN_SEARCH.left).collect();
    let mut all = Vec::new();
    if plant.floats() && strong.iter().take(3).any(|s| *s) {
        all.push(("base", 0));
    }
    if strong.iter().any(|s| *s) {
        all.push(("tip", 0));
    }
    all.extend((0..plant.drives.len()).filter(|j| strong[plant.drives[*j]]).map(|j| ("actuator", j)));
    let loads = (0..plant.drives.len()).filter(|j| plant.flexible(*j) && strong[plant.joints[*j]]);
    all.extend(loads.map(|j| ("load", j)));
    all
}

/// Impulses that were found, and the nats that they gain with their priors.
#[derive(Default)]
struct FoundPulses {
    pulses: Vec<[f64; 2]>,
    gain: f64,
}

impl ChainFits<'_> {
    /// The same without those whose impulses are known.
    pub(super) fn pushed_places(&self, frame: &TrajectoryFrame, q: &[f64]) -> Vec<PushedPlace> {
        let mut all = pushed_places(frame, q);
        all.retain(|(place, joint)| !self.is_known(ARM_PUSHES.id(), place, &[*joint]));
        all
    }
}

fn shape_of((place, joint): PushedPlace, pulses: Vec<[f64; 2]>) -> LawShape {
    LawShape { pulses, ..LawShape::new(place, "pulses", &[]) }.at(&[joint])
}

/// Recordings in which impulses are looked for, on one place after the other.
struct PushedRecordings {
    /// With the scores in addition to the laws that are fitted.
    frame: TrajectoryFrame,
    standing: Vec<AppliedLaw>,
    screening: Screening,
    /// Evidence without impulses.
    alone: f64,
    /// Most impulses.
    most: usize,
}

impl PushedRecordings {
    fn new(
        frame: &TrajectoryFrame,
        q: &[f64],
        standing: &[AppliedLaw],
        recordings: &[usize],
        most: usize,
    ) -> Self {
        let mut frame = frame.of_recordings(recordings);
        let some = |law: &AppliedLaw| {
            let of = |c: &Vec<_>| recordings.iter().map(|k| Clone::clone(&c[*k])).collect();
            AppliedLaw { columns: law.columns.iter().map(of).collect(), ..law.clone() }
        };
        let standing: Vec<AppliedLaw> = standing.iter().map(some).collect();
        let mut screening = chain_screening(&mut frame, &standing);
        let alone = screening.look(&frame, &mut [], &chain_bank(&frame, q, &[1.0, 0.3, 0.1]));
        scored(&mut frame, q, &standing);
        Self { frame, standing, screening, alone, most }
    }
}

/// Where impulses are looked for in addition to the laws that are fitted: in all recordings, and in each alone.
pub struct PushSearch {
    q: Vec<f64>,
    together: PushedRecordings,
    each: Vec<PushedRecordings>,
}

impl PushSearch {
    /// At these intensities.
    pub fn new(frame: &TrajectoryFrame, q: &[f64], standing: &[AppliedLaw]) -> Self {
        let all: Vec<usize> = (0..frame.runs.len()).collect();
        let of = |some: &[usize], most: usize| PushedRecordings::new(frame, q, standing, some, most);
        let each = all.iter().map(|k| of(&[*k], MOST[1])).collect();
        Self { q: q.to_vec(), together: of(&all, MOST[0]), each }
    }

    /// The impulses on a place that explain most.
    pub fn on(&mut self, fits: &ChainFits<'_>, place: PushedPlace) -> Option<EffectForm> {
        let together = fits.pursue(&mut self.together, &self.q, place);
        let alone: Vec<FoundPulses> =
            self.each.iter_mut().map(|one| fits.pursue(one, &self.q, place)).collect();
        let mut shape = shape_of(place, together.pulses);
        if alone.iter().map(|a| a.gain).sum::<f64>() > together.gain {
            shape.pulses = alone.iter().flat_map(|a| a.pulses.clone()).collect();
            shape.only = alone.iter().enumerate().flat_map(|(k, a)| vec![k; a.pulses.len()]).collect();
        }
        (!shape.pulses.is_empty()).then(|| EffectForm::new(ARM_PUSHES, shape))
    }
}

impl ChainFits<'_> {
    fn pursue(&self, of: &mut PushedRecordings, q: &[f64], place: PushedPlace) -> FoundPulses {
        let PushedRecordings { frame, standing, screening, alone, most } = of;
        let (mut last, mut best): (f64, Option<ScreenedShape>) = (*alone, None);
        let made = |z: &TrajectoryFrame, sets: Vec<Vec<[f64; 2]>>| -> Vec<ScreenedShape> {
            self.along(z, |along| {
                let one = |p| ScreenedShape::new(ARM_PUSHES, along, shape_of(place, p));
                sets.into_iter().filter_map(one).collect()
            })
        };
        let [least, share] = CHAIN_SEARCH.push;
        // Further impulses are looked for in the scores in addition to the first ones.
        let mut beside: Option<TrajectoryFrame> = None;
        for _ in 0..*most {
            let mine = best.as_ref().map_or_else(Vec::new, |b| b.shape.pulses.clone());
            let own = best.as_ref().map_or_else(|| q.to_vec(), |b| b.intensities.clone());
            if let Some(b) = &best {
                let laws: Vec<AppliedLaw> = standing.iter().chain([&b.terms.applied]).cloned().collect();
                scored(beside.get_or_insert_with(|| frame.clone()), &own, &laws);
            }
            let z = beside.as_ref().unwrap_or(frame);
            let with = |p: [f64; 2]| [&mine[..], &[p]].concat();
            let mut all = made(z, self.matched(z, place).into_iter().map(with).collect());
            screening.look(z, &mut all, &chain_bank(z, &own, &[1.0, 0.2]));
            let found = all.into_iter().filter(ScreenedShape::is_possible).reduce(ScreenedShape::or_better);
            let Some(mut found) = found.filter(|b| b.evidence >= last + share * least) else { break };
            for step in STEPS {
                let Some(pulse) = found.shape.pulses.last().copied() else { break };
                let mut all = made(z, neighbours(pulse, step).into_iter().map(with).collect());
                screening.look(z, &mut all, &[found.intensities.clone()]);
                found = all.into_iter().fold(found, ScreenedShape::or_better);
            }
            if found.evidence < last + least {
                break;
            }
            last = found.evidence;
            best = Some(found);
        }
        let pulses = best.map_or_else(Vec::new, |b| b.shape.pulses);
        let gain = last - *alone - CHAIN_SEARCH.each_push * pulses.len() as f64;
        FoundPulses { pulses, gain }
    }

    /// Begin and width of raised cosines that match the scores of a place best.
    fn matched(&self, frame: &TrajectoryFrame, (place, joint): PushedPlace) -> Vec<[f64; 2]> {
        let Some(longest) = frame.runs.iter().max_by_key(|r| r.nodes.len()) else { return Vec::new() };
        let (dt, nodes) = (median(longest.nodes.step.clone()), longest.nodes.len());
        let width = frame.coordinates() + frame.channels();
        let axes = match place {
            "base" => 3,
            "tip" => frame.plant.tip_axes(),
            _ => 1,
        };
        let mut sums = vec![vec![0.0; nodes]; axes];
        self.along(frame, |along| {
            for (k, r) in frame.runs.iter().enumerate() {
                let score = |t: usize, c: usize| r.scores.get(width * t + c).copied().unwrap_or(0.0);
                for (axis, sum) in sums.iter_mut().enumerate() {
                    let tip = along.mechanics.filter(|_| place == "tip").and_then(|m| m.tip(k, axis));
                    let of = |t: usize| match place {
                        "base" => frame.usual_force[axis] * score(t, axis),
                        "tip" => tip
                            .iter()
                            .flat_map(|j| j.iter().enumerate())
                            .map(|(c, j)| j[t] * score(t, c))
                            .sum(),
                        "actuator" => score(t, frame.plant.drives[joint]),
                        _ => score(t, frame.plant.joints[joint]),
                    };
                    sum.iter_mut().take(r.nodes.len()).enumerate().for_each(|(t, s)| *s += of(t));
                }
            }
        });
        let settled = ((START / dt) as usize).min(nodes);
        for sum in &mut sums {
            sum[..settled].fill(0.0);
            if place != "base" {
                let size = (sum.iter().map(|s| s * s).sum::<f64>() / nodes as f64).sqrt() + 1e-300;
                sum.iter_mut().for_each(|s| *s /= size);
            }
        }
        let mut out = Vec::new();
        for width in WIDTHS.0 {
            let m = ((width / dt) as usize).max(2);
            if m > nodes {
                continue;
            }
            let bump = raised_cosine(m);
            let at = |i: usize| -> f64 {
                sums.iter().map(|s| bump.iter().zip(&s[i..]).map(|(b, s)| b * s).sum::<f64>().powi(2)).sum()
            };
            let mut power: Vec<f64> = (0..=nodes - m).map(at).collect();
            for _ in 0..WIDTHS.1 {
                let top = (0..power.len()).fold(0, |a, b| if power[b] > power[a] { b } else { a });
                out.push([longest.nodes.time[top] - longest.nodes.time[0], width]);
                let end = (top + m / 2 + 1).min(power.len());
                power[top.saturating_sub(m / 2)..end].fill(0.0);
            }
        }
        out
    }
}
