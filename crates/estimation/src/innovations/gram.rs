//! Gram matrices of whitened innovations.
//!
//! The base (data, nuisances, causes that are chosen) has a full matrix; a group next to it only its products with the base and with
//! itself, which is all that the evidence of base and group needs. Sums are in double precision: compared with a strong effect the
//! evidence is a small difference of large sums.

use std::cell::RefCell;
use std::rc::Rc;

use pulp::{Arch, Simd, WithSimd};

use super::column::{self, FilterColumn};
use super::filter::data_innovations;
use super::filter_data::{DataColumn, FilterGains, FilterInput, FilterLane, LANES, LaneBlock, LaneStream};
use super::lanes::{pass_streams, single_rows};

/// Numbers that are summed side by side.
const STRIDE: usize = 8;
/// Numbers of so many columns, filled up to whole vectors.
fn stride(columns: usize) -> usize {
    columns.next_multiple_of(STRIDE)
}
/// Rows after which sums of a block go back to memory.
const ROWS: usize = 32;

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
    /// Columns of the base, filled up to whole vectors.
    pub fn stride(&self) -> usize {
        stride(self.size)
    }
    /// Product of two columns.
    pub fn product(&self, i: usize, j: usize) -> f64 {
        self.products[self.size * i + j]
    }
}

/// Gains of a recording with the variances of its readings, as [`FilterGains::gain`] and [`FilterGains::variance`].
pub type SharedGains = (Rc<Vec<f64>>, Rc<Vec<f64>>);

/// Base of a pass at some intensities, kept for further groups.
#[derive(Debug, Default)]
pub struct PassedBase {
    /// Its Gram matrix.
    pub gram: BaseGram,
    /// Gains of each recording.
    pub gains: Vec<SharedGains>,
    /// Whitened innovations of each recording by reading, [`BaseGram::stride`] numbers each, data first.
    pub innovations: Vec<Vec<f64>>,
}

impl PassedBase {
    /// Gram matrices of groups in addition to the base; `input`: what the filter of each recording takes at the intensities of the
    /// pass.
    pub fn groups<'i>(
        &self,
        packed: &PackedColumns,
        groups: &[&[FilterColumn]],
        input: impl Fn(usize) -> FilterInput<'i>,
    ) -> Vec<GroupGram> {
        let mut sums = GroupSums::new(packed, groups);
        for (k, e) in self.innovations.iter().enumerate() {
            sums.pass(k, &self.gains_of(k, input(k)), e);
        }
        sums.done()
    }
    /// Gains of a recording with what its filter takes.
    pub fn gains_of<'i>(&self, recording: usize, input: FilterInput<'i>) -> FilterGains<'i> {
        let (gain, variance) = self.gains[recording].clone();
        FilterGains { input, gain, variance, predicted: Vec::new() }
    }
    /// A column of the base by what it leaves of the innovations, by recording and reading. [`PassedBase::multiply`] comes after it.
    pub fn replace(&mut self, column: usize, by: impl Fn(usize, usize) -> f64) {
        let stride = self.gram.stride();
        for (r, rows) in self.innovations.iter_mut().enumerate() {
            rows.chunks_mut(stride).enumerate().for_each(|(at, row)| row[column] = by(r, at));
        }
    }
    /// Products of the innovations once more.
    pub fn multiply(&mut self) {
        let (n, stride) = (self.gram.size, self.gram.stride());
        self.gram.products.fill(0.0);
        for row in self.innovations.iter().flat_map(|rows| rows.chunks(stride)) {
            for (a, products) in row[..n].iter().zip(self.gram.products.chunks_mut(n)) {
                products.iter_mut().zip(row).for_each(|(p, b)| *p += a * b);
            }
        }
    }
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
    buffers: RefCell<PassBuffers>,
}

/// What a pass writes, kept for the next one: new memory costs as much as the sums.
#[derive(Clone, Debug, Default)]
struct PassBuffers {
    lanes: [Vec<FilterLane>; 2],
    rows: [Vec<f32>; 2],
    innovations: [Vec<f64>; 2],
}

impl PackedColumns {
    /// Of what was read, one entry a recording, and the columns of the base.
    pub fn new(data: Vec<DataColumn>, base: &[FilterColumn], channels: usize) -> Self {
        let coordinates = data.first().map_or(0, |d| d.forces.len());
        let columns: Vec<&FilterColumn> = base.iter().collect();
        let blocks =
            |r: usize| columns.chunks(LANES).map(|c| column::beside(c, r, coordinates, channels)).collect();
        let blocks = (0..data.len()).map(blocks).collect();
        Self { data, base: blocks, width: base.len(), coordinates, channels, buffers: RefCell::default() }
    }

    /// An empty matrix for the base.
    pub fn nothing(&self) -> BaseGram {
        let size = self.width + 1;
        BaseGram { size, products: vec![0.0; size * size], ..BaseGram::default() }
    }

    /// Adds a recording to the matrices of the base (their lower half), one for each of `gains`; `take` gets the innovations of
    /// data and base for each, [`BaseGram::stride`] numbers a reading.
    pub fn pass_base(
        &self,
        recording: usize,
        gains: &[FilterGains<'_>],
        sums: &mut [BaseGram],
        mut take: impl FnMut(usize, &[f64]),
    ) {
        let Some(one) = gains.first() else { return };
        let rows = one.input.counted_rows();
        let size = self.width + 1;
        let stride = stride(size);
        let PassBuffers { lanes, rows: single, innovations: e } = &mut *self.buffers.borrow_mut();
        for (pair, (gains, sums)) in gains.chunks(2).zip(sums.chunks_mut(2)).enumerate() {
            for (gains, e) in gains.iter().zip(&mut *e) {
                let data = data_innovations(gains, &self.data[recording]);
                e.clear();
                e.resize(stride * data.len(), 0.0);
                rows.iter().for_each(|k| e[stride * k] = data[*k]);
            }
            gains.iter().zip(&mut *single).for_each(|(gains, to)| single_rows(gains, to));
            for (b, block) in self.base[recording].iter().enumerate() {
                let streams = gains.iter().zip(&*single).zip(&mut *lanes);
                let mut streams: Vec<_> =
                    streams.map(|((gains, rows), out)| LaneStream { gains, rows, block, out }).collect();
                pass_streams(&mut streams);
                let width = (self.width - LANES * b).min(LANES);
                for (e, stream) in e.iter_mut().zip(&streams) {
                    for k in &rows {
                        let to = &mut e[stride * k + 1 + LANES * b..][..width];
                        to.iter_mut().zip(&stream.out[*k]).for_each(|(x, l)| *x = f64::from(*l));
                    }
                }
            }
            for (k, ((sum, gains), e)) in sums.iter_mut().zip(gains).zip(&*e).enumerate() {
                vectorised(BaseSums { rows: &rows, e, size, products: &mut sum.products });
                sum.log_variance += rows.iter().map(|k| gains.variance[*k].ln()).sum::<f64>();
                sum.count += rows.len();
                take(2 * pair + k, e);
            }
        }
    }
}

/// Sums of groups next to a base while recordings pass.
pub struct GroupSums<'a> {
    packed: &'a PackedColumns,
    /// Groups that fit side by side.
    blocks: Vec<Vec<&'a [FilterColumn]>>,
    /// By block: products with each column of the base, and with the lane that is 0, 1, .. further, as far as its widest group goes.
    with_base: Vec<Vec<WideProduct>>,
    with_own: Vec<Vec<WideProduct>>,
    /// Groups with more columns than lanes.
    wide: Vec<WideGroup<'a>>,
    /// Where each group is.
    places: Vec<GroupPlace>,
}

/// A group with more columns than lanes.
struct WideGroup<'a> {
    columns: &'a [FilterColumn],
    sums: GroupGram,
}

enum GroupPlace {
    /// In a block, from this lane on.
    Block(usize, usize),
    /// Among the wide ones.
    Wide(usize),
}

impl<'a> GroupSums<'a> {
    /// Nothing yet.
    pub fn new(packed: &'a PackedColumns, groups: &[&'a [FilterColumn]]) -> Self {
        let size = packed.width + 1;
        let mut blocks: Vec<Vec<&'a [FilterColumn]>> = Vec::new();
        let mut with_own: Vec<Vec<WideProduct>> = Vec::new();
        let (mut wide, mut places) = (Vec::new(), Vec::new());
        let mut used = LANES;
        for columns in groups.iter().copied() {
            let k = columns.len();
            if k > LANES {
                places.push(GroupPlace::Wide(wide.len()));
                let sums = GroupGram { size: k, base: vec![0.0; size * k], own: vec![0.0; k * k] };
                wide.push(WideGroup { columns, sums });
                continue;
            }
            if used + k > LANES {
                blocks.push(Vec::new());
                with_own.push(Vec::new());
                used = 0;
            }
            places.push(GroupPlace::Block(blocks.len() - 1, used));
            used += k;
            if let (Some(block), Some(own)) = (blocks.last_mut(), with_own.last_mut()) {
                block.push(columns);
                own.resize(k.max(own.len()), [0.0; LANES]);
            }
        }
        let with_base = vec![vec![[0.0; LANES]; size]; blocks.len()];
        Self { packed, blocks, with_base, with_own, wide, places }
    }

    /// Adds a recording; `e` has the innovations of data and base.
    pub fn pass(&mut self, recording: usize, gains: &FilterGains<'_>, e: &[f64]) {
        let rows = gains.input.counted_rows();
        let packed = self.packed;
        let beside = |columns: &[&FilterColumn]| {
            column::beside(columns, recording, packed.coordinates, packed.channels)
        };
        let mut single = Vec::new();
        single_rows(gains, &mut single);
        let single = &single[..];
        let mut lanes = [Vec::new(), Vec::new()];
        for (b, pair) in self.blocks.chunks(2).enumerate() {
            let columns = |groups: &Vec<&'a [FilterColumn]>| {
                beside(&groups.iter().flat_map(|g| g.iter()).collect::<Vec<_>>())
            };
            let blocks: Vec<LaneBlock> = pair.iter().map(columns).collect();
            let streams = blocks.iter().zip(&mut lanes);
            let mut streams: Vec<_> =
                streams.map(|(block, out)| LaneStream { gains, rows: single, block, out }).collect();
            pass_streams(&mut streams);
            for (stream, b) in streams.iter().zip(2 * b..) {
                let (with_base, with_own) = (&mut self.with_base[b][..], &mut self.with_own[b][..]);
                vectorised(BlockSums { rows: &rows, e, lanes: &*stream.out, with_base, with_own });
            }
        }
        for group in &mut self.wide {
            let mut pieces = Vec::new();
            for columns in group.columns.chunks(LANES) {
                let (block, mut out) = (beside(&columns.iter().collect::<Vec<_>>()), Vec::new());
                pass_streams(&mut [LaneStream { gains, rows: single, block: &block, out: &mut out }]);
                pieces.push(out);
            }
            group.add(&rows, e, &pieces);
        }
    }

    /// The matrices of all groups, in order.
    pub fn done(self) -> Vec<GroupGram> {
        let size = self.packed.width + 1;
        let widths = self.blocks.iter().flat_map(|b| b.iter().map(|g| g.len()));
        let mut widths = widths.collect::<Vec<_>>().into_iter();
        let mut wide: Vec<GroupGram> = self.wide.into_iter().map(|w| w.sums).collect();
        let mut out = Vec::new();
        for place in self.places {
            let (b, first) = match place {
                GroupPlace::Block(b, first) => (b, first),
                GroupPlace::Wide(w) => {
                    out.push(std::mem::take(&mut wide[w]));
                    continue;
                }
            };
            let k = widths.next().unwrap_or(0);
            let base = (0..size).flat_map(|i| (0..k).map(move |j| (i, j)));
            let base = base.map(|(i, j)| self.with_base[b][i][first + j]).collect();
            let own = |i: usize, j: usize| self.with_own[b][i.abs_diff(j)][first + i.min(j)];
            let own = (0..k).flat_map(|i| (0..k).map(move |j| own(i, j))).collect();
            out.push(GroupGram { size: k, base, own });
        }
        out
    }
}

impl WideGroup<'_> {
    /// Adds the innovations of its columns in pieces of [`LANES`]; `e` has those of data and base.
    fn add(&mut self, rows: &[usize], e: &[f64], pieces: &[Vec<FilterLane>]) {
        let k = self.sums.size;
        let size = self.sums.base.len() / k;
        let mut x = vec![0.0; k];
        for row in rows {
            for (x, piece) in x.chunks_mut(LANES).zip(pieces) {
                x.iter_mut().zip(&piece[*row]).for_each(|(x, l)| *x = f64::from(*l));
            }
            let base = &e[stride(size) * row..][..size];
            for (sums, by) in
                self.sums.base.chunks_mut(k).zip(base).chain(self.sums.own.chunks_mut(k).zip(&x))
            {
                sums.iter_mut().zip(&x).for_each(|(sum, x)| *sum += by * x);
            }
        }
    }
}

type WideProduct = [f64; LANES];

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
    fn with_simd<S: Simd>(self, simd: S) {
        let (size, stride) = (self.size, stride(self.size));
        // Rows of the matrix in whole vectors; what is beyond the diagonal is not kept.
        let mut sums = vec![simd.splat_f64s(0.0); size];
        for first in (0..size).step_by(S::F64_LANES) {
            for (i, sum) in sums.iter_mut().enumerate().skip(first) {
                let end = (first + S::F64_LANES).min(size);
                *sum = simd.partial_load_f64s(&self.products[size * i + first..size * i + end]);
            }
            for k in self.rows {
                let x = &self.e[stride * k..stride * (k + 1)];
                let y = S::as_simd_f64s(&x[first..]).0[0];
                for (sum, x) in sums.iter_mut().zip(&x[..size]).skip(first) {
                    *sum = simd.add_f64s(*sum, simd.mul_f64s(simd.splat_f64s(*x), y));
                }
            }
            for (i, sum) in sums.iter().enumerate().skip(first) {
                let all: &[f64] = pulp::bytemuck::cast_slice(core::slice::from_ref(sum));
                let kept = (i + 1 - first).min(all.len());
                self.products[size * i + first..][..kept].copy_from_slice(&all[..kept]);
            }
        }
    }
}

/// Products of a block of groups.
struct BlockSums<'a> {
    rows: &'a [usize],
    e: &'a [f64],
    lanes: &'a [FilterLane],
    with_base: &'a mut [WideProduct],
    with_own: &'a mut [WideProduct],
}

impl WithSimd for BlockSums<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let size = self.with_base.len();
        let stride = stride(size);
        let parts = || (0..LANES).step_by(S::F64_LANES);
        // Zeros behind the lanes, for those that are further.
        let mut wide = [[0.0; 2 * LANES]; ROWS];
        for rows in self.rows.chunks(ROWS) {
            for (l, k) in wide.iter_mut().zip(rows) {
                for j in 0..LANES {
                    l[j] = f64::from(self.lanes[*k][j]);
                }
            }
            let wide = &wide[..rows.len()];
            for (i, sums) in self.with_base.iter_mut().enumerate() {
                for (first, sum) in parts().zip(S::as_mut_simd_f64s(sums).0) {
                    for (l, k) in wide.iter().zip(rows) {
                        let x = simd.splat_f64s(self.e[stride * k + i]);
                        let y = S::as_simd_f64s(&l[first..]).0[0];
                        *sum = simd.add_f64s(*sum, simd.mul_f64s(x, y));
                    }
                }
            }
            for (d, sums) in self.with_own.iter_mut().enumerate() {
                for (first, sum) in parts().zip(S::as_mut_simd_f64s(sums).0) {
                    for l in wide {
                        let x = S::as_simd_f64s(&l[first..]).0[0];
                        let y = S::as_simd_f64s(&l[first + d..]).0[0];
                        *sum = simd.add_f64s(*sum, simd.mul_f64s(x, y));
                    }
                }
            }
        }
    }
}

fn vectorised(sums: impl WithSimd<Output = ()>) {
    Arch::new().dispatch(sums);
}
