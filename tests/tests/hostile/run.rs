//! The legal run: short, with inputs, events and all results as bits.

use super::fmu::{Kind, Library};
use super::subject::{Phase, Subject, ask};
use core::ptr::null_mut;
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;
use trueup_fmi_description::description::DescriptionCausality;

const STEP: f64 = 2e-3;
const STEPS: u32 = 6;

impl Subject<'_> {
    fn ok(&self, status: i32) {
        if status != 0 {
            self.fail(&format!("a legal call answers {status}: {:?}", self.environment.journal));
        }
    }
    pub fn initialize(&mut self, tolerance: f64, start: f64, stop: Option<f64>) -> i32 {
        let (defined, end) = (stop.is_some(), stop.unwrap_or_default());
        let status = match &self.fmu.library {
            Library::Two(f) => {
                let s = ask!(self, f.fmi2SetupExperiment(1, tolerance, start, i32::from(defined), end));
                if s != 0 { s } else { ask!(self, f.fmi2EnterInitializationMode()) }
            }
            Library::Three(f) => {
                ask!(self, f.fmi3EnterInitializationMode(fmi3True, tolerance, start, defined.into(), end))
            }
        };
        if status == 0 {
            (self.phase, self.t) = (Phase::Initialization, start);
        }
        status
    }
    pub fn exit_initialization(&mut self) -> i32 {
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2ExitInitializationMode()),
            Library::Three(f) => ask!(self, f.fmi3ExitInitializationMode()),
        };
        if status == 0 {
            self.phase = if self.event_mode() { Phase::Event } else { Phase::Step };
        }
        status
    }
    /// One pass of event iteration: status, whether another one is needed.
    pub fn update(&mut self) -> (i32, bool) {
        match &self.fmu.library {
            Library::Two(f) => {
                let mut info = fmi2EventInfo::default();
                let status = ask!(self, f.fmi2NewDiscreteStates(&mut info));
                self.finite(status, "nextEventTime", &[info.nextEventTime]);
                (status, info.newDiscreteStatesNeeded != 0)
            }
            Library::Three(f) => {
                let (mut b, mut t) = ([fmi3False; 5], 0.0);
                let [needed, end, nominals, values, timed] = &mut b;
                let status =
                    ask!(self, f.fmi3UpdateDiscreteStates(needed, end, nominals, values, timed, &mut t));
                self.finite(status, "nextEventTime", &[t]);
                (status, b[0].0 != 0)
            }
        }
    }
    fn settle(&mut self) {
        while {
            let (status, again) = self.update();
            self.ok(status);
            again
        } {}
    }
    pub fn enter(&mut self, phase: Phase) -> i32 {
        let status = match (&self.fmu.library, phase) {
            (Library::Two(f), Phase::Event) => ask!(self, f.fmi2EnterEventMode()),
            (Library::Two(f), _) => ask!(self, f.fmi2EnterContinuousTimeMode()),
            (Library::Three(f), Phase::Event) => ask!(self, f.fmi3EnterEventMode()),
            (Library::Three(f), Phase::Step) => ask!(self, f.fmi3EnterStepMode()),
            (Library::Three(f), _) => ask!(self, f.fmi3EnterContinuousTimeMode()),
        };
        if status == 0 {
            self.phase = phase;
        }
        status
    }
    pub fn terminate(&mut self) -> i32 {
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2Terminate()),
            Library::Three(f) => ask!(self, f.fmi3Terminate()),
        };
        if status == 0 {
            self.phase = Phase::Terminated;
        }
        status
    }
    pub fn set_time(&mut self, t: f64) -> i32 {
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2SetTime(t)),
            Library::Three(f) => ask!(self, f.fmi3SetTime(t)),
        };
        if status == 0 {
            self.t = t;
        }
        status
    }
    pub fn set_states(&mut self, x: &[f64]) -> i32 {
        match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2SetContinuousStates(x.as_ptr(), x.len())),
            Library::Three(f) => ask!(self, f.fmi3SetContinuousStates(x.as_ptr(), x.len())),
        }
    }
    pub fn states(&mut self, x: &mut [f64]) -> i32 {
        let (p, n) = (x.as_mut_ptr(), x.len());
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2GetContinuousStates(p, n)),
            Library::Three(f) => ask!(self, f.fmi3GetContinuousStates(p, n)),
        };
        self.finite(status, "GetContinuousStates", x)
    }
    pub fn rates(&mut self, dx: &mut [f64]) -> i32 {
        let (p, n) = (dx.as_mut_ptr(), dx.len());
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2GetDerivatives(p, n)),
            Library::Three(f) => ask!(self, f.fmi3GetContinuousStateDerivatives(p, n)),
        };
        self.finite(status, "GetDerivatives", dx)
    }
    pub fn indicators(&mut self, z: &mut [f64]) -> i32 {
        let (p, n) = (z.as_mut_ptr(), z.len());
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2GetEventIndicators(p, n)),
            Library::Three(f) => ask!(self, f.fmi3GetEventIndicators(p, n)),
        };
        self.finite(status, "GetEventIndicators", z)
    }
    pub fn get(&mut self, references: &[u32], values: &mut [f64]) -> i32 {
        let (r, n, p, len) = (references.as_ptr(), references.len(), values.as_mut_ptr(), values.len());
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2GetReal(r, n, p)),
            Library::Three(f) => ask!(self, f.fmi3GetFloat64(r, n, p, len)),
        };
        self.finite(status, "GetReal", values)
    }
    pub fn set(&mut self, references: &[u32], values: &[f64]) -> i32 {
        let (r, n, p, len) = (references.as_ptr(), references.len(), values.as_ptr(), values.len());
        match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2SetReal(r, n, p)),
            Library::Three(f) => ask!(self, f.fmi3SetFloat64(r, n, p, len)),
        }
    }
    /// A step from `t`: status, time reached, whether an event waits.
    pub fn do_step(&mut self, t: f64, h: f64) -> (i32, f64, bool) {
        let (status, reached, event) = match &self.fmu.library {
            Library::Two(f) => {
                let status = ask!(self, f.fmi2DoStep(t, h, 1));
                let mut reached = self.t;
                // The time, also a variable of its own.
                if status == 0 {
                    self.get(&[0], core::slice::from_mut(&mut reached));
                }
                if status == 2 && ask!(self, f.fmi2GetRealStatus(fmi2LastSuccessfulTime, &mut reached)) != 0 {
                    self.fail("no last successful time after Discard");
                }
                (status, reached, false)
            }
            Library::Three(f) => {
                let (mut b, mut reached) = ([fmi3False; 3], self.t);
                let [event, end, early] = &mut b;
                let status = ask!(self, f.fmi3DoStep(t, h, fmi3True, event, end, early, &mut reached));
                let may = matches!(self.way, Way::CoSimulation { early_return: true, .. });
                if status == 0 && b[2].0 != 0 && !may {
                    self.fail("returned early without leave");
                }
                (status, reached, b[0].0 != 0)
            }
        };
        self.finite(status, "last successful time", &[reached]);
        if status == 0 || status == 2 && !self.fmu.is_fmi3() {
            if reached > t + h + 1e-9 * h.max(t.abs()) || reached < self.t {
                self.fail(&format!("a step from {:?} by {h:?} came to {reached:?}", self.t));
            }
            self.t = reached;
        }
        (status, reached, event)
    }

    /// From instantiation to termination, all legal; everything that was read, as bits.
    pub fn standard(&mut self) -> Vec<u64> {
        let fmu = self.fmu;
        let outputs = fmu.of(DescriptionCausality::Output, Kind::Real);
        let references: Vec<u32> = outputs.iter().map(|v| v.reference).collect();
        let mut y = vec![0.0; outputs.iter().map(|v| v.len).sum()];
        let mut bits = Vec::new();
        let s = self.initialize(1e-6, 0.0, None);
        self.ok(s);
        for (k, v) in fmu.of(DescriptionCausality::Input, Kind::Real).into_iter().enumerate() {
            let s = self.set(&[v.reference], &vec![0.02 * (k + 1) as f64; v.len]);
            self.ok(s);
        }
        let s = self.exit_initialization();
        self.ok(s);
        if self.event_mode() {
            self.settle();
            let s = self.enter(if self.is_me() { Phase::Continuous } else { Phase::Step });
            self.ok(s);
        }
        let (mut x, mut dx) = (vec![0.0; fmu.states], vec![0.0; fmu.states]);
        let mut z = vec![0.0; fmu.indicators];
        for k in 0..STEPS {
            let t = f64::from(k) * STEP;
            if self.is_me() {
                let s = [self.set_time(t), self.states(&mut x), self.rates(&mut dx)];
                s.into_iter().for_each(|s| self.ok(s));
                x.iter_mut().zip(&dx).for_each(|(x, dx)| *x += STEP * dx);
                let s = [self.set_states(&x), self.indicators(&mut z)];
                s.into_iter().for_each(|s| self.ok(s));
                let s = self.enter(Phase::Event);
                self.ok(s);
                self.settle();
                let s = self.enter(Phase::Continuous);
                self.ok(s);
                bits.extend(x.iter().chain(&z).map(|v| v.to_bits()));
            } else {
                let end = t + STEP;
                while self.t < end - 1e-9 {
                    let (status, _, event) = self.do_step(self.t, end - self.t);
                    self.ok(status);
                    if event && self.event_mode() {
                        let s = self.enter(Phase::Event);
                        self.ok(s);
                        self.settle();
                        let s = self.enter(Phase::Step);
                        self.ok(s);
                    }
                }
            }
            let s = self.get(&references, &mut y);
            self.ok(s);
            bits.extend(y.iter().map(|v| v.to_bits()));
        }
        let s = self.terminate();
        self.ok(s);
        bits
    }
    /// Takes a state into the list of stored ones.
    pub fn store(&mut self) -> i32 {
        let mut handle = null_mut();
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2GetFMUstate(&mut handle)),
            Library::Three(f) => ask!(self, f.fmi3GetFMUState(&mut handle)),
        };
        if status == 0 {
            self.states.push((handle, self.phase, self.t));
        }
        status
    }
}
use super::subject::Way;
