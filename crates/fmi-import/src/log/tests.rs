//! The callbacks, called as FMUs call them.

#![allow(unsafe_code)] // calls of C functions
#![allow(clippy::unwrap_used)]

use std::ptr::{null, null_mut, without_provenance_mut};

use super::*;

fn texts(live: &Live) -> Vec<String> {
    live.messages().iter().map(Message::to_string).collect()
}

#[test]
fn fmi2_messages_are_formatted_as_printf_does() {
    let live = Live::register("formatted", "x.fmu".as_ref(), None);
    let category = c"events".as_ptr();
    // SAFETY: texts of the right kind for the format.
    unsafe {
        trueup_fmi2_logger(
            live.environment(),
            null(),
            fmi2Warning,
            category,
            c"%s: %d %.3f".as_ptr(),
            c"x".as_ptr(),
            7,
            0.5,
        );
    }
    assert_eq!(texts(&live), ["[Warning, events] x: 7 0.500"]);
}

#[test]
fn a_long_message_comes_whole_and_one_without_measure_is_cut() {
    let live = Live::register("long", "x.fmu".as_ref(), None);
    let long = std::ffi::CString::new("y".repeat(8_000)).unwrap();
    // SAFETY: as above.
    unsafe {
        trueup_fmi2_logger(live.environment(), null(), fmi2OK, null(), c"<%s>".as_ptr(), long.as_ptr())
    };
    assert_eq!(live.messages()[0].text, format!("<{}>", "y".repeat(8_000)));
    // Cut between characters.
    let longer = std::ffi::CString::new("\u{20ac}".repeat(1_000_000)).unwrap();
    // SAFETY: as above.
    unsafe {
        trueup_fmi2_logger(live.environment(), null(), fmi2OK, null(), c"%s".as_ptr(), longer.as_ptr())
    };
    let expected = format!("{} ... (cut: the message has 3000000 bytes)", "\u{20ac}".repeat(LONGEST / 3));
    assert_eq!(live.messages()[1].text, expected);
}

#[test]
fn null_odd_status_and_odd_text_do_no_harm() {
    let live = Live::register("odd", "x.fmu".as_ref(), None);
    // SAFETY: NULL is among what FMUs pass.
    unsafe {
        trueup_fmi2_logger(live.environment(), null(), fmi2Status(-17), null(), null());
        trueup_fmi2_logger(live.environment(), null(), fmi2Pending, null(), c"\xff".as_ptr());
        fmi3_log(live.environment(), fmi3Status(99), null(), null());
    }
    assert_eq!(texts(&live), ["[unknown status -17] ", "[Pending] \u{fffd}", "[unknown status 99] "]);
}

#[test]
fn a_foreign_environment_falls_back_to_the_name() {
    let live = Live::register("only one of this name", "x.fmu".as_ref(), None);
    let name = c"only one of this name".as_ptr();
    // SAFETY: environments are never followed.
    unsafe {
        trueup_fmi2_logger(null_mut(), name, fmi2OK, null(), c"a".as_ptr());
        trueup_fmi2_logger(without_provenance_mut(usize::MAX), name, fmi2OK, null(), c"b".as_ptr());
        trueup_fmi2_logger(
            without_provenance_mut(usize::MAX),
            c"nobody".as_ptr(),
            fmi2OK,
            null(),
            c"c".as_ptr(),
        );
        trueup_fmi2_logger(null_mut(), null(), fmi2OK, null(), c"d".as_ptr());
    }
    assert_eq!(texts(&live), ["[OK] a", "[OK] b"]);
    let twin = Live::register("only one of this name", "x.fmu".as_ref(), None);
    // SAFETY: as above.
    unsafe { trueup_fmi2_logger(null_mut(), name, fmi2OK, null(), c"whose?".as_ptr()) };
    assert_eq!((live.messages().len(), twin.messages().len()), (2, 0));
}

#[test]
fn a_dead_instance_hears_nothing() {
    let live = Live::register("dead", "x.fmu".as_ref(), None);
    let environment = live.environment();
    drop(live);
    // SAFETY: as above.
    unsafe { fmi3_log(environment, fmi3OK, null(), c"still there?".as_ptr()) };
    assert!(find(environment, Some("dead")).is_none());
}

#[test]
fn the_log_keeps_the_last_messages() {
    let live = Live::register("many", "x.fmu".as_ref(), None);
    for i in 0..KEPT + 5 {
        live.push(Message { status: FmiStatus::Ok, category: String::new(), text: i.to_string() });
    }
    let messages = live.messages();
    assert_eq!((messages.len(), messages[0].text.as_str()), (KEPT, "5"));
    assert_eq!(live.tail().len(), TAIL);
}

#[test]
fn an_update_without_a_taker_asks_for_nothing() {
    let (mut early, mut time) = (fmi3True, 1.0);
    let yes = fmi3Boolean(0x5a); // an odd byte
    // SAFETY: valid pointers, then NULL.
    unsafe {
        fmi3_intermediate_update(null_mut(), 0.0, yes, yes, yes, yes, &raw mut early, &raw mut time);
        fmi3_intermediate_update(null_mut(), 0.0, yes, yes, yes, yes, null_mut(), null_mut());
    }
    assert_eq!((early, time), (fmi3False, 1.0));
}
