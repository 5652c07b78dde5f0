//! FMU states, derivatives, dependencies.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]
use crate::common::*;
use core::ptr::null_mut;
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;

fn run(c: fmi3Instance, from: u32, to: u32) -> Vec<u64> {
    let mut bits = Vec::new();
    for k in from..to {
        let t = f64::from(k) * 0.01;
        assert_eq!(set3(c, vr::FORCE, &[(3.0 * t).sin()]), fmi3OK);
        assert_eq!(step3(c, t, 0.01).0, fmi3OK);
        bits.extend(get3::<5>(c, vr::STATE).map(f64::to_bits));
    }
    bits
}

#[test]
fn a_state_continues_bit_equal_here_and_in_another_instance() {
    let journal = Journal::default();
    let c = simple3_cs(&journal);
    assert_eq!(set3(c, vr::SAMPLE_PERIOD, &[0.03]), fmi3OK);
    assert_eq!(set3(c, vr::INITIAL_HEIGHT, &[0.8]), fmi3OK);
    init3(c, 1e-7);
    run(c, 0, 37);
    unsafe {
        let (mut state, mut size) = (null_mut(), 0);
        assert_eq!(fmi3GetFMUState(c, &mut state), fmi3OK);
        assert_eq!(fmi3SerializedFMUStateSize(c, state, &mut size), fmi3OK);
        let mut bytes = vec![0u8; size];
        assert_eq!(fmi3SerializeFMUState(c, state, bytes.as_mut_ptr(), size - 1), fmi3Error);
        assert!(journal.last().1.contains(&format!("needs {size} bytes")));
        assert_eq!(fmi3SerializeFMUState(c, state, bytes.as_mut_ptr(), size), fmi3OK);
        let first = run(c, 37, 120);
        assert_eq!(fmi3SetFMUState(c, state), fmi3OK);
        assert_eq!(run(c, 37, 120), first);
        // Stored over an older one.
        let old = state;
        assert_eq!(fmi3GetFMUState(c, &mut state), fmi3OK);
        assert_eq!(old, state);

        let other = simple3_cs(&journal);
        let mut copy = null_mut();
        assert_eq!(fmi3DeserializeFMUState(other, bytes.as_ptr(), size, &mut copy), fmi3OK);
        assert_eq!(fmi3SetFMUState(other, copy), fmi3OK);
        assert_eq!(get3::<1>(other, vr::INITIAL_SWING), [0.8]);
        assert_eq!(run(other, 37, 120), first);
        // Not of this instance, freed twice, NULL.
        assert_eq!(fmi3SetFMUState(other, state), fmi3Error);
        assert!(journal.last().1.contains("not made by this instance"));
        assert_eq!(fmi3FreeFMUState(other, &mut copy), fmi3OK);
        assert!(copy.is_null());
        assert_eq!(fmi3FreeFMUState(other, &mut copy), fmi3OK);
        assert_eq!(fmi3SetFMUState(other, copy), fmi3Error);
        // Bytes that were cut, damaged, or of another kind.
        for (bad, word) in [
            (bytes[..size - 3].to_vec(), ""),
            (Vec::new(), "end too early"),
            ([&bytes[..], &[0]].concat(), "too long"),
            (
                bytes.iter().enumerate().map(|(i, b)| if i == size / 2 { b ^ 1 } else { *b }).collect(),
                "damaged",
            ),
            (vec![0; 4000], "do not begin"),
        ] {
            assert_eq!(fmi3DeserializeFMUState(other, bad.as_ptr(), bad.len(), &mut copy), fmi3Error);
            assert!(journal.last().1.contains(word), "{word}");
        }
        for i in 0..size {
            let mut bad = bytes.clone();
            bad[i] ^= 0x10;
            assert_eq!(fmi3DeserializeFMUState(other, bad.as_ptr(), size, &mut copy), fmi3Error, "byte {i}");
        }
        let me = new3_me(&journal);
        assert_eq!(fmi3DeserializeFMUState(me, bytes.as_ptr(), size, &mut copy), fmi3Error);
        assert!(journal.last().1.contains("interface type"));
        [c, other, me].into_iter().for_each(|c| fmi3FreeInstance(c));
    }
}

/// Unknowns at given knowns, by setting them and reading.
fn evaluate(c: fmi3Instance, x: &[f64; 5], force: f64, stiffness: &[f64; 2]) -> Vec<f64> {
    unsafe {
        assert_eq!(fmi3EnterEventMode(c), fmi3OK);
        assert_eq!(set3(c, vr::STIFFNESS, stiffness), fmi3OK);
        assert_eq!(set3(c, vr::FORCE, &[force]), fmi3OK);
        assert_eq!(fmi3EnterContinuousTimeMode(c), fmi3OK);
        assert_eq!(fmi3SetContinuousStates(c, x.as_ptr(), 5), fmi3OK);
    }
    let mut out = get3::<5>(c, vr::RATE).to_vec();
    out.extend(get3::<1>(c, vr::ENERGY));
    out.extend(get3::<2>(c, vr::SWING));
    out.extend(get3::<1>(c, vr::INDICATOR));
    out
}

#[test]
fn derivatives_are_those_of_central_differences() {
    let journal = Journal::default();
    let c = new3_me(&journal);
    assert_eq!(unsafe { fmi3SetInt64(c, &vr::LAW, 1, &2, 1) }, fmi3OK);
    init3(c, 1e-6);
    update3(c);
    assert_eq!(unsafe { fmi3SetTime(c, 0.7) }, fmi3OK);
    let unknowns = [vr::RATE, vr::ENERGY, vr::SWING, vr::INDICATOR];
    let knowns = [vr::STATE, vr::FORCE, vr::STIFFNESS];
    let mut random = 1u64;
    let mut next = || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (random >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    for _ in 0..50 {
        let x: [f64; 5] = core::array::from_fn(|_| next());
        let (force, k) = (next(), [4.0 + next(), 1.0 + next()]);
        let seed: [f64; 8] = core::array::from_fn(|_| next());
        let moved = |s: f64| {
            let x = core::array::from_fn(|i| x[i] + s * seed[i]);
            evaluate(c, &x, force + s * seed[5], &[k[0] + s * seed[6], k[1] + s * seed[7]])
        };
        let h = 1e-6;
        let (plus, minus) = (moved(h), moved(-h));
        evaluate(c, &x, force, &k);
        let mut exact = [0.0; 9];
        let (mut adjoint, weights) = ([0.0; 8], [0.3, -0.7, 0.2, 1.1, 0.5, -0.4, 0.9, 0.6, -1.3]);
        unsafe {
            let s = fmi3GetDirectionalDerivative(
                c,
                unknowns.as_ptr(),
                4,
                knowns.as_ptr(),
                3,
                seed.as_ptr(),
                8,
                exact.as_mut_ptr(),
                9,
            );
            assert_eq!(s, fmi3OK, "{:?}", journal.last());
            let s = fmi3GetAdjointDerivative(
                c,
                unknowns.as_ptr(),
                4,
                knowns.as_ptr(),
                3,
                weights.as_ptr(),
                9,
                adjoint.as_mut_ptr(),
                8,
            );
            assert_eq!(s, fmi3OK);
        }
        for i in 0..9 {
            let difference = (plus[i] - minus[i]) / (2.0 * h);
            assert!(
                (exact[i] - difference).abs() < 1e-7 * (1.0 + difference.abs()),
                "{i}: {} {difference}",
                exact[i]
            );
        }
        // w . (J s) = (J^T w) . s
        let left: f64 = exact.iter().zip(weights).map(|(a, b)| a * b).sum();
        let right: f64 = adjoint.iter().zip(seed).map(|(a, b)| a * b).sum();
        assert!((left - right).abs() < 1e-12 * (1.0 + left.abs()));
    }
    unsafe {
        let refused = |u: u32, k: u32| {
            fmi3GetDirectionalDerivative(c, &u, 1, &k, 1, [1.0; 5].as_ptr(), 1, [0.0; 5].as_mut_ptr(), 1)
        };
        assert_eq!(refused(vr::RESTING, vr::FORCE), fmi3Error);
        assert!(journal.last().1.contains("`resting` is no unknown"));
        assert_eq!(refused(vr::ENERGY, vr::HEIGHT), fmi3Error);
        assert!(journal.last().1.contains("`height` is no known"));
        assert_eq!(refused(vr::ENERGY, vr::STATE), fmi3Error);
        assert!(journal.last().1.contains("5 elements"));
        assert_eq!(refused(vr::ENERGY, vr::TIME), fmi3OK);
        fmi3FreeInstance(c);
    }
}

#[test]
fn in_initialization_mode_states_follow_from_parameters() {
    let journal = Journal::default();
    let c = new2(&journal, fmi2ModelExchange);
    unsafe {
        assert_eq!(fmi2EnterInitializationMode(c), fmi2OK);
        // initialSwing follows initialHeight, so the swing moves with it, and its acceleration too.
        let unknowns = [vr::STATE, vr::STATE + 2, vr::RATE + 3, vr::SWING];
        let mut d = [0.0; 4];
        let known = vr::INITIAL_HEIGHT;
        let s = fmi2GetDirectionalDerivative(c, unknowns.as_ptr(), 4, &known, 1, &2.0, d.as_mut_ptr());
        assert_eq!(s, fmi2OK, "{:?}", journal.last());
        assert_eq!(d, [2.0, 2.0, -8.0, 2.0]);
        assert_eq!(set2(c, vr::INITIAL_SWING, 0.5), fmi2OK);
        fmi2GetDirectionalDerivative(c, unknowns.as_ptr(), 4, &known, 1, &2.0, d.as_mut_ptr());
        assert_eq!(d, [2.0, 0.0, 0.0, 0.0]);
        assert_eq!(
            fmi2GetDirectionalDerivative(c, &vr::ENERGY, 1, &vr::STATE, 1, &2.0, &mut d[0]),
            fmi2Error
        );
        fmi2FreeInstance(c);
    }
}

#[test]
fn dependencies() {
    let journal = Journal::default();
    let c = new3_me(&journal);
    unsafe {
        let mut n = 0;
        assert_eq!(fmi3GetNumberOfVariableDependencies(c, vr::HEIGHT, &mut n), fmi3OK);
        assert_eq!(n, 5);
        let (mut own, mut refs, mut elements) = ([0; 5], [0; 5], [0; 5]);
        let mut kinds = [fmi3Independent; 5];
        let mut ask = |n| {
            fmi3GetVariableDependencies(
                c,
                vr::HEIGHT,
                own.as_mut_ptr(),
                refs.as_mut_ptr(),
                elements.as_mut_ptr(),
                kinds.as_mut_ptr(),
                n,
            )
        };
        assert_eq!(ask(4), fmi3Error);
        assert_eq!(ask(5), fmi3OK);
        assert_eq!(
            (own, refs, elements, kinds),
            ([1; 5], [vr::STATE; 5], [1, 2, 3, 4, 5], [fmi3Constant; 5])
        );
        assert_eq!(fmi3GetNumberOfVariableDependencies(c, vr::ENERGY, &mut n), fmi3OK);
        assert_eq!(n, 7);
        let (mut own, mut refs, mut elements, mut kinds) = ([0; 7], [0; 7], [0; 7], [fmi3Independent; 7]);
        let energy = fmi3GetVariableDependencies(
            c,
            vr::ENERGY,
            own.as_mut_ptr(),
            refs.as_mut_ptr(),
            elements.as_mut_ptr(),
            kinds.as_mut_ptr(),
            n,
        );
        assert_eq!((energy, kinds), (fmi3OK, [fmi3Dependent; 7]));
        fmi3FreeInstance(c);
    }
}
