//! Making and changing a stage.

use crate::{app::AppState, boxed, problem::Problem, viewer::Viewer, views::stage};
use faceoff_api::{
    requests::{NewStage, StageChange},
    views::stage::StageView,
};
use faceoff_store::{Actor, Stage, StagePhase};
use faceoff_types::{
    MismatchSettings, PerturbationSettings, Retention, Ruleset, Runtimes, StageId, StageName,
    StageRules, StageSettings, Standings, Variation,
};

fn name(text: &str) -> Result<StageName, Problem> {
    text.parse()
        .map_err(|error| Problem::invalid("name", error))
}

fn check(rules: &StageRules, settings: &StageSettings) -> Result<(), Problem> {
    let checked = rules.check().and_then(|()| settings.check());
    checked.map_err(|error| Problem::invalid(error.field(), error))
}

/// Refuses runtimes that the server does not offer.
pub fn check_offered(app: &AppState, wanted: Option<&Runtimes>) -> Result<(), Problem> {
    let Some(wanted) = wanted else {
        return Ok(());
    };
    wanted
        .check()
        .map_err(|error| Problem::invalid("runtimes", error))?;
    let offered = &app.config.capacity.runtimes;
    match wanted
        .names()
        .find(|name| !offered.iter().any(|one| one == name))
    {
        Some(name) => {
            let detail = format!(
                "expected some of those that this server offers, {}, got {name:?}; null is all of them",
                offered.join(", ")
            );
            Err(Problem::invalid("runtimes", detail))
        }
        None => Ok(()),
    }
}

/// Refuses magnitudes that no robot of the season meets.
#[boxed]
pub async fn check_robot(app: &AppState, settings: &PerturbationSettings) -> Result<(), Problem> {
    if settings.model_mismatch == MismatchSettings::default() {
        return Ok(());
    }
    let seed = app.store.season().await?.secret.model_mismatch();
    let [least, most] = settings.model_mismatch.static_error_m;
    let settings = settings.clone();
    let has_robot = move || faceoff_dataset::has_robot(&settings, seed);
    if tokio::task::spawn_blocking(has_robot)
        .await
        .map_err(Problem::internal)?
    {
        return Ok(());
    }
    let detail = format!(
        "model_mismatch: of 300 robots drawn by these ranges of mass and gains none has its largest static error within \
         {least} to {most} m (static_error_m); widen one of them"
    );
    Err(Problem::invalid("perturbations", detail))
}

/// Makes a stage; what is left out is as in the stage that is open, or in the nearest.
#[boxed]
pub async fn create_stage(
    app: &AppState,
    actor: Actor,
    new: NewStage,
) -> Result<StageView, Problem> {
    let like = stage::current(app).await?;
    let now = app.config.clock.now();
    check_offered(app, new.runtimes.as_ref().and_then(Option::as_ref))?;
    let rules = StageRules {
        ruleset: Ruleset::CURRENT,
        profile: new.profile.unwrap_or(like.rules.rules.profile),
        tasks: new.tasks.unwrap_or(like.rules.rules.tasks),
        episodes_per_task: new
            .episodes_per_task
            .unwrap_or(like.rules.rules.episodes_per_task),
        max_faults: new.max_faults.unwrap_or(like.rules.rules.max_faults),
        variation: Variation {
            weights: new.weights.unwrap_or(like.rules.rules.variation.weights),
            tier_bounds: new
                .tier_bounds
                .unwrap_or(like.rules.rules.variation.tier_bounds),
            perturbations: new
                .perturbations
                .unwrap_or(like.rules.rules.variation.perturbations),
        },
        limits: new.limits.unwrap_or(like.rules.rules.limits),
        runtimes: new.runtimes.unwrap_or(like.rules.rules.runtimes),
    };
    let default = StageSettings::default();
    let settings = StageSettings {
        schedule: new.schedule,
        ablation_episodes: new.ablation_episodes.unwrap_or(0),
        episodes_per_shard: new
            .episodes_per_shard
            .unwrap_or(like.settings.episodes_per_shard),
        day_deadline: new.day_deadline.unwrap_or_default(),
        blind: new.blind.unwrap_or(default.blind),
        publishes: new.publishes.unwrap_or(default.publishes),
        standings: new.standings.unwrap_or(default.standings),
        uploads: new.uploads.unwrap_or(like.settings.uploads),
    };
    check(&rules, &settings)?;
    let retention = checked_retention(new.retention)?.unwrap_or_default();
    check_robot(app, &rules.variation.perturbations).await?;
    let wanted = faceoff_store::NewStage {
        name: name(&new.name)?,
        opens_at: new.opens_at.unwrap_or(now),
        closes_at: new.closes_at,
        zone: new.zone.unwrap_or(like.zone),
        rules,
        settings,
    };
    let made = app
        .store
        .create_stage_keeping(actor, wanted, retention, now)
        .await?;
    tracing::info!(stage = %made.name, id = %made.id, "stage made");
    let view = stage::of(app, made).await?;
    stage::seen_by(view, app, Viewer::Organiser).await
}

/// Changes a stage; what would begin its board anew, or remove something, is to be confirmed with its name.
#[boxed]
pub async fn change_stage(
    app: &AppState,
    actor: Actor,
    id: StageId,
    change: StageChange,
) -> Result<StageView, Problem> {
    let stage = app.store.stage(id).await?;
    let now = app.config.clock.now();
    let is = &stage.rules.rules;
    let other_rules = change.profile.is_some()
        || change.tasks.is_some()
        || change.episodes_per_task.is_some()
        || change.max_faults.is_some()
        || change.weights.is_some()
        || change.tier_bounds.is_some()
        || change.perturbations.is_some()
        || change.limits.is_some()
        || change.runtimes.is_some();
    check_offered(app, change.runtimes.as_ref().and_then(Option::as_ref))?;
    let rules = StageRules {
        // An upgrade of the program alone changes nothing of a stage.
        ruleset: if other_rules {
            Ruleset::CURRENT
        } else {
            is.ruleset
        },
        profile: change.profile.unwrap_or(is.profile),
        tasks: change.tasks.unwrap_or_else(|| is.tasks.clone()),
        episodes_per_task: change.episodes_per_task.unwrap_or(is.episodes_per_task),
        max_faults: change.max_faults.unwrap_or(is.max_faults),
        variation: Variation {
            weights: change.weights.unwrap_or(is.variation.weights),
            tier_bounds: change.tier_bounds.unwrap_or(is.variation.tier_bounds),
            perturbations: change
                .perturbations
                .unwrap_or_else(|| is.variation.perturbations.clone()),
        },
        limits: change.limits.unwrap_or_else(|| is.limits.clone()),
        runtimes: change.runtimes.unwrap_or_else(|| is.runtimes.clone()),
    };
    let settings = StageSettings {
        schedule: change
            .schedule
            .unwrap_or_else(|| stage.settings.schedule.clone()),
        ablation_episodes: change
            .ablation_episodes
            .unwrap_or(stage.settings.ablation_episodes),
        episodes_per_shard: change
            .episodes_per_shard
            .unwrap_or(stage.settings.episodes_per_shard),
        day_deadline: change.day_deadline.unwrap_or(stage.settings.day_deadline),
        blind: change.blind.unwrap_or(stage.settings.blind),
        publishes: change.publishes.unwrap_or(stage.settings.publishes),
        standings: change.standings.unwrap_or(stage.settings.standings),
        uploads: change.uploads.unwrap_or(stage.settings.uploads),
    };
    check(&rules, &settings)?;
    let retention = checked_retention(change.retention)?;
    if rules.variation.perturbations != is.variation.perturbations {
        check_robot(app, &rules.variation.perturbations).await?;
    }
    let mut told = Vec::new();
    if stage.phase(now) == StagePhase::Open {
        let other_rules = (rules != *is).then(|| begins_anew(&stage));
        let other_order = (settings.standings != stage.settings.standings)
            .then(|| ordered_anew(&stage, settings.standings));
        told.extend(other_rules.into_iter().chain(other_order));
    }
    if let Some(retention) = &retention {
        told.extend(removal(app, &stage, retention).await?);
    }
    check_confirmed(&stage, &told, change.confirm.as_deref())?;
    let wanted = faceoff_store::StageChange {
        name: change.name.as_deref().map(name).transpose()?,
        opens_at: change.opens_at,
        closes_at: change.closes_at,
        zone: change.zone,
        rules: Some(rules),
        settings: Some(settings),
        retention,
    };
    let changed = app.store.change_stage(actor, id, wanted, now).await?;
    tracing::info!(stage = %changed.name, %id, revision = changed.rules.number, "stage changed");
    let view = stage::of(app, changed).await?;
    stage::seen_by(view, app, Viewer::Organiser).await
}

fn checked_retention(retention: Option<Retention>) -> Result<Option<Retention>, Problem> {
    if let Some(retention) = &retention {
        let checked = retention.check();
        checked.map_err(|error| Problem::invalid("retention", error))?;
    }
    Ok(retention)
}

/// What would go by another retention, in words.
async fn removal(
    app: &AppState,
    stage: &Stage,
    retention: &Retention,
) -> Result<Option<String>, Problem> {
    if app.store.stage_retention(stage.id).await? == *retention {
        return Ok(None);
    }
    let now = app.config.clock.now();
    let removed = app.store.would_remove(stage.id, retention, now).await?;
    if removed.is_nothing() {
        return Ok(None);
    }
    let unmeasured = match removed.unmeasured {
        0 => String::new(),
        unmeasured => format!(", and {unmeasured} datasets that are not measured yet"),
    };
    let when = match removed.not_before {
        None => "at once".to_owned(),
        Some(at) => format!(
            "some of it not before {}",
            at.strftime("%Y-%m-%d at %H:%M UTC")
        ),
    };
    Ok(Some(format!(
        "of the stage {:?}, {retention} would be kept; {} datasets of {} teams and {} archives of submissions that nobody \
         plays any more ({} bytes{unmeasured}) would be removed for good, {when} or when nothing of the stage is under way, \
         to be decided, or blind; results stay",
        stage.name.as_str(),
        removed.datasets,
        removed.teams,
        removed.archives,
        removed.bytes
    )))
}

fn begins_anew(stage: &Stage) -> String {
    let number = stage.rules.number;
    format!(
        "other rules begin revision {} with an empty board, what was played by revision {number} stays on its own, and \
         neither can be undone",
        number + 1
    )
}

fn ordered_anew(stage: &Stage, standings: Standings) -> String {
    format!(
        "the rows of its boards would be made by {standings} in place of {}, at once, of all that was played",
        stage.settings.standings
    )
}

/// Refuses what would change an open stage's boards, or remove something, unless the stage is named.
fn check_confirmed(stage: &Stage, told: &[String], confirm: Option<&str>) -> Result<(), Problem> {
    if told.is_empty() {
        return Ok(());
    }
    Problem::check_confirmed(confirm, stage.name.as_str(), &told.join("; "))
}
