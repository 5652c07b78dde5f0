//! What was measured and simulated, and the gap as figures.

use super::ChannelTrace;
use crate::engine::problem::Compared;
use crate::engine::replay::ReplayedReadings;
use crate::floor;
use crate::outcome::{ChannelRms, GapReport, HeldOutGap, WindowGap};

pub(super) fn traces(
    runs: &[Compared],
    shown: [&ReplayedReadings; 3],
    floors: &[Vec<f64>],
) -> Vec<ChannelTrace> {
    let mut all = Vec::new();
    for (r, run) in runs.iter().enumerate() {
        for (c, channel) in run.run.channels.iter().enumerate() {
            all.push(ChannelTrace {
                recording: run.run.name.clone(),
                channel: channel.name.clone(),
                time: channel.t.clone(),
                measured: channel.y.clone(),
                before: shown[0][r][c].clone(),
                tuned: shown[1][r][c].clone(),
                after: shown[2][r][c].clone(),
                floor: floors[r][c],
            });
        }
    }
    all
}

/// Simulations of recordings over windows: nominal, refitted, with what is claimed; and what noise leaves.
pub(super) struct WindowedGap {
    /// Length of a window, s.
    pub seconds: f64,
    /// Readings by recording and channel.
    pub shown: [ReplayedReadings; 3],
    /// Deviations by recording and channel.
    pub floors: Vec<Vec<f64>>,
}

fn figures(traces: &[ChannelTrace], seed: u64) -> floor::Gaps {
    fn of(t: &ChannelTrace) -> floor::ReplayedChannel<'_> {
        floor::ReplayedChannel {
            recording: &t.recording,
            channel: &t.channel,
            measured: &t.measured,
            before: &t.before,
            tuned: &t.tuned,
            after: &t.after,
            floor: t.floor,
        }
    }
    floor::gaps(&traces.iter().map(of).collect::<Vec<_>>(), seed)
}

/// RMS of a channel over its recordings.
fn rms(traces: &[ChannelTrace], channel: &str, unit: &str) -> Option<ChannelRms> {
    let own = || traces.iter().filter(|t| t.channel == channel);
    let readings: usize = own().map(|t| t.measured.len()).sum();
    let missed = |of: fn(&ChannelTrace) -> &[f64]| {
        let squares = own().flat_map(|t| of(t).iter().zip(&t.measured)).map(|(x, m)| (x - m).powi(2));
        (squares.sum::<f64>() / readings as f64).sqrt()
    };
    let noise: f64 = own().map(|t| t.measured.len() as f64 * t.floor.powi(2)).sum();
    (readings > 0).then(|| ChannelRms {
        unit: unit.into(),
        before: missed(|t| &t.before),
        tuned: missed(|t| &t.tuned),
        after: missed(|t| &t.after),
        floor: (noise / readings as f64).sqrt(),
    })
}

impl WindowedGap {
    /// By recording and channel.
    pub(super) fn traces(&self, runs: &[Compared]) -> Vec<ChannelTrace> {
        let [before, tuned, after] = &self.shown;
        traces(runs, [before, tuned, after], &self.floors)
    }
}

/// Gaps of whole recordings, with those over windows of so many seconds, and of the twists of transmissions; `unit`: of a channel.
pub(super) fn gap_report(
    [traces, twists]: [&[ChannelTrace]; 2],
    windowed: Option<(f64, &[ChannelTrace])>,
    seed: u64,
    unit: &dyn Fn(&str) -> String,
) -> GapReport {
    let found = figures(traces, seed);
    let windows = windowed.map(|(seconds, traces)| (seconds, figures(traces, seed)));
    let window = |of: &dyn Fn(&floor::Gaps) -> Option<floor::GapShares>| {
        let (seconds, gaps) = windows.as_ref()?;
        let floor::GapShares { before, tuned, after, floor, closed, .. } = of(gaps)?;
        let finite = [before, tuned, after, floor].iter().all(|x| x.is_finite());
        finite.then_some(WindowGap { seconds: *seconds, before, tuned, after, floor, closed })
    };
    let of = |g: &floor::GapShares, window, rms| {
        let floor::GapShares { before, tuned, after, floor, closed, ci95 } = *g;
        HeldOutGap { before, tuned, after, floor, closed, ci95, window, rms }
    };
    let channel = |(name, g): &(String, floor::GapShares)| {
        let own = window(&|gaps| gaps.channels.iter().find(|c| c.0 == *name).map(|c| c.1));
        (name.clone(), of(g, own, rms(traces, name, &unit(name))))
    };
    let twist =
        |(name, g): &(String, floor::GapShares)| (name.clone(), of(g, None, rms(twists, name, "rad")));
    GapReport {
        overall: found.overall.as_ref().map(|g| of(g, window(&|gaps| gaps.overall), None)),
        channels: found.channels.iter().map(channel).collect(),
        derived: figures(twists, seed).channels.iter().map(twist).collect(),
        left_out: found.left_out,
    }
}
