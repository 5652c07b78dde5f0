//! The functions of an FMU: pointers into its library, or to what replaces them when it is in another process.

#![allow(unsafe_code)] // the C boundary

use std::ffi::c_void;

use libloading::Library;

use crate::core::FunctionTable;
use crate::isolation::{HostFault, RemoteInstance};

/// A struct with one optional pointer per function of a version.
macro_rules! function_table {
    ($free:ident: $(fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {
        /// Pointers to the functions that the library exports; they are valid while `library` is loaded.
        #[allow(non_snake_case, dead_code)] // the list is complete, also where nothing needs it yet
        pub(crate) struct LibraryFunctions {
            $(pub(crate) $name: Option<pointer::$name>,)*
            /// Taken (never unloaded) when the FMU ended in a fatal error.
            pub(crate) library: Option<Library>,
            /// The process that has the library, if it is not this one.
            pub(crate) remote: Option<RemoteInstance>,
        }

        impl LibraryFunctions {
            /// No function at all.
            pub(crate) fn none() -> Self {
                Self { $($name: None,)* library: None, remote: None }
            }

            pub(crate) fn of(library: Library) -> Self {
                Self {
                    // SAFETY: the symbol is a function of the standard, with the standard's signature.
                    $($name: unsafe { library.get::<pointer::$name>(stringify!($name)) }.ok().map(|f| *f),)*
                    library: Some(library),
                    remote: None,
                }
            }
        }

        impl FunctionTable for LibraryFunctions {
            unsafe fn free(&self, component: *mut c_void) {
                match (&self.remote, self.$free) {
                    (Some(remote), _) => remote.free(),
                    // SAFETY: the caller's word.
                    (None, Some(free)) => unsafe { free(component) },
                    (None, None) => {}
                }
            }

            fn leak(&mut self) {
                self.remote.iter().for_each(RemoteInstance::abandon);
                std::mem::forget(self.library.take());
            }

            fn fault(&self) -> Option<HostFault> {
                self.remote.as_ref().and_then(RemoteInstance::fault)
            }

            fn blamed(&self) -> Option<&'static str> {
                self.remote.as_ref().and_then(RemoteInstance::blamed)
            }
        }
    };
}

/// The table of FMI 2.0.
pub(crate) mod table2 {
    use super::*;
    use trueup_fmi::abi::fmi2::*;
    macro_rules! table {
        ($($list:tt)*) => { function_table! { fmi2FreeInstance: $($list)* } };
    }
    trueup_fmi::fmi2_functions!(table);
}

/// The table of FMI 3.0.
pub(crate) mod table3 {
    use super::*;
    use trueup_fmi::abi::fmi3::*;
    macro_rules! table {
        ($($list:tt)*) => { function_table! { fmi3FreeInstance: $($list)* } };
    }
    trueup_fmi::fmi3_functions!(table);
}
