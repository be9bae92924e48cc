//! Creating and changing stages. A *stage* is a part of the season with its own rules, board and daily evaluations. A change of the
//! rules of an open stage begins a new *revision*, with an empty board.

use crate::{app::AppState, boxed_future, problem::Problem, views::stage};
use faceoff_api::requests::{NewStage, OrNull, StagePatch};
use faceoff_store::{Actor, Stage, StagePhase};
use faceoff_types::{
    CountingResult, InvalidStageRules, Magnitudes, Retention, Runtimes, StageId, StageName,
    StageSettings,
};
use std::sync::Arc;

/// Parses the name of a stage, or of a tournament, whose names have the same rules.
pub fn parse_name(text: &str) -> Result<StageName, Problem> {
    text.parse()
        .map_err(|error| Problem::invalid("name", error))
}

fn invalid_rules(error: &InvalidStageRules) -> Problem {
    Problem::invalid(error.field(), error)
}

fn requested_runtimes(patch: &StagePatch) -> Option<&Runtimes> {
    let OrNull(runtimes) = patch.runtimes.as_ref()?;
    runtimes.as_ref()
}

/// Refuses runtimes (environments such as Python) that the server does not offer. `None` stands for all.
pub fn check_offered(app: &AppState, requested: Option<&Runtimes>) -> Result<(), Problem> {
    let Some(requested) = requested else {
        return Ok(());
    };
    requested
        .check()
        .map_err(|error| Problem::invalid("runtimes", error))?;
    let runtimes = &app.config.capacity.runtimes;
    match requested
        .names()
        .find(|name| !runtimes.iter().any(|offered| offered == name))
    {
        Some(name) => {
            let detail = format!(
                "expected runtimes that this server offers ({}), got {name:?}; null selects all",
                runtimes.join(", ")
            );
            Err(Problem::invalid("runtimes", detail))
        }
        None => Ok(()),
    }
}

/// Refuses magnitudes of perturbations with which this season cannot be played.
#[boxed_future]
pub async fn check_season_magnitudes(
    app: &AppState,
    magnitudes: &Magnitudes,
) -> Result<(), Problem> {
    let seed = app.store.season().await?.secret.model_mismatch();
    let simulator = Arc::clone(&app.config.simulator);
    let magnitudes = magnitudes.clone();
    let check = move || simulator.check_season_magnitudes(&magnitudes, seed);
    let checked = tokio::task::spawn_blocking(check)
        .await
        .map_err(Problem::internal)?;
    checked.map_err(|problem| Problem::invalid("perturbations", problem))
}

/// Creates a stage. Fields that are left out are copied from the open stage, or from the nearest one.
#[boxed_future]
pub async fn create_stage(app: &AppState, actor: Actor, new: NewStage) -> Result<Stage, Problem> {
    let template = stage::current(app).await?;
    let now = app.config.clock.now();
    let NewStage {
        name,
        settings: patch,
    } = new;
    check_offered(app, requested_runtimes(&patch))?;
    let mut rules = template.revision.rules;
    rules.ruleset = app.config.competition().ruleset();
    let mut settings = StageSettings {
        episodes_per_shard: template.settings.episodes_per_shard,
        uploads: template.settings.uploads,
        ..StageSettings::default()
    };
    patch
        .apply(
            &mut rules,
            &mut settings,
            app.config.competition().ruleset(),
        )
        .and_then(|()| {
            app.config
                .competition()
                .check_and_normalise_rules(&mut rules)
        })
        .map_err(|error| invalid_rules(&error))?;
    let retention = checked_retention(patch.retention)?.unwrap_or_default();
    check_season_magnitudes(app, &rules.variation.perturbations).await?;
    let new_stage = faceoff_store::NewStage {
        name: parse_name(&name)?,
        opens_at: patch.opens_at.unwrap_or(now),
        closes_at: patch.closes_at.and_then(|OrNull(at)| at),
        zone: patch.zone.unwrap_or(template.zone),
        rules,
        settings,
    };
    let created = app
        .store
        .create_stage_with_retention(actor, new_stage, retention, now)
        .await?;
    tracing::info!(stage = %created.name, id = %created.id, "stage created");
    Ok(created)
}

/// Changes a stage. A change that begins a new revision, reorders a board or removes files must be confirmed with the
/// stage's name.
#[boxed_future]
pub async fn change_stage(
    app: &AppState,
    actor: Actor,
    id: StageId,
    change: StagePatch,
) -> Result<Stage, Problem> {
    let stage = app.store.stage(id).await?;
    let now = app.config.clock.now();
    let current_rules = &stage.revision.rules;
    check_offered(app, requested_runtimes(&change))?;
    let mut rules = current_rules.clone();
    let mut settings = stage.settings.clone();
    change
        .apply(
            &mut rules,
            &mut settings,
            app.config.competition().ruleset(),
        )
        .and_then(|()| {
            app.config
                .competition()
                .check_and_normalise_rules(&mut rules)
        })
        .map_err(|error| invalid_rules(&error))?;
    let retention = checked_retention(change.retention)?;
    if rules.variation.perturbations != current_rules.variation.perturbations {
        check_season_magnitudes(app, &rules.variation.perturbations).await?;
    }
    let mut effects = Vec::new();
    if stage.phase(now) == StagePhase::Open {
        let new_revision = (rules != *current_rules).then(|| new_revision_effect(&stage));
        let reordering = (settings.counting_result != stage.settings.counting_result)
            .then(|| reordering_effect(&stage, settings.counting_result));
        effects.extend(new_revision.into_iter().chain(reordering));
    }
    if let Some(retention) = &retention {
        effects.extend(retention_effect(app, &stage, retention).await?);
    }
    check_confirmed(&stage, &effects, change.confirm.as_deref())?;
    let stage_change = faceoff_store::StageChange {
        name: change.name.as_deref().map(parse_name).transpose()?,
        opens_at: change.opens_at,
        closes_at: change.closes_at.map(|OrNull(at)| at),
        zone: change.zone,
        rules: Some(rules),
        settings: Some(settings),
        retention,
    };
    let changed = app.store.change_stage(actor, id, stage_change, now).await?;
    tracing::info!(stage = %changed.name, %id, revision = changed.revision.number, "stage changed");
    Ok(changed)
}

fn checked_retention(retention: Option<Retention>) -> Result<Option<Retention>, Problem> {
    if let Some(retention) = &retention {
        let checked = retention.check();
        checked.map_err(|error| Problem::invalid("retention", error))?;
    }
    Ok(retention)
}

/// Describes which files a new retention (how long a stage keeps datasets and bundles) would remove; `None` if none.
async fn retention_effect(
    app: &AppState,
    stage: &Stage,
    retention: &Retention,
) -> Result<Option<String>, Problem> {
    if app.store.stage_retention(stage.id).await? == *retention {
        return Ok(None);
    }
    let now = app.config.clock.now();
    let removal = app.store.preview_removal(stage.id, retention, now).await?;
    if removal.is_empty() {
        return Ok(None);
    }
    let unmeasured_clause = match removal.unmeasured {
        0 => String::new(),
        unmeasured => format!(", without {unmeasured} datasets that are not measured yet"),
    };
    let time_clause = match removal.next_removal_at {
        None => "at once".to_owned(),
        Some(at) => format!(
            "some of it not before {}",
            at.strftime("%Y-%m-%d at %H:%M UTC")
        ),
    };
    Ok(Some(format!(
        "the stage {:?} will keep {retention}; {} datasets of {} teams and {} bundles of submissions that are no longer \
         used ({} bytes{unmeasured_clause}) will be removed for good, {time_clause}, but only once nothing of the stage is running, \
         undecided or blind; results stay",
        stage.name.as_str(),
        removal.datasets,
        removal.teams,
        removal.bundles,
        removal.bytes
    )))
}

fn new_revision_effect(stage: &Stage) -> String {
    let number = stage.revision.number;
    format!(
        "the new rules will begin revision {} with an empty board; results of revision {number} stay on their own board; \
         this cannot be undone",
        number + 1
    )
}

fn reordering_effect(stage: &Stage, counting_result: CountingResult) -> String {
    format!(
        "the rows of its boards will be selected by {counting_result} instead of {}, at once, from all results",
        stage.settings.counting_result
    )
}

/// Refuses a change with these effects unless it is confirmed with the stage's name.
fn check_confirmed(
    stage: &Stage,
    effects: &[String],
    confirm: Option<&str>,
) -> Result<(), Problem> {
    if effects.is_empty() {
        return Ok(());
    }
    Problem::check_confirmed(confirm, stage.name.as_str(), &effects.join("; "))
}
