//! Tests of board pages, which show the ranking of a stage: changes since the previous day, past days, sorting, ETags and page
//! size.

use crate::{
    html::{attributes, page, texts},
    site::{ADMIN, Site, result},
};
use reqwest::{Method, header};

/// Two days: Alpha falls behind Beta, and Gamma joins on the second day.
async fn two_days(site: &Site) {
    let teams = [site.team("Alpha").await, site.team("Beta").await];
    for team in &teams {
        site.valid_submission(team, "agent").await;
    }
    site.start_day().await;
    site.finish_evaluation(&result([0.6; 3], 10.0)).await;
    site.finish_evaluation(&result([0.4; 3], 20.0)).await;
    let gamma = site.team("Gamma").await;
    site.valid_submission(&gamma, "agent").await;
    site.next_day();
    site.start_day().await;
    site.finish_evaluation(&result([0.5; 3], 10.0)).await;
    site.finish_evaluation(&result([0.7; 3], 20.0)).await;
    site.finish_evaluation(&result([0.1; 3], 700.0)).await;
}

#[tokio::test]
async fn board_page_shows_changes_since_the_previous_day() {
    let site = Site::start().await;
    two_days(&site).await;
    for path in ["/", "/tasks/hit"] {
        let html = page(&site, path).await;
        assert_eq!(
            texts(&html, ".board th.team > a"),
            ["Beta", "Alpha", "Gamma"],
            "{path}"
        );
        let ranks = texts(&html, ".board td.rank");
        assert_eq!(
            ranks,
            [
                "1=▲ 1 up since 2026-03-01",
                "1=▼ 1 down since 2026-03-01",
                "3new: not on the board of 2026-03-01",
            ],
            "{path}"
        );
        let scores = texts(&html, ".board .score .change, .board .success .change");
        assert_eq!(
            scores,
            ["+30.0 since the day before", "−10.0 since the day before"],
            "{path}"
        );
    }
    // The first day has no previous one.
    let first = page(&site, "/?day=2026-03-01").await;
    assert_eq!(texts(&first, ".board td.rank"), ["1=", "1="]);
    assert!(texts(&first, ".change").is_empty());
}

#[tokio::test]
async fn past_days_are_linked_with_the_same_parameters() {
    let site = Site::start().await;
    two_days(&site).await;
    let current = page(&site, "/?sort=team").await;
    assert_eq!(
        attributes(&current, ".days [rel=prev]", "href"),
        ["/?day=2026-03-01&sort=team"]
    );
    assert!(attributes(&current, ".days [rel=next]", "href").is_empty());
    assert_eq!(
        texts(&current, ".days details a"),
        ["2026-03-02", "2026-03-01"]
    );
    let past = page(&site, "/?day=2026-03-01&sort=team").await;
    assert!(texts(&past, ".days")[0].starts_with("As of 2026-03-01"));
    assert_eq!(texts(&past, ".board th.team > a"), ["Alpha", "Beta"]);
    assert_eq!(
        attributes(&past, ".days [rel=next]", "href"),
        ["/?sort=team"],
        "the newest day is the current board"
    );
    assert_eq!(
        attributes(&past, ".tabs a", "href"),
        [
            "/?day=2026-03-01",
            "/tasks/hit?day=2026-03-01",
            "/tasks/defend?day=2026-03-01",
            "/tasks/prepare?day=2026-03-01"
        ]
    );
    assert_eq!(site.get("/?day=2026-02-28", None).await.status, 404);
}

#[tokio::test]
async fn board_is_sorted_by_links_in_its_header() {
    let site = Site::start().await;
    two_days(&site).await;
    for (path, direction, teams, next) in [
        (
            "/",
            "ascending",
            ["Beta", "Alpha", "Gamma"],
            "/?sort=-place",
        ),
        (
            "/?sort=points",
            "ascending",
            ["Alpha", "Beta", "Gamma"],
            "/?sort=-points",
        ),
        (
            "/?sort=-score",
            "ascending",
            ["Gamma", "Alpha", "Beta"],
            "/?sort=score",
        ),
        (
            "/?sort=prepare",
            "descending",
            ["Beta", "Alpha", "Gamma"],
            "/?sort=-prepare",
        ),
        (
            "/tasks/hit?sort=-team",
            "descending",
            ["Gamma", "Beta", "Alpha"],
            "/tasks/hit?sort=team",
        ),
        (
            "/tasks/hit?sort=score",
            "descending",
            ["Beta", "Alpha", "Gamma"],
            "/tasks/hit?sort=-score",
        ),
    ] {
        let html = page(&site, path).await;
        assert_eq!(texts(&html, ".board th.team > a"), teams, "{path}");
        assert_eq!(
            attributes(&html, "thead [aria-sort]", "aria-sort"),
            [direction]
        );
        assert_eq!(
            attributes(&html, "thead [aria-sort] a", "href"),
            [next],
            "{path}"
        );
        // Task boards are not grouped by tier, so each row shows its tier.
        let tiers = if path == "/" { 0 } else { 3 };
        assert_eq!(texts(&html, ".board th.team .tier").len(), tiers, "{path}");
    }
    for wrong in [
        "/?sort=luck",
        "/tasks/hit?sort=defend",
        "/?sort=",
        "/?order=team",
    ] {
        assert_eq!(site.get(wrong, None).await.status, 400, "{wrong}");
    }
}

#[tokio::test]
async fn unchanged_board_page_answers_not_modified() {
    let site = Site::start().await;
    two_days(&site).await;
    for token in [None, Some(ADMIN)] {
        for path in ["/", "/?day=2026-03-01", "/tasks/hit?sort=team"] {
            let answer = site.get(path, token).await;
            assert_eq!(answer.header("cache-control"), "private, no-cache");
            let tag = answer.header("etag").to_owned();
            let again = site
                .request(Method::GET, path, token)
                .header(header::IF_NONE_MATCH, &tag)
                .send()
                .await
                .unwrap();
            assert_eq!(again.status(), 304, "{path}");
            assert_eq!(again.headers()[header::ETAG], tag.as_str());
            assert!(again.bytes().await.unwrap().is_empty());
        }
    }
    let tag = site.get("/", None).await.header("etag").to_owned();
    site.next_day();
    site.start_day().await;
    let request = site.request(Method::GET, "/", None);
    let changed = request.header(header::IF_NONE_MATCH, &tag).send().await;
    assert_eq!(changed.unwrap().status(), 200);
}

#[tokio::test]
async fn full_board_page_loads_less_than_100_kilobytes() {
    let site = Site::start().await;
    // As many teams as in the paper's qualifying stage, on two days.
    const TEAMS: u32 = 17;
    let names: Vec<String> = (1..=TEAMS)
        .map(|number| format!("Team number {number}"))
        .collect();
    let results: Vec<_> = (1..=TEAMS)
        .map(f64::from)
        .map(|number| result([number / 20.0; 3], 100.0 * number))
        .collect();
    let teams: Vec<_> = names
        .iter()
        .zip(&results)
        .map(|(name, result)| (name.as_str(), result.clone()))
        .collect();
    site.add_ranked_teams(&teams).await;
    site.next_day();
    site.start_day().await;
    for result in results.iter().rev() {
        site.finish_evaluation(result).await;
    }
    for path in ["/", "/tasks/hit"] {
        let html = page(&site, path).await;
        assert_eq!(texts(&html, ".board td.rank").len(), TEAMS as usize);
        let mut bytes = site.get(path, None).await.body.len();
        let assets = [
            attributes(&html, "link[rel=stylesheet], link[rel=icon]", "href"),
            attributes(&html, "script, img", "src"),
        ];
        for asset in assets.concat() {
            let answer = site.get(&asset, None).await;
            assert_eq!(answer.status, 200, "{asset}");
            assert!(answer.header("cache-control").contains("immutable"));
            bytes += answer.body.len();
        }
        assert!(bytes < 100_000, "{path} loads {bytes} bytes");
    }
}

#[tokio::test]
async fn embedded_board_shows_first_teams_to_other_sites() {
    let site = Site::start().await;
    two_days(&site).await;
    let answer = site.get("/embed", None).await;
    let policy = answer.header("content-security-policy");
    assert!(policy.contains("frame-ancestors *"), "{policy}");
    let html = answer.html(200);
    assert_eq!(texts(&html, "tbody td:first-child"), ["1=", "1=", "3"]);
    let scores = texts(&html, "tbody td.number");
    assert!(scores[0].starts_with("70.0"), "{scores:?}");
    assert!(attributes(&html, "tbody a", "href")[0].starts_with("/teams/"));
    // Framing the board itself is not allowed.
    assert_eq!(site.get("/", None).await.header("x-frame-options"), "DENY");
}
