//! The evaluator: what a slot calls to unpack bundles and to run validations, shards, games and scorings. A *shard* is a
//! range of episodes of one task; an evaluation is played in shards.

use faceoff_episode::Simulator;
use faceoff_runner::{
    AgentEnvironment, AssembledDataset, EvaluationMeta, GameReport, GameSpec, LiveFeed,
    LiveFeedSink, Observer, POSITION_INTERVAL, PlatformFault, ShardReport, ShardSpec,
    ValidationReport, ValidationSpec,
    bundle::{self, Bundle, BundleError, BundleLimits},
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// Runs the jobs of a slot. The only implementation is the runner; tests replace it to inject platform faults, which a
/// healthy machine does not have.
pub(crate) trait Evaluator: Send + Sync {
    /// Unpacks an uploaded archive, unless `cancelled` returns true.
    fn unpack(
        &self,
        archive: &Path,
        into: &Path,
        limits: &BundleLimits,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Bundle, BundleError>;

    /// Checks that the agent starts, answers and keeps the time limits.
    fn validate(
        &self,
        spec: &ValidationSpec,
        bundle: &Bundle,
        env: &AgentEnvironment,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<ValidationReport, PlatformFault>;

    /// Plays a shard and writes its recording into `out`.
    fn play_shard(
        &self,
        spec: &ShardSpec,
        bundle: &Bundle,
        env: &AgentEnvironment,
        out: &Path,
        observer: &mut dyn Observer,
    ) -> Result<ShardReport, PlatformFault>;

    /// Plays a game and writes its files into `out`. In pairs, the home side comes first.
    fn play_game(
        &self,
        spec: &GameSpec,
        bundles: [&Bundle; 2],
        envs: [&AgentEnvironment; 2],
        out: &Path,
        live_updates: &mut dyn LiveFeedSink,
    ) -> Result<GameReport, PlatformFault>;

    /// Merges the recordings of an evaluation's shards into a dataset, and scores it.
    fn assemble(
        &self,
        meta: &EvaluationMeta,
        recordings: &[PathBuf],
        archive: &Path,
        clips: &Path,
    ) -> Result<AssembledDataset, PlatformFault>;
}

/// The evaluator of `faceoff-runner`, which `faceoff eval` also uses.
#[derive(Debug)]
pub(crate) struct Runner {
    /// The simulator of the recordings that are merged.
    pub(crate) simulator: Arc<dyn Simulator>,
}

impl Evaluator for Runner {
    fn unpack(
        &self,
        archive: &Path,
        into: &Path,
        limits: &BundleLimits,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Bundle, BundleError> {
        let bundle = bundle::unpack(archive, into, limits, cancelled)?;
        bundle::check_interpolation(&bundle, self.simulator.competition())?;
        Ok(bundle)
    }

    fn validate(
        &self,
        spec: &ValidationSpec,
        bundle: &Bundle,
        env: &AgentEnvironment,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<ValidationReport, PlatformFault> {
        faceoff_runner::validate(spec, bundle, env, cancelled)
    }

    fn play_shard(
        &self,
        spec: &ShardSpec,
        bundle: &Bundle,
        env: &AgentEnvironment,
        out: &Path,
        observer: &mut dyn Observer,
    ) -> Result<ShardReport, PlatformFault> {
        faceoff_runner::run_shard(spec, bundle, env, out, observer)
    }

    fn play_game(
        &self,
        spec: &GameSpec,
        bundles: [&Bundle; 2],
        envs: [&AgentEnvironment; 2],
        out: &Path,
        live_updates: &mut dyn LiveFeedSink,
    ) -> Result<GameReport, PlatformFault> {
        let mut live_feed = LiveFeed::new(live_updates, POSITION_INTERVAL);
        let report = faceoff_runner::run_game(spec, bundles, envs, out, &mut live_feed)?;
        live_feed.end(&report);
        Ok(report)
    }

    fn assemble(
        &self,
        meta: &EvaluationMeta,
        recordings: &[PathBuf],
        archive: &Path,
        clips: &Path,
    ) -> Result<AssembledDataset, PlatformFault> {
        let simulator = self.simulator.as_ref();
        let assembled =
            faceoff_runner::assemble(meta, recordings, archive, Some(clips), simulator)?;
        Ok(assembled)
    }
}
