//! What a board's rows are made of: of each team one evaluation, or the mean of several.

use crate::{
    app::AppState,
    problem::Problem,
    standing::{RowsOf, Standing},
};
use faceoff_scoring::{BoardEntry, RankedEntry, overall_board, task_board};
use faceoff_store::{BoardDays, BoardRecord, BoardScope, Stage};
use faceoff_types::{Standings, Task};
use jiff::civil::Date;

/// How rows stand within a scope: a stage that waits for its final day shows the newest until that has its cut.
pub(super) async fn within(
    app: &AppState,
    stage: &Stage,
    scope: &BoardScope,
) -> Result<Standings, Problem> {
    let standings = stage.settings.standings;
    if standings != Standings::Final {
        return Ok(standings);
    }
    let final_cut = app.store.final_cut(stage.id).await?;
    // A board that was frozen before shows on what it showed.
    let is_over = final_cut.is_some_and(|at| {
        scope.until.is_none_or(|until| at <= until)
            && scope.until_day.is_none_or(|day| stage.day(at).date <= day)
    });
    Ok(if is_over {
        Standings::Final
    } else {
        Standings::Latest
    })
}

/// One row of each team with a result within the scope by a revision of a stage's rules, in the teams' order of names.
/// `beside` are results that are taken as if they counted.
pub(super) async fn rows(
    app: &AppState,
    stage: &Stage,
    revision: u32,
    (scope, beside): (&BoardScope, Vec<BoardRecord>),
    standings: Standings,
    task: Option<Task>,
) -> Result<Vec<Standing>, Problem> {
    let is_plain = scope.without.is_empty() && beside.is_empty();
    let make = async || made(app, stage, revision, (scope, beside), standings, task).await;
    // The newest results alone are read as quickly as it is seen that nothing has changed.
    if standings == Standings::Latest || !is_plain {
        return make().await;
    }
    let of = RowsOf {
        stage: stage.id,
        revision,
        by: standings,
        task,
        until: scope.until,
        until_day: scope.until_day,
    };
    app.rows.get(of, make).await
}

async fn made(
    app: &AppState,
    stage: &Stage,
    revision: u32,
    (scope, beside): (&BoardScope, Vec<BoardRecord>),
    standings: Standings,
    task: Option<Task>,
) -> Result<Vec<Standing>, Problem> {
    let days = match standings {
        Standings::Latest => None,
        Standings::Final => Some(BoardDays::Final),
        Standings::Best => Some(BoardDays::All),
        Standings::MeanOfLast(days) => Some(BoardDays::Last(days)),
    };
    let mut records = match days {
        None => app.store.board_within(stage.id, revision, scope).await?,
        Some(days) => {
            let board = app.store.board_of_days(stage.id, revision, days, scope);
            board.await?
        }
    };
    if !beside.is_empty() {
        let final_cut = app.store.final_cut(stage.id).await?;
        let final_day = final_cut.map(|at| stage.day(at).date);
        let is_eligible =
            |record: &BoardRecord| standings != Standings::Final || Some(record.day) == final_day;
        records.extend(beside.into_iter().filter(is_eligible));
        records.sort_by(|a, b| {
            let key = |record: &BoardRecord| (record.team.name.clone(), record.team.id, record.day);
            key(a).cmp(&key(b))
        });
    }
    let counts = Counts {
        standings,
        final_day: None,
        task,
    };
    of_records(records, counts)
}

/// What of a team's records counts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counts {
    pub(super) standings: Standings,
    /// Given where records are of other days, too.
    pub(super) final_day: Option<Date>,
    pub(super) task: Option<Task>,
}

/// One row of each team, of records that stand team by team, the earlier day first.
pub(super) fn of_records(
    records: Vec<BoardRecord>,
    counts: Counts,
) -> Result<Vec<Standing>, Problem> {
    let teams = by_team(records);
    match counts.standings {
        Standings::Latest => {
            let newest = teams.filter_map(|mut days| days.pop());
            Ok(newest.map(Standing::alone).collect())
        }
        Standings::Final => {
            let final_day = counts.final_day;
            let of_day = teams.filter_map(|mut days| {
                let newest = days.pop()?;
                final_day
                    .is_none_or(|day| newest.day == day)
                    .then_some(newest)
            });
            Ok(of_day.map(Standing::alone).collect())
        }
        Standings::Best => {
            let best = teams.filter_map(|days| best(days, counts.task));
            Ok(best.map(Standing::alone).collect())
        }
        Standings::MeanOfLast(last) => teams
            .filter_map(|mut days| {
                let older = days.len().saturating_sub(last as usize);
                days.drain(..older);
                Standing::mean(days).transpose()
            })
            .collect(),
    }
}

/// Takes out of a team's records what cannot count any more, whatever comes later.
pub(super) fn forget(records: &mut Vec<BoardRecord>, counts: Counts) {
    let kept = match counts.standings {
        Standings::Latest | Standings::Final => 1,
        Standings::MeanOfLast(days) => days as usize,
        Standings::Best => {
            let all = std::mem::take(records);
            records.extend(best(all, counts.task));
            1
        }
    };
    let older = records.len().saturating_sub(kept);
    records.drain(..older);
}

/// Records that stand team by team.
fn by_team(records: Vec<BoardRecord>) -> impl Iterator<Item = Vec<BoardRecord>> {
    let mut records = records.into_iter().peekable();
    std::iter::from_fn(move || {
        let first = records.next()?;
        let team = first.team.id;
        let mut of_team = vec![first];
        while let Some(next) = records.next_if(|next| next.team.id == team) {
            of_team.push(next);
        }
        Some(of_team)
    })
}

/// The one that stands highest by the board's own order; of level ones the earliest.
fn best(records: Vec<BoardRecord>, task: Option<Task>) -> Option<BoardRecord> {
    let ranked = ranked(records, task, |record| record);
    ranked.into_iter().next().map(|first| first.entry.key)
}

/// In board order.
pub(super) fn ranked<K>(
    rows: Vec<K>,
    task: Option<Task>,
    record: impl Fn(&K) -> &BoardRecord,
) -> Vec<RankedEntry<K>> {
    let entries = rows.into_iter().map(|row| BoardEntry {
        result: record(&row).result.clone(),
        submitted_at_ms: record(&row).submitted_at.as_millisecond(),
        key: row,
    });
    match task {
        None => overall_board(entries.collect()),
        Some(task) => task_board(task, entries.collect()),
    }
}

/// Those that are ranked, with ranks among themselves, and baselines, each with the rank that it would take.
pub(super) fn apart<K>(
    all: Vec<RankedEntry<K>>,
    is_baseline: impl Fn(&K) -> bool,
) -> (Vec<RankedEntry<K>>, Vec<RankedEntry<K>>) {
    let (mut ranked, mut baselines) = (Vec::new(), Vec::new());
    let mut rank = 1;
    for entry in all {
        let entry = RankedEntry { rank, ..entry };
        if is_baseline(&entry.entry.key) {
            baselines.push(entry);
        } else {
            ranked.push(entry);
            rank += 1;
        }
    }
    (ranked, baselines)
}
