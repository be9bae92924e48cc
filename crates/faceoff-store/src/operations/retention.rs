//! What is kept of a stage's large files: said by the organiser, applied by the server by its clock.

use crate::{
    boxed,
    error::{Result, StoreError},
    event::{Actor, Event, Subject},
    operations::tidy::RECORDINGS_KEPT,
    store::Store,
    tables::{
        bundles, days, finalised,
        retentions::{self, Scored},
        season,
        stages::{self, Stage, StagePhase},
    },
    write::Tx,
};
use faceoff_types::{EvaluationId, Retention, StageId, SubmissionId, TeamId};
use jiff::{SignedDuration, Timestamp};
use sqlx::SqliteConnection;
use std::collections::{BTreeMap, BTreeSet};

/// For how long the file of what was removed stays where it is: as [`RECORDINGS_KEPT`], for the backup whose database
/// still names it.
pub const FILES_KEPT: SignedDuration = RECORDINGS_KEPT;

/// How much goes, or has gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Removed {
    pub datasets: u32,
    /// Of so many teams.
    pub teams: u32,
    /// Archives of submissions that nobody plays any more.
    pub archives: u32,
    /// All of them together, as far as they were measured.
    pub bytes: u64,
    /// Datasets among them whose size nobody has measured yet.
    pub unmeasured: u32,
    /// Some of it goes only from then on; `None`: nothing of it waits for a date.
    pub not_before: Option<Timestamp>,
}

impl Removed {
    #[must_use]
    pub const fn is_nothing(&self) -> bool {
        self.datasets == 0 && self.archives == 0
    }
}

/// What goes by a retention, and why.
#[derive(Debug, Default)]
struct Plan {
    reason: String,
    datasets: Vec<EvaluationId>,
    archives: Vec<SubmissionId>,
    removed: Removed,
}

/// Until when a stage that was signed off is kept by that, where its retention goes by it.
fn kept_after_sign_off(retention: &Retention, stage: &Stage) -> Option<Timestamp> {
    let at = stage.finalised.as_ref()?.at;
    let kept = SignedDuration::from_hours(24 * i64::from(retention.days_after_sign_off?));
    at.saturating_add(kept).ok()
}

/// Has the time come from which on nothing of a stage is kept?
fn has_ended(retention: &Retention, stage: &Stage, is_over: bool, now: Timestamp) -> bool {
    let by_date = retention.until.is_some_and(|until| until <= now);
    let by_sign_off = kept_after_sign_off(retention, stage).is_some_and(|until| until <= now);
    by_date && is_over || by_sign_off
}

/// Does somebody still need all of a stage? While something of it is under way or to be decided, results may change,
/// and while it is blind no team could have taken its datasets home.
async fn is_needed(connection: &mut SqliteConnection, stage: &Stage) -> Result<bool> {
    Ok(stage.settings.blind
        || finalised::count_open(connection, stage.id).await? > 0
        || !days::unreleased(connection, stage.id).await?.is_empty()
        || retentions::count_proposals(connection, stage.id).await? > 0)
}

/// Which of a team's, the newest first, are beyond its last so many that count, and not its best by their rules.
fn beyond_last(of_team: &[Scored], last: u32) -> Vec<&Scored> {
    let mut best: BTreeMap<u32, &Scored> = BTreeMap::new();
    for one in of_team.iter().filter(|one| one.counts) {
        let standing = best.entry(one.revision).or_insert(one);
        if one.board_order(standing).is_lt() {
            *standing = one;
        }
    }
    let is_best = |one: &Scored| {
        one.counts
            && best
                .get(&one.revision)
                .is_some_and(|best| best.id == one.id)
    };
    let mut newer = 0;
    let mut beyond = Vec::new();
    for one in of_team {
        if newer >= last && !is_best(one) {
            beyond.push(one);
        }
        newer += u32::from(one.counts);
    }
    beyond
}

/// What goes, if nobody needs all of the stage.
async fn plan(
    connection: &mut SqliteConnection,
    stage: &Stage,
    retention: &Retention,
    now: Timestamp,
) -> Result<Plan> {
    if retention.keeps_all() {
        return Ok(Plan::default());
    }
    let is_over = stage.phase(now) == StagePhase::Closed
        || season::read(connection).await?.closed_at.is_some();
    let ended = has_ended(retention, stage, is_over, now);
    let scored = retentions::scored(connection, stage.id).await?;
    let going: Vec<&Scored> = match retention.last {
        _ if ended => scored.iter().collect(),
        Some(last) => scored
            .chunk_by(|one, other| one.team == other.team)
            .flat_map(|of_team| beyond_last(of_team, last))
            .collect(),
        None => return Ok(Plan::default()),
    };
    let is_going = |one: &&&Scored| one.is_kept && !one.is_evidence;
    let going: Vec<&Scored> = going.iter().filter(is_going).copied().collect();
    let datasets: Vec<EvaluationId> = going.iter().map(|one| one.id).collect();
    let archives = retentions::idle_archives(connection, stage.id, &datasets).await?;
    let teams: BTreeSet<TeamId> = going.iter().map(|one| one.team).collect();
    let count = |len: usize| u32::try_from(len).unwrap_or(u32::MAX);
    let bytes_of_archives = archives.iter().map(|(_, bytes)| bytes).sum::<u64>();
    Ok(Plan {
        reason: format!(
            "by the retention of the stage {:?}, which keeps {retention}",
            stage.name.as_str()
        ),
        removed: Removed {
            datasets: count(datasets.len()),
            teams: count(teams.len()),
            archives: count(archives.len()),
            bytes: going.iter().filter_map(|one| one.bytes).sum::<u64>() + bytes_of_archives,
            unmeasured: count(going.iter().filter(|one| one.bytes.is_none()).count()),
            not_before: None,
        },
        datasets,
        archives: archives.into_iter().map(|(id, _)| id).collect(),
    })
}

/// Gives a stage another retention, also when it is signed off: nothing of its result depends on it.
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
    /// What a stage keeps.
    #[boxed]
    pub async fn stage_retention(&self, stage: StageId) -> Result<Retention> {
        retentions::of_stage(&mut *self.database.read.acquire().await?, stage).await
    }

    /// What would go of a stage if it had this retention, of what is there at `now`: at once or as soon as nothing of it is
    /// under way, to be decided, or blind; and what goes later by a date that is known.
    #[boxed]
    pub async fn would_remove(
        &self,
        stage: StageId,
        retention: &Retention,
        now: Timestamp,
    ) -> Result<Removed> {
        let mut connection = self.database.read.acquire().await?;
        let stage = stages::find(&mut connection, stage).await?;
        let at_once = plan(&mut connection, &stage, retention, now).await?.removed;
        let dates = [retention.until, kept_after_sign_off(retention, &stage)];
        let Some(later) = dates.into_iter().flatten().filter(|at| *at > now).min() else {
            return Ok(at_once);
        };
        let in_all = plan(&mut connection, &stage, retention, later).await?;
        let not_before = (in_all.removed != at_once).then_some(later);
        Ok(Removed {
            not_before,
            ..in_all.removed
        })
    }

    /// Has go what the stages' retentions do not keep: first nobody is promised it any more, with the reason, and
    /// [`FILES_KEPT`] later its files are removed. How much is no longer promised. Run it now and then; a kill half way is
    /// made up for by the next call.
    #[boxed]
    pub async fn apply_retentions(&self, now: Timestamp) -> Result<Removed> {
        let mut all = Removed::default();
        let mut connection = self.database.read.acquire().await?;
        let bounded = retentions::bounded(&mut connection).await?;
        let mut due = Vec::new();
        for id in bounded {
            let stage = stages::find(&mut connection, id).await?;
            if is_needed(&mut connection, &stage).await? {
                continue;
            }
            let retention = retentions::of_stage(&mut connection, id).await?;
            let plan = plan(&mut connection, &stage, &retention, now).await?;
            if !plan.removed.is_nothing() {
                due.push(id);
            }
        }
        drop(connection);
        for id in due {
            let removed = self
                .write(Actor::Server, now, async |tx| take_away(tx, id).await)
                .await?;
            all.datasets += removed.datasets;
            all.teams += removed.teams;
            all.archives += removed.archives;
            all.bytes += removed.bytes;
            all.unmeasured += removed.unmeasured;
        }
        self.remove_files_of_removed(now).await?;
        Ok(all)
    }

    /// Removes the files that nobody has been promised for [`FILES_KEPT`]: datasets that a retention took, archives that
    /// it or somebody's wish took; none that have become evidence meanwhile. How many.
    #[boxed]
    pub async fn remove_files_of_removed(&self, now: Timestamp) -> Result<usize> {
        let before = now.saturating_sub(FILES_KEPT).unwrap_or(Timestamp::MIN);
        let mut connection = self.database.read.acquire().await?;
        let datasets = retentions::datasets_going(&mut connection, before).await?;
        let archives = bundles::going(&mut connection, before).await?;
        drop(connection);
        for (id, key) in &datasets {
            self.artifacts().delete_dataset(key).await?;
            self.write(Actor::Server, now, async |tx| {
                retentions::set_dataset_gone(tx, *id).await
            })
            .await?;
        }
        for (id, key) in &archives {
            self.artifacts().delete(key).await?;
            self.write(Actor::Server, now, async |tx| {
                bundles::set_gone(tx, *id).await
            })
            .await?;
        }
        Ok(datasets.len() + archives.len())
    }

    /// Measures the datasets that were stored before their sizes were noted. How many.
    #[boxed]
    pub async fn measure_datasets(&self, now: Timestamp) -> Result<usize> {
        let mut connection = self.database.read.acquire().await?;
        let unmeasured = retentions::unmeasured(&mut connection).await?;
        drop(connection);
        for (id, key) in &unmeasured {
            // One that is lost takes no room.
            let bytes = self.artifacts().bytes_of(key).await?.unwrap_or(0);
            self.write(Actor::Server, now, async |tx| {
                retentions::set_measured(tx, *id, bytes).await
            })
            .await?;
        }
        Ok(unmeasured.len())
    }
}

/// Marks what is to go as removed. It is looked for again: since the last look something may have changed.
async fn take_away(tx: &mut Tx, id: StageId) -> Result<Removed> {
    let now = tx.now;
    let stage = stages::find(tx, id).await?;
    if is_needed(tx, &stage).await? {
        return Ok(Removed::default());
    }
    let retention = retentions::of_stage(tx, id).await?;
    let plan = plan(tx, &stage, &retention, now).await?;
    let reason = plan.reason;
    for id in plan.datasets {
        retentions::set_dataset_removed(tx, id, &reason, now).await?;
        let reason = reason.clone();
        tx.record(Subject::Evaluation(id), Event::DatasetRemoved { reason });
    }
    for id in plan.archives {
        bundles::remove(tx, id, &reason, now).await?;
        let reason = reason.clone();
        tx.record(Subject::Submission(id), Event::ArchiveRemoved { reason });
    }
    Ok(plan.removed)
}
