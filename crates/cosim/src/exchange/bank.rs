//! The values of a running system, and how they are read, converted and set.

use trueup_fmi_import::{Prepared, Status};

use crate::buffer::{Block, Blocks};
use crate::error::Error;
use crate::node::{self, Node};
use crate::plan::Element;

/// Where a value lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spot {
    /// Among the reals.
    Real(usize),
    /// Block of others, element.
    Other(usize, usize),
}

/// `Float64` of one node, read or set by one call.
pub(super) struct Reals {
    pub(super) node: usize,
    pub(super) references: Prepared,
    /// Its values among the reals.
    pub(super) first: usize,
    pub(super) end: usize,
}

/// Values of another type.
pub(super) struct Others {
    pub(super) node: usize,
    pub(super) block: Block,
    /// Elements by place, for messages.
    pub(super) elements: Vec<Element>,
}

#[derive(Clone, Copy)]
pub(super) struct Copy {
    pub(super) from: u32,
    pub(super) to: u32,
}

#[derive(Clone, Copy)]
pub(super) struct Scaled {
    pub(super) from: u32,
    pub(super) to: u32,
    pub(super) factor: f64,
    pub(super) offset: f64,
}

#[derive(Clone)]
pub(super) struct Converted {
    pub(super) from: Spot,
    pub(super) to: Spot,
    pub(super) factor: f64,
    pub(super) offset: f64,
    pub(super) map: Option<usize>,
}

/// Errors on the way are no larger than a pointer: a running system passes many results.
#[cold]
#[expect(clippy::boxed_local, reason = "unpacked here, off the way")]
pub(super) fn called(time: f64, source: Box<trueup_fmi_import::Error>) -> Box<Error> {
    Box::new(Error::Call { time, source: *source })
}

/// Everything but the order.
pub(super) struct Bank {
    /// All `Float64`, outputs and inputs.
    pub(super) reals: Vec<f64>,
    /// Which element each of them is.
    pub(super) elements: Vec<Element>,
    pub(super) blocks: Vec<Reals>,
    pub(super) others: Vec<Others>,
    pub(super) copies: Vec<Copy>,
    pub(super) scaled: Vec<Scaled>,
    pub(super) converted: Vec<Converted>,
    pub(super) maps: Vec<Vec<(i64, i64)>>,
}

impl Bank {
    /// Reads a block and looks whether it is finite.
    #[inline]
    pub(super) fn get(&mut self, block: usize, nodes: &mut [Node], time: f64) -> Result<(), Box<Error>> {
        let Reals { node, references, first, end } = &self.blocks[block];
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
    pub(super) fn not_finite(&self, range: std::ops::Range<usize>, nodes: &[Node], time: f64) -> Box<Error> {
        let at = range.clone().find(|at| !self.reals[*at].is_finite()).unwrap_or(range.start);
        let element = self.elements[at];
        let node = &nodes[element.component];
        Box::new(Error::NotFinite {
            time,
            instance: node.slave.name().into(),
            variable: node::variable(node.description(), element.variable, element.element),
            value: self.reals[at],
            log: node.slave.log(),
        })
    }

    #[inline]
    pub(super) fn set(&self, block: usize, nodes: &mut [Node], time: f64) -> Result<(), Box<Error>> {
        let Reals { node, references, first, end } = &self.blocks[block];
        match nodes[*node].slave.write(references, &self.reals[*first..*end]) {
            Ok(()) => Ok(()),
            Err(source) => Err(called(time, source)),
        }
    }

    pub(super) fn get_other(&mut self, at: usize, nodes: &mut [Node], time: f64) -> Result<(), Error> {
        let Others { node, block, elements } = &mut self.others[at];
        let node = &mut nodes[*node];
        node.slave.get(block).map_err(|source| Error::Call { time, source })?;
        match block.values.first_not_finite() {
            None => Ok(()),
            Some((at, value)) => Err(Error::NotFinite {
                time,
                instance: node.slave.name().into(),
                variable: node::variable(node.description(), elements[at].variable, elements[at].element),
                value,
                log: node.slave.log(),
            }),
        }
    }

    pub(super) fn set_other(&self, at: usize, nodes: &mut [Node], time: f64) -> Result<(), Error> {
        let Others { node, block, .. } = &self.others[at];
        nodes[*node].slave.set(block).map_err(|source| Error::Call { time, source })
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
        use crate::buffer::{Buffer, Number};
        let Converted { from, to, factor, offset, map } = self.converted[at].clone();
        if let (Spot::Other(b, i), Spot::Other(c, j)) = (from, to)
            && let Buffer::String(texts) = &self.others[b].block.values
        {
            let text = texts[i].clone();
            let Buffer::String(ours) = &mut self.others[c].block.values else { return false };
            let changed = ours[j] != text;
            ours[j] = text;
            return changed;
        }
        let number = match from {
            Spot::Real(i) => Some(Number::Real(self.reals[i])),
            Spot::Other(b, i) => self.others[b].block.values.exact(i),
        };
        let Some(mut number) = number else { return false };
        if let (Some(map), Number::Whole(x)) = (map, number)
            && let Some((_, y)) = self.maps[map].iter().find(|(key, _)| i128::from(*key) == x)
        {
            number = Number::Whole((*y).into());
        }
        if (factor, offset) != (1.0, 0.0) {
            number = Number::Real(factor * number.real() + offset);
        }
        match to {
            Spot::Real(j) => std::mem::replace(&mut self.reals[j], number.real()) != self.reals[j],
            Spot::Other(c, j) => {
                let values = &mut self.others[c].block.values;
                let before = values.exact(j);
                values.set_exact(j, number);
                before != values.exact(j)
            }
        }
    }
}

/// A call that failed for the values that it was given, not for good.
pub(super) fn is_discard(error: &Error) -> bool {
    matches!(error, Error::Call { source, .. } if source.status() == Some(Status::Discard))
        || matches!(error, Error::NotFinite { .. })
}
