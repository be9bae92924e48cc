//! The days of a board, and the ranks of the day before.

use crate::{
    app::AppState,
    boxed,
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
    /// The board of the day before its newest one; `None` on the first day, and if the rows showed other evaluations
    /// then.
    pub before: Option<EarlierBoard>,
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
    /// The timeline of a board as it is shown; `live` includes results after a freeze.
    #[boxed]
    pub async fn load(
        app: &AppState,
        visibility: &Visibility,
        board: &BoardView,
        live: bool,
    ) -> Result<Self, Problem> {
        let mut timeline = Self {
            days: Vec::new(),
            before: None,
        };
        if visibility.is_hidden(board.stage) {
            return Ok(timeline);
        }
        let frozen = board.frozen.as_ref().filter(|_| !live);
        let scope = BoardScope {
            finished_until: frozen.map(|frozen| frozen.at),
            ..BoardScope::default()
        };
        let days = app.store.board_days(board.stage, board.revision, &scope);
        timeline.days = days.await?;
        let earlier = timeline.days.iter().rev();
        let mut earlier = earlier.skip_while(|day| board.day.is_some_and(|shown| **day > shown));
        // The first one is the board's own day.
        if let Some(day) = earlier.nth(1).copied() {
            let scope = BoardScope {
                last_day: Some(day),
                ..scope
            };
            timeline.before = Self::before(app, board, scope, day).await?;
        }
        Ok(timeline)
    }

    async fn before(
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
        let (by, task) = (board.rows_by, board.task);
        let results = (&scope, Vec::new());
        let mut rows = board_rows::rows(app, &stage, board.revision, results, by, task).await?;
        rows.retain(|row| {
            let division = &row.record.team.profile.division;
            board.division.is_none() || board.division == *division || row.record.team.is_baseline
        });
        let all = board_rows::rank(rows, task, |row| &row.record);
        let (ranked, _) = board_rows::split_baselines(all, |row| row.record.team.is_baseline);
        let teams = ranked.into_iter().map(|ranked| {
            let record = ranked.entry.key.record;
            let earlier = EarlierRank {
                rank: ranked.rank,
                score: score(&record.result, task),
            };
            (record.team.id, earlier)
        });
        Ok(Some(EarlierBoard {
            day,
            teams: teams.collect(),
        }))
    }
}

fn score(result: &EvaluationResult, task: Option<Task>) -> f64 {
    match task.and_then(|task| result.tasks.get(&task)) {
        Some(of_task) => 100.0 * of_task.success_rate,
        None => result.score,
    }
}
