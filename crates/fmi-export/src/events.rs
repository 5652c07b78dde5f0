//! Event iteration, and what an importer's integrator needs in Model Exchange.

use crate::fault::{CallOutcome, CallStatus, discard, error};
use crate::instance::ModelInstance;
use crate::log::EVENTS;
use crate::model::FmuModel;
use crate::state_machine::{CallGroup, InstanceState, InterfaceType};
use trueup_fmi::table::Storage;
use trueup_numerics::hybrid::EventUpdate;

/// Passes of one event iteration after which it is assumed to be without end.
const MAX_PASSES: u32 = 1000;

/// Result of one pass of event iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EventIteration {
    /// Another pass is needed.
    pub needed: bool,
    /// States were given new values.
    pub states: bool,
    /// Time of the next event known beforehand, in s.
    pub next: Option<f64>,
}

impl<M: FmuModel> ModelInstance<M> {
    pub(crate) fn next_event(&self) -> Option<f64> {
        // One at infinity never comes.
        self.model.next_event(&self.memory.p, &self.memory.modes).filter(|t| t.is_finite())
    }
    fn pass(&mut self) -> CallOutcome<EventUpdate> {
        self.ready()?;
        let m = &mut self.memory;
        m.passes += 1;
        if m.passes > MAX_PASSES {
            return error(format!(
                "the event iteration at time {:?} does not settle after {MAX_PASSES} passes; check parameters and inputs",
                m.t
            ));
        }
        let update = self.model.update(m.t, &mut m.x, &m.u, &m.p, &mut m.modes);
        if m.passes == 1 && update.settled() {
            m.driver.event_time = f64::NEG_INFINITY; // it was none, with the inputs of now: the next one is the first
        }
        self.touch();
        self.finite_states()?;
        if !update.settled() && self.log.wants(EVENTS) {
            let text = format!(
                "event at time {:?}: {}; modes now {:?}",
                self.memory.t,
                if update.states { "states jumped" } else { "modes changed" },
                self.memory.modes
            );
            self.log.say(CallStatus::Ok, EVENTS, text);
        }
        Ok(update)
    }
    /// Event iteration until nothing changes.
    pub(crate) fn settle(&mut self) -> CallOutcome {
        self.memory.passes = 0;
        while !self.pass()?.settled() {}
        Ok(())
    }

    /// fmi2NewDiscreteStates, fmi3UpdateDiscreteStates: one pass.
    pub fn update_discrete_states(&mut self) -> CallOutcome<EventIteration> {
        self.permit(CallGroup::UpdateDiscreteStates)?;
        let update = self.pass()?;
        Ok(EventIteration { needed: !update.settled(), states: update.states, next: self.next_event() })
    }
    /// fmi3EvaluateDiscreteStates: nothing to do, the update evaluates them.
    pub fn evaluate_discrete_states(&mut self) -> CallOutcome {
        self.permit(CallGroup::UpdateDiscreteStates)
    }
    /// fmiXEnterEventMode.
    pub fn enter_event_mode(&mut self) -> CallOutcome {
        self.permit(CallGroup::EnterEvent)?;
        if self.settings.interface == InterfaceType::CoSimulation && !self.settings.event_mode_used {
            return error(
                "the instance was made without event mode (eventModeUsed): it handles its events itself",
            );
        }
        self.memory.passes = 0;
        self.enter(InstanceState::Event);
        Ok(())
    }
    /// fmiXEnterContinuousTimeMode.
    pub fn enter_continuous_time(&mut self) -> CallOutcome {
        self.permit(CallGroup::EnterContinuousTime)?;
        self.ready()?;
        self.enter(InstanceState::ContinuousTime);
        Ok(())
    }
    /// fmi3EnterStepMode.
    pub fn enter_step_mode(&mut self) -> CallOutcome {
        self.permit(CallGroup::EnterStep)?;
        self.ready()?;
        self.enter(InstanceState::Step);
        Ok(())
    }
    /// fmi3EnterConfigurationMode: legal, but there is nothing to configure.
    pub fn enter_configuration(&mut self) -> CallOutcome {
        self.permit(CallGroup::EnterConfiguration)?;
        self.enter(InstanceState::Configuration);
        Ok(())
    }
    /// fmi3ExitConfigurationMode.
    pub fn exit_configuration(&mut self) -> CallOutcome {
        self.permit(CallGroup::ExitConfiguration)?;
        self.enter(InstanceState::Instantiated);
        Ok(())
    }

    /// fmiXSetTime.
    pub fn set_time(&mut self, t: f64) -> CallOutcome {
        self.permit(CallGroup::SetTime)?;
        if !t.is_finite() {
            return error(format!("time = {t:?}: it must be a finite number"));
        }
        if t < self.memory.start_time {
            return error(format!("time = {t:?} is before the start time {:?}", self.memory.start_time));
        }
        self.memory.t = t;
        self.touch();
        Ok(())
    }
    /// fmiXSetContinuousStates. NaN and infinity are discarded: a solver's trial may produce them.
    pub fn set_states(&mut self, x: &[f64]) -> CallOutcome {
        self.permit(CallGroup::Integrator)?;
        self.expect_count("states", self.memory.x.len(), x.len())?;
        if let Some(i) = x.iter().position(|v| !v.is_finite()) {
            let name = self.layout.name_of(Storage::State(i));
            return discard(format!("state `{name}` = {}: it must be finite; try a smaller step", x[i]));
        }
        self.memory.x.copy_from_slice(x);
        self.touch();
        Ok(())
    }
    /// fmiXCompletedIntegratorStep: is an event due where the step ended? An integrator may have stepped over one.
    pub fn completed_integrator_step(&mut self) -> CallOutcome<bool> {
        self.permit(CallGroup::Integrator)?;
        self.ready()?;
        self.watch();
        let (m, (x, modes)) = (&self.memory, &mut self.tried);
        x.copy_from_slice(&m.x);
        modes.copy_from_slice(&m.modes);
        Ok(!self.model.update(m.t, x, &m.u, &m.p, modes).settled())
    }
    /// fmiXGetContinuousStates.
    pub fn get_states(&mut self, x: &mut [f64]) -> CallOutcome {
        self.permit(CallGroup::Evaluate)?;
        self.expect_count("states", self.memory.x.len(), x.len())?;
        self.ready()?;
        self.finite_states()?;
        x.copy_from_slice(&self.memory.x);
        Ok(())
    }
    /// fmi2GetDerivatives, fmi3GetContinuousStateDerivatives.
    pub fn get_rates(&mut self, dx: &mut [f64]) -> CallOutcome {
        self.permit(CallGroup::Evaluate)?;
        self.expect_count("states", self.memory.x.len(), dx.len())?;
        self.evaluate_rates()?;
        dx.copy_from_slice(&self.cache.dx);
        Ok(())
    }
    /// fmiXGetEventIndicators.
    pub fn get_indicators(&mut self, z: &mut [f64]) -> CallOutcome {
        self.permit(CallGroup::Evaluate)?;
        self.expect_count("event indicators", self.cache.z.len(), z.len())?;
        self.evaluate_indicators()?;
        z.copy_from_slice(&self.cache.z);
        Ok(())
    }
    /// fmiXGetNominalsOfContinuousStates.
    pub fn get_nominals(&mut self, nominals: &mut [f64]) -> CallOutcome {
        self.permit(CallGroup::Nominals)?;
        self.expect_count("states", self.memory.x.len(), nominals.len())?;
        nominals.copy_from_slice(&self.layout.nominals);
        Ok(())
    }
    fn expect_count(&self, what: &str, has: usize, given: usize) -> CallOutcome {
        if has == given {
            return Ok(());
        }
        error(format!("{given} values given, but the model has {has} {what}: give exactly {has}"))
    }
}
