//! Queries of boards, which rank the teams of a stage, and of their history.

use faceoff_types::{CountingResult, DivisionName, StageId, Task};
use jiff::civil::Date;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};

/// Selects a board.
#[derive(Debug, Clone, Default, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct BoardQuery {
    /// The board's stage. Default: the open stage, or the one nearest in time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<StageId>,
    /// Revision of the stage's rules. Default: the newest revision with results. A board never mixes two revisions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub revision: Option<u32>,
    /// Rank only the teams of this division, among themselves. Default: all teams.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// Use only results up to this day, which must have results. Default: all days.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub day: Option<Date>,
    /// Which of a team's evaluations its row shows. Default: as the stage's setting `standings` says.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(inline)]
    pub by: Option<BoardBy>,
    /// Whether to include evaluations that finished after the boards were frozen. For organisers only.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[param(required = false)]
    pub live: bool,
    /// Format of the response. Default: the one that the header `Accept` prefers, else JSON.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(inline)]
    pub format: Option<BoardFormat>,
}

/// Which of a team's evaluations a board row shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BoardBy {
    /// The one that ranks highest on the board.
    Best,
    /// The newest.
    Latest,
}

impl BoardBy {
    /// The stage setting that selects the same evaluations.
    pub const fn counting_result(self) -> CountingResult {
        match self {
            Self::Best => CountingResult::Best,
            Self::Latest => CountingResult::Latest,
        }
    }
}

/// Format of a board response.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BoardFormat {
    /// JSON.
    Json,
    /// CSV with a header line.
    Csv,
    /// CSV for spreadsheets in countries that write 1.5, with a byte order mark.
    Spreadsheet,
    /// CSV for spreadsheets in countries that write 1,5, with semicolons and a byte order mark.
    SpreadsheetComma,
}

/// Query of a board page: the board, and how it is sorted.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoardPageQuery {
    /// See [`BoardQuery::stage`].
    pub stage: Option<StageId>,
    /// See [`BoardQuery::revision`].
    pub revision: Option<u32>,
    /// See [`BoardQuery::division`].
    pub division: Option<DivisionName>,
    /// See [`BoardQuery::day`].
    pub day: Option<Date>,
    /// See [`BoardQuery::by`].
    pub by: Option<BoardBy>,
    /// See [`BoardQuery::live`].
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub live: bool,
    /// The column that sorts the rows. Default: board order, which is by tier, then by score.
    pub sort: Option<BoardSort>,
}

impl BoardPageQuery {
    /// The board that the page shows.
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

/// The column that sorts a board, the best value first. In a query `-` before the column's name reverses the order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct BoardSort {
    /// The column that sorts the rows.
    pub column: BoardColumn,
    /// Whether the worst value comes first.
    pub is_reversed: bool,
}

/// A column of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoardColumn {
    /// Board order: by tier, then by score.
    Rank,
    /// The team's name.
    Team,
    /// The overall score; on a task's board the success rate.
    Score,
    /// A task's success rate.
    Task(Task),
    /// Penalty points.
    Points,
}

impl BoardColumn {
    /// The column's name in a query.
    pub fn as_str(&self) -> &str {
        match self {
            // Another name than "place" would break links to sorted boards.
            Self::Rank => "place",
            Self::Team => "team",
            Self::Score => "score",
            Self::Task(task) => task.as_str(),
            Self::Points => "points",
        }
    }

    /// The column with this name; others than those of every board are named like their task.
    fn from_name(name: &str) -> Option<Self> {
        let of_every_board = [Self::Rank, Self::Team, Self::Score, Self::Points];
        let found = of_every_board
            .into_iter()
            .find(|column| column.as_str() == name);
        found.or_else(|| name.parse().ok().map(Self::Task))
    }
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
        let column = BoardColumn::from_name(name);
        let unknown = || {
            "expected sort to be place, team, score, points or the name of a task, with a - before it to reverse the order"
                .to_owned()
        };
        column
            .map(|column| Self {
                column,
                is_reversed,
            })
            .ok_or_else(unknown)
    }
}

/// Query of a team's page.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TeamPageQuery {
    /// The stage whose results the page shows. Default: the open stage, or the one nearest in time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<StageId>,
}

/// Selects the history of a board: the results of all teams, day by day.
#[derive(Debug, Clone, Default, Serialize, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct HistoryQuery {
    /// The stage. Default: the open stage, or the one nearest in time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<StageId>,
    /// Revision of the stage's rules. Default: the newest revision with results.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub revision: Option<u32>,
    /// Rank only the teams of this division, among themselves. Default: all teams.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub division: Option<DivisionName>,
    /// Rank by this task. Default: by all tasks together.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub task: Option<Task>,
    /// Which of a team's evaluations ranks it. Default: as the stage's setting `standings` says.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(inline)]
    pub by: Option<BoardBy>,
    /// Whether to include evaluations that finished after the boards were frozen. For organisers only.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[param(required = false)]
    pub live: bool,
    /// Format of the response. Default: the one that the header `Accept` prefers, else JSON.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[param(inline)]
    pub format: Option<BoardFormat>,
}
