//! A season of three months with forty teams, played through in one test: a clock that is turned from cut to cut, real
//! requests on a real database, the schedule and the tidying of the server, and a worker that plays nothing and commits
//! what a real one would.

mod organiser;
mod season;
mod stand_in;

use season::{DAYS, Season};
use serde_json::json;

/// What a season may take in the database, datasets and archives apart.
const MOST_BYTES: u64 = 50 << 20;

#[tokio::test]
#[expect(clippy::print_stdout, reason = "a measurement tells what it measured")]
async fn forty_teams_play_ninety_days_and_the_database_stays_small() {
    let mut season = Season::start().await;
    let (mut largest, mut played) = (0, 0);
    for day in 0..DAYS {
        season.morning(day).await;
        season.organise(day).await;
        played += season.evening(day).await;
        season.night().await;
        largest = largest.max(season.database_bytes());
    }
    season.sign_off().await;
    println!(
        "{played} evaluations; the database: {} MB at the end, {} MB at most",
        season.database_bytes() >> 20,
        largest >> 20
    );
    assert!(largest < MOST_BYTES, "{largest} bytes");
    for (path, taken) in season.boards().await {
        println!("{path}: {taken:?}");
    }
    let season = season.site.get("/api/v1/season", None).await.json(200);
    assert_ne!(season["closed_at"], json!(null));
}
