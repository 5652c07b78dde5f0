//! Messages of FMUs, one log per instance.
//!
//! What an FMU hands to a callback as environment is a number here, looked up among the live instances and
//! never followed as a pointer: some FMUs pass another pointer than the one they were given.

#![allow(unsafe_code)] // the C boundary

use std::any::Any;
use std::collections::{BTreeMap, VecDeque};
use std::ffi::{CStr, c_char, c_int, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use trueup_fmi::abi::{fmi2::*, fmi3::*};

use crate::error::FmiStatus;

/// One message of an FMU.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// How bad it is.
    pub status: FmiStatus,
    /// Category, empty if the FMU gave none.
    pub category: String,
    /// The text.
    pub text: String,
}

impl std::fmt::Display for Message {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.category.as_str() {
            "" => write!(f, "[{}] {}", self.status, self.text),
            category => write!(f, "[{}, {category}] {}", self.status, self.text),
        }
    }
}

/// Takes messages as they come, on the thread that called the FMU.
pub type Listener = Box<dyn Fn(&Message) + Send + Sync>;

/// Messages kept per instance; older ones are dropped.
pub const KEPT: usize = 1000;

/// Bytes of a message that are kept; the ring of an isolated FMU takes them at once.
const LONGEST: usize = 1 << 13;

/// Lines of the log that an error carries.
const TAIL: usize = 10;

/// One intermediate update, as the C callback gives it; returns the time of a requested early return.
pub(crate) type Hook = Box<dyn FnMut(UpdateArguments) -> Option<f64> + Send>;

/// Arguments of an intermediate update.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UpdateArguments {
    pub(crate) time: f64,
    pub(crate) set_requested: bool,
    pub(crate) get_allowed: bool,
    pub(crate) step_finished: bool,
    pub(crate) can_return_early: bool,
}

/// A live instance as the callbacks see it.
pub(crate) struct Live {
    pub(crate) id: usize,
    pub(crate) name: String,
    /// The FMU.
    pub(crate) file: PathBuf,
    messages: Mutex<VecDeque<Message>>,
    listener: Option<Listener>,
    hook: Mutex<Option<Hook>>,
    panic: Mutex<Option<String>>,
    /// There is one; looked at after every step.
    panicked: AtomicBool,
}

static NEXT: AtomicUsize = AtomicUsize::new(1);
static REGISTRY: Mutex<BTreeMap<usize, Weak<Live>>> = Mutex::new(BTreeMap::new());

/// A panicked listener must not silence the log for good.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Live {
    pub(crate) fn register(name: &str, file: &Path, listener: Option<Listener>) -> Arc<Self> {
        let live = Arc::new(Self {
            id: NEXT.fetch_add(1, Ordering::Relaxed),
            name: name.into(),
            file: file.into(),
            messages: Mutex::default(),
            listener,
            hook: Mutex::default(),
            panic: Mutex::default(),
            panicked: AtomicBool::new(false),
        });
        lock(&REGISTRY).insert(live.id, Arc::downgrade(&live));
        live
    }

    /// What the FMU gets as environment.
    pub(crate) fn environment(&self) -> *mut c_void {
        std::ptr::without_provenance_mut(self.id)
    }

    pub(crate) fn set_hook(&self, hook: Option<Hook>) {
        *lock(&self.hook) = hook;
    }

    pub(crate) fn has_hook(&self) -> bool {
        lock(&self.hook).is_some()
    }

    /// The message of a panic in a hook since the last call.
    pub(crate) fn take_panic(&self) -> Option<String> {
        if !self.panicked.load(Ordering::Acquire) {
            return None;
        }
        self.panicked.store(false, Ordering::Relaxed);
        lock(&self.panic).take()
    }

    pub(crate) fn messages(&self) -> Vec<Message> {
        lock(&self.messages).iter().cloned().collect()
    }

    pub(crate) fn tail(&self) -> Vec<String> {
        let messages = lock(&self.messages);
        messages.iter().skip(messages.len().saturating_sub(TAIL)).map(Message::to_string).collect()
    }

    pub(crate) fn push(&self, message: Message) {
        let mut messages = lock(&self.messages);
        if messages.len() == KEPT {
            messages.pop_front();
        }
        messages.push_back(message.clone());
        drop(messages);
        if let Some(listener) = &self.listener {
            listener(&message);
        }
    }
}

impl Drop for Live {
    fn drop(&mut self) {
        lock(&REGISTRY).remove(&self.id);
    }
}

/// All instances, unless they are being changed.
pub(crate) fn living() -> Vec<Arc<Live>> {
    REGISTRY.try_lock().map(|all| all.values().filter_map(Weak::upgrade).collect()).unwrap_or_default()
}

/// The live instance of an environment, else the only one with that name.
fn find(environment: *mut c_void, name: Option<&str>) -> Option<Arc<Live>> {
    let registry = lock(&REGISTRY);
    if let Some(live) = registry.get(&environment.addr()).and_then(Weak::upgrade) {
        return Some(live);
    }
    let found: Vec<_> = registry.values().filter_map(Weak::upgrade).collect();
    drop(registry); // the last reference to an instance may go here, and its drop takes the lock
    let mut named = found.into_iter().filter(|live| Some(live.name.as_str()) == name);
    named.next().filter(|_| named.next().is_none())
}

/// A text from the FMU.
///
/// # Safety
/// NULL or a null-terminated string.
pub(crate) unsafe fn text(pointer: *const c_char) -> String {
    if pointer.is_null() {
        return String::new();
    }
    // SAFETY: not NULL, so null-terminated by the caller's word.
    unsafe { CStr::from_ptr(pointer) }.to_string_lossy().into_owned()
}

pub(crate) fn panic_message(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".into())
}

/// The beginning of a message that is too long, and how long it is.
fn cut(mut text: String) -> String {
    let length = text.len();
    if length > LONGEST {
        let end = (0..=LONGEST).rev().find(|at| text.is_char_boundary(*at)).unwrap_or(0);
        text.truncate(end);
        text.push_str(&format!(" ... (cut: the message has {length} bytes)"));
    }
    text
}

/// Where logger.c delivers the formatted message.
///
/// # Safety
/// The texts are NULL or null-terminated.
#[unsafe(no_mangle)]
unsafe extern "C" fn trueup_fmi_log(
    environment: *mut c_void,
    instance: *const c_char,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
) {
    // A listener may panic; unwinding into the FMU is not allowed, and there is no one to report to.
    let _ = catch_unwind(|| {
        // SAFETY: as the caller's.
        let (name, category, text) = unsafe { (text(instance), text(category), text(message)) };
        if let Some(live) = find(environment, Some(&name)) {
            live.push(Message { status: status.into(), category: cut(category), text: cut(text) });
        }
    });
}

unsafe extern "C" {
    /// logger.c
    pub(crate) fn trueup_fmi2_logger(
        environment: fmi2ComponentEnvironment,
        instance: fmi2String,
        status: fmi2Status,
        category: fmi2String,
        format: fmi2String,
        ...
    );
}

/// The logger of FMI 3.0.
pub(crate) unsafe extern "C" fn fmi3_log(
    environment: fmi3InstanceEnvironment,
    status: fmi3Status,
    category: fmi3String,
    message: fmi3String,
) {
    // SAFETY: the texts are the FMU's, NULL or null-terminated.
    unsafe { trueup_fmi_log(environment, std::ptr::null(), status.0, category, message) }
}

/// The intermediate update of FMI 3.0.
pub(crate) unsafe extern "C" fn fmi3_intermediate_update(
    environment: fmi3InstanceEnvironment,
    time: fmi3Float64,
    set_requested: fmi3Boolean,
    get_allowed: fmi3Boolean,
    step_finished: fmi3Boolean,
    can_return_early: fmi3Boolean,
    early_return_requested: *mut fmi3Boolean,
    early_return_time: *mut fmi3Float64,
) {
    let update = UpdateArguments {
        time,
        set_requested: set_requested.into(),
        get_allowed: get_allowed.into(),
        step_finished: step_finished.into(),
        can_return_early: can_return_early.into(),
    };
    let wish = find(environment, None).and_then(|live| {
        // Taken out for the call, so that a call back into the closure finds none instead of a deadlock.
        let mut hook = lock(&live.hook).take()?;
        let wish = catch_unwind(AssertUnwindSafe(|| hook(update)));
        live.set_hook(Some(hook));
        wish.unwrap_or_else(|panic| {
            *lock(&live.panic) = Some(panic_message(&*panic));
            live.panicked.store(true, Ordering::Release);
            None
        })
    });
    // SAFETY: the FMU's, valid where not NULL.
    unsafe {
        if !early_return_requested.is_null() {
            *early_return_requested = wish.is_some().into();
        }
        if let (Some(wish), false) = (wish, early_return_time.is_null()) {
            *early_return_time = wish;
        }
    }
}

#[cfg(test)]
mod tests;
