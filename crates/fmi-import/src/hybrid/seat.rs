//! An instance on its way from its start over its events.

use std::sync::Arc;

use trueup_numerics::hybrid::EventUpdate;
use trueup_plant::VariableTable;

use super::table::ElementReferences;
use crate::{AnyInstance, EventInfo, ExperimentSetup, ImportError, InstanceOptions, UnpackedFmu};

pub(super) struct Seat {
    pub(super) instance: AnyInstance,
    /// Parameters that it was initialised with.
    p: Vec<f64>,
    /// Number of the place where it is.
    pub(super) at: i32,
    /// No event has come since its start.
    pub(super) first: bool,
    /// In event mode.
    pub(super) open: bool,
    /// Its event iteration has ended, with new states: the pass that a caller makes then finds nothing to do.
    ended_pass: bool,
    /// It was initialised, and has to be reset for another start.
    used: bool,
    /// The FMU has ended the run.
    pub(super) ended: bool,
    pub(super) next_event: Option<f64>,
}

impl Seat {
    pub(super) fn new(fmu: &Arc<UnpackedFmu>) -> Result<Self, ImportError> {
        let instance = AnyInstance::model_exchange(fmu, InstanceOptions::default())?;
        let (p, next_event) = (Vec::new(), None);
        let (at, flags) = (0, false);
        Ok(Self {
            instance,
            p,
            at,
            first: flags,
            open: flags,
            ended_pass: flags,
            used: flags,
            ended: flags,
            next_event,
        })
    }

    /// It was started with these parameters.
    pub(super) fn same(&self, p: &[f64]) -> bool {
        self.used && self.p.len() == p.len() && self.p.iter().zip(p).all(|(a, b)| a.to_bits() == b.to_bits())
    }

    pub(super) fn renew(&mut self) -> Result<(), ImportError> {
        if self.used {
            self.instance.reset()?;
        }
        (self.used, self.first, self.open, self.ended) = (false, false, false, false);
        (self.ended_pass, self.next_event) = (false, None);
        Ok(())
    }

    pub(super) fn initialise(
        &mut self,
        start: f64,
        places: &ElementReferences,
        table: &VariableTable,
        p: &[f64],
        u: Option<&[f64]>,
    ) -> Result<(), ImportError> {
        self.used = true;
        for place in &places.parameters {
            // What is not given stays as the FMU has it.
            let changed = place.elements().any(|i| p[i].to_bits() != table.parameters[i].start.to_bits());
            if changed {
                self.instance.set_float64(&[place.reference], &p[place.elements()])?;
            }
        }
        self.instance.enter_initialization_mode(ExperimentSetup { start, ..ExperimentSetup::default() })?;
        if let Some(u) = u.filter(|u| !u.is_empty()) {
            self.instance.set_float64(&places.inputs, u)?;
        }
        self.instance.exit_initialization_mode()?;
        self.p = p.to_vec();
        (self.first, self.open) = (true, true);
        Ok(())
    }

    fn keep(&mut self, info: EventInfo) {
        self.next_event = info.next_event.filter(|t| t.is_finite());
        self.ended |= info.terminate;
    }

    fn close(&mut self) -> Result<(), ImportError> {
        self.instance.enter_continuous_time_mode()?;
        self.open = false;
        Ok(())
    }

    /// Event iteration to its end.
    pub(super) fn settle(&mut self) -> Result<(), ImportError> {
        let info = self.instance.iterate_events()?;
        self.keep(info);
        self.close()
    }

    /// One pass of event iteration at these values.
    pub(super) fn event(
        &mut self,
        t: f64,
        x: &mut [f64],
        places: &ElementReferences,
        u: &[f64],
    ) -> Result<EventUpdate, ImportError> {
        if std::mem::take(&mut self.ended_pass) {
            return Ok(EventUpdate::default());
        }
        if !self.open {
            self.place(t, x, places, u)?;
            self.instance.enter_event_mode()?;
            (self.open, self.first) = (true, false);
        }
        if !u.is_empty() {
            self.instance.set_float64(&places.inputs, u)?;
        }
        let info = self.instance.update_discrete_states()?;
        self.keep(info);
        let again = info.again && !self.ended;
        if !again {
            self.close()?;
        }
        if info.states_changed && !x.is_empty() {
            self.instance.get_states(x)?;
        }
        self.ended_pass = !again && info.states_changed;
        Ok(EventUpdate { modes: again, states: info.states_changed })
    }

    pub(super) fn completed_step(&mut self) -> Result<bool, ImportError> {
        let done = self.instance.completed_integrator_step()?;
        self.ended |= done.terminate;
        Ok(done.event)
    }

    /// Time, states and inputs, in continuous time.
    pub(super) fn place(
        &mut self,
        t: f64,
        x: &[f64],
        places: &ElementReferences,
        u: &[f64],
    ) -> Result<(), ImportError> {
        self.ended_pass = false;
        self.instance.set_time(t)?;
        if !x.is_empty() {
            self.instance.set_states(x)?;
        }
        match places.continuous.references.as_slice() {
            [] => Ok(()),
            inputs => self.instance.set_float64(inputs, &places.continuous.of(u)),
        }
    }
}
