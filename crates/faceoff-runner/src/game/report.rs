use super::{
    lock_step::{self, OnceAnswered},
    side_player::SidePlayer,
};
use crate::{
    bundle::Bundle,
    calibration::Calibration,
    config::AgentEnvironment,
    fault::PlatformFault,
    host_watch::{Counters, HostWatch},
};
use faceoff_dataset::game::{GameArchives, GameRecorder, RecordedGame, clear_game};
use faceoff_episode::{
    Arena, FinishedGame, GameCourse, GameSink, GameStepRow, RallyRow, RallyStart, RecordError,
};
use faceoff_sandbox::affinity::PinnedElsewhere;
use faceoff_types::Side;
use faceoff_wire::game::{GameCalibration, GameSpec};
use std::{fs, path::Path};

/// Follows a game as it runs, and can stop it.
pub trait GameObserver {
    fn rally_begun(&mut self, _start: &RallyStart<'_>) {}
    /// A control step was played. Called as often as the game has steps, so it must be cheap.
    fn stepped(&mut self, _row: &GameStepRow<'_>) {}
    /// A rally is over.
    fn rally_over(&mut self, _row: &RallyRow<'_>) {}
    /// The end of an agent's standard error with its faults, once for each side, however the game ends: also
    /// when it was cancelled or the platform failed, and there is no report.
    fn log(&mut self, _side: Side, _log: &str) {}
    /// Is the game to stop? Asked before each step, so it must be cheap.
    fn cancelled(&self) -> bool;
}

/// What a game yields, beside its recording.
#[derive(Debug, Clone, PartialEq)]
pub struct GameReport {
    /// Score, outcome and the archives' hashes.
    pub archives: GameArchives,
    /// How evenly the slot kept time for each side.
    pub calibration: GameCalibration,
    /// The ends of both agents' standard errors, with their faults.
    pub logs: [String; 2],
}

const TABLES: &str = "tables.partial";

/// Plays a game and records it in the folder `out`, which is created: `game.zip`, and `side-1.zip` and
/// `side-2.zip`, which can be given to the teams. Arrays are the first side's first.
///
/// # Errors
/// The platform's alone, also if the host kept an agent from answering: then the game is to be played again.
/// Faults of agents are in the report. [`PlatformFault::Cancelled`] when the observer said so.
pub fn run_game(
    spec: &GameSpec,
    bundles: [&Bundle; 2],
    envs: [&AgentEnvironment; 2],
    out: &Path,
    observer: &mut dyn GameObserver,
) -> Result<GameReport, PlatformFault> {
    run_game_watched(spec, bundles, envs, out, observer, [&Counters; 2])
}

/// [`run_game`] with other judges of what the host takes.
///
/// # Errors
/// As [`run_game`].
pub fn run_game_watched(
    spec: &GameSpec,
    bundles: [&Bundle; 2],
    envs: [&AgentEnvironment; 2],
    out: &Path,
    observer: &mut dyn GameObserver,
    watches: [&dyn HostWatch; 2],
) -> Result<GameReport, PlatformFault> {
    let clear =
        || clear_game(out).map_err(PlatformFault::io(format!("clearing {}", out.display())));
    clear()?;
    let tables = out.join(TABLES);
    let report = record(spec, bundles, envs, out, &tables, observer, watches);
    if report.is_err() {
        if let Err(error) = fs::remove_dir_all(&tables) {
            tracing::debug!(%error, "no tables of a broken game to remove");
        }
        if let Err(error) = clear() {
            tracing::warn!(%error, "what a broken game has left could not be removed");
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
    watches: [&dyn HostWatch; 2],
) -> Result<GameReport, PlatformFault> {
    let recorder = GameRecorder::create(tables)?;
    let (played, calibration, logs) = play_game(spec, bundles, envs, recorder, observer, watches)?;
    let agents = bundles.map(|bundle| bundle.manifest.name.clone());
    let recorded = RecordedGame {
        spec,
        agents: &agents,
        played,
        calibration,
        logs: &logs,
    };
    Ok(GameReport {
        archives: recorded.write(out)?,
        calibration,
        logs,
    })
}

/// Plays a game and tells `sink` of its steps. Returns what it came to, how evenly the slot kept time, and both
/// agents' logs.
///
/// # Errors
/// As [`run_game`].
pub fn play_game<S: GameSink>(
    spec: &GameSpec,
    bundles: [&Bundle; 2],
    envs: [&AgentEnvironment; 2],
    sink: S,
    observer: &mut dyn GameObserver,
    watches: [&dyn HostWatch; 2],
) -> Result<(FinishedGame<S>, GameCalibration, [String; 2]), PlatformFault> {
    let [first, second] = envs;
    let agent_cpus = [&first.agent_cpus[..], &second.agent_cpus].concat();
    let _pinned = PinnedElsewhere::than(&agent_cpus);
    let mut calibrations = [
        Calibration::start(&first.agent_cpus)?,
        Calibration::start(&second.agent_cpus)?,
    ];
    let arena = Arena::by(
        spec.ruleset,
        spec.profile,
        &spec.perturbations,
        spec.seed,
        spec.mismatch_seed,
    );
    let mut sides = Side::BOTH.map(|side| {
        let at = side.index();
        let restart_s = spec.limits.restart_s;
        SidePlayer::new(side, bundles[at], envs[at], restart_s, watches[at])
    });
    let told = Told {
        sink,
        observer: &mut *observer,
    };
    let mut course = GameCourse::begin(&arena, spec.steps, spec.limits.clone(), told);
    // Outside of a sandbox nothing is counted.
    let answered = if AgentEnvironment::share_cpus(envs) && envs.iter().all(|env| env.counts_cpus())
    {
        OnceAnswered::IsFrozen
    } else {
        OnceAnswered::GoesOn
    };
    let played = lock_step::play(
        &mut course,
        &mut sides,
        &mut calibrations,
        answered,
        |told| told.observer.cancelled(),
    );
    let ended = played.map(|()| {
        let FinishedGame {
            outcome,
            answer_times_s,
            sink: Told { sink, .. },
        } = course.finish();
        FinishedGame {
            outcome,
            answer_times_s,
            sink,
        }
    });
    let [(first_log, first_stall_s), (second_log, second_stall_s)] = sides.map(SidePlayer::close);
    observer.log(Side::First, &first_log);
    observer.log(Side::Second, &second_log);
    let [first, second] = calibrations;
    let calibration = GameCalibration {
        sides: [
            first.finish(first_stall_s, 0, spec.platform_retries),
            second.finish(second_stall_s, 0, spec.platform_retries),
        ],
    };
    Ok((ended?, calibration, [first_log, second_log]))
}

/// A sink beside which somebody watches.
struct Told<'o, S> {
    sink: S,
    observer: &'o mut dyn GameObserver,
}

impl<S: GameSink> GameSink for Told<'_, S> {
    fn begin_rally(&mut self, start: &RallyStart<'_>) -> Result<(), RecordError> {
        self.sink.begin_rally(start)?;
        self.observer.rally_begun(start);
        Ok(())
    }

    fn observe(&mut self, observations: [&[f64]; 2]) {
        self.sink.observe(observations);
    }

    fn step(&mut self, row: &GameStepRow<'_>) -> Result<(), RecordError> {
        self.sink.step(row)?;
        self.observer.stepped(row);
        Ok(())
    }

    fn end_rally(&mut self, row: &RallyRow<'_>) -> Result<(), RecordError> {
        self.sink.end_rally(row)?;
        self.observer.rally_over(row);
        Ok(())
    }
}
