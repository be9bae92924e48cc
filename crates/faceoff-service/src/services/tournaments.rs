//! Tournaments: opening, changing, pausing and closing them.

use super::{
    decision_preview::{Preview, checked_reason},
    entrants,
    stages::{check_offered, check_season_magnitudes, parse_name},
};
use crate::{app::AppState, boxed_future, problem::Problem, views::stage};
use faceoff_api::{
    objects_only,
    requests::{NewTournament, TournamentChange},
};
use faceoff_store::{Actor, Stage, Tournament};
use faceoff_types::{TournamentId, TournamentRules, TournamentSettings};
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Map, Value};

/// Opens a tournament. Without names of teams, those that qualify by the board of the stage enter it.
#[boxed_future]
pub async fn open_tournament(
    app: &AppState,
    actor: Actor,
    request: NewTournament,
) -> Result<Tournament, Problem> {
    let name = parse_name(&request.name)?;
    let rules = changed_rules(
        app,
        &app.config.competition().tournament_rules(),
        request.rules,
    )
    .await?;
    let settings = changed_settings(&TournamentSettings::default(), request.settings)?;
    let stage = match (&request.stage, &request.teams) {
        (Some(stage), _) => Some(find_stage(app, stage).await?),
        (None, Some(_)) => None,
        (None, None) => Some(stage::current(app).await?),
    };
    let entrants = match (&request.teams, &stage) {
        (Some(teams), _) => entrants::find_by_names(app, "teams", teams).await?,
        (None, Some(stage)) => entrants::qualified_teams(app, stage).await?,
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
        .open_tournament(actor, &new_tournament, now)
        .await?;
    tracing::info!(
        tournament = %opened.name, id = %opened.id, teams = new_tournament.entrants.len(), "tournament opened"
    );
    Ok(opened)
}

/// Changes a tournament: its rules until the first round starts, everything else until it is closed.
#[boxed_future]
pub async fn change_tournament(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
    change: TournamentChange,
) -> Result<Tournament, Problem> {
    let current = app.store.tournament(id).await?;
    let rules = match change.rules {
        Some(fields) => Some(changed_rules(app, &current.rules, Some(fields)).await?),
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
        .change_tournament(actor, id, &tournament_change, now)
        .await?;
    tracing::info!(tournament = %changed.name, %id, "tournament changed");
    Ok(changed)
}

/// Pauses a tournament: no game starts; running ones continue.
#[boxed_future]
pub async fn pause_tournament(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
    reason: &str,
) -> Result<(), Problem> {
    let reason = checked_reason(reason)?;
    let now = app.config.clock.now();
    app.store.pause_tournament(actor, id, reason, now).await?;
    tracing::info!(tournament = %id, reason, "tournament paused");
    Ok(())
}

/// Resumes a paused tournament.
#[boxed_future]
pub async fn resume_tournament(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
) -> Result<(), Problem> {
    let now = app.config.clock.now();
    app.store.resume_tournament(actor, id, now).await?;
    tracing::info!(tournament = %id, "tournament resumed");
    Ok(())
}

/// Preview of closing a tournament.
#[boxed_future]
pub async fn preview_close(app: &AppState, id: TournamentId) -> Result<Preview, Problem> {
    let record = app.store.tournament_record(id).await?;
    let (tournament, rounds) = (record.tournament, record.rounds.len());
    let effect = format!(
        "the tournament {:?} will be closed for good, with {rounds} of {} rounds started. Recordings of its games will be \
         published according to its settings",
        tournament.name.as_str(),
        tournament.rules.format.last_round()
    );
    let name = tournament.name.to_string();
    Ok(Preview { name, effect })
}

/// Closes a tournament for good, if that is confirmed with its name: nothing of it can change any more.
#[boxed_future]
pub async fn close_tournament(
    app: &AppState,
    actor: Actor,
    id: TournamentId,
    confirm: Option<&str>,
) -> Result<(), Problem> {
    let preview = preview_close(app, id).await?;
    preview.check_confirmed(confirm)?;
    let now = app.config.clock.now();
    app.store.close_tournament(actor, id, now).await?;
    tracing::info!(tournament = %preview.name, %id, "tournament closed");
    Ok(())
}

/// A stage by its id, or by its name, ignoring case.
async fn find_stage(app: &AppState, text: &str) -> Result<Stage, Problem> {
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
    app: &AppState,
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
    check_season_magnitudes(app, &rules.perturbations).await?;
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
