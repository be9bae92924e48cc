//! Games: orders, attempts, recordings and what is shown, with an evaluator that plays what a test tells it to.

use super::{
    between::{Between, Moment},
    fixture::*,
};
use crate::server::{Claimed, WorkServer as _};
use faceoff_runner::PlatformFault;
use faceoff_store::*;
use faceoff_types::*;
use faceoff_wire::work::{Assignment, WorkReport};
use std::{
    collections::BTreeSet,
    sync::{
        Arc, Mutex,
        atomic::{AtomicU32, Ordering},
    },
};

const POSITION: LivePosition = LivePosition {
    step: 7,
    puck: [0.1, 0.2, 0.3],
    mallets: [[-0.8, 0.0], [0.8, 0.1]],
};

/// A tournament of two teams whose first round is one game, which waits.
async fn one_game(server: &Server, rules: TournamentRules) -> Game {
    let mut teams = Vec::new();
    for team in ["Alpha", "Beta"] {
        teams.push(server.valid(team).await.team);
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
        .open_tournament(Actor::Organiser, &new, server.now());
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
        .start_round(Actor::Organiser, id, &drawn, server.now())
        .await
        .unwrap();
    let mut games = server.store.games(id, GamesOf::Rounds).await.unwrap();
    games.remove(0)
}

/// Waits until a game stands so.
async fn stands(server: &Server, id: GameId, so: impl Fn(&GameState) -> bool) -> GameState {
    let mut events = server.store.events();
    loop {
        let state = server.store.game(id).await.unwrap().state;
        if so(&state) {
            return state;
        }
        // a lagging receiver has missed something: look again
        let _ = events.recv().await;
    }
}

async fn played(server: &Server, id: GameId) -> GameResultRow {
    let state = stands(server, id, |state| !state.is_open()).await;
    let GameState::Played(result) = state else {
        panic!("{state:?}")
    };
    *result
}

async fn ends(server: &Server, id: GameId) -> Vec<AttemptOutcome> {
    let attempts = server.store.game_attempts(id).await.unwrap();
    let ends = attempts.into_iter().map(|attempt| attempt.end);
    ends.map(|end| end.expect("it is over").how).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_order_of_a_game_tells_all_and_no_secret() {
    let server = Server::new().await;
    let mut rules = TournamentRules {
        steps: 500,
        ..TournamentRules::default()
    };
    rules.game_limits.max_faults = 3;
    rules.limits.pids = Some(7);
    rules.perturbations.tracking_loss.probability = 0.25;
    let game = one_game(&server, rules.clone()).await;
    let local = server.local();
    let claimed = blocking(move || local.claim("test").unwrap()).await;
    let Claimed::Order(order) = claimed else {
        panic!("the game is queued")
    };
    let secret = server.store.season().await.unwrap().secret;
    let text = serde_json::to_string(&order).unwrap();
    assert!(!text.contains(&secret.to_string()), "{text}");
    let Assignment::Game {
        game: ordered,
        attempt,
        agents,
        spec,
        recording,
    } = order.assignment
    else {
        panic!("{}", order.assignment)
    };
    assert_eq!((ordered, attempt), (game.id, 1));
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
    let key = format!("games/{}/{}", game.id, order.lease.nonce);
    assert_eq!(recording, Some(key));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_game_that_we_break_is_an_attempt_and_no_result_until_it_is_played_again() {
    let server = Server::new().await;
    let game = one_game(&server, TournamentRules::default()).await.id;
    let seeds = Arc::new(Mutex::new(BTreeSet::new()));
    let broken = {
        let seeds = Arc::clone(&seeds);
        Scripted::of_games(move |spec, _| {
            seeds.lock().unwrap().insert(spec.seed.to_string());
            Err(PlatformFault::Recording("a defect of ours".into()))
        })
    };
    let mut events = server.store.events();
    let running = server.work(1, &broken);
    for attempt in 1..=MAX_ATTEMPTS {
        while ended(&server, game).await < attempt {
            let _ = events.recv().await;
        }
        // It rests after each failure, by the server's clock.
        server.pass(600);
    }
    let state = stands(&server, game, |state| !state.is_open()).await;
    let GameState::Broken { reason, .. } = state else {
        panic!("{state:?}")
    };
    assert!(
        reason.contains("the recording could not be made"),
        "{reason}"
    );
    assert_eq!(ends(&server, game).await, [AttemptOutcome::Broken; 5]);
    running.stop().await;

    let rerun = server
        .store
        .rerun_game(Actor::Organiser, game, server.now());
    rerun.await.unwrap();
    let healthy = {
        let seeds = Arc::clone(&seeds);
        Scripted::of_games(move |spec, _| {
            seeds.lock().unwrap().insert(spec.seed.to_string());
            Ok(())
        })
    };
    let running = server.work(1, &healthy);
    let result = played(&server, game).await;
    assert_eq!(result.attempt, 6);
    assert_eq!(result.score["sides"][0]["score"], 1);
    for (side, told) in Side::BOTH.into_iter().zip(["first log\n", "second log\n"]) {
        let log = server.store.game_log(game, side).await.unwrap();
        assert_eq!(log.as_deref(), Some(told));
    }
    assert_eq!(seeds.lock().unwrap().len(), 1, "one seed, however often");
    running.stop().await;
}

/// How many attempts are over.
async fn ended(server: &Server, game: GameId) -> u32 {
    let attempts = server.store.game_attempts(game).await.unwrap();
    let over = attempts.iter().filter(|attempt| attempt.end.is_some());
    u32::try_from(over.count()).unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn of_a_games_recordings_the_one_that_counts_is_kept() {
    let server = Server::new().await;
    let game = one_game(&server, TournamentRules::default()).await.id;
    // of an attempt that was killed between upload and commit
    let killed = format!("games/{game}/killed/game.zip");
    server.put(&killed, b"PK").await;
    let evaluator = Scripted::of_games(|_, _| Ok(()));
    let running = server.work(1, &evaluator);
    let files = |result: &GameResultRow| {
        let recording = result.recording.as_ref().expect("a round's game has one");
        ["game.zip", "side-1.zip", "side-2.zip"].map(|name| format!("{}/{name}", recording.key))
    };
    let first = files(&played(&server, game).await);
    for file in &first {
        assert!(server.has(file).await, "{file}");
    }
    let void = server
        .store
        .void_game(Actor::Organiser, game, "the table leaned", server.now());
    void.await.unwrap();
    for file in &first {
        assert!(server.has(file).await, "until another result stands");
    }
    let rerun = server
        .store
        .rerun_game(Actor::Organiser, game, server.now());
    rerun.await.unwrap();
    let second = files(&played(&server, game).await);
    // The slot removes what nobody needs before it looks for more work.
    running.stop().await;
    for file in &second {
        assert!(server.has(file).await, "{file}");
    }
    for file in first.iter().chain([&killed]) {
        assert!(!server.has(file).await, "{file}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_recording_of_a_lost_lease_is_removed_and_its_result_does_not_count() {
    let server = Server::new().await;
    let game = one_game(&server, TournamentRules::default()).await.id;
    let local = server.local();
    let claimed = blocking(move || local.claim("lost").unwrap()).await;
    let Claimed::Order(order) = claimed else {
        panic!("the game is queued")
    };
    // Its lease ends, and another slot plays the game.
    server.pass(2 * i64::from(LEASE_S));
    let evaluator = Scripted::of_games(|_, _| Ok(()));
    let running = server.work(1, &evaluator);
    let result = played(&server, game).await;
    running.stop().await;
    let Assignment::Game {
        recording: Some(key),
        ..
    } = &order.assignment
    else {
        panic!("{}", order.assignment)
    };
    let file = format!("{key}/game.zip");
    server.put(&file, b"PK").await;
    let report = WorkReport::Game {
        score: serde_json::json!({"winner": 1}),
        recording: Some(faceoff_wire::work::StoredGame {
            key: key.clone(),
            game_blake3: "ab".repeat(32),
            side_blake3: ["cd".repeat(32), "ef".repeat(32)],
        }),
        logs: Default::default(),
    };
    let (local, lease) = (server.local(), order.lease.clone());
    let holding = blocking(move || local.commit(&lease, report).unwrap()).await;
    assert_eq!(holding, crate::server::Holding::Lost);
    assert!(!server.has(&file).await);
    assert_eq!(played(&server, game).await, result);
    assert_eq!(
        ends(&server, game).await,
        [AttemptOutcome::Lost, AttemptOutcome::Played]
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_answer_that_is_lost_after_a_commit_leaves_result_and_recording() {
    let server = Server::new().await;
    let game = one_game(&server, TournamentRules::default()).await.id;
    let commits = Arc::new(AtomicU32::new(0));
    let running = server.work_through(1, &Scripted::of_games(|_, _| Ok(())), |local| {
        let commits = Arc::clone(&commits);
        Between::slots_and(local, move |moment| match moment {
            Moment::Committed(_) => {
                commits.fetch_add(1, Ordering::SeqCst);
                anyhow::bail!("the connection broke")
            }
            Moment::GivingBack => Ok(()),
        })
    });
    let result = played(&server, game).await;
    running.stop().await;
    assert_eq!(commits.load(Ordering::SeqCst), 1);
    let key = result.recording.unwrap().key;
    assert!(server.has(&format!("{key}/game.zip")).await);
    assert_eq!(ends(&server, game).await, [AttemptOutcome::Played]);
    let state = server.store.game(game).await.unwrap().state;
    assert!(matches!(state, GameState::Played(_)), "{state:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_game_is_shown_while_it_is_played_and_anew_when_it_is_played_again() {
    let server = Server::new().await;
    let rules = TournamentRules {
        steps: 500,
        ..TournamentRules::default()
    };
    let game = one_game(&server, rules).await.id;
    let happening = LiveHappening {
        step: 7,
        what: GameHappening::Stuck,
    };
    let (told, go_on) = (happening.clone(), Arc::new(tokio::sync::Semaphore::new(0)));
    let (begun, mut begins) = tokio::sync::mpsc::unbounded_channel();
    let gate = Arc::clone(&go_on);
    let evaluator = Scripted::of_games(move |_, audience| {
        audience.hear(vec![told.clone()], POSITION);
        begun.send(()).unwrap();
        while gate.try_acquire().map(|permit| permit.forget()).is_err() {
            if audience.cancelled() {
                return Err(PlatformFault::Cancelled);
            }
            std::thread::yield_now();
        }
        panic!("a defect of ours");
    });
    let running = server.work(1, &evaluator);
    begins.recv().await.unwrap();
    let mut watch = server.store.live_games().watch(game).unwrap();
    let news = watch.news(None);
    assert_eq!(news.happenings, [happening]);
    assert_eq!((news.stands.attempt, news.stands.steps), (1, 500));
    assert_eq!(news.stands.position, Some(POSITION));
    assert!(!news.stands.is_over);

    // A panic ends the attempt, and what is shown of it.
    go_on.add_permits(1);
    let mut broken = watch.news(Some(news.mark));
    while !broken.stands.is_over {
        assert!(watch.changed().await);
        broken = watch.news(Some(news.mark));
    }
    assert_eq!(broken.happenings[0].what, GameHappening::BrokenOff);
    while ended(&server, game).await < 1 {
        tokio::task::yield_now().await;
    }
    server.pass(600);
    begins.recv().await.unwrap();
    let anew = watch.news(Some(broken.mark));
    assert_eq!((anew.stands.attempt, anew.stands.is_over), (2, false));
    // A shutdown gives it back: the attempt does not count against the game.
    running.stop().await;
    assert_eq!(
        ends(&server, game).await,
        [AttemptOutcome::Broken, AttemptOutcome::GivenBack]
    );
    assert!(watch.news(None).stands.is_over);
}
