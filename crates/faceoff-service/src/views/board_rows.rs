//! Aggregation of results into board rows: for each team one evaluation, or the mean of several. The stage's setting
//! ([`CountingResult`]) says which of a team's evaluations count. Results are board records: an evaluation with a score.

use crate::{
    aggregated_rows::{AggregatedRow, RowsKey},
    app::AppState,
    problem::Problem,
};
use faceoff_scoring::{BoardEntry, RankedEntry, overall_board, task_board};
use faceoff_store::{BoardDays, BoardRecord, BoardScope, Stage};
use faceoff_types::{Competition, CountingResult, Task};
use jiff::civil::Date;
use std::sync::Arc;

/// Which evaluations the rows show within a scope (which selects results by time and day). A stage whose final day counts shows
/// the newest evaluations until the cutoff of that day.
pub(super) async fn counting_result(
    app: &AppState,
    stage: &Stage,
    scope: &BoardScope,
) -> Result<CountingResult, Problem> {
    let counting_result = stage.settings.counting_result;
    if counting_result != CountingResult::Final {
        return Ok(counting_result);
    }
    let final_cutoff = app.store.final_cutoff(stage.id).await?;
    // A board that was frozen before the final day keeps showing the newest results.
    let has_final_day = final_cutoff.is_some_and(|cutoff_at| {
        scope.finished_until.is_none_or(|until| cutoff_at <= until)
            && scope
                .last_day
                .is_none_or(|day| stage.day(cutoff_at).date <= day)
    });
    Ok(if has_final_day {
        CountingResult::Final
    } else {
        CountingResult::Latest
    })
}

/// One row for each team with a result within the scope under a revision of a stage's rules, ordered by team name.
/// `extra` results, those of a proposed re-evaluation, are treated as if they counted.
pub(super) async fn rows(
    app: &AppState,
    stage: &Stage,
    revision: u32,
    (scope, extra): (&BoardScope, Vec<BoardRecord>),
    counting_result: CountingResult,
    task: Option<Task>,
) -> Result<Vec<AggregatedRow>, Problem> {
    let is_hypothetical = !scope.excluded.is_empty() || !extra.is_empty();
    let compute = async || load(app, stage, revision, (scope, extra), counting_result, task).await;
    // Newest results are not cached: reading them is as fast as checking the cache.
    if counting_result == CountingResult::Latest || is_hypothetical {
        return compute().await;
    }
    let key = RowsKey {
        // Read before the rows, which may then include a later change, too.
        change: app.store.newest_change().await?,
        stage: stage.id,
        revision,
        counting_result,
        task,
        finished_until: scope.finished_until,
        last_day: scope.last_day,
    };
    let rows = app
        .board_rows
        .get(key, async { compute().await.map(Arc::new) });
    Ok(rows.await?.to_vec())
}

async fn load(
    app: &AppState,
    stage: &Stage,
    revision: u32,
    (scope, extra): (&BoardScope, Vec<BoardRecord>),
    counting_result: CountingResult,
    task: Option<Task>,
) -> Result<Vec<AggregatedRow>, Problem> {
    let days = match counting_result {
        CountingResult::Latest => None,
        CountingResult::Final => Some(BoardDays::Final),
        CountingResult::Best => Some(BoardDays::All),
        CountingResult::MeanOfLast(days) => Some(BoardDays::Last(days)),
    };
    let mut records = match days {
        None => app.store.board_within(stage.id, revision, scope).await?,
        Some(days) => {
            let board = app.store.board_of_days(stage.id, revision, days, scope);
            board.await?
        }
    };
    if !extra.is_empty() {
        let final_cutoff = app.store.final_cutoff(stage.id).await?;
        let final_day = final_cutoff.map(|cutoff_at| stage.day(cutoff_at).date);
        let is_eligible = |record: &BoardRecord| {
            counting_result != CountingResult::Final || Some(record.day) == final_day
        };
        records.extend(extra.into_iter().filter(is_eligible));
        records.sort_by(|a, b| {
            let key = |record: &BoardRecord| (record.team.name.clone(), record.team.id, record.day);
            key(a).cmp(&key(b))
        });
    }
    let rule = CountingRule {
        counting_result,
        final_day: None,
        task,
    };
    aggregate(records, rule, app.config.competition())
}

/// Which of a team's results count.
#[derive(Debug, Clone, Copy)]
pub(super) struct CountingRule {
    pub(super) counting_result: CountingResult,
    /// The final day, if there are also records of other days.
    pub(super) final_day: Option<Date>,
    pub(super) task: Option<Task>,
}

/// One row for each team. `records` are grouped by team, and within a team in order of their days.
pub(super) fn aggregate(
    records: Vec<BoardRecord>,
    rule: CountingRule,
    competition: &Competition,
) -> Result<Vec<AggregatedRow>, Problem> {
    let teams = group_by_team(records);
    match rule.counting_result {
        CountingResult::Latest => {
            let newest = teams.filter_map(|mut records| records.pop());
            Ok(newest.map(AggregatedRow::single).collect())
        }
        CountingResult::Final => {
            let final_day = rule.final_day;
            let final_results = teams.filter_map(|mut records| {
                let newest = records.pop()?;
                final_day
                    .is_none_or(|day| newest.day == day)
                    .then_some(newest)
            });
            Ok(final_results.map(AggregatedRow::single).collect())
        }
        CountingResult::Best => {
            let best = teams.filter_map(|records| best(records, rule.task));
            Ok(best.map(AggregatedRow::single).collect())
        }
        CountingResult::MeanOfLast(count) => teams
            .filter_map(|mut records| {
                let older_count = records.len().saturating_sub(count as usize);
                records.drain(..older_count);
                AggregatedRow::mean(records, competition).transpose()
            })
            .collect(),
    }
}

/// Drops a team's records that cannot count any more, whatever results follow.
pub(super) fn drop_superseded(records: &mut Vec<BoardRecord>, rule: CountingRule) {
    let kept_count = match rule.counting_result {
        CountingResult::Latest | CountingResult::Final => 1,
        CountingResult::MeanOfLast(count) => count as usize,
        CountingResult::Best => {
            let all = std::mem::take(records);
            records.extend(best(all, rule.task));
            1
        }
    };
    let older_count = records.len().saturating_sub(kept_count);
    records.drain(..older_count);
}

/// Splits records, which are grouped by team, into one list per team.
fn group_by_team(records: Vec<BoardRecord>) -> impl Iterator<Item = Vec<BoardRecord>> {
    let mut records = records.into_iter().peekable();
    std::iter::from_fn(move || {
        let first = records.next()?;
        let team = first.team.id;
        let mut team_records = vec![first];
        while let Some(next) = records.next_if(|next| next.team.id == team) {
            team_records.push(next);
        }
        Some(team_records)
    })
}

/// The record that ranks highest on the board; of equal ones the earliest.
fn best(records: Vec<BoardRecord>, task: Option<Task>) -> Option<BoardRecord> {
    let ranked = rank(records, task, |record| record);
    ranked.into_iter().next().map(|first| first.entry.key)
}

/// Sorts rows into board order, with ranks.
pub(super) fn rank<K>(
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

/// Teams with their ranks, and baselines with the rank that each would have.
pub(super) fn split_baselines<K>(
    all_ranked: Vec<RankedEntry<K>>,
    is_baseline: impl Fn(&K) -> bool,
) -> (Vec<RankedEntry<K>>, Vec<RankedEntry<K>>) {
    let (mut ranked, mut baselines) = (Vec::new(), Vec::new());
    let mut rank = 1;
    for entry in all_ranked {
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
