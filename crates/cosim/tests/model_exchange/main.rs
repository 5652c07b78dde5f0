//! FMUs of Model Exchange, integrated by the master.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]

mod reference;

use std::sync::Arc;

use trueup_cosim::model_exchange::{Group, Integrator, Settings, Surroundings, TOLERANCE};
use trueup_cosim::node::Node;
use trueup_cosim::plan::Planned;
use trueup_cosim::system::Interface;
use trueup_cosim::{Block, Buffer, Error};
use trueup_fmi_import::{Experiment, Fmu, fmi3};

/// One FMU under way.
struct Single {
    nodes: Vec<Node>,
    group: Group,
}

impl Single {
    fn new(fmu: &Arc<Fmu>, integrator: Integrator, tolerance: f64) -> Self {
        let planned = Planned {
            name: "model".into(),
            fmu: Arc::clone(fmu),
            interface: Interface::ModelExchange,
            structural: Vec::new(),
            resized: None,
            start: Vec::new(),
            every: 1,
        };
        let mut node = Node::new(planned, fmi3::CoSimulation::default()).unwrap();
        node.slave.enter_initialization_mode(Experiment::default()).unwrap();
        node.slave.exit_initialization_mode().unwrap();
        let mut nodes = vec![node];
        let settings = Settings { integrator, tolerance, ..Settings::default() };
        let (group, _) = Group::start(&mut nodes, &[0], 0.0, settings, &mut ()).unwrap();
        Self { nodes, group }
    }

    /// Goes on to `time` and handles an event there too; `events` are given their times.
    fn to(&mut self, time: f64, around: &mut dyn Surroundings, events: &mut Vec<f64>) -> Result<(), Error> {
        loop {
            let reached = self.group.advance(&mut self.nodes, around, time, true)?;
            if !reached.event {
                return Ok(());
            }
            events.push(self.group.time());
            self.group.settle(&mut self.nodes, around)?;
        }
    }

    fn reals(&mut self, references: &[u32]) -> Vec<f64> {
        let mut block =
            Block { references: references.into(), values: Buffer::Float64(vec![0.0; references.len()]) };
        self.nodes[0].slave.get(&mut block).unwrap();
        let Buffer::Float64(values) = block.values else { unreachable!() };
        values
    }
}
