//! A recording through the FMU: the integration of `trueup-fmi-import` from reading to reading.

use trueup_fmi_description::description::{Description, InterfaceCapabilities};
use trueup_fmi_import::integration::{
    Failure, Fmus, IntegratedGroup, IntegrationSettings, Integrator, Sensitivities,
};
use trueup_fmi_import::{
    AnyInstance, ExperimentSetup, ImportError, InstanceOptions, StateColumns, UnpackedFmu,
};
use trueup_numerics::driver::DriveError;
use trueup_plant::Lanes;

use super::inserted::InsertedHere;
use super::lane::LaneDirection;
use super::{FmuSubject, VariablePlace, WIDTH};
use crate::predict::{InputMap, MOST_EVENTS, PredictError, PredictionPlan};

/// Why a run ended.
enum FmuRunEnd {
    Fmu(Box<ImportError>),
    Integration(Box<Failure<ImportError>>),
    NoOutput(usize),
}

impl From<ImportError> for FmuRunEnd {
    fn from(e: ImportError) -> Self {
        Self::Fmu(Box::new(e))
    }
}

impl From<Failure<ImportError>> for FmuRunEnd {
    fn from(e: Failure<ImportError>) -> Self {
        Self::Integration(Box::new(e))
    }
}

impl FmuRunEnd {
    /// Steps are too short for the explicit method.
    fn looks_stiff(&self) -> bool {
        let Self::Integration(failure) = self else { return false };
        let Failure::Integrator { source, .. } = &**failure else { return false };
        matches!(source, DriveError::MaxSteps { .. } | DriveError::StepTooSmall { .. })
    }
    fn reason(&self) -> String {
        match self {
            Self::Fmu(e) => e.to_string(),
            Self::Integration(e) => e.to_string(),
            Self::NoOutput(output) => format!("there is no output {output}"),
        }
    }
}

/// The FMU with its inputs on their lines.
struct Driven<'a> {
    fmu: &'a UnpackedFmu,
    instance: AnyInstance,
    references: Vec<u32>,
    /// Time of the last node in s; inputs then, and their slopes.
    since: f64,
    u: Vec<f64>,
    du: Vec<f64>,
    now: Vec<f64>,
    inserted: Option<InsertedHere>,
}

impl Fmus for Driven<'_> {
    type Error = ImportError;

    fn count(&self) -> usize {
        1
    }
    fn instance(&mut self, _: usize) -> &mut AnyInstance {
        &mut self.instance
    }
    fn description(&self, _: usize) -> &Description {
        self.fmu.description()
    }
    fn exchange(&mut self, time: f64, _: bool) -> Result<(), ImportError> {
        if self.references.is_empty() {
            return Ok(());
        }
        for ((now, u), du) in self.now.iter_mut().zip(&self.u).zip(&self.du) {
            *now = u + du * (time - self.since);
        }
        if let Some(inserted) = &mut self.inserted {
            inserted.add(&mut self.instance, time, &mut self.now)?;
        }
        self.instance.set_float64(&self.references, &self.now)
    }
}

/// A run under way.
struct Under<'a> {
    driven: Driven<'a>,
    group: IntegratedGroup,
    /// The FMU has ended the run: its outputs stay.
    ended: bool,
}

/// What is done at each reading: its place among all, its output.
type EachReading<'a> = &'a mut dyn FnMut(&mut Under, usize, usize) -> Result<(), FmuRunEnd>;

impl FmuSubject {
    fn offered(&self) -> Option<&InterfaceCapabilities> {
        self.fmu.description().model_exchange.as_ref()
    }

    /// What the sensors would show, with parameters `p`.
    pub(super) fn simulate(
        &self,
        plan: &PredictionPlan,
        p: &[f64],
        map: &InputMap<f64>,
    ) -> Result<Vec<f64>, PredictError> {
        let attempt = |integrator| {
            let mut y = vec![0.0; plan.len()];
            let each: EachReading = &mut |run, at, output| {
                y[at] = self.output_of(run, output)?;
                Ok(())
            };
            self.attempt(plan, p, map, integrator, &[], each).map(|()| y)
        };
        let found = match attempt(Integrator::Explicit) {
            Err(stopped) if stopped.looks_stiff() => attempt(Integrator::Stiff),
            found => found,
        };
        found.map_err(|stopped| PredictError::Fmu { run: plan.name().into(), what: stopped.reason() })
    }

    fn attempt(
        &self,
        plan: &PredictionPlan,
        p: &[f64],
        map: &InputMap<f64>,
        integrator: Integrator,
        directions: &[LaneDirection],
        each: EachReading,
    ) -> Result<(), FmuRunEnd> {
        let once = self.offered().is_some_and(|i| i.can_be_instantiated_only_once_per_process);
        // One that may exist only once is kept under the lock for as long as it runs.
        let mut idle = self.idle.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let kept = idle.pop();
        let mut held = once.then_some(idle);
        let instance = match kept {
            Some(instance) => instance,
            None => AnyInstance::model_exchange(&self.fmu, InstanceOptions::default())?,
        };
        let mut run = self.start(instance, plan, p, map, integrator, directions)?;
        for i in 0..plan.nodes() {
            run.node(i, plan, map, directions)?;
            for (at, channel) in plan.due(i) {
                each(&mut run, at, plan.wanted()[channel])?;
            }
            if i + 1 < plan.nodes() && !run.ended {
                run.ended =
                    run.group.advance(&mut run.driven, plan.time(i) + plan.step(i), false)?.terminated;
            }
        }
        // One that cannot be reset is let go.
        let mut instance = run.driven.instance;
        if instance.reset().is_ok() {
            match &mut held {
                Some(idle) => idle.push(instance),
                None => {
                    self.idle.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(instance);
                }
            }
        }
        Ok(())
    }

    /// Readings with their derivatives, integrated along with the states; `None` where the FMU does not give them.
    pub(super) fn sensitivities(
        &self,
        plan: &PredictionPlan,
        p: &[Lanes],
        map: &InputMap<Lanes>,
        acting: &[usize],
    ) -> Option<Vec<Lanes>> {
        let columns = StateColumns::of(self.fmu.description())?;
        let plain = |v: &[Lanes]| -> Vec<f64> { v.iter().map(|v| v.re).collect() };
        let directions = self.directions(p, map, acting);
        let mut y = vec![Lanes::default(); plan.len()];
        let each: EachReading = &mut |run, at, output| {
            y[at].re = self.output_of(run, output)?;
            let Some(place) = self.output_place(output) else { return Ok(()) };
            let state = columns.states.iter().position(|r| *r == place.reference);
            for (lane, &k) in acting.iter().enumerate() {
                y[at].eps[k] = if let Some(i) = state {
                    run.group.sensitivity(lane)[i]
                } else {
                    let mut column = vec![0.0; place.elements.len()];
                    run.group.derivative(&mut run.driven, lane, &[place.reference], &mut column)?;
                    column[output - place.elements.start]
                };
            }
            Ok(())
        };
        let map = InputMap { gain: plain(&map.gain), bias: plain(&map.bias) };
        let done = self.attempt(plan, &plain(p), &map, Integrator::Explicit, &directions, each);
        done.ok().map(|()| y)
    }

    /// The variable that has this output.
    pub(super) fn output_place(&self, output: usize) -> Option<&VariablePlace> {
        self.output_places.iter().find(|place| place.elements.contains(&output))
    }

    fn output_of(&self, run: &mut Under, output: usize) -> Result<f64, FmuRunEnd> {
        let place = self.output_place(output).ok_or(FmuRunEnd::NoOutput(output))?;
        let mut values = vec![0.0; place.elements.len()];
        run.driven.instance.get_float64(&[place.reference], &mut values)?;
        Ok(values[output - place.elements.start])
    }

    fn start(
        &self,
        mut instance: AnyInstance,
        plan: &PredictionPlan,
        p: &[f64],
        map: &InputMap<f64>,
        integrator: Integrator,
        directions: &[LaneDirection],
    ) -> Result<Under<'_>, FmuRunEnd> {
        // How the first states move: they follow from the parameters, however the FMU does that.
        let mut first = Vec::new();
        for direction in directions {
            let mut ends = [Vec::new(), Vec::new()];
            for (end, sign) in ends.iter_mut().zip([-1.0, 1.0]) {
                let moved = p.iter().zip(&direction.moves).map(|(p, m)| p + sign * WIDTH[1] * m);
                let run = self.begin(instance, plan, &moved.collect::<Vec<_>>(), map, integrator)?;
                *end = run.group.states().to_vec();
                instance = run.driven.instance;
                instance.reset()?;
            }
            let [low, high] = ends;
            first.extend(high.iter().zip(low).map(|(h, l)| (h - l) / (2.0 * WIDTH[1])));
        }
        let mut run = self.begin(instance, plan, p, map, integrator)?;
        if !directions.is_empty() {
            let (lanes, inputs) =
                (directions.iter().map(|d| d.lane.clone()).collect(), run.driven.references.clone());
            let of = Sensitivities { lanes, inputs, since: run.driven.since };
            run.group.differentiate(&run.driven, of, &first)?;
        }
        Ok(run)
    }

    /// The FMU initialised, its first events handled.
    fn begin(
        &self,
        mut instance: AnyInstance,
        plan: &PredictionPlan,
        p: &[f64],
        map: &InputMap<f64>,
        integrator: Integrator,
    ) -> Result<Under<'_>, FmuRunEnd> {
        let start = plan.time(0);
        // What is not given stays as the FMU has it.
        let changed = |place: &&VariablePlace| {
            place.elements.clone().any(|i| p[i].to_bits() != self.parameters[i].start.to_bits())
        };
        for (reference, kind, value) in &self.chosen {
            instance.set_number(*reference, *kind, *value)?;
        }
        for place in self.parameter_places.iter().filter(changed) {
            instance.set_float64(&[place.reference], &p[place.elements.clone()])?;
        }
        instance.enter_initialization_mode(ExperimentSetup { start, ..ExperimentSetup::default() })?;
        let references: Vec<u32> = self.input_places.iter().map(|p| p.reference).collect();
        let zeros = || vec![0.0; self.inputs.len()];
        let (fmu, u, du, now) = (&*self.fmu, zeros(), zeros(), zeros());
        let inserted = InsertedHere::of(self, start);
        let mut driven = Driven { fmu, instance, references, since: start, u, du, now, inserted };
        plan.inputs_at(0, map, &mut driven.u, &mut driven.du);
        driven.exchange(start, true)?;
        driven.instance.exit_initialization_mode()?;
        let settings = IntegrationSettings {
            integrator,
            tolerance: self.tolerance,
            span: plan.time(plan.nodes().saturating_sub(1)) - start,
            // Then the stiff method is tried.
            most_steps: plan.most_steps as usize,
            most_events: MOST_EVENTS,
            ..IntegrationSettings::default()
        };
        let (mut group, settled) = IntegratedGroup::start(&mut driven, start, settings)?;
        let ended = settled.terminated || group.go_on(&mut driven)?;
        Ok(Under { driven, group, ended })
    }
}

impl Under<'_> {
    /// At a node: its inputs from here on; one that jumps is an event.
    fn node(
        &mut self,
        i: usize,
        plan: &PredictionPlan,
        map: &InputMap<f64>,
        directions: &[LaneDirection],
    ) -> Result<(), FmuRunEnd> {
        let Self { driven, group, ended } = self;
        plan.inputs_at(i, map, &mut driven.u, &mut driven.du);
        driven.since = plan.time(i);
        if let Some(of) = group.sensitivities_mut() {
            of.since = driven.since;
            let moved = of.lanes.iter_mut().zip(directions).filter(|(lane, _)| !lane.u.is_empty());
            moved.for_each(|(lane, d)| plan.inputs_at(i, &d.map, &mut lane.u, &mut lane.du));
        }
        if *ended {
            return Ok(());
        }
        if i > 0 && plan.jumps(i) {
            *ended = group.jump(driven)?;
            if *ended {
                return Ok(());
            }
        }
        Ok(group.place(driven)?)
    }
}
