//! The card of an episode: its still picture and its end.

use super::{
    layout::{Card, LEFT, text_style},
    response::respond,
    still::{self, Place},
};
use crate::{episode_text::plain_end, frame::PageProblem, replay_section::Still};
use axum::{extract::State, response::Response};
use faceoff_picture::Weight;
use faceoff_service::{
    app::App,
    episode_path::EpisodePath,
    problem::Problem,
    request_preconditions::RequestPreconditions,
    viewer::Viewer,
    views::{clips::Clips, visibility::Visibility},
};

/// Left end and width of the drawing.
const DRAWING: [f64; 2] = [470.0, 690.0];
/// Width of the text beside it.
const TEXT_WIDTH: f64 = 380.0;

pub(super) async fn picture(
    State(app): State<App>,
    preconditions: RequestPreconditions,
    path: Result<EpisodePath, Problem>,
) -> Result<Response, PageProblem> {
    respond(&app, &preconditions, load(&app, path?)).await
}

async fn load(app: &App, path: EpisodePath) -> Result<Card, PageProblem> {
    let EpisodePath { id, task, episode } = path;
    let visibility = Visibility::load(app, Viewer::Visitor).await?;
    let clips = Clips::find(app, &visibility, id).await?;
    let clip = clips.episode(task, episode).await?;
    let team = app.store.team(clips.evaluation.team).await?;
    let competition = app.config.competition();
    let title = competition
        .task(task)
        .map_or(task.as_str(), |info| info.title.as_str());
    let mut card = Card::new(&competition.short_title);
    let name = text_style(Weight::Semibold, 50.0, "ink");
    let y = card.paragraph(team.name.as_str(), &name, [LEFT, 190.0], (TEXT_WIDTH, 2));
    let soft = text_style(Weight::Regular, 34.0, "soft");
    card.text(
        &format!("{title}, episode {episode}"),
        &soft,
        [LEFT, y - 8.0],
        TEXT_WIDTH,
    );
    let day = clips.evaluation.stage_day.date.to_string();
    card.text(&day, &soft, [LEFT, y + 38.0], TEXT_WIDTH);
    let (verdict, colour) = match clip.summary.success {
        true => ("Success", "good"),
        false => ("No success", "poor"),
    };
    let large = text_style(Weight::Semibold, 48.0, colour);
    card.text(verdict, &large, [LEFT, y + 122.0], TEXT_WIDTH);
    let reason = plain_end(&clip.summary, &clip.motion.header.contacts);
    let ink = text_style(Weight::Regular, 34.0, "ink");
    card.paragraph(&reason, &ink, [LEFT, y + 174.0], (TEXT_WIDTH, 4));
    let [x, width] = DRAWING;
    let place = Place { x, y: 170.0, width };
    card.elements(&still::svg(&Still::new(&clip.motion, None), None, place));
    Ok(card)
}
