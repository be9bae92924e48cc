//! Timeline of a board: the days for which it can be requested, and the ranks on the previous day with results.

use crate::{
    app::AppState,
    boxed_future,
    problem::Problem,
    views::{board_rows, visibility::Visibility},
};
use faceoff_api::views::board::BoardView;
use faceoff_store::BoardScope;
use faceoff_types::{CountingResult, EvaluationResult, Task, TeamId};
use jiff::civil::Date;
use std::collections::BTreeMap;

/// The days for which a board can be requested.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardTimeline {
    /// Days with results, earliest first.
    pub days: Vec<Date>,
    /// The board of the day before the board's own day; `None` on the first day. Also `None` if the board shows the results of
    /// the final day, because earlier boards showed other evaluations.
    pub previous_board: Option<EarlierBoard>,
}

/// A board of an earlier day.
#[derive(Debug, Clone, PartialEq)]
pub struct EarlierBoard {
    pub day: Date,
    teams: BTreeMap<TeamId, EarlierRank>,
}

/// A team's rank and score on an earlier day.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EarlierRank {
    /// From 1.
    pub rank: u32,
    /// In percent: the overall score, or the task's success rate.
    pub score: f64,
}

impl EarlierBoard {
    /// The team's rank; `None` if it was not on the board.
    pub fn rank_of(&self, team: TeamId) -> Option<EarlierRank> {
        self.teams.get(&team).copied()
    }
}

impl BoardTimeline {
    /// The timeline of a board as it is shown; `is_live` includes results after a freeze of the boards.
    #[boxed_future]
    pub async fn load(
        app: &AppState,
        visibility: &Visibility,
        board: &BoardView,
        is_live: bool,
    ) -> Result<Self, Problem> {
        let mut timeline = Self {
            days: Vec::new(),
            previous_board: None,
        };
        if visibility.hides_scores(board.stage) {
            return Ok(timeline);
        }
        let frozen = board.frozen.as_ref().filter(|_| !is_live);
        let scope = BoardScope {
            finished_until: frozen.map(|frozen| frozen.at),
            ..BoardScope::default()
        };
        let days = app.store.board_days(board.stage, board.revision, &scope);
        timeline.days = days.await?;
        let newest_first = timeline.days.iter().rev();
        let mut days_until_board =
            newest_first.skip_while(|day| board.day.is_some_and(|board_day| **day > board_day));
        // The first of them is the board's own day.
        if let Some(day) = days_until_board.nth(1).copied() {
            let scope = BoardScope {
                last_day: Some(day),
                ..scope
            };
            timeline.previous_board = Self::load_earlier(app, board, scope, day).await?;
        }
        Ok(timeline)
    }

    async fn load_earlier(
        app: &AppState,
        board: &BoardView,
        scope: BoardScope,
        day: Date,
    ) -> Result<Option<EarlierBoard>, Problem> {
        let stage = app.store.stage(board.stage).await?;
        let earlier_result = board_rows::counting_result(app, &stage, &scope).await?;
        if board.rows_by == CountingResult::Final && earlier_result != CountingResult::Final {
            return Ok(None);
        }
        let (rows_by, task) = (board.rows_by, board.task);
        let results = (&scope, Vec::new());
        let mut rows =
            board_rows::rows(app, &stage, board.revision, results, rows_by, task).await?;
        rows.retain(|row| {
            let division = &row.record.team.profile.division;
            board.division.is_none() || board.division == *division || row.record.team.is_baseline
        });
        let all_ranked = board_rows::rank(rows, task, |row| &row.record);
        let (ranked, _) =
            board_rows::split_baselines(all_ranked, |row| row.record.team.is_baseline);
        let teams = ranked.into_iter().map(|ranked| {
            let record = ranked.entry.key.record;
            let earlier_rank = EarlierRank {
                rank: ranked.rank,
                score: score_percent(&record.result, task),
            };
            (record.team.id, earlier_rank)
        });
        Ok(Some(EarlierBoard {
            day,
            teams: teams.collect(),
        }))
    }
}

/// The overall score, or the success rate of the task.
fn score_percent(result: &EvaluationResult, task: Option<Task>) -> f64 {
    match task.and_then(|task| result.tasks.get(&task)) {
        Some(task_result) => 100.0 * task_result.success_rate,
        None => result.score,
    }
}
