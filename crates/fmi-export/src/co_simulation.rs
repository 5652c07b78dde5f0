//! Co-Simulation: a communication step with the FMU's own integrator.
//!
//! A step has three parts: [`ModelInstance::begin_step`] checks the call and returns a [`Job`], which runs on
//! copies of its own, so that the importer may read and set the instance from within its intermediate
//! update callback; [`ModelInstance::finish_step`] takes the result over.

use crate::fault::{CallOutcome, CallStatus, discard, error};
use crate::instance::ModelInstance;
use crate::integrator::StepIntegrator;
use crate::log::EVENTS;
use crate::model::FmuModel;
use crate::state_machine::{CallGroup, InstanceState, InstanceVersion, InterfaceType};
use std::sync::Arc;
use trueup_fmi::table::Storage;
use trueup_numerics::driver::{
    DriveError, DriverMemory, DriverMoment, DriverQuantity, DriverReached, DriverState as Lent, DriverView,
    Flow, StepInputs,
};

/// A step under way.
pub struct Job<M> {
    model: Arc<M>,
    work: Box<StepIntegrator>,
    t_end: f64,
    /// Messages about events are requested.
    pub log_events: bool,
}

/// What the importer requests after an internal step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StepRequest {
    /// Go on.
    Continue,
    /// Go on with the inputs changed.
    InputsChanged,
    /// Return early, at this time (at once if it has passed).
    ReturnAt(f64),
}

impl<M: FmuModel> Job<M> {
    /// Integrates up to the end of the step. `observe` is called after every internal step and event.
    ///
    /// # Errors
    /// What kept the integrator from going on.
    pub fn run(
        &mut self,
        observe: &mut dyn FnMut(&mut DriverView) -> StepRequest,
    ) -> Result<DriverReached, DriveError> {
        let w = &mut *self.work;
        let mut t_end = self.t_end;
        let mut inputs =
            if w.slopes.iter().any(|s| *s != 0.0) { StepInputs::Ramp(&w.slopes) } else { StepInputs::Hold };
        loop {
            let mut wanted = None;
            let mut lent = Lent {
                t: &mut w.t,
                x: &mut w.x,
                u: &mut w.u,
                p: &w.p,
                modes: &mut w.modes,
                memory: &mut w.memory,
            };
            let reached = w.driver.advance_to(
                &*self.model,
                &mut lent,
                t_end,
                inputs,
                &mut |mut view: DriverView| match observe(&mut view) {
                    StepRequest::Continue => Flow::Continue,
                    StepRequest::InputsChanged => Flow::InputsChanged,
                    StepRequest::ReturnAt(t) => {
                        wanted = Some(t);
                        Flow::Return
                    }
                },
            )?;
            match wanted {
                Some(t) if t > reached.t && t < t_end && reached.pending.is_none() => {
                    t_end = t;
                    inputs = if matches!(inputs, StepInputs::Hold) {
                        StepInputs::Hold
                    } else {
                        StepInputs::Ramp(&w.slopes)
                    };
                }
                _ => return Ok(reached),
            }
        }
    }
}

/// How a step ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepEnd {
    /// Time reached in s.
    pub t: f64,
    /// The importer has to enter event mode.
    pub event: bool,
    /// Before the requested end.
    pub early: bool,
}

impl<M: FmuModel> ModelInstance<M> {
    /// End of initialization: events other than a sample due at the start are processed.
    pub(crate) fn begin_co_simulation(&mut self) -> CallOutcome {
        self.memory.driver = DriverMemory::default();
        if self.settings.event_mode_used {
            self.enter(InstanceState::Event);
            return Ok(());
        }
        let due = self.next_event().is_some_and(|next| next <= self.memory.t);
        if !due {
            self.settle()?;
        }
        self.enter(InstanceState::Step);
        Ok(())
    }

    /// First part of fmiXDoStep, from `t` by `h` s.
    pub fn begin_step(&mut self, t: f64, h: f64) -> CallOutcome<Job<M>> {
        self.permit(CallGroup::DoStep)?;
        let m = &self.memory;
        if !(h.is_finite() && h > 0.0) {
            return error(format!("communicationStepSize = {h:?}: it must be greater than 0"));
        }
        // Importers add up time in their own way.
        if !t.is_finite() || (t - m.t).abs() > 1e-9 * h.max(t.abs()) {
            return error(format!(
                "currentCommunicationPoint = {t:?}, but the instance is at {:?}: continue there or set a stored state",
                m.t
            ));
        }
        if let Some(stop) = m.stop_time.filter(|stop| t + h > stop + 1e-9 * h.max(stop.abs())) {
            return error(format!("the step ends at {:?}, beyond the stop time {stop:?}: shorten it", t + h));
        }
        self.ready()?;
        self.watch_step(h);
        let Some(mut work) = self.co_simulation.take() else {
            return error("the instance has no integrator: it was made for Model Exchange");
        };
        let m = &mut self.memory;
        if !m.slopes_new {
            m.slopes.fill(0.0);
        }
        m.slopes_new = false;
        work.t = m.t;
        work.x.copy_from_slice(&m.x);
        work.u.copy_from_slice(&m.u);
        work.p.copy_from_slice(&m.p);
        work.modes.copy_from_slice(&m.modes);
        work.slopes.copy_from_slice(&m.slopes);
        work.before.0.copy_from_slice(&m.x);
        work.before.1.copy_from_slice(&m.u);
        work.before.2.copy_from_slice(&m.modes);
        work.memory = m.driver;
        work.driver.options.tolerance = m.tolerance;
        work.driver.options.stop_at_event =
            self.settings.event_mode_used && self.settings.early_return_allowed;
        let t_end = (t + h).max(m.t);
        self.enter(InstanceState::Stepping);
        Ok(Job { model: Arc::clone(&self.model), work, t_end, log_events: self.log.wants(EVENTS) })
    }

    /// Shows the state within a step to the importer: intermediate update mode.
    pub fn publish(&mut self, view: &DriverView) -> CallOutcome {
        let m = &mut self.memory;
        m.t = view.t;
        m.x.copy_from_slice(view.x);
        m.u.copy_from_slice(view.u);
        m.modes.copy_from_slice(view.modes);
        self.enter(InstanceState::IntermediateUpdate);
        self.touch();
        Ok(())
    }
    /// Ends intermediate update mode; were inputs changed?
    pub fn collect(&mut self, view: &mut DriverView) -> bool {
        self.enter(InstanceState::Stepping);
        let changed = view.u != self.memory.u.as_slice();
        view.u.copy_from_slice(&self.memory.u);
        changed
    }
    /// Writes an event within a step to the log.
    pub fn report_event(&mut self, view: &DriverView) -> CallOutcome {
        if view.moment == DriverMoment::Event && self.log.wants(EVENTS) {
            let text = format!("event at time {:?}; modes now {:?}", view.t, view.modes);
            self.log.say(CallStatus::Ok, EVENTS, text);
        }
        Ok(())
    }

    /// Last part of fmiXDoStep.
    ///
    /// A step that could not be completed: FMI 2.0 keeps what was reached (Discard, last successful time),
    /// FMI 3.0 is as before the call (Discard); without any progress it is an Error.
    pub fn finish_step(
        &mut self,
        job: Job<M>,
        started: f64,
        result: Result<DriverReached, DriveError>,
    ) -> CallOutcome<StepEnd> {
        let w = job.work;
        let progress = w.t > started;
        let keep = result.is_ok() || self.settings.version == InstanceVersion::Fmi2;
        if keep {
            self.memory.t = w.t;
            self.memory.x.copy_from_slice(&w.x);
            self.memory.u.copy_from_slice(&w.u);
            self.memory.modes.copy_from_slice(&w.modes);
            self.memory.driver = w.memory;
            self.memory.last_successful = w.t;
        } else {
            self.memory.t = started;
            self.memory.x.copy_from_slice(&w.before.0);
            self.memory.u.copy_from_slice(&w.before.1);
            self.memory.modes.copy_from_slice(&w.before.2);
        }
        self.co_simulation = Some(w);
        self.touch();
        match result {
            Ok(reached) => {
                self.enter(InstanceState::Step);
                self.watch();
                let timed = || self.next_event().is_some_and(|next| next <= reached.t);
                let event = self.settings.event_mode_used && (reached.pending.is_some() || timed());
                Ok(StepEnd { t: reached.t, event, early: reached.t < job.t_end })
            }
            Err(e) => {
                let text = format!("the step to {:?} could not be completed: {}", job.t_end, self.explain(e));
                let discarded = progress && self.settings.version == InstanceVersion::Fmi2;
                self.enter(if discarded { InstanceState::StepFailed } else { InstanceState::Step });
                if progress { discard(text) } else { error(text) }
            }
        }
    }

    fn explain(&self, e: DriveError) -> String {
        let DriveError::NotFinite { t, what } = e else { return e.to_string() };
        let name = match what {
            DriverQuantity::State(i) => self.layout.name_of(Storage::State(i)),
            DriverQuantity::Rate(i) => self.layout.name_of(Storage::Rate(i)),
            DriverQuantity::Input(i) => self.layout.name_of(Storage::Input(i)),
            DriverQuantity::Indicator(i) => format!("eventIndicator[{}]", i + 1),
        };
        format!("`{name}` is not finite at time {t:?}; {}", self.singular("check parameters and inputs"))
    }

    /// fmi2SetRealInputDerivatives: slopes of inputs during the next step.
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> CallOutcome {
        self.permit(CallGroup::InputDerivatives)?;
        for ((reference, order), value) in references.iter().zip(orders).zip(values) {
            let (v, element, _) = self.input(*reference)?;
            let name = self.layout.variable(v).element_name(element);
            if *order != 1 {
                return error(format!("derivative of order {order} of `{name}`: only order 1 is taken"));
            }
            if !value.is_finite() {
                return error(format!("derivative of `{name}` = {value:?}: it must be a finite number"));
            }
        }
        for (reference, value) in references.iter().zip(values) {
            let (_, _, i) = self.input(*reference)?;
            if !self.memory.slopes_new {
                self.memory.slopes.fill(0.0);
            }
            self.memory.slopes_new = true;
            self.memory.slopes[i] = *value;
        }
        Ok(())
    }
    /// Variable, element and place of a continuous input.
    fn input(&self, reference: u32) -> CallOutcome<(usize, usize, usize)> {
        use crate::layout::ReferenceTarget;
        use trueup_fmi::table::{BoundaryType, Variability};
        if let ReferenceTarget::Variable(r) = self.layout.find(self.settings.version, reference)? {
            let v = self.layout.variable(r.variable);
            if let (Storage::Input(b), BoundaryType::Real, Variability::Continuous) =
                (v.storage, v.kind, v.variability)
            {
                return Ok((r.variable, r.first, b + r.first));
            }
            return error(format!(
                "`{}` is no continuous input: it has no input derivative",
                v.element_name(r.first)
            ));
        }
        error("an event indicator has no input derivative")
    }
    /// Whether the instance integrates itself.
    pub fn integrates(&self) -> bool {
        self.settings.interface == InterfaceType::CoSimulation
    }
}
