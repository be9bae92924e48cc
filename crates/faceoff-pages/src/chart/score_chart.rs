//! A chart of the score of a game over time, with the fouls of both sides.

use super::scale::{BOTTOM, LEFT, RIGHT, Scale, Tick, round_up, without_trailing_zeros};
use crate::format;
use faceoff_replay::model::CONTROL_STEP_S;

/// Height of each of the two rows of foul marks below the plot, in units of the drawing.
const FOUL_ROW_HEIGHT: f64 = 16.0;

/// Score of both sides over the time of a game, in the form that `chart.html` draws: a step line per side, and marks for fouls.
#[derive(Debug)]
pub(crate) struct ScoreChart {
    /// Step line of each side; SVG paths.
    pub(crate) paths: [String; 2],
    /// Fouls of each side; SVG paths of triangles.
    pub(crate) fouls: [String; 2],
    /// y of the rows of fouls.
    pub(crate) foul_rows: [String; 2],
    pub(crate) minutes: Vec<Tick>,
    pub(crate) grid: Vec<Tick>,
    /// Text alternative for screen readers.
    pub(crate) description: String,
}

impl ScoreChart {
    /// `steps`: control steps of the game. `changes`: step, score after it, and the side that fouled, if it was a foul.
    pub(crate) fn new(
        steps: u32,
        changes: impl Iterator<Item = (u32, [u32; 2], Option<usize>)>,
        teams: &[String; 2],
    ) -> Self {
        let changes: Vec<_> = changes.collect();
        let last = changes.last().map_or([0; 2], |(_, score, _)| *score);
        let max = round_up(f64::from(last[0].max(last[1]).max(4)));
        let scale = Scale { max };
        let x = |step: u32| {
            LEFT + (RIGHT - LEFT) * (f64::from(step) / f64::from(steps.max(1))).clamp(0.0, 1.0)
        };
        let foul_y = [0.0, 1.0].map(|row| BOTTOM + FOUL_ROW_HEIGHT * (0.75 + row));
        let mut paths = [0, 1].map(|_| {
            format!(
                "M{} {}",
                format::one_decimal(LEFT),
                format::one_decimal(BOTTOM)
            )
        });
        let mut fouls = [String::new(), String::new()];
        for (step, score, foul_by) in &changes {
            for (path, score) in paths.iter_mut().zip(score) {
                path.push_str(&format!(
                    "H{}V{}",
                    format::one_decimal(x(*step)),
                    format::one_decimal(scale.y(f64::from(*score)))
                ));
            }
            if let Some(side) = foul_by.filter(|side| *side < 2) {
                fouls[side].push_str(&format!(
                    "M{} {}l4 7h-8z",
                    format::one_decimal(x(*step)),
                    format::one_decimal(foul_y[side] - 4.0)
                ));
            }
        }
        for path in &mut paths {
            path.push_str(&format!("H{}", format::one_decimal(RIGHT)));
        }
        let minutes = f64::from(steps) * CONTROL_STEP_S / 60.0;
        let ticks = [0.0, 0.5, 1.0].map(|share| Tick {
            position: format::one_decimal(LEFT + share * (RIGHT - LEFT)),
            label: without_trailing_zeros(share * minutes, 1),
        });
        let foul_count = |side: usize| {
            let fouls = changes
                .iter()
                .filter(|(_, _, foul_by)| *foul_by == Some(side));
            fouls.count()
        };
        Self {
            paths,
            fouls,
            foul_rows: foul_y.map(|y| format::one_decimal(y + 4.0)),
            minutes: ticks.into(),
            grid: scale.grid(),
            description: format!(
                "Score over {} minutes: {} {}, {} {}; fouls {} and {}; the table below lists each",
                without_trailing_zeros(minutes, 1),
                teams[0],
                last[0],
                teams[1],
                last[1],
                foul_count(0),
                foul_count(1)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn score_steps_at_changes_and_fouls_are_in_their_row() {
        let teams = ["A", "B"].map(str::to_owned);
        let changes = [(1500, [1, 0], None), (3000, [1, 1], Some(0))];
        let chart = ScoreChart::new(3000, changes.into_iter(), &teams);
        assert_eq!(
            chart.paths[0], "M38.0 140.0H192.0V108.0H346.0V108.0H346.0",
            "half of the time, a quarter of the height"
        );
        assert_eq!(chart.paths[1], "M38.0 140.0H192.0V140.0H346.0V108.0H346.0");
        assert_eq!(chart.fouls, ["M346.0 148.0l4 7h-8z", ""].map(str::to_owned));
        assert!(
            chart.description.contains("A 1, B 1; fouls 1 and 0"),
            "{}",
            chart.description
        );
        let none = ScoreChart::new(0, std::iter::empty(), &teams);
        assert_eq!(none.paths[0], "M38.0 140.0H346.0");
    }
}
