//! Lowering by serde: an elaborated object deserialises into the struct of its kind.
//!
//! `Given<T>` takes the slot's value and origin; a `one of` becomes the enum whose variants are its members; a variant
//! (`sphere(radius = …)`) becomes the enum variant of its name.

use serde::Deserializer;
use serde::de::{self, DeserializeSeed, EnumAccess, IntoDeserializer, MapAccess, SeqAccess, VariantAccess, Visitor};

use crate::diagnostics::Span;
use crate::scene::{Origin, Selection, SelectionTerm};
use crate::semantics::kinds::{Kind, Kinds};
use crate::semantics::value::{Object, Quantity, Slot, Value};

/// Why an object does not lower. `unsupported` is for what the checker allows and no pass takes yet; everything else is
/// a bug of ours.
#[derive(Debug)]
pub struct LowerError {
    pub message: String,
    pub unsupported: Option<Span>,
}

impl std::fmt::Display for LowerError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for LowerError {}

impl de::Error for LowerError {
    fn custom<T: std::fmt::Display>(message: T) -> Self {
        Self { message: message.to_string(), unsupported: None }
    }
}

fn bug<T>(wanted: &str, value: &Value) -> Result<T, LowerError> {
    let shown: String = format!("{value:?}").chars().take(120).collect();
    Err(de::Error::custom(format!("{wanted} was expected, not {shown}")))
}

/// Deserialises a whole object.
pub fn from_object<'de, T: de::Deserialize<'de>>(object: &Object, kinds: &Kinds) -> Result<T, LowerError> {
    struct Whole<'a>(&'a Object, &'a Kinds<'a>);
    impl<'de> Deserializer<'de> for Whole<'_> {
        type Error = LowerError;

        fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, LowerError> {
            Err(de::Error::custom("an object lowers to a struct"))
        }

        fn deserialize_struct<V: Visitor<'de>>(
            self,
            _: &'static str,
            fields: &'static [&'static str],
            visitor: V,
        ) -> Result<V::Value, LowerError> {
            visitor.visit_map(ObjectFields::new(self.0, self.1, fields))
        }

        serde::forward_to_deserialize_any! {
            bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
            newtype_struct seq tuple tuple_struct map enum identifier ignored_any
        }
    }
    T::deserialize(Whole(object, kinds))
}

/// One value on its way into a struct.
#[derive(Clone, Copy)]
struct De<'a> {
    value: &'a Value,
    origin: Origin,
    kinds: &'a Kinds<'a>,
}

impl<'a> De<'a> {
    fn slot(slot: &'a Slot, kinds: &'a Kinds<'a>) -> Self {
        Self { value: &slot.value, origin: slot.origin, kinds }
    }

    /// Typed data that is already in its final form goes through serde's own data model.
    fn bridged(&self) -> Option<Result<serde_json::Value, serde_json::Error>> {
        Some(match self.value {
            Value::Selection(selection) => serde_json::to_value(&**selection),
            Value::Item(item) => {
                let term = SelectionTerm { item: item.item, path: Vec::new(), filter: None, span: self.origin.span };
                serde_json::to_value(Selection { terms: vec![term] })
            }
            Value::Signal(signal) => serde_json::to_value(&signal.signal),
            Value::Draft(draft) => serde_json::to_value(&**draft),
            Value::State { case, item } => Ok(serde_json::json!({ "case": case, "item": item })),
            _ => return None,
        })
    }

    /// A strength: one value, or a scatter about a mean.
    fn strength(&self) -> Result<serde_json::Value, LowerError> {
        let number = |object: &Object, name: &str| match object.fields.get(name).map(|slot| &slot.value) {
            Some(Value::Number(number)) => Ok(number.si),
            other => bug("a number", other.unwrap_or(&Value::Absent)),
        };
        match self.value {
            Value::Number(mean) => Ok(serde_json::json!({ "mean": mean.si, "scatter": null })),
            Value::Object(object) if &*object.kind == "weibull" => Ok(serde_json::json!({
                "mean": number(object, "mean")?,
                "scatter": { "weibull": { "shape": number(object, "shape")? } },
            })),
            other => bug("a strength", other),
        }
    }

    fn elements(&self, length: Option<usize>) -> Result<Vec<Value>, LowerError> {
        let list = match self.value {
            Value::List(list) => list.to_vec(),
            Value::Items(items) => items.iter().cloned().map(Value::Item).collect(),
            Value::Symbol { name, .. } if length == Some(4) && **name == *"none" => quaternion([0.0; 3]).to_vec(),
            // `axes = xy`: which of the three letters are there.
            Value::Symbol { name, .. } if length == Some(3) => {
                ['x', 'y', 'z'].iter().map(|axis| Value::Truth(name.contains(*axis))).collect()
            }
            Value::Selection(_) => {
                let message = "a place on a part cannot be used here yet: give three lengths".to_owned();
                return Err(LowerError { message, unsupported: Some(self.origin.span) });
            }
            other => return bug("a list", other),
        };
        match length {
            Some(4) if list.len() == 3 => {
                let angle = |i: usize| match &list[i] {
                    Value::Number(number) => number.si,
                    _ => 0.0,
                };
                Ok(quaternion([angle(0), angle(1), angle(2)]).to_vec())
            }
            Some(length) if list.len() != length => bug(&format!("a list of {length}"), self.value),
            _ => Ok(list),
        }
    }
}

/// The turn about fixed axes, x first, then y, then z, as a quaternion x, y, z, w.
fn quaternion(angles: [f64; 3]) -> [Value; 4] {
    let [(sx, cx), (sy, cy), (sz, cz)] = angles.map(|a| (libm::sin(a / 2.0), libm::cos(a / 2.0)));
    [sx * cy * cz - cx * sy * sz, cx * sy * cz + sx * cy * sz, cx * cy * sz - sx * sy * cz, cx * cy * cz + sx * sy * sz]
        .map(|si| Value::Number(Quantity::ratio(si)))
}

macro_rules! whole_numbers {
    ($($method:ident)*) => {$(
        fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, LowerError> {
            match self.value {
                Value::Number(number) if number.si >= 0.0 && number.si.fract() == 0.0 => {
                    visitor.visit_u64(number.si as u64)
                }
                other => bug("a whole number", other),
            }
        }
    )*};
}

impl<'de> Deserializer<'de> for De<'_> {
    type Error = LowerError;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, LowerError> {
        bug("a value of a known shape", self.value)
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, LowerError> {
        match self.value {
            Value::Number(number) => visitor.visit_f64(number.si),
            other => bug("a number", other),
        }
    }

    whole_numbers! { deserialize_u8 deserialize_u16 deserialize_u32 deserialize_u64 }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, LowerError> {
        match self.value {
            Value::Truth(truth) => visitor.visit_bool(*truth),
            // `solve = static`: the only enumerator stands for yes.
            Value::Symbol { .. } => visitor.visit_bool(true),
            other => bug("true or false", other),
        }
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, LowerError> {
        match self.value {
            Value::Text(text) => visitor.visit_str(text),
            Value::Symbol { name, .. } => visitor.visit_str(name),
            Value::Item(item) => visitor.visit_str(&item.name),
            Value::Object(object) => visitor.visit_str(&object.kind),
            other => bug("a text", other),
        }
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, LowerError> {
        self.deserialize_string(visitor)
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, LowerError> {
        match self.value {
            Value::Absent => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, LowerError> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, LowerError> {
        let list = self.elements(None)?;
        visitor.visit_seq(List { rest: list.iter(), of: self })
    }

    fn deserialize_tuple<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, LowerError> {
        let list = self.elements(Some(length))?;
        visitor.visit_seq(List { rest: list.iter(), of: self })
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, LowerError> {
        if name == "Given" {
            return visitor.visit_map(GivenFields { de: self, next: 0 });
        }
        if name == "Strength" {
            return self.strength()?.deserialize_struct(name, fields, visitor).map_err(de::Error::custom);
        }
        match self.value {
            Value::Object(object) => visitor.visit_map(ObjectFields::new(object, self.kinds, fields)),
            Value::Record(record) => {
                let span = self.origin.span;
                let object = Object { kind: "".into(), name: "".into(), span, fields: (**record).clone() };
                visitor.visit_map(ObjectFields::new(&object, self.kinds, fields))
            }
            other => match self.bridged() {
                Some(json) => json
                    .map_err(de::Error::custom)?
                    .deserialize_struct(name, fields, visitor)
                    .map_err(de::Error::custom),
                None => bug(name, other),
            },
        }
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, LowerError> {
        if name == "Signal" {
            return match self.bridged() {
                Some(json) => json
                    .map_err(de::Error::custom)?
                    .deserialize_enum(name, variants, visitor)
                    .map_err(de::Error::custom),
                None => bug("a signal", self.value),
            };
        }
        let named = |wanted: &str| variants.iter().copied().find(|variant| *variant == wanted);
        let variant = match self.value {
            Value::Symbol { name, .. } => named(name),
            Value::Object(object) => named(&object.kind),
            Value::Number(_) => named("fixed"),
            Value::Selection(_) | Value::Item(_) => named("parts").or_else(|| named("on")),
            Value::List(_) => named("at"),
            Value::Signal(_) => named("output"),
            _ => None,
        };
        match variant.or_else(|| named("other")) {
            Some(variant) => visitor.visit_enum(Variant { variant, de: self }),
            None => bug(&format!("one of {variants:?}"), self.value),
        }
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, LowerError> {
        visitor.visit_unit()
    }

    serde::forward_to_deserialize_any! {
        i8 i16 i32 i64 i128 u128 f32 char bytes byte_buf unit unit_struct tuple_struct map identifier
    }
}

/// The elements of a list; all share the list's origin.
struct List<'a, 'l> {
    rest: std::slice::Iter<'l, Value>,
    of: De<'a>,
}

impl<'de> SeqAccess<'de> for List<'_, '_> {
    type Error = LowerError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, LowerError> {
        let Some(value) = self.rest.next() else { return Ok(None) };
        seed.deserialize(De { value, origin: self.of.origin, kinds: self.of.kinds }).map(Some)
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.rest.len())
    }
}

/// `value` and `origin` of a `Given`.
struct GivenFields<'a> {
    de: De<'a>,
    next: u8,
}

impl<'de> MapAccess<'de> for GivenFields<'_> {
    type Error = LowerError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, LowerError> {
        self.next += 1;
        let key = match self.next {
            1 => "value",
            2 => "origin",
            _ => return Ok(None),
        };
        seed.deserialize(key.into_deserializer()).map(Some)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, LowerError> {
        match self.next {
            1 => seed.deserialize(self.de),
            _ => {
                let origin = serde_json::to_value(self.de.origin).map_err(<LowerError as de::Error>::custom)?;
                seed.deserialize(origin).map_err(de::Error::custom)
            }
        }
    }
}

/// The fields that a struct asks of an object.
struct ObjectFields<'a> {
    object: &'a Object,
    kind: Option<&'a Kind>,
    kinds: &'a Kinds<'a>,
    fields: &'static [&'static str],
    next: usize,
}

impl<'a> ObjectFields<'a> {
    fn new(object: &'a Object, kinds: &'a Kinds<'a>, fields: &'static [&'static str]) -> Self {
        let kind = kinds.get(&object.kind).map(|kind| &**kind);
        Self { object, kind, kinds, fields, next: 0 }
    }
}

impl<'de> MapAccess<'de> for ObjectFields<'_> {
    type Error = LowerError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, LowerError> {
        let Some(field) = self.fields.get(self.next) else { return Ok(None) };
        self.next += 1;
        seed.deserialize((*field).into_deserializer()).map(Some)
    }

    fn next_value_seed<S: DeserializeSeed<'de>>(&mut self, seed: S) -> Result<S::Value, LowerError> {
        let field = self.fields[self.next - 1];
        let declared = self.kind.and_then(|kind| kind.field(field));
        let in_group = declared.is_some_and(|declared| declared.group.is_some());
        match self.object.fields.get(field) {
            Some(slot) if !in_group => seed.deserialize(De::slot(slot, self.kinds)),
            None if field == "name" => seed.deserialize(self.object.name.to_string().into_deserializer()),
            _ => seed.deserialize(Group { object: self.object, kind: self.kind, kinds: self.kinds }),
        }
    }
}

/// A struct field that stands for a `one of`: the enum's variants say which.
struct Group<'a> {
    object: &'a Object,
    kind: Option<&'a Kind>,
    kinds: &'a Kinds<'a>,
}

impl<'de> Deserializer<'de> for Group<'_> {
    type Error = LowerError;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, LowerError> {
        let fields: Vec<&String> = self.object.fields.keys().collect();
        Err(de::Error::custom(format!("a field of `{}` is not declared; it has {fields:?}", self.object.kind)))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, LowerError> {
        let groups = self.kind.map_or(&[][..], |kind| &kind.groups);
        let fields = self.kind.map_or(&[][..], |kind| &kind.fields);
        let members = groups.iter().find(|members| members.iter().any(|i| variants.contains(&&*fields[*i].name)));
        let chosen = members.into_iter().flatten().find_map(|i| {
            let slot = self.object.fields.get(&*fields[*i].name)?;
            let variant = variants.iter().copied().find(|v| *v == &*fields[*i].name)?;
            (!matches!(slot.value, Value::Absent)).then_some((variant, slot))
        });
        match chosen {
            Some((variant, slot)) => visitor.visit_enum(Variant { variant, de: De::slot(slot, self.kinds) }),
            None => Err(de::Error::custom(format!("no member of {name} was chosen for `{}`", self.object.kind))),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map struct identifier ignored_any
    }
}

/// A chosen variant and its content.
struct Variant<'a> {
    variant: &'static str,
    de: De<'a>,
}

impl<'de, 'a> EnumAccess<'de> for Variant<'a> {
    type Error = LowerError;
    type Variant = De<'a>;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, De<'a>), LowerError> {
        let variant = seed.deserialize(self.variant.into_deserializer())?;
        Ok((variant, self.de))
    }
}

impl<'de> VariantAccess<'de> for De<'_> {
    type Error = LowerError;

    fn unit_variant(self) -> Result<(), LowerError> {
        Ok(())
    }

    /// A law with one field (`strain(at = 5 %)`) gives that field; everything else gives itself.
    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, LowerError> {
        if let Value::Object(object) = self.value
            && let Some(slot) = object.fields.get("at")
        {
            return seed.deserialize(De::slot(slot, self.kinds));
        }
        seed.deserialize(self)
    }

    fn tuple_variant<V: Visitor<'de>>(self, length: usize, visitor: V) -> Result<V::Value, LowerError> {
        self.deserialize_tuple(length, visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, LowerError> {
        self.deserialize_struct("variant", fields, visitor)
    }
}
