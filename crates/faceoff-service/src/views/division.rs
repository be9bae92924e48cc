//! The season's divisions, as a request names them.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
};
use faceoff_types::DivisionName;

/// The division of this name, whatever the case of its letters, as the organisers wrote it.
///
/// # Errors
/// `NotFound`, which names those that there are.
#[boxed]
pub async fn find(app: &AppState, name: &DivisionName) -> Result<DivisionName, Problem> {
    let all = app.store.divisions().await?;
    let wanted = name.as_str().to_lowercase();
    let found = all
        .iter()
        .find(|division| division.as_str().to_lowercase() == wanted);
    found.cloned().ok_or_else(|| unknown(name, &all))
}

fn unknown(name: &DivisionName, all: &[DivisionName]) -> Problem {
    let names: Vec<String> = all.iter().map(ToString::to_string).collect();
    let quoted: Vec<String> = names.iter().map(|name| format!("“{name}”")).collect();
    let detail = if names.is_empty() {
        format!("division: this season has no divisions, so leave out “{name}”")
    } else {
        format!(
            "division: expected {}, got “{name}”; without it the board is that of all teams",
            quoted.join(" or ")
        )
    };
    Problem::new(ProblemKind::NotFound, detail).with("divisions", names)
}
