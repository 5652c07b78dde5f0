//! After initialization no derivative evaluation and no step of a packed FMU allocates.
//!
//! This program's `malloc` counts: the dynamic linker binds the FMU's allocations to it.

#![allow(unsafe_code)] // calls of C functions
#![allow(
    missing_docs,
    unreachable_pub,
    clippy::missing_safety_doc,
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used
)]

#[path = "hostile/fmu.rs"]
mod fmu;
#[path = "../benches/importer.rs"]
mod importer;

use core::ffi::c_void;
use core::sync::atomic::{AtomicU64, Ordering::Relaxed};
use fmu::{Fmu, files, pack, packed, skipped};
use importer::Importer;

static ALLOCATIONS: AtomicU64 = AtomicU64::new(0);

unsafe extern "C" {
    fn __libc_malloc(size: usize) -> *mut c_void;
    fn __libc_calloc(n: usize, size: usize) -> *mut c_void;
    fn __libc_realloc(p: *mut c_void, size: usize) -> *mut c_void;
    fn __libc_memalign(alignment: usize, size: usize) -> *mut c_void;
}

/// Takes the place of the C library's function, counts and passes on.
macro_rules! counted {
    ($($name:ident($($arg:ident: $type:ty),*) => $to:ident;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($arg: $type),*) -> *mut c_void {
            ALLOCATIONS.fetch_add(1, Relaxed);
            // SAFETY: the caller's arguments.
            unsafe { $to($($arg),*) }
        }
    )*};
}
counted! {
    malloc(size: usize) => __libc_malloc;
    calloc(n: usize, size: usize) => __libc_calloc;
    realloc(p: *mut c_void, size: usize) => __libc_realloc;
    memalign(alignment: usize, size: usize) => __libc_memalign;
    aligned_alloc(alignment: usize, size: usize) => __libc_memalign;
}
/// As the C library's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn posix_memalign(p: *mut *mut c_void, alignment: usize, size: usize) -> i32 {
    ALLOCATIONS.fetch_add(1, Relaxed);
    // SAFETY: the caller's arguments.
    unsafe { *p = __libc_memalign(alignment, size) };
    0
}

fn during(work: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.load(Relaxed);
    work();
    ALLOCATIONS.load(Relaxed) - before
}

// One test in this program: another thread's allocations would be counted too.
#[test]
fn none_after_initialization() {
    let mut all = packed();
    if all.is_empty() {
        skipped("neither TRUEUP_FMUS nor TRUEUP_BIN is set, so there is no FMU to count in; run ./test");
    }
    // A robot with all that is made on request: measures and a table of modes.
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("robot");
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/robot.toml");
    if pack(&["--robot", robot], &folder) {
        all.extend(files(&folder));
    }
    for file in all {
        let fmu = Fmu::load(&file);
        let (mut me, mut cs) = (None, None);
        let made = during(|| me = Some(Importer::model_exchange(&fmu)));
        // Instances have vectors: the FMU's allocations are seen.
        assert!(made > 20, "{}: {made} allocations counted", fmu.name);
        cs.replace(Importer::co_simulation(&fmu));
        let (me, cs) = (me.as_mut().unwrap(), cs.as_mut().unwrap());
        let input = |k: u32| 0.1 * f64::from(k % 7) - 0.3;
        let evaluations = during(|| (0..1000).for_each(|k| _ = me.evaluate(f64::from(k), input(k))));
        assert_eq!(evaluations, 0, "{}: 1000 derivative evaluations", fmu.name);
        let steps = during(|| (0..100).for_each(|k| _ = cs.step(1e-2, input(k))));
        assert_eq!(steps, 0, "{}: 100 steps", fmu.name);
    }
}
