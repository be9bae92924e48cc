//! `/tournaments`: all of the season, the newest first.

use super::{
    frame::{Frame, PageProblem, render},
    spoilers::Spoilers,
    tournament_words,
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::views::tournament::TournamentHead;
use faceoff_service::{
    app::App,
    views::{season::SeasonHead, tournament},
};

struct Row {
    head: TournamentHead,
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
    /// What comes next of one; a pause's reason is the organiser's own words.
    fn next<'a>(&self, row: &'a Row) -> &'a str {
        match self.spoilers.hide() && row.head.paused.is_some() {
            true => "No game begins: it is paused.",
            false => &row.head.next,
        }
    }
}

pub(super) async fn page(
    State(app): State<App>,
    spoilers: Spoilers,
) -> Result<Response, PageProblem> {
    let season = SeasonHead::now(&app).await?;
    let mut heads = tournament::heads(&app).await?;
    heads.reverse();
    render(&Page {
        frame: Frame::of(&app, season.name, "/tournaments"),
        rows: heads
            .into_iter()
            .map(|head| Row {
                phase: tournament_words::phase(&head),
                head,
            })
            .collect(),
        spoilers,
    })
}
