//! Time zones of stages. [`IanaTimeZone`] is a `jiff` time zone that has a name, so that it can be stored and shown.

use jiff::{Timestamp, civil::Date, tz::TimeZone};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// A time zone by its name in the IANA database, e.g. `Europe/Berlin` or `UTC`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema), schema(as = Zone, value_type = String, example = "Europe/Berlin"))]
#[serde(try_from = "String", into = "String")]
pub struct IanaTimeZone(TimeZone);

impl IanaTimeZone {
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

impl Default for IanaTimeZone {
    fn default() -> Self {
        Self::UTC
    }
}

impl fmt::Display for IanaTimeZone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // `from_str` accepts only zones with a name.
        f.pad(self.0.iana_name().unwrap_or("UTC"))
    }
}

/// Text that is not the name of a time zone.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no time zone: expected a name of the IANA database, as “Europe/Berlin” or “UTC”")]
pub struct UnknownTimeZone(String);

impl FromStr for IanaTimeZone {
    type Err = UnknownTimeZone;
    fn from_str(name: &str) -> Result<Self, UnknownTimeZone> {
        if name == "UTC" {
            return Ok(Self::UTC);
        }
        let unknown = || UnknownTimeZone(name.to_owned());
        let zone = TimeZone::get(name).map_err(|_| unknown())?;
        // `TimeZone::get` also knows "Etc/Unknown".
        match zone.iana_name() {
            Some(found) if !zone.is_unknown() && !found.is_empty() => Ok(Self(zone)),
            _ => Err(unknown()),
        }
    }
}

impl TryFrom<String> for IanaTimeZone {
    type Error = UnknownTimeZone;
    fn try_from(name: String) -> Result<Self, UnknownTimeZone> {
        name.parse()
    }
}

impl From<IanaTimeZone> for String {
    fn from(zone: IanaTimeZone) -> Self {
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
            name.parse::<IanaTimeZone>()
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
            assert_eq!(name.parse::<IanaTimeZone>().unwrap().to_string(), name);
        }
        for wrong in ["", "Berlin", "Europe/Atlantis", "+01:00", "Etc/Unknown"] {
            let error = wrong.parse::<IanaTimeZone>().unwrap_err().to_string();
            assert!(error.contains("Europe/Berlin"), "{error}");
        }
    }
}
