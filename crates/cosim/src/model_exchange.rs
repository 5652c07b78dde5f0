//! FMUs of Model Exchange in a system: [`StepperGroup`] gives [`integration`](trueup_fmi_import::integration) the nodes of the system
//! and what sets their inputs.

mod linear;

use trueup_fmi_description::description::Description;
pub use trueup_fmi_import::integration::{
    EventSettled, IntegrationReached, IntegrationSettings, Integrator, Statistics, TOLERANCE,
};
use trueup_fmi_import::integration::{Failure, Fmus, IntegratedGroup as Integration};
use trueup_fmi_import::{AnyInstance, ImportError as FmuError, integration};

pub use self::linear::{Linear, OperatingPoint};
use crate::buffer::{BlockAccess, VariableBlock};
use crate::error::CosimError;
use crate::node::InstanceNode;

/// What acts on the FMUs of a group, and what they do to each other.
pub trait GroupSurroundings {
    /// Sets the inputs at `time` (s), those that come from other FMUs of the group in the order of dependency. In
    /// `event` mode discrete inputs are set too, else continuous ones only.
    ///
    /// # Errors
    /// Whatever an FMU returns.
    fn exchange(&mut self, nodes: &mut [InstanceNode], time: f64, event: bool) -> Result<(), CosimError>;
}

/// Nothing is connected.
impl GroupSurroundings for () {
    fn exchange(&mut self, _: &mut [InstanceNode], _: f64, _: bool) -> Result<(), CosimError> {
        Ok(())
    }
}

/// Nodes of a system that are integrated together.
pub struct StepperGroup {
    members: Vec<usize>,
    /// Inputs whose change is an event, if it happens in event mode: node and variables of one type.
    inputs: Vec<(usize, VariableBlock)>,
    integration: Integration,
}

/// What a group remembers in addition to the states of its FMUs.
#[derive(Clone, Debug)]
pub struct GroupSnapshot {
    integration: integration::IntegrationSnapshot,
    inputs: Vec<(usize, VariableBlock)>,
}

/// The members of a group while it works.
struct Members<'a> {
    nodes: &'a mut [InstanceNode],
    members: &'a [usize],
    inputs: &'a mut [(usize, VariableBlock)],
    around: &'a mut dyn GroupSurroundings,
}

impl Fmus for Members<'_> {
    type Error = CosimError;

    fn count(&self) -> usize {
        self.members.len()
    }
    fn instance(&mut self, member: usize) -> &mut AnyInstance {
        &mut self.nodes[self.members[member]].slave
    }
    fn description(&self, member: usize) -> &Description {
        self.nodes[self.members[member]].description()
    }
    fn exchange(&mut self, time: f64, event: bool) -> Result<(), CosimError> {
        self.around.exchange(self.nodes, time, event)
    }
    fn inputs_changed(&mut self) -> Result<bool, FmuError> {
        let mut changed = false;
        for (node, block) in &mut *self.inputs {
            changed |= self.nodes[*node].slave.get_changed(block)?;
        }
        Ok(changed)
    }
}

impl From<Failure<Self>> for CosimError {
    fn from(failure: Failure<Self>) -> Self {
        match failure {
            Failure::Exchange(error) => error,
            Failure::Call { time, source } => Self::Call { time, source },
            Failure::Interrupted { time } => Self::Interrupted { time },
            Failure::NotFinite { time, instance, variable, value, log } => {
                Self::NotFinite { time, instance, variable, value, log }
            }
            Failure::Stuck { time, reason, log } => Self::Stuck { time, reason, log },
            Failure::Integrator { time, instances, source } => {
                let reason = format!("integration of {instances:?} fails: {source}");
                Self::Stuck { time, reason, log: Vec::new() }
            }
            Failure::NoDerivative { time, reason } => {
                Self::Stuck { time, reason: reason.into(), log: Vec::new() }
            }
        }
    }
}

impl StepperGroup {
    /// The FMUs at these places among `nodes`, which have just left initialization mode at `time` (s). Runs the first
    /// event iteration; the FMUs stay in event mode. A change of `inputs` is an event, if it happens in event mode.
    ///
    /// # Errors
    /// Whatever an FMU returns; an event iteration without end.
    pub fn start(
        nodes: &mut [InstanceNode],
        members: &[usize],
        time: f64,
        settings: IntegrationSettings,
        mut inputs: Vec<(usize, VariableBlock)>,
        around: &mut dyn GroupSurroundings,
    ) -> Result<(Self, EventSettled), CosimError> {
        let mut fmus = Members { nodes, members, inputs: &mut inputs, around };
        let (integration, settled) = Integration::start(&mut fmus, time, settings)?;
        Ok((Self { members: members.into(), inputs, integration }, settled))
    }

    fn parts<'a>(
        &'a mut self,
        nodes: &'a mut [InstanceNode],
        around: &'a mut dyn GroupSurroundings,
    ) -> (&'a mut Integration, Members<'a>) {
        let Self { members, inputs, integration } = self;
        (integration, Members { nodes, members, inputs, around })
    }

    /// See [`advance`](trueup_fmi_import::integration::IntegratedGroup::advance).
    ///
    /// # Errors
    /// As there.
    pub fn advance(
        &mut self,
        nodes: &mut [InstanceNode],
        around: &mut dyn GroupSurroundings,
        to: f64,
        stop: bool,
    ) -> Result<IntegrationReached, CosimError> {
        let (integration, mut fmus) = self.parts(nodes, around);
        Ok(integration.advance(&mut fmus, to, stop)?)
    }

    /// See [`settle`](trueup_fmi_import::integration::IntegratedGroup::settle).
    ///
    /// # Errors
    /// As there.
    pub fn settle(
        &mut self,
        nodes: &mut [InstanceNode],
        around: &mut dyn GroupSurroundings,
    ) -> Result<EventSettled, CosimError> {
        let (integration, mut fmus) = self.parts(nodes, around);
        Ok(integration.settle(&mut fmus)?)
    }

    /// Some FMU may have an event whose time is not known beforehand.
    pub fn finds_events(&self) -> bool {
        self.integration.finds_events()
    }

    /// The next time event of all FMUs in s.
    pub fn next_event(&self) -> Option<f64> {
        self.integration.next_event()
    }

    /// Time in s.
    pub fn time(&self) -> f64 {
        self.integration.time()
    }

    /// What it has done so far.
    pub fn statistics(&self) -> Statistics {
        self.integration.statistics()
    }

    /// What it chose on the way, to be reported to the user.
    pub fn notes(&self) -> &[String] {
        self.integration.notes()
    }

    /// What has to be restored together with the states of the FMUs, to go back.
    pub fn snapshot(&self) -> GroupSnapshot {
        GroupSnapshot { integration: self.integration.snapshot(), inputs: self.inputs.clone() }
    }

    /// Goes back; the states of the FMUs have been restored.
    pub fn restore(&mut self, to: &GroupSnapshot) {
        self.integration.restore(&to.integration);
        self.inputs.clone_from(&to.inputs);
    }
}
