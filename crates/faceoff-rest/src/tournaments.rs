//! Tournaments: creating, changing, pausing and closing them.

use axum::{
    Json,
    extract::State,
    http::{StatusCode, header},
    response::{AppendHeaders, IntoResponse},
};
use faceoff_api::{
    objects_only, paths,
    requests::{Confirmation, NewTournament, Reason, TournamentChange},
    views::tournament::{TournamentHead, TournamentView},
};
use faceoff_service::{
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    services::{
        decisions::checked_reason,
        entrants,
        stages::{check_offered, check_playable, parse_name},
    },
    views::{stage, tournament},
};
use faceoff_store::Stage;
use faceoff_types::{TournamentId, TournamentRules, TournamentSettings};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Map, Value};

/// Lists all tournaments, in order of creation.
#[utoipa::path(
    get, path = "/tournaments", tag = "public", responses((status = 200, body = Vec<TournamentHead>))
)]
pub(crate) async fn list_tournaments(
    State(app): State<App>,
) -> Result<Json<Vec<TournamentHead>>, Problem> {
    tournament::heads(&app).await.map(Json)
}

/// Returns a tournament: rules, entrants, rounds and standings.
#[utoipa::path(
    get, path = "/tournaments/{id}", tag = "public", params(("id" = TournamentId, Path)),
    responses((status = 200, body = TournamentView), (status = 404))
)]
pub(crate) async fn tournament(
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<TournamentView>, Problem> {
    tournament::find(&app, id).await.map(Json)
}

/// Creates a tournament. Until its first round starts, entrants and rules may change, and test and friendly games can
/// be played.
#[utoipa::path(
    post, path = "/tournaments", tag = "organiser", security(("organiser" = [])), request_body = NewTournament,
    responses(
        (status = 201, body = TournamentView, headers(("Location" = String, description = "path of the tournament"))),
        (status = 404, description = "no such stage"),
        (status = 409, description = "the name is taken, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn open_tournament(
    organiser: Organiser,
    State(app): State<App>,
    Body(request): Body<NewTournament>,
) -> Result<impl IntoResponse, Problem> {
    let name = parse_name(&request.name)?;
    let rules = changed_rules(
        &app,
        &app.config.competition().tournament_rules(),
        request.rules,
    )
    .await?;
    let settings = changed_settings(&TournamentSettings::default(), request.settings)?;
    let stage = match (&request.stage, &request.teams) {
        (Some(stage), _) => Some(find_stage(&app, stage).await?),
        (None, Some(_)) => None,
        (None, None) => Some(stage::current(&app).await?),
    };
    let entrants = match (&request.teams, &stage) {
        (Some(teams), _) => entrants::find_by_names(&app, "teams", teams).await?,
        (None, Some(stage)) => entrants::qualified_teams(&app, stage).await?,
        (None, None) => Vec::new(),
    };
    entrants::check_count(entrants.len())?;
    let new_tournament = faceoff_store::NewTournament {
        name,
        stage: stage.map(|stage| stage.id),
        rules,
        settings,
        entrants,
    };
    let now = app.config.clock.now();
    let opened = app
        .store
        .open_tournament(organiser.actor(), &new_tournament, now)
        .await?;
    tracing::info!(
        tournament = %opened.name, id = %opened.id, teams = new_tournament.entrants.len(), "tournament opened"
    );
    let location = [(header::LOCATION, paths::tournament(opened.id))];
    let view = tournament::find(&app, opened.id).await?;
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}

/// Changes a tournament: its rules until the first round starts, everything else until it is closed.
#[utoipa::path(
    patch, path = "/tournaments/{id}", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = TournamentChange,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "rules after the first round has started, any change after the tournament is closed, or the name is taken"),
        (status = 422),
    )
)]
pub(crate) async fn change_tournament(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(change): Body<TournamentChange>,
) -> Result<Json<TournamentView>, Problem> {
    let current = app.store.tournament(id).await?;
    let rules = match change.rules {
        Some(fields) => Some(changed_rules(&app, &current.rules, Some(fields)).await?),
        None => None,
    };
    let settings = match change.settings {
        Some(fields) => Some(changed_settings(&current.settings, Some(fields))?),
        None => None,
    };
    let tournament_change = faceoff_store::TournamentChange {
        name: change.name.as_deref().map(parse_name).transpose()?,
        rules,
        settings,
        baseline: change.baseline,
    };
    let now = app.config.clock.now();
    let changed = app
        .store
        .change_tournament(organiser.actor(), id, &tournament_change, now)
        .await?;
    tracing::info!(tournament = %changed.name, %id, "tournament changed");
    tournament::find(&app, id).await.map(Json)
}

/// Pauses a tournament: no game starts; running ones continue.
#[utoipa::path(
    post, path = "/tournaments/{id}/pause", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = Reason,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "the tournament is already paused, or closed"),
        (status = 422),
    )
)]
pub(crate) async fn pause_tournament(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(Reason { reason }): Body<Reason>,
) -> Result<Json<TournamentView>, Problem> {
    let reason = checked_reason(&reason)?;
    let now = app.config.clock.now();
    app.store
        .pause_tournament(organiser.actor(), id, reason, now)
        .await?;
    tracing::info!(tournament = %id, reason, "tournament paused");
    tournament::find(&app, id).await.map(Json)
}

/// Resumes a paused tournament.
#[utoipa::path(
    post, path = "/tournaments/{id}/resume", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)),
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "the tournament is not paused, or is closed"),
    )
)]
pub(crate) async fn resume_tournament(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
) -> Result<Json<TournamentView>, Problem> {
    let now = app.config.clock.now();
    app.store
        .resume_tournament(organiser.actor(), id, now)
        .await?;
    tracing::info!(tournament = %id, "tournament resumed");
    tournament::find(&app, id).await.map(Json)
}

/// Closes a tournament for good: nothing of it can change any more.
#[utoipa::path(
    post, path = "/tournaments/{id}/close", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = Confirmation,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "not confirmed with its name (nothing is done), a game is unfinished or has to be rerun, or the tournament is already closed"),
    )
)]
pub(crate) async fn close_tournament(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(Confirmation { confirm }): Body<Confirmation>,
) -> Result<Json<TournamentView>, Problem> {
    let record = app.store.tournament_record(id).await?;
    let (tournament, rounds) = (record.tournament, record.rounds.len());
    let effect = format!(
        "the tournament {:?} would be closed for good, with {rounds} of {} rounds started; recordings of its games would be \
         published according to its settings",
        tournament.name.as_str(),
        tournament.rules.format.last_round()
    );
    Problem::check_confirmed(confirm.as_deref(), tournament.name.as_str(), &effect)?;
    let now = app.config.clock.now();
    app.store
        .close_tournament(organiser.actor(), id, now)
        .await?;
    tracing::info!(tournament = %tournament.name, %id, "tournament closed");
    tournament::find(&app, id).await.map(Json)
}

/// A stage by its id, or by its name, ignoring case.
async fn find_stage(app: &App, text: &str) -> Result<Stage, Problem> {
    if let Ok(id) = text.parse() {
        return Ok(app.store.stage(id).await?);
    }
    let stages = app.store.stages().await?;
    let names: Vec<String> = stages.iter().map(|stage| stage.name.to_string()).collect();
    let name = text.to_lowercase();
    let mut stages = stages.into_iter();
    let found = stages.find(|stage| stage.name.as_str().to_lowercase() == name);
    found.ok_or_else(|| {
        let detail = format!("expected one of {}, got {text:?}", names.join(", "));
        Problem::invalid("stage", detail)
    })
}

/// `current`, changed by the fields of a JSON merge patch (RFC 7396); `null` restores the value in `defaults`. `name` is the field of the
/// request, for errors.
fn apply_patch<T: Serialize + DeserializeOwned>(
    name: &str,
    current: &T,
    defaults: &T,
    fields: Option<Map<String, Value>>,
) -> Result<T, Problem> {
    let object = |value: &T| match serde_json::to_value(value).map_err(Problem::internal)? {
        Value::Object(object) => Ok(object),
        _ => Err(Problem::internal(format_args!(
            "{name} are not a JSON object"
        ))),
    };
    let (mut object, mut defaults) = (object(current)?, object(defaults)?);
    for (field, value) in fields.unwrap_or_default() {
        let value = match value {
            Value::Null => defaults.remove(&field),
            value => Some(value),
        };
        match value {
            Some(value) => drop(object.insert(field, value)),
            // Left out by default.
            None => drop(object.remove(&field)),
        }
    }
    let value = Value::Object(object);
    objects_only::check::<T>(&value).map_err(|error| Problem::invalid(name, error))?;
    serde_path_to_error::deserialize(value).map_err(|error| Problem::invalid(name, error))
}

async fn changed_rules(
    app: &App,
    current: &TournamentRules,
    fields: Option<Map<String, Value>>,
) -> Result<TournamentRules, Problem> {
    let sets_ruleset = fields
        .as_ref()
        .is_some_and(|fields| fields.contains_key("ruleset"));
    let competition = app.config.competition();
    let mut rules = apply_patch("rules", current, &competition.tournament_rules(), fields)?;
    // Completes magnitudes, so that those that state a default are no change.
    let checked = competition.check_tournament(&mut rules);
    checked.map_err(|error| Problem::invalid("rules", error))?;
    let newest = competition.ruleset();
    // An upgrade of the server alone does not change a tournament.
    if rules != *current {
        if sets_ruleset && rules.ruleset != newest {
            let detail = format!(
                "ruleset: expected the current one, {newest}, got {}; leave it out",
                rules.ruleset
            );
            return Err(Problem::invalid("rules", detail));
        }
        rules.ruleset = newest;
    }
    check_offered(app, rules.runtimes.as_ref())?;
    check_playable(app, &rules.perturbations).await?;
    Ok(rules)
}

fn changed_settings(
    current: &TournamentSettings,
    fields: Option<Map<String, Value>>,
) -> Result<TournamentSettings, Problem> {
    let settings = apply_patch("settings", current, &TournamentSettings::default(), fields)?;
    settings
        .check()
        .map_err(|error| Problem::invalid("settings", error))?;
    Ok(settings)
}
