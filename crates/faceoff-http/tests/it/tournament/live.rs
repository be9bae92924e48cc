//! Tests of live streams of games over real connections. The test acts as the slot that runs the game: it reports goals and
//! positions.

use super::{cup::TestTournament, fake_worker::GameOutcome};
use crate::{
    site::{ADMIN, Answer, Site, string},
    sse::{Event, Stream},
};
use faceoff_http::HttpLimits;
use faceoff_types::{GameEvent, GameId, LiveEvent, LivePosition, Side};
use reqwest::Method;
use serde_json::{Value, json};

/// Control steps of a game: 15 minutes.
const GAME_STEPS: u32 = 45_000;

/// Opens the stream of a game; `last_event_id` is the last event that the client received before it reconnects.
async fn open(cup: &TestTournament, game: GameId, last_event_id: Option<&str>) -> Stream {
    let path = format!("/api/v1/games/{game}/live");
    Stream::open(&cup.site, &path, None, last_event_id).await
}

/// The next event other than a position.
async fn next_event(stream: &mut Stream) -> Option<Event> {
    loop {
        let event = stream.next().await?;
        if event.name != "position" {
            return Some(event);
        }
    }
}

fn goal_event(step: u32, score: [u32; 2]) -> LiveEvent {
    LiveEvent {
        step,
        event: GameEvent::Goal {
            by: Side::First,
            score,
        },
    }
}

fn end_event(step: u32, score: [u32; 2]) -> LiveEvent {
    LiveEvent {
        step,
        event: GameEvent::Ended {
            score,
            winner: Some(Side::First),
            forfeits: [None, None],
        },
    }
}

fn position(step: u32) -> LivePosition {
    LivePosition {
        step,
        puck: [0.1, 0.2, 0.3],
        mallets: [[-0.8, 0.0], [0.8, 0.0]],
    }
}

/// A game that a slot has claimed, with its claim and seed.
async fn running_game() -> (
    TestTournament,
    faceoff_store::JobClaim,
    faceoff_store::Game,
    faceoff_types::Seed,
) {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    cup.start_round().await;
    let (claim, game, seed) = cup.claim().await.unwrap();
    (cup, claim, game, seed)
}

#[tokio::test]
async fn live_stream_is_resumed_without_a_gap() {
    let (cup, claim, game, seed) = running_game().await;
    let live = &cup.site.live.games;
    live.begin(game.id, 1, GAME_STEPS);
    let mut stream = open(&cup, game.id, None).await;
    let first = stream.next().await.unwrap();
    assert_eq!(
        (first.name.as_str(), &first.data["attempt"]),
        ("snapshot", &json!(1))
    );
    live.advance(
        game.id,
        1,
        vec![goal_event(300, [1, 0])],
        Some(position(301)),
    );
    let event = stream.next().await.unwrap();
    assert_eq!(
        (
            event.name.as_str(),
            event.id.as_deref(),
            &event.data["kind"]
        ),
        ("happening", Some("1.1"), &json!("goal"))
    );
    assert_eq!(stream.next().await.unwrap().name, "position");
    drop(stream);

    // Meanwhile there are two more goals and many positions, of which only the newest is sent.
    live.advance(game.id, 1, vec![goal_event(600, [2, 0])], None);
    live.advance(game.id, 1, vec![goal_event(900, [3, 0])], None);
    for step in 901..1000 {
        live.advance(game.id, 1, Vec::new(), Some(position(step)));
    }
    let mut resumed = open(&cup, game.id, event.id.as_deref()).await;
    let snapshot = resumed.next().await.unwrap();
    assert_eq!(
        (
            snapshot.name.as_str(),
            &snapshot.data["score"],
            &snapshot.data["position"]["step"]
        ),
        ("snapshot", &json!([3, 0]), &json!(999))
    );
    let ids = [
        resumed.next().await.unwrap().id,
        resumed.next().await.unwrap().id,
    ];
    assert_eq!(ids, [Some("1.2".to_owned()), Some("1.3".to_owned())]);
    live.advance(game.id, 1, vec![end_event(GAME_STEPS, [3, 0])], None);
    let end = next_event(&mut resumed).await.unwrap();
    assert_eq!(
        (end.id.as_deref(), &end.data["kind"]),
        (Some("1.4"), &json!("ended"))
    );
    let over = next_event(&mut resumed).await.unwrap();
    assert_eq!(
        (over.name.as_str(), &over.data),
        ("over", &json!({ "game": game.id, "state": "played" }))
    );
    assert_eq!(resumed.next().await, None, "the stream ends with the game");

    // A stream that is opened after the end has all events at once, and ends.
    cup.commit(&claim, &game, seed, GameOutcome::goals(3, 0))
        .await;
    let mut late_stream = open(&cup, game.id, None).await;
    let mut names = Vec::new();
    while let Some(event) = late_stream.next().await {
        names.push(event.name);
    }
    assert_eq!(
        names,
        [
            "snapshot",
            "happening",
            "happening",
            "happening",
            "happening",
            "over"
        ]
    );
}

#[tokio::test]
async fn live_stream_waits_for_the_start_and_restarts_on_retry() {
    let (cup, claim, game, _) = running_game().await;
    let live = &cup.site.live.games;
    let mut stream = open(&cup, game.id, None).await;
    assert_eq!(stream.next().await.unwrap().name, "waiting");
    live.begin(game.id, 1, GAME_STEPS);
    assert_eq!(stream.next().await.unwrap().name, "snapshot");
    live.advance(game.id, 1, vec![goal_event(5, [1, 0])], None);
    assert_eq!(stream.next().await.unwrap().id.as_deref(), Some("1.1"));
    // The slot shuts down, so this attempt ends without a result.
    cup.site
        .store
        .release(&claim, cup.site.now())
        .await
        .unwrap();
    live.end_attempt(game.id, 1);
    let aborted = stream.next().await.unwrap();
    assert_eq!(aborted.data["kind"], "broken_off");
    assert_eq!(stream.next().await.unwrap().name, "waiting");
    let (_, retried, _) = cup.claim().await.unwrap();
    assert_eq!(retried.id, game.id);
    live.begin(game.id, 2, GAME_STEPS);
    let restarted = stream.next().await.unwrap();
    assert_eq!(
        (restarted.name.as_str(), &restarted.data["attempt"]),
        ("snapshot", &json!(2))
    );
    live.advance(game.id, 2, vec![goal_event(7, [1, 0])], None);
    assert_eq!(stream.next().await.unwrap().id.as_deref(), Some("2.1"));
    // An event id of the previous attempt is ignored: all events of this attempt are sent.
    let mut resumed = open(&cup, game.id, Some("1.2")).await;
    assert_eq!(resumed.next().await.unwrap().name, "snapshot");
    assert_eq!(resumed.next().await.unwrap().id.as_deref(), Some("2.1"));
}

#[tokio::test]
async fn live_stream_of_a_finished_game_has_its_result() {
    let (cup, claim, game, seed) = running_game().await;
    cup.commit(&claim, &game, seed, GameOutcome::goals(4, 1))
        .await;
    let mut stream = open(&cup, game.id, None).await;
    let snapshot = stream.next().await.unwrap();
    assert_eq!(
        (&snapshot.data["score"], &snapshot.data["is_over"]),
        (&json!([4, 1]), &json!(true))
    );
    assert_eq!(stream.next().await.unwrap().data["state"], "played");
    assert_eq!(stream.next().await, None);
    let wrong = cup
        .site
        .request(
            Method::GET,
            &format!("/api/v1/games/{}/live", game.id),
            None,
        )
        .header("last-event-id", "seventeen");
    Answer::read(wrong.send().await.unwrap()).await.problem(
        400,
        "invalid-request",
        &["Last-Event-ID", "seventeen"],
    );
}

#[tokio::test]
async fn live_stream_of_a_private_game_ends_with_its_token() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    let team_token = cup.token("A");
    let path = format!("{}/friendly-games", cup.path);
    let game = cup
        .site
        .post(&path, Some(team_token), &json!({ "opponent": "B" }))
        .await
        .json(201);
    let path = format!("/api/v1/games/{}/live", string(&game["id"]));
    let mut stream = Stream::open(&cup.site, &path, Some(team_token), None).await;
    assert_eq!(stream.next().await.unwrap().name, "waiting");
    let caller = cup.site.get("/api/v1/whoami", Some(team_token)).await;
    let path = format!(
        "/api/v1/tokens/{}",
        string(&caller.json(200)["token"]["id"])
    );
    let revoked = cup
        .site
        .send(Method::DELETE, &path, Some(ADMIN), &Value::Null);
    revoked.await.json(200);
    assert_eq!(stream.next().await, None);
}

#[tokio::test]
async fn number_of_live_readers_is_limited() {
    let limits = HttpLimits {
        live_readers: 1,
        ..crate::site::generous_limits()
    };
    let cup = TestTournament::open_on(Site::start_with(limits).await, &["A", "B"], json!({})).await;
    cup.start_round().await;
    let game: GameId = crate::site::string(&cup.games().await[0]["id"])
        .parse()
        .unwrap();
    let mut stream = open(&cup, game, None).await;
    assert_eq!(stream.next().await.unwrap().name, "waiting");
    let path = format!("/api/v1/games/{game}/live");
    let busy = cup.site.get(&path, None).await;
    busy.problem(503, "busy", &["1 of the 1 places"]);
    assert_eq!(busy.header("retry-after"), "2");
    // The stream of a cancelled game ends.
    let departure = json!({ "team": "A", "as": "disqualified", "reason": "x", "confirm": "A" });
    cup.post("departures", departure).await.json(200);
    assert_eq!(stream.next().await.unwrap().data["state"], "cancelled");
    assert_eq!(stream.next().await, None);
}

#[tokio::test]
async fn shutdown_does_not_wait_for_the_end_of_games() {
    let (mut cup, _, game, _) = running_game().await;
    cup.site.live.games.begin(game.id, 1, GAME_STEPS);
    let mut stream = open(&cup, game.id, None).await;
    assert_eq!(stream.next().await.unwrap().name, "snapshot");
    cup.site.shut_down().await;
    assert_eq!(
        stream.next().await,
        None,
        "the stream ends without an error"
    );
}
