//! A process that waits for the one in which FMUs run: what ends that one without a message (`_exit`, exec, a daemon, a
//! signal) is seen by its parent, which ends what the FMUs have started as well.

#![allow(unsafe_code)] // fork

use std::io::{self, PipeReader, PipeWriter, Read, Write};
use std::sync::OnceLock;

use rustix::process::{
    Pid, Signal, WaitOptions, WaitStatus, getpid, getppid, kill_process, set_child_subreaper,
    set_parent_process_death_signal, wait, waitpid,
};

use crate::children::children;
use crate::isolation::ended;

unsafe extern "C" {
    fn fork() -> i32;
}

/// Where the process that works reports how it ends; not set in any other one.
static WORD: OnceLock<PipeWriter> = OnceLock::new();

/// Which of the two processes this is.
pub enum KeeperSide {
    /// The one that goes on and works.
    Worker,
    /// The one that waits for it.
    Keeper(Keeper),
}

/// Waits for the worker.
pub struct Keeper {
    worker: Pid,
    word: PipeReader,
}

/// How the worker ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum KeeperEnd {
    /// With this exit status, which it reported before.
    Said(u8),
    /// Without a message: how, as a sentence without its subject.
    Silent(String),
}

/// Divides the process in two, which has one thread so far.
///
/// # Errors
/// The system has no process or pipe to give.
pub fn divide() -> io::Result<KeeperSide> {
    let (word, mut say) = io::pipe()?;
    let keeper = getpid();
    // A descendant of the worker that loses its parent comes to the keeper, also from a session of its own.
    set_child_subreaper(Some(keeper))?;
    // SAFETY: there is one thread, so no lock is held by another one.
    match unsafe { fork() } {
        0 => {
            set_parent_process_death_signal(Some(Signal::KILL))?;
            if getppid() != Some(keeper) {
                std::process::exit(1); // the keeper has ended already, which gives no signal any more
            }
            let _ = say.flush();
            let _ = WORD.set(say);
            crate::exit::end_forks();
            Ok(KeeperSide::Worker)
        }
        id => {
            let worker = Pid::from_raw(id).filter(|_| id > 0).ok_or_else(io::Error::last_os_error)?;
            Ok(KeeperSide::Keeper(Keeper { worker, word }))
        }
    }
}

/// This process is a worker already.
pub fn is_worker() -> bool {
    WORD.get().is_some()
}

/// The worker is about to end with this exit status. Elsewhere nothing happens.
pub fn say(status: u8) {
    if let Some(mut word) = WORD.get() {
        let _ = word.write_all(&[status]); // no one may wait any more
    }
}

impl Keeper {
    /// The worker's process id.
    pub fn worker(&self) -> i32 {
        self.worker.as_raw_nonzero().get()
    }

    /// Waits for the worker, and ends what it leaves behind.
    pub fn wait(mut self) -> KeeperEnd {
        let status = loop {
            match waitpid(Some(self.worker), WaitOptions::empty()) {
                Ok(Some((_, status))) => break Some(status),
                Ok(None) | Err(rustix::io::Errno::INTR) => {}
                Err(_) => break None,
            }
        };
        end_children();
        // All who could write are gone, so this ends.
        let mut said = Vec::new();
        let _ = self.word.read_to_end(&mut said);
        match said.first() {
            Some(status) => KeeperEnd::Said(*status),
            None => KeeperEnd::Silent(status.map_or_else(|| "was lost".to_owned(), how)),
        }
    }
}

fn how(status: WaitStatus) -> String {
    ended(std::os::unix::process::ExitStatusExt::from_raw(status.as_raw()))
}

/// What the isolated FMUs of this process leave behind when they crash comes to it, for [`end_children`] to end.
///
/// # Errors
/// A kernel that cannot do so.
pub fn adopt() -> io::Result<()> {
    Ok(set_child_subreaper(Some(getpid()))?)
}

/// Ends all children of this process until there are none; of one that [adopts](adopt) all that is below them too.
pub fn end_children() {
    loop {
        let mut any = false;
        for child in children(getpid()) {
            any |= kill_process(child, Signal::KILL).is_ok();
        }
        while let Ok(Some(_)) = wait(WaitOptions::NOHANG) {
            any = true;
        }
        if !any {
            return;
        }
        std::thread::yield_now();
    }
}
