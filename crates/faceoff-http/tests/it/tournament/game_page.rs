//! A game's page, and the clips that its replay is drawn from.

use super::cup::{Cup, first_by_name_wins};
use crate::{
    html::{rows, texts},
    site::text,
};
use faceoff_episode::{Answered, Arena, Entry, GameCourse, Response};
use faceoff_replay::{CHUNK_STEPS, Clip, GameClipRecorder};
use faceoff_store::Game;
use faceoff_types::{GameLimits, Interpolation, Profile, Seed, Side};
use scraper::{Html, Selector};
use serde_json::json;

const STEPS: u32 = 600;

/// The pack of a short game in which both arms hold.
fn pack() -> Vec<u8> {
    let seed = Seed::from_number(5);
    let arena = Arena::new(Profile::Ideal, seed, seed.model_mismatch());
    let clips = GameClipRecorder::new(Vec::new()).unwrap();
    let mut course = GameCourse::begin(&arena, STEPS, GameLimits::default(), clips);
    while course.end().is_none() {
        let entries = Side::BOTH.map(|side| Entry::Plays {
            startup_s: course.needs_start(side).then_some(0.1),
            interpolation: Interpolation::Linear,
            reset_s: 0.1,
        });
        course.start_rally(entries).unwrap();
        while course.is_in_rally() {
            let held = Side::BOTH.map(|side| {
                let question = course.question(side).unwrap().unwrap();
                question.observation[6..13].to_vec()
            });
            let answered = Answered {
                computation_time_s: 0.001,
                host_time_s: 0.0,
                cpu_time_s: None,
            };
            let responses = held
                .each_ref()
                .map(|action| Response::Answer { action, answered });
            course.answer(responses).unwrap();
        }
    }
    course.finish().sink.finish().unwrap()
}

async fn played(publishes: &str) -> (Cup, Game) {
    let rules = json!({ "format": { "kind": "round_robin", "rounds": 1 } });
    let settings = json!({ "publishes": publishes });
    let cup = Cup::open(
        &["A", "B", "C"],
        json!({ "rules": rules, "settings": settings }),
    )
    .await;
    cup.start_round().await;
    let game = cup.play_next(first_by_name_wins).await.unwrap();
    (cup, game)
}

/// Where the files of a game are.
async fn add_clips(cup: &Cup, game: &Game) {
    let row = cup.site.store.game(game.id).await.unwrap();
    let faceoff_store::GameState::Played(played) = row.state else {
        panic!("{row:?}");
    };
    let key = format!("{}/clips", played.recording.unwrap().key);
    let file = cup.site.folder.path().join("clips");
    std::fs::write(&file, pack()).unwrap();
    let artifacts = cup.site.store.artifacts();
    artifacts.put_file(&key, &file).await.unwrap();
}

async fn page(cup: &Cup, game: &Game) -> Html {
    let answer = cup.site.get(&format!("/games/{}", game.id), None).await;
    assert_eq!(answer.status, 200, "{}", answer.body);
    let html = Html::parse_document(&answer.body);
    assert!(html.errors.is_empty(), "{:?}\n{}", html.errors, answer.body);
    html
}

#[tokio::test]
async fn a_games_page_says_what_it_came_to_and_why() {
    let (cup, game) = played("at_release").await;
    let path = format!("/api/v1/games/{}", game.id);
    let view = cup.site.get(&path, None).await.json(200);
    let html = page(&cup, &game).await;
    let verdict = texts(&html, ".verdict").remove(0);
    let [home, away] = [0, 1].map(|side| view["result"]["score"][side].to_string());
    assert!(
        verdict.starts_with(&format!("{home} : {away}")),
        "{verdict}"
    );
    assert!(
        verdict.contains(&text(&view["result"]["because"])),
        "{verdict}"
    );
    let winner = text(&view["result"]["winner"]);
    assert!(verdict.contains(&format!("{winner} wins")), "{verdict}");
    let rows = texts(&html, "tbody tr");
    assert!(
        rows.iter().any(|row| row.starts_with("Penalty points")),
        "{rows:?}"
    );
    assert!(html.html().contains("No replay of this game is kept"));

    let waiting = cup.games().await;
    let waiting = waiting
        .iter()
        .find(|game| game["state"] == "queued")
        .unwrap();
    let path = format!("/games/{}", text(&waiting["id"]));
    let html = cup.site.get(&path, None).await;
    assert!(html.body.contains("It waits for a slot."), "{}", html.body);
    assert_eq!(cup.site.get("/games/nothing", None).await.status, 404);
}

#[tokio::test]
async fn a_games_motion_is_everybodys_and_a_sides_observations_its_own() {
    let (cup, game) = played("never").await;
    let [home, away] = cup.names(&game).await;
    let path = format!("/api/v1/games/{}", game.id);
    let before = cup.site.get(&format!("{path}/motion/0"), None).await;
    before.problem(409, "conflict", &["no replay of this game"]);
    add_clips(&cup, &game).await;

    let html = page(&cup, &game).await;
    let replay = Selector::parse("#replay").unwrap();
    let replay = html.select(&replay).next().unwrap();
    let motion = replay.attr("data-chunks").unwrap();
    assert_eq!(replay.attr("data-observed-chunks"), None, "to a visitor");
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
        assert_eq!(clip.mallet_places(1).len(), clip.header.samples as usize);
    }
    let behind = motion.replace("{chunk}", "2");
    let behind = cup.site.get(&behind, None).await;
    behind.problem(404, "not-found", &["no such part"]);

    let observed = |side| format!("{path}/sides/{side}/observed/0");
    for (side, team, other) in [(1, &home, &away), (2, &away, &home)] {
        let own = cup.site.get(&observed(side), Some(cup.token(team))).await;
        assert_eq!(own.status, 200, "{}", own.body);
        let others = cup.site.get(&observed(side), Some(cup.token(other))).await;
        others.problem(403, "forbidden", &["its team's"]);
        let nobodys = cup.site.get(&observed(side), None).await;
        nobodys.problem(401, "unauthenticated", &["its team's"]);
    }
}

#[tokio::test]
async fn a_games_page_tells_of_the_play_what_its_clips_say() {
    let (cup, game) = played("never").await;
    add_clips(&cup, &game).await;
    let html = page(&cup, &game).await;
    // Both arms hold: the puck lies where it was served, for all of the game.
    let found = rows(&html, "[aria-labelledby=possession] tbody tr");
    assert!(
        found[0] == "Puck on the own half 100.0 0.0"
            || found[0] == "Puck on the own half 0.0 100.0",
        "{found:?}"
    );
    assert_eq!(found[1], "Touched it last 0.0 0.0");
    let caption = texts(&html, "[aria-labelledby=possession] caption").remove(0);
    assert!(caption.contains("In 100.0 % of it neither"), "{caption}");
    let shots = texts(&html, "[aria-labelledby=shots] figcaption");
    assert!(
        shots
            .iter()
            .all(|told| told.ends_with(": 0 shots, 0 goals")),
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
    assert_eq!(samples(&hidden), "45001", "as long as the rules have it");
    assert!(texts(&hidden, "[aria-labelledby=possession]").is_empty());
}
