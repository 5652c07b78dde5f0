//! The layout of calls in the shared memory.
//!
//! A frame is a row of entries; an entry is one call: number of the function with flags, length in bytes, status, then the
//! arguments in the order of the C function, each aligned to 8 bytes. An array is its length and its elements; where the FMU
//! writes, its values before the call are in place, and those after it as soon as it has returned. Texts and binaries that the FMU
//! gives follow behind the entry.

#![allow(unsafe_code)] // the boundary of the process

use std::ffi::{CStr, CString, c_char, c_int, c_void};
use std::io::Error as IoError;

use super::memory::SharedMemory;

/// Kinds of notes.
pub(super) mod note {
    /// To the host: load the library.
    pub(in super::super) const OPEN: u32 = 1;
    /// To the host: run a frame.
    pub(in super::super) const CALL: u32 = 2;
    /// To the master: it is done.
    pub(in super::super) const REPLY: u32 = 3;
    /// To the master, amid a call: an intermediate update.
    pub(in super::super) const CALLBACK: u32 = 4;
    /// To the host: it is done.
    pub(in super::super) const ANSWER: u32 = 5;
    /// To the master, amid a call: the ring of messages is full.
    pub(in super::super) const FULL: u32 = 6;
    /// To the host: it is read.
    pub(in super::super) const READ: u32 = 7;
    /// To the host: end.
    pub(in super::super) const QUIT: u32 = 8;
}

/// Bytes before the arguments.
pub(super) const HEAD: usize = 24;
/// In the first word: the entry goes before the call that is waited for, or after it.
pub(super) const BEFORE: u64 = 1 << 32;
pub(super) const AFTER: u64 = 2 << 32;
/// Status of an entry that was not run.
pub(super) const NOT_RUN: u64 = 1 << 40;

/// The next place for an argument.
pub(super) fn aligned(at: usize) -> usize {
    at.next_multiple_of(8)
}

/// What can be in memory and be passed on as it is.
pub(super) trait PlainValue: Copy {
    fn word(self) -> u64;
    fn from_word(word: u64) -> Self;
}

macro_rules! plain {
    ($($type:ty)*) => {
        $(impl PlainValue for $type {
            fn word(self) -> u64 {
                self as u64
            }
            fn from_word(word: u64) -> Self {
                word as Self
            }
        })*
    };
}
plain! { u8 u32 i32 u64 usize *mut c_void }

impl PlainValue for f64 {
    fn word(self) -> u64 {
        self.to_bits()
    }
    fn from_word(word: u64) -> Self {
        Self::from_bits(word)
    }
}

/// An entry that is being written.
pub(super) struct FrameWriter<'a> {
    memory: &'a mut SharedMemory,
    pub(super) begin: usize,
    at: usize,
    /// Behind what the FMU only reads, up to what it writes first.
    pub(super) question: usize,
    failed: Option<IoError>,
}

impl<'a> FrameWriter<'a> {
    pub(super) fn new(memory: &'a mut SharedMemory, begin: usize, number: u64) -> Self {
        let mut this = Self { memory, begin, at: begin, question: 0, failed: None };
        this.word(number);
        this.word(0);
        this.word(NOT_RUN);
        this
    }

    fn room(&mut self, bytes: usize) -> bool {
        if self.failed.is_none() {
            self.failed = self.memory.room(aligned(self.at.saturating_add(bytes))).err();
        }
        self.failed.is_none()
    }

    pub(super) fn word(&mut self, word: u64) {
        if self.room(8) {
            self.memory.copy_in(self.at, &word.to_ne_bytes());
            self.at += 8;
        }
    }

    pub(super) fn value<T: PlainValue>(&mut self, value: T) {
        self.word(value.word());
    }

    /// # Safety
    /// `count` elements are there, if any.
    pub(super) unsafe fn array<T>(&mut self, elements: *const T, count: usize) {
        let bytes = count.saturating_mul(size_of::<T>());
        if self.room(bytes.saturating_add(8)) {
            self.word(count as u64);
            if count > 0 {
                // SAFETY: the caller's word, and there is room.
                unsafe { std::ptr::copy_nonoverlapping(elements.cast(), self.memory.at(self.at), bytes) };
            }
            self.at = aligned(self.at + bytes);
        }
    }

    /// # Safety
    /// As [`FrameWriter::array`].
    pub(super) unsafe fn written<T>(&mut self, elements: *mut T, count: usize) {
        if self.question == 0 {
            self.question = self.at + 8;
        }
        // SAFETY: the caller's word.
        unsafe { self.array(elements.cast_const(), count) };
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        // SAFETY: a slice.
        unsafe { self.array(bytes.as_ptr(), bytes.len()) };
    }

    /// # Safety
    /// NULL or a null-terminated text.
    pub(super) unsafe fn text(&mut self, text: *const c_char) {
        match text.is_null() {
            true => self.bytes(&[]),
            // SAFETY: the caller's word.
            false => self.bytes(unsafe { CStr::from_ptr(text) }.to_bytes_with_nul()),
        }
    }

    /// # Safety
    /// `count` texts.
    pub(super) unsafe fn texts(&mut self, texts: *const *const c_char, count: usize) {
        self.word(count as u64);
        // SAFETY: the caller's word.
        (0..count).for_each(|i| unsafe { self.text(*texts.add(i)) });
    }

    /// # Safety
    /// `count` binaries with their sizes.
    pub(super) unsafe fn binaries(&mut self, binaries: *const *const u8, sizes: *const usize, count: usize) {
        self.word(count as u64);
        // SAFETY: the caller's word.
        (0..count).for_each(|i| unsafe { self.array(*binaries.add(i), *sizes.add(i)) });
    }

    /// The end of the entry.
    pub(super) fn finish(self) -> Result<usize, IoError> {
        if let Some(error) = self.failed {
            return Err(error);
        }
        self.memory.copy_in(self.begin + 8, &((self.at - self.begin) as u64).to_ne_bytes());
        Ok(self.at)
    }
}

/// What the master reads of an entry that was run.
pub(super) struct FrameReader<'a> {
    memory: &'a SharedMemory,
    at: usize,
}

impl<'a> FrameReader<'a> {
    pub(super) fn new(memory: &'a SharedMemory, at: usize) -> Self {
        Self { memory, at }
    }

    pub(super) fn word(&mut self) -> u64 {
        self.at += 8;
        self.memory.word(self.at - 8)
    }

    /// Over an array of known size.
    pub(super) fn skip<T>(&mut self, count: usize) {
        self.at = aligned(self.at.saturating_add(8).saturating_add(count.saturating_mul(size_of::<T>())));
    }

    /// # Safety
    /// There is room for `count` elements, of a type that any bits are a value of.
    pub(super) unsafe fn written<T>(&mut self, elements: *mut T, count: usize) {
        if count > 0 {
            // SAFETY: the caller's word.
            let into =
                unsafe { std::slice::from_raw_parts_mut(elements.cast::<u8>(), count * size_of::<T>()) };
            let _ = self.memory.copy_out(self.at + 8, into);
        }
        self.skip::<T>(count);
    }

    /// Bytes of a length that the host gives.
    pub(super) fn bytes(&mut self) -> Vec<u8> {
        let length = usize::try_from(self.word()).unwrap_or(usize::MAX).min(self.memory.size());
        let mut bytes = vec![0; length];
        if !self.memory.copy_out(self.at, &mut bytes) {
            bytes.clear();
        }
        self.at = aligned(self.at + length);
        bytes
    }

    /// A text; `None`: NULL.
    pub(super) fn text(&mut self) -> Option<CString> {
        let mut bytes = self.bytes();
        bytes.pop()?;
        bytes.retain(|b| *b != 0);
        CString::new(bytes).ok()
    }
}

/// Arguments in the memory as the host hands them to the FMU. It trusts the master.
pub(super) struct Arguments {
    memory: *mut SharedMemory,
    at: usize,
    /// Where texts and binaries go.
    pub(super) end: usize,
}

/// # Safety
/// (of all) What is there was written by the master for this function; the memory lives and no one uses it elsewhere.
impl Arguments {
    pub(super) unsafe fn new(memory: *mut SharedMemory, begin: usize, end: usize) -> Self {
        Self { memory, at: begin + HEAD, end }
    }

    pub(super) unsafe fn word(&mut self) -> u64 {
        self.at += 8;
        // SAFETY: the caller's word.
        unsafe { (*self.memory).word(self.at - 8) }
    }

    pub(super) unsafe fn value<T: PlainValue>(&mut self) -> T {
        // SAFETY: the caller's word.
        T::from_word(unsafe { self.word() })
    }

    pub(super) unsafe fn array<T>(&mut self) -> *mut T {
        // SAFETY: the caller's word.
        unsafe {
            let count = self.word() as usize;
            let elements = (*self.memory).at(self.at);
            self.at = aligned(self.at + count * size_of::<T>());
            elements.cast()
        }
    }

    /// Of elements that are `unwritten` as long as the FMU does not write them.
    pub(super) unsafe fn read<T: Copy>(&mut self, unwritten: T) -> *mut T {
        // SAFETY: the caller's word.
        unsafe {
            let count = self.word() as usize;
            self.at -= 8;
            let elements = self.array();
            std::slice::from_raw_parts_mut(elements, count).fill(unwritten);
            elements
        }
    }

    pub(super) unsafe fn text(&mut self) -> *const c_char {
        // SAFETY: the caller's word.
        unsafe {
            let there = (*self.memory).word(self.at) != 0;
            let text = self.array();
            if there { text } else { std::ptr::null() }
        }
    }

    pub(super) unsafe fn texts(&mut self) -> Vec<*const c_char> {
        // SAFETY: the caller's word.
        unsafe { (0..self.word()).map(|_| self.text()).collect() }
    }

    pub(super) unsafe fn binaries(&mut self) -> Vec<*const u8> {
        // SAFETY: the caller's word.
        unsafe { (0..self.word()).map(|_| self.array::<u8>().cast_const()).collect() }
    }

    /// NULL for each binary or text that the FMU shall give.
    pub(super) unsafe fn places<T>(&mut self) -> Vec<*const T> {
        // SAFETY: the caller's word.
        vec![std::ptr::null(); unsafe { self.word() } as usize]
    }

    /// What the FMU gave, behind the entry.
    pub(super) unsafe fn give(&mut self, bytes: &[u8]) {
        // SAFETY: the caller's word.
        let memory = unsafe { &mut *self.memory };
        let end = aligned(self.end + 8 + bytes.len());
        if memory.room(end).is_err() {
            return; // the master finds nothing where it looks
        }
        memory.copy_in(self.end, &(bytes.len() as u64).to_ne_bytes());
        memory.copy_in(self.end + 8, bytes);
        self.end = end;
    }

    pub(super) unsafe fn give_texts(&mut self, texts: &[*const c_char]) {
        for text in texts {
            // SAFETY: NULL or null-terminated.
            let bytes: &[u8] =
                if text.is_null() { &[] } else { unsafe { CStr::from_ptr(*text) }.to_bytes_with_nul() };
            // SAFETY: the caller's word.
            unsafe { self.give(bytes) };
        }
    }

    pub(super) unsafe fn give_binaries(&mut self, binaries: &[*const u8], sizes: *const usize) {
        for (i, binary) in binaries.iter().enumerate() {
            // SAFETY: NULL, or of the size that the FMU gave.
            let bytes: &[u8] = match binary.is_null() {
                true => &[],
                false => unsafe { std::slice::from_raw_parts(*binary, *sizes.add(i)) },
            };
            // SAFETY: the caller's word.
            unsafe { self.give(bytes) };
        }
    }
}

/// A status as it is in an entry.
pub(super) fn status_word(status: c_int) -> u64 {
    u64::from(status as u32)
}

pub(super) fn status_of(word: u64) -> Option<c_int> {
    (word != NOT_RUN).then_some(word as u32 as c_int)
}
