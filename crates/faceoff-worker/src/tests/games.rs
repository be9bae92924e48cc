//! Games: jobs, attempts, recordings and live updates, with a scripted evaluator.

use super::{
    fixture::*,
    intercepted_server::{InterceptedServer, Interception},
};
use crate::server::{ClaimResult, JobServer as _};
use faceoff_runner::PlatformFault;
use faceoff_store::*;
use faceoff_testkit::wait_for;
use faceoff_types::*;
use faceoff_wire::job::{JobPayload, JobReport};
use std::{
    collections::BTreeSet,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU32, Ordering},
    },
};

/// Any positions of puck and mallets.
const POSITION: LivePosition = LivePosition {
    step: 7,
    puck: [0.1, 0.2, 0.3],
    mallets: [[-0.8, 0.0], [0.8, 0.1]],
};

/// Starts a tournament of two teams whose first round is one queued game.
async fn start_one_game(server: &Server, rules: TournamentRules) -> Game {
    let mut teams = Vec::new();
    for team in ["Alpha", "Beta"] {
        teams.push(server.upload_valid(team).await.team);
    }
    let new = NewTournament {
        name: "Finals".parse().unwrap(),
        stage: None,
        rules,
        settings: TournamentSettings::default(),
        entrants: teams.clone(),
    };
    let opened = server
        .store
        .open_tournament(Actor::Operator, &new, server.now());
    let id = opened.await.unwrap().id;
    let drawn = DrawnRound {
        number: RoundNumber::FIRST,
        groups: Vec::new(),
        matchdays: vec![DrawnMatchday {
            games: vec![[teams[0], teams[1]]],
            byes: Vec::new(),
        }],
    };
    server
        .store
        .start_round(Actor::Operator, id, &drawn, server.now())
        .await
        .unwrap();
    let mut games = server.store.games(id, GameFilter::Rounds).await.unwrap();
    games.remove(0)
}

/// Waits until the game's state satisfies a condition.
async fn wait_for_state(
    server: &Server,
    id: GameId,
    condition: impl Fn(&GameState) -> bool,
) -> GameState {
    wait_for(&server.store, async || {
        let state = server.store.game(id).await.unwrap().state;
        condition(&state).then_some(state)
    })
    .await
}

/// Waits for the result of a game.
async fn wait_for_result(server: &Server, id: GameId) -> StoredGameResult {
    let state = wait_for_state(server, id, |state| !state.is_open()).await;
    let GameState::Played(result) = state else {
        panic!("{state:?}")
    };
    *result
}

/// The outcomes of a game's attempts, which must be over.
async fn attempt_outcomes(server: &Server, id: GameId) -> Vec<AttemptOutcome> {
    let attempts = server.store.game_attempts(id).await.unwrap();
    let ends = attempts.into_iter().map(|attempt| attempt.end);
    ends.map(|end| end.expect("the attempt is over").outcome)
        .collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn game_job_is_complete_and_contains_no_secret() {
    let server = Server::new().await;
    let mut rules = TournamentRules {
        steps: 500,
        ..faceoff_airhockey::competition().tournament_rules()
    };
    rules.game_limits.max_faults = 3;
    rules.limits.pids = Some(7);
    let magnitude = Magnitude::Number(0.25);
    rules
        .perturbations
        .set("tracking_loss", "probability", magnitude);
    let game = start_one_game(&server, rules.clone()).await;
    let local = server.local();
    let claimed = blocking(move || local.claim("test").unwrap()).await;
    let ClaimResult::Job(job) = claimed else {
        panic!("the game is queued")
    };
    let secret = server.store.season().await.unwrap().secret;
    let text = serde_json::to_string(&job).unwrap();
    assert!(!text.contains(&secret.to_string()), "{text}");
    let JobPayload::Game {
        game: job_game,
        attempt,
        agents,
        spec,
        recording,
    } = job.payload
    else {
        panic!("{}", job.payload)
    };
    assert_eq!((job_game, attempt), (game.id, 1));
    for (agent, submission) in agents.iter().zip(game.submissions) {
        let bundle = server.store.submission(submission).await.unwrap().bundle;
        assert_eq!(agent.bundle, bundle);
        assert_eq!(agent.limits.resources.pids, 7);
    }
    assert_eq!(spec.seed, game.seed.seed(&secret));
    assert_eq!(spec.mismatch_seed, secret.model_mismatch());
    assert_eq!((spec.steps, spec.platform_retries), (500, 0));
    assert_eq!(spec.limits, rules.game_limits);
    assert_eq!(spec.perturbations, rules.perturbations);
    let key = format!("games/{}/{}", game.id, job.lease.nonce);
    assert_eq!(recording, Some(key));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn platform_fault_ends_game_without_result_until_rerun() {
    let server = Server::new().await;
    let game = start_one_game(&server, faceoff_airhockey::competition().tournament_rules())
        .await
        .id;
    let seeds = Arc::new(Mutex::new(BTreeSet::new()));
    let failing_evaluator = {
        let seeds = Arc::clone(&seeds);
        ScriptedEvaluator::with_game(move |spec, _| {
            seeds.lock().unwrap().insert(spec.seed.to_string());
            Err(PlatformFault::Recording("a bug of the platform".into()))
        })
    };
    let mut events = server.store.events();
    let running = server.start_slots(1, &failing_evaluator);
    for attempt in 1..=MAX_PLATFORM_FAULTS {
        while ended_attempts(&server, game).await < attempt {
            let _ = events.recv().await;
        }
        // After each failure the job pauses, by the server's clock.
        server.advance(600);
    }
    let state = wait_for_state(&server, game, |state| !state.is_open()).await;
    let GameState::PlatformFailed { reason, .. } = state else {
        panic!("{state:?}")
    };
    assert!(
        reason.contains("the recording could not be made"),
        "{reason}"
    );
    assert_eq!(
        attempt_outcomes(&server, game).await,
        [AttemptOutcome::PlatformFailed; MAX_PLATFORM_FAULTS as usize]
    );
    running.stop().await;

    let rerun = server.store.rerun_game(Actor::Operator, game, server.now());
    rerun.await.unwrap();
    let healthy_evaluator = {
        let seeds = Arc::clone(&seeds);
        ScriptedEvaluator::with_game(move |spec, _| {
            seeds.lock().unwrap().insert(spec.seed.to_string());
            Ok(())
        })
    };
    let running = server.start_slots(1, &healthy_evaluator);
    let result = wait_for_result(&server, game).await;
    assert_eq!(result.attempt, MAX_PLATFORM_FAULTS + 1);
    assert_eq!(result.results["sides"][0]["score"], 1);
    for (side, expected) in Side::BOTH.into_iter().zip(["first log\n", "second log\n"]) {
        let log = server.store.game_log(game, side).await.unwrap();
        assert_eq!(log.as_deref(), Some(expected));
    }
    assert_eq!(
        seeds.lock().unwrap().len(),
        1,
        "all attempts have the same seed"
    );
    running.stop().await;
}

/// The number of attempts that are over.
async fn ended_attempts(server: &Server, game: GameId) -> u32 {
    let attempts = server.store.game_attempts(game).await.unwrap();
    let over = attempts.iter().filter(|attempt| attempt.end.is_some());
    u32::try_from(over.count()).unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn only_the_recording_of_the_last_result_is_kept() {
    let server = Server::new().await;
    let game = start_one_game(&server, faceoff_airhockey::competition().tournament_rules())
        .await
        .id;
    // A recording is left of an attempt whose process was killed between upload and commit.
    let killed = format!("games/{game}/killed/game.zip");
    server.put_artifact(&killed, b"PK").await;
    let evaluator = ScriptedEvaluator::with_game(|_, _| Ok(()));
    let running = server.start_slots(1, &evaluator);
    let files = |result: &StoredGameResult| {
        let recording = result.recording.as_ref().expect("a round's game has one");
        ["game.zip", "side-1.zip", "side-2.zip"].map(|name| format!("{}/{name}", recording.key))
    };
    let first = files(&wait_for_result(&server, game).await);
    for file in &first {
        assert!(server.has_artifact(file).await, "{file}");
    }
    let void = server
        .store
        .void_game(Actor::Operator, game, "the table leaned", server.now());
    void.await.unwrap();
    for file in &first {
        assert!(
            server.has_artifact(file).await,
            "the files are kept until there is another result"
        );
    }
    let rerun = server.store.rerun_game(Actor::Operator, game, server.now());
    rerun.await.unwrap();
    let second = files(&wait_for_result(&server, game).await);
    // The slot removes obsolete recordings before it claims another job.
    running.stop().await;
    for file in &second {
        assert!(server.has_artifact(file).await, "{file}");
    }
    for file in first.iter().chain([&killed]) {
        assert!(!server.has_artifact(file).await, "{file}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn lost_lease_discards_result_and_recording() {
    let server = Server::new().await;
    let game = start_one_game(&server, faceoff_airhockey::competition().tournament_rules())
        .await
        .id;
    let local = server.local();
    let claimed = blocking(move || local.claim("lost").unwrap()).await;
    let ClaimResult::Job(job) = claimed else {
        panic!("the game is queued")
    };
    // The lease expires, and another slot plays the game.
    server.advance(2 * i64::from(LEASE_S));
    let evaluator = ScriptedEvaluator::with_game(|_, _| Ok(()));
    let running = server.start_slots(1, &evaluator);
    let result = wait_for_result(&server, game).await;
    running.stop().await;
    let JobPayload::Game {
        recording: Some(key),
        ..
    } = &job.payload
    else {
        panic!("{}", job.payload)
    };
    let file = format!("{key}/game.zip");
    server.put_artifact(&file, b"PK").await;
    let report = JobReport::Game {
        score: serde_json::json!({"winner": 1}),
        recording: Some(faceoff_wire::job::GameFiles {
            key: key.clone(),
            game_blake3: "ab".repeat(32),
            side_blake3: ["cd".repeat(32), "ef".repeat(32)],
        }),
        logs: Default::default(),
    };
    let (local, lease) = (server.local(), job.lease.clone());
    let status = blocking(move || local.commit(&lease, report).unwrap()).await;
    assert_eq!(status, crate::server::LeaseStatus::Lost);
    assert!(!server.has_artifact(&file).await);
    assert_eq!(wait_for_result(&server, game).await, result);
    assert_eq!(
        attempt_outcomes(&server, game).await,
        [AttemptOutcome::Lost, AttemptOutcome::Played]
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn lost_commit_response_keeps_result_and_recording() {
    let server = Server::new().await;
    let game = start_one_game(&server, faceoff_airhockey::competition().tournament_rules())
        .await
        .id;
    let commits = Arc::new(AtomicU32::new(0));
    let running =
        server.start_intercepted_slots(1, &ScriptedEvaluator::with_game(|_, _| Ok(())), |local| {
            let commits = Arc::clone(&commits);
            InterceptedServer::wrap(local, move |interception| match interception {
                Interception::Committed(_) => {
                    commits.fetch_add(1, Ordering::SeqCst);
                    anyhow::bail!("the connection broke")
                }
                Interception::Releasing => Ok(()),
            })
        });
    let result = wait_for_result(&server, game).await;
    running.stop().await;
    assert_eq!(commits.load(Ordering::SeqCst), 1);
    let key = result.recording.unwrap().key;
    assert!(server.has_artifact(&format!("{key}/game.zip")).await);
    assert_eq!(
        attempt_outcomes(&server, game).await,
        [AttemptOutcome::Played]
    );
    let state = server.store.game(game).await.unwrap().state;
    assert!(matches!(state, GameState::Played(_)), "{state:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn live_updates_cover_each_attempt() {
    let server = Server::new().await;
    let rules = TournamentRules {
        steps: 500,
        ..faceoff_airhockey::competition().tournament_rules()
    };
    let game = start_one_game(&server, rules).await.id;
    let event = LiveEvent {
        step: 7,
        event: GameEvent::Stuck,
    };
    let (published, end_permits) = (event.clone(), Arc::new(tokio::sync::Semaphore::new(0)));
    let (started, mut starts) = tokio::sync::mpsc::unbounded_channel();
    let evaluator_permits = Arc::clone(&end_permits);
    let evaluator = ScriptedEvaluator::with_game(move |_, live_updates| {
        live_updates.receive(vec![published.clone()], POSITION);
        started.send(()).unwrap();
        while evaluator_permits
            .try_acquire()
            .map(|permit| permit.forget())
            .is_err()
        {
            if live_updates.cancelled() {
                return Err(PlatformFault::Cancelled);
            }
            std::thread::yield_now();
        }
        panic!("a bug of the platform");
    });
    let running = server.start_slots(1, &evaluator);
    starts.recv().await.unwrap();
    let mut viewer = server.live.games.subscribe(game).unwrap();
    let updates = viewer.read_since(None);
    assert_eq!(updates.events, [event]);
    assert_eq!((updates.state.attempt, updates.state.steps), (1, 500));
    assert_eq!(updates.state.position, Some(POSITION));
    assert!(!updates.state.is_over);

    // A panic ends the attempt and its live updates.
    end_permits.add_permits(1);
    let mut aborted = viewer.read_since(Some(updates.end));
    while !aborted.state.is_over {
        assert!(viewer.changed().await);
        aborted = viewer.read_since(Some(updates.end));
    }
    assert_eq!(aborted.events[0].event, GameEvent::Aborted);
    while ended_attempts(&server, game).await < 1 {
        tokio::task::yield_now().await;
    }
    server.advance(600);
    starts.recv().await.unwrap();
    let second = viewer.read_since(Some(aborted.end));
    assert_eq!((second.state.attempt, second.state.is_over), (2, false));
    // A shutdown releases the game without counting the attempt.
    running.stop().await;
    assert_eq!(
        attempt_outcomes(&server, game).await,
        [AttemptOutcome::PlatformFailed, AttemptOutcome::Released]
    );
    assert!(viewer.read_since(None).state.is_over);
}
