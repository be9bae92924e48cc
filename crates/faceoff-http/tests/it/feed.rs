//! Tests of the Atom feed with the season's news, parsed by a feed reader's library.

use crate::site::{ADMIN, Answer, Site, result};
use atom_syndication::Feed;
use reqwest::Method;
use serde_json::json;

const FEED_PATH: &str = "/feed.atom";

async fn fetch_feed(site: &Site) -> (Answer, Feed) {
    let answer = site.get(FEED_PATH, None).await;
    assert_eq!(answer.status, 200, "{}", answer.body);
    assert_eq!(
        answer.header("content-type"),
        "application/atom+xml; charset=utf-8"
    );
    let feed = Feed::read_from(answer.body.as_bytes()).unwrap();
    (answer, feed)
}

fn titles(feed: &Feed) -> Vec<String> {
    let entries = feed.entries().iter();
    entries
        .map(|entry| entry.title().as_str().to_owned())
        .collect()
}

#[tokio::test]
async fn feed_lists_news_newest_first_with_stable_ids() {
    let site = Site::start().await;
    let (_, first_feed) = fetch_feed(&site).await;
    assert_eq!(first_feed.title().as_str(), "Test season · Faceoff");
    assert_eq!(titles(&first_feed), ["Qualifying is open"]);
    site.advance(60);
    site.add_ranked_teams(&[
        ("Alpha", result([0.511; 3], 10.0)),
        ("Beta", result([0.7; 3], 20.0)),
    ])
    .await;
    site.advance(60);
    // Characters that XML and HTML must escape.
    let special = "<b>odd</b> & \"more\" ]]> 🙂";
    let announcement = json!({ "title": special, "text": format!("{special}\n\nand so on") });
    let path = "/api/v1/announcements";
    site.post(path, Some(ADMIN), &announcement).await.json(201);
    site.advance(60);
    let cup = json!({ "name": "Cup", "teams": ["Alpha", "Beta"] });
    let cup = site.post("/api/v1/tournaments", Some(ADMIN), &cup).await;
    assert_eq!(cup.status, 201, "{}", cup.body);
    site.advance(60);
    let rounds = format!("{}/rounds", cup.header("location"));
    let started = site.post(&rounds, Some(ADMIN), &json!({})).await;
    assert!(started.status.is_success(), "{}", started.body);

    let (answer, feed) = fetch_feed(&site).await;
    assert_eq!(
        titles(&feed),
        [
            "Cup: round 1 has begun",
            "The tournament Cup is open",
            special,
            "Qualifying: the day 2026-03-01 is released",
            "Qualifying is open"
        ]
    );
    assert!(!answer.body.contains("51.1"), "no score");
    assert_eq!(feed.id(), first_feed.id());
    assert_eq!(feed.entries()[4].id(), first_feed.entries()[0].id());
    let announced = &feed.entries()[2];
    let content = announced.content().unwrap();
    assert_eq!(content.content_type(), Some("text"));
    assert_eq!(
        content.value(),
        Some(format!("{special}\n\nand so on").as_str())
    );
    let announcement = announced.links()[0].href();
    assert!(
        announcement.starts_with("/announcements#a"),
        "{announcement}"
    );
    assert_eq!(feed.updated(), feed.entries()[0].updated());
    for entry in feed.entries() {
        assert!(entry.id().starts_with("urn:uuid:"));
        let linked_page = site.get(entry.links()[0].href(), None).await;
        assert_eq!(linked_page.status, 200, "{entry:?}");
        assert!(linked_page.header("content-type").starts_with("text/html"));
    }
    let mut ids: Vec<&str> = feed.entries().iter().map(|entry| entry.id()).collect();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), 5);
    // Pages link to the feed.
    let page = site.get("/announcements", None).await.body;
    let link = r#"<link rel="alternate" type="application/atom+xml""#;
    assert!(page.contains(link), "{page}");
}

#[tokio::test]
async fn unchanged_feed_answers_not_modified() {
    let site = Site::start().await;
    let (answer, _) = fetch_feed(&site).await;
    let (tag, modified) = (answer.header("etag"), answer.header("last-modified"));
    assert_eq!(modified, "Sun, 01 Mar 2026 10:00:00 GMT");
    let get_with_header = async |name: &str, value: &str| {
        let request = site
            .request(Method::GET, FEED_PATH, None)
            .header(name, value);
        Answer::read(request.send().await.unwrap()).await
    };
    for (name, value) in [
        ("if-none-match", tag.to_owned()),
        ("if-none-match", format!("\"other\", W/{tag}")),
        ("if-modified-since", modified.to_owned()),
    ] {
        let unchanged = get_with_header(name, &value).await;
        assert_eq!(
            (unchanged.status.as_u16(), unchanged.body.as_str()),
            (304, "")
        );
        assert_eq!(unchanged.header("etag"), tag);
    }
    for (name, value) in [
        ("if-none-match", "\"other\""),
        ("if-modified-since", "Sun, 01 Mar 2026 09:59:59 GMT"),
        ("if-modified-since", "yesterday"),
    ] {
        assert_eq!(get_with_header(name, value).await.status, 200, "{value}");
    }
    site.advance(60);
    let announcement = json!({ "title": "News", "text": "of this test" });
    let path = "/api/v1/announcements";
    site.post(path, Some(ADMIN), &announcement).await.json(201);
    assert_eq!(get_with_header("if-none-match", tag).await.status, 200);
    assert_eq!(
        get_with_header("if-modified-since", modified).await.status,
        200
    );
}
