//! Look-up of the season's divisions by name. A *division* is a group of teams, such as students, that are ranked among
//! themselves.

use crate::{
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
};
use faceoff_types::DivisionName;

/// The requested division, ignoring case, as the organisers spelled it; `None` if none is requested.
///
/// # Errors
/// `NotFound`, with the names of all divisions.
#[boxed_future]
pub async fn find(
    app: &AppState,
    requested: Option<DivisionName>,
) -> Result<Option<DivisionName>, Problem> {
    let Some(name) = requested else {
        return Ok(None);
    };
    let divisions = app.store.divisions().await?;
    let lowercase = name.as_str().to_lowercase();
    let division = divisions
        .iter()
        .find(|division| division.as_str().to_lowercase() == lowercase);
    match division {
        Some(division) => Ok(Some(division.clone())),
        None => Err(unknown_division(&name, &divisions)),
    }
}

fn unknown_division(name: &DivisionName, divisions: &[DivisionName]) -> Problem {
    let names: Vec<String> = divisions.iter().map(ToString::to_string).collect();
    let quoted: Vec<String> = names.iter().map(|name| format!("“{name}”")).collect();
    let detail = if names.is_empty() {
        format!(
            "division: expected none, as this season has no divisions, got “{name}”; leave it out"
        )
    } else {
        format!(
            "division: expected {}, got “{name}”; leave it out for all teams",
            quoted.join(" or ")
        )
    };
    Problem::new(ProblemKind::NotFound, detail).with("divisions", names)
}
