//! The season: its name, rules, the commitment to its secret, and its end.

use crate::{
    app::App,
    auth::Organiser,
    extract::Json as Body,
    problem::Problem,
    requests::CloseSeason,
    viewer::Viewer,
    views::season::{SeasonHead, SeasonView},
};
use axum::{Json, extract::State};
use faceoff_store::Actor;

/// The season.
#[utoipa::path(get, path = "/season", tag = "public", responses((status = 200, body = SeasonView)))]
pub(crate) async fn season(
    viewer: Viewer,
    State(app): State<App>,
) -> Result<Json<SeasonView>, Problem> {
    SeasonView::now(&app, viewer).await.map(Json)
}

/// Closes the season for good: its secret becomes public, and nothing more is uploaded or evaluated.
#[utoipa::path(
    post, path = "/season/close", tag = "organiser", security(("organiser" = [])),
    request_body = CloseSeason,
    responses(
        (status = 200, body = SeasonView),
        (status = 409, description = "evaluations are queued or running, a stage is blind or waits for its final day, or it is closed already"),
        (status = 422, description = "not the season's name"),
    )
)]
pub(crate) async fn close_season(
    _: Organiser,
    State(app): State<App>,
    Body(CloseSeason { confirm }): Body<CloseSeason>,
) -> Result<Json<SeasonView>, Problem> {
    let name = SeasonHead::now(&app).await?.name;
    if confirm != name {
        let detail = format!(
            "expected the season's name {name:?}, got {confirm:?}; closing cannot be undone"
        );
        return Err(Problem::invalid("confirm", detail));
    }
    let now = app.config.clock.now();
    app.store.close_season(Actor::Organiser, now).await?;
    tracing::info!(season = name, "season closed; its secret is public");
    SeasonView::now(&app, Viewer::Organiser).await.map(Json)
}
