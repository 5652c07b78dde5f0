//! A drive along a recording, and what else it could have done with its command.

use std::rc::Rc;

use trueup_estimation::innovations::intake::RecordedInput;
use trueup_estimation::innovations::trajectory::nodes::TrajectoryNodes;

/// The place of a drive's command.
#[derive(Clone, Debug)]
enum DriveCommand {
    /// An input as it was recorded.
    Recorded(RecordedInput),
    /// An input of the nodes of a chain, by index.
    OfNodes(Rc<TrajectoryNodes>, usize),
}

/// A drive along a recording. Series have one value a part of a step.
#[derive(Clone, Debug)]
pub struct DriveAlong {
    /// Torque per unit of the command.
    pub gain: f64,
    /// Means of the command.
    pub means: Vec<f64>,
    /// Part of a step, s.
    part: f64,
    command: Option<DriveCommand>,
}

impl DriveAlong {
    /// Of an input with these means over steps of `step` s; `None`: it was not recorded.
    pub fn recorded(gain: f64, means: Vec<f64>, step: f64, input: Option<RecordedInput>) -> Self {
        Self { gain, means, part: step, command: input.map(DriveCommand::Recorded) }
    }
    /// Of input `input` of nodes, whose unit is a torque of `gain`, in parts of `part` s.
    pub fn of_nodes(nodes: &Rc<TrajectoryNodes>, input: usize, gain: f64, part: f64) -> Self {
        let places = (0..nodes.len()).flat_map(|t| (0..nodes.parts).map(move |p| (t, p)));
        let means = places.map(|(t, p)| nodes.torque(t, p)[input]).collect();
        Self { gain, means, part, command: Some(DriveCommand::OfNodes(nodes.clone(), input)) }
    }

    /// Means of the command a dead time earlier, s.
    pub fn delayed(&self, delay: f64) -> Vec<f64> {
        match &self.command {
            Some(DriveCommand::Recorded(i)) => i.delayed(delay),
            Some(DriveCommand::OfNodes(nodes, input)) => nodes.late_torque(*input, delay),
            None => self.means.clone(),
        }
    }
    /// Means of the command after `lags` first-order lags of this time constant, s: x follows (i - x) / T, mean of x = mean of
    /// i - T (rise of x) / part.
    pub fn lagged(&self, lag: f64, lags: usize) -> Vec<f64> {
        let kept = (-self.part / lag).exp();
        let mut means = self.means.clone();
        for _ in 0..lags {
            let mut x = means.first().copied().unwrap_or(0.0);
            for m in &mut means {
                let next = (1.0 - kept) * *m + kept * x;
                *m -= lag * (next - x) / self.part; // (COL-2)
                x = next;
            }
        }
        means
    }
    /// Means of the command within a limit.
    pub fn limited(&self, limit: f64) -> Vec<f64> {
        let within = |u: &[f64]| u.iter().map(|u| u.clamp(-limit, limit)).collect::<Vec<_>>();
        match &self.command {
            Some(DriveCommand::Recorded(i)) => i.means_of(&within(&i.values)),
            _ => within(&self.means),
        }
    }
}
