//! Retention of a stage's large files (datasets and bundles): the organiser sets how long they are kept, and the server
//! removes them automatically afterwards.

use crate::{
    boxed_future,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::cleanup::{RECORDINGS_KEPT_FOR, earlier},
    store::Store,
    tables::{
        bundles, days,
        retentions::{self, ScoredEvaluation},
        season, sign_offs,
        stages::{self, Stage, StagePhase},
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, Retention, StageId, SubmissionId, TeamId};
use jiff::{SignedDuration, Timestamp};
use sqlx::SqliteConnection;
use std::collections::{BTreeMap, BTreeSet};

/// Time between the removal of a dataset or bundle and the deletion of its file: as [`RECORDINGS_KEPT_FOR`], for a
/// backup whose database still refers to it.
pub const FILES_KEPT_FOR: SignedDuration = RECORDINGS_KEPT_FOR;

/// Number and size of the files that a retention removes or has removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RemovalSummary {
    /// Number of datasets.
    pub datasets: u32,
    /// Number of teams that these datasets belong to. In the sum of several stages a team counts once for each.
    pub teams: u32,
    /// Number of bundles of submissions that are not used any more.
    pub bundles: u32,
    /// Total size of the measured datasets and bundles.
    pub bytes: u64,
    /// Number of datasets whose size has not been measured yet.
    pub unmeasured: u32,
    /// When files that are kept until a date will be removed; `None` if there are no such files.
    pub next_removal_at: Option<Timestamp>,
}

impl RemovalSummary {
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.datasets == 0 && self.bundles == 0
    }
}

/// Files that a retention removes, and the reason shown for it.
#[derive(Debug, Default)]
struct RemovalPlan {
    reason: String,
    datasets: Vec<EvaluationId>,
    bundles: Vec<SubmissionId>,
    removed: RemovalSummary,
}

/// End of the period after sign-off for which the retention keeps the files of a stage.
fn sign_off_period_end(retention: &Retention, stage: &Stage) -> Option<Timestamp> {
    let signed_off_at = stage.sign_off.as_ref()?.signed_off_at;
    let period = SignedDuration::from_hours(24 * i64::from(retention.days_after_sign_off?));
    signed_off_at.saturating_add(period).ok()
}

/// Is the period over for which the retention keeps the stage's files? A retention until a date keeps them also while the stage is
/// not over.
fn has_ended(retention: &Retention, stage: &Stage, is_stage_over: bool, now: Timestamp) -> bool {
    let is_date_past = retention.until.is_some_and(|until| until <= now);
    let is_sign_off_period_past =
        sign_off_period_end(retention, stage).is_some_and(|end| end <= now);
    is_date_past && is_stage_over || is_sign_off_period_past
}

/// Are all files of a stage still needed? Results can change while evaluations, days or proposals are open,
/// and while the stage is blind no team can have downloaded its datasets.
async fn is_in_use(connection: &mut SqliteConnection, stage: &Stage) -> Result<bool> {
    Ok(stage.settings.blind
        || sign_offs::count_open(connection, stage.id).await? > 0
        || !days::unreleased(connection, stage.id).await?.is_empty()
        || retentions::count_proposals(connection, stage.id).await? > 0)
}

/// Evaluations of a team that are older than its `kept_count` newest counting ones, without its best one of each revision
/// of the rules. `evaluations` has the newest first.
fn older_than_newest(evaluations: &[ScoredEvaluation], kept_count: u32) -> Vec<&ScoredEvaluation> {
    let mut best: BTreeMap<u32, &ScoredEvaluation> = BTreeMap::new();
    for evaluation in evaluations.iter().filter(|evaluation| evaluation.counts) {
        let best_so_far = best.entry(evaluation.revision).or_insert(evaluation);
        if evaluation.compare_rank(best_so_far).is_lt() {
            *best_so_far = evaluation;
        }
    }
    let is_best = |evaluation: &ScoredEvaluation| {
        evaluation.counts
            && best
                .get(&evaluation.revision)
                .is_some_and(|best| best.id == evaluation.id)
    };
    let mut newer_counting = 0;
    let mut older = Vec::new();
    for evaluation in evaluations {
        if newer_counting >= kept_count && !is_best(evaluation) {
            older.push(evaluation);
        }
        newer_counting += u32::from(evaluation.counts);
    }
    older
}

/// Files that the retention removes at `now`, provided that the stage is not [in use](is_in_use).
async fn plan_removal(
    connection: &mut SqliteConnection,
    stage: &Stage,
    retention: &Retention,
    now: Timestamp,
) -> Result<RemovalPlan> {
    if retention.keeps_all() {
        return Ok(RemovalPlan::default());
    }
    let is_stage_over = stage.phase(now) == StagePhase::Closed
        || season::read(connection).await?.closed_at.is_some();
    let ended = has_ended(retention, stage, is_stage_over, now);
    let scored = retentions::scored_evaluations(connection, stage.id).await?;
    let removable: Vec<&ScoredEvaluation> = match retention.last {
        _ if ended => scored.iter().collect(),
        Some(kept_count) => scored
            .chunk_by(|first, second| first.team == second.team)
            .flat_map(|evaluations| older_than_newest(evaluations, kept_count))
            .collect(),
        None => return Ok(RemovalPlan::default()),
    };
    let is_removable =
        |evaluation: &&&ScoredEvaluation| evaluation.has_dataset && !evaluation.is_evidence;
    let removable: Vec<&ScoredEvaluation> =
        removable.iter().filter(is_removable).copied().collect();
    let datasets: Vec<EvaluationId> = removable.iter().map(|evaluation| evaluation.id).collect();
    let bundles = retentions::idle_bundles(connection, stage.id, &datasets).await?;
    let teams: BTreeSet<TeamId> = removable.iter().map(|evaluation| evaluation.team).collect();
    let count = |len: usize| u32::try_from(len).unwrap_or(u32::MAX);
    let bundle_bytes = bundles.iter().map(|(_, bytes)| bytes).sum::<u64>();
    Ok(RemovalPlan {
        reason: format!(
            "by the retention of the stage {:?}, which keeps {retention}",
            stage.name.as_str()
        ),
        removed: RemovalSummary {
            datasets: count(datasets.len()),
            teams: count(teams.len()),
            bundles: count(bundles.len()),
            bytes: removable
                .iter()
                .filter_map(|evaluation| evaluation.bytes)
                .sum::<u64>()
                + bundle_bytes,
            unmeasured: count(
                removable
                    .iter()
                    .filter(|evaluation| evaluation.bytes.is_none())
                    .count(),
            ),
            next_removal_at: None,
        },
        datasets,
        bundles: bundles.into_iter().map(|(id, _)| id).collect(),
    })
}

/// Changes a stage's retention. Allowed after sign-off too, since no result depends on it.
pub(super) async fn change(tx: &mut Tx, stage: StageId, retention: Retention) -> Result<()> {
    retention
        .check()
        .map_err(|error| StoreError::Conflict(format!("retention: {error}")))?;
    if retentions::of_stage(tx, stage).await? == retention {
        return Ok(());
    }
    retentions::set(tx, stage, &retention).await?;
    tx.record(
        Subject::Stage(stage),
        Event::StageRetentionChanged { retention },
    );
    Ok(())
}

impl Store {
    #[boxed_future]
    pub async fn stage_retention(&self, stage: StageId) -> Result<Retention> {
        retentions::of_stage(&mut *self.database.read.acquire().await?, stage).await
    }

    /// Preview, as of `now`, of the files that this retention would remove from a stage: immediately (or once nothing of
    /// the stage is open, undecided or blind), and on a known date.
    #[boxed_future]
    pub async fn preview_removal(
        &self,
        stage: StageId,
        retention: &Retention,
        now: Timestamp,
    ) -> Result<RemovalSummary> {
        let mut connection = self.database.read.acquire().await?;
        let stage = stages::find(&mut connection, stage).await?;
        let immediate = plan_removal(&mut connection, &stage, retention, now)
            .await?
            .removed;
        let end_dates = [retention.until, sign_off_period_end(retention, &stage)];
        let Some(next_date) = end_dates.into_iter().flatten().filter(|at| *at > now).min() else {
            return Ok(immediate);
        };
        let at_next_date = plan_removal(&mut connection, &stage, retention, next_date).await?;
        let next_removal_at = (at_next_date.removed != immediate).then_some(next_date);
        Ok(RemovalSummary {
            next_removal_at,
            ..at_next_date.removed
        })
    }

    /// Applies the retentions of all stages. Datasets and bundles are first marked as removed, with the reason; their
    /// files are deleted [`FILES_KEPT_FOR`] later. Returns a summary of the marked files. To be called periodically; an interrupted call
    /// is completed by the next one.
    #[boxed_future]
    pub async fn apply_retentions(&self, now: Timestamp) -> Result<RemovalSummary> {
        let mut total = RemovalSummary::default();
        let mut connection = self.database.read.acquire().await?;
        let stages_with_removals = retentions::stages_with_removals(&mut connection).await?;
        let mut due_stages = Vec::new();
        for id in stages_with_removals {
            let stage = stages::find(&mut connection, id).await?;
            if is_in_use(&mut connection, &stage).await? {
                continue;
            }
            let retention = retentions::of_stage(&mut connection, id).await?;
            let plan = plan_removal(&mut connection, &stage, &retention, now).await?;
            if !plan.removed.is_empty() {
                due_stages.push(id);
            }
        }
        drop(connection);
        for id in due_stages {
            let removed = self
                .write(Actor::Server, now, async |tx| mark_removed(tx, id).await)
                .await?;
            total.datasets += removed.datasets;
            total.teams += removed.teams;
            total.bundles += removed.bundles;
            total.bytes += removed.bytes;
            total.unmeasured += removed.unmeasured;
        }
        self.remove_files_of_removed(now).await?;
        Ok(total)
    }

    /// Deletes the files of datasets and bundles that were removed at least [`FILES_KEPT_FOR`] ago, by a retention or on
    /// request. Evidence is kept. Returns the number of deleted files.
    #[boxed_future]
    pub async fn remove_files_of_removed(&self, now: Timestamp) -> Result<usize> {
        let removed_until = earlier(now, FILES_KEPT_FOR);
        let mut connection = self.database.read.acquire().await?;
        let datasets = retentions::deletable_datasets(&mut connection, removed_until).await?;
        let bundles = bundles::deletable(&mut connection, removed_until).await?;
        drop(connection);
        for (id, key) in &datasets {
            self.artifacts().delete_dataset(key).await?;
            self.write(Actor::Server, now, async |tx| {
                retentions::set_dataset_file_deleted(tx, *id).await
            })
            .await?;
        }
        for (id, key) in &bundles {
            self.artifacts().delete(key).await?;
            self.write(Actor::Server, now, async |tx| {
                bundles::set_file_deleted(tx, *id).await
            })
            .await?;
        }
        Ok(datasets.len() + bundles.len())
    }

    /// Measures datasets stored by versions that did not record sizes. Returns the number of datasets.
    #[boxed_future]
    pub async fn measure_datasets(&self, now: Timestamp) -> Result<usize> {
        let mut connection = self.database.read.acquire().await?;
        let unmeasured = retentions::unmeasured(&mut connection).await?;
        drop(connection);
        for (id, key) in &unmeasured {
            // A lost dataset takes no space.
            let bytes = self.artifacts().size_bytes(key).await?.unwrap_or(0);
            self.write(Actor::Server, now, async |tx| {
                retentions::set_dataset_bytes(tx, *id, bytes).await
            })
            .await?;
        }
        Ok(unmeasured.len())
    }
}

/// Marks datasets and bundles of a stage as removed. The plan is made again, since the stage may have changed
/// meanwhile.
async fn mark_removed(tx: &mut Tx, id: StageId) -> Result<RemovalSummary> {
    let now = tx.now;
    let stage = stages::find(tx, id).await?;
    if is_in_use(tx, &stage).await? {
        return Ok(RemovalSummary::default());
    }
    let retention = retentions::of_stage(tx, id).await?;
    let plan = plan_removal(tx, &stage, &retention, now).await?;
    let reason = plan.reason;
    for id in plan.datasets {
        retentions::set_dataset_removed(tx, id, &reason, now).await?;
        let reason = reason.clone();
        tx.record(Subject::Evaluation(id), Event::DatasetRemoved { reason });
    }
    for id in plan.bundles {
        bundles::set_removed(tx, id, &reason, now).await?;
        let reason = reason.clone();
        tx.record(Subject::Submission(id), Event::BundleRemoved { reason });
    }
    Ok(plan.removed)
}
