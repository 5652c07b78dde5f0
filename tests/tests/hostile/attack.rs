//! The generator: which call comes next, and with what.

use super::data::Pool;
use super::fmu::Library;
use super::random::Random;
use super::subject::{Phase, Subject, ask};
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;

/// Groups of calls.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Act {
    Initialize,
    ExitInitialization,
    Configuration,
    EnterEvent,
    EnterContinuous,
    EnterStep,
    Update,
    SetTime,
    SetStates,
    ReadStates,
    Rates,
    Indicators,
    Nominals,
    Completed,
    DoStep,
    Get,
    Set,
    Tune,
    Terminate,
    Reset,
    States,
    Bytes,
    Derivatives,
    OutputDerivatives,
    InputDerivatives,
    StepStatus,
    Logging,
    Clocks,
    OtherTypes,
    Structure,
}
use Act::*;

const ALL: &[Act] = &[
    Initialize,
    ExitInitialization,
    Configuration,
    EnterEvent,
    EnterContinuous,
    EnterStep,
    Update,
    SetTime,
    SetStates,
    ReadStates,
    Rates,
    Indicators,
    Nominals,
    Completed,
    DoStep,
    Get,
    Set,
    Tune,
    Terminate,
    Reset,
    States,
    Bytes,
    Derivatives,
    OutputDerivatives,
    InputDerivatives,
    StepStatus,
    Logging,
    Clocks,
    OtherTypes,
    Structure,
];
/// Legal in every phase.
const ALWAYS: &[Act] = &[Get, States, Bytes, Logging, Structure];

fn fitting(s: &Subject) -> &'static [Act] {
    match (s.phase, s.is_me()) {
        (Phase::Instantiated, _) => &[Initialize, Initialize, Set, Tune],
        (Phase::Configuration, _) => &[Configuration, Set],
        (Phase::Initialization, _) => &[ExitInitialization, ExitInitialization, Set, Tune, Derivatives],
        (Phase::Event, true) => &[Update, EnterContinuous, Set, Tune, Derivatives, Rates],
        (Phase::Event, false) => &[Update, EnterStep, EnterStep, Set, Tune, Derivatives],
        (Phase::Continuous, _) => &[
            SetTime,
            SetStates,
            ReadStates,
            Rates,
            Rates,
            Indicators,
            Completed,
            EnterEvent,
            Set,
            Derivatives,
            Nominals,
        ],
        (Phase::Step, _) => &[
            DoStep,
            DoStep,
            DoStep,
            Set,
            Tune,
            Derivatives,
            OutputDerivatives,
            InputDerivatives,
            EnterEvent,
            StepStatus,
        ],
        (Phase::Terminated, _) => &[Reset, Reset, Get],
    }
}

/// One random call, legal or not.
pub fn attack(s: &mut Subject, r: &mut Random, pool: &mut Pool) {
    let act = match r.below(20) {
        0..=13 => r.pick(fitting(s)),
        14..=16 => r.pick(ALWAYS),
        _ => r.pick(ALL),
    };
    match act {
        Initialize => {
            let tolerance =
                r.pick(&[1e-6, 1e-6, 1e-4, 1e-9, 1e-300, 0.0, -1.0, f64::NAN, f64::INFINITY, 1e3]);
            let start = if r.once_in(8) { r.odd() } else { 0.0 };
            let stop = if r.once_in(4) { Some(r.number()) } else { None };
            s.wrong = !(tolerance.is_finite() && tolerance > 0.0 && start.is_finite());
            let status = s.initialize(tolerance, start, stop);
            s.wrong = false;
            if status == 0 && !start.is_finite() {
                s.fail("a start time that is no number was taken");
            }
        }
        ExitInitialization => drop(s.exit_initialization()),
        Configuration => configuration(s, r),
        EnterEvent => drop(s.enter(Phase::Event)),
        EnterContinuous => {
            s.wrong = !s.is_me();
            s.enter(Phase::Continuous);
        }
        EnterStep => {
            let phase = if s.fmu.is_fmi3() { Phase::Step } else { Phase::Continuous };
            s.wrong = s.is_me() == s.fmu.is_fmi3();
            s.enter(phase);
        }
        Update if r.once_in(12) => update_into_null(s),
        Update => drop(s.update()),
        SetTime => {
            let t = match r.below(6) {
                0 => r.odd(),
                1 => s.t - 1e-3,
                _ => s.t + 1e-3 * r.unit(),
            };
            s.wrong = !t.is_finite() || !s.is_me();
            s.set_time(t);
        }
        SetStates => {
            let n = if r.once_in(10) { r.below(40) } else { s.fmu.states };
            let mut x = vec![0.0; n];
            let known = n == s.fmu.states && s.phase == Phase::Continuous && s.states(&mut x) == 0;
            for x in &mut x {
                *x = if known && !r.once_in(20) { *x + 1e-3 * (r.unit() - 0.5) } else { r.number() };
            }
            s.wrong = n != s.fmu.states || x.iter().any(|v| !v.is_finite()) || !s.is_me();
            s.set_states(&x);
        }
        ReadStates | Rates | Indicators => {
            let own = if act == Indicators { s.fmu.indicators } else { s.fmu.states };
            let n = if r.once_in(10) { r.below(40) } else { own };
            let mut values = vec![f64::NAN; n];
            s.wrong = n != own || !s.is_me();
            match act {
                ReadStates => s.states(&mut values),
                Rates => s.rates(&mut values),
                _ => s.indicators(&mut values),
            };
        }
        Nominals => s.nominals(r),
        Completed => completed(s, r),
        DoStep => do_step(s, r),
        Get => s.read(r),
        Set => s.write(r, false),
        Tune => s.write(r, true),
        Terminate if r.once_in(3) => drop(s.terminate()),
        Reset if s.phase == Phase::Terminated || r.once_in(3) => {
            if s.reset() != 0 {
                s.fail("refuses to be reset");
            }
        }
        Terminate | Reset => {}
        States => s.handles(r, pool),
        Bytes => s.bytes(r, pool),
        Derivatives => s.directional(r),
        OutputDerivatives | InputDerivatives => s.slopes(r, act == InputDerivatives),
        StepStatus => step_status(s, r),
        Logging => s.logging(r),
        Clocks => s.clocks(r),
        OtherTypes => s.other_types(r),
        Structure => s.structure(r),
    }
}

fn configuration(s: &mut Subject, r: &mut Random) {
    let Library::Three(f) = &s.fmu.library else { return };
    if s.phase == Phase::Configuration || r.once_in(4) {
        if ask!(s, f.fmi3ExitConfigurationMode()) == 0 {
            s.phase = Phase::Instantiated;
        }
    } else if ask!(s, f.fmi3EnterConfigurationMode()) == 0 {
        s.phase = Phase::Configuration;
    }
}

fn update_into_null(s: &mut Subject) {
    use core::ptr::null_mut;
    s.wrong = true;
    match &s.fmu.library {
        Library::Two(f) => ask!(s, f.fmi2NewDiscreteStates(null_mut())),
        Library::Three(f) => {
            let mut b = fmi3False;
            let end = &raw mut b;
            ask!(s, f.fmi3UpdateDiscreteStates(end, null_mut(), end, end, end, null_mut()))
        }
    };
}

fn completed(s: &mut Subject, r: &mut Random) {
    let one_null = r.once_in(10);
    s.wrong = one_null || !s.is_me();
    match &s.fmu.library {
        Library::Two(f) => {
            let (mut a, mut b) = (0, 0);
            let b = if one_null { core::ptr::null_mut() } else { &raw mut b };
            ask!(s, f.fmi2CompletedIntegratorStep(1, &mut a, b))
        }
        Library::Three(f) => {
            let (mut a, mut b) = (fmi3False, fmi3False);
            let b = if one_null { core::ptr::null_mut() } else { &raw mut b };
            ask!(s, f.fmi3CompletedIntegratorStep(fmi3True, &mut a, b))
        }
    };
}

fn do_step(s: &mut Subject, r: &mut Random) {
    let t = match r.below(12) {
        0 => r.odd(),
        1 => s.t + 1e-3,
        2 => s.t - 1e-3,
        _ => s.t,
    };
    let h = match r.below(16) {
        0 => r.pick(&[0.0, -0.0, -1e-3, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -f64::MAX]),
        1 => r.pick(&[5e-324, 1e-18, 1e-12, f64::MIN_POSITIVE]),
        2 => 0.02,
        _ => 1e-3 * (0.1 + r.unit()),
    };
    s.wrong =
        s.is_me() || !(h.is_finite() && h > 0.0) || !t.is_finite() || (t - s.t).abs() > 1e-8 * h.max(t.abs());
    s.environment.hostile.set(true);
    let (status, _, event) = s.do_step(t, h);
    s.environment.hostile.set(false);
    if status == 0 && event && !s.event_mode() {
        s.fail("requests event mode, which is not used");
    }
}

fn step_status(s: &mut Subject, r: &mut Random) {
    let Library::Two(f) = &s.fmu.library else { return };
    let kind = fmi2StatusKind(r.pick(&[0, 1, 2, 3, 4, -1, i32::MAX]));
    let null = r.once_in(10);
    fn pointer<T>(v: &mut T, null: bool) -> *mut T {
        if null { core::ptr::null_mut() } else { v }
    }
    s.wrong = s.is_me() || null;
    match r.below(6) {
        0 => ask!(s, f.fmi2GetStatus(kind, pointer(&mut fmi2Status(0), null))),
        1 => {
            let mut t = f64::NAN;
            let status = ask!(s, f.fmi2GetRealStatus(kind, pointer(&mut t, null)));
            s.finite(status, "fmi2GetRealStatus", &[t])
        }
        2 => ask!(s, f.fmi2GetIntegerStatus(kind, pointer(&mut 0, null))),
        3 => ask!(s, f.fmi2GetBooleanStatus(kind, pointer(&mut 0, null))),
        4 => ask!(s, f.fmi2GetStringStatus(kind, pointer(&mut core::ptr::null(), null))),
        _ => ask!(s, f.fmi2CancelStep()),
    };
}

/// A freed instance refuses every call, and being freed again does no harm.
pub fn after_free(s: &mut Subject) {
    s.free();
    s.wrong = true;
    s.reset();
    s.wrong = true;
    s.terminate();
    s.wrong = true;
    s.get(&[0], &mut [0.0]);
    s.wrong = true;
    s.do_step(0.0, 1e-3);
}
