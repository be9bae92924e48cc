//! Schedules: when the evaluation days of a stage start. A day starts with its *cutoff*, the moment at which each team's
//! active submission is fixed.

use crate::IanaTimeZone;
use croner::{
    Cron,
    errors::CronError,
    parser::{CronParser, Seconds, Year},
};
use jiff::{
    Span, Timestamp,
    civil::{Date, Time},
};
use serde::{Deserialize, Serialize};

/// The dates and times at which the evaluation days of a stage start, at most one per date, in the stage's zone.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "ScheduleFields", into = "ScheduleFields")]
pub struct Schedule {
    recurrence: Recurrence,
    days_off: Vec<Date>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Recurrence {
    Daily(Time),
    /// The cron expression as text; the parsed form would take 100 times the memory.
    Cron(String),
}

/// A schedule in JSON and TOML.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "openapi", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
struct ScheduleFields {
    /// Every day at this time; excludes `cron`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(value_type = Option<String>, example = "06:00:00"))]
    daily: Option<Time>,
    /// Five fields: minute, hour, day of the month, month, day of the week. On each matching date, the first matching time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[cfg_attr(feature = "openapi", schema(example = "0 6 * * 1-5"))]
    cron: Option<String>,
    /// Dates without an evaluation day.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    days_off: Vec<Date>,
}

#[cfg(feature = "openapi")]
impl utoipa::PartialSchema for Schedule {
    fn schema() -> utoipa::openapi::RefOr<utoipa::openapi::Schema> {
        ScheduleFields::schema()
    }
}

#[cfg(feature = "openapi")]
impl utoipa::ToSchema for Schedule {}

/// An invalid schedule.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum InvalidSchedule {
    /// Neither or both of `daily` and `cron`.
    #[error(
        "a schedule has either `daily`, a time as \"06:00\", or `cron`, five fields as \"0 6 * * 1-5\""
    )]
    OneKindExpected,
    /// Not a cron expression, or one that never matches.
    #[error(
        "{pattern:?} is no schedule of five fields (minute, hour, day of the month, month, day of the week): {reason}"
    )]
    Cron { pattern: String, reason: String },
}

/// How far ahead to search for a cutoff: beyond the gap between two leap days, and any holidays.
const HORIZON_DAYS: i64 = 366 * 9;

impl Schedule {
    /// Every day at a time.
    #[must_use]
    pub const fn daily(time: Time) -> Self {
        Self {
            recurrence: Recurrence::Daily(time),
            days_off: Vec::new(),
        }
    }

    /// On each date that matches the expression, at the first matching time. Takes five fields, or e.g. `@daily`.
    ///
    /// # Errors
    /// If the expression is invalid, or no date matches it.
    pub fn cron(pattern: &str) -> Result<Self, InvalidSchedule> {
        let invalid = |reason: String| InvalidSchedule::Cron {
            pattern: pattern.to_owned(),
            reason,
        };
        parse(pattern).map_err(|error| invalid(error.to_string()))?;
        let schedule = Self {
            recurrence: Recurrence::Cron(pattern.to_owned()),
            days_off: Vec::new(),
        };
        // Every date recurs within eight years, even 29 February.
        match schedule.next(
            jiff::civil::date(2000, 1, 1),
            Timestamp::UNIX_EPOCH,
            &IanaTimeZone::UTC,
        ) {
            Some(_) => Ok(schedule),
            None => Err(invalid("there is no such date".to_owned())),
        }
    }

    /// Excludes these dates.
    #[must_use]
    pub fn without(mut self, mut days_off: Vec<Date>) -> Self {
        days_off.sort_unstable();
        days_off.dedup();
        self.days_off = days_off;
        self
    }

    /// Date and instant of the first start on or after the date `from` and not before `earliest`.
    #[must_use]
    pub fn next(
        &self,
        mut from: Date,
        earliest: Timestamp,
        zone: &IanaTimeZone,
    ) -> Option<(Date, Timestamp)> {
        let horizon = from.checked_add(Span::new().days(HORIZON_DAYS)).ok()?;
        while from <= horizon {
            let (date, at) = self.first_from(from, earliest, zone)?;
            if at >= earliest && !self.days_off.contains(&date) {
                return Some((date, at));
            }
            from = date.tomorrow().ok()?;
        }
        None
    }

    /// The first start on or after the date `from`, which may be on a day off, and for daily schedules before `earliest`.
    /// A time that the change to summer time skips is moved to after the change.
    fn first_from(
        &self,
        from: Date,
        earliest: Timestamp,
        zone: &IanaTimeZone,
    ) -> Option<(Date, Timestamp)> {
        match &self.recurrence {
            Recurrence::Daily(time) => {
                let start = from.to_datetime(*time).to_zoned(zone.time_zone()).ok()?;
                Some((from, start.timestamp()))
            }
            Recurrence::Cron(pattern) => {
                let midnight = from.to_zoned(zone.time_zone()).ok()?;
                let begin = midnight.max(earliest.to_zoned(zone.time_zone()));
                let start = parse(pattern).ok()?.find_next_occurrence(&begin, true);
                let start = start.ok()?;
                Some((start.date(), start.timestamp()))
            }
        }
    }
}

fn parse(pattern: &str) -> Result<Cron, CronError> {
    CronParser::builder()
        .seconds(Seconds::Disallowed)
        .year(Year::Disallowed)
        .build()
        .parse(pattern)
}

impl TryFrom<ScheduleFields> for Schedule {
    type Error = InvalidSchedule;
    fn try_from(fields: ScheduleFields) -> Result<Self, InvalidSchedule> {
        let schedule = match (fields.daily, fields.cron) {
            (Some(time), None) => Self::daily(time),
            (None, Some(pattern)) => Self::cron(&pattern)?,
            _ => return Err(InvalidSchedule::OneKindExpected),
        };
        Ok(schedule.without(fields.days_off))
    }
}

impl From<Schedule> for ScheduleFields {
    fn from(
        Schedule {
            recurrence,
            days_off,
        }: Schedule,
    ) -> Self {
        let (daily, cron) = match recurrence {
            Recurrence::Daily(time) => (Some(time), None),
            Recurrence::Cron(pattern) => (None, Some(pattern)),
        };
        Self {
            daily,
            cron,
            days_off,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use jiff::civil::date;

    /// The first `count` starts on or after the date `from`, as the local date and the instant.
    fn starts(schedule: &Schedule, zone: &str, from: Date, count: usize) -> Vec<String> {
        let zone: IanaTimeZone = zone.parse().unwrap();
        let mut from = from;
        let next = || {
            let (date, at) = schedule.next(from, Timestamp::UNIX_EPOCH, &zone)?;
            from = date.tomorrow().unwrap();
            Some(format!("{date} {at}"))
        };
        std::iter::from_fn(next).take(count).collect()
    }

    #[test]
    fn daily_start_follows_the_zone_through_dst_changes() {
        let half_past_two = Schedule::daily("02:30".parse().unwrap());
        assert_eq!(
            starts(&half_past_two, "Europe/Berlin", date(2026, 3, 28), 3),
            [
                "2026-03-28 2026-03-28T01:30:00Z",
                // There is no 02:30 on that date: the clocks go from 02:00 to 03:00.
                "2026-03-29 2026-03-29T01:30:00Z",
                "2026-03-30 2026-03-30T00:30:00Z",
            ]
        );
        // 02:30 occurs twice: the first counts.
        assert_eq!(
            starts(&half_past_two, "Europe/Berlin", date(2026, 10, 25), 1),
            ["2026-10-25 2026-10-25T00:30:00Z"]
        );
    }

    #[test]
    fn cron_starts_at_first_matching_time_of_a_date() {
        let weekdays = Schedule::cron("0 6,18 * * 1-5").unwrap();
        assert_eq!(
            starts(&weekdays, "America/New_York", date(2026, 11, 20), 3),
            [
                "2026-11-20 2026-11-20T11:00:00Z",
                "2026-11-23 2026-11-23T11:00:00Z",
                "2026-11-24 2026-11-24T11:00:00Z",
            ]
        );
        // If 06:00 of the first date has passed, the start is at 18:00 of the same date.
        let earliest = "2026-11-20T12:00:00Z".parse().unwrap();
        let next = weekdays.next(date(2026, 11, 20), earliest, &IanaTimeZone::UTC);
        assert_eq!(next.unwrap().1.to_string(), "2026-11-20T18:00:00Z");
        let daily = Schedule::daily("06:00".parse().unwrap());
        let next = daily.next(date(2026, 11, 20), earliest, &IanaTimeZone::UTC);
        assert_eq!(next.unwrap().1.to_string(), "2026-11-21T06:00:00Z");
        let leap = Schedule::cron("0 0 29 2 *").unwrap();
        assert_eq!(
            starts(&leap, "UTC", date(2026, 1, 1), 1),
            ["2028-02-29 2028-02-29T00:00:00Z"]
        );
    }

    #[test]
    fn days_off_are_skipped() {
        let days_off = vec![date(2026, 12, 25), date(2026, 12, 24)];
        let schedule = Schedule::daily("06:00".parse().unwrap()).without(days_off);
        assert_eq!(
            starts(&schedule, "UTC", date(2026, 12, 23), 2),
            [
                "2026-12-23 2026-12-23T06:00:00Z",
                "2026-12-26 2026-12-26T06:00:00Z"
            ]
        );
    }

    #[test]
    fn schedule_round_trips_and_bad_ones_are_refused() {
        for text in [
            r#"{"daily":"06:00:00"}"#,
            r#"{"cron":"0 6 * * 1-5","days_off":["2026-12-24"]}"#,
        ] {
            let schedule: Schedule = serde_json::from_str(text).unwrap();
            assert_eq!(serde_json::to_string(&schedule).unwrap(), text);
        }
        for (wrong, words) in [
            ("{}", "either `daily`"),
            (r#"{"daily":"06:00","cron":"0 6 * * *"}"#, "either `daily`"),
            (r#"{"cron":"0 6 * *"}"#, "five fields"),
            (r#"{"cron":"0 0 6 * * *"}"#, "five fields"),
            (r#"{"cron":"99 6 * * *"}"#, "five fields"),
            (r#"{"cron":"0 0 30 2 *"}"#, "no such date"),
            (r#"{"daily":"25:00"}"#, "hour"),
            (r#"{"dayly":"05:00"}"#, "dayly"),
        ] {
            let error = serde_json::from_str::<Schedule>(wrong).unwrap_err();
            assert!(error.to_string().contains(words), "{wrong}: {error}");
        }
    }
}
