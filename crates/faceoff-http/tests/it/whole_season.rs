//! Test of a whole season: three months with twenty teams. The clock is set from one evaluation day to the next. Requests,
//! database, schedule and clean-up are real; a fake worker commits random outcomes without running agents. `season` runs the
//! days, `organiser_actions` has what organisers and teams do on some of them.

mod fake_worker;
mod organiser_actions;
mod season;

use season::{DAYS, Season};
use serde_json::json;

/// The size that the database may reach during the season. Datasets and bundles are not in the database.
const MAX_DATABASE_BYTES: u64 = 25 << 20;

#[tokio::test]
#[expect(clippy::print_stdout, reason = "the test prints its measurements")]
async fn database_stays_small_with_twenty_teams_and_ninety_days() {
    let mut season = Season::start().await;
    let (mut largest_bytes, mut evaluations) = (0, 0);
    for day in 0..DAYS {
        season.add_teams_and_submissions(day).await;
        season.perform_actions(day).await;
        evaluations += season.run_evaluations(day).await;
        season.run_clean_up().await;
        largest_bytes = largest_bytes.max(season.database_bytes());
    }
    season.sign_off().await;
    println!(
        "{evaluations} evaluations; the database: {} MB at the end, {} MB at most",
        season.database_bytes() >> 20,
        largest_bytes >> 20
    );
    assert!(largest_bytes < MAX_DATABASE_BYTES, "{largest_bytes} bytes");
    for (board, elapsed) in season.time_boards().await {
        println!("{board}: {elapsed:?}");
    }
    let season = season.site.get("/api/v1/season", None).await.json(200);
    assert_ne!(season["closed_at"], json!(null));
}
