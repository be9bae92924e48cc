//! What each team came to on each day of a stage, and where it stood by then.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    standing::Standing,
    views::{
        board, division, ruling,
        sight::Sight,
        standings::{self, Counts},
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
use faceoff_store::{BoardDays, BoardRecord, BoardScope, Stage};
use faceoff_types::{Standings, Task, TeamId};
use jiff::civil::Date;
use std::collections::BTreeMap;

/// What a request asks for.
#[boxed]
pub async fn asked(
    app: &AppState,
    sight: &Sight,
    query: HistoryQuery,
) -> Result<HistoryView, Problem> {
    let stage = board::stage_asked(app, sight, (query.stage, query.live)).await?;
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
        (None, Standings::Final) if final_day.is_none_or(|last| day < last) => Standings::Latest,
        (None, standings) => standings,
    };
    let rows = rows(records, rows_by, final_day, query.task)?;
    let mut days: Vec<Date> = rows.iter().map(|row| row.day).collect();
    days.dedup();
    Ok(HistoryView {
        revision,
        by,
        task: query.task,
        division,
        frozen: frozen.map(ruling::of),
        days,
        rows,
        ..without_rows(stage)
    })
}

fn without_rows(stage: Stage) -> HistoryView {
    HistoryView {
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
