//! Tests of a game's page, and of the game's clips, which are the data of its replay in parts of 500 control steps.

use super::{
    cup::{TestTournament, first_by_name_wins},
    fake_worker::GameOutcome,
};
use crate::{
    cards::Picture,
    html::{rows, texts},
    site::{ADMIN, string},
};
use faceoff_airhockey::Interpolation;
use faceoff_airhockey::{RallyReadiness, Response, RunningGame, SimulationSetup};
use faceoff_episode::AnswerTiming;
use faceoff_replay::{CHUNK_STEPS, Clip, GameClipRecorder};
use faceoff_store::Game;
use faceoff_types::{GameLimits, Seed, Side};
use scraper::{Html, Selector};

/// Control steps of the recorded game.
const STEPS: u32 = 600;

/// The clip file of a short game in which both arms do not move.
fn record_game_clips() -> Vec<u8> {
    let seed = Seed::from_number(5);
    let setup = SimulationSetup::new(
        faceoff_airhockey::IDEAL.try_into().unwrap(),
        seed,
        seed.model_mismatch(),
    );
    let clips = GameClipRecorder::new(Vec::new()).unwrap();
    let mut running = RunningGame::begin(&setup, STEPS, GameLimits::default(), clips);
    while running.end().is_none() {
        let readiness = Side::BOTH.map(|side| RallyReadiness::Ready {
            startup_s: running.needs_start(side).then_some(0.1),
            interpolation: Interpolation::Linear,
            reset_s: 0.1,
        });
        running.start_rally(readiness).unwrap();
        while running.is_in_rally() {
            let actions = Side::BOTH.map(|side| {
                let request = running.action_request(side).unwrap().unwrap();
                // Entries 6 to 12 of an observation are the joint positions.
                request.observation[6..13].to_vec()
            });
            let timing = AnswerTiming {
                computation_time_s: 0.001,
                host_time_s: 0.0,
                cpu_time_s: None,
            };
            let responses = actions
                .each_ref()
                .map(|action| Response::Answer { action, timing });
            running.answer(responses).unwrap();
        }
    }
    running.finish().sink.finish().unwrap()
}

/// A tournament in which one game is played and others are queued. `publishes` says when recordings become public.
async fn play_one_game(publishes: &str) -> (TestTournament, Game) {
    let cup = TestTournament::start_round_robin(publishes).await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    (cup, game)
}

/// Stores a clip file beside the recording of a game.
async fn add_clips(cup: &TestTournament, game: &Game) {
    let stored = cup.site.store.game(game.id).await.unwrap();
    let faceoff_store::GameState::Played(result) = stored.state else {
        panic!("{stored:?}");
    };
    let key = format!("{}/clips", result.recording.unwrap().key);
    let file = cup.site.folder.path().join("clips");
    std::fs::write(&file, record_game_clips()).unwrap();
    let artifacts = cup.site.store.artifacts();
    artifacts.put_file(&key, &file).await.unwrap();
}

/// The page of a game, as visitors see it.
async fn page(cup: &TestTournament, game: &Game) -> Html {
    let path = format!("/games/{}", game.id);
    cup.site.get(&path, None).await.html(200)
}

#[tokio::test]
async fn game_page_shows_result_and_reason() {
    let (cup, game) = play_one_game("at_release").await;
    let path = format!("/api/v1/games/{}", game.id);
    let view = cup.site.get(&path, None).await.json(200);
    let html = page(&cup, &game).await;
    let verdict = texts(&html, ".verdict").remove(0);
    let names = cup.names(&game).await;
    let [home, away] = [0, 1].map(|side| view["result"]["score"][side].to_string());
    assert!(
        verdict.starts_with(&format!("{} {home} : {away} {}", names[0], names[1])),
        "{verdict}"
    );
    assert!(
        verdict.contains(&string(&view["result"]["because"])),
        "{verdict}"
    );
    let winner = string(&view["result"]["winner"]);
    assert!(verdict.contains(&format!("{winner} wins")), "{verdict}");
    let rows = texts(&html, "tbody tr");
    assert!(
        rows.iter().any(|row| row.starts_with("Penalty points")),
        "{rows:?}"
    );
    assert!(
        html.html()
            .contains("The replay of this game is no longer stored")
    );

    let games = cup.games().await;
    let queued = games.iter().find(|game| game["state"] == "queued").unwrap();
    let path = format!("/games/{}", string(&queued["id"]));
    let html = cup.site.get(&path, None).await;
    assert!(
        html.body.contains("Waiting for a free slot."),
        "{}",
        html.body
    );
    assert_eq!(cup.site.get("/games/nothing", None).await.status, 404);
}

#[tokio::test]
async fn game_motion_is_public_and_observations_are_not() {
    let (cup, game) = play_one_game("never").await;
    let [home, away] = cup.names(&game).await;
    let path = format!("/api/v1/games/{}", game.id);
    let before = cup.site.get(&format!("{path}/motion/0"), None).await;
    before.problem(409, "conflict", &["no replay of this game"]);
    add_clips(&cup, &game).await;

    let html = page(&cup, &game).await;
    let replay = Selector::parse("#replay").unwrap();
    let replay = html.select(&replay).next().unwrap();
    let motion = replay.attr("data-chunks").unwrap();
    assert_eq!(
        replay.attr("data-observed-chunks"),
        None,
        "visitors see no observations"
    );
    for chunk in 0..STEPS.div_ceil(CHUNK_STEPS) {
        let part = motion.replace("{chunk}", &chunk.to_string());
        let request = cup.site.request(reqwest::Method::GET, &part, None);
        let answer = request
            .header("accept-encoding", "gzip")
            .send()
            .await
            .unwrap();
        assert_eq!(answer.status(), 200);
        let clip = Clip::read(&answer.bytes().await.unwrap()).unwrap();
        assert_eq!(clip.header.first, chunk * CHUNK_STEPS);
        assert_eq!(clip.mallet_positions(1).len(), clip.header.samples as usize);
    }
    let beyond_end = motion.replace("{chunk}", "2");
    let beyond_end = cup.site.get(&beyond_end, None).await;
    beyond_end.problem(404, "not-found", &["no such part"]);

    let observed = |side| format!("{path}/sides/{side}/observed/0");
    for (side, team, opponent) in [(1, &home, &away), (2, &away, &home)] {
        let response = cup.site.get(&observed(side), Some(cup.token(team))).await;
        assert_eq!(response.status, 200, "{}", response.body);
        let refused = cup
            .site
            .get(&observed(side), Some(cup.token(opponent)))
            .await;
        refused.problem(403, "forbidden", &["the side's team"]);
        let unauthenticated = cup.site.get(&observed(side), None).await;
        unauthenticated.problem(401, "unauthenticated", &["the side's team"]);
    }
}

#[tokio::test]
async fn game_page_shows_statistics_of_its_clips() {
    let (cup, game) = play_one_game("never").await;
    add_clips(&cup, &game).await;
    let html = page(&cup, &game).await;
    // The arms do not move, so the puck stays where it was served.
    let found = rows(&html, "[aria-labelledby=possession] tbody tr");
    assert!(
        found[0] == "Puck on own half 100.0 0.0" || found[0] == "Puck on own half 0.0 100.0",
        "{found:?}"
    );
    assert_eq!(found[1], "Last to touch the puck 0.0 0.0");
    let caption = texts(&html, "[aria-labelledby=possession] caption").remove(0);
    assert!(caption.contains("For 100.0 % of it neither"), "{caption}");
    let shots = texts(&html, "[aria-labelledby=shots] figcaption");
    assert!(
        shots
            .iter()
            .all(|caption| caption.ends_with(": 0 shots, 0 goals")),
        "{shots:?}"
    );
    let safety = texts(&html, "[aria-labelledby=safety] figcaption");
    assert_eq!(safety.len(), 2);

    let hidden = cup
        .site
        .request(reqwest::Method::GET, &format!("/games/{}", game.id), None);
    let hidden = hidden
        .header("cookie", "spoilers=hidden")
        .send()
        .await
        .unwrap();
    let hidden = Html::parse_document(&hidden.text().await.unwrap());
    let replay = Selector::parse("#replay").unwrap();
    let samples = |html: &Html| {
        let replay = html.select(&replay).next().unwrap();
        replay.attr("data-samples").unwrap().to_owned()
    };
    assert_eq!(
        samples(&hidden),
        "45001",
        "the length by the rules, not that of the game"
    );
    assert!(texts(&hidden, "[aria-labelledby=possession]").is_empty());
}

/// The picture of a game for link previews.
async fn card(cup: &TestTournament, game: &str, cookie: Option<&str>) -> Picture {
    let path = format!("/games/{game}/card.png");
    let mut request = cup.site.request(reqwest::Method::GET, &path, None);
    if let Some(cookie) = cookie {
        request = request.header("cookie", cookie);
    }
    Picture::read(request.send().await.unwrap()).await
}

#[tokio::test]
async fn game_card_shows_no_result_that_is_hidden() {
    let cup = TestTournament::start_round_robin("at_release").await;
    let id = string(&cup.games().await[0]["id"]);
    let before = card(&cup, &id, None).await;
    // Games of the length of the replay that is added to them.
    let short_outcome = |game: &Game, names: [&str; 2]| GameOutcome {
        windows: STEPS / CHUNK_STEPS,
        penalty_points: [0.0; 2],
        ..first_by_name_wins(game, names)
    };
    while let Some(game) = cup.play_next(short_outcome).await {
        let played_id = game.id.to_string();
        let without_replay = card(&cup, &played_id, None).await;
        add_clips(&cup, &game).await;
        let with_replay = card(&cup, &played_id, None).await;
        assert!(with_replay.png != without_replay.png, "paths of the puck");
    }
    let shown = card(&cup, &id, None).await;
    assert!(shown.png != before.png, "the result is public");
    let hidden = card(&cup, &id, Some("spoilers=hidden")).await;
    assert!(hidden.png == before.png, "as before the game");
    for picture in [&shown, &hidden] {
        assert_eq!(picture.headers["vary"], "cookie");
    }
    assert_ne!(shown.headers["etag"], hidden.headers["etag"]);
    let path = format!("/games/{id}/card.png?show=result");
    let request = cup.site.request(reqwest::Method::GET, &path, None);
    let request = request.header("cookie", "spoilers=hidden");
    let revealed = Picture::read(request.send().await.unwrap()).await;
    assert!(revealed.png == shown.png);
    // Pictures of other games differ, since their teams do.
    let other = string(&cup.games().await[1]["id"]);
    assert!(card(&cup, &other, None).await.png != shown.png);
}

#[tokio::test]
async fn card_of_a_test_game_is_hidden_from_everyone() {
    let cup = TestTournament::open(&["A", "B"], serde_json::json!({})).await;
    let baseline = cup.site.team("Organisers").await;
    let baseline = cup.site.valid_submission(&baseline, "baseline").await;
    let body = serde_json::json!({ "baseline": baseline.rsplit('/').next().unwrap() });
    cup.site
        .patch(&cup.path, Some(ADMIN), &body)
        .await
        .json(200);
    let path = format!("{}/test-games", cup.path);
    let team = cup.token("A").to_owned();
    let body = serde_json::json!({});
    let created = cup.site.post(&path, Some(&team), &body).await.json(201);
    let page = format!("/games/{}", string(&created["queued"][0]["id"]));
    for token in [None, Some(team.as_str()), Some(ADMIN)] {
        let card = cup.site.get(&format!("{page}/card.png"), token).await;
        assert_eq!(card.status, 404, "a picture is the same for everyone");
    }
    assert_eq!(cup.site.get(&page, Some(&team)).await.status, 200);
}
