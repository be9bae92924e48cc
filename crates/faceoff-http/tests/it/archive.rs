//! The season as one file, and a server that shows what came out of it.

use crate::site::{ADMIN, Answer, GZIP, Site, TestTeam, outcome, text};
use faceoff_archive::{Entry, Manifest, unpack};
use faceoff_store::{Edition, Store};
use faceoff_types::{EpisodeOutcome, EvaluationId, Task};
use reqwest::Method;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A season with something of everything that has something to hide.
struct Season {
    site: Site,
    alpha: TestTeam,
    evaluations: [EvaluationId; 2],
    /// What nobody must find in a public archive, and what it is.
    secrets: Vec<(&'static str, Vec<u8>)>,
}

fn well(task: Task, episode: u32) -> EpisodeOutcome {
    outcome(task, episode, false)
}

fn worse(task: Task, episode: u32) -> EpisodeOutcome {
    EpisodeOutcome {
        success: episode.is_multiple_of(3),
        ..outcome(task, episode, false)
    }
}

async fn confirmed(site: &Site, path: &str, body: Value) -> Value {
    let answer = site.post(path, Some(ADMIN), &body).await;
    assert!(answer.status.is_success(), "{path}: {answer:?}");
    serde_json::from_str(&answer.body).unwrap_or_default()
}

impl Season {
    async fn played() -> Self {
        let site = Site::start().await;
        let evaluations = site
            .played_day(30, [("Alpha", &well), ("Beta", &worse)])
            .await;
        let listed = site.get("/api/v1/teams", Some(ADMIN)).await.json(200);
        let alpha = listed
            .as_array()
            .unwrap()
            .iter()
            .find(|team| team["name"] == "Alpha");
        let id = text(&alpha.unwrap()["id"]);
        site.team("Never here").await;
        let replaced = confirmed(&site, &format!("/api/v1/teams/{id}/token"), json!({})).await;
        let alpha = TestTeam {
            id: id.clone(),
            token: text(&replaced["token"]),
        };
        let joined = {
            let made = confirmed(
                &site,
                "/api/v1/invitations",
                json!({ "role": "member", "team": id, "note": "for Ada Lovelace" }),
            )
            .await;
            let join = json!({ "code": made["code"], "name": "Ada Lovelace", "password": "correct horse battery" });
            let joined = site.post("/api/v1/invitations/accept", None, &join).await;
            joined.json(201)
        };
        confirmed(
            &site,
            "/api/v1/invitations",
            json!({ "role": "organiser", "note": "an open one" }),
        )
        .await;
        let opened = site
            .request(Method::PATCH, "/api/v1/season", Some(ADMIN))
            .json(&json!({ "takes_registrations": true }));
        assert!(opened.send().await.unwrap().status().is_success());
        let register = json!({ "team": { "name": "Gamma" }, "contact": "gamma@example.org" });
        assert_eq!(
            site.post("/api/v1/registrations", None, &register)
                .await
                .status,
            201
        );
        for (words, public) in [("a private question", false), ("a public question", true)] {
            let asked = site
                .post(
                    "/api/v1/questions",
                    Some(&alpha.token),
                    &json!({ "text": words }),
                )
                .await;
            let path = format!("/api/v1/questions/{}/answer", text(&asked.json(201)["id"]));
            let answer = json!({ "text": "an answer", "public": public });
            let request = site.request(Method::PUT, &path, Some(ADMIN)).json(&answer);
            assert!(request.send().await.unwrap().status().is_success());
        }
        let person = text(&joined["person"]["id"]);
        let mut season = Self {
            site,
            alpha,
            evaluations,
            secrets: vec![
                ("a password", b"$argon2id$".to_vec()),
                ("a name", b"Ada Lovelace".to_vec()),
                ("who did something", person.into_bytes()),
                ("an open invitation", b"an open one".to_vec()),
                ("a contact", b"gamma@example.org".to_vec()),
                ("a private question", b"a private question".to_vec()),
                ("an agent's log", b"log of ".to_vec()),
                (
                    "what an agent wrote",
                    b"{\\\"type\\\":\\\"act\\\"}".to_vec(),
                ),
                ("a bundle's name", b"striker.tar.gz".to_vec()),
                (
                    "a bundle's hash",
                    blake3::hash(&GZIP).to_string().into_bytes(),
                ),
                ("a worker's name", b"slot 0".to_vec()),
                ("a team that never played", b"Never here".to_vec()),
            ],
        };
        let secret = season.site.store.season().await.unwrap().secret;
        season
            .secrets
            .push(("the secret", secret.as_bytes().to_vec()));
        for token in [&season.alpha.token, &text(&joined["secret"])] {
            let hash = faceoff_api::token::hash_token(token);
            season.secrets.push(("a token's hash", hash.to_vec()));
        }
        season
    }

    /// Two more days, by other rules: on one an agent fails and another one does once what is forgiven; of the other
    /// one evaluation is under way, which this returns.
    async fn with_a_day_under_way(&mut self) -> EvaluationId {
        let site = &self.site;
        let path = format!("/api/v1/stages/{}", site.stage().await);
        let forgiving = json!({ "max_faults": 5, "confirm": "Qualifying" });
        let changed = site
            .request(Method::PATCH, &path, Some(ADMIN))
            .json(&forgiving);
        assert_eq!(changed.send().await.unwrap().status(), 200);
        site.next_day();
        confirmed(site, "/api/v1/days", json!({})).await;
        site.play_shards(10).await;
        site.finish_as(|task, episode| outcome(task, episode, task == Task::Hit && episode == 0))
            .await;
        site.next_day();
        confirmed(site, "/api/v1/days", json!({})).await;
        site.play_shards(10).await;
        let today = site.get("/api/v1/evaluations", Some(ADMIN)).await.json(200);
        let open = today
            .as_array()
            .unwrap()
            .iter()
            .find(|one| one["state"] == "queued");
        text(&open.unwrap()["id"]).parse().unwrap()
    }
}

async fn ask(site: &Site, edition: &str) -> reqwest::Response {
    let path = format!("/api/v1/season/archive?edition={edition}");
    let asked = site
        .request(Method::GET, &path, Some(ADMIN))
        .send()
        .await
        .unwrap();
    assert_eq!(asked.status(), 200, "{asked:?}");
    asked
}

/// Downloads and unpacks an archive; the manifest of what lies in the folder.
pub async fn exported(site: &Site, edition: &str) -> (TempDir, Manifest) {
    let bytes = ask(site, edition).await.bytes().await.unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("season.tar.zst");
    std::fs::write(&file, bytes).unwrap();
    let into = folder.path().join("archive");
    std::fs::create_dir(&into).unwrap();
    let manifest = unpack(&file, &into).unwrap();
    (folder, manifest)
}

/// Imports what was unpacked, and serves it.
pub async fn imported((folder, _): (TempDir, Manifest)) -> Site {
    let rest = folder.path().join("archive");
    let target = folder.path().join("faceoff.sqlite3");
    std::fs::rename(rest.join("database.sqlite3"), target).unwrap();
    if rest.join("artifacts").exists() {
        std::fs::rename(rest.join("artifacts"), folder.path().join("artifacts")).unwrap();
    }
    let now = "2027-01-01T00:00:00Z".parse().unwrap();
    Store::import(folder.path(), now).await.unwrap();
    Site::showing(folder).await
}

pub fn read(folder: &TempDir, path: &str) -> String {
    let file = folder.path().join("archive").join(path);
    std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

fn paths(manifest: &Manifest) -> Vec<&str> {
    manifest
        .files
        .iter()
        .map(|file: &Entry| file.path.as_str())
        .collect()
}

/// Every file below a folder.
fn files_of(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files_of(&path));
        } else {
            found.push(path);
        }
    }
    found
}

fn holds(content: &[u8], part: &[u8]) -> bool {
    content.windows(part.len()).any(|window| window == part)
}

#[tokio::test]
async fn what_is_exported_is_shown_by_another_server_byte_for_byte() {
    let season = Season::played().await;
    let site = &season.site;
    let stage = site.stage().await;
    for (edition, token) in [("public", None), ("organiser", Some(ADMIN))] {
        let exported = exported(site, edition).await;
        assert_eq!(exported.1.left_out, Vec::<String>::new());
        let board = site.get("/api/v1/board", token).await;
        assert_eq!(
            read(&exported.0, "results/1-qualifying/board.json"),
            board.body
        );
        let rows = read(&exported.0, "results/1-qualifying/board.csv");
        assert!(rows.lines().nth(1).unwrap().contains(",Alpha,"), "{rows}");
        let day = read(&exported.0, "results/1-qualifying/2026-03-01.json");
        let day: Value = serde_json::from_str(&day).unwrap();
        assert_eq!(day.as_array().unwrap().len(), 2);

        let shown = imported(exported).await;
        let [a, b] = season.evaluations;
        let mut asked: Vec<String> = [
            "/board",
            "/board/hit",
            "/board/history",
            "/announcements",
            "/terms",
        ]
        .map(|path| format!("/api/v1{path}"))
        .into();
        asked.extend([
            format!("/api/v1/teams/{}", season.alpha.id),
            format!("/api/v1/evaluations/{a}/compare/{b}"),
        ]);
        if token.is_some() {
            asked.extend([
                format!("/api/v1/evaluations/{a}"),
                "/api/v1/evaluations?day=2026-03-01".into(),
                format!("/api/v1/evaluations/{a}/dataset"),
                "/api/v1/people".into(),
                "/api/v1/registrations".into(),
                "/api/v1/questions".into(),
            ]);
        }
        for path in asked {
            let (before, after) = (site.get(&path, token).await, shown.get(&path, token).await);
            assert_eq!(before.status, 200, "{path}: {before:?}");
            assert_eq!(after.body, before.body, "{edition}: {path}");
        }
        let path = format!("/api/v1/stages/{stage}");
        let mut before = site.get(&path, token).await.json(200);
        let forecast = before.as_object_mut().unwrap().remove("capacity");
        assert_eq!(forecast.is_some(), token.is_some(), "the organiser's");
        assert_eq!(
            shown.get(&path, token).await.json(200),
            before,
            "an archive forecasts no day"
        );
        let all = shown.get("/api/v1/stages", token).await.json(200);
        assert_eq!(all, json!([before]));
        let mut seasons = Vec::new();
        for site in [site, &shown] {
            let mut season = site.get("/api/v1/season", token).await.json(200);
            let archived = season.as_object_mut().unwrap().remove("archived");
            for stage in season["stages"].as_array_mut().unwrap() {
                stage.as_object_mut().unwrap().remove("capacity");
            }
            seasons.push((season, archived));
        }
        assert_eq!(seasons[1].0, seasons[0].0);
        assert_eq!(seasons[0].1, None);
        let archived = seasons[1].1.as_ref().unwrap();
        assert_eq!(archived["edition"], edition);
        assert_eq!(archived["imported_at"], "2027-01-01T00:00:00Z");
        assert!(
            seasons[1].0["days"][0]["seed"].is_string(),
            "public seeds stay"
        );

        for page in [
            "/",
            "/season",
            &format!("/evaluations/{a}"),
            "/announcements",
        ] {
            let page = shown.get(page, None).await;
            assert_eq!(page.status, 200, "{page:?}");
            assert!(
                page.body
                    .contains("Archived season: you see it as it was on 2026-03-01")
            );
        }
        assert!(!site.get("/", None).await.body.contains("Archived season"));
        // An archive of the archive shows the same moment.
        let again = self::exported(&shown, "public").await;
        let board = shown.get("/api/v1/board", None).await;
        assert_eq!(
            read(&again.0, "results/1-qualifying/board.json"),
            board.body
        );
    }
}

#[tokio::test]
async fn the_public_archive_holds_nothing_that_is_not_public() {
    let mut season = Season::played().await;
    let open = season.with_a_day_under_way().await;
    let hidden = season
        .evaluations
        .map(|id| format!("artifacts/datasets/{id}.zip"));

    let (folder, manifest) = exported(&season.site, "organiser").await;
    let named = paths(&manifest);
    assert!(
        hidden.iter().all(|path| named.contains(&path.as_str())),
        "{named:?}"
    );
    assert_eq!(
        named
            .iter()
            .filter(|path| path.starts_with("artifacts/bundles/"))
            .count(),
        2
    );
    assert!(manifest.left_out[0].contains("1 evaluations that were queued or running"));
    let all: Vec<_> = files_of(&folder.path().join("archive"));
    let content: Vec<Vec<u8>> = all
        .iter()
        .map(|file| std::fs::read(file).unwrap())
        .collect();
    let is_there = |part: &[u8]| content.iter().any(|content| holds(content, part));
    for (file, content) in all.iter().zip(&content) {
        // The log tells that it was queued.
        let is_log = ["events.jsonl", "database.sqlite3"]
            .iter()
            .any(|name| file.ends_with(name));
        assert!(
            is_log || !holds(content, open.to_string().as_bytes()),
            "{}",
            file.display()
        );
    }
    for (what, part) in &season.secrets {
        let is_key = matches!(*what, "a password" | "a token's hash" | "the secret");
        if is_key {
            assert!(!is_there(part), "{what} is in the organiser's archive");
        }
    }
    assert!(
        is_there(b"Ada Lovelace"),
        "the organiser's holds names: the test can find things"
    );
    for (what, part) in &season.secrets {
        let kept = [
            "an agent's log",
            "what an agent wrote",
            "a contact",
            "a worker's name",
        ];
        if kept.contains(what) {
            assert!(is_there(part), "{what} is not in the organiser's archive");
        }
    }

    let (folder, manifest) = exported(&season.site, "public").await;
    let named = paths(&manifest);
    assert!(
        named.iter().all(|path| !path.starts_with("artifacts/")),
        "the stage is open: {named:?}"
    );
    for file in files_of(&folder.path().join("archive")) {
        let content = std::fs::read(&file).unwrap();
        for (what, part) in &season.secrets {
            assert!(!holds(&content, part), "{what} is in {}", file.display());
        }
        assert!(
            !holds(&content, open.to_string().as_bytes()),
            "{}",
            file.display()
        );
    }
    assert!(read(&folder, "results/questions.json").contains("a public question"));
    let log = read(&folder, "events.jsonl");
    assert!(
        log.contains("\"day_released\"") && log.contains("\"evaluation_finished\""),
        "{log}"
    );
    for private in [
        "token_created",
        "person_joined",
        "submission_uploaded",
        "invited",
    ] {
        assert!(!log.contains(private), "{private}");
    }
    // By the newest rules one has a score, by those before both do; of the day under way nothing is told.
    for (file, rows, day) in [
        ("board", 1, "2026-03-02"),
        ("board-revision-2", 2, "2026-03-01"),
    ] {
        let board = read(&folder, &format!("results/1-qualifying/{file}.json"));
        let board: Value = serde_json::from_str(&board).unwrap();
        assert_eq!(board["rows"].as_array().unwrap().len(), rows, "{file}");
        assert_eq!(board["rows"][0]["day"], day);
    }
    let days = paths(&manifest).join("\n");
    assert!(
        days.contains("2026-03-02.csv") && !days.contains("2026-03-03"),
        "{days}"
    );
    let shown = imported((folder, manifest)).await;
    let was = season.site.get("/api/v1/board", None).await;
    assert_eq!(shown.get("/api/v1/board", None).await.body, was.body);
}

#[tokio::test]
async fn a_blind_stage_and_a_frozen_board_tell_the_public_archive_nothing() {
    let site = Site::start().await;
    let stage = site.stage().await;
    let request = |body: Value| {
        let path = format!("/api/v1/stages/{stage}");
        site.request(Method::PATCH, &path, Some(ADMIN)).json(&body)
    };
    let blinded = request(json!({ "blind": true, "publishes": "at_release" }));
    let blinded = Answer::of(blinded.send().await.unwrap()).await;
    assert_eq!(blinded.status, 200, "{blinded:?}");
    let before = site.played_day(3, [("Alpha", &well)]).await[0];
    let (folder, manifest) = exported(&site, "public").await;
    for file in files_of(&folder.path().join("archive")) {
        let content = std::fs::read(&file).unwrap();
        assert!(
            !holds(&content, before.to_string().as_bytes()),
            "{}",
            file.display()
        );
    }
    assert!(
        paths(&manifest)
            .iter()
            .all(|path| !path.starts_with("artifacts"))
    );
    let shown = imported((folder, manifest)).await;
    let board = shown.get("/api/v1/board", Some(ADMIN)).await.json(200);
    assert_eq!(
        (&board["blind"], &board["rows"]),
        (&json!(true), &json!([]))
    );
    let days = shown.get("/api/v1/season", Some(ADMIN)).await.json(200);
    assert_eq!(days["days"][0]["seed"], Value::Null, "nor does its seed");

    let opened = Answer::of(request(json!({ "blind": false })).send().await.unwrap()).await;
    assert_eq!(opened.status, 200, "{opened:?}");
    let freeze = format!("/api/v1/stages/{stage}/freeze");
    confirmed(&site, &freeze, json!({ "reason": "the ceremony" })).await;
    site.next_day();
    confirmed(&site, "/api/v1/days", json!({})).await;
    let after = site.finish_as(worse).await;
    let (folder, manifest) = exported(&site, "public").await;
    let named = paths(&manifest).join("\n");
    assert!(
        named.contains(&before.to_string()) && !named.contains(&after.to_string()),
        "{named}"
    );
    let shown = imported((folder, manifest)).await;
    let (was, is) = (
        site.get("/api/v1/board", None).await,
        shown.get("/api/v1/board", Some(ADMIN)).await,
    );
    assert_eq!(is.body, was.body);
    let dataset = format!("/api/v1/evaluations/{before}/dataset");
    assert_eq!(
        shown.get(&dataset, None).await.body,
        site.get(&dataset, None).await.body
    );
}

#[tokio::test]
async fn nothing_of_an_archived_season_changes_whoever_asks() {
    let season = Season::played().await;
    let shown = imported(exported(&season.site, "organiser").await).await;
    let document = shown.get("/api/v1/openapi.json", None).await.json(200);
    let mut refused = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        let path = path.replace("{id}", &season.evaluations[0].to_string());
        for method in item.as_object().unwrap().keys() {
            let method: Method = method.to_uppercase().parse().unwrap();
            if method == Method::GET {
                continue;
            }
            for token in [None, Some(ADMIN), Some(season.alpha.token.as_str())] {
                let asked = shown.request(method.clone(), &path, token).json(&json!({}));
                let answer = Answer::of(asked.send().await.unwrap()).await;
                let problem =
                    answer.problem(403, "read-only", &["archive of a season", "2026-03-01"]);
                assert_eq!(
                    problem["imported_at"], "2027-01-01T00:00:00Z",
                    "{method} {path}"
                );
                refused += 1;
            }
        }
    }
    assert!(refused > 100, "{refused}");
    for page in ["/sign-in", "/sign-out", "/register", "/join/fo_invite_x"] {
        let asked = shown
            .request(Method::POST, page, None)
            .header("accept", "text/html");
        let answer = Answer::of(asked.send().await.unwrap()).await;
        assert_eq!(answer.status, 403, "{answer:?}");
        assert!(answer.body.contains("The season is archived"), "{answer:?}");
    }
    // Nor by any other way: the store itself refuses.
    let error = shown
        .store
        .name_season(faceoff_store::Actor::Server, "x", shown.now())
        .await;
    assert!(error.unwrap_err().to_string().contains("archived"));
    // The old keys open nothing.
    shown
        .get("/api/v1/me", Some(&season.alpha.token))
        .await
        .problem(401, "unauthenticated", &["not known"]);
    assert_eq!(
        shown.get("/api/v1/health", None).await.json(200)["status"],
        "ok"
    );
    assert_eq!(shown.get("/api/v1/events", Some(ADMIN)).await.status, 200);
}

#[tokio::test]
async fn a_public_archive_has_nothing_for_the_organiser() {
    let season = Season::played().await;
    let shown = imported(exported(&season.site, "public").await).await;
    let asked = shown.get("/api/v1/season/archive", Some(ADMIN)).await;
    asked.problem(409, "conflict", &["ask for the public one"]);
    let dataset = format!("/api/v1/evaluations/{}/dataset", season.evaluations[0]);
    let asked = shown.get(&dataset, Some(ADMIN)).await;
    asked.problem(410, "gone", &["made without this dataset"]);
    shown
        .get(&dataset, None)
        .await
        .problem(401, "unauthenticated", &[]);
    let questions = shown.get("/api/v1/questions", Some(ADMIN)).await.json(200);
    assert_eq!(questions[0]["text"], "a public question");
    assert_eq!(questions[0].get("team"), None, "nobody tells who asked");
    assert_eq!(questions.as_array().unwrap().len(), 1);
    for list in ["people", "registrations", "proposals"] {
        let found = shown
            .get(&format!("/api/v1/{list}"), Some(ADMIN))
            .await
            .json(200);
        assert_eq!(found, json!([]), "{list}");
    }
}

#[tokio::test]
async fn one_archive_is_made_at_a_time_and_one_that_nobody_takes_is_forgotten() {
    let season = Season::played().await;
    let site = &season.site;
    // So much that it does not fit between sender and reader.
    let large = site.folder.path().join("large");
    let noise: Vec<u8> = {
        let mut reader = blake3::Hasher::new().finalize_xof();
        let mut noise = vec![0; 48 << 20];
        reader.fill(&mut noise);
        noise
    };
    std::fs::write(&large, &noise).unwrap();
    let key = format!("datasets/{}.zip", season.evaluations[0]);
    site.store.artifacts().put_file(&key, &large).await.unwrap();

    let under_way = ask(site, "organiser").await;
    let second = site.get("/api/v1/season/archive", Some(ADMIN)).await;
    second.problem(503, "busy", &["one at a time"]);
    assert_eq!(second.header("retry-after"), "60");
    drop(under_way);
    // The file is not what its hash says any more: the archive breaks off, however far it came.
    let broken = loop {
        let path = "/api/v1/season/archive?edition=organiser";
        let asked = site
            .request(Method::GET, path, Some(ADMIN))
            .send()
            .await
            .unwrap();
        if asked.status() == 200 {
            break asked.bytes().await;
        }
        // the first sender has not noticed yet that its reader is gone
        tokio::task::yield_now().await;
    };
    assert!(broken.is_err(), "it must not look whole");
    let public = loop {
        let path = "/api/v1/season/archive?edition=public";
        let asked = site
            .request(Method::GET, path, Some(ADMIN))
            .send()
            .await
            .unwrap();
        if asked.status() == 200 {
            break asked.bytes().await;
        }
        tokio::task::yield_now().await;
    };
    assert!(public.is_ok());
    // The sender removes its files before it lets the next one begin, and ends after the last byte.
    while site
        .get("/api/v1/season/archive?edition=public", Some(ADMIN))
        .await
        .status
        != 200
    {
        tokio::task::yield_now().await;
    }

    let refused = site
        .get("/api/v1/season/archive?edition=mine", Some(ADMIN))
        .await;
    refused.problem(400, "invalid-request", &["public", "organiser"]);
}

#[tokio::test]
async fn a_dataset_that_is_gone_is_named() {
    let season = Season::played().await;
    let key = format!("datasets/{}.zip", season.evaluations[0]);
    season.site.store.artifacts().delete(&key).await.unwrap();
    let (_folder, manifest) = exported(&season.site, "organiser").await;
    assert_eq!(manifest.left_out.len(), 1);
    assert!(
        manifest.left_out[0].contains(&key),
        "{:?}",
        manifest.left_out
    );
    assert!(!paths(&manifest).iter().any(|path| path.contains(&key)));
}

#[tokio::test]
async fn once_closed_the_season_tells_its_secret_in_the_archive_too() {
    let season = Season::played().await;
    let closed = confirmed(
        &season.site,
        "/api/v1/season/close",
        json!({ "confirm": "Test season" }),
    )
    .await;
    let (folder, manifest) = exported(&season.site, "public").await;
    let named = paths(&manifest).join("\n");
    assert!(
        season
            .evaluations
            .iter()
            .all(|id| named.contains(&id.to_string())),
        "{named}"
    );
    let shown = imported((folder, manifest)).await;
    let season = shown.get("/api/v1/season", None).await.json(200);
    assert_eq!(season["secret"], closed["secret"]);
    assert_eq!(season["commitment"], closed["commitment"]);
    assert_eq!(shown.store.archived().unwrap().edition, Edition::Public);
}
