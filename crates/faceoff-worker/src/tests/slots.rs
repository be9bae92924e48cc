//! Units from claim to commit, and faults of ours.

use super::fixture::*;
use crate::{slot::Rests, tidying};
use faceoff_replay::{Key, Pack};
use faceoff_runner::PlatformFault;
use faceoff_store::*;
use faceoff_types::*;
use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicU32, Ordering},
    },
    thread,
    time::Duration,
};
use tokio_util::sync::CancellationToken;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slots_play_every_shard_once_and_publish_the_dataset() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let evaluator = Scripted::new(|spec, observer| {
        for episode in spec.episodes.clone() {
            observer.episode_done(&outcome(spec.task, episode));
        }
        Ok(())
    });
    let running = server.work(3, &evaluator);
    let EvaluationState::Finished {
        result, dataset, ..
    } = server.over(id).await
    else {
        panic!("it finishes")
    };
    let mut played = evaluator.played.lock().unwrap().clone();
    played.sort_unstable();
    let all: Vec<_> = Task::ALL
        .into_iter()
        .flat_map(|task| [(task, 0), (task, 2)])
        .collect();
    assert_eq!(played, all);
    let in_order: Vec<_> = all
        .iter()
        .map(|(task, first)| format!("{task} {first}"))
        .collect();
    assert_eq!(
        *evaluator.assembled.lock().unwrap(),
        in_order,
        "recordings in order of play"
    );
    let file = server.folder.path().join("dataset");
    server
        .store
        .artifacts()
        .get_to_file(&dataset, &file)
        .await
        .unwrap();
    assert_eq!(std::fs::read_to_string(&file).unwrap(), in_order.join("\n"));
    let season = server.store.season().await.unwrap();
    let of = server.store.evaluation(id).await.unwrap().of;
    assert_eq!(result.seed, season.secret.stage(of.stage).day(of.date));
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_upload_is_checked_by_an_idle_worker() {
    let server = Server::new().await;
    let running = server.work(1, &Scripted::new(|_, _| Ok(())));
    let mut events = server.store.events();
    let good = server.upload("Alpha", b"archive").await.id;
    let bad = server.upload("Beta", b"no archive").await.id;
    let state = async |id, events: &mut tokio::sync::broadcast::Receiver<Change>| loop {
        let state = server.store.submission(id).await.unwrap().state;
        if state.is_settled() {
            break state;
        }
        let _ = events.recv().await;
    };
    assert_eq!(state(good, &mut events).await, SubmissionState::Valid);
    let log = server.store.submission_log(good).await.unwrap();
    assert_eq!(log.as_deref(), Some("smoke\n"));
    let reason = "agent.toml is missing".to_owned();
    let invalid = SubmissionState::Invalid { reason };
    assert_eq!(state(bad, &mut events).await, invalid);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_panic_and_a_fault_of_ours_cost_nothing_but_time() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let (calls, ahead_s) = (AtomicU32::new(0), Arc::clone(&server.ahead_s));
    let evaluator = Scripted::new(move |_, _| {
        match calls.fetch_add(1, Ordering::SeqCst) {
            0 => panic!("a defect of ours"),
            1 => {
                let source = std::io::Error::other("disk full");
                Err(PlatformFault::Io {
                    what: "writing".into(),
                    source,
                })
            }
            // the pause after a failure passes
            _ => {
                ahead_s.fetch_add(10, Ordering::SeqCst);
                Ok(())
            }
        }
    });
    let running = server.work(1, &evaluator);
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Finished { .. }
    ));
    assert_eq!(evaluator.played.lock().unwrap().len(), 6);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_slot_that_failed_rests_while_another_plays_and_ends_when_it_is_asked_to() {
    let hour = Duration::from_secs(3600);
    let mut server = Server::new().await;
    server.intervals.shutdown_grace = hour;
    server.intervals.rests = Rests {
        first: hour,
        longest: hour,
    };
    let id = server.evaluation().await;
    let (began, ahead_s) = (Arc::<Mutex<Vec<_>>>::default(), Arc::clone(&server.ahead_s));
    let slots = Arc::clone(&began);
    let evaluator = Scripted::new(move |_, _| {
        // The rest of the unit passes; that of the slot does not.
        ahead_s.fetch_add(10, Ordering::SeqCst);
        let mut slots = slots.lock().unwrap();
        slots.push(thread::current().name().map(str::to_owned));
        match slots.len() {
            1 => Err(PlatformFault::Recording("a broken disk".into())),
            _ => Ok(()),
        }
    });
    let running = server.work(2, &evaluator);
    assert!(matches!(
        server.over(id).await,
        EvaluationState::Finished { .. }
    ));
    // For longer than the test may take, unless the rest ends with the slot.
    running.stop().await;
    let slots = began.lock().unwrap();
    let (failed, played) = slots.split_first().unwrap();
    assert_eq!(played.len(), 6);
    assert!(!played.contains(failed), "{slots:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_lasting_fault_of_ours_ends_the_evaluation_which_is_queued_again() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let ahead_s = Arc::clone(&server.ahead_s);
    let evaluator = Scripted::new(move |_, _| {
        ahead_s.fetch_add(61, Ordering::SeqCst);
        Err(PlatformFault::Recording("no space left".into()))
    });
    let running = server.work(1, &evaluator);
    let state = server.over(id).await;
    let EvaluationState::PlatformFailed { reason, .. } = &state else {
        panic!("{state:?}")
    };
    assert!(
        reason.starts_with("the recording could not be made"),
        "{reason}"
    );
    assert!(
        !reason.contains("no space left"),
        "the cause is for the log: {reason}"
    );
    running.stop().await;
    let broken = server.store.evaluation(id).await.unwrap();
    let of_team = server.store.evaluations_of(broken.team).await.unwrap();
    let again = of_team.iter().find(|one| one.rerun_of == Some(id));
    assert_eq!(again.unwrap().submission, broken.submission);
}

#[tokio::test]
async fn the_schedule_starts_a_missed_day_once() {
    let server = Server::new().await;
    let submission = server.upload("Alpha", b"archive").await;
    let work = server
        .store
        .claim("test", LEASE_S, server.now())
        .await
        .unwrap()
        .unwrap();
    let outcome = SmokeOutcome::Valid {
        runtime: "native".into(),
        agent_name: "a".into(),
        timing: Vec::new(),
        log: String::new(),
    };
    server
        .store
        .commit_smoke(&work.claim, outcome, server.now())
        .await
        .unwrap();
    let plan = RunPlan {
        profile: Profile::Ideal,
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        episodes_per_shard: 1,
        max_faults: 0,
        variation: Default::default(),
        limits: Default::default(),
    };
    let midnight = Schedule::daily(jiff::civil::Time::midnight());
    // A stage that opened after midnight would wait for the next one.
    let opened = server.now() - jiff::SignedDuration::from_hours(24);
    let stage = stage_by(&server.store, &plan, Some(midnight), opened).await;
    let settings = StageSettings {
        ablation_episodes: 2,
        ..server.store.stage(stage).await.unwrap().settings
    };
    let with_ablations = StageChange {
        settings: Some(settings),
        ..StageChange::default()
    };
    server
        .store
        .change_stage(Actor::Organiser, stage, with_ablations, server.now())
        .await
        .unwrap();
    for first in [true, false] {
        let mut events = server.store.events();
        let shutdown = CancellationToken::new();
        let schedule = crate::run_schedule(server.store.clone(), server.clock(), shutdown.clone());
        let schedule = tokio::spawn(schedule);
        if first {
            let mut kinds = Vec::new();
            for _ in 0..3 {
                let Change::Recorded(record) = events.recv().await.unwrap() else {
                    panic!("nothing is claimed")
                };
                assert_eq!(record.actor, Actor::Schedule);
                kinds.push(record.event);
            }
            assert!(
                matches!(
                    kinds[..],
                    [
                        Event::EvaluationQueued { .. },
                        Event::DayStarted { evaluations: 1 },
                        Event::AblationOrdered {
                            episodes_per_task: 2,
                            ..
                        },
                    ]
                ),
                "{kinds:?}"
            );
        }
        shutdown.cancel();
        schedule.await.unwrap().unwrap();
        assert_eq!(
            server
                .store
                .evaluations_of(submission.team)
                .await
                .unwrap()
                .len(),
            1
        );
    }
}

#[tokio::test]
async fn the_schedule_ends_an_overdue_day_before_the_next_one_starts() {
    let server = Server::new().await;
    let first = server.evaluation().await;
    let first = server.store.evaluation(first).await.unwrap();
    let stage = server.store.stage(first.of.stage).await.unwrap();
    // The next day, and the deadline, in 24 hours.
    let at = server.now().to_zoned(jiff::tz::TimeZone::UTC).time();
    let settings = StageSettings {
        schedule: Some(Schedule::daily(at)),
        ..stage.settings
    };
    let scheduled = StageChange {
        settings: Some(settings),
        ..StageChange::default()
    };
    let scheduled = server
        .store
        .change_stage(Actor::Organiser, stage.id, scheduled, server.now());
    scheduled.await.unwrap();
    server.pass(24 * 3600);
    let mut events = server.store.events();
    let shutdown = CancellationToken::new();
    let schedule = crate::run_schedule(server.store.clone(), server.clock(), shutdown.clone());
    let schedule = tokio::spawn(schedule);
    let mut kinds = Vec::new();
    for _ in 0..5 {
        let Change::Recorded(record) = events.recv().await.unwrap() else {
            panic!("nothing is claimed")
        };
        assert_eq!(record.actor, Actor::Schedule);
        kinds.push(record.event);
    }
    assert!(
        matches!(
            kinds[..],
            [
                Event::DayOverdue { not_played: 1 },
                Event::EvaluationNotPlayed { .. },
                Event::DayReleased,
                Event::EvaluationQueued { .. },
                Event::DayStarted { evaluations: 1 },
            ]
        ),
        "{kinds:?}"
    );
    shutdown.cancel();
    schedule.await.unwrap().unwrap();
}

#[tokio::test]
async fn an_ablation_is_played_on_episodes_of_its_own_in_every_profile() {
    let server = Server::new().await;
    let evaluation = server.evaluation().await;
    let submission = server
        .store
        .evaluation(evaluation)
        .await
        .unwrap()
        .submission;
    let specs = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
    let seen = std::sync::Arc::clone(&specs);
    let evaluator = Scripted::new(move |spec, _| {
        seen.lock().unwrap().push(spec.clone());
        Ok(())
    });
    let plan = RunPlan {
        episodes_per_task: 3,
        episodes_per_shard: 3,
        ..server.store.evaluation(evaluation).await.unwrap().plan
    };
    server
        .store
        .create_ablation(Actor::Organiser, submission, &plan, server.now())
        .await
        .unwrap();
    let mut events = server.store.events();
    let running = server.work(1, &evaluator);
    let ablation = loop {
        let newest = server.store.newest_ablation(submission).await.unwrap();
        match newest {
            Some(ablation) if matches!(ablation.state, AblationState::Finished { .. }) => {
                break ablation;
            }
            // a lagging receiver has missed something: look again
            _ => drop(events.recv().await),
        }
    };
    running.stop().await;
    let secret = server.store.season().await.unwrap().secret;
    let specs = std::mem::take(&mut *specs.lock().unwrap());
    let runs: Vec<_> = specs
        .iter()
        .filter(|spec| spec.seed == secret.ablation())
        .collect();
    assert_eq!((specs.len(), runs.len()), (6 + 18, 18));
    for (run, profile) in runs.chunks(3).zip(Profile::ABLATION) {
        for (run, task) in run.iter().zip(Task::ALL) {
            assert_eq!(
                (run.profile, run.task, &run.episodes),
                (profile, task, &(0..3))
            );
            assert_eq!(run.mismatch_seed, secret.model_mismatch());
        }
    }
    // What ends otherwise than in the ideal simulator is kept, beside how it ended there.
    let artifacts = server.store.artifacts();
    for profile in Profile::ABLATION {
        let key = Artifacts::ablation_clips(ablation.id, profile);
        assert_eq!(artifacts.bytes_of(&key).await.unwrap(), None, "not yet");
    }
    for _ in 0..2 {
        tidying::tidy(&server.store, server.now()).await;
        assert_eq!(artifacts.ablations_in_parts().await.unwrap(), []);
        for profile in Profile::ABLATION {
            let key = Artifacts::ablation_clips(ablation.id, profile);
            let pack = Pack::open(&artifacts.path_of(&key).unwrap()).unwrap();
            let lines = pack.sheet().unwrap().episodes;
            let lines = lines.iter().map(|line| (line.task, line.episode));
            let expected = Task::ALL.map(|task| (task, 1));
            assert_eq!(lines.collect::<Vec<_>>(), expected, "{profile}");
            for task in Task::ALL {
                let told = format!("{profile} 1").into_bytes();
                assert_eq!(pack.clip(Key::motion(task, 1)).unwrap(), Some(told));
                assert_eq!(pack.clip(Key::motion(task, 0)).unwrap(), None);
            }
        }
        // A part that comes late changes nothing.
        let late = Artifacts::ablation_part(ablation.id, Profile::Ideal, Task::Hit, 0);
        server.put(&late, b"late").await;
    }
    for run in ablation.runs.into_values() {
        assert_eq!(server.store.outcomes(run).await.unwrap().len(), 9);
    }
    assert!(
        server
            .store
            .evaluation(evaluation)
            .await
            .unwrap()
            .state
            .is_over()
    );
}
