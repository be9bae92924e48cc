//! The boards: overall and by task.

use super::schema;
use crate::{App, extract::PathParam, problem::Problem};
use axum::{Json, extract::State};
use faceoff_scoring::{
    BoardEntry, EpisodeSummary, Played, RankedEntry, SIGNIFICANCE, TIER_CHANGE_RESAMPLES,
    overall_board, rank_groups, task_board as rank_by_task,
};
use faceoff_store::BoardRecord;
use faceoff_types::{
    EvaluationId, Profile, RULESET, RunId, Seed, Task, TaskResult, TeamId, TeamName, Tier,
};
use jiff::{Timestamp, civil};
use serde::{Deserialize, Serialize};
use std::{
    collections::{BTreeMap, HashMap},
    sync::Arc,
};
use utoipa::ToSchema;

/// A board: each team's newest finished evaluation, in board order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoardView {
    /// The rules that the scores refer to.
    #[schema(example = "airhockey-2023.1")]
    pub ruleset: String,
    /// The task, or null for the overall board.
    #[schema(value_type = Option<String>)]
    pub task: Option<Task>,
    /// The level at which teams are told apart: rows of one rank group stand in the same tier and
    /// cannot be told from the group's first row.
    #[schema(example = 0.05)]
    pub significance: f64,
    /// Bootstrap resamples behind each `tier_change_probability`.
    #[schema(example = 2000)]
    pub tier_change_resamples: u32,
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
    /// Tier on this board.
    #[schema(value_type = String, example = "deployable")]
    pub tier: Tier,
    /// Probability that other episodes of the same kind would give another tier.
    pub tier_change_probability: f64,
    /// The team's name.
    #[schema(value_type = String)]
    pub team: TeamName,
    /// The team's id.
    #[schema(value_type = String, format = Uuid)]
    pub team_id: TeamId,
    /// The agent's own name.
    pub agent: Option<String>,
    /// The evaluation.
    #[schema(value_type = String, format = Uuid)]
    pub evaluation: EvaluationId,
    /// Its UTC day.
    #[schema(value_type = String, format = Date)]
    pub day: civil::Date,
    /// When it finished.
    #[schema(value_type = String, format = DateTime)]
    pub finished_at: Timestamp,
    /// The rules that it was scored by.
    pub ruleset: String,
    /// The perturbation profile.
    #[schema(value_type = String, example = "evaluation")]
    pub profile: Profile,
    /// Overall score in percent.
    pub score: f64,
    /// Overall penalty points: the maximum over the tasks.
    pub penalty_points: f64,
    /// The seed of the day's evaluations; null while teams that have not used their turn must not know
    /// their episodes.
    #[schema(value_type = Option<String>)]
    pub seed: Option<Seed>,
    /// Results by task: hit, defend, prepare.
    #[schema(value_type = BTreeMap<String, schema::TaskResult>)]
    pub tasks: BTreeMap<Task, TaskResult>,
}

/// A team in its place.
#[derive(Debug)]
pub(crate) struct BoardLine {
    pub(crate) ranked: RankedEntry<BoardRecord>,
    pub(crate) rank_group: u32,
    /// Of the tier on this board.
    pub(crate) tier_change: f64,
}

/// A board's record as comparisons need it.
fn played<'a>(
    record: &'a BoardRecord,
    summaries: &'a HashMap<RunId, Arc<EpisodeSummary>>,
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

/// The board's records, ranked and grouped.
pub(crate) async fn ranked(app: &App, task: Option<Task>) -> Result<Vec<BoardLine>, Problem> {
    let records = app.store.board().await?;
    let summaries = app
        .summaries_of(records.iter().map(|record| record.run))
        .await?;
    let entries = records
        .into_iter()
        .map(|record| BoardEntry {
            result: record.result.clone(),
            submitted_at_ms: record.submitted_at.as_millisecond(),
            key: record,
        })
        .collect();
    let ranked = match task {
        None => overall_board(entries),
        Some(task) => rank_by_task(task, entries),
    };
    let mismatch_seed = app.store.season().await?.secret.model_mismatch();
    let groups = rank_groups(&ranked, |leader, row| {
        let leader = played(leader, &summaries, mismatch_seed)?;
        Ok::<_, Problem>(leader.told_apart(&played(row, &summaries, mismatch_seed)?, task))
    })?;
    let mut lines = Vec::with_capacity(ranked.len());
    for (ranked, rank_group) in ranked.into_iter().zip(groups) {
        let summary = played(&ranked.entry.key, &summaries, mismatch_seed)?.summary;
        let tier_change = match task {
            None => summary.tier_change,
            Some(task) => summary
                .tasks
                .get(&task)
                .map_or(0.0, |task| task.tier_change),
        };
        lines.push(BoardLine {
            ranked,
            rank_group,
            tier_change,
        });
    }
    Ok(lines)
}

async fn view(app: &App, task: Option<Task>) -> Result<Json<BoardView>, Problem> {
    let lines = ranked(app, task).await?;
    let days = lines.iter().map(|line| line.ranked.entry.key.day);
    let seeds = app.day_seeds(days.collect()).await?;
    let rows = lines
        .into_iter()
        .map(|line| {
            let RankedEntry { rank, tier, entry } = line.ranked;
            let (record, result) = (entry.key, entry.result);
            BoardRow {
                rank,
                rank_group: line.rank_group,
                tier,
                tier_change_probability: line.tier_change,
                team: record.team.name,
                team_id: record.team.id,
                agent: record.agent_name,
                evaluation: record.evaluation,
                day: record.day,
                finished_at: record.finished_at,
                ruleset: result.ruleset,
                profile: result.profile,
                score: result.score,
                penalty_points: result.penalty_points,
                seed: seeds.public(result.seed, record.day),
                tasks: result.tasks,
            }
        })
        .collect();
    Ok(Json(BoardView {
        ruleset: RULESET.to_owned(),
        task,
        significance: SIGNIFICANCE,
        tier_change_resamples: TIER_CHANGE_RESAMPLES,
        rows,
    }))
}

/// The overall board.
#[utoipa::path(get, path = "/board", tag = "public", responses((status = 200, body = BoardView)))]
pub(crate) async fn board(State(app): State<App>) -> Result<Json<BoardView>, Problem> {
    view(&app, None).await
}

/// The board of one task, ranked by its success rate and its penalty points.
#[utoipa::path(
    get, path = "/board/{task}", tag = "public",
    params(("task" = String, Path, description = "hit, defend or prepare")),
    responses((status = 200, body = BoardView))
)]
pub(crate) async fn task_board(
    State(app): State<App>,
    PathParam(task): PathParam<Task>,
) -> Result<Json<BoardView>, Problem> {
    view(&app, Some(task)).await
}
