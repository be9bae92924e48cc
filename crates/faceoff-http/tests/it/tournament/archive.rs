//! Tests of tournaments in a season archive, and on a server that shows an imported one.

use super::cup::{TestTournament, first_by_name_wins};
use crate::{
    archive::{export, import, read_file},
    browser::Browser,
    site::ADMIN,
};
use serde_json::json;

#[tokio::test]
async fn archive_shows_the_tournament_unchanged() {
    let rules = json!({ "format": { "kind": "round_robin", "rounds": 1 } });
    let cup = TestTournament::open(&["A", "B", "C"], json!({ "rules": rules })).await;
    cup.start_round().await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    cup.play(first_by_name_wins).await;
    let recording = format!("/api/v1/games/{}/recording", game.id);
    for (edition, token) in [("public", None), ("organiser", Some(ADMIN))] {
        let exported = export(&cup.site, edition).await;
        let mut original_responses = Vec::new();
        for (file, path) in [
            ("tournament.json", cup.path.clone()),
            ("games.json", format!("{}/games", cup.path)),
        ] {
            let answer = cup.site.get(&path, token).await;
            let file = format!("results/tournament-1-cup/{file}");
            assert_eq!(read_file(&exported.0, &file), answer.body, "{edition}");
            original_responses.push((path, answer.body));
        }
        let imported = import(exported).await;
        for (path, original) in original_responses {
            assert_eq!(imported.get(&path, token).await.body, original, "{edition}");
        }
        let ratings = format!("{}/ratings", cup.path);
        let original = cup.site.get(&ratings, None).await.json(200);
        assert_eq!(imported.get(&ratings, None).await.json(200), original);
        // Only the organiser's edition has recordings, since they are not published.
        let response = imported.get(&recording, token).await;
        assert_eq!(
            response.status.as_u16(),
            if token.is_some() { 200 } else { 401 }
        );
        // The pages work, and so does the choice to hide results, which does not change the season.
        let page = cup.path.replace("/api/v1", "");
        let tournament_page = imported.get(&page, None).await;
        assert_eq!(
            tournament_page.status, 200,
            "{edition}: {}",
            tournament_page.body
        );
        assert!(
            tournament_page.body.contains("Archived season"),
            "{edition}"
        );
        let game_page = imported.get(&format!("/games/{}", game.id), None).await;
        assert_eq!(game_page.status, 200, "{edition}: {}", game_page.body);
        let mut browser = Browser::new(&imported);
        let fields = [("results", "hidden"), ("next", page.as_str())];
        let hidden = browser.submit("/spoilers", &fields).await;
        assert_eq!(hidden.status, 303, "{edition}: {}", hidden.body);
        let rounds = format!("{}/rounds", cup.path);
        let start = imported.post(&rounds, Some(ADMIN), &json!({})).await;
        start.problem(403, "read-only", &["archive"]);
    }
}
