//! Magnitudes of the perturbations, such as the size of noise: values by group (the perturbation that they belong to) and name.
//! [`Competition`](crate::Competition) defines which magnitudes exist, and their ranges.

use indexmap::IndexMap;
use serde::{
    Deserialize, Deserializer, Serialize,
    de::{self, DeserializeOwned, MapAccess, Visitor},
};
use std::{fmt, marker::PhantomData};

/// Magnitudes of the perturbations by group and name. Those left out have the default of the competition. The profile decides which
/// perturbations are active.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Magnitudes(Fields<Fields<Magnitude>>);

/// A map of values by name. Its JSON is refused if a name occurs twice, where serde's maps would take the last value.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(transparent)]
struct Fields<T>(IndexMap<String, T>);

impl<T> Default for Fields<T> {
    fn default() -> Self {
        Self(IndexMap::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Fields<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
            type Value = Fields<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("magnitudes by name")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Fields<T>, A::Error> {
                let mut fields = Fields::default();
                while let Some((name, value)) = map.next_entry::<String, T>()? {
                    if fields.0.contains_key(&name) {
                        let problem = format_args!("duplicate field `{name}`");
                        return Err(de::Error::custom(problem));
                    }
                    fields.0.insert(name, value);
                }
                Ok(fields)
            }
        }

        deserializer.deserialize_map(Entries(PhantomData))
    }
}

/// The value of a magnitude: a number, or two (a range from which the simulator draws).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number or two numbers")]
pub enum Magnitude {
    Count(u32),
    Number(f64),
    Counts([u32; 2]),
    Range([f64; 2]),
}

impl fmt::Display for Magnitude {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(count) => count.fmt(f),
            Self::Number(number) => number.fmt(f),
            Self::Counts([low, high]) => write!(f, "[{low}, {high}]"),
            Self::Range([low, high]) => write!(f, "[{low}, {high}]"),
        }
    }
}

/// The description of a magnitude.
#[derive(Debug, Clone, PartialEq)]
pub struct MagnitudeInfo {
    /// The perturbation to which it belongs.
    pub group: String,
    /// Its name within the group, with the unit.
    pub name: String,
    /// What it means, as a sentence.
    pub description: String,
    /// The value unless a stage or a tournament has another. A pair: the magnitude is two numbers, the smaller one first.
    pub default: Magnitude,
    /// The least and the largest valid number.
    pub bounds: [f64; 2],
}

/// An invalid magnitude.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidMagnitude {
    /// The value is of another kind, or out of range. `field` has group and name.
    #[error("{field}: expected {expected}, got {got}")]
    Value {
        field: String,
        expected: String,
        /// The value as it was given.
        got: String,
    },
    /// The competition has no such group, or the group no such magnitude.
    #[error("{field}: unknown{}", known_text(.known))]
    Unknown { field: String, known: Vec<String> },
}

fn known_text(known: &[String]) -> String {
    if known.is_empty() {
        return ": the competition has no magnitudes".to_owned();
    }
    format!(", expected one of {}", known.join(", "))
}

impl Magnitudes {
    /// Do all magnitudes have the competition's defaults?
    /// [`Competition::check_and_normalise_rules`](crate::Competition::check_and_normalise_rules) leaves none then.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.0.is_empty()
    }

    /// Gives a magnitude this value.
    pub fn set(&mut self, group: &str, name: &str, value: Magnitude) {
        let group = self.0.0.entry(group.to_owned()).or_default();
        group.0.insert(name.to_owned(), value);
    }

    /// The value of a magnitude; `None` if it is that of the competition.
    #[must_use]
    pub fn get(&self, group: &str, name: &str) -> Option<Magnitude> {
        self.0.0.get(group)?.0.get(name).copied()
    }

    /// The magnitudes as the settings of a simulator, whose defaults are those of the competition.
    ///
    /// # Errors
    /// If the simulator does not have one of them, or needs a value of another kind.
    pub fn to_settings<T: DeserializeOwned>(&self) -> Result<T, serde_json::Error> {
        serde_json::from_value(serde_json::to_value(self)?)
    }

    /// Checks the magnitudes, and completes them in the order of their descriptions. If all have the defaults, the map becomes empty.
    pub(crate) fn complete(&mut self, known: &[MagnitudeInfo]) -> Result<(), InvalidMagnitude> {
        for (group, values) in &self.0.0 {
            let of_group = || known.iter().filter(|info| info.group == *group);
            if of_group().next().is_none() {
                let mut groups: Vec<String> = known.iter().map(|info| info.group.clone()).collect();
                groups.dedup();
                return Err(InvalidMagnitude::unknown(group.clone(), groups));
            }
            for name in values.0.keys() {
                if of_group().all(|info| info.name != *name) {
                    let names = of_group().map(|info| info.name.clone()).collect();
                    return Err(InvalidMagnitude::unknown(format!("{group}.{name}"), names));
                }
            }
        }
        let mut complete = Self::default();
        let mut all_default = true;
        for info in known {
            let given = self.get(&info.group, &info.name);
            let value = given.map_or(Ok(info.default), |given| info.checked(given))?;
            all_default &= value == info.default;
            complete.set(&info.group, &info.name, value);
        }
        *self = if all_default {
            Self::default()
        } else {
            complete
        };
        Ok(())
    }
}

impl InvalidMagnitude {
    /// The name is quoted by its first characters: it can be anything.
    fn unknown(field: String, known: Vec<String>) -> Self {
        let field = field.chars().take(80).collect();
        Self::Unknown { field, known }
    }
}

impl MagnitudeInfo {
    /// The value, if it is valid: of the default's kind (whole numbers are accepted where any numbers are) and within the bounds.
    fn checked(&self, given: Magnitude) -> Result<Magnitude, InvalidMagnitude> {
        use Magnitude::{Count, Counts, Number, Range};
        let value = match (self.default, given) {
            (Number(_), Count(count)) => Number(f64::from(count)),
            (Range(_), Counts(counts)) => Range(counts.map(f64::from)),
            _ => given,
        };
        let is_same_kind = std::mem::discriminant(&value) == std::mem::discriminant(&self.default);
        let [low, high] = match value {
            Count(count) => [f64::from(count); 2],
            Number(number) => [number; 2],
            Counts(counts) => counts.map(f64::from),
            Range(range) => range,
        };
        let [least, most] = self.bounds;
        // NaN compares as false, so it is refused, too.
        if is_same_kind && least <= low && low <= high && high <= most {
            return Ok(value);
        }
        let kind = match self.default {
            Count(_) => "a whole number",
            Number(_) => "a number",
            Counts(_) => "two whole numbers",
            Range(_) => "two numbers",
        };
        let order = match self.default {
            Count(_) | Number(_) => "",
            Counts(_) | Range(_) => ", the smaller one first",
        };
        Err(InvalidMagnitude::Value {
            field: format!("{}.{}", self.group, self.name),
            expected: format!("{kind} from {least} to {most}{order}"),
            got: given.to_string(),
        })
    }
}

#[cfg(feature = "openapi")]
mod schema {
    use super::Magnitudes;
    use std::borrow::Cow;
    use utoipa::{
        PartialSchema, ToSchema,
        openapi::{ObjectBuilder, RefOr, Schema, Type},
    };

    /// A placeholder: the server puts the groups and names of its competition in its place in the API's document.
    impl PartialSchema for Magnitudes {
        fn schema() -> RefOr<Schema> {
            ObjectBuilder::new().schema_type(Type::Object).into()
        }
    }

    impl ToSchema for Magnitudes {
        fn name() -> Cow<'static, str> {
            Cow::Borrowed("PerturbationSettings")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(group: &str, name: &str, default: Magnitude, bounds: [f64; 2]) -> MagnitudeInfo {
        MagnitudeInfo {
            group: group.to_owned(),
            name: name.to_owned(),
            description: String::new(),
            default,
            bounds,
        }
    }

    fn known() -> Vec<MagnitudeInfo> {
        vec![
            info("wind", "speed_m_s", Magnitude::Number(2.0), [0.0, 10.0]),
            info("wind", "gusts_s", Magnitude::Range([0.5, 1.5]), [0.1, 10.0]),
            info("loss", "steps", Magnitude::Counts([5, 20]), [1.0, 500.0]),
        ]
    }

    fn completed(json: &str) -> Result<String, String> {
        let parsed = serde_json::from_str::<Magnitudes>(json);
        let mut magnitudes = parsed.map_err(|error| error.to_string())?;
        let checked = magnitudes.complete(&known());
        checked.map_err(|error| error.to_string())?;
        Ok(serde_json::to_string(&magnitudes).unwrap())
    }

    #[test]
    fn magnitudes_are_completed_in_order() {
        assert_eq!(
            completed(r#"{"loss":{"steps":[1,2]},"wind":{"speed_m_s":3}}"#).unwrap(),
            r#"{"wind":{"speed_m_s":3.0,"gusts_s":[0.5,1.5]},"loss":{"steps":[1,2]}}"#
        );
        for all_default in ["{}", r#"{"wind":{}}"#, r#"{"wind":{"speed_m_s":2}}"#] {
            assert_eq!(completed(all_default).unwrap(), "{}");
        }
    }

    #[test]
    fn invalid_magnitude_is_refused_by_name() {
        for (json, words) in [
            (
                r#"{"wind":{"speed_m_s":-0.5}}"#,
                "wind.speed_m_s: expected a number from 0 to 10, got -0.5",
            ),
            (
                r#"{"wind":{"gusts_s":[1.2,0.8]}}"#,
                "wind.gusts_s: expected two numbers from 0.1 to 10, the smaller one first, got [1.2, 0.8]",
            ),
            (r#"{"wind":{"gusts_s":1}}"#, "expected two numbers"),
            (
                r#"{"loss":{"steps":[0,3]}}"#,
                "loss.steps: expected two whole numbers from 1 to 500",
            ),
            (r#"{"loss":{"steps":[1.5,3]}}"#, "two whole numbers"),
            (
                r#"{"loss":{"steps":"x"}}"#,
                "expected a number or two numbers",
            ),
            (
                r#"{"rain":{}}"#,
                "rain: unknown, expected one of wind, loss",
            ),
            (
                r#"{"loss":{"chance":0.5}}"#,
                "loss.chance: unknown, expected one of steps",
            ),
            (
                r#"{"loss":{"steps":[1,2]},"loss":{}}"#,
                "duplicate field `loss`",
            ),
            (
                r#"{"loss":{"steps":[1,2],"steps":[1,2]}}"#,
                "duplicate field `steps`",
            ),
        ] {
            let error = completed(json).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
        let mut not_a_number = Magnitudes::default();
        not_a_number.set("wind", "speed_m_s", Magnitude::Number(f64::NAN));
        assert!(not_a_number.complete(&known()).is_err());
        let mut rain = Magnitudes::default();
        rain.set("rain", "mm", Magnitude::Count(1));
        let refused = rain.complete(&[]).unwrap_err().to_string();
        assert_eq!(refused, "rain: unknown: the competition has no magnitudes");
    }
}
