//! Messages to the importer.

use crate::fault::CallStatus;
use std::ffi::CString;
use trueup_fmi::table::LOG_CATEGORIES;

/// The importer's callback: status, category, message.
pub type LogSink = Box<dyn Fn(CallStatus, &std::ffi::CStr, &std::ffi::CStr) + Send>;

/// Index into [`LOG_CATEGORIES`] of refused and failed calls.
pub const ERRORS: usize = 0;
/// Index of reservations.
pub const WARNINGS: usize = 1;
/// Index of located events.
pub const EVENTS: usize = 2;

/// Where messages go and which are requested. Without `loggingOn` nothing is sent, as both standards require.
#[derive(Default)]
pub struct MessageLog {
    enabled: [bool; LOG_CATEGORIES.len()],
    sink: Option<LogSink>,
    /// The last message, sent or not.
    pub last: String,
}

impl MessageLog {
    /// All categories on or off.
    pub fn new(sink: Option<LogSink>, on: bool) -> Self {
        Self { enabled: [on; LOG_CATEGORIES.len()], sink, last: String::new() }
    }
    /// Whether a message of that category would be sent; check before formatting what is not an error.
    pub fn wants(&self, category: usize) -> bool {
        self.sink.is_some() && self.enabled.get(category).copied().unwrap_or(false)
    }
    /// Sends a message if its category is on.
    pub fn say(&mut self, status: CallStatus, category: usize, message: String) {
        if self.wants(category) {
            let name = LOG_CATEGORIES.get(category).map_or("", |c| c.0);
            let text = |s: &str| CString::new(s.replace('\0', "?")).unwrap_or_default();
            if let Some(sink) = &self.sink {
                sink(status, &text(name), &text(&message));
            }
        }
        self.last = message;
    }
    /// Switches categories (all when none is named). An unknown name is refused, nothing is switched then.
    ///
    /// In FMI 2.0 the named categories alone are on afterwards; in FMI 3.0 the others stay as they are.
    pub fn switch(&mut self, on: bool, names: &[String], others_stay: bool) -> Result<(), String> {
        let find = |n: &String| LOG_CATEGORIES.iter().position(|c| c.0 == n).ok_or_else(|| n.clone());
        let chosen = names.iter().map(find).collect::<Result<Vec<_>, _>>()?;
        if chosen.is_empty() {
            self.enabled = [on; LOG_CATEGORIES.len()];
            return Ok(());
        }
        if !others_stay {
            self.enabled = [false; LOG_CATEGORIES.len()];
        }
        for i in chosen {
            self.enabled[i] = on;
        }
        Ok(())
    }
}
