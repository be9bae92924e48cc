//! Board history: the results of each evaluation day, with the ranks that the teams had on the board of that day.

use crate::{
    aggregated_rows::AggregatedRow,
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
    views::{
        board,
        board_rows::{self, CountingRule},
        decision, division,
        visibility::Visibility,
    },
};
use faceoff_api::{
    requests::{BoardBy, HistoryQuery},
    views::{
        history::{HistoryRow, HistoryView},
        task::TaskView,
    },
};
use faceoff_scoring::RankedEntry;
use faceoff_store::{BoardDays, BoardRecord, BoardScope};
use faceoff_types::{Competition, CountingResult, Task, TeamId};
use jiff::civil::Date;
use std::collections::BTreeMap;

/// The requested history.
#[boxed_future]
pub async fn query(
    app: &AppState,
    visibility: &Visibility,
    query: HistoryQuery,
) -> Result<HistoryView, Problem> {
    if let Some(task) = query.task {
        let found = app.config.competition().find_task(task.as_str());
        found
            .map_err(|error| Problem::new(ProblemKind::InvalidRequest, format!("task: {error}")))?;
    }
    let stage = board::requested_stage(app, visibility, (query.stage, query.live)).await?;
    let frozen = visibility.frozen(stage.id).cloned();
    let scope = BoardScope {
        finished_until: frozen
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
    if !revisions.iter().any(|existing| existing.number == revision) {
        return Err(Problem::not_found("revision of the stage's rules"));
    }
    let division = division::find(app, query.division).await?;
    let requested_result = query.by.map(BoardBy::counting_result);
    let mut records = if visibility.hides_scores(stage.id) {
        Vec::new()
    } else {
        let days = BoardDays::All;
        let records = app.store.board_of_days(stage.id, revision, days, &scope);
        records.await?
    };
    records.retain(|record| {
        let team_division = &record.team.profile.division;
        record.team.is_baseline || division.is_none() || *team_division == division
    });
    let final_cutoff = app.store.final_cutoff(stage.id).await?;
    let final_day = final_cutoff.map(|cutoff_at| stage.day(cutoff_at).date);
    let counting_result_on = |day: Date| match (requested_result, stage.settings.counting_result) {
        (Some(counting_result), _) => counting_result,
        (None, CountingResult::Final) if final_day.is_none_or(|final_day| day < final_day) => {
            CountingResult::Latest
        }
        (None, counting_result) => counting_result,
    };
    let rows = history_rows(
        records,
        counting_result_on,
        final_day,
        query.task,
        app.config.competition(),
    )?;
    let mut days: Vec<Date> = rows.iter().map(|row| row.day).collect();
    days.dedup();
    Ok(HistoryView {
        stage: stage.id,
        stage_name: stage.name,
        revision,
        standings: stage.settings.counting_result,
        blind: stage.settings.blind,
        provisional: stage.sign_off.is_none(),
        by: requested_result,
        task: query.task,
        division,
        frozen: frozen.map(decision::view),
        days,
        rows,
    })
}

/// The rows of each day with the ranks of that day's board. `records` are grouped by team.
fn history_rows(
    records: Vec<BoardRecord>,
    counting_result_on: impl Fn(Date) -> CountingResult,
    final_day: Option<Date>,
    task: Option<Task>,
    competition: &Competition,
) -> Result<Vec<HistoryRow>, Problem> {
    // Index of each team, in the order of the records.
    let mut team_index = BTreeMap::new();
    let mut by_day: BTreeMap<Date, Vec<BoardRecord>> = BTreeMap::new();
    for record in records {
        let next_index = team_index.len();
        team_index.entry(record.team.id).or_insert(next_index);
        by_day.entry(record.day).or_default().push(record);
    }
    // For each team, the results that can still count.
    let mut counting_records = vec![Vec::new(); team_index.len()];
    let mut rows = Vec::new();
    for (day, day_records) in by_day {
        let rule = CountingRule {
            counting_result: counting_result_on(day),
            final_day,
            task,
        };
        for record in &day_records {
            let team_records: &mut Vec<BoardRecord> =
                &mut counting_records[team_index[&record.team.id]];
            team_records.push(record.clone());
            board_rows::drop_superseded(team_records, rule);
        }
        let aggregated = board_rows::aggregate(counting_records.concat(), rule, competition)?;
        let all_ranked = board_rows::rank(aggregated, task, |row| &row.record);
        let (ranked, baselines) =
            board_rows::split_baselines(all_ranked, |row| row.record.team.is_baseline);
        let mut day_rows: Vec<HistoryRow> = day_records
            .iter()
            .filter_map(|record| {
                let team = record.team.id;
                history_row(
                    record,
                    task,
                    rank_of(&ranked, team),
                    rank_of(&baselines, team),
                )
            })
            .collect();
        day_rows.sort_by_key(|row| (row.baseline, row.rank.or(row.hypothetical_rank)));
        rows.extend(day_rows);
    }
    Ok(rows)
}

fn rank_of(rows: &[RankedEntry<AggregatedRow>], team: TeamId) -> Option<u32> {
    let team_row = rows.iter().find(|row| row.entry.key.record.team.id == team);
    team_row.map(|row| row.rank)
}

/// A result with the team's rank on its day, or the rank that a baseline would have; `None` if the task was not evaluated.
fn history_row(
    record: &BoardRecord,
    task: Option<Task>,
    rank: Option<u32>,
    hypothetical_rank: Option<u32>,
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
        hypothetical_rank,
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
