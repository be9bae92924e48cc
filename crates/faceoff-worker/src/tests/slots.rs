//! Jobs from claim to commit, and platform faults.

use super::fixture::*;
use crate::{cleanup, slot::Backoff};
use faceoff_airhockey::{ABLATION_PROFILES, HIT, IDEAL, TASKS};
use faceoff_replay::{ClipKey, Pack};
use faceoff_runner::PlatformFault;
use faceoff_scoring::EpisodeSummary;
use faceoff_store::*;
use faceoff_testkit::{
    change_settings, configure_stage, finish_validation, one_shard_plan, valid_outcome,
};
use faceoff_types::*;
use std::{
    sync::{
        Arc, Mutex,
        atomic::{AtomicU32, Ordering},
    },
    thread,
    time::Duration,
};
use tokio::sync::broadcast;
use tokio_util::sync::CancellationToken;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn slots_play_each_shard_once_and_store_the_dataset() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let evaluator = ScriptedEvaluator::new(|spec, observer| {
        for episode in spec.episodes.clone() {
            observer.on_episode_end(&outcome(spec.task, episode));
        }
        Ok(())
    });
    let running = server.start_slots(3, &evaluator);
    let EvaluationState::Finished {
        result, dataset, ..
    } = server.wait_for_end(id).await
    else {
        panic!("the evaluation finishes")
    };
    let mut played = evaluator.played.lock().unwrap().clone();
    played.sort_by_key(|(task, first)| (TASKS.iter().position(|other| other == task), *first));
    // Task and first episode of each shard of two episodes.
    let all: Vec<_> = TASKS
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
    let day = server.store.evaluation(id).await.unwrap().stage_day;
    assert_eq!(result.seed, season.secret.stage(day.stage).day(day.date));
    running.stop().await;
}

/// The state of a submission after its validation run.
async fn validated_state(
    server: &Server,
    id: SubmissionId,
    events: &mut broadcast::Receiver<Change>,
) -> SubmissionState {
    loop {
        let state = server.store.submission(id).await.unwrap().state;
        if state.validation_is_over() {
            return state;
        }
        let _ = events.recv().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn idle_slot_validates_submissions() {
    let server = Server::new().await;
    let running = server.start_slots(1, &ScriptedEvaluator::new(|_, _| Ok(())));
    let mut events = server.store.events();
    let valid_id = server.upload("Alpha", VALID_ARCHIVE).await.id;
    let invalid_id = server.upload("Beta", INVALID_ARCHIVE).await.id;
    assert_eq!(
        validated_state(&server, valid_id, &mut events).await,
        SubmissionState::Valid
    );
    let log = server.store.submission_log(valid_id).await.unwrap();
    assert_eq!(log.as_deref(), Some("validated\n"));
    let reason = "agent.toml is missing".to_owned();
    let invalid = SubmissionState::Invalid { reason };
    assert_eq!(
        validated_state(&server, invalid_id, &mut events).await,
        invalid
    );
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn panics_and_platform_faults_are_retried() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let (calls, clock_ahead_s) = (AtomicU32::new(0), Arc::clone(&server.clock_ahead_s));
    let evaluator = ScriptedEvaluator::new(move |_, _| {
        match calls.fetch_add(1, Ordering::SeqCst) {
            0 => panic!("a bug of the platform"),
            1 => {
                let source = std::io::Error::other("disk full");
                Err(PlatformFault::Io {
                    action: "writing".into(),
                    source,
                })
            }
            // Skips the pause of the job after a failure.
            _ => {
                clock_ahead_s.fetch_add(10, Ordering::SeqCst);
                Ok(())
            }
        }
    });
    let running = server.start_slots(1, &evaluator);
    server.wait_for_result(id).await;
    assert_eq!(evaluator.played.lock().unwrap().len(), 6);
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn error_after_a_cancellation_is_no_platform_fault() {
    let hour = Duration::from_secs(3600);
    let mut server = Server::new().await;
    server.intervals.backoff = Backoff {
        first: hour,
        longest: hour,
    };
    let id = server.start_evaluation().await;
    let (handle, clock) = (tokio::runtime::Handle::current(), server.clock());
    let store = server.store.clone();
    // Ends before the lease keeper has noticed that the lease is lost.
    let evaluator = ScriptedEvaluator::new(move |_, _| {
        let cancelled = store.cancel_evaluation(Actor::Operator, id, "a test", clock.now());
        handle.block_on(cancelled).unwrap();
        Err(PlatformFault::Io {
            action: "fetching the bundle".into(),
            source: std::io::Error::other("the lease is lost"),
        })
    });
    let running = server.start_slots(1, &evaluator);
    server.wait_for_end(id).await;
    let mut events = server.store.events();
    let upload = server.upload("Beta", VALID_ARCHIVE).await;
    // The slot does not pause, as it would after a platform fault.
    assert_eq!(
        validated_state(&server, upload.id, &mut events).await,
        SubmissionState::Valid
    );
    running.stop().await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn failed_slot_pauses_and_stops_at_shutdown() {
    let hour = Duration::from_secs(3600);
    let mut server = Server::new().await;
    server.intervals.shutdown_grace = hour;
    server.intervals.backoff = Backoff {
        first: hour,
        longest: hour,
    };
    let id = server.start_evaluation().await;
    let (started, clock_ahead_s) = (
        Arc::<Mutex<Vec<_>>>::default(),
        Arc::clone(&server.clock_ahead_s),
    );
    let thread_names = Arc::clone(&started);
    let evaluator = ScriptedEvaluator::new(move |_, _| {
        // Skips the pause of the job, but not that of the slot.
        clock_ahead_s.fetch_add(10, Ordering::SeqCst);
        let mut thread_names = thread_names.lock().unwrap();
        thread_names.push(thread::current().name().map(str::to_owned));
        match thread_names.len() {
            1 => Err(PlatformFault::Recording("a broken disk".into())),
            _ => Ok(()),
        }
    });
    let running = server.start_slots(2, &evaluator);
    server.wait_for_result(id).await;
    // Without the shutdown, the pause would outlast the test.
    running.stop().await;
    let thread_names = started.lock().unwrap();
    let (failed_slot, later_slots) = thread_names.split_first().unwrap();
    assert_eq!(later_slots.len(), 6, "one for each shard");
    assert!(!later_slots.contains(failed_slot), "{thread_names:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn lasting_platform_fault_fails_and_requeues_evaluation() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let clock_ahead_s = Arc::clone(&server.clock_ahead_s);
    let evaluator = ScriptedEvaluator::new(move |_, _| {
        // Skips the pause of the job after a failure.
        clock_ahead_s.fetch_add(61, Ordering::SeqCst);
        Err(PlatformFault::Recording("no space left".into()))
    });
    let running = server.start_slots(1, &evaluator);
    let state = server.wait_for_end(id).await;
    let EvaluationState::PlatformFailed { reason, .. } = &state else {
        panic!("{state:?}")
    };
    assert!(
        reason.starts_with("the recording could not be made"),
        "{reason}"
    );
    assert!(
        !reason.contains("no space left"),
        "the cause is for the log only: {reason}"
    );
    running.stop().await;
    let failed = server.store.evaluation(id).await.unwrap();
    let evaluations = server.store.evaluations_of(failed.team).await.unwrap();
    let rerun = evaluations
        .iter()
        .find(|evaluation| evaluation.rerun_of == Some(id));
    assert_eq!(rerun.unwrap().submission, failed.submission);
}

/// The next events, all of which the schedule must have caused.
async fn next_schedule_events(
    events: &mut broadcast::Receiver<Change>,
    count: usize,
) -> Vec<Event> {
    let mut found = Vec::new();
    while found.len() < count {
        let Change::Recorded(record) = events.recv().await.unwrap() else {
            panic!("every change is recorded as an event")
        };
        assert_eq!(record.actor, Actor::Schedule);
        found.push(record.event);
    }
    found
}

#[tokio::test]
async fn missed_day_is_started_once() {
    let server = Server::new().await;
    let submission = server.upload("Alpha", VALID_ARCHIVE).await;
    let outcome = valid_outcome("native", "a", "");
    finish_validation(&server.store, outcome, server.now()).await;
    let plan = RunPlan {
        profile: IDEAL,
        max_faults: 0,
        ..one_shard_plan()
    };
    let midnight = Schedule::daily(jiff::civil::Time::midnight());
    // A stage that opened after midnight would start at the next midnight.
    let opened = server.now() - jiff::SignedDuration::from_hours(24);
    let stage = configure_stage(&server.store, &plan, Some(midnight), opened).await;
    change_settings(&server.store, stage, server.now(), |settings| {
        settings.ablation_episodes = 2;
    })
    .await
    .unwrap();
    for is_first_start in [true, false] {
        let mut events = server.store.events();
        let shutdown = CancellationToken::new();
        let schedule = crate::run_schedule(
            server.store.clone(),
            server.local().competition().clone(),
            server.clock(),
            shutdown.clone(),
        );
        let schedule = tokio::spawn(schedule);
        if is_first_start {
            let kinds = next_schedule_events(&mut events, 3).await;
            assert!(
                matches!(
                    kinds[..],
                    [
                        Event::EvaluationQueued { .. },
                        Event::DayStarted { evaluations: 1 },
                        Event::AblationRequested {
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
async fn overdue_day_ends_before_the_next_one_starts() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let evaluation = server.store.evaluation(id).await.unwrap();
    // The next day starts in 24 hours, which is also the deadline.
    let cutoff = server.now().to_zoned(jiff::tz::TimeZone::UTC).time();
    let stage = evaluation.stage_day.stage;
    let scheduled = change_settings(&server.store, stage, server.now(), |settings| {
        settings.schedule = Some(Schedule::daily(cutoff));
    });
    scheduled.await.unwrap();
    server.advance(24 * 3600);
    let mut events = server.store.events();
    let shutdown = CancellationToken::new();
    let schedule = crate::run_schedule(
        server.store.clone(),
        server.local().competition().clone(),
        server.clock(),
        shutdown.clone(),
    );
    let schedule = tokio::spawn(schedule);
    let kinds = next_schedule_events(&mut events, 5).await;
    assert!(
        matches!(
            kinds[..],
            [
                Event::DayOverdue { not_played: 1 },
                Event::EvaluationDeadlineMissed { .. },
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
async fn ablation_plays_own_episodes_in_all_profiles() {
    let server = Server::new().await;
    let evaluation = server.start_evaluation().await;
    let submission = server
        .store
        .evaluation(evaluation)
        .await
        .unwrap()
        .submission;
    let specs = Arc::new(Mutex::new(Vec::new()));
    let recorded_specs = Arc::clone(&specs);
    let evaluator = ScriptedEvaluator::new(move |spec, _| {
        recorded_specs.lock().unwrap().push(spec.clone());
        Ok(())
    });
    let plan = RunPlan {
        episodes_per_task: 3,
        episodes_per_shard: 3,
        ..server.store.evaluation(evaluation).await.unwrap().plan
    };
    server
        .store
        .request_ablation(
            Actor::Operator,
            submission,
            faceoff_airhockey::RULESET,
            &plan,
            &ABLATION_PROFILES,
            server.now(),
        )
        .await
        .unwrap();
    let mut events = server.store.events();
    let running = server.start_slots(1, &evaluator);
    let ablation = loop {
        let newest = server.store.newest_ablation(submission).await.unwrap();
        match newest {
            Some(ablation) if matches!(ablation.state, AblationState::Finished { .. }) => {
                break ablation;
            }
            // After a lag, the state is read again.
            _ => drop(events.recv().await),
        }
    };
    running.stop().await;
    let runs: Vec<_> = ablation.runs.values().copied().collect();
    let version = EpisodeSummary::VERSION;
    let summaries = server
        .store
        .episode_summaries(&runs, version)
        .await
        .unwrap();
    assert_eq!(
        summaries.len(),
        runs.len(),
        "the commit of a run's last shard stores its summary"
    );
    let unsummarised = server.store.unsummarised_runs(version).await.unwrap();
    assert_eq!(unsummarised, [], "the scored evaluation has one, too");
    let secret = server.store.season().await.unwrap().secret;
    let specs = std::mem::take(&mut *specs.lock().unwrap());
    let ablation_specs: Vec<_> = specs
        .iter()
        .filter(|spec| spec.seed == secret.ablation())
        .collect();
    // The evaluation has 6 shards; the ablation has one for each of 6 profiles and 3 tasks.
    assert_eq!((specs.len(), ablation_specs.len()), (6 + 18, 18));
    for (run, profile) in ablation_specs.chunks(3).zip(ABLATION_PROFILES) {
        // The order of a run's shards is random.
        for task in TASKS {
            let spec = run.iter().find(|spec| spec.task == task);
            let spec = spec.expect("each task is played");
            assert_eq!(
                (spec.profile, spec.task, &spec.episodes),
                (profile, task, &(0..3))
            );
            assert_eq!(spec.mismatch_seed, secret.model_mismatch());
        }
    }
    // Clips are kept of episodes that end differently than in the ideal simulator, together with the same episodes in the ideal simulator.
    // In the scripted clips this is episode 1 of each task.
    let artifacts = server.store.artifacts();
    for _ in 0..2 {
        cleanup::clean_up(&server.store, server.local().competition(), &server.clock()).await;
        assert_eq!(artifacts.ablations_with_parts().await.unwrap(), []);
        for profile in ABLATION_PROFILES {
            let key = Artifacts::ablation_clips_key(ablation.id, profile);
            let pack = Pack::open(&artifacts.local_path(&key).unwrap()).unwrap();
            let entries = pack.clip_index().unwrap().episodes;
            let entries = entries.iter().map(|entry| (entry.task, entry.episode));
            let expected = TASKS.map(|task| (task, 1));
            assert_eq!(entries.collect::<Vec<_>>(), expected, "{profile}");
            for task in TASKS {
                let clip = format!("{profile} 1").into_bytes();
                assert_eq!(pack.clip(ClipKey::motion(task, 1)).unwrap(), Some(clip));
                assert_eq!(pack.clip(ClipKey::motion(task, 0)).unwrap(), None);
            }
        }
        // A part that arrives late has no effect.
        let late = Artifacts::ablation_part_key(ablation.id, IDEAL, HIT, 0);
        server.put_artifact(&late, b"late").await;
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
