//! Time zones of stages.

use jiff::{Timestamp, civil::Date, tz::TimeZone};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A time zone by its name in the IANA database, e.g. `Europe/Berlin` or `UTC`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema), schema(value_type = String, example = "Europe/Berlin"))]
#[serde(try_from = "String", into = "String")]
pub struct Zone(TimeZone);

impl Zone {
    pub const UTC: Self = Self(TimeZone::UTC);

    #[must_use]
    pub fn time_zone(&self) -> TimeZone {
        self.0.clone()
    }

    /// The local date at an instant.
    #[must_use]
    pub fn date(&self, instant: Timestamp) -> Date {
        instant.to_zoned(self.time_zone()).date()
    }
}

impl Default for Zone {
    fn default() -> Self {
        Self::UTC
    }
}

impl fmt::Display for Zone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // `from_str` accepts only zones with a name.
        f.pad(self.0.iana_name().unwrap_or("UTC"))
    }
}

/// Text that is not the name of a time zone.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no time zone: expected a name of the IANA database, as “Europe/Berlin” or “UTC”")]
pub struct UnknownZone(String);

impl FromStr for Zone {
    type Err = UnknownZone;
    fn from_str(name: &str) -> Result<Self, UnknownZone> {
        if name == "UTC" {
            return Ok(Self::UTC);
        }
        let unknown = || UnknownZone(name.to_owned());
        let zone = TimeZone::get(name).map_err(|_| unknown())?;
        // `TimeZone::get` also knows "Etc/Unknown".
        match zone.iana_name() {
            Some(found) if !zone.is_unknown() && !found.is_empty() => Ok(Self(zone)),
            _ => Err(unknown()),
        }
    }
}

impl TryFrom<String> for Zone {
    type Error = UnknownZone;
    fn try_from(name: String) -> Result<Self, UnknownZone> {
        name.parse()
    }
}

impl From<Zone> for String {
    fn from(zone: Zone) -> Self {
        zone.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zone_gives_the_local_date() {
        let half_past_eleven: Timestamp = "2026-03-01T23:30:00Z".parse().unwrap();
        let date = |name: &str| {
            name.parse::<Zone>()
                .unwrap()
                .date(half_past_eleven)
                .to_string()
        };
        assert_eq!(date("UTC"), "2026-03-01");
        assert_eq!(date("Europe/Berlin"), "2026-03-02");
        assert_eq!(date("America/Los_Angeles"), "2026-03-01");
    }

    #[test]
    fn zone_names_round_trip_and_others_are_refused() {
        for name in ["UTC", "Europe/Berlin", "Pacific/Auckland"] {
            assert_eq!(name.parse::<Zone>().unwrap().to_string(), name);
        }
        for wrong in ["", "Berlin", "Europe/Atlantis", "+01:00", "Etc/Unknown"] {
            let error = wrong.parse::<Zone>().unwrap_err().to_string();
            assert!(error.contains("Europe/Berlin"), "{error}");
        }
    }
}
