//! The heading of a board: stage, notices, rules, and links to other boards.

use super::address::Address;
use crate::{board_status, figures::utc_minute, frame::PageProblem};
use faceoff_api::views::{
    board::BoardView,
    day::NextCutoff,
    ruling::RulingView,
    stage::{PhaseView, StageView},
};
use faceoff_service::{
    app::App,
    problem::Problem,
    views::{stage, visibility::Visibility},
};
use faceoff_types::{DivisionName, Task, TaskWeights, TierBounds};
use jiff::Timestamp;

pub(super) struct Heading {
    pub(super) stage: String,
    /// Dates of the stage.
    pub(super) dates: String,
    pub(super) next_evaluation: Option<NextEvaluation>,
    /// The revision of the rules, if the stage has several.
    pub(super) rules: Option<String>,
    /// Boards of other stages, and of other revisions of the rules of this one.
    pub(super) other_boards: Vec<OtherBoard>,
    /// Divisions with a board of their own; `division` is the shown one.
    pub(super) divisions: Vec<DivisionName>,
    pub(super) division: Option<DivisionName>,
    /// Query of this board with all teams.
    pub(super) all_teams: String,
    /// The queue is paused.
    pub(super) paused: Option<RulingView>,
    /// The organisers have *frozen* the board: it hides all later results.
    pub(super) frozen: Option<RulingView>,
    /// What a row contains, for the caption of the table.
    pub(super) rows_caption: String,
    pub(super) weights: TaskWeights,
    pub(super) tier_bounds: TierBounds,
    /// The stage has its own magnitudes of the perturbations.
    pub(super) has_own_magnitudes: bool,
    /// Set while only the final day counts and it is still to come.
    pub(super) final_day_notice: Option<&'static str>,
    /// Who sees a *blind* board, whose results are hidden until the organisers reveal them.
    pub(super) blind_notice: Option<&'static str>,
    /// Is it hidden from the viewer?
    pub(super) is_hidden: bool,
    pub(super) result_status: String,
    pub(super) is_provisional: bool,
    /// The overall board and the boards of the tasks.
    pub(super) tabs: Vec<Tab>,
}

pub(super) struct OtherBoard {
    pub(super) label: String,
    pub(super) query: String,
}

/// A board of the same stage and day.
pub(super) struct Tab {
    pub(super) name: &'static str,
    pub(super) address: String,
    pub(super) is_shown: bool,
}

/// Task, name and path of each board.
const TABS: [(Option<Task>, &str, &str); 4] = [
    (None, "Overall", "/"),
    (Some(Task::Hit), "Hit", "/tasks/hit"),
    (Some(Task::Defend), "Defend", "/tasks/defend"),
    (Some(Task::Prepare), "Prepare", "/tasks/prepare"),
];

impl Heading {
    pub(super) async fn load(
        app: &App,
        board: &BoardView,
        visibility: &Visibility,
        address: &Address<'_>,
        paused: Option<RulingView>,
    ) -> Result<Self, PageProblem> {
        let is_hidden = visibility.is_hidden(board.stage);
        let stages = stage::all(app).await?;
        let mut other_boards = Vec::new();
        let mut heading = None;
        for stage in stages {
            let is_shown = stage.id == board.stage;
            for rules in &stage.revisions {
                let newest = rules.revision == stage.rules.revision;
                if is_shown && rules.revision == board.revision || (!is_shown && !newest) {
                    continue;
                }
                other_boards.push(OtherBoard {
                    label: if is_shown {
                        format!("{}, rules of {}", stage.name, utc_minute(rules.since))
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
                    other_boards: Vec::new(),
                    divisions: app.store.divisions().await?,
                    division: board.division.clone(),
                    all_teams: format!("?stage={}&revision={}", board.stage, board.revision),
                    paused: None,
                    frozen: board.frozen.clone(),
                    rows_caption: board_status::rows_caption(board),
                    weights: board.weights,
                    tier_bounds: board.tier_bounds,
                    has_own_magnitudes: board.perturbations.is_some(),
                    final_day_notice: board_status::final_day_notice(board),
                    blind_notice: board_status::blind_notice(board, is_hidden),
                    is_hidden,
                    result_status: board_status::result_status(board),
                    is_provisional: board.provisional,
                    tabs: tabs(board.task, address),
                });
            }
        }
        let heading = heading.ok_or_else(|| Problem::internal("board without its stage"))?;
        Ok(Self {
            other_boards,
            paused,
            ..heading
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

fn tabs(shown: Option<Task>, address: &Address<'_>) -> Vec<Tab> {
    let tab = |(task, name, path): (Option<Task>, &'static str, &str)| Tab {
        name,
        address: address.with_path(path),
        is_shown: task == shown,
    };
    TABS.into_iter().map(tab).collect()
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
