//! One instance of a model: its values, its mode, and the evaluation of its equations.

use crate::duals::Duals;
use crate::fault::{CallOutcome, CallStatus, discard, error};
use crate::integrator::StepIntegrator;
use crate::layout::Layout;
use crate::log::{MessageLog, WARNINGS};
use crate::memory::{InstanceMemory, StoredState};
use crate::model::FmuModel;
use crate::state_machine::{CallGroup, InstanceState, InstanceVersion, InterfaceType};
use std::sync::Arc;
use trueup_fmi::abi::fmi3::fmi3Boolean;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{LOG_CATEGORIES, Storage};
use trueup_numerics::driver;
use trueup_numerics::hybrid::At;

/// Results that are valid until a value changes.
#[derive(Debug, Default)]
pub(crate) struct EvaluationCache {
    pub(crate) y: Vec<f64>,
    pub(crate) dx: Vec<f64>,
    pub(crate) z: Vec<f64>,
    y_valid: bool,
    dx_valid: bool,
    z_valid: bool,
}

/// How an importer requests the instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InstanceSettings {
    /// Version of the standard.
    pub version: InstanceVersion,
    /// Interface type.
    pub interface: InterfaceType,
    /// FMI 3.0 Co-Simulation: the importer handles events.
    pub event_mode_used: bool,
    /// FMI 3.0 Co-Simulation: a step may end early.
    pub early_return_allowed: bool,
}

/// One instance.
pub struct ModelInstance<M: FmuModel> {
    pub(crate) settings: InstanceSettings,
    /// Shared with a step under way, see [`crate::co_simulation`].
    pub(crate) model: Arc<M>,
    pub(crate) layout: Layout,
    pub(crate) token: String,
    pub(crate) memory: InstanceMemory,
    pub(crate) cache: EvaluationCache,
    /// States and modes of an event iteration that is only tried.
    pub(crate) tried: (Vec<f64>, Vec<i32>),
    /// Bits of the warnings given on states of this run, and whether of its communication steps.
    said: (u32, bool),
    /// Where messages go.
    pub log: MessageLog,
    /// Boxed, because their addresses are the importer's handles.
    #[allow(clippy::vec_box)]
    pub(crate) snapshots: Vec<Box<StoredState>>,
    pub(crate) duals: Duals,
    /// Co-Simulation only; lent to the step under way.
    pub(crate) co_simulation: Option<Box<StepIntegrator>>,
    /// Indices of inputs that may be set in intermediate update mode.
    pub(crate) intermediate: Vec<u32>,
    /// The importer's callback and (as a number) its environment, see [`crate::abi`].
    pub(crate) intermediate_update: Option<(IntermediateUpdateFunction, usize)>,
}

/// The importer's function for intermediate update mode; called from [`crate::abi`] only.
pub(crate) type IntermediateUpdateFunction = unsafe extern "C" fn(
    *mut core::ffi::c_void,
    f64,
    fmi3Boolean,
    fmi3Boolean,
    fmi3Boolean,
    fmi3Boolean,
    *mut fmi3Boolean,
    *mut f64,
);

/// Relative tolerance of Co-Simulation while the importer requests none. That of the default experiment may be looser: it is
/// for solvers of importers, which an input that jumps can stop.
const TOLERANCE: f64 = 1e-9;

/// What an indicator of 0 is handed out as. 0 belongs to the domain below it ([`Direction::counts`](trueup_numerics::event::Direction)), which
/// integrators of others cannot know: one that ends a step where an indicator from below is 0 finds no event due there, and
/// does not see this indicator cross again. Far below all indicators, and the product of two is not 0.
const BELOW: f64 = -1e-100;

fn unasked(layout: &Layout) -> f64 {
    TOLERANCE.min(layout.table.experiment.tolerance)
}

impl<M: FmuModel> ModelInstance<M> {
    /// From the configuration packed into the library; the message gives the reason.
    pub fn new(configuration: &Configuration, settings: InstanceSettings) -> Result<Self, String> {
        let model = M::build(configuration)?;
        let layout = Layout::new(&model, configuration)?;
        let sizes = layout.sizes;
        let memory = InstanceMemory {
            state: InstanceState::Instantiated,
            t: 0.0,
            start_time: 0.0,
            stop_time: None,
            tolerance: unasked(&layout),
            x: vec![0.0; sizes.states],
            u: layout.inputs.clone(),
            p: layout.parameters.clone(),
            set: layout.given.clone(),
            modes: vec![0; sizes.modes],
            slopes: vec![0.0; sizes.inputs],
            slopes_new: false,
            passes: 0,
            start_stale: true,
            unchecked: true,
            driver: driver::DriverMemory::default(),
            last_successful: 0.0,
        };
        let cache = EvaluationCache {
            y: vec![0.0; sizes.outputs],
            dx: vec![0.0; sizes.states],
            z: vec![0.0; sizes.indicators],
            ..EvaluationCache::default()
        };
        let integrates = settings.interface == InterfaceType::CoSimulation;
        let co_simulation = integrates.then(|| Box::new(StepIntegrator::new(&layout, &model)));
        Ok(Self {
            settings,
            model: Arc::new(model),
            token: configuration.token.clone(),
            memory,
            cache,
            tried: (vec![0.0; sizes.states], vec![0; sizes.modes]),
            said: (0, false),
            log: MessageLog::default(),
            snapshots: Vec::new(),
            duals: Duals::default(),
            co_simulation,
            intermediate: Vec::new(),
            intermediate_update: None,
            layout,
        })
    }

    /// Whether a call is legal now.
    pub fn permit(&self, call: CallGroup) -> CallOutcome {
        call.permit(self.settings.version, self.settings.interface, self.memory.state)
    }
    /// Current time in s.
    pub fn time(&self) -> f64 {
        self.memory.t
    }
    pub(crate) fn enter(&mut self, state: InstanceState) {
        self.memory.state = state;
    }
    /// A value changed: results are to be computed again.
    pub(crate) fn touch(&mut self) {
        (self.cache.y_valid, self.cache.dx_valid, self.cache.z_valid) = (false, false, false);
    }
    /// A panic was caught: nothing but freeing is left.
    pub fn lose(&mut self) {
        self.memory.state = InstanceState::Fatal;
    }
    /// Whether a panic was caught.
    pub fn is_lost(&self) -> bool {
        self.memory.state == InstanceState::Fatal
    }
    /// Whether a step may end early.
    pub fn early_return_allowed(&self) -> bool {
        self.settings.early_return_allowed
    }
    /// End of the last successful step in s.
    pub fn last_successful_time(&self) -> f64 {
        self.memory.last_successful
    }
    /// Model, table and start values.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }
    /// Inputs (value references) that may be set in intermediate update mode.
    pub fn require_intermediate(&mut self, references: &[u32]) -> Result<(), String> {
        for reference in references {
            self.layout.find(self.settings.version, *reference).map_err(|f| f.message)?;
        }
        self.intermediate = references.to_vec();
        Ok(())
    }
    /// fmiXSetDebugLogging.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[String]) -> CallOutcome {
        self.permit(CallGroup::Any)?;
        let others_stay = self.settings.version == InstanceVersion::Fmi3;
        self.log.switch(on, categories, others_stay).or_else(|name| {
            let known: Vec<_> = LOG_CATEGORIES.iter().map(|c| c.0).collect();
            error(format!("unknown log category {name:?}: take {}", known.join(", ")))
        })
    }
    pub(crate) fn is_initial(&self) -> bool {
        matches!(
            self.memory.state,
            InstanceState::Instantiated | InstanceState::Configuration | InstanceState::Initialization
        )
    }

    /// Makes the instance fit to be evaluated: parameters consistent, initial states computed.
    pub(crate) fn ready(&mut self) -> CallOutcome {
        let m = &mut self.memory;
        if m.unchecked {
            if let Err((i, why)) = self.model.check(&m.p) {
                let value = m.p.get(i).copied().unwrap_or(f64::NAN);
                return error(format!("`{}` = {value:?}: {why}", self.layout.name_of(Storage::Parameter(i))));
            }
            m.unchecked = false;
            if self.log.wants(WARNINGS)
                && let Some(remark) = self.model.remark(&self.memory.p)
            {
                self.log.say(CallStatus::Warning, WARNINGS, remark);
            }
        }
        let m = &mut self.memory;
        if m.start_stale {
            self.model.start(&m.p, &mut m.x);
            let at = At { t: m.t, x: &m.x, u: &m.u, p: &m.p, modes: &[] };
            self.model.start_modes(at, &mut m.modes);
            self.touch();
            self.finite_states()?;
            self.memory.start_stale = false;
        }
        Ok(())
    }
    /// Warns of states that the model is not made for, of each thing once a run.
    pub(crate) fn watch(&mut self) {
        if !self.log.wants(WARNINGS) {
            return;
        }
        let m = &self.memory;
        let at = At { t: m.t, x: &m.x, u: &m.u, p: &m.p, modes: &m.modes };
        if let Some((bit, warning)) = self.model.watch(at, self.said.0) {
            self.said.0 |= bit;
            self.log.say(CallStatus::Warning, WARNINGS, warning);
        }
    }
    /// Warns of a communication step that is too long for the model, once a run.
    pub(crate) fn watch_step(&mut self, h: f64) {
        if self.said.1 || !self.log.wants(WARNINGS) {
            return;
        }
        if let Some(warning) = self.model.long_step(h, &self.memory.p) {
            self.said.1 = true;
            self.log.say(CallStatus::Warning, WARNINGS, warning);
        }
    }
    /// Why values are not numbers now, as far as the model reports it; else `otherwise`.
    pub(crate) fn singular(&self, otherwise: &str) -> String {
        let m = &self.memory;
        let at = At { t: m.t, x: &m.x, u: &m.u, p: &m.p, modes: &m.modes };
        self.model.singular(at).unwrap_or_else(|| otherwise.to_owned())
    }
    pub(crate) fn finite_states(&self) -> CallOutcome {
        match self.memory.x.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(i) => error(format!(
                "state `{}` became {} at time {:?}; check parameters and inputs",
                self.layout.name_of(Storage::State(i)),
                self.memory.x[i],
                self.memory.t
            )),
        }
    }
    fn finite(&self, values: &[f64], place: fn(usize) -> Storage) -> CallOutcome {
        match values.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(i) => discard(format!(
                "`{}` is {} at time {:?} with these states and inputs; {}",
                self.layout.name_of(place(i)),
                values[i],
                self.memory.t,
                self.singular("try a smaller step")
            )),
        }
    }

    /// Computes the rates of the states if they are out of date.
    pub(crate) fn evaluate_rates(&mut self) -> CallOutcome {
        if self.cache.dx_valid {
            return Ok(());
        }
        self.ready()?;
        let m = &self.memory;
        let at = At { t: m.t, x: &m.x, u: &m.u, p: &m.p, modes: &m.modes };
        self.model.rates(at, &mut self.cache.dx);
        self.finite(&self.cache.dx, Storage::Rate)?;
        self.cache.dx_valid = true;
        Ok(())
    }
    /// Computes the outputs if they are out of date.
    pub(crate) fn evaluate_outputs(&mut self) -> CallOutcome {
        if self.cache.y_valid {
            return Ok(());
        }
        self.ready()?;
        let m = &self.memory;
        let at = At { t: m.t, x: &m.x, u: &m.u, p: &m.p, modes: &m.modes };
        self.model.outputs(at, &mut self.cache.y);
        self.finite(&self.cache.y, Storage::Output)?;
        self.cache.y_valid = true;
        // Importers need not report completed steps, but read outputs at the present state.
        if self.settings.interface == InterfaceType::ModelExchange && !self.is_initial() {
            self.watch();
        }
        Ok(())
    }
    /// Computes the event indicators if they are out of date.
    pub(crate) fn evaluate_indicators(&mut self) -> CallOutcome {
        if self.cache.z_valid {
            return Ok(());
        }
        self.ready()?;
        let m = &self.memory;
        let at = At { t: m.t, x: &m.x, u: &m.u, p: &m.p, modes: &m.modes };
        self.model.indicators(at, &mut self.cache.z);
        if let Some(i) = self.cache.z.iter().position(|v| !v.is_finite()) {
            return discard(format!(
                "event indicator {} is {} at time {:?}; {}",
                i + 1,
                self.cache.z[i],
                m.t,
                self.singular("try a smaller step")
            ));
        }
        self.cache.z.iter_mut().filter(|z| **z == 0.0).for_each(|z| *z = BELOW);
        self.cache.z_valid = true;
        Ok(())
    }

    /// fmi2SetupExperiment and the arguments of fmi3EnterInitializationMode.
    pub fn setup_experiment(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> CallOutcome {
        if let Some(tol) = tolerance.filter(|tol| !(tol.is_finite() && *tol > 0.0)) {
            return error(format!("tolerance = {tol:?}: it must be a number above 0"));
        }
        if !start.is_finite() {
            return error(format!("startTime = {start:?}: it must be a finite number"));
        }
        if let Some(stop) = stop.filter(|stop| stop.is_nan() || *stop < start) {
            return error(format!("stopTime = {stop:?} is before startTime = {start:?}"));
        }
        let m = &mut self.memory;
        m.tolerance = tolerance.unwrap_or(unasked(&self.layout));
        (m.t, m.start_time, m.stop_time, m.last_successful) = (start, start, stop, start);
        m.start_stale = true;
        self.touch();
        Ok(())
    }
    /// fmiXEnterInitializationMode.
    pub fn enter_initialization(&mut self) -> CallOutcome {
        self.permit(CallGroup::EnterInitialization)?;
        self.enter(InstanceState::Initialization);
        self.said = (0, false);
        Ok(())
    }
    /// fmiXExitInitializationMode.
    pub fn exit_initialization(&mut self) -> CallOutcome {
        self.permit(CallGroup::ExitInitialization)?;
        self.memory.start_stale = true;
        self.ready()?;
        self.memory.passes = 0;
        match self.settings.interface {
            InterfaceType::ModelExchange => self.enter(InstanceState::Event),
            InterfaceType::CoSimulation => self.begin_co_simulation()?,
        }
        self.watch();
        Ok(())
    }
    /// fmiXTerminate.
    pub fn terminate(&mut self) -> CallOutcome {
        self.permit(CallGroup::Terminate)?;
        self.enter(InstanceState::Terminated);
        Ok(())
    }
    /// fmiXReset: as after instantiation; logging stays as it is.
    pub fn reset(&mut self) -> CallOutcome {
        self.permit(CallGroup::Any)?;
        let m = &mut self.memory;
        m.state = InstanceState::Instantiated;
        (m.t, m.start_time, m.stop_time, m.last_successful) = (0.0, 0.0, None, 0.0);
        m.tolerance = unasked(&self.layout);
        m.x.fill(0.0);
        m.u.copy_from_slice(&self.layout.inputs);
        m.p.copy_from_slice(&self.layout.parameters);
        m.set.copy_from_slice(&self.layout.given);
        m.modes.fill(0);
        m.slopes.fill(0.0);
        (m.slopes_new, m.passes, m.start_stale, m.unchecked) = (false, 0, true, true);
        m.driver = driver::DriverMemory::default();
        self.touch();
        Ok(())
    }
}
