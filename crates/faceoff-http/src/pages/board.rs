//! The boards: `/` in tiers as in the paper's qualifying table, `/tasks/{task}` by task.

use super::{
    baselines::{self, Baseline},
    figures,
    frame::{Frame, PageProblem, render},
    standing,
};
use crate::{
    app::App,
    extract::{PathParam, QueryParams},
    problem::Problem,
    requests::BoardQuery,
    viewer::Viewer,
    views::{
        board::{BoardRow, BoardView},
        evaluation::{EvaluationStatus, EvaluationView, Progress},
        ruling::RulingView,
        season::SeasonHead,
        sight::Sight,
        stage::{PhaseView, StageView},
        task::TaskView,
        team::TeamView,
    },
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_types::{
    DivisionName, EvaluationId, StageDay, Task, TaskWeights, TeamId, Tier, TierBounds,
    ViolationCounts,
};
use figures::Rate;
use jiff::{Timestamp, civil};

/// Who a row is about.
struct Who {
    rank: u32,
    /// Whom the episodes cannot tell from the group's first.
    rank_group: u32,
    /// Of the tier on this board.
    tier_change: String,
    team: String,
    team_id: TeamId,
    division: Option<DivisionName>,
    agent: Option<String>,
    evaluation: EvaluationId,
    day: civil::Date,
    /// Why it is a turn beside the day's own.
    extra_turn: Option<String>,
    /// How many days the row is a mean of, if of several.
    days: Option<usize>,
    /// How it was evaluated, where the rows of the board differ in that.
    setting: Option<String>,
}

/// How a result came about; results of different settings do not compare.
fn setting(row: &BoardRow) -> String {
    format!(
        "{} profile, {} episodes per task, rules {}",
        row.profile,
        episodes(row),
        row.ruleset
    )
}

/// Of the task with the most, on a day.
fn episodes(row: &BoardRow) -> u32 {
    let episodes = row.tasks.values().map(|task| task.episodes);
    of_a_day(row, episodes.max().unwrap_or(0))
}

/// Episodes of a day, of those of all that the row is made of.
fn of_a_day(row: &BoardRow, episodes: u32) -> u32 {
    let days = u32::try_from(row.evaluations.len()).unwrap_or(u32::MAX);
    episodes / days.max(1)
}

/// The setting of the whole board; `None` where its rows differ.
fn common_setting(rows: &[BoardRow]) -> Option<String> {
    let first = setting(rows.first()?);
    rows.iter()
        .all(|row| setting(row) == first)
        .then_some(first)
}

impl Who {
    fn of(row: &BoardRow, common_setting: Option<&String>) -> Self {
        Self {
            rank: row.rank,
            rank_group: row.rank_group,
            tier_change: row
                .tier_change_probability
                .map_or_else(|| "not computed of means".to_owned(), figures::chance),
            team: row.team.to_string(),
            team_id: row.team_id,
            division: row.division.clone(),
            agent: row.agent.clone(),
            evaluation: row.evaluation,
            day: row.day,
            extra_turn: row.extra_turn.clone(),
            days: (row.evaluations.len() > 1).then_some(row.evaluations.len()),
            setting: common_setting.is_none().then(|| setting(row)),
        }
    }
}

/// The teams of one tier; tiers without a team are left out.
struct TierRows<Row> {
    name: &'static str,
    title: &'static str,
    sign: &'static str,
    bounds: String,
    rows: Vec<Row>,
}

fn by_tier<Row>(board: &BoardView, row: impl Fn(&BoardRow) -> Row) -> Vec<TierRows<Row>> {
    let mut tiers: Vec<TierRows<Row>> = Tier::ALL
        .into_iter()
        .map(|tier| TierRows {
            name: tier.as_str(),
            title: tier.title(),
            sign: figures::tier_sign(tier),
            bounds: figures::tier_bounds(tier, &board.tier_bounds),
            rows: Vec::new(),
        })
        .collect();
    for of_board in &board.rows {
        tiers[of_board.tier as usize].rows.push(row(of_board));
    }
    tiers.retain(|tier| !tier.rows.is_empty());
    tiers
}

struct OverallRow {
    who: Who,
    /// In the order of `Task::ALL`; `None` where the task was not played.
    rates: Vec<(Task, Option<Rate>)>,
    penalty_points: String,
    per_episode: String,
    score: String,
}

impl OverallRow {
    fn of(row: &BoardRow, common_setting: Option<&String>) -> Self {
        Self {
            who: Who::of(row, common_setting),
            rates: Task::ALL
                .into_iter()
                .map(|task| (task, row.tasks.get(&task).map(Rate::of)))
                .collect(),
            penalty_points: figures::one(row.penalty_points),
            per_episode: figures::per_episode(row.penalty_points, episodes(row)),
            score: figures::one(row.score),
        }
    }
}

/// An evaluation of today that has no result (yet).
struct UnderWay {
    team: String,
    evaluation: EvaluationId,
    state: &'static str,
    progress: Option<Progress>,
}

/// Whose board a page is, and which others there are.
struct Heading {
    stage: String,
    /// Since when, until when.
    times: String,
    /// When the next day starts.
    next: Option<String>,
    /// Of the rules, if the stage has had several.
    rules: Option<String>,
    others: Vec<OtherBoard>,
    /// Of which the board can be asked for; with the one that is shown, if one is.
    divisions: Vec<DivisionName>,
    division: Option<DivisionName>,
    /// The query that asks for this board of all teams.
    of_all: String,
    /// The organiser holds the queue.
    paused: Option<RulingView>,
    /// The organiser has frozen the board.
    frozen: Option<RulingView>,
    /// What its rows are, for the table's caption.
    rows: String,
    /// What the tasks weigh, and the bounds of the tiers.
    weights: TaskWeights,
    tier_bounds: TierBounds,
    /// The perturbations have magnitudes of their own.
    own_magnitudes: bool,
    /// What decides in the end, if that is something else.
    still_to_come: Option<&'static str>,
    /// Who sees it, if not everybody.
    blind: Option<&'static str>,
    /// Is it hidden from the viewer?
    is_hidden: bool,
    /// May it change?
    result: String,
}

struct OtherBoard {
    label: String,
    /// The query that asks for it.
    query: String,
}

impl Heading {
    async fn of(
        app: &App,
        board: &BoardView,
        sight: &Sight,
        paused: Option<RulingView>,
    ) -> Result<Self, PageProblem> {
        let is_hidden = sight.is_hidden(board.stage);
        let stages = StageView::all(app).await?;
        let mut others = Vec::new();
        let mut heading = None;
        for stage in stages {
            let is_shown = stage.id == board.stage;
            for rules in &stage.revisions {
                let newest = rules.revision == stage.rules.revision;
                if is_shown && rules.revision == board.revision || (!is_shown && !newest) {
                    continue;
                }
                others.push(OtherBoard {
                    label: if is_shown {
                        format!("{}, rules of {}", stage.name, minute(rules.since))
                    } else {
                        stage.name.to_string()
                    },
                    query: if is_shown {
                        format!("?stage={}&revision={}", stage.id, rules.revision)
                    } else {
                        format!("?stage={}", stage.id)
                    },
                });
            }
            if is_shown {
                heading = Some(Self {
                    times: times(&stage),
                    next: stage.next_cut.map(|next| next.to_string()),
                    rules: (stage.revisions.len() > 1).then(|| {
                        format!("revision {}, since {}", board.revision, minute(board.since))
                    }),
                    stage: stage.name.to_string(),
                    others: Vec::new(),
                    divisions: app.store.divisions().await.map_err(Problem::from)?,
                    division: board.division.clone(),
                    of_all: format!("?stage={}&revision={}", board.stage, board.revision),
                    paused: None,
                    frozen: board.frozen.clone(),
                    rows: standing::rows(board),
                    weights: board.weights,
                    tier_bounds: board.tier_bounds,
                    own_magnitudes: board.perturbations.is_some(),
                    still_to_come: standing::still_to_come(board),
                    blind: standing::blind(board, is_hidden),
                    is_hidden,
                    result: standing::result(board),
                });
            }
        }
        let heading = heading.ok_or_else(|| Problem::internal("a board without its stage"))?;
        Ok(Self {
            others,
            paused,
            ..heading
        })
    }
}

fn minute(at: Timestamp) -> String {
    at.strftime("%Y-%m-%d %H:%M UTC").to_string()
}

fn times(stage: &StageView) -> String {
    let there = |at: Timestamp| {
        let there = at.to_zoned(stage.zone.time_zone());
        format!("{} {}", there.strftime("%Y-%m-%d %H:%M:%S"), stage.zone)
    };
    match (stage.phase, stage.closes_at) {
        (PhaseView::Upcoming, _) => format!("opens {}", there(stage.opens_at)),
        (PhaseView::Open, Some(at)) => format!("open until {}", there(at)),
        (PhaseView::Open, None) => "open".to_owned(),
        (PhaseView::Closed, at) => format!("closed {}", there(at.unwrap_or(stage.opens_at))),
    }
}

#[derive(Template)]
#[template(path = "board.html")]
struct OverallPage {
    frame: Frame,
    today: civil::Date,
    heading: Heading,
    commitment: String,
    setting: Option<String>,
    tiers: Vec<TierRows<OverallRow>>,
    baselines: Vec<Baseline>,
    under_way: Vec<UnderWay>,
    disqualified: Vec<TeamView>,
}

/// The overall board.
pub(super) async fn overall(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    query: Result<QueryParams<BoardQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let QueryParams(query) = query?;
    let sight = Sight::of(&app, viewer?).await?;
    let season = SeasonHead::now(&app).await?;
    let board = BoardView::asked(&app, &sight, query, None).await?;
    let today = app.store.stage(board.stage).await.map_err(Problem::from)?;
    let today = today.day(app.config.clock.now());
    let setting = common_setting(&board.rows);
    let mut under_way = under_way(&app, &sight, today).await?;
    if let Some(division) = &board.division {
        let mut teams = TeamView::all(&app).await?;
        teams.retain(|team| team.division.as_ref() == Some(division));
        under_way.retain(|of| teams.iter().any(|team| team.name.as_str() == of.team));
    }
    let page = OverallPage {
        frame: Frame::of(&app, season.name, "/"),
        today: today.date,
        heading: Heading::of(&app, &board, &sight, season.paused).await?,
        commitment: season.commitment,
        tiers: by_tier(&board, |row| OverallRow::of(row, setting.as_ref())),
        baselines: baselines::of(&board),
        setting,
        under_way,
        disqualified: board.disqualified,
    };
    render(&page)
}

async fn under_way(
    app: &App,
    sight: &Sight,
    today: StageDay,
) -> Result<Vec<UnderWay>, PageProblem> {
    let evaluations = EvaluationView::current(app, sight, today).await?;
    let under_way = evaluations.into_iter().filter_map(|evaluation| {
        let state = match evaluation.status {
            _ if evaluation.voided.is_some() => "Voided by the organiser",
            EvaluationStatus::Finished { .. } => return None,
            // How it went is not told.
            EvaluationStatus::AgentFailed { .. } if evaluation.blind => return None,
            EvaluationStatus::Queued => "Queued",
            EvaluationStatus::Running => "Running",
            EvaluationStatus::Finalising => "Computing the score",
            EvaluationStatus::AgentFailed { .. } => {
                "The agent failed; its team sees why when the day is released"
            }
            EvaluationStatus::PlatformFailed { .. } => "Stopped by our fault",
            EvaluationStatus::NotPlayed { .. } => "Not played in time: our capacity",
            EvaluationStatus::Cancelled { .. } => "Cancelled by the organiser",
        };
        let moving = !evaluation.status.is_final();
        Some(UnderWay {
            team: evaluation.team_name.to_string(),
            evaluation: evaluation.id,
            state,
            progress: moving.then_some(evaluation.progress),
        })
    });
    Ok(under_way.collect())
}

struct TaskRow {
    who: Who,
    rate: Rate,
    penalty_points: String,
    per_episode: String,
    details: Option<TaskDetails>,
}

/// What is told of a row once its day is released.
struct TaskDetails {
    violations: ViolationCounts,
    mean_ms: String,
    p99_ms: String,
    max_ms: String,
}

impl TaskDetails {
    fn of(result: &TaskView) -> Option<Self> {
        let time = result.computation_time_s?;
        Some(Self {
            violations: result.violations?,
            mean_ms: figures::milliseconds(time.mean),
            p99_ms: figures::milliseconds(time.p99),
            max_ms: figures::milliseconds(time.max),
        })
    }
}

impl TaskRow {
    fn of(row: &BoardRow, result: &TaskView, common_setting: Option<&String>) -> Self {
        Self {
            who: Who::of(row, common_setting),
            rate: Rate::of(result),
            penalty_points: figures::one(result.penalty_points),
            per_episode: figures::per_episode(
                result.penalty_points,
                of_a_day(row, result.episodes),
            ),
            details: TaskDetails::of(result),
        }
    }
}

#[derive(Template)]
#[template(path = "task.html")]
struct TaskPage {
    frame: Frame,
    heading: Heading,
    title: &'static str,
    aim: &'static str,
    setting: Option<String>,
    tiers: Vec<TierRows<TaskRow>>,
    baselines: Vec<Baseline>,
}

/// The board of one task.
pub(super) async fn by_task(
    viewer: Result<Viewer, Problem>,
    State(app): State<App>,
    task: Result<PathParam<Task>, Problem>,
    query: Result<QueryParams<BoardQuery>, Problem>,
) -> Result<Response, PageProblem> {
    let (PathParam(task), QueryParams(query)) = (task?, query?);
    let sight = Sight::of(&app, viewer?).await?;
    let season = SeasonHead::now(&app).await?;
    let (title, aim) = match task {
        Task::Hit => (
            "Hit",
            "Score a goal against an opponent that moves in a fixed pattern.",
        ),
        Task::Defend => (
            "Defend",
            "Stop an incoming puck on the own side of the table.",
        ),
        Task::Prepare => (
            "Prepare",
            "Bring a puck from the border to a good hitting position.",
        ),
    };
    let mut board = BoardView::asked(&app, &sight, query, Some(task)).await?;
    // The board leaves out teams without the task; a row without one could show nothing.
    board.rows.retain(|row| row.tasks.contains_key(&task));
    let setting = common_setting(&board.rows);
    let tiers = by_tier(&board, |row| {
        TaskRow::of(row, &row.tasks[&task], setting.as_ref())
    });
    let frame = Frame::of(&app, season.name, format!("/tasks/{task}"));
    render(&TaskPage {
        frame,
        heading: Heading::of(&app, &board, &sight, season.paused).await?,
        title,
        aim,
        setting,
        tiers,
        baselines: baselines::of(&board),
    })
}
