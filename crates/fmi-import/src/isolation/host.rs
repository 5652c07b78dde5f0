//! The other side: a process that loads one FMU and calls it for the master.

#![allow(unsafe_code)] // the boundary of the process

use std::ffi::{OsString, c_int, c_void};
use std::os::unix::ffi::OsStringExt;
use std::path::Path;
use std::process::ExitCode;
use std::sync::atomic::{AtomicPtr, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, ThreadId};
use std::time::Duration;

use rustix::process::{Signal, getppid, kill_process};
use trueup_fmi::abi::{fmi2, fmi3};

use super::calls::{three, two};
use super::frame::{Arguments, FrameReader, HEAD, aligned, note, status_word};
use super::link::{FREE, INSTANTIATE, said};
use super::memory::{MessageNote, SharedMemory};
use crate::library;
use crate::log::{Live, Message, UpdateArguments, fmi3_intermediate_update, fmi3_log, trueup_fmi2_logger};
use crate::table::{table2, table3};

/// How often the host looks whether its master is still there.
const LOOK: Duration = Duration::from_millis(200);
const ERROR: c_int = 3;

unsafe extern "C" {
    fn calloc(count: usize, size: usize) -> *mut c_void;
    fn free(memory: *mut c_void);
    fn signal(number: c_int, handler: usize) -> usize;
}

/// Signals that Rust's runtime looks at first, and its default.
const SIGBUS: c_int = 7;
const SIGSEGV: c_int = 11;
const DEFAULT: usize = 0;

#[expect(clippy::large_enum_variant, reason = "a process has one")]
enum HostFunctions {
    None,
    Two(table2::LibraryFunctions),
    Three(table3::LibraryFunctions),
}

struct Host {
    memory: SharedMemory,
    functions: HostFunctions,
    component: *mut c_void,
    live: Option<Arc<Live>>,
    /// Keeps them for the FMU, which keeps the pointer.
    callbacks: Option<Box<fmi2::fmi2CallbackFunctions>>,
    /// Where data of a callback goes.
    top: usize,
}

/// The host, once there is one; what the FMU calls back has no other way to it.
static HOST: AtomicPtr<Host> = AtomicPtr::new(std::ptr::null_mut());
/// One thread at a time puts messages into the ring; which thread may hand over amid a call.
static RING: Mutex<Option<ThreadId>> = Mutex::new(None);

/// Serves the master that has made this process, until it orders the end or is gone.
pub(super) fn serve() -> Result<ExitCode, String> {
    let failed = |e: std::io::Error| format!("it is no memory of an FMU: {e}");
    let file = std::io::stdin();
    let file = std::os::fd::AsFd::as_fd(&file).try_clone_to_owned().map_err(failed)?;
    if let Ok(null) = std::fs::File::open("/dev/null") {
        // What the FMU reads as its standard input is empty.
        let _ = rustix::stdio::dup2_stdin(&null);
    }
    let memory = SharedMemory::of_host(file).map_err(failed)?;
    // A crash ends the process where it happens, however it came about.
    // SAFETY: the C library's, with signals of Linux.
    unsafe {
        signal(SIGBUS, DEFAULT);
        signal(SIGSEGV, DEFAULT);
    }
    // What the FMU starts stays below this process, so that its master finds it.
    let _ = rustix::process::set_child_subreaper(Some(rustix::process::getpid()));
    let master = memory.master();
    thread::spawn(move || {
        // However the master ends, and whatever the FMU is doing then.
        while getppid().is_some_and(|parent| parent.as_raw_nonzero().get() as u32 == master) {
            thread::sleep(LOOK);
        }
        let _ = kill_process(rustix::process::getpid(), Signal::KILL);
    });
    let host = Host {
        memory,
        functions: HostFunctions::None,
        component: std::ptr::null_mut(),
        live: None,
        callbacks: None,
        top: 0,
    };
    let host = Box::into_raw(Box::new(host));
    HOST.store(host, Ordering::Release);
    // SAFETY: the host lives as long as the process; this thread alone uses it, and holds no reference while the FMU runs.
    unsafe {
        loop {
            let note = next(host)?;
            match note.kind {
                note::OPEN => open(host, note),
                note::CALL => run(host, note),
                _ => break,
            }
        }
        // Unloads the library: what it does at its end belongs to this process.
        (*host).functions = HostFunctions::None;
    }
    crate::keeper::end_children();
    Ok(ExitCode::SUCCESS)
}

/// # Safety
/// (of all below) The host lives, on its thread, and no one holds a reference to it.
unsafe fn next(host: *mut Host) -> Result<MessageNote, String> {
    // SAFETY: the caller's word.
    unsafe {
        while !(*host).memory.wait(Duration::from_secs(3600)) {}
        (*host).memory.receive().map_err(|e| e.to_string())
    }
}

unsafe fn open(host: *mut Host, note: MessageNote) {
    // SAFETY: the caller's word.
    unsafe {
        let mut r = FrameReader::new(&(*host).memory, note.begin);
        let is_three = r.word() as u32 != 0;
        let (_, _) = (r.word(), r.word());
        let path = OsString::from_vec(r.bytes());
        let loaded = library::load(Path::new(&path));
        let (loaded, bytes) = match loaded {
            Err(why) => (false, why.into_bytes()),
            Ok(library) => {
                let there = if is_three {
                    let functions = table3::LibraryFunctions::of(library);
                    let there = three::there(&functions);
                    (*host).functions = HostFunctions::Three(functions);
                    there
                } else {
                    let functions = table2::LibraryFunctions::of(library);
                    let there = two::there(&functions);
                    (*host).functions = HostFunctions::Two(functions);
                    there
                };
                (true, there.into_iter().map(u8::from).collect())
            }
        };
        let it = &mut *host;
        let end = aligned(16 + bytes.len());
        let end = if it.memory.room(end).is_ok() { end } else { 0 };
        if end > 0 {
            it.memory.copy_in(0, &u64::from(loaded).to_ne_bytes());
            it.memory.copy_in(8, &(bytes.len() as u64).to_ne_bytes());
            it.memory.copy_in(16, &bytes);
        }
        it.memory.send(MessageNote { kind: note::REPLY, begin: 0, end });
    }
}

/// The entries of a frame, as far as they go well.
unsafe fn run(host: *mut Host, frame: MessageNote) {
    // SAFETY: the caller's word.
    unsafe {
        let outer = ((*host).top, (*host).memory.current());
        (*host).top = aligned(frame.end);
        *lock() = Some(thread::current().id());
        let (mut at, mut end) = (frame.begin, frame.end);
        while at + HEAD <= frame.end {
            let (word, length) = ((*host).memory.word(at), (*host).memory.word(at + 8) as usize);
            (*host).memory.set_current(word as u32);
            let mut arguments = Arguments::new(&raw mut (*host).memory, at, frame.end);
            let status = call(host, word as u32, &mut arguments);
            (*host).memory.copy_in(at + 16, &status_word(status).to_ne_bytes());
            end = end.max(arguments.end);
            let good = matches!(status, 0 | 1);
            if !good || length == 0 {
                break;
            }
            at += length;
        }
        (*host).top = outer.0;
        (*host).memory.set_current(outer.1);
        if outer.0 == 0 {
            *lock() = None;
        }
        (*host).memory.send(MessageNote { kind: note::REPLY, begin: frame.begin, end });
    }
}

fn lock() -> std::sync::MutexGuard<'static, Option<ThreadId>> {
    RING.lock().unwrap_or_else(PoisonError::into_inner)
}

unsafe fn call(host: *mut Host, number: u32, arguments: &mut Arguments) -> c_int {
    // SAFETY: the caller's word; the functions are not changed while one runs.
    unsafe {
        let (functions, component) = (&(*host).functions, (*host).component);
        match (number, functions) {
            (INSTANTIATE, HostFunctions::Two(f)) => {
                let made = instantiate_two(host, f, arguments);
                (*host).component = made;
                if made.is_null() { ERROR } else { 0 }
            }
            (INSTANTIATE, HostFunctions::Three(f)) => {
                let made = instantiate_three(host, f, arguments);
                (*host).component = made;
                if made.is_null() { ERROR } else { 0 }
            }
            (FREE, HostFunctions::Two(f)) => {
                f.fmi2FreeInstance.into_iter().for_each(|free| free(component));
                0
            }
            (FREE, HostFunctions::Three(f)) => {
                f.fmi3FreeInstance.into_iter().for_each(|free| free(component));
                0
            }
            (_, HostFunctions::Two(f)) => two::call(f, number, component, arguments).unwrap_or(ERROR),
            (_, HostFunctions::Three(f)) => three::call(f, number, component, arguments).unwrap_or(ERROR),
            (_, HostFunctions::None) => ERROR,
        }
    }
}

/// The instance as callbacks see it: its messages go into the ring.
unsafe fn live(host: *mut Host, name: *const std::ffi::c_char) -> Arc<Live> {
    // SAFETY: the caller's word; the name is the master's.
    unsafe {
        let live = Live::register(&crate::log::text(name), Path::new(""), Some(Box::new(log)));
        (*host).live = Some(Arc::clone(&live));
        live
    }
}

unsafe fn instantiate_two(host: *mut Host, f: &table2::LibraryFunctions, a: &mut Arguments) -> *mut c_void {
    // SAFETY: the caller's word; the arguments are those that `Isolated::instantiate_two` writes.
    unsafe {
        let (name, kind, guid, resources) = (a.text(), fmi2::fmi2Type(a.value()), a.text(), a.text());
        let (visible, logging) = (a.value(), a.value());
        let Some(function) = f.fmi2Instantiate else { return std::ptr::null_mut() };
        let callbacks = fmi2::fmi2CallbackFunctions {
            logger: Some(trueup_fmi2_logger),
            allocateMemory: Some(calloc),
            freeMemory: Some(free),
            stepFinished: None,
            componentEnvironment: live(host, name).environment(),
        };
        let callbacks: *const _ = &**(*host).callbacks.insert(Box::new(callbacks));
        function(name, kind, guid, resources, callbacks, visible, logging)
    }
}

unsafe fn instantiate_three(host: *mut Host, f: &table3::LibraryFunctions, a: &mut Arguments) -> *mut c_void {
    // SAFETY: the caller's word; the arguments are those that `Isolated::instantiate_three` writes.
    unsafe {
        let co_simulation = a.word() != 0;
        let (name, token, resources) = (a.text(), a.text(), a.text());
        let mut flag = || fmi3::fmi3Boolean(a.word() as u8);
        let (visible, logging, events, early, update) = (flag(), flag(), flag(), flag(), flag());
        let count = a.word() as usize;
        let variables = a.array::<u32>();
        let live = live(host, name);
        let environment = live.environment();
        if !co_simulation {
            let Some(function) = f.fmi3InstantiateModelExchange else { return std::ptr::null_mut() };
            return function(name, token, resources, visible, logging, environment, Some(fmi3_log));
        }
        let Some(function) = f.fmi3InstantiateCoSimulation else { return std::ptr::null_mut() };
        let update: fmi3::fmi3IntermediateUpdateCallback = bool::from(update).then(|| {
            live.set_hook(Some(Box::new(intermediate_update)));
            fmi3_intermediate_update as _
        });
        function(
            name,
            token,
            resources,
            visible,
            logging,
            events,
            early,
            variables,
            count,
            environment,
            Some(fmi3_log),
            update,
        )
    }
}

/// A message of the FMU, from whatever thread.
fn log(message: &Message) {
    let host = HOST.load(Ordering::Acquire);
    let ring = lock();
    // SAFETY: the host lives as long as the process; the ring is used under the lock, and handed over by the thread alone
    // whose turn it is.
    unsafe {
        let bytes = said(message);
        if (*host).memory.say(&bytes) {
            return;
        }
        let mine = *ring == Some(thread::current().id());
        if mine {
            (*host).memory.send(MessageNote { kind: note::FULL, begin: 0, end: 0 });
            let _ = next(host);
        }
        if !mine || !(*host).memory.say(&bytes) {
            (*host).memory.lose();
        }
    }
}

/// An intermediate update: the master's closure, which may call the FMU meanwhile.
fn intermediate_update(update: UpdateArguments) -> Option<f64> {
    let host = HOST.load(Ordering::Acquire);
    if *lock() != Some(thread::current().id()) {
        return None; // a thread of the FMU's own: it is not its turn
    }
    let flags = [update.set_requested, update.get_allowed, update.step_finished, update.can_return_early];
    let mut words = vec![update.time.to_bits()];
    words.extend(flags.map(u64::from));
    words.extend([0, 0]);
    // SAFETY: as of `serve`: this is its thread, amid a call.
    unsafe {
        let begin = (*host).top;
        let end = begin + 8 * words.len();
        (*host).memory.room(end).ok()?;
        for (i, word) in words.iter().enumerate() {
            (*host).memory.copy_in(begin + 8 * i, &word.to_ne_bytes());
        }
        (*host).top = end;
        (*host).memory.send(MessageNote { kind: note::CALLBACK, begin, end });
        loop {
            match next(host) {
                Ok(frame) if frame.kind == note::CALL => run(host, frame),
                Ok(_) => break,
                Err(_) => return None,
            }
        }
        (*host).top = begin;
        let memory = &(*host).memory;
        (memory.word(begin + 40) != 0).then(|| f64::from_bits(memory.word(begin + 48)))
    }
}
