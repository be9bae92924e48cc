//! What the motion of games says of the play, kept in memory.

use crate::problem::Problem;
use faceoff_replay::GameAnalysis;
use moka::future::Cache;
use std::sync::Arc;

/// Bytes of analyses that are kept; most games have some ten thousand, of a robot that shakes at a limit some hundred.
const KEPT_BYTES: u64 = 16 << 20;

/// What the motion of games said that were asked for last, by the keys of their clips: those of a played game never change.
#[derive(Debug)]
pub struct KeptAnalyses(Cache<String, Arc<GameAnalysis>>);

impl KeptAnalyses {
    /// What is kept of a game, or what `make` works out: once, however many ask for it meanwhile.
    ///
    /// # Errors
    /// That of `make`.
    pub async fn get(
        &self,
        clips: String,
        make: impl Future<Output = Result<GameAnalysis, Problem>>,
    ) -> Result<Arc<GameAnalysis>, Problem> {
        let made = async { make.await.map(Arc::new) };
        let kept = self.0.try_get_with(clips, made).await;
        kept.map_err(|problem| Problem::clone(&problem))
    }
}

impl Default for KeptAnalyses {
    fn default() -> Self {
        let cache = Cache::builder()
            .max_capacity(KEPT_BYTES)
            .weigher(|_, analysis: &Arc<GameAnalysis>| bytes_of(analysis));
        Self(cache.build())
    }
}

fn bytes_of(analysis: &GameAnalysis) -> u32 {
    let places: usize = analysis.goals.iter().map(|goal| goal.places.len()).sum();
    let bytes = size_of::<GameAnalysis>()
        + size_of_val(analysis.breaks.as_slice())
        + size_of_val(analysis.goals.as_slice())
        + places * size_of::<[f64; 2]>()
        + size_of_val(analysis.shots.as_slice())
        + size_of_val(analysis.breaches.as_slice());
    u32::try_from(bytes).unwrap_or(u32::MAX)
}
