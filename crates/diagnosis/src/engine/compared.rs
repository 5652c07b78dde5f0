//! A recording ready to be compared with a model.

use trueup_identification::predict::PredictionPlan;
use trueup_identification::run::IdentificationRun;

/// Longest step of models that are not affine, in radians (or e-folds) of their fastest mode: an oscillation is behind by 4e-6 of a
/// radian in each one (decision 108).
const RADIANS: f64 = 0.15;
/// A model that needs more steps than this between two readings is too stiff to be looked at.
const MOST_STEPS: f64 = 40.0;

/// A recording ready for the simulation of a plant with `inputs` inputs.
pub(super) fn plan_of(run: &IdentificationRun, inputs: usize) -> PredictionPlan {
    PredictionPlan::new(run, inputs).within(MOST_STEPS).stepping(RADIANS)
}

/// A recording ready to be compared.
#[derive(Clone, Debug)]
pub struct Compared {
    /// Inputs and readings.
    pub run: IdentificationRun,
    /// Parameters that hold for this recording: first states.
    pub known: Vec<(usize, f64)>,
    pub(super) plan: PredictionPlan,
}

impl Compared {
    /// Of a plant with `inputs` inputs.
    pub fn new(run: IdentificationRun, known: Vec<(usize, f64)>, inputs: usize) -> Self {
        let plan = plan_of(&run, inputs);
        Self { run, known, plan }
    }
    /// The first share of it.
    pub fn until(&self, share: f64, inputs: usize) -> Self {
        let mut run = self.run.clone();
        let last = run.channels.iter().filter_map(|c| c.t.last()).fold(run.start, |a, t| a.max(*t));
        let end = run.start + share * (last - run.start);
        for channel in &mut run.channels {
            let kept = channel.t.partition_point(|t| *t <= end);
            channel.t.truncate(kept);
            channel.y.truncate(kept);
            channel.spread.truncate(kept);
        }
        Self::new(run, self.known.clone(), inputs)
    }
    /// How many readings there are.
    pub fn len(&self) -> usize {
        self.plan.len()
    }
    /// None.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

#[cfg(test)]
mod tests {
    use super::Compared;
    use trueup_identification::run::{IdentificationRun, OutputChannel};

    /// Channels may be read at different rates, and a recording may begin late.
    #[test]
    fn the_first_share_of_a_recording_ends_where_that_share_of_its_time_does() {
        let channel = |output, n: u32, h: f64| OutputChannel {
            output,
            t: (0..n).map(|k| 2.0 + f64::from(k) * h).collect(),
            y: (0..n).map(f64::from).collect(),
            spread: vec![1.0; if output == 0 { n as usize } else { 0 }],
            ..OutputChannel::default()
        };
        let run = IdentificationRun {
            channels: vec![channel(0, 11, 1.0), channel(1, 3, 4.0)],
            start: 2.0,
            ..IdentificationRun::default()
        };
        let half = Compared::new(run, vec![(3, 0.5)], 1).until(0.5, 1);
        let kept: Vec<&[f64]> = half.run.channels.iter().map(|c| &*c.y).collect();
        assert_eq!(kept, [&[0.0, 1.0, 2.0, 3.0, 4.0, 5.0][..], &[0.0, 1.0]]);
        assert_eq!([half.run.channels[0].spread.len(), half.run.channels[1].spread.len()], [6, 0]);
        assert_eq!((half.len(), half.known), (8, vec![(3, 0.5)]));
    }
}
