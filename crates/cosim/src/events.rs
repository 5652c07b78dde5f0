//! Times at which inputs from a file jump, or go on in another direction: steps end there.

use std::collections::BTreeSet;

use trueup_fmi_description::description::{DescriptionVariability, DescriptionVariable, VariableType};
use trueup_numerics::ShortNumber;

use crate::buffer::{ValueBuffer, VariableBlock};
use crate::exchange::Wiring;
use crate::grid::CommunicationGrid;
use crate::inputs::InputFileTable;
use crate::mistake::quoted;
use crate::node::InstanceNode;
use crate::plan::DrivenInput;
use crate::system::ComponentInterface;

/// Part of a communication step below which two times are the same.
const SAME: f64 = 1e-9;

/// Times in s, in order; `true`: a held input jumps, which is an event.
#[derive(Debug, Default)]
pub(crate) struct EventCuts {
    times: Vec<(f64, bool)>,
}

impl EventCuts {
    /// Of all jumps; of bends of linear inputs only where the master integrates. None at all if an FMU may not be given
    /// parts of a step: a note reports what is then late. Samples at communication points but for rounding are moved there.
    pub(crate) fn new(
        nodes: &[InstanceNode],
        driven: &[DrivenInput],
        inputs: Option<&mut InputFileTable>,
        grid: &CommunicationGrid,
        notes: &mut Vec<String>,
    ) -> Self {
        let Some(inputs) = inputs else { return Self::default() };
        for signal in &mut inputs.columns {
            for t in &mut signal.times {
                let point = grid.time(((*t - grid.start) / grid.step).round().max(0.0) as u64);
                if (*t - point).abs() <= SAME * grid.step {
                    *t = point;
                }
            }
        }
        let mut times: Vec<(f64, bool)> = Vec::new();
        for d in driven {
            let signal = &inputs.columns[d.column];
            let node = &nodes[d.to.component];
            let integrated = node.planned.interface == ComponentInterface::ModelExchange;
            times.extend(signal.jumps(d.linear).map(|t| (t, true)));
            if d.linear && integrated {
                times.extend(signal.times.iter().map(|t| (*t, false)));
            }
        }
        times.retain(|(t, _)| *t > grid.start && *t < grid.stop);
        let whole: Vec<&str> =
            nodes.iter().filter(|n| !n.allows_any_step()).map(|n| n.planned.name.as_str()).collect();
        if !whole.is_empty() {
            let point = |t: f64| grid.time(((t - grid.start) / grid.step).round() as u64);
            let late = times.iter().filter(|(t, jumps)| *jumps && *t != point(*t));
            if let (n @ 1.., Some((t, _))) = (late.clone().count(), late.clone().next()) {
                let who = if whole == [""] { "the FMU".into() } else { quoted(&whole) };
                notes.push(format!(
                    "inputs from the file jump between communication points ({n} times, first at {} s) and are handed on at the next one: {who} is not declared \
                     to take parts of a step; choose a step that meets the jumps",
                    ShortNumber(*t)
                ));
            }
            return Self::default();
        }
        times.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
        times.dedup_by(|b, a| b.0 - a.0 <= SAME * grid.step);
        Self { times }
    }

    /// The first one after `from` and before `to`.
    pub(crate) fn between(&self, from: f64, to: f64) -> Option<(f64, bool)> {
        let at = self.times.partition_point(|(t, _)| *t <= from);
        self.times.get(at).copied().filter(|(t, _)| *t < to)
    }
}

/// The inputs of one node that are connected or driven, one block per variable.
pub(crate) fn inputs(
    node: &InstanceNode,
    at: usize,
    wiring: Wiring<'_>,
    keep: impl Fn(&DescriptionVariable) -> bool,
) -> Vec<VariableBlock> {
    let d = node.description();
    let links = wiring.links.iter().map(|l| l.to);
    let all = links.chain(wiring.driven.iter().map(|d| d.to)).filter(|to| to.component == at);
    let variables: BTreeSet<usize> = all.map(|to| to.variable).collect();
    let block = |v: &DescriptionVariable| {
        let values = ValueBuffer::new(v.kind, d.version, d.elements(v)?)?;
        Some(VariableBlock { references: vec![v.value_reference], values })
    };
    variables.into_iter().map(|v| &d.variables[v]).filter(|v| keep(v)).filter_map(block).collect()
}

/// Those that may be set in event mode only.
pub(crate) fn discrete_inputs(node: &InstanceNode, at: usize, wiring: Wiring<'_>) -> Vec<VariableBlock> {
    inputs(node, at, wiring, |v| !is_continuous(v))
}

/// It may change between events.
pub(crate) fn is_continuous(v: &DescriptionVariable) -> bool {
    matches!(v.kind, VariableType::Float64 | VariableType::Float32)
        && v.variability == DescriptionVariability::Continuous
}
