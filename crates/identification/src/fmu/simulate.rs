//! A recording through the FMU: steps of the integrator, events, readings.

use trueup_fmi_description::description::Interface;
use trueup_fmi_import::{Error, Experiment};
use trueup_numerics::driver::{DriveError, Memory, Options, Reached, Solver, Stepper, System};
use trueup_numerics::event::Direction;

use super::field::{Columns, Field};
use super::instance::Slave;
use super::{FmuModel, Place};
use crate::predict::{InputMap, Plan, PredictError};

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

/// A run under way.
struct Under<'a> {
    slave: Slave,
    references: Vec<u32>,
    columns: Option<&'a Columns>,
    completed: bool,
    t: f64,
    x: Vec<f64>,
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

impl FmuModel {
    fn offered(&self) -> Option<&Interface> {
        self.fmu.description().model_exchange.as_ref()
    }

    fn columns(&self) -> Option<Columns> {
        let d = self.fmu.description();
        self.offered().filter(|i| i.provides_directional_derivatives)?;
        let mut columns = Columns::default();
        for unknown in &d.structure.derivatives {
            let rate = d.variables.get(d.resolve(unknown.reference)?)?;
            let state = d.variables.get(d.resolve(rate.derivative?)?)?;
            if !(rate.dimensions.is_empty() && state.dimensions.is_empty()) {
                return None;
            }
            columns.states.push(state.value_reference);
            columns.derivatives.push(rate.value_reference);
        }
        Some(columns)
    }

    /// What the sensors would show, with parameters `p`.
    pub(super) fn simulate(
        &self,
        plan: &Plan,
        p: &[f64],
        map: &InputMap<f64>,
    ) -> Result<Vec<f64>, PredictError> {
        let columns = self.columns();
        let mut found = Err(Stopped::Other(String::new()));
        for solver in [Solver::Explicit, Solver::Stiff] {
            found = self.attempt(plan, p, map, solver, columns.as_ref());
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
        columns: Option<&Columns>,
    ) -> Result<Vec<f64>, Stopped> {
        let once = self.offered().is_some_and(|i| i.can_be_instantiated_only_once_per_process);
        // One that may exist only once is kept under the lock for as long as it runs.
        let mut idle = self.idle.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let kept = idle.pop();
        let mut held = once.then_some(idle);
        let slave = match kept {
            Some(slave) => slave,
            None => Slave::new(&self.fmu)?,
        };
        let mut run = self.start(slave, plan, p, map, solver, columns)?;
        let mut y = vec![0.0; plan.len()];
        for i in 0..plan.nodes() {
            run.node(i, plan, map)?;
            for (at, channel) in plan.due(i) {
                let output = plan.wanted()[channel];
                y[at] = self.output_of(&mut run.slave, output)?;
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
        Ok(y)
    }

    fn output_of(&self, slave: &mut Slave, output: usize) -> Result<f64, Stopped> {
        let place = self.output_places.iter().rfind(|p| p.begin <= output);
        let Some(place) = place else { return Err(Stopped::Other(format!("there is no output {output}"))) };
        let mut values = vec![0.0; place.len];
        slave.get(&[place.reference], &mut values)?;
        Ok(values[output - place.begin])
    }

    fn start<'a>(
        &self,
        mut slave: Slave,
        plan: &Plan,
        p: &[f64],
        map: &InputMap<f64>,
        solver: Solver,
        columns: Option<&'a Columns>,
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
            x: vec![0.0; states],
            next_event: None,
            stepper: Stepper::new(solver, vec![1.0; states], indicators),
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
    fn field<'b>(
        slave: &'b mut Slave,
        (references, u, du): (&'b [u32], &'b [f64], &'b [f64]),
        begin: f64,
        columns: Option<&'b Columns>,
        nominal: &'b [f64],
    ) -> Field<'b> {
        Field { slave, references, begin, u, du, columns, nominal, failure: None }
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
                return Err(Stopped::Other(format!("its event iteration at t = {} s does not end", self.t)));
            }
        }
        self.slave.enter_continuous_time_mode()?;
        if !self.x.is_empty() {
            self.slave.get_states(&mut self.x)?;
            let nominal = self.stepper.nominal_mut();
            self.slave.nominals(nominal)?;
            nominal.iter_mut().for_each(|x| *x = if x.is_finite() && *x != 0.0 { x.abs() } else { 1.0 });
        }
        self.fresh = true;
        Ok(())
    }

    /// At a node: its inputs from here on; one that jumps is an event.
    fn node(&mut self, i: usize, plan: &Plan, map: &InputMap<f64>) -> Result<(), Stopped> {
        let before = std::mem::take(&mut self.u);
        self.u = vec![0.0; before.len()];
        plan.inputs_at(i, map, &mut self.u, &mut self.du);
        self.begin = plan.time(i);
        self.t = self.begin;
        if self.ended {
            return Ok(());
        }
        if i > 0 && plan.jumps(i) {
            self.slave.enter_event_mode()?;
            self.slave.set(&self.references, &self.u)?;
            self.settle()?;
        }
        let mut field =
            Self::field(&mut self.slave, (&self.references, &self.u, &self.du), self.begin, None, &[]);
        field.place(self.t, &self.x)?;
        Ok(())
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
            let inputs = (&self.references[..], &self.u[..], &self.du[..]);
            let mut field = Self::field(&mut self.slave, inputs, self.begin, None, &[]);
            field.place(self.t, &self.x)?;
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
                self.slave.enter_event_mode()?;
                self.settle()?;
            }
        }
        Ok(())
    }

    /// One accepted step; the indicator at whose crossing it ended.
    fn step(&mut self, end: f64) -> Result<Option<usize>, Stopped> {
        let nominal = self.stepper.nominal_mut().to_vec();
        let inputs = (&self.references[..], &self.u[..], &self.du[..]);
        let mut field = Self::field(&mut self.slave, inputs, self.begin, self.columns, &nominal);
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
