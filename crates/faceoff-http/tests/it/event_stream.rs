//! The stream of what changes, over real connections: who is told what, and what a reader that comes again gets.

use crate::{
    site::{ADMIN, Answer, Site, TestTeam, patient, result, text},
    sse::{Event, Stream},
};
use faceoff_http::HttpLimits;
use reqwest::Method;
use serde_json::{Value, json};

const PATH: &str = "/api/v1/events/stream";

async fn announce(site: &Site) {
    let told = json!({ "title": "The end", "text": "of this test" });
    let path = "/api/v1/announcements";
    site.post(path, Some(ADMIN), &told).await.json(201);
}

async fn change_stage(site: &Site, body: Value) {
    let path = format!("/api/v1/stages/{}", site.stage().await);
    let request = site.request(Method::PATCH, &path, Some(ADMIN)).json(&body);
    Answer::of(request.send().await.unwrap()).await.json(200);
}

/// All changes until the announcement, from the beginning of the season.
async fn until_the_end(site: &Site, query: &str, token: Option<&str>) -> Vec<Event> {
    let mut stream = Stream::open(site, &format!("{PATH}{query}"), token, Some("0")).await;
    let mut told = Vec::new();
    loop {
        let event = stream.next().await.unwrap();
        assert_eq!(event.name, "change");
        assert_eq!(event.id, Some(event.data["id"].to_string()));
        if event.data["kind"] == "announced" {
            return told;
        }
        told.push(event);
    }
}

fn kinds(events: &[Event]) -> Vec<&str> {
    let kinds = events.iter().map(|event| event.data["kind"].as_str());
    kinds.map(Option::unwrap).collect()
}

/// A day of two teams that are played to their scores; the path of the first one's evaluation.
async fn played_day(site: &Site, teams: &[TestTeam; 2]) -> String {
    let mut of_first = None;
    for team in teams {
        site.valid_submission(team, "agent").await;
    }
    for team in teams {
        let submission = site.store.submissions_of(team.id.parse().unwrap());
        let submission = submission.await.unwrap()[0].id.to_string();
        let evaluation = site.evaluate(team, &submission).await;
        of_first.get_or_insert(evaluation);
    }
    site.finish(&result([0.5; 3], 10.0)).await;
    site.finish(&result([0.7; 3], 20.0)).await;
    of_first.unwrap()
}

async fn two_teams(site: &Site) -> [TestTeam; 2] {
    [site.team("Alpha").await, site.team("Beta").await]
}

#[tokio::test]
async fn a_reader_that_comes_again_and_again_gets_each_change_once_and_in_order() {
    let site = Site::start().await;
    let mut live = Stream::open(&site, PATH, Some(ADMIN), None).await;
    let now = live.next().await.unwrap();
    assert_eq!(now.name, "now");
    assert_eq!(now.id, Some(now.data["id"].to_string()));
    let teams = two_teams(&site).await;
    played_day(&site, &teams).await;

    let log = site
        .get("/api/v1/events?limit=1000", Some(ADMIN))
        .await
        .json(200);
    let logged = log["events"].as_array().unwrap().iter().rev();
    let ids: Vec<i64> = logged.map(|event| event["id"].as_i64().unwrap()).collect();
    assert!(ids.len() > 20, "{ids:?}");
    // Three at a time, by a connection each.
    let (mut told, mut last) = (Vec::new(), "0".to_owned());
    while told.len() < ids.len() {
        let mut stream = Stream::open(&site, PATH, Some(ADMIN), Some(&last)).await;
        for _ in 0..3.min(ids.len() - told.len()) {
            let event = stream.next().await.unwrap();
            last = event.id.unwrap();
            told.push(last.parse::<i64>().unwrap());
        }
    }
    assert_eq!(told, ids);
    // Who stayed has what came after the first word.
    let since = ids
        .iter()
        .filter(|id| **id > now.data["id"].as_i64().unwrap());
    for id in since {
        assert_eq!(live.next().await.unwrap().id, Some(id.to_string()));
    }
    announce(&site).await;
    let told = live.next().await.unwrap().data;
    assert_eq!(told["kind"], "announced");
    assert_eq!(told["at"], site.now().to_string());
    assert!(text(&told["subject"]).starts_with("announcement:"));
    assert!(told.get("title").is_none(), "what it says is asked for");
}

#[tokio::test]
async fn everybody_is_told_what_they_may_know_and_no_score() {
    let site = Site::start().await;
    let teams = two_teams(&site).await;
    let [alpha, beta] = &teams;
    let evaluation = played_day(&site, &teams).await;
    let id = evaluation.rsplit('/').next().unwrap();
    let asked = json!({ "text": "?" });
    site.post("/api/v1/questions", Some(&alpha.token), &asked)
        .await
        .json(201);
    announce(&site).await;

    let by_visitor = until_the_end(&site, "", None).await;
    let seen = kinds(&by_visitor);
    for kind in [
        "team_created",
        "day_started",
        "evaluation_finished",
        "day_released",
    ] {
        assert!(seen.contains(&kind), "{seen:?}");
    }
    for hidden in [
        "token_created",
        "submission_uploaded",
        "submission_valid",
        "shard_committed",
        "evaluation_queued",
        "evaluation_begun",
        "asked",
    ] {
        assert!(!seen.contains(&hidden), "{hidden} in {seen:?}");
    }
    let finished = by_visitor
        .iter()
        .find(|event| event.data["subject"] == format!("evaluation:{id}"))
        .unwrap();
    assert_eq!(finished.data["teams"], json!([alpha.id]));
    assert_eq!(finished.data["stage"], site.stage().await.to_string());
    assert_eq!(finished.data["day"], "2026-03-01");
    for event in &by_visitor {
        let data = event.data.as_object().unwrap();
        let known = [
            "id",
            "kind",
            "at",
            "subject",
            "teams",
            "stage",
            "day",
            "submission",
        ];
        for key in data.keys() {
            assert!(known.contains(&key.as_str()), "{event:?}");
        }
    }

    let by_alpha = until_the_end(&site, "", Some(&alpha.token)).await;
    let seen = kinds(&by_alpha);
    for kind in [
        "submission_valid",
        "shard_committed",
        "token_created",
        "asked",
    ] {
        assert!(seen.contains(&kind), "{kind} is not in {seen:?}");
    }
    let of_beta = format!("team:{}", beta.id);
    let others = by_alpha
        .iter()
        .filter(|event| event.data["teams"] == json!([beta.id]));
    let others: Vec<&str> = others
        .map(|event| event.data["kind"].as_str().unwrap())
        .collect();
    assert_eq!(others, ["team_created", "evaluation_finished"], "{of_beta}");
}

#[tokio::test]
async fn of_a_blind_stage_only_its_team_and_the_organiser_learn_what_became_of_an_evaluation() {
    let site = Site::start().await;
    let teams = two_teams(&site).await;
    change_stage(&site, json!({ "blind": true })).await;
    let evaluation = played_day(&site, &teams).await;
    let id = evaluation.rsplit('/').next().unwrap();
    announce(&site).await;

    let by_visitor = until_the_end(&site, "", None).await;
    let about_evaluations = |events: &[Event]| -> Vec<Value> {
        let subjects = events.iter().map(|event| &event.data["subject"]);
        let subjects = subjects.filter(|subject| text(subject).starts_with("evaluation:"));
        subjects.cloned().collect()
    };
    assert_eq!(about_evaluations(&by_visitor), [json!(null); 0]);
    assert!(
        !kinds(&by_visitor)
            .iter()
            .any(|kind| kind.starts_with("evaluation_"))
    );
    assert!(kinds(&by_visitor).contains(&"day_released"));
    let by_alpha = until_the_end(
        &site,
        "?about=evaluations,announcements",
        Some(&teams[0].token),
    )
    .await;
    assert!(kinds(&by_alpha).contains(&"evaluation_finished"));
    for subject in about_evaluations(&by_alpha) {
        assert_eq!(subject, format!("evaluation:{id}"));
    }
    let finished = until_the_end(
        &site,
        "?about=evaluation_finished,announcements",
        Some(ADMIN),
    )
    .await;
    assert_eq!(kinds(&finished), ["evaluation_finished"; 2]);
}

#[tokio::test]
async fn what_frozen_boards_leave_out_is_told_to_its_team_alone() {
    let site = Site::start().await;
    let teams = two_teams(&site).await;
    let freeze = format!("/api/v1/stages/{}/freeze", site.stage().await);
    let why = json!({ "reason": "the last week is a surprise" });
    site.post(&freeze, Some(ADMIN), &why).await.json(200);
    site.later(60);
    played_day(&site, &teams).await;
    announce(&site).await;
    let query = "?about=evaluation_finished,announcements";
    let [alpha, beta] = &teams;
    for (token, told) in [
        (None, 0),
        (Some(alpha.token.as_str()), 1),
        (Some(beta.token.as_str()), 1),
        (Some(ADMIN), 2),
    ] {
        let events = until_the_end(&site, query, token).await;
        assert_eq!(events.len(), told, "{events:?}");
    }
}

#[tokio::test]
async fn one_stream_tells_all_that_a_page_shows_and_nothing_else() {
    let site = Site::start().await;
    let teams = two_teams(&site).await;
    played_day(&site, &teams).await;
    announce(&site).await;
    let of_board = until_the_end(&site, "?about=board,announcements", None).await;
    assert_eq!(
        kinds(&of_board),
        [
            "stage_created",
            "evaluation_finished",
            "evaluation_finished",
            "day_released"
        ]
    );
    let query = format!("?about=team:{},announcements", teams[1].id);
    let of_beta = until_the_end(&site, &query, None).await;
    assert_eq!(kinds(&of_beta), ["team_created", "evaluation_finished"]);
    let stage = site.stage().await;
    let of_stage = until_the_end(&site, &format!("?about=stage:{stage},announced"), None).await;
    assert_eq!(
        kinds(&of_stage),
        [
            "stage_created",
            "day_started",
            "evaluation_finished",
            "evaluation_finished",
            "day_released"
        ]
    );
}

#[tokio::test]
async fn what_is_no_id_and_no_topic_is_said_in_words() {
    let site = Site::start().await;
    let path = format!("{PATH}?about=board,nothing");
    site.get(&path, None)
        .await
        .problem(422, "invalid-content", &["about", "queue", "nothing"]);
    for wrong in ["seventeen", "-1", "1.17", ""] {
        let request = site.request(Method::GET, PATH, None);
        let request = request.header("last-event-id", wrong);
        Answer::of(request.send().await.unwrap()).await.problem(
            400,
            "invalid-request",
            &["Last-Event-ID", wrong],
        );
    }
    // Of a folder that a backup has taken the place of.
    let mut stream = Stream::open(&site, PATH, None, Some("4711000")).await;
    let reset = stream.next().await.unwrap();
    assert_eq!(reset.name, "reset");
    let newest = site.store.newest_event().await.unwrap();
    assert_eq!(reset.data, json!({ "id": newest }));
    announce(&site).await;
    let next = stream.next().await.unwrap();
    assert_eq!(next.data["kind"], "announced");
}

#[tokio::test]
async fn so_many_follow_at_a_time_and_whoever_leaves_makes_room() {
    let limits = HttpLimits {
        event_readers: 1,
        ..patient()
    };
    let mut site = Site::start_with(limits).await;
    let mut stream = Stream::open(&site, PATH, None, None).await;
    assert_eq!(stream.next().await.unwrap().name, "now");
    let busy = site.get(PATH, None).await;
    busy.problem(503, "busy", &["1 readers"]);
    assert_eq!(busy.header("retry-after"), "2");
    site.end().await;
    assert_eq!(stream.next().await, None, "whole, and not cut off");
}

#[tokio::test]
async fn a_stream_ends_with_its_token() {
    let site = Site::start().await;
    let [alpha, beta] = two_teams(&site).await;
    let mut of_alpha = Stream::open(&site, PATH, Some(&alpha.token), None).await;
    let mut of_beta = Stream::open(&site, PATH, Some(&beta.token), None).await;
    assert_eq!(of_alpha.next().await.unwrap().name, "now");
    assert_eq!(of_beta.next().await.unwrap().name, "now");
    let replace = format!("/api/v1/teams/{}/token", alpha.id);
    site.post(&replace, Some(ADMIN), &json!({})).await.json(200);
    assert_eq!(of_alpha.next().await, None, "nothing more, and no error");
    announce(&site).await;
    assert_eq!(of_beta.next().await.unwrap().data["kind"], "announced");
}
