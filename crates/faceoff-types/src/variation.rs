//! Variations: a stage's deviations from the defaults of the competition and of its ruleset that affect scores.

use crate::{Magnitudes, Millionths, TaskWeights, millionths::NotMillionths};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// Deviations from the defaults of the competition and of the ruleset that affect scores. Absent values are the defaults.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
pub struct Variation {
    /// Weights of the tasks' success rates in the overall score; absent: those of the competition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(nullable = false))]
    pub weights: Option<TaskWeights>,
    /// Largest penalty points per episode of the two better tiers; absent: those of the competition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(nullable = false))]
    pub tier_bounds: Option<TierBounds>,
    /// Magnitudes of the profile's perturbations; absent values are the ruleset's.
    #[serde(default, skip_serializing_if = "Magnitudes::is_empty")]
    pub perturbations: Magnitudes,
}

impl Variation {
    /// Does the stage have all defaults?
    #[must_use]
    pub fn is_empty(&self) -> bool {
        is_default(self)
    }
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

/// Invalid tier bounds.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidTierBounds {
    /// The bounds of the tiers do not rise.
    #[error(
        "expected 0 < deployable < improvable, in points per episode, got {deployable} and {improvable}"
    )]
    Bounds {
        deployable: Millionths,
        improvable: Millionths,
    },
    /// Too many or too few numbers, or text that is not a number.
    #[error("expected {expected} numbers with commas between them, as in {example}, got {got:?}")]
    Count {
        expected: usize,
        example: &'static str,
        /// The text as it was given.
        got: String,
    },
    #[error(transparent)]
    Number(#[from] NotMillionths),
}

/// Largest penalty points per episode of the two better tiers; the bound itself belongs to the better tier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "BoundFields", into = "BoundFields")]
pub struct TierBounds {
    deployable: Millionths,
    improvable: Millionths,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
struct BoundFields {
    /// Penalty points per episode: above 0, with at most six decimals.
    #[cfg_attr(feature = "openapi", schema(value_type = f64, example = 0.5))]
    deployable: Millionths,
    /// Penalty points per episode: above `deployable`, with at most six decimals.
    #[cfg_attr(feature = "openapi", schema(value_type = f64, example = 1.5))]
    improvable: Millionths,
}

impl TierBounds {
    /// From the bounds of the best and the second tier.
    ///
    /// # Errors
    /// If the first bound is 0, or the second is not above it.
    pub fn new(deployable: Millionths, improvable: Millionths) -> Result<Self, InvalidTierBounds> {
        if deployable.count() > 0 && deployable < improvable {
            Ok(Self {
                deployable,
                improvable,
            })
        } else {
            Err(InvalidTierBounds::Bounds {
                deployable,
                improvable,
            })
        }
    }

    /// The bounds of a competition, as a constant.
    ///
    /// # Panics
    /// If the first bound is 0, or the second is not above it.
    #[must_use]
    pub const fn constant(deployable: Millionths, improvable: Millionths) -> Self {
        assert!(
            0 < deployable.count() && deployable.count() < improvable.count(),
            "expected 0 < deployable < improvable"
        );
        Self {
            deployable,
            improvable,
        }
    }

    /// Bound of the best tier, in penalty points per episode.
    #[must_use]
    pub const fn deployable(&self) -> Millionths {
        self.deployable
    }

    /// Bound of the second tier, in penalty points per episode.
    #[must_use]
    pub const fn improvable(&self) -> Millionths {
        self.improvable
    }
}

impl TryFrom<BoundFields> for TierBounds {
    type Error = InvalidTierBounds;
    fn try_from(fields: BoundFields) -> Result<Self, InvalidTierBounds> {
        Self::new(fields.deployable, fields.improvable)
    }
}

impl From<TierBounds> for BoundFields {
    fn from(bounds: TierBounds) -> Self {
        Self {
            deployable: bounds.deployable,
            improvable: bounds.improvable,
        }
    }
}

/// The form used on the command line: the lower bound first.
impl fmt::Display for TierBounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{},{}", self.deployable, self.improvable)
    }
}

impl FromStr for TierBounds {
    type Err = InvalidTierBounds;
    fn from_str(text: &str) -> Result<Self, InvalidTierBounds> {
        let [deployable, improvable] = parse_numbers(text, "0.5,1.5")?;
        Self::new(deployable, improvable)
    }
}

/// Parses `N` numbers with commas between them.
fn parse_numbers<const N: usize>(
    text: &str,
    example: &'static str,
) -> Result<[Millionths; N], InvalidTierBounds> {
    let wrong_count = || InvalidTierBounds::Count {
        expected: N,
        example,
        got: text.to_owned(),
    };
    let numbers = text
        .split(',')
        .map(|part| part.trim().parse::<f64>().map_err(|_| wrong_count()));
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
    let numbers: [f64; N] = numbers.try_into().map_err(|_| wrong_count())?;
    let mut exact = [Millionths::new(0); N];
    for (exact, number) in exact.iter_mut().zip(numbers) {
        *exact = Millionths::try_from(number)?;
    }
    Ok(exact)
}

#[cfg(feature = "openapi")]
mod schemas {
    use super::{BoundFields, TierBounds};
    use utoipa::{PartialSchema, ToSchema, openapi};

    impl PartialSchema for TierBounds {
        fn schema() -> openapi::RefOr<openapi::Schema> {
            BoundFields::schema()
        }
    }

    impl ToSchema for TierBounds {}
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ruleset_values_are_omitted_and_round_trip() {
        assert_eq!(serde_json::to_string(&Variation::default()).unwrap(), "{}");
        let read: Variation = serde_json::from_str("{}").unwrap();
        assert!(read.is_empty());
        let text = r#"{"weights":{"hit":0.5,"defend":0.25,"prepare":0.25},"tier_bounds":{"deployable":0.1,"improvable":2.0}}"#;
        let read: Variation = serde_json::from_str(text).unwrap();
        assert!(!read.is_empty());
        assert_eq!(serde_json::to_string(&read).unwrap(), text);
        let no_losses = r#"{"perturbations":{"tracking_loss":{"probability":0.0}}}"#;
        let read: Variation = serde_json::from_str(no_losses).unwrap();
        assert!(!read.is_empty());
        assert_eq!(serde_json::to_string(&read).unwrap(), no_losses);
    }

    #[test]
    fn bounds_of_tiers_rise() {
        let [deployable, improvable] = [500_000, 1_500_000].map(Millionths::new);
        let bounds = TierBounds::constant(deployable, improvable);
        assert_eq!("0.5,1.5".parse(), Ok(bounds));
        assert_eq!(TierBounds::new(deployable, improvable), Ok(bounds));
        for (wrong, words) in [
            ("0,1", "0 < deployable"),
            ("1.5,0.5", "deployable < improvable"),
            ("1,1", "deployable < improvable"),
            ("1", "2 numbers"),
            ("NaN,1", "six decimals"),
        ] {
            let error = wrong.parse::<TierBounds>().unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
    }
}
