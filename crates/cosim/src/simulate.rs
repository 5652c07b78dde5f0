//! One FMU over its experiment.

use std::sync::Arc;

use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariability, DescriptionVariable, Initial, VariableType,
};
use trueup_fmi_import::UnpackedFmu;

use crate::buffer::{ValueBuffer, VariableBlock};
use crate::error::CosimError;
use crate::grid::CommunicationGrid;
use crate::inputs::InputFileTable;
use crate::master::Master;
use crate::plan::{DrivenInput, ElementIndex, MasterPlan, PlannedComponent, RecordedElement};
use crate::results::{ColumnKind, ResultSink};
use crate::step_rule::{internal_step, refusal};
use crate::system::ComponentInterface;
use crate::value;

/// What the user requests; what is left open comes from the FMU's default experiment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SimulateOptions {
    /// How the FMU is run; `None`: Co-Simulation where it offers that, else Model Exchange.
    pub interface: Option<ComponentInterface>,
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
    pub inputs: Option<InputFileTable>,
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

/// Runs an FMU and writes a row per communication point. All settings are checked before it is instantiated.
///
/// # Errors
/// [`CosimError::Setting`] with every setting that does not fit; failures of the FMU with function and time. The sink
/// then holds what was computed before.
pub fn simulate(
    fmu: &Arc<UnpackedFmu>,
    options: &SimulateOptions,
    sink: &mut dyn ResultSink,
) -> Result<Summary, CosimError> {
    let log = Master::new(plan(fmu, options)?)?.run(sink)?;
    let terminated = log.terminated_by.is_some();
    Ok(Summary { time: log.time, steps: log.steps, discarded: log.discarded, terminated })
}

/// The plan of one FMU alone.
///
/// # Errors
/// [`CosimError::Setting`] with every setting that does not fit.
pub(crate) fn plan(fmu: &Arc<UnpackedFmu>, options: &SimulateOptions) -> Result<MasterPlan, CosimError> {
    let d = fmu.description();
    let mut wrong = Vec::new();
    let start = starts(d, options, &mut wrong);
    let mut inputs = options.inputs.clone();
    let driven = driven(d, inputs.as_mut(), &mut wrong);
    let recorded = recorded(d, options, &mut wrong);
    let grid = grid(d, options, &mut wrong);
    let (Some(grid), []) = (grid, &wrong[..]) else { return Err(CosimError::Setting(wrong)) };
    let component = PlannedComponent {
        name: String::new(),
        fmu: Arc::clone(fmu),
        interface: interface(d, options),
        structural: Vec::new(),
        resized: None,
        start,
        every: 1,
    };
    Ok(MasterPlan {
        components: vec![component],
        links: Vec::new(),
        driven,
        inputs,
        recorded,
        grid,
        tolerance: options.tolerance,
        algorithm: None,
        event_rows: None,
        maps: Vec::new(),
        notes: Vec::new(),
    })
}

fn interface(d: &Description, options: &SimulateOptions) -> ComponentInterface {
    options.interface.unwrap_or(match d.co_simulation {
        None if d.model_exchange.is_some() => ComponentInterface::ModelExchange,
        _ => ComponentInterface::CoSimulation,
    })
}

/// Start values, one block per variable.
fn starts(d: &Description, options: &SimulateOptions, wrong: &mut Vec<String>) -> Vec<VariableBlock> {
    let mut blocks: Vec<VariableBlock> = Vec::new();
    let mut set = |name: &str, text: &str| -> Result<(), String> {
        let (v, element) = value::find(d, name)?;
        let settable = matches!(v.causality, DescriptionCausality::Parameter | DescriptionCausality::Input)
            || (v.initial.is_some() && v.effective_initial() != Some(Initial::Calculated));
        if v.causality == DescriptionCausality::StructuralParameter
            || v.variability == DescriptionVariability::Constant
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
                    let whole = element.is_none().then(|| ValueBuffer::new(v.kind, d.version, n)).flatten();
                    let values = value::start(d, v).or(whole);
                    let values = values.ok_or_else(|| {
                        format!("`{name}` has no start values of all elements to change one of")
                    })?;
                    blocks.push(VariableBlock { references: vec![v.value_reference], values });
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
fn same(d: &Description, v: &DescriptionVariable, values: &ValueBuffer) -> bool {
    ValueBuffer::new(v.kind, d.version, 0)
        .is_some_and(|b| std::mem::discriminant(&b) == std::mem::discriminant(values))
}

/// Inputs that columns drive; the columns become what they are to them.
fn driven(d: &Description, inputs: Option<&mut InputFileTable>, wrong: &mut Vec<String>) -> Vec<DrivenInput> {
    let Some(inputs) = inputs else { return Vec::new() };
    let (mut driven, mut signals, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    for column in &inputs.columns {
        let name = &column.name;
        let (v, element) = match value::find(d, name) {
            Ok((v, _)) if v.causality != DescriptionCausality::Input => continue, // recordings hold outputs in addition to the inputs
            Ok((v, element)) if element.is_some() || v.dimensions.is_empty() => (v, element.unwrap_or(0)),
            Ok(_) => {
                wrong.push(format!(
                    "input column `{name}` is an array; give one column per element, `{name}[1]`"
                ));
                continue;
            }
            Err(why) => {
                wrong.push(format!("input column: {why}"));
                continue;
            }
        };
        let continuous = v.kind.is_float() && v.variability == DescriptionVariability::Continuous;
        match column.drives(d, v, continuous, &mut notes) {
            Ok((signal, linear)) => {
                driven.push(DrivenInput { to: element_of(d, v, element), column: signals.len(), linear });
                signals.push(signal);
            }
            Err(why) => wrong.push(format!("input column `{name}`: {why}")),
        }
    }
    inputs.columns = signals;
    driven
}

fn element_of(d: &Description, v: &DescriptionVariable, element: usize) -> ElementIndex {
    let variable = d.variables.iter().position(|w| std::ptr::eq(v, w)).unwrap_or(0);
    ElementIndex { component: 0, variable, element }
}

/// What is recorded, in the order that was requested, else that of the variables.
fn recorded(d: &Description, options: &SimulateOptions, wrong: &mut Vec<String>) -> Vec<RecordedElement> {
    let mut variables: Vec<&DescriptionVariable> = Vec::new();
    for name in &options.outputs {
        match value::find(d, name) {
            Ok((v, None)) => variables.push(v),
            Ok((v, Some(_))) => wrong.push(format!("output `{name}`: name the whole array `{}`", v.name)),
            Err(why) => wrong.push(why),
        }
    }
    if options.outputs.is_empty() {
        let holds = |v: &&DescriptionVariable| {
            v.causality == DescriptionCausality::Output
                && !matches!(v.kind, VariableType::Binary | VariableType::Clock)
        };
        variables.extend(d.variables.iter().filter(holds));
    }
    let mut recorded = Vec::new();
    for v in variables {
        let known = ColumnKind::of(v.kind).and(d.elements(v)).and_then(|_| value::elements(d, v));
        let Some(names) = known else {
            wrong.push(format!("`{}` ({:?}) cannot be recorded", v.name, v.kind));
            continue;
        };
        let one = |(i, name)| RecordedElement { from: element_of(d, v, i), name, every: 1 };
        recorded.extend(names.into_iter().enumerate().map(one));
    }
    recorded
}

/// The communication points.
fn grid(d: &Description, options: &SimulateOptions, wrong: &mut Vec<String>) -> Option<CommunicationGrid> {
    let start = options.start.or(d.experiment.start_time).unwrap_or(0.0);
    let stop = options.stop.or(d.experiment.stop_time);
    let stop = stop.or(options.inputs.as_ref().map(|i| i.end)).unwrap_or(start + 1.0);
    let stepped = interface(d, options) == ComponentInterface::CoSimulation;
    let offered = d.co_simulation.as_ref().filter(|_| stepped);
    let default =
        d.experiment.step_size.filter(|h| *h > 0.0).unwrap_or((stop - start).max(f64::MIN_POSITIVE) / 500.0);
    let step = options.step.unwrap_or_else(|| match offered.and_then(internal_step) {
        Some(h) => h * (default / h).round().max(1.0),
        _ => default,
    });
    let grid = CommunicationGrid::new(start, stop, step);
    match grid {
        None => wrong.push(CommunicationGrid::refusal(start, stop, step)),
        Some(_) => {
            let why = offered.and_then(|i| refusal(i, step, stop - start));
            wrong.extend(why.map(|why| format!("the FMU {why}")));
        }
    }
    grid
}
