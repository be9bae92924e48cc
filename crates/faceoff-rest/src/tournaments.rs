//! The season's tournaments: opened, changed, held, closed by the organiser, seen by everybody.

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
    acts::{
        deciding::checked_reason,
        entering,
        staging::{check_offered, check_robot},
    },
    app::App,
    auth::Organiser,
    extract::{Json as Body, PathParam},
    problem::Problem,
    views::{stage, tournament},
};
use faceoff_store::Stage;
use faceoff_types::{Ruleset, StageName, TournamentId, TournamentRules, TournamentSettings};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Map, Value};

/// All tournaments, the first one first.
#[utoipa::path(
    get, path = "/tournaments", tag = "public", responses((status = 200, body = Vec<TournamentHead>))
)]
pub(crate) async fn list_tournaments(
    State(app): State<App>,
) -> Result<Json<Vec<TournamentHead>>, Problem> {
    tournament::heads(&app).await.map(Json)
}

/// One: rules, teams, rounds, tables, and what comes next.
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

/// Opens a tournament. Until its first round is started, teams and rules may change, and games that do not count be
/// played.
#[utoipa::path(
    post, path = "/tournaments", tag = "organiser", security(("organiser" = [])), request_body = NewTournament,
    responses(
        (status = 201, body = TournamentView, headers(("Location" = String, description = "where it is, from the server's root"))),
        (status = 404, description = "no such stage"),
        (status = 409, description = "the name is taken, or the season is closed"),
        (status = 422),
    )
)]
pub(crate) async fn open_tournament(
    organiser: Organiser,
    State(app): State<App>,
    Body(new): Body<NewTournament>,
) -> Result<impl IntoResponse, Problem> {
    let name = name(&new.name)?;
    let rules = changed_rules(&app, &TournamentRules::default(), new.rules).await?;
    let settings = changed_settings(&TournamentSettings::default(), new.settings)?;
    let stage = match (&new.stage, &new.teams) {
        (Some(stage), _) => Some(find_stage(&app, stage).await?),
        (None, Some(_)) => None,
        (None, None) => Some(stage::current(&app).await?),
    };
    let entrants = match (&new.teams, &stage) {
        (Some(teams), _) => entering::named(&app, "teams", teams).await?,
        (None, Some(stage)) => entering::by_tier(&app, stage).await?,
        (None, None) => Vec::new(),
    };
    entering::check_count(entrants.len())?;
    let wanted = faceoff_store::NewTournament {
        name,
        stage: stage.map(|stage| stage.id),
        rules,
        settings,
        entrants,
    };
    let now = app.config.clock.now();
    let opened = app
        .store
        .open_tournament(organiser.actor(), &wanted, now)
        .await?;
    tracing::info!(
        tournament = %opened.name, id = %opened.id, teams = wanted.entrants.len(), "tournament opened"
    );
    let location = [(header::LOCATION, paths::tournament(opened.id))];
    let view = tournament::find(&app, opened.id).await?;
    Ok((StatusCode::CREATED, AppendHeaders(location), Json(view)))
}

/// Changes a tournament: its rules until the first round is started, the rest until it is closed.
#[utoipa::path(
    patch, path = "/tournaments/{id}", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = TournamentChange,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "rules once a round was started, anything once it is closed, or the name is taken"),
        (status = 422),
    )
)]
pub(crate) async fn change_tournament(
    organiser: Organiser,
    State(app): State<App>,
    PathParam(id): PathParam<TournamentId>,
    Body(change): Body<TournamentChange>,
) -> Result<Json<TournamentView>, Problem> {
    let is = app.store.tournament(id).await?;
    let rules = match change.rules {
        Some(fields) => Some(changed_rules(&app, &is.rules, Some(fields)).await?),
        None => None,
    };
    let settings = match change.settings {
        Some(fields) => Some(changed_settings(&is.settings, Some(fields))?),
        None => None,
    };
    let wanted = faceoff_store::TournamentChange {
        name: change.name.as_deref().map(name).transpose()?,
        rules,
        settings,
        baseline: change.baseline,
    };
    let now = app.config.clock.now();
    let changed = app
        .store
        .change_tournament(organiser.actor(), id, &wanted, now)
        .await?;
    tracing::info!(tournament = %changed.name, %id, "tournament changed");
    tournament::find(&app, id).await.map(Json)
}

/// Holds a tournament: no game of it begins; what is played goes on to its end.
#[utoipa::path(
    post, path = "/tournaments/{id}/pause", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = Reason,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "it is paused or closed"),
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

/// Lets a paused tournament go on.
#[utoipa::path(
    post, path = "/tournaments/{id}/resume", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)),
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "it is not paused, or closed"),
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

/// Closes a tournament for good: nothing of it changes any more.
#[utoipa::path(
    post, path = "/tournaments/{id}/close", tag = "organiser", security(("organiser" = [])),
    params(("id" = TournamentId, Path)), request_body = Confirmation,
    responses(
        (status = 200, body = TournamentView),
        (status = 404),
        (status = 409, description = "not confirmed with its name (nothing is done), a game is open or waits to be played again, or it is closed"),
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
    let what = format!(
        "nothing of the tournament {:?} would change any more, {rounds} of {} rounds were started, and the recordings of \
         their games would come out as its settings say",
        tournament.name.as_str(),
        tournament.rules.format.last_round()
    );
    Problem::check_confirmed(confirm.as_deref(), tournament.name.as_str(), &what)?;
    let now = app.config.clock.now();
    app.store
        .close_tournament(organiser.actor(), id, now)
        .await?;
    tracing::info!(tournament = %tournament.name, %id, "tournament closed");
    tournament::find(&app, id).await.map(Json)
}

fn name(text: &str) -> Result<StageName, Problem> {
    text.parse()
        .map_err(|error| Problem::invalid("name", error))
}

/// A stage by its id, or by its name, whatever the case of its letters.
async fn find_stage(app: &App, text: &str) -> Result<Stage, Problem> {
    if let Ok(id) = text.parse() {
        return Ok(app.store.stage(id).await?);
    }
    let stages = app.store.stages().await?;
    let names: Vec<String> = stages.iter().map(|stage| stage.name.to_string()).collect();
    let wanted = text.to_lowercase();
    let mut found = stages.into_iter();
    let found = found.find(|stage| stage.name.as_str().to_lowercase() == wanted);
    found.ok_or_else(|| {
        let detail = format!("expected one of {}, got {text:?}", names.join(", "));
        Problem::invalid("stage", detail)
    })
}

/// What is there, with other values for the fields that were sent.
fn merged<T: Serialize + DeserializeOwned>(
    what: &str,
    is: &T,
    fields: Option<Map<String, Value>>,
) -> Result<T, Problem> {
    let value = serde_json::to_value(is).map_err(Problem::internal)?;
    let Value::Object(mut all) = value else {
        return Err(Problem::internal(format_args!("{what} are no object")));
    };
    for (field, value) in fields.unwrap_or_default() {
        match value {
            Value::Null => drop(all.remove(&field)),
            value => drop(all.insert(field, value)),
        }
    }
    let value = Value::Object(all);
    objects_only::check::<T>(&value).map_err(|error| Problem::invalid(what, error))?;
    serde_path_to_error::deserialize(value).map_err(|error| Problem::invalid(what, error))
}

async fn changed_rules(
    app: &App,
    is: &TournamentRules,
    fields: Option<Map<String, Value>>,
) -> Result<TournamentRules, Problem> {
    let is_named = fields
        .as_ref()
        .is_some_and(|fields| fields.contains_key("ruleset"));
    let mut rules: TournamentRules = merged("rules", is, fields)?;
    // An upgrade of the program alone changes nothing of a tournament.
    if rules != *is {
        if is_named && rules.ruleset != Ruleset::CURRENT {
            let detail = format!(
                "ruleset: expected {}, the current one, got {}; leave it out",
                Ruleset::CURRENT,
                rules.ruleset
            );
            return Err(Problem::invalid("rules", detail));
        }
        rules.ruleset = Ruleset::CURRENT;
    }
    rules
        .check()
        .map_err(|error| Problem::invalid("rules", error))?;
    check_offered(app, rules.runtimes.as_ref())?;
    check_robot(app, &rules.perturbations).await?;
    Ok(rules)
}

fn changed_settings(
    is: &TournamentSettings,
    fields: Option<Map<String, Value>>,
) -> Result<TournamentSettings, Problem> {
    let settings: TournamentSettings = merged("settings", is, fields)?;
    settings
        .check()
        .map_err(|error| Problem::invalid("settings", error))?;
    Ok(settings)
}
