//! What an instance holds of its link.

#![allow(unsafe_code)] // the boundary of the process

use std::ffi::c_void;
use std::time::Duration;

use super::super::frame::FrameWriter;
use super::{FREE, HostFault, INSTANTIATE, ProcessLink};

impl ProcessLink {
    /// Makes an instance.
    ///
    /// # Safety
    /// As of [`ProcessLink::wait`].
    pub(in super::super) unsafe fn instantiate(
        link: *mut Self,
        write: impl FnOnce(&mut FrameWriter<'_>),
    ) -> bool {
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
    /// As of [`ProcessLink::wait`].
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
pub(crate) struct RemoteInstance(*mut ProcessLink);

// SAFETY: one thread at a time uses an instance, and so its link.
unsafe impl Send for RemoteInstance {}

impl RemoteInstance {
    pub(in super::super) fn new(link: ProcessLink) -> Self {
        Self(Box::into_raw(Box::new(link)))
    }

    /// What the functions get as component.
    pub(crate) fn component(&self) -> *mut c_void {
        self.0.cast()
    }

    /// Frees the instance.
    pub(crate) fn free(&self) {
        // SAFETY: the link lives, and no call is under way.
        unsafe { ProcessLink::free(self.0) }
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
    pub(crate) fn fault(&self) -> Option<HostFault> {
        // SAFETY: as above.
        unsafe { (*self.0).fault().cloned() }
    }

    /// The function that a status is of, if it is not the one that returned it.
    pub(crate) fn blamed(&self) -> Option<&'static str> {
        // SAFETY: as above.
        unsafe { (*self.0).blamed() }
    }

    pub(in super::super) fn link(&self) -> *mut ProcessLink {
        self.0
    }
}

impl Drop for RemoteInstance {
    fn drop(&mut self) {
        // SAFETY: made by `new`, dropped once, and no call is under way.
        drop(unsafe { Box::from_raw(self.0) });
    }
}
