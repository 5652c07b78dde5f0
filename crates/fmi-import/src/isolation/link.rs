//! The master's side: an FMU in a process of its own.

#![allow(unsafe_code)] // the boundary of the process

mod ahead;
mod fault;
mod message;
mod remote;

use std::ffi::{CString, c_char, c_int};
use std::io::Error as IoError;
use std::os::unix::process::CommandExt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::time::{Duration, Instant};

use trueup_fmi::abi::fmi3::{fmi3Boolean, fmi3False};
use trueup_fmi_description::FmiVersion;

use self::ahead::PrefetchedQueries;
pub(crate) use self::fault::HostFault;
use self::fault::end;
pub(crate) use self::fault::ended;
use self::message::first;
pub(super) use self::message::said;
pub(crate) use self::remote::RemoteInstance;
use super::Isolation;
use super::frame::{BEFORE, FrameReader, FrameWriter, HEAD, aligned, note, status_of};
use super::memory::{MessageNote, SharedMemory};
use crate::error::FmiStatus;
use crate::interrupt;
use crate::log::{Live, Message, fmi3_intermediate_update};

const FATAL: c_int = 4;
/// Bytes of calls that are kept for the next one.
const POSTED: usize = 1 << 15;
/// How often a master that waits looks after the host.
const FIRST_LOOK: Duration = Duration::from_millis(1);
const LAST_LOOK: Duration = Duration::from_millis(50);
/// How long a call may still take once the user has ended the run.
const GRACE: Duration = Duration::from_secs(1);
/// How long a host may take to end when nothing else is given.
const PATIENCE: Duration = Duration::from_secs(5);

/// Numbers of what is no function of an instance.
pub(super) const INSTANTIATE: u32 = 1000;
pub(super) const FREE: u32 = 1001;

/// OK or Warning.
fn good(status: c_int) -> bool {
    matches!(status, 0 | 1)
}

/// What a call came to, and where its results are: its entry, and behind it.
pub(super) struct LinkOutcome {
    pub(super) status: c_int,
    pub(super) at: Option<(usize, usize)>,
}

const LOST: LinkOutcome = LinkOutcome { status: FATAL, at: None };

/// An instance of an FMU in another process. The functions of [`calls`](super::calls) get its address as the component.
pub(super) struct ProcessLink {
    memory: SharedMemory,
    child: Child,
    deadline: Option<Duration>,
    live: Arc<Live>,
    names: &'static [&'static str],
    /// Where the next frame begins; not at 0 in a call amid a call.
    base: usize,
    /// Where the next entry begins.
    cursor: usize,
    /// Entries that wait for the next call.
    posted: Vec<usize>,
    /// Within an intermediate update.
    nested: bool,
    ahead: PrefetchedQueries,
    fault: Option<HostFault>,
    /// The function whose status the last call returned, if it was another one.
    blamed: Option<&'static str>,
    texts: Vec<CString>,
    binaries: Vec<Vec<u8>>,
}

impl ProcessLink {
    /// Starts a host and loads the library.
    pub(super) fn start(
        library: &Path,
        version: FmiVersion,
        names: &'static [&'static str],
        isolation: &Isolation,
        live: &Arc<Live>,
    ) -> Result<(Self, Vec<bool>), String> {
        let failed = |e: IoError| format!("no process of its own can be made for it: {e}");
        let memory = SharedMemory::new().map_err(failed)?;
        let file = memory.file().try_clone_to_owned().map_err(failed)?;
        let mut command = Command::new(&isolation.program);
        command.args(&isolation.arguments).stdin(Stdio::from(file)).process_group(0);
        let child = command.spawn().map_err(failed)?;
        let mut this = Self {
            memory,
            child,
            deadline: isolation.deadline,
            live: Arc::clone(live),
            names,
            base: 0,
            cursor: 0,
            posted: Vec::new(),
            nested: false,
            ahead: PrefetchedQueries::default(),
            fault: None,
            blamed: None,
            texts: Vec::new(),
            binaries: Vec::new(),
        };
        let mut w = FrameWriter::new(&mut this.memory, 0, u64::from(version == FmiVersion::V3));
        w.bytes(std::os::unix::ffi::OsStrExt::as_bytes(library.as_os_str()));
        let end = w.finish().map_err(failed)?;
        // SAFETY: no call is under way.
        let answer =
            unsafe { Self::exchange(&raw mut this, MessageNote { kind: note::OPEN, begin: 0, end }) };
        if answer.is_none() {
            return Err(this.fault.take().map_or_else(String::new, |fault| format!("it {}", fault.how)));
        }
        let mut r = FrameReader::new(&this.memory, 0);
        let (loaded, said) = (r.word() != 0, r.bytes());
        if !loaded {
            return Err(String::from_utf8_lossy(&said).into_owned());
        }
        let there = said.iter().map(|b| *b != 0).collect();
        Ok((this, there))
    }

    pub(super) fn fault(&self) -> Option<&HostFault> {
        self.fault.as_ref()
    }

    pub(super) fn blamed(&self) -> Option<&'static str> {
        self.blamed
    }

    /// Begins an entry.
    pub(super) fn entry(&mut self, number: u32) -> FrameWriter<'_> {
        FrameWriter::new(&mut self.memory, self.cursor, number.into())
    }

    /// Of the arguments of an entry that was run.
    pub(super) fn reader(&self, entry: usize) -> FrameReader<'_> {
        FrameReader::new(&self.memory, entry + HEAD)
    }

    /// Whether a call can be made, and where its entry ends.
    fn ready(&mut self, end: Result<usize, IoError>) -> Option<usize> {
        self.blamed = None;
        if self.fault.is_some() {
            return None;
        }
        match end {
            Ok(end) => Some(end),
            Err(error) => {
                self.fail(format!("was ended: {error}"));
                None
            }
        }
    }

    /// Marks an entry.
    fn flag(&mut self, at: usize, flag: u64) {
        let word = self.memory.word(at) & 0xffff_ffff | flag;
        self.memory.copy_in(at, &word.to_ne_bytes());
    }

    /// Keeps the call for the next one.
    ///
    /// # Safety
    /// (of these four) The link lives and no one holds a reference into it.
    pub(super) unsafe fn post(
        link: *mut Self,
        begin: usize,
        question: usize,
        end: Result<usize, IoError>,
    ) -> LinkOutcome {
        // SAFETY: the caller's word.
        unsafe {
            let it = &mut *link;
            if it.nested || it.cursor.saturating_sub(it.base) > POSTED {
                return Self::wait(link, begin, question, end);
            }
            let Some(end) = it.ready(end) else { return LOST };
            it.ahead.close();
            it.flag(begin, BEFORE);
            it.posted.push(begin);
            it.cursor = end;
            LinkOutcome { status: 0, at: None }
        }
    }

    /// Makes the call.
    pub(super) unsafe fn wait(
        link: *mut Self,
        begin: usize,
        _: usize,
        end: Result<usize, IoError>,
    ) -> LinkOutcome {
        // SAFETY: the caller's word.
        unsafe {
            let Some(end) = (*link).ready(end) else { return LOST };
            (*link).ahead.close();
            Self::run(link, begin, end, end)
        }
    }

    /// Makes the call, unless it was answered with the last step.
    pub(super) unsafe fn ask(
        link: *mut Self,
        begin: usize,
        question: usize,
        end: Result<usize, IoError>,
    ) -> LinkOutcome {
        // SAFETY: the caller's word.
        unsafe {
            let it = &mut *link;
            let Some(end) = it.ready(end) else { return LOST };
            if !it.posted.is_empty() || it.nested {
                it.ahead.close();
            }
            if let Some(status) = it.ahead.answer(&it.memory, begin, question, end) {
                return LinkOutcome { status, at: Some((begin, end)) };
            }
            let done = Self::run(link, begin, end, end);
            if good(done.status) {
                let it = &mut *link;
                it.ahead.learn(&it.memory, begin, question, end);
            }
            done
        }
    }

    /// Makes the call, and with it those that came after the last step.
    pub(super) unsafe fn step(
        link: *mut Self,
        begin: usize,
        _: usize,
        end: Result<usize, IoError>,
    ) -> LinkOutcome {
        // SAFETY: the caller's word.
        unsafe {
            let it = &mut *link;
            let Some(end) = it.ready(end) else { return LOST };
            if it.nested {
                return Self::run(link, begin, end, end);
            }
            let Ok(last) = it.ahead.append(&mut it.memory, end) else {
                return Self::run(link, begin, end, end);
            };
            let done = Self::run(link, begin, end, last);
            let it = &mut *link;
            it.ahead.open(&it.memory, end, done.at.is_some() && good(done.status));
            done
        }
    }

    /// Hands the frame over: what was posted, the entry from `begin` to `end`, what follows it up to `last`.
    unsafe fn run(link: *mut Self, begin: usize, end: usize, last: usize) -> LinkOutcome {
        // SAFETY: the caller's word.
        unsafe {
            let frame = MessageNote { kind: note::CALL, begin: (*link).base, end: last };
            let answer = Self::exchange(link, frame);
            let it = &mut *link;
            it.cursor = it.base;
            let posted = std::mem::take(&mut it.posted);
            if answer.is_none() {
                return LOST;
            }
            let bad = posted.iter().find_map(|at| {
                let status = status_of(it.memory.word(at + 16)).unwrap_or(FATAL);
                (!good(status)).then_some((*at, status))
            });
            if let Some((at, status)) = bad {
                it.blamed = it.names.get(it.memory.word(at) as u32 as usize).copied();
                return LinkOutcome { status, at: None };
            }
            it.posted = posted;
            it.posted.clear();
            match status_of(it.memory.word(begin + 16)) {
                Some(status) => LinkOutcome { status, at: Some((begin, end)) },
                None => {
                    it.fail("broke the memory that it shares with this program".into());
                    LOST
                }
            }
        }
    }

    /// Hands over and serves the FMU's requests meanwhile, until it is done. `None`: there is a fault.
    ///
    /// # Safety
    /// The link lives and no one holds a reference into it.
    unsafe fn exchange(link: *mut Self, note: MessageNote) -> Option<MessageNote> {
        // SAFETY: the caller's word; no reference is held while a callback runs, which may call again.
        unsafe {
            (*link).memory.send(note);
            loop {
                let note = (*link).next()?;
                match note.kind {
                    note::REPLY => return Some(note),
                    note::FULL => (*link).memory.send(MessageNote { kind: note::READ, ..note }),
                    note::CALLBACK if note.end - note.begin >= 7 * 8 => Self::call_back(link, note),
                    _ => {
                        (*link).fail("broke the memory that it shares with this program".into());
                        return None;
                    }
                }
            }
        }
    }

    /// An intermediate update.
    unsafe fn call_back(link: *mut Self, note: MessageNote) {
        // SAFETY: as of `exchange`.
        unsafe {
            let environment = (*link).live.environment();
            let words: [u64; 5] = std::array::from_fn(|i| (*link).memory.word(note.begin + 8 * i));
            let flag = |i: usize| fmi3Boolean(words[i] as u8);
            let outer = ((*link).base, (*link).cursor, (*link).nested);
            let posted = std::mem::take(&mut (*link).posted);
            ((*link).base, (*link).cursor, (*link).nested) = (aligned(note.end), aligned(note.end), true);
            let (mut wanted, mut time) = (fmi3False, 0.0);
            fmi3_intermediate_update(
                environment,
                f64::from_bits(words[0]),
                flag(1),
                flag(2),
                flag(3),
                flag(4),
                &raw mut wanted,
                &raw mut time,
            );
            let it = &mut *link;
            (it.base, it.cursor, it.nested) = outer;
            it.posted = posted;
            it.memory.copy_in(note.begin + 40, &u64::from(bool::from(wanted)).to_ne_bytes());
            it.memory.copy_in(note.begin + 48, &time.to_bits().to_ne_bytes());
            it.memory.send(MessageNote { kind: note::ANSWER, ..note });
        }
    }

    /// Waits for the host.
    fn next(&mut self) -> Option<MessageNote> {
        if self.fault.is_some() {
            return None; // of a call amid this one
        }
        let mut look = self.deadline.unwrap_or(FIRST_LOOK).min(FIRST_LOOK);
        let (mut begun, mut interrupted) = (None, None);
        while !self.memory.wait(look) {
            let begun =
                *begun.get_or_insert_with(|| Instant::now().checked_sub(look).unwrap_or_else(Instant::now));
            if let Ok(Some(status)) = self.child.try_wait() {
                if self.memory.wait(Duration::ZERO) {
                    break; // its last word
                }
                self.fail(ended(status));
                return None;
            }
            let spent = begun.elapsed();
            look = (2 * look).min(LAST_LOOK);
            if let Some(deadline) = self.deadline {
                if spent >= deadline {
                    self.fail(format!("did not return within {} s and was stopped", deadline.as_secs_f64()));
                    return None;
                }
                look = look.min(deadline.saturating_sub(spent)).max(Duration::from_micros(100));
            }
            if interrupt::requested() && interrupted.get_or_insert_with(Instant::now).elapsed() >= GRACE {
                self.fail("did not return after the run was interrupted and was stopped".into());
                return None;
            }
        }
        self.hear();
        match self.memory.receive() {
            Ok(note) => Some(note),
            Err(error) => {
                self.fail(format!("was stopped: {error}"));
                None
            }
        }
    }

    /// Ends it all: there is no host any more.
    fn fail(&mut self, how: String) {
        self.kill();
        self.hear();
        let at = self.memory.current();
        let function = match at {
            INSTANTIATE => "instantiation",
            FREE => "fmiFreeInstance",
            _ => self.names.get(at as usize).copied().unwrap_or("loading"),
        };
        self.fault.get_or_insert(HostFault { function, how });
    }

    fn kill(&mut self) {
        end(&mut self.child);
    }

    /// Takes over what the FMU has logged.
    #[inline]
    fn hear(&mut self) {
        let bytes = self.memory.heard();
        let mut rest = bytes.as_slice();
        while let Some((message, behind)) = first(rest) {
            self.tell(message);
            rest = behind;
        }
        match self.memory.lost() {
            0 => {}
            lost => self.tell(Message {
                status: FmiStatus::Warning,
                category: String::new(),
                text: format!("{lost} messages of other threads of the FMU were lost"),
            }),
        }
    }

    fn tell(&self, message: Message) {
        // A listener may panic; as where the FMU calls, there is no one to report to.
        let _ = catch_unwind(AssertUnwindSafe(|| self.live.push(message)));
    }

    /// Ends the host at once: its instance may not be called any more.
    pub(super) fn abandon(&mut self) {
        self.kill();
        self.fault.get_or_insert(HostFault { function: "", how: "was stopped".into() });
    }

    /// How long a call may take.
    pub(super) fn deadline(&self) -> Option<Duration> {
        self.deadline
    }

    /// Texts that are at `at`; they live until the next ones are read.
    ///
    /// # Safety
    /// There is room for `count` texts.
    pub(super) unsafe fn texts_at(&mut self, at: usize, texts: *mut *const c_char, count: usize) {
        let mut r = FrameReader::new(&self.memory, at);
        self.texts.clear();
        for i in 0..count {
            let text = r.text();
            let pointer = text.as_ref().map_or(std::ptr::null(), |text| text.as_ptr());
            self.texts.extend(text);
            // SAFETY: the caller's word; the text does not move when the list does.
            unsafe { texts.add(i).write(pointer) };
        }
    }

    /// Binaries that are at `at`, with their sizes; as [`ProcessLink::texts_at`].
    ///
    /// # Safety
    /// There is room for `count` of both.
    pub(super) unsafe fn binaries_at(
        &mut self,
        at: usize,
        binaries: *mut *const u8,
        sizes: *mut usize,
        count: usize,
    ) {
        let mut r = FrameReader::new(&self.memory, at);
        self.binaries = (0..count).map(|_| r.bytes()).collect();
        for (i, binary) in self.binaries.iter().enumerate() {
            // SAFETY: the caller's word.
            unsafe {
                binaries.add(i).write(binary.as_ptr());
                sizes.add(i).write(binary.len());
            }
        }
    }
}

impl Drop for ProcessLink {
    fn drop(&mut self) {
        if self.fault.is_none() {
            self.memory.send(MessageNote { kind: note::QUIT, begin: 0, end: 0 });
            let until = Instant::now() + self.deadline.unwrap_or(PATIENCE);
            let mut pause = Duration::from_micros(200);
            while Instant::now() < until {
                if !matches!(self.child.try_wait(), Ok(None)) {
                    break;
                }
                std::thread::sleep(pause);
                pause = (2 * pause).min(Duration::from_millis(10));
            }
        }
        self.kill();
    }
}
