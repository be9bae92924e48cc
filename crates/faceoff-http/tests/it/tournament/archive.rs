//! Tournaments in the archive of a season.

use super::cup::{Cup, first_by_name_wins};
use crate::{
    archive::{export, import, read_file},
    browser::Browser,
    site::ADMIN,
};
use serde_json::json;

#[tokio::test]
async fn archive_shows_the_tournament_unchanged() {
    let rules = json!({ "format": { "kind": "round_robin", "rounds": 1 } });
    let cup = Cup::open(&["A", "B", "C"], json!({ "rules": rules })).await;
    cup.start_round().await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    cup.play(first_by_name_wins).await;
    let recording = format!("/api/v1/games/{}/recording", game.id);
    for (edition, token) in [("public", None), ("organiser", Some(ADMIN))] {
        let exported = export(&cup.site, edition).await;
        let mut shown = Vec::new();
        for (file, path) in [
            ("tournament.json", cup.path.clone()),
            ("games.json", format!("{}/games", cup.path)),
        ] {
            let answer = cup.site.get(&path, token).await;
            let file = format!("results/tournament-1-cup/{file}");
            assert_eq!(read_file(&exported.0, &file), answer.body, "{edition}");
            shown.push((path, answer.body));
        }
        let server = import(exported).await;
        for (path, before) in shown {
            assert_eq!(server.get(&path, token).await.body, before, "{edition}");
        }
        let ratings = format!("{}/ratings", cup.path);
        let before = cup.site.get(&ratings, None).await.json(200);
        assert_eq!(server.get(&ratings, None).await.json(200), before);
        // Only the organiser's edition has recordings, since they are not published.
        let response = server.get(&recording, token).await;
        assert_eq!(
            response.status.as_u16(),
            if token.is_some() { 200 } else { 401 }
        );
        // The pages work, and so does the choice to hide results, which does not change the season.
        let page = cup.path.replace("/api/v1", "");
        let shown = server.get(&page, None).await;
        assert_eq!(shown.status, 200, "{edition}: {}", shown.body);
        assert!(shown.body.contains("Archived season"), "{edition}");
        let game_page = server.get(&format!("/games/{}", game.id), None).await;
        assert_eq!(game_page.status, 200, "{edition}: {}", game_page.body);
        let mut browser = Browser::new(&server);
        let fields = [("results", "hidden"), ("next", page.as_str())];
        let chosen = browser.submit("/spoilers", &fields).await;
        assert_eq!(chosen.status, 303, "{edition}: {}", chosen.body);
        let rounds = format!("{}/rounds", cup.path);
        let start = server.post(&rounds, Some(ADMIN), &json!({})).await;
        start.problem(403, "read-only", &["archive"]);
    }
}
