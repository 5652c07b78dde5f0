//! The importer's loops on raw C functions, as lean as they can be.

#![allow(unsafe_code)] // calls of C functions

use super::fmu::{Fmu, Kind, Library};
use core::ffi::c_void;
use core::ptr::null;
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;
use trueup_fmi_description::description::DescriptionCausality;

pub const TOLERANCE: f64 = 1e-6;

pub struct Importer<'a> {
    fmu: &'a Fmu,
    c: *mut c_void,
    t: f64,
    x: Vec<f64>,
    moved: Vec<f64>,
    dx: Vec<f64>,
    inputs: (Vec<u32>, Vec<f64>),
    /// Values of the inputs at the start: bodies of prescribed motion are apart.
    start: Vec<f64>,
    outputs: (Vec<u32>, Vec<f64>),
    _callbacks: Box<fmi2CallbackFunctions>,
}

/// Every call has to be legal.
macro_rules! ok {
    ($call:expr) => {{
        // SAFETY: pointers are valid for the lengths given with them.
        let status = unsafe { $call };
        assert_eq!(status.0, 0, stringify!($call));
    }};
}

impl<'a> Importer<'a> {
    fn new(fmu: &'a Fmu, model_exchange: bool) -> Self {
        // SAFETY: a function without parameters that ignores its arguments.
        let logger = unsafe { core::mem::transmute::<*const (), Logger>(silent as *const ()) };
        let callbacks = Box::new(fmi2CallbackFunctions {
            // Reference FMUs of FMI 2.0 want all three.
            logger: Some(logger),
            allocateMemory: Some(calloc),
            freeMemory: Some(free),
            stepFinished: None,
            componentEnvironment: core::ptr::null_mut(),
        });
        let (name, token, no) = (c"bench".as_ptr(), fmu.token.as_ptr(), core::ptr::null_mut());
        // SAFETY: legal arguments.
        let c = unsafe {
            match &fmu.library {
                Library::Two(f) => {
                    let kind = if model_exchange { fmi2ModelExchange } else { fmi2CoSimulation };
                    (f.fmi2Instantiate)(name, kind, token, null(), &*callbacks, 0, 0)
                }
                Library::Three(f) if model_exchange => {
                    (f.fmi3InstantiateModelExchange)(name, token, null(), fmi3False, fmi3False, no, None)
                }
                Library::Three(f) => (f.fmi3InstantiateCoSimulation)(
                    name,
                    token,
                    null(),
                    fmi3False,
                    fmi3False,
                    fmi3False,
                    fmi3False,
                    null(),
                    0,
                    no,
                    None,
                    None,
                ),
            }
        };
        assert!(!c.is_null(), "{}", fmu.name);
        match &fmu.library {
            Library::Two(f) => {
                ok!((f.fmi2SetupExperiment)(c, 1, TOLERANCE, 0.0, 0, 0.0));
                ok!((f.fmi2EnterInitializationMode)(c));
                ok!((f.fmi2ExitInitializationMode)(c));
            }
            Library::Three(f) => {
                ok!((f.fmi3EnterInitializationMode)(c, fmi3True, TOLERANCE, 0.0, fmi3False, 0.0));
                ok!((f.fmi3ExitInitializationMode)(c));
            }
        }
        let all = |causality| {
            let variables = fmu.of(causality, Kind::Real);
            let len = variables.iter().map(|v| v.len).sum();
            (variables.iter().map(|v| v.reference).collect(), vec![0.0; len])
        };
        let n = fmu.states;
        let mut inputs: (Vec<u32>, Vec<f64>) = all(DescriptionCausality::Input);
        let (ur, un, u, ul) = parts(&mut inputs);
        match &fmu.library {
            Library::Two(f) => ok!((f.fmi2GetReal)(c, ur, un, u)),
            Library::Three(f) => ok!((f.fmi3GetFloat64)(c, ur, un, u, ul)),
        }
        Self {
            fmu,
            c,
            t: 0.0,
            x: vec![0.0; n],
            moved: vec![0.0; n],
            dx: vec![0.0; n],
            start: inputs.1.clone(),
            inputs,
            outputs: all(DescriptionCausality::Output),
            _callbacks: callbacks,
        }
    }
    /// In continuous-time mode.
    pub fn model_exchange(fmu: &'a Fmu) -> Self {
        let mut i = Self::new(fmu, true);
        let (c, x, n) = (i.c, i.x.as_mut_ptr(), i.x.len());
        match &fmu.library {
            Library::Two(f) => {
                let mut info = fmi2EventInfo { newDiscreteStatesNeeded: 1, ..fmi2EventInfo::default() };
                while info.newDiscreteStatesNeeded != 0 {
                    ok!((f.fmi2NewDiscreteStates)(c, &mut info));
                }
                ok!((f.fmi2EnterContinuousTimeMode)(c));
                ok!((f.fmi2GetContinuousStates)(c, x, n));
            }
            Library::Three(f) => {
                let mut b = [fmi3True; 5];
                while b[0] == fmi3True {
                    let [p, q, r, s, u] = &mut b;
                    ok!((f.fmi3UpdateDiscreteStates)(c, p, q, r, s, u, &mut i.t));
                }
                ok!((f.fmi3EnterContinuousTimeMode)(c));
                ok!((f.fmi3GetContinuousStates)(c, x, n));
            }
        }
        i
    }
    /// In step mode.
    pub fn co_simulation(fmu: &'a Fmu) -> Self {
        Self::new(fmu, false)
    }
    /// Time, states (moved a little), derivatives.
    pub fn evaluate(&mut self, t: f64, move_by: f64) -> &[f64] {
        self.moved.copy_from_slice(&self.x);
        self.moved[0] += move_by;
        let (c, x, dx, n) = (self.c, self.moved.as_ptr(), self.dx.as_mut_ptr(), self.x.len());
        match &self.fmu.library {
            Library::Two(f) => {
                ok!((f.fmi2SetTime)(c, t));
                ok!((f.fmi2SetContinuousStates)(c, x, n));
                ok!((f.fmi2GetDerivatives)(c, dx, n));
            }
            Library::Three(f) => {
                ok!((f.fmi3SetTime)(c, t));
                ok!((f.fmi3SetContinuousStates)(c, x, n));
                ok!((f.fmi3GetContinuousStateDerivatives)(c, dx, n));
            }
        }
        &self.dx
    }
    /// All inputs set, to their start values and `input` more, one step, all outputs read.
    pub fn step(&mut self, h: f64, input: f64) -> &[f64] {
        self.inputs.1.iter_mut().zip(&self.start).for_each(|(u, start)| *u = start + input);
        let c = self.c;
        let (ur, un, u, ul) = parts(&mut self.inputs);
        match &self.fmu.library {
            Library::Two(f) => ok!((f.fmi2SetReal)(c, ur, un, u)),
            Library::Three(f) => ok!((f.fmi3SetFloat64)(c, ur, un, u, ul)),
        }
        self.advance(h);
        let (yr, yn, y, yl) = parts(&mut self.outputs);
        match &self.fmu.library {
            Library::Two(f) => ok!((f.fmi2GetReal)(c, yr, yn, y)),
            Library::Three(f) => ok!((f.fmi3GetFloat64)(c, yr, yn, y, yl)),
        }
        &self.outputs.1
    }
    /// One step, and nothing else.
    pub fn advance(&mut self, h: f64) {
        let (c, t) = (self.c, self.t);
        match &self.fmu.library {
            Library::Two(f) => ok!((f.fmi2DoStep)(c, t, h, 1)),
            Library::Three(f) => {
                let (mut b, mut reached) = ([fmi3False; 3], 0.0);
                let [event, end, early] = &mut b;
                ok!((f.fmi3DoStep)(c, t, h, fmi3True, event, end, early, &mut reached));
            }
        }
        self.t += h;
    }
}

type Logger = unsafe extern "C" fn(*mut c_void, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
extern "C" fn silent() {}

fn parts((references, values): &mut (Vec<u32>, Vec<f64>)) -> (*const u32, usize, *mut f64, usize) {
    (references.as_ptr(), references.len(), values.as_mut_ptr(), values.len())
}

unsafe extern "C" {
    fn calloc(n: usize, size: usize) -> *mut c_void;
    fn free(p: *mut c_void);
}

impl Drop for Importer<'_> {
    fn drop(&mut self) {
        // SAFETY: an instance.
        unsafe {
            match &self.fmu.library {
                Library::Two(f) => (f.fmi2FreeInstance)(self.c),
                Library::Three(f) => (f.fmi3FreeInstance)(self.c),
            }
        }
    }
}
