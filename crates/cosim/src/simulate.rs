//! One FMU over its experiment.

use std::sync::Arc;

use trueup_fmi_description::description::{Causality, Description, Initial, Type, Variability, Variable};
use trueup_fmi_import::{Experiment, Fmu, Options as Instantiate};

use crate::error::Error;
use crate::grid::Grid;
use crate::inputs::Inputs;
use crate::results::{Column, Kind, Row, Sink, Values};
use crate::slave::{Block, Buffer, Slave};
use crate::value;

/// What the user wants; what is left open comes from the FMU's default experiment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// Start in s.
    pub start: Option<f64>,
    /// Stop in s; else the default experiment's, else the end of the inputs, else 1 s after the start.
    pub stop: Option<f64>,
    /// Communication step in s; else the default experiment's, else a 500th of the run.
    pub step: Option<f64>,
    /// Relative tolerance of an integrator inside the FMU.
    pub tolerance: Option<f64>,
    /// Start values: name (of an array or of one element, `a[1]`), value (of an array separated by commas).
    pub set: Vec<(String, String)>,
    /// Inputs over time.
    pub inputs: Option<Inputs>,
    /// Variables to record; empty: all outputs that CSV can hold.
    pub outputs: Vec<String>,
}

/// What a run did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// Time reached in s.
    pub time: f64,
    /// Communication steps.
    pub steps: u64,
    /// Steps that the FMU refused at their full length.
    pub discarded: u64,
    /// The FMU ended the run before the stop time.
    pub terminated: bool,
}

/// Halvings of a discarded step before the run is given up.
const HALVINGS: u32 = 20;

/// Variables read in one call, with the columns of their elements.
struct Recorded {
    block: Block,
    columns: Vec<Column>,
}

/// An input that a column drives: block, element, column, whether it goes linearly between samples.
struct Driven {
    block: usize,
    element: usize,
    column: usize,
    linear: bool,
}

/// Runs an FMU and writes a row per communication point. All settings are checked before it is instantiated.
///
/// # Errors
/// [`Error::Setting`] with every setting that does not fit; failures of the FMU with function and time. The sink
/// then holds what was computed before.
pub fn simulate(fmu: &Arc<Fmu>, options: &Options, sink: &mut dyn Sink) -> Result<Summary, Error> {
    let d = fmu.description();
    let mut wrong = Vec::new();
    let starts = starts(d, options, &mut wrong);
    let (driven, mut inputs) = inputs(d, options.inputs.as_ref(), &mut wrong);
    let recorded = recorded(d, options, &mut wrong);
    let grid = grid(d, options, &mut wrong);
    let (Some(grid), []) = (grid, &wrong[..]) else { return Err(Error::Setting(wrong)) };

    let columns: Vec<Column> = recorded.iter().flat_map(|r| r.columns.iter().cloned()).collect();
    sink.begin(&columns)?;
    let variable_step =
        d.co_simulation.as_ref().is_some_and(|i| i.can_handle_variable_communication_step_size);
    let mut run = Run {
        slave: Slave::new(fmu, Instantiate::default())?,
        recorded,
        variable_step,
        values: Values::default(),
    };
    let at = |time: f64| move |source| Error::Call { time, source };

    let slave = &mut run.slave;
    starts.iter().try_for_each(|block| slave.set(block)).map_err(at(grid.start))?;
    let tolerance = options.tolerance.or(d.experiment.tolerance);
    let experiment = Experiment { tolerance, start: grid.start, stop: Some(grid.stop) };
    slave.enter_initialization_mode(experiment).map_err(at(grid.start))?;
    let mut apply = |slave: &mut Slave, time: f64| {
        let Some(columns) = &options.inputs else { return Ok(()) };
        for input in &driven {
            inputs[input.block]
                .values
                .set_number(input.element, columns.at(input.column, time, input.linear));
        }
        inputs.iter().try_for_each(|block| slave.set(block)).map_err(at(time))
    };
    apply(slave, grid.start)?;
    slave.exit_initialization_mode().map_err(at(grid.start))?;
    run.record(grid.start, 0, sink)?;

    let mut summary = Summary { time: grid.start, steps: 0, discarded: 0, terminated: false };
    for i in 0..grid.steps {
        let (time, end) = (grid.time(i), grid.time(i + 1));
        // An FMU that wants equal steps gets them to the last bit.
        let step = if variable_step { end - time } else { grid.step };
        (summary.time, summary.terminated) = run.advance(time, end, step, &mut summary.discarded)?;
        summary.steps += 1;
        // Outputs that follow an input directly belong to the input of now, not of the step before.
        apply(&mut run.slave, summary.time)?;
        run.record(summary.time, i + 1, sink)?;
        if summary.terminated {
            break;
        }
    }
    run.slave.terminate().map_err(at(summary.time))?;
    Ok(summary)
}

/// An instance under way.
struct Run {
    slave: Slave,
    recorded: Vec<Recorded>,
    variable_step: bool,
    values: Values,
}

impl Run {
    /// Steps from `time` to `end`; a discarded step goes on from where the FMU came, or is halved.
    fn advance(
        &mut self,
        mut time: f64,
        end: f64,
        whole: f64,
        discarded: &mut u64,
    ) -> Result<(f64, bool), Error> {
        let (mut step, mut halvings) = (whole, 0);
        loop {
            let done = self.slave.do_step(time, step, true).map_err(|source| Error::Call { time, source })?;
            if !done.early {
                if step >= end - time {
                    return Ok((end, done.terminate));
                }
                time += step;
            } else {
                *discarded += u64::from(done.discarded);
                if done.terminate {
                    return Ok((if done.time >= time && done.time <= end { done.time } else { time }, true));
                }
                let progress = done.time > time && done.time <= end;
                halvings += u32::from(!progress);
                let reason = if !self.variable_step {
                    "and takes no other step"
                } else if halvings > HALVINGS {
                    "however short the step"
                } else if !progress && done.time != time {
                    "and does not say where it stands"
                } else {
                    ""
                };
                if !reason.is_empty() {
                    let reason = format!(
                        "doStep of instance \"{}\" over {step:?} s ended early at {:?} s (Discard) {reason}",
                        self.slave.name(),
                        done.time
                    );
                    return Err(Error::Stuck { time, reason, log: self.slave.log() });
                }
                (time, step) = if progress { (done.time, step) } else { (time, step / 2.0) };
                if time >= end {
                    return Ok((end, false));
                }
            }
            step = step.min(end - time);
        }
    }

    /// Reads the outputs and writes them. Only finite values are written.
    fn record(&mut self, time: f64, point: u64, sink: &mut dyn Sink) -> Result<(), Error> {
        let values = &mut self.values;
        values.clear();
        for Recorded { block, columns } in &mut self.recorded {
            self.slave.get(block).map_err(|source| Error::Call { time, source })?;
            if let Some((at, value)) = block.values.first_not_finite() {
                let (instance, log) = (self.slave.name().to_owned(), self.slave.log());
                return Err(Error::NotFinite {
                    time,
                    instance,
                    variable: columns[at].name.clone(),
                    value,
                    log,
                });
            }
            block.values.append_to(values);
        }
        sink.row(Row { time, point: Some(point), values })
    }
}

/// Start values, one block per variable.
fn starts(d: &Description, options: &Options, wrong: &mut Vec<String>) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let mut set = |name: &str, text: &str| -> Result<(), String> {
        let (v, element) = value::find(d, name)?;
        let settable = matches!(v.causality, Causality::Parameter | Causality::Input)
            || (v.initial.is_some() && v.effective_initial() != Some(Initial::Calculated));
        if v.causality == Causality::StructuralParameter
            || v.variability == Variability::Constant
            || !settable
        {
            return Err(format!(
                "`{name}` is a {:?} that cannot be set; set a parameter or an input",
                v.causality
            ));
        }
        let at =
            match blocks.iter().position(|b| b.references[0] == v.value_reference && same(d, v, &b.values)) {
                Some(at) => at,
                None => {
                    let n = d.elements(v).ok_or_else(|| format!("the size of `{name}` is not known"))?;
                    let whole = element.is_none().then(|| Buffer::new(v.kind, d.version, n)).flatten();
                    let values = value::start(d, v).or(whole);
                    let values = values.ok_or_else(|| {
                        format!("`{name}` has no start values of all elements to change one of")
                    })?;
                    blocks.push(Block { references: vec![v.value_reference], values });
                    blocks.len() - 1
                }
            };
        let buffer = &mut blocks[at].values;
        match element {
            Some(element) => value::assign(d, v, buffer, element, text),
            None if v.dimensions.is_empty() => value::assign(d, v, buffer, 0, text),
            None => {
                let (texts, n) = (text.split(',').collect::<Vec<_>>(), d.elements(v).unwrap_or(0));
                if texts.len() != n {
                    return Err(format!("`{name}` has {n} elements, {} are given", texts.len()));
                }
                texts.iter().enumerate().try_for_each(|(i, text)| value::assign(d, v, buffer, i, text))
            }
        }
    };
    wrong.extend(options.set.iter().filter_map(|(name, text)| set(name, text).err()));
    blocks
}

/// In FMI 2.0 value references are unique within a type only.
fn same(d: &Description, v: &Variable, values: &Buffer) -> bool {
    Buffer::new(v.kind, d.version, 0)
        .is_some_and(|b| std::mem::discriminant(&b) == std::mem::discriminant(values))
}

/// Inputs that columns drive, one block per type.
fn inputs(d: &Description, columns: Option<&Inputs>, wrong: &mut Vec<String>) -> (Vec<Driven>, Vec<Block>) {
    let (mut driven, mut blocks): (_, Vec<Block>) = (Vec::new(), Vec::new());
    // Per variable: block and position of its first element.
    let mut placed: Vec<(*const Variable, usize, usize)> = Vec::new();
    for (column, (name, ..)) in columns.iter().flat_map(|c| &c.columns).enumerate() {
        let (v, element) = match value::find(d, name) {
            Ok((v, element))
                if v.causality == Causality::Input && (element.is_some() || v.dimensions.is_empty()) =>
            {
                (v, element)
            }
            Ok((v, _)) if v.causality == Causality::Input => {
                wrong.push(format!(
                    "input column `{name}` is an array; give one column per element, `{name}[1]`"
                ));
                continue;
            }
            Ok(_) => continue, // recordings hold outputs besides the inputs
            Err(why) => {
                wrong.push(format!("input column: {why}"));
                continue;
            }
        };
        let known = placed.iter().find(|(p, ..)| std::ptr::eq(*p, v)).copied();
        let (_, block, first) = match known {
            Some(place) => place,
            None => {
                let n = d.elements(v).unwrap_or(1);
                let values = value::start(d, v).or_else(|| Buffer::new(v.kind, d.version, n));
                let Some(values) = values.filter(|_| v.kind != Type::String) else {
                    wrong.push(format!("input column `{name}` is a {:?}; only numbers can be read", v.kind));
                    continue;
                };
                let place = match blocks.iter().position(|b| same(d, v, &b.values)) {
                    Some(at) => {
                        let first = blocks[at].values.append(values);
                        blocks[at].references.push(v.value_reference);
                        (at, first)
                    }
                    None => {
                        blocks.push(Block { references: vec![v.value_reference], values });
                        (blocks.len() - 1, 0)
                    }
                };
                placed.push((v, place.0, place.1));
                (std::ptr::null(), place.0, place.1)
            }
        };
        let linear = v.kind.is_float() && v.variability == Variability::Continuous;
        let samples = columns.iter().flat_map(|c| &c.columns[column].2);
        let at = first + element.unwrap_or(0);
        if let Some(x) = samples.copied().find(|x| !blocks[block].values.set_number(at, *x)) {
            wrong.push(format!("input column `{name}`: {x:?} is no {:?}", v.kind));
        }
        driven.push(Driven { block, element: at, column, linear });
    }
    (driven, blocks)
}

/// What is recorded, one block per type, in the order of the variables within it.
fn recorded(d: &Description, options: &Options, wrong: &mut Vec<String>) -> Vec<Recorded> {
    let mut variables: Vec<&Variable> = Vec::new();
    for name in &options.outputs {
        match value::find(d, name) {
            Ok((v, None)) => variables.push(v),
            Ok((v, Some(_))) => wrong.push(format!("output `{name}`: name the whole array `{}`", v.name)),
            Err(why) => wrong.push(why),
        }
    }
    if options.outputs.is_empty() {
        let holds =
            |v: &&Variable| v.causality == Causality::Output && !matches!(v.kind, Type::Binary | Type::Clock);
        variables.extend(d.variables.iter().filter(holds));
    }
    let mut recorded: Vec<Recorded> = Vec::new();
    for v in variables {
        let buffer = d.elements(v).and_then(|n| Buffer::new(v.kind, d.version, n));
        let (Some(values), Some(columns)) = (buffer, columns(d, v)) else {
            wrong.push(format!("`{}` ({:?}) cannot be recorded as CSV", v.name, v.kind));
            continue;
        };
        match recorded.iter_mut().find(|r| same(d, v, &r.block.values)) {
            Some(r) => {
                r.block.references.push(v.value_reference);
                r.block.values.append(values);
                r.columns.extend(columns);
            }
            None => recorded
                .push(Recorded { block: Block { references: vec![v.value_reference], values }, columns }),
        }
    }
    recorded
}

/// One column per element.
fn columns(d: &Description, v: &Variable) -> Option<Vec<Column>> {
    let (kind, unit) = (Kind::of(v.kind)?, d.attributes(v).unit.unwrap_or_default());
    let names = value::elements(d, v)?.into_iter();
    Some(names.map(|name| Column::new(name, kind, unit.as_str())).collect())
}

/// The communication points.
fn grid(d: &Description, options: &Options, wrong: &mut Vec<String>) -> Option<Grid> {
    let start = options.start.or(d.experiment.start_time).unwrap_or(0.0);
    let stop = options.stop.or(d.experiment.stop_time);
    let stop = stop.or(options.inputs.as_ref().map(|i| i.end)).unwrap_or(start + 1.0);
    let interface = d.co_simulation.clone().unwrap_or_default();
    let default =
        d.experiment.step_size.filter(|h| *h > 0.0).unwrap_or((stop - start).max(f64::MIN_POSITIVE) / 500.0);
    let step = options.step.unwrap_or_else(|| match interface.fixed_internal_step_size {
        Some(h) if h > 0.0 => h * (default / h).round().max(1.0),
        _ => default,
    });
    let grid = Grid::new(start, stop, step);
    match grid {
        None => wrong.push(format!("no run from {start:?} s to {stop:?} s in steps of {step:?} s; choose start < stop and a positive step")),
        Some(g) if !interface.can_handle_variable_communication_step_size && !g.is_even() => wrong.push(format!(
            "the FMU takes steps of equal length only, and {step:?} s does not divide {:?} s; choose another step or stop",
            stop - start
        )),
        Some(_) => {}
    }
    grid
}
