//! Memory that the master and the host of an FMU share, and whose turn it is to use it.
//!
//! One side writes, the other waits: for a moment in a loop, then asleep on a futex. Only messages of the FMU come out of
//! turn (threads of its own may log); they have a ring of their own and are there also when the host has crashed.

#![allow(unsafe_code)] // the boundary of the process

use std::ffi::c_void;
use std::io::Error as IoError;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering, fence};
use std::time::Duration;

use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, fcntl_get_seals, fstat, ftruncate, memfd_create};
use rustix::mm::{Advice, MapFlags, ProtFlags, madvise, mmap, munmap};
use rustix::thread::futex;

/// Whose turn it is.
pub(super) const MASTER: u32 = 0;
pub(super) const HOST: u32 = 1;

/// Looks at whose turn it is before falling asleep: a few microseconds, which is what falling asleep and waking up cost.
const LOOKS: u32 = 200;
/// Memories of this process as a master, each with a host.
static HOSTS: AtomicU32 = AtomicU32::new(0);

/// How often a host looks: where there is no core for each of them next to the master's, one that looks would keep the core from
/// the one whose turn it is.
fn looks_of_host(hosts: u32, cores: u32) -> u32 {
    if hosts < cores { LOOKS } else { 1 }
}
/// Bytes of the ring of messages.
const RING: usize = 1 << 16;
/// Where the ring begins; also where data begins behind it, in pages of any usual size.
const RING_AT: usize = 1 << 16;
const DATA_AT: usize = RING_AT + RING;
/// Data at first, in bytes.
const FIRST: usize = 1 << 16;
/// Data at most, in bytes.
const MOST: usize = 1 << 34;

/// The beginning of the memory. `turn` and `sleeping` are the handover, all else belongs to whose turn it is, but for the ring.
#[repr(C)]
struct ControlBlock {
    turn: AtomicU32,
    sleeping: [AtomicU32; 2],
    kind: AtomicU32,
    begin: AtomicU64,
    end: AtomicU64,
    size: AtomicU64,
    /// Number of the function that the host is in.
    current: AtomicU32,
    /// Messages that found no room.
    lost: AtomicU32,
    master: AtomicU32,
    /// How often the host looks at whose turn it is before it falls asleep.
    looks: AtomicU32,
    /// Bytes ever written to the ring, and read from it.
    written: AtomicU64,
    read: AtomicU64,
}

/// A message from one side to the other: its kind, and the part of the data that goes with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct MessageNote {
    pub(super) kind: u32,
    pub(super) begin: usize,
    pub(super) end: usize,
}

/// A mapped part of the file.
struct Mapping {
    address: *mut u8,
    length: usize,
}

impl Mapping {
    fn of(file: BorrowedFd<'_>, offset: usize, length: usize) -> Result<Self, IoError> {
        let (protection, flags) = (ProtFlags::READ | ProtFlags::WRITE, MapFlags::SHARED);
        // SAFETY: a new mapping at a place that the kernel chooses; the file never shrinks, it is sealed.
        let address = unsafe { mmap(std::ptr::null_mut(), length, protection, flags, file, offset as u64) }?;
        Ok(Self { address: address.cast(), length })
    }

    /// A process that the FMU forks would go on as a second host, and answer too: it has no such memory.
    fn of_this_process_alone(self) -> Result<Self, IoError> {
        // SAFETY: mapped by `of`; nothing changes for this process.
        unsafe { madvise(self.address.cast::<c_void>(), self.length, Advice::LinuxDontFork) }?;
        Ok(self)
    }
}

impl Drop for Mapping {
    fn drop(&mut self) {
        // SAFETY: mapped by `of`, and no one holds an address in it any more.
        let _ = unsafe { munmap(self.address.cast::<c_void>(), self.length) };
    }
}

/// One side's view of the memory.
pub(super) struct SharedMemory {
    file: OwnedFd,
    control: Mapping,
    data: Mapping,
    /// The FMU may be in the middle of a call with addresses in these.
    outgrown: Vec<Mapping>,
    me: u32,
    cores: u32,
}

// SAFETY: the addresses are valid on every thread; one thread at a time uses an instance.
unsafe impl Send for SharedMemory {}

impl Drop for SharedMemory {
    fn drop(&mut self) {
        if self.me == MASTER {
            HOSTS.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

fn broken() -> IoError {
    IoError::other("the shared memory is in disorder")
}

impl SharedMemory {
    /// Of the master.
    pub(super) fn new() -> Result<Self, IoError> {
        let file = memfd_create("trueup-fmu", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?;
        ftruncate(&file, (DATA_AT + FIRST) as u64)?;
        // Reading behind the end of a file that was made shorter would be a crash of the master.
        fcntl_add_seals(&file, SealFlags::SHRINK)?;
        let this = Self::map(file, MASTER, FIRST)?;
        this.control().size.store(FIRST as u64, Ordering::Relaxed);
        this.control().master.store(std::process::id(), Ordering::Relaxed);
        HOSTS.fetch_add(1, Ordering::Relaxed);
        Ok(this)
    }

    /// Of the host, which was given the file.
    ///
    /// # Errors
    /// The file is no such memory.
    pub(super) fn of_host(file: OwnedFd) -> Result<Self, IoError> {
        if !fcntl_get_seals(&file)?.contains(SealFlags::SHRINK) {
            return Err(broken());
        }
        Self::map(file, HOST, FIRST)
    }

    fn map(file: OwnedFd, me: u32, size: usize) -> Result<Self, IoError> {
        let map = |offset, length| Self::mapped(file.as_fd(), me, offset, length);
        let (control, data) = (map(0, DATA_AT)?, map(DATA_AT, size)?);
        let cores =
            std::thread::available_parallelism().map_or(2, |n| u32::try_from(n.get()).unwrap_or(u32::MAX));
        Ok(Self { file, control, data, outgrown: Vec::new(), me, cores })
    }

    fn mapped(file: BorrowedFd<'_>, me: u32, offset: usize, length: usize) -> Result<Mapping, IoError> {
        let mapping = Mapping::of(file, offset, length)?;
        if me == HOST { mapping.of_this_process_alone() } else { Ok(mapping) }
    }

    pub(super) fn file(&self) -> BorrowedFd<'_> {
        self.file.as_fd()
    }

    #[inline]
    fn control(&self) -> &ControlBlock {
        // SAFETY: mapped, aligned, and all of it atomic.
        unsafe { &*self.control.address.cast::<ControlBlock>() }
    }

    /// Process id of the master.
    pub(super) fn master(&self) -> u32 {
        self.control().master.load(Ordering::Relaxed)
    }

    /// The function that the host is in.
    pub(super) fn current(&self) -> u32 {
        self.control().current.load(Ordering::Relaxed)
    }

    pub(super) fn set_current(&self, function: u32) {
        self.control().current.store(function, Ordering::Relaxed);
    }

    /// Hands over.
    #[inline]
    pub(super) fn send(&self, note: MessageNote) {
        let (control, other) = (self.control(), 1 - self.me);
        control.kind.store(note.kind, Ordering::Relaxed);
        control.begin.store(note.begin as u64, Ordering::Relaxed);
        control.end.store(note.end as u64, Ordering::Relaxed);
        if self.me == MASTER {
            let looks = looks_of_host(HOSTS.load(Ordering::Relaxed), self.cores);
            control.looks.store(looks, Ordering::Relaxed);
        }
        control.turn.store(other, Ordering::Release);
        fence(Ordering::SeqCst); // the other one marks that it sleeps, then looks at the turn
        if control.sleeping[other as usize].load(Ordering::Relaxed) != 0 {
            let _ = futex::wake(&control.turn, futex::Flags::empty(), 1);
        }
    }

    /// Whether it is my turn now, after at most this time.
    #[inline]
    pub(super) fn wait(&self, longest: Duration) -> bool {
        let turn = &self.control().turn;
        let looks = match self.me {
            MASTER => looks_of_host(1, self.cores),
            _ => self.control().looks.load(Ordering::Relaxed),
        };
        for _ in 0..looks {
            if turn.load(Ordering::Acquire) == self.me {
                return true;
            }
            std::hint::spin_loop();
        }
        self.sleep(longest)
    }

    #[cold]
    fn sleep(&self, longest: Duration) -> bool {
        let control = self.control();
        let sleeping = &control.sleeping[self.me as usize];
        sleeping.store(1, Ordering::Relaxed);
        fence(Ordering::SeqCst);
        if control.turn.load(Ordering::Acquire) != self.me {
            let longest =
                futex::Timespec { tv_sec: longest.as_secs() as _, tv_nsec: longest.subsec_nanos().into() };
            // Woken, too late, or for nothing: what counts is whose turn it is.
            let _ = futex::wait(&control.turn, futex::Flags::empty(), 1 - self.me, Some(&longest));
        }
        sleeping.store(0, Ordering::Relaxed);
        control.turn.load(Ordering::Acquire) == self.me
    }

    /// What the other side has sent, in my turn.
    ///
    /// # Errors
    /// It makes no sense.
    #[inline]
    pub(super) fn receive(&mut self) -> Result<MessageNote, IoError> {
        let control = self.control();
        let number = |x: &AtomicU64| usize::try_from(x.load(Ordering::Relaxed)).unwrap_or(usize::MAX);
        let (size, begin, end) = (number(&control.size), number(&control.begin), number(&control.end));
        let kind = control.kind.load(Ordering::Relaxed);
        if size != self.data.length {
            self.grow_to(size)?;
        }
        if begin > end || end > size || begin % 8 != 0 {
            return Err(broken());
        }
        Ok(MessageNote { kind, begin, end })
    }

    /// Makes room for `end` bytes of data, in my turn.
    ///
    /// # Errors
    /// There is no such room.
    #[inline]
    pub(super) fn room(&mut self, end: usize) -> Result<(), IoError> {
        if end <= self.data.length { Ok(()) } else { self.enlarge(end) }
    }

    #[cold]
    fn enlarge(&mut self, end: usize) -> Result<(), IoError> {
        if end > MOST {
            return Err(IoError::other(format!("{end} bytes are too much for one call")));
        }
        let size = end.max(2 * self.data.length).next_multiple_of(FIRST).min(MOST);
        ftruncate(&self.file, (DATA_AT + size) as u64)?;
        self.grow_to(size)?;
        self.control().size.store(size as u64, Ordering::Relaxed);
        Ok(())
    }

    fn grow_to(&mut self, size: usize) -> Result<(), IoError> {
        let there = usize::try_from(fstat(&self.file)?.st_size).unwrap_or(0);
        if size <= self.data.length || size > MOST || there < DATA_AT + size {
            return Err(broken());
        }
        let data = Self::mapped(self.file.as_fd(), self.me, DATA_AT, size)?;
        self.outgrown.push(std::mem::replace(&mut self.data, data));
        Ok(())
    }

    /// Bytes of data.
    pub(super) fn size(&self) -> usize {
        self.data.length
    }

    /// Where data is; `offset` is within.
    #[inline]
    pub(super) fn at(&self, offset: usize) -> *mut u8 {
        debug_assert!(offset <= self.data.length, "the caller has made room");
        // SAFETY: within the mapping.
        unsafe { self.data.address.add(offset) }
    }

    /// Copies from data, as far as it goes.
    #[inline]
    pub(super) fn copy_out(&self, offset: usize, into: &mut [u8]) -> bool {
        let fits = offset.checked_add(into.len()).is_some_and(|end| end <= self.data.length);
        if fits {
            // SAFETY: within the mapping; the other process writes in its own turn only, and if it breaks that the bytes
            // are wrong ones, but bytes.
            unsafe { std::ptr::copy_nonoverlapping(self.at(offset), into.as_mut_ptr(), into.len()) };
        }
        fits
    }

    /// Copies to data, where there is room.
    #[inline]
    pub(super) fn copy_in(&self, offset: usize, from: &[u8]) {
        assert!(offset + from.len() <= self.data.length, "the caller has made room");
        // SAFETY: within the mapping.
        unsafe { std::ptr::copy_nonoverlapping(from.as_ptr(), self.at(offset), from.len()) };
    }

    /// A word of data; 0 behind its end.
    #[inline]
    pub(super) fn word(&self, offset: usize) -> u64 {
        let mut bytes = [0; 8];
        let _ = self.copy_out(offset, &mut bytes);
        u64::from_ne_bytes(bytes)
    }

    fn ring(&self, at: u64) -> *mut u8 {
        // SAFETY: within the mapping.
        unsafe { self.control.address.add(RING_AT + (at % RING as u64) as usize) }
    }

    /// Puts a message into the ring; only the host does, one thread at a time. `false`: it is full.
    pub(super) fn say(&self, message: &[u8]) -> bool {
        let control = self.control();
        let written = control.written.load(Ordering::Relaxed);
        let used = written - control.read.load(Ordering::Acquire);
        if used + message.len() as u64 > RING as u64 {
            return false;
        }
        for (i, byte) in message.iter().enumerate() {
            // SAFETY: within the ring.
            unsafe { self.ring(written + i as u64).write_volatile(*byte) };
        }
        control.written.store(written + message.len() as u64, Ordering::Release);
        true
    }

    /// Counts a message that found no room.
    pub(super) fn lose(&self) {
        self.control().lost.fetch_add(1, Ordering::Relaxed);
    }

    /// Messages that found no room since the last time.
    pub(super) fn lost(&self) -> u32 {
        if self.control().lost.load(Ordering::Relaxed) == 0 {
            return 0;
        }
        self.control().lost.swap(0, Ordering::Relaxed)
    }

    /// What is in the ring; only the master reads.
    #[inline]
    pub(super) fn heard(&self) -> Vec<u8> {
        let control = self.control();
        let read = control.read.load(Ordering::Relaxed);
        let written = control.written.load(Ordering::Acquire);
        if written == read {
            return Vec::new();
        }
        let length = written.wrapping_sub(read).min(RING as u64);
        // SAFETY: within the ring.
        let bytes = (0..length).map(|i| unsafe { self.ring(read.wrapping_add(i)).read_volatile() }).collect();
        control.read.store(written, Ordering::Release);
        bytes
    }

    /// The longest message that the ring takes.
    pub(super) const LONGEST: usize = RING / 4;
}

#[cfg(test)]
mod tests {
    use super::{LOOKS, looks_of_host};

    #[test]
    fn hosts_look_while_each_has_a_core_beside_the_masters() {
        assert_eq!([(1, 2), (3, 4), (7, 16)].map(|(hosts, cores)| looks_of_host(hosts, cores)), [LOOKS; 3]);
        assert_eq!(
            [(1, 1), (2, 2), (4, 4), (20, 16)].map(|(hosts, cores)| looks_of_host(hosts, cores)),
            [1; 4]
        );
    }
}
