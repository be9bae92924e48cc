//! The replay of a game on its page and alone, to embed in other sites: addresses of the recording, and the events of the game, from
//! which the script draws the time line before it has loaded any part of the recording.

use crate::{
    assets,
    embeddable::Embeddable,
    frame::{Frame, NO_ENTRY, PageProblem, render},
};
use askama::Template;
use axum::{extract::State, response::Response};
use faceoff_api::{
    paths,
    views::game::{GameStatus, GameView},
};
use faceoff_replay::{Constraint, GameAnalysis, LocatedViolation, RallyEndKind};
use faceoff_service::{
    app::App,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{game, game_clips::GameClips},
};
use faceoff_types::{GameId, Side};
use serde_json::json;

/// The replay of a game in `game_replay.html`. The script loads one chunk of the recording after another.
pub(super) struct GameReplay {
    pub(super) teams: [String; 2],
    pub(super) tournament: String,
    /// Address of the clips of the motion, with `{chunk}` for the number of the chunk.
    pub(super) motion_url: String,
    /// Address of the clips of observations and commands of the side whose clips the viewer may see; `None` if there is none.
    pub(super) observed_url: Option<String>,
    /// Control steps of the game, plus one.
    pub(super) samples: u32,
    /// Ends of rallies and violations of the whole game as JSON; `None` if results are hidden.
    pub(super) events_json: Option<String>,
    /// Is the replay embedded in another site?
    pub(super) is_embedded: bool,
}

#[derive(Template)]
#[template(path = "game_embedded.html")]
struct EmbeddedPage {
    frame: Frame,
    id: GameId,
    replay: GameReplay,
    styles: [&'static str; 2],
    script: &'static str,
}

/// Largest number of ranges of violations on the time line, which is about a thousand pixels wide.
const MAX_RANGES: usize = 250;

/// Violations of a side that are less than a gap apart.
#[derive(Debug, PartialEq)]
struct ViolationRange {
    side: usize,
    from: u32,
    to: u32,
    constraints: Vec<Constraint>,
    count: u32,
}

/// The replay alone, for other sites: always the public view, whether or not the visitor is signed in.
pub(crate) async fn embedded(
    State(app): State<App>,
    id: Result<PathParam<GameId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let view = game::find(&app, Viewer::Visitor, id).await?;
    let GameStatus::Played { result, .. } = &view.status else {
        return Err(Problem::new(ProblemKind::Conflict, "the game has no result yet").into());
    };
    let clips = GameClips::find(&app, Viewer::Visitor, id).await?;
    let analysis = clips.analysis(&app, result.steps).await?;
    let mut response = render(&EmbeddedPage {
        frame: Frame::without_season(NO_ENTRY),
        id,
        replay: GameReplay {
            observed_url: None,
            is_embedded: true,
            ..GameReplay::new(&view, &clips, result.steps, Some(&analysis))
        },
        styles: [assets::EPISODES_STYLE.url(), assets::REPLAY_STYLE.url()],
        script: assets::REPLAY_SCRIPT.url(),
    })?;
    response.extensions_mut().insert(Embeddable);
    Ok(response)
}

impl GameReplay {
    /// `analysis`: `None` if results are hidden.
    pub(super) fn new(
        view: &GameView,
        clips: &GameClips,
        steps: u32,
        analysis: Option<&GameAnalysis>,
    ) -> Self {
        let api = paths::game(view.id);
        let visible_side = Side::BOTH
            .into_iter()
            .find(|side| clips.can_see_observations[side.index()]);
        Self {
            teams: view.sides.each_ref().map(|side| side.team_name.to_string()),
            tournament: view.tournament_name.to_string(),
            motion_url: format!("{api}/motion/{{chunk}}"),
            observed_url: visible_side
                .map(|side| format!("{api}/sides/{}/observed/{{chunk}}", side.number())),
            samples: steps.saturating_add(1),
            events_json: analysis.map(events_json),
            is_embedded: false,
        }
    }
}

/// The events of a game as the script reads them: each end of a rally as `[sample, kind, side, score, score]`, and each range of
/// violations as `[first sample, last sample, side, constraints, number]`.
fn events_json(analysis: &GameAnalysis) -> String {
    let rally_ends = analysis
        .rally_ends
        .iter()
        .filter(|end| end.kind != RallyEndKind::GameOver)
        .map(|end| json!([end.sample, end.kind, end.by, end.score[0], end.score[1]]));
    let violations = violation_ranges(&analysis.violations)
        .into_iter()
        .map(|range| {
            let constraints: Vec<String> = range
                .constraints
                .iter()
                .map(|constraint| constraint.name().to_string())
                .collect();
            json!([
                range.from,
                range.to,
                range.side,
                constraints.join(" "),
                range.count
            ])
        });
    json!({
        "ends": rally_ends.collect::<Vec<_>>(),
        "violations": violations.collect::<Vec<_>>(),
    })
    .to_string()
}

/// Joins violations of a side that are close to each other, until there are few enough ranges.
fn violation_ranges(violations: &[LocatedViolation]) -> Vec<ViolationRange> {
    // Half a second of the game, which is doubled while there are too many ranges.
    let mut gap_steps = 25;
    loop {
        let ranges = joined(violations, gap_steps);
        if ranges.len() <= MAX_RANGES {
            return ranges;
        }
        gap_steps *= 2;
    }
}

/// Ranges of violations with gaps of at most `gap_steps`. `violations` are in the order of their first sample.
fn joined(violations: &[LocatedViolation], gap_steps: u32) -> Vec<ViolationRange> {
    let mut ranges: Vec<ViolationRange> = Vec::new();
    for violation in violations {
        let last = ranges
            .iter_mut()
            .rfind(|range| range.side == violation.side);
        match last {
            Some(last) if violation.first_sample <= last.to.saturating_add(gap_steps) => {
                last.to = last.to.max(violation.last_sample);
                last.count += 1;
                if !last.constraints.contains(&violation.constraint) {
                    last.constraints.push(violation.constraint);
                }
            }
            _ => ranges.push(ViolationRange {
                side: violation.side,
                from: violation.first_sample,
                to: violation.last_sample,
                constraints: vec![violation.constraint],
                count: 1,
            }),
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;

    fn violation(side: usize, constraint: Constraint, first_sample: u32) -> LocatedViolation {
        LocatedViolation {
            side,
            constraint,
            first_sample,
            last_sample: first_sample + 1,
            max_excess: 0.1,
            mallet_position: [0.0; 2],
        }
    }

    #[test]
    fn close_violations_of_a_side_are_one_range() {
        let ranges = violation_ranges(&[
            violation(0, Constraint::Ee, 10),
            violation(1, Constraint::Ee, 12),
            violation(0, Constraint::JointVel, 20),
            violation(0, Constraint::Ee, 900),
        ]);
        let spans: Vec<_> = ranges
            .iter()
            .map(|range| (range.side, range.from, range.to, range.count))
            .collect();
        assert_eq!(spans, [(0, 10, 21, 2), (1, 12, 13, 1), (0, 900, 901, 1)]);
        assert_eq!(
            ranges[0].constraints,
            [Constraint::Ee, Constraint::JointVel]
        );
    }

    #[test]
    fn number_of_violation_ranges_is_limited() {
        let many: Vec<_> = (0..2000)
            .map(|index| violation(0, Constraint::Ee, 100 * index))
            .collect();
        let ranges = violation_ranges(&many);
        assert!(ranges.len() <= MAX_RANGES, "{} ranges", ranges.len());
        assert_eq!(ranges.iter().map(|range| range.count).sum::<u32>(), 2000);
    }
}
