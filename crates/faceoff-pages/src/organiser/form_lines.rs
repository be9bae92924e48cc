//! Text areas with one name per line.

use faceoff_service::problem::Problem;
use std::{fmt::Display, str::FromStr};

/// The values of a text area with one per line; empty lines are skipped. `field` is the name of the text area, for errors.
///
/// # Errors
/// `InvalidContent`: a line is no valid value.
pub(super) fn parse<T: FromStr<Err: Display>>(field: &str, text: &str) -> Result<Vec<T>, Problem> {
    let lines = text.lines().map(str::trim);
    let values = lines.filter(|line| !line.is_empty()).map(str::parse::<T>);
    let values: Result<Vec<T>, T::Err> = values.collect();
    values.map_err(|error| Problem::invalid(field, error))
}
