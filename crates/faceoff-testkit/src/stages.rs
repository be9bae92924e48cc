//! Plans of runs, and stages that have them.

use faceoff_airhockey::{DEFEND, EVALUATION, HIT, PREPARE};
use faceoff_store::{Actor, RunPlan, Stage, StageChange, Store, StoreError};
use faceoff_types::{IanaTimeZone, Schedule, StageId, StageRules, StageSettings};
use jiff::Timestamp;

/// 3 tasks of 4 episodes in shards of 2 episodes. 3 agent faults are allowed.
pub fn six_shard_plan() -> RunPlan {
    RunPlan {
        profile: EVALUATION,
        tasks: vec![HIT, DEFEND, PREPARE],
        episodes_per_task: 4,
        episodes_per_shard: 2,
        max_faults: 3,
        variation: Default::default(),
        limits: Default::default(),
    }
}

/// 4 episodes of one task in shards of 2 episodes.
pub fn two_shard_plan() -> RunPlan {
    RunPlan {
        tasks: vec![HIT],
        ..six_shard_plan()
    }
}

/// One shard of one episode.
pub fn one_shard_plan() -> RunPlan {
    RunPlan {
        episodes_per_task: 1,
        ..two_shard_plan()
    }
}

/// Rules and settings of a stage with this plan.
pub fn rules_and_settings(plan: &RunPlan) -> (StageRules, StageSettings) {
    let rules = StageRules {
        runtimes: None,
        ruleset: faceoff_airhockey::RULESET,
        profile: plan.profile,
        tasks: plan.tasks.clone(),
        episodes_per_task: plan.episodes_per_task,
        max_faults: plan.max_faults,
        variation: plan.variation.clone(),
        limits: plan.limits.clone(),
    };
    let settings = StageSettings {
        episodes_per_shard: plan.episodes_per_shard,
        ..StageSettings::default()
    };
    (rules, settings)
}

/// Configures the season's first stage with this plan. Returns its id.
pub async fn configure_stage(
    store: &Store,
    plan: &RunPlan,
    schedule: Option<Schedule>,
    now: Timestamp,
) -> StageId {
    let (rules, settings) = rules_and_settings(plan);
    let settings = StageSettings {
        schedule,
        ..settings
    };
    store
        .configure_stage(rules, settings, IanaTimeZone::UTC, now)
        .await
        .unwrap();
    store.stages().await.unwrap()[0].id
}

/// Changes the rules of a stage.
///
/// # Errors
/// Those of [`Store::change_stage`].
pub async fn change_rules(
    store: &Store,
    stage: StageId,
    now: Timestamp,
    change: impl FnOnce(&mut StageRules),
) -> Result<Stage, StoreError> {
    let mut rules = store.stage(stage).await?.revision.rules;
    change(&mut rules);
    let change = StageChange {
        rules: Some(rules),
        ..StageChange::default()
    };
    store
        .change_stage(Actor::Operator, stage, change, now)
        .await
}

/// Changes the settings of a stage.
///
/// # Errors
/// Those of [`Store::change_stage`].
pub async fn change_settings(
    store: &Store,
    stage: StageId,
    now: Timestamp,
    change: impl FnOnce(&mut StageSettings),
) -> Result<Stage, StoreError> {
    let mut settings = store.stage(stage).await?.settings;
    change(&mut settings);
    let change = StageChange {
        settings: Some(settings),
        ..StageChange::default()
    };
    store
        .change_stage(Actor::Operator, stage, change, now)
        .await
}

/// Lets a stage accept only agents of these runtimes; `None` accepts all.
pub async fn accept_runtimes(
    store: &Store,
    stage: StageId,
    runtimes: Option<&[&str]>,
    now: Timestamp,
) {
    let runtimes = runtimes.map(|names| names.iter().map(ToString::to_string).collect());
    change_rules(store, stage, now, |rules| rules.runtimes = runtimes)
        .await
        .unwrap();
}
