//! Who stands where, and how sure that is.

use super::{ruling::RulingView, stage, task::TaskView, team::TeamView};
use crate::{
    app::AppState, problem::Problem, requests::BoardQuery, summaries::RunSummaries, views::shown,
};
use faceoff_scoring::{
    BoardEntry, Played, RankedEntry, SIGNIFICANCE, TIER_CHANGE_RESAMPLES, overall_board,
    rank_groups, task_board,
};
use faceoff_store::{BoardRecord, BoardScope, Stage};
use faceoff_types::{
    EvaluationId, Profile, Seed, StageId, StageName, Task, TeamId, TeamName, Tier,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// A board: each team's newest evaluation of a stage that is finished under one revision of its rules, in board
/// order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoardView {
    /// Whose it is.
    pub stage: StageId,
    /// As the organiser named it.
    pub stage_name: StageName,
    /// By which of the stage's rules the rows were played; no board mixes two.
    pub revision: u32,
    /// Since when those were the stage's.
    pub since: Timestamp,
    /// The simulator and the scoring that the scores refer to.
    #[schema(example = "airhockey-2023.2")]
    pub ruleset: String,
    /// The task, or null for the overall board.
    pub task: Option<Task>,
    /// The level at which teams are told apart: rows of one rank group stand in the same tier and
    /// cannot be told from the group's first row.
    #[schema(example = 0.05)]
    pub significance: f64,
    /// Bootstrap resamples behind each `tier_change_probability`.
    #[schema(example = 2000)]
    pub tier_change_resamples: u32,
    /// The board shows what it showed then: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<RulingView>,
    /// Teams that are on no board, and why.
    pub disqualified: Vec<TeamView>,
    /// Deployable teams first, then improvable, then non-deployable; inside a tier the higher score,
    /// then the fewer penalty points, then the earlier submission.
    pub rows: Vec<BoardRow>,
}

/// One team on a board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoardRow {
    /// Place on the whole board, from 1.
    pub rank: u32,
    /// Teams of one group cannot be told from the group's first; from 1 down the board.
    pub rank_group: u32,
    /// The overall one, or the task's.
    pub tier: Tier,
    /// Probability that other episodes of the same kind would give another tier.
    pub tier_change_probability: f64,
    /// The team's name.
    pub team: TeamName,
    /// Stays when names change.
    pub team_id: TeamId,
    /// The agent's own name.
    pub agent: Option<String>,
    /// The newest that the team finished.
    pub evaluation: EvaluationId,
    /// The date, in the stage's zone, whose episodes it played.
    pub day: Date,
    /// It is a turn beside the day's own, and why; absent otherwise. Given after the day's release it played other
    /// episodes than the other rows of the day.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub extra_turn: Option<String>,
    /// When its score was published.
    pub finished_at: Timestamp,
    /// The rules that it was scored by.
    pub ruleset: String,
    /// The perturbations.
    pub profile: Profile,
    /// Overall score in percent.
    pub score: f64,
    /// Overall penalty points: the maximum over the tasks.
    pub penalty_points: f64,
    /// When the day's last evaluation had ended, and all of the day came out; null until then.
    pub released_at: Option<Timestamp>,
    /// The seed of the day's evaluations; null until the day is released.
    pub seed: Option<Seed>,
    /// Results by task: hit, defend, prepare.
    pub tasks: BTreeMap<Task, TaskView>,
}

impl BoardView {
    /// The board that a request asks for: the overall one, or that of one task. Whether the caller may see the live
    /// one of a frozen stage is checked before.
    pub(crate) async fn asked(
        app: &AppState,
        query: BoardQuery,
        task: Option<Task>,
    ) -> Result<Self, Problem> {
        let stage = match query.stage {
            Some(id) => app.store.stage(id).await?,
            None => stage::current(app).await?,
        };
        let frozen = app.store.boards_frozen(stage.id).await?;
        let scope = BoardScope {
            until: frozen
                .as_ref()
                .filter(|_| !query.live)
                .map(|frozen| frozen.at),
            ..BoardScope::default()
        };
        let revision = match query.revision {
            Some(number) => number,
            None => app.store.board_revision_until(&stage, scope.until).await?,
        };
        let records = app.store.board_within(stage.id, revision, &scope).await?;
        let board = Self::of(app, &stage, revision, task, records).await?;
        Ok(Self {
            frozen: frozen.map(RulingView::from),
            ..board
        })
    }

    /// These records of a stage by one revision of its rules, ranked by all tasks or by one. A constant number of
    /// reads, however many teams there are.
    pub(crate) async fn of(
        app: &AppState,
        stage: &Stage,
        number: u32,
        task: Option<Task>,
        records: Vec<BoardRecord>,
    ) -> Result<Self, Problem> {
        let mut revisions = app.store.stage_revisions(stage.id).await?.into_iter();
        let Some(revision) = revisions.find(|revision| revision.number == number) else {
            return Err(Problem::not_found("revision of the stage's rules"));
        };
        let mut disqualified = TeamView::all(app).await?;
        disqualified.retain(|team| team.disqualified.is_some());
        let runs: Vec<_> = records.iter().map(|record| record.run).collect();
        let summaries = app.summaries.of(&runs).await?;
        let mismatch_seed = app.store.season().await?.secret.model_mismatch();

        let entries = records.into_iter().map(|record| BoardEntry {
            result: record.result.clone(),
            submitted_at_ms: record.submitted_at.as_millisecond(),
            key: record,
        });
        let ranked = match task {
            None => overall_board(entries.collect()),
            Some(task) => task_board(task, entries.collect()),
        };
        let groups = rank_groups(&ranked, |leader, row| {
            let leader = played(leader, &summaries, mismatch_seed)?;
            Ok::<_, Problem>(leader.told_apart(&played(row, &summaries, mismatch_seed)?, task))
        })?;
        let rows = ranked.into_iter().zip(groups).map(|(ranked, rank_group)| {
            let summary = played(&ranked.entry.key, &summaries, mismatch_seed)?.summary;
            let tier_change_probability = summary.tier_change_of(task);
            Ok(row(ranked, rank_group, tier_change_probability))
        });
        Ok(Self {
            stage: stage.id,
            stage_name: stage.name.clone(),
            revision: number,
            since: revision.since,
            ruleset: revision.rules.ruleset.to_string(),
            task,
            significance: SIGNIFICANCE,
            tier_change_resamples: TIER_CHANGE_RESAMPLES,
            frozen: None,
            disqualified,
            rows: rows.collect::<Result<_, Problem>>()?,
        })
    }
}

/// A board's record as comparisons need it.
fn played<'a>(
    record: &'a BoardRecord,
    summaries: &'a RunSummaries,
    mismatch_seed: Seed,
) -> Result<Played<'a>, Problem> {
    let run = record.run;
    let summary = summaries
        .get(&run)
        .ok_or_else(|| Problem::internal(format_args!("run {run} has no summary")))?;
    Ok(Played {
        ruleset: &record.result.ruleset,
        profile: record.result.profile,
        seed: record.result.seed,
        mismatch_seed,
        summary,
    })
}

fn row(
    ranked: RankedEntry<BoardRecord>,
    rank_group: u32,
    tier_change_probability: f64,
) -> BoardRow {
    let RankedEntry { rank, tier, entry } = ranked;
    let (record, result) = (entry.key, entry.result);
    let released = record.released_at.is_some();
    BoardRow {
        rank,
        rank_group,
        tier,
        tier_change_probability,
        team: record.team.name,
        team_id: record.team.id,
        agent: record.agent_name.map(shown),
        evaluation: record.evaluation,
        day: record.day,
        extra_turn: record.extra_for,
        finished_at: record.finished_at,
        ruleset: result.ruleset,
        profile: result.profile,
        score: result.score,
        penalty_points: result.penalty_points,
        released_at: record.released_at,
        seed: released.then_some(result.seed),
        tasks: result
            .tasks
            .iter()
            .map(|(task, result)| (*task, TaskView::new(result, released)))
            .collect(),
    }
}
