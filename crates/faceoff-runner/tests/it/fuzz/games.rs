//! Fuzz test of recordings of games: each is read, or refused as differing, altered, unreadable or foreign (of another version).

use super::{
    assert_outcomes,
    datasets::{ValidRecording, label},
    fuzz,
};
use faceoff_airhockey::EVALUATION;
use faceoff_airhockey::{RallyReadiness, Response, RunningGame, SideFault, SimulationSetup};
use faceoff_dataset::{
    game::{GAME_FILE, GameRecorder, GameRecording, RecordedGame, verify_game},
    verify::VerifyError,
};
use faceoff_episode::AnswerTiming;
use faceoff_sim::Interpolation;
use faceoff_types::{AgentFaultKind, GameLimits, Seed, Side, SlotTiming};
use faceoff_wire::game::{GameCalibration, GameSpec};
use std::{fs, path::Path};
use tempfile::TempDir;

/// Records a short game with a late answer and a fault of one side.
fn record_game(out: &Path) {
    let seed = Seed::from_number(5);
    let spec = GameSpec {
        ruleset: faceoff_airhockey::RULESET,
        steps: 40,
        profile: EVALUATION,
        seed,
        mismatch_seed: seed.model_mismatch(),
        limits: GameLimits::default(),
        platform_retries: 0,
        perturbations: Default::default(),
        forfeit_score: Default::default(),
    };
    let setup = SimulationSetup::new(
        spec.profile.try_into().unwrap(),
        spec.seed,
        spec.mismatch_seed,
    );
    let recorder = GameRecorder::create(&out.join("tables")).unwrap();
    let mut game = RunningGame::begin(&setup, spec.steps, spec.limits.clone(), recorder);
    while game.end().is_none() {
        let readiness = Side::BOTH.map(|side| RallyReadiness::Ready {
            startup_s: game.needs_start(side).then_some(0.25),
            interpolation: Interpolation::Linear,
            reset_s: 0.125,
        });
        game.start_rally(readiness).unwrap();
        while game.is_in_rally() {
            let step = game.rally_steps();
            let actions = Side::BOTH.map(|side| {
                let request = game.action_request(side).unwrap()?;
                Some(request.observation[6..13].to_vec())
            });
            let responses = Side::BOTH.map(|side| {
                let timing = AnswerTiming {
                    computation_time_s: if step == 7 { 0.03125 } else { 0.001953125 },
                    host_time_s: 0.0,
                    cpu_time_s: None,
                };
                match &actions[side.index()] {
                    None => Response::Held,
                    Some(_) if (step, side) == (20, Side::Second) => Response::Fault {
                        fault: SideFault {
                            kind: AgentFaultKind::NonFinite,
                            line: Some("oops".to_owned()),
                        },
                        timing,
                    },
                    Some(action) => Response::Answer { action, timing },
                }
            });
            game.answer(responses).unwrap();
        }
    }
    let recorded = RecordedGame {
        spec: &spec,
        agents: &["one".to_owned(), "other".to_owned()],
        finished: game.finish(),
        calibration: GameCalibration {
            sides: [SlotTiming::default(); 2],
        },
        logs: &["log of one\n".to_owned(), "log of the other\n".to_owned()],
    };
    recorded.write(out).unwrap();
}

/// Reads the whole recording, and stops at the first error.
fn read(path: &Path) -> Result<(), VerifyError> {
    GameRecording::is_at(path)?;
    let recording = GameRecording::open(path)?;
    recording.results()?;
    recording.outcome()?;
    verify_game(&recording, &|_| ()).map(drop)
}

#[test]
fn game_recording_is_read_or_refused() {
    let scratch = TempDir::new().unwrap();
    record_game(scratch.path());
    let valid = ValidRecording::read(&scratch.path().join(GAME_FILE), scratch.path());
    let outcomes = fuzz("games", 800, |rng| {
        let dir = scratch.path().join("changed");
        fs::create_dir(&dir).unwrap();
        let label = label(&read(&valid.write_mutated(&dir, rng)));
        fs::remove_dir_all(&dir).unwrap();
        label.to_owned()
    });
    let kinds = ["read", "differs", "unreadable", "foreign", "altered"];
    assert_outcomes(&outcomes, &kinds);
}
