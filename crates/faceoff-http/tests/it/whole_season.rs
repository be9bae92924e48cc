//! A season of three months with twenty teams in one test. The clock is set from cutoff to cutoff. Requests, database,
//! schedule and clean-up are real; a fake worker commits random outcomes without running agents.

mod fake_worker;
mod organiser_actions;
mod season;

use season::{DAYS, Season};
use serde_json::json;

/// The largest size of the database during a season, without datasets and archives.
const MAX_BYTES: u64 = 25 << 20;

#[tokio::test]
#[expect(clippy::print_stdout, reason = "the test prints its measurements")]
async fn database_stays_small_with_twenty_teams_and_ninety_days() {
    let mut season = Season::start().await;
    let (mut largest, mut evaluations) = (0, 0);
    for day in 0..DAYS {
        season.morning(day).await;
        season.perform_actions(day).await;
        evaluations += season.evening(day).await;
        season.night().await;
        largest = largest.max(season.database_bytes());
    }
    season.sign_off().await;
    println!(
        "{evaluations} evaluations; the database: {} MB at the end, {} MB at most",
        season.database_bytes() >> 20,
        largest >> 20
    );
    assert!(largest < MAX_BYTES, "{largest} bytes");
    for (path, elapsed) in season.boards().await {
        println!("{path}: {elapsed:?}");
    }
    let season = season.site.get("/api/v1/season", None).await.json(200);
    assert_ne!(season["closed_at"], json!(null));
}
