//! Gram matrices of whitened innovations.
//!
//! The base (data, nuisances, causes that stand) has a full matrix; a group beside it only its products with the base and with
//! itself, which is all that the evidence of base and group needs. Sums are in double precision: beside a strong effect the
//! evidence is a small difference of large sums.

use std::rc::Rc;

use pulp::{Arch, Simd, WithSimd};

use super::column::{self, Column};
use super::filter::{DataColumn, FilterGains, LANES, Lane, LaneBlock, data_innovations, lane_innovations};
use super::kernel::SizeError;

/// Most columns of a group.
pub const GROUP: usize = 4;

/// Products of all columns of the base, data first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BaseGram {
    /// Number of columns, data included.
    pub size: usize,
    /// Products, rows of rows.
    pub products: Vec<f64>,
    /// Sum of log S over what counts.
    pub log_variance: f64,
    /// Readings that count.
    pub count: usize,
}

/// Products of a group.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GroupGram {
    /// Its columns.
    pub size: usize,
    /// With each column of the base: `size` numbers each.
    pub base: Vec<f64>,
    /// With each other, rows of rows.
    pub own: Vec<f64>,
}

impl BaseGram {
    /// With a group behind the base.
    pub fn with(&self, group: &GroupGram) -> Self {
        let (n, k) = (self.size, group.size);
        let mut products = vec![0.0; (n + k) * (n + k)];
        let mut set = |i: usize, j: usize, v: f64| {
            products[(n + k) * i + j] = v;
            products[(n + k) * j + i] = v;
        };
        for i in 0..n {
            (0..=i).for_each(|j| set(i, j, self.products[n * i + j]));
            (0..k).for_each(|j| set(i, n + j, group.base[k * i + j]));
        }
        for i in 0..k {
            (0..=i).for_each(|j| set(n + i, n + j, group.own[k * i + j]));
        }
        Self { size: n + k, products, ..self.clone() }
    }
    /// The upper half as the lower one.
    pub fn mirrored(mut self) -> Self {
        let n = self.size;
        for i in 0..n {
            (0..i).for_each(|j| self.products[n * j + i] = self.products[n * i + j]);
        }
        self
    }
    /// Product of two columns.
    pub fn product(&self, i: usize, j: usize) -> f64 {
        self.products[self.size * i + j]
    }
}

/// Gains of a recording with the variances of its readings, as [`FilterGains::gain`] and [`FilterGains::variance`].
pub type SharedGains = (Rc<[f64]>, Rc<[f64]>);

/// Base of a pass at some intensities, kept for further groups.
#[derive(Debug)]
pub struct PassedBase {
    /// Its Gram matrix.
    pub gram: BaseGram,
    /// Gains of each recording.
    pub gains: Vec<SharedGains>,
    /// Whitened innovations of each recording by reading, `gram.size` numbers each, data first.
    pub innovations: Vec<Vec<f64>>,
}

/// Columns as the filter takes them: the base packed once for every intensity.
#[derive(Clone, Debug)]
pub struct PackedColumns {
    data: Vec<DataColumn>,
    /// By recording and block.
    base: Vec<Vec<LaneBlock>>,
    width: usize,
    coordinates: usize,
    channels: usize,
}

impl PackedColumns {
    /// Of what was read, one entry a recording, and the columns of the base.
    pub fn new(data: Vec<DataColumn>, base: &[Column], channels: usize) -> Self {
        let coordinates = data.first().map_or(0, |d| d.forces.len());
        let columns: Vec<&Column> = base.iter().collect();
        let blocks =
            |r: usize| columns.chunks(LANES).map(|c| column::beside(c, r, coordinates, channels)).collect();
        let blocks = (0..data.len()).map(blocks).collect();
        Self { data, base: blocks, width: base.len(), coordinates, channels }
    }

    /// An empty matrix for the base.
    pub fn nothing(&self) -> BaseGram {
        let size = self.width + 1;
        BaseGram { size, products: vec![0.0; size * size], ..BaseGram::default() }
    }

    /// Adds a recording to the matrix of the base (its lower half); tells the innovations of data and base.
    ///
    /// # Errors
    /// Where no kernel has these sizes.
    pub fn pass_base(
        &self,
        recording: usize,
        gains: &FilterGains<'_>,
        sum: &mut BaseGram,
    ) -> Result<Vec<f64>, SizeError> {
        let size = sum.size;
        let rows = gains.input.counted_rows();
        let data = data_innovations(gains, &self.data[recording])?;
        let mut e = vec![0.0; size * data.len()];
        data.iter().enumerate().for_each(|(k, d)| e[size * k] = *d);
        let mut lanes = Vec::new();
        for (b, block) in self.base[recording].iter().enumerate() {
            lane_innovations(gains, block, &mut lanes)?;
            let width = (self.width - LANES * b).min(LANES);
            for k in &rows {
                let to = &mut e[size * k + 1 + LANES * b..][..width];
                to.iter_mut().zip(&lanes[*k]).for_each(|(x, l)| *x = f64::from(*l));
            }
        }
        vectorised(BaseSums { rows: &rows, e: &e, size, products: &mut sum.products });
        sum.log_variance += rows.iter().map(|k| gains.variance[*k].ln()).sum::<f64>();
        sum.count += rows.len();
        Ok(e)
    }
}

/// Sums of groups beside a base while recordings pass.
pub struct GroupSums<'a> {
    packed: &'a PackedColumns,
    /// Groups of at most [`GROUP`] columns, as many as fit beside each other.
    blocks: Vec<Vec<&'a [Column]>>,
    /// By block: products with each column of the base, and with the lane that is 0, 1, .. further.
    with_base: Vec<Vec<Wide>>,
    with_own: Vec<[Wide; GROUP]>,
}

impl<'a> GroupSums<'a> {
    /// Nothing yet.
    pub fn new(packed: &'a PackedColumns, groups: &[&'a [Column]]) -> Self {
        let mut blocks: Vec<Vec<&'a [Column]>> = Vec::new();
        let mut used = LANES;
        for g in groups {
            if used + g.len() > LANES {
                blocks.push(Vec::new());
                used = 0;
            }
            used += g.len();
            if let Some(b) = blocks.last_mut() {
                b.push(g);
            }
        }
        let with_base = vec![vec![[0.0; LANES]; packed.width + 1]; blocks.len()];
        let with_own = vec![[[0.0; LANES]; GROUP]; blocks.len()];
        Self { packed, blocks, with_base, with_own }
    }

    /// Adds a recording; `e` has the innovations of data and base.
    ///
    /// # Errors
    /// Where no kernel has these sizes.
    pub fn pass(&mut self, recording: usize, gains: &FilterGains<'_>, e: &[f64]) -> Result<(), SizeError> {
        let rows = gains.input.counted_rows();
        let mut lanes = Vec::new();
        for (b, groups) in self.blocks.iter().enumerate() {
            let columns: Vec<&Column> = groups.iter().flat_map(|g| g.iter()).collect();
            let block = column::beside(&columns, recording, self.packed.coordinates, self.packed.channels);
            lane_innovations(gains, &block, &mut lanes)?;
            let (with_base, with_own) = (&mut self.with_base[b][..], &mut self.with_own[b]);
            vectorised(BlockSums { rows: &rows, e, lanes: &lanes, with_base, with_own });
        }
        Ok(())
    }

    /// The matrices of all groups, in order.
    pub fn done(self) -> Vec<GroupGram> {
        let size = self.packed.width + 1;
        let mut out = Vec::new();
        for (b, groups) in self.blocks.iter().enumerate() {
            let mut first = 0;
            for g in groups {
                let k = g.len();
                let base = (0..size).flat_map(|i| (0..k).map(move |j| (i, j)));
                let base = base.map(|(i, j)| self.with_base[b][i][first + j]).collect();
                let own = |i: usize, j: usize| self.with_own[b][i.abs_diff(j)][first + i.min(j)];
                let own = (0..k).flat_map(|i| (0..k).map(move |j| own(i, j))).collect();
                out.push(GroupGram { size: k, base, own });
                first += k;
            }
        }
        out
    }
}

type Wide = [f64; LANES];

/// Products of the base, lower half.
struct BaseSums<'a> {
    rows: &'a [usize],
    e: &'a [f64],
    size: usize,
    products: &'a mut [f64],
}

impl WithSimd for BaseSums<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let size = self.size;
        for k in self.rows {
            let x = &self.e[size * k..size * (k + 1)];
            for i in 0..size {
                let sums = &mut self.products[size * i..size * i + i + 1];
                for (s, y) in sums.iter_mut().zip(x) {
                    *s += x[i] * y;
                }
            }
        }
    }
}

/// Products of a block of groups.
struct BlockSums<'a> {
    rows: &'a [usize],
    e: &'a [f64],
    lanes: &'a [Lane],
    with_base: &'a mut [Wide],
    with_own: &'a mut [Wide; GROUP],
}

impl WithSimd for BlockSums<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let size = self.with_base.len();
        for k in self.rows {
            let mut l = [0.0; LANES];
            for j in 0..LANES {
                l[j] = f64::from(self.lanes[*k][j]);
            }
            for (sums, x) in self.with_base.iter_mut().zip(&self.e[size * k..size * (k + 1)]) {
                for j in 0..LANES {
                    sums[j] += x * l[j];
                }
            }
            for d in 0..GROUP {
                let sums = &mut self.with_own[d];
                for j in 0..LANES - d {
                    sums[j] += l[j] * l[j + d];
                }
            }
        }
    }
}

fn vectorised(sums: impl WithSimd<Output = ()>) {
    Arch::new().dispatch(sums);
}
