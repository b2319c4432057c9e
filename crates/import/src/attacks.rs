use std::fmt;
use std::path::Path;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::file::{parse_json, read_bytes};
use crate::{FileError, ReadError};
use sabaki::maps::SphereKey;
use sabaki::query::Attack;

/// An attack file: moving spheres in the character's frame at the time of the query (root on the
/// ground, facing +Z). Time 0 is the query. Unknown keys are ignored.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AttackFile {
    /// Attacks, in the order of the file.
    pub attacks: Vec<Attack>,
}

/// An attack as it is written in a file: the keys of each moving sphere, in order of time. A single sphere may be written as a list of
/// keys.
#[derive(Deserialize)]
pub(super) struct StoredAttack {
    #[serde(deserialize_with = "one_or_many")]
    pub(super) spheres: Vec<Vec<SphereKey>>,
}

impl AttackFile {
    /// Parses and checks JSON text.
    ///
    /// # Errors
    /// The first error, with line and column or with the index of attack, sphere and key.
    pub fn parse(text: &[u8]) -> Result<Self, FileError> {
        #[derive(Deserialize)]
        struct Stored {
            attacks: Vec<StoredAttack>,
        }
        let Stored { attacks } = parse_json(text)?;
        if attacks.is_empty() {
            return Err(FileError::invalid("the file holds no attack"));
        }
        let attack = |(attack, stored): (usize, StoredAttack)| {
            let wrong = |error| FileError::part(format!("attack {attack}"), error);
            Attack::new(stored.spheres).map_err(wrong)
        };
        let attacks = attacks.into_iter().enumerate().map(attack);
        Ok(Self {
            attacks: attacks.collect::<Result<_, _>>()?,
        })
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// The first error, with the file and the position in it.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::parse(&read_bytes(path)?).map_err(ReadError::in_file(path))
    }
}

/// An element of `spheres`: a key of a single sphere, or a list of keys.
///
/// It is not a serde untagged enum, because that loses line and column.
enum Element {
    Key(SphereKey),
    Sphere(Vec<SphereKey>),
}

impl<'de> Deserialize<'de> for Element {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct KeyOrSphere;
        impl<'de> Visitor<'de> for KeyOrSphere {
            type Value = Element;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a key {t, center, radius} or a list of keys")
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Element, A::Error> {
                SphereKey::deserialize(MapAccessDeserializer::new(map)).map(Element::Key)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Element, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(Element::Sphere)
            }
        }
        deserializer.deserialize_any(KeyOrSphere)
    }
}

fn one_or_many<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<Vec<SphereKey>>, D::Error> {
    let elements = Vec::<Element>::deserialize(deserializer)?;
    let (mut keys, mut spheres) = (Vec::new(), Vec::new());
    for element in elements {
        match element {
            Element::Key(key) => keys.push(key),
            Element::Sphere(sphere) => spheres.push(sphere),
        }
    }
    match (keys.is_empty(), spheres.is_empty()) {
        (true, _) => Ok(spheres),
        (false, true) => Ok(vec![keys]),
        (false, false) => Err(serde::de::Error::custom(
            "spheres mixes keys and lists of keys",
        )),
    }
}
