//! How the score came about: a chart over the game's time, the same as a table, and the puck's ways into the goals.

use super::live::{at, before};
use crate::{chart::Course, table_drawing::way};
use faceoff_replay::{Break, BreakKind, GameAnalysis};

pub(super) struct TimeLine {
    pub(super) chart: Course,
    pub(super) rows: Vec<Row>,
    /// Rallies that ended without goal or foul.
    pub(super) others: usize,
    /// Each side's ways into the goal: SVG paths.
    pub(super) ways: [String; 2],
}

/// A goal or a foul, or another end of a rally.
pub(super) struct Row {
    pub(super) at: String,
    /// The replay a little before.
    pub(super) link: String,
    pub(super) what: &'static str,
    pub(super) who: String,
    pub(super) score: [u32; 2],
}

impl TimeLine {
    pub(super) fn of(analysis: &GameAnalysis, teams: &[String; 2]) -> Self {
        let GameAnalysis { breaks, steps, .. } = analysis;
        let ways = [0, 1].map(|side| {
            let goals = analysis.goals.iter().filter(|goal| goal.side == side);
            goals.map(|goal| way(&goal.places)).collect()
        });
        let is_told = |end: &&Break| matches!(end.what, BreakKind::Goal | BreakKind::Foul);
        let rows: Vec<Row> = breaks
            .iter()
            .filter(|end| end.what != BreakKind::GameOver)
            .map(|end| Row {
                at: at(end.sample),
                link: before(end.sample),
                what: word(end.what),
                who: match end.by {
                    Some(0) => teams[0].clone(),
                    Some(_) => teams[1].clone(),
                    None => "–".to_owned(),
                },
                score: end.score,
            })
            .collect();
        Self {
            chart: Course::of(
                *steps,
                breaks.iter().filter(is_told).map(|end| {
                    let foul_by = (end.what == BreakKind::Foul)
                        .then_some(end.by)
                        .flatten()
                        .map(|by| usize::from(by == 1));
                    (end.sample, end.score, foul_by)
                }),
                teams,
            ),
            others: breaks.iter().filter(|end| !is_told(end)).count(),
            ways,
            rows,
        }
    }
}

impl TimeLine {
    pub(super) fn has_goals(&self) -> bool {
        self.ways.iter().any(|ways| !ways.is_empty())
    }
}

const fn word(what: BreakKind) -> &'static str {
    match what {
        BreakKind::Goal => "goal",
        BreakKind::Foul => "foul",
        BreakKind::Stuck => "stuck in the middle",
        BreakKind::LeftTable => "left the table",
        BreakKind::Diverged => "simulation diverged",
        BreakKind::GameOver => "end of the game",
    }
}
