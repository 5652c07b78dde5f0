//! FMUs of Model Exchange as one stepper.

use trueup_fmi_import::StateId;

use super::{Advance, EventSettled, SLOTS, StepLimit, SystemStepper};
use crate::buffer::VariableBlock;
use crate::error::CosimError;
use crate::events;
use crate::exchange::{Exchange, Phase, Wiring};
use crate::model_exchange::{
    GroupSnapshot, GroupSurroundings, IntegrationSettings, Statistics, StepperGroup, TOLERANCE,
};
use crate::node::{self, InstanceNode};
use crate::plan::LinearLink;

/// A [`StepperGroup`] with the connections among its FMUs.
pub(crate) struct GroupStepper {
    nodes: Vec<usize>,
    group: Option<StepperGroup>,
    around: Around,
    settings: IntegrationSettings,
    /// Inputs whose change is an event.
    inputs: Vec<(usize, VariableBlock)>,
    ended: bool,
    stop: bool,
    saved: [Option<(GroupSnapshot, Vec<StateId>)>; SLOTS],
}

/// What sets inputs while the group integrates.
struct Around {
    /// Nodes whose continuous inputs come from outside, on lines.
    lines: Vec<usize>,
    within: StepLimit,
    /// Connections of continuous variables among the FMUs, and all connections.
    continuous: Option<Exchange>,
    all: Option<Exchange>,
}

impl GroupSurroundings for Around {
    fn exchange(&mut self, nodes: &mut [InstanceNode], time: f64, event: bool) -> Result<(), CosimError> {
        if self.within == StepLimit::Line {
            self.lines.iter().try_for_each(|n| nodes[*n].set_on_line(time))?;
        }
        let exchange = if event { &mut self.all } else { &mut self.continuous };
        exchange.as_mut().map_or(Ok(()), |e| e.propagate(nodes, time))
    }
}

impl GroupStepper {
    /// Of these nodes, with lines installed, in a run of `span` s.
    ///
    /// # Errors
    /// [`CosimError::Setting`]: an array is connected to the group and to others; sizes of arrays cannot be had.
    pub(crate) fn new(
        nodes: &mut [InstanceNode],
        members: &[usize],
        wiring: Wiring<'_>,
        tolerance: Option<f64>,
        span: f64,
    ) -> Result<Self, CosimError> {
        let within = |n: usize| members.contains(&n);
        let inner = |l: &&LinearLink| within(l.from.component) && within(l.to.component);
        let target = |nodes: &[InstanceNode], l: &LinearLink| {
            events::is_continuous(&nodes[l.to.component].description().variables[l.to.variable])
        };
        let links: Vec<LinearLink> = wiring.links.iter().filter(inner).copied().collect();
        let smooth: Vec<LinearLink> = links.iter().filter(|l| target(nodes, l)).copied().collect();
        let outer =
            wiring.links.iter().filter(|l| !within(l.from.component) && within(l.to.component)).map(|l| l.to);
        let outer: Vec<_> =
            outer.chain(wiring.driven.iter().filter(|d| within(d.to.component)).map(|d| d.to)).collect();
        let shared = links
            .iter()
            .find(|l| outer.iter().any(|to| (to.component, to.variable) == (l.to.component, l.to.variable)));
        if let Some(link) = shared {
            return Err(CosimError::Setting(vec![format!(
                "some elements of the array of `{}` come from Model Exchange and some from elsewhere; connect all from one side",
                node::name(nodes, link.to)
            )]));
        }
        let mut exchange = |links: &[LinearLink]| {
            let wiring = Wiring { links, driven: &[], maps: wiring.maps };
            (!links.is_empty()).then(|| Exchange::new(nodes, wiring, Phase::Stepping, within)).transpose()
        };
        let (continuous, all) = (exchange(&smooth)?, exchange(&links)?);
        let mut inputs: Vec<(usize, VariableBlock)> = Vec::new();
        for &n in members {
            inputs.extend(events::inputs(&nodes[n], n, wiring, |_| true).into_iter().map(|block| (n, block)));
        }
        let opens = !outer.is_empty() || smooth.len() < links.len();
        let lines = members.iter().copied().filter(|n| outer.iter().any(|to| to.component == *n)).collect();
        let settings = IntegrationSettings {
            tolerance: tolerance.unwrap_or(TOLERANCE),
            linked: !links.is_empty(),
            opens,
            span,
            ..IntegrationSettings::default()
        };
        Ok(Self {
            nodes: members.into(),
            group: None,
            around: Around { lines, within: StepLimit::Held, continuous, all },
            settings,
            inputs,
            ended: false,
            stop: false,
            saved: [const { None }; SLOTS],
        })
    }
}

impl SystemStepper for GroupStepper {
    fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    fn begin(&mut self, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        let (group, settled) = StepperGroup::start(
            nodes,
            &self.nodes,
            time,
            self.settings.clone(),
            self.inputs.clone(),
            &mut self.around,
        )?;
        (self.group, self.ended) = (Some(group), settled.terminated);
        Ok(())
    }

    fn stop_at_events(&mut self) {
        self.stop = true;
    }

    fn may_stop(&self, _: &[InstanceNode]) -> bool {
        self.stop && self.group.as_ref().is_some_and(StepperGroup::finds_events)
    }

    fn next_event(&self, time: f64) -> Option<f64> {
        self.group.as_ref()?.next_event().filter(|next| *next > time)
    }

    fn step(
        &mut self,
        nodes: &mut [InstanceNode],
        from: f64,
        to: f64,
        within: StepLimit,
    ) -> Result<Advance, CosimError> {
        let Some(group) = self.group.as_mut().filter(|_| !self.ended) else {
            return Ok(Advance { time: from, terminate: true, ..Advance::default() });
        };
        let before = group.statistics().events;
        self.around.within = within;
        let reached = group.advance(nodes, &mut self.around, to, self.stop);
        self.around.within = StepLimit::Held;
        let reached = reached?;
        let early = reached.terminated || (reached.event && group.time() < to);
        Ok(Advance {
            time: if early { group.time() } else { to },
            terminate: reached.terminated,
            event: early && !reached.terminated,
            discarded: 0,
            events: (group.statistics().events - before) as u64,
        })
    }

    fn has_events(&self) -> bool {
        true
    }

    fn settle(&mut self, nodes: &mut [InstanceNode], _time: f64) -> Result<EventSettled, CosimError> {
        let Some(group) = self.group.as_mut().filter(|_| !self.ended) else {
            return Ok(EventSettled::default());
        };
        let settled = group.settle(nodes, &mut self.around)?;
        self.ended = settled.terminated;
        Ok(settled)
    }

    fn notes(&self) -> Vec<String> {
        let Some(group) = &self.group else { return Vec::new() };
        let Statistics { accepted, rejected, events } = group.statistics();
        let did =
            format!("Model Exchange: {accepted} integrator steps ({rejected} rejected), {events} events");
        group.notes().iter().cloned().chain([did]).collect()
    }

    fn can_restore(&self, nodes: &[InstanceNode]) -> bool {
        self.nodes.iter().all(|n| nodes[*n].can_restore())
    }

    fn save_in(&mut self, slot: usize, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        let Some(group) = &self.group else { return Ok(()) };
        let saved = self.saved[slot].take();
        let mut ids: Vec<Option<StateId>> = match saved {
            Some((_, ids)) => ids.into_iter().map(Some).collect(),
            None => self.nodes.iter().map(|_| None).collect(),
        };
        for (n, id) in self.nodes.iter().zip(&mut ids) {
            nodes[*n].slave.save(id).map_err(|source| CosimError::Call { time, source })?;
        }
        self.saved[slot] = Some((group.snapshot(), ids.into_iter().flatten().collect()));
        Ok(())
    }

    fn restore_from(&mut self, slot: usize, nodes: &mut [InstanceNode], time: f64) -> Result<(), CosimError> {
        let (Some((snapshot, ids)), Some(group)) = (&self.saved[slot], &mut self.group) else {
            return Ok(());
        };
        for (n, id) in self.nodes.iter().zip(ids) {
            nodes[*n].slave.restore(id).map_err(|source| CosimError::Call { time, source })?;
        }
        group.restore(snapshot);
        Ok(())
    }
}
