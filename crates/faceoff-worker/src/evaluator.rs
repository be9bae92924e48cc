use faceoff_runner::{
    AgentEnvironment, Assembled, Commentary, EvaluationMeta, GameAudience, GameReport, GameSpec,
    Observer, POSITION_EVERY, PlatformFault, ShardReport, ShardSpec, SmokeReport, SmokeSpec,
    bundle::{self, Bundle, BundleError, BundleLimits},
};
use std::path::{Path, PathBuf};

/// What a slot does with its units. One implementation, the runner; tests put faults of ours in its
/// place, which cannot be had from a healthy machine.
pub(crate) trait Evaluator: Send + Sync {
    /// Unpacks an uploaded archive, unless `cancelled`.
    fn unpack(
        &self,
        archive: &Path,
        into: &Path,
        limits: &BundleLimits,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Bundle, BundleError>;

    /// Does the agent start, answer and keep time?
    fn smoke(
        &self,
        spec: &SmokeSpec,
        bundle: &Bundle,
        env: &AgentEnvironment,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<SmokeReport, PlatformFault>;

    /// Plays a shard; its recording is left in `out`.
    fn play(
        &self,
        spec: &ShardSpec,
        bundle: &Bundle,
        env: &AgentEnvironment,
        out: &Path,
        observer: &mut dyn Observer,
    ) -> Result<ShardReport, PlatformFault>;

    /// Plays a game; its files are left in `out`. Pairs are the home side's first.
    fn play_game(
        &self,
        spec: &GameSpec,
        bundles: [&Bundle; 2],
        envs: [&AgentEnvironment; 2],
        out: &Path,
        audience: &mut dyn GameAudience,
    ) -> Result<GameReport, PlatformFault>;

    /// Joins recordings into a dataset and scores them.
    fn assemble(
        &self,
        meta: &EvaluationMeta,
        recordings: &[PathBuf],
        archive: &Path,
        clips: &Path,
    ) -> Result<Assembled, PlatformFault>;
}

/// The evaluator that `faceoff eval` runs, too.
#[derive(Debug)]
pub(crate) struct Runner;

impl Evaluator for Runner {
    fn unpack(
        &self,
        archive: &Path,
        into: &Path,
        limits: &BundleLimits,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Bundle, BundleError> {
        bundle::unpack(archive, into, limits, cancelled)
    }

    fn smoke(
        &self,
        spec: &SmokeSpec,
        bundle: &Bundle,
        env: &AgentEnvironment,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<SmokeReport, PlatformFault> {
        faceoff_runner::smoke(spec, bundle, env, cancelled)
    }

    fn play(
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
        audience: &mut dyn GameAudience,
    ) -> Result<GameReport, PlatformFault> {
        let mut commentary = Commentary::new(audience, POSITION_EVERY);
        let report = faceoff_runner::run_game(spec, bundles, envs, out, &mut commentary)?;
        commentary.end(&report);
        Ok(report)
    }

    fn assemble(
        &self,
        meta: &EvaluationMeta,
        recordings: &[PathBuf],
        archive: &Path,
        clips: &Path,
    ) -> Result<Assembled, PlatformFault> {
        let assembled = faceoff_runner::assemble(meta, recordings, archive, Some(clips))?;
        Ok(assembled)
    }
}
