//! Our own joint as an FMU through its events, against the model that it was made of: stick and slip. The same against an integrator
//! of others: `tests/python/test_hybrid_events.py`.

use trueup_models::joint::TwoMassJoint;
use trueup_numerics::driver::{
    Driver, DriverMemory, DriverMoment, DriverOptions, DriverState, Flow, StepInputs,
};
use trueup_numerics::hybrid::Hybrid as _;
use trueup_plant::Plant as _;

use super::hybrid_derivatives::oscillator;
use super::hybrid_fmu::{begin, fmus, in_order, joint};
use super::hybrid_run::{HeldInputs, run};

const TOLERANCE: f64 = 1e-11;
const STOP: f64 = 1.2;

/// Events and last states by the driver of our models.
fn by_the_model(p: &[f64], inputs: &[HeldInputs]) -> (Vec<f64>, Vec<f64>) {
    let model = TwoMassJoint::new(true, &[] as &[&str]).unwrap();
    let n = model.sizes();
    let options = DriverOptions { tolerance: TOLERANCE, ..DriverOptions::default() };
    let mut driver = Driver::new(n, &vec![1e-3; n.states], options);
    let (mut t, mut memory, mut events) = (0.0, DriverMemory::default(), Vec::new());
    let (mut x, mut u, mut modes) = (vec![0.0; n.states], inputs[0].1.clone(), vec![0; n.modes]);
    let mut s = DriverState { t: &mut t, x: &mut x, u: &mut u, p, modes: &mut modes, memory: &mut memory };
    driver.initialise(&model, &mut s).unwrap();
    for (k, (begin, held)) in inputs.iter().enumerate() {
        s.u.copy_from_slice(held);
        let end = inputs.get(k + 1).map_or(STOP, |next| next.0);
        let seen = &mut |view: trueup_numerics::driver::DriverView| {
            if view.moment == DriverMoment::Event && view.t > *begin {
                events.push(view.t);
            }
            Flow::Continue
        };
        driver.advance_to(&model, &mut s, end, StepInputs::Hold, seen).unwrap();
    }
    (events, x)
}

#[test]
fn stick_and_slip_are_those_of_the_model() {
    let model = joint();
    let table = trueup_plant::Plant::table(&model);
    let mut p: Vec<f64> = table.parameters.iter().map(|q| q.start).collect();
    let k = |name: &str| table.parameter(name).unwrap();
    p[k("staticFriction")] = 1.8 * p[k("coulombFriction")];
    let level = p[k("staticFriction")] / p[k("torqueConstant")];
    // It sticks, breaks away, turns round, comes to rest.
    let currents = [(0.0, 0.5), (0.1, 1.3), (0.2, 0.0), (0.5, -1.3), (0.6, 1.1), (0.75, -1.2), (0.9, 0.0)];
    let inputs: Vec<HeldInputs> = currents.iter().map(|(t, i)| (*t, vec![i * level, 0.0])).collect();
    let (events, x) = by_the_model(&p, &inputs);
    assert!(events.len() >= 3, "{events:?}");
    for fmu in fmus() {
        let own = run(&fmu, &in_order(table, fmu.table(), &p), &inputs, STOP, TOLERANCE).unwrap();
        assert_eq!(own.events.len(), events.len(), "{:?} {events:?}", own.events);
        let late = own.events.iter().zip(&events).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
        let off = own.x.iter().zip(&x).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs() / b.abs().max(1e-3)));
        println!(
            "{}: {} events, times within {late:.1e} s, states within {off:.1e}",
            fmu.fmu().file().display(),
            events.len()
        );
        assert!(late <= 1e-9 && off <= 1e-8, "{late:e} {off:e}");
    }
}

#[test]
fn an_event_that_the_fmu_has_ended_is_not_begun_again() {
    for version in [2, 3] {
        let Some((_folder, fmu)) = oscillator(version) else { return };
        let (mut modes, _) = begin(&fmu, &[], &[]);
        let mut x = [1.0, 2.0];
        // States are new, so that a caller makes another pass; then it has another event at the same time.
        for after in [-1.0, 0.5] {
            assert!(fmu.update(0.5, &mut x, &[], &[], &mut modes).states);
            assert!(fmu.update(0.5, &mut x, &[], &[], &mut modes).settled());
            assert_eq!((x, fmu.failure()), ([1.0, after], None));
        }
    }
}
