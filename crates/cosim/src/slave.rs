//! One instance of an FMU, of either version of the standard and of either interface.

use std::sync::Arc;

use trueup_fmi_description::Version;
use trueup_fmi_import::{
    Error, Experiment, Fmu, Interface, Options, Prepared, StateId, Status, Step, fmi2, fmi3,
};

use crate::buffer::Blocks;
pub use crate::buffer::{Block, Buffer};

/// An instance of either version.
pub enum Slave {
    /// FMI 2.0.
    V2(Box<fmi2::Instance>),
    /// FMI 3.0.
    V3(fmi3::Instance),
}

/// Calls the same method of whichever version.
macro_rules! either {
    ($slave:expr, $instance:ident => $call:expr) => {
        match $slave {
            Slave::V2($instance) => $call,
            Slave::V3($instance) => $call,
        }
    };
}

/// Warnings of one FMU that are told.
const WARNINGS: usize = 3;
/// Categories of messages on what went wrong (FMI 2.0, section 2.2.4; FMI 3.0, section 2.4.5).
const REASONS: [&str; 4] = ["logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"];

impl Slave {
    /// Instantiates for Co-Simulation, without event mode and early return.
    ///
    /// # Errors
    /// The FMU does not offer it, or gives no instance.
    pub fn new(fmu: &Arc<Fmu>, options: Options) -> Result<Self, Error> {
        Self::co_simulation(fmu, options, fmi3::CoSimulation::default())
    }

    /// Instantiates for Co-Simulation; `how` is for FMI 3.0.
    ///
    /// # Errors
    /// As [`Slave::new`].
    pub fn co_simulation(fmu: &Arc<Fmu>, options: Options, how: fmi3::CoSimulation) -> Result<Self, Error> {
        Ok(match fmu.description().version {
            Version::V2 => Self::V2(Box::new(fmi2::Instance::new(fmu, Interface::CoSimulation, options)?)),
            Version::V3 => Self::V3(fmi3::Instance::co_simulation(fmu, options, how)?),
        })
    }

    /// Instantiates for Model Exchange.
    ///
    /// # Errors
    /// As [`Slave::new`].
    pub fn model_exchange(fmu: &Arc<Fmu>, options: Options) -> Result<Self, Error> {
        Ok(match fmu.description().version {
            Version::V2 => Self::V2(Box::new(fmi2::Instance::new(fmu, Interface::ModelExchange, options)?)),
            Version::V3 => Self::V3(fmi3::Instance::model_exchange(fmu, options)?),
        })
    }

    /// Asks for messages on what the FMU refuses, where it offers them by the names of the standard: without them an error has
    /// no reason. Other messages may be many.
    pub fn ask_for_reasons(&mut self, offered: &[(String, String)]) {
        let names = offered.iter().map(|c| c.0.as_str()).filter(|name| REASONS.contains(name));
        let names: Vec<&str> = names.collect();
        if !names.is_empty() {
            // An FMU that does not give them runs as well.
            let _ = either!(self, i => i.set_debug_logging(true, &names));
        }
    }

    /// Name of the instance.
    pub fn name(&self) -> &str {
        either!(self, i => i.name())
    }

    /// The instance's last messages.
    pub fn log(&self) -> Vec<String> {
        let messages = either!(self, i => i.log());
        messages.iter().rev().take(10).rev().map(ToString::to_string).collect()
    }

    /// What the FMU has warned of, each thing once, the first ones.
    pub fn warnings(&self) -> Vec<String> {
        let mut texts: Vec<String> = Vec::new();
        for message in either!(self, i => i.log()).into_iter().filter(|m| m.status == Status::Warning) {
            if texts.len() < WARNINGS && !texts.contains(&message.text) {
                texts.push(message.text);
            }
        }
        texts
    }

    /// Sets structural parameters (FMI 3.0), in configuration mode.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn configure(&mut self, structural: &[Block]) -> Result<(), Error> {
        if let (Self::V3(i), false) = (&mut *self, structural.is_empty()) {
            i.enter_configuration_mode()?;
            structural.iter().try_for_each(|block| i.set(block))?;
            i.exit_configuration_mode()?;
        }
        Ok(())
    }

    /// Enters initialization mode.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn enter_initialization_mode(&mut self, experiment: Experiment) -> Result<(), Error> {
        either!(self, i => i.enter_initialization_mode(experiment))
    }

    /// Leaves it.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn exit_initialization_mode(&mut self) -> Result<(), Error> {
        either!(self, i => i.exit_initialization_mode())
    }

    /// Steps from `time` by `step` s; `None`: the whole step was made and nothing is to be told.
    ///
    /// # Errors
    /// Whatever the FMU returns, but for Discard.
    #[inline]
    pub fn step(&mut self, time: f64, step: f64, no_rollback: bool) -> Result<Option<Box<Step>>, Box<Error>> {
        either!(self, i => i.step(time, step, no_rollback))
    }

    /// Ends the run.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn terminate(&mut self) -> Result<(), Error> {
        either!(self, i => i.terminate())
    }

    /// Reads a block.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn get(&mut self, block: &mut Block) -> Result<(), Error> {
        match self {
            Self::V2(i) => i.as_mut().get(block),
            Self::V3(i) => i.get(block),
        }
    }

    /// Sets a block.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn set(&mut self, block: &Block) -> Result<(), Error> {
        match self {
            Self::V2(i) => i.as_mut().set(block),
            Self::V3(i) => i.set(block),
        }
    }

    /// A block of `Float64` (`Real`) to be read or written again and again: such a call costs the FMU's function and
    /// its checks.
    ///
    /// # Errors
    /// Sizes of arrays cannot be had.
    pub fn prepare(&mut self, references: &[u32]) -> Result<Prepared, Error> {
        either!(self, i => i.prepare(references))
    }

    /// Reads a prepared block.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    #[inline]
    pub fn read(&mut self, block: &Prepared, values: &mut [f64]) -> Result<(), Box<Error>> {
        either!(self, i => i.read(block, values))
    }

    /// Sets a prepared block.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    #[inline]
    pub fn write(&mut self, block: &Prepared, values: &[f64]) -> Result<(), Box<Error>> {
        either!(self, i => i.write(block, values))
    }

    /// Stores the state, in place of `slot`'s if there is one.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn save(&mut self, slot: &mut Option<StateId>) -> Result<(), Error> {
        match slot {
            Some(id) => either!(self, i => i.save_over(id)),
            None => {
                *slot = Some(either!(self, i => i.save())?);
                Ok(())
            }
        }
    }

    /// Goes back to a stored state.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn restore(&mut self, id: &StateId) -> Result<(), Error> {
        either!(self, i => i.restore(id))
    }

    /// First derivatives of `Float64` inputs with respect to time, for the next step (FMI 2.0).
    ///
    /// # Errors
    /// Whatever the FMU returns; FMI 3.0 has no such function.
    pub fn set_input_derivatives(
        &mut self,
        references: &[u32],
        ones: &[i32],
        slopes: &[f64],
    ) -> Result<(), Error> {
        match self {
            Self::V2(i) => i.set_input_derivatives(references, ones, slopes),
            Self::V3(i) => Err(Error::NotSupported {
                function: "fmi2SetRealInputDerivatives",
                instance: i.name().into(),
            }),
        }
    }

    /// Partial derivatives of `unknowns` with respect to `knowns` (value references), times `seed`.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    pub fn directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        result: &mut [f64],
    ) -> Result<(), Error> {
        match self {
            Self::V2(i) => i.directional_derivative(unknowns, knowns, seed, result),
            Self::V3(i) => i.directional_derivative(fmi3::DerivativeOf { unknowns, knowns }, seed, result),
        }
    }
}
