//! The inner loop of a master: steps and calls with prepared blocks of many instances, run one after another with nothing
//! between them but a look at the status.
//!
//! What is checked elsewhere at every call is checked here when the program is [bound](Program::bind): that the instances
//! are the same, live, and no one else's as long as it is bound.

#![allow(unsafe_code)] // the C boundary

mod lines;

use std::ffi::{c_int, c_void};
use std::ops::Range;

use trueup_fmi::abi::fmi2;
use trueup_fmi::abi::fmi3;

pub use lines::{Following, InputLines};

use crate::core::{PreparedReferences, UNWRITTEN, lent};
use crate::error::ImportError;
use crate::exit;
use crate::instance::AnyInstance;
use crate::results::CoSimulationStep;

impl AnyInstance {
    fn id(&self) -> usize {
        match self {
            Self::V2(i) => i.core.live.id,
            Self::V3(i) => i.core.live.id,
        }
    }

    /// Where it is, whether sizes of its arrays have changed, whether it can be called.
    fn identity(&self) -> (*mut c_void, u32, bool) {
        match self {
            Self::V2(i) => (i.core.component, 0, i.core.ready("").is_ok()),
            Self::V3(i) => (i.core.component, i.epoch, i.core.ready("").is_ok()),
        }
    }
}

/// Who has instances, by index.
pub trait Instances {
    /// The instance of this index.
    fn instance(&mut self, index: usize) -> Option<&mut AnyInstance>;
}

/// A block of doubles: references (kept alive by the program), values in `first..first + values`.
#[derive(Clone, Copy)]
struct DoubleBlock {
    /// Of the instance.
    id: usize,
    component: *mut c_void,
    references: *const u32,
    count: usize,
    first: usize,
    values: usize,
}

#[derive(Clone, Copy)]
enum ProgramCall {
    Get2(fmi2::pointer::fmi2GetReal, DoubleBlock),
    Get3(fmi3::pointer::fmi3GetFloat64, DoubleBlock),
    Set2(fmi2::pointer::fmi2SetReal, DoubleBlock),
    Set3(fmi3::pointer::fmi3SetFloat64, DoubleBlock),
    /// `values[to] = factor * values[from] + offset`
    Hand {
        from: usize,
        to: usize,
        factor: f64,
        offset: f64,
    },
}

impl DoubleBlock {
    /// A copy of the references.
    ///
    /// # Safety
    /// The program that keeps them lives.
    #[inline]
    unsafe fn lent<R>(&self, call: impl FnOnce(*const u32) -> R) -> R {
        // SAFETY: the caller's word.
        lent(unsafe { std::slice::from_raw_parts(self.references, self.count) }, call)
    }
}

impl ProgramCall {
    /// Sets copies of the block's `values`, as many as it has; OK of what sets nothing.
    ///
    /// # Safety
    /// The program lives, the instance is live and exclusively the caller's.
    #[inline]
    unsafe fn set(self, values: *const f64) -> c_int {
        let (Self::Set2(_, b) | Self::Set3(_, b)) = self else { return 0 };
        // SAFETY: the caller's word.
        unsafe {
            let values = std::slice::from_raw_parts(values, b.values);
            b.lent(|r| {
                lent(values, |v| match self {
                    Self::Set2(f, _) => f(b.component, r, b.count, v).0,
                    Self::Set3(f, _) => f(b.component, r, b.count, v, b.values).0,
                    _ => 0,
                })
            })
        }
    }
}

#[derive(Clone, Copy)]
enum Stepping {
    V2(fmi2::pointer::fmi2DoStep, *mut c_void, usize),
    V3(fmi3::pointer::fmi3DoStep, *mut c_void, usize),
}

/// Steps, then calls and copies.
#[derive(Default)]
pub struct Program {
    steps: Vec<Stepping>,
    /// What is done about the inputs of each step; of those beyond nothing.
    ahead: Vec<lines::RangeHandling>,
    /// Instance of each step.
    stepped: Vec<usize>,
    calls: Vec<ProgramCall>,
    /// Instance of each call; of a copy 0.
    called: Vec<usize>,
    /// Instances with their places and the sizes for which their blocks were prepared.
    identities: Vec<(usize, *mut c_void, u32)>,
    references: Vec<Box<[u32]>>,
    /// Number of values needed.
    values: usize,
}

// SAFETY: the pointers are followed by `Bound` alone, while it has exclusive access to the instances.
unsafe impl Send for Program {}

/// A program with its instances, which no one else can reach meanwhile.
pub struct Bound<'a, I: ?Sized> {
    program: &'a Program,
    _instances: &'a mut I,
}

/// Why a round of a program ended early.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProgramStop {
    /// The `at`-th step was not whole; those after it were not made.
    Step {
        /// Which.
        at: usize,
        /// Which part of it, from 0: of inputs on lines.
        part: usize,
        /// What it came to: for [`Program::explain`].
        outcome: StepOutcome,
    },
    /// The inputs of the `at`-th step could not be set; it was not made.
    Ahead {
        /// Which.
        at: usize,
        /// Status of the call.
        status: c_int,
    },
    /// A call failed; those after it were not made.
    Call {
        /// Which.
        at: usize,
        /// Its status.
        status: c_int,
    },
}

/// What a step came to, as the FMU reported it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepOutcome {
    /// Begin and length of the requested step, s.
    time: f64,
    step: f64,
    status: c_int,
    event: bool,
    terminate: bool,
    early: bool,
    last: f64,
}

impl Program {
    /// Adds a step of an instance. `false`, and nothing is added: it has no doStep function, or intermediate updates.
    pub fn step(&mut self, index: usize, instance: &mut AnyInstance) -> bool {
        let (component, ..) = instance.identity();
        let step = match &*instance {
            AnyInstance::V2(i) => {
                i.core.functions.fmi2DoStep.map(|f| Stepping::V2(f, component, i.core.live.id))
            }
            // What happens in an intermediate update is looked at after each step.
            AnyInstance::V3(i) if i.core.live.has_hook() => None,
            AnyInstance::V3(i) => {
                i.core.functions.fmi3DoStep.map(|f| Stepping::V3(f, component, i.core.live.id))
            }
        };
        let Some(step) = step else { return false };
        self.know(index, instance);
        self.steps.push(step);
        self.stepped.push(index);
        true
    }

    /// Adds the reading of doubles into `values`, or their setting from there. `false`: there is no such function, or the
    /// block is not of this length.
    pub fn call(
        &mut self,
        index: usize,
        instance: &mut AnyInstance,
        set: bool,
        block: &PreparedReferences,
        values: Range<usize>,
    ) -> bool {
        let Some((it, references)) = Self::block(instance, block, &values) else { return false };
        let call = match (&*instance, set) {
            (AnyInstance::V2(i), false) => i.core.functions.fmi2GetReal.map(|f| ProgramCall::Get2(f, it)),
            (AnyInstance::V2(i), true) => i.core.functions.fmi2SetReal.map(|f| ProgramCall::Set2(f, it)),
            (AnyInstance::V3(i), false) => i.core.functions.fmi3GetFloat64.map(|f| ProgramCall::Get3(f, it)),
            (AnyInstance::V3(i), true) => i.core.functions.fmi3SetFloat64.map(|f| ProgramCall::Set3(f, it)),
        };
        let Some(call) = call else { return false };
        self.know(index, instance);
        self.references.push(references);
        self.values = self.values.max(values.end);
        self.calls.push(call);
        self.called.push(index);
        true
    }

    /// A block with its references, `None` if it is not of this length.
    fn block(
        instance: &AnyInstance,
        block: &PreparedReferences,
        values: &Range<usize>,
    ) -> Option<(DoubleBlock, Box<[u32]>)> {
        let (component, epoch, _) = instance.identity();
        if block.epoch != epoch || block.count != values.len() {
            return None;
        }
        let references = block.references.clone();
        let it = DoubleBlock {
            id: instance.id(),
            component,
            references: references.as_ptr(),
            count: references.len(),
            first: values.start,
            values: values.len(),
        };
        Some((it, references))
    }

    /// Adds `values[to] = factor * values[from] + offset`.
    pub fn hand(&mut self, from: usize, to: usize, factor: f64, offset: f64) {
        self.values = self.values.max(from.max(to) + 1);
        self.calls.push(ProgramCall::Hand { from, to, factor, offset });
        self.called.push(0);
    }

    fn know(&mut self, index: usize, instance: &AnyInstance) {
        let (component, epoch, _) = instance.identity();
        if !self.identities.iter().rev().any(|known| *known == (index, component, epoch)) {
            self.identities.push((index, component, epoch));
        }
    }

    /// Binds the instances that the program was made of. `None`: they are others now, one may not be called any more, or
    /// sizes have changed.
    pub fn bind<'a, I: Instances + ?Sized>(&'a self, instances: &'a mut I) -> Option<Bound<'a, I>> {
        for (index, component, epoch) in &self.identities {
            let (now, sizes, ready) = instances.instance(*index)?.identity();
            if now != *component || sizes != *epoch || !ready {
                return None;
            }
        }
        Some(Bound { program: self, _instances: instances })
    }

    /// The instance of the `at`-th step.
    pub fn stepped(&self, at: usize) -> usize {
        self.stepped[at]
    }

    /// The instance of the `at`-th call.
    pub fn called(&self, at: usize) -> usize {
        self.called[at]
    }

    /// What the outcome of a step means.
    ///
    /// # Errors
    /// As `do_step` of the instance.
    pub fn explain(
        instance: &mut AnyInstance,
        outcome: StepOutcome,
    ) -> Result<Option<Box<CoSimulationStep>>, Box<ImportError>> {
        let StepOutcome { time, step, status, event, terminate, early, last } = outcome;
        match instance {
            AnyInstance::V2(i) => i.not_whole(fmi2::fmi2Status(status), time),
            AnyInstance::V3(i) => {
                i.stepped(i.core.check("fmi3DoStep", status), time, step, [event, terminate, early], last)
            }
        }
    }

    /// The error of what sets the inputs of the `at`-th step.
    pub fn failure_ahead(&self, instance: &mut AnyInstance, at: usize, status: c_int) -> Option<ImportError> {
        let function = self.setter(at);
        match instance {
            AnyInstance::V2(i) => i.core.check(function, status).err(),
            AnyInstance::V3(i) => i.core.check(function, status).err(),
        }
    }

    /// The error of the `at`-th call.
    pub fn failure(&self, instance: &mut AnyInstance, at: usize, status: c_int) -> Option<ImportError> {
        let function = match self.calls[at] {
            ProgramCall::Get2(..) => "fmi2GetReal",
            ProgramCall::Set2(..) => "fmi2SetReal",
            ProgramCall::Get3(..) => "fmi3GetFloat64",
            ProgramCall::Set3(..) => "fmi3SetFloat64",
            ProgramCall::Hand { .. } => return None,
        };
        match instance {
            AnyInstance::V2(i) => i.core.check(function, status).err(),
            AnyInstance::V3(i) => i.core.check(function, status).err(),
        }
    }
}

/// Before a block is read.
///
/// # Safety
/// There are so many values, which nothing else uses.
#[inline]
unsafe fn unwritten(values: *mut f64, count: usize) {
    // SAFETY: the caller's word.
    unsafe { std::slice::from_raw_parts_mut(values, count) }.fill(UNWRITTEN);
}

/// OK or Warning.
#[inline]
fn good(status: c_int) -> bool {
    status as u32 <= 1
}

/// One step of an instance that is live and exclusively the caller's; `None`: it went its whole way and nothing is to be
/// reported.
#[inline]
fn do_step(stepping: Stepping, time: f64, step: f64, no_rollback: bool) -> Option<StepOutcome> {
    match stepping {
        Stepping::V2(f, component, id) => {
            exit::calls_at(id, time);
            // SAFETY: the signature is the standard's; the instance is live and exclusively ours, see `Program::bind`.
            let status = unsafe { f(component, time, step, no_rollback.into()) }.0;
            if good(status) {
                return None;
            }
            Some(StepOutcome { time, step, status, event: false, terminate: false, early: false, last: time })
        }
        Stepping::V3(f, component, id) => {
            exit::calls_at(id, time);
            let [mut event, mut terminate, mut early] = [fmi3::fmi3False; 3];
            let mut last = time;
            let flags = (&raw mut event, &raw mut terminate, &raw mut early);
            // SAFETY: as above.
            let status = unsafe {
                f(component, time, step, no_rollback.into(), flags.0, flags.1, flags.2, &raw mut last)
            }
            .0;
            let [event, terminate, early] = [event, terminate, early].map(bool::from);
            if good(status) && !(event || terminate || early) {
                return None;
            }
            Some(StepOutcome { time, step, status, event, terminate, early, last })
        }
    }
}

impl<I: ?Sized> Bound<'_, I> {
    /// All steps from `time` by `step` s, then all calls and copies. `values`: at least as many as the blocks need.
    ///
    /// # Errors
    /// The first step that was not whole, or the first call that failed.
    #[inline]
    pub fn round(
        &mut self,
        time: f64,
        step: f64,
        no_rollback: bool,
        values: &mut [f64],
    ) -> Result<(), ProgramStop> {
        let program = self.program;
        for (at, stepping) in program.steps.iter().enumerate() {
            if let Some(outcome) = do_step(*stepping, time, step, no_rollback) {
                return Err(ProgramStop::Step { at, part: 0, outcome });
            }
        }
        self.exchange(values)
    }

    /// All calls and copies.
    ///
    /// # Errors
    /// The first call that failed.
    #[inline]
    pub fn exchange(&mut self, values: &mut [f64]) -> Result<(), ProgramStop> {
        assert!(values.len() >= self.program.values, "as many values as the program's blocks need");
        let base = values.as_mut_ptr();
        for (at, call) in self.program.calls.iter().enumerate() {
            if let ProgramCall::Get2(_, b)
            | ProgramCall::Get3(_, b)
            | ProgramCall::Set2(_, b)
            | ProgramCall::Set3(_, b) = call
            {
                exit::calls(b.id);
            }
            // SAFETY: the signatures are the standard's; the instance is live and exclusively ours and the block was prepared
            // for its sizes, see `bind`; the ranges and indices are within `values`, by the assertion.
            let status = unsafe {
                match *call {
                    ProgramCall::Get2(f, b) => {
                        unwritten(base.add(b.first), b.values);
                        b.lent(|references| f(b.component, references, b.count, base.add(b.first)).0)
                    }
                    ProgramCall::Get3(f, b) => {
                        unwritten(base.add(b.first), b.values);
                        b.lent(|references| {
                            f(b.component, references, b.count, base.add(b.first), b.values).0
                        })
                    }
                    ProgramCall::Set2(_, b) | ProgramCall::Set3(_, b) => call.set(base.add(b.first)),
                    ProgramCall::Hand { from, to, factor, offset } => {
                        *base.add(to) = factor * *base.add(from) + offset;
                        0
                    }
                }
            };
            if !good(status) {
                return Err(ProgramStop::Call { at, status });
            }
        }
        exit::returned();
        Ok(())
    }
}
