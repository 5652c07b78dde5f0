//! What was measured and simulated, and the gap as figures.

use super::ChannelTrace;
use crate::engine::problem::Compared;
use crate::engine::replay::ReplayedReadings;
use crate::floor;
use crate::outcome::{GapReport, HeldOutGap, WindowGap};

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

/// Gaps of whole recordings, with those over windows.
pub(super) fn gap_report(
    runs: &[Compared],
    traces: &[ChannelTrace],
    windowed: Option<&WindowedGap>,
    seed: u64,
) -> GapReport {
    let found = figures(traces, seed);
    let windows = windowed.map(|w| {
        let [before, tuned, after] = &w.shown;
        (w.seconds, figures(&self::traces(runs, [before, tuned, after], &w.floors), seed))
    });
    let window = |of: &dyn Fn(&floor::Gaps) -> Option<floor::GapShares>| {
        let (seconds, gaps) = windows.as_ref()?;
        let floor::GapShares { before, tuned, after, floor, closed, .. } = of(gaps)?;
        let finite = [before, tuned, after, floor].iter().all(|x| x.is_finite());
        finite.then_some(WindowGap { seconds: *seconds, before, tuned, after, floor, closed })
    };
    let of = |g: &floor::GapShares, window| HeldOutGap {
        before: g.before,
        tuned: g.tuned,
        after: g.after,
        floor: g.floor,
        closed: g.closed,
        ci95: g.ci95,
        window,
    };
    let channel = |(name, g): &(String, floor::GapShares)| {
        let own = window(&|gaps| gaps.channels.iter().find(|c| c.0 == *name).map(|c| c.1));
        (name.clone(), of(g, own))
    };
    GapReport {
        overall: found.overall.as_ref().map(|g| of(g, window(&|gaps| gaps.overall))),
        channels: found.channels.iter().map(channel).collect(),
        left_out: found.left_out,
    }
}
