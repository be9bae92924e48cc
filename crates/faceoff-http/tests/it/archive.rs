//! Tests of the season archive, a file with the data of a season, and of a server that shows an imported archive. The public
//! edition has what visitors can see; the organiser's edition has everything except passwords and tokens.

use crate::site::{ADMIN, Answer, GZIP, Site, TestTeam, outcome, string};
use faceoff_airhockey::HIT;
use faceoff_archive::{Entry, Manifest, unpack};
use faceoff_store::{Edition, Store};
use faceoff_types::{EpisodeOutcome, EvaluationId, Task};
use reqwest::Method;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A season with private data of every kind.
struct Season {
    site: Site,
    alpha: TestTeam,
    /// Evaluations of the first day, Alpha's and Beta's.
    evaluations: [EvaluationId; 2],
    /// A description and the bytes of each piece of data that must not be in a public archive.
    private_data: Vec<(&'static str, Vec<u8>)>,
}

fn good_outcome(task: Task, episode: u32) -> EpisodeOutcome {
    outcome(task, episode, false)
}

fn weak_outcome(task: Task, episode: u32) -> EpisodeOutcome {
    EpisodeOutcome {
        success: episode.is_multiple_of(3),
        ..outcome(task, episode, false)
    }
}

/// Posts as an organiser. The request must succeed.
async fn post(site: &Site, path: &str, body: Value) -> Value {
    let answer = site.post(path, Some(ADMIN), &body).await;
    assert!(answer.status.is_success(), "{path}: {answer:?}");
    serde_json::from_str(&answer.body).unwrap_or_default()
}

impl Season {
    async fn start() -> Self {
        let site = Site::start().await;
        let evaluations = site
            .run_day(30, [("Alpha", &good_outcome), ("Beta", &weak_outcome)])
            .await;
        let listed = site.get("/api/v1/teams", Some(ADMIN)).await.json(200);
        let alpha = listed
            .as_array()
            .unwrap()
            .iter()
            .find(|team| team["name"] == "Alpha");
        let id = string(&alpha.unwrap()["id"]);
        site.team("Never played").await;
        let replaced = post(&site, &format!("/api/v1/teams/{id}/token"), json!({})).await;
        let alpha = TestTeam {
            id: id.clone(),
            token: string(&replaced["token"]),
        };
        let joined = {
            let invitation = post(
                &site,
                "/api/v1/invitations",
                json!({ "role": "member", "team": id, "note": "for Ada Lovelace" }),
            )
            .await;
            let join = json!({ "code": invitation["code"], "name": "Ada Lovelace", "password": "correct horse battery" });
            let joined = site.post("/api/v1/invitations/accept", None, &join).await;
            joined.json(201)
        };
        post(
            &site,
            "/api/v1/invitations",
            json!({ "role": "organiser", "note": "an open one" }),
        )
        .await;
        let open = json!({ "takes_registrations": true });
        let opened = site.patch("/api/v1/season", Some(ADMIN), &open).await;
        assert!(opened.status.is_success());
        let register = json!({ "team": { "name": "Gamma" }, "contact": "gamma@example.org" });
        assert_eq!(
            site.post("/api/v1/registrations", None, &register)
                .await
                .status,
            201
        );
        for (text, public) in [("a private question", false), ("a public question", true)] {
            let response = site
                .post(
                    "/api/v1/questions",
                    Some(&alpha.token),
                    &json!({ "text": text }),
                )
                .await;
            let path = format!(
                "/api/v1/questions/{}/answer",
                string(&response.json(201)["id"])
            );
            let answer = json!({ "text": "an answer", "public": public });
            let answered = site.send(Method::PUT, &path, Some(ADMIN), &answer).await;
            assert!(answered.status.is_success());
        }
        let person = string(&joined["person"]["id"]);
        let mut season = Self {
            site,
            alpha,
            evaluations,
            private_data: vec![
                ("a password", b"$argon2id$".to_vec()),
                ("a name", b"Ada Lovelace".to_vec()),
                ("a user's id", person.into_bytes()),
                ("an open invitation", b"an open one".to_vec()),
                ("a contact", b"gamma@example.org".to_vec()),
                ("a private question", b"a private question".to_vec()),
                ("an agent's log", b"log of ".to_vec()),
                ("an agent's output", b"{\\\"type\\\":\\\"act\\\"}".to_vec()),
                ("a bundle's name", b"striker.tar.gz".to_vec()),
                (
                    "a bundle's hash",
                    blake3::hash(&GZIP).to_string().into_bytes(),
                ),
                ("a worker's name", b"slot 0".to_vec()),
                ("a team that never played", b"Never played".to_vec()),
            ],
        };
        let secret = season.site.store.season().await.unwrap().secret;
        season
            .private_data
            .push(("the secret", secret.as_bytes().to_vec()));
        for token in [&season.alpha.token, &string(&joined["secret"])] {
            let hash = faceoff_api::token::hash_token(token);
            season.private_data.push(("a token's hash", hash.to_vec()));
        }
        season
    }

    /// Adds two more days by other rules. On the first of them, one agent fails, and the other has one fault, which is
    /// allowed. On the second, one evaluation is still open. Returns its id.
    async fn add_unfinished_day(&mut self) -> EvaluationId {
        let site = &self.site;
        let more_faults = json!({ "max_faults": 5, "confirm": "Qualifying" });
        site.change_first_stage(more_faults).await.json(200);
        site.next_day();
        site.start_day().await;
        site.run_shards_with_faults(10).await;
        site.run_evaluation(|task, episode| outcome(task, episode, task == HIT && episode == 0))
            .await;
        site.next_day();
        site.start_day().await;
        site.run_shards_with_faults(10).await;
        let today = site.get("/api/v1/evaluations", Some(ADMIN)).await.json(200);
        let open = today
            .as_array()
            .unwrap()
            .iter()
            .find(|evaluation| evaluation["state"] == "queued");
        string(&open.unwrap()["id"]).parse().unwrap()
    }
}

async fn download(site: &Site, edition: &str) -> reqwest::Response {
    let path = format!("/api/v1/season/archive?edition={edition}");
    let response = site
        .request(Method::GET, &path, Some(ADMIN))
        .send()
        .await
        .unwrap();
    assert_eq!(response.status(), 200, "{response:?}");
    response
}

/// Downloads and unpacks an archive. Returns the folder and the manifest.
pub async fn export(site: &Site, edition: &str) -> (TempDir, Manifest) {
    let bytes = download(site, edition).await.bytes().await.unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("season.tar.zst");
    std::fs::write(&file, bytes).unwrap();
    let unpacked = folder.path().join("archive");
    std::fs::create_dir(&unpacked).unwrap();
    let manifest = unpack(&file, &unpacked).unwrap();
    (folder, manifest)
}

/// Imports an unpacked archive and serves it.
pub async fn import((folder, _): (TempDir, Manifest)) -> Site {
    let unpacked = folder.path().join("archive");
    let database = folder.path().join("faceoff.sqlite3");
    std::fs::rename(unpacked.join("database.sqlite3"), database).unwrap();
    if unpacked.join("artifacts").exists() {
        std::fs::rename(unpacked.join("artifacts"), folder.path().join("artifacts")).unwrap();
    }
    let now = "2027-01-01T00:00:00Z".parse().unwrap();
    Store::import(folder.path(), now).await.unwrap();
    Site::open_archive(folder).await
}

/// The text of a file in an unpacked archive.
pub fn read_file(folder: &TempDir, path: &str) -> String {
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

fn contains_bytes(content: &[u8], part: &[u8]) -> bool {
    content.windows(part.len()).any(|window| window == part)
}

#[tokio::test]
async fn imported_archive_is_shown_byte_for_byte() {
    let season = Season::start().await;
    let site = &season.site;
    let stage = site.stage().await;
    for (edition, token) in [("public", None), ("organiser", Some(ADMIN))] {
        let exported = export(site, edition).await;
        assert_eq!(exported.1.left_out, Vec::<String>::new());
        let board = site.get("/api/v1/board", token).await;
        assert_eq!(
            read_file(&exported.0, "results/1-qualifying/board.json"),
            board.body
        );
        let rows = read_file(&exported.0, "results/1-qualifying/board.csv");
        assert!(rows.lines().nth(1).unwrap().contains(",Alpha,"), "{rows}");
        let day = read_file(&exported.0, "results/1-qualifying/2026-03-01.json");
        let day: Value = serde_json::from_str(&day).unwrap();
        assert_eq!(day.as_array().unwrap().len(), 2);

        let imported = import(exported).await;
        let [alpha_evaluation, beta_evaluation] = season.evaluations;
        let mut compared: Vec<String> = [
            "/board",
            "/board/hit",
            "/board/history",
            "/announcements",
            "/terms",
        ]
        .map(|path| format!("/api/v1{path}"))
        .into();
        compared.extend([
            format!("/api/v1/teams/{}", season.alpha.id),
            format!("/api/v1/evaluations/{alpha_evaluation}/compare/{beta_evaluation}"),
        ]);
        if token.is_some() {
            compared.extend([
                format!("/api/v1/evaluations/{alpha_evaluation}"),
                "/api/v1/evaluations?day=2026-03-01".into(),
                format!("/api/v1/evaluations/{alpha_evaluation}/dataset"),
                "/api/v1/people".into(),
                "/api/v1/registrations".into(),
                "/api/v1/questions".into(),
            ]);
        }
        for path in compared {
            let original_answer = site.get(&path, token).await;
            let imported_answer = imported.get(&path, token).await;
            assert_eq!(original_answer.status, 200, "{path}: {original_answer:?}");
            assert_eq!(
                imported_answer.body, original_answer.body,
                "{edition}: {path}"
            );
        }
        let path = format!("/api/v1/stages/{stage}");
        let mut original_stage = site.get(&path, token).await.json(200);
        let forecast = original_stage.as_object_mut().unwrap().remove("capacity");
        assert_eq!(
            forecast.is_some(),
            token.is_some(),
            "only organisers see the forecast"
        );
        assert_eq!(
            imported.get(&path, token).await.json(200),
            original_stage,
            "an archive forecasts no day"
        );
        let stages = imported.get("/api/v1/stages", token).await.json(200);
        assert_eq!(stages, json!([original_stage]));
        let mut seasons = Vec::new();
        for site in [site, &imported] {
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
            &format!("/evaluations/{alpha_evaluation}"),
            "/announcements",
        ] {
            let page = imported.get(page, None).await;
            assert_eq!(page.status, 200, "{page:?}");
            assert!(page.body.contains("Archived season as of 2026-03-01"));
        }
        assert!(!site.get("/", None).await.body.contains("Archived season"));
        // An archive of the imported season has the same board.
        let second_export = self::export(&imported, "public").await;
        let board = imported.get("/api/v1/board", None).await;
        assert_eq!(
            read_file(&second_export.0, "results/1-qualifying/board.json"),
            board.body
        );
    }
}

#[tokio::test]
async fn public_archive_has_no_private_data() {
    let mut season = Season::start().await;
    let open = season.add_unfinished_day().await;
    let dataset_paths = season
        .evaluations
        .map(|id| format!("artifacts/datasets/{id}.zip"));

    let (folder, manifest) = export(&season.site, "organiser").await;
    let listed = paths(&manifest);
    assert!(
        dataset_paths
            .iter()
            .all(|path| listed.contains(&path.as_str())),
        "{listed:?}"
    );
    assert_eq!(
        listed
            .iter()
            .filter(|path| path.starts_with("artifacts/bundles/"))
            .count(),
        2
    );
    assert!(manifest.left_out[0].contains("1 evaluations that were queued or running"));
    let files: Vec<_> = files_of(&folder.path().join("archive"));
    let content: Vec<Vec<u8>> = files
        .iter()
        .map(|file| std::fs::read(file).unwrap())
        .collect();
    let is_found = |part: &[u8]| content.iter().any(|content| contains_bytes(content, part));
    for (file, content) in files.iter().zip(&content) {
        // The log mentions that the evaluation was queued.
        let is_log = ["events.jsonl", "database.sqlite3"]
            .iter()
            .any(|name| file.ends_with(name));
        assert!(
            is_log || !contains_bytes(content, open.to_string().as_bytes()),
            "{}",
            file.display()
        );
    }
    for (description, part) in &season.private_data {
        let is_credential = matches!(*description, "a password" | "a token's hash" | "the secret");
        if is_credential {
            assert!(
                !is_found(part),
                "{description} is in the organiser's archive"
            );
        }
    }
    assert!(
        is_found(b"Ada Lovelace"),
        "the organiser's archive has names: the search works"
    );
    for (description, part) in &season.private_data {
        let kept_by_organisers = [
            "an agent's log",
            "an agent's output",
            "a contact",
            "a worker's name",
        ];
        if kept_by_organisers.contains(description) {
            assert!(
                is_found(part),
                "{description} is not in the organiser's archive"
            );
        }
    }

    let (folder, manifest) = export(&season.site, "public").await;
    let listed = paths(&manifest);
    assert!(
        listed.iter().all(|path| !path.starts_with("artifacts/")),
        "the stage is open: {listed:?}"
    );
    for file in files_of(&folder.path().join("archive")) {
        let content = std::fs::read(&file).unwrap();
        for (description, part) in &season.private_data {
            assert!(
                !contains_bytes(&content, part),
                "{description} is in {}",
                file.display()
            );
        }
        assert!(
            !contains_bytes(&content, open.to_string().as_bytes()),
            "{}",
            file.display()
        );
    }
    assert!(read_file(&folder, "results/questions.json").contains("a public question"));
    let log = read_file(&folder, "events.jsonl");
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
    // By the newest rules one team has a score, by the earlier rules both. The unfinished day is not in the archive.
    for (file, rows, day) in [
        ("board", 1, "2026-03-02"),
        ("board-revision-2", 2, "2026-03-01"),
    ] {
        let board = read_file(&folder, &format!("results/1-qualifying/{file}.json"));
        let board: Value = serde_json::from_str(&board).unwrap();
        assert_eq!(board["rows"].as_array().unwrap().len(), rows, "{file}");
        assert_eq!(board["rows"][0]["day"], day);
    }
    let days = paths(&manifest).join("\n");
    assert!(
        days.contains("2026-03-02.csv") && !days.contains("2026-03-03"),
        "{days}"
    );
    let imported = import((folder, manifest)).await;
    let original = season.site.get("/api/v1/board", None).await;
    assert_eq!(
        imported.get("/api/v1/board", None).await.body,
        original.body
    );
}

#[tokio::test]
async fn public_archive_hides_blind_stages_and_frozen_results() {
    let site = Site::start().await;
    site.change_first_stage(json!({ "blind": true, "publishes": "at_release" }))
        .await
        .json(200);
    let evaluation_before_freeze = site.run_day(3, [("Alpha", &good_outcome)]).await[0];
    let (folder, manifest) = export(&site, "public").await;
    for file in files_of(&folder.path().join("archive")) {
        let content = std::fs::read(&file).unwrap();
        assert!(
            !contains_bytes(&content, evaluation_before_freeze.to_string().as_bytes()),
            "{}",
            file.display()
        );
    }
    assert!(
        paths(&manifest)
            .iter()
            .all(|path| !path.starts_with("artifacts"))
    );
    let imported = import((folder, manifest)).await;
    let board = imported.get("/api/v1/board", Some(ADMIN)).await.json(200);
    assert_eq!(
        (&board["blind"], &board["rows"]),
        (&json!(true), &json!([]))
    );
    let days = imported.get("/api/v1/season", Some(ADMIN)).await.json(200);
    assert_eq!(
        days["days"][0]["seed"],
        Value::Null,
        "the seed of a blind day is hidden"
    );

    site.change_first_stage(json!({ "blind": false }))
        .await
        .json(200);
    let freeze = format!("/api/v1/stages/{}/freeze", site.stage().await);
    post(&site, &freeze, json!({ "reason": "the ceremony" })).await;
    site.next_day();
    site.start_day().await;
    let evaluation_after_freeze = site.run_evaluation(weak_outcome).await;
    let (folder, manifest) = export(&site, "public").await;
    let listed = paths(&manifest).join("\n");
    assert!(
        listed.contains(&evaluation_before_freeze.to_string())
            && !listed.contains(&evaluation_after_freeze.to_string()),
        "{listed}"
    );
    let imported = import((folder, manifest)).await;
    let original_board = site.get("/api/v1/board", None).await;
    let imported_board = imported.get("/api/v1/board", Some(ADMIN)).await;
    assert_eq!(imported_board.body, original_board.body);
    let dataset = format!("/api/v1/evaluations/{evaluation_before_freeze}/dataset");
    assert_eq!(
        imported.get(&dataset, None).await.body,
        site.get(&dataset, None).await.body
    );
}

#[tokio::test]
async fn archived_season_is_read_only_for_all_roles() {
    let season = Season::start().await;
    let imported = import(export(&season.site, "organiser").await).await;
    let document = imported.get("/api/v1/openapi.json", None).await.json(200);
    let mut refused_requests = 0;
    for (path, item) in document["paths"].as_object().unwrap() {
        let path = path.replace("{id}", &season.evaluations[0].to_string());
        for method in item.as_object().unwrap().keys() {
            let method: Method = method.to_uppercase().parse().unwrap();
            if method == Method::GET {
                continue;
            }
            for token in [None, Some(ADMIN), Some(season.alpha.token.as_str())] {
                let request = imported
                    .request(method.clone(), &path, token)
                    .json(&json!({}));
                let answer = Answer::read(request.send().await.unwrap()).await;
                let problem =
                    answer.problem(403, "read-only", &["archive of a season", "2026-03-01"]);
                assert_eq!(
                    problem["imported_at"], "2027-01-01T00:00:00Z",
                    "{method} {path}"
                );
                refused_requests += 1;
            }
        }
    }
    assert!(refused_requests > 100, "{refused_requests}");
    for page in ["/sign-in", "/sign-out", "/register", "/join/fo_invite_x"] {
        let request = imported
            .request(Method::POST, page, None)
            .header("accept", "text/html");
        let answer = Answer::read(request.send().await.unwrap()).await;
        assert_eq!(answer.status, 403, "{answer:?}");
        assert!(answer.body.contains("The season is archived"), "{answer:?}");
    }
    // The store itself refuses changes, too.
    let error = imported
        .store
        .name_season(faceoff_store::Actor::Server, "x", imported.now())
        .await;
    assert!(error.unwrap_err().to_string().contains("archived"));
    // Tokens of the original server are not valid.
    imported
        .get("/api/v1/me", Some(&season.alpha.token))
        .await
        .problem(401, "unauthenticated", &["unknown"]);
    assert_eq!(
        imported.get("/api/v1/health", None).await.json(200)["status"],
        "ok"
    );
    assert_eq!(
        imported.get("/api/v1/events", Some(ADMIN)).await.status,
        200
    );
}

#[tokio::test]
async fn public_archive_hides_organiser_data_from_organisers() {
    let season = Season::start().await;
    let imported = import(export(&season.site, "public").await).await;
    let response = imported.get("/api/v1/season/archive", Some(ADMIN)).await;
    response.problem(409, "conflict", &["ask for the public edition"]);
    let dataset = format!("/api/v1/evaluations/{}/dataset", season.evaluations[0]);
    let response = imported.get(&dataset, Some(ADMIN)).await;
    response.problem(410, "gone", &["does not contain this dataset"]);
    imported
        .get(&dataset, None)
        .await
        .problem(401, "unauthenticated", &[]);
    let questions = imported
        .get("/api/v1/questions", Some(ADMIN))
        .await
        .json(200);
    assert_eq!(questions[0]["text"], "a public question");
    assert_eq!(questions[0].get("team"), None, "questions are anonymous");
    assert_eq!(questions.as_array().unwrap().len(), 1);
    for list in ["people", "registrations", "proposals"] {
        let found = imported
            .get(&format!("/api/v1/{list}"), Some(ADMIN))
            .await
            .json(200);
        assert_eq!(found, json!([]), "{list}");
    }
}

#[tokio::test]
async fn archives_are_made_one_at_a_time_and_stop_if_unread() {
    let season = Season::start().await;
    let site = &season.site;
    // The file is larger than all buffers between sender and reader, and cannot be compressed.
    const LARGE_BYTES: usize = 48 << 20;
    let large = site.folder.path().join("large");
    let noise: Vec<u8> = {
        let mut reader = blake3::Hasher::new().finalize_xof();
        let mut noise = vec![0; LARGE_BYTES];
        reader.fill(&mut noise);
        noise
    };
    std::fs::write(&large, &noise).unwrap();
    // Clips have no hash in the database, so these count as undamaged.
    let key = format!("datasets/{}.zip.clips", season.evaluations[0]);
    site.store.artifacts().put_file(&key, &large).await.unwrap();

    let unread_download = download(site, "organiser").await;
    let second = site.get("/api/v1/season/archive", Some(ADMIN)).await;
    second.problem(503, "busy", &["only one"]);
    assert_eq!(second.header("retry-after"), "60");
    drop(unread_download);
    // Waits until the previous sender has ended: it may not have noticed yet that its client disconnected.
    let download = async |edition: &str| loop {
        let path = format!("/api/v1/season/archive?edition={edition}");
        let request = site.request(Method::GET, &path, Some(ADMIN));
        let response = request.send().await.unwrap();
        if response.status() == 200 {
            break response.bytes().await;
        }
        tokio::task::yield_now().await;
    };
    assert!(download("organiser").await.is_ok());
    // The sender removes its files after the last byte, and only then may the next archive begin.
    assert!(download("public").await.is_ok());

    let refused = site
        .get("/api/v1/season/archive?edition=mine", Some(ADMIN))
        .await;
    refused.problem(400, "invalid-request", &["public", "organiser"]);
}

#[tokio::test]
async fn missing_dataset_is_listed_in_the_manifest() {
    let season = Season::start().await;
    let key = format!("datasets/{}.zip", season.evaluations[0]);
    season.site.store.artifacts().delete(&key).await.unwrap();
    let (_folder, manifest) = export(&season.site, "organiser").await;
    assert_eq!(manifest.left_out.len(), 1);
    assert!(
        manifest.left_out[0].contains(&key),
        "{:?}",
        manifest.left_out
    );
    assert!(!paths(&manifest).iter().any(|path| path.contains(&key)));
}

#[tokio::test]
async fn damaged_dataset_is_left_out_and_named() {
    let season = Season::start().await;
    let artifacts = season.site.store.artifacts();
    let [damaged, intact] =
        [0, 1].map(|index| format!("datasets/{}.zip", season.evaluations[index]));
    let path = artifacts.local_path(&damaged).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    let (_folder, manifest) = export(&season.site, "organiser").await;
    let listed = paths(&manifest).join("\n");
    assert!(
        listed.contains(&intact) && !listed.contains(&damaged),
        "{listed}"
    );
    let [left_out] = manifest.left_out.as_slice() else {
        panic!("{:?}", manifest.left_out)
    };
    assert!(
        left_out.contains(&damaged) && left_out.ends_with("the file is damaged"),
        "{left_out}"
    );
}

#[tokio::test]
async fn archive_of_a_closed_season_has_its_secret() {
    let season = Season::start().await;
    let closed = post(
        &season.site,
        "/api/v1/season/close",
        json!({ "confirm": "Test season" }),
    )
    .await;
    let (folder, manifest) = export(&season.site, "public").await;
    let listed = paths(&manifest).join("\n");
    assert!(
        season
            .evaluations
            .iter()
            .all(|id| listed.contains(&id.to_string())),
        "{listed}"
    );
    let imported = import((folder, manifest)).await;
    let season = imported.get("/api/v1/season", None).await.json(200);
    assert_eq!(season["secret"], closed["secret"]);
    assert_eq!(season["commitment"], closed["commitment"]);
    assert_eq!(
        imported.store.archived_season().unwrap().edition,
        Edition::Public
    );
}
