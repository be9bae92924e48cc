//! Tournaments: entrants, rounds, games and their attempts (each start of a game is one), test games against the baseline (an opponent
//! that the organisers choose), friendly games between two teams, and schedule replays (all games played once more, to estimate how
//! much the result owes to chance).

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use proptest::prelude::*;
use serde_json::json;

/// Of voided games, pauses and departures.
const REASON: &str = "the table was tilted";

fn round(number: u32) -> RoundNumber {
    number.try_into().unwrap()
}

/// A tournament with these rules and teams, each of which has a valid submission.
async fn tournament_of(
    f: &TestStore,
    names: &[&str],
    rules: TournamentRules,
) -> (Tournament, Vec<TeamId>) {
    let mut teams = Vec::new();
    for name in names {
        teams.push(f.valid_submission_of(name).await.team);
    }
    let new = NewTournament {
        name: "Cup".parse().unwrap(),
        stage: None,
        rules,
        settings: TournamentSettings::default(),
        entrants: teams.clone(),
    };
    let opened = f.store.open_tournament(Actor::Operator, &new, f.now).await;
    (opened.unwrap(), teams)
}

/// A drawn round: the games of each matchday, and the team that has none on it (`byes`, one per matchday).
fn drawn(number: u32, matchdays: &[&[[TeamId; 2]]], byes: &[TeamId]) -> DrawnRound {
    let mut matchdays: Vec<_> = matchdays
        .iter()
        .map(|games| DrawnMatchday {
            games: games.to_vec(),
            byes: Vec::new(),
        })
        .collect();
    for (day, bye) in matchdays.iter_mut().zip(byes) {
        day.byes.push(*bye);
    }
    DrawnRound {
        number: round(number),
        groups: Vec::new(),
        matchdays,
    }
}

async fn start_round(
    f: &TestStore,
    id: TournamentId,
    drawn: &DrawnRound,
) -> Result<TournamentRound, StoreError> {
    f.store.start_round(Actor::Operator, id, drawn, f.now).await
}

/// A tournament of two teams whose first round, of one game, has started.
async fn one_game(f: &TestStore, rules: TournamentRules) -> (Tournament, Vec<TeamId>) {
    let (cup, teams) = tournament_of(f, &["A", "B"], rules).await;
    let round = drawn(1, &[&[[teams[0], teams[1]]]], &[]);
    start_round(f, cup.id, &round).await.unwrap();
    (cup, teams)
}

/// A tournament of three teams whose first round has started. Each of its three matchdays has one game.
async fn three_games(f: &TestStore) -> (Tournament, [TeamId; 3]) {
    let (cup, teams) = tournament_of(
        f,
        &["A", "B", "C"],
        faceoff_airhockey::competition().tournament_rules(),
    )
    .await;
    let [a, b, c] = teams[..] else { panic!() };
    let round = drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]);
    start_round(f, cup.id, &round).await.unwrap();
    (cup, [a, b, c])
}

async fn record(f: &TestStore, id: TournamentId) -> TournamentRecord {
    f.store.tournament_record(id).await.unwrap()
}

/// The result of a game, as a worker commits it. Games of schedule replays have no recording.
fn game_commit(recorded: bool) -> GameCommit {
    let hash = || "0".repeat(64);
    GameCommit {
        results: json!({"steps": 500}),
        recording: recorded.then(|| GameRecording {
            key: "games/1/2".to_owned(),
            game_blake3: hash(),
            side_blake3: [hash(), hash()],
        }),
        logs: ["home\n".to_owned(), "away\n".to_owned()],
    }
}

/// Claims the next job, which must be a game. The last number counts the game's attempts from 1.
async fn claim_game(f: &TestStore) -> (JobClaim, GameId, u32) {
    match f.claim().await {
        Some(ClaimedJob {
            claim,
            job: Job::Game { game, attempt, .. },
        }) => (claim, game, attempt),
        other => panic!("expected a game: {other:?}"),
    }
}

async fn run_next_game(f: &TestStore) -> GameId {
    let (claim, game, _) = claim_game(f).await;
    let recorded = f.store.game(game).await.unwrap().purpose.keeps_recording();
    let committed = f
        .store
        .commit_game(&claim, &game_commit(recorded), f.now)
        .await;
    assert_eq!(committed.unwrap(), CommitOutcome::Stored);
    game
}

#[tokio::test]
async fn ban_requeues_running_games_and_lists_results() {
    let f = TestStore::new().await;
    let (cup, teams) = tournament_of(
        &f,
        &["A", "B", "C"],
        faceoff_airhockey::competition().tournament_rules(),
    )
    .await;
    let pairings = [
        [teams[0], teams[1]],
        [teams[1], teams[2]],
        [teams[2], teams[0]],
    ];
    start_round(&f, cup.id, &drawn(1, &[&pairings], &[]))
        .await
        .unwrap();
    // The server claims a job for remote workers in advance, and transfers the lease to the worker that starts it.
    let begin = async |claim: &JobClaim, slot: &str| {
        let begins = f.store.transfer_lease(claim, slot, LEASE_S, f.now);
        assert!(begins.await.unwrap());
    };
    let claim_in_advance = async || {
        let claimed = f.store.claim("reserved", LEASE_S, f.now).await.unwrap();
        match claimed.expect("a game is queued") {
            ClaimedJob {
                claim,
                job: Job::Game { game, .. },
            } => (claim, game),
            other => panic!("{other:?}"),
        }
    };
    let (claim, played) = claim_in_advance().await;
    begin(&claim, "remote/rack-1/slot-0").await;
    let commit = game_commit(true);
    let committed = f.store.commit_game(&claim, &commit, f.now);
    assert_eq!(committed.await.unwrap(), CommitOutcome::Stored);
    let rack: WorkerName = "rack-1".parse().unwrap();
    let games = f.store.results_of_worker(&rack, 10).await.unwrap().games;
    assert_eq!(games, [played], "organisers can find the game and void it");

    // Two games run: one on the worker that is banned before it commits, one on another worker.
    let (to_ban, requeued) = claim_in_advance().await;
    begin(&to_ban, "remote/rack-1/slot-0").await;
    let (other, _) = claim_in_advance().await;
    begin(&other, "remote/rack-2/slot-0").await;
    let ban = f.store.ban_worker(Actor::Server, &rack, REASON, f.now);
    ban.await.unwrap();
    let late = f.store.commit_game(&to_ban, &commit, f.now);
    assert_eq!(late.await.unwrap(), CommitOutcome::LeaseLost);
    assert_eq!(state(&f, requeued).await, GameState::Queued);
    let (reclaimed, game) = claim_in_advance().await;
    assert_eq!(game, requeued, "another worker gets it at once");
    begin(&reclaimed, "remote/rack-2/slot-1").await;
    let committed = f.store.commit_game(&other, &commit, f.now);
    assert_eq!(committed.await.unwrap(), CommitOutcome::Stored);
}

async fn state(f: &TestStore, game: GameId) -> GameState {
    f.store.game(game).await.unwrap().state
}

fn departure(
    team: TeamId,
    kind: DepartureKind,
    from_round: Option<RoundNumber>,
) -> DepartureRequest {
    DepartureRequest {
        team,
        kind,
        from_round,
        reason: REASON.to_owned(),
    }
}

#[tokio::test]
async fn round_starts_once_and_ends_with_its_last_game() {
    let mut f = TestStore::new().await;
    let (cup, teams) = tournament_of(
        &f,
        &["A", "B", "C"],
        faceoff_airhockey::competition().tournament_rules(),
    )
    .await;
    let [a, b, c] = teams[..] else { panic!() };
    assert_eq!(cup.number, 1);
    let first = drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]);
    let (one, two) = tokio::join!(
        start_round(&f, cup.id, &first),
        start_round(&f, cup.id, &first)
    );
    let lost = if one.is_ok() { two } else { one };
    assert_conflict(lost, &["round 1 has started already"]);
    assert_conflict(
        start_round(&f, cup.id, &drawn(3, &[&[[a, b]]], &[c])).await,
        &["not the next one"],
    );
    assert_conflict(
        start_round(&f, cup.id, &drawn(2, &[&[[a, b]]], &[c])).await,
        &["3 games of earlier rounds have no result"],
    );
    let started = record(&f, cup.id).await;
    let byes: Vec<_> = started.rounds[0]
        .byes
        .iter()
        .map(|bye| (bye.matchday, bye.team))
        .collect();
    assert_eq!(byes, [(1, c), (2, a), (3, b)]);
    assert_eq!(started.rounds[0].submissions.len(), 3);
    let mut seeds = Vec::new();
    for game in &started.games {
        f.advance_clock_s(30);
        assert_eq!(
            run_next_game(&f).await,
            game.id,
            "games are run in the order of the draw"
        );
        seeds.push(game.seed);
    }
    seeds.dedup();
    assert_eq!(seeds.len(), 3);
    assert!(f.claim().await.is_none());
    let over = record(&f, cup.id).await;
    assert_eq!(over.rounds[0].over_at, Some(f.now));
    let GameState::Played(played) = &over.games[0].state else {
        panic!("{:?}", over.games[0])
    };
    assert_eq!(
        (played.attempt, &played.results),
        (1, &json!({"steps": 500}))
    );
    let log = |side| f.store.game_log(over.games[0].id, side);
    assert_eq!(log(Side::First).await.unwrap().as_deref(), Some("home\n"));
    assert_eq!(log(Side::Second).await.unwrap().as_deref(), Some("away\n"));
    // A round uses the submissions frozen at its start; the next round uses the newer one.
    let team = f.store.team(a).await.unwrap();
    f.upload(&team).await;
    let newer = f.validate().await;
    start_round(
        &f,
        cup.id,
        &drawn(2, &[&[[b, a]], &[[c, b]], &[[a, c]]], &[c, a, b]),
    )
    .await
    .unwrap();
    let second = &record(&f, cup.id).await.games[3];
    assert_eq!(second.submissions[1], newer.id);
    assert_ne!(over.games[0].submissions[0], newer.id);
}

#[tokio::test]
async fn mirrored_halves_share_a_seed_and_swap_sides() {
    let f = TestStore::new().await;
    let rules = TournamentRules {
        mirrored: true,
        ..faceoff_airhockey::competition().tournament_rules()
    };
    let (cup, _) = one_game(&f, rules).await;
    let games = record(&f, cup.id).await.games;
    let [first, second] = &games[..] else {
        panic!()
    };
    assert_eq!(first.seed, second.seed);
    assert_eq!(first.teams, [second.teams[1], second.teams[0]]);
    assert_eq!(
        first.submissions,
        [second.submissions[1], second.submissions[0]]
    );
}

#[tokio::test]
async fn round_needs_a_valid_submission_of_each_team() {
    let f = TestStore::new().await;
    let (cup, teams) = tournament_of(
        &f,
        &["A", "B"],
        faceoff_airhockey::competition().tournament_rules(),
    )
    .await;
    let late = f.create_team("Late").await;
    f.store
        .add_entrants(Actor::Operator, cup.id, &[late.id], f.now)
        .await
        .unwrap();
    let round = drawn(1, &[&[[teams[0], late.id]]], &[teams[1]]);
    assert_conflict(
        start_round(&f, cup.id, &round).await,
        &["Late", "Wait for them, or let them leave"],
    );
    assert!(record(&f, cup.id).await.rounds.is_empty());
    let request = departure(late.id, DepartureKind::Withdrawn, None);
    let left = f
        .store
        .leave_tournament(Actor::Operator, cup.id, &request, f.now)
        .await;
    assert_eq!(
        left.unwrap(),
        None,
        "before the first round it is only removed"
    );
    assert_conflict(
        start_round(&f, cup.id, &round).await,
        &["have changed meanwhile"],
    );
    let two = drawn(1, &[&[[teams[0], teams[1]]]], &[]);
    start_round(&f, cup.id, &two).await.unwrap();
    assert_conflict(
        f.store
            .add_entrants(Actor::Operator, cup.id, &[late.id], f.now)
            .await,
        &["a round is under way"],
    );
}

#[tokio::test]
async fn round_refuses_runtimes_that_rules_exclude() {
    let f = TestStore::new().await;
    let rules = TournamentRules {
        runtimes: Some(["python3".to_owned()].into_iter().collect()),
        ..faceoff_airhockey::competition().tournament_rules()
    };
    let (cup, teams) = tournament_of(&f, &["A", "B"], rules).await;
    assert_conflict(
        start_round(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[])).await,
        &["A, B"],
    );
}

#[tokio::test]
async fn game_with_platform_faults_has_attempts_but_no_result() {
    let mut f = TestStore::new().await;
    let (cup, teams) = one_game(&f, faceoff_airhockey::competition().tournament_rules()).await;
    let game = record(&f, cup.id).await.games[0].id;
    // A slot that dies (its lease expires), one that shuts down, and platform faults until no more attempts are made.
    let (lost, _, _) = claim_game(&f).await;
    f.advance_clock_s(i64::from(LEASE_S) + 1);
    let (claim, _, attempt) = claim_game(&f).await;
    assert_eq!(attempt, 2);
    let late = f
        .store
        .commit_game(&lost, &game_commit(true), f.now)
        .await
        .unwrap();
    assert_eq!(late, CommitOutcome::LeaseLost);
    f.store.release(&claim, f.now).await.unwrap();
    assert_eq!(state(&f, game).await, GameState::Queued);
    for _ in 0..MAX_PLATFORM_FAULTS {
        let (claim, _, _) = claim_game(&f).await;
        f.store
            .release_after_platform_fault(&claim, "no sandbox", f.now)
            .await
            .unwrap();
        f.advance_clock_s(60);
    }
    assert!(
        matches!(state(&f, game).await, GameState::PlatformFailed { reason, .. } if reason == "no sandbox")
    );
    let attempts = f.store.game_attempts(game).await.unwrap();
    let ends: Vec<_> = attempts
        .iter()
        .map(|attempt| attempt.end.as_ref().unwrap().outcome)
        .collect();
    let failures = [AttemptOutcome::PlatformFailed; MAX_PLATFORM_FAULTS as usize];
    assert_eq!(
        ends,
        [
            &[AttemptOutcome::Lost, AttemptOutcome::Released][..],
            &failures
        ]
        .concat()
    );
    assert_eq!(
        record(&f, cup.id).await.rounds[0].over_at,
        None,
        "a result is missing"
    );
    assert_conflict(
        f.store
            .close_tournament(Actor::Operator, cup.id, f.now)
            .await,
        &["has no result"],
    );
    let seed = f.store.game(game).await.unwrap().seed;
    let rerun = f
        .store
        .rerun_game(Actor::Operator, game, f.now)
        .await
        .unwrap();
    assert_eq!((rerun.seed, rerun.state), (seed, GameState::Queued));
    run_next_game(&f).await;
    assert!(record(&f, cup.id).await.rounds[0].over_at.is_some());
    // Its result counts until an organiser voids it; then the game can be rerun once.
    let voided = f
        .store
        .void_game(Actor::Operator, game, REASON, f.now)
        .await
        .unwrap();
    assert!(matches!(voided.state, GameState::Void { reason, .. } if reason == REASON));
    let attempts = f.store.game_attempts(game).await.unwrap();
    let last = attempts.last().unwrap().end.as_ref().unwrap();
    assert_eq!(
        (last.outcome, last.reason.as_deref()),
        (AttemptOutcome::Played, Some(REASON))
    );
    assert_conflict(
        start_round(&f, cup.id, &drawn(2, &[&[[teams[1], teams[0]]]], &[])).await,
        &["have no result"],
    );
    assert_conflict(
        f.store
            .void_game(Actor::Operator, game, REASON, f.now)
            .await,
        &["only a game"],
    );
    f.store
        .rerun_game(Actor::Operator, game, f.now)
        .await
        .unwrap();
    assert_conflict(
        f.store.rerun_game(Actor::Operator, game, f.now).await,
        &["only a game"],
    );
    run_next_game(&f).await;
    let GameState::Played(played) = state(&f, game).await else {
        panic!()
    };
    assert_eq!(played.attempt, 4 + MAX_PLATFORM_FAULTS);
}

#[tokio::test]
async fn paused_tournament_starts_no_game() {
    let f = TestStore::new().await;
    let (cup, teams) = one_game(&f, faceoff_airhockey::competition().tournament_rules()).await;
    let paused = f
        .store
        .pause_tournament(Actor::Operator, cup.id, REASON, f.now)
        .await;
    assert_eq!(paused.unwrap().paused.unwrap().reason, REASON);
    assert_conflict(
        f.store
            .pause_tournament(Actor::Operator, cup.id, REASON, f.now)
            .await,
        &["paused already"],
    );
    assert!(f.claim().await.is_none());
    let team = f.store.team(teams[0]).await.unwrap();
    f.upload(&team).await;
    f.validate().await;
    assert!(f.claim().await.is_none());
    let game = record(&f, cup.id).await.games[0].id;
    assert_eq!(f.store.game_attempts(game).await.unwrap(), []);
    f.store
        .resume_tournament(Actor::Operator, cup.id, f.now)
        .await
        .unwrap();
    assert_conflict(
        f.store
            .resume_tournament(Actor::Operator, cup.id, f.now)
            .await,
        &["not paused"],
    );
    assert_eq!(run_next_game(&f).await, game);
}

#[tokio::test]
async fn game_forecast_uses_recent_durations() {
    let mut f = TestStore::new().await;
    let (cup, _) = three_games(&f).await;
    let ids: Vec<GameId> = record(&f, cup.id)
        .await
        .games
        .iter()
        .map(|game| game.id)
        .collect();
    let position = async |f: &TestStore, id| {
        let forecast = f.store.queue_forecast(1, f.now).await.unwrap();
        let found = forecast.games.get(&id).copied();
        found.map(|found| (found.position, found.total, found.expected_at))
    };
    assert_eq!(
        position(&f, ids[1]).await,
        Some((2, 3, None)),
        "there is no measured duration"
    );
    let (claim, _, _) = claim_game(&f).await;
    f.advance_clock_s(40);
    f.store
        .commit_game(&claim, &game_commit(true), f.now)
        .await
        .unwrap();
    let at = |seconds| Some(f.now + jiff::SignedDuration::from_secs(seconds));
    assert_eq!(position(&f, ids[0]).await, None);
    assert_eq!(position(&f, ids[1]).await, Some((1, 2, at(40))));
    assert_eq!(position(&f, ids[2]).await, Some((2, 2, at(80))));
    f.store
        .pause_tournament(Actor::Operator, cup.id, REASON, f.now)
        .await
        .unwrap();
    assert_eq!(
        position(&f, ids[1]).await,
        None,
        "it starts when the tournament resumes"
    );
}

#[tokio::test]
async fn departure_cancels_open_games() {
    let f = TestStore::new().await;
    let (cup, [a, b, c]) = three_games(&f).await;
    run_next_game(&f).await;
    let (claim, running, _) = claim_game(&f).await;
    let leave = |kind, from| departure(c, kind, from);
    assert_conflict(
        f.store
            .leave_tournament(
                Actor::Operator,
                cup.id,
                &leave(DepartureKind::Disqualified, Some(round(2))),
                f.now,
            )
            .await,
        &["from_round: expected 1 to 1"],
    );
    let left = f
        .store
        .leave_tournament(
            Actor::Operator,
            cup.id,
            &leave(DepartureKind::Disqualified, None),
            f.now,
        )
        .await
        .unwrap();
    assert_eq!(left.unwrap().from_round, round(1));
    assert_conflict(
        f.store
            .leave_tournament(
                Actor::Operator,
                cup.id,
                &leave(DepartureKind::Withdrawn, None),
                f.now,
            )
            .await,
        &["has left the tournament already"],
    );
    assert!(matches!(
        state(&f, running).await,
        GameState::Cancelled { .. }
    ));
    let late = f
        .store
        .commit_game(&claim, &game_commit(true), f.now)
        .await
        .unwrap();
    assert_eq!(late, CommitOutcome::LeaseLost);
    assert!(!f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap());
    let attempts = f.store.game_attempts(running).await.unwrap();
    assert_eq!(
        attempts[0].end.as_ref().unwrap().outcome,
        AttemptOutcome::Cancelled
    );
    let after = record(&f, cup.id).await;
    assert!(after.rounds[0].over_at.is_some(), "no result is missing");
    assert!(f.claim().await.is_none());
    assert_eq!(
        after
            .entrants
            .iter()
            .filter(|one| one.departure.is_some())
            .count(),
        1
    );
    start_round(&f, cup.id, &drawn(2, &[&[[b, a]]], &[]))
        .await
        .unwrap();
    assert_conflict(
        f.store.rerun_game(Actor::Operator, running, f.now).await,
        &["only a game"],
    );
}

#[tokio::test]
async fn round_ends_after_rerun_of_a_game_of_an_earlier_round() {
    let f = TestStore::new().await;
    let rules = TournamentRules {
        withdrawals: Withdrawals::AtOnce,
        ..faceoff_airhockey::competition().tournament_rules()
    };
    let (cup, teams) = tournament_of(&f, &["A", "B", "C"], rules).await;
    let [a, b, c] = teams[..] else { panic!() };
    let first = drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]);
    start_round(&f, cup.id, &first).await.unwrap();
    let played = run_next_game(&f).await;
    for _ in 0..2 {
        run_next_game(&f).await;
    }
    let second = drawn(2, &[&[[b, a]], &[[c, b]], &[[a, c]]], &[c, a, b]);
    start_round(&f, cup.id, &second).await.unwrap();
    f.store
        .void_game(Actor::Operator, played, REASON, f.now)
        .await
        .unwrap();
    let request = departure(c, DepartureKind::Withdrawn, None);
    let left = f
        .store
        .leave_tournament(Actor::Operator, cup.id, &request, f.now)
        .await
        .unwrap();
    assert_eq!(
        left.unwrap().from_round,
        round(2),
        "it keeps its results of the first round"
    );
    // Two games are open now: B against A in the second round, and the voided one of the first round, which is rerun.
    f.store
        .rerun_game(Actor::Operator, played, f.now)
        .await
        .unwrap();
    for _ in 0..2 {
        run_next_game(&f).await;
    }
    assert!(record(&f, cup.id).await.rounds[1].over_at.is_some());
    f.store
        .close_tournament(Actor::Operator, cup.id, f.now)
        .await
        .unwrap();
}

#[tokio::test]
async fn withdrawn_team_plays_the_round_to_its_end() {
    let f = TestStore::new().await;
    let (cup, [a, b, c]) = three_games(&f).await;
    run_next_game(&f).await;
    let request = departure(c, DepartureKind::Withdrawn, None);
    let leave = async |request: &DepartureRequest| {
        f.store
            .leave_tournament(Actor::Operator, cup.id, request, f.now)
            .await
    };
    let early = departure(c, DepartureKind::Withdrawn, Some(round(1)));
    assert_conflict(leave(&early).await, &["from_round: expected 2"]);
    let left = leave(&request).await.unwrap().unwrap();
    assert_eq!(left.from_round, round(2));
    assert_conflict(leave(&request).await, &["has left the tournament already"]);
    let next = drawn(2, &[&[[b, a]]], &[]);
    assert_conflict(
        start_round(&f, cup.id, &next).await,
        &["2 games of earlier rounds have no result"],
    );
    for _ in 0..2 {
        run_next_game(&f).await;
    }
    let after = record(&f, cup.id).await;
    assert!(after.rounds[0].over_at.is_some());
    let is_played = |game: &Game| matches!(game.state, GameState::Played(_));
    assert!(after.games.iter().all(is_played), "{:?}", after.games);
    start_round(&f, cup.id, &next).await.unwrap();
}

#[tokio::test]
async fn cancelled_game_of_an_earlier_round_is_not_waited_for() {
    let f = TestStore::new().await;
    let (cup, [a, b, c]) = three_games(&f).await;
    for _ in 0..3 {
        run_next_game(&f).await;
    }
    let games = record(&f, cup.id).await.games;
    let of_c = games.iter().find(|game| game.teams.contains(&c)).unwrap();
    let second = drawn(2, &[&[[b, a]], &[[c, b]], &[[a, c]]], &[c, a, b]);
    start_round(&f, cup.id, &second).await.unwrap();
    f.store
        .void_game(Actor::Operator, of_c.id, REASON, f.now)
        .await
        .unwrap();
    let request = departure(c, DepartureKind::Disqualified, None);
    let left = f
        .store
        .leave_tournament(Actor::Operator, cup.id, &request, f.now);
    assert_eq!(left.await.unwrap().unwrap().from_round, round(2));
    assert!(matches!(
        state(&f, of_c.id).await,
        GameState::Cancelled { .. }
    ));
    run_next_game(&f).await;
    assert!(record(&f, cup.id).await.rounds[1].over_at.is_some());
    f.store
        .close_tournament(Actor::Operator, cup.id, f.now)
        .await
        .unwrap();
}

#[tokio::test]
async fn withdrawal_does_not_delay_a_disqualification() {
    for from_whole_season in [false, true] {
        let f = TestStore::new().await;
        let (cup, [_, _, c]) = three_games(&f).await;
        let request = departure(c, DepartureKind::Withdrawn, None);
        let leave = async |request: &DepartureRequest| {
            let left = f
                .store
                .leave_tournament(Actor::Operator, cup.id, request, f.now);
            left.await.unwrap().unwrap()
        };
        assert_eq!(leave(&request).await.from_round, round(2));
        if from_whole_season {
            let decision = f.store.disqualify_team(Actor::Operator, c, REASON, f.now);
            decision.await.unwrap();
        } else {
            leave(&departure(c, DepartureKind::Disqualified, None)).await;
        }
        let after = record(&f, cup.id).await;
        let entrant = after.entrants.iter().find(|one| one.team == c).unwrap();
        let departure = entrant.departure.as_ref().unwrap();
        assert_eq!(
            (departure.kind, departure.from_round),
            (DepartureKind::Disqualified, round(1))
        );
        let open = after.games.iter().filter(|game| game.state.is_open());
        assert_eq!(open.count(), 1, "only the game without C is still open");
    }
}

#[tokio::test]
async fn disqualification_also_applies_after_withdrawal() {
    let f = TestStore::new().await;
    let (cup, teams) = tournament_of(
        &f,
        &["A", "B", "C"],
        faceoff_airhockey::competition().tournament_rules(),
    )
    .await;
    let [a, b, c] = teams[..] else { panic!() };
    let first = drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]);
    start_round(&f, cup.id, &first).await.unwrap();
    for _ in 0..3 {
        run_next_game(&f).await;
    }
    let leave = async |request: DepartureRequest| {
        f.store
            .leave_tournament(Actor::Operator, cup.id, &request, f.now)
            .await
    };
    let left = leave(departure(c, DepartureKind::Withdrawn, None))
        .await
        .unwrap();
    assert_eq!(left.unwrap().from_round, round(2));
    assert_conflict(
        leave(departure(c, DepartureKind::Disqualified, Some(round(3)))).await,
        &["from_round: expected 1 to 2"],
    );
    let left = leave(departure(c, DepartureKind::Disqualified, Some(round(1))))
        .await
        .unwrap();
    assert_eq!(left.unwrap().kind, DepartureKind::Disqualified);
    assert_conflict(
        leave(departure(c, DepartureKind::Disqualified, None)).await,
        &["has left the tournament already"],
    );
    // A voided game can be rerun if both teams were entrants in its round, otherwise not.
    let games = record(&f, cup.id).await.games;
    for game in &games[..2] {
        f.store
            .void_game(Actor::Operator, game.id, REASON, f.now)
            .await
            .unwrap();
    }
    assert_conflict(
        f.store
            .rerun_game(Actor::Operator, games[1].id, f.now)
            .await,
        &["by its round"],
    );
    f.store
        .rerun_game(Actor::Operator, games[0].id, f.now)
        .await
        .unwrap();
    // A team disqualified from the season leaves its tournaments.
    f.store
        .disqualify_team(Actor::Operator, b, REASON, f.now)
        .await
        .unwrap();
    assert!(f.claim().await.is_none(), "queued games are cancelled");
    let entrants = record(&f, cup.id).await.entrants;
    let of_b = entrants.iter().find(|one| one.team == b).unwrap();
    assert_eq!(
        of_b.departure.as_ref().unwrap().kind,
        DepartureKind::Disqualified
    );
    assert_conflict(
        f.store.close_season(Actor::Operator, f.now).await,
        &["Cup", "close it first"],
    );
}

#[tokio::test]
async fn friendly_games_have_a_quota_and_wait_for_rounds() {
    let mut f = TestStore::new().await;
    let (cup, teams) = tournament_of(
        &f,
        &["A", "B", "Base"],
        faceoff_airhockey::competition().tournament_rules(),
    )
    .await;
    let [a, b, base] = teams[..] else { panic!() };
    let request = departure(base, DepartureKind::Withdrawn, None);
    f.store
        .leave_tournament(Actor::Operator, cup.id, &request, f.now)
        .await
        .unwrap();
    // A game of A against the baseline, requested by a team or (`None`) by the operator.
    let test_game = async |f: &TestStore, by| {
        f.store
            .request_test_game(Actor::Operator, cup.id, a, by, f.now)
            .await
    };
    assert_conflict(test_game(&f, None).await, &["has no baseline"]);
    let baseline = f.store.active_submissions().await.unwrap();
    let baseline = baseline.iter().find(|one| one.team == base).unwrap().id;
    let change = TournamentChange {
        baseline: Some(Some(baseline)),
        settings: Some(TournamentSettings {
            test_and_friendly_games_per_day: 3,
            ..TournamentSettings::default()
        }),
        ..TournamentChange::default()
    };
    f.store
        .change_tournament(Actor::Operator, cup.id, &change, f.now)
        .await
        .unwrap();
    let friendly = async |f: &TestStore, by, with| {
        f.store
            .request_friendly_game(Actor::Team(by), cup.id, by, with, f.now)
            .await
    };
    let tested = test_game(&f, Some(a)).await.unwrap();
    assert_eq!(tested.submissions[1], baseline);
    assert_conflict(friendly(&f, a, a).await, &["cannot play itself"]);
    assert_conflict(
        friendly(&f, a, base).await,
        &["Base is not in the tournament"],
    );
    let cancelled = friendly(&f, a, b).await.unwrap();
    f.store
        .cancel_game(Actor::Team(a), cancelled.id, "not now", f.now)
        .await
        .unwrap();
    assert_eq!(
        f.store.requested_games_on_day(a, f.now).await.unwrap(),
        2,
        "cancelled games count"
    );
    friendly(&f, a, b).await.unwrap();
    assert!(matches!(
        friendly(&f, a, b).await,
        Err(StoreError::GameQuotaExceeded { limit: 3, used: 3 })
    ));
    test_game(&f, None).await.unwrap();
    f.store
        .set_declines_friendly_games(Actor::Team(a), a, true, f.now)
        .await
        .unwrap();
    assert_conflict(friendly(&f, b, a).await, &["A plays no friendly games"]);
    for _ in 0..3 {
        run_next_game(&f).await;
    }
    let friendly_games = f
        .store
        .games(cup.id, GameFilter::TestAndFriendly(Some(b)))
        .await
        .unwrap();
    assert_eq!(friendly_games.len(), 2, "one of them was cancelled");
    f.advance_clock_s(24 * 3600);
    assert_eq!(f.store.requested_games_on_day(a, f.now).await.unwrap(), 0);
    start_round(&f, cup.id, &drawn(1, &[&[[a, b]]], &[]))
        .await
        .unwrap();
    assert_conflict(test_game(&f, None).await, &["a round is under way"]);
    assert_conflict(friendly(&f, a, b).await, &["a round is under way"]);
    let record = record(&f, cup.id).await;
    assert_eq!(record.games.len(), 1);
    let of_round = f
        .store
        .cancel_game(Actor::Operator, record.games[0].id, "no", f.now)
        .await;
    assert_conflict(of_round, &["cannot be cancelled"]);
}

#[tokio::test]
async fn schedule_replay_has_new_seeds_and_does_not_count() {
    let f = TestStore::new().await;
    let one_round = TournamentRules {
        format: TournamentFormat::RoundRobin { rounds: round(1) },
        ..faceoff_airhockey::competition().tournament_rules()
    };
    let (cup, teams) = tournament_of(&f, &["A", "B"], one_round).await;
    let replay = async |times| {
        f.store
            .request_schedule_replays(Actor::Operator, cup.id, times, f.now)
            .await
    };
    assert_conflict(replay(1).await, &["0 of 1 rounds have started"]);
    start_round(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[]))
        .await
        .unwrap();
    assert_conflict(replay(1).await, &["1 games have no result yet"]);
    let game = run_next_game(&f).await;
    assert_conflict(replay(0).await, &["expected 1 to 1000"]);
    assert_eq!(replay(3).await.unwrap(), 3);
    assert_conflict(replay(998).await, &["expected 1 to 997"]);
    f.store
        .void_game(Actor::Operator, game, REASON, f.now)
        .await
        .unwrap();
    f.store
        .rerun_game(Actor::Operator, game, f.now)
        .await
        .unwrap();
    let (claim, counting_game, _) = claim_game(&f).await;
    assert!(matches!(
        f.store.game(counting_game).await.unwrap().purpose,
        GamePurpose::Round(_)
    ));
    f.store
        .commit_game(&claim, &game_commit(true), f.now)
        .await
        .unwrap();
    let (claim, replay_game, _) = claim_game(&f).await;
    assert_conflict(
        f.store.commit_game(&claim, &game_commit(true), f.now).await,
        &["none of a game of a replayed schedule"],
    );
    f.store
        .commit_game(&claim, &game_commit(false), f.now)
        .await
        .unwrap();
    assert_eq!(
        f.store
            .cancel_schedule_replays(Actor::Operator, cup.id, f.now)
            .await
            .unwrap(),
        2
    );
    let replays = f
        .store
        .games(cup.id, GameFilter::ScheduleReplays)
        .await
        .unwrap();
    assert_eq!(replays[0].id, replay_game);
    let of_rounds = record(&f, cup.id).await.games;
    assert!(
        replays
            .iter()
            .all(|one| of_rounds.iter().all(|game| game.seed != one.seed))
    );
    assert_eq!(of_rounds.len(), 1);
}

#[tokio::test]
async fn tournament_keeps_its_earlier_ruleset() {
    let f = TestStore::new().await;
    let rules = TournamentRules {
        ruleset: faceoff_airhockey::RULESETS[1],
        ..faceoff_airhockey::competition().tournament_rules()
    };
    one_game(&f, rules).await;
    // The server restarts with a version whose newest ruleset is a later one.
    let claimed = f.reopen().await.claim("slot 0", LEASE_S, f.now).await;
    let Some(ClaimedJob {
        job: Job::Game { rules, .. },
        ..
    }) = claimed.unwrap()
    else {
        panic!("expected a game");
    };
    assert_eq!(rules.ruleset, faceoff_airhockey::RULESETS[1]);
}

#[tokio::test]
async fn closed_tournament_is_final_and_frees_bundles() {
    let f = TestStore::new().await;
    let (cup, teams) = tournament_of(
        &f,
        &["A", "B"],
        faceoff_airhockey::competition().tournament_rules(),
    )
    .await;
    let rules = TournamentChange {
        rules: Some(TournamentRules {
            steps: 500,
            ..faceoff_airhockey::competition().tournament_rules()
        }),
        ..TournamentChange::default()
    };
    let change = async || {
        f.store
            .change_tournament(Actor::Operator, cup.id, &rules, f.now)
            .await
    };
    assert_eq!(change().await.unwrap().rules.steps, 500);
    start_round(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[]))
        .await
        .unwrap();
    let other = TournamentChange {
        rules: Some(faceoff_airhockey::competition().tournament_rules()),
        ..TournamentChange::default()
    };
    assert_conflict(
        f.store
            .change_tournament(Actor::Operator, cup.id, &other, f.now)
            .await,
        &["a round has started"],
    );
    assert_conflict(
        f.store
            .close_tournament(Actor::Operator, cup.id, f.now)
            .await,
        &["1 games are queued or running"],
    );
    assert_conflict(
        f.store.close_season(Actor::Operator, f.now).await,
        &["1 games are queued"],
    );
    let game = run_next_game(&f).await;
    let of_a = f.store.game(game).await.unwrap().submissions[0];
    f.store
        .withdraw_submission(Actor::Team(teams[0]), of_a, f.now)
        .await
        .unwrap();
    assert_conflict(
        f.store.check_deletable(of_a, f.now).await,
        &["a tournament that is not closed"],
    );
    f.store
        .close_tournament(Actor::Operator, cup.id, f.now)
        .await
        .unwrap();
    f.store.check_deletable(of_a, f.now).await.unwrap();
    assert_conflict(change().await, &["was closed on"]);
    assert_conflict(
        f.store
            .void_game(Actor::Operator, game, REASON, f.now)
            .await,
        &["was closed on"],
    );
    let same_name = NewTournament {
        name: "cup".parse().unwrap(),
        stage: None,
        rules: faceoff_airhockey::competition().tournament_rules(),
        settings: TournamentSettings::default(),
        entrants: Vec::new(),
    };
    let taken = f
        .store
        .open_tournament(Actor::Operator, &same_name, f.now)
        .await;
    assert!(
        matches!(taken, Err(StoreError::TournamentNameTaken(_))),
        "{taken:?}"
    );
}

#[derive(Debug, Clone)]
/// What workers do with jobs. The numbers select one of the claims so far.
enum WorkerAction {
    Claim,
    Commit(usize),
    /// A platform fault.
    Fail(usize),
    /// The worker shuts down and gives the job back.
    Release(usize),
    /// All leases expire.
    Die,
}

fn actions() -> impl Strategy<Value = Vec<WorkerAction>> {
    let action = prop_oneof![
        4 => Just(WorkerAction::Claim),
        4 => (0..8_usize).prop_map(WorkerAction::Commit),
        1 => (0..8_usize).prop_map(WorkerAction::Fail),
        1 => (0..8_usize).prop_map(WorkerAction::Release),
        1 => Just(WorkerAction::Die),
    ];
    prop::collection::vec(action, 0..40)
}

/// For any order of actions, each game has at most one result, and all have one in the end.
async fn run_actions(actions: Vec<WorkerAction>) {
    let mut f = TestStore::new().await;
    let (cup, _) = three_games(&f).await;
    let mut claims: Vec<(JobClaim, GameId)> = Vec::new();
    let mut committed = std::collections::BTreeMap::<GameId, u32>::new();
    for action in actions {
        let pick = |number: usize| claims.get(number % claims.len().max(1)).cloned();
        match action {
            WorkerAction::Claim => {
                if let Some(ClaimedJob {
                    claim,
                    job: Job::Game { game, .. },
                }) = f.claim().await
                {
                    claims.push((claim, game));
                }
            }
            WorkerAction::Commit(number) => {
                if let Some((claim, game)) = pick(number)
                    && f.store
                        .commit_game(&claim, &game_commit(true), f.now)
                        .await
                        .unwrap()
                        == CommitOutcome::Stored
                {
                    *committed.entry(game).or_default() += 1;
                }
            }
            WorkerAction::Fail(number) => {
                if let Some((claim, _)) = pick(number) {
                    f.store
                        .release_after_platform_fault(&claim, "a platform fault", f.now)
                        .await
                        .unwrap();
                }
            }
            WorkerAction::Release(number) => {
                if let Some((claim, _)) = pick(number) {
                    f.store.release(&claim, f.now).await.unwrap();
                }
            }
            WorkerAction::Die => f.advance_clock_s(i64::from(LEASE_S) + 1),
        }
    }
    f.advance_clock_s(600);
    for game in record(&f, cup.id).await.games {
        if let GameState::PlatformFailed { .. } = game.state {
            f.store
                .rerun_game(Actor::Operator, game.id, f.now)
                .await
                .unwrap();
        }
    }
    while let Some(ClaimedJob {
        claim,
        job: Job::Game { game, .. },
    }) = f.claim().await
    {
        f.store
            .commit_game(&claim, &game_commit(true), f.now)
            .await
            .unwrap();
        *committed.entry(game).or_default() += 1;
    }
    let record = record(&f, cup.id).await;
    assert!(record.rounds[0].over_at.is_some());
    for game in record.games {
        assert_eq!(committed.get(&game.id), Some(&1), "{game:?}");
        let attempts = f.store.game_attempts(game.id).await.unwrap();
        let played = attempts.iter().filter(|one| {
            one.end
                .as_ref()
                .is_some_and(|end| end.outcome == AttemptOutcome::Played)
        });
        assert_eq!(played.count(), 1);
        assert!(matches!(game.state, GameState::Played(_)));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn games_have_exactly_one_result(actions in actions()) {
        tokio::runtime::Runtime::new().unwrap().block_on(run_actions(actions));
    }
}
