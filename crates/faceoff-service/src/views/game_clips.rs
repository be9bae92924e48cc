//! Clips of a game: compressed recordings. Everyone who may see the game may see the motion. The observations and actions of a side
//! (one of the two teams) are visible to viewers with access to the side's recording.

use crate::{
    app::App,
    boxed_future,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{clip_file::ClipFile, game, visibility::GameVisibility},
};
use faceoff_replay::{CHUNK_STEPS, Clip, ClipKey, GameAnalysis, Pack, ReplayError};
use faceoff_store::{Game, GameState};
use faceoff_types::{GameId, Side};
use std::sync::Arc;

/// The recorded clips of a game.
#[derive(Debug)]
pub struct GameClips {
    pub file: ClipFile,
    /// For each side: whether the viewer may see its observations and actions.
    pub can_see_observations: [bool; 2],
}

impl GameClips {
    /// The clips of a game that the viewer may see.
    ///
    /// # Errors
    /// `NotFound`; `Conflict` without a result, or without stored clips.
    #[boxed_future]
    pub async fn find(app: &App, viewer: Viewer, id: GameId) -> Result<Self, Problem> {
        let (state, game) = game::find_visible(app, viewer, id).await?;
        Self::find_clips(app, state.visibility(viewer), &game).await
    }

    async fn find_clips(
        app: &App,
        visibility: GameVisibility<'_>,
        game: &Game,
    ) -> Result<Self, Problem> {
        let recording = match &game.state {
            GameState::Played(stored_result) => stored_result.recording.as_ref(),
            _ => None,
        };
        let conflict = |detail: &str| Problem::new(ProblemKind::Conflict, detail);
        let Some(recording) = recording else {
            return Err(conflict(
                "the game has no replay, because it has no result with a recording",
            ));
        };
        let key = format!("{}/clips", recording.key);
        let file = ClipFile::find(app, key).await?.ok_or_else(|| {
            conflict(
                "there is no replay of this game: the server version that ran it recorded none, or the season archive does \
                 not contain it",
            )
        })?;
        Ok(Self {
            file,
            can_see_observations: Side::BOTH.map(|side| {
                visibility.has_team_access(game, side) || visibility.can_see_both_sides(game)
            }),
        })
    }

    /// A clip's compressed bytes.
    ///
    /// # Errors
    /// `NotFound` if the game ended before this clip. A clip has a fixed number of steps of the game.
    #[boxed_future]
    pub async fn clip(&self, key: ClipKey) -> Result<Vec<u8>, Problem> {
        let clip = self.file.read(move |pack| pack.clip(key)).await?;
        clip.ok_or_else(|| {
            let detail = format!(
                "the game has no such part; each part has {CHUNK_STEPS} control steps, the first is part 0"
            );
            Problem::new(ProblemKind::NotFound, detail)
        })
    }

    /// Analysis of the motion of the whole game, which has this number of control steps. It is cached.
    ///
    /// # Errors
    /// `Internal` if the clips cannot be read.
    #[boxed_future]
    pub async fn analysis(&self, app: &App, steps: u32) -> Result<Arc<GameAnalysis>, Problem> {
        let key = self.file.key.clone();
        let compute = async { self.analyse(steps).await.map(Arc::new) };
        app.game_analyses.get(key, compute).await
    }

    async fn analyse(&self, steps: u32) -> Result<GameAnalysis, Problem> {
        let read = move |pack: &Pack| {
            let chunks = 0..steps.div_ceil(CHUNK_STEPS);
            let clip = |chunk| -> Result<Option<Clip>, ReplayError> {
                let bytes = pack.clip(ClipKey::game_motion(chunk))?;
                bytes.map(|bytes| Clip::read(&bytes)).transpose()
            };
            GameAnalysis::from_clips(chunks.filter_map(|chunk| clip(chunk).transpose()))
        };
        self.file.read(read).await
    }
}
