//! Values and derivatives of variables. An array has one value reference and all its elements, in row-major
//! order, in the values.

use trueup_fmi::abi::fmi3::*;

use super::{Fmi3Instance, Intermediate};
use crate::core::{PreparedReferences, c_strings, call, call_prepared, lent};
use crate::error::ImportError;
use crate::log::text;

/// A numeric type of FMI 3.0.
pub trait Fmi3Number: Sized {
    /// What an element is before the FMU writes it; of an integer every value may be one of the FMU's.
    #[doc(hidden)]
    const UNWRITTEN: Self;
    #[doc(hidden)]
    fn read(
        instance: &mut Fmi3Instance,
        block: &PreparedReferences,
        values: &mut [Self],
    ) -> Result<(), Box<ImportError>>;
    #[doc(hidden)]
    fn write(
        instance: &mut Fmi3Instance,
        block: &PreparedReferences,
        values: &[Self],
    ) -> Result<(), Box<ImportError>>;
}

impl Fmi3Instance {
    /// Values of a block; all its variables are of the type of `values`.
    ///
    /// # Errors
    /// [`ImportError::Length`]; [`ImportError::Stale`] if sizes have changed since the block was prepared; whatever
    /// `fmi3Get<Type>` returns.
    #[inline]
    pub fn read<T: Fmi3Number>(
        &mut self,
        block: &PreparedReferences,
        values: &mut [T],
    ) -> Result<(), Box<ImportError>> {
        T::read(self, block, values)
    }

    /// Sets the values of a block.
    ///
    /// # Errors
    /// As [`Fmi3Instance::read`].
    #[inline]
    pub fn write<T: Fmi3Number>(
        &mut self,
        block: &PreparedReferences,
        values: &[T],
    ) -> Result<(), Box<ImportError>> {
        T::write(self, block, values)
    }
}

macro_rules! numeric {
    ($($get:ident $fmi_get:ident $set:ident $fmi_set:ident $type:ty, $unwritten:expr;)*) => {
        numeric! { for Fmi3Instance: $($get $fmi_get $set $fmi_set $type;)* }
        numeric! { for Intermediate: $($get $fmi_get $set $fmi_set $type;)* }
        $(impl Fmi3Number for $type {
            const UNWRITTEN: Self = $unwritten;
            #[inline]
            fn read(instance: &mut Fmi3Instance, block: &PreparedReferences, values: &mut [Self]) -> Result<(), Box<ImportError>> {
                let core = &instance.core;
                let (n, length, epoch) = (block.references.len(), values.len(), instance.epoch);
                values.fill(Self::UNWRITTEN);
                lent(&block.references, |r| {
                    call_prepared!(core, $fmi_get, block, epoch, length, r, n, values.as_mut_ptr(), length)
                })
            }
            #[inline]
            fn write(instance: &mut Fmi3Instance, block: &PreparedReferences, values: &[Self]) -> Result<(), Box<ImportError>> {
                let core = &instance.core;
                let (n, length, epoch) = (block.references.len(), values.len(), instance.epoch);
                lent(&block.references, |r| {
                    lent(values, |v| call_prepared!(core, $fmi_set, block, epoch, length, r, n, v, length))
                })
            }
        })*
    };
    (for $receiver:ident: $($get:ident $fmi_get:ident $set:ident $fmi_set:ident $type:ty;)*) => {
        impl $receiver {
            $(
                #[doc = concat!("`", stringify!($fmi_get), "`.")]
                ///
                /// # Errors
                /// [`ImportError::Length`] if `values` has not room for exactly all elements; whatever it returns.
                pub fn $get(&mut self, references: &[u32], values: &mut [$type]) -> Result<(), ImportError> {
                    self.core.length(stringify!($fmi_get), "values", self.core.count(references)?, values.len())?;
                    let (n, length) = (references.len(), values.len());
                    values.fill(<$type as Fmi3Number>::UNWRITTEN);
                    lent(references, |r| call!(self.core, $fmi_get, r, n, values.as_mut_ptr(), length))
                }

                #[doc = concat!("`", stringify!($fmi_set), "`.")]
                ///
                /// # Errors
                /// [`ImportError::Length`] if `values` has not exactly all elements; whatever it returns.
                pub fn $set(&mut self, references: &[u32], values: &[$type]) -> Result<(), ImportError> {
                    self.core.length(stringify!($fmi_set), "values", self.core.count(references)?, values.len())?;
                    let (n, length) = (references.len(), values.len());
                    lent(references, |r| lent(values, |v| call!(self.core, $fmi_set, r, n, v, length)))
                }
            )*
        }
    };
}

numeric! {
    get_float32 fmi3GetFloat32 set_float32 fmi3SetFloat32 f32, f32::NAN;
    get_float64 fmi3GetFloat64 set_float64 fmi3SetFloat64 f64, f64::NAN;
    get_int8 fmi3GetInt8 set_int8 fmi3SetInt8 i8, 0;
    get_uint8 fmi3GetUInt8 set_uint8 fmi3SetUInt8 u8, 0;
    get_int16 fmi3GetInt16 set_int16 fmi3SetInt16 i16, 0;
    get_uint16 fmi3GetUInt16 set_uint16 fmi3SetUInt16 u16, 0;
    get_int32 fmi3GetInt32 set_int32 fmi3SetInt32 i32, 0;
    get_uint32 fmi3GetUInt32 set_uint32 fmi3SetUInt32 u32, 0;
    get_int64 fmi3GetInt64 set_int64 fmi3SetInt64 i64, 0;
    get_uint64 fmi3GetUInt64 set_uint64 fmi3SetUInt64 u64, 0;
}

impl Fmi3Instance {
    /// Values of Booleans.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetBoolean` returns.
    pub fn get_boolean(&mut self, references: &[u32], values: &mut [bool]) -> Result<(), ImportError> {
        self.core.length("fmi3GetBoolean", "values", self.core.count(references)?, values.len())?;
        let mut raw = vec![fmi3False; values.len()];
        lent(references, |r| {
            call!(self.core, fmi3GetBoolean, r, references.len(), raw.as_mut_ptr(), raw.len())
        })?;
        values.iter_mut().zip(raw).for_each(|(value, raw)| *value = raw.into());
        Ok(())
    }

    /// Sets Booleans.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3SetBoolean` returns.
    pub fn set_boolean(&mut self, references: &[u32], values: &[bool]) -> Result<(), ImportError> {
        self.core.length("fmi3SetBoolean", "values", self.core.count(references)?, values.len())?;
        let raw: Vec<fmi3Boolean> = values.iter().map(|value| (*value).into()).collect();
        lent(references, |r| call!(self.core, fmi3SetBoolean, r, references.len(), raw.as_ptr(), raw.len()))
    }

    /// Values of Strings.
    ///
    /// # Errors
    /// Whatever `fmi3GetString` returns.
    pub fn get_string(&mut self, references: &[u32]) -> Result<Vec<String>, ImportError> {
        let mut raw = vec![std::ptr::null(); self.core.count(references)?];
        lent(references, |r| {
            call!(self.core, fmi3GetString, r, references.len(), raw.as_mut_ptr(), raw.len())
        })?;
        // SAFETY: the FMU's texts are NULL or null-terminated, and valid until its next call.
        Ok(raw.into_iter().map(|pointer| unsafe { text(pointer) }).collect())
    }

    /// Sets Strings.
    ///
    /// # Errors
    /// [`ImportError::Length`], [`ImportError::Text`]; whatever `fmi3SetString` returns.
    pub fn set_string(&mut self, references: &[u32], values: &[&str]) -> Result<(), ImportError> {
        self.core.length("fmi3SetString", "values", self.core.count(references)?, values.len())?;
        let texts = c_strings("value", values)?;
        let raw: Vec<_> = texts.iter().map(|text| text.as_ptr()).collect();
        lent(references, |r| call!(self.core, fmi3SetString, r, references.len(), raw.as_ptr(), raw.len()))
    }

    /// Values of Binaries.
    ///
    /// # Errors
    /// Whatever `fmi3GetBinary` returns.
    pub fn get_binary(&mut self, references: &[u32]) -> Result<Vec<Vec<u8>>, ImportError> {
        let count = self.core.count(references)?;
        let (mut sizes, mut raw) = (vec![0_usize; count], vec![std::ptr::null(); count]);
        let n = references.len();
        lent(references, |r| {
            call!(self.core, fmi3GetBinary, r, n, sizes.as_mut_ptr(), raw.as_mut_ptr(), count)
        })?;
        let copy = |(pointer, size): (fmi3Binary, usize)| {
            if pointer.is_null() {
                return Vec::new();
            }
            // SAFETY: not NULL, so of the size that the FMU gave, and valid until its next call.
            unsafe { std::slice::from_raw_parts(pointer, size) }.to_vec()
        };
        Ok(raw.into_iter().zip(sizes).map(copy).collect())
    }

    /// Sets Binaries.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3SetBinary` returns.
    pub fn set_binary(&mut self, references: &[u32], values: &[&[u8]]) -> Result<(), ImportError> {
        self.core.length("fmi3SetBinary", "values", self.core.count(references)?, values.len())?;
        let sizes: Vec<usize> = values.iter().map(|value| value.len()).collect();
        let raw: Vec<fmi3Binary> = values.iter().map(|value| value.as_ptr()).collect();
        let n = references.len();
        lent(references, |r| call!(self.core, fmi3SetBinary, r, n, sizes.as_ptr(), raw.as_ptr(), raw.len()))
    }

    /// Which clocks tick.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetClock` returns.
    pub fn get_clock(&mut self, references: &[u32], values: &mut [bool]) -> Result<(), ImportError> {
        self.core.length("fmi3GetClock", "values", references.len(), values.len())?;
        let mut raw = vec![fmi3False; values.len()];
        lent(references, |r| call!(self.core, fmi3GetClock, r, references.len(), raw.as_mut_ptr()))?;
        values.iter_mut().zip(raw).for_each(|(value, raw)| *value = raw.into());
        Ok(())
    }

    /// Lets clocks tick.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3SetClock` returns.
    pub fn set_clock(&mut self, references: &[u32], values: &[bool]) -> Result<(), ImportError> {
        self.core.length("fmi3SetClock", "values", references.len(), values.len())?;
        let raw: Vec<fmi3Clock> = values.iter().map(|value| (*value).into()).collect();
        lent(references, |r| call!(self.core, fmi3SetClock, r, references.len(), raw.as_ptr()))
    }
}

/// Which partial derivatives: of the unknowns with respect to the knowns.
#[derive(Clone, Copy, Debug)]
pub struct DerivativeOf<'a> {
    /// Value references of the unknowns.
    pub unknowns: &'a [u32],
    /// Value references of the knowns.
    pub knowns: &'a [u32],
}

macro_rules! derivative {
    ($self:ident $function:ident $of:ident $seed:ident ($($seeds:tt)*) $result:ident ($($results:tt)*)) => {{
        $self.core.length(stringify!($function), "seed", $self.core.count($($seeds)*)?, $seed.len())?;
        $self.core.length(stringify!($function), "result", $self.core.count($($results)*)?, $result.len())?;
        let (unknowns, knowns) = ($of.unknowns, $of.knowns);
        let (n_unknowns, n_knowns, n_seed, n_result) = (unknowns.len(), knowns.len(), $seed.len(), $result.len());
        let result = $result.as_mut_ptr();
        lent(unknowns, |u| {
            lent(knowns, |k| {
                lent($seed, |s| {
                    call!($self.core, $function, u, n_unknowns, k, n_knowns, s, n_seed, result, n_result)
                })
            })
        })
    }};
}

impl Fmi3Instance {
    /// Partial derivatives times a direction: `seed` has the elements of the knowns, `result` of the unknowns.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetDirectionalDerivative` returns.
    pub fn directional_derivative(
        &mut self,
        of: DerivativeOf,
        seed: &[f64],
        result: &mut [f64],
    ) -> Result<(), ImportError> {
        derivative!(self fmi3GetDirectionalDerivative of seed (of.knowns) result (of.unknowns))
    }

    /// A row vector times partial derivatives: `seed` has the elements of the unknowns, `result` of the knowns.
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetAdjointDerivative` returns.
    pub fn adjoint_derivative(
        &mut self,
        of: DerivativeOf,
        seed: &[f64],
        result: &mut [f64],
    ) -> Result<(), ImportError> {
        derivative!(self fmi3GetAdjointDerivative of seed (of.unknowns) result (of.knowns))
    }

    /// Derivatives of outputs with respect to time, each variable's of its order (from 1).
    ///
    /// # Errors
    /// [`ImportError::Length`]; whatever `fmi3GetOutputDerivatives` returns.
    pub fn get_output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Result<(), ImportError> {
        self.core.length("fmi3GetOutputDerivatives", "orders", references.len(), orders.len())?;
        self.core.length("fmi3GetOutputDerivatives", "values", self.core.count(references)?, values.len())?;
        let (n, length) = (references.len(), values.len());
        let orders = orders.as_ptr();
        call!(
            self.core,
            fmi3GetOutputDerivatives,
            references.as_ptr(),
            n,
            orders,
            values.as_mut_ptr(),
            length
        )
    }
}
