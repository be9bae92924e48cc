//! Measures how long responses with boards (the rankings of a stage) take with many teams. Not part of the normal test run:
//! `cargo nextest run --release -p faceoff-http --run-ignored only board_load --no-capture`

use crate::site::{OutcomeFn, Site, outcome};
use faceoff_airhockey::{EE, JOINT_VEL};
use faceoff_types::{EpisodeOutcome, Task};
use std::time::Instant;

const TEAMS: usize = 50;
/// Episodes of each task.
const EPISODES: u32 = 1000;

/// A pseudo-random number below 1000 that depends only on the arguments. Different salts give independent numbers.
fn pseudo_random(team: u64, task: Task, episode: u32, salt: u8) -> u64 {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&team.to_le_bytes());
    hasher.update(task.as_str().as_bytes());
    hasher.update(&episode.to_le_bytes());
    hasher.update(&[salt]);
    u64::from_le_bytes(hasher.finalize().as_bytes()[..8].try_into().unwrap()) % 1000
}

#[tokio::test]
#[ignore = "a measurement, of some minutes without --release"]
#[expect(clippy::print_stdout, reason = "the test prints its measurements")]
async fn boards_of_fifty_teams_are_measured() {
    let site = Site::start().await;
    // Later teams succeed more often, and violate more.
    let outcome_fn = |team: u64| {
        move |task: Task, episode: u32| EpisodeOutcome {
            success: pseudo_random(team, task, episode, 0) < 200 + 12 * team,
            violations: [
                (EE, pseudo_random(team, task, episode, 1) < 4 * team),
                (JOINT_VEL, pseudo_random(team, task, episode, 2) < 6 * team),
            ]
            .into_iter()
            .collect(),
            ..outcome(task, episode, false)
        }
    };
    let names: [String; TEAMS] = std::array::from_fn(|team| format!("Team {team}"));
    let agents: [_; TEAMS] = std::array::from_fn(|team| outcome_fn(team as u64));
    let teams: [(&str, OutcomeFn<'_>); TEAMS] =
        std::array::from_fn(|team| (names[team].as_str(), &agents[team] as OutcomeFn<'_>));
    site.run_day(EPISODES, teams).await;
    for round in ["first, summaries are computed", "second"] {
        for path in ["/api/v1/board", "/", "/tasks/hit", "/api/v1/board/prepare"] {
            let started = Instant::now();
            let answer = site.get(path, None).await;
            let elapsed = started.elapsed();
            assert_eq!(answer.status, 200);
            println!("{TEAMS} teams × 3 tasks × {EPISODES} episodes, {round}: {path} {elapsed:?}");
        }
    }
}
