//! The card of a game: the score, and how its first goal fell.

use super::{
    layout::{Card, LEFT, RIGHT, text_style},
    response::respond,
    still::{self, Place},
};
use crate::{
    frame::PageProblem,
    replay_section::Still,
    spoilers::Spoilers,
    table_drawing::{self, Dot, TableOutline},
};
use axum::{
    extract::State,
    http::{HeaderValue, header},
    response::Response,
};
use faceoff_api::views::game::{GameResultView, GameStatus, GameView};
use faceoff_picture::{Align, Weight};
use faceoff_replay::{
    CHUNK_STEPS, Clip, ClipKey, GOAL_PATH_STEPS, GameAnalysis,
    model::{PUCK, TOOL},
};
use faceoff_service::{
    app::App,
    extract::PathParam,
    problem::{Problem, ProblemKind},
    request_preconditions::RequestPreconditions,
    viewer::Viewer,
    views::{game, game_clips::GameClips},
};
use faceoff_types::GameId;

/// Where the drawing is.
const DRAWING: Place = Place {
    x: 255.0,
    y: 234.0,
    width: 690.0,
};
/// Baseline of names and score.
const SCORE_LINE: f64 = 196.0;

/// The picture of a game. A visitor who hides results gets it without them.
pub(super) async fn picture(
    State(app): State<App>,
    preconditions: RequestPreconditions,
    spoilers: Spoilers,
    id: Result<PathParam<GameId>, Problem>,
) -> Result<Response, PageProblem> {
    let PathParam(id) = id?;
    let card = load(&app, id, spoilers.hides_results());
    let mut response = respond(&app, &preconditions, card).await?;
    response
        .headers_mut()
        .insert(header::VARY, HeaderValue::from_static("cookie"));
    Ok(response)
}

async fn load(app: &App, id: GameId, is_hidden: bool) -> Result<Card, PageProblem> {
    let view = game::find(app, Viewer::Visitor, id).await?;
    let mut card = Card::new(view.tournament_name.as_str());
    let result = match &view.status {
        GameStatus::Played { result, .. } if !is_hidden => Some(result),
        _ => None,
    };
    draw_score(&mut card, &view, result.map(|result| result.score));
    let scene = match result {
        Some(result) => Scene::find(app, id, result).await?,
        None => None,
    };
    card.elements(&match scene {
        Some(scene) => still::svg(&scene.still(), scene.opponent(), DRAWING),
        None => still::empty_table(DRAWING),
    });
    Ok(card)
}

/// The names, with the score between them.
fn draw_score(card: &mut Card, view: &GameView, score: Option<[u32; 2]>) {
    let (text, style) = match score {
        Some([home, away]) => (
            format!("{home} : {away}"),
            text_style(Weight::Semibold, 84.0, "ink"),
        ),
        None => (
            "against".to_owned(),
            text_style(Weight::Regular, 40.0, "soft"),
        ),
    };
    let middle = f64::midpoint(LEFT, RIGHT);
    let half_gap = style.width_px(&text) / 2.0 + 40.0;
    card.aligned_text(
        &text,
        &style,
        [middle, SCORE_LINE],
        RIGHT - LEFT,
        Align::Middle,
    );
    let [home, away] = view.sides.each_ref().map(|side| side.team_name.as_str());
    let width = middle - half_gap - LEFT;
    let name_style = |colour| text_style(Weight::Semibold, 54.0, colour);
    card.text_at_end(
        home,
        &name_style("accent"),
        [middle - half_gap, SCORE_LINE],
        width,
    );
    // The away side's colour is that of the tier “improvable”, without its meaning.
    card.text(
        away,
        &name_style("fair"),
        [middle + half_gap, SCORE_LINE],
        width,
    );
}

/// The paths that the card shows: the last seconds before the first goal, or before the end of a game without goals.
struct Scene {
    puck: Vec<[f64; 2]>,
    mallets: [Vec<[f64; 2]>; 2],
}

impl Scene {
    /// The first goal, or the end of a game without goals; `None` without a stored replay.
    async fn find(app: &App, id: GameId, result: &GameResultView) -> Result<Option<Self>, Problem> {
        let clips = match GameClips::find(app, Viewer::Visitor, id).await {
            Ok(clips) => clips,
            // There is no replay of this game, or none any more.
            Err(problem) if problem.kind() == ProblemKind::Conflict => return Ok(None),
            Err(problem) => return Err(problem),
        };
        let analysis = clips.analysis(app, result.steps).await?;
        let last = last_sample(&analysis, result.steps);
        let chunk = last.saturating_sub(1) / CHUNK_STEPS;
        let key = ClipKey::game_motion(chunk);
        let clip = clips.file.read(move |pack| {
            let bytes = pack.clip(key)?;
            bytes.map(|bytes| Clip::read(&bytes)).transpose()
        });
        Ok(clip.await?.map(|clip| Self::new(&clip, last)))
    }

    /// The samples of a clip up to `last`, in the same rally.
    fn new(clip: &Clip, last: u32) -> Self {
        let header = &clip.header;
        let index = |sample: u32| sample.saturating_sub(header.first) as usize;
        let ends = header.rally_ends.iter().map(|end| end.sample);
        let rally_start = ends
            .filter(|end| *end < last)
            .max()
            .map_or(0, |end| index(end) + 1);
        let end = index(last) + 1;
        let start = rally_start.max(end.saturating_sub(GOAL_PATH_STEPS + 1));
        let scene_part = |positions: Vec<[f64; 2]>| {
            let to = end.min(positions.len());
            positions[start.min(to)..to].to_vec()
        };
        Self {
            puck: scene_part(clip.puck_positions()),
            mallets: [0, 1].map(|side| scene_part(clip.mallet_positions(side))),
        }
    }

    fn still(&self) -> Still {
        let dot = |position: Option<&[f64; 2]>| Dot::at(position.copied().unwrap_or_default());
        let [home, away] = &self.mallets;
        Still {
            table: TableOutline::new(),
            puck_path: table_drawing::path(&self.puck),
            mallet_path: table_drawing::path(home),
            opponent_path: table_drawing::path(away),
            observed_puck_dots: String::new(),
            contact_squares: String::new(),
            start: dot(self.puck.first()),
            puck: dot(self.puck.last()),
            mallet: dot(home.last()),
            puck_radius: 1e3 * PUCK.radius_m,
            mallet_radius: 1e3 * TOOL.cylinder_radius_m,
        }
    }

    fn opponent(&self) -> Option<Dot> {
        self.mallets[1].last().copied().map(Dot::at)
    }
}

/// The number of the first goal's sample; without goals, of the last sample. A sample is recorded per control step.
fn last_sample(analysis: &GameAnalysis, steps: u32) -> u32 {
    analysis.goals.first().map_or(steps, |goal| goal.sample)
}
