//! `/tournaments`: the tournaments of the season, newest first.

use super::{
    frame::{Frame, PageProblem, render},
    spoilers::Spoilers,
    tournament_text,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::tournament::TournamentSummary;
use faceoff_service::{app::App, views::tournament};

struct Row {
    summary: TournamentSummary,
    phase: String,
}

#[derive(Template)]
#[template(path = "tournaments.html")]
struct Page {
    frame: Frame,
    spoilers: Spoilers,
    rows: Vec<Row>,
}

impl Page {
    /// The next step of a tournament. If results are hidden, it leaves out the reason of a pause: a free text that may reveal them.
    fn next_step<'a>(&self, row: &'a Row) -> &'a str {
        match self.spoilers.hides_results() && row.summary.paused.is_some() {
            true => "The tournament is paused; no games start.",
            false => &row.summary.next,
        }
    }
}

pub(super) async fn page(
    State(app): State<App>,
    spoilers: Spoilers,
) -> Result<Response, PageProblem> {
    let mut summaries = tournament::summaries(&app).await?;
    summaries.reverse();
    render(&Page {
        frame: Frame::load(&app, "/tournaments").await?,
        rows: summaries
            .into_iter()
            .map(|summary| Row {
                phase: tournament_text::phase_label(&summary),
                summary,
            })
            .collect(),
        spoilers,
    })
}
