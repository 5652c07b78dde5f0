//! No allocation after construction.
#![allow(unsafe_code)] // an allocator that counts
#![allow(missing_docs, clippy::unwrap_used)]

use crate::common::{Block, VanDerPol};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use trueup_numerics::Driver;
use trueup_numerics::driver::{DriverMemory, DriverOptions, DriverState, Flow, Solver, StepInputs};
use trueup_numerics::hybrid::Hybrid;

thread_local!(static COUNT: Cell<usize> = const { Cell::new(0) });

struct Counting;

// SAFETY: passes everything on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        // SAFETY: the caller's guarantee is passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        // SAFETY: the caller's guarantee is passed on.
        unsafe { System.dealloc(p, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations<M: Hybrid>(model: &M, p: &[f64], solver: Solver) -> usize {
    let n = model.sizes();
    let (mut t, mut x, mut u, mut modes) = (0.0, vec![0.0; n.states], vec![0.0; n.inputs], vec![0; n.modes]);
    let mut memory = DriverMemory::default();
    let mut driver =
        Driver::new(n, &[], DriverOptions { solver, max_step: 1e-3, ..DriverOptions::default() });
    let mut s = DriverState { t: &mut t, x: &mut x, u: &mut u, p, modes: &mut modes, memory: &mut memory };
    let before = COUNT.get();
    driver.initialise(model, &mut s).unwrap();
    let mut steps = 0;
    for k in 1..=20 {
        let end = 0.1 * f64::from(k);
        steps += driver
            .advance_to(model, &mut s, end, StepInputs::Hold, &mut |_| Flow::Continue)
            .unwrap()
            .accepted;
    }
    assert!(steps > 1000);
    COUNT.get() - before
}

#[test]
fn none_after_construction() {
    for solver in
        [Solver::Explicit, Solver::Stiff, Solver::FixedEuler, Solver::FixedExplicit, Solver::FixedStiff]
    {
        assert_eq!(allocations(&Block, &Block::P, solver), 0, "{solver:?}");
    }
    assert_eq!(allocations(&VanDerPol, &[], Solver::Stiff), 0);
    assert!(COUNT.get() > 0);
}
