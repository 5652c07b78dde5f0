//! What instances of both versions have in common.

#![allow(unsafe_code)] // the C boundary

use std::ffi::{CString, c_int, c_void};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{FmiError, FmiStatus, ImportError};
use crate::exit;
use crate::isolation::HostFault;
use crate::library::UnpackedFmu;
use crate::log::{Listener, Live};

/// How to instantiate.
#[derive(Default)]
pub struct InstanceOptions {
    /// Name of the instance, as it appears in messages; empty: the file's name.
    pub name: String,
    /// Request the FMU's debug messages.
    pub logging_on: bool,
    /// Let the FMU show itself.
    pub visible: bool,
    /// Takes messages as they come; they are kept in the instance's log, too.
    pub listener: Option<Listener>,
}

impl InstanceOptions {
    /// Quiet, with this name.
    pub fn named(name: impl Into<String>) -> Self {
        Self { name: name.into(), ..Self::default() }
    }
}

/// A stored state of an instance. It goes with the instance: restoring or freeing it through another one is an
/// error, and what is not freed is freed when the instance terminates or is dropped.
#[derive(Debug, PartialEq, Eq, Hash)]
pub struct StateId {
    instance: usize,
    serial: usize,
}

/// Value references whose number of values is known: what is read or written again and again costs the call alone.
/// Made by `prepare` of an instance; it holds until sizes of arrays change (configuration mode, reset).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PreparedReferences {
    pub(crate) references: Box<[u32]>,
    /// Number of values, all elements of arrays.
    pub(crate) count: usize,
    /// Of the instance's sizes.
    pub(crate) epoch: u32,
}

impl PreparedReferences {
    /// The value references.
    pub fn references(&self) -> &[u32] {
        &self.references
    }

    /// Number of values, all elements of arrays.
    pub fn count(&self) -> usize {
        self.count
    }
}

/// A version's function table.
pub(crate) trait FunctionTable {
    /// Frees an instance.
    ///
    /// # Safety
    /// The instance is of this library and not freed yet.
    unsafe fn free(&self, component: *mut c_void);
    /// Never unload the library; if it is in another process, end that.
    fn leak(&mut self);
    /// Why there is no process of the FMU any more.
    fn fault(&self) -> Option<HostFault>;
    /// The function that the last status is of, if it is not the one that returned it.
    fn blamed(&self) -> Option<&'static str>;
}

/// An instance: what every call needs.
pub(crate) struct Core<F: FunctionTable> {
    pub(crate) component: *mut c_void,
    pub(crate) functions: F,
    pub(crate) live: Arc<Live>,
    pub(crate) lost: AtomicBool,
    /// Last, so that the directory outlives the library.
    pub(crate) fmu: Arc<UnpackedFmu>,
}

impl<F: FunctionTable> Core<F> {
    pub(crate) fn new(fmu: &Arc<UnpackedFmu>, functions: F, options: InstanceOptions) -> Self {
        let stem =
            || fmu.file().file_stem().map_or_else(|| "fmu".into(), |s| s.to_string_lossy().into_owned());
        let name = if options.name.is_empty() { stem() } else { options.name };
        Self {
            component: std::ptr::null_mut(),
            functions,
            live: Live::register(&name, fmu.file(), options.listener),
            lost: AtomicBool::new(false),
            fmu: Arc::clone(fmu),
        }
    }

    /// The next call is one of this instance.
    #[inline]
    pub(crate) fn mark(&self) {
        exit::calls(self.live.id);
    }

    #[inline]
    pub(crate) fn ready(&self, function: &'static str) -> Result<(), ImportError> {
        if self.lost.load(Ordering::Relaxed) {
            return Err(ImportError::Lost { function, instance: self.live.name.clone() });
        }
        Ok(())
    }

    pub(crate) fn missing(&self, function: &'static str) -> ImportError {
        ImportError::NotSupported { function, instance: self.live.name.clone() }
    }

    pub(crate) fn no_instance(&self, function: &'static str) -> ImportError {
        if let Some(HostFault { how, .. }) = self.functions.fault() {
            return self.ended(function, how);
        }
        ImportError::Instantiate { function, instance: self.live.name.clone(), log: self.live.tail() }
    }

    #[inline]
    pub(crate) fn check(&self, function: &'static str, status: c_int) -> Result<(), ImportError> {
        // OK and Warning
        if matches!(status, 0 | 1) { Ok(()) } else { Err(self.failed(function, FmiStatus::from(status))) }
    }

    #[cold]
    fn failed(&self, function: &'static str, status: FmiStatus) -> ImportError {
        if let Some(HostFault { function, how }) = self.functions.fault() {
            self.lost.store(true, Ordering::Relaxed);
            return self.ended(function, how);
        }
        let function = self.functions.blamed().unwrap_or(function);
        if status == FmiStatus::Fatal {
            self.lost.store(true, Ordering::Relaxed);
        }
        FmiError { function, status, instance: self.live.name.clone(), log: self.live.tail() }.into()
    }

    /// Waits no longer for this instance, which is never called again.
    #[cold]
    pub(crate) fn give_up(&self, function: &'static str, how: String) -> ImportError {
        self.lost.store(true, Ordering::Relaxed);
        self.ended(function, how)
    }

    fn ended(&self, function: &'static str, how: String) -> ImportError {
        ImportError::Ended {
            function,
            instance: self.live.name.clone(),
            file: self.fmu.file().to_owned(),
            how,
            log: self.live.tail(),
        }
    }

    #[inline]
    pub(crate) fn length(
        &self,
        function: &'static str,
        what: &'static str,
        expected: usize,
        got: usize,
    ) -> Result<(), ImportError> {
        if expected == got {
            return Ok(());
        }
        Err(self.wrong_length(function, what, expected, got))
    }

    #[cold]
    fn wrong_length(
        &self,
        function: &'static str,
        what: &'static str,
        expected: usize,
        got: usize,
    ) -> ImportError {
        ImportError::Length { function, instance: self.live.name.clone(), what, expected, got }
    }

    /// The instance may be called, with a block that was prepared for these sizes and has as many values as `got`.
    #[inline]
    pub(crate) fn fits(&self, block: &PreparedReferences, epoch: u32, got: usize) -> bool {
        block.epoch == epoch && block.count == got && !self.lost.load(Ordering::Relaxed)
    }

    /// Why a call with a block was not made.
    #[cold]
    pub(crate) fn unfit(
        &self,
        function: &'static str,
        block: &PreparedReferences,
        epoch: u32,
        got: usize,
    ) -> Box<ImportError> {
        let instance = || self.live.name.clone();
        Box::new(match self.ready(function) {
            Err(lost) => lost,
            Ok(()) if block.epoch != epoch => ImportError::Stale { function, instance: instance() },
            Ok(()) if block.count != got => self.wrong_length(function, "values", block.count, got),
            Ok(()) => self.missing(function),
        })
    }

    /// As [`Core::check`], small enough for a register.
    #[inline]
    pub(crate) fn check_boxed(&self, function: &'static str, status: c_int) -> Result<(), Box<ImportError>> {
        if matches!(status, 0 | 1) { Ok(()) } else { Err(self.failed_boxed(function, status)) }
    }

    #[cold]
    fn failed_boxed(&self, function: &'static str, status: c_int) -> Box<ImportError> {
        Box::new(self.failed(function, FmiStatus::from(status)))
    }
}

impl<F: FunctionTable> Drop for Core<F> {
    fn drop(&mut self) {
        if self.lost.load(Ordering::Relaxed) {
            self.functions.leak(); // the FMU may not be called any more, but its threads may still run
        } else if !self.component.is_null() {
            self.mark();
            // SAFETY: instantiated by this library, freed here only.
            unsafe { self.functions.free(self.component) };
            exit::returned();
        }
    }
}

/// What an FMU has to write is this before: one that answers OK and writes nothing would have the value of the call before.
pub(crate) const UNWRITTEN: f64 = f64::NAN;

/// Elements of an array that are copied one by one, and without allocating.
const FEW: usize = 4;
const SMALL: usize = 16;

/// Hands a copy of `of` to `call`: some FMUs write into what they may only read. Most calls hand over a few elements, and a step has
/// several such calls.
#[inline]
pub(crate) fn lent<T: Copy, R>(of: &[T], call: impl FnOnce(*const T) -> R) -> R {
    let few: [T; FEW];
    let small: [T; SMALL];
    let many: Vec<T>;
    let copy = match of {
        [] => of.as_ptr(),
        [first, ..] if of.len() <= FEW => {
            few = std::array::from_fn(|k| of.get(k).copied().unwrap_or(*first));
            few.as_ptr()
        }
        [first, ..] if of.len() <= SMALL => {
            let mut all = [*first; SMALL];
            all[..of.len()].copy_from_slice(of);
            small = all;
            small.as_ptr()
        }
        _ => {
            many = of.to_vec();
            many.as_ptr()
        }
    };
    call(copy)
}

/// Calls a function of the table with a prepared block: what a running system does most, so no error is built before it
/// is needed, and none is larger than a pointer.
macro_rules! call_prepared {
    ($core:expr, $function:ident, $block:expr, $epoch:expr, $length:expr $(, $arg:expr)* $(,)?) => {{
        let core = &$core;
        match core.functions.$function {
            Some(function) if core.fits($block, $epoch, $length) => {
                core.mark();
                // SAFETY: as in `call`; the block has as many values as the instance expects.
                let status = unsafe { function(core.component, $($arg),*) };
                core.check_boxed(stringify!($function), status.0)
            }
            _ => Err(core.unfit(stringify!($function), $block, $epoch, $length)),
        }
    }};
}
/// Calls a function of the table and checks its status.
macro_rules! call {
    ($core:expr, $function:ident $(, $arg:expr)* $(,)?) => {{
        let core = &$core;
        core.ready(stringify!($function)).and_then(|()| {
            let function = core.functions.$function.ok_or_else(|| core.missing(stringify!($function)))?;
            core.mark();
            // SAFETY: the signature is the standard's, the component is this instance's and not freed,
            // and every pointer is valid for the length that goes with it.
            let status = unsafe { function(core.component, $($arg),*) };
            core.check(stringify!($function), status.0)
        })
    }};
}
pub(crate) use {call, call_prepared};

/// Stored states of one instance, by serial number.
#[derive(Default)]
pub(crate) struct States {
    next: usize,
    list: Vec<FmuState>,
}

/// What the FMU stores, and the sizes of arrays at that time.
pub(crate) struct FmuState {
    serial: usize,
    pub(crate) pointer: *mut c_void,
    pub(crate) epoch: Option<u32>,
}

impl States {
    pub(crate) fn add<F: FunctionTable>(
        &mut self,
        core: &Core<F>,
        pointer: *mut c_void,
        epoch: Option<u32>,
    ) -> StateId {
        self.next += 1;
        self.list.push(FmuState { serial: self.next, pointer, epoch });
        StateId { instance: core.live.id, serial: self.next }
    }

    fn position<F: FunctionTable>(&self, core: &Core<F>, id: &StateId) -> Result<usize, ImportError> {
        let position = self.list.iter().position(|state| state.serial == id.serial);
        position
            .filter(|_| id.instance == core.live.id)
            .ok_or_else(|| ImportError::NoSuchState { instance: core.live.name.clone() })
    }

    pub(crate) fn slot<F: FunctionTable>(
        &mut self,
        core: &Core<F>,
        id: &StateId,
    ) -> Result<&mut FmuState, ImportError> {
        let position = self.position(core, id)?;
        Ok(&mut self.list[position])
    }

    /// Forgets a state.
    pub(crate) fn take<F: FunctionTable>(
        &mut self,
        core: &Core<F>,
        id: &StateId,
    ) -> Result<*mut c_void, ImportError> {
        let position = self.position(core, id)?;
        Ok(self.list.swap_remove(position).pointer)
    }

    /// Forgets all.
    pub(crate) fn drain(&mut self) -> impl Iterator<Item = *mut c_void> {
        self.list.drain(..).map(|state| state.pointer)
    }
}

/// The six functions on FMU states, the same in both versions but for their names.
macro_rules! state_functions {
    ($get:ident, $set:ident, $free:ident, $size:ident, $serialize:ident, $deserialize:ident) => {
        /// Stores the instance's state.
        ///
        /// # Errors
        #[doc = concat!("Whatever `", stringify!($get), "` returns.")]
        pub fn save(&mut self) -> Result<StateId, ImportError> {
            let mut state = std::ptr::null_mut();
            call!(self.core, $get, &raw mut state)?;
            let epoch = Some(self.epoch());
            Ok(self.states.add(&self.core, state, epoch))
        }

        /// Stores the instance's state in place of an earlier one, without allocating.
        ///
        /// # Errors
        #[doc = concat!("Whatever `", stringify!($get), "` returns; [`Error::NoSuchState`].")]
        pub fn save_over(&mut self, id: &StateId) -> Result<(), ImportError> {
            let epoch = Some(self.epoch());
            let state = self.states.slot(&self.core, id)?;
            state.epoch = epoch;
            call!(self.core, $get, &raw mut state.pointer)
        }

        /// Goes back to a stored state, which stays stored.
        ///
        /// # Errors
        #[doc = concat!("Whatever `", stringify!($set), "` returns; [`Error::NoSuchState`].")]
        pub fn restore(&mut self, id: &StateId) -> Result<(), ImportError> {
            let (now, state) = (self.epoch(), self.states.slot(&self.core, id)?);
            let (pointer, same) = (state.pointer, state.epoch == Some(now));
            if !same {
                self.forget_sizes();
            }
            call!(self.core, $set, pointer)
        }

        /// Frees a stored state.
        ///
        /// # Errors
        #[doc = concat!("Whatever `", stringify!($free), "` returns; [`Error::NoSuchState`].")]
        pub fn free(&mut self, id: StateId) -> Result<(), ImportError> {
            let mut state = self.states.take(&self.core, &id)?;
            call!(self.core, $free, &raw mut state)
        }

        /// A stored state as bytes, for this FMU in another process.
        ///
        /// # Errors
        #[doc = concat!("Whatever `", stringify!($serialize), "` returns; [`Error::NoSuchState`].")]
        pub fn serialize(&mut self, id: &StateId) -> Result<Vec<u8>, ImportError> {
            let state = self.states.slot(&self.core, id)?.pointer;
            let mut size = 0;
            call!(self.core, $size, state, &raw mut size)?;
            let mut bytes = vec![0_u8; size];
            call!(self.core, $serialize, state, bytes.as_mut_ptr().cast(), size)?;
            Ok(bytes)
        }

        /// A stored state from bytes.
        ///
        /// # Errors
        #[doc = concat!("Whatever `", stringify!($deserialize), "` returns.")]
        pub fn deserialize(&mut self, bytes: &[u8]) -> Result<StateId, ImportError> {
            let mut state = std::ptr::null_mut();
            call!(self.core, $deserialize, bytes.as_ptr().cast(), bytes.len(), &raw mut state)?;
            Ok(self.states.add(&self.core, state, None))
        }

        /// States are freed before the instance is terminated: some FMUs refuse it later.
        fn free_states(&mut self) {
            for mut state in self.states.drain() {
                let _ = call!(self.core, $free, &raw mut state); // nothing can be done about it
            }
        }
    };
}
pub(crate) use state_functions;

/// A text for C.
pub(crate) fn c_string(what: &'static str, text: &str) -> Result<CString, ImportError> {
    CString::new(text).map_err(|_| ImportError::Text { what, text: text.into() })
}

/// Texts for C, with the pointers to them.
pub(crate) fn c_strings(what: &'static str, texts: &[&str]) -> Result<Vec<CString>, ImportError> {
    texts.iter().map(|text| c_string(what, text)).collect()
}
