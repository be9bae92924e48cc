//! What the replay of a game is drawn from: the motion for everybody who knows the game, what a side was told and commanded for whoever
//! gets its file.

use crate::{
    app::App,
    boxed,
    problem::{Problem, ProblemKind},
    viewer::Viewer,
    views::{clip_file::ClipFile, game, sight::GameSight},
};
use faceoff_replay::{CHUNK_STEPS, Clip, GameAnalysis, Key, Pack, ReplayError};
use faceoff_store::{Game, GameState};
use faceoff_types::{GameId, Side};
use std::sync::Arc;

/// The recorded clips of a game.
#[derive(Debug)]
pub struct GameClips {
    pub file: ClipFile,
    /// Of each side: does the viewer see what it was told and commanded?
    pub sees: [bool; 2],
}

impl GameClips {
    /// Of a game that the viewer knows of.
    ///
    /// # Errors
    /// `NotFound`; `Conflict` without a result, or for one whose clips are not kept.
    #[boxed]
    pub async fn of(app: &App, viewer: Viewer, id: GameId) -> Result<Self, Problem> {
        let (sheet, game) = game::known(app, viewer, id).await?;
        Self::of_known(app, sheet.sight(viewer), &game).await
    }

    async fn of_known(app: &App, sight: GameSight<'_>, game: &Game) -> Result<Self, Problem> {
        let recording = match &game.state {
            GameState::Played(row) => row.recording.as_ref(),
            _ => None,
        };
        let conflict = |why: &str| Problem::new(ProblemKind::Conflict, why);
        let Some(recording) = recording else {
            return Err(conflict(
                "the game has no result with a recording, and its replay is drawn from that",
            ));
        };
        let key = format!("{}/clips", recording.key);
        let file = ClipFile::find(app, key).await?.ok_or_else(|| {
            conflict(
                "there is no replay of this game: the version of the server that played it made none, or the archive that \
                 is shown was made without it",
            )
        })?;
        Ok(Self {
            file,
            sees: Side::BOTH.map(|side| sight.is_own(game, side) || sight.sees_both_sides(game)),
        })
    }

    /// A clip's compressed bytes.
    ///
    /// # Errors
    /// `NotFound` if the game was over before.
    #[boxed]
    pub async fn clip(&self, key: Key) -> Result<Vec<u8>, Problem> {
        let clip = self.file.read(move |pack| pack.clip(key)).await?;
        clip.ok_or_else(|| {
            let detail = format!(
                "the game has no such part; each is {CHUNK_STEPS} control steps, the first is 0"
            );
            Problem::new(ProblemKind::NotFound, detail)
        })
    }

    /// What the motion of all of the game says of the play: worked out once for all who ask about then.
    ///
    /// # Errors
    /// An internal problem, if it cannot be read.
    #[boxed]
    pub async fn analysis(&self, app: &App, steps: u32) -> Result<Arc<GameAnalysis>, Problem> {
        let key = self.file.key.clone();
        app.kept_analyses.get(key, self.analyse(steps)).await
    }

    async fn analyse(&self, steps: u32) -> Result<GameAnalysis, Problem> {
        let read = move |pack: &Pack| {
            let chunks = 0..steps.div_ceil(CHUNK_STEPS);
            let clip = |chunk| -> Result<Option<Clip>, ReplayError> {
                let bytes = pack.clip(Key::game_motion(chunk))?;
                bytes.map(|bytes| Clip::read(&bytes)).transpose()
            };
            GameAnalysis::of(chunks.filter_map(|chunk| clip(chunk).transpose()))
        };
        self.file.read(read).await
    }
}
