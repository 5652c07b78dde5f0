//! An FMU that ends the whole process (`exit`), which would look like a run that ended well.

#![allow(unsafe_code)] // the C boundary

use std::cell::Cell;
use std::ffi::c_int;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::log::{self, Live};

unsafe extern "C" {
    fn atexit(function: extern "C" fn()) -> c_int;
    fn _exit(status: c_int) -> !;
    #[cfg(target_os = "linux")]
    fn pthread_atfork(
        prepare: Option<extern "C" fn()>,
        parent: Option<extern "C" fn()>,
        child: Option<extern "C" fn()>,
    ) -> c_int;
}

thread_local! {
    /// The instance that this thread has called last, and the time that it was given last.
    static CALLED: Cell<usize> = const { Cell::new(0) };
    static TIME: Cell<f64> = const { Cell::new(f64::NAN) };
}

/// The process may not end now unless an FMU ends it.
static WATCHED: AtomicBool = AtomicBool::new(false);
static TELL: OnceLock<fn(Option<f64>, &str)> = OnceLock::new();

/// This process is one that an FMU has forked.
static FORKED: AtomicBool = AtomicBool::new(false);

#[cfg(target_os = "linux")]
extern "C" fn forked() {
    FORKED.store(true, Ordering::Relaxed);
}

/// From now on a process that is forked from this one ends where a call of an FMU has returned: it would go on as a second program, and
/// write the same results. What it does within the call, or after `exec`, is the FMU's own.
#[cfg(target_os = "linux")]
pub(crate) fn end_forks() {
    // SAFETY: the function is there for good, and only stores.
    let _ = unsafe { pthread_atfork(None, None, Some(forked)) };
}

/// Calls of FMUs have returned.
#[inline]
pub(crate) fn returned() {
    if FORKED.load(Ordering::Relaxed) {
        // SAFETY: nothing of this process is needed any more.
        unsafe { _exit(0) }
    }
}

/// An instance is called.
#[inline]
pub(crate) fn calls(id: usize) {
    returned();
    CALLED.set(id);
}

/// It is called for this time in s.
#[inline]
pub(crate) fn calls_at(id: usize, time: f64) {
    returned();
    CALLED.set(id);
    TIME.set(time);
}

/// As long as it lives, an end of the process is the doing of an FMU.
#[derive(Debug)]
pub struct Watch(());

/// From now on, an FMU in this process that calls `exit` ends it with status 1, after a sentence to `tell` that names the FMU,
/// with the time in s that it was given last.
///
/// A program that itself ends by `exit` declares that before: [`expect`].
pub fn watch(tell: fn(Option<f64>, &str)) -> Watch {
    // SAFETY: the function is there for good, and does not unwind.
    static REGISTERED: OnceLock<c_int> = OnceLock::new();
    REGISTERED.get_or_init(|| unsafe { atexit(at_exit) });
    let _ = TELL.set(tell);
    WATCHED.store(true, Ordering::SeqCst);
    Watch(())
}

/// The program itself will end the process.
pub fn expect() {
    WATCHED.store(false, Ordering::SeqCst);
}

impl Drop for Watch {
    fn drop(&mut self) {
        expect();
    }
}

extern "C" fn at_exit() {
    if !WATCHED.swap(false, Ordering::SeqCst) {
        return;
    }
    let _ = std::panic::catch_unwind(|| {
        let name = |it: &Live| format!("\"{}\" ({})", it.name, it.file.display());
        let living = log::living();
        // Another thread than those that call FMUs is one of an FMU's own.
        let called = CALLED.try_with(Cell::get).ok().and_then(|id| living.iter().find(|it| it.id == id));
        let who = match called {
            Some(it) => format!("instance {}", name(it)),
            None => {
                let all: Vec<_> = living.iter().map(|it| name(it)).collect();
                format!("one of the instances {}", all.join(", "))
            }
        };
        let time = TIME.try_with(Cell::get).ok().filter(|t| t.is_finite());
        let tail = called.map(|it| crate::error::tail(&it.tail())).unwrap_or_default();
        if let Some(tell) = TELL.get() {
            let what = format!(
                "the FMU of {who} called exit, which ends this program; what was computed is lost, run it in a process of its own to \
                 keep that{tail}"
            );
            tell(time, &what);
        }
    });
    // SAFETY: ends the process.
    unsafe { _exit(1) }
}
