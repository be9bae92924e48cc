//! Who stands where, and how sure that is.

use crate::{
    app::AppState,
    boxed,
    problem::{Problem, ProblemKind},
    standing::Standing,
    summaries::RunSummaries,
    views::{division, finalised, ruling, sight::Sight, stage, standings, team},
};
use faceoff_api::{
    requests::{BoardBy, BoardQuery},
    views::{
        baseline::BaselineRow,
        board::{BoardRow, BoardView},
        shown,
        task::TaskView,
    },
};
use faceoff_scoring::{
    EpisodeSummary, Played, RankedEntry, SIGNIFICANCE, TIER_CHANGE_RESAMPLES, joined_summary,
    rank_groups,
};
use faceoff_store::{BoardRecord, BoardScope, Stage};
use faceoff_types::{DivisionName, PerturbationSettings, Seed, StageId, Standings, Task};
use jiff::civil::Date;
use std::sync::Arc;

/// What a board ranks, whom, and by which of their results.
#[derive(Debug, Clone, Default)]
pub struct Whose {
    /// One task; `None`: all of them together.
    pub task: Option<Task>,
    /// The teams of one division; `None`: all teams.
    pub division: Option<DivisionName>,
    /// In place of what the stage's standings say.
    pub by: Option<Standings>,
}

impl Whose {
    fn is_ranked(&self, division: Option<&DivisionName>) -> bool {
        self.division.is_none() || self.division.as_ref() == division
    }
}

/// Whose board a request asks for.
///
/// # Errors
/// `Unauthenticated` or `Forbidden` if the viewer may not see the live one of a frozen stage.
#[boxed]
pub async fn stage_asked(
    app: &AppState,
    sight: &Sight,
    (stage, live): (Option<StageId>, bool),
) -> Result<Stage, Problem> {
    if live {
        sight.check_organiser("the board beyond the freeze")?;
    }
    match stage {
        Some(id) => Ok(app.store.stage(id).await?),
        None => stage::current(app).await,
    }
}

/// The board that a request asks for: the overall one, or that of one task.
#[boxed]
pub async fn asked(
    app: &AppState,
    sight: &Sight,
    query: BoardQuery,
    task: Option<Task>,
) -> Result<BoardView, Problem> {
    let stage = stage_asked(app, sight, (query.stage, query.live)).await?;
    let frozen = sight.frozen(stage.id).cloned();
    let scope = BoardScope {
        until: frozen
            .as_ref()
            .filter(|_| !query.live)
            .map(|frozen| frozen.at),
        until_day: query.day,
        ..BoardScope::default()
    };
    let revision = match query.revision {
        Some(number) => number,
        None => app.store.board_revision_within(&stage, &scope).await?,
    };
    if let Some(day) = query.day
        && !sight.is_hidden(stage.id)
    {
        let days = app.store.board_days(stage.id, revision, &scope).await?;
        check_has_results(day, &days)?;
    }
    let division = match query.division {
        Some(name) => Some(division::find(app, &name).await?),
        None => None,
    };
    let whose = Whose {
        task,
        division,
        by: query.by.map(BoardBy::standings),
    };
    let board = of(app, sight, &stage, revision, whose, (&scope, Vec::new())).await?;
    Ok(BoardView {
        frozen: frozen.map(ruling::of),
        ..board
    })
}

/// The board of a stage by one revision of its rules within a scope, with results that are taken as if they counted
/// beside it. A constant number of reads, however many teams there are.
#[boxed]
pub async fn of(
    app: &AppState,
    sight: &Sight,
    stage: &Stage,
    number: u32,
    whose: Whose,
    (scope, beside): (&BoardScope, Vec<BoardRecord>),
) -> Result<BoardView, Problem> {
    let mut revisions = app.store.stage_revisions(stage.id).await?.into_iter();
    let Some(revision) = revisions.find(|revision| revision.number == number) else {
        return Err(Problem::not_found("revision of the stage's rules"));
    };
    let mut disqualified = team::all(app).await?;
    match &stage.finalised {
        None => disqualified.retain(|team| team.disqualified.is_some()),
        Some(finalised) => disqualified.retain(|team| finalised.without.contains(&team.id)),
    }
    disqualified.retain(|team| whose.is_ranked(team.division.as_ref()));
    let variation = revision.rules.variation;
    let rows_by = match whose.by {
        Some(by) => by,
        None => standings::within(app, stage, scope).await?,
    };
    let (rows, baselines) = if sight.is_hidden(stage.id) {
        Default::default()
    } else {
        ranked_rows(app, stage, number, (scope, beside), rows_by, &whose).await?
    };
    Ok(BoardView {
        stage: stage.id,
        stage_name: stage.name.clone(),
        revision: number,
        since: revision.since,
        ruleset: revision.rules.ruleset.to_string(),
        weights: variation.weights,
        tier_bounds: variation.tier_bounds,
        perturbations: (*variation.perturbations != PerturbationSettings::default())
            .then_some(variation.perturbations),
        standings: stage.settings.standings,
        rows_by,
        day: scope.until_day,
        blind: stage.settings.blind,
        provisional: stage.finalised.is_none(),
        finalised: stage.finalised.clone().map(finalised::of),
        task: whose.task,
        division: whose.division,
        significance: SIGNIFICANCE,
        tier_change_resamples: TIER_CHANGE_RESAMPLES,
        frozen: None,
        disqualified,
        rows,
        baselines,
    })
}

/// Refuses a day without a result, of days with one, the last of which is no later than it.
fn check_has_results(day: Date, days: &[Date]) -> Result<(), Problem> {
    let why = match days.last() {
        Some(last) if *last == day => return Ok(()),
        Some(last) => format!("the one before it that has some is {last}"),
        None => "none before it has one either".to_owned(),
    };
    Err(Problem::new(
        ProblemKind::NotFound,
        format!(
            "{day} has no result on this board, and {why}; GET /api/v1/board/history lists all days that have results"
        ),
    ))
}

/// The rows of a board in their order, with what tells them apart, and the baselines.
async fn ranked_rows(
    app: &AppState,
    stage: &Stage,
    revision: u32,
    results: (&BoardScope, Vec<BoardRecord>),
    rows_by: Standings,
    whose: &Whose,
) -> Result<(Vec<BoardRow>, Vec<BaselineRow>), Problem> {
    let task = whose.task;
    let mut rows = standings::rows(app, stage, revision, results, rows_by, task).await?;
    rows.retain(|row| {
        let team = &row.record.team;
        team.is_baseline || whose.is_ranked(team.profile.division.as_ref())
    });
    let runs: Vec<_> = rows.iter().flat_map(|row| row.runs.clone()).collect();
    let summaries = app.summaries.of(&runs).await?;
    let mismatch_seed = app.store.season().await?.secret.model_mismatch();
    let rows: Vec<Row> = rows
        .into_iter()
        .map(|standing| Row::of(standing, &summaries))
        .collect::<Result<_, _>>()?;
    let all = standings::ranked(rows, task, |row| &row.standing.record);
    let (ranked, baselines) =
        standings::apart(all, |row: &Row| row.standing.record.team.is_baseline);
    let groups = rank_groups(&ranked, |leader, row| {
        let [leader, row] = [leader, row].map(|row| row.played(mismatch_seed));
        Ok::<_, Problem>(leader.told_apart(&row, task))
    })?;
    let rows = ranked.into_iter().zip(groups);
    let rows = rows.map(|(ranked, rank_group)| row(ranked, rank_group, task));
    // They are in no group.
    let baselines = baselines.into_iter().map(|ranked| row(ranked, 0, task));
    Ok((rows.collect(), baselines.map(baseline).collect()))
}

/// A row with its episodes.
struct Row {
    standing: Standing,
    summary: Arc<EpisodeSummary>,
}

impl Row {
    fn of(standing: Standing, summaries: &RunSummaries) -> Result<Self, Problem> {
        let days = standing.runs.iter().map(|run| {
            let summary = summaries.get(run);
            summary.ok_or_else(|| Problem::internal(format_args!("run {run} has no summary")))
        });
        let days: Vec<&Arc<EpisodeSummary>> = days.collect::<Result<_, _>>()?;
        let summary = match days[..] {
            [one] => Arc::clone(one),
            _ => {
                let days: Vec<&EpisodeSummary> = days.iter().map(|day| &***day).collect();
                Arc::new(joined_summary(&days))
            }
        };
        Ok(Self { standing, summary })
    }

    /// As comparisons need it.
    fn played(&self, mismatch_seed: Seed) -> Played<'_> {
        let result = &self.standing.record.result;
        Played {
            ruleset: &result.ruleset,
            profile: result.profile,
            variation: &result.variation,
            seed: result.seed,
            mismatch_seed,
            summary: &self.summary,
        }
    }
}

fn row(ranked: RankedEntry<Row>, rank_group: u32, task: Option<Task>) -> BoardRow {
    let RankedEntry { rank, tier, entry } = ranked;
    let (row, result) = (entry.key, entry.result);
    let Standing {
        record,
        evaluations,
        ..
    } = row.standing;
    let released = record.released_at.is_some();
    let is_mean = evaluations.len() > 1;
    BoardRow {
        rank,
        rank_group,
        tier,
        tier_change_probability: (!is_mean).then(|| row.summary.tier_change_of(task)),
        team: record.team.name,
        team_id: record.team.id,
        division: record.team.profile.division,
        agent: record.agent_name.map(shown),
        evaluation: record.evaluation,
        evaluations,
        day: record.day,
        extra_turn: record.extra_for,
        finished_at: record.finished_at,
        ruleset: result.ruleset,
        profile: result.profile,
        score: result.score,
        penalty_points: result.penalty_points,
        released_at: record.released_at,
        seed: (released && !is_mean).then_some(result.seed),
        tasks: result
            .tasks
            .iter()
            .map(|(task, result)| (*task, TaskView::new(result, released)))
            .collect(),
    }
}

/// Of a row whose rank is the one that it would take.
fn baseline(row: BoardRow) -> BaselineRow {
    BaselineRow {
        would_rank: row.rank,
        baseline: true,
        tier: row.tier,
        tier_change_probability: row.tier_change_probability,
        team: row.team,
        team_id: row.team_id,
        agent: row.agent,
        evaluation: row.evaluation,
        evaluations: row.evaluations,
        day: row.day,
        extra_turn: row.extra_turn,
        finished_at: row.finished_at,
        ruleset: row.ruleset,
        profile: row.profile,
        score: row.score,
        penalty_points: row.penalty_points,
        released_at: row.released_at,
        seed: row.seed,
        tasks: row.tasks,
    }
}
