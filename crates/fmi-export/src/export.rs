//! The C functions of a shared library.

#![allow(unsafe_code)] // the C boundary

/// Makes a shared library an FMU template: all functions of FMI 2.0 and 3.0 for one
/// [`FmuModel`](crate::FmuModel), and the block into which the packer writes the configuration.
///
/// `export_fmu!(Model, stamp)`, the stamp saying from which sources it is built; in tests
/// `export_fmu!(Model, stamp, "model Name\ntoken ...\n")` is packed from the start.
#[macro_export]
macro_rules! export_fmu {
    ($model:ty, $stamp:expr) => {
        $crate::export_fmu!($model, $stamp, "");
    };
    ($model:ty, $stamp:expr, $configuration:expr) => {
        type __ExportedModel = $model;
        const __STAMP: &str = $stamp;
        const __CONFIGURATION: &str = $configuration;

        /// The functions of FMI 2.0 and 3.0, as the standards declare them.
        #[allow(
            missing_docs,
            non_snake_case,
            non_camel_case_types,
            unused_imports,
            clippy::missing_safety_doc
        )]
        pub mod fmi {
            use $crate::trueup_fmi::abi::fmi2::*;
            use $crate::trueup_fmi::abi::fmi3::*;
            use $crate::trueup_fmi::configuration::{
                BLOCK_SIZE, Configuration, ConfigurationError, template,
            };

            /// Filled by the packer.
            #[used]
            #[unsafe(no_mangle)]
            pub static TRUEUP_FMU_CONFIGURATION: [u8; BLOCK_SIZE] =
                template(super::__CONFIGURATION, super::__STAMP);

            #[derive(Debug)]
            pub struct Fmu;
            impl $crate::Exported for Fmu {
                type Model = super::__ExportedModel;
                fn configuration() -> Result<Configuration, ConfigurationError> {
                    $crate::abi::configuration(&TRUEUP_FMU_CONFIGURATION)
                }
            }
            use $crate::{forward_fmi2, forward_fmi3};
            $crate::trueup_fmi::fmi2_functions!(forward_fmi2);
            $crate::trueup_fmi::fmi3_functions!(forward_fmi3);
        }
    };
}

/// For [`export_fmu!`]: the C functions of one version.
#[doc(hidden)]
#[macro_export]
macro_rules! forward_fmi2 {
    ($(fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($arg: $type),*) $(-> $result)? {
            // SAFETY: the importer's pointers are handed on as they are.
            unsafe { $crate::abi::fmi2::$name::<Fmu>($($arg),*) }
        }
    )*};
}

/// For [`export_fmu!`]: the C functions of one version.
#[doc(hidden)]
#[macro_export]
macro_rules! forward_fmi3 {
    ($(fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {$(
        #[unsafe(no_mangle)]
        pub unsafe extern "C" fn $name($($arg: $type),*) $(-> $result)? {
            // SAFETY: the importer's pointers are handed on as they are.
            unsafe { $crate::abi::fmi3::$name::<Fmu>($($arg),*) }
        }
    )*};
}
