//! How the score of a game came about.

use super::scale::{BOTTOM, LEFT, RIGHT, Scale, Tick, nice, trimmed};
use crate::figures;
use faceoff_replay::model::CONTROL_STEP_S;

/// Rows of a course's fouls below its plot, from each other.
const FOUL_ROW: f64 = 16.0;

/// A count of two sides over the time of a game, ready to be drawn by `chart.html`: a stair for each, and marks for fouls.
#[derive(Debug)]
pub(crate) struct Course {
    /// The stairs; SVG paths.
    pub(crate) paths: [String; 2],
    /// Each side's fouls: SVG paths of triangles.
    pub(crate) fouls: [String; 2],
    /// Where the rows of fouls lie.
    pub(crate) foul_rows: [String; 2],
    pub(crate) minutes: Vec<Tick>,
    pub(crate) grid: Vec<Tick>,
    /// What it shows in a sentence, for whoever does not see it.
    pub(crate) told: String,
}

impl Course {
    /// Of what changes the score in so many control steps: when, the score afterwards, and who fouled if it was a foul.
    pub(crate) fn of(
        steps: u32,
        changes: impl Iterator<Item = (u32, [u32; 2], Option<usize>)>,
        teams: &[String; 2],
    ) -> Self {
        let changes: Vec<_> = changes.collect();
        let last = changes.last().map_or([0; 2], |(_, score, _)| *score);
        let most = nice(f64::from(last[0].max(last[1]).max(4)));
        let scale = Scale { most };
        let x = |step: u32| {
            LEFT + (RIGHT - LEFT) * (f64::from(step) / f64::from(steps.max(1))).clamp(0.0, 1.0)
        };
        let foul_y = [0.0, 1.0].map(|row| BOTTOM + FOUL_ROW * (0.75 + row));
        let mut paths = [0, 1].map(|_| format!("M{} {}", figures::one(LEFT), figures::one(BOTTOM)));
        let mut fouls = [String::new(), String::new()];
        for (step, score, foul_by) in &changes {
            for (path, score) in paths.iter_mut().zip(score) {
                path.push_str(&format!(
                    "H{}V{}",
                    figures::one(x(*step)),
                    figures::one(scale.y(f64::from(*score)))
                ));
            }
            if let Some(side) = foul_by.filter(|side| *side < 2) {
                fouls[side].push_str(&format!(
                    "M{} {}l4 7h-8z",
                    figures::one(x(*step)),
                    figures::one(foul_y[side] - 4.0)
                ));
            }
        }
        for path in &mut paths {
            path.push_str(&format!("H{}", figures::one(RIGHT)));
        }
        let minutes = f64::from(steps) * CONTROL_STEP_S / 60.0;
        let ticks = [0.0, 0.5, 1.0].map(|share| Tick {
            at: figures::one(LEFT + share * (RIGHT - LEFT)),
            word: trimmed(share * minutes, 1),
        });
        let of_fouls = |side: usize| {
            let those = changes.iter().filter(|(_, _, by)| *by == Some(side));
            those.count()
        };
        Self {
            paths,
            fouls,
            foul_rows: foul_y.map(|y| figures::one(y + 4.0)),
            minutes: ticks.into(),
            grid: scale.grid(),
            told: format!(
                "Score over {} minutes: {} {}, {} {}; fouls {} and {}; the table below has each",
                trimmed(minutes, 1),
                teams[0],
                last[0],
                teams[1],
                last[1],
                of_fouls(0),
                of_fouls(1)
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_score_rises_when_it_changes_and_a_foul_stands_in_its_sides_row() {
        let teams = ["A", "B"].map(str::to_owned);
        let changes = [(1500, [1, 0], None), (3000, [1, 1], Some(0))];
        let course = Course::of(3000, changes.into_iter(), &teams);
        assert_eq!(
            course.paths[0], "M38.0 140.0H192.0V108.0H346.0V108.0H346.0",
            "half of the time, a quarter of the height"
        );
        assert_eq!(course.paths[1], "M38.0 140.0H192.0V140.0H346.0V108.0H346.0");
        assert_eq!(
            course.fouls,
            ["M346.0 148.0l4 7h-8z", ""].map(str::to_owned)
        );
        assert!(
            course.told.contains("A 1, B 1; fouls 1 and 0"),
            "{}",
            course.told
        );
        let none = Course::of(0, std::iter::empty(), &teams);
        assert_eq!(none.paths[0], "M38.0 140.0H346.0");
    }
}
