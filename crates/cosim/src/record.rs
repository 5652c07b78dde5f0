//! What is recorded, read from the FMUs: one call per FMU and type and row.

use trueup_fmi_description::description::VariableType;
use trueup_fmi_import::PreparedReferences;

use crate::buffer::{BlockAccess, ValueBuffer, VariableBlock};
use crate::error::CosimError;
use crate::node::{self, InstanceNode};
use crate::plan::{ElementIndex, RecordedElement};
use crate::results::{ColumnKind, ResultColumn, ResultRow, ResultSink, RowValues};

/// Reads rows.
pub(crate) struct Recorder {
    columns: Vec<ResultColumn>,
    values: RowValues,
    reals: Vec<f64>,
    blocks: Vec<(usize, PreparedReferences, std::ops::Range<usize>)>,
    others: Vec<(usize, VariableBlock)>,
    /// Of the columns that are doubles, in their order: where among the reals.
    doubles: Vec<usize>,
    /// All others: block, element, slot in the row.
    rest: Vec<(usize, usize, ColumnKind, usize)>,
    /// Slots in the row of the doubles.
    slots: Vec<usize>,
    /// Of the reals, what they are.
    elements: Vec<ElementIndex>,
}

/// The columns of these elements.
pub(crate) fn columns(nodes: &[InstanceNode], recorded: &[RecordedElement]) -> Vec<ResultColumn> {
    let column = |r: &RecordedElement| {
        let d = nodes[r.from.component].description();
        let v = &d.variables[r.from.variable];
        let unit = d.attributes(v).unit.unwrap_or_default();
        let kind = ColumnKind::of(v.kind).unwrap_or(ColumnKind::Text); // binaries and clocks were refused
        ResultColumn { every: r.every, ..ResultColumn::new(r.name.as_str(), kind, unit) }
    };
    recorded.iter().map(column).collect()
}

impl Recorder {
    pub(crate) fn new(nodes: &mut [InstanceNode], recorded: &[RecordedElement]) -> Result<Self, CosimError> {
        let columns = columns(nodes, recorded);
        let slots = crate::results::slots(&columns);
        let mut variables: Vec<(usize, usize)> =
            recorded.iter().map(|r| (r.from.component, r.from.variable)).collect();
        variables.sort_unstable();
        variables.dedup();
        let mut this = Self {
            values: RowValues::of(&columns),
            columns,
            reals: Vec::new(),
            blocks: Vec::new(),
            others: Vec::new(),
            doubles: Vec::new(),
            rest: Vec::new(),
            slots: Vec::new(),
            elements: Vec::new(),
        };
        // Where the first element of each variable is stored: block of others (or none), place.
        let mut places = std::collections::HashMap::new();
        for (n, node) in nodes.iter_mut().enumerate() {
            let (first, mut references) = (this.reals.len(), Vec::new());
            for &(_, variable) in variables.iter().filter(|(m, _)| *m == n) {
                let d = node.description();
                let v = &d.variables[variable];
                let (elements, reference) = (d.elements(v).unwrap_or(1), v.value_reference);
                if v.kind == VariableType::Float64 {
                    places.insert((n, variable), (None, this.reals.len()));
                    references.push(reference);
                    let named = (0..elements).map(|element| ElementIndex { component: n, variable, element });
                    this.elements.extend(named);
                    this.reals.resize(this.elements.len(), 0.0);
                    continue;
                }
                let Some(values) = ValueBuffer::new(v.kind, d.version, elements) else { continue };
                let same = |(m, b): &(usize, VariableBlock)| {
                    *m == n && std::mem::discriminant(&b.values) == std::mem::discriminant(&values)
                };
                match this.others.iter().position(same) {
                    Some(at) => {
                        let block = &mut this.others[at].1;
                        block.references.push(reference);
                        places.insert((n, variable), (Some(at), block.values.append(values)));
                    }
                    None => {
                        places.insert((n, variable), (Some(this.others.len()), 0));
                        this.others.push((n, VariableBlock { references: vec![reference], values }));
                    }
                }
            }
            if !references.is_empty() {
                this.blocks.push((n, node.slave.prepare(&references)?, first..this.reals.len()));
            }
        }
        for ((r, slot), column) in recorded.iter().zip(slots).zip(&this.columns) {
            match places.get(&(r.from.component, r.from.variable)) {
                Some((None, at)) => {
                    this.doubles.push(at + r.from.element);
                    this.slots.push(slot);
                }
                Some((Some(block), at)) => this.rest.push((*block, at + r.from.element, column.kind, slot)),
                None => {}
            }
        }
        Ok(this)
    }

    pub(crate) fn columns(&self) -> &[ResultColumn] {
        &self.columns
    }

    /// The first communication point behind `point` at which a column is due.
    pub(crate) fn next_due(&self, point: u64) -> u64 {
        let next = |c: &ResultColumn| (point + 1).next_multiple_of(u64::from(c.every.max(1)));
        self.columns.iter().map(next).min().unwrap_or(u64::MAX)
    }

    /// Reads and writes a row, if any column is due. Only finite values are written.
    #[inline]
    pub(crate) fn row(
        &mut self,
        nodes: &mut [InstanceNode],
        time: f64,
        point: Option<u64>,
        sink: &mut dyn ResultSink,
    ) -> Result<(), CosimError> {
        if self.columns.is_empty() || !self.columns.iter().any(|c| c.is_due(point)) {
            return Ok(());
        }
        for (n, references, range) in &self.blocks {
            let values = &mut self.reals[range.clone()];
            nodes[*n]
                .slave
                .read(references, values)
                .map_err(|source| CosimError::Call { time, source: *source })?;
            if let Some(at) = values.iter().position(|x| !x.is_finite()) {
                let element = self.elements[range.start + at];
                return Err(not_finite(nodes, element, self.reals[range.start + at], time));
            }
        }
        for (n, block) in &mut self.others {
            let node = &mut nodes[*n];
            node.slave.get(block).map_err(|source| CosimError::Call { time, source })?;
        }
        for (at, slot) in self.doubles.iter().zip(&self.slots) {
            self.values.reals[*slot] = self.reals[*at];
        }
        for (block, at, kind, slot) in &self.rest {
            let (n, block) = &self.others[*block];
            match (&block.values, kind) {
                (ValueBuffer::String(texts), _) => self.values.texts[*slot].clone_from(&texts[*at]),
                (ValueBuffer::UInt64(v), _) => self.values.integers[*slot] = v[*at] as i64,
                (values, ColumnKind::Single) => {
                    let x = values.number(*at).unwrap_or(f64::NAN);
                    if !x.is_finite() {
                        return Err(not_finite_in(nodes, *n, block, *at, x, time));
                    }
                    self.values.reals[*slot] = x;
                }
                (values, _) => {
                    if let Some(crate::buffer::ElementNumber::Whole(x)) = values.exact(*at) {
                        self.values.integers[*slot] = x as i64;
                    }
                }
            }
        }
        sink.row(ResultRow { time, point, values: &self.values })
    }
}

#[cold]
fn not_finite(nodes: &[InstanceNode], element: ElementIndex, value: f64, time: f64) -> CosimError {
    let node = &nodes[element.component];
    CosimError::NotFinite {
        time,
        instance: node.slave.name().into(),
        variable: node::variable(node.description(), element.variable, element.element),
        value,
        log: node.slave.log(),
    }
}

#[cold]
fn not_finite_in(
    nodes: &[InstanceNode],
    node: usize,
    block: &VariableBlock,
    at: usize,
    value: f64,
    time: f64,
) -> CosimError {
    let d = nodes[node].description();
    let mut left = at;
    let mut found = ElementIndex { component: node, variable: 0, element: 0 };
    for reference in &block.references {
        let of = d
            .variables
            .iter()
            .position(|v| v.value_reference == *reference && v.kind == VariableType::Float32);
        let Some(variable) = of else { continue };
        let n = d.elements(&d.variables[variable]).unwrap_or(1);
        if left < n {
            found = ElementIndex { component: node, variable, element: left };
            break;
        }
        left -= n;
    }
    not_finite(nodes, found, value, time)
}
