//! About boards.

use faceoff_types::{DivisionName, StageId, Standings, Task};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// Which board.
#[derive(Debug, Clone, Default, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct BoardQuery {
    /// Whose; without it that of the stage that is open, or of the nearest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<StageId>,
    /// By which of the stage's rules; without it by the newest with results. No board mixes two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub revision: Option<u32>,
    /// Of the teams of one of the season's divisions alone, ranked among themselves; without it of all teams.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// As it stood by the results of the days up to this one, a day that has some; without it by all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub day: Option<Date>,
    /// Which result of a team its row is, whatever the stage's standings say.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(inline)]
    pub by: Option<BoardBy>,
    /// The organiser: with what was finished since the boards were frozen.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[param(required = false)]
    pub live: bool,
    /// As what it is sent; without it as the header `Accept` says, and JSON if that says nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(inline)]
    pub format: Option<BoardFormat>,
}

/// Which result of a team its row on a board is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BoardBy {
    /// The one that stands highest by the board's order.
    Best,
    /// The newest.
    Latest,
}

impl BoardBy {
    /// The standings that these rows are made by.
    pub const fn standings(self) -> Standings {
        match self {
            Self::Best => Standings::Best,
            Self::Latest => Standings::Latest,
        }
    }
}

/// As what a board is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BoardFormat {
    /// As everything else.
    Json,
    /// A table for spreadsheets, with a line of names.
    Csv,
}

/// Which board a page shows, and in which order.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardPageQuery {
    /// As of [`BoardQuery`].
    pub stage: Option<StageId>,
    /// As of [`BoardQuery`].
    pub revision: Option<u32>,
    /// As of [`BoardQuery`].
    pub division: Option<DivisionName>,
    /// As of [`BoardQuery`].
    pub day: Option<Date>,
    /// As of [`BoardQuery`].
    pub by: Option<BoardBy>,
    /// As of [`BoardQuery`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub live: bool,
    /// By which column; without it in board order, tier by tier.
    pub sort: Option<BoardSort>,
}

impl BoardPageQuery {
    /// The board itself.
    pub fn board(&self) -> BoardQuery {
        BoardQuery {
            stage: self.stage,
            revision: self.revision,
            division: self.division.clone(),
            day: self.day,
            by: self.by,
            live: self.live,
            format: None,
        }
    }
}

/// A column that a board is sorted by; the better first, or with a `-` before its name the worse.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct BoardSort {
    /// Which.
    pub column: BoardColumn,
    /// The other way round.
    pub is_reversed: bool,
}

/// A column of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoardColumn {
    /// Board order: tiers, and inside of them the score.
    Place,
    /// By name.
    Team,
    /// The overall score, or on a task's board the success rate.
    Score,
    /// A task's success rate.
    Task(Task),
    /// Penalty points.
    Points,
}

impl BoardColumn {
    /// As a query names it.
    pub const fn as_str(self) -> &'static str {
        match self {
            Self::Place => "place",
            Self::Team => "team",
            Self::Score => "score",
            Self::Task(task) => task.as_str(),
            Self::Points => "points",
        }
    }

    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Place,
        Self::Team,
        Self::Score,
        Self::Task(Task::Hit),
        Self::Task(Task::Defend),
        Self::Task(Task::Prepare),
        Self::Points,
    ];
}

impl From<BoardSort> for String {
    fn from(sort: BoardSort) -> Self {
        let sign = if sort.is_reversed { "-" } else { "" };
        format!("{sign}{}", sort.column.as_str())
    }
}

impl TryFrom<String> for BoardSort {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        let (name, is_reversed) = match text.strip_prefix('-') {
            Some(name) => (name, true),
            None => (text.as_str(), false),
        };
        let column = BoardColumn::ALL
            .into_iter()
            .find(|column| column.as_str() == name);
        let unknown = || {
            let names = BoardColumn::ALL.map(BoardColumn::as_str).join(", ");
            format!("sort is one of {names}, with a - before it for the other way round")
        };
        column
            .map(|column| Self {
                column,
                is_reversed,
            })
            .ok_or_else(unknown)
    }
}

/// Of which stage a team's page tells.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TeamPageQuery {
    /// Without it of the one that is open, or of the nearest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<StageId>,
}

/// What all teams have played, day by day.
#[derive(Debug, Clone, Default, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct HistoryQuery {
    /// Of which stage; without it that of the stage that is open, or of the nearest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<StageId>,
    /// By which of the stage's rules; without it by the newest with results.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub revision: Option<u32>,
    /// Of the teams of one of the season's divisions alone, ranked among themselves; without it of all teams.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// Ranked by this task alone; without it by all together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub task: Option<Task>,
    /// By which result of a team it was ranked, whatever the stage's standings say.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(inline)]
    pub by: Option<BoardBy>,
    /// The organiser: with what was finished since the boards were frozen.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[param(required = false)]
    pub live: bool,
    /// As what it is sent, as for a board.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(inline)]
    pub format: Option<BoardFormat>,
}
