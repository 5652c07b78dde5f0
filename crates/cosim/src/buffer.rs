//! Values of any type, and blocks of variables that one call reads or sets.

use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::description::VariableType;
use trueup_fmi_import::{AnyInstance, ImportError, fmi2, fmi3};

/// Variables of one type that are read or set by one call.
#[derive(Clone, Debug, PartialEq)]
pub struct VariableBlock {
    /// Value references.
    pub references: Vec<u32>,
    /// All their elements.
    pub values: ValueBuffer,
}

macro_rules! buffers {
    ($($kind:ident $type:ty, $get:ident $set:ident;)*) => {
        /// Values of one type.
        #[derive(Clone, Debug, PartialEq)]
        #[allow(missing_docs)]
        pub enum ValueBuffer {
            $($kind(Vec<$type>),)*
            Boolean(Vec<bool>),
            String(Vec<String>),
        }

        impl ValueBuffer {
            /// Of this length; `None` for binaries and clocks. FMI 2.0 has its enumerations among the `Int32`.
            pub fn new(kind: VariableType, version: FmiVersion, length: usize) -> Option<Self> {
                Some(match kind {
                    $(VariableType::$kind => Self::$kind(vec![Default::default(); length]),)*
                    VariableType::Enumeration if version == FmiVersion::V2 => Self::Int32(vec![0; length]),
                    VariableType::Enumeration => Self::Int64(vec![0; length]),
                    VariableType::Boolean => Self::Boolean(vec![false; length]),
                    VariableType::String => Self::String(vec![String::new(); length]),
                    VariableType::Binary | VariableType::Clock => return None,
                })
            }

            /// Appends what reads back as the same value: of a double its shortest digits, Booleans as 0 or 1.
            pub(crate) fn texts(&self, out: &mut Vec<String>) {
                match self {
                    $(Self::$kind(v) => out.extend(v.iter().map(|x| format!("{x:?}"))),)*
                    Self::Boolean(v) => out.extend(v.iter().map(|x| u8::from(*x).to_string())),
                    Self::String(v) => out.extend(v.iter().cloned()),
                }
            }

            /// An element as a number; Booleans as 0 or 1.
            pub(crate) fn number(&self, at: usize) -> Option<f64> {
                match self {
                    $(Self::$kind(v) => v.get(at).map(|x| *x as f64),)*
                    Self::Boolean(v) => v.get(at).map(|x| f64::from(u8::from(*x))),
                    Self::String(_) => None,
                }
            }

            /// Appends values of the same type; returns where they begin.
            pub(crate) fn append(&mut self, other: Self) -> usize {
                match (self, other) {
                    $((Self::$kind(v), Self::$kind(w)) => { v.extend(w.iter()); v.len() - w.len() })*
                    (Self::Boolean(v), Self::Boolean(w)) => { v.extend(w.iter()); v.len() - w.len() }
                    (Self::String(v), Self::String(w)) => { let at = v.len(); v.extend(w); at }
                    _ => 0, // never requested: blocks are of one type
                }
            }

            /// An element; `None`: a text.
            pub(crate) fn exact(&self, at: usize) -> Option<ElementNumber> {
                match self {
                    $(Self::$kind(v) => v.get(at).map(|x| x.number()),)*
                    Self::Boolean(v) => v.get(at).map(|x| ElementNumber::Whole((*x).into())),
                    Self::String(_) => None,
                }
            }

            /// Sets an element; `false` if the type cannot hold it.
            pub(crate) fn set_exact(&mut self, at: usize, number: ElementNumber) -> bool {
                match self {
                    $(Self::$kind(v) => Exact::of(number).map(|x| v[at] = x).is_some(),)*
                    Self::Boolean(v) => match number.real() {
                        x if x == 0.0 || x == 1.0 => { v[at] = x == 1.0; true }
                        _ => false,
                    },
                    Self::String(_) => false,
                }
            }

            /// Sets an element from a text; `false` if it is no value of this type.
            pub(crate) fn parse(&mut self, at: usize, text: &str) -> bool {
                match self {
                    $(Self::$kind(v) => text.parse().map(|x| v[at] = x).is_ok(),)*
                    Self::Boolean(v) => match text {
                        "true" | "True" | "1" => { v[at] = true; true }
                        "false" | "False" | "0" => { v[at] = false; true }
                        _ => false,
                    },
                    Self::String(v) => { text.clone_into(&mut v[at]); true }
                }
            }
        }

        impl BlockAccess for fmi3::Fmi3Instance {
            fn get(&mut self, block: &mut VariableBlock) -> Result<(), ImportError> {
                match &mut block.values {
                    $(ValueBuffer::$kind(v) => self.$get(&block.references, v),)*
                    ValueBuffer::Boolean(v) => self.get_boolean(&block.references, v),
                    ValueBuffer::String(v) => self.get_string(&block.references).map(|texts| *v = texts),
                }
            }
            fn set(&mut self, block: &VariableBlock) -> Result<(), ImportError> {
                match &block.values {
                    $(ValueBuffer::$kind(v) => self.$set(&block.references, v),)*
                    ValueBuffer::Boolean(v) => self.set_boolean(&block.references, v),
                    ValueBuffer::String(v) => self.set_string(&block.references, &texts(v)),
                }
            }
        }
    };
}
buffers! {
    Float32 f32, get_float32 set_float32;
    Float64 f64, get_float64 set_float64;
    Int8 i8, get_int8 set_int8;
    UInt8 u8, get_uint8 set_uint8;
    Int16 i16, get_int16 set_int16;
    UInt16 u16, get_uint16 set_uint16;
    Int32 i32, get_int32 set_int32;
    UInt32 u32, get_uint32 set_uint32;
    Int64 i64, get_int64 set_int64;
    UInt64 u64, get_uint64 set_uint64;
}

/// An element as it is handed on: exact for every type.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ElementNumber {
    /// Of floats.
    Real(f64),
    /// Of integers, Booleans (0, 1) and items of enumerations.
    Whole(i128),
}

impl ElementNumber {
    pub(crate) fn real(self) -> f64 {
        match self {
            Self::Real(x) => x,
            Self::Whole(x) => x as f64,
        }
    }
}

/// How a type takes and gives a [`ElementNumber`].
trait Exact: Copy {
    fn number(self) -> ElementNumber;
    fn of(number: ElementNumber) -> Option<Self>;
}
macro_rules! exact {
    ($($float:ty)*; $($whole:ty)*) => {
        $(impl Exact for $float {
            fn number(self) -> ElementNumber { ElementNumber::Real(f64::from(self)) }
            fn of(number: ElementNumber) -> Option<Self> { Some(number.real() as $float) }
        })*
        $(impl Exact for $whole {
            fn number(self) -> ElementNumber { ElementNumber::Whole(self.into()) }
            fn of(number: ElementNumber) -> Option<Self> {
                match number {
                    ElementNumber::Whole(x) => x.try_into().ok(),
                    ElementNumber::Real(x) => (x.fract() == 0.0).then(|| (x as i128).try_into().ok()).flatten(),
                }
            }
        })*
    };
}
exact! { f32 f64; i8 u8 i16 u16 i32 u32 i64 u64 }

/// Reading and setting blocks.
pub trait BlockAccess {
    /// Reads a block.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    fn get(&mut self, block: &mut VariableBlock) -> Result<(), ImportError>;
    /// Sets a block.
    ///
    /// # Errors
    /// Whatever the FMU returns.
    fn set(&mut self, block: &VariableBlock) -> Result<(), ImportError>;
    /// Reads a block again: has one of its values changed?
    ///
    /// # Errors
    /// Whatever the FMU returns.
    fn get_changed(&mut self, block: &mut VariableBlock) -> Result<bool, ImportError> {
        let before = block.values.clone();
        self.get(block)?;
        Ok(before != block.values)
    }
}

impl BlockAccess for AnyInstance {
    fn get(&mut self, block: &mut VariableBlock) -> Result<(), ImportError> {
        match self {
            Self::V2(i) => i.as_mut().get(block),
            Self::V3(i) => i.get(block),
        }
    }
    fn set(&mut self, block: &VariableBlock) -> Result<(), ImportError> {
        match self {
            Self::V2(i) => i.as_mut().set(block),
            Self::V3(i) => i.set(block),
        }
    }
}

/// Sets structural parameters (FMI 3.0), in configuration mode.
///
/// # Errors
/// Whatever the FMU returns.
pub(crate) fn configure(instance: &mut AnyInstance, structural: &[VariableBlock]) -> Result<(), ImportError> {
    if structural.is_empty() {
        return Ok(());
    }
    instance.enter_configuration_mode()?;
    structural.iter().try_for_each(|block| instance.set(block))?;
    instance.exit_configuration_mode()
}

fn texts(values: &[String]) -> Vec<&str> {
    values.iter().map(String::as_str).collect()
}

/// Types that FMI 2.0 does not have cannot come from its descriptions.
impl BlockAccess for fmi2::Fmi2Instance {
    fn get(&mut self, block: &mut VariableBlock) -> Result<(), ImportError> {
        match &mut block.values {
            ValueBuffer::Float64(v) => self.get_real(&block.references, v),
            ValueBuffer::Int32(v) => self.get_integer(&block.references, v),
            ValueBuffer::Boolean(v) => self.get_boolean(&block.references, v),
            ValueBuffer::String(v) => self.get_string(&block.references).map(|texts| *v = texts),
            _ => Ok(()),
        }
    }
    fn set(&mut self, block: &VariableBlock) -> Result<(), ImportError> {
        match &block.values {
            ValueBuffer::Float64(v) => self.set_real(&block.references, v),
            ValueBuffer::Int32(v) => self.set_integer(&block.references, v),
            ValueBuffer::Boolean(v) => self.set_boolean(&block.references, v),
            ValueBuffer::String(v) => self.set_string(&block.references, &texts(v)),
            _ => Ok(()),
        }
    }
}

impl ValueBuffer {
    /// The first value that is not finite.
    pub fn first_not_finite(&self) -> Option<(usize, f64)> {
        match self {
            Self::Float64(v) => v.iter().copied().enumerate().find(|(_, x)| !x.is_finite()),
            Self::Float32(v) => v.iter().map(|x| f64::from(*x)).enumerate().find(|(_, x)| !x.is_finite()),
            _ => None,
        }
    }

    /// Sets an element from a number; `false` if the type cannot hold it.
    pub(crate) fn set_number(&mut self, at: usize, x: f64) -> bool {
        match self {
            Self::Float64(v) => v[at] = x,
            Self::Float32(v) => v[at] = x as f32,
            Self::Boolean(v) if x == 0.0 || x == 1.0 => v[at] = x == 1.0,
            Self::Boolean(_) => return false,
            whole => return x.fract() == 0.0 && whole.parse(at, &format!("{x:.0}")),
        }
        self.first_not_finite().is_none()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_a_type_cannot_hold_is_refused() {
        for (kind, good, bad) in [
            (VariableType::Int8, [-128.0, 127.0], [128.0, 0.5]),
            (VariableType::UInt64, [0.0, 1e15], [-1.0, 1e20]),
            (VariableType::Boolean, [0.0, 1.0], [2.0, -1.0]),
            (VariableType::Float32, [0.1, -1e38], [1e39, f64::INFINITY]),
        ] {
            let mut buffer = ValueBuffer::new(kind, FmiVersion::V3, 1).unwrap();
            assert!(good.iter().all(|x| buffer.set_number(0, *x)), "{kind:?}");
            assert!(bad.iter().all(|x| !buffer.set_number(0, *x)), "{kind:?}");
        }
    }
}
