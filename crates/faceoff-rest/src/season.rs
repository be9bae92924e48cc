//! The season: its public data, its settings, and its end. A commitment (hash) to the season's secret is public from the
//! start; all seeds follow from the secret, which becomes public when the season closes.

use axum::{Json, extract::State};
use faceoff_api::{
    requests::{CloseSeason, SeasonChange},
    views::season::SeasonView,
};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::Json as Body,
    problem::Problem,
    services::teams,
    viewer::Viewer,
    views::season::{self, SeasonSummary},
};

/// Returns the season: name, commitment, stages, days, and the seeds that are revealed.
#[utoipa::path(
    get, path = "/season", tag = "public", security((), ("team" = []), ("organiser" = [])),
    responses((status = 200, body = SeasonView))
)]
pub(crate) async fn season(
    viewer: Viewer,
    State(app): State<App>,
) -> Result<Json<SeasonView>, Problem> {
    season::build(&app, viewer).await.map(Json)
}

/// Changes whether teams can register, and the divisions.
#[utoipa::path(
    patch, path = "/season", tag = "organiser", security(("organiser" = [])), request_body = SeasonChange,
    responses(
        (status = 200, body = SeasonView),
        (status = 409, description = "a removed division has teams, a division is listed twice, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn change_season(
    organiser: Organiser,
    State(app): State<App>,
    Body(change): Body<SeasonChange>,
) -> Result<Json<SeasonView>, Problem> {
    teams::change_season(&app, organiser.actor(), &change).await?;
    season::build(&app, Viewer::Organiser).await.map(Json)
}

/// Closes the season for good: its secret becomes public, and nothing can be uploaded or evaluated any more.
#[utoipa::path(
    post, path = "/season/close", tag = "organiser", security(("organiser" = [])),
    request_body = CloseSeason,
    responses(
        (status = 200, body = SeasonView),
        (status = 409, description = "evaluations are queued or running, a stage is blind or waits for its final day, or the season is already closed"),
        (status = 422, description = "not the season's name"),
    )
)]
pub(crate) async fn close_season(
    organiser: Organiser,
    State(app): State<App>,
    Body(CloseSeason { confirm }): Body<CloseSeason>,
) -> Result<Json<SeasonView>, Problem> {
    let name = SeasonSummary::load(&app).await?.name;
    if confirm != name {
        let detail = format!(
            "expected the season's name {name:?}, got {confirm:?}; closing cannot be undone"
        );
        return Err(Problem::invalid("confirm", detail));
    }
    let now = app.config.clock.now();
    app.store.close_season(organiser.actor(), now).await?;
    tracing::info!(season = name, "season closed; its secret is public");
    season::build(&app, Viewer::Organiser).await.map(Json)
}
