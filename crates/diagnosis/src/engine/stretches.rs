//! Free runs over stretches of the recordings for fitting, each from a first state of its own (multiple shooting without
//! continuity): the evidence where balances contain no information and a free run over a whole recording diverges.

use std::ops::Range;

use super::coordinate::median_step;
use super::kept::SearchMemory;
use super::problem::Compared;
use super::recordings::{PreparedCase, first_states};
use super::search::{CaseSearch, FittedSet};
use trueup_identification::run::IdentificationRun;

/// Length of a stretch, s,
pub(super) const LENGTH: f64 = 1.0;
/// and readings of a channel that it has at least.
const READINGS: f64 = 200.0;

/// A case whose recordings for fitting are stretches of those of another.
#[derive(Debug)]
pub struct Stretches {
    case: PreparedCase,
}

impl Stretches {
    /// Of a search; `None`: its recordings are too short to be cut.
    pub fn of(search: &CaseSearch<'_>) -> Option<Self> {
        let whole = &search.case.train;
        let train: Vec<Compared> = whole.iter().flat_map(|c| search.case.cut(c)).collect();
        let case = PreparedCase { train, ..search.case.clone() };
        (case.train.len() > whole.len()).then_some(Self { case })
    }

    /// The search over them, where nothing is prescribed: typical sizes are those of all, causes those that act all along.
    pub fn search<'a>(&'a self, all: &CaseSearch<'_>) -> CaseSearch<'a> {
        let causes = all.causes.iter().filter(|h| h.is_alike_in_all() && !h.is_push()).cloned().collect();
        let (sizes, drifting_starts) = (all.sizes.clone(), all.drifting_starts.clone());
        CaseSearch {
            case: &self.case,
            sizes,
            causes,
            prescribed: Vec::new(),
            expected: Vec::new(),
            drifting_starts,
            memory: SearchMemory::default(),
        }
    }
}

impl PreparedCase {
    /// A recording in stretches, or as it is.
    fn cut(&self, whole: &Compared) -> Vec<Compared> {
        let pieces = pieces(&whole.run);
        if pieces.len() < 2 {
            return vec![whole.clone()];
        }
        let begins = |run: &IdentificationRun| {
            if run.start == whole.run.start {
                return whole.known.clone();
            }
            first_states(&self.subject, &self.model, &self.nominal, &self.coordinates, run)
        };
        let ready =
            |run: IdentificationRun| Compared::new(run.clone(), begins(&run), self.model.sizes().inputs);
        pieces.into_iter().map(ready).collect()
    }
}

/// A recording in stretches of even length, which keep its time.
fn pieces(whole: &IdentificationRun) -> Vec<IdentificationRun> {
    let channels = || whole.channels.iter();
    let step = channels().filter_map(|c| median_step(&c.t)).fold(0.0, f64::max);
    let end = channels().filter_map(|c| c.t.last()).fold(whole.start, |a, t| a.max(*t));
    let span = end - whole.start;
    let count = (span / LENGTH.max(READINGS * step)).floor().max(1.0);
    let edge = |k: f64| if k < count { whole.start + span * k / count } else { f64::INFINITY };
    let piece = |k: f64| {
        let mut run = part(whole, edge(k)..edge(k + 1.0));
        run.name = format!("{} from {} s", run.name, run.start);
        run
    };
    (0..count as u32).map(|k| piece(f64::from(k))).collect()
}

/// The readings of a recording within these times, with its inputs and its name; it begins where they do.
pub(super) fn part(whole: &IdentificationRun, within: Range<f64>) -> IdentificationRun {
    let first = whole.start == within.start;
    let mut run = IdentificationRun { start: within.start, at_rest: whole.at_rest && first, ..whole.clone() };
    for c in &mut run.channels {
        let kept = c.t.partition_point(|t| *t < within.start)..c.t.partition_point(|t| *t < within.end);
        c.t = c.t[kept.clone()].to_vec();
        c.y = c.y[kept.clone()].to_vec();
        c.spread = c.spread.get(kept).unwrap_or_default().to_vec();
    }
    run
}

impl FittedSet {
    /// The unknowns of all recordings, without those of each.
    pub fn of_all(&self) -> Self {
        let mut own = self.clone();
        own.stated.unknowns.iter_mut().filter(|u| u.run.is_some()).for_each(|u| u.run = Some(usize::MAX));
        own
    }
}

#[cfg(test)]
mod tests {
    use super::pieces;
    use trueup_identification::run::{IdentificationRun, OutputChannel};

    fn run(seconds: f64, step: f64) -> IdentificationRun {
        let t: Vec<f64> = (0..=(seconds / step).round() as u32).map(|k| 2.0 + f64::from(k) * step).collect();
        let own = OutputChannel { y: t.clone(), spread: t.clone(), t: t.clone(), ..OutputChannel::default() };
        // Read four times a second, and counted in full.
        let slow = OutputChannel {
            t: t.iter().copied().filter(|t| (t * 4.0).fract() < 1e-9).collect(),
            ..OutputChannel::default()
        };
        let slow = OutputChannel { y: slow.t.clone(), ..slow };
        IdentificationRun {
            name: "a.csv".into(),
            channels: vec![own, slow],
            start: 2.0,
            at_rest: true,
            ..IdentificationRun::default()
        }
    }

    /// Every reading is in one stretch, each begins where the last ended, none is shorter than a second.
    #[test]
    fn stretches_have_all_readings_once() {
        let all = pieces(&IdentificationRun {
            channels: vec![run(3.5, 0.002).channels.remove(0)],
            ..run(3.5, 0.002)
        });
        assert_eq!(all.iter().map(|r| r.name.as_str()).collect::<Vec<_>>().len(), 3);
        let t: Vec<f64> = all.iter().flat_map(|r| r.channels[0].t.clone()).collect();
        assert_eq!(t, run(3.5, 0.002).channels[0].t);
        for r in &all {
            let c = &r.channels[0];
            assert!(c.t[0] >= r.start && c.t[0] < r.start + 0.002 && c.y == c.t && c.spread == c.t);
            assert!(c.t.len() >= 500);
        }
        assert_eq!(all.iter().map(|r| r.at_rest).collect::<Vec<_>>(), [true, false, false]);
        assert_eq!(all[1].name, format!("a.csv from {} s", 2.0 + 3.5 / 3.0));
    }

    /// What is read slowly needs longer stretches: 200 readings of the slowest channel.
    #[test]
    fn slow_channels_make_long_stretches() {
        assert_eq!(pieces(&run(99.0, 0.01)).len(), 1);
        let all = pieces(&run(101.0, 0.01));
        assert_eq!(all.iter().map(|r| r.channels[1].t.len()).collect::<Vec<_>>(), [202, 203]);
        assert!(all[0].channels[1].spread.is_empty());
    }
}
