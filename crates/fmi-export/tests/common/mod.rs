//! A small model with everything that the boundary has to carry, and its C functions.
#![allow(dead_code, missing_docs, unreachable_pub, clippy::panic, clippy::unwrap_used)]

use core::ffi::{CStr, c_char, c_void};
use std::sync::Mutex;
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::*;
use trueup_fmi_export::FmuModel;
use trueup_numerics::Scalar;
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// A ball that bounces, an oscillator with a force, a sampler of that force, and traps.
#[derive(Clone, Copy, Debug)]
pub struct Probe;

trueup_fmi_export::export_fmu!(Probe, "", "model Probe\ntoken probe-1\nstart restitution 0.7\n");
pub use fmi::*;

/// Value references (FMI 2.0 counts elements, so they are the same in both versions).
pub mod vr {
    pub const TIME: u32 = 0;
    pub const GRAVITY: u32 = 1;
    pub const RESTITUTION: u32 = 2;
    pub const STIFFNESS: u32 = 3; // 3, 4
    pub const INITIAL_HEIGHT: u32 = 5;
    pub const INITIAL_SWING: u32 = 6;
    pub const LAW: u32 = 7;
    pub const SAMPLE_PERIOD: u32 = 8;
    pub const TRAP: u32 = 9;
    pub const FORCE: u32 = 10;
    pub const ENABLE: u32 = 11;
    pub const HEIGHT: u32 = 12;
    pub const ENERGY: u32 = 13;
    pub const RESTING: u32 = 14;
    pub const HELD: u32 = 15;
    pub const SWING: u32 = 16; // 16, 17
    pub const STATE: u32 = 18; // 18..23
    pub const RATE: u32 = 23; // 23..28
    pub const INDICATOR: u32 = 28;
}

impl Hybrid for Probe {
    fn sizes(&self) -> ModelSizes {
        ModelSizes { states: 5, inputs: 2, parameters: 9, outputs: 6, modes: 2, indicators: 1 }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        x.copy_from_slice(&[p[4], T::zero(), p[5], T::zero(), T::zero()]);
    }
    fn start_modes(&self, _: At<f64>, modes: &mut [i32]) {
        modes.copy_from_slice(&[0, 0]);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let (x, u, p) = (at.x, at.u, at.p);
        match p[8].value() as i32 {
            1 => panic!("the trap snapped"),
            2 if at.t.value() > 0.5 => return dx.fill(T::constant(f64::NAN)),
            3 => return dx.fill(T::constant(f64::NAN)),
            _ => {}
        }
        let resting = at.modes[0] == 1;
        dx[0] = if resting { T::zero() } else { x[1] };
        dx[1] = if resting { T::zero() } else { -p[0] };
        let cubic = if p[6].value() == 2.0 { x[2].powi(3) } else { T::zero() };
        dx[2] = x[3];
        dx[3] = u[0] * u[1] - p[2] * x[2] - p[3] * x[3] - cubic;
        dx[4] = T::zero();
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let (x, u, p) = (at.x, at.u, at.p);
        y[0] = x[0];
        y[1] = p[0] * x[0] + x[1] * x[1] * 0.5 + at.t.sin() * u[0];
        y[2] = T::constant(f64::from(at.modes[0]));
        y[3] = if self.due(at.t.value(), p[7].value(), at.modes) { u[0] } else { x[4] };
        y[4] = x[2];
        y[5] = p[2] * x[2] * u[0].exp();
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        z[0] = if at.modes[0] == 1 { T::one() } else { at.x[0] };
    }
    fn direction(&self, _: usize) -> Direction {
        Direction::Down
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let mut done = EventUpdate::default();
        if modes[0] == 0 && x[0] <= 0.0 && x[1] < 0.0 {
            (x[0], x[1]) = (0.0, -p[1] * x[1]);
            done.states = true;
            if x[1] < 1e-2 {
                x[1] = 0.0;
                modes[0] = 1;
                done.modes = true;
            }
        }
        if self.due(t, p[7], modes) {
            x[4] = u[0];
            modes[1] += 1;
            (done.states, done.modes) = (true, true);
        }
        done
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        (p[7] > 0.0).then(|| f64::from(modes[1]) * p[7])
    }
}

impl Probe {
    fn due(&self, t: f64, period: f64, modes: &[i32]) -> bool {
        period > 0.0 && t >= f64::from(modes[1]) * period
    }
}

impl FmuModel for Probe {
    fn build(c: &Configuration) -> Result<Self, String> {
        if c.model == "Probe" { Ok(Self) } else { Err(format!("no model {:?}", c.model)) }
    }
    fn table(&self) -> ModelTable {
        use Causality as C;
        use Storage as S;
        use Variability as V;
        let v = |name: &str, c, y, s| TableVariable::new(name, c, y, s, "1", "for tests");
        let variables = vec![
            v("time", C::Independent, V::Continuous, S::Time),
            v("gravity", C::Parameter, V::Tunable, S::Parameter(0)).start(&[9.81]),
            TableVariable { max: Some(1.0), ..v("restitution", C::Parameter, V::Tunable, S::Parameter(1)) }
                .start(&[0.5])
                .at_least(0.0),
            v("stiffness", C::Parameter, V::Tunable, S::Parameter(2))
                .array(&[2])
                .start(&[4.0, 0.1])
                .above(0.0),
            v("initialHeight", C::Parameter, V::Fixed, S::Parameter(4)).start(&[1.0]),
            v("initialSwing", C::Parameter, V::Fixed, S::Parameter(5)).start(&[1.0]).follows("initialHeight"),
            v("law", C::Parameter, V::Fixed, S::Parameter(6))
                .start(&[1.0])
                .kind(BoundaryType::Enumeration(0)),
            v("samplePeriod", C::Parameter, V::Fixed, S::Parameter(7)).start(&[0.0]).at_least(0.0),
            v("trap", C::Parameter, V::Tunable, S::Parameter(8)).start(&[0.0]).kind(BoundaryType::Integer),
            v("force", C::Input, V::Continuous, S::Input(0)).start(&[0.0]),
            v("enable", C::Input, V::Discrete, S::Input(1)).start(&[1.0]).kind(BoundaryType::Boolean),
            TableVariable {
                depends: Depends::copy("state"),
                ..v("height", C::Output, V::Continuous, S::Output(0))
            },
            v("energy", C::Output, V::Continuous, S::Output(1)),
            v("resting", C::Output, V::Discrete, S::Output(2)).kind(BoundaryType::Boolean),
            v("held", C::Output, V::Continuous, S::Output(3)),
            v("swing", C::Output, V::Continuous, S::Output(4)).array(&[2]),
            v("state", C::Local, V::Continuous, S::State(0)).array(&[5]).nominal(2.0),
            v("rate", C::Local, V::Continuous, S::Rate(0)).array(&[5]).derivative_of("state"),
        ];
        let law = Enumeration {
            name: "Law",
            description: "spring",
            items: vec![("linear", "proportional"), ("cubic", "hardening")],
        };
        ModelTable {
            name: "Probe".into(),
            title: None,
            description: "for tests".into(),
            variables,
            enumerations: vec![law],
            terminals: Vec::new(),
            indicators: 1,
            experiment: TableExperiment { stop_time: 3.0, tolerance: 1e-8, step_size: 0.01 },
        }
    }
    fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        if p[2] + p[3] > 1000.0 {
            return Err((3, "stiffness[1] + stiffness[2] must not exceed 1000: lower one of them".into()));
        }
        Ok(())
    }
}

/// The messages of the FMU.
#[derive(Default)]
pub struct Journal(Mutex<Vec<(i32, String, String)>>);

impl Journal {
    pub fn environment(&self) -> *mut c_void {
        core::ptr::from_ref(self).cast_mut().cast()
    }
    pub fn take(&self) -> Vec<(i32, String, String)> {
        std::mem::take(&mut *self.0.lock().unwrap())
    }
    /// Status and text of the last message.
    pub fn last(&self) -> (i32, String) {
        self.take().pop().map(|m| (m.0, m.2)).unwrap_or_default()
    }
}

unsafe fn note(environment: *mut c_void, status: i32, category: *const c_char, message: *const c_char) {
    let journal = unsafe { &*environment.cast::<Journal>() };
    let text = |p| unsafe { CStr::from_ptr(p) }.to_str().unwrap().to_owned();
    journal.0.lock().unwrap().push((status, text(category), text(message)));
}
pub unsafe extern "C" fn log3(
    e: *mut c_void,
    s: fmi3Status,
    category: *const c_char,
    message: *const c_char,
) {
    unsafe { note(e, s.0, category, message) }
}
/// An importer that takes the format for the message, as those do whose language has no variadic functions. On
/// this platform a variadic call without arguments passes like a fixed one.
unsafe extern "C" fn log2(
    e: *mut c_void,
    name: *const c_char,
    s: fmi2Status,
    category: *const c_char,
    message: *const c_char,
) {
    assert_eq!(unsafe { CStr::from_ptr(name) }, c"probe");
    unsafe { note(e, s.0, category, message) }
}
type Logger2 = unsafe extern "C" fn(*mut c_void, fmi2String, fmi2Status, fmi2String, fmi2String, ...);

pub fn callbacks2(journal: &Journal) -> fmi2CallbackFunctions {
    // SAFETY: see `log2`.
    let logger = unsafe { std::mem::transmute::<*const (), Logger2>(log2 as *const ()) };
    fmi2CallbackFunctions {
        logger: Some(logger),
        allocateMemory: None,
        freeMemory: None,
        stepFinished: None,
        componentEnvironment: journal.environment(),
    }
}
pub fn new2(journal: &Journal, kind: fmi2Type) -> fmi2Component {
    let callbacks = callbacks2(journal);
    let c = unsafe {
        fmi2Instantiate(
            c"probe".as_ptr(),
            kind,
            c"probe-1".as_ptr(),
            core::ptr::null(),
            &callbacks,
            0,
            fmi2True,
        )
    };
    assert!(!c.is_null(), "{:?}", journal.take());
    c
}
pub fn new3_me(journal: &Journal) -> fmi3Instance {
    let c = unsafe {
        fmi3InstantiateModelExchange(
            c"probe".as_ptr(),
            c"probe-1".as_ptr(),
            core::ptr::null(),
            fmi3False,
            fmi3True,
            journal.environment(),
            Some(log3),
        )
    };
    assert!(!c.is_null(), "{:?}", journal.take());
    c
}
pub fn new3_cs(
    journal: &Journal,
    event_mode: bool,
    early: bool,
    required: &[u32],
    update: fmi3IntermediateUpdateCallback,
    environment: *mut c_void,
    log: fmi3LogMessageCallback,
) -> fmi3Instance {
    let c = unsafe {
        fmi3InstantiateCoSimulation(
            c"probe".as_ptr(),
            c"probe-1".as_ptr(),
            core::ptr::null(),
            fmi3False,
            fmi3True,
            event_mode.into(),
            early.into(),
            required.as_ptr(),
            required.len(),
            environment,
            log,
            update,
        )
    };
    assert!(!c.is_null(), "{:?}", journal.take());
    c
}
pub fn simple3_cs(journal: &Journal) -> fmi3Instance {
    new3_cs(journal, false, false, &[], None, journal.environment(), Some(log3))
}

pub fn init2(c: fmi2Component, tolerance: f64) {
    unsafe {
        assert_eq!(fmi2SetupExperiment(c, fmi2True, tolerance, 0.0, fmi2False, 0.0), fmi2OK);
        assert_eq!(fmi2EnterInitializationMode(c), fmi2OK);
        assert_eq!(fmi2ExitInitializationMode(c), fmi2OK);
    }
}
pub fn init3(c: fmi3Instance, tolerance: f64) {
    unsafe {
        assert_eq!(fmi3EnterInitializationMode(c, fmi3True, tolerance, 0.0, fmi3False, 0.0), fmi3OK);
        assert_eq!(fmi3ExitInitializationMode(c), fmi3OK);
    }
}
pub fn set3(c: fmi3Instance, reference: u32, values: &[f64]) -> fmi3Status {
    unsafe { fmi3SetFloat64(c, &reference, 1, values.as_ptr(), values.len()) }
}
pub fn get3<const N: usize>(c: fmi3Instance, reference: u32) -> [f64; N] {
    let mut out = [f64::NAN; N];
    assert_eq!(unsafe { fmi3GetFloat64(c, &reference, 1, out.as_mut_ptr(), N) }, fmi3OK);
    out
}
pub fn set2(c: fmi2Component, reference: u32, value: f64) -> fmi2Status {
    unsafe { fmi2SetReal(c, &reference, 1, &value) }
}
pub fn get2(c: fmi2Component, reference: u32) -> f64 {
    let mut out = f64::NAN;
    assert_eq!(unsafe { fmi2GetReal(c, &reference, 1, &mut out) }, fmi2OK);
    out
}
/// One step in FMI 3.0: status, event, early return, time.
pub fn step3(c: fmi3Instance, t: f64, h: f64) -> (fmi3Status, bool, bool, f64) {
    let (mut event, mut terminate, mut early, mut last) = (fmi3False, fmi3False, fmi3False, f64::NAN);
    let s = unsafe { fmi3DoStep(c, t, h, fmi3True, &mut event, &mut terminate, &mut early, &mut last) };
    (s, event.into(), early.into(), last)
}
/// Event iteration in FMI 3.0 until nothing changes; the next event time.
pub fn update3(c: fmi3Instance) -> Option<f64> {
    let mut flags = [fmi3False; 5];
    let mut next = 0.0;
    loop {
        let [a, b, d, e, f] = &mut flags;
        assert_eq!(unsafe { fmi3UpdateDiscreteStates(c, a, b, d, e, f, &mut next) }, fmi3OK);
        if !bool::from(flags[0]) {
            return bool::from(flags[4]).then_some(next);
        }
    }
}
