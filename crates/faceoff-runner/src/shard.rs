//! Runs a *shard*: a range of episodes of one task, played by one agent.

use crate::{
    bundle::Bundle,
    calibration::Calibration,
    config::AgentEnvironment,
    fault::PlatformFault,
    host_interference::{InterferenceMonitor, KernelCounters},
    player::{OnHostInterference, Player},
};
use faceoff_dataset::{Recorder, ShardFolder, ShardReport, shard_conditions};
use faceoff_episode::StepSink;
use faceoff_sandbox::affinity::AffinityGuard;
use faceoff_types::EpisodeOutcome;
use faceoff_wire::job::ShardSpec;
use std::path::Path;

/// Observes a running shard, and can stop it.
pub trait Observer {
    /// An episode is over.
    fn on_episode_end(&mut self, outcome: &EpisodeOutcome);
    /// The agent's standard error (its beginning and end, if it is long), with its faults. Called exactly once, even if there is no
    /// report because the shard was cancelled or the platform failed.
    fn log(&mut self, _log: &str) {}
    /// The agent runs, since it has answered `hello`. Called before each reset and each step, so it must be cheap.
    fn on_agent_running(&self) {}
    /// Should the shard stop? Called before each reset and each step, so it must be cheap.
    fn cancelled(&self) -> bool;
}

/// Runs a shard and records it in the folder `out`, which is created: `steps.parquet`,
/// `episodes.parquet`, `agent.log`, `report.json` (the returned report) and last, with the hashes
/// of the others, `shard.json`. A folder without `shard.json` is not a recording.
///
/// # Errors
/// Platform faults only: agent faults are in the report. [`PlatformFault::Cancelled`] if the observer
/// cancelled the shard.
pub fn run_shard(
    spec: &ShardSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<ShardReport, PlatformFault> {
    run_shard_monitored(spec, bundle, env, out, observer, &KernelCounters)
}

/// [`run_shard`] with another monitor of host interference.
///
/// # Errors
/// As [`run_shard`].
pub fn run_shard_monitored(
    spec: &ShardSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    out: &Path,
    observer: &mut dyn Observer,
    monitor: &dyn InterferenceMonitor,
) -> Result<ShardReport, PlatformFault> {
    let folder = ShardFolder::create(out)?;
    let mut recorder = Recorder::create(&folder, spec.task, env.simulator.competition())?;
    let report = play_shard(spec, bundle, env, &mut recorder, observer, monitor)?;
    recorder.finish()?;
    folder.commit(spec, &report, env.simulator.as_ref())?;
    Ok(report)
}

/// Runs a shard and sends its steps to `sink`.
///
/// # Errors
/// As [`run_shard`].
pub fn play_shard(
    spec: &ShardSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    sink: &mut dyn StepSink,
    observer: &mut dyn Observer,
    monitor: &dyn InterferenceMonitor,
) -> Result<ShardReport, PlatformFault> {
    let _affinity_guard = AffinityGuard::avoid(&env.agent_cpus);
    let world_factory = env.simulator.world_factory(&shard_conditions(spec))?;
    let mut calibration = Calibration::start(&env.agent_cpus)?;
    let mut player = Player::new(
        bundle,
        env,
        spec.task,
        spec.episodes.end.saturating_sub(spec.episodes.start),
        world_factory.as_ref(),
        monitor,
        OnHostInterference::KeepLastTry,
    );
    let max_steps = world_factory.max_steps(spec.task);
    let played = play(
        spec,
        max_steps,
        &mut player,
        sink,
        observer,
        &mut calibration,
    );
    let (outcomes, stopped_by_faults) = match played {
        Ok(played) => played,
        Err(fault) => {
            observer.log(&player.abort());
            return Err(fault);
        }
    };
    let timing = calibration.finish(
        player.max_host_interference_s(),
        player.host_interference_reruns(),
        spec.platform_retries,
    );
    let log = player.finish()?;
    observer.log(&log);
    Ok(ShardReport {
        outcomes,
        log,
        stopped_by_faults,
        timing,
    })
}

/// Runs the episodes; also returns whether faults stopped the shard early.
fn play(
    spec: &ShardSpec,
    max_steps: u32,
    player: &mut Player<'_>,
    sink: &mut dyn StepSink,
    observer: &mut dyn Observer,
    calibration: &mut Calibration,
) -> Result<(Vec<EpisodeOutcome>, bool), PlatformFault> {
    let mut outcomes = Vec::with_capacity(spec.episodes.len());
    let mut faults = 0;
    for episode in spec.episodes.clone() {
        if observer.cancelled() {
            return Err(PlatformFault::Cancelled);
        }
        let outcome = player.play(episode, max_steps, sink, &|| {
            observer.on_agent_running();
            observer.cancelled()
        })?;
        calibration.measure_between_episodes()?;
        observer.on_episode_end(&outcome);
        faults += u32::from(outcome.fault.is_some());
        outcomes.push(outcome);
        if faults > spec.max_faults {
            return Ok((outcomes, true));
        }
    }
    Ok((outcomes, false))
}
