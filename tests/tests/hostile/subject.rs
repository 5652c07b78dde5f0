//! An instance under attack, and what must hold after every call.

use super::fmu::{Fmu, Library};
use super::random::Random;
use core::ffi::{CStr, c_char, c_void};
use core::ptr::{null, null_mut};
use std::cell::{Cell, RefCell};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;

/// Calls made and calls refused, over all threads.
pub static CALLS: AtomicU64 = AtomicU64::new(0);
pub static REFUSED: AtomicU64 = AtomicU64::new(0);
/// Callbacks of intermediate update.
pub static UPDATES: AtomicU64 = AtomicU64::new(0);
/// Print every call before it is made (for a crash that leaves no message).
pub static TRACE: AtomicBool = AtomicBool::new(false);

pub const REFUSALS: i32 = 2;

/// What the importer's callbacks see.
pub struct Environment {
    /// Status and text.
    pub journal: RefCell<Vec<(i32, String)>>,
    /// What went wrong inside a callback, where a panic would abort.
    pub failures: RefCell<Vec<String>>,
    /// The intermediate update does odd things.
    pub hostile: Cell<bool>,
    pub random: RefCell<Random>,
    pub instance: Cell<*mut c_void>,
    pub fmu: *const Fmu,
}

unsafe fn note(e: *mut c_void, status: i32, category: *const c_char, message: *const c_char) {
    // SAFETY: the environment given at instantiation, alive as long as the instance.
    let (e, category, message) =
        unsafe { (&*e.cast::<Environment>(), CStr::from_ptr(category), CStr::from_ptr(message)) };
    let text = message.to_str().map_or_else(|_| "not UTF-8".to_owned(), str::to_owned);
    if !["logStatusError", "logStatusWarning", "logEvents"].iter().any(|c| *c == category.to_string_lossy()) {
        e.failures.borrow_mut().push(format!("unknown category {category:?}"));
    }
    e.journal.borrow_mut().push((status, text));
}
/// Takes the place of the variadic logger, which stable Rust cannot define: on x86-64 and AArch64 (Linux) its
/// named arguments arrive alike. The format must be one that consumes no argument.
pub unsafe extern "C" fn log2(
    e: *mut c_void,
    _: fmi2String,
    status: fmi2Status,
    category: fmi2String,
    format: fmi2String,
) {
    // SAFETY: as `note`.
    unsafe {
        if CStr::from_ptr(format).to_string_lossy().replace("%%", "").contains('%') {
            (*e.cast::<Environment>()).failures.borrow_mut().push("a format with arguments".to_owned());
        }
        note(e, status.0, category, format)
    }
}
pub type Logger2 = unsafe extern "C" fn(*mut c_void, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
pub unsafe extern "C" fn log3(e: *mut c_void, status: fmi3Status, category: fmi3String, message: fmi3String) {
    // SAFETY: as `note`.
    unsafe { note(e, status.0, category, message) }
}

/// How an instance is made.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Way {
    ModelExchange,
    CoSimulation { event_mode: bool, early_return: bool },
}
pub const WAYS: [Way; 5] = [
    Way::ModelExchange,
    Way::CoSimulation { event_mode: false, early_return: false },
    Way::CoSimulation { event_mode: true, early_return: false },
    Way::CoSimulation { event_mode: false, early_return: true },
    Way::CoSimulation { event_mode: true, early_return: true },
];

/// What the generator assumes of the instance; a guess that steers it, not a claim.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Phase {
    Instantiated,
    Configuration,
    Initialization,
    Event,
    Continuous,
    Step,
    Terminated,
}

pub struct Subject<'a> {
    pub fmu: &'a Fmu,
    pub way: Way,
    pub c: *mut c_void,
    pub environment: Box<Environment>,
    /// Refusals have to be logged.
    pub logs: bool,
    /// False once freed.
    pub live: bool,
    /// The next call cannot be right.
    pub wrong: bool,
    pub phase: Phase,
    pub t: f64,
    /// Stored states with the phase and time at which they were taken.
    pub states: Vec<(*mut c_void, Phase, f64)>,
    pub context: String,
    trail: Vec<String>,
    _callbacks: Box<fmi2CallbackFunctions>,
}

/// Makes a call that answers with a status, and checks what must hold after any call.
macro_rules! ask {
    ($s:ident, $f:ident.$name:ident($($arg:expr),* $(,)?)) => {{
        $s.before(stringify!($name));
        // SAFETY: pointers are NULL or valid for the lengths given with them.
        let status = unsafe { ($f.$name)($s.c, $($arg),*) }.0;
        $s.after(stringify!($name), status)
    }};
}
pub(crate) use ask;

impl<'a> Subject<'a> {
    /// A legal instance with logging on (`logs`) or off.
    pub fn new(fmu: &'a Fmu, way: Way, logs: bool, seed: u64, context: String) -> Self {
        let environment = Box::new(Environment {
            journal: RefCell::default(),
            failures: RefCell::default(),
            hostile: Cell::new(false),
            random: RefCell::new(Random::new(seed)),
            instance: Cell::new(null_mut()),
            fmu,
        });
        let pointer = core::ptr::from_ref(&*environment).cast_mut().cast::<c_void>();
        // SAFETY: see `log2`.
        let logger = unsafe { core::mem::transmute::<*const (), Logger2>(log2 as *const ()) };
        let callbacks = Box::new(fmi2CallbackFunctions {
            logger: Some(logger),
            allocateMemory: None,
            freeMemory: None,
            stepFinished: None,
            componentEnvironment: pointer,
        });
        let (name, token, on) = (c"probe".as_ptr(), fmu.token.as_ptr(), fmi3Boolean::from(logs));
        let required: Vec<u32> = fmu
            .variables
            .iter()
            .filter(|v| v.causality == trueup_fmi_description::description::DescriptionCausality::Input)
            .map(|v| v.reference)
            .collect();
        // SAFETY: legal arguments.
        let c = unsafe {
            match (&fmu.library, way) {
                (Library::Two(f), _) => {
                    let kind = if way == Way::ModelExchange { fmi2ModelExchange } else { fmi2CoSimulation };
                    (f.fmi2Instantiate)(name, kind, token, null(), &*callbacks, 0, i32::from(logs))
                }
                (Library::Three(f), Way::ModelExchange) => {
                    (f.fmi3InstantiateModelExchange)(name, token, null(), fmi3False, on, pointer, Some(log3))
                }
                (Library::Three(f), Way::CoSimulation { event_mode, early_return }) => (f
                    .fmi3InstantiateCoSimulation)(
                    name,
                    token,
                    null(),
                    fmi3False,
                    on,
                    event_mode.into(),
                    early_return.into(),
                    required.as_ptr(),
                    required.len(),
                    pointer,
                    Some(log3),
                    Some(super::callback::intermediate_update),
                ),
            }
        };
        assert!(!c.is_null(), "{}: {context}: {:?}", fmu.name, environment.journal);
        environment.instance.set(c);
        Self {
            fmu,
            way,
            c,
            environment,
            logs,
            live: true,
            wrong: false,
            phase: Phase::Instantiated,
            t: 0.0,
            states: Vec::new(),
            context,
            trail: Vec::new(),
            _callbacks: callbacks,
        }
    }
    pub fn is_me(&self) -> bool {
        self.way == Way::ModelExchange
    }
    pub fn event_mode(&self) -> bool {
        self.is_me() || matches!(self.way, Way::CoSimulation { event_mode: true, .. }) && self.fmu.is_fmi3()
    }
    pub fn fail(&self, why: &str) -> ! {
        let from = self.trail.len().saturating_sub(40);
        panic!(
            "{} {:?}, {}: {why}\ncalls: {}",
            self.fmu.name,
            self.way,
            self.context,
            self.trail[from..].join(" ")
        )
    }
    pub fn before(&mut self, name: &'static str) {
        CALLS.fetch_add(1, Relaxed);
        self.environment.journal.borrow_mut().clear();
        if TRACE.load(Relaxed) {
            eprintln!(
                "{} {} {:?} {name} t={:?} {:?}",
                self.context, self.fmu.name, self.way, self.t, self.phase
            );
        }
    }
    /// The invariants of every call.
    pub fn after(&mut self, name: &'static str, status: i32) -> i32 {
        self.trail.push(format!("{name}={status}"));
        let wrong = core::mem::take(&mut self.wrong);
        if !(0..=3).contains(&status) {
            self.fail(&format!("{name} answers {status}: {:?}", self.environment.journal));
        }
        if wrong && status < REFUSALS {
            self.fail(&format!("{name} took what it had to refuse"));
        }
        if let Some(failure) = self.environment.failures.borrow().first() {
            self.fail(failure);
        }
        let journal = self.environment.journal.borrow();
        if status >= REFUSALS {
            REFUSED.fetch_add(1, Relaxed);
            let told =
                |m: &(i32, String)| m.0 == status && m.1.starts_with(name) && m.1.len() > name.len() + 12;
            if self.live && self.logs && !journal.iter().any(told) {
                self.fail(&format!("{name} refuses in silence: {journal:?}"));
            }
        } else if !self.environment.hostile.get() && journal.iter().any(|m| m.0 >= REFUSALS) {
            self.fail(&format!("{name} complains but answers {status}: {journal:?}"));
        }
        status
    }
    /// What was read with status OK is finite.
    pub fn finite(&self, status: i32, name: &str, values: &[f64]) -> i32 {
        if status < REFUSALS && values.iter().any(|v| !v.is_finite()) {
            self.fail(&format!("{name} answers {status} with {values:?}"));
        }
        status
    }
    pub fn reset(&mut self) -> i32 {
        let status = match &self.fmu.library {
            Library::Two(f) => ask!(self, f.fmi2Reset()),
            Library::Three(f) => ask!(self, f.fmi3Reset()),
        };
        if status == 0 {
            (self.phase, self.t) = (Phase::Instantiated, 0.0);
        }
        status
    }
    pub fn free(&mut self) {
        self.before("FreeInstance");
        // SAFETY: the instance, or one freed just before.
        unsafe {
            match &self.fmu.library {
                Library::Two(f) => (f.fmi2FreeInstance)(self.c),
                Library::Three(f) => (f.fmi3FreeInstance)(self.c),
            }
        }
        self.live = false;
        self.states.clear();
    }
}

impl Drop for Subject<'_> {
    fn drop(&mut self) {
        if self.live && !std::thread::panicking() {
            self.free();
        }
    }
}
