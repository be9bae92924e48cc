//! Cache of game analyses. An analysis lists goals, shots and violations of a whole game; it is computed from the game's
//! clips, which record the motion of puck and robots.

use crate::problem::Problem;
use faceoff_replay::GameAnalysis;
use moka::future::Cache;
use std::sync::Arc;

/// Size of the cache in bytes. Most analyses have some ten kilobytes; those of a robot that violates a limit again and again
/// have some hundred.
const MAX_BYTES: u64 = 16 << 20;

/// Analyses by the artifact key of the game's clip file. The clips of a played game never change.
#[derive(Debug)]
pub struct AnalysisCache(Cache<String, Arc<GameAnalysis>>);

impl AnalysisCache {
    /// The cached analysis of a game, or the result of `compute`. Concurrent requests share one computation.
    ///
    /// # Errors
    /// That of `compute`.
    pub async fn get(
        &self,
        clips_key: String,
        compute: impl Future<Output = Result<GameAnalysis, Problem>>,
    ) -> Result<Arc<GameAnalysis>, Problem> {
        let computed = async { compute.await.map(Arc::new) };
        let analysis = self.0.try_get_with(clips_key, computed).await;
        analysis.map_err(|problem| Problem::clone(&problem))
    }
}

impl Default for AnalysisCache {
    fn default() -> Self {
        let cache = Cache::builder()
            .max_capacity(MAX_BYTES)
            .weigher(|_, analysis: &Arc<GameAnalysis>| size_bytes(analysis));
        Self(cache.build())
    }
}

fn size_bytes(analysis: &GameAnalysis) -> u32 {
    let positions: usize = analysis.goals.iter().map(|goal| goal.positions.len()).sum();
    let bytes = size_of::<GameAnalysis>()
        + size_of_val(analysis.rally_ends.as_slice())
        + size_of_val(analysis.goals.as_slice())
        + positions * size_of::<[f64; 2]>()
        + size_of_val(analysis.shots.as_slice())
        + size_of_val(analysis.violations.as_slice());
    u32::try_from(bytes).unwrap_or(u32::MAX)
}
