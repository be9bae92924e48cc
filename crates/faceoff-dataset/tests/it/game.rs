//! Tests of the recording of games: verification of genuine, forged and damaged recordings, and clips for replays.

use crate::{
    forgery::{Forgery, flipped},
    recordings::table,
};
use arrow_array::{Array, RecordBatch, cast::AsArray, types::Float64Type};
use faceoff_airhockey::EVALUATION;
use faceoff_airhockey::{RallyReadiness, Response, RunningGame, SideFault, SimulationSetup};
use faceoff_dataset::{
    DatasetError,
    game::{GAME_FILE, GameRecorder, GameRecording, RecordedGame, side_file, verify_game},
};
use faceoff_episode::AnswerTiming;
use faceoff_replay::{CHUNK_STEPS, Clip, ClipKey, Pack};
use faceoff_sim::Interpolation;
use faceoff_types::{AgentFaultKind, GameLimits, Seed, Side, SlotTiming};
use faceoff_wire::game::{GameCalibration, GameSpec};
use std::{
    fs::{self, File},
    path::Path,
};
use tempfile::TempDir;
use zip::ZipArchive;

/// Control steps of the recorded game.
const STEPS: u32 = 1600;

fn spec() -> GameSpec {
    let seed = Seed::from_number(11);
    GameSpec {
        ruleset: faceoff_airhockey::RULESET,
        steps: STEPS,
        profile: EVALUATION,
        seed,
        mismatch_seed: seed.model_mismatch(),
        limits: GameLimits::default(),
        platform_retries: 0,
        perturbations: Default::default(),
        forfeit_score: Default::default(),
    }
}

/// Records a game with all recorded cases: answers late and in time, a fault at a step, at a reset and at a start, and
/// another interpolation after a restart.
fn record(out: &Path) {
    let spec = spec();
    let setup = SimulationSetup::new(
        spec.profile.try_into().unwrap(),
        spec.seed,
        spec.mismatch_seed,
    );
    let recorder = GameRecorder::create(&out.join("tables")).unwrap();
    let mut game = RunningGame::begin(&setup, spec.steps, spec.limits.clone(), recorder);
    let fault = |detail: &str| SideFault {
        kind: AgentFaultKind::NotJson {
            detail: detail.to_owned(),
        },
        line: Some("oops".to_owned()),
    };
    while game.end().is_none() {
        let rally = game.rally();
        let readiness = Side::BOTH.map(|side| {
            let startup_s = game.needs_start(side).then_some(0.25);
            let interpolation = match (rally, side) {
                (0, _) => Interpolation::Cubic,
                _ => Interpolation::Linear,
            };
            match (rally, side) {
                (1, Side::Second) => RallyReadiness::ResetFailed {
                    startup_s,
                    interpolation,
                    reset_s: 0.125,
                    fault: fault("reset"),
                },
                (2, Side::First) if startup_s.is_some() => RallyReadiness::StartFailed {
                    startup_s: 0.5,
                    fault: fault("start"),
                },
                _ => RallyReadiness::Ready {
                    startup_s,
                    interpolation,
                    reset_s: 0.0625,
                },
            }
        });
        let interpolations = readiness.each_ref().map(RallyReadiness::interpolation);
        game.start_rally(readiness).unwrap();
        while game.is_in_rally() {
            let step = game.rally_steps();
            let actions = Side::BOTH.map(|side| {
                let request = game.action_request(side).unwrap()?;
                let mut joints: [f64; 7] = request.observation[6..13].try_into().unwrap();
                joints[0] += 0.001 * f64::from(step % 30);
                let interpolation = interpolations[side.index()].unwrap();
                Some(interpolation.hold_position(&joints)[..interpolation.len()].to_vec())
            });
            let responses = [0, 1].map(|side| {
                // Some answers take longer than a control step of 0.02 s and are late.
                let computation_time_s = if step % 100 == 7 {
                    0.03125
                } else {
                    0.001953125
                };
                let timing = AnswerTiming {
                    computation_time_s,
                    host_time_s: 0.0,
                    cpu_time_s: None,
                };
                match &actions[side] {
                    None => Response::Held,
                    Some(_)
                        if (rally, step, side) == (0, 40, 1)
                            || (rally, step, side) == (1, 9, 0) =>
                    {
                        Response::Fault {
                            fault: fault("step"),
                            timing,
                        }
                    }
                    Some(action) => Response::Answer { action, timing },
                }
            });
            game.answer(responses).unwrap();
        }
    }
    let calibration = GameCalibration {
        sides: [SlotTiming::default(); 2],
    };
    let recorded = RecordedGame {
        spec: &spec,
        agents: &["one".to_owned(), "other".to_owned()],
        finished: game.finish(),
        calibration,
        logs: &["log of one\n".to_owned(), "log of the other\n".to_owned()],
    };
    recorded.write(out).unwrap();
}

/// The folder of a recorded game, and a folder with its unpacked archive.
fn recorded() -> (TempDir, TempDir) {
    let (out, unpacked) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    record(out.path());
    let archive = File::open(out.path().join(GAME_FILE)).unwrap();
    let mut zip = ZipArchive::new(archive).unwrap();
    zip.extract(unpacked.path()).unwrap();
    (out, unpacked)
}

/// The number of verified steps, or the text of the error.
fn verify(path: &Path) -> Result<u32, String> {
    let recording = GameRecording::open(path).map_err(|error| error.to_string())?;
    verify_game(&recording, &|_| ())
        .map(|verified| verified.steps)
        .map_err(|error| error.to_string())
}

#[test]
fn recording_verifies_and_is_reproducible() {
    let (out, unpacked) = recorded();
    assert_eq!(verify(&out.path().join(GAME_FILE)), Ok(STEPS));
    assert_eq!(verify(out.path()), Ok(STEPS));
    assert_eq!(verify(unpacked.path()), Ok(STEPS));
    let outcome = GameRecording::open(out.path()).unwrap().outcome().unwrap();
    let faults = outcome.sides.each_ref().map(|side| side.faults.len());
    assert!(faults[0] >= 2 && faults[1] >= 2, "{outcome:?}");
    assert!(outcome.sides.iter().all(|side| side.late_answers > 0));
    let (second_out, _) = recorded();
    for name in [GAME_FILE, side_file(Side::First), side_file(Side::Second)] {
        let bytes = [&out, &second_out].map(|dir| fs::read(dir.path().join(name)).unwrap());
        assert!(bytes[0] == bytes[1], "{name}");
        assert!(GameRecording::is_at(&out.path().join(name)).unwrap());
    }
    assert!(!out.path().join("tables").exists());
}

#[test]
fn games_of_the_second_ruleset_verify() {
    let (_out, unpacked) = recorded();
    let earlier = Forgery::copy_of(unpacked.path());
    for name in ["manifest.json", "results.json"] {
        earlier.replace_text(name, "airhockey-2023.3", "airhockey-2023.2");
    }
    assert_eq!(verify(earlier.update_manifest().dir.path()), Ok(STEPS));
}

/// Forgeries with updated hashes differ from the simulation.
#[test]
fn forged_value_in_any_column_is_found() {
    let (_out, unpacked) = recorded();
    for (name, row) in [
        ("motion.parquet", 20),
        ("side-1.parquet", 20),
        ("rallies.parquet", 1),
        ("entries-2.parquet", 1),
    ] {
        let columns: Vec<String> = crate::recordings::table(&unpacked.path().join(name))
            .schema()
            .fields()
            .iter()
            .map(|field| field.name().clone())
            .collect();
        for column in columns {
            // No other number follows from host interference or CPU time.
            if ["host_time_ns", "cpu_time_ns"].contains(&column.as_str()) {
                continue;
            }
            let forged = Forgery::copy_of(unpacked.path());
            let mut is_unchanged = false;
            forged.change_table(name, |batch| {
                let changed = flipped(&batch, &column, row);
                is_unchanged = batch.column_by_name(&column).unwrap().to_data()
                    == changed.column_by_name(&column).unwrap().to_data();
                changed
            });
            if is_unchanged {
                // The row has no value in this column.
                continue;
            }
            let found = verify(forged.update_manifest().dir.path());
            let message = found.expect_err(&format!("{name}, {column}"));
            assert!(!message.is_empty(), "{name}, {column}");
        }
    }
}

#[test]
fn difference_names_location_and_field() {
    let (_out, unpacked) = recorded();
    let error_of = |name: &str, change: fn(RecordBatch) -> RecordBatch| {
        let forged = Forgery::copy_of(unpacked.path());
        forged.change_table(name, change);
        verify(forged.update_manifest().dir.path()).unwrap_err()
    };
    let message = error_of("motion.parquet", |batch| flipped(&batch, "puck_x", 30));
    assert!(
        message.starts_with("motion.parquet, rally 0, step 30, puck_x: recorded"),
        "{message}"
    );
    let message = error_of("motion.parquet", |batch| batch.slice(0, 100));
    assert!(message.contains("rally 0, step 100, rows"), "{message}");
    let message = error_of("rallies.parquet", |batch| batch.slice(0, 1));
    assert!(message.contains("the game has not ended"), "{message}");
    let message = error_of("entries-1.parquet", |batch| batch.slice(0, 1));
    assert!(
        message.contains("entries-1.parquet, rally 1, rows"),
        "{message}"
    );

    let forged = Forgery::copy_of(unpacked.path());
    forged.replace_text("results.json", "\"goals\": 0", "\"goals\": 7");
    let message = verify(forged.update_manifest().dir.path()).unwrap_err();
    assert!(
        message.contains("results.json, sides[0].goals"),
        "{message}"
    );
    let forged = Forgery::copy_of(unpacked.path());
    let seed = spec().seed.to_string();
    forged.replace_text("manifest.json", &seed, &Seed::from_number(12).to_string());
    let message = verify(forged.dir.path()).unwrap_err();
    assert!(message.contains("rally 0"), "{message}");
}

#[test]
fn damaged_and_foreign_recordings_have_different_errors() {
    let (out, unpacked) = recorded();
    let archive = out.path().join(GAME_FILE);
    let whole = fs::read(&archive).unwrap();
    fs::write(&archive, &whole[..whole.len() / 2]).unwrap();
    assert!(matches!(
        GameRecording::open(&archive),
        Err(DatasetError::Unreadable(_))
    ));
    let forged = Forgery::copy_of(unpacked.path());
    fs::write(forged.path("agent-1.log"), "another log\n").unwrap();
    let altered = GameRecording::open(forged.dir.path()).unwrap_err();
    assert!(matches!(altered, DatasetError::Altered(_)));
    assert!(altered.to_string().contains("agent-1.log"), "{altered}");
    for (from, to, expected) in [
        ("faceoff-game/1", "faceoff-game/9", "this version reads"),
        (
            "airhockey-2023.3",
            "airhockey-2023.1",
            "only airhockey-2023.2 and airhockey-2023.3 have games",
        ),
        (
            "airhockey-2023.3",
            "airhockey-1999",
            "this version knows airhockey-2023.1, airhockey-2023.2, airhockey-2023.3",
        ),
    ] {
        let forged = Forgery::copy_of(unpacked.path());
        forged.replace_text("manifest.json", from, to);
        let message = verify(forged.dir.path()).unwrap_err();
        assert!(message.contains(expected), "{message}");
    }
    let side = GameRecording::open(&out.path().join(side_file(Side::Second))).unwrap_err();
    assert!(matches!(side, DatasetError::Foreign(_)));
    let empty = tempfile::tempdir().unwrap();
    assert!(!GameRecording::is_at(empty.path()).unwrap());
    for name in [GAME_FILE, "dataset.zip"] {
        fs::write(empty.path().join(name), "").unwrap();
    }
    let both = GameRecording::is_at(empty.path()).unwrap_err().to_string();
    assert!(both.contains("pass one of them"), "{both}");
}

#[test]
fn clips_of_a_game_match_its_motion() {
    let (out, unpacked) = recorded();
    let pack = Pack::open(&out.path().join("clips")).unwrap();
    let motion = table(&unpacked.path().join("motion.parquet"));
    let float = |name: &str| motion[name].as_primitive::<Float64Type>().values().to_vec();
    let mut score = [0, 0];
    let mut previous_last: Option<f64> = None;
    let mut rallies = 0;
    for chunk in 0..STEPS.div_ceil(CHUNK_STEPS) {
        let clip = pack.clip(ClipKey::game_motion(chunk)).unwrap().unwrap();
        let clip = Clip::read(&clip).unwrap();
        let first = chunk * CHUNK_STEPS;
        let samples = (STEPS - first).min(CHUNK_STEPS) + 1;
        assert_eq!((clip.header.first, clip.header.samples), (first, samples));
        assert_eq!(clip.header.score, Some(score));
        for (column, recorded) in [
            ("puck_x", "puck_x"),
            ("q_4", "robot_1_q_4"),
            ("opponent_q_4", "robot_2_q_4"),
            ("opponent_dq_2", "robot_2_dq_2"),
            ("universal_1", "robot_1_universal_1"),
        ] {
            let column = clip.column(column).unwrap();
            let recorded = &float(recorded)[first as usize..(first + samples - 1) as usize];
            // The first sample repeats the end of the previous chunk.
            for (found, expected) in column.values().skip(1).zip(recorded) {
                let difference = (found - expected).abs();
                assert!(difference <= 0.5001 * column.scale, "{}", column.name);
            }
        }
        let positions: Vec<f64> = clip.column("puck_x").unwrap().values().collect();
        if let Some(last) = previous_last {
            assert_eq!(
                positions[0], last,
                "a chunk begins at the end of the previous one"
            );
        }
        previous_last = positions.last().copied();
        for end in &clip.header.rally_ends {
            assert!((first + 1..=first + samples).contains(&end.sample));
            score = end.score;
            rallies += 1;
        }
        for side in Side::BOTH {
            let observed = pack
                .clip(ClipKey::game_observed(side, chunk))
                .unwrap()
                .unwrap();
            let observed = Clip::read(&observed).unwrap();
            let times = observed.column("computation_time").unwrap();
            assert_eq!(times.counts.len(), samples as usize - 1);
            // The clip has each side's observation in the table frame.
            let observed_x = observed.column("seen_x").unwrap();
            for (observed_x, true_x) in observed_x.values().zip(&positions) {
                // Half a table is 0.97 m; in the base frame values would be up to 2.5 m.
                assert!(
                    observed_x.abs() < 1.2,
                    "{observed_x} where the puck is at {true_x}"
                );
            }
        }
    }
    let after_last = ClipKey::game_motion(STEPS.div_ceil(CHUNK_STEPS));
    assert!(pack.clip(after_last).unwrap().is_none());
    let recorded = table(&unpacked.path().join("rallies.parquet"));
    assert_eq!(rallies, recorded.num_rows(), "one end per rally");
}
