//! The days of a board: which there are, and how it stood a day before.

use crate::{
    app::AppState,
    boxed,
    problem::Problem,
    views::{sight::Sight, standings},
};
use faceoff_api::views::board::BoardView;
use faceoff_store::BoardScope;
use faceoff_types::{EvaluationResult, Standings, Task, TeamId};
use jiff::civil::Date;
use std::collections::BTreeMap;

/// The days that a board can be asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Trail {
    /// Those with results, the earlier first.
    pub days: Vec<Date>,
    /// How it stood by the results of the day before its newest one; `None` on the first, and where it was made of
    /// something else then.
    pub before: Option<Before>,
}

/// A board of an earlier day.
#[derive(Debug, Clone, PartialEq)]
pub struct Before {
    pub day: Date,
    teams: BTreeMap<TeamId, Stood>,
}

/// Where a team stood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stood {
    /// Its place, from 1.
    pub rank: u32,
    /// In percent: the overall score, or the task's success rate.
    pub score: f64,
}

impl Before {
    /// `None` of who was not on the board.
    pub fn stood(&self, team: TeamId) -> Option<Stood> {
        self.teams.get(&team).copied()
    }
}

impl Trail {
    /// Of a board as it is shown; `live`: with what a freeze leaves out.
    #[boxed]
    pub async fn of(
        app: &AppState,
        sight: &Sight,
        board: &BoardView,
        live: bool,
    ) -> Result<Self, Problem> {
        let mut trail = Self {
            days: Vec::new(),
            before: None,
        };
        if sight.is_hidden(board.stage) {
            return Ok(trail);
        }
        let frozen = board.frozen.as_ref().filter(|_| !live);
        let scope = BoardScope {
            until: frozen.map(|frozen| frozen.at),
            ..BoardScope::default()
        };
        let days = app.store.board_days(board.stage, board.revision, &scope);
        trail.days = days.await?;
        let earlier = trail.days.iter().rev();
        let mut earlier = earlier.skip_while(|day| board.day.is_some_and(|shown| **day > shown));
        // The first of them is the board's own.
        if let Some(day) = earlier.nth(1).copied() {
            let scope = BoardScope {
                until_day: Some(day),
                ..scope
            };
            trail.before = Self::before(app, board, scope, day).await?;
        }
        Ok(trail)
    }

    async fn before(
        app: &AppState,
        board: &BoardView,
        scope: BoardScope,
        day: Date,
    ) -> Result<Option<Before>, Problem> {
        let stage = app.store.stage(board.stage).await?;
        let then = standings::within(app, &stage, &scope).await?;
        if board.rows_by == Standings::Final && then != Standings::Final {
            return Ok(None);
        }
        let (by, task) = (board.rows_by, board.task);
        let results = (&scope, Vec::new());
        let mut rows = standings::rows(app, &stage, board.revision, results, by, task).await?;
        rows.retain(|row| {
            let of = &row.record.team.profile.division;
            board.division.is_none() || board.division == *of || row.record.team.is_baseline
        });
        let all = standings::ranked(rows, task, |row| &row.record);
        let (ranked, _) = standings::apart(all, |row| row.record.team.is_baseline);
        let teams = ranked.into_iter().map(|ranked| {
            let record = ranked.entry.key.record;
            let stood = Stood {
                rank: ranked.rank,
                score: score(&record.result, task),
            };
            (record.team.id, stood)
        });
        Ok(Some(Before {
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
