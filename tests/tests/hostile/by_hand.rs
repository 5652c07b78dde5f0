//! Hand-written nastiness: what a random sequence does not come to.

use super::fmu::{Fmu, Library};
use super::fmus;
use super::subject::{Logger2, Phase, Subject, WAYS, Way, ask, log3};
use core::ffi::{c_char, c_void};
use core::ptr::{null, null_mut};
use std::cell::RefCell;
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;

const CS: Way = Way::CoSimulation { event_mode: false, early_return: false };

fn subject(fmu: &Fmu, way: Way) -> Subject<'_> {
    Subject::new(fmu, way, true, 1, "by hand".to_owned())
}
/// Initialized, in step mode or continuous-time mode.
fn running(fmu: &Fmu, way: Way) -> Subject<'_> {
    let mut s = subject(fmu, way);
    assert_eq!([s.initialize(1e-6, 0.0, None), s.exit_initialization()], [0, 0]);
    if s.event_mode() {
        while s.update().1 {}
        assert_eq!(s.enter(if s.is_me() { Phase::Continuous } else { Phase::Step }), 0);
    }
    s
}

#[test]
fn instances_that_cannot_be_made() {
    unsafe extern "C" fn note(e: *mut c_void, _: fmi2String, s: fmi2Status, _: fmi2String, _: fmi2String) {
        // SAFETY: the environment is this.
        unsafe { (*e.cast::<RefCell<Vec<i32>>>()).borrow_mut().push(s.0) };
    }
    for fmu in fmus() {
        let told = RefCell::new(Vec::<i32>::new());
        let environment = (&raw const told).cast_mut().cast::<c_void>();
        let (name, token, other) = (c"probe".as_ptr(), fmu.token.as_ptr(), c"{wrong}".as_ptr());
        let not_utf8 = c"\xff\xfe\x80".as_ptr();
        match &fmu.library {
            Library::Two(f) => {
                // SAFETY: see `subject::log2`.
                let logger = unsafe { core::mem::transmute::<*const (), Logger2>(note as *const ()) };
                let callbacks = fmi2CallbackFunctions {
                    logger: Some(logger),
                    allocateMemory: None,
                    freeMemory: None,
                    stepFinished: None,
                    componentEnvironment: environment,
                };
                let silent = fmi2CallbackFunctions { logger: None, ..callbacks };
                let make = |name, kind, token, callbacks: *const fmi2CallbackFunctions| {
                    // SAFETY: pointers are NULL or valid.
                    unsafe { (f.fmi2Instantiate)(name, fmi2Type(kind), token, null(), callbacks, 0, 1) }
                };
                let bad = [
                    make(null(), 0, token, &callbacks),
                    make(c"".as_ptr(), 0, token, &callbacks),
                    make(name, 0, null(), &callbacks),
                    make(name, 0, other, &callbacks),
                    make(name, 0, not_utf8, &callbacks),
                    make(name, 7, token, &callbacks),
                    make(name, -1, token, &callbacks),
                ];
                assert!(bad.iter().all(|c| c.is_null()), "{}", fmu.name);
                assert_eq!(told.borrow().as_slice(), [3; 7], "{}: each with a message", fmu.name);
                assert!(make(name, 0, token, null()).is_null());
                // Without a logger, and with names of any kind, all goes on in silence.
                for name in [name, not_utf8] {
                    let c = make(name, 1, token, &silent);
                    assert!(!c.is_null());
                    // SAFETY: an instance.
                    unsafe {
                        assert_eq!((f.fmi2DoStep)(c, 0.0, 1.0, 1), fmi2Error);
                        (f.fmi2FreeInstance)(c);
                    }
                }
            }
            Library::Three(f) => {
                unsafe extern "C" fn note3(e: *mut c_void, s: fmi3Status, _: fmi3String, _: fmi3String) {
                    // SAFETY: the environment is this.
                    unsafe { (*e.cast::<RefCell<Vec<i32>>>()).borrow_mut().push(s.0) };
                }
                let make = |name, token, references: *const u32, n| {
                    // SAFETY: pointers are NULL or valid.
                    unsafe {
                        (f.fmi3InstantiateCoSimulation)(
                            name,
                            token,
                            null(),
                            fmi3False,
                            fmi3True,
                            fmi3False,
                            fmi3False,
                            references,
                            n,
                            environment,
                            Some(note3),
                            None,
                        )
                    }
                };
                let unknown = [u32::MAX];
                let bad = [
                    make(null(), token, null(), 0),
                    make(c"".as_ptr(), token, null(), 0),
                    make(name, null(), null(), 0),
                    make(name, other, null(), 0),
                    make(name, not_utf8, null(), 0),
                    make(name, token, null(), 1),
                    make(name, token, null(), usize::MAX),
                    make(name, token, unknown.as_ptr(), 1),
                ];
                assert!(bad.iter().all(|c| c.is_null()), "{}: {bad:?}", fmu.name);
                assert_eq!(told.borrow().as_slice(), [3; 8], "{}: each with a message", fmu.name);
                // SAFETY: pointers are NULL or valid.
                unsafe {
                    let scheduled = (f.fmi3InstantiateScheduledExecution)(
                        name,
                        token,
                        null(),
                        fmi3False,
                        fmi3True,
                        null_mut(),
                        None,
                        None,
                        None,
                        None,
                    );
                    assert!(scheduled.is_null());
                    let c = (f.fmi3InstantiateModelExchange)(
                        name,
                        token,
                        null(),
                        fmi3False,
                        fmi3True,
                        null_mut(),
                        None,
                    );
                    assert_eq!((f.fmi3SetTime)(c, f64::NAN), fmi3Error);
                    (f.fmi3FreeInstance)(c);
                }
            }
        }
    }
}

#[test]
fn null_instances() {
    for fmu in fmus() {
        let mut s = subject(fmu, Way::ModelExchange);
        let c = core::mem::replace(&mut s.c, null_mut());
        s.live = false;
        for call in [Subject::reset, Subject::exit_initialization, Subject::terminate, Subject::store] {
            s.wrong = true;
            call(&mut s);
        }
        s.wrong = true;
        s.get(&[0], &mut [0.0]);
        s.wrong = true;
        s.rates(&mut [0.0]);
        s.wrong = true;
        s.do_step(0.0, 1.0);
        s.free();
        (s.c, s.live) = (c, true);
    }
}

#[test]
fn impossible_lengths() {
    for fmu in fmus() {
        let mut s = running(fmu, Way::ModelExchange);
        let (reference, mut value) = ([1u32], [0.0]);
        let (r, v) = (reference.as_ptr(), value.as_mut_ptr());
        for n in [usize::MAX, usize::MAX / 8, isize::MAX as usize, usize::MAX / 2 + 1] {
            let m = if n == usize::MAX / 8 { usize::MAX } else { n };
            s.wrong = true;
            match &fmu.library {
                Library::Two(f) => ask!(s, f.fmi2GetDerivatives(v, n)),
                Library::Three(f) => ask!(s, f.fmi3GetContinuousStateDerivatives(v, n)),
            };
            s.wrong = true;
            match &fmu.library {
                Library::Two(f) => ask!(s, f.fmi2SetContinuousStates(v, n)),
                Library::Three(f) => ask!(s, f.fmi3GetFloat64(r, 1, v, n)),
            };
            s.wrong = true;
            match &fmu.library {
                Library::Two(f) => ask!(s, f.fmi2SetReal(r, m, v)),
                Library::Three(f) => ask!(s, f.fmi3SetFloat64(r, 1, v, m)),
            };
        }
        // Nothing, from nowhere, is legal.
        let status = match &fmu.library {
            Library::Two(f) => ask!(s, f.fmi2GetReal(null(), 0, null_mut())),
            Library::Three(f) => ask!(s, f.fmi3GetFloat64(null(), 0, null_mut(), 0)),
        };
        assert_eq!(status, 0);
    }
}

#[test]
fn parameters_without_physics() {
    for fmu in fmus().iter().filter(|f| f.name.starts_with("TwoMass") || f.name.starts_with("Planar")) {
        for name in
            ["motorInertia", "loadInertia", "baseMass", "linkMass", "stiffness", "gearRatio", "linkMass[1]"]
        {
            let Some(v) = fmu.variables.iter().find(|v| v.name == name) else { continue };
            for value in [-1.0, f64::NAN, f64::INFINITY, -0.0, 0.0] {
                let mut s = subject(fmu, CS);
                // Refused at once, or when initialization ends, with a message that names it.
                let zero_is_refused = !(name == "motorInertia" && fmu.name.starts_with("Planar"));
                let values = vec![value; v.len];
                let mut refused = s.set(&[v.reference], &values) >= 2;
                let mut told = s.environment.journal.borrow().clone();
                if !refused {
                    let _ = s.initialize(1e-6, 0.0, None);
                    refused = s.exit_initialization() >= 2;
                    told = s.environment.journal.borrow().clone();
                }
                if value == 0.0 && !zero_is_refused {
                    continue;
                }
                assert!(refused, "{}: {name} = {value} is taken", fmu.name);
                assert!(
                    told.iter().any(|m| m.1.contains(name)),
                    "{}: {told:?} does not name {name}",
                    fmu.name
                );
            }
        }
    }
}

#[test]
fn stored_states_go_nowhere_else() {
    let fmus = fmus();
    for (k, fmu) in fmus.iter().enumerate() {
        for way in [Way::ModelExchange, CS] {
            let (mut a, mut b) = (running(fmu, way), running(fmu, way));
            let other = &fmus[(k + 1) % fmus.len()];
            let mut stranger = running(other, way);
            assert_eq!(a.store(), 0);
            let handle = a.states[0].0;
            for s in [&mut b, &mut stranger] {
                s.wrong = true;
                match &s.fmu.library {
                    Library::Two(f) => ask!(s, f.fmi2SetFMUstate(handle)),
                    Library::Three(f) => ask!(s, f.fmi3SetFMUState(handle)),
                };
                s.wrong = true;
                let mut size = 0;
                match &s.fmu.library {
                    Library::Two(f) => ask!(s, f.fmi2SerializedFMUstateSize(handle, &mut size)),
                    Library::Three(f) => ask!(s, f.fmi3SerializedFMUStateSize(handle, &mut size)),
                };
            }
            // Freed twice: the second time there is nothing of that name.
            for wrong in [false, true] {
                let mut freed = handle;
                a.wrong = wrong;
                match &fmu.library {
                    Library::Two(f) => ask!(a, f.fmi2FreeFMUstate(&mut freed)),
                    Library::Three(f) => ask!(a, f.fmi3FreeFMUState(&mut freed)),
                };
            }
            // Freeing nothing is legal.
            let status = match &fmu.library {
                Library::Two(f) => ask!(a, f.fmi2FreeFMUstate(null_mut())),
                Library::Three(f) => ask!(a, f.fmi3FreeFMUState(null_mut())),
            };
            assert_eq!(status, 0);
        }
    }
}

/// Every bit of a serialized state matters.
#[test]
fn damaged_bytes() {
    for fmu in fmus() {
        let mut s = running(fmu, CS);
        assert_eq!(s.store(), 0);
        let handle = s.states[0].0;
        let mut size = 0;
        match &fmu.library {
            Library::Two(f) => ask!(s, f.fmi2SerializedFMUstateSize(handle, &mut size)),
            Library::Three(f) => ask!(s, f.fmi3SerializedFMUStateSize(handle, &mut size)),
        };
        let mut bytes = vec![0u8; size];
        match &fmu.library {
            Library::Two(f) => ask!(s, f.fmi2SerializeFMUstate(handle, bytes.as_mut_ptr().cast(), size)),
            Library::Three(f) => ask!(s, f.fmi3SerializeFMUState(handle, bytes.as_mut_ptr(), size)),
        };
        let read = |s: &mut Subject, bytes: &[u8], wrong| {
            let mut state = null_mut();
            s.wrong = wrong;
            match &fmu.library {
                Library::Two(f) => {
                    ask!(
                        s,
                        f.fmi2DeSerializeFMUstate(bytes.as_ptr().cast::<c_char>(), bytes.len(), &mut state)
                    )
                }
                Library::Three(f) => {
                    ask!(s, f.fmi3DeserializeFMUState(bytes.as_ptr(), bytes.len(), &mut state))
                }
            }
        };
        assert_eq!(read(&mut s, &bytes, false), 0);
        for i in 0..size {
            bytes[i] ^= 1 << (i % 8);
            read(&mut s, &bytes, true);
            bytes[i] ^= 1 << (i % 8);
            read(&mut s, &bytes[..i], true);
        }
    }
}

/// The logger calls the instance that is logging: refused, no deadlock.
#[test]
fn logger_that_calls_back() {
    static BACK: std::sync::Mutex<Vec<i32>> = std::sync::Mutex::new(Vec::new());
    thread_local!(static TARGET: RefCell<Option<(&'static Fmu, *mut c_void)>> = const { RefCell::new(None) });
    unsafe extern "C" fn nosy(_: *mut c_void, _: fmi3Status, _: fmi3String, _: fmi3String) {
        TARGET.with(|t| {
            if let Some((Fmu { library: Library::Three(f), .. }, c)) = *t.borrow() {
                // SAFETY: an instance.
                let status = unsafe { (f.fmi3Reset)(c) };
                BACK.lock().unwrap().push(status.0);
                // SAFETY: an instance; freeing it while it is in a call is ignored.
                unsafe { (f.fmi3FreeInstance)(c) };
            }
        });
    }
    for fmu in fmus() {
        let Library::Three(f) = &fmu.library else { continue };
        // SAFETY: legal arguments, an instance.
        unsafe {
            let c = (f.fmi3InstantiateModelExchange)(
                c"nosy".as_ptr(),
                fmu.token.as_ptr(),
                null(),
                fmi3False,
                fmi3True,
                null_mut(),
                Some(nosy),
            );
            TARGET.with(|t| *t.borrow_mut() = Some((fmu, c)));
            assert_eq!((f.fmi3SetTime)(c, 1.0), fmi3Error);
            assert_eq!(BACK.lock().unwrap().pop(), Some(3));
            TARGET.with(|t| *t.borrow_mut() = None);
            assert_eq!((f.fmi3Reset)(c), fmi3OK, "{}: it is still there", fmu.name);
            (f.fmi3FreeInstance)(c);
        }
    }
}

/// The callback frees the instance whose step is under way.
#[test]
fn freed_within_a_step() {
    thread_local!(static TARGET: RefCell<Option<(&'static Fmu, *mut c_void)>> = const { RefCell::new(None) });
    unsafe extern "C" fn free_it(
        _: *mut c_void,
        _: f64,
        _: fmi3Boolean,
        _: fmi3Boolean,
        _: fmi3Boolean,
        _: fmi3Boolean,
        _: *mut fmi3Boolean,
        _: *mut f64,
    ) {
        TARGET.with(|t| {
            if let Some((Fmu { library: Library::Three(f), .. }, c)) = *t.borrow() {
                // SAFETY: an instance, or one freed just before.
                unsafe { (f.fmi3FreeInstance)(c) };
            }
        });
    }
    for fmu in fmus() {
        let Library::Three(f) = &fmu.library else { continue };
        // SAFETY: legal arguments but for the callback.
        unsafe {
            let c = (f.fmi3InstantiateCoSimulation)(
                c"gone".as_ptr(),
                fmu.token.as_ptr(),
                null(),
                fmi3False,
                fmi3True,
                fmi3False,
                fmi3False,
                null(),
                0,
                null_mut(),
                None,
                Some(free_it),
            );
            assert_eq!((f.fmi3EnterInitializationMode)(c, fmi3False, 0.0, 0.0, fmi3False, 0.0), fmi3OK);
            assert_eq!((f.fmi3ExitInitializationMode)(c), fmi3OK);
            TARGET.with(|t| *t.borrow_mut() = Some((fmu, c)));
            let (mut b, mut t) = ([fmi3False; 3], 0.0);
            let [x, y, z] = &mut b;
            assert_eq!((f.fmi3DoStep)(c, 0.0, 0.01, fmi3True, x, y, z, &mut t), fmi3Error, "{}", fmu.name);
            assert_eq!((f.fmi3Reset)(c), fmi3Error);
        }
    }
}

/// Two threads on one instance, against the rules: each call is carried out or refused, none is torn.
#[test]
fn one_instance_in_two_threads() {
    struct Pointer(*mut c_void);
    // SAFETY: that is what is tried.
    unsafe impl Sync for Pointer {}
    for fmu in fmus() {
        let Library::Three(f) = &fmu.library else { continue };
        // SAFETY: legal arguments.
        let c = Pointer(unsafe {
            (f.fmi3InstantiateModelExchange)(
                c"shared".as_ptr(),
                fmu.token.as_ptr(),
                null(),
                fmi3False,
                fmi3False,
                null_mut(),
                Some(log3),
            )
        });
        std::thread::scope(|scope| {
            for _ in 0..2 {
                let c = &c;
                scope.spawn(move || {
                    for _ in 0..2000 {
                        let mut state = null_mut();
                        // SAFETY: an instance.
                        let statuses = unsafe {
                            [
                                (f.fmi3GetFMUState)(c.0, &mut state),
                                (f.fmi3EnterConfigurationMode)(c.0),
                                (f.fmi3ExitConfigurationMode)(c.0),
                                (f.fmi3FreeFMUState)(c.0, &mut state),
                                (f.fmi3Reset)(c.0),
                            ]
                        };
                        assert!(statuses.iter().all(|s| (0..=3).contains(&s.0)), "{statuses:?}");
                    }
                });
            }
        });
        // SAFETY: an instance.
        unsafe { (f.fmi3FreeInstance)(c.0) };
    }
}

/// Reset, terminate twice and the legal run, out of every mode.
#[test]
fn reset_from_everywhere() {
    for fmu in fmus() {
        for way in WAYS.into_iter().take(if fmu.is_fmi3() { 5 } else { 2 }) {
            let fresh = subject(fmu, way).standard();
            for depth in 0..5 {
                let mut s = subject(fmu, way);
                if depth > 0 {
                    assert_eq!(s.initialize(1e-3, 2.0, Some(9.0)), 0);
                }
                if depth > 1 {
                    assert_eq!(s.exit_initialization(), 0);
                }
                if depth > 2 && s.event_mode() {
                    s.update();
                    s.enter(if s.is_me() { Phase::Continuous } else { Phase::Step });
                }
                if depth > 3 {
                    assert_eq!(s.terminate(), 0);
                    s.wrong = true;
                    s.terminate();
                    let mut time = [0.0];
                    assert_eq!((s.get(&[0], &mut time), time), (0, [2.0]));
                }
                assert_eq!(s.reset(), 0);
                assert!(s.standard() == fresh, "{} {way:?}: after a reset from depth {depth}", fmu.name);
            }
        }
    }
}
