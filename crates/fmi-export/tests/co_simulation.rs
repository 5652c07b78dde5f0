//! Co-Simulation through the C functions: results, events, event mode, early return, intermediate update.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]
use crate::common::*;
use core::ffi::c_void;
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;

/// Time of the first impact and height of the bouncing ball at `t` (before the second one).
fn ball(t: f64) -> (f64, f64) {
    let (g, e, h) = (9.81_f64, 0.7, 1.0);
    let impact = (2.0 * h / g).sqrt();
    let s = t - impact;
    (impact, if s < 0.0 { h - 0.5 * g * t * t } else { e * g * impact * s - 0.5 * g * s * s })
}

#[test]
fn both_versions_bounce_exactly() {
    let journal = Journal::default();
    let (c2, c3) = (new2(&journal, fmi2CoSimulation), simple3_cs(&journal));
    init2(c2, 1e-10);
    init3(c3, 1e-10);
    for k in 0..60 {
        let t = f64::from(k) * 0.01;
        assert_eq!(unsafe { fmi2DoStep(c2, t, 0.01, fmi2True) }, fmi2OK);
        assert_eq!(step3(c3, t, 0.01), (fmi3OK, false, false, t + 0.01));
        let exact = ball(t + 0.01).1;
        assert!((get2(c2, vr::HEIGHT) - exact).abs() < 1e-9, "{t}");
        assert_eq!(get2(c2, vr::HEIGHT), get3::<1>(c3, vr::HEIGHT)[0]);
    }
    unsafe {
        assert_eq!(fmi2Terminate(c2), fmi2OK);
        fmi2FreeInstance(c2);
        assert_eq!(fmi3Terminate(c3), fmi3OK);
        fmi3FreeInstance(c3);
    }
    let events = journal.take();
    assert_eq!(events.len(), 2, "{events:?}");
    assert!(events.iter().all(|e| e.1 == "logEvents" && e.2.contains("0.4515")));
}

#[test]
fn event_mode_stops_at_the_event_and_the_importer_handles_it() {
    let journal = Journal::default();
    let c = new3_cs(&journal, true, true, &[], None, journal.environment(), Some(log3));
    init3(c, 1e-10);
    assert_eq!(update3(c), None);
    assert_eq!(unsafe { fmi3EnterStepMode(c) }, fmi3OK);
    let (status, event, early, t) = step3(c, 0.0, 1.0);
    assert_eq!((status, event, early), (fmi3OK, true, true));
    assert!((t - ball(0.0).0).abs() < 1e-9, "{t}");
    let before = get3::<5>(c, vr::STATE)[1];
    assert_eq!(unsafe { fmi3EnterEventMode(c) }, fmi3OK);
    assert_eq!(update3(c), None);
    let after = get3::<5>(c, vr::STATE)[1];
    assert!((after + 0.7 * before).abs() < 1e-12 && after > 0.0, "{before} {after}");
    assert_eq!(unsafe { fmi3EnterStepMode(c) }, fmi3OK);
    let (status, event, early, end) = step3(c, t, 0.1);
    assert_eq!((status, event, early, end), (fmi3OK, false, false, t + 0.1));
    assert!((get3::<1>(c, vr::HEIGHT)[0] - ball(end).1).abs() < 1e-9);
    unsafe { fmi3FreeInstance(c) };
}

#[test]
fn a_sample_due_at_the_end_of_a_step_sees_the_inputs_set_then() {
    let journal = Journal::default();
    let c = simple3_cs(&journal);
    assert_eq!(set3(c, vr::SAMPLE_PERIOD, &[0.1]), fmi3OK);
    init3(c, 1e-8);
    for k in 0..5 {
        let force = f64::from(k) + 1.0;
        assert_eq!(set3(c, vr::FORCE, &[force]), fmi3OK);
        // The sample at the start of the step: visible at once, and after the step.
        assert_eq!(get3::<1>(c, vr::HELD), [force]);
        let t = f64::from(k) * 0.1;
        assert_eq!(step3(c, t, 0.1).0, fmi3OK);
        assert_eq!(get3::<5>(c, vr::STATE)[4], force, "step {k}");
    }
    unsafe { fmi3FreeInstance(c) };
    // In event mode it is reported to the importer.
    let c = new3_cs(&journal, true, true, &[], None, journal.environment(), Some(log3));
    assert_eq!(set3(c, vr::SAMPLE_PERIOD, &[0.1]), fmi3OK);
    init3(c, 1e-8);
    assert_eq!(update3(c), Some(0.1));
    assert_eq!(unsafe { fmi3EnterStepMode(c) }, fmi3OK);
    assert_eq!(step3(c, 0.0, 0.1), (fmi3OK, true, false, 0.1));
    assert_eq!(set3(c, vr::FORCE, &[7.0]), fmi3OK);
    assert_eq!(unsafe { fmi3EnterEventMode(c) }, fmi3OK);
    assert_eq!(update3(c), Some(0.2));
    assert_eq!(get3::<1>(c, vr::HELD), [7.0]);
    unsafe { fmi3FreeInstance(c) };
}

#[derive(Default)]
struct Importer {
    instance: std::cell::Cell<*mut c_void>,
    times: std::cell::RefCell<Vec<f64>>,
    early_at: std::cell::Cell<Option<f64>>,
    refused: std::cell::Cell<i32>,
}

unsafe extern "C" fn intermediate(
    e: *mut c_void,
    t: f64,
    set: fmi3Boolean,
    get: fmi3Boolean,
    finished: fmi3Boolean,
    can_return: fmi3Boolean,
    early: *mut fmi3Boolean,
    early_time: *mut f64,
) {
    let me = unsafe { &*e.cast::<Importer>() };
    assert!(bool::from(set) && bool::from(get) && bool::from(finished));
    me.times.borrow_mut().push(t);
    let c = me.instance.get();
    // Reading and setting from within; everything else is refused.
    let [height] = get3::<1>(c, vr::HEIGHT);
    assert!((height - ball(t).1).abs() < 1e-7);
    assert_eq!(set3(c, vr::FORCE, &[t]), fmi3OK);
    assert_eq!(set3(c, vr::GRAVITY, &[1.0]), fmi3Error);
    me.refused.set(step3(c, t, 0.1).0.0);
    if let Some(at) = me.early_at.get() {
        assert!(bool::from(can_return));
        unsafe {
            *early = fmi3True;
            *early_time = at;
        }
    }
}

#[test]
fn intermediate_update_reads_sets_and_returns_early() {
    let me = Importer::default();
    let journal = Journal::default();
    let environment = core::ptr::from_ref(&me).cast_mut().cast();
    let c = new3_cs(&journal, false, true, &[vr::FORCE, vr::HEIGHT], Some(intermediate), environment, None);
    me.instance.set(c);
    init3(c, 1e-9);
    assert_eq!(step3(c, 0.0, 0.6), (fmi3OK, false, false, 0.6));
    assert_eq!(me.refused.get(), fmi3Error.0);
    {
        let times = me.times.borrow();
        assert!(
            times.len() > 3 && times.windows(2).all(|w| w[0] <= w[1]) && times.last() == Some(&0.6),
            "{times:?}"
        );
    }
    assert_eq!(get3::<1>(c, vr::FORCE), [0.6]);
    me.early_at.set(Some(0.63));
    let (status, event, early, t) = step3(c, 0.6, 0.2);
    assert_eq!((status, event, early), (fmi3OK, false, true));
    assert!((0.6..=0.8).contains(&t), "{t}");
    unsafe { fmi3FreeInstance(c) };
}

#[test]
fn input_and_output_derivatives() {
    let journal = Journal::default();
    let c = new2(&journal, fmi2CoSimulation);
    init2(c, 1e-10);
    unsafe {
        // q'' = F t - 4 q - 0.1 q', compared with the force given in small pieces.
        let order = 1;
        assert_eq!(set2(c, vr::FORCE, 0.0), fmi2OK);
        assert_eq!(fmi2SetRealInputDerivatives(c, &vr::FORCE, 1, &order, &2.0), fmi2OK);
        assert_eq!(fmi2DoStep(c, 0.0, 0.4, fmi2True), fmi2OK);
        assert!((get2(c, vr::FORCE) - 0.8).abs() < 1e-15);
        let refs = [vr::ENERGY, vr::SWING];
        let mut slope = [0.0; 2];
        assert_eq!(
            fmi2GetRealOutputDerivatives(c, refs.as_ptr(), 2, [1, 1].as_ptr(), slope.as_mut_ptr()),
            fmi2OK
        );
        // d/dt (g h + v^2/2) = 0 in free fall, so what is left is d/dt (F sin t).
        assert!((slope[0] - (0.8 * 0.4_f64.cos() + 2.0 * 0.4_f64.sin())).abs() < 1e-9, "{slope:?}");
        assert_eq!(slope[1], get2(c, vr::STATE + 3));
        let fine = new2(&journal, fmi2CoSimulation);
        init2(fine, 1e-10);
        for k in 0..4000 {
            let t = f64::from(k) * 1e-4;
            assert_eq!(set2(fine, vr::FORCE, 2.0 * (t + 0.5e-4)), fmi2OK);
            assert_eq!(fmi2DoStep(fine, t, 1e-4, fmi2True), fmi2OK);
        }
        assert!((get2(fine, vr::STATE + 2) - get2(c, vr::STATE + 2)).abs() < 1e-8);
        // The slope ends with its step.
        assert_eq!(fmi2DoStep(c, 0.4, 0.01, fmi2True), fmi2OK);
        assert_eq!(get2(c, vr::FORCE), get2(c, vr::FORCE).max(0.8));
        assert!((get2(c, vr::FORCE) - 0.8).abs() < 1e-15);
        assert_eq!(fmi2SetRealInputDerivatives(c, &vr::FORCE, 1, &2, &2.0), fmi2Error);
        assert_eq!(fmi2SetRealInputDerivatives(c, &vr::ENABLE, 1, &1, &2.0), fmi2Error);
        fmi2FreeInstance(c);
        fmi2FreeInstance(fine);
    }
}

#[test]
fn a_step_that_cannot_go_on() {
    let journal = Journal::default();
    let (c2, c3) = (new2(&journal, fmi2CoSimulation), simple3_cs(&journal));
    unsafe {
        assert_eq!(fmi2SetInteger(c2, &vr::TRAP, 1, &2), fmi2OK);
        assert_eq!(fmi3SetInt32(c3, &vr::TRAP, 1, &2, 1), fmi3OK);
        init2(c2, 1e-8);
        init3(c3, 1e-8);
        let before = get3::<5>(c3, vr::STATE);
        assert_eq!(fmi2DoStep(c2, 0.0, 1.0, fmi2True), fmi2Discard);
        let (status, text) = journal.last();
        assert!(status == 2 && text.contains("rate[") && text.contains("not finite"), "{text}");
        let mut last = 0.0;
        assert_eq!(fmi2GetRealStatus(c2, fmi2LastSuccessfulTime, &mut last), fmi2OK);
        assert!(last > 0.49 && last <= 0.5, "{last}");
        assert_eq!(get2(c2, vr::TIME), last);
        assert_eq!(fmi2DoStep(c2, last, 0.1, fmi2True), fmi2Error);
        // FMI 3.0: as before the call.
        assert_eq!(step3(c3, 0.0, 1.0).0, fmi3Discard);
        assert_eq!(get3::<5>(c3, vr::STATE), before);
        assert_eq!(step3(c3, 0.0, 0.4).0, fmi3OK);
        // No progress at all: Error.
        assert_eq!(fmi3SetInt32(c3, &vr::TRAP, 1, &3, 1), fmi3OK);
        assert_eq!(step3(c3, 0.4, 0.1).0, fmi3Error);
        assert_eq!(fmi3SetInt32(c3, &vr::TRAP, 1, &0, 1), fmi3OK);
        assert_eq!(step3(c3, 0.4, 0.1).0, fmi3OK);
        fmi2FreeInstance(c2);
        fmi3FreeInstance(c3);
    }
}
