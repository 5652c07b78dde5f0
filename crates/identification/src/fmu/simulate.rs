//! A recording through the FMU: steps of the integrator, events, readings.

use trueup_fmi_description::description::Interface;
use trueup_fmi_import::{Error, Experiment, ModelExchange, StateColumns};
use trueup_numerics::Figure;
use trueup_numerics::driver::{DriveError, Memory, Options, Reached, Solver, Stepper, System};
use trueup_numerics::event::Direction;

use super::field::Field;
use super::lane::Lane;
use super::{FmuModel, Place, WIDTH};
use crate::predict::{InputMap, Plan, PredictError};
use trueup_plant::Lanes;

/// Why a run ended.
enum Stopped {
    Fmu(Box<Error>),
    Integrator(DriveError),
    Other(String),
}

impl From<Error> for Stopped {
    fn from(e: Error) -> Self {
        Self::Fmu(Box::new(e))
    }
}

/// Passes of an event iteration, and events between two samples, that count as without end.
const MOST: usize = 200;
/// Steps between two samples after which the stiff method is tried.
const STEPS: usize = 5000;

/// Nominal value of a sensitivity: steps follow the states alone.
const FREE: f64 = 1e100;

/// A run under way.
struct Under<'a> {
    slave: ModelExchange,
    references: Vec<u32>,
    columns: Option<&'a StateColumns>,
    completed: bool,
    t: f64,
    /// States, then the sensitivities of each lane.
    x: Vec<f64>,
    n: usize,
    lanes: Vec<Lane>,
    /// Event indicators as variables (FMI 3.0).
    shown: Vec<u32>,
    next_event: Option<f64>,
    stepper: Stepper,
    memory: Memory,
    options: Options,
    u: Vec<f64>,
    du: Vec<f64>,
    begin: f64,
    fresh: bool,
    /// The FMU has ended the run: its outputs stay.
    ended: bool,
}

/// How an event moves with the lanes.
struct Late {
    /// By how much later it comes, one per lane.
    by: Vec<f64>,
    /// Rates of the states before it.
    before: Vec<f64>,
    /// The FMU is in event mode already.
    entered: bool,
}

impl FmuModel {
    fn offered(&self) -> Option<&Interface> {
        self.fmu.description().model_exchange.as_ref()
    }

    /// Value references of the event indicators, where they are variables.
    fn shown_indicators(&self, count: usize) -> Vec<u32> {
        let d = self.fmu.description();
        let all =
            d.structure.event_indicators.iter().filter_map(|u| d.variables.get(d.resolve(u.reference)?));
        let scalars: Vec<u32> = all.filter(|v| v.dimensions.is_empty()).map(|v| v.value_reference).collect();
        if scalars.len() == count { scalars } else { Vec::new() }
    }

    /// What the sensors would show, with parameters `p`.
    pub(super) fn simulate(
        &self,
        plan: &Plan,
        p: &[f64],
        map: &InputMap<f64>,
    ) -> Result<Vec<f64>, PredictError> {
        let columns = StateColumns::of(self.fmu.description());
        let mut found = Err(Stopped::Other(String::new()));
        for solver in [Solver::Explicit, Solver::Stiff] {
            let mut y = vec![0.0; plan.len()];
            let each = &mut |run: &mut Under, at: usize, output: usize| {
                y[at] = self.output_of(&mut run.slave, output)?;
                Ok(())
            };
            found = self.attempt(plan, p, map, solver, columns.as_ref(), Vec::new(), each).map(|()| y);
            let stiff = matches!(
                &found,
                Err(Stopped::Integrator(DriveError::MaxSteps { .. } | DriveError::StepTooSmall { .. }))
            );
            if !stiff {
                break;
            }
        }
        found.map_err(|stopped| PredictError::Fmu {
            run: plan.name().into(),
            what: match stopped {
                Stopped::Fmu(e) => e.to_string(),
                Stopped::Integrator(e) => e.to_string(),
                Stopped::Other(e) => e,
            },
        })
    }

    fn attempt(
        &self,
        plan: &Plan,
        p: &[f64],
        map: &InputMap<f64>,
        solver: Solver,
        columns: Option<&StateColumns>,
        lanes: Vec<(Lane, InputMap<f64>)>,
        each: &mut dyn FnMut(&mut Under, usize, usize) -> Result<(), Stopped>,
    ) -> Result<(), Stopped> {
        let once = self.offered().is_some_and(|i| i.can_be_instantiated_only_once_per_process);
        // One that may exist only once is kept under the lock for as long as it runs.
        let mut idle = self.idle.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let kept = idle.pop();
        let mut held = once.then_some(idle);
        let slave = match kept {
            Some(slave) => slave,
            None => ModelExchange::new(&self.fmu)?,
        };
        let (lanes, maps): (Vec<Lane>, Vec<InputMap<f64>>) = lanes.into_iter().unzip();
        let mut run = self.start(slave, plan, p, map, solver, columns, lanes)?;
        for i in 0..plan.nodes() {
            run.node(i, plan, map, &maps)?;
            for (at, channel) in plan.due(i) {
                each(&mut run, at, plan.wanted()[channel])?;
            }
            if i + 1 < plan.nodes() && !run.ended {
                run.advance(plan.time(i) + plan.step(i))?;
            }
        }
        // One that cannot be reset is let go.
        if run.slave.reset().is_ok() {
            match &mut held {
                Some(idle) => idle.push(run.slave),
                None => {
                    self.idle.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(run.slave);
                }
            }
        }
        Ok(())
    }

    /// Readings with their derivatives, integrated along with the states; `None` where the FMU does not give them.
    pub(super) fn sensitivities(
        &self,
        plan: &Plan,
        p: &[Lanes],
        map: &InputMap<Lanes>,
        acting: &[usize],
    ) -> Option<Vec<Lanes>> {
        let columns = StateColumns::of(self.fmu.description())?;
        let plain = |v: &[Lanes]| -> Vec<f64> { v.iter().map(|v| v.re).collect() };
        let moved = |v: &[Lanes], k: usize| -> Vec<f64> { v.iter().map(|v| v.eps[k]).collect() };
        let lanes = self.lanes(p, map, acting).into_iter().zip(acting).map(|(lane, &k)| {
            // Without an entry of its own an input would count with gain 1.
            let zero = |v: Vec<f64>| if v.is_empty() { vec![0.0; self.inputs.len()] } else { v };
            (lane, InputMap { gain: zero(moved(&map.gain, k)), bias: zero(moved(&map.bias, k)) })
        });
        let mut y = vec![Lanes::default(); plan.len()];
        let each = &mut |run: &mut Under, at: usize, output: usize| {
            y[at].re = self.output_of(&mut run.slave, output)?;
            let place = self.output_places.iter().rfind(|p| p.begin <= output);
            let Some(place) = place else { return Ok(()) };
            let state = columns.states.iter().position(|r| *r == place.reference);
            for (j, &k) in acting.iter().enumerate() {
                let s = &run.x[run.n * (j + 1)..run.n * (j + 2)];
                if let Some(i) = state {
                    y[at].eps[k] = s[i];
                    continue;
                }
                let (by, seed) = run.lanes[j].knowns(&columns.states, s, &run.references, run.t - run.begin);
                let mut column = vec![0.0; place.len];
                run.slave.directional(&[place.reference], &by, &seed, &mut column)?;
                y[at].eps[k] = column[output - place.begin];
            }
            Ok(())
        };
        let map = InputMap { gain: plain(&map.gain), bias: plain(&map.bias) };
        let done =
            self.attempt(plan, &plain(p), &map, Solver::Explicit, Some(&columns), lanes.collect(), each);
        done.ok().map(|()| y)
    }

    fn output_of(&self, slave: &mut ModelExchange, output: usize) -> Result<f64, Stopped> {
        let place = self.output_places.iter().rfind(|p| p.begin <= output);
        let Some(place) = place else { return Err(Stopped::Other(format!("there is no output {output}"))) };
        let mut values = vec![0.0; place.len];
        slave.get(&[place.reference], &mut values)?;
        Ok(values[output - place.begin])
    }

    fn start<'a>(
        &self,
        mut slave: ModelExchange,
        plan: &Plan,
        p: &[f64],
        map: &InputMap<f64>,
        solver: Solver,
        columns: Option<&'a StateColumns>,
        lanes: Vec<Lane>,
    ) -> Result<Under<'a>, Stopped> {
        // How the first states move: they follow from the parameters, however the FMU does that.
        let mut first = Vec::new();
        for lane in &lanes {
            let mut ends = [Vec::new(), Vec::new()];
            for (end, sign) in ends.iter_mut().zip([-1.0, 1.0]) {
                let q: Vec<f64> = p.iter().zip(&lane.moves).map(|(p, m)| p + sign * WIDTH[1] * m).collect();
                let mut run = self.begin(slave, plan, &q, map, solver, columns, Vec::new())?;
                *end = std::mem::take(&mut run.x);
                slave = run.slave;
                slave.reset()?;
            }
            let [low, high] = ends;
            first.extend(high.iter().zip(low).map(|(h, l)| (h - l) / (2.0 * WIDTH[1])));
        }
        let mut run = self.begin(slave, plan, p, map, solver, columns, lanes)?;
        let n = run.n;
        run.x[n..].copy_from_slice(&first);
        Ok(run)
    }

    fn begin<'a>(
        &self,
        mut slave: ModelExchange,
        plan: &Plan,
        p: &[f64],
        map: &InputMap<f64>,
        solver: Solver,
        columns: Option<&'a StateColumns>,
        lanes: Vec<Lane>,
    ) -> Result<Under<'a>, Stopped> {
        let t = plan.time(0);
        // What is not said stays as the FMU has it.
        let changed = |place: &&Place| {
            (place.begin..place.begin + place.len).any(|i| p[i].to_bits() != self.starts[i].to_bits())
        };
        for (reference, kind, value) in &self.chosen {
            slave.choose(*reference, *kind, *value)?;
        }
        for place in self.parameter_places.iter().filter(changed) {
            slave.set(&[place.reference], &p[place.begin..place.begin + place.len])?;
        }
        slave.enter_initialization_mode(Experiment { start: t, ..Experiment::default() })?;
        let references: Vec<u32> = self.input_places.iter().map(|p| p.reference).collect();
        let (mut u, mut du) = (vec![0.0; self.inputs.len()], vec![0.0; self.inputs.len()]);
        plan.inputs_at(0, map, &mut u, &mut du);
        if !references.is_empty() {
            slave.set(&references, &u)?;
        }
        slave.exit_initialization_mode()?;
        let (states, indicators) = slave.counts()?;
        let mut run = Under {
            slave,
            references,
            columns,
            completed: self.offered().is_some_and(|i| i.needs_completed_integrator_step),
            t,
            x: vec![0.0; states * (1 + lanes.len())],
            n: states,
            stepper: Stepper::new(solver, vec![FREE; states * (1 + lanes.len())], indicators),
            lanes,
            shown: self.shown_indicators(indicators),
            next_event: None,
            memory: Memory::default(),
            options: Options { solver, tolerance: self.tolerance, max_steps: STEPS, ..Options::default() },
            u,
            du,
            begin: t,
            fresh: true,
            ended: false,
        };
        run.settle()?;
        Ok(run)
    }
}

impl Under<'_> {
    fn field<'b>(&'b mut self, nominal: &'b [f64]) -> (Field<'b>, &'b mut [f64]) {
        let field = Field {
            slave: &mut self.slave,
            references: &self.references,
            begin: self.begin,
            u: &self.u,
            du: &self.du,
            columns: self.columns,
            nominal,
            n: self.n,
            lanes: &self.lanes,
            failure: None,
        };
        (field, &mut self.x)
    }

    /// The FMU at the present time and states.
    fn place(&mut self) -> Result<(), Stopped> {
        let t = self.t;
        let (mut field, x) = self.field(&[]);
        Ok(field.place(t, x)?)
    }

    /// In event mode: iterates until nothing changes any more, then goes on in continuous time.
    fn settle(&mut self) -> Result<(), Stopped> {
        for pass in 0.. {
            let info = self.slave.update_discrete_states()?;
            self.next_event = info.next_event.filter(|t| t.is_finite());
            self.ended |= info.terminate;
            if !info.again || self.ended {
                break;
            }
            if pass > MOST {
                return Err(Stopped::Other(format!(
                    "its event iteration at t = {} s does not end",
                    Figure(self.t)
                )));
            }
        }
        self.slave.enter_continuous_time_mode()?;
        if self.n > 0 {
            self.slave.get_states(&mut self.x[..self.n])?;
            let nominal = &mut self.stepper.nominal_mut()[..self.n];
            self.slave.nominals(nominal)?;
            nominal.iter_mut().for_each(|x| *x = if x.is_finite() && *x != 0.0 { x.abs() } else { 1.0 });
        }
        self.fresh = true;
        Ok(())
    }

    /// An event; `jump`: by inputs that jump, else at a crossing that comes later by `Late` as the lanes move.
    fn event(&mut self, late: Option<Late>, jump: bool) -> Result<(), Stopped> {
        let n = self.n;
        let old = self.x[..n].to_vec();
        if !late.as_ref().is_some_and(|late| late.entered) {
            self.slave.enter_event_mode()?;
        }
        if jump {
            self.slave.set(&self.references, &self.u)?;
        }
        self.settle()?;
        if self.lanes.is_empty() {
            return Ok(());
        }
        self.place()?;
        let mut after = vec![0.0; n];
        self.slave.derivatives(&mut after)?;
        for k in 0..self.lanes.len() {
            let (dt, before) = late.as_ref().map_or((0.0, &after), |late| (late.by[k], &late.before));
            for i in 0..n {
                let s = n * (k + 1) + i;
                if self.x[i].to_bits() == old[i].to_bits() {
                    self.x[s] += (before[i] - after[i]) * dt;
                } else if self.x[i] == 0.0 {
                    // Stopped: wherever it came from.
                    self.x[s] = -after[i] * dt;
                } else {
                    return Err(Stopped::Other("how an event resets a state is not known".into()));
                }
            }
        }
        Ok(())
    }

    /// By how much the crossing of indicator `i`, here and now, comes later as each lane moves: -dz / (dz/dt). Parameters'
    /// part of dz is a directional derivative where indicators are variables (FMI 3.0), else a difference in event mode,
    /// where tunable parameters may be set.
    fn lateness(&mut self, i: usize) -> Result<Late, Stopped> {
        let (n, t, count) = (self.n, self.t, self.stepper.restart().len());
        let mut before = vec![0.0; n];
        self.slave.derivatives(&mut before)?;
        let mut z = vec![0.0; count];
        let mut at = |run: &mut Self, t: f64, x: &[f64]| -> Result<f64, Stopped> {
            let (mut field, _) = run.field(&[]);
            field.place(t, x)?;
            run.slave.indicators(&mut z)?;
            Ok(z[i])
        };
        let here = self.x.clone();
        let shifted = |by: f64, along: &[f64]| -> Vec<f64> {
            here[..n].iter().zip(along).map(|(x, f)| x + by * f).collect()
        };
        let span = 1e-7 * t.abs().max(1e-2);
        let rate = (at(self, t + span, &shifted(span, &before))?
            - at(self, t - span, &shifted(-span, &before))?)
            / (2.0 * span);
        let shown = self.shown.get(i).copied();
        let mut dz = Vec::new();
        for k in 0..self.lanes.len() {
            let s = here[n * (k + 1)..n * (k + 2)].to_vec();
            if let (Some(shown), Some(c)) = (shown, self.columns) {
                self.place()?;
                let (by, seed) = self.lanes[k].knowns(&c.states, &s, &self.references, t - self.begin);
                let mut column = [0.0];
                self.slave.directional(&[shown], &by, &seed, &mut column)?;
                dz.push(column[0]);
                continue;
            }
            if !self.lanes[k].u.is_empty() {
                return Err(Stopped::Other("how inputs move an event is not known".into()));
            }
            let size = s.iter().zip(&here).map(|(s, x)| s.abs() / (1e-3 + x.abs())).fold(0.0, f64::max);
            let by = 1e-6 / size.max(1e-30);
            dz.push((at(self, t, &shifted(by, &s))? - at(self, t, &shifted(-by, &s))?) / (2.0 * by));
        }
        self.place()?;
        let entered = shown.is_none() && self.lanes.iter().any(Lane::tunes);
        if entered {
            self.slave.enter_event_mode()?;
            for (lane, dz) in self.lanes.iter().zip(&mut dz).filter(|(lane, _)| lane.tunes()) {
                let mut ends = [0.0; 2];
                for (end, by) in ends.iter_mut().zip([-WIDTH[0], WIDTH[0]]) {
                    let (references, values) = lane.tuned(by);
                    self.slave.set(&references, &values)?;
                    self.slave.indicators(&mut z)?;
                    *end = z[i];
                }
                let (references, values) = lane.tuned(0.0);
                self.slave.set(&references, &values)?;
                *dz += (ends[1] - ends[0]) / (2.0 * WIDTH[0]);
            }
        }
        // One that is only grazed has no derivative.
        let later = |dz: f64| Some(-dz / rate).filter(|dt| dt.is_finite()).unwrap_or(0.0);
        Ok(Late { by: dz.into_iter().map(later).collect(), before, entered })
    }

    /// At a node: its inputs from here on; one that jumps is an event.
    fn node(
        &mut self,
        i: usize,
        plan: &Plan,
        map: &InputMap<f64>,
        maps: &[InputMap<f64>],
    ) -> Result<(), Stopped> {
        plan.inputs_at(i, map, &mut self.u, &mut self.du);
        for (lane, map) in self.lanes.iter_mut().zip(maps).filter(|(lane, _)| !lane.u.is_empty()) {
            plan.inputs_at(i, map, &mut lane.u, &mut lane.du);
        }
        self.begin = plan.time(i);
        self.t = self.begin;
        if self.ended {
            return Ok(());
        }
        if i > 0 && plan.jumps(i) {
            self.event(None, true)?;
        }
        self.place()
    }

    fn advance(&mut self, to: f64) -> Result<(), Stopped> {
        let mut events = 0;
        while self.t < to && !self.ended {
            let tiny = 4.0 * f64::EPSILON * to.abs().max(1.0);
            let timed = self.next_event.filter(|next| *next < to - tiny);
            let end = timed.map_or(to, |next| next.max(self.t));
            let crossed = if end - self.t <= tiny {
                self.t = end;
                None
            } else {
                self.step(end)?
            };
            self.place()?;
            let mut event = crossed.is_some() || timed.is_some_and(|next| self.t >= next);
            if self.completed {
                let done = self.slave.completed_integrator_step()?;
                self.ended |= done.terminate;
                event |= done.event;
            }
            if event {
                events += 1;
                if events > MOST {
                    return Err(Stopped::Other(format!(
                        "more than {MOST} events between t = {} s and the next sample",
                        self.begin
                    )));
                }
                let late = match crossed {
                    Some(i) if !self.lanes.is_empty() => Some(self.lateness(i)?),
                    _ => None,
                };
                self.event(late, false)?;
            }
        }
        Ok(())
    }

    /// One accepted step; the indicator at whose crossing it ended.
    fn step(&mut self, end: f64) -> Result<Option<usize>, Stopped> {
        let nominal = self.stepper.nominal_mut().to_vec();
        let mut field = Field {
            slave: &mut self.slave,
            references: &self.references,
            begin: self.begin,
            u: &self.u,
            du: &self.du,
            columns: self.columns,
            nominal: &nominal,
            n: self.n,
            lanes: &self.lanes,
            failure: None,
        };
        if self.fresh {
            let z = self.stepper.restart();
            if !z.is_empty() {
                field.indicators(self.t, &self.x, z);
            }
            self.fresh = false;
        }
        let mut done = Reached::default();
        let found = self.stepper.step(
            &mut field,
            &|_| Direction::Both,
            &mut self.t,
            &mut self.x,
            &mut self.memory,
            end,
            &self.options,
            &mut done,
        );
        if let Some(failure) = field.failure {
            return Err(failure.into());
        }
        found.map_err(Stopped::Integrator)
    }
}
