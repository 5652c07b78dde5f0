//! An FMU for Model Exchange as a plant, of any vendor.
//!
//! An FMU keeps its modes to itself. Of a plant's modes there is one here, the number of a place on the FMU's way: the instance
//! as it was initialised, and then as each event left it. An FMU goes one way only, so modes that an event has ended cannot be
//! requested any more.
//!
//! Derivatives are directional derivatives where the FMU offers them, else central differences. A parameter that is fixed acts
//! through the initialisation alone as far as the standard goes: along it there are differences of starts, and none of rates.

mod seat;
mod table;

use std::any::Any;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, EventUpdate, ModelSizes};
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{Coordinate, LANES, Lanes, Plant, PlantError, VariableTable};

use crate::{FmiStatus, ImportError, StateColumns, UnpackedFmu};
use seat::Seat;
use table::ElementReferences;
pub use table::{MAX_ELEMENTS, element_quantities};

/// Half the width of a central difference, as a share of what is moved.
const WIDTH: f64 = 6e-6;

/// An FMU for Model Exchange as a [`Plant`]: one run at a time ([`Plant::with`] no effects is another instance). It has no
/// coordinates: an FMU takes no forces but its inputs. What it refuses (Discard) becomes NaN, at which an integrator tries a
/// shorter step; of any other failure the results are NaN and [`HybridFmu::failure`] gives the reason.
pub struct HybridFmu {
    fmu: Arc<UnpackedFmu>,
    start: f64,
    table: VariableTable,
    places: ElementReferences,
    columns: Option<StateColumns>,
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
#[derive(Clone, Copy)]
enum HybridQuery {
    Rates,
    Outputs,
    Indicators,
}

/// One direction in which the arguments move.
struct HybridScratch<'a> {
    t: f64,
    x: &'a [f64],
    u: &'a [f64],
    p: &'a [f64],
}

impl std::fmt::Debug for HybridFmu {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("HybridFmu").field("file", &self.fmu.file()).finish_non_exhaustive()
    }
}

fn values(lanes: &[Lanes]) -> Vec<f64> {
    lanes.iter().map(|v| v.re).collect()
}
fn lane(lanes: &[Lanes], k: usize) -> Vec<f64> {
    lanes.iter().map(|v| v.eps[k]).collect()
}
/// The largest part of a direction, relative to max(|value|, 1).
fn relative_size(along: &[f64], at: &[f64]) -> f64 {
    along.iter().zip(at).map(|(a, v)| a.abs() / v.abs().max(1.0)).fold(0.0, f64::max)
}
fn moved(at: &[f64], by: f64, along: &[f64]) -> Vec<f64> {
    at.iter().zip(along).map(|(v, a)| v + by * a).collect()
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
        let (table, places) = table::read(d).map_err(|what| PlantError(format!("{file}: {what}")))?;
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
        let columns = StateColumns::of(d);
        Ok(Self { fmu: Arc::clone(fmu), start, table, places, columns, sizes, way })
    }

    /// The same with differences in place of directional derivatives, which are the FMU's own and may be wrong.
    #[must_use]
    pub fn by_differences(self) -> Self {
        Self { columns: None, ..self }
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
        let settled = match &mut way.seat {
            Some(seat) if seat.open => seat.settle()?,
            _ => true,
        };
        if !settled {
            Self::fail(way, format!("{}: its event iteration does not end", self.fmu.file().display()));
            return Ok(None);
        }
        Ok(way.seat.as_mut())
    }

    fn read(&self, seat: &mut Seat, asked: HybridQuery, result: &mut [f64]) -> Result<(), ImportError> {
        match asked {
            HybridQuery::Rates if result.is_empty() => Ok(()),
            HybridQuery::Rates => seat.instance.derivatives(result),
            HybridQuery::Outputs => seat.instance.get_float64(&self.places.outputs, result),
            HybridQuery::Indicators => seat.instance.indicators(result),
        }
    }

    fn ask(&self, asked: HybridQuery, at: At<f64>, result: &mut [f64]) {
        let mut way = self.way();
        let done = match self.seat(&mut way, at) {
            Ok(Some(seat)) => seat
                .place(at.t, at.x, &self.places.inputs, at.u)
                .and_then(|()| self.read(seat, asked, result)),
            Ok(None) => {
                result.fill(f64::NAN);
                Ok(())
            }
            Err(e) => Err(e),
        };
        Self::kept(&mut way, done, result);
    }

    /// Along one direction, the values at `at` in `here`.
    fn along(&self, asked: HybridQuery, at: At<f64>, along: &HybridScratch, result: &mut [f64]) {
        let acting = |place: &&table::ElementReference| along.p[place.elements()].iter().any(|v| *v != 0.0);
        let acting: Vec<&table::ElementReference> = self.places.parameters.iter().filter(acting).collect();
        let of = self.columns.as_ref().and_then(|c| match asked {
            HybridQuery::Rates => Some(&c.derivatives),
            HybridQuery::Outputs => Some(&self.places.outputs),
            HybridQuery::Indicators => self.places.indicators.as_ref(),
        });
        if let Some(fixed) = acting.iter().find(|p| !p.tunable || of.is_none()) {
            let name = &self.table.parameters[fixed.begin].name;
            Self::fail(
                &mut self.way(),
                format!(
                    "{}: no derivative by `{name}` along the way is to be had of this FMU; take differences of whole runs",
                    self.fmu.file().display()
                ),
            );
            result.fill(f64::NAN);
            return;
        }
        result.fill(0.0);
        let mut by_difference = HybridScratch { t: along.t, x: &[], u: &[], p: &[] };
        if let (Some(of), Some(columns)) = (of, &self.columns) {
            let (mut by, mut seed) = (columns.states.clone(), along.x.to_vec());
            if along.u.iter().any(|v| *v != 0.0) {
                by.extend(&self.places.inputs);
                seed.extend(along.u);
            }
            for place in acting {
                by.push(place.reference);
                seed.extend(&along.p[place.elements()]);
            }
            if !by.is_empty() && !of.is_empty() && seed.iter().any(|v| *v != 0.0) {
                let mut way = self.way();
                let done = match self.seat(&mut way, at) {
                    Ok(Some(seat)) => seat
                        .place(at.t, at.x, &self.places.inputs, at.u)
                        .and_then(|()| seat.instance.directional(of, &by, &seed, result)),
                    Ok(None) => return result.fill(f64::NAN),
                    Err(e) => Err(e),
                };
                Self::kept(&mut way, done, result);
            }
        } else {
            (by_difference.x, by_difference.u) = (along.x, along.u);
        }
        let size = relative_size(by_difference.x, at.x)
            .max(relative_size(by_difference.u, at.u))
            .max(along.t.abs() / at.t.abs().max(1.0));
        if size == 0.0 {
            return;
        }
        let width = WIDTH / size;
        let mut ends = [vec![0.0; result.len()], vec![0.0; result.len()]];
        for (end, by) in ends.iter_mut().zip([-width, width]) {
            let pad = |own: &[f64], n: usize| if own.is_empty() { vec![0.0; n] } else { own.to_vec() };
            let x = moved(at.x, by, &pad(by_difference.x, at.x.len()));
            let u = moved(at.u, by, &pad(by_difference.u, at.u.len()));
            self.ask(asked, At { t: at.t + by * along.t, x: &x, u: &u, ..at }, end);
        }
        let [low, high] = ends;
        result.iter_mut().zip(high.iter().zip(low)).for_each(|(r, (h, l))| *r += (h - l) / (2.0 * width));
    }

    fn ask_lanes(&self, asked: HybridQuery, at: At<Lanes>, result: &mut [Lanes]) {
        let (x, u, p) = (values(at.x), values(at.u), values(at.p));
        let plain = At { t: at.t.re, x: &x, u: &u, p: &p, modes: at.modes };
        let mut column = vec![0.0; result.len()];
        self.ask(asked, plain, &mut column);
        result.iter_mut().zip(&column).for_each(|(r, v)| *r = Dual::constant(*v));
        for k in 0..LANES {
            let (x, u, p) = (lane(at.x, k), lane(at.u, k), lane(at.p, k));
            let along = HybridScratch { t: at.t.eps[k], x: &x, u: &u, p: &p };
            if along.t == 0.0 && x.iter().chain(&u).chain(&p).all(|v| *v == 0.0) {
                continue;
            }
            self.along(asked, plain, &along, &mut column);
            result.iter_mut().zip(&column).for_each(|(r, v)| r.eps[k] = *v);
        }
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
        &[]
    }
    fn sizes(&self) -> ModelSizes {
        self.sizes
    }
    fn with(&self, effects: &[&str]) -> Result<Box<dyn Plant>, PlantError> {
        if let Some(id) = effects.first() {
            return Err(PlantError(format!("no effect can act in an FMU, `{id}` neither; leave it out")));
        }
        Ok(Box::new(Self::new(&self.fmu, self.start)?))
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
        let plain = values(p);
        let mut column = vec![0.0; x.len()];
        for k in 0..LANES {
            let along = lane(p, k);
            let size = relative_size(&along, &plain);
            if size == 0.0 {
                x.iter_mut().for_each(|v| v.eps[k] = 0.0);
                continue;
            }
            let width = WIDTH / size;
            let mut ends = [column.clone(), column.clone()];
            for (end, by) in ends.iter_mut().zip([-width, width]) {
                self.start(&moved(&plain, by, &along), end);
            }
            let [low, high] = ends;
            for (x, (h, l)) in x.iter_mut().zip(high.iter().zip(low)) {
                x.eps[k] = (h - l) / (2.0 * width);
            }
        }
        // Last, so that the instance is the one of these parameters.
        self.start(&plain, &mut column);
        x.iter_mut().zip(&column).for_each(|(x, v)| x.re = *v);
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
    fn rates(&self, at: At<f64>, _: &[f64], dx: &mut [f64]) {
        self.ask(HybridQuery::Rates, at, dx);
    }
    fn rates_lanes(&self, at: At<Lanes>, _: &[Lanes], dx: &mut [Lanes]) {
        self.ask_lanes(HybridQuery::Rates, at, dx);
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
            let inputs = &self.places.inputs;
            way.seat.as_mut().map_or(Ok(()), |seat| seat.event(t, x, inputs, u).map(|done| update = done))
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
