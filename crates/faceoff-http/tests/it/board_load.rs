//! How quick the boards are with many teams. Not run by itself:
//! `cargo nextest run --release -p faceoff-http --run-ignored only board_load --no-capture`

use crate::site::{Played, Site, outcome};
use faceoff_types::{EpisodeOutcome, Task, Violations};
use std::time::Instant;

const TEAMS: usize = 50;
const EPISODES: u32 = 1000;

/// The same pseudo-random number below 1000 for the same episode.
fn draw(team: u64, task: Task, episode: u32, what: u8) -> u64 {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&team.to_le_bytes());
    hasher.update(task.as_str().as_bytes());
    hasher.update(&episode.to_le_bytes());
    hasher.update(&[what]);
    u64::from_le_bytes(hasher.finalize().as_bytes()[..8].try_into().unwrap()) % 1000
}

#[tokio::test]
#[ignore = "a measurement, of some minutes without --release"]
#[expect(clippy::print_stdout, reason = "a measurement tells what it measured")]
async fn boards_of_fifty_teams() {
    let site = Site::start().await;
    let played = |team: u64| {
        move |task: Task, episode: u32| EpisodeOutcome {
            success: draw(team, task, episode, 0) < 200 + 12 * team,
            violations: Violations {
                ee: draw(team, task, episode, 1) < 4 * team,
                joint_vel: draw(team, task, episode, 2) < 6 * team,
                ..Violations::default()
            },
            ..outcome(task, episode, false)
        }
    };
    let names: [String; TEAMS] = std::array::from_fn(|team| format!("Team {team}"));
    let agents: [_; TEAMS] = std::array::from_fn(|team| played(team as u64));
    let teams: [(&str, Played<'_>); TEAMS] =
        std::array::from_fn(|team| (names[team].as_str(), &agents[team] as Played<'_>));
    site.played_day(EPISODES, teams).await;
    for round in ["first, summaries are made", "second"] {
        for path in ["/api/v1/board", "/", "/tasks/hit", "/api/v1/board/prepare"] {
            let started = Instant::now();
            let answer = site.get(path, None).await;
            let taken = started.elapsed();
            assert_eq!(answer.status, 200);
            println!("{TEAMS} teams × 3 × {EPISODES}, {round}: {path} {taken:?}");
        }
    }
}
