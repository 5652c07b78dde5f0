//! Random sequences of calls with random arguments: no crash, no refusal in silence, no NaN that is called OK,
//! and after a reset the instance runs as if nothing had happened.
//!
//! `HOSTILE_SEQUENCES` sets how many (2000 by default); buffers are as long as declared.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]
use crate::common::*;
use core::ffi::c_void;
use core::ptr::{null, null_mut};
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;

struct Random(u64);
impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }
    fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }
    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
    fn reference(&mut self) -> u32 {
        if self.below(20) == 0 { self.next() as u32 } else { self.below(31) as u32 }
    }
    fn number(&mut self) -> f64 {
        let odd = [0.0, -0.0, 1.0, -1.0, 1e300, -1e300, 1e-310, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        if self.below(3) == 0 { self.pick(&odd) } else { (self.next() >> 11) as f64 / (1u64 << 51) as f64 }
    }
    fn time(&mut self, t: f64) -> f64 {
        if self.below(8) == 0 { self.number() } else { t }
    }
}

/// One instance under attack.
struct Victim {
    c: *mut c_void,
    t: f64,
    states: Vec<*mut c_void>,
    bytes: Vec<u8>,
}

/// Checks what was read with status OK.
fn finite(status: i32, values: &[f64]) -> i32 {
    assert!(status != 0 || values.iter().all(|v| v.is_finite()), "OK with {values:?}");
    status
}

unsafe fn attack2(v: &mut Victim, r: &mut Random) -> i32 {
    let c = v.c;
    let n = r.below(4);
    let refs: Vec<u32> = (0..n).map(|_| r.reference()).collect();
    let mut reals: Vec<f64> = (0..n).map(|_| r.number()).collect();
    let mut ints: Vec<i32> = (0..n).map(|_| r.pick(&[0, 1, 2, 3, -1, i32::MAX])).collect();
    let mut flag = 0;
    let p = if r.below(30) == 0 { null() } else { refs.as_ptr() };
    let mut five = [0.0; 5];
    let k = if r.below(10) == 0 { r.below(6) } else { 5 };
    unsafe {
        match r.below(34) {
            0 => fmi2SetupExperiment(c, 1, r.number(), r.number(), 0, 0.0).0,
            1..=3 => fmi2EnterInitializationMode(c).0,
            4..=6 => fmi2ExitInitializationMode(c).0,
            7 => fmi2Terminate(c).0,
            8 => fmi2Reset(c).0,
            9 => {
                let s = fmi2GetReal(c, p, n, reals.as_mut_ptr()).0;
                finite(s, &reals)
            }
            10 => fmi2SetReal(c, p, n, reals.as_ptr()).0,
            11 => fmi2GetInteger(c, p, n, ints.as_mut_ptr()).0,
            12 => {
                // The trap that panics is tried elsewhere.
                let hot = refs.iter().zip(&ints).any(|(reference, i)| *reference == vr::TRAP && *i == 1);
                if hot { 0 } else { fmi2SetInteger(c, p, n, ints.as_ptr()).0 }
            }
            13 => fmi2GetBoolean(c, p, n, ints.as_mut_ptr()).0,
            14 => fmi2SetBoolean(c, p, n, ints.as_ptr()).0,
            15 => fmi2GetString(c, p, n, null_mut()).0 * i32::from(n > 0),
            16 => {
                let mut s = r.pick(&[null_mut(), null_mut(), v.c, 8 as *mut c_void]);
                let status = fmi2GetFMUstate(c, &mut s).0;
                if status == 0 {
                    v.states.push(s);
                }
                status
            }
            17 => fmi2SetFMUstate(c, v.states.last().copied().unwrap_or(null_mut())).0,
            18 => {
                let mut s = if r.below(4) == 0 { v.c } else { v.states.pop().unwrap_or(null_mut()) };
                fmi2FreeFMUstate(c, &mut s).0
            }
            19 => {
                let s = v.states.last().copied().unwrap_or(v.c);
                let mut size = 0;
                let status = fmi2SerializedFMUstateSize(c, s, &mut size).0;
                v.bytes = vec![0; if r.below(4) == 0 { size / 2 } else { size }];
                status.max(fmi2SerializeFMUstate(c, s, v.bytes.as_mut_ptr().cast(), v.bytes.len()).0)
            }
            20 => {
                let mut bytes = v.bytes.clone();
                if !bytes.is_empty() && r.below(2) == 0 {
                    let at = r.below(bytes.len());
                    bytes[at] = r.next() as u8;
                    bytes.truncate(r.below(bytes.len() + 1));
                }
                let mut s = null_mut();
                let status = fmi2DeSerializeFMUstate(c, bytes.as_ptr().cast(), bytes.len(), &mut s).0;
                if status == 0 {
                    v.states.push(s);
                }
                status
            }
            21 => {
                let known = [r.reference(), r.reference()];
                let mut out = vec![0.0; n];
                let seed = [r.number(), 1.0];
                let s =
                    fmi2GetDirectionalDerivative(c, p, n, known.as_ptr(), 2, seed.as_ptr(), out.as_mut_ptr())
                        .0;
                finite(s, &out)
            }
            22 => fmi2EnterEventMode(c).0,
            23 => fmi2NewDiscreteStates(c, &mut fmi2EventInfo::default()).0,
            24 => fmi2EnterContinuousTimeMode(c).0,
            25 => fmi2CompletedIntegratorStep(c, 1, &mut 0, r.pick(&[null_mut(), &raw mut flag])).0,
            26 => {
                let t = v.t + 0.01;
                let status = fmi2SetTime(c, r.time(t)).0;
                v.t = t;
                status
            }
            27 => {
                let x = [r.number(), r.number(), 0.1, 0.2, r.number()];
                fmi2SetContinuousStates(c, x.as_ptr(), k).0
            }
            28 => {
                let s = fmi2GetDerivatives(c, five.as_mut_ptr(), k).0;
                finite(s, &five)
            }
            29 => {
                let s = fmi2GetEventIndicators(c, five.as_mut_ptr(), k.min(1)).0;
                finite(s, &five)
            }
            30 => fmi2SetRealInputDerivatives(c, p, n, ints.as_ptr(), reals.as_ptr()).0,
            31 => {
                let s = fmi2GetRealOutputDerivatives(c, p, n, vec![1; n].as_ptr(), reals.as_mut_ptr()).0;
                finite(s, &reals)
            }
            _ => {
                let h = if r.below(5) == 0 { r.number().min(0.05) } else { 0.01 };
                let status = fmi2DoStep(c, r.time(v.t), h, 1).0;
                let (mut t, one) = (0.0, [vr::TIME]);
                if fmi2GetReal(c, one.as_ptr(), 1, &mut t) == fmi2OK {
                    v.t = t;
                }
                status
            }
        }
    }
}

unsafe fn attack3(v: &mut Victim, r: &mut Random) -> i32 {
    let c = v.c;
    let n = r.below(3);
    let refs: Vec<u32> = (0..n).map(|_| r.reference()).collect();
    let len = r.below(9);
    let mut reals: Vec<f64> = (0..len).map(|_| r.number()).collect();
    let p = if r.below(30) == 0 { null() } else { refs.as_ptr() };
    unsafe {
        match r.below(18) {
            0..=1 => fmi3EnterInitializationMode(c, fmi3False, 0.0, r.time(0.0), fmi3False, 0.0).0,
            2..=3 => fmi3ExitInitializationMode(c).0,
            4 => {
                r.pick(&[fmi3EnterConfigurationMode, fmi3ExitConfigurationMode, fmi3Terminate, fmi3Reset])(c)
                    .0
            }
            5 => fmi3EnterEventMode(c).0,
            6 => r.pick(&[fmi3EnterStepMode, fmi3EnterContinuousTimeMode, fmi3EvaluateDiscreteStates])(c).0,
            7 => {
                let s = fmi3GetFloat64(c, p, n, reals.as_mut_ptr(), len).0;
                finite(s, &reals)
            }
            8 => fmi3SetFloat64(c, p, n, reals.as_ptr(), len).0,
            9 => {
                let flags: Vec<_> = (0..len).map(|_| fmi3Boolean(r.next() as u8)).collect();
                fmi3SetBoolean(c, p, n, flags.as_ptr(), len).0
            }
            10 => {
                let laws: Vec<i64> = (0..len).map(|_| r.pick(&[1, 2, 0, i64::MIN])).collect();
                fmi3SetInt64(c, p, n, laws.as_ptr(), len).0
            }
            11 => {
                let mut out = vec![0.0; r.below(6)];
                let known = [r.reference()];
                let f = r.pick(&[fmi3GetDirectionalDerivative, fmi3GetAdjointDerivative]);
                let s = f(c, p, n, known.as_ptr(), 1, reals.as_ptr(), len, out.as_mut_ptr(), out.len()).0;
                finite(s, &out)
            }
            12 => {
                let mut f = [fmi3False; 5];
                let [a, b, d, e, g] = &mut f;
                fmi3UpdateDiscreteStates(c, a, b, d, e, g, r.pick(&[null_mut(), &raw mut v.t])).0
            }
            13 => fmi3GetOutputDerivatives(c, p, n, vec![1; n].as_ptr(), reals.as_mut_ptr(), len).0,
            14 => {
                let mut count = 0;
                fmi3GetNumberOfVariableDependencies(c, r.reference(), &mut count).0
            }
            15 => {
                let i = r.pick(&[fmi3GetShiftDecimal, fmi3GetShiftDecimal]);
                i(c, p, n, null_mut()).0
            }
            _ => {
                let mut t = v.t;
                if fmi3GetFloat64(c, &vr::TIME, 1, &mut t, 1) == fmi3OK {
                    v.t = t;
                }
                let h = if r.below(5) == 0 { r.number().min(0.05) } else { 0.01 };
                step3(c, r.time(v.t), h).0.0
            }
        }
    }
}

/// A standard run after a reset, as bits.
fn standard(c: *mut c_void, fmi3: bool, event_mode: bool) -> Vec<u64> {
    let mut bits = Vec::new();
    unsafe {
        if fmi3 {
            assert_eq!(fmi3Reset(c), fmi3OK);
            init3(c, 1e-7);
            if event_mode {
                update3(c);
                assert_eq!(fmi3EnterStepMode(c), fmi3OK);
            }
            for k in 0..40 {
                assert_eq!(step3(c, f64::from(k) * 0.01, 0.01).0, fmi3OK);
            }
            bits.extend(get3::<5>(c, vr::STATE).map(f64::to_bits));
        } else {
            assert_eq!(fmi2Reset(c), fmi2OK);
            init2(c, 1e-7);
            bits.extend([vr::HEIGHT, vr::ENERGY, vr::RATE + 3].map(|reference| get2(c, reference).to_bits()));
        }
    }
    bits
}

#[test]
fn sequences() {
    let count = std::env::var("HOSTILE_SEQUENCES").ok().and_then(|n| n.parse().ok()).unwrap_or(2000u64);
    let journal = Journal::default();
    let mut refused = 0;
    let mut reference: [Option<Vec<u64>>; 4] = Default::default();
    for sequence in 0..count {
        let mut r = Random(sequence.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        let kind = r.below(4);
        let c = match kind {
            0 => new2(&journal, fmi2ModelExchange),
            1 => new2(&journal, fmi2CoSimulation),
            2 => simple3_cs(&journal),
            _ => new3_cs(&journal, true, true, &[], None, journal.environment(), Some(log3)),
        };
        let mut victim = Victim { c, t: 0.0, states: Vec::new(), bytes: Vec::new() };
        if r.below(3) > 0 {
            // Most sequences begin where a run begins.
            unsafe {
                if kind < 2 {
                    init2(c, 1e-6);
                    if kind == 0 && r.below(2) == 0 {
                        fmi2EnterContinuousTimeMode(c);
                    }
                } else {
                    init3(c, 1e-6);
                    if kind == 3 && r.below(2) == 0 {
                        fmi3EnterStepMode(c);
                    }
                }
            }
        }
        for _ in 0..60 {
            journal.take();
            let status =
                unsafe { if kind < 2 { attack2(&mut victim, &mut r) } else { attack3(&mut victim, &mut r) } };
            assert!((0..4).contains(&status), "sequence {sequence}: status {status}");
            if status >= 2 {
                refused += 1;
                let told = journal.take();
                assert!(
                    told.iter().any(|m| m.0 >= 2 && m.2.len() > 20),
                    "sequence {sequence}: refused in silence: {told:?}"
                );
            }
        }
        let bits = standard(c, kind >= 2, kind == 3);
        let expected = reference[kind].get_or_insert_with(|| bits.clone());
        assert_eq!(&bits, expected, "sequence {sequence}");
        unsafe { if kind < 2 { fmi2FreeInstance(c) } else { fmi3FreeInstance(c) } };
    }
    println!("{count} sequences of 60 calls, {refused} calls refused");
}
