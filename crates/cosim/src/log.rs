//! What a run did.

use crate::adaptive::Adapted;
use crate::calls::FmuCalls;
use crate::exchange::LoopLog;
use crate::system::Algorithm;

/// What a run did and why.
#[derive(Clone, Debug, PartialEq)]
pub struct RunLog {
    /// How the components were coupled.
    pub algorithm: Algorithm,
    /// Why that.
    pub reason: String,
    /// What was chosen or converted before.
    pub notes: Vec<String>,
    /// Time reached in s.
    pub time: f64,
    /// Communication steps.
    pub steps: u64,
    /// Communication steps that were rolled back and made shorter.
    pub rejected: u64,
    /// Steps that an FMU refused at their full length.
    pub discarded: u64,
    /// Repetitions of steps, all together (iterative, adaptive).
    pub iterations: u64,
    /// Events.
    pub events: u64,
    /// Algebraic loops while stepping.
    pub loops: Vec<LoopLog>,
    /// Algebraic loops at initialization.
    pub initial_loops: Vec<LoopLog>,
    /// Calls of doStep, of each FMU in Co-Simulation.
    pub calls: Vec<FmuCalls>,
    /// What the adaptive algorithm did.
    pub adapted: Option<Adapted>,
    /// The FMU that ended the run before its stop time.
    pub terminated_by: Option<String>,
}

impl RunLog {
    pub(crate) fn new(algorithm: Algorithm, reason: String, notes: Vec<String>, time: f64) -> Self {
        Self {
            algorithm,
            reason,
            notes,
            time,
            steps: 0,
            rejected: 0,
            discarded: 0,
            iterations: 0,
            events: 0,
            loops: Vec::new(),
            initial_loops: Vec::new(),
            calls: Vec::new(),
            adapted: None,
            terminated_by: None,
        }
    }
}
