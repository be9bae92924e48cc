//! The boards: overall and by task.

use super::schema;
use crate::{App, extract::PathParam, problem::Problem};
use axum::{Json, extract::State};
use faceoff_scoring::{BoardEntry, RankedEntry, overall_board, task_board as rank_by_task};
use faceoff_store::BoardRecord;
use faceoff_types::{
    EvaluationId, Profile, RULESET, Seed, Task, TaskResult, TeamId, TeamName, Tier,
};
use jiff::{Timestamp, civil};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
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
    /// Deployable teams first, then improvable, then non-deployable; inside a tier the higher score,
    /// then the fewer penalty points, then the earlier submission.
    pub rows: Vec<BoardRow>,
}

/// One team on a board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoardRow {
    /// Place on the whole board, from 1.
    pub rank: u32,
    /// Tier on this board.
    #[schema(value_type = String, example = "deployable")]
    pub tier: Tier,
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
    /// The seed of the day's evaluations; null until the day is over, because teams that have not
    /// used their turn yet would know their episodes.
    #[schema(value_type = Option<String>)]
    pub seed: Option<Seed>,
    /// Results by task: hit, defend, prepare.
    #[schema(value_type = BTreeMap<String, schema::TaskResult>)]
    pub tasks: BTreeMap<Task, TaskResult>,
}

/// The board's records, ranked.
pub(crate) async fn ranked(
    app: &App,
    task: Option<Task>,
) -> Result<Vec<RankedEntry<BoardRecord>>, Problem> {
    let entries = app
        .store
        .board()
        .await?
        .into_iter()
        .map(|record| BoardEntry {
            result: record.result.clone(),
            submitted_at_ms: record.submission.created_at.as_millisecond(),
            key: record,
        })
        .collect();
    Ok(match task {
        None => overall_board(entries),
        Some(task) => rank_by_task(task, entries),
    })
}

/// The seed of an evaluation of `day`, once everybody may know it.
pub(crate) fn public_seed(seed: Seed, day: civil::Date, today: civil::Date) -> Option<Seed> {
    (day < today).then_some(seed)
}

async fn view(app: &App, task: Option<Task>) -> Result<Json<BoardView>, Problem> {
    let today = app.config.clock.today();
    let rows = ranked(app, task)
        .await?
        .into_iter()
        .map(
            |RankedEntry {
                 rank,
                 tier,
                 entry:
                     BoardEntry {
                         key: record,
                         result,
                         ..
                     },
             }| BoardRow {
                rank,
                tier,
                team: record.team.name,
                team_id: record.team.id,
                agent: record.submission.agent_name,
                evaluation: record.evaluation,
                day: record.day,
                finished_at: record.finished_at,
                ruleset: result.ruleset,
                profile: result.profile,
                score: result.score,
                penalty_points: result.penalty_points,
                seed: public_seed(result.seed, record.day, today),
                tasks: result.tasks,
            },
        )
        .collect();
    Ok(Json(BoardView {
        ruleset: RULESET.to_owned(),
        task,
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
