//! The season: its name, rules, the commitment to its secret, and its end.

use axum::{Json, extract::State};
use faceoff_api::{
    requests::{CloseSeason, SeasonChange},
    views::season::SeasonView,
};
use faceoff_service::{
    acts::teams,
    app::App,
    auth::Organiser,
    extract::Json as Body,
    problem::Problem,
    viewer::Viewer,
    views::season::{self, SeasonHead},
};

/// The season.
#[utoipa::path(
    get, path = "/season", tag = "public", security((), ("team" = []), ("organiser" = [])),
    responses((status = 200, body = SeasonView))
)]
pub(crate) async fn season(
    viewer: Viewer,
    State(app): State<App>,
) -> Result<Json<SeasonView>, Problem> {
    season::now(&app, viewer).await.map(Json)
}

/// Lets anybody register a team, or nobody; sets the divisions.
#[utoipa::path(
    patch, path = "/season", tag = "organiser", security(("organiser" = [])), request_body = SeasonChange,
    responses(
        (status = 200, body = SeasonView),
        (status = 409, description = "a team is in a division that is left out, one is there twice, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn change_season(
    organiser: Organiser,
    State(app): State<App>,
    Body(change): Body<SeasonChange>,
) -> Result<Json<SeasonView>, Problem> {
    teams::change_season(&app, organiser.actor(), &change).await?;
    season::now(&app, Viewer::Organiser).await.map(Json)
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
    organiser: Organiser,
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
    app.store.close_season(organiser.actor(), now).await?;
    tracing::info!(season = name, "season closed; its secret is public");
    season::now(&app, Viewer::Organiser).await.map(Json)
}
