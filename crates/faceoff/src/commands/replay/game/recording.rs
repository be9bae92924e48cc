//! A recorded game with the texts of its page.

use super::clock;
use anyhow::{Context, bail};
use faceoff_dataset::game::{GameCourse, GamePositions, ListedRally};
use faceoff_types::{Side, escape_unprintable};
use std::path::Path;

/// Positions of the mallets before the first control step, which are not recorded: near each side's end of the table, m.
const INITIAL_MALLETS: [[f64; 2]; 2] = [[-0.8, 0.0], [0.8, 0.0]];

/// A recorded game.
pub struct RecordedGame {
    /// Score, rallies, violations and faults.
    pub course: GameCourse,
    /// The displayed names of the sides: their agents' names, followed by the side's number if both names are equal.
    pub agents: [String; 2],
    /// The positions after 0, 1, 2 … control steps.
    pub samples: Vec<GamePositions>,
}

impl RecordedGame {
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let course = GameCourse::read(path)
            .with_context(|| format!("reading {} as a recorded game", path.display()))?;
        let names = course
            .score
            .sides
            .each_ref()
            .map(|side| escape_unprintable(&side.agent).into_owned());
        let agents = if names[0] == names[1] {
            Side::BOTH.map(|side| format!("{} ({})", names[0], side.number()))
        } else {
            names
        };
        let Some(first) = course.rallies.first() else {
            bail!(
                "{} has no rally, so there is nothing to draw",
                path.display()
            );
        };
        let start = GamePositions {
            puck: first.initial_puck,
            mallets: course
                .positions
                .first()
                .map_or(INITIAL_MALLETS, |first| first.mallets),
        };
        let samples = std::iter::once(start)
            .chain(course.positions.iter().copied())
            .collect();
        Ok(Self {
            course,
            agents,
            samples,
        })
    }

    /// A rally by its number, from 0.
    pub fn rally(&self, number: u32) -> anyhow::Result<&ListedRally> {
        let rallies = &self.course.rallies;
        rallies.get(number as usize).with_context(|| {
            format!(
                "--rally: there is no rally {number}: the game has {}, from 0 (faceoff dataset list shows them)",
                rallies.len()
            )
        })
    }

    pub fn last_rally(&self) -> &ListedRally {
        let rallies = &self.course.rallies;
        rallies.last().expect("a game without a rally is refused")
    }

    /// The positions in a rally. It begins with the puck's serve, and where the mallets are after the first step.
    pub fn rally_samples(&self, rally: &ListedRally) -> Vec<GamePositions> {
        let steps = rally.game_step as usize + 1..rally.end_step() as usize + 1;
        let samples = &self.samples[steps];
        let start = GamePositions {
            puck: rally.initial_puck,
            mallets: samples
                .first()
                .unwrap_or(&self.samples[rally.game_step as usize])
                .mallets,
        };
        std::iter::once(start)
            .chain(samples.iter().copied())
            .collect()
    }

    /// The name of a side by its number, 1 or 2.
    pub fn agent(&self, side: u32) -> &str {
        &self.agents[usize::from(side == 2)]
    }

    pub fn headline(&self) -> String {
        let [home, away] = &self.agents;
        let [first, second] = self.course.score.sides.each_ref().map(|side| side.score);
        format!("{home} {first} : {second} {away}")
    }

    /// Winner and reason.
    pub fn result(&self) -> String {
        let result = self.course.score.result();
        match result.winner() {
            Some(side) => format!("winner: {} ({result})", self.agents[side as usize]),
            None => format!("a draw ({result})"),
        }
    }

    /// Time and end of a rally.
    pub fn rally_text(&self, rally: &ListedRally) -> String {
        let end = match (rally.end.as_str(), rally.by) {
            ("game_over", _) => "the game is over".to_owned(),
            ("stuck", _) => "stuck in the middle".to_owned(),
            ("left_table", _) => "left the table".to_owned(),
            (end, Some(side)) => format!("{end} by {}", self.agent(side)),
            (end, None) => escape_unprintable(end).into_owned(),
        };
        format!(
            "rally {}, {} to {}: {end}",
            rally.rally,
            clock::text(rally.game_step),
            clock::text(rally.end_step())
        )
    }
}
