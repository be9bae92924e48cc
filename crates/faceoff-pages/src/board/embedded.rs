//! `/embed`: the first teams of the newest board, to embed in other sites.

use super::{
    rows::{Context, Group, OverallRow},
    score_history::ScoreHistory,
};
use crate::{
    assets,
    embeddable::Embeddable,
    frame::{Frame, NO_ENTRY, PageProblem, render},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::requests::BoardQuery;
use faceoff_service::{
    app::App,
    viewer::Viewer,
    views::{board, visibility::Visibility},
};
use std::sync::Arc;

/// As many as a frame of 640 × 360 shows.
const MAX_TEAMS: usize = 6;

#[derive(Template)]
#[template(path = "board_embedded.html")]
struct Page {
    frame: Frame,
    style: &'static str,
    title: String,
    stage: String,
    /// Is the board hidden from visitors?
    is_hidden: bool,
    groups: Vec<Group<OverallRow>>,
    /// Number of teams that are not shown.
    omitted: usize,
}

/// Always the public view, whether or not the visitor is signed in.
pub(crate) async fn page(State(app): State<App>) -> Result<Response, PageProblem> {
    let competition = Arc::clone(app.config.competition());
    let visibility = Visibility::load(&app, Viewer::Visitor).await?;
    let board = board::query(&app, &visibility, BoardQuery::default(), None).await?;
    let score_history = ScoreHistory::default();
    let is_by_rank = true;
    let context = Context::new(&board, None, &score_history, is_by_rank);
    let mut groups =
        context.groups(|row| OverallRow::new(row, &context, &board.weights, &competition));
    let mut remaining = MAX_TEAMS;
    for group in &mut groups {
        group.rows.truncate(remaining);
        remaining -= group.rows.len();
    }
    groups.retain(|group| !group.rows.is_empty());
    let mut response = render(&Page {
        frame: Frame::without_season(NO_ENTRY),
        style: assets::FRONT_STYLE.url(),
        title: competition.title.clone(),
        stage: board.stage_name.to_string(),
        is_hidden: visibility.hides_scores(board.stage),
        groups,
        omitted: board.rows.len().saturating_sub(MAX_TEAMS),
    })?;
    response.extensions_mut().insert(Embeddable);
    Ok(response)
}
