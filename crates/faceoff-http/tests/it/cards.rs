//! Tests of cards, the pictures of link previews: their content, and that they contain nothing that visitors may not see. The cards
//! of games are tested with the game page.

use crate::{
    clips::{record_open_day, record_released_day},
    html::attributes,
    site::{ADMIN, Answer, Site, TestTeam, result},
};
use reqwest::{Method, Response, header::HeaderMap};
use serde_json::json;
use std::io::Cursor;

/// A picture of a card, whose size and format are checked.
#[derive(Debug)]
pub struct Picture {
    pub headers: HeaderMap,
    pub png: Vec<u8>,
}

impl Picture {
    /// Decodes a response.
    pub async fn read(response: Response) -> Self {
        let (status, headers) = (response.status(), response.headers().clone());
        let png = response.bytes().await.unwrap().to_vec();
        assert_eq!(status, 200, "{}", String::from_utf8_lossy(&png));
        assert_eq!(headers["content-type"], "image/png");
        assert_eq!(headers["cache-control"], "public, max-age=60");
        let mut decoder = png::Decoder::new(Cursor::new(&png)).read_info().unwrap();
        let mut pixels = vec![0; decoder.output_buffer_size().unwrap()];
        let info = decoder.next_frame(&mut pixels).unwrap();
        assert_eq!((info.width, info.height), (1200, 630));
        let first = &pixels[..4];
        assert!(
            pixels.chunks(4).any(|pixel| pixel != first),
            "not only ground"
        );
        Self { headers, png }
    }
}

async fn fetch(site: &Site, path: &str, token: Option<&str>) -> Picture {
    let request = site.request(Method::GET, path, token);
    Picture::read(request.send().await.unwrap()).await
}

/// The pages of a team's evaluation, with a card each.
fn pages(team: &TestTeam, evaluation: &str) -> [String; 4] {
    [
        String::new(),
        "/tasks/hit".to_owned(),
        format!("/teams/{}", team.id),
        evaluation.replace("/api/v1", ""),
    ]
}

/// The pictures of these pages.
async fn cards(site: &Site, pages: &[String], token: Option<&str>) -> Vec<Vec<u8>> {
    let mut cards = Vec::new();
    for page in pages {
        cards.push(fetch(site, &format!("{page}/card.png"), token).await.png);
    }
    cards
}

#[tokio::test]
async fn result_changes_the_cards_of_its_pages() {
    let site = Site::start().await;
    let (alpha, _, evaluation) = site.team_with_evaluation("Alpha", "striker").await;
    let pages = pages(&alpha, &evaluation);
    let before = cards(&site, &pages, None).await;
    site.finish_evaluation(&result([0.511, 0.622, 0.733], 77.0))
        .await;
    let after = cards(&site, &pages, None).await;
    for (index, card) in after.iter().enumerate() {
        assert!(*card != before[index], "{}", pages[index]);
        assert!(!after[..index].contains(card), "{}", pages[index]);
    }
    assert!(cards(&site, &pages, None).await == after, "the same again");
    for token in [alpha.token.as_str(), ADMIN] {
        assert!(
            cards(&site, &pages, Some(token)).await == after,
            "the same for everyone"
        );
    }
    let stage = format!("/card.png?stage={}", site.stage().await);
    assert!(fetch(&site, &stage, None).await.png == after[0]);
}

#[tokio::test]
async fn unchanged_card_is_not_sent_again() {
    let site = Site::start().await;
    let (alpha, _, evaluation) = site.team_with_evaluation("Alpha", "striker").await;
    for page in pages(&alpha, &evaluation) {
        let path = format!("{page}/card.png");
        let first = fetch(&site, &path, None).await;
        let request = site.request(Method::GET, &path, None);
        let request = request.header("if-none-match", &first.headers["etag"]);
        let again = Answer::read(request.send().await.unwrap()).await;
        assert_eq!((again.status.as_u16(), &*again.body), (304, ""), "{path}");
        for header in ["etag", "cache-control"] {
            assert_eq!(again.headers[header], first.headers[header], "{path}");
        }
        // Chats load it from their own pages.
        let policy = &first.headers["cross-origin-resource-policy"];
        assert_eq!(policy, "cross-origin", "{path}");
    }
    let path = format!("{}/card.png", evaluation.replace("/api/v1", ""));
    let running = fetch(&site, &path, None).await;
    site.finish_evaluation(&result([0.5; 3], 10.0)).await;
    let finished = fetch(&site, &path, None).await;
    assert_ne!(finished.headers["etag"], running.headers["etag"]);
}

#[tokio::test]
async fn blind_results_are_on_no_card() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let submission = site.valid_submission(&alpha, "agent").await;
    site.change_first_stage(json!({ "blind": true }))
        .await
        .json(200);
    let evaluation = site.start_evaluation(&alpha, &submission).await;
    let pages = pages(&alpha, &evaluation);
    let before = cards(&site, &pages, None).await;
    site.finish_evaluation(&result([0.511, 0.622, 0.733], 777.5))
        .await;
    for token in [None, Some(alpha.token.as_str()), Some(ADMIN)] {
        let after = cards(&site, &pages, token).await;
        for (index, page) in pages.iter().enumerate() {
            assert!(after[index] == before[index], "{page} for {token:?}");
        }
    }
    site.change_first_stage(json!({ "blind": false }))
        .await
        .json(200);
    let revealed = cards(&site, &pages, None).await;
    for (index, page) in pages.iter().enumerate() {
        assert!(revealed[index] != before[index], "{page}");
    }
}

#[tokio::test]
async fn results_after_a_freeze_are_on_no_card() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let submission = site.valid_submission(&alpha, "agent").await;
    site.start_evaluation(&alpha, &submission).await;
    site.finish_evaluation(&result([0.5; 3], 10.0)).await;
    let freeze = format!("/api/v1/stages/{}/freeze", site.stage().await);
    let reason = json!({ "reason": "a surprise" });
    site.post(&freeze, Some(ADMIN), &reason).await.json(200);
    site.next_day();
    let evaluation = site.start_evaluation(&alpha, &submission).await;
    let pages = pages(&alpha, &evaluation);
    let before = cards(&site, &pages, None).await;
    site.finish_evaluation(&result([1.0; 3], 20.0)).await;
    for token in [None, Some(alpha.token.as_str()), Some(ADMIN)] {
        assert!(cards(&site, &pages, token).await == before, "{token:?}");
    }
    // Organisers may see the live board, but its picture would be for everyone.
    let live = site.get("/card.png?live=true", Some(ADMIN)).await;
    assert_eq!(live.status, 401);
    let unfreeze = freeze.replace("freeze", "unfreeze");
    site.post(&unfreeze, Some(ADMIN), &reason).await.json(200);
    let after = cards(&site, &pages, None).await;
    assert!(
        after
            .iter()
            .zip(&before)
            .all(|(after, before)| after != before)
    );
}

#[tokio::test]
async fn episode_card_shows_the_public_motion() {
    let unreleased = record_open_day().await;
    let path = format!("{}/prepare/1/card.png", unreleased.page);
    for token in [None, Some(unreleased.alpha.token.as_str()), Some(ADMIN)] {
        let early = unreleased.site.get(&path, token).await;
        assert_eq!(early.status, 409, "{}", early.body);
    }
    let day = record_released_day().await;
    let card = async |episode: u32, token| {
        let path = format!("{}/prepare/{episode}/card.png", day.page);
        fetch(&day.site, &path, token).await.png
    };
    let shown = card(1, None).await;
    assert!(card(2, None).await != shown, "another episode");
    let team = Some(day.alpha.token.as_str());
    assert!(card(1, team).await == shown, "without observations");
    for path in ["prepare/99", "hit/0", "juggle/0", "prepare/first"] {
        let path = format!("{}/{path}/card.png", day.page);
        let missing = day.site.get(&path, None).await;
        assert_eq!(missing.status, 404, "{path}: {}", missing.body);
    }
}

#[tokio::test]
async fn card_without_its_page_is_refused_like_the_page() {
    let site = Site::start().await;
    let id = "00000000-0000-7000-8000-000000000000";
    for (page, query, status) in [
        (format!("/teams/{id}"), "", 404),
        ("/teams/unknown".to_owned(), "", 404),
        (format!("/evaluations/{id}"), "", 404),
        (format!("/games/{id}"), "", 404),
        ("/tasks/juggle".to_owned(), "", 404),
        ("/tasks/hit".to_owned(), "?day=yesterday", 400),
        (String::new(), "?stage=first", 400),
        (String::new(), "?unknown=1", 400),
    ] {
        let card = format!("{page}/card.png{query}");
        let refused = site.get(&card, None).await;
        assert_eq!(refused.status, status, "{card}: {}", refused.body);
        let path = format!("{}{query}", if page.is_empty() { "/" } else { &page });
        assert_eq!(site.get(&path, None).await.status, status, "{path}");
    }
}

#[tokio::test]
async fn team_name_in_other_script_gives_nameless_card() {
    let site = Site::start().await;
    let [long, foreign] = ["An exceptionally long name of a team", "冰球"];
    let [long, foreign] = [site.team(long).await, site.team(foreign).await];
    let other = site.team("曲棍球").await;
    let card = async |team: &TestTeam| {
        let path = format!("/teams/{}/card.png", team.id);
        fetch(&site, &path, None).await.png
    };
    let nameless = card(&foreign).await;
    assert!(card(&long).await != nameless);
    assert!(card(&other).await == nameless);
}

#[tokio::test]
async fn pages_link_their_card_with_alternative_text() {
    let site = Site::start().await;
    let site = site.with_public_url("https://faceoff.example.org").await;
    let (alpha, _, evaluation) = site.team_with_evaluation("Alpha", "striker").await;
    site.finish_evaluation(&result([0.5; 3], 10.0)).await;
    let evaluation = evaluation.replace("/api/v1", "");
    let stage = site.stage().await;
    for (page, card) in [
        ("/".to_owned(), "/card.png".to_owned()),
        (
            format!("/?stage={stage}&sort=team"),
            format!("/card.png?stage={stage}"),
        ),
        ("/tasks/hit".to_owned(), "/tasks/hit/card.png".to_owned()),
        (
            format!("/teams/{}", alpha.id),
            format!("/teams/{}/card.png", alpha.id),
        ),
        (evaluation.clone(), format!("{evaluation}/card.png")),
    ] {
        let html = site.get(&page, None).await.html(200);
        let content = |property: &str| {
            attributes(&html, &format!("meta[property=\"{property}\"]"), "content").remove(0)
        };
        let address = format!("https://faceoff.example.org{card}");
        assert_eq!(content("og:image"), address, "{page}");
        assert_eq!(content("og:image:width"), "1200", "{page}");
        assert!(!content("og:image:alt").is_empty(), "{page}");
        fetch(&site, &card, None).await;
    }
    let html = site.get("/season", None).await.html(200);
    let picture = attributes(&html, "meta[property=\"og:image\"]", "content").remove(0);
    assert!(picture.ends_with("/docs/images/board.png"), "{picture}");
}
