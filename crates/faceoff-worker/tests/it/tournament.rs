//! Helpers for tests with tournaments: rules, pairs, results and recordings.

use crate::server::Server;
use faceoff_store::*;
use faceoff_testkit::wait_for;
use faceoff_types::*;
use jiff::Timestamp;
use std::{io::Read as _, path::PathBuf};

/// Rules for short games in which only answers of more than a second are late, so that a busy machine does not affect them.
pub fn rules(steps: u32) -> TournamentRules {
    TournamentRules {
        steps,
        game_limits: GameLimits {
            max_answer_s: 1.0,
            restart_s: 600.0,
            ..GameLimits::default()
        },
        ..faceoff_airhockey::competition().tournament_rules()
    }
}

/// Opens a tournament and starts its first round with these pairs, on one matchday. Returns its games.
pub async fn start_round(
    server: &Server,
    rules: TournamentRules,
    pairs: &[[TeamId; 2]],
) -> Vec<Game> {
    let mut entrants: Vec<TeamId> = pairs.iter().flatten().copied().collect();
    entrants.sort_unstable();
    entrants.dedup();
    let new = NewTournament {
        name: "Finals".parse().unwrap(),
        stage: None,
        rules,
        settings: TournamentSettings::default(),
        entrants,
    };
    let (store, now) = (&server.store, Timestamp::now());
    let opened = store.open_tournament(Actor::Operator, &new, now);
    let id = opened.await.unwrap().id;
    let drawn = DrawnRound {
        number: RoundNumber::FIRST,
        groups: Vec::new(),
        matchdays: vec![DrawnMatchday {
            games: pairs.to_vec(),
            byes: Vec::new(),
        }],
    };
    let started = store.start_round(Actor::Operator, id, &drawn, now);
    started.await.unwrap();
    store.games(id, GameFilter::Rounds).await.unwrap()
}

/// Each team against each other one, once.
pub fn all_pairs(teams: &[TeamId]) -> Vec<[TeamId; 2]> {
    let pairs_of = |(index, home): (usize, &TeamId)| {
        let home = *home;
        teams[index + 1..].iter().map(move |away| [home, *away])
    };
    teams.iter().enumerate().flat_map(pairs_of).collect()
}

/// Waits until a tournament's games are over. Returns their results in the order of play.
pub async fn wait_for_results(server: &Server, tournament: TournamentId) -> Vec<StoredGameResult> {
    wait_for(&server.store, async || {
        let games = server.store.games(tournament, GameFilter::Rounds).await;
        let results = games.unwrap().into_iter().map(|game| match game.state {
            GameState::Played(result) => Some(*result),
            state if state.is_open() => None,
            state => panic!("{state:?}"),
        });
        results.collect()
    })
    .await
}

/// The path of a game's stored recording, which must have the reported hash.
pub fn recording(server: &Server, result: &StoredGameResult) -> PathBuf {
    let recording = result.recording.as_ref().expect("a round's game has one");
    let folder = server.path().join("data/artifacts").join(&recording.key);
    let archive = folder.join("game.zip");
    let hash = blake3::hash(&std::fs::read(&archive).unwrap());
    assert_eq!(hash.to_string(), recording.game_blake3);
    archive
}

/// The content of a file in a stored recording.
pub fn read_from_recording(recording: PathBuf, name: &str) -> Vec<u8> {
    let archive = std::fs::File::open(recording).unwrap();
    let mut archive = zip::ZipArchive::new(archive).unwrap();
    let mut bytes = Vec::new();
    let read = archive.by_name(name).unwrap().read_to_end(&mut bytes);
    read.unwrap();
    bytes
}
