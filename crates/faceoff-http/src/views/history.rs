//! What each team came to on each day of a stage, and where it stood by then.

use super::{
    board::BoardView,
    division,
    ruling::RulingView,
    sight::Sight,
    standings::{self, Counts},
    task::TaskView,
};
use crate::{
    app::AppState,
    problem::Problem,
    requests::{BoardBy, HistoryQuery},
    standing::Standing,
};
use faceoff_scoring::RankedEntry;
use faceoff_store::{BoardDays, BoardRecord, BoardScope, Stage};
use faceoff_types::{
    DivisionName, EvaluationId, StageId, StageName, Standings, Task, TeamId, TeamName, Tier,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// All results of a stage that count, by one revision of its rules.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct HistoryView {
    /// Whose they are.
    pub stage: StageId,
    /// As the organiser named it.
    pub stage_name: StageName,
    /// By which of the stage's rules they were played.
    pub revision: u32,
    /// What boards of the stage are made of; ranks before a final day are by the newest results.
    pub standings: Standings,
    /// What teams were ranked by, if it was asked for something else; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<Standings>,
    /// The stage is blind: without the organiser's token there are no rows until the organiser opens it.
    pub blind: bool,
    /// The result may still change: it is not signed off.
    pub provisional: bool,
    /// The task that ranks, or null for all together.
    pub task: Option<Task>,
    /// Whose teams are ranked, among themselves alone; absent where all teams are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// Nothing is told that is newer: since when, and why; absent otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frozen: Option<RulingView>,
    /// Those with results, the earlier first.
    pub days: Vec<Date>,
    /// The earlier day first; of a day in board order.
    pub rows: Vec<HistoryRow>,
}

/// What a team came to on a day.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct HistoryRow {
    /// The date whose episodes it played.
    pub day: Date,
    /// The team's name.
    pub team: TeamName,
    /// Stays when names change.
    pub team_id: TeamId,
    /// The division that the team is in now; absent if it is in none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// A reference agent of the organisers, which takes no rank.
    pub baseline: bool,
    /// Where it stood on the board by the results up to that day; null of a baseline.
    pub rank: Option<u32>,
    /// The rank that a baseline would have taken; absent of others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub would_rank: Option<u32>,
    /// What it played.
    pub evaluation: EvaluationId,
    /// When its score was published.
    pub finished_at: Timestamp,
    /// When all of the day came out; null until then.
    pub released_at: Option<Timestamp>,
    /// Of the day's own result, overall or in the task.
    pub tier: Tier,
    /// The day's own, overall, in percent.
    pub score: f64,
    /// The day's own, overall: the maximum over the tasks.
    pub penalty_points: f64,
    /// The day's own results by task.
    pub tasks: BTreeMap<Task, TaskView>,
}

impl HistoryView {
    /// What a request asks for.
    pub(crate) async fn asked(
        app: &AppState,
        sight: &Sight,
        query: HistoryQuery,
    ) -> Result<Self, Problem> {
        let stage = BoardView::stage_asked(app, sight, (query.stage, query.live)).await?;
        let frozen = sight.frozen(stage.id).cloned();
        let scope = BoardScope {
            until: frozen
                .as_ref()
                .filter(|_| !query.live)
                .map(|frozen| frozen.at),
            ..BoardScope::default()
        };
        let revision = match query.revision {
            Some(number) => number,
            None => app.store.board_revision_within(&stage, &scope).await?,
        };
        let revisions = app.store.stage_revisions(stage.id).await?;
        if !revisions.iter().any(|of| of.number == revision) {
            return Err(Problem::not_found("revision of the stage's rules"));
        }
        let division = match query.division {
            Some(name) => Some(division::find(app, &name).await?),
            None => None,
        };
        let by = query.by.map(BoardBy::standings);
        let mut records = if sight.is_hidden(stage.id) {
            Vec::new()
        } else {
            let all = BoardDays::All;
            let board = app.store.board_of_days(stage.id, revision, all, &scope);
            board.await?
        };
        records.retain(|record| {
            let of_team = &record.team.profile.division;
            record.team.is_baseline || division.is_none() || *of_team == division
        });
        let final_cut = app.store.final_cut(stage.id).await?;
        let final_day = final_cut.map(|at| stage.day(at).date);
        let rows_by = |day: Date| match (by, stage.settings.standings) {
            (Some(by), _) => by,
            (None, Standings::Final) if final_day.is_none_or(|last| day < last) => {
                Standings::Latest
            }
            (None, standings) => standings,
        };
        let rows = rows(records, rows_by, final_day, query.task)?;
        let mut days: Vec<Date> = rows.iter().map(|row| row.day).collect();
        days.dedup();
        Ok(Self {
            revision,
            by,
            task: query.task,
            division,
            frozen: frozen.map(RulingView::from),
            days,
            rows,
            ..Self::without_rows(stage)
        })
    }

    fn without_rows(stage: Stage) -> Self {
        Self {
            stage: stage.id,
            stage_name: stage.name,
            revision: stage.rules.number,
            standings: stage.settings.standings,
            by: None,
            blind: stage.settings.blind,
            provisional: stage.finalised.is_none(),
            task: None,
            division: None,
            frozen: None,
            days: Vec::new(),
            rows: Vec::new(),
        }
    }
}

/// Of records that stand team by team, the rows of each day with the ranks of the board as it stood by then.
fn rows(
    records: Vec<BoardRecord>,
    rows_by: impl Fn(Date) -> Standings,
    final_day: Option<Date>,
    task: Option<Task>,
) -> Result<Vec<HistoryRow>, Problem> {
    // Teams in the order of the records.
    let mut order = BTreeMap::new();
    let mut by_day: BTreeMap<Date, Vec<BoardRecord>> = BTreeMap::new();
    for record in records {
        let next = order.len();
        order.entry(record.team.id).or_insert(next);
        by_day.entry(record.day).or_default().push(record);
    }
    // Of each team the results that can still count.
    let mut counting = vec![Vec::new(); order.len()];
    let mut rows = Vec::new();
    for (day, of_day) in by_day {
        let counts = Counts {
            standings: rows_by(day),
            final_day,
            task,
        };
        for record in &of_day {
            let of_team: &mut Vec<BoardRecord> = &mut counting[order[&record.team.id]];
            of_team.push(record.clone());
            standings::forget(of_team, counts);
        }
        let standing = standings::of_records(counting.concat(), counts)?;
        let all = standings::ranked(standing, task, |row| &row.record);
        let (ranked, baselines) = standings::apart(all, |row| row.record.team.is_baseline);
        let mut of_day: Vec<HistoryRow> = of_day
            .iter()
            .filter_map(|record| {
                let team = record.team.id;
                row(record, task, rank(&ranked, team), rank(&baselines, team))
            })
            .collect();
        of_day.sort_by_key(|row| (row.baseline, row.rank.or(row.would_rank)));
        rows.extend(of_day);
    }
    Ok(rows)
}

fn rank(of: &[RankedEntry<Standing>], team: TeamId) -> Option<u32> {
    let found = of.iter().find(|row| row.entry.key.record.team.id == team);
    found.map(|row| row.rank)
}

/// A day's own result; `None` if the task was not played.
fn row(
    record: &BoardRecord,
    task: Option<Task>,
    rank: Option<u32>,
    would_rank: Option<u32>,
) -> Option<HistoryRow> {
    let result = &record.result;
    let released = record.released_at.is_some();
    let tier = match task {
        None => result.tier,
        Some(task) => result.tasks.get(&task)?.tier,
    };
    let tasks = result.tasks.iter();
    Some(HistoryRow {
        day: record.day,
        team: record.team.name.clone(),
        team_id: record.team.id,
        division: record.team.profile.division.clone(),
        baseline: record.team.is_baseline,
        rank,
        would_rank,
        evaluation: record.evaluation,
        finished_at: record.finished_at,
        released_at: record.released_at,
        tier,
        score: result.score,
        penalty_points: result.penalty_points,
        tasks: tasks
            .map(|(task, result)| (*task, TaskView::new(result, released)))
            .collect(),
    })
}
