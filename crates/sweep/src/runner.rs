//! Runs of a sweep, one after the other; each share of them is a process of its own.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use trueup_cosim::plan::MasterPlan;
use trueup_cosim::system::{CosimSystem, RecordedVariable as Recorded, SourceSpan};
use trueup_cosim::{ColumnKind, CosimError as RunError, Files, InputMistake, Master, ResultSink, check_with};
use trueup_fmi_description::description::Item;

use crate::design::SweepDesign;
use crate::error::SweepError;
use crate::file::{Output, SweepFile, Take};
use crate::log::{LogDamage, RunRecord, SweepLog, read};
use crate::measure::Measures;
use crate::print::fingerprint;
use crate::value::FactorValue;

/// A share of the runs: every `of`-th one, from the `index`-th on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which one, from 1.
    pub index: u64,
    /// Of how many.
    pub of: u64,
}

impl Shard {
    /// Its runs.
    pub fn runs(self, all: u64) -> impl Iterator<Item = u64> {
        let first = self.index;
        let count = if first > all { 0 } else { (all - first) / self.of + 1 };
        (0..count).map(move |k| first + k * self.of)
    }

    fn log(self) -> String {
        format!("{}-of-{}.log", self.index, self.of)
    }
}

/// A run that has just been done, and how far the share is.
pub struct RunStep<'a> {
    /// What it gave.
    pub record: &'a RunRecord,
    /// Runs of the share that are done.
    pub done: u64,
    /// Runs of the share.
    pub of: u64,
}

/// What became of a share.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Runs that were done now.
    pub ran: u64,
    /// Runs that had been done before.
    pub kept: u64,
    /// Failures among all of them.
    pub failed: u64,
    /// Lines of logs that are damaged; their runs were run again.
    pub damage: Vec<LogDamage>,
}

/// How long a line of a log may wait for the disk.
const SYNC: Duration = Duration::from_secs(1);

/// Runs a sweep.
pub struct Runner {
    sweep: SweepFile,
    design: SweepDesign,
    /// Without the factors' values; it records what the outputs need.
    system: CosimSystem,
    /// What the system itself records.
    record: Vec<Recorded>,
    files: Files,
    plan: MasterPlan,
    print: String,
    /// Paths as messages have them, and as they are in the sweep.
    paths: Vec<(String, String)>,
}

impl Runner {
    /// Reads a sweep and checks all of it, so that what fails later is a run.
    ///
    /// # Errors
    /// [`SweepError::Mistakes`] of the sweep with lines, [`SweepError::System`] of what is run, [`SweepError::File`].
    pub fn open(file: &Path) -> Result<Self, SweepError> {
        Self::open_with(file, false)
    }

    /// As [`Self::open`]; `own_processes`: each component will have one, see [`CosimSystem::own_processes`].
    ///
    /// # Errors
    /// As [`Self::open`].
    pub fn open_with(file: &Path, own_processes: bool) -> Result<Self, SweepError> {
        let sweep = SweepFile::read(file)?;
        let design = SweepDesign::of(&sweep);
        let mut system = CosimSystem { own_processes, ..CosimSystem::read(&sweep.system)? };
        over(&mut system, &sweep);
        let record = sweep.outputs.iter().map(|o| Recorded {
            name: o.variable.clone(),
            place: o.place.clone(),
            ..Recorded::default()
        });
        let mut wanted: Vec<Recorded> = Vec::new();
        for one in record {
            if !wanted.iter().any(|before| before.name == one.name) {
                wanted.push(one);
            }
        }
        let record = std::mem::replace(&mut system.record, wanted);
        let mut files = Files::default();
        let plan = check_with(&system, &mut files)?;
        let print = fingerprint(file, &system).map_err(|e| SweepError::at(file, e))?;
        let paths = paths(&sweep, &system);
        let mut runner = Self { sweep, design, system, record, files, plan, print, paths };
        runner.look_outputs_up()?;
        runner.look_factors_up()?;
        Ok(runner)
    }

    /// The content of the file.
    pub fn sweep(&self) -> &SweepFile {
        &self.sweep
    }

    /// Its runs.
    pub fn design(&self) -> &SweepDesign {
        &self.design
    }

    /// The [fingerprint](crate::fingerprint) of the sweep.
    pub fn print(&self) -> &str {
        &self.print
    }

    /// The plan of the system without the factors' values; all runs share its FMUs.
    pub fn plan(&self) -> &MasterPlan {
        &self.plan
    }

    /// The system of a run, recording what the system itself records.
    ///
    /// # Errors
    /// [`SweepError::NoRun`], [`SweepError::Mistakes`]
    pub fn system(&self, run: u64) -> Result<CosimSystem, SweepError> {
        let runs = self.design.runs();
        if !(1..=runs).contains(&run) {
            return Err(SweepError::NoRun { run, runs });
        }
        let mut system = self.set(run).map_err(|m| SweepError::Mistakes(vec![m]))?;
        system.record = self.record.clone();
        Ok(system)
    }

    /// Does one run.
    pub fn run(&mut self, run: u64) -> RunRecord {
        let master = self.master(run);
        let mut measures = Measures::new(&self.sweep.outputs);
        let done = master.and_then(|mut master| master.run(&mut measures));
        let values = measures.values();
        RunRecord { run, result: done.map(|_| values).map_err(|e| self.reason(&e)) }
    }

    /// Does one run and hands its rows over, with a column per variable of the outputs.
    ///
    /// # Errors
    /// Why the run failed; the rows until then have been handed over.
    pub fn run_into(&mut self, run: u64, sink: &mut dyn ResultSink) -> Result<(), String> {
        let done = self.master(run).and_then(|mut master| master.run(sink));
        done.map(|_| ()).map_err(|e| self.reason(&e))
    }

    fn master(&mut self, run: u64) -> Result<Master, RunError> {
        let system = self.set(run).map_err(|mistake| RunError::System(vec![mistake]))?;
        Master::new(check_with(&system, &mut self.files)?)
    }

    /// Does the runs of a share that no log has, and reports each.
    ///
    /// # Errors
    /// [`SweepError::File`]: a log cannot be used or written. A run that fails is none.
    pub fn shard(&mut self, shard: Shard, mut tell: impl FnMut(&RunStep)) -> Result<Tally, SweepError> {
        let folder = self.sweep.folder();
        std::fs::create_dir_all(&folder).map_err(|e| SweepError::at(&folder, e))?;
        let mut log = SweepLog::open(&folder.join(shard.log()), &self.print)?;
        let runs = self.design.runs();
        let mine: Vec<u64> = shard.runs(runs).collect();
        let (mut tally, mut known) = (Tally::default(), vec![false; mine.len()]);
        for file in logs(&folder)? {
            let found = read(&file, &self.print)?;
            tally.damage.extend(found.damage);
            for record in found.records {
                let Ok(at) = mine.binary_search(&record.run) else { continue };
                if !std::mem::replace(&mut known[at], true) {
                    tally.kept += 1;
                    tally.failed += u64::from(record.result.is_err());
                }
            }
        }
        let mut synced = Instant::now();
        for run in mine.iter().zip(&known).filter(|(_, known)| !**known).map(|(run, _)| *run) {
            let record = self.run(run);
            log.add(&record)?;
            tally.ran += 1;
            tally.failed += u64::from(record.result.is_err());
            if synced.elapsed() >= SYNC {
                log.sync()?;
                synced = Instant::now();
            }
            tell(&RunStep { record: &record, done: tally.ran + tally.kept, of: mine.len() as u64 });
        }
        log.sync()?;
        Ok(tally)
    }

    /// Names and units of the columns of factors and outputs; empty: none.
    pub fn units(&self) -> Vec<(String, String)> {
        let factors = self.sweep.factors.iter().map(|f| (f.name.clone(), self.unit_of_factor(&f.variables)));
        let outputs = self.sweep.outputs.iter().map(|o| (o.name.clone(), self.unit_of_output(o)));
        factors.chain(outputs).collect()
    }

    /// Items of the enumeration that an output's variable is of; none of what is no enumeration.
    pub fn items(&self, output: &Output) -> &[Item] {
        let recorded = self.plan.recorded.iter().find(|r| r.name == output.variable);
        let items = recorded.and_then(|r| {
            let d = self.plan.components[r.from.component].description();
            let name = d.variables[r.from.variable].declared_type.as_deref()?;
            Some(d.declared_type(name)?.items.as_slice())
        });
        items.unwrap_or_default()
    }

    fn unit_of_factor(&self, variables: &[String]) -> String {
        let of = |name: &String| {
            let port = self.system.port(name)?;
            let planned = self.plan.components.iter().find(|c| c.name == port.component)?;
            let d = planned.description();
            let array = port.variable.split_once('[').map_or(port.variable.as_str(), |(array, _)| array);
            d.attributes(d.find(&port.variable).or_else(|| d.find(array))?).unit
        };
        variables.first().and_then(of).unwrap_or_default()
    }

    fn unit_of_output(&self, output: &Output) -> String {
        if let Take::Above(_) | Take::Below(_) = output.take {
            return "s".into();
        }
        let recorded = self.plan.recorded.iter().find(|r| r.name == output.variable);
        let unit = recorded.and_then(|r| {
            let d = self.plan.components[r.from.component].description();
            d.attributes(&d.variables[r.from.variable]).unit
        });
        unit.unwrap_or_default()
    }

    /// Each output is one column of numbers.
    fn look_outputs_up(&self) -> Result<(), SweepError> {
        let mut mistakes = Vec::new();
        for output in &self.sweep.outputs {
            let variable = &output.variable;
            let mut wrong = |message: String| {
                mistakes.push(InputMistake { place: output.place.clone(), message });
            };
            let Some(recorded) = self.plan.recorded.iter().find(|r| r.name == *variable) else {
                wrong(format!("`{variable}` is an array; name one element, as `{variable}[1]`"));
                continue;
            };
            let d = self.plan.components[recorded.from.component].description();
            if matches!(
                ColumnKind::of(d.variables[recorded.from.variable].kind),
                None | Some(ColumnKind::Text)
            ) {
                wrong(format!("`{variable}` is no number; a sweep keeps numbers"));
            }
        }
        if mistakes.is_empty() { Ok(()) } else { Err(SweepError::Mistakes(mistakes)) }
    }

    /// A factor that can be set neither in its first run nor in its last one is a mistake, not a failure of every run.
    fn look_factors_up(&mut self) -> Result<(), SweepError> {
        let mut mistakes = Vec::new();
        for factor in 0..self.sweep.factors.len() {
            let mut tried = Vec::new();
            for run in [1, self.design.runs()] {
                let mut system = self.system.clone();
                let set = set(&mut system, &self.sweep, factor, &self.design.value(factor, run));
                match set
                    .map_err(|m| RunError::System(vec![m]))
                    .and_then(|()| check_with(&system, &mut self.files))
                {
                    Ok(_) => break,
                    Err(e) => tried.push(e),
                }
            }
            if tried.len() == 2 {
                match tried.swap_remove(0) {
                    RunError::System(list) => mistakes.extend(list),
                    e => mistakes.push(InputMistake {
                        place: self.sweep.factors[factor].place.clone(),
                        message: e.to_string(),
                    }),
                }
            }
        }
        if mistakes.is_empty() { Ok(()) } else { Err(SweepError::Mistakes(mistakes)) }
    }

    fn set(&self, run: u64) -> Result<CosimSystem, InputMistake> {
        let mut system = self.system.clone();
        for factor in 0..self.sweep.factors.len() {
            set(&mut system, &self.sweep, factor, &self.design.value(factor, run))?;
        }
        Ok(system)
    }

    /// Why a run failed, in one line that does not depend on where the program was started.
    fn reason(&self, error: &RunError) -> String {
        let mut text = error.to_string();
        for (said, short) in &self.paths {
            text = text.replace(said, short);
        }
        text.lines().next().unwrap_or_default().trim_end_matches([':', ';']).to_owned()
    }
}

fn set(
    system: &mut CosimSystem,
    sweep: &SweepFile,
    factor: usize,
    value: &FactorValue,
) -> Result<(), InputMistake> {
    let factor = &sweep.factors[factor];
    factor.variables.iter().try_for_each(|name| system.set(name, &value.text(), &factor.place))
}

/// The sweep's settings of when and how override the system's.
fn over(system: &mut CosimSystem, sweep: &SweepFile) {
    let (run, asked) = (&mut system.run, &sweep.run);
    for (slot, asked) in [
        (&mut run.start, asked.start),
        (&mut run.stop, asked.stop),
        (&mut run.step, asked.step),
        (&mut run.tolerance, asked.tolerance),
    ] {
        if asked.is_some() {
            *slot = asked;
            run.place = SourceSpan { file: sweep.file.clone(), line: 0 };
        }
    }
    run.algorithm = asked.algorithm.or(run.algorithm);
}

/// Paths as messages have them, longest first, and as they are in the sweep.
fn paths(sweep: &SweepFile, system: &CosimSystem) -> Vec<(String, String)> {
    let folder = sweep.file.parent().unwrap_or(Path::new(""));
    let files = [&sweep.file, &system.file].into_iter();
    let files =
        files.chain(system.components.iter().map(|c| &c.fmu)).chain(system.inputs.iter().map(|i| &i.file));
    let mut paths: Vec<(String, String)> = files
        .filter_map(|file| {
            let short = file.strip_prefix(folder).ok()?;
            Some((file.display().to_string(), short.display().to_string()))
        })
        .filter(|(said, short)| said != short)
        .collect();
    paths.sort_by_key(|(said, _)| std::cmp::Reverse(said.len()));
    paths.dedup();
    paths
}

/// All logs of a folder, in the order of their names.
pub(crate) fn logs(folder: &Path) -> Result<Vec<PathBuf>, SweepError> {
    let fail = |e: std::io::Error| SweepError::at(folder, e);
    let mut logs = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.extension().is_some_and(|e| e == "log") {
            logs.push(path);
        }
    }
    logs.sort();
    Ok(logs)
}
