//! Ctrl-C while Python's lock is released.

use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::{Duration, Instant};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use trueup_cosim::{CosimError, ResultColumn, ResultRow, ResultSink};

/// Between two looks: well below the 0.2 s after which a run that was interrupted has ended.
pub(crate) const LOOK: Duration = Duration::from_millis(50);

/// Hands rows on, and ends the run at the first one after Python was requested to stop.
pub(crate) struct WatchedWork<S> {
    /// What takes the rows.
    pub(crate) sink: S,
    looked: Instant,
    /// What Python's handler raised.
    pub(crate) raised: Option<PyErr>,
}

impl<S> WatchedWork<S> {
    pub(crate) fn new(sink: S) -> Self {
        Self { sink, looked: Instant::now(), raised: None }
    }
}

impl<S: ResultSink> ResultSink for WatchedWork<S> {
    fn begin(&mut self, columns: &[ResultColumn]) -> Result<(), CosimError> {
        self.sink.begin(columns)
    }

    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError> {
        if self.looked.elapsed() >= LOOK {
            self.looked = Instant::now();
            if let Err(raised) = Python::attach(|py| py.check_signals()) {
                self.raised = Some(raised);
                return Err(CosimError::Interrupted { time: row.time });
            }
        }
        self.sink.row(row)
    }
}

/// What long work reports to the thread that waits for it.
enum WorkMessage<R> {
    /// How far it is (0 to 1; `nan`: not known), and what is being done.
    Reached(f64, String),
    Done(R),
}

/// Reports the progress of long work, and ends it where no one waits any more.
pub(crate) type ProgressSender<'a> = &'a (dyn Fn(f64, &str) + Sync);

/// The stack of the thread that works, bytes: as much as a program's main thread has.
const STACK: usize = 8 << 20;

/// Long work in a thread of its own, so that the caller's can follow Ctrl-C meanwhile. Where the caller leaves, the work ends
/// at the next word on how far it is. `progress` is called with that word.
pub(crate) fn watched<R: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(ProgressSender<'_>) -> R + Send + 'static,
) -> PyResult<R> {
    let (say, mut heard) = mpsc::channel();
    let works = move || {
        let tell = |part: f64, what: &str| {
            if say.send(WorkMessage::Reached(part, what.to_owned())).is_err() {
                // The one way out of the middle of it; no one waits for a report.
                std::panic::resume_unwind(Box::new("no one waits"));
            }
        };
        let done = work(&tell);
        let _ = say.send(WorkMessage::Done(done)); // no one may wait any more
    };
    std::thread::Builder::new().stack_size(STACK).spawn(works)?;
    loop {
        let listening = &mut heard;
        match py.detach(move || listening.recv_timeout(LOOK)) {
            Ok(WorkMessage::Done(done)) => return Ok(done),
            Ok(WorkMessage::Reached(part, what)) => {
                if let Some(progress) = progress {
                    progress.call1(py, (part, what))?;
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => {
                let what = "the work ended without a result, which is a mistake of this package; its messages above show the place";
                return Err(PyRuntimeError::new_err(what));
            }
        }
        py.check_signals()?;
    }
}
