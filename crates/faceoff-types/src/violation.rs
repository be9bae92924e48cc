//! Kinds of violations of an agent's limits, by their names.

use crate::short_name::short_name;
use indexmap::IndexMap;
use serde::{Deserialize, Serialize};

short_name! {
    /// The name of a kind of violation. [`Competition`](crate::Competition) defines which kinds exist, and what they cost.
    ViolationName, "a violation"
}

impl ViolationName {
    /// The agent took too long to answer a step. In every competition.
    pub const COMPUTATION_TIME: Self = Self::new("computation_time");
}

/// All limits of the competition's robot in the competition's order, each with whether an episode violated it at least once. Two
/// values are equal if the same limits are violated.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Violations(IndexMap<ViolationName, bool>);

impl Violations {
    /// The names of the limits and whether each was violated.
    pub fn iter(&self) -> impl Iterator<Item = (ViolationName, bool)> + '_ {
        self.0.iter().map(|(name, violated)| (*name, *violated))
    }

    /// The violated limits.
    pub fn violated(&self) -> impl Iterator<Item = ViolationName> + '_ {
        self.iter()
            .filter_map(|(name, violated)| violated.then_some(name))
    }

    /// Is each of these limits listed, and no other? The order is not compared: JSON of other programs may have another.
    #[must_use]
    pub fn has_kinds(&self, kinds: impl Iterator<Item = ViolationName> + Clone) -> bool {
        kinds.clone().count() == self.0.len()
            && kinds.clone().all(|kind| self.0.contains_key(&kind))
    }

    /// Was the limit violated?
    #[must_use]
    pub fn contains(&self, name: ViolationName) -> bool {
        self.0.get(&name).copied().unwrap_or_default()
    }
}

impl PartialEq for Violations {
    fn eq(&self, other: &Self) -> bool {
        self.violated().count() == other.violated().count()
            && self.violated().all(|name| other.contains(name))
    }
}

impl Eq for Violations {}

impl FromIterator<(ViolationName, bool)> for Violations {
    fn from_iter<I: IntoIterator<Item = (ViolationName, bool)>>(violated: I) -> Self {
        Self(violated.into_iter().collect())
    }
}

/// These limits are violated, and no other.
impl<const N: usize> From<[ViolationName; N]> for Violations {
    fn from(violated: [ViolationName; N]) -> Self {
        violated.into_iter().map(|name| (name, true)).collect()
    }
}

/// For each kind of violation, the number of episodes (or of windows of a game) with it, in the order of the competition.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ViolationCounts(IndexMap<ViolationName, u32>);

impl ViolationCounts {
    /// The count of a kind; 0 if there is none of it.
    #[must_use]
    pub fn get(&self, name: ViolationName) -> u32 {
        self.0.get(&name).copied().unwrap_or_default()
    }

    /// Sets the count of a kind. A kind that is new follows the others.
    pub fn set(&mut self, name: ViolationName, count: u32) {
        self.0.insert(name, count);
    }

    /// All kinds with their counts.
    pub fn iter(&self) -> impl Iterator<Item = (ViolationName, u32)> + '_ {
        self.0.iter().map(|(name, count)| (*name, *count))
    }

    /// Adds the counts of others.
    pub fn add(&mut self, others: &Self) {
        for (name, count) in others.iter() {
            let sum = self.0.entry(name).or_default();
            *sum = sum.saturating_add(count);
        }
    }
}

impl FromIterator<(ViolationName, u32)> for ViolationCounts {
    fn from_iter<I: IntoIterator<Item = (ViolationName, u32)>>(counts: I) -> Self {
        Self(counts.into_iter().collect())
    }
}

#[cfg(feature = "openapi")]
mod schema {
    use super::ViolationCounts;
    use utoipa::{
        PartialSchema, ToSchema,
        openapi::{ObjectBuilder, RefOr, Schema, Type},
    };

    impl PartialSchema for ViolationCounts {
        fn schema() -> RefOr<Schema> {
            let count = ObjectBuilder::new().schema_type(Type::Integer);
            ObjectBuilder::new()
                .schema_type(Type::Object)
                .additional_properties(Some(count))
                .into()
        }
    }

    impl ToSchema for ViolationCounts {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_added_by_kind() {
        let mut counts: ViolationCounts = serde_json::from_str(r#"{"fall":2,"speed":1}"#).unwrap();
        let other = serde_json::from_str(r#"{"speed":3,"heat":4}"#).unwrap();
        counts.add(&other);
        let text = serde_json::to_string(&counts).unwrap();
        assert_eq!(text, r#"{"fall":2,"speed":4,"heat":4}"#);
        assert_eq!(counts.get(ViolationName::new("speed")), 4);
        assert_eq!(counts.get(ViolationName::COMPUTATION_TIME), 0);
    }

    #[test]
    fn kinds_of_a_report_are_compared_without_order() {
        let [ee, link] = ["ee", "link"].map(ViolationName::new);
        let reported: Violations = serde_json::from_str(r#"{"link": true, "ee": false}"#)
            .expect("violations are an object of booleans");
        assert!(reported.has_kinds([ee, link].into_iter()));
        assert!(
            !reported.has_kinds([ee].into_iter()),
            "an unknown kind is refused"
        );
        let other = ViolationName::new("other");
        assert!(
            !reported.has_kinds([ee, link, other].into_iter()),
            "a missing kind is refused"
        );
        assert!(!reported.has_kinds([ee, other].into_iter()));
    }
}
