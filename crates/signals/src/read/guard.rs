//! Panics of the libraries that read files of others.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

thread_local! {
    static GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Does it; a panic is an error.
///
/// Parquet, MAT and HDF5 are read by libraries that have panics left on damaged files (a page of a dictionary that is none, an
/// index that is out of bounds). They cannot all be found by looking at a file before, and none may end the program without a
/// word on the file. Nothing is shared with what panicked: it is given bytes and gives columns. What cannot be caught, memory
/// that is not to be had, is bounded before.
///
/// While it works, this thread's panics are not printed: they are reported as errors of the file.
pub(super) fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |panic| {
            if !GUARDED.get() {
                usual(panic);
            }
        }));
    });
    GUARDED.set(true);
    let done = catch_unwind(AssertUnwindSafe(work));
    GUARDED.set(false);
    done.map_err(|panic| format!("it is damaged ({})", message(panic.as_ref())))
}

fn message(panic: &(dyn Any + Send)) -> String {
    let text =
        panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("no reason given").lines().next().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::panic)]
    fn a_panic_is_an_error_with_its_words() {
        assert_eq!(guarded(|| 3), Ok(3));
        let told: Result<(), _> = guarded(|| panic!("index {} is out of bounds", 7));
        assert_eq!(told, Err("it is damaged (index 7 is out of bounds)".to_owned()));
    }
}
