//! Kinds and structs agree: each field of one is a field of the other.

use serde::de::{self, Deserialize, Deserializer, Visitor};

use crate::scene;
use crate::semantics::lower::{FLOW_ONLY, NOT_YET};
use crate::semantics::{Options, library_kinds};

/// Names the fields of a struct, or the variants of an enum, by asking serde for one.
#[derive(Debug)]
struct Asked(Vec<&'static str>);

impl std::fmt::Display for Asked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}", self.0)
    }
}

impl std::error::Error for Asked {}

impl de::Error for Asked {
    fn custom<T: std::fmt::Display>(_: T) -> Self {
        Asked(Vec::new())
    }
}

struct Probe;

impl<'de> Deserializer<'de> for Probe {
    type Error = Asked;

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Asked> {
        Err(Asked(Vec::new()))
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, Asked> {
        Err(Asked(fields.to_vec()))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        _: V,
    ) -> Result<V::Value, Asked> {
        Err(Asked(variants.to_vec()))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf option unit unit_struct
        newtype_struct seq tuple tuple_struct map identifier ignored_any
    }
}

fn names<'de, T: Deserialize<'de> + std::fmt::Debug>() -> Vec<&'static str> {
    T::deserialize(Probe).expect_err("the probe never gives a value").0
}

type Struct = (&'static str, Vec<&'static str>, Vec<(&'static str, Vec<&'static str>)>);

/// Kind, its struct's fields, and for each field that is a `one of` the enum's variants.
fn structs() -> Vec<Struct> {
    use scene::*;
    vec![
        ("fibre", names::<Fibre>(), vec![]),
        ("yarn", names::<Yarn>(), vec![("size", names::<YarnSize>())]),
        ("weave", names::<Weave>(), vec![("pattern", names::<Pattern>()), ("extent", names::<Extent>())]),
        ("strand", names::<Strand>(), vec![]),
        ("body", names::<Body>(), vec![("mass", names::<Mass>())]),
        ("fabric", names::<Fabric>(), vec![]),
        ("cord", names::<Cord>(), vec![("pull", names::<CordPull>())]),
        ("gas", names::<Gas>(), vec![("amount", names::<GasAmount>())]),
        ("cloth", names::<Cloth>(), vec![]),
        ("gore", names::<Gore>(), vec![]),
        ("seam", names::<Seam>(), vec![]),
        ("tie", names::<Tie>(), vec![]),
        ("line", names::<Line>(), vec![("way", names::<Way>())]),
        ("canopy", names::<Canopy>(), vec![]),
        ("air", names::<Air>(), vec![]),
        ("push", names::<Push>(), vec![("load", names::<Load>())]),
        ("cut", names::<Cut>(), vec![]),
        ("stretch", names::<Stretch>(), vec![]),
        ("release", names::<Release>(), vec![]),
        ("stage", names::<Stage>(), vec![]),
        ("fix", names::<Fix>(), vec![]),
        ("pull", names::<Pull>(), vec![("drive", names::<Drive>())]),
        ("contact", names::<Contact>(), vec![]),
        ("run", names::<Run>(), vec![("extent", names::<Extents>())]),
        ("record", names::<Record>(), vec![]),
        ("picture", names::<Picture>(), vec![]),
        ("probe", names::<scene::Probe>(), vec![]),
    ]
}

/// Fields that say something to people only, and the backend, which the command line decides with.
const NOT_LOWERED: [&str; 3] = ["source", "confidence", "backend"];

#[test]
fn each_kind_and_its_struct_agree() {
    let _ = Options::default();
    library_kinds(|kinds| {
        for (kind_name, fields, groups) in structs() {
            let kind = kinds.get(kind_name).unwrap();
            let mut lowered: Vec<&str> = Vec::new();
            for field in fields {
                if let Some((_, variants)) = groups.iter().find(|(name, _)| *name == field) {
                    let group = kind
                        .groups
                        .iter()
                        .find(|members| members.iter().any(|i| variants.contains(&&*kind.fields[*i].name)))
                        .unwrap_or_else(|| panic!("no `one of` in `{kind_name}` for `{field}`"));
                    let members: Vec<&str> = group.iter().map(|i| &*kind.fields[*i].name).collect();
                    let mut sorted = (members.clone(), variants.clone());
                    sorted.0.sort_unstable();
                    sorted.1.sort_unstable();
                    assert_eq!(sorted.0, sorted.1, "`one of` of `{kind_name}` and its enum");
                    lowered.extend(members);
                } else if field != "name" {
                    let declared = kind.field(field).unwrap_or_else(|| panic!("`{kind_name}` declares no `{field}`"));
                    assert!(declared.settable(), "`{kind_name}.{field}` cannot be set");
                    lowered.push(field);
                }
            }
            for declared in kind.fields.iter().filter(|field| field.settable()) {
                let waits = NOT_YET.iter().any(|(owner, field, _)| kind.is(owner) && *field == &*declared.name);
                let flow = kind.is("air") && FLOW_ONLY.contains(&&*declared.name);
                let known =
                    flow || lowered.contains(&&*declared.name) || NOT_LOWERED.contains(&&*declared.name) || waits;
                assert!(known, "nothing reads `{}` of `{kind_name}`", declared.name);
            }
        }
        for variants in [
            names::<scene::Break>(),
            names::<scene::Flattening>(),
            names::<scene::Compaction>(),
            names::<scene::Friction>(),
            names::<scene::Permeability>(),
            names::<scene::Outline>(),
            names::<scene::ClothModel>(),
            names::<scene::Start>(),
        ] {
            for variant in variants {
                assert!(kinds.get(variant).is_some(), "no kind `{variant}`");
            }
        }
        let values = |name: &str| kinds.enumerations[name].values.iter().map(|v| v.to_string()).collect::<Vec<_>>();
        assert_eq!(values("Integrator"), names::<scene::Integrator>());
        assert_eq!(values("Flow"), names::<scene::Flow>());
        assert_eq!(values("Topology"), names::<scene::Topology>());
        assert_eq!(values("Precision"), names::<scene::Precision>());
        assert_eq!(values("ContactModel"), names::<scene::ContactModel>());
    });
}
