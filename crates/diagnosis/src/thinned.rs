//! Large recordings on a thinned grid: memory and time grow with readings, what is learnt of a slow mechanism does not.

use std::borrow::Cow;

use crate::outcome::{NoticedMistake, OutcomeSeverity};
use trueup_models::effect::PlantKind;
use trueup_signals::{Channel, Interpolation, Loaded, SensorData};

/// Readings of a channel, in all recordings for fitting, that are taken as they are. 200 s at 200 Hz are fewer.
const MOST: usize = 40_000;
/// s; no coarser: a joint's spring and an arm's are seen still.
const COARSEST: [f64; 2] = [0.008, 0.02];

/// How a case was thinned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thinning {
    /// Of so many readings one is taken.
    pub every: usize,
    /// Readings a second that are left.
    pub rate: f64,
}

impl Thinning {
    /// The finding on it.
    #[must_use]
    pub fn finding(self) -> NoticedMistake {
        let Self { every, rate } = self;
        let ending = match every {
            2 => "nd",
            3 => "rd",
            _ => "th",
        };
        NoticedMistake {
            severity: OutcomeSeverity::Note,
            kind: "thinned".into(),
            file: "case.toml".into(),
            line: None,
            channel: None,
            text: format!(
                "the recordings are large: every {every}{ending} reading of the outputs is taken ({rate:.0} a second), and lines of the inputs that are nearest to all; --all-readings takes all of them, with that many times the memory and the time"
            ),
        }
    }
}

/// The same case with every n-th reading of its outputs, and lines of its inputs that are nearest to all; as it is where it is small.
#[must_use]
pub fn thinned<'a>(
    loaded: &'a Loaded,
    plant: PlantKind,
    inputs: &[String],
) -> (Cow<'a, Loaded>, Option<Thinning>) {
    let is_input = |c: &Channel| inputs.contains(&c.name);
    let outputs = || loaded.train().into_iter().flat_map(|r| &r.channels).filter(|c| !is_input(c));
    let names = outputs().map(|c| &c.name);
    let count = |name: &String| outputs().filter(|c| c.name == *name).map(Channel::len).sum::<usize>();
    let most = names.map(count).max().unwrap_or(0);
    let step = outputs().filter_map(Channel::median_step).fold(f64::INFINITY, f64::min);
    let coarsest = COARSEST[usize::from(plant == PlantKind::Arm)];
    let every = most.div_ceil(MOST).min((coarsest / step * (1.0 + 1e-9)) as usize);
    if every < 2 {
        return (Cow::Borrowed(loaded), None);
    }
    let mut own = loaded.clone();
    for c in own.recordings.values_mut().flat_map(|r| &mut r.channels) {
        // A channel that is slow by itself stays.
        let own = c.median_step().map_or(1, |own| (every as f64 * step / own * (1.0 + 1e-9)) as usize);
        match (own, is_input(c)) {
            (..2, _) => {}
            (every, true) => *c = averaged(c, every),
            (every, false) => *c = decimated(c, every),
        }
    }
    (Cow::Owned(own), Some(Thinning { every, rate: 1.0 / (every as f64 * step) }))
}

/// Every n-th sample.
fn decimated(c: &Channel, every: usize) -> Channel {
    let of = |list: &[f64]| list.iter().step_by(every).copied().collect();
    Channel { time: of(&c.time), values: of(&c.values), ..c.clone() }
}

/// Lines between every n-th sample (of a held input: means from one to the next). White noise is as much smaller.
fn averaged(c: &Channel, every: usize) -> Channel {
    let mut kept: Vec<usize> = (0..c.len()).step_by(every).collect();
    if kept.last().is_some_and(|last| last + 1 < c.len()) {
        kept.push(c.len() - 1);
    }
    let time = kept.iter().map(|k| c.time[*k]).collect();
    let values = match c.interpolation {
        Interpolation::Hold => held(c, &kept),
        Interpolation::Linear => lines(c, &kept),
    };
    let noise = c.sensor.deviation().map(|d| d / (every as f64).sqrt());
    let sensor = SensorData { noise, resolution: None, ..c.sensor.clone() };
    Channel { time, values, sensor, ..c.clone() }
}

/// Means from each of these samples to the next.
fn held(c: &Channel, kept: &[usize]) -> Vec<f64> {
    let (t, x) = (&c.time, &c.values);
    let end = |i: usize| kept.get(i + 1).copied().unwrap_or(c.len() - 1);
    let mean = |(i, &from): (usize, &usize)| {
        let whole: f64 = (from..end(i)).map(|k| x[k] * (t[k + 1] - t[k])).sum();
        if end(i) > from { whole / (t[end(i)] - t[from]) } else { x[from] }
    };
    kept.iter().enumerate().map(mean).collect()
}

/// Lines between these samples that are nearest to all (least squares): means alone would make a tone smaller.
fn lines(c: &Channel, kept: &[usize]) -> Vec<f64> {
    let (t, x) = (&c.time, &c.values);
    let n = kept.len();
    // Normal equations: diagonal, off-diagonal, right-hand side.
    let (mut own, mut next, mut right) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut i = 0;
    for k in 0..c.len() {
        while i + 2 < n && kept[i + 1] <= k {
            i += 1;
        }
        let share = (t[k] - t[kept[i]]) / (t[kept[i + 1]] - t[kept[i]]);
        let weights = [1.0 - share, share];
        for (w, at) in weights.into_iter().zip([i, i + 1]) {
            own[at] += w * w;
            right[at] += w * x[k];
        }
        next[i] += weights[0] * weights[1];
    }
    for i in 1..n {
        let factor = next[i - 1] / own[i - 1];
        own[i] -= factor * next[i - 1];
        right[i] -= factor * right[i - 1];
    }
    for i in (0..n).rev() {
        let after = if i + 1 < n { next[i] * right[i + 1] } else { 0.0 };
        right[i] = (right[i] - after) / own[i];
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn channel(n: usize, interpolation: Interpolation) -> Channel {
        let time: Vec<f64> = (0..n).map(|k| 0.002 * k as f64).collect();
        let values = time.iter().map(|t| (3.0 * t).sin() + t).collect();
        let mut c = Channel::new("motorCurrent", "A", time, values);
        c.interpolation = interpolation;
        c.sensor =
            SensorData { noise: Some(0.3), resolution: Some(0.4 * 12f64.sqrt()), ..SensorData::default() };
        c
    }

    fn impulse(c: &Channel, until: f64) -> f64 {
        let mut cursor = c.cursor();
        let fine = 20_000;
        (0..fine).map(|k| cursor.at((f64::from(k) + 0.5) * until / f64::from(fine))).sum::<f64>() * until
            / f64::from(fine)
    }

    /// Of a tone of 5 Hz at 125 a second lines miss no more than what they must, (w h)^2/16, and their noise is half.
    #[test]
    fn lines_keep_tones_and_less_noise() {
        let mut tone = channel(5001, Interpolation::Linear);
        let w = 10.0 * std::f64::consts::PI;
        tone.values = tone.time.iter().map(|t| (w * t).sin()).collect();
        let few = averaged(&tone, 4);
        let off = tone.time.iter().zip(&tone.values).map(|(t, x)| (few.at(*t) - x).abs());
        let most = off.fold(0.0, f64::max);
        assert!(most < (w * 0.008).powi(2) / 12.0, "{most:e}");
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        tone.values.iter_mut().for_each(|x| *x = rng.sample(rand_distr::StandardNormal));
        let noise = averaged(&tone, 4);
        // What it does to a motion: its mean over a tenth of a second.
        let power = |c: &Channel, per: usize| {
            let means = c.values.chunks(per).map(|part| part.iter().sum::<f64>() / part.len() as f64);
            means.map(|m| m * m).sum::<f64>() / (c.len() / per) as f64
        };
        let ratio = power(&noise, 12) / power(&tone, 48);
        assert!((ratio - 1.0).abs() < 0.25, "{ratio}");
    }

    #[test]
    fn means_keep_the_impulse_and_less_noise() {
        for kind in [Interpolation::Linear, Interpolation::Hold] {
            let all = channel(1001, kind);
            let few = averaged(&all, 4);
            assert_eq!((few.len(), few.interpolation), (251, kind));
            for until in [0.8, 1.6, 2.0] {
                let apart = impulse(&all, until) - impulse(&few, until);
                assert!(apart.abs() < 2e-5, "{kind:?} {until}: {apart:e}");
            }
            assert!((few.sensor.deviation().unwrap() - 0.25).abs() < 1e-12);
        }
    }

    #[test]
    fn a_small_case_stays_and_a_large_one_keeps_what_its_springs_need() {
        let case = |seconds: usize| {
            let angle =
                Channel { name: "motorAngle".into(), ..channel(500 * seconds + 1, Interpolation::Linear) };
            let mut run = trueup_signals::Recording { name: "a.csv".into(), ..Default::default() };
            run.channels = vec![channel(500 * seconds + 1, Interpolation::Linear), angle];
            let case = trueup_signals::Case {
                model: "TwoMassJoint".into(),
                train: vec!["a.csv".into()],
                ..Default::default()
            };
            Loaded { case, recordings: [("a.csv".to_owned(), run)].into() }
        };
        let inputs = ["motorCurrent".to_owned()];
        let how = |seconds, plant| thinned(&case(seconds), plant, &inputs).1.map(|t| t.every);
        assert_eq!(how(70, PlantKind::Joint), None);
        assert_eq!(how(100, PlantKind::Joint), Some(2));
        assert_eq!(how(1000, PlantKind::Joint), Some(4), "125 a second");
        assert_eq!(how(1000, PlantKind::Arm), Some(10), "50 a second");
        let large = case(100);
        let (small, _) = thinned(&large, PlantKind::Joint, &inputs);
        let run = &small.recordings["a.csv"];
        assert_eq!(run.channels[1].values[7], large.recordings["a.csv"].channels[1].values[14]);
        assert_eq!(run.channels[1].sensor, large.recordings["a.csv"].channels[1].sensor);
    }
}
