//! Episodes, their replays, and who may see what of them.

use crate::{
    html::texts,
    site::{ADMIN, Answer, Site, TestTeam, result},
};
use faceoff_episode::{Answered, Arena, Course, StepSink};
use faceoff_replay::{Clip, ClipRecorder, join};
use faceoff_types::{AgentFaultKind, Interpolation, Phase, Profile, Seed, Task};
use flate2::read::GzDecoder;
use reqwest::Method;
use scraper::{Html, Selector};
use serde_json::{Value, json};
use std::{fs::File, io::Read, path::PathBuf};

/// Episodes of `prepare`; the agent holds its arm, and in the last one answers with what is no number.
const EPISODES: u32 = 5;
const SECRET: &str = "said something of its own";

struct Recorded {
    site: Site,
    alpha: TestTeam,
    beta: TestTeam,
    path: String,
    page: String,
}

/// The pack of a real, if short, evaluation.
pub(crate) fn pack(folder: &std::path::Path) -> PathBuf {
    let seed = Seed::from_number(3);
    let arena = Arena::new(Profile::Evaluation, seed, seed.model_mismatch());
    let part = folder.join("part");
    let mut clips = ClipRecorder::new(Task::Prepare, File::create(&part).unwrap()).unwrap();
    for episode in 0..EPISODES {
        let interpolation = Some(Interpolation::Cubic);
        let mut course = Course::begin(&arena, Task::Prepare, episode, interpolation, &mut clips);
        let held = course.question().unwrap().observation[6..13].to_vec();
        let outcome = loop {
            if episode == EPISODES - 1 && course.steps() == 3 {
                let fault = AgentFaultKind::NotJson {
                    detail: SECRET.to_owned(),
                };
                break course.failed(Phase::Step, fault, None);
            }
            let answered = Answered {
                computation_time_s: if course.steps() == 2 { 0.03 } else { 0.001 },
                host_time_s: 0.0,
                cpu_time_s: None,
            };
            match course.answer(&[held.clone(), vec![0.0; 7]].concat(), answered) {
                Ok(None) => {}
                Ok(Some(outcome)) => break outcome,
                Err(fault) => break course.failed(Phase::Step, fault, None),
            }
        };
        course.sink().end(&outcome, 0).unwrap();
    }
    clips.finish().unwrap();
    let pack = folder.join("pack");
    join(&[part], File::create(&pack).unwrap()).unwrap();
    pack
}

/// Two teams of one day; the first has an evaluation with clips, the second's is under way unless the day is over.
async fn recorded(is_over: bool) -> Recorded {
    recorded_at(Site::start().await, is_over).await
}

async fn recorded_at(site: Site, is_over: bool) -> Recorded {
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let of_alpha = site.valid_submission(&alpha, "striker").await;
    site.valid_submission(&beta, "striker").await;
    let path = site.evaluate(&alpha, &of_alpha).await;
    let id = path.rsplit('/').next().unwrap().to_owned();
    let folder = tempfile::tempdir().unwrap();
    let pack = pack(folder.path());
    let key = faceoff_store::Artifacts::clips_of(&format!("datasets/{id}.zip"));
    let artifacts = site.store.artifacts();
    artifacts.put_file(&key, &pack).await.unwrap();
    site.finish(&result([0.5, 0.6, 0.7], 100.0)).await;
    if is_over {
        site.finish(&result([0.1, 0.2, 0.3], 10.0)).await;
    }
    Recorded {
        page: format!("/evaluations/{id}/episodes"),
        site,
        alpha,
        beta,
        path,
    }
}

impl Recorded {
    async fn get(&self, path: &str, token: Option<&str>) -> Answer {
        self.site.get(&format!("{}/{path}", self.path), token).await
    }

    async fn bytes(&self, path: &str, encodings: &str) -> (reqwest::header::HeaderMap, Vec<u8>) {
        let path = format!("{}/{path}", self.path);
        let request = self
            .site
            .request(Method::GET, &path, Some(&self.alpha.token));
        let answer = request.header("accept-encoding", encodings).send().await;
        let answer = answer.unwrap();
        assert_eq!(answer.status(), 200);
        let headers = answer.headers().clone();
        (headers, answer.bytes().await.unwrap().into())
    }

    async fn page(&self, path: &str) -> Html {
        let answer = self.site.get(&format!("{}{path}", self.page), None).await;
        assert_eq!(answer.status, 200, "{}", answer.body);
        let html = Html::parse_document(&answer.body);
        assert!(html.errors.is_empty(), "{:?}\n{}", html.errors, answer.body);
        html
    }
}

#[tokio::test]
async fn nothing_is_told_of_episodes_before_the_day_is_released() {
    let recorded = recorded(false).await;
    let own = Some(recorded.alpha.token.as_str());
    for path in [
        "episodes",
        "episodes/prepare/0/motion",
        "episodes/prepare/0/observed",
    ] {
        for token in [None, own, Some(ADMIN)] {
            let answer = recorded.get(path, token).await;
            answer.problem(409, "not-yet", &["queued or running"]);
        }
    }
    let page = recorded.site.get(&recorded.page, None).await;
    assert_eq!(page.status, 409, "{}", page.body);
}

#[tokio::test]
async fn everybody_sees_the_motion_and_who_gets_the_dataset_the_rest() {
    let recorded = recorded(true).await;
    let alpha = Some(recorded.alpha.token.as_str());
    let beta = Some(recorded.beta.token.as_str());
    for token in [None, beta, alpha, Some(ADMIN)] {
        let motion = recorded.get("episodes/prepare/1/motion", token).await;
        assert_eq!(motion.status, 200);
    }
    let observed = "episodes/prepare/1/observed";
    let refused = recorded.get(observed, None).await;
    refused.problem(401, "unauthenticated", &["the motion is there"]);
    let refused = recorded.get(observed, beta).await;
    refused.problem(403, "forbidden", &["the motion is there"]);
    for token in [alpha, Some(ADMIN)] {
        assert_eq!(recorded.get(observed, token).await.status, 200);
    }

    let told = |answer: Answer| {
        let view = answer.json(200);
        let last = view["episodes"][EPISODES as usize - 1].clone();
        (view, last)
    };
    let (view, last) = told(recorded.get("episodes", None).await);
    assert_eq!(
        view["episodes"].as_array().unwrap().len(),
        EPISODES as usize
    );
    assert_eq!(last["end"], "agent_fault");
    assert_eq!(last["why"], "a fault of the agent ended the episode");
    assert_eq!(view.get("computation_times"), None);
    for line in view["episodes"].as_array().unwrap() {
        assert_eq!((line.get("longest_s"), line.get("late")), (None, None));
    }
    let (view, last) = told(recorded.get("episodes", alpha).await);
    assert!(last["why"].as_str().unwrap().contains(SECRET), "{last}");
    let steps: u64 = view["computation_times"]["prepare"]
        .as_array()
        .unwrap()
        .iter()
        .map(|bin| bin["steps"].as_u64().unwrap())
        .sum();
    let played = view["episodes"].as_array().unwrap().iter();
    let played: u64 = played.map(|line| line["steps"].as_u64().unwrap()).sum();
    assert_eq!(steps, played);
    assert!(last["longest_s"].as_f64().unwrap() > 0.0, "{last}");
    // The same for spreadsheets, and drawn.
    let evaluation = recorded.page.trim_end_matches("/episodes");
    for (token, sees) in [(None, false), (alpha, true)] {
        let site = &recorded.site;
        let table = site.get(&format!("{evaluation}/episodes.csv"), token).await;
        assert!(table.header("content-type").starts_with("text/csv"));
        let mut reader = csv::Reader::from_reader(table.body.as_bytes());
        let column = |name: &str| {
            let mut reader = csv::Reader::from_reader(table.body.as_bytes());
            let headers = reader.headers().unwrap();
            headers.iter().position(|one| one == name).unwrap()
        };
        let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
        assert_eq!(rows.len(), EPISODES as usize);
        let last = &rows[EPISODES as usize - 1];
        assert_eq!(&last[column("end")], "agent_fault");
        assert_eq!(last[column("why")].contains(SECRET), sees);
        assert_eq!(!last[column("longest_s")].is_empty(), sees);
        let times = site
            .get(&format!("{evaluation}/answer-times.csv"), token)
            .await;
        let page = site.get(evaluation, token).await;
        assert_eq!(page.body.contains("class=\"shape\""), sees);
        if sees {
            let mut reader = csv::Reader::from_reader(times.body.as_bytes());
            let counted = reader.records().map(|row| row.unwrap()[3].parse::<u64>());
            assert_eq!(counted.map(Result::unwrap).sum::<u64>(), steps);
        } else {
            assert_eq!(times.status, 401);
        }
    }
    let page = recorded.page("/prepare/4").await;
    assert!(!page.html().contains(SECRET), "a page for everybody");
    for path in ["prepare/99/motion", "hit/0/motion", "juggle/0/motion"] {
        let absent = recorded.get(&format!("episodes/{path}"), alpha).await;
        assert_eq!(absent.status, 404, "{path}: {}", absent.body);
    }
}

#[tokio::test]
async fn a_blind_stage_shows_no_episode() {
    let site = Site::start().await;
    let path = format!("/api/v1/stages/{}", site.stage().await);
    let request = site.request(Method::PATCH, &path, Some(ADMIN));
    let changed = request
        .json(&json!({ "blind": true }))
        .send()
        .await
        .unwrap();
    assert_eq!(changed.status(), 200);
    let recorded = recorded_at(site, true).await;
    for path in ["episodes", "episodes/prepare/0/motion"] {
        for token in [None, Some(recorded.alpha.token.as_str())] {
            let refused = recorded.get(path, token).await;
            refused.problem(409, "blind", &["blind"]);
        }
        assert_eq!(recorded.get(path, Some(ADMIN)).await.status, 200);
    }
}

#[tokio::test]
async fn a_clip_comes_compressed_to_who_takes_it_and_once() {
    let recorded = recorded(true).await;
    let path = "episodes/prepare/0/motion";
    let (headers, compressed) = recorded.bytes(path, "br, gzip").await;
    assert_eq!(headers["content-encoding"], "gzip");
    let (plain_headers, plain) = recorded.bytes(path, "identity").await;
    assert!(!plain_headers.contains_key("content-encoding"));
    let mut unpacked = Vec::new();
    GzDecoder::new(compressed.as_slice())
        .read_to_end(&mut unpacked)
        .unwrap();
    assert!(unpacked == plain);
    let clip = Clip::read(&compressed).unwrap();
    assert_eq!(clip.puck_places().len(), clip.header.samples as usize);
    let url = format!("{}/{path}", recorded.path);
    let again = recorded.site.request(Method::GET, &url, None);
    let tag = headers["etag"].to_str().unwrap();
    let again = again.header("if-none-match", tag).send().await.unwrap();
    assert_eq!(again.status(), 304);
}

#[tokio::test]
async fn an_evaluation_of_an_older_server_says_that_it_has_no_replays() {
    let site = Site::start().await;
    let team = site.team("Alpha").await;
    let submission = site.valid_submission(&team, "striker").await;
    let path = site.evaluate(&team, &submission).await;
    site.finish(&result([0.5, 0.6, 0.7], 100.0)).await;
    let answer = site.get(&format!("{path}/episodes"), None).await;
    answer.problem(409, "conflict", &["no replays", "faceoff replay"]);
}

#[tokio::test]
async fn the_page_of_episodes_shows_those_that_were_chosen() {
    let recorded = recorded(true).await;
    let view: Value = recorded.get("episodes", None).await.json(200);
    let lines = view["episodes"].as_array().unwrap();
    let all = recorded.page("").await;
    let rows = |html: &Html| texts(html, ".episodes tbody tr");
    assert_eq!(rows(&all).len(), EPISODES as usize);
    for (row, line) in rows(&all).iter().zip(lines) {
        assert!(row.contains(line["why"].as_str().unwrap()), "{row}");
        let verdict = if line["success"] == true {
            "✓"
        } else {
            "✕"
        };
        assert!(row.contains(verdict), "{row}");
    }
    let faulty = recorded.page("?end=agent_fault").await;
    assert_eq!(rows(&faulty).len(), 1);
    let failed = lines.iter().filter(|line| line["success"] == false).count();
    let shown = recorded.page("?task=prepare&went=failure").await;
    assert_eq!(rows(&shown).len(), failed);
    let broke = lines
        .iter()
        .filter(|line| line["broken"].is_array())
        .count();
    let shown = recorded.page("?broke=any").await;
    assert_eq!(rows(&shown).len(), broke);
    let none = recorded.page("?task=hit").await;
    assert!(texts(&none, "#table ~ p")[0].contains("No episode is like this"));
    let maps = texts(&all, ".maps figcaption");
    assert!(
        maps.iter().any(|map| map.starts_with("prepare:")),
        "{maps:?}"
    );
    for unknown in [
        "?task=juggle",
        "?went=well",
        "?broke=everything",
        "?what=else",
    ] {
        let path = format!("{}{unknown}", recorded.page);
        let refused = recorded.site.get(&path, None).await;
        assert_eq!(refused.status, 400, "{unknown}: {}", refused.body);
    }
}

#[tokio::test]
async fn a_replay_is_complete_without_its_script() {
    let recorded = recorded(true).await;
    let view: Value = recorded.get("episodes", None).await.json(200);
    let page = recorded.page("/prepare/1").await;
    let why = view["episodes"][1]["why"].as_str().unwrap();
    assert!(texts(&page, ".verdict")[0].contains(why));
    let attribute = |selector: &str, name: &str| {
        let selector = Selector::parse(selector).unwrap();
        let found = page.select(&selector).next()?;
        found.attr(name).map(str::to_owned)
    };
    let way = attribute(".way.puck", "d").unwrap();
    let samples = view["episodes"][1]["steps"].as_u64().unwrap() + 1;
    assert_eq!(way.matches(['M', 'L']).count() as u64, samples);
    let motion = attribute("#replay", "data-motion").unwrap();
    assert_eq!(recorded.site.get(&motion, None).await.status, 200);
    assert_eq!(attribute("#replay", "data-observed"), None);
    let script = attribute("script", "src").unwrap();
    let script = recorded.site.get(&script, None).await;
    assert_eq!(script.status, 200);
    assert!(script.header("content-type").starts_with("text/javascript"));
    for link in texts(&page, ".pages a") {
        assert!(link.contains("episode"), "{link}");
    }
    let embedded = recorded
        .site
        .get(&format!("{}/prepare/1/embed", recorded.page), None)
        .await;
    assert_eq!(embedded.status, 200);
    assert!(
        embedded
            .header("content-security-policy")
            .contains("frame-ancestors *")
    );
    assert!(embedded.headers.get("x-frame-options").is_none());
    let alone = recorded.site.get(&recorded.page, None).await;
    assert_eq!(alone.header("x-frame-options"), "DENY");
}
