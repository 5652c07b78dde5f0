//! An FMU for Model Exchange as a plant, of any vendor.
//!
//! An FMU keeps its modes to itself. Of a plant's modes there is one here, the number of a place on the FMU's way: the instance
//! as it was initialised, and then as each event left it. An FMU goes one way only, so modes that an event has ended cannot be
//! requested any more.
//!
//! Derivatives are directional derivatives where the FMU offers them, else central differences. A parameter that is fixed acts
//! through the initialisation alone as far as the standard goes: along it there are differences of starts, and none of rates.

mod derivatives;
mod ports;
mod seat;
mod table;

use std::any::Any;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, EventUpdate, ModelSizes};
use trueup_plant::{Coordinate, InsertionPoint, Lanes, Plant, PlantError, VariableTable};

use crate::{FmiStatus, ImportError, UnpackedFmu};
pub use ports::{ForceInput, HybridPorts};
use seat::Seat;
use table::{DirectionalUnknowns, ElementReferences, SomeElements};
pub use table::{MAX_ELEMENTS, element_quantities};

/// An FMU for Model Exchange as a [`Plant`]: one run at a time ([`Plant::with`] no effects is another instance). It has the
/// coordinates of its ports ([`HybridFmu::with_ports`]), whose forces are inputs; without ports none. What it refuses (Discard) becomes NaN, at which an integrator tries a
/// shorter step; of any other failure the results are NaN and [`HybridFmu::failure`] gives the reason.
pub struct HybridFmu {
    fmu: Arc<UnpackedFmu>,
    start: f64,
    table: VariableTable,
    places: ElementReferences,
    unknown: DirectionalUnknowns,
    ports: HybridPorts,
    sizes: ModelSizes,
    way: Mutex<EventPath>,
}

/// The instance and what became of it.
#[derive(Default)]
struct EventPath {
    seat: Option<Seat>,
    /// Number of the last place.
    last: i32,
    failure: Option<String>,
}

/// Which values are requested.
#[derive(Clone, Copy, PartialEq, Eq)]
enum HybridQuery {
    Rates,
    Outputs,
    Indicators,
}

impl std::fmt::Debug for HybridFmu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("HybridFmu").field("file", &self.fmu.file()).finish_non_exhaustive()
    }
}

impl HybridFmu {
    /// This FMU, its runs beginning at `start` s.
    ///
    /// # Errors
    /// No Model Exchange; too many variables; no instance.
    pub fn new(fmu: &Arc<UnpackedFmu>, start: f64) -> Result<Self, PlantError> {
        let d = fmu.description();
        let file = fmu.file().display();
        if d.model_exchange.is_none() {
            return Err(PlantError(format!("{file} does not offer Model Exchange; export it for that")));
        }
        let (table, places, unknown) =
            table::read(d).map_err(|what| PlantError(format!("{file}: {what}")))?;
        let mut seat = Seat::new(fmu).map_err(|e| PlantError(e.to_string()))?;
        let (states, indicators) = seat.instance.counts(d.into()).map_err(|e| PlantError(e.to_string()))?;
        let sizes = ModelSizes {
            states,
            inputs: table.inputs.len(),
            parameters: table.parameters.len(),
            outputs: table.outputs.len(),
            modes: 1,
            indicators,
        };
        let way = Mutex::new(EventPath { seat: Some(seat), ..EventPath::default() });
        let offered = d.model_exchange.as_ref().is_some_and(|i| i.provides_directional_derivatives);
        let ports = HybridPorts::default();
        let mut plant = Self { fmu: Arc::clone(fmu), start, table, places, unknown, ports, sizes, way };
        // Indicators of FMI 2.0 are no variables.
        let complete = |all: &SomeElements, count| all.elements.len() == count;
        if !(offered && complete(&plant.unknown.rates, states)) {
            plant = plant.by_differences();
        } else if !complete(&plant.unknown.indicators, indicators) {
            plant.unknown.indicators = SomeElements::default();
        }
        Ok(plant)
    }

    /// The same with differences in place of directional derivatives, which are the FMU's own and may be wrong.
    #[must_use]
    pub fn by_differences(self) -> Self {
        Self { unknown: DirectionalUnknowns::default(), ..self }
    }
    /// The same with these coordinates and readings.
    ///
    /// # Errors
    /// Not one force for each coordinate; a variable that there is not.
    pub fn with_ports(self, ports: HybridPorts) -> Result<Self, PlantError> {
        match ports.mistake(&self.sizes) {
            Some(what) => Err(PlantError(format!("{}: {what}", self.fmu.file().display()))),
            None => Ok(Self { ports, ..self }),
        }
    }
    /// The FMU.
    pub fn fmu(&self) -> &Arc<UnpackedFmu> {
        &self.fmu
    }
    /// Reports to the FMU that a step is accepted, where it declares to need that: at the values requested last.
    /// `true`: an event is due ([`Plant::update`]).
    pub fn completed_step(&self) -> bool {
        let wants = self.fmu.description().model_exchange.as_ref();
        if !wants.is_some_and(|i| i.needs_completed_integrator_step) {
            return false;
        }
        let mut way = self.way();
        let done = way.seat.as_mut().filter(|s| !s.open).map(|s| s.completed_step());
        match done {
            Some(Err(e)) => {
                Self::fail(&mut way, e.to_string());
                false
            }
            Some(Ok(event)) => event,
            None => false,
        }
    }
    /// The first call that failed since this was read last.
    pub fn failure(&self) -> Option<String> {
        self.way().failure.take()
    }

    fn way(&self) -> MutexGuard<'_, EventPath> {
        self.way.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Keeps what failed; the results are NaN.
    fn kept(way: &mut EventPath, done: Result<(), ImportError>, result: &mut [f64]) {
        let Err(error) = done else { return };
        result.fill(f64::NAN);
        if error.status() != Some(FmiStatus::Discard) {
            Self::fail(way, error.to_string());
        }
    }
    fn fail(way: &mut EventPath, what: String) {
        way.failure.get_or_insert(what);
    }

    /// An instance initialised with these parameters and inputs (none: the FMU's own), in event mode.
    fn initialise(&self, way: &mut EventPath, p: &[f64], u: Option<&[f64]>) -> Result<(), ImportError> {
        // One that cannot be reset is let go.
        let renewed = way.seat.take().and_then(|mut seat| seat.renew().is_ok().then_some(seat));
        let mut seat = match renewed {
            Some(seat) => seat,
            None => Seat::new(&self.fmu)?,
        };
        seat.initialise(self.start, &self.places, &self.table, p, u)?;
        way.last += 1;
        seat.at = way.last;
        way.seat = Some(seat);
        Ok(())
    }

    /// The instance at the place of these modes, in continuous time; place 0 is the first one, its events processed.
    fn seat<'a>(&self, way: &'a mut EventPath, at: At<f64>) -> Result<Option<&'a mut Seat>, ImportError> {
        let wanted = at.modes.first().copied().unwrap_or(0);
        let fresh = way.seat.as_ref().is_some_and(|s| s.first && s.same(at.p));
        if wanted == 0 && !fresh {
            self.initialise(way, at.p, Some(at.u))?;
        }
        let here = way.seat.as_ref().is_some_and(|s| (wanted == 0 || s.at == wanted) && s.same(at.p));
        if !here {
            Self::fail(
                way,
                format!(
                    "{}: these modes, or these parameters in them, are before an event or another start; an FMU cannot go back: start again",
                    self.fmu.file().display()
                ),
            );
            return Ok(None);
        }
        if let Some(seat) = way.seat.as_mut().filter(|seat| seat.open) {
            seat.settle()?;
        }
        Ok(way.seat.as_mut())
    }

    fn read(&self, seat: &mut Seat, asked: HybridQuery, result: &mut [f64]) -> Result<(), ImportError> {
        match asked {
            // An FMU without states, outputs or indicators may lack the function.
            _ if result.is_empty() => Ok(()),
            HybridQuery::Rates => seat.instance.derivatives(result),
            HybridQuery::Outputs => seat.instance.get_float64(&self.places.outputs, result),
            HybridQuery::Indicators => seat.instance.indicators(result),
        }
    }

    fn ask(&self, asked: HybridQuery, at: At<f64>, result: &mut [f64]) {
        let mut way = self.way();
        let done = match self.seat(&mut way, at) {
            Ok(Some(seat)) => {
                seat.place(at.t, at.x, &self.places, at.u).and_then(|()| self.read(seat, asked, result))
            }
            Ok(None) => {
                result.fill(f64::NAN);
                Ok(())
            }
            Err(e) => Err(e),
        };
        Self::kept(&mut way, done, result);
    }
}

impl Plant for HybridFmu {
    fn model(&self) -> &str {
        &self.fmu.description().model_name
    }
    fn table(&self) -> &VariableTable {
        &self.table
    }
    fn coordinates(&self) -> &[Coordinate] {
        &self.ports.coordinates
    }
    fn insertion_points(&self) -> Vec<InsertionPoint> {
        self.ports.insertion_points(&self.table)
    }
    fn sizes(&self) -> ModelSizes {
        self.sizes
    }
    fn with(&self, effects: &[&str]) -> Result<Box<dyn Plant>, PlantError> {
        if let Some(id) = effects.first() {
            return Err(PlantError(format!("no effect can act in an FMU, `{id}` neither; leave it out")));
        }
        Ok(Box::new(Self::new(&self.fmu, self.start)?.with_ports(self.ports.clone())?))
    }
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn start(&self, p: &[f64], x: &mut [f64]) {
        let mut way = self.way();
        let done = self.initialise(&mut way, p, None).and_then(|()| match &mut way.seat {
            Some(seat) if !x.is_empty() => seat.instance.get_states(x),
            _ => Ok(()),
        });
        Self::kept(&mut way, done, x);
    }
    fn start_lanes(&self, p: &[Lanes], x: &mut [Lanes]) {
        self.starts(p, x);
    }
    /// An FMU declares nothing of its equilibria: it starts as its parameters have it.
    fn rest(&self, _: &mut [f64], _: &[f64]) {}
    fn rest_lanes(&self, _: &mut [Lanes], _: &[Lanes]) {}
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        let mut way = self.way();
        // Inputs may have a part in how it begins.
        let done = self.initialise(&mut way, at.p, Some(at.u));
        modes.fill(way.last);
        Self::kept(&mut way, done, &mut []);
    }
    fn rates(&self, at: At<f64>, force: &[f64], dx: &mut [f64]) {
        let u = self.ports.with_forces(at.u, at.p, force);
        self.ask(HybridQuery::Rates, At { u: u.as_deref().unwrap_or(at.u), ..at }, dx);
    }
    fn rates_lanes(&self, at: At<Lanes>, force: &[Lanes], dx: &mut [Lanes]) {
        let u = self.ports.with_forces(at.u, at.p, force);
        self.ask_lanes(HybridQuery::Rates, At { u: u.as_deref().unwrap_or(at.u), ..at }, dx);
    }
    fn outputs(&self, at: At<f64>, y: &mut [f64]) {
        self.ask(HybridQuery::Outputs, at, y);
    }
    fn outputs_lanes(&self, at: At<Lanes>, y: &mut [Lanes]) {
        self.ask_lanes(HybridQuery::Outputs, at, y);
    }
    fn indicators(&self, at: At<f64>, z: &mut [f64]) {
        self.ask(HybridQuery::Indicators, at, z);
    }
    fn indicators_lanes(&self, at: At<Lanes>, z: &mut [Lanes]) {
        self.ask_lanes(HybridQuery::Indicators, at, z);
    }
    fn direction(&self, _: usize) -> Direction {
        Direction::Both
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let mut way = self.way();
        let wanted = modes.first().copied().unwrap_or(0);
        let here = way.seat.as_ref().is_some_and(|s| s.at == wanted && s.same(p));
        let mut update = EventUpdate::default();
        let done = if here {
            let places = &self.places;
            way.seat.as_mut().map_or(Ok(()), |seat| seat.event(t, x, places, u).map(|done| update = done))
        } else {
            Self::fail(
                &mut way,
                format!("{}: an event of earlier modes; start again", self.fmu.file().display()),
            );
            Ok(())
        };
        Self::kept(&mut way, done, x);
        if way.seat.as_ref().is_some_and(|s| s.ended) {
            Self::fail(
                &mut way,
                format!("{}: the FMU ended the run at t = {t} s", self.fmu.file().display()),
            );
        }
        if here && update.settled() {
            way.last += 1;
            let last = way.last;
            if let Some(seat) = &mut way.seat {
                seat.at = last;
            }
            modes.fill(last);
        }
        update
    }
    fn next_event(&self, _: &[f64], _: &[i32]) -> Option<f64> {
        self.way().seat.as_ref().and_then(|s| s.next_event)
    }
}
