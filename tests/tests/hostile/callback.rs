//! The intermediate update callback: legal and illegal use of the instance from within a step.

use super::fmu::{Kind, Library};
use super::subject::{Environment, UPDATES};
use core::ffi::c_void;
use core::ptr::null_mut;
use std::sync::atomic::Ordering::Relaxed;
use trueup_fmi::abi::fmi3::*;
use trueup_fmi_description::description::DescriptionCausality;

pub unsafe extern "C" fn intermediate_update(
    e: *mut c_void,
    time: f64,
    set_requested: fmi3Boolean,
    get_allowed: fmi3Boolean,
    _finished: fmi3Boolean,
    can_return: fmi3Boolean,
    early: *mut fmi3Boolean,
    early_time: *mut f64,
) {
    // SAFETY: the environment given at instantiation.
    let e = unsafe { &*e.cast::<Environment>() };
    UPDATES.fetch_add(1, Relaxed);
    if !e.hostile.get() {
        return;
    }
    // SAFETY: FMUs outlive their instances.
    let fmu = unsafe { &*e.fmu };
    let Library::Three(f) = &fmu.library else { return };
    let (c, mut r) = (e.instance.get(), e.random.borrow_mut());
    let fail = |why: String| e.failures.borrow_mut().push(format!("in intermediate update: {why}"));
    if !time.is_finite() {
        fail(format!("time {time}"));
    }
    let refuse = |name: &str, status: fmi3Status| {
        if !(2..=3).contains(&status.0) {
            fail(format!("{name} answers {status}"));
        }
    };
    // SAFETY: pointers are NULL or valid for the lengths given with them.
    unsafe {
        match r.below(14) {
            0 => refuse("fmi3Reset", (f.fmi3Reset)(c)),
            1 => refuse("fmi3Terminate", (f.fmi3Terminate)(c)),
            2 => {
                let (mut b, mut t) = ([fmi3False; 3], 0.0);
                let [x, y, z] = &mut b;
                refuse("fmi3DoStep", (f.fmi3DoStep)(c, time, 1e-3, fmi3True, x, y, z, &mut t));
            }
            3 => refuse("fmi3GetFMUState", (f.fmi3GetFMUState)(c, &mut null_mut())),
            4 => refuse("fmi3EnterEventMode", (f.fmi3EnterEventMode)(c)),
            5 => refuse("fmi3SetTime", (f.fmi3SetTime)(c, time)),
            6 | 7 => {
                let inputs = fmu.of(DescriptionCausality::Input, Kind::Real);
                let v = inputs[r.below(inputs.len())];
                let values: Vec<f64> = (0..v.len).map(|i| r.value(v, i)).collect();
                let status = (f.fmi3SetFloat64)(c, &v.reference, 1, values.as_ptr(), v.len);
                let legal = set_requested.0 != 0 && values.iter().all(|v| v.is_finite());
                if !legal {
                    refuse("fmi3SetFloat64", status);
                }
            }
            8 => {
                let parameters = fmu.of(DescriptionCausality::Parameter, Kind::Real);
                let v = parameters[r.below(parameters.len())];
                refuse(
                    "fmi3SetFloat64 of a parameter",
                    (f.fmi3SetFloat64)(c, &v.reference, 1, v.start.as_ptr(), v.start.len()),
                );
            }
            9 | 10 => {
                let outputs = fmu.of(DescriptionCausality::Output, Kind::Real);
                let v = outputs[r.below(outputs.len())];
                let mut values = vec![f64::NAN; v.len];
                let status = (f.fmi3GetFloat64)(c, &v.reference, 1, values.as_mut_ptr(), v.len);
                if status.0 < 2 && (get_allowed.0 == 0 || values.iter().any(|v| !v.is_finite())) {
                    fail(format!("`{}` = {values:?} with {status}", v.name));
                }
            }
            11 if can_return.0 != 0 => {
                *early = fmi3True;
                *early_time = if r.once_in(3) { r.odd() } else { time + 1e-4 * r.unit() };
            }
            _ => {}
        }
    }
}
