//! Whose board a page is, and which others there are.

use super::address::Address;
use crate::{figures::minute, frame::PageProblem, standing};
use faceoff_api::views::{
    board::BoardView,
    day::NextCut,
    ruling::RulingView,
    stage::{PhaseView, StageView},
};
use faceoff_service::{
    app::App,
    problem::Problem,
    views::{sight::Sight, stage},
};
use faceoff_types::{DivisionName, Task, TaskWeights, TierBounds};
use jiff::Timestamp;

/// What stands above a board.
pub(super) struct Heading {
    pub(super) stage: String,
    /// Since when, until when.
    pub(super) times: String,
    /// When the next day starts.
    pub(super) next: Option<NextCut>,
    /// Of the rules, if the stage has had several.
    pub(super) rules: Option<String>,
    pub(super) others: Vec<OtherBoard>,
    /// Of which the board can be asked for; with the one that is shown, if one is.
    pub(super) divisions: Vec<DivisionName>,
    pub(super) division: Option<DivisionName>,
    /// The query that asks for this board of all teams.
    pub(super) of_all: String,
    /// The organiser holds the queue.
    pub(super) paused: Option<RulingView>,
    /// The organiser has frozen the board.
    pub(super) frozen: Option<RulingView>,
    /// What its rows are, for the table's caption.
    pub(super) rows: String,
    /// What the tasks weigh, and the bounds of the tiers.
    pub(super) weights: TaskWeights,
    pub(super) tier_bounds: TierBounds,
    /// The perturbations have magnitudes of their own.
    pub(super) own_magnitudes: bool,
    /// What decides in the end, if that is something else.
    pub(super) still_to_come: Option<&'static str>,
    /// Who sees it, if not everybody.
    pub(super) blind: Option<&'static str>,
    /// Is it hidden from the viewer?
    pub(super) is_hidden: bool,
    pub(super) result: String,
    pub(super) is_provisional: bool,
    /// The overall board and those of the tasks.
    pub(super) tabs: Vec<Tab>,
}

pub(super) struct OtherBoard {
    pub(super) label: String,
    /// The query that asks for it.
    pub(super) query: String,
}

/// A board of the same stage and day.
pub(super) struct Tab {
    pub(super) name: &'static str,
    pub(super) address: String,
    pub(super) is_shown: bool,
}

/// The overall board's and the tasks' names, with their paths.
const TABS: [(Option<Task>, &str, &str); 4] = [
    (None, "Overall", "/"),
    (Some(Task::Hit), "Hit", "/tasks/hit"),
    (Some(Task::Defend), "Defend", "/tasks/defend"),
    (Some(Task::Prepare), "Prepare", "/tasks/prepare"),
];

impl Heading {
    pub(super) async fn of(
        app: &App,
        board: &BoardView,
        sight: &Sight,
        address: &Address<'_>,
        paused: Option<RulingView>,
    ) -> Result<Self, PageProblem> {
        let is_hidden = sight.is_hidden(board.stage);
        let stages = stage::all(app).await?;
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
                    next: stage.next_cut.clone(),
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
                    is_provisional: board.provisional,
                    tabs: tabs(board.task, address),
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

fn tabs(shown: Option<Task>, address: &Address<'_>) -> Vec<Tab> {
    let tab = |(task, name, path): (Option<Task>, &'static str, &str)| Tab {
        name,
        address: address.at(path),
        is_shown: task == shown,
    };
    TABS.into_iter().map(tab).collect()
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
