//! Repeated `kill -9` of a server during a hundred games.

use crate::{
    killed_child::{run_and_kill, run_jobs},
    server::Server,
    tournament::{recording, rules, start_round, wait_for_results},
};
use faceoff_store::*;
use faceoff_types::{TeamId, TournamentId};
use std::collections::BTreeMap;

const GAMES: usize = 100;

/// Are all games over?
async fn are_over(server: &Server, tournament: TournamentId) -> bool {
    let games = server.store.games(tournament, GameFilter::Rounds);
    let games = games.await.unwrap();
    games.iter().all(|game| !game.state.is_open())
}

/// Runs games until the process is killed or all games are over, and prints a line for each event. Started by the test below.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
#[ignore = "the child process of tournament_survives_killed_servers"]
async fn child_process_plays_games() {
    run_jobs(2, async |server, id| {
        are_over(server, id.parse().unwrap()).await
    })
    .await;
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn tournament_survives_killed_servers() {
    let server = Server::new().await;
    let mut teams: Vec<TeamId> = Vec::new();
    for number in 0..20 {
        teams.push(server.upload_valid(&format!("Team {number}"), "").await);
    }
    let (home, away) = teams.split_at(10);
    let pairs_of = |home: &TeamId| {
        let home = *home;
        away.iter().map(move |away| [home, *away])
    };
    let pairs: Vec<[TeamId; 2]> = home.iter().flat_map(pairs_of).collect();
    let games = start_round(&server, rules(2), &pairs).await;
    assert_eq!(games.len(), GAMES);
    let tournament = games[0].tournament;

    let id = tournament.to_string();
    for events_to_live in [1, 2, 3, 5, 8, 13, 21, 13, 8, 5, 3, 2] {
        let seen_events = run_and_kill(
            &server,
            "games_killed::child_process_plays_games",
            &id,
            events_to_live,
        );
        assert_eq!(seen_events, events_to_live, "the child ended early");
    }
    let worker = server.start_worker(2);
    let results = wait_for_results(&server, tournament).await;
    worker.stop().await;

    let (mut lost, mut games_of_team) = (0, BTreeMap::new());
    for (game, result) in games.iter().zip(&results) {
        assert_eq!(result.results["steps"], 2);
        for team in game.teams {
            *games_of_team.entry(team).or_insert(0) += 1;
        }
        // Checks the recording's hash.
        recording(&server, result);
        let attempts = server.store.game_attempts(game.id).await.unwrap();
        let numbers: Vec<u32> = attempts.iter().map(|attempt| attempt.number).collect();
        assert!(
            numbers.iter().copied().eq(1..=result.attempt),
            "{attempts:?}"
        );
        for attempt in &attempts {
            let end = attempt.end.as_ref().expect("no attempt is left open");
            let expected = if attempt.number == result.attempt {
                AttemptOutcome::Played
            } else {
                lost += 1;
                AttemptOutcome::Lost
            };
            assert_eq!(end.outcome, expected, "{attempts:?}");
        }
    }
    assert!(lost > 0, "some games were killed in the middle");
    assert!(games_of_team.len() == 20 && games_of_team.values().all(|games| *games == 10));
    let record = server.store.tournament_record(tournament).await.unwrap();
    assert!(record.rounds[0].over_at.is_some());
}
