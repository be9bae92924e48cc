//! Settings of a stage that are written differently on the command line than in JSON.

use crate::requests::double_option::OrNull;
use clap::{ArgMatches, Args, Command, FromArgMatches, Id, error::ErrorKind};
use faceoff_types::{Magnitudes, Runtimes, Schedule};
use jiff::civil::{Date, Time};
use serde::de::DeserializeOwned;
use std::convert::Infallible;

/// Parses an option in JSON; an error names the wrong field.
pub(super) fn parse_json<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let mut json = serde_json::Deserializer::from_str(text);
    let parsed = serde_path_to_error::deserialize(&mut json).map_err(|error| error.to_string())?;
    json.end().map_err(|error| error.to_string())?;
    Ok(parsed)
}

/// Reads a JSON file with magnitudes of the perturbations. Which are valid is known to the competition.
///
/// # Errors
/// If the file cannot be read, or has another structure.
pub fn read_perturbations(path: &str) -> Result<Magnitudes, String> {
    let text = std::fs::read_to_string(path).map_err(|error| error.to_string())?;
    parse_json(&text)
}

/// Names of runtimes separated by commas; `all` is every runtime that the server offers.
pub(super) fn parse_runtimes(text: &str) -> Result<OrNull<Runtimes>, Infallible> {
    let names = || text.split(',');
    let is_all = names().any(|name| name == "all");
    Ok(OrNull(
        (!is_all).then(|| names().map(str::to_owned).collect()),
    ))
}

/// Options of a schedule, the times of a stage's cutoffs.
#[derive(Args)]
struct ScheduleOptions {
    /// Daily cutoff at this time
    #[arg(long, value_name = "HH:MM", conflicts_with = "cron")]
    daily: Option<Time>,
    /// Cutoffs by a cron expression, e.g. "0 6 * * 1-5"; at most the first time of each date
    #[arg(long, value_name = "EXPRESSION", value_parser = Schedule::cron)]
    cron: Option<Schedule>,
    /// Dates without a cutoff, with --daily or --cron, e.g. 2026-12-24,2026-12-25
    #[arg(long, value_delimiter = ',', value_name = "DATES")]
    days_off: Option<Vec<Date>>,
}

impl FromArgMatches for OrNull<Schedule> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let options = ScheduleOptions::from_arg_matches(matches)?;
        let schedule = match (options.daily, options.cron) {
            (Some(time_of_day), _) => Schedule::daily(time_of_day),
            (None, Some(schedule)) => schedule,
            // Then --days-off is given: clap calls this only if one of the options is.
            (None, None) => {
                return Err(clap::Error::raw(
                    ErrorKind::MissingRequiredArgument,
                    "--days-off needs --daily or --cron, which set the cutoffs",
                ));
            }
        };
        let days_off = options.days_off.unwrap_or_default();
        Ok(Self(Some(schedule.without(days_off))))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for OrNull<Schedule> {
    fn group_id() -> Option<Id> {
        ScheduleOptions::group_id()
    }

    fn augment_args(command: Command) -> Command {
        ScheduleOptions::augment_args(command)
    }

    fn augment_args_for_update(command: Command) -> Command {
        ScheduleOptions::augment_args_for_update(command)
    }
}
