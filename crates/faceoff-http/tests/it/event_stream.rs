//! Tests of the event stream (changes of the season as server-sent events) over real connections: visibility of events,
//! topics and resumption.

use crate::{
    site::{ADMIN, Answer, Site, TestTeam, generous_limits, result, string},
    sse::{Event, Stream},
};
use faceoff_http::HttpLimits;
use reqwest::Method;
use serde_json::{Value, json};

const STREAM_PATH: &str = "/api/v1/events/stream";

/// All events from the beginning of the season until the announcement.
async fn events_until_announcement(site: &Site, query: &str, token: Option<&str>) -> Vec<Event> {
    let mut stream = Stream::open(site, &format!("{STREAM_PATH}{query}"), token, Some("0")).await;
    let mut events = Vec::new();
    loop {
        let event = stream.next().await.unwrap();
        assert_eq!(event.name, "change");
        assert_eq!(event.id, Some(event.data["id"].to_string()));
        if event.data["kind"] == "announced" {
            return events;
        }
        events.push(event);
    }
}

fn kinds(events: &[Event]) -> Vec<&str> {
    let kinds = events.iter().map(|event| event.data["kind"].as_str());
    kinds.map(Option::unwrap).collect()
}

/// Runs a day of two teams. Returns the path of the first team's evaluation.
async fn run_day(site: &Site, teams: &[TestTeam; 2]) -> String {
    let mut first_evaluation = None;
    for team in teams {
        site.valid_submission(team, "agent").await;
    }
    for team in teams {
        let submission = site.store.submissions_of(team.id.parse().unwrap());
        let submission = submission.await.unwrap()[0].id.to_string();
        let evaluation = site.start_evaluation(team, &submission).await;
        first_evaluation.get_or_insert(evaluation);
    }
    site.finish_evaluation(&result([0.5; 3], 10.0)).await;
    site.finish_evaluation(&result([0.7; 3], 20.0)).await;
    first_evaluation.unwrap()
}

async fn two_teams(site: &Site) -> [TestTeam; 2] {
    [site.team("Alpha").await, site.team("Beta").await]
}

#[tokio::test]
async fn resumed_stream_has_each_event_once_in_order() {
    let site = Site::start().await;
    let mut live = Stream::open(&site, STREAM_PATH, Some(ADMIN), None).await;
    let now = live.next().await.unwrap();
    assert_eq!(now.name, "now");
    assert_eq!(now.id, Some(now.data["id"].to_string()));
    let teams = two_teams(&site).await;
    run_day(&site, &teams).await;

    let log = site
        .get("/api/v1/events?limit=1000", Some(ADMIN))
        .await
        .json(200);
    let logged = log["events"].as_array().unwrap().iter().rev();
    let ids: Vec<i64> = logged.map(|event| event["id"].as_i64().unwrap()).collect();
    assert!(ids.len() > 20, "{ids:?}");
    // Each connection reads three events, and the next one resumes after them.
    let (mut received, mut last_id) = (Vec::new(), "0".to_owned());
    while received.len() < ids.len() {
        let mut stream = Stream::open(&site, STREAM_PATH, Some(ADMIN), Some(&last_id)).await;
        for _ in 0..3.min(ids.len() - received.len()) {
            let event = stream.next().await.unwrap();
            last_id = event.id.unwrap();
            received.push(last_id.parse::<i64>().unwrap());
        }
    }
    assert_eq!(received, ids);
    // The stream that stayed open has all events since it was opened.
    let ids_since_open = ids
        .iter()
        .filter(|id| **id > now.data["id"].as_i64().unwrap());
    for id in ids_since_open {
        assert_eq!(live.next().await.unwrap().id, Some(id.to_string()));
    }
    site.announce().await;
    let announced = live.next().await.unwrap().data;
    assert_eq!(announced["kind"], "announced");
    assert_eq!(announced["at"], site.now().to_string());
    assert!(string(&announced["subject"]).starts_with("announcement:"));
    assert!(announced.get("title").is_none(), "the event has no content");
}

#[tokio::test]
async fn stream_shows_visible_events_without_scores() {
    let site = Site::start().await;
    let teams = two_teams(&site).await;
    let [alpha, beta] = &teams;
    let evaluation = run_day(&site, &teams).await;
    let id = evaluation.rsplit('/').next().unwrap();
    let question = json!({ "text": "?" });
    site.post("/api/v1/questions", Some(&alpha.token), &question)
        .await
        .json(201);
    site.announce().await;

    let visitor_events = events_until_announcement(&site, "", None).await;
    let visitor_kinds = kinds(&visitor_events);
    for kind in [
        "team_created",
        "day_started",
        "evaluation_finished",
        "day_released",
    ] {
        assert!(visitor_kinds.contains(&kind), "{visitor_kinds:?}");
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
        assert!(
            !visitor_kinds.contains(&hidden),
            "{hidden} in {visitor_kinds:?}"
        );
    }
    let finished = visitor_events
        .iter()
        .find(|event| event.data["subject"] == format!("evaluation:{id}"))
        .unwrap();
    assert_eq!(finished.data["teams"], json!([alpha.id]));
    assert_eq!(finished.data["stage"], site.stage().await.to_string());
    assert_eq!(finished.data["day"], "2026-03-01");
    for event in &visitor_events {
        let data = event.data.as_object().unwrap();
        let allowed = [
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
            assert!(allowed.contains(&key.as_str()), "{event:?}");
        }
    }

    let alpha_events = events_until_announcement(&site, "", Some(&alpha.token)).await;
    let alpha_kinds = kinds(&alpha_events);
    for kind in [
        "submission_valid",
        "shard_committed",
        "token_created",
        "asked",
    ] {
        assert!(
            alpha_kinds.contains(&kind),
            "{kind} is not in {alpha_kinds:?}"
        );
    }
    // Alpha sees of Beta what is public.
    let beta_events = alpha_events
        .iter()
        .filter(|event| event.data["teams"] == json!([beta.id]));
    let beta_events: Vec<&str> = beta_events
        .map(|event| event.data["kind"].as_str().unwrap())
        .collect();
    assert_eq!(beta_events, ["team_created", "evaluation_finished"]);
}

#[tokio::test]
async fn stream_of_a_blind_stage_hides_evaluations_of_others() {
    let site = Site::start().await;
    let teams = two_teams(&site).await;
    site.change_first_stage(json!({ "blind": true }))
        .await
        .json(200);
    let evaluation = run_day(&site, &teams).await;
    let id = evaluation.rsplit('/').next().unwrap();
    site.announce().await;

    let visitor_events = events_until_announcement(&site, "", None).await;
    let evaluation_subjects = |events: &[Event]| -> Vec<Value> {
        let subjects = events.iter().map(|event| &event.data["subject"]);
        let subjects = subjects.filter(|subject| string(subject).starts_with("evaluation:"));
        subjects.cloned().collect()
    };
    assert_eq!(evaluation_subjects(&visitor_events), [json!(null); 0]);
    assert!(
        !kinds(&visitor_events)
            .iter()
            .any(|kind| kind.starts_with("evaluation_"))
    );
    assert!(kinds(&visitor_events).contains(&"day_released"));
    let alpha_events = events_until_announcement(
        &site,
        "?about=evaluations,announcements",
        Some(&teams[0].token),
    )
    .await;
    assert!(kinds(&alpha_events).contains(&"evaluation_finished"));
    for subject in evaluation_subjects(&alpha_events) {
        assert_eq!(subject, format!("evaluation:{id}"));
    }
    let finished = events_until_announcement(
        &site,
        "?about=evaluation_finished,announcements",
        Some(ADMIN),
    )
    .await;
    assert_eq!(kinds(&finished), ["evaluation_finished"; 2]);
}

#[tokio::test]
async fn stream_hides_evaluations_after_a_freeze_from_others() {
    let site = Site::start().await;
    let teams = two_teams(&site).await;
    let freeze = format!("/api/v1/stages/{}/freeze", site.stage().await);
    let reason = json!({ "reason": "the last week is a surprise" });
    site.post(&freeze, Some(ADMIN), &reason).await.json(200);
    site.advance(60);
    run_day(&site, &teams).await;
    site.announce().await;
    let query = "?about=evaluation_finished,announcements";
    let [alpha, beta] = &teams;
    for (token, count) in [
        (None, 0),
        (Some(alpha.token.as_str()), 1),
        (Some(beta.token.as_str()), 1),
        (Some(ADMIN), 2),
    ] {
        let events = events_until_announcement(&site, query, token).await;
        assert_eq!(events.len(), count, "{events:?}");
    }
}

#[tokio::test]
async fn stream_is_filtered_by_topics() {
    let site = Site::start().await;
    let teams = two_teams(&site).await;
    run_day(&site, &teams).await;
    site.announce().await;
    let board_events = events_until_announcement(&site, "?about=board,announcements", None).await;
    assert_eq!(
        kinds(&board_events),
        [
            "stage_created",
            "evaluation_finished",
            "evaluation_finished",
            "day_released"
        ]
    );
    let query = format!("?about=team:{},announcements", teams[1].id);
    let beta_events = events_until_announcement(&site, &query, None).await;
    assert_eq!(kinds(&beta_events), ["team_created", "evaluation_finished"]);
    let stage = site.stage().await;
    let stage_events =
        events_until_announcement(&site, &format!("?about=stage:{stage},announced"), None).await;
    assert_eq!(
        kinds(&stage_events),
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
async fn unknown_topic_or_event_id_is_refused() {
    let site = Site::start().await;
    let path = format!("{STREAM_PATH}?about=board,nothing");
    site.get(&path, None)
        .await
        .problem(422, "invalid-content", &["about", "queue", "nothing"]);
    for wrong in ["seventeen", "-1", "1.17", ""] {
        let request = site.request(Method::GET, STREAM_PATH, None);
        let request = request.header("last-event-id", wrong);
        Answer::read(request.send().await.unwrap()).await.problem(
            400,
            "invalid-request",
            &["Last-Event-ID", wrong],
        );
    }
    // An id that is too high comes from data that was replaced by a backup.
    let mut stream = Stream::open(&site, STREAM_PATH, None, Some("4711000")).await;
    let reset = stream.next().await.unwrap();
    assert_eq!(reset.name, "reset");
    let newest = site.store.newest_event().await.unwrap();
    assert_eq!(reset.data, json!({ "id": newest }));
    site.announce().await;
    let next = stream.next().await.unwrap();
    assert_eq!(next.data["kind"], "announced");
}

#[tokio::test]
async fn number_of_event_readers_is_limited() {
    let limits = HttpLimits {
        event_readers: 1,
        ..generous_limits()
    };
    let mut site = Site::start_with(limits).await;
    let mut stream = Stream::open(&site, STREAM_PATH, None, None).await;
    assert_eq!(stream.next().await.unwrap().name, "now");
    let busy = site.get(STREAM_PATH, None).await;
    busy.problem(503, "busy", &["1 of the 1 places"]);
    assert_eq!(busy.header("retry-after"), "2");
    site.shut_down().await;
    assert_eq!(
        stream.next().await,
        None,
        "the stream ends without an error"
    );
}

#[tokio::test]
async fn stream_ends_when_its_token_is_replaced() {
    let site = Site::start().await;
    let [alpha, beta] = two_teams(&site).await;
    let mut alpha_stream = Stream::open(&site, STREAM_PATH, Some(&alpha.token), None).await;
    let mut beta_stream = Stream::open(&site, STREAM_PATH, Some(&beta.token), None).await;
    assert_eq!(alpha_stream.next().await.unwrap().name, "now");
    assert_eq!(beta_stream.next().await.unwrap().name, "now");
    let replace = format!("/api/v1/teams/{}/token", alpha.id);
    site.post(&replace, Some(ADMIN), &json!({})).await.json(200);
    assert_eq!(
        alpha_stream.next().await,
        None,
        "the stream ends without an error"
    );
    site.announce().await;
    assert_eq!(beta_stream.next().await.unwrap().data["kind"], "announced");
}
