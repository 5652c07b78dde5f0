//! What was measured and simulated, and the gap as figures.

use super::Trace;
use crate::engine::problem::Compared;
use crate::engine::replay::Replayed;
use crate::floor;
use crate::outcome::{Gap, GapReport};

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

fn replayed(traces: &[Trace]) -> Vec<floor::Replayed<'_>> {
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
    traces.iter().map(of).collect()
}

pub(super) fn gap_report(traces: &[Trace], seed: u64) -> GapReport {
    let found = floor::gaps(&replayed(traces), seed);
    let of = |g: &floor::Gap| Gap {
        before: g.before,
        tuned: g.tuned,
        after: g.after,
        floor: g.floor,
        closed: g.closed,
        ci95: g.ci95,
    };
    GapReport {
        overall: found.overall.as_ref().map(of),
        channels: found.channels.iter().map(|(name, g)| (name.clone(), of(g))).collect(),
        left_out: found.left_out,
    }
}
