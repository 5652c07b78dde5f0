//! Model Exchange through the C functions, several instances, threads, and no allocation once under way.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]
use crate::common::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;

thread_local!(static COUNT: Cell<usize> = const { Cell::new(0) });
struct Counting;
// SAFETY: hands everything on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        unsafe { System.dealloc(p, layout) }
    }
}
#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Explicit midpoint with events located by bisection of the step; the height at the end.
fn simulate(c: fmi3Instance, end: f64) -> f64 {
    let n = 5;
    let (mut x, mut dx, mut z) = ([0.0; 5], [0.0; 5], [0.0; 1]);
    let (mut event, mut stop) = (fmi3False, fmi3False);
    let mut t = 0.0;
    unsafe {
        update3(c);
        assert_eq!(fmi3EnterContinuousTimeMode(c), fmi3OK);
        assert_eq!(fmi3GetContinuousStates(c, x.as_mut_ptr(), n), fmi3OK);
        let mut h = 1e-3_f64;
        while t < end {
            h = h.min(end - t);
            assert_eq!(fmi3GetContinuousStateDerivatives(c, dx.as_mut_ptr(), n), fmi3OK);
            let middle: [f64; 5] = core::array::from_fn(|i| x[i] + 0.5 * h * dx[i]);
            assert_eq!(fmi3SetTime(c, t + 0.5 * h), fmi3OK);
            assert_eq!(fmi3SetContinuousStates(c, middle.as_ptr(), n), fmi3OK);
            assert_eq!(fmi3GetContinuousStateDerivatives(c, dx.as_mut_ptr(), n), fmi3OK);
            let new: [f64; 5] = core::array::from_fn(|i| x[i] + h * dx[i]);
            assert_eq!(fmi3SetTime(c, t + h), fmi3OK);
            assert_eq!(fmi3SetContinuousStates(c, new.as_ptr(), n), fmi3OK);
            assert_eq!(fmi3GetEventIndicators(c, z.as_mut_ptr(), 1), fmi3OK);
            if z[0] <= 0.0 && h > 1e-12 {
                h *= 0.5;
                assert_eq!(fmi3SetTime(c, t), fmi3OK);
                assert_eq!(fmi3SetContinuousStates(c, x.as_ptr(), n), fmi3OK);
                continue;
            }
            (t, x) = (t + h, new);
            assert_eq!(fmi3CompletedIntegratorStep(c, fmi3True, &mut event, &mut stop), fmi3OK);
            if z[0] <= 0.0 {
                assert_eq!(fmi3EnterEventMode(c), fmi3OK);
                update3(c);
                assert_eq!(fmi3EnterContinuousTimeMode(c), fmi3OK);
                assert_eq!(fmi3GetContinuousStates(c, x.as_mut_ptr(), n), fmi3OK);
                h = 1e-3;
            }
        }
    }
    x[0]
}

#[test]
fn an_importer_integrates_over_the_bounce() {
    let journal = Journal::default();
    let c = new3_me(&journal);
    init3(c, 1e-6);
    let mut counts = (0, 0);
    unsafe {
        assert_eq!(fmi3GetNumberOfContinuousStates(c, &mut counts.0), fmi3OK);
        assert_eq!(fmi3GetNumberOfEventIndicators(c, &mut counts.1), fmi3OK);
        let mut nominals = [0.0; 5];
        assert_eq!(fmi3GetNominalsOfContinuousStates(c, nominals.as_mut_ptr(), 5), fmi3OK);
        assert_eq!((counts, nominals), ((5, 1), [2.0; 5]));
    }
    let height = simulate(c, 0.6);
    let (g, impact) = (9.81, (2.0_f64 / 9.81).sqrt());
    let s = 0.6 - impact;
    // The midpoint rule is exact for a parabola; what is left is the located event.
    assert!((height - (0.7 * g * impact * s - 0.5 * g * s * s)).abs() < 1e-9, "{height}");
    unsafe { fmi3FreeInstance(c) };
}

/// 0 belongs to the domain below it, and an indicator shows that: an integrator that ends a step where one is 0 exactly, and takes such a
/// root function out, would lose the event. What was stepped over all the same is searched where the step ends.
#[test]
fn integrators_of_others_cannot_lose_an_event() {
    let journal = Journal::default();
    for height in [0.5, 1e-300, 0.0, -0.0, -1e-300, -0.1] {
        let (due, below) = (height <= 0.0, if height == 0.0 { -1e-100 } else { height });
        let (c3, c2) = (new3_me(&journal), new2(&journal, fmi2ModelExchange));
        init3(c3, 1e-6);
        init2(c2, 1e-6);
        let x = [height, -1.0, 1.0, 0.0, 0.0];
        let (mut z, mut info) = ([[7.0; 1]; 2], fmi2EventInfo::default());
        let (mut event3, mut event2, mut stop3, mut stop2) = (fmi3False, 0, fmi3False, 0);
        unsafe {
            update3(c3);
            assert_eq!(fmi2NewDiscreteStates(c2, &mut info), fmi2OK);
            assert_eq!((fmi3EnterContinuousTimeMode(c3), fmi2EnterContinuousTimeMode(c2)), (fmi3OK, fmi2OK));
            assert_eq!(fmi3SetContinuousStates(c3, x.as_ptr(), 5), fmi3OK);
            assert_eq!(fmi2SetContinuousStates(c2, x.as_ptr(), 5), fmi2OK);
            assert_eq!(fmi3GetEventIndicators(c3, z[0].as_mut_ptr(), 1), fmi3OK);
            assert_eq!(fmi2GetEventIndicators(c2, z[1].as_mut_ptr(), 1), fmi2OK);
            assert_eq!((z[0], z[1], get3::<1>(c3, vr::INDICATOR)), ([below], [below], [below]));
            assert_eq!(fmi3CompletedIntegratorStep(c3, fmi3True, &mut event3, &mut stop3), fmi3OK);
            assert_eq!(fmi2CompletedIntegratorStep(c2, 1, &mut event2, &mut stop2), fmi2OK);
            assert_eq!((event3 != fmi3False, event2 != 0), (due, due), "{height}");
            assert_eq!((stop3 != fmi3False, stop2 != 0), (false, false));
            // It was only tried: nothing has changed.
            let mut after = [0.0; 5];
            assert_eq!(fmi3GetContinuousStates(c3, after.as_mut_ptr(), 5), fmi3OK);
            assert_eq!(after.map(f64::to_bits), x.map(f64::to_bits));
            fmi3FreeInstance(c3);
            fmi2FreeInstance(c2);
        }
    }
}

#[test]
fn threads_have_an_instance_each() {
    let results: Vec<f64> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4)
            .map(|_| {
                scope.spawn(|| {
                    let journal = Journal::default();
                    let c = new3_me(&journal);
                    init3(c, 1e-6);
                    let height = simulate(c, 0.9);
                    unsafe { fmi3FreeInstance(c) };
                    height
                })
            })
            .collect();
        threads.into_iter().map(|t| t.join().unwrap()).collect()
    });
    assert!(results.windows(2).all(|w| w[0].to_bits() == w[1].to_bits()), "{results:?}");
}

#[test]
fn two_instances_do_not_touch_each_other() {
    let journal = Journal::default();
    let (a, b) = (simple3_cs(&journal), simple3_cs(&journal));
    assert_eq!(set3(a, vr::GRAVITY, &[1.0]), fmi3OK);
    init3(a, 1e-8);
    init3(b, 1e-8);
    for k in 0..30 {
        let t = f64::from(k) * 0.01;
        assert_eq!(step3(a, t, 0.01).0, fmi3OK);
        assert_eq!(step3(b, t, 0.01).0, fmi3OK);
    }
    let fallen = |g: f64| 1.0 - 0.5 * g * 0.09;
    assert!((get3::<1>(a, vr::HEIGHT)[0] - fallen(1.0)).abs() < 1e-9);
    assert!((get3::<1>(b, vr::HEIGHT)[0] - fallen(9.81)).abs() < 1e-9);
    unsafe {
        fmi3FreeInstance(a);
        fmi3FreeInstance(b);
    }
}

#[test]
fn nothing_is_allocated_once_under_way() {
    let journal = Journal::default();
    let (cs, me) = (new2(&journal, fmi2CoSimulation), new3_me(&journal));
    init2(cs, 1e-6);
    init3(me, 1e-6);
    unsafe {
        assert_eq!(fmi2SetDebugLogging(cs, 0, 0, core::ptr::null()), fmi2OK);
        assert_eq!(fmi3SetDebugLogging(me, fmi3False, 0, core::ptr::null()), fmi3OK);
        let before = COUNT.get();
        for k in 0..100 {
            let t = f64::from(k) * 0.01;
            assert_eq!(set2(cs, vr::FORCE, t), fmi2OK);
            assert_eq!(fmi2DoStep(cs, t, 0.01, fmi2True), fmi2OK);
            get2(cs, vr::ENERGY);
        }
        assert_eq!(COUNT.get() - before, 0, "Co-Simulation");
        simulate(me, 0.6);
        assert_eq!(COUNT.get() - before, 0, "Model Exchange");
        fmi2FreeInstance(cs);
        fmi3FreeInstance(me);
    }
}
