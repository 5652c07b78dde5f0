//! The types that cross the C boundary, named as in the official headers.
//!
//! Enumerations are integers and booleans of FMI 3.0 are bytes: whatever the other side hands over is a
//! valid value here, never undefined behaviour. [`fmi2_functions!`](crate::fmi2_functions) and
//! [`fmi3_functions!`](crate::fmi3_functions) hold the one list of all functions of each version; both
//! sides of the boundary are made from it or checked against it:
//!
//! ```
//! use trueup_fmi::abi::fmi2::*;
//! macro_rules! count {
//!     ($(fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {
//!         [$(stringify!($name)),*].len()
//!     };
//! }
//! assert_eq!(trueup_fmi::fmi2_functions!(count), 44);
//! ```

#![allow(unsafe_code)] // the C boundary
#![allow(non_camel_case_types, non_snake_case, non_upper_case_globals)]

pub mod fmi2;
pub mod fmi3;

/// An enumeration of C as an integer with named values; unknown values are legal.
macro_rules! integer_enum {
    ($(#[$doc:meta])* $name:ident { $($(#[$item_doc:meta])* $item:ident = $value:expr),* $(,)? }) => {
        $(#[$doc])*
        #[repr(transparent)]
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub struct $name(pub core::ffi::c_int);
        $($(#[$item_doc])* pub const $item: $name = $name($value);)*

        impl $name {
            /// All values that the standard names.
            pub const ALL: &'static [(&'static str, $name)] = &[$((stringify!($item), $item)),*];
        }

        impl core::fmt::Display for $name {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                match Self::ALL.iter().find(|(_, value)| value == self) {
                    Some((name, _)) => f.write_str(name),
                    None => write!(f, "{} {}", stringify!($name), self.0),
                }
            }
        }
    };
}
pub(crate) use integer_enum;

/// One pointer type per function of a list.
macro_rules! pointer_types {
    ($(fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {
        $(
            #[doc = concat!("Pointer to `", stringify!($name), "`.")]
            pub type $name = unsafe extern "C" fn($($arg: $type),*) $(-> $result)?;
        )*
        /// The names of all functions, in the order of the header.
        pub const NAMES: &[&str] = &[$(stringify!($name)),*];
    };
}
pub(crate) use pointer_types;
