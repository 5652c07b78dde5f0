//! What is read after each step goes with the next step, and its answers are there when they are requested.
//!
//! The FMU sees the calls in the order in which they are made without; only where a run changes what it reads, an
//! FMU is called once for what is no longer needed.

use std::ffi::c_int;
use std::io::Error as IoError;

use super::super::frame::{AFTER, HEAD, NOT_RUN, status_of};
use super::super::memory::SharedMemory;

/// Entries kept at most, and bytes of one.
const MOST: usize = 16;
const LARGEST: usize = 1 << 14;

/// Entries with what they were answered last.
#[derive(Default)]
pub(super) struct PrefetchedQueries {
    entries: Vec<PrefetchedEntry>,
    /// Of these the first were answered with the last step.
    answered: usize,
    /// And of these the first were requested.
    asked: usize,
    /// Nothing but questions came since the last step.
    open: bool,
}

struct PrefetchedEntry {
    bytes: Vec<u8>,
    /// Behind the question.
    question: usize,
}

fn word(bytes: &[u8], at: usize) -> u64 {
    bytes.get(at..at + 8).and_then(|b| b.try_into().ok()).map_or(0, u64::from_ne_bytes)
}

impl PrefetchedQueries {
    /// Something else was called: what is answered holds no more.
    #[inline]
    pub(super) fn close(&mut self) {
        if self.open {
            self.open = false;
            self.entries.truncate(self.asked);
            (self.answered, self.asked) = (0, 0);
        }
    }

    /// Puts the entries behind the step, which ends at `end`; where they end.
    pub(super) fn append(&mut self, memory: &mut SharedMemory, end: usize) -> Result<usize, IoError> {
        self.close();
        let mut at = end;
        for entry in &mut self.entries {
            let number = word(&entry.bytes, 0) & 0xffff_ffff | AFTER;
            entry.bytes[..8].copy_from_slice(&number.to_ne_bytes());
            entry.bytes[16..HEAD].copy_from_slice(&NOT_RUN.to_ne_bytes());
            memory.room(at + entry.bytes.len())?;
            memory.copy_in(at, &entry.bytes);
            at += entry.bytes.len();
        }
        Ok(at)
    }

    /// Takes the answers, which follow `at`.
    pub(super) fn open(&mut self, memory: &SharedMemory, mut at: usize, good: bool) {
        (self.answered, self.asked, self.open) = (0, 0, true);
        for entry in self.entries.iter_mut().take_while(|_| good) {
            let length = entry.bytes.len();
            if status_of(memory.word(at + 16)).is_none() || !memory.copy_out(at, &mut entry.bytes) {
                break;
            }
            at += length;
            self.answered += 1;
        }
    }

    /// The answer to the question from `begin`, put in its place.
    pub(super) fn answer(
        &mut self,
        memory: &SharedMemory,
        begin: usize,
        question: usize,
        end: usize,
    ) -> Option<c_int> {
        let entry = self.entries.get_mut(self.asked).filter(|_| self.open && self.asked < self.answered)?;
        if end - begin != entry.bytes.len() || question - begin != entry.question {
            return None;
        }
        // In pieces, so that nothing is allocated.
        let mut piece = [0; 256];
        let mut at = HEAD;
        while at < entry.question {
            let n = piece.len().min(entry.question - at);
            memory.copy_out(begin + at, &mut piece[..n]);
            if piece[..n] != entry.bytes[at..at + n] {
                return None;
            }
            at += n;
        }
        if word(&entry.bytes, 0) & 0xffff_ffff != memory.word(begin) & 0xffff_ffff {
            return None;
        }
        memory.copy_in(begin, &entry.bytes);
        self.asked += 1;
        status_of(word(&entry.bytes, 16))
    }

    /// A question that was not foreseen.
    pub(super) fn learn(&mut self, memory: &SharedMemory, begin: usize, question: usize, end: usize) {
        if !self.open {
            return;
        }
        self.entries.truncate(self.asked);
        if self.asked == MOST || end - begin > LARGEST {
            return self.close();
        }
        let mut bytes = vec![0; end - begin];
        memory.copy_out(begin, &mut bytes);
        self.entries.push(PrefetchedEntry { bytes, question: question - begin });
        self.asked += 1;
        self.answered = self.asked;
    }
}
