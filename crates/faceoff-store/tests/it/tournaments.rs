//! Tournaments: who is in, what is drawn, how games stand, and what is kept apart from results.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;
use proptest::prelude::*;
use serde_json::json;

const WHY: &str = "the table was tilted";

#[track_caller]
fn refused<T: std::fmt::Debug>(done: Result<T, StoreError>, words: &[&str]) {
    let Err(StoreError::Conflict(why)) = done else {
        panic!("expected a conflict with {words:?}: {done:?}");
    };
    for word in words {
        assert!(why.contains(word), "{word:?} is not in {why:?}");
    }
}

fn round(number: u32) -> RoundNumber {
    number.try_into().unwrap()
}

/// Ready teams in a tournament of these rules.
async fn opened(f: &Fixture, names: &[&str], rules: TournamentRules) -> (Tournament, Vec<TeamId>) {
    let mut teams = Vec::new();
    for name in names {
        teams.push(f.ready_team(name).await.team);
    }
    let new = NewTournament {
        name: "Cup".parse().unwrap(),
        stage: None,
        rules,
        settings: TournamentSettings::default(),
        entrants: teams.clone(),
    };
    let opened = f.store.open_tournament(Actor::Organiser, &new, f.now).await;
    (opened.unwrap(), teams)
}

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

async fn start(
    f: &Fixture,
    id: TournamentId,
    drawn: &DrawnRound,
) -> Result<TournamentRound, StoreError> {
    f.store
        .start_round(Actor::Organiser, id, drawn, f.now)
        .await
}

async fn record(f: &Fixture, id: TournamentId) -> TournamentRecord {
    f.store.tournament_record(id).await.unwrap()
}

fn result(recorded: bool) -> GameCommit {
    let hash = || "0".repeat(64);
    GameCommit {
        score: json!({"steps": 500}),
        recording: recorded.then(|| GameRecording {
            key: "games/1/2".to_owned(),
            game_blake3: hash(),
            side_blake3: [hash(), hash()],
        }),
        logs: ["home\n".to_owned(), "away\n".to_owned()],
    }
}

/// The next unit, which must be a game.
async fn claim_game(f: &Fixture) -> (Claim, GameId, u32) {
    match f.claim().await {
        Some(Claimed {
            claim,
            work: Work::Game { game, attempt, .. },
        }) => (claim, game, attempt),
        other => panic!("expected a game: {other:?}"),
    }
}

async fn play_next(f: &Fixture) -> GameId {
    let (claim, game, _) = claim_game(f).await;
    let recorded = f.store.game(game).await.unwrap().purpose.keeps_recording();
    let committed = f.store.commit_game(&claim, &result(recorded), f.now).await;
    assert_eq!(committed.unwrap(), Committed::Now);
    game
}

#[tokio::test]
async fn who_played_a_game_elsewhere_is_known_and_what_it_has_under_way_goes_with_its_ban() {
    let f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B", "C"], TournamentRules::default()).await;
    let meetings = [
        [teams[0], teams[1]],
        [teams[1], teams[2]],
        [teams[2], teams[0]],
    ];
    start(&f, cup.id, &drawn(1, &[&meetings], &[]))
        .await
        .unwrap();
    let begin = async |claim: &Claim, slot: &str| {
        let begins = f.store.hand_over(claim, slot, LEASE_S, f.now);
        assert!(begins.await.unwrap());
    };
    let given_out = async || {
        let claimed = f.store.claim("given out", LEASE_S, f.now).await.unwrap();
        match claimed.expect("a game waits") {
            Claimed {
                claim,
                work: Work::Game { game, .. },
            } => (claim, game),
            other => panic!("{other:?}"),
        }
    };
    let (claim, played) = given_out().await;
    begin(&claim, "remote/rack-1/slot-0").await;
    let commit = result(true);
    let committed = f.store.commit_game(&claim, &commit, f.now);
    assert_eq!(committed.await.unwrap(), Committed::Now);
    let rack: WorkerName = "rack-1".parse().unwrap();
    let games = f.store.played_by(&rack, 10).await.unwrap().games;
    assert_eq!(games, [played], "an organiser finds it, to void it or not");

    // One is just being looked at, one is somebody else's.
    let (looked_at, mine) = given_out().await;
    begin(&looked_at, "remote/rack-1/slot-0").await;
    let (other, _) = given_out().await;
    begin(&other, "remote/rack-2/slot-0").await;
    let ban = f.store.ban_worker(Actor::Server, &rack, WHY, f.now);
    ban.await.unwrap();
    let late = f.store.commit_game(&looked_at, &commit, f.now);
    assert_eq!(late.await.unwrap(), Committed::LeaseLost);
    assert_eq!(state(&f, mine).await, GameState::Queued);
    let (again, game) = given_out().await;
    assert_eq!(game, mine, "another plays it at once");
    begin(&again, "remote/rack-2/slot-1").await;
    let committed = f.store.commit_game(&other, &commit, f.now);
    assert_eq!(committed.await.unwrap(), Committed::Now);
}

async fn state(f: &Fixture, game: GameId) -> GameState {
    f.store.game(game).await.unwrap().state
}

fn leaving(team: TeamId, left_as: LeftAs, from_round: Option<RoundNumber>) -> Leaving {
    Leaving {
        team,
        left_as,
        from_round,
        reason: WHY.to_owned(),
    }
}

#[tokio::test]
async fn a_round_is_drawn_once_played_in_order_and_over_with_its_last_game() {
    let mut f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B", "C"], TournamentRules::default()).await;
    let [a, b, c] = teams[..] else { panic!() };
    assert_eq!(cup.number, 1);
    let first = drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]);
    let (one, two) = tokio::join!(start(&f, cup.id, &first), start(&f, cup.id, &first));
    let lost = if one.is_ok() { two } else { one };
    refused(lost, &["round 1 was started already"]);
    refused(
        start(&f, cup.id, &drawn(3, &[&[[a, b]]], &[c])).await,
        &["not the next one"],
    );
    refused(
        start(&f, cup.id, &drawn(2, &[&[[a, b]]], &[c])).await,
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
        f.later(30);
        assert_eq!(
            play_next(&f).await,
            game.id,
            "in the order in which they were drawn"
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
    assert_eq!((played.attempt, &played.score), (1, &json!({"steps": 500})));
    let log = |side| f.store.game_log(over.games[0].id, side);
    assert_eq!(log(Side::First).await.unwrap().as_deref(), Some("home\n"));
    assert_eq!(log(Side::Second).await.unwrap().as_deref(), Some("away\n"));
    // What was fixed at the start plays the round, whatever is uploaded then; the next has the new one.
    let team = f.store.team(a).await.unwrap();
    f.upload(&team).await;
    let newer = f.validate().await;
    start(
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
    let f = Fixture::new().await;
    let rules = TournamentRules {
        mirrored: true,
        ..TournamentRules::default()
    };
    let (cup, teams) = opened(&f, &["A", "B"], rules).await;
    start(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[]))
        .await
        .unwrap();
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
async fn a_team_without_a_valid_agent_keeps_a_round_from_starting() {
    let f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B"], TournamentRules::default()).await;
    let late = f.team("Late").await;
    f.store
        .enter_tournament(Actor::Organiser, cup.id, &[late.id], f.now)
        .await
        .unwrap();
    let round = drawn(1, &[&[[teams[0], late.id]]], &[teams[1]]);
    refused(
        start(&f, cup.id, &round).await,
        &["Late", "Wait for them, or let them leave"],
    );
    assert!(record(&f, cup.id).await.rounds.is_empty());
    let out = leaving(late.id, LeftAs::Withdrawn, None);
    let left = f
        .store
        .leave_tournament(Actor::Organiser, cup.id, &out, f.now)
        .await;
    assert_eq!(left.unwrap(), None, "nothing was played, so it is just out");
    refused(start(&f, cup.id, &round).await, &["have changed meanwhile"]);
    let two = drawn(1, &[&[[teams[0], teams[1]]]], &[]);
    start(&f, cup.id, &two).await.unwrap();
    refused(
        f.store
            .enter_tournament(Actor::Organiser, cup.id, &[late.id], f.now)
            .await,
        &["a round is under way"],
    );
}

#[tokio::test]
async fn only_runtimes_that_the_tournament_takes_play() {
    let f = Fixture::new().await;
    let rules = TournamentRules {
        runtimes: Some(["python3".to_owned()].into_iter().collect()),
        ..TournamentRules::default()
    };
    let (cup, teams) = opened(&f, &["A", "B"], rules).await;
    refused(
        start(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[])).await,
        &["A, B"],
    );
}

#[tokio::test]
async fn a_game_that_we_break_is_an_attempt_and_no_result() {
    let mut f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B"], TournamentRules::default()).await;
    start(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[]))
        .await
        .unwrap();
    let game = record(&f, cup.id).await.games[0].id;
    // A slot that dies, one that is asked to end, and faults of ours until it is given up.
    let (lost, _, _) = claim_game(&f).await;
    f.later(i64::from(LEASE_S) + 1);
    let (claim, _, attempt) = claim_game(&f).await;
    assert_eq!(attempt, 2);
    let late = f
        .store
        .commit_game(&lost, &result(true), f.now)
        .await
        .unwrap();
    assert_eq!(late, Committed::LeaseLost);
    f.store.release(&claim, f.now).await.unwrap();
    assert_eq!(state(&f, game).await, GameState::Queued);
    for _ in 0..MAX_ATTEMPTS {
        let (claim, _, _) = claim_game(&f).await;
        f.store
            .release_failed(&claim, "no sandbox", f.now)
            .await
            .unwrap();
        f.later(60);
    }
    assert!(
        matches!(state(&f, game).await, GameState::Broken { reason, .. } if reason == "no sandbox")
    );
    let attempts = f.store.game_attempts(game).await.unwrap();
    let ends: Vec<_> = attempts
        .iter()
        .map(|attempt| attempt.end.as_ref().unwrap().how)
        .collect();
    let broken = [AttemptOutcome::Broken; MAX_ATTEMPTS as usize];
    assert_eq!(
        ends,
        [
            &[AttemptOutcome::Lost, AttemptOutcome::GivenBack][..],
            &broken
        ]
        .concat()
    );
    assert_eq!(
        record(&f, cup.id).await.rounds[0].over_at,
        None,
        "it is owed a result"
    );
    refused(
        f.store
            .close_tournament(Actor::Organiser, cup.id, f.now)
            .await,
        &["has no result"],
    );
    let seed = f.store.game(game).await.unwrap().seed;
    let again = f
        .store
        .rerun_game(Actor::Organiser, game, f.now)
        .await
        .unwrap();
    assert_eq!((again.seed, again.state), (seed, GameState::Queued));
    play_next(&f).await;
    assert!(record(&f, cup.id).await.rounds[0].over_at.is_some());
    // Its result counts until it is voided, and then it is played again by the same rules.
    let voided = f
        .store
        .void_game(Actor::Organiser, game, WHY, f.now)
        .await
        .unwrap();
    assert!(matches!(voided.state, GameState::Void { reason, .. } if reason == WHY));
    let attempts = f.store.game_attempts(game).await.unwrap();
    let last = attempts.last().unwrap().end.as_ref().unwrap();
    assert_eq!(
        (last.how, last.reason.as_deref()),
        (AttemptOutcome::Played, Some(WHY))
    );
    refused(
        start(&f, cup.id, &drawn(2, &[&[[teams[1], teams[0]]]], &[])).await,
        &["have no result"],
    );
    refused(
        f.store.void_game(Actor::Organiser, game, WHY, f.now).await,
        &["only a game"],
    );
    f.store
        .rerun_game(Actor::Organiser, game, f.now)
        .await
        .unwrap();
    refused(
        f.store.rerun_game(Actor::Organiser, game, f.now).await,
        &["only a game"],
    );
    play_next(&f).await;
    let GameState::Played(played) = state(&f, game).await else {
        panic!()
    };
    assert_eq!(played.attempt, 4 + MAX_ATTEMPTS);
}

#[tokio::test]
async fn a_paused_tournament_begins_nothing_and_lets_the_rest_go_on() {
    let f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B"], TournamentRules::default()).await;
    start(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[]))
        .await
        .unwrap();
    let paused = f
        .store
        .pause_tournament(Actor::Organiser, cup.id, WHY, f.now)
        .await;
    assert_eq!(paused.unwrap().paused.unwrap().reason, WHY);
    refused(
        f.store
            .pause_tournament(Actor::Organiser, cup.id, WHY, f.now)
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
        .resume_tournament(Actor::Organiser, cup.id, f.now)
        .await
        .unwrap();
    refused(
        f.store
            .resume_tournament(Actor::Organiser, cup.id, f.now)
            .await,
        &["not paused"],
    );
    assert_eq!(play_next(&f).await, game);
}

#[tokio::test]
async fn what_games_took_says_when_the_next_are_over() {
    let mut f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B", "C"], TournamentRules::default()).await;
    let [a, b, c] = teams[..] else { panic!() };
    start(
        &f,
        cup.id,
        &drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]),
    )
    .await
    .unwrap();
    let ids: Vec<GameId> = record(&f, cup.id)
        .await
        .games
        .iter()
        .map(|game| game.id)
        .collect();
    let place = async |f: &Fixture, id| {
        let outlook = f.store.outlook(1, f.now).await.unwrap();
        let place = outlook.games.get(&id).copied();
        place.map(|place| (place.place, place.of, place.expected_at))
    };
    assert_eq!(
        place(&f, ids[1]).await,
        Some((2, 3, None)),
        "nothing like it was measured"
    );
    let (claim, _, _) = claim_game(&f).await;
    f.later(40);
    f.store
        .commit_game(&claim, &result(true), f.now)
        .await
        .unwrap();
    let at = |seconds| Some(f.now + jiff::SignedDuration::from_secs(seconds));
    assert_eq!(place(&f, ids[0]).await, None);
    assert_eq!(place(&f, ids[1]).await, Some((1, 2, at(40))));
    assert_eq!(place(&f, ids[2]).await, Some((2, 2, at(80))));
    f.store
        .pause_tournament(Actor::Organiser, cup.id, WHY, f.now)
        .await
        .unwrap();
    assert_eq!(
        place(&f, ids[1]).await,
        None,
        "it begins when the tournament goes on"
    );
}

#[tokio::test]
async fn who_leaves_takes_its_open_games_along() {
    let f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B", "C"], TournamentRules::default()).await;
    let [a, b, c] = teams[..] else { panic!() };
    start(
        &f,
        cup.id,
        &drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]),
    )
    .await
    .unwrap();
    play_next(&f).await;
    let (claim, running, _) = claim_game(&f).await;
    let leave = |left_as, from| leaving(c, left_as, from);
    refused(
        f.store
            .leave_tournament(
                Actor::Organiser,
                cup.id,
                &leave(LeftAs::Disqualified, Some(round(2))),
                f.now,
            )
            .await,
        &["from_round: expected 1 to 1"],
    );
    let left = f
        .store
        .leave_tournament(
            Actor::Organiser,
            cup.id,
            &leave(LeftAs::Disqualified, None),
            f.now,
        )
        .await
        .unwrap();
    assert_eq!(left.unwrap().from_round, round(1));
    refused(
        f.store
            .leave_tournament(
                Actor::Organiser,
                cup.id,
                &leave(LeftAs::Withdrawn, None),
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
        .commit_game(&claim, &result(true), f.now)
        .await
        .unwrap();
    assert_eq!(late, Committed::LeaseLost);
    assert!(!f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap());
    let attempts = f.store.game_attempts(running).await.unwrap();
    assert_eq!(
        attempts[0].end.as_ref().unwrap().how,
        AttemptOutcome::CalledOff
    );
    let after = record(&f, cup.id).await;
    assert!(after.rounds[0].over_at.is_some(), "nothing of it is owed");
    assert!(f.claim().await.is_none());
    assert_eq!(
        after
            .entrants
            .iter()
            .filter(|one| one.left.is_some())
            .count(),
        1
    );
    start(&f, cup.id, &drawn(2, &[&[[b, a]]], &[]))
        .await
        .unwrap();
    refused(
        f.store.rerun_game(Actor::Organiser, running, f.now).await,
        &["only a game"],
    );
}

#[tokio::test]
async fn a_game_that_is_to_be_played_again_makes_no_earlier_round_unfinished() {
    let f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B", "C"], TournamentRules::default()).await;
    let [a, b, c] = teams[..] else { panic!() };
    let first = drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]);
    start(&f, cup.id, &first).await.unwrap();
    let played = play_next(&f).await;
    for _ in 0..2 {
        play_next(&f).await;
    }
    let second = drawn(2, &[&[[b, a]], &[[c, b]], &[[a, c]]], &[c, a, b]);
    start(&f, cup.id, &second).await.unwrap();
    f.store
        .void_game(Actor::Organiser, played, WHY, f.now)
        .await
        .unwrap();
    let out = leaving(c, LeftAs::Withdrawn, None);
    let left = f
        .store
        .leave_tournament(Actor::Organiser, cup.id, &out, f.now)
        .await
        .unwrap();
    assert_eq!(
        left.unwrap().from_round,
        round(2),
        "it keeps what it played of the first"
    );
    // Of the second round B and A are still owed their game, and of the first the void one.
    f.store
        .rerun_game(Actor::Organiser, played, f.now)
        .await
        .unwrap();
    for _ in 0..2 {
        play_next(&f).await;
    }
    assert!(record(&f, cup.id).await.rounds[1].over_at.is_some());
    f.store
        .close_tournament(Actor::Organiser, cup.id, f.now)
        .await
        .unwrap();
}

#[tokio::test]
async fn nobody_escapes_a_disqualification_by_leaving_first_or_by_the_season() {
    let f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B", "C"], TournamentRules::default()).await;
    let [a, b, c] = teams[..] else { panic!() };
    let first = drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]);
    start(&f, cup.id, &first).await.unwrap();
    for _ in 0..3 {
        play_next(&f).await;
    }
    let leave = async |leaving: Leaving| {
        f.store
            .leave_tournament(Actor::Organiser, cup.id, &leaving, f.now)
            .await
    };
    let out = leave(leaving(c, LeftAs::Withdrawn, None)).await.unwrap();
    assert_eq!(out.unwrap().from_round, round(2));
    refused(
        leave(leaving(c, LeftAs::Disqualified, Some(round(3)))).await,
        &["from_round: expected 1 to 2"],
    );
    let out = leave(leaving(c, LeftAs::Disqualified, Some(round(1))))
        .await
        .unwrap();
    assert_eq!(out.unwrap().left_as, LeftAs::Disqualified);
    refused(
        leave(leaving(c, LeftAs::Disqualified, None)).await,
        &["has left the tournament already"],
    );
    // A game that a team had played before it left is played again if it is voided; one that counts no more is not.
    let games = record(&f, cup.id).await.games;
    for game in &games[..2] {
        f.store
            .void_game(Actor::Organiser, game.id, WHY, f.now)
            .await
            .unwrap();
    }
    refused(
        f.store
            .rerun_game(Actor::Organiser, games[1].id, f.now)
            .await,
        &["by its round"],
    );
    f.store
        .rerun_game(Actor::Organiser, games[0].id, f.now)
        .await
        .unwrap();
    // Out of the season is out of its tournaments.
    f.store
        .disqualify_team(Actor::Organiser, b, WHY, f.now)
        .await
        .unwrap();
    assert!(f.claim().await.is_none(), "what waited is called off");
    let entrants = record(&f, cup.id).await.entrants;
    let of_b = entrants.iter().find(|one| one.team == b).unwrap();
    assert_eq!(of_b.left.as_ref().unwrap().left_as, LeftAs::Disqualified);
    refused(
        f.store.close_season(Actor::Organiser, f.now).await,
        &["Cup", "close it first"],
    );
}

#[tokio::test]
async fn games_that_do_not_count_have_a_quota_and_wait_for_rounds() {
    let mut f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B", "Base"], TournamentRules::default()).await;
    let [a, b, base] = teams[..] else { panic!() };
    let out = leaving(base, LeftAs::Withdrawn, None);
    f.store
        .leave_tournament(Actor::Organiser, cup.id, &out, f.now)
        .await
        .unwrap();
    let test = async |f: &Fixture, by| {
        f.store
            .order_test_game(Actor::Organiser, cup.id, a, by, f.now)
            .await
    };
    refused(test(&f, None).await, &["named no baseline"]);
    let baseline = f.store.active_submissions().await.unwrap();
    let baseline = baseline.iter().find(|one| one.team == base).unwrap().id;
    let change = TournamentChange {
        baseline: Some(Some(baseline)),
        settings: Some(TournamentSettings {
            free_games_per_day: 3,
            ..TournamentSettings::default()
        }),
        ..TournamentChange::default()
    };
    f.store
        .change_tournament(Actor::Organiser, cup.id, &change, f.now)
        .await
        .unwrap();
    let friendly = async |f: &Fixture, by, with| {
        f.store
            .order_friendly_game(Actor::Team(by), cup.id, by, with, f.now)
            .await
    };
    let tested = test(&f, Some(a)).await.unwrap();
    assert_eq!(tested.submissions[1], baseline);
    refused(friendly(&f, a, a).await, &["cannot play itself"]);
    refused(
        friendly(&f, a, base).await,
        &["Base is not in the tournament"],
    );
    let called_off = friendly(&f, a, b).await.unwrap();
    f.store
        .cancel_game(Actor::Team(a), called_off.id, "not now", f.now)
        .await
        .unwrap();
    assert_eq!(
        f.store.free_games_used(a, f.now).await.unwrap(),
        2,
        "called off or not"
    );
    friendly(&f, a, b).await.unwrap();
    assert!(matches!(
        friendly(&f, a, b).await,
        Err(StoreError::FreeGamesSpent { limit: 3, used: 3 })
    ));
    test(&f, None).await.unwrap();
    f.store
        .set_declines_friendly_games(Actor::Team(a), a, true, f.now)
        .await
        .unwrap();
    refused(friendly(&f, b, a).await, &["A plays no friendly games"]);
    for _ in 0..3 {
        play_next(&f).await;
    }
    let free = f.store.games(cup.id, GamesOf::Free(Some(b))).await.unwrap();
    assert_eq!(free.len(), 2, "one of them was called off");
    f.later(24 * 3600);
    assert_eq!(f.store.free_games_used(a, f.now).await.unwrap(), 0);
    start(&f, cup.id, &drawn(1, &[&[[a, b]]], &[]))
        .await
        .unwrap();
    refused(test(&f, None).await, &["a round is under way"]);
    refused(friendly(&f, a, b).await, &["a round is under way"]);
    let record = record(&f, cup.id).await;
    assert_eq!(record.games.len(), 1);
    let of_round = f
        .store
        .cancel_game(Actor::Organiser, record.games[0].id, "no", f.now)
        .await;
    refused(of_round, &["is not called off"]);
}

#[tokio::test]
async fn a_schedule_is_played_again_with_fresh_seeds_and_beside_what_counts() {
    let f = Fixture::new().await;
    let once = TournamentRules {
        format: TournamentFormat::RoundRobin { rounds: round(1) },
        ..TournamentRules::default()
    };
    let (cup, teams) = opened(&f, &["A", "B"], once).await;
    let again = async |times| {
        f.store
            .order_replays(Actor::Organiser, cup.id, times, f.now)
            .await
    };
    refused(again(1).await, &["0 of 1 rounds were started"]);
    start(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[]))
        .await
        .unwrap();
    refused(again(1).await, &["1 games have no result yet"]);
    let game = play_next(&f).await;
    refused(again(0).await, &["expected 1 to 1000"]);
    assert_eq!(again(3).await.unwrap(), 3);
    refused(again(998).await, &["expected 1 to 997"]);
    f.store
        .void_game(Actor::Organiser, game, WHY, f.now)
        .await
        .unwrap();
    f.store
        .rerun_game(Actor::Organiser, game, f.now)
        .await
        .unwrap();
    let (claim, counts, _) = claim_game(&f).await;
    assert!(matches!(
        f.store.game(counts).await.unwrap().purpose,
        GamePurpose::Round(_)
    ));
    f.store
        .commit_game(&claim, &result(true), f.now)
        .await
        .unwrap();
    let (claim, replayed, _) = claim_game(&f).await;
    refused(
        f.store.commit_game(&claim, &result(true), f.now).await,
        &["played again is not"],
    );
    f.store
        .commit_game(&claim, &result(false), f.now)
        .await
        .unwrap();
    assert_eq!(
        f.store
            .cancel_replays(Actor::Organiser, cup.id, f.now)
            .await
            .unwrap(),
        2
    );
    let replays = f.store.games(cup.id, GamesOf::Replays).await.unwrap();
    assert_eq!(replays[0].id, replayed);
    let of_rounds = record(&f, cup.id).await.games;
    assert!(
        replays
            .iter()
            .all(|one| of_rounds.iter().all(|game| game.seed != one.seed))
    );
    assert_eq!(of_rounds.len(), 1);
}

#[tokio::test]
async fn tournament_of_an_earlier_ruleset_keeps_it() {
    let f = Fixture::new().await;
    let rules = TournamentRules {
        ruleset: Ruleset::Second,
        ..TournamentRules::default()
    };
    let (cup, teams) = opened(&f, &["A", "B"], rules).await;
    start(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[]))
        .await
        .unwrap();
    // The new program starts.
    let claimed = f.reopen().await.claim("slot 0", LEASE_S, f.now).await;
    let Some(Claimed {
        work: Work::Game { rules, .. },
        ..
    }) = claimed.unwrap()
    else {
        panic!("expected a game");
    };
    assert_eq!(rules.ruleset, Ruleset::Second);
}

#[tokio::test]
async fn a_closed_tournament_stays_as_it_is_and_lets_its_archives_go() {
    let f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B"], TournamentRules::default()).await;
    let rules = TournamentChange {
        rules: Some(TournamentRules {
            steps: 500,
            ..TournamentRules::default()
        }),
        ..TournamentChange::default()
    };
    let change = async || {
        f.store
            .change_tournament(Actor::Organiser, cup.id, &rules, f.now)
            .await
    };
    assert_eq!(change().await.unwrap().rules.steps, 500);
    start(&f, cup.id, &drawn(1, &[&[[teams[0], teams[1]]]], &[]))
        .await
        .unwrap();
    let other = TournamentChange {
        rules: Some(TournamentRules::default()),
        ..TournamentChange::default()
    };
    refused(
        f.store
            .change_tournament(Actor::Organiser, cup.id, &other, f.now)
            .await,
        &["a round was started"],
    );
    refused(
        f.store
            .close_tournament(Actor::Organiser, cup.id, f.now)
            .await,
        &["1 games are queued or running"],
    );
    refused(
        f.store.close_season(Actor::Organiser, f.now).await,
        &["1 games are queued"],
    );
    let game = play_next(&f).await;
    let of_a = f.store.game(game).await.unwrap().submissions[0];
    f.store
        .withdraw_submission(Actor::Team(teams[0]), of_a, f.now)
        .await
        .unwrap();
    refused(
        f.store.check_deletable(of_a, f.now).await,
        &["a tournament that is not closed"],
    );
    f.store
        .close_tournament(Actor::Organiser, cup.id, f.now)
        .await
        .unwrap();
    f.store.check_deletable(of_a, f.now).await.unwrap();
    refused(change().await, &["was closed on"]);
    refused(
        f.store.void_game(Actor::Organiser, game, WHY, f.now).await,
        &["was closed on"],
    );
    let twice = NewTournament {
        name: "cup".parse().unwrap(),
        stage: None,
        rules: TournamentRules::default(),
        settings: TournamentSettings::default(),
        entrants: Vec::new(),
    };
    let taken = f
        .store
        .open_tournament(Actor::Organiser, &twice, f.now)
        .await;
    assert!(
        matches!(taken, Err(StoreError::TournamentNameTaken(_))),
        "{taken:?}"
    );
}

#[derive(Debug, Clone)]
enum Act {
    Claim,
    Commit(usize),
    Break(usize),
    GiveBack(usize),
    Die,
}

fn acts() -> impl Strategy<Value = Vec<Act>> {
    let act = prop_oneof![
        4 => Just(Act::Claim),
        4 => (0..8_usize).prop_map(Act::Commit),
        1 => (0..8_usize).prop_map(Act::Break),
        1 => (0..8_usize).prop_map(Act::GiveBack),
        1 => Just(Act::Die),
    ];
    prop::collection::vec(act, 0..40)
}

/// Whatever slots do, in whatever order: each game has one result at most, and all have one in the end.
async fn play_acts(acts: Vec<Act>) {
    let mut f = Fixture::new().await;
    let (cup, teams) = opened(&f, &["A", "B", "C"], TournamentRules::default()).await;
    let [a, b, c] = teams[..] else { panic!() };
    start(
        &f,
        cup.id,
        &drawn(1, &[&[[a, b]], &[[b, c]], &[[c, a]]], &[c, a, b]),
    )
    .await
    .unwrap();
    let mut claims: Vec<(Claim, GameId)> = Vec::new();
    let mut committed = std::collections::BTreeMap::<GameId, u32>::new();
    for act in acts {
        let pick = |number: usize| claims.get(number % claims.len().max(1)).cloned();
        match act {
            Act::Claim => {
                if let Some(Claimed {
                    claim,
                    work: Work::Game { game, .. },
                }) = f.claim().await
                {
                    claims.push((claim, game));
                }
            }
            Act::Commit(number) => {
                if let Some((claim, game)) = pick(number)
                    && f.store
                        .commit_game(&claim, &result(true), f.now)
                        .await
                        .unwrap()
                        == Committed::Now
                {
                    *committed.entry(game).or_default() += 1;
                }
            }
            Act::Break(number) => {
                if let Some((claim, _)) = pick(number) {
                    f.store
                        .release_failed(&claim, "broken", f.now)
                        .await
                        .unwrap();
                }
            }
            Act::GiveBack(number) => {
                if let Some((claim, _)) = pick(number) {
                    f.store.release(&claim, f.now).await.unwrap();
                }
            }
            Act::Die => f.later(i64::from(LEASE_S) + 1),
        }
    }
    f.later(600);
    for game in record(&f, cup.id).await.games {
        if let GameState::Broken { .. } = game.state {
            f.store
                .rerun_game(Actor::Organiser, game.id, f.now)
                .await
                .unwrap();
        }
    }
    while let Some(Claimed {
        claim,
        work: Work::Game { game, .. },
    }) = f.claim().await
    {
        f.store
            .commit_game(&claim, &result(true), f.now)
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
                .is_some_and(|end| end.how == AttemptOutcome::Played)
        });
        assert_eq!(played.count(), 1);
        assert!(matches!(game.state, GameState::Played(_)));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn every_game_has_one_result_whatever_slots_do(acts in acts()) {
        tokio::runtime::Runtime::new().unwrap().block_on(play_acts(acts));
    }
}
