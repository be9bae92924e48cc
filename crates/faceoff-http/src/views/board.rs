//! Who stands where, and how sure that is.

use super::{
    baseline::BaselineRow, division, finalised::FinalisedView, ruling::RulingView, sight::Sight,
    stage, standings, task::TaskView, team::TeamView,
};
use crate::{
    app::AppState,
    problem::{Problem, ProblemKind},
    requests::{BoardBy, BoardQuery},
    standing::Standing,
    summaries::RunSummaries,
    views::shown,
};
use faceoff_scoring::{
    EpisodeSummary, Played, RankedEntry, SIGNIFICANCE, TIER_CHANGE_RESAMPLES, joined_summary,
    rank_groups,
};
use faceoff_store::{BoardRecord, BoardScope, Stage};
use faceoff_types::{
    DivisionName, EvaluationId, PerturbationSettings, Profile, Seed, StageId, StageName, Standings,
    Task, TaskWeights, TeamId, TeamName, Tier, TierBounds,
};
use jiff::{Timestamp, civil::Date};
use serde::{Deserialize, Serialize};
use std::{collections::BTreeMap, sync::Arc};
use utoipa::ToSchema;

/// A board: of each team what the stage's standings say, of its evaluations that are finished under one revision of
/// the stage's rules, in board order.
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
    #[schema(example = "airhockey-2023.3")]
    pub ruleset: String,
    /// What each task's success rate weighs in the overall score.
    pub weights: TaskWeights,
    /// Penalty points per episode up to which an agent is in a tier.
    pub tier_bounds: TierBounds,
    /// Magnitudes of the perturbations that the profile switches on; absent where they are the ruleset's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub perturbations: Option<Box<PerturbationSettings>>,
    /// What rows are made of in the end.
    pub standings: Standings,
    /// What they are made of at the moment: before a final day, of the newest evaluations, which do not count then; or as
    /// it was asked for.
    pub rows_by: Standings,
    /// The board as it stood by the results of the days up to this one; absent where all count.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub day: Option<Date>,
    /// The stage is blind: without the organiser's token there are no rows until the organiser opens it.
    pub blind: bool,
    /// The result may still change: it is not signed off.
    pub provisional: bool,
    /// It is signed off, if it is.
    pub finalised: Option<FinalisedView>,
    /// The task, or null for the overall board.
    pub task: Option<Task>,
    /// Whose teams are ranked, among themselves alone; absent where all teams are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
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
    /// Reference agents of the organisers', in board order, which take no rank from anybody; on the boards of all
    /// divisions.
    #[serde(default)]
    pub baselines: Vec<BaselineRow>,
}

/// One team on a board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct BoardRow {
    /// Place on this board, from 1.
    pub rank: u32,
    /// Teams of one group cannot be told from the group's first; from 1 down the board.
    pub rank_group: u32,
    /// The overall one, or the task's.
    pub tier: Tier,
    /// Probability that other episodes of the same kind would give another tier; null where the row is a mean of
    /// several days, of which it is not computed.
    pub tier_change_probability: Option<f64>,
    /// The team's name.
    pub team: TeamName,
    /// Stays when names change.
    pub team_id: TeamId,
    /// The division that the team is in now; absent if it is in none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// The agent's own name.
    pub agent: Option<String>,
    /// What the row shows; of a mean, the newest of its evaluations.
    pub evaluation: EvaluationId,
    /// All that the row is made of, the earlier day first: one, unless it is a mean.
    pub evaluations: Vec<EvaluationId>,
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
    /// Overall penalty points: the maximum over the tasks. Of a mean: of a day.
    pub penalty_points: f64,
    /// When the day's last evaluation had ended, and all of the day came out; null until then. Of a mean: null until
    /// that is so of all its days.
    pub released_at: Option<Timestamp>,
    /// The seed of the day's evaluations; null until the day is released, and where the row is a mean of several days.
    pub seed: Option<Seed>,
    /// Results by task: hit, defend, prepare. Of a mean, episodes, successes, violations and steps are sums over the
    /// days, rates and points are means of a day, and of the computation times `p99` and `max` are the worst day's.
    pub tasks: BTreeMap<Task, TaskView>,
}

/// What a board ranks, whom, and by which of their results.
#[derive(Debug, Clone, Default)]
pub(crate) struct Whose {
    /// One task; `None`: all of them together.
    pub(crate) task: Option<Task>,
    /// The teams of one division; `None`: all teams.
    pub(crate) division: Option<DivisionName>,
    /// In place of what the stage's standings say.
    pub(crate) by: Option<Standings>,
}

impl Whose {
    fn is_ranked(&self, division: Option<&DivisionName>) -> bool {
        self.division.is_none() || self.division.as_ref() == division
    }
}

impl BoardView {
    /// Whose board a request asks for.
    ///
    /// # Errors
    /// `Unauthenticated` or `Forbidden` if the viewer may not see the live one of a frozen stage.
    pub(crate) async fn stage_asked(
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
    pub(crate) async fn asked(
        app: &AppState,
        sight: &Sight,
        query: BoardQuery,
        task: Option<Task>,
    ) -> Result<Self, Problem> {
        let stage = Self::stage_asked(app, sight, (query.stage, query.live)).await?;
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
        let board = Self::of(app, sight, &stage, revision, whose, (&scope, Vec::new())).await?;
        Ok(Self {
            frozen: frozen.map(RulingView::from),
            ..board
        })
    }

    /// The board of a stage by one revision of its rules within a scope, with results that are taken as if they counted
    /// beside it. A constant number of reads, however many teams there are.
    pub(crate) async fn of(
        app: &AppState,
        sight: &Sight,
        stage: &Stage,
        number: u32,
        whose: Whose,
        (scope, beside): (&BoardScope, Vec<BoardRecord>),
    ) -> Result<Self, Problem> {
        let mut revisions = app.store.stage_revisions(stage.id).await?.into_iter();
        let Some(revision) = revisions.find(|revision| revision.number == number) else {
            return Err(Problem::not_found("revision of the stage's rules"));
        };
        let mut disqualified = TeamView::all(app).await?;
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
        Ok(Self {
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
            finalised: stage.finalised.clone().map(FinalisedView::from),
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
