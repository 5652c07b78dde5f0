//! Free runs of any plant or FMU, each recording with first states of its own.

use trueup_identification::fit::{ChannelComparison, FitOptions, compare, search};
use trueup_identification::lsq::Loss;
use trueup_identification::model::SimulatedPlant;
use trueup_identification::output_error::OutputError;
use trueup_identification::predict::PredictError;
use trueup_identification::recorded::nuisance;
use trueup_identification::run::IdentificationRun;
use trueup_identification::subject::IdentificationSubject;
use trueup_signals::Loaded;

use super::ChannelTrace;
use crate::floor;

/// Iterations of the first states of a recording, by its begin and then by all of it: a simulation through an FMU takes long.
const ITERATIONS: [usize; 2] = [8, 1];
/// What is its begin, s.
const BEGIN: f64 = 1.0;

/// Channels of all recordings against their simulation.
pub(super) type FreeReadings = Vec<ChannelComparison>;

/// A plant with the recordings that it is compared with.
#[derive(Clone, Copy)]
pub(super) struct FreeRuns<'a> {
    pub subject: &'a dyn IdentificationSubject,
    pub runs: &'a [IdentificationRun],
}

/// The begin of a recording.
fn begun(run: &IdentificationRun) -> IdentificationRun {
    let mut begun = run.clone();
    for c in &mut begun.channels {
        let few = c.t.partition_point(|t| *t <= run.start + BEGIN).max(10).min(c.t.len());
        c.t.truncate(few);
        c.y.truncate(few);
        c.spread.truncate(few);
    }
    begun
}

/// Recordings cut into windows of so many seconds, each a run that begins by itself; a rest of less than half of one is left out.
pub(super) fn windows(
    plant: &SimulatedPlant,
    runs: &[IdentificationRun],
    seconds: f64,
) -> Vec<IdentificationRun> {
    let mut all = Vec::new();
    for run in runs {
        let ends = run.channels.iter().filter_map(|c| c.t.last().copied());
        let end = ends.fold(run.start, f64::max);
        for k in 0..((end - run.start) / seconds).round().max(1.0) as usize {
            let from = run.start + k as f64 * seconds;
            let mut own = run.clone();
            own.start = from;
            own.at_rest &= k == 0;
            if k > 0 {
                // How the recording begins is not how the window does.
                own.known.retain(|(k, _)| !plant.parameters()[*k].is_initial());
            }
            for c in &mut own.channels {
                let span = c.t.partition_point(|t| *t < from)..c.t.partition_point(|t| *t < from + seconds);
                c.t = c.t[span.clone()].to_vec();
                c.y = c.y[span.clone()].to_vec();
                c.spread = c.spread.get(span).map_or_else(Vec::new, <[f64]>::to_vec);
            }
            own.channels.retain(|c| !c.t.is_empty());
            if !own.is_empty() {
                all.push(own);
            }
        }
    }
    all
}

impl FreeRuns<'_> {
    /// With these parameters; `late`: a channel that shows everything so much later, s.
    pub(super) fn run(
        &self,
        values: &[f64],
        late: Option<(&str, f64)>,
    ) -> Result<FreeReadings, PredictError> {
        let mut runs = self.runs.to_vec();
        if let Some((channel, by)) = late {
            let channels = runs.iter_mut().flat_map(|r| &mut r.channels);
            channels.filter(|c| c.name == channel).for_each(|c| c.delay += by);
        }
        let mut all = Vec::new();
        for (r, run) in runs.iter().enumerate() {
            let begin = begun(run);
            let first = self.search(&begin, values, None, ITERATIONS[0])?;
            let found = match begin.len() < run.len() {
                true => self.search(run, values, Some(first), ITERATIONS[1])?,
                false => first,
            };
            let shown = compare(&self.problem(run, values), &found)?;
            all.extend(shown.into_iter().map(|c| ChannelComparison { run: r, ..c }));
        }
        Ok(all)
    }

    fn problem<'a>(&'a self, run: &'a IdentificationRun, values: &[f64]) -> OutputError<'a> {
        let alone = std::slice::from_ref(run);
        OutputError::new(self.subject, values, alone, nuisance(self.subject, values, alone))
    }

    /// First states of a recording, from these.
    fn search(
        &self,
        run: &IdentificationRun,
        values: &[f64],
        from: Option<Vec<f64>>,
        iterations: usize,
    ) -> Result<Vec<f64>, PredictError> {
        let problem = self.problem(run, values);
        // A simulation far off must not bend its beginning.
        let starts = from.into_iter().collect();
        let options = FitOptions { starts, loss: Loss::SoftL1(3.0), iterations, ..FitOptions::default() };
        Ok(search(&problem, &options)?.0.x)
    }
}

/// What was measured and simulated, by channel: nominal, refitted, with what is claimed.
pub(super) fn traces(
    runs: &[IdentificationRun],
    loaded: &Loaded,
    shown: [&FreeReadings; 3],
) -> Vec<ChannelTrace> {
    let deviation =
        |c: &ChannelComparison| floor::output(loaded, &c.channel).map_or(0.0, |floor| floor.deviation);
    let [before, tuned, after] = shown;
    let one = |(k, c): (usize, &ChannelComparison)| ChannelTrace {
        recording: runs[c.run].name.clone(),
        channel: c.channel.clone(),
        time: c.t.clone(),
        measured: c.measured.clone(),
        before: c.predicted.clone(),
        tuned: tuned[k].predicted.clone(),
        after: after[k].predicted.clone(),
        floor: deviation(c),
    };
    before.iter().enumerate().map(one).collect()
}
