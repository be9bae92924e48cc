//! Boards: the ranks of the teams in a stage, and their statistical uncertainty. A board belongs to one revision of the stage's
//! rules. It ranks by *tier* (grade of safety) first, if the competition has tiers, then by score. Teams in the same *rank group* are
//! statistically tied with the first team of the group. A *baseline* is a team of the organisers, which is shown for comparison, without a
//! rank.

use crate::{
    aggregated_rows::AggregatedRow,
    app::AppState,
    boxed_future,
    problem::{Problem, ProblemKind},
    summaries::RunSummaries,
    views::{board_rows, decision, division, sign_off, stage, team, visibility::Visibility},
};
use faceoff_api::{
    requests::{BoardBy, BoardQuery},
    views::{
        baseline::BaselineRow,
        board::{BoardRow, BoardView},
        printable,
        task::TaskView,
    },
};
use faceoff_scoring::{
    ComparedEvaluation, EpisodeSummary, RankedEntry, SIGNIFICANCE, TIER_CHANGE_RESAMPLES,
    joined_summary, rank_groups,
};
use faceoff_store::{BoardRecord, BoardScope, Stage};
use faceoff_types::{
    Competition, CountingResult, DivisionName, Seed, StageId, Task, TaskWeights, UnknownTask,
};
use jiff::civil::Date;
use std::sync::Arc;

/// What a board ranks: which task, teams and evaluations.
#[derive(Debug, Clone, Default)]
pub struct BoardSelection {
    /// `None`: all tasks together.
    pub task: Option<Task>,
    /// `None`: the teams of all divisions.
    pub division: Option<DivisionName>,
    /// Which results count; overrides the stage's setting `standings`.
    pub counting_result: Option<CountingResult>,
}

impl BoardSelection {
    /// Whether the board ranks teams of this division.
    fn is_ranked(&self, division: Option<&DivisionName>) -> bool {
        self.division.is_none() || self.division.as_ref() == division
    }
}

/// The stage of a requested board; by default the current one. `is_live` requests results after a freeze of the boards.
///
/// # Errors
/// `Unauthenticated` or `Forbidden` if the viewer may not see the live board of a frozen stage.
#[boxed_future]
pub async fn requested_stage(
    app: &AppState,
    visibility: &Visibility,
    (stage, is_live): (Option<StageId>, bool),
) -> Result<Stage, Problem> {
    if is_live {
        visibility.check_organiser("the board beyond the freeze")?;
    }
    match stage {
        Some(id) => Ok(app.store.stage(id).await?),
        None => stage::current(app).await,
    }
}

/// There is no board of this task.
#[must_use]
pub fn unknown_task(competition: &Competition, task: Task) -> Problem {
    let error = UnknownTask::new(task.as_str(), competition.task_names());
    Problem::new(ProblemKind::NotFound, error.to_string())
}

/// The requested board: the overall one, or that of one task.
#[boxed_future]
pub async fn query(
    app: &AppState,
    visibility: &Visibility,
    query: BoardQuery,
    task: Option<Task>,
) -> Result<BoardView, Problem> {
    let competition = app.config.competition();
    if let Some(task) = task.filter(|task| competition.task(*task).is_none()) {
        return Err(unknown_task(competition, task));
    }
    let stage = requested_stage(app, visibility, (query.stage, query.live)).await?;
    let frozen = visibility.frozen(stage.id).cloned();
    let scope = BoardScope {
        finished_until: frozen
            .as_ref()
            .filter(|_| !query.live)
            .map(|frozen| frozen.at),
        last_day: query.day,
        ..BoardScope::default()
    };
    let revision = match query.revision {
        Some(number) => number,
        None => app.store.board_revision_within(&stage, &scope).await?,
    };
    if let Some(day) = query.day
        && !visibility.hides_scores(stage.id)
    {
        let days = app.store.board_days(stage.id, revision, &scope).await?;
        check_has_results(day, &days)?;
    }
    let division = division::find(app, query.division).await?;
    let selection = BoardSelection {
        task,
        division,
        counting_result: query.by.map(BoardBy::counting_result),
    };
    let board = build(
        app,
        visibility,
        &stage,
        revision,
        selection,
        (&scope, Vec::new()),
    )
    .await?;
    Ok(BoardView {
        frozen: frozen.map(decision::view),
        ..board
    })
}

/// The board of a stage under one revision of its rules, from the results within `scope` and from `extra` results: those of a proposed
/// re-evaluation, as if they counted. The number of database reads does not depend on the number of teams.
#[boxed_future]
pub async fn build(
    app: &AppState,
    visibility: &Visibility,
    stage: &Stage,
    revision_number: u32,
    selection: BoardSelection,
    (scope, extra): (&BoardScope, Vec<BoardRecord>),
) -> Result<BoardView, Problem> {
    let mut revisions = app.store.stage_revisions(stage.id).await?.into_iter();
    let Some(revision) = revisions.find(|revision| revision.number == revision_number) else {
        return Err(Problem::not_found("revision of the stage's rules"));
    };
    let mut disqualified = team::all(app).await?;
    match &stage.sign_off {
        None => disqualified.retain(|team| team.disqualified.is_some()),
        Some(sign_off) => {
            disqualified.retain(|team| sign_off.disqualified_teams.contains(&team.id))
        }
    }
    disqualified.retain(|team| selection.is_ranked(team.division.as_ref()));
    let variation = revision.rules.variation;
    let counting_result = match selection.counting_result {
        Some(counting_result) => counting_result,
        None => board_rows::counting_result(app, stage, scope).await?,
    };
    let (rows, baselines) = if visibility.hides_scores(stage.id) {
        Default::default()
    } else {
        ranked_rows(
            app,
            stage,
            revision_number,
            (scope, extra),
            counting_result,
            &selection,
        )
        .await?
    };
    Ok(BoardView {
        stage: stage.id,
        stage_name: stage.name.clone(),
        revision: revision_number,
        since: revision.since,
        ruleset: revision.rules.ruleset.to_string(),
        weights: app.config.competition().weights(&variation),
        tier_bounds: app.config.competition().tier_bounds(&variation),
        perturbations: (!variation.perturbations.is_empty()).then_some(variation.perturbations),
        standings: stage.settings.counting_result,
        rows_by: counting_result,
        day: scope.last_day,
        blind: stage.settings.blind,
        provisional: stage.sign_off.is_none(),
        sign_off: stage.sign_off.clone().map(sign_off::view),
        task: selection.task,
        division: selection.division,
        significance: SIGNIFICANCE,
        tier_change_resamples: TIER_CHANGE_RESAMPLES,
        frozen: None,
        disqualified,
        rows,
        baselines,
    })
}

/// Refuses a day without results. `days` are the days with results up to this one.
fn check_has_results(day: Date, days: &[Date]) -> Result<(), Problem> {
    let hint = match days.last() {
        Some(last) if *last == day => return Ok(()),
        Some(last) => format!("the last earlier day with results is {last}"),
        None => "no earlier day has results".to_owned(),
    };
    Err(Problem::new(
        ProblemKind::NotFound,
        format!(
            "{day} has no results on this board; {hint}; GET /api/v1/board/history lists all days with results"
        ),
    ))
}

/// The rows of a board in board order with their rank groups, and the baselines.
async fn ranked_rows(
    app: &AppState,
    stage: &Stage,
    revision: u32,
    results: (&BoardScope, Vec<BoardRecord>),
    counting_result: CountingResult,
    selection: &BoardSelection,
) -> Result<(Vec<BoardRow>, Vec<BaselineRow>), Problem> {
    let task = selection.task;
    let mut aggregated_rows =
        board_rows::rows(app, stage, revision, results, counting_result, task).await?;
    aggregated_rows.retain(|row| {
        let team = &row.record.team;
        team.is_baseline || selection.is_ranked(team.profile.division.as_ref())
    });
    let runs: Vec<_> = aggregated_rows
        .iter()
        .flat_map(|row| row.runs.clone())
        .collect();
    let summaries = app.summaries.load(&runs).await?;
    let mismatch_seed = app.store.season().await?.secret.model_mismatch();
    let summarised_rows: Vec<SummarisedRow> = aggregated_rows
        .into_iter()
        .map(|aggregated| SummarisedRow::new(aggregated, &summaries, app.config.competition()))
        .collect::<Result<_, _>>()?;
    let all_ranked = board_rows::rank(summarised_rows, task, |row| &row.aggregated.record);
    let (ranked, baselines) = board_rows::split_baselines(all_ranked, |row: &SummarisedRow| {
        row.aggregated.record.team.is_baseline
    });
    let groups = rank_groups(&ranked, |leader, row| {
        let [leader, row] = [leader, row].map(|row| row.to_compared(mismatch_seed));
        Ok::<_, Problem>(leader.differs_significantly(&row, task))
    })?;
    let views = ranked
        .into_iter()
        .zip(groups)
        .map(|(ranked, rank_group)| row_view(ranked, rank_group, task));
    // Baselines have no rank group: `baseline_row` drops the 0.
    let baselines = baselines
        .into_iter()
        .map(|ranked| row_view(ranked, 0, task));
    Ok((views.collect(), baselines.map(baseline_row).collect()))
}

/// A team's row with the weights of the tasks and the summary of its episodes, as statistical comparisons need them.
struct SummarisedRow {
    aggregated: AggregatedRow,
    weights: TaskWeights,
    /// Of all evaluations that the row aggregates.
    summary: Arc<EpisodeSummary>,
}

impl SummarisedRow {
    fn new(
        aggregated: AggregatedRow,
        summaries: &RunSummaries,
        competition: &Competition,
    ) -> Result<Self, Problem> {
        let run_summaries = aggregated.runs.iter().map(|run| {
            let summary = summaries.get(run);
            summary.ok_or_else(|| Problem::internal(format_args!("run {run} has no summary")))
        });
        let run_summaries: Vec<&Arc<EpisodeSummary>> = run_summaries.collect::<Result<_, _>>()?;
        let summary = match run_summaries[..] {
            [summary] => Arc::clone(summary),
            _ => {
                let run_summaries: Vec<&EpisodeSummary> =
                    run_summaries.iter().map(|summary| &***summary).collect();
                Arc::new(joined_summary(&run_summaries))
            }
        };
        Ok(Self {
            weights: competition.weights(&aggregated.record.result.variation),
            aggregated,
            summary,
        })
    }

    /// The row in the form that statistical comparisons take.
    fn to_compared(&self, mismatch_seed: Seed) -> ComparedEvaluation<'_> {
        let result = &self.aggregated.record.result;
        ComparedEvaluation {
            ruleset: &result.ruleset,
            profile: result.profile,
            variation: &result.variation,
            weights: &self.weights,
            seed: result.seed,
            mismatch_seed,
            summary: &self.summary,
        }
    }
}

/// A row of the response. Seed and episode data of a day without release are left out.
fn row_view(ranked: RankedEntry<SummarisedRow>, rank_group: u32, task: Option<Task>) -> BoardRow {
    let RankedEntry { rank, tier, entry } = ranked;
    let (row, result) = (entry.key, entry.result);
    let AggregatedRow {
        record,
        evaluations,
        ..
    } = row.aggregated;
    let released = record.released_at.is_some();
    let is_mean = evaluations.len() > 1;
    BoardRow {
        rank,
        rank_group,
        tier,
        tier_change_probability: row.summary.tier_change_of(task).filter(|_| !is_mean),
        team: record.team.name,
        team_id: record.team.id,
        division: record.team.profile.division,
        agent: record.agent_name.map(printable),
        evaluation: record.evaluation,
        evaluations,
        day: record.day,
        extra_evaluation: record.extra_reason,
        rerun_after_release: record.rerun_after_release,
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

/// The row of a baseline; `row.rank` is the rank that it would have if it were ranked.
fn baseline_row(row: BoardRow) -> BaselineRow {
    BaselineRow {
        hypothetical_rank: row.rank,
        baseline: true,
        tier: row.tier,
        tier_change_probability: row.tier_change_probability,
        team: row.team,
        team_id: row.team_id,
        agent: row.agent,
        evaluation: row.evaluation,
        evaluations: row.evaluations,
        day: row.day,
        extra_evaluation: row.extra_evaluation,
        rerun_after_release: row.rerun_after_release,
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
