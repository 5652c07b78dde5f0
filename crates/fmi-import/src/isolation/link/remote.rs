//! What an instance holds of its link.

#![allow(unsafe_code)] // the boundary of the process

use std::ffi::c_void;
use std::time::Duration;

use super::super::frame::Writer;
use super::{FREE, Fault, INSTANTIATE, Link};

impl Link {
    /// Makes an instance.
    ///
    /// # Safety
    /// As of [`Link::wait`].
    pub(in super::super) unsafe fn instantiate(link: *mut Self, write: impl FnOnce(&mut Writer<'_>)) -> bool {
        // SAFETY: the caller's word.
        unsafe {
            let mut w = (*link).entry(INSTANTIATE);
            write(&mut w);
            let (begin, end) = (w.begin, w.finish());
            let done = Self::wait(link, begin, 0, end);
            done.at.is_some() && done.status == 0
        }
    }

    /// Frees the instance.
    ///
    /// # Safety
    /// As of [`Link::wait`].
    pub(in super::super) unsafe fn free(link: *mut Self) {
        // SAFETY: the caller's word.
        unsafe {
            let w = (*link).entry(FREE);
            let (begin, end) = (w.begin, w.finish());
            let _ = Self::wait(link, begin, 0, end);
        }
    }
}

/// The handle of a link, of an instance.
pub(crate) struct Remote(*mut Link);

// SAFETY: one thread at a time uses an instance, and so its link.
unsafe impl Send for Remote {}

impl Remote {
    pub(in super::super) fn new(link: Link) -> Self {
        Self(Box::into_raw(Box::new(link)))
    }

    /// What the functions get as component.
    pub(crate) fn component(&self) -> *mut c_void {
        self.0.cast()
    }

    /// Frees the instance.
    pub(crate) fn free(&self) {
        // SAFETY: the link lives, and no call is under way.
        unsafe { Link::free(self.0) }
    }

    /// Never calls the instance again.
    pub(crate) fn abandon(&self) {
        // SAFETY: as above.
        unsafe { (*self.0).abandon() }
    }

    /// How long a call may take.
    pub(crate) fn deadline(&self) -> Option<Duration> {
        // SAFETY: as above.
        unsafe { (*self.0).deadline() }
    }

    /// Why there is no process any more.
    pub(crate) fn fault(&self) -> Option<Fault> {
        // SAFETY: as above.
        unsafe { (*self.0).fault().cloned() }
    }

    /// The function that a status is of, if it is not the one that returned it.
    pub(crate) fn blamed(&self) -> Option<&'static str> {
        // SAFETY: as above.
        unsafe { (*self.0).blamed() }
    }

    pub(in super::super) fn link(&self) -> *mut Link {
        self.0
    }
}

impl Drop for Remote {
    fn drop(&mut self) {
        // SAFETY: made by `new`, dropped once, and no call is under way.
        drop(unsafe { Box::from_raw(self.0) });
    }
}
