//! The highlight of a board as a drawing that moves: an episode from above at half speed. `live.js` starts it, unless the visitor has
//! asked for less motion; until then it is a still picture.

use super::{
    replay,
    table_drawing::{self, Position, TableOutline},
};
use faceoff_replay::model::{PUCK, TOOL};
use faceoff_service::views::highlight::TeamHighlight;
use faceoff_types::Competition;
use jiff::civil::Date;
use std::iter;

/// One position of each body per this number of samples: 25 per second of the episode.
const SAMPLES_PER_FRAME: usize = 2;
/// Still frames at the end of each loop.
const FINAL_FRAMES: usize = 20;
const SLOWDOWN: f64 = 2.0;

/// A drawing that moves, in `highlight.html`.
pub(super) struct HighlightLoop {
    pub(super) team: String,
    pub(super) day: Date,
    /// What the team achieved, such as "goal".
    pub(super) achievement: String,
    /// Length of the episode, s.
    pub(super) episode_s: String,
    /// The page of its replay.
    pub(super) address: String,
    pub(super) table: TableOutline,
    pub(super) path: String,
    /// Duration of one loop, s.
    pub(super) loop_s: String,
    pub(super) bodies: Vec<Body>,
}

/// A disc that moves.
pub(super) struct Body {
    pub(super) class: &'static str,
    /// mm.
    pub(super) radius: f64,
    /// Last position, mm.
    pub(super) last: [String; 2],
    /// Positions, mm, as values of an SVG animation.
    pub(super) values: [String; 2],
}

impl HighlightLoop {
    /// `None` without a highlight.
    pub(super) fn new(found: &TeamHighlight, competition: &Competition) -> Option<Self> {
        let highlight = found.highlight.as_ref().as_ref()?;
        let motion = &highlight.motion;
        let puck = motion.puck_positions();
        let mallets = [0, 1].map(|robot| motion.mallet_positions(robot));
        let frames = puck.len().div_ceil(SAMPLES_PER_FRAME) + FINAL_FRAMES;
        let [puck_mm, mallet_mm] = [PUCK.radius_m, TOOL.cylinder_radius_m].map(|m| 1e3 * m);
        let classes = ["disc mallet", "disc opponent"];
        let mallets = mallets.iter().zip(classes);
        let bodies =
            mallets.filter_map(|(positions, class)| Body::new(class, mallet_mm, positions));
        let info = competition.task(highlight.task)?;
        Some(Self {
            team: found.team.clone(),
            day: found.day,
            achievement: info.achievement.clone(),
            episode_s: format!(
                "{:.1}",
                competition.duration_s(highlight.task, highlight.steps)
            ),
            address: replay::page_path(found.evaluation, highlight.task, highlight.episode),
            table: TableOutline::new(),
            path: table_drawing::path(&puck),
            loop_s: format!(
                "{:.2}",
                SLOWDOWN * motion.header.step_s * to_f64(SAMPLES_PER_FRAME * frames)
            ),
            bodies: bodies
                .chain(Body::new("disc puck", puck_mm, &puck))
                .collect(),
        })
    }
}

impl Body {
    /// `None` without positions.
    fn new(class: &'static str, radius: f64, positions: &[Position]) -> Option<Self> {
        let last = *positions.last()?;
        let frames = positions.iter().step_by(SAMPLES_PER_FRAME).copied();
        let frames: Vec<Position> = frames.chain(iter::repeat_n(last, FINAL_FRAMES)).collect();
        let text = |index: usize| {
            move |position: &Position| table_drawing::to_svg(*position)[index].to_string()
        };
        Some(Self {
            class,
            radius,
            last: [0, 1].map(|index| text(index)(&last)),
            values: [0, 1].map(|index| {
                let values: Vec<String> = frames.iter().map(text(index)).collect();
                values.join(";")
            }),
        })
    }
}

/// Exact for numbers of samples.
fn to_f64(count: usize) -> f64 {
    f64::from(u32::try_from(count).unwrap_or(u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn body_moves_through_its_positions_and_rests_at_the_last() {
        let positions = [[0.0, 0.1], [0.1, 0.1], [0.2, -0.1]];
        let body = Body::new("disc", 30.0, &positions).unwrap();
        let [x, y] = body.values.each_ref().map(|values| values.split(';'));
        assert_eq!(x.clone().count(), 2 + FINAL_FRAMES);
        assert_eq!(x.clone().take(3).collect::<Vec<_>>(), ["0", "200", "200"]);
        assert_eq!(
            y.clone().take(3).collect::<Vec<_>>(),
            ["-100", "100", "100"]
        );
        assert_eq!(body.last, ["200", "100"]);
        assert!(Body::new("disc", 30.0, &[]).is_none());
    }
}
