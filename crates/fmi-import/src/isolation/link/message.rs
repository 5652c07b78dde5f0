//! Messages as they are in the ring of the shared memory.

use std::ffi::c_int;

use super::super::memory::SharedMemory;
use crate::error::FmiStatus;
use crate::log::Message;

/// The first message of what was in the ring, and the rest.
pub(super) fn first(bytes: &[u8]) -> Option<(Message, &[u8])> {
    let number = |at: usize| Some(u32::from_ne_bytes(bytes.get(at..at + 4)?.try_into().ok()?));
    let (category, text) = (12 + number(4)? as usize, number(8)? as usize);
    let read = |part: &[u8]| String::from_utf8_lossy(part).into_owned();
    let message = Message {
        status: FmiStatus::from(number(0)? as c_int),
        category: read(bytes.get(12..category)?),
        text: read(bytes.get(category..category.checked_add(text)?)?),
    };
    Some((message, &bytes[category + text..]))
}

/// A message for the ring.
pub(in super::super) fn said(message: &Message) -> Vec<u8> {
    let number: c_int = match message.status {
        FmiStatus::Ok => 0,
        FmiStatus::Warning => 1,
        FmiStatus::Discard => 2,
        FmiStatus::Error => 3,
        FmiStatus::Fatal => 4,
        FmiStatus::Pending => 5,
        FmiStatus::Unknown(number) => number,
    };
    let cut = |text: &str| text.as_bytes()[..text.len().min(SharedMemory::LONGEST)].to_vec();
    let (category, text) = (cut(&message.category), cut(&message.text));
    let head = [number as u32, category.len() as u32, text.len() as u32].map(u32::to_ne_bytes);
    [head.concat(), category, text].concat()
}
