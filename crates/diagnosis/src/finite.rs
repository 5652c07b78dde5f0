//! Whether every figure of a result is finite. JSON has no number that is not, and would say `null`, which means something else.

use std::fmt;

use serde::ser::{self, Serialize};

/// A figure that is not finite, by its path: `gap.overall.before`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path} is {value}, not finite")]
pub struct NotFinite {
    /// Where it is.
    pub path: String,
    /// `NaN`, `inf` or `-inf`; or why it is not known.
    pub value: String,
}

impl ser::Error for NotFinite {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self { path: String::new(), value: message.to_string() }
    }
}

/// Looks at all figures of a value.
///
/// # Errors
/// The first one that is not finite.
pub fn check<T: Serialize + ?Sized>(value: &T) -> Result<(), NotFinite> {
    value.serialize(&mut Walk::default())
}

/// Where it is.
#[derive(Default)]
struct Walk {
    path: Vec<String>,
    /// Index of the next element, of every list that is open.
    next: Vec<usize>,
}

impl Walk {
    fn figure(&self, x: f64) -> Result<(), NotFinite> {
        if x.is_finite() {
            return Ok(());
        }
        Err(NotFinite { path: self.path.join("."), value: x.to_string() })
    }
    fn list(&mut self) -> &mut Self {
        self.next.push(0);
        self
    }
    fn element<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), NotFinite> {
        let k = self.next.last_mut().map_or(0, |k| {
            *k += 1;
            *k
        });
        self.under(k.to_string(), value)
    }
    fn under<T: Serialize + ?Sized>(&mut self, name: String, value: &T) -> Result<(), NotFinite> {
        self.path.push(name);
        value.serialize(&mut *self)?;
        self.path.pop();
        Ok(())
    }
    fn close(&mut self) -> Result<(), NotFinite> {
        self.next.pop();
        Ok(())
    }
}

macro_rules! nothing {
    ($($name:ident($kind:ty)),*) => { $(fn $name(self, _: $kind) -> Result<(), NotFinite> { Ok(()) })* };
}

impl<'a> ser::Serializer for &'a mut Walk {
    type Ok = ();
    type Error = NotFinite;
    type SerializeSeq = &'a mut Walk;
    type SerializeTuple = &'a mut Walk;
    type SerializeTupleStruct = &'a mut Walk;
    type SerializeTupleVariant = &'a mut Walk;
    type SerializeMap = &'a mut Walk;
    type SerializeStruct = &'a mut Walk;
    type SerializeStructVariant = &'a mut Walk;

    nothing!(
        serialize_bool(bool),
        serialize_i8(i8),
        serialize_i16(i16),
        serialize_i32(i32),
        serialize_i64(i64),
        serialize_u8(u8),
        serialize_u16(u16),
        serialize_u32(u32),
        serialize_u64(u64),
        serialize_char(char),
        serialize_str(&str),
        serialize_bytes(&[u8]),
        serialize_unit_struct(&'static str)
    );
    fn serialize_f32(self, x: f32) -> Result<(), NotFinite> {
        self.figure(x.into())
    }
    fn serialize_f64(self, x: f64) -> Result<(), NotFinite> {
        self.figure(x)
    }
    fn serialize_none(self) -> Result<(), NotFinite> {
        Ok(())
    }
    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), NotFinite> {
        value.serialize(self)
    }
    fn serialize_unit(self) -> Result<(), NotFinite> {
        Ok(())
    }
    fn serialize_unit_variant(self, _: &'static str, _: u32, _: &'static str) -> Result<(), NotFinite> {
        Ok(())
    }
    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<(), NotFinite> {
        value.serialize(self)
    }
    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        name: &'static str,
        value: &T,
    ) -> Result<(), NotFinite> {
        self.under(name.to_owned(), value)
    }
    fn serialize_seq(self, _: Option<usize>) -> Result<Self, NotFinite> {
        Ok(self.list())
    }
    fn serialize_tuple(self, _: usize) -> Result<Self, NotFinite> {
        Ok(self.list())
    }
    fn serialize_tuple_struct(self, _: &'static str, _: usize) -> Result<Self, NotFinite> {
        Ok(self.list())
    }
    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, NotFinite> {
        Ok(self.list())
    }
    fn serialize_map(self, _: Option<usize>) -> Result<Self, NotFinite> {
        Ok(self.list())
    }
    fn serialize_struct(self, _: &'static str, _: usize) -> Result<Self, NotFinite> {
        Ok(self.list())
    }
    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        _: &'static str,
        _: usize,
    ) -> Result<Self, NotFinite> {
        Ok(self.list())
    }
}

macro_rules! lists {
    ($($kind:ident $method:ident),*) => { $(impl ser::$kind for &mut Walk {
        type Ok = ();
        type Error = NotFinite;
        fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), NotFinite> {
            self.element(value)
        }
        fn end(self) -> Result<(), NotFinite> {
            self.close()
        }
    })* };
}
lists!(
    SerializeSeq serialize_element,
    SerializeTuple serialize_element,
    SerializeTupleStruct serialize_field,
    SerializeTupleVariant serialize_field
);

macro_rules! structs {
    ($($kind:ident),*) => { $(impl ser::$kind for &mut Walk {
        type Ok = ();
        type Error = NotFinite;
        fn serialize_field<T: Serialize + ?Sized>(
            &mut self,
            name: &'static str,
            value: &T,
        ) -> Result<(), NotFinite> {
            self.under(name.to_owned(), value)
        }
        fn end(self) -> Result<(), NotFinite> {
            self.close()
        }
    })* };
}
structs!(SerializeStruct, SerializeStructVariant);

impl ser::SerializeMap for &mut Walk {
    type Ok = ();
    type Error = NotFinite;
    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), NotFinite> {
        let name = serde_json::to_value(key).ok().and_then(|v| v.as_str().map(str::to_owned));
        self.path.push(name.unwrap_or_default());
        Ok(())
    }
    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), NotFinite> {
        value.serialize(&mut **self)?;
        self.path.pop();
        Ok(())
    }
    fn end(self) -> Result<(), NotFinite> {
        self.close()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Serialize;
    use std::collections::BTreeMap;

    #[derive(Serialize)]
    struct ValuePath {
        name: &'static str,
        list: Vec<Option<[f64; 2]>>,
        map: BTreeMap<String, f64>,
    }

    #[test]
    fn what_is_not_finite_is_named_by_its_path() {
        let mut all =
            ValuePath { name: "x", list: vec![None, Some([0.0, 1.0])], map: [("a".to_owned(), 1.0)].into() };
        assert_eq!(check(&all), Ok(()));
        all.map.insert("b".into(), f64::NEG_INFINITY);
        assert_eq!(check(&all).unwrap_err().to_string(), "map.b is -inf, not finite");
        all.list.push(Some([0.0, f64::NAN]));
        assert_eq!(check(&all).unwrap_err().to_string(), "list.3.2 is NaN, not finite");
        assert_eq!(all.name, "x");
    }
}
