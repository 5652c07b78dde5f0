//! FMUs of Model Exchange, integrated by the master.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod reference;

use std::sync::Arc;

use trueup_cosim::model_exchange::{Group, Integrator, Moment, Surroundings, TOLERANCE};
use trueup_cosim::{Block, Buffer, Error, Slave};
use trueup_fmi_import::{Experiment, Fmu, Options};

/// One FMU under way.
struct Single {
    slaves: Vec<Slave>,
    group: Group,
}

/// Times of events.
type Events = Vec<f64>;

impl Single {
    fn new(fmu: &Arc<Fmu>, integrator: Integrator, tolerance: f64) -> Self {
        let mut slave = Slave::model_exchange(fmu, Options::default()).unwrap();
        slave.enter_initialization_mode(Experiment::default()).unwrap();
        slave.exit_initialization_mode().unwrap();
        let mut slaves = vec![slave];
        let (group, _) = Group::start(&mut slaves, &[0], 0.0, false, integrator, tolerance, &mut ()).unwrap();
        Self { slaves, group }
    }

    /// Goes on to `time` and handles an event there too; `events` are given their times.
    fn to(&mut self, time: f64, around: &mut dyn Surroundings, events: &mut Events) -> Result<(), Error> {
        let mut observer = |_: &mut [Slave], time: f64, moment: Moment| {
            if moment == Moment::Before {
                events.push(time);
            }
            Ok(())
        };
        let reached = self.group.advance(&mut self.slaves, around, time, &mut observer)?;
        if reached.pending {
            self.group.settle(&mut self.slaves, around, &mut observer)?;
        }
        Ok(())
    }

    fn reals(&mut self, references: &[u32]) -> Vec<f64> {
        let mut block =
            Block { references: references.into(), values: Buffer::Float64(vec![0.0; references.len()]) };
        self.slaves[0].get(&mut block).unwrap();
        let Buffer::Float64(values) = block.values else { unreachable!() };
        values
    }
}
