//! How quick the boards are with many teams. Not run by itself:
//! `cargo nextest run --release -p faceoff-http --run-ignored only board_load --no-capture`

use crate::site::{Site, outcome};
use faceoff_types::{EpisodeOutcome, Task, Violations};
use std::time::Instant;

const TEAMS: u64 = 50;
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
    for team in 0..TEAMS {
        let name = format!("Team {team}");
        site.played_team(&name, EPISODES, |task, episode| EpisodeOutcome {
            success: draw(team, task, episode, 0) < 200 + 12 * team,
            violations: Violations {
                ee: draw(team, task, episode, 1) < 4 * team,
                joint_vel: draw(team, task, episode, 2) < 6 * team,
                ..Violations::default()
            },
            ..outcome(task, episode, false)
        })
        .await;
    }
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
