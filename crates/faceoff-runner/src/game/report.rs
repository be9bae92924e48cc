//! Runs a whole game, records it, and reports its result.

use super::{
    lock_step::{self, AfterAnswer, ControllingSink},
    side_player::SidePlayer,
};
use crate::{
    bundle::Bundle,
    calibration::Calibration,
    config::AgentEnvironment,
    fault::PlatformFault,
    host_interference::{InterferenceMonitor, KernelCounters},
};
use faceoff_airhockey::{FinishedGame, GameSink, GameStepRow, RallyRow, RallyStart, RunningGame};
use faceoff_dataset::game::{
    GameArchives, GameRecorder, RecordedGame, game_simulation_setup, remove_game,
};
use faceoff_episode::RecordError;
use faceoff_sandbox::affinity::AffinityGuard;
use faceoff_types::{AgentFault, Side};
use faceoff_wire::game::{GameCalibration, GameSpec};
use std::{fs, path::Path};

/// Observes a running game, and can stop it.
pub trait GameObserver {
    /// A side's agent was started, for the first time or after a fault: it has answered `hello`, or had this fault.
    fn on_start(&mut self, _side: Side, _fault: Option<&AgentFault>) {}
    fn on_rally_start(&mut self, _start: &RallyStart<'_>) {}
    /// A control step was simulated. Called for every step, so it must be cheap.
    fn on_step(&mut self, _row: &GameStepRow<'_>) {}
    /// A rally is over.
    fn on_rally_end(&mut self, _row: &RallyRow<'_>) {}
    /// An agent's standard error (its beginning and end, if it is long), with its faults. Called exactly once for each side, even if
    /// there is no report because the game was cancelled or the platform failed.
    fn log(&mut self, _side: Side, _log: &str) {}
    /// Should the game stop? Called after each start and before each step, so it must be cheap.
    fn cancelled(&self) -> bool;
}

/// Results of a game, beside its recording.
#[derive(Debug, Clone, PartialEq)]
pub struct GameReport {
    /// Score, outcome and the archives' hashes.
    pub archives: GameArchives,
    /// Timing noise of the worker's slot, measured on the CPUs of each side.
    pub calibration: GameCalibration,
    /// Both agents' standard error (its beginning and end, if it is long), with their faults.
    pub logs: [String; 2],
}

/// Folder of the tables while they are written.
const TABLES_FOLDER: &str = "tables.partial";

/// Runs a game and records it in the folder `out`, which is created: `game.zip`, and `side-1.zip` and
/// `side-2.zip` for the teams. In all arrays the first side comes first.
///
/// # Errors
/// Platform faults only, including host interference that prevented an agent's answer: the game must be run again.
/// Agent faults are in the report. [`PlatformFault::Cancelled`] if the observer cancelled the game.
pub fn run_game(
    spec: &GameSpec,
    bundles: [&Bundle; 2],
    envs: [&AgentEnvironment; 2],
    out: &Path,
    observer: &mut dyn GameObserver,
) -> Result<GameReport, PlatformFault> {
    run_game_monitored(spec, bundles, envs, out, observer, [&KernelCounters; 2])
}

/// [`run_game`] with other monitors of host interference.
///
/// # Errors
/// As [`run_game`].
pub fn run_game_monitored(
    spec: &GameSpec,
    bundles: [&Bundle; 2],
    envs: [&AgentEnvironment; 2],
    out: &Path,
    observer: &mut dyn GameObserver,
    monitors: [&dyn InterferenceMonitor; 2],
) -> Result<GameReport, PlatformFault> {
    let remove_old_files =
        || remove_game(out).map_err(PlatformFault::io(format!("clearing {}", out.display())));
    remove_old_files()?;
    let tables = out.join(TABLES_FOLDER);
    let report = record(spec, bundles, envs, out, &tables, observer, monitors);
    if report.is_err() {
        if let Err(error) = fs::remove_dir_all(&tables) {
            tracing::debug!(%error, "a failed game has left no tables to remove");
        }
        if let Err(error) = remove_old_files() {
            tracing::warn!(%error, "the files of a failed game could not be removed");
        }
    }
    report
}

fn record(
    spec: &GameSpec,
    bundles: [&Bundle; 2],
    envs: [&AgentEnvironment; 2],
    out: &Path,
    tables: &Path,
    observer: &mut dyn GameObserver,
    monitors: [&dyn InterferenceMonitor; 2],
) -> Result<GameReport, PlatformFault> {
    let recorder = GameRecorder::create(tables)?;
    let (played, calibration, logs) = play_game(spec, bundles, envs, recorder, observer, monitors)?;
    let agents = bundles.map(|bundle| bundle.manifest.name.clone());
    let recorded = RecordedGame {
        spec,
        agents: &agents,
        finished: played,
        calibration,
        logs: &logs,
    };
    Ok(GameReport {
        archives: recorded.write(out)?,
        calibration,
        logs,
    })
}

/// Runs a game and sends its steps to `sink`. Returns the outcome, the slot's timing noise, and both agents' logs.
///
/// # Errors
/// As [`run_game`].
pub fn play_game<S: GameSink>(
    spec: &GameSpec,
    bundles: [&Bundle; 2],
    envs: [&AgentEnvironment; 2],
    sink: S,
    observer: &mut dyn GameObserver,
    monitors: [&dyn InterferenceMonitor; 2],
) -> Result<(FinishedGame<S>, GameCalibration, [String; 2]), PlatformFault> {
    let [first, second] = envs;
    let agent_cpus = [&first.agent_cpus[..], &second.agent_cpus].concat();
    let _affinity_guard = AffinityGuard::avoid(&agent_cpus);
    let mut calibrations = [
        Calibration::start(&first.agent_cpus)?,
        Calibration::start(&second.agent_cpus)?,
    ];
    let setup = game_simulation_setup(spec)?;
    let mut sides = Side::BOTH.map(|side| {
        let index = side.index();
        let restart_s = spec.limits.restart_s;
        SidePlayer::new(
            side,
            bundles[index],
            envs[index],
            restart_s,
            monitors[index],
        )
    });
    let observed = ObservedSink {
        sink,
        observer: &mut *observer,
    };
    let mut game = RunningGame::begin(&setup, spec.steps, spec.limits.clone(), observed);
    // Without a sandbox no CPU time is counted, so freezing is not needed.
    let after_answer =
        if AgentEnvironment::share_cpus(envs) && envs.iter().all(|env| env.has_cpu_accounting()) {
            AfterAnswer::Freeze
        } else {
            AfterAnswer::Continue
        };
    let played = lock_step::play(&mut game, &mut sides, &mut calibrations, after_answer);
    let finished = played.map(|()| {
        let FinishedGame {
            outcome,
            answer_times_s,
            sink: ObservedSink { sink, .. },
        } = game.finish();
        FinishedGame {
            outcome,
            answer_times_s,
            sink,
        }
    });
    let [
        (first_log, first_max_host_interference_s),
        (second_log, second_max_host_interference_s),
    ] = sides.map(SidePlayer::abort);
    observer.log(Side::First, &first_log);
    observer.log(Side::Second, &second_log);
    let [first, second] = calibrations;
    let calibration = GameCalibration {
        sides: [
            first.finish(first_max_host_interference_s, 0, spec.platform_retries),
            second.finish(second_max_host_interference_s, 0, spec.platform_retries),
        ],
    };
    Ok((finished?, calibration, [first_log, second_log]))
}

/// A sink that also notifies an observer.
struct ObservedSink<'o, S> {
    sink: S,
    observer: &'o mut dyn GameObserver,
}

impl<S: GameSink> GameSink for ObservedSink<'_, S> {
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError> {
        self.sink.begin_rally(start)?;
        self.observer.on_rally_start(start);
        Ok(())
    }

    fn observe(&mut self, observations: [&[f64]; 2]) {
        self.sink.observe(observations);
    }

    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError> {
        self.sink.step(row)?;
        self.observer.on_step(row);
        Ok(())
    }

    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError> {
        self.sink.end_rally(row)?;
        self.observer.on_rally_end(row);
        Ok(())
    }
}

impl<S: GameSink> ControllingSink for ObservedSink<'_, S> {
    fn on_start(&mut self, side: Side, fault: Option<&AgentFault>) {
        self.observer.on_start(side, fault);
    }

    fn cancelled(&self) -> bool {
        self.observer.cancelled()
    }
}
