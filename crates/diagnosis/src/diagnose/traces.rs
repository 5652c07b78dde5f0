//! What was measured and simulated, and the gap as figures.

use super::Trace;
use crate::engine::problem::Compared;
use crate::engine::replay::Replayed;
use crate::floor;
use crate::outcome::{Gap, GapReport, WindowGap};

pub(super) fn traces(runs: &[Compared], shown: [&Replayed; 3], floors: &[Vec<f64>]) -> Vec<Trace> {
    let mut all = Vec::new();
    for (r, run) in runs.iter().enumerate() {
        for (c, channel) in run.run.channels.iter().enumerate() {
            all.push(Trace {
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
pub(super) struct Windowed {
    /// Length of a window, s.
    pub seconds: f64,
    /// Readings by recording and channel.
    pub shown: [Replayed; 3],
    /// Deviations by recording and channel.
    pub floors: Vec<Vec<f64>>,
}

fn figures(traces: &[Trace], seed: u64) -> floor::Gaps {
    fn of(t: &Trace) -> floor::Replayed<'_> {
        floor::Replayed {
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

/// Gaps of whole recordings, with those over windows beside them.
pub(super) fn gap_report(
    runs: &[Compared],
    traces: &[Trace],
    windowed: Option<&Windowed>,
    seed: u64,
) -> GapReport {
    let found = figures(traces, seed);
    let windows = windowed.map(|w| {
        let [before, tuned, after] = &w.shown;
        (w.seconds, figures(&self::traces(runs, [before, tuned, after], &w.floors), seed))
    });
    let window = |of: &dyn Fn(&floor::Gaps) -> Option<floor::Gap>| {
        let (seconds, gaps) = windows.as_ref()?;
        let floor::Gap { before, tuned, after, floor, closed, .. } = of(gaps)?;
        let finite = [before, tuned, after, floor].iter().all(|x| x.is_finite());
        finite.then_some(WindowGap { seconds: *seconds, before, tuned, after, floor, closed })
    };
    let of = |g: &floor::Gap, window| Gap {
        before: g.before,
        tuned: g.tuned,
        after: g.after,
        floor: g.floor,
        closed: g.closed,
        ci95: g.ci95,
        window,
    };
    let channel = |(name, g): &(String, floor::Gap)| {
        let own = window(&|gaps| gaps.channels.iter().find(|c| c.0 == *name).map(|c| c.1));
        (name.clone(), of(g, own))
    };
    GapReport {
        overall: found.overall.as_ref().map(|g| of(g, window(&|gaps| gaps.overall))),
        channels: found.channels.iter().map(channel).collect(),
        left_out: found.left_out,
    }
}
