//! A link that bends between the sweeps: its modes are one joint of many degrees of freedom between the body and what its end
//! carries, and go where the sweep from the tips passes them (LNK-3).

use super::bent::CarryingLinkEnd;
use super::flexible::Modal;
use super::snapshot::RobotSnapshot;
use super::spatial::{Articulated, SpatialMotion, SpatialWrench};
use super::{MAX_APPENDAGES, MAX_MODES_OF_LINK};
use arrayvec::ArrayVec;
use trueup_numerics::Scalar;

/// What is kept of a mode on the way from the tips.
#[derive(Clone, Copy)]
struct ModeRow<T> {
    /// What it meets of the body's acceleration.
    coupling: SpatialWrench<T>,
    /// What is left to accelerate it.
    rest: T,
    /// 1 / (what its own acceleration meets).
    inverse: T,
    /// What it meets of the accelerations of the modes behind it.
    beside: [T; MAX_MODES_OF_LINK],
}

/// What links carry, and their modes, on the way from the tips.
pub(super) struct Bending<T> {
    carried: ArrayVec<(Articulated<T>, SpatialWrench<T>), MAX_APPENDAGES>,
    rows: Modal<ModeRow<T>>,
    /// Of each link the first of its rows.
    first: [usize; MAX_APPENDAGES],
}

impl<T: Scalar> Bending<T> {
    #[inline]
    pub(super) fn new() -> Self {
        Self { carried: ArrayVec::new(), rows: ArrayVec::new(), first: [0; MAX_APPENDAGES] }
    }
    /// Nothing is carried yet.
    pub(super) fn begin(&mut self, now: &RobotSnapshot<'_, T>) {
        let nothing = Articulated {
            angular: [[T::zero(); 3]; 3],
            mixed: [[T::zero(); 3]; 3],
            linear: [[T::zero(); 3]; 3],
        };
        let ends = now.flexing.ends.map_or(0, |e| e.count());
        self.carried.extend((0..ends).map(|_| (nothing, SpatialWrench::zero())));
    }
    /// Articulated inertia and bias of what this end carries, axes of the link's body.
    pub(super) fn carried(
        &mut self,
        end: &CarryingLinkEnd<'_, T>,
    ) -> (&mut Articulated<T>, &mut SpatialWrench<T>) {
        let (inertia, bias) = &mut self.carried[end.number];
        (inertia, bias)
    }
}

/// Makes of a body, its link and what that carries one articulated body: `inertia` and `bias` are the body's own, its link's
/// matter with them. All children of the body are there.
pub(super) fn eliminate<T: Scalar>(
    now: &RobotSnapshot<'_, T>,
    body: usize,
    end: CarryingLinkEnd<'_, T>,
    (inertia, bias): (&mut Articulated<T>, &mut SpatialWrench<T>),
    bending: &mut Bending<T>,
) {
    let flexing = &now.flexing;
    let (carried, resting) = bending.carried[end.number];
    let outer = carried.times(end.bias(now.placed[body].velocity)).plus(resting);
    inertia.add(&carried);
    *bias = bias.plus(outer);
    let from = bending.rows.len();
    bending.first[end.number] = from;
    for (row, (j, column)) in end.columns().enumerate() {
        let met = carried.times(column); // (LNK-3)
        let mut beside = [T::zero(); MAX_MODES_OF_LINK];
        // Symmetric: what is before the row's own place is not read.
        for (to, (_, other)) in beside.iter_mut().zip(end.columns()).skip(row) {
            *to = other.power(met);
        }
        beside[row] += flexing.modes[j].mass;
        bending.rows.push(ModeRow {
            coupling: flexing.coupling[j].plus(met),
            rest: flexing.force[j] - flexing.bias[j] - column.power(outer), // (LNK-3)
            inverse: T::zero(),
            beside,
        });
    }
    let rows = &mut bending.rows[from..];
    let count = rows.len();
    for k in 0..count {
        let (done, behind) = rows.split_at_mut(k + 1);
        let pivot = &mut done[k];
        pivot.inverse = T::one() / pivot.beside[k];
        inertia.take(&pivot.coupling, pivot.inverse);
        *bias = bias.plus(pivot.coupling.times(pivot.rest * pivot.inverse));
        for (m, row) in behind.iter_mut().enumerate() {
            let share = pivot.beside[k + 1 + m] * pivot.inverse;
            row.coupling = row.coupling.minus(pivot.coupling.times(share));
            row.rest -= share * pivot.rest;
            let there = k + 1 + m..count;
            let own = row.beside[there.clone()].iter_mut();
            own.zip(&pivot.beside[there]).for_each(|(own, met)| *own -= share * *met);
        }
    }
}

/// Accelerations of a link's modes, of a body that accelerates so.
pub(super) fn resolve<T: Scalar>(
    end: &CarryingLinkEnd<'_, T>,
    body: SpatialMotion<T>,
    bending: &Bending<T>,
    modal: &mut [T],
) {
    let (first, last) = end.end.modes;
    let rows = &bending.rows[bending.first[end.number]..][..last - first];
    for (k, row) in rows.iter().enumerate().rev() {
        let mut met = row.rest - body.power(row.coupling);
        (k + 1..rows.len()).for_each(|c| met -= row.beside[c] * modal[first + c]);
        modal[first + k] = met * row.inverse;
    }
}
