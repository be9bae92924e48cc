//! Timeline of the score of a game. A game consists of rallies; a rally ends with a goal, with a foul, or without a result,
//! such as with a stuck puck. The page shows a chart of the score over time, the ends of rallies as a table, and the paths of
//! the puck into the goals.

use super::live::{game_clock, replay_link};
use crate::{chart::ScoreChart, table_drawing::path};
use faceoff_replay::{GameAnalysis, RallyEndEvent, RallyEndKind};

pub(super) struct ScoreTimeline {
    pub(super) chart: ScoreChart,
    pub(super) rows: Vec<Row>,
    /// Number of rallies that ended without goal or foul.
    pub(super) others: usize,
    /// Paths of the puck into the goals of each side; SVG paths.
    pub(super) goal_paths: [String; 2],
}

/// The end of a rally.
pub(super) struct Row {
    /// Minutes and seconds of the game.
    pub(super) time: String,
    /// The replay two seconds earlier.
    pub(super) link: String,
    pub(super) event: &'static str,
    pub(super) team: String,
    pub(super) score: [u32; 2],
}

impl ScoreTimeline {
    pub(super) fn new(analysis: &GameAnalysis, teams: &[String; 2]) -> Self {
        let GameAnalysis {
            rally_ends, steps, ..
        } = analysis;
        let goal_paths = [0, 1].map(|side| {
            let goals = analysis.goals.iter().filter(|goal| goal.side == side);
            goals.map(|goal| path(&goal.positions)).collect()
        });
        let changes_score =
            |end: &&RallyEndEvent| matches!(end.kind, RallyEndKind::Goal | RallyEndKind::Foul);
        let rows: Vec<Row> = rally_ends
            .iter()
            .filter(|end| end.kind != RallyEndKind::GameOver)
            .map(|end| Row {
                time: game_clock(end.sample),
                link: replay_link(end.sample),
                event: end_label(end.kind),
                team: match end.by {
                    Some(0) => teams[0].clone(),
                    Some(_) => teams[1].clone(),
                    None => "–".to_owned(),
                },
                score: end.score,
            })
            .collect();
        Self {
            chart: ScoreChart::new(
                *steps,
                rally_ends.iter().filter(changes_score).map(|end| {
                    let foul_by = (end.kind == RallyEndKind::Foul)
                        .then_some(end.by)
                        .flatten()
                        .map(|side| usize::from(side == 1));
                    (end.sample, end.score, foul_by)
                }),
                teams,
            ),
            others: rally_ends.iter().filter(|end| !changes_score(end)).count(),
            goal_paths,
            rows,
        }
    }
}

impl ScoreTimeline {
    pub(super) fn has_goals(&self) -> bool {
        self.goal_paths.iter().any(|paths| !paths.is_empty())
    }
}

const fn end_label(kind: RallyEndKind) -> &'static str {
    match kind {
        RallyEndKind::Goal => "goal",
        RallyEndKind::Foul => "foul",
        RallyEndKind::Stuck => "stuck in the middle",
        RallyEndKind::LeftTable => "left the table",
        RallyEndKind::Diverged => "simulation diverged",
        RallyEndKind::GameOver => "end of the game",
    }
}
