//! The C boundary: the only place of this crate with unsafe code.
//!
//! What an importer holds is a pointer to a [`Handle`]. Every call takes the instance in it exclusively and
//! gives it back, so a call from a second thread, or from within a callback, is refused instead of racing.
//! Freed handles stay readable for a while (a bounded queue), so that a call on a freed instance is refused
//! too. Panics are caught; the instance is then lost and every later call answers Fatal. The panic hook
//! belongs to the process and is left alone: a panic also prints its line on standard error.

#![allow(unsafe_code)] // the C boundary

pub mod fmi2;
pub mod fmi3;
mod fmi3_states;
mod fmi3_status;
mod fmi3_values;

use crate::co_simulation::{StepEnd, StepRequest};
use crate::fault::{CallFault, CallOutcome, CallStatus, error};
use crate::instance::{InstanceSettings, ModelInstance};
use crate::log::{ERRORS, MessageLog};
use crate::model::{Exported, FmuModel};
use core::cell::UnsafeCell;
use core::ffi::{CStr, c_char, c_void};
use core::sync::atomic::{AtomicU64, Ordering};
use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use trueup_fmi::configuration::{BLOCK_SIZE, Configuration, ConfigurationError};
use trueup_numerics::driver::{DriverMoment, DriverView};

/// Marks of a handle: ready for a call, inside a call, freed.
const READY: u64 = 0x5452_5545_5550_0001;
const BUSY: u64 = 0x5452_5545_5550_0002;
const FREED: u64 = 0;

/// What the importer's instance pointer points to.
pub struct Handle<M: FmuModel> {
    mark: AtomicU64,
    instance: UnsafeCell<Option<Box<ModelInstance<M>>>>,
}

/// Addresses of freed handles with the function that gives their memory back; the only global state, touched
/// when an instance is freed.
static FREED_HANDLES: Mutex<VecDeque<Freed>> = Mutex::new(VecDeque::new());
/// Address of a freed handle and the function that gives its memory back.
type Freed = (usize, unsafe fn(usize));
/// How many of them are kept.
const KEPT: usize = 1024;

/// A new instance; the message gives the reason.
pub(crate) fn make<E: Exported>(
    token: Option<&str>,
    what: &str,
    settings: InstanceSettings,
) -> Result<ModelInstance<E::Model>, String> {
    let configuration = E::configuration().map_err(|e| e.to_string())?;
    match token {
        None => Err(format!("{what} is NULL: give the one of modelDescription.xml")),
        Some(token) if token != configuration.token => Err(format!(
            "{what} is {token:?}, but this library is {:?}: modelDescription.xml and library are of different FMUs",
            configuration.token
        )),
        Some(_) => ModelInstance::new(&configuration, settings),
    }
}

/// Returns the instance that `make` makes, or NULL after a message.
pub(crate) fn instantiate<M: FmuModel>(
    function: &str,
    mut log: MessageLog,
    make: impl FnOnce() -> Result<ModelInstance<M>, String>,
) -> *mut c_void {
    let made = catch_unwind(AssertUnwindSafe(make));
    match made.unwrap_or_else(|panic| Err(format!("internal error: {}", panic_text(&*panic)))) {
        Ok(mut instance) => {
            instance.log = log;
            publish(instance)
        }
        Err(why) => {
            log.say(CallStatus::Error, ERRORS, format!("{function}: {why}"));
            core::ptr::null_mut()
        }
    }
}

/// Hands an instance out to the importer.
pub(crate) fn publish<M: FmuModel>(instance: ModelInstance<M>) -> *mut c_void {
    let handle = Handle { mark: AtomicU64::new(READY), instance: UnsafeCell::new(Some(Box::new(instance))) };
    Box::into_raw(Box::new(handle)).cast()
}

/// Frees an instance; NULL, freed and foreign pointers are ignored.
///
/// # Safety
/// `c` is NULL or was returned by [`publish`] with the same `M` (freed or not), or points to readable memory.
pub(crate) unsafe fn free<M: FmuModel>(c: *mut c_void) {
    // SAFETY: as this function's own.
    let Some(handle) = (unsafe { handle::<M>(c) }) else { return };
    if handle.mark.compare_exchange(READY, FREED, Ordering::Acquire, Ordering::Relaxed).is_err() {
        return;
    }
    // SAFETY: the mark went from ready to freed here, so no one else has or will get the instance.
    let instance = unsafe { (*handle.instance.get()).take() };
    let _ = catch_unwind(AssertUnwindSafe(|| drop(instance)));
    // SAFETY: called once, with the address of a handle that `publish` boxed.
    unsafe fn give_back<M: FmuModel>(address: usize) {
        // SAFETY: as above.
        drop(unsafe { Box::from_raw(address as *mut Handle<M>) });
    }
    let mut freed = FREED_HANDLES.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    freed.push_back((c as usize, give_back::<M>));
    if freed.len() > KEPT
        && let Some((address, give_back)) = freed.pop_front()
    {
        // SAFETY: every address is put into the queue once, when its handle is freed.
        unsafe { give_back(address) };
    }
}

/// # Safety
/// As [`free`].
unsafe fn handle<'a, M: FmuModel>(c: *mut c_void) -> Option<&'a Handle<M>> {
    let p = c.cast::<Handle<M>>();
    // SAFETY: not NULL and aligned; what it points to is the caller's responsibility.
    if p.is_null() || !p.is_aligned() { None } else { Some(unsafe { &*p }) }
}

/// Runs `f` on the instance; a fault is logged with the function's name, a panic makes the instance fatal.
///
/// # Safety
/// As [`free`].
pub(crate) unsafe fn enter<M: FmuModel, T>(
    c: *mut c_void,
    function: &str,
    f: impl FnOnce(&mut ModelInstance<M>) -> CallOutcome<T>,
) -> Result<T, CallStatus> {
    // SAFETY: as this function's own.
    let Some(handle) = (unsafe { handle::<M>(c) }) else { return Err(CallStatus::Error) };
    if handle.mark.compare_exchange(READY, BUSY, Ordering::Acquire, Ordering::Relaxed).is_err() {
        return Err(CallStatus::Error);
    }
    // SAFETY: the mark went from ready to busy here: until it is set back the instance is ours alone.
    let result = match unsafe { (*handle.instance.get()).as_deref_mut() } {
        None => Err(CallStatus::Error),
        Some(instance) => match catch_unwind(AssertUnwindSafe(|| f(instance))) {
            Ok(Ok(value)) => Ok(value),
            Ok(Err(fault)) => Err(complain(instance, function, fault)),
            Err(panic) => {
                instance.lose();
                let message = format!(
                    "internal error: {}; the instance is lost, free it and report this",
                    panic_text(&*panic)
                );
                Err(complain(instance, function, CallFault { status: CallStatus::Fatal, message }))
            }
        },
    };
    handle.mark.store(READY, Ordering::Release);
    result
}

fn panic_text(panic: &(dyn Any + Send)) -> &str {
    panic
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| panic.downcast_ref::<String>().map(String::as_str))
        .unwrap_or("unknown")
}

fn complain<M: FmuModel>(instance: &mut ModelInstance<M>, function: &str, fault: CallFault) -> CallStatus {
    let status = if instance.is_lost() { CallStatus::Fatal } else { fault.status };
    let message = format!("{function}: {}", fault.message);
    let _ = catch_unwind(AssertUnwindSafe(|| instance.log.say(status, ERRORS, message)));
    status
}

/// As [`enter`], for calls that answer with their status alone.
///
/// # Safety
/// As [`free`].
pub(crate) unsafe fn status<M: FmuModel>(
    c: *mut c_void,
    function: &str,
    f: impl FnOnce(&mut ModelInstance<M>) -> CallOutcome,
) -> i32 {
    // SAFETY: as this function's own.
    unsafe { enter(c, function, f) }.err().unwrap_or(CallStatus::Ok) as i32
}

/// fmiXDoStep; `update` is called after every internal step, without holding the instance.
///
/// # Safety
/// As [`free`].
pub(crate) unsafe fn do_step<M: FmuModel>(
    c: *mut c_void,
    function: &str,
    t: f64,
    h: f64,
    update: Option<&dyn Fn(f64) -> Option<f64>>,
) -> Result<StepEnd, CallStatus> {
    // SAFETY (here and below): as this function's own.
    let (mut job, started) = unsafe { enter::<M, _>(c, function, |i| Ok((i.begin_step(t, h)?, i.time()))) }?;
    let log_events = job.log_events;
    let mut observe = |view: &mut DriverView| {
        let mut wish = StepRequest::Continue;
        if log_events && view.moment == DriverMoment::Event {
            // SAFETY: as above.
            let _ = unsafe { enter::<M, _>(c, function, |i| i.report_event(view)) };
        }
        if let Some(update) = update
            && view.moment == DriverMoment::Step
        {
            // SAFETY: as above.
            let _ = unsafe { enter::<M, _>(c, function, |i| i.publish(view)) };
            let early = update(view.t);
            // SAFETY: as above.
            if let Ok(true) = unsafe { enter::<M, _>(c, function, |i| Ok(i.collect(view))) } {
                wish = StepRequest::InputsChanged;
            }
            if let Some(t) = early {
                wish = StepRequest::ReturnAt(t);
            }
        }
        wish
    };
    let result = catch_unwind(AssertUnwindSafe(|| job.run(&mut observe)));
    // SAFETY: as above.
    unsafe {
        enter::<M, _>(c, function, |i| match result {
            Ok(result) => i.finish_step(job, started, result),
            Err(panic) => std::panic::resume_unwind(panic),
        })
    }
}

/// fmiXGetFMUState.
pub(crate) unsafe fn get_state<M: FmuModel>(
    i: &mut ModelInstance<M>,
    state: *mut *mut c_void,
) -> CallOutcome {
    usable("FMUstate", state.cast_const(), 1)?;
    // SAFETY: not NULL; the rest is the importer's responsibility.
    let handle = i.get_state(unsafe { *state } as usize)?;
    // SAFETY: as above.
    unsafe { write("FMUstate", state, handle as *mut c_void) }
}

/// fmiXFreeFMUState.
pub(crate) unsafe fn free_state<M: FmuModel>(
    i: &mut ModelInstance<M>,
    state: *mut *mut c_void,
) -> CallOutcome {
    if state.is_null() {
        return Ok(());
    }
    usable("FMUstate", state.cast_const(), 1)?;
    // SAFETY: not NULL; the rest is the importer's responsibility.
    i.free_state(unsafe { *state } as usize)?;
    // SAFETY: as above.
    unsafe { write("FMUstate", state, core::ptr::null_mut()) }
}

/// A C array as a slice; NULL is legal for an empty one only.
///
/// # Safety
/// `p` is NULL or points to `n` readable values that no one writes during the call.
pub(crate) unsafe fn slice<'a, T>(name: &str, p: *const T, n: usize) -> CallOutcome<&'a [T]> {
    if n == 0 {
        return Ok(&[]);
    }
    usable(name, p, n)?;
    // SAFETY: not NULL, aligned, of a possible length; the rest is the caller's responsibility.
    Ok(unsafe { core::slice::from_raw_parts(p, n) })
}

/// A C array as a slice to be written.
///
/// # Safety
/// `p` is NULL or points to `n` initialized values that no one else uses during the call.
pub(crate) unsafe fn slice_mut<'a, T>(name: &str, p: *mut T, n: usize) -> CallOutcome<&'a mut [T]> {
    if n == 0 {
        return Ok(&mut []);
    }
    usable(name, p.cast_const(), n)?;
    // SAFETY: not NULL, aligned, of a possible length; the rest is the caller's responsibility.
    Ok(unsafe { core::slice::from_raw_parts_mut(p, n) })
}

fn usable<T>(name: &str, p: *const T, n: usize) -> CallOutcome {
    if p.is_null() {
        return error(format!("{name} is NULL: it must point to {n} values"));
    }
    if !p.is_aligned() || n > isize::MAX as usize / size_of::<T>().max(1) {
        return error(format!("{name} with {n} values is not a possible array: check pointer and number"));
    }
    Ok(())
}

/// Writes a result through a pointer that must not be NULL.
///
/// # Safety
/// `p` is NULL or points to memory that may be written.
pub(crate) unsafe fn write<T>(name: &str, p: *mut T, value: T) -> CallOutcome {
    usable(name, p.cast_const(), 1)?;
    // SAFETY: not NULL and aligned; the rest is the caller's responsibility.
    unsafe { p.write(value) };
    Ok(())
}

/// A C string; None if it is NULL.
///
/// # Safety
/// `p` is NULL or a null-terminated string.
pub(crate) unsafe fn text(p: *const c_char) -> Option<String> {
    // SAFETY: not NULL; the rest is the caller's responsibility.
    (!p.is_null()).then(|| unsafe { CStr::from_ptr(p) }.to_string_lossy().into_owned())
}

/// The configuration in a library's block, as the packer left it: read byte by byte from memory, because the
/// compiler only sees the empty block.
///
/// # Errors
/// A library that was not packed, or badly so.
pub fn configuration(block: &'static [u8; BLOCK_SIZE]) -> Result<Configuration, ConfigurationError> {
    // SAFETY: references to bytes are valid for reading.
    let bytes: Vec<u8> = block.iter().map(|b| unsafe { core::ptr::read_volatile(b) }).collect();
    Configuration::from_block(&bytes)
}
