//! A run of a plan, from start to stop.
//!
//! ```no_run
//! use trueup_cosim::{Master, Results, check, system::CosimSystem};
//!
//! let plan = check(&CosimSystem::read("loop.toml".as_ref())?)?;
//! let mut results = Results::create("loop.csv".as_ref())?;
//! let mut master = Master::new(plan)?;
//! match master.run(&mut results) {
//!     Ok(log) => {
//!         results.finish()?;
//!         println!("{} steps with {}: {}", log.steps, log.algorithm, log.reason);
//!     }
//!     Err(error) => eprintln!("{error}; kept: {:?}", results.keep_partial()?),
//! }
//! # Ok::<(), trueup_cosim::CosimError>(())
//! ```

use trueup_fmi_import::{ExperimentSetup, ProcessSurroundings};
use trueup_numerics::ShortNumber;

use crate::adaptive::{self, Adaptive};
use crate::buffer::{BlockAccess, configure};
use crate::choose::{choose, order, units};
use crate::couple::Coupling;
use crate::error::CosimError;
use crate::events::{EventCuts, discrete_inputs};
use crate::exchange::{Exchange, Phase, Wiring};
use crate::grid::CommunicationGrid;
use crate::log::RunLog;
use crate::mistake::quoted;
use crate::node::InstanceNode;
use crate::plan::MasterPlan;
use crate::record::Recorder;
use crate::results::ResultSink;
use crate::step_rule::{InputFollowing, StepRule};
use crate::stepper::{
    Advance, EventStepper, GroupStepper, SlaveStepper, StepLimit, SystemStepper, has_event_mode, intermediate,
};
use crate::system::{Algorithm, ComponentInterface};

/// Relative tolerance of the coupling where none is given.
const TOLERANCE: f64 = 1e-6;
/// Part of it below which repeated steps count as converged.
const SETTLED: f64 = 0.01;
/// Halvings of a step whose repetition does not settle.
const HALVINGS: u32 = 10;

/// Working directory and limits of the process are what they were; else they are that again, and one of these FMUs had
/// changed them.
fn stays<'a>(
    surroundings: &ProcessSurroundings,
    time: f64,
    nodes: impl Iterator<Item = &'a InstanceNode>,
) -> Result<(), CosimError> {
    let Some(what) = surroundings.restored() else { return Ok(()) };
    let within = nodes.filter(|node| !node.planned.fmu.is_isolated());
    let names: Vec<_> = within
        .map(|node| format!("\"{}\" ({})", node.slave.name(), node.planned.fmu.file().display()))
        .collect();
    let one = if names.len() == 1 { "instance" } else { "one of the instances" };
    Err(CosimError::Surroundings { time, who: format!("{one} {}", names.join(", ")), what })
}

/// Whether an event in one FMU can end the step of all of them; a note where it cannot.
fn shares_events(plan: &mut MasterPlan, rules: &[Option<StepRule>], algorithm: Algorithm) -> bool {
    if matches!(algorithm, Algorithm::Iterative | Algorithm::Adaptive) {
        return false;
    }
    let rigid = plan.components.iter().zip(rules).filter(|(_, rule)| rule.is_some_and(|r| !r.allows_any()));
    let rigid: Vec<&str> = rigid.map(|(c, _)| c.name.as_str()).collect();
    let seldom: Vec<&str> = plan.components.iter().filter(|c| c.every > 1).map(|c| c.name.as_str()).collect();
    let why = match (rigid.is_empty(), seldom.is_empty()) {
        (true, true) => return true,
        (false, _) => format!("{}: not declared to take parts of a step", quoted(&rigid)),
        (true, false) => format!("{} steps less often (`every`)", quoted(&seldom)),
    };
    if plan.components.iter().any(|c| c.interface == ComponentInterface::ModelExchange || has_event_mode(c)) {
        plan.notes.push(format!("other FMUs learn of an event at the next communication point: {why}"));
    }
    false
}

/// Runs a [`MasterPlan`] once.
pub struct Master {
    /// Without its components, which have become nodes.
    plan: MasterPlan,
    units: Vec<Vec<usize>>,
    order: Vec<usize>,
    ready: Option<Ready>,
    cuts: EventCuts,
    log: RunLog,
    surroundings: ProcessSurroundings,
}

/// Instantiated, not yet initialized.
struct Ready {
    nodes: Vec<InstanceNode>,
    shared: Vec<Option<std::sync::Arc<crate::stepper::SharedInstance>>>,
    /// Of each: its events are handled as FMI 3.0 has it.
    event_mode: Vec<bool>,
    /// An event of one ends the step of all.
    shares: bool,
}

impl Master {
    /// Chooses the algorithm, instantiates the FMUs and sets their start values.
    ///
    /// # Errors
    /// [`CosimError::Setting`] if the FMUs cannot follow the algorithm that was requested; whatever an FMU returns.
    pub fn new(mut plan: MasterPlan) -> Result<Self, CosimError> {
        let rules: Vec<_> = plan.components.iter().map(|c| StepRule::of(c, &plan)).collect();
        let (algorithm, reason) = choose(&plan, &rules)?;
        let units = units(&plan.components);
        let (order, ..) = order(&plan, &units);
        let follows = algorithm != Algorithm::Jacobi;
        let (mut nodes, mut shared) = (Vec::new(), Vec::new());
        let start = plan.grid.start;
        let mut event_mode = Vec::new();
        let alone = units.len() == 1;
        let shares = !alone && shares_events(&mut plan, &rules, algorithm);
        let surroundings = ProcessSurroundings::now();
        for (planned, rule) in std::mem::take(&mut plan.components).into_iter().zip(rules) {
            let slave_of = |event_mode: bool| {
                let asks = follows && rule.is_some_and(|rule| rule.way == InputFollowing::Intermediate);
                let (mut how, lines) = if asks { intermediate(&planned) } else { Default::default() };
                (how.event_mode_used, how.early_return_allowed) = (event_mode, event_mode);
                InstanceNode::instantiate(&planned, how).map(|slave| (slave, lines))
            };
            let mut with_events = (alone || shares) && has_event_mode(&planned);
            let (slave, lines) = match slave_of(with_events) {
                // Declared, and yet refused.
                Err(_) if with_events => {
                    with_events = false;
                    plan.notes.push(format!(
                        "{}: refuses its event mode, runs without",
                        planned.fmu.file().display()
                    ));
                    slave_of(false)?
                }
                other => other?,
            };
            let mut node = InstanceNode::new(planned, slave);
            node.rule = rule;
            let at = |source| CosimError::Call { time: start, source };
            configure(&mut node.slave, &node.planned.structural).map_err(at)?;
            node.planned.start.iter().try_for_each(|block| node.slave.set(block)).map_err(at)?;
            stays(&surroundings, start, std::iter::once(&node))?;
            nodes.push(node);
            shared.push(lines);
            event_mode.push(with_events);
        }
        let uniform = nodes.iter().all(|n| n.planned.every <= 1);
        let inputs = plan.inputs.as_mut().filter(|_| uniform);
        let cuts = EventCuts::new(&nodes, &plan.driven, inputs, &plan.grid, &mut plan.notes);
        let log = RunLog::new(algorithm, reason, plan.notes.clone(), start);
        let ready = Some(Ready { nodes, shared, event_mode, shares });
        Ok(Self { plan, units, order, ready, cuts, log, surroundings })
    }

    /// What was chosen and, after a run, what it did; also of a run that failed.
    pub fn log(&self) -> &RunLog {
        &self.log
    }

    /// Initializes, then goes from start to stop and gives the sink a row per communication point. A master runs once.
    ///
    /// # Errors
    /// An error of an FMU that cannot be recovered, with its time; loops without solution; values that are not finite;
    /// the sink's own. The sink then holds what was computed before.
    pub fn run(&mut self, sink: &mut dyn ResultSink) -> Result<RunLog, CosimError> {
        let Some(ready) = self.ready.take() else {
            return Err(CosimError::Setting(vec!["a master runs once; make a new one of a new plan".into()]));
        };
        let (mut coupling, mut recorder) = self.initialize(ready, sink)?;
        let done = self.steps(&mut coupling, &mut recorder, sink);
        self.log.loops = coupling.values().loops().cloned().collect();
        self.log.calls = coupling.calls();
        if self.log.algorithm == Algorithm::Jacobi {
            let held = self.log.calls.iter_mut().filter(|c| !c.inputs.is_empty());
            held.for_each(|c| c.inputs = "inputs held");
        }
        self.log.notes.extend(coupling.notes());
        for node in coupling.nodes() {
            let name = node.slave.name().to_owned();
            let told = node.slave.warnings().into_iter().map(|text| format!("{name} warns: {text}"));
            self.log.notes.extend(told);
        }
        let time = self.log.time;
        let stayed = stays(&self.surroundings, time, coupling.nodes().iter());
        done.and(stayed)?;
        for node in coupling.nodes() {
            node.slave.terminate().map_err(|source| CosimError::Call { time, source })?;
            stays(&self.surroundings, time, std::iter::once(&*node))?;
        }
        Ok(self.log.clone())
    }

    fn initialize(
        &mut self,
        ready: Ready,
        sink: &mut dyn ResultSink,
    ) -> Result<(Coupling, Recorder), CosimError> {
        let Ready { mut nodes, shared, event_mode, shares } = ready;
        let MasterPlan { links, driven, maps, inputs, recorded, grid, tolerance, .. } = &self.plan;
        let start = grid.start;
        for node in &mut nodes {
            let tolerance = tolerance.or(node.description().experiment.tolerance);
            let experiment = ExperimentSetup { tolerance, start, stop: Some(grid.stop) };
            let entered = node.slave.enter_initialization_mode(experiment);
            entered.map_err(|source| CosimError::Call { time: start, source })?;
            stays(&self.surroundings, start, std::iter::once(&*node))?;
        }
        let mut recorder = Recorder::new(&mut nodes, recorded)?;
        sink.begin(recorder.columns())?;
        let wiring = Wiring { links, driven, maps };
        let mut first = Exchange::new(&mut nodes, wiring, Phase::Initialization, |_| true)?;
        first.drive(inputs.as_ref(), start, |_| true);
        let solved = first.propagate(&mut nodes, start);
        self.log.initial_loops = first.loops().cloned().collect();
        solved?;
        for node in &mut nodes {
            let left = node.slave.exit_initialization_mode();
            left.map_err(|source| CosimError::Call { time: start, source })?;
            stays(&self.surroundings, start, std::iter::once(&*node))?;
        }
        let rolls_back = matches!(self.log.algorithm, Algorithm::Iterative | Algorithm::Adaptive);
        let (units, step) = (&self.units, grid.step);
        let groups = nodes.iter().any(|n| n.planned.interface == ComponentInterface::ModelExchange);
        let shares = shares && (groups || event_mode.contains(&true));
        let alone = units.len() == 1;
        let steppers = |nodes: &mut [InstanceNode]| {
            let mut list: Vec<(Box<dyn SystemStepper>, u64)> = Vec::new();
            for unit in units {
                let every = u64::from(nodes[unit[0]].planned.every);
                let mut stepper: Box<dyn SystemStepper> = match nodes[unit[0]].rule {
                    Some(rule) => {
                        let step = step * every as f64;
                        let lines = shared[unit[0]].clone();
                        let restored = rolls_back || shares && nodes[unit[0]].can_restore();
                        let slave = SlaveStepper::new(nodes, unit[0], rule, step, restored, lines);
                        match &nodes[unit[0]] {
                            node if event_mode[unit[0]] => Box::new(EventStepper::new(
                                slave,
                                unit[0],
                                discrete_inputs(node, unit[0], wiring),
                                [start, grid.stop - start],
                            )),
                            _ => Box::new(slave),
                        }
                    }
                    None => {
                        let span = grid.stop - grid.start;
                        Box::new(GroupStepper::new(nodes, unit, wiring, *tolerance, span)?)
                    }
                };
                // Where an event stops all, it shows in the results.
                if shares || alone && !rolls_back {
                    stepper.stop_at_events();
                }
                list.push((stepper, every));
            }
            Ok(list)
        };
        let order = std::mem::take(&mut self.order);
        let mut coupling = Coupling::new(nodes, wiring, inputs.clone(), steppers, order, start)?;
        if shares {
            coupling.share_events(self.log.algorithm == Algorithm::GaussSeidel);
        }
        recorder.row(coupling.nodes(), start, Some(0), sink)?;
        Ok((coupling, recorder))
    }

    fn steps(
        &mut self,
        coupling: &mut Coupling,
        recorder: &mut Recorder,
        sink: &mut dyn ResultSink,
    ) -> Result<(), CosimError> {
        let grid = self.plan.grid;
        let algorithm = self.log.algorithm;
        if algorithm == Algorithm::Adaptive {
            return self.adapt(coupling, recorder, sink);
        }
        let follows = algorithm != Algorithm::Jacobi;
        let cuts = &std::mem::take(&mut self.cuts);
        // The end of a step from `time`, which is at or behind `point`.
        let next = |time: f64, point: u64| {
            move |every: u64| {
                let to = grid.time((point + every).min(grid.steps));
                cuts.between(time, to).map_or(to, |(cut, _)| cut)
            }
        };
        let events_show = self.plan.event_rows.unwrap_or(self.units.len() == 1);
        let inputs_show = self.plan.event_rows != Some(false);
        let mut time = grid.start;
        if follows {
            coupling.draw_lines(next(time, 0));
        }
        let within = if algorithm == Algorithm::Extrapolate { StepLimit::Line } else { StepLimit::Held };
        let mut straight = match algorithm {
            Algorithm::Jacobi | Algorithm::Extrapolate => coupling.straight(within),
            _ => None,
        };
        let mut point = 0;
        while point < grid.steps {
            let mut mid = None;
            if let Some(program) = &mut straight {
                let until = recorder.next_due(point).min(grid.regular());
                let (made, stopped) = coupling.race(program, &grid, point, until)?;
                (point, mid) = (point + made, stopped);
                time = grid.time(point);
                self.log.steps += made;
                self.log.time = time;
                if made > 0 {
                    recorder.row(coupling.nodes(), time, Some(point), sink)?;
                }
                if point == grid.steps {
                    return Ok(());
                }
            }
            let i = point;
            point += 1;
            let to = grid.time(i + 1);
            while time < to {
                let cut = cuts.between(time, to);
                let end = cut.map_or(to, |(cut, _)| cut);
                coupling.turn(i + 1, i + 1 == grid.steps);
                let mut done = match algorithm {
                    Algorithm::Jacobi | Algorithm::Extrapolate => match mid.take() {
                        Some(mid) => coupling.finish(mid, end, within)?,
                        None => coupling.step(end, within)?,
                    },
                    Algorithm::GaussSeidel => coupling.step_in_order(end)?,
                    _ => self.settle(coupling, time, end)?,
                };
                self.log.steps += 1;
                self.log.discarded += done.discarded;
                self.log.events += done.events;
                self.log.time = done.time;
                // Between points, rows are written where something jumps: one before, one after it.
                let jumps = done.event && events_show || inputs_show && cut.is_some_and(|(_, jumps)| jumps);
                let between = done.time < to && jumps;
                if between {
                    recorder.row(coupling.nodes(), done.time, None, sink)?;
                }
                if algorithm != Algorithm::Iterative {
                    if follows {
                        coupling.extrapolate_held(end);
                    }
                    coupling.exchange(done.time)?;
                }
                let settled = coupling.settle(done.time)?;
                self.log.events += settled.events;
                done.terminate |= settled.terminated;
                time = done.time;
                if follows {
                    coupling.draw_lines(next(time, if time < to { i } else { i + 1 }));
                }
                if between && !done.terminate {
                    recorder.row(coupling.nodes(), done.time, None, sink)?;
                } else if time >= to || done.terminate {
                    recorder.row(coupling.nodes(), done.time, Some(i + 1), sink)?;
                }
                if done.terminate {
                    self.log.terminated_by = Some(coupling.terminated_by());
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// Steps of the length that the error of the run allows; a row after each pair of them.
    fn adapt(
        &mut self,
        coupling: &mut Coupling,
        recorder: &mut Recorder,
        sink: &mut dyn ResultSink,
    ) -> Result<(), CosimError> {
        let CommunicationGrid { start, stop, step, .. } = self.plan.grid;
        let tolerance = self.plan.tolerance.unwrap_or(adaptive::TOLERANCE);
        let mut adaptive = Adaptive::new(&mut coupling.parts(), tolerance, [start, stop], step)?;
        let mut time = start;
        while time < stop {
            let done = adaptive.advance(&mut coupling.parts(), time);
            self.log.adapted = Some(adaptive.log());
            self.log.steps = adaptive.log().accepted;
            self.log.rejected = adaptive.log().rejected;
            let done = done?;
            time = done.time;
            self.log.time = time;
            self.log.discarded += done.discarded;
            self.log.events += done.events;
            recorder.row(coupling.nodes(), time, None, sink)?;
            if done.terminate {
                self.log.terminated_by = Some(adaptive.ended(coupling.nodes()));
                break;
            }
        }
        let error = adaptive.log().error;
        if error > 2.0 * tolerance {
            self.log.notes.push(format!(
                "the error of the run is estimated as {error:.1e} (relative), above the tolerance of {tolerance:e}: values jump, or errors grow by \
                 themselves; to be sure, run again with a smaller tolerance and compare"
            ));
        }
        Ok(())
    }

    /// Repeats the step until its inputs settle; in parts, where it does not settle as a whole.
    fn settle(&mut self, coupling: &mut Coupling, from: f64, to: f64) -> Result<Advance, CosimError> {
        let tolerance = SETTLED * self.plan.tolerance.unwrap_or(TOLERANCE);
        let (mut time, mut step, mut halvings) = (from, to - from, 0);
        let mut all = Advance { time: to, ..Advance::default() };
        loop {
            let end = if time + step * (1.0 + 1e-9) >= to { to } else { time + step };
            coupling.save(time)?;
            let attempt = coupling.iterate(time, end, tolerance)?;
            self.log.iterations += u64::from(attempt.iterations);
            if attempt.settled {
                all.discarded += attempt.advance.discarded;
                all.events += attempt.advance.events;
                if attempt.advance.terminate || end >= to {
                    return Ok(Advance { discarded: all.discarded, events: all.events, ..attempt.advance });
                }
                let settled = coupling.settle(end)?;
                all.events += settled.events;
                if settled.terminated {
                    return Ok(Advance { time: end, terminate: true, ..all });
                }
                coupling.draw_lines(|_| (end + step).min(to));
                time = end;
                continue;
            }
            halvings += 1;
            let rigid = coupling.takes_whole_steps();
            if halvings > HALVINGS || rigid {
                let why = if rigid { "and an FMU takes no shorter step" } else { "however short the step" };
                let reason = format!("a step of {} s does not settle, {why}", ShortNumber(step));
                return Err(coupling.unsettled(time, end, tolerance, reason));
            }
            self.log.rejected += 1;
            coupling.restore(time)?;
            step *= 0.5;
        }
    }
}
