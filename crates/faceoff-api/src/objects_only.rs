//! Refuses JSON arrays in place of objects.
//!
//! Structs with a derived `Deserialize` also accept an array, whose items are the fields by position. The OpenAPI document
//! does not promise this, positions change with the code, and `[null, null]` would pass as a request that changes nothing.

use serde::{
    Deserialize,
    de::{
        DeserializeSeed, Deserializer, EnumAccess, Error as _, IntoDeserializer, MapAccess,
        SeqAccess, Unexpected, VariantAccess, Visitor,
    },
    forward_to_deserialize_any,
};
use serde_json::{Error, Map, Value, map};
use std::slice;

/// Checks that a value, which deserialises as `T`, has no array in place of an object, at any depth.
///
/// # Errors
/// The path of the first such array.
pub fn check<'de, T: Deserialize<'de>>(
    value: &'de Value,
) -> Result<(), serde_path_to_error::Error<Error>> {
    serde_path_to_error::deserialize::<_, T>(ObjectsOnly(value)).map(drop)
}

/// A deserializer like that of [`Value`], except that it accepts only objects for structs.
#[derive(Clone, Copy)]
struct ObjectsOnly<'de>(&'de Value);

impl<'de> IntoDeserializer<'de, Error> for ObjectsOnly<'de> {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

impl<'de> Deserializer<'de> for ObjectsOnly<'de> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.0 {
            Value::Array(items) => visitor.visit_seq(Items(items.iter())),
            Value::Object(fields) => visitor.visit_map(Fields::new(fields)),
            scalar => scalar.deserialize_any(visitor),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self.0 {
            Value::Array(_) => Err(Error::invalid_type(Unexpected::Seq, &visitor)),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.0 {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self.0 {
            Value::Object(fields) if fields.len() == 1 => visitor.visit_enum(Fields::new(fields)),
            other => other.deserialize_enum(name, variants, visitor),
        }
    }

    forward_to_deserialize_any! {
        <V: Visitor<'de>>
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map identifier ignored_any
    }
}

/// The items of an array that remain to be read.
struct Items<'de>(slice::Iter<'de, Value>);

impl<'de> SeqAccess<'de> for Items<'de> {
    type Error = Error;

    fn next_element_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Error> {
        let next = self
            .0
            .next()
            .map(|item| seed.deserialize(ObjectsOnly(item)));
        next.transpose()
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

/// Reads the fields of an object.
struct Fields<'de> {
    remaining: map::Iter<'de>,
    /// The value of the field whose name was read last.
    value: &'de Value,
}

impl<'de> Fields<'de> {
    fn new(fields: &'de Map<String, Value>) -> Self {
        Self {
            remaining: fields.iter(),
            value: &Value::Null,
        }
    }
}

impl<'de> MapAccess<'de> for Fields<'de> {
    type Error = Error;

    fn next_key_seed<S: DeserializeSeed<'de>>(
        &mut self,
        seed: S,
    ) -> Result<Option<S::Value>, Error> {
        let Some((name, value)) = self.remaining.next() else {
            return Ok(None);
        };
        self.value = value;
        seed.deserialize(name.as_str().into_deserializer())
            .map(Some)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, Error> {
        seed.deserialize(ObjectsOnly(self.value))
    }
}

/// An externally tagged enum: the variant's name is the object's only field.
impl<'de> EnumAccess<'de> for Fields<'de> {
    type Error = Error;
    type Variant = Self;

    fn variant_seed<S: DeserializeSeed<'de>>(mut self, seed: S) -> Result<(S::Value, Self), Error> {
        let name = self.next_key_seed(seed)?;
        name.map(|name| (name, self))
            .ok_or_else(|| Error::custom("expected the name of a variant, got an empty object"))
    }
}

impl<'de> VariantAccess<'de> for Fields<'de> {
    type Error = Error;

    /// A unit variant is a string, never an object with a null field.
    fn unit_variant(self) -> Result<(), Error> {
        Err(Error::invalid_type(Unexpected::Map, &"a text"))
    }

    fn newtype_variant_seed<S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, Error> {
        seed.deserialize(ObjectsOnly(self.value))
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Error> {
        ObjectsOnly(self.value).deserialize_seq(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        ObjectsOnly(self.value).deserialize_struct("", fields, visitor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[derive(Debug, Deserialize)]
    #[expect(dead_code, reason = "only deserialised")]
    struct Outer {
        inner: Option<Inner>,
        pair: (f64, f64),
        kind: Kind,
    }

    #[derive(Debug, Deserialize)]
    #[expect(dead_code, reason = "only deserialised")]
    struct Inner {
        name: String,
    }

    #[derive(Debug, Deserialize)]
    #[serde(rename_all = "snake_case")]
    #[expect(dead_code, reason = "only deserialised")]
    enum Kind {
        Plain,
        Counted(u32),
        Named(Inner),
    }

    #[test]
    fn array_in_place_of_object_is_refused_at_any_depth() {
        let valid = [
            json!({"inner": {"name": "a"}, "pair": [1, 2.5], "kind": "plain"}),
            json!({"inner": null, "pair": [1, 2], "kind": {"counted": 3}}),
            json!({"pair": [1, 2], "kind": {"named": {"name": "a"}}}),
        ];
        for value in valid {
            check::<Outer>(&value).unwrap();
        }
        let assert_refused = |value: Value, path: &str| {
            // The derived `Deserialize` accepts the value, which is why `check` is needed.
            serde_json::from_value::<Outer>(value.clone()).unwrap();
            let error = check::<Outer>(&value).unwrap_err();
            assert_eq!(error.path().to_string(), path, "{error}");
        };
        assert_refused(json!([{"name": "a"}, [1, 2], "plain"]), ".");
        assert_refused(
            json!({"inner": ["a"], "pair": [1, 2], "kind": "plain"}),
            "inner",
        );
        assert_refused(
            json!({"pair": [1, 2], "kind": {"named": ["a"]}}),
            "kind.named",
        );
        assert_refused(
            json!({"pair": [1, 2], "kind": {"plain": null}}),
            "kind.plain",
        );
    }
}
