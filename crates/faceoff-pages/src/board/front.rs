//! The front page, above the board: what the competition is, who leads, when the next evaluation is, and how to take part.

use super::rows::{Group, OverallRow};
use crate::{assets, format::in_words, frame::PageProblem, highlight::HighlightLoop};
use faceoff_api::views::board::BoardView;
use faceoff_service::{
    app::App,
    views::{highlight, visibility::Visibility},
};
use faceoff_types::{AnnouncementId, Competition, TeamId};
use jiff::Timestamp;

pub(super) struct FrontPage {
    pub(super) title: String,
    pub(super) summary: String,
    pub(super) leader: Option<Leader>,
    /// Path of the page that says how to take part: the registration, if it is open, else the first steps.
    pub(super) take_part: &'static str,
    pub(super) news: Option<News>,
    pub(super) highlight: Option<HighlightLoop>,
    /// The style sheet of the highlight.
    pub(super) style: &'static str,
    pub(super) tasks: Vec<TaskCard>,
}

/// The first team of the board.
pub(super) struct Leader {
    pub(super) team: String,
    pub(super) id: TeamId,
    /// Score and ends of its interval, percent.
    pub(super) score: String,
    pub(super) low: String,
    pub(super) high: String,
    /// The teams that are statistically tied with it: a name or their number.
    pub(super) tied_with: Option<String>,
}

/// The newest announcement.
pub(super) struct News {
    pub(super) id: AnnouncementId,
    pub(super) title: String,
    pub(super) at: Timestamp,
}

/// A task with its drawing.
pub(super) struct TaskCard {
    pub(super) title: String,
    pub(super) aim: String,
    pub(super) drawing: String,
    pub(super) address: String,
    /// Its share of the score, percent.
    pub(super) share: String,
}

impl FrontPage {
    pub(super) async fn load(
        app: &App,
        visibility: &Visibility,
        board: &BoardView,
        groups: &[Group<OverallRow>],
        takes_registrations: bool,
    ) -> Result<Self, PageProblem> {
        let competition = app.config.competition();
        let highlight = match competition.has_replays {
            true => highlight::of_board(app, visibility, &board.rows).await,
            false => None,
        };
        let announcements = app.store.announcements(1).await?;
        Ok(Self {
            title: competition.title.clone(),
            summary: competition.summary.clone(),
            leader: Leader::find(board, groups),
            take_part: match takes_registrations {
                true => "/register",
                false => "/docs/start",
            },
            news: announcements.into_iter().next().map(|newest| News {
                id: newest.id,
                title: newest.title,
                at: newest.at,
            }),
            highlight: highlight
                .as_ref()
                .and_then(|found| HighlightLoop::new(found, competition)),
            style: assets::EPISODES_STYLE.url(),
            tasks: task_cards(competition, board),
        })
    }
}

impl Leader {
    fn find(board: &BoardView, groups: &[Group<OverallRow>]) -> Option<Self> {
        let first = board.rows.first()?;
        let row = groups.iter().flat_map(|group| &group.rows).next()?;
        // Rows of the same rank group are statistically tied.
        let others = board.rows.iter().skip(1);
        let tied: Vec<_> = others
            .filter(|other| other.rank_group == first.rank_group)
            .collect();
        let whole = |percent: &str| percent.parse().map_or_else(|_| percent.to_owned(), round);
        Some(Self {
            team: first.team.to_string(),
            id: first.team_id,
            score: whole(&row.score.percent),
            low: whole(&row.score.low),
            high: whole(&row.score.high),
            tied_with: match &tied[..] {
                [] => None,
                [other] => Some(other.team.to_string()),
                others => Some(format!("{} teams", in_words(others.len()))),
            },
        })
    }
}

fn round(percent: f64) -> String {
    format!("{percent:.0}")
}

fn task_cards(competition: &Competition, board: &BoardView) -> Vec<TaskCard> {
    let cards = competition.tasks.iter().map(|info| TaskCard {
        title: info.title.clone(),
        aim: info.aim.clone(),
        drawing: info.drawing.clone(),
        address: format!("/tasks/{}", info.task),
        share: round(100.0 * board.weights.weight(info.task).as_f64()),
    });
    cards.collect()
}
