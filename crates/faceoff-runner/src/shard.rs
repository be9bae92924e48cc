use crate::{
    bundle::Bundle,
    calibration::Calibration,
    config::AgentEnvironment,
    fault::PlatformFault,
    host_watch::{Counters, HostWatch},
    player::{IfTheHostWins, Player},
};
use faceoff_dataset::{Recorder, ShardFolder, ShardReport};
use faceoff_episode::{Arena, StepSink};
use faceoff_sandbox::affinity::PinnedElsewhere;
use faceoff_types::EpisodeOutcome;
use faceoff_wire::work::ShardSpec;
use std::path::Path;

/// Follows a shard as it runs, and can stop it.
pub trait Observer {
    /// An episode is over.
    fn episode_done(&mut self, outcome: &EpisodeOutcome);
    /// The end of the agent's standard error with its faults, once, however the shard ends: also
    /// when it was cancelled or the platform failed, and there is no report.
    fn log(&mut self, _log: &str) {}
    /// Is the shard to stop? Asked before each step, so it must be cheap.
    fn cancelled(&self) -> bool;
}

/// Plays a shard and records it in the folder `out`, which is created: `steps.parquet`,
/// `episodes.parquet`, `agent.log`, `report.json` (the returned report) and last, with the hashes
/// of the others, `shard.json`. A folder without `shard.json` is no recording.
///
/// # Errors
/// The platform's alone: the agent's faults are in the report. [`PlatformFault::Cancelled`] when
/// the observer said so.
pub fn run_shard(
    spec: &ShardSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    out: &Path,
    observer: &mut dyn Observer,
) -> Result<ShardReport, PlatformFault> {
    run_shard_watched(spec, bundle, env, out, observer, &Counters)
}

/// [`run_shard`] with another judge of what the host takes.
///
/// # Errors
/// As [`run_shard`].
pub fn run_shard_watched(
    spec: &ShardSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    out: &Path,
    observer: &mut dyn Observer,
    watch: &dyn HostWatch,
) -> Result<ShardReport, PlatformFault> {
    let folder = ShardFolder::create(out)?;
    let mut recorder = Recorder::create(&folder, spec.task)?;
    let report = play_shard(spec, bundle, env, &mut recorder, observer, watch)?;
    recorder.finish()?;
    folder.commit(spec, &report)?;
    Ok(report)
}

/// Plays a shard and tells `sink` of its steps.
///
/// # Errors
/// As [`run_shard`].
pub fn play_shard(
    spec: &ShardSpec,
    bundle: &Bundle,
    env: &AgentEnvironment,
    sink: &mut dyn StepSink,
    observer: &mut dyn Observer,
    watch: &dyn HostWatch,
) -> Result<ShardReport, PlatformFault> {
    let _pinned = PinnedElsewhere::than(&env.agent_cpus);
    let mut calibration = Calibration::start(&env.agent_cpus)?;
    let mut player = Player::new(
        bundle,
        env,
        spec.task,
        spec.episodes.end.saturating_sub(spec.episodes.start),
        Arena::by(
            spec.ruleset,
            spec.profile,
            &spec.perturbations,
            spec.seed,
            spec.mismatch_seed,
        ),
        watch,
        IfTheHostWins::LastTryCounts,
    );
    let played = play(spec, &mut player, sink, observer, &mut calibration);
    let (outcomes, stopped_by_faults) = match played {
        Ok(played) => played,
        Err(fault) => {
            observer.log(&player.abort());
            return Err(fault);
        }
    };
    let timing = calibration.finish(
        player.longest_stall_s(),
        player.host_noise_reruns(),
        spec.platform_retries,
    );
    let log = player.close()?;
    observer.log(&log);
    Ok(ShardReport {
        outcomes,
        log,
        stopped_by_faults,
        timing,
    })
}

/// Plays the episodes; tells also whether faults ended them early.
fn play(
    spec: &ShardSpec,
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
        let outcome = player.play(episode, faceoff_sim::EPISODE_STEPS, sink, &|| {
            observer.cancelled()
        })?;
        calibration.between_episodes()?;
        observer.episode_done(&outcome);
        faults += u32::from(outcome.fault.is_some());
        outcomes.push(outcome);
        if faults > spec.max_faults {
            return Ok((outcomes, true));
        }
    }
    Ok((outcomes, false))
}
