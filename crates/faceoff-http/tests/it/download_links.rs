//! Tests of signed links, which download a file without a token.

use crate::{
    site::{ADMIN, Answer, DATASET, Site, TestTeam, result, string},
    tournament::cup::{TestTournament, first_by_name_wins},
};
use reqwest::Method;
use serde_json::json;

/// A team with a finished evaluation. Returns the paths of the evaluation and of its submission.
async fn finished_evaluation(site: &Site, name: &str) -> (TestTeam, String, String) {
    let team = site.team(name).await;
    let submission = site.valid_submission(&team, "striker").await;
    let path = site.start_evaluation(&team, &submission).await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    (team, path, submission)
}

/// Creates a link to the file at `path`. Returns the link.
async fn create_link(site: &Site, path: &str, token: &str) -> String {
    let link = format!("{path}/link");
    let created = site.post(&link, Some(token), &json!({})).await.json(201);
    string(&created["url"])
}

#[tokio::test]
async fn link_needs_no_token_and_expires() {
    let site = Site::start().await;
    let (team, path, submission) = finished_evaluation(&site, "Alpha").await;
    let dataset = format!("{path}/dataset");
    let request = json!({ "expires_in_s": 60 });
    let created = site
        .post(&format!("{dataset}/link"), Some(&team.token), &request)
        .await
        .json(201);
    assert_eq!(created["expires_at"], "2026-03-01T10:01:00Z");
    let url = string(&created["url"]);
    assert!(url.starts_with(&format!("{dataset}?expires=")), "{url}");
    assert!(!url.contains(&team.token));
    let downloaded = site.get(&url, None).await;
    assert_eq!(
        (downloaded.status.as_u16(), downloaded.body.as_str()),
        (200, DATASET)
    );
    let part = site.request(Method::GET, &url, None);
    let part = part.header("range", "bytes=-7").send().await.unwrap();
    assert_eq!(part.status(), 206);
    let head = site.request(Method::HEAD, &url, None).send().await.unwrap();
    assert_eq!(head.status(), 200);
    site.advance(59);
    assert_eq!(site.get(&url, None).await.status, 200);
    site.advance(1);
    let expired = site.get(&url, None).await;
    let words = ["expired at 2026-03-01 10:01:00 UTC"];
    let problem = expired.problem(410, "link-expired", &words);
    assert_eq!(problem["expired_at"], "2026-03-01T10:01:00Z");

    // A link without an expiry is valid for an hour.
    let bundle_link = create_link(&site, &format!("{submission}/bundle"), &team.token).await;
    site.advance(3599);
    assert_eq!(site.get(&bundle_link, None).await.status, 200);
    site.advance(1);
    assert_eq!(site.get(&bundle_link, None).await.status, 410);
}

#[tokio::test]
async fn link_is_for_one_file_and_cannot_be_forged() {
    let site = Site::start().await;
    let (alpha, alpha_evaluation, _) = finished_evaluation(&site, "Alpha").await;
    site.next_day();
    let (beta, _, beta_evaluation) = site.team_with_evaluation("Beta", "b").await;
    site.finish_evaluation(&result([0.5; 3], 100.0)).await;
    site.finish_evaluation(&result([0.5; 3], 100.0)).await;
    let url = create_link(&site, &format!("{alpha_evaluation}/dataset"), ADMIN).await;
    assert_eq!(site.get(&url, None).await.status, 200);

    let (_, query) = url.split_once('?').unwrap();
    let prolonged = {
        let (expires, rest) = query.split_once('&').unwrap();
        let expires_s: i64 = expires.strip_prefix("expires=").unwrap().parse().unwrap();
        format!("expires={}&{rest}", expires_s + 1)
    };
    let (_, signature) = query.split_once("signature=").unwrap();
    let reversed: String = signature.chars().rev().collect();
    let tokens = site
        .get("/api/v1/tokens", Some(&beta.token))
        .await
        .json(200);
    let other_token = string(&tokens[0]["id"]);
    let creator_token = query.split(['&', '=']).nth(3).unwrap();
    for forged in [
        format!("{beta_evaluation}/dataset?{query}"),
        format!("{alpha_evaluation}/dataset?{prolonged}"),
        url.replace(signature, &reversed),
        url.replace(signature, "abc"),
        url.replace(creator_token, &other_token),
        url.replace(creator_token, "00000000-0000-7000-8000-000000000000"),
    ] {
        let words = ["not valid for this file"];
        let answer = site.get(&forged, None).await;
        answer.problem(403, "link-invalid", &words);
    }
    let (without_signature, _) = query.split_once("&signature=").unwrap();
    for incomplete in ["expires=1", "signature=00", without_signature] {
        let answer = site
            .get(&format!("{alpha_evaluation}/dataset?{incomplete}"), None)
            .await;
        answer.problem(400, "invalid-request", &["only some of them"]);
    }
    // Only a caller who may download the file may create a link. It expires after a week at most.
    let link_path = format!("{alpha_evaluation}/dataset/link");
    for (token, status) in [(None, 401), (Some(beta.token.as_str()), 404)] {
        let refused = site.post(&link_path, token, &json!({})).await;
        assert_eq!(refused.status, status);
    }
    for wrong in [0, 604_801] {
        let request = json!({ "expires_in_s": wrong });
        let refused = site.post(&link_path, Some(&alpha.token), &request).await;
        refused.problem(422, "invalid-content", &["expires_in_s", "604800"]);
    }
    let week = json!({ "expires_in_s": 604_800 });
    let created = site
        .post(&link_path, Some(&alpha.token), &week)
        .await
        .json(201);
    assert_eq!(created["expires_at"], "2026-03-09T10:00:00Z");
}

#[tokio::test]
async fn link_is_valid_while_its_creator_may_download() {
    let site = Site::start().await;
    let (team, path, submission) = finished_evaluation(&site, "Alpha").await;
    let dataset = format!("{path}/dataset");
    let (team_link, organiser_link) = (
        create_link(&site, &dataset, &team.token).await,
        create_link(&site, &dataset, ADMIN).await,
    );
    let status = async |url: &str| site.get(url, None).await.status.as_u16();
    // Links to a removed file are gone, too.
    let bundle_link = create_link(&site, &format!("{submission}/bundle"), &team.token).await;
    assert_eq!(status(&bundle_link).await, 200);
    site.valid_submission(&team, "b").await;
    let delete = site
        .request(Method::DELETE, &submission, Some(&team.token))
        .json(&json!({ "confirm": "striker.tar.gz" }));
    assert_eq!(delete.send().await.unwrap().status(), 200);
    let gone = site.get(&bundle_link, None).await;
    gone.problem(410, "removed", &["by its team"]);

    // A link is invalid once its token is rotated or revoked.
    let tokens = site.get("/api/v1/tokens", Some(&team.token)).await;
    let token = string(&tokens.json(200)[0]["id"]);
    let rotate = format!("/api/v1/tokens/{token}/rotate");
    let rotated = site.post(&rotate, Some(&team.token), &json!({})).await;
    let secret = string(&rotated.json(200)["secret"]);
    site.get(&team_link, None)
        .await
        .problem(403, "link-invalid", &["was rotated"]);
    let new_link = create_link(&site, &dataset, &secret).await;
    assert_eq!(status(&new_link).await, 200);
    let revoke = site.request(
        Method::DELETE,
        &format!("/api/v1/tokens/{token}"),
        Some(&secret),
    );
    assert_eq!(revoke.send().await.unwrap().status(), 200);
    site.get(&new_link, None)
        .await
        .problem(403, "link-invalid", &["was revoked"]);
    assert_eq!(
        status(&organiser_link).await,
        200,
        "the organiser's link stays valid"
    );
}

#[tokio::test]
async fn link_to_an_unfinished_dataset_is_refused() {
    let site = Site::start().await;
    let (team, _, path) = site.team_with_evaluation("Alpha", "striker").await;
    let link_path = format!("{path}/dataset/link");
    site.post(&link_path, Some(&team.token), &json!({}))
        .await
        .problem(409, "conflict", &["not finished"]);
}

#[tokio::test]
async fn game_recordings_have_links() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    cup.start_round().await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    let [home, _] = cup.names(&game).await;
    let path = format!("/api/v1/games/{}", game.id);
    let site = &cup.site;
    let recording_link = create_link(site, &format!("{path}/recording"), ADMIN).await;
    let side_link = create_link(site, &format!("{path}/sides/1"), cup.token(&home)).await;
    for url in [&recording_link, &side_link] {
        let answer = site.get(url, None).await;
        assert_eq!(answer.status, 200, "{url}");
        let hash = blake3::hash(answer.body.as_bytes()).to_string();
        assert_eq!(answer.header("x-content-blake3"), hash);
    }
    // A team cannot create a link to a file that it may not download.
    let refused: Answer = site
        .post(
            &format!("{path}/recording/link"),
            Some(cup.token(&home)),
            &json!({}),
        )
        .await;
    refused.problem(403, "forbidden", &["you may not see"]);
}
