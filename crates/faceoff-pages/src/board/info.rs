//! Information about a board, around its table: stage, notices, rules, and links to other boards.

use super::address::Address;
use crate::{
    board_status,
    format::{in_words, utc_minute},
    frame::PageProblem,
};
use faceoff_api::views::{
    board::BoardView,
    day::NextCutoff,
    decision::DecisionView,
    stage::{PhaseView, StageView},
};
use faceoff_service::{
    app::App,
    problem::Problem,
    views::{stage, visibility::Visibility},
};
use faceoff_types::{Competition, DivisionName, Task, TaskInfo, TaskWeights, TierBounds};
use jiff::Timestamp;
use std::iter;

pub(super) struct BoardInfo {
    pub(super) stage: String,
    /// Dates of the stage.
    pub(super) dates: String,
    pub(super) next_evaluation: Option<NextEvaluation>,
    /// The revision of the rules, if the stage has several.
    pub(super) rules: Option<String>,
    /// The stages, if there are several.
    pub(super) stages: Vec<Tab>,
    /// Boards of other revisions of the rules of this stage.
    pub(super) other_boards: Vec<OtherBoard>,
    /// Divisions with a board of their own; `division` is the shown one.
    pub(super) divisions: Vec<DivisionName>,
    pub(super) division: Option<DivisionName>,
    /// Query of this board with all teams.
    pub(super) all_teams: String,
    /// The queue is paused.
    pub(super) paused: Option<DecisionView>,
    /// The organisers have *frozen* the board: it hides all later results.
    pub(super) frozen: Option<DecisionView>,
    /// What a row contains, for the caption of the table.
    pub(super) rows_caption: String,
    /// The shares of the tasks in the score, as a sum.
    pub(super) weighted_sum: String,
    /// The number of tasks, in words.
    pub(super) task_count: String,
    /// Penalty points by kind of violation.
    pub(super) points_by_violation: String,
    /// `None` in a competition without tiers.
    pub(super) tier_bounds: Option<TierBounds>,
    /// The stage has its own magnitudes of the perturbations.
    pub(super) has_own_magnitudes: bool,
    /// Set while only the final day counts and it is still to come.
    pub(super) final_day_notice: Option<&'static str>,
    /// Who sees a *blind* board, whose results are hidden until the organisers reveal them.
    pub(super) blind_notice: Option<&'static str>,
    /// Is the board hidden from the viewer?
    pub(super) is_hidden: bool,
    /// Whether the result of the stage is provisional or signed off, as a sentence.
    pub(super) result_status: String,
    pub(super) is_provisional: bool,
    /// The tasks with columns of their own; empty on the board of a task.
    pub(super) task_columns: Vec<TaskInfo>,
    /// The overall board and the boards of the tasks.
    pub(super) tabs: Vec<Tab>,
}

/// A link to the board of another revision of the rules.
pub(super) struct OtherBoard {
    pub(super) label: String,
    pub(super) query: String,
}

/// A link to the board of a stage, or to the board of a task in the same stage and on the same day.
pub(super) struct Tab {
    pub(super) name: String,
    pub(super) address: String,
    pub(super) is_shown: bool,
}

impl BoardInfo {
    pub(super) async fn load(
        app: &App,
        board: &BoardView,
        visibility: &Visibility,
        address: &Address<'_>,
        paused: Option<DecisionView>,
    ) -> Result<Self, PageProblem> {
        let is_hidden = visibility.hides_scores(board.stage);
        let stages = stage::all(app).await?;
        let mut other_boards = Vec::new();
        let mut info = None;
        let stage_tab = |stage: &StageView| Tab {
            name: stage.name.to_string(),
            address: format!("{}?stage={}", address.path(), stage.id),
            is_shown: stage.id == board.stage,
        };
        let stage_tabs = match &stages[..] {
            [_, _, ..] => stages.iter().map(stage_tab).collect(),
            _ => Vec::new(),
        };
        for stage in stages {
            if stage.id == board.stage {
                let other_revisions = stage.revisions.iter();
                let other_revisions =
                    other_revisions.filter(|rules| rules.revision != board.revision);
                other_boards.extend(other_revisions.map(|rules| OtherBoard {
                    label: format!("rules of {}", utc_minute(rules.since)),
                    query: format!("?stage={}&revision={}", stage.id, rules.revision),
                }));
                info = Some(Self {
                    dates: stage_dates(&stage),
                    next_evaluation: stage.next_cutoff.as_ref().map(NextEvaluation::new),
                    rules: (stage.revisions.len() > 1).then(|| {
                        format!(
                            "revision {}, since {}",
                            board.revision,
                            utc_minute(board.since)
                        )
                    }),
                    stage: stage.name.to_string(),
                    stages: Vec::new(),
                    other_boards: Vec::new(),
                    divisions: app.store.divisions().await?,
                    division: board.division.clone(),
                    all_teams: format!("?stage={}&revision={}", board.stage, board.revision),
                    paused: None,
                    frozen: board.frozen.clone(),
                    rows_caption: board_status::rows_caption(board),
                    weighted_sum: weighted_sum(app.config.competition(), &board.weights),
                    task_count: in_words(app.config.competition().tasks.len()),
                    points_by_violation: points_by_violation(app.config.competition()),
                    tier_bounds: board.tier_bounds,
                    has_own_magnitudes: board.perturbations.is_some(),
                    final_day_notice: board_status::final_day_notice(board),
                    blind_notice: board_status::blind_notice(board, is_hidden),
                    is_hidden,
                    result_status: board_status::result_status(board),
                    is_provisional: board.provisional,
                    task_columns: match board.task {
                        Some(_) => Vec::new(),
                        None => app.config.competition().tasks.clone(),
                    },
                    tabs: tabs(app.config.competition(), board.task, address),
                });
            }
        }
        let info = info.ok_or_else(|| Problem::internal("board without its stage"))?;
        Ok(Self {
            stages: stage_tabs,
            other_boards,
            paused,
            ..info
        })
    }
}

/// Time of the next evaluation of the stage.
pub(super) struct NextEvaluation {
    /// `None` where an organiser starts the day.
    pub(super) at: Option<Timestamp>,
    pub(super) text: String,
}

impl NextEvaluation {
    fn new(next: &NextCutoff) -> Self {
        let text = match next.at {
            Some(at) => {
                let local = at.to_zoned(next.zone.time_zone());
                format!("{} {}", local.strftime("%-d %B, %H:%M"), next.zone)
            }
            None => format!(
                "{} at the earliest (started by the organisers)",
                next.day.strftime("%-d %B")
            ),
        };
        Self { at: next.at, text }
    }
}

/// The overall board, and the board of each task.
fn tabs(competition: &Competition, shown: Option<Task>, address: &Address<'_>) -> Vec<Tab> {
    let tab = |task: Option<Task>, name: &str, path: &str| Tab {
        name: name.to_owned(),
        address: address.with_path(path),
        is_shown: task == shown,
    };
    let task_tabs = competition.tasks.iter().map(|info| {
        tab(
            Some(info.task),
            &info.title,
            &format!("/tasks/{}", info.task),
        )
    });
    iter::once(tab(None, "Overall", "/"))
        .chain(task_tabs)
        .collect()
}

/// Such as `0.4 × hit + 0.6 × defend`.
fn weighted_sum(competition: &Competition, weights: &TaskWeights) -> String {
    let terms = competition
        .task_names()
        .map(|task| format!("{} × {task}", weights.weight(task)));
    terms.collect::<Vec<_>>().join(" + ")
}

/// Such as `out of bounds 3, late answers 0.5 to 2`.
fn points_by_violation(competition: &Competition) -> String {
    let kinds = competition
        .violations
        .iter()
        .map(|kind| format!("{} {}", kind.description, kind.points_text()));
    kinds.collect::<Vec<_>>().join(", ")
}

fn stage_dates(stage: &StageView) -> String {
    let local = |at: Timestamp| {
        let local = at.to_zoned(stage.zone.time_zone());
        format!("{} {}", local.strftime("%Y-%m-%d %H:%M:%S"), stage.zone)
    };
    match (stage.phase, stage.closes_at) {
        (PhaseView::Upcoming, _) => format!("opens {}", local(stage.opens_at)),
        (PhaseView::Open, Some(at)) => format!("open until {}", local(at)),
        (PhaseView::Open, None) => "open".to_owned(),
        (PhaseView::Closed, at) => format!("closed {}", local(at.unwrap_or(stage.opens_at))),
    }
}
