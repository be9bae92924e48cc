//! How the score came about: a chart over the game's time, and the same as a table.

use super::live::at;
use crate::pages::chart::Course;
use faceoff_replay::{Break, BreakKind};

/// The time line.
pub(super) struct TimeLine {
    pub(super) chart: Course,
    pub(super) rows: Vec<Row>,
    /// Rallies that ended without goal or foul.
    pub(super) others: usize,
}

/// A goal or a foul, or another end of a rally.
pub(super) struct Row {
    pub(super) at: String,
    pub(super) what: &'static str,
    pub(super) who: String,
    pub(super) score: [u32; 2],
}

impl TimeLine {
    pub(super) fn of(breaks: &[Break], steps: u32, teams: &[String; 2]) -> Self {
        let is_told = |end: &&Break| matches!(end.what, BreakKind::Goal | BreakKind::Foul);
        let rows: Vec<Row> = breaks
            .iter()
            .filter(|end| end.what != BreakKind::GameOver)
            .map(|end| Row {
                at: at(end.sample),
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
                steps,
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
            rows,
        }
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
