//! The values of a running system, and how they are read, converted and set.

use trueup_fmi_import::{FmiStatus, PreparedReferences};

use crate::buffer::{BlockAccess, VariableBlock};
use crate::error::CosimError;
use crate::node::{self, InstanceNode};
use crate::plan::ElementIndex;

/// Where a value is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ValueSlot {
    /// Among the reals.
    Real(usize),
    /// Block of others, element.
    Other(usize, usize),
}

/// `Float64` of one node, read or set by one call.
pub(super) struct RealElements {
    pub(super) node: usize,
    pub(super) references: PreparedReferences,
    /// Its values among the reals.
    pub(super) first: usize,
    pub(super) end: usize,
}

/// Values of another type.
pub(super) struct OtherElements {
    pub(super) node: usize,
    pub(super) block: VariableBlock,
    /// Elements by place, for messages.
    pub(super) elements: Vec<ElementIndex>,
}

#[derive(Clone, Copy)]
pub(super) struct ElementCopy {
    pub(super) from: u32,
    pub(super) to: u32,
}

#[derive(Clone, Copy)]
pub(super) struct ScaledElement {
    pub(super) from: u32,
    pub(super) to: u32,
    pub(super) factor: f64,
    pub(super) offset: f64,
}

#[derive(Clone)]
pub(super) struct ConvertedElement {
    pub(super) from: ValueSlot,
    pub(super) to: ValueSlot,
    pub(super) factor: f64,
    pub(super) offset: f64,
    pub(super) map: Option<usize>,
}

/// Errors on the way are no larger than a pointer: a running system passes many results.
#[cold]
#[expect(clippy::boxed_local, reason = "unpacked here, off the way")]
pub(super) fn called(time: f64, source: Box<trueup_fmi_import::ImportError>) -> Box<CosimError> {
    Box::new(CosimError::Call { time, source: *source })
}

/// Everything but the order.
pub(super) struct ElementBank {
    /// All `Float64`, outputs and inputs.
    pub(super) reals: Vec<f64>,
    /// Which element each of them is.
    pub(super) elements: Vec<ElementIndex>,
    pub(super) blocks: Vec<RealElements>,
    pub(super) others: Vec<OtherElements>,
    pub(super) copies: Vec<ElementCopy>,
    pub(super) scaled: Vec<ScaledElement>,
    pub(super) converted: Vec<ConvertedElement>,
    pub(super) maps: Vec<Vec<(i64, i64)>>,
}

impl ElementBank {
    /// Reads a block and looks whether it is finite.
    #[inline]
    pub(super) fn get(
        &mut self,
        block: usize,
        nodes: &mut [InstanceNode],
        time: f64,
    ) -> Result<(), Box<CosimError>> {
        let RealElements { node, references, first, end } = &self.blocks[block];
        let values = &mut self.reals[*first..*end];
        if let Err(source) = nodes[*node].slave.read(references, values) {
            return Err(called(time, source));
        }
        // 0 x is 0 but for what is not finite: one comparison for all.
        if values.iter().fold(0.0, |sum, x| sum + 0.0 * x) == 0.0 {
            return Ok(());
        }
        Err(self.not_finite(*first..*end, nodes, time))
    }

    #[cold]
    pub(super) fn not_finite(
        &self,
        range: std::ops::Range<usize>,
        nodes: &[InstanceNode],
        time: f64,
    ) -> Box<CosimError> {
        let at = range.clone().find(|at| !self.reals[*at].is_finite()).unwrap_or(range.start);
        let element = self.elements[at];
        let node = &nodes[element.component];
        Box::new(CosimError::NotFinite {
            time,
            instance: node.slave.name().into(),
            variable: node::variable(node.description(), element.variable, element.element),
            value: self.reals[at],
            log: node.slave.log(),
        })
    }

    #[inline]
    pub(super) fn set(
        &self,
        block: usize,
        nodes: &mut [InstanceNode],
        time: f64,
    ) -> Result<(), Box<CosimError>> {
        let RealElements { node, references, first, end } = &self.blocks[block];
        match nodes[*node].slave.write(references, &self.reals[*first..*end]) {
            Ok(()) => Ok(()),
            Err(source) => Err(called(time, source)),
        }
    }

    pub(super) fn get_other(
        &mut self,
        at: usize,
        nodes: &mut [InstanceNode],
        time: f64,
    ) -> Result<(), CosimError> {
        let OtherElements { node, block, elements } = &mut self.others[at];
        let node = &mut nodes[*node];
        node.slave.get(block).map_err(|source| CosimError::Call { time, source })?;
        match block.values.first_not_finite() {
            None => Ok(()),
            Some((at, value)) => Err(CosimError::NotFinite {
                time,
                instance: node.slave.name().into(),
                variable: node::variable(node.description(), elements[at].variable, elements[at].element),
                value,
                log: node.slave.log(),
            }),
        }
    }

    pub(super) fn set_other(
        &self,
        at: usize,
        nodes: &mut [InstanceNode],
        time: f64,
    ) -> Result<(), CosimError> {
        let OtherElements { node, block, .. } = &self.others[at];
        nodes[*node].slave.set(block).map_err(|source| CosimError::Call { time, source })
    }

    #[inline]
    pub(super) fn hand(&mut self, [copies, scaled, converted]: [(u32, u32); 3]) {
        for c in &self.copies[copies.0 as usize..copies.1 as usize] {
            self.reals[c.to as usize] = self.reals[c.from as usize];
        }
        for c in &self.scaled[scaled.0 as usize..scaled.1 as usize] {
            self.reals[c.to as usize] = c.factor * self.reals[c.from as usize] + c.offset;
        }
        for at in converted.0..converted.1 {
            self.convert(at as usize);
        }
    }

    /// Hands on a value whose type may differ; types were compared when the system was checked. `true`: it changed.
    pub(super) fn convert(&mut self, at: usize) -> bool {
        use crate::buffer::{ElementNumber, ValueBuffer};
        let ConvertedElement { from, to, factor, offset, map } = self.converted[at].clone();
        if let (ValueSlot::Other(b, i), ValueSlot::Other(c, j)) = (from, to)
            && let ValueBuffer::String(texts) = &self.others[b].block.values
        {
            let text = texts[i].clone();
            let ValueBuffer::String(ours) = &mut self.others[c].block.values else { return false };
            let changed = ours[j] != text;
            ours[j] = text;
            return changed;
        }
        let number = match from {
            ValueSlot::Real(i) => Some(ElementNumber::Real(self.reals[i])),
            ValueSlot::Other(b, i) => self.others[b].block.values.exact(i),
        };
        let Some(mut number) = number else { return false };
        if let (Some(map), ElementNumber::Whole(x)) = (map, number)
            && let Some((_, y)) = self.maps[map].iter().find(|(key, _)| i128::from(*key) == x)
        {
            number = ElementNumber::Whole((*y).into());
        }
        if (factor, offset) != (1.0, 0.0) {
            number = ElementNumber::Real(factor * number.real() + offset);
        }
        match to {
            ValueSlot::Real(j) => std::mem::replace(&mut self.reals[j], number.real()) != self.reals[j],
            ValueSlot::Other(c, j) => {
                let values = &mut self.others[c].block.values;
                let before = values.exact(j);
                values.set_exact(j, number);
                before != values.exact(j)
            }
        }
    }
}

/// A call that failed for the values that it was given, not for good.
pub(super) fn is_discard(error: &CosimError) -> bool {
    matches!(error, CosimError::Call { source, .. } if source.status() == Some(FmiStatus::Discard))
        || matches!(error, CosimError::NotFinite { .. })
}
