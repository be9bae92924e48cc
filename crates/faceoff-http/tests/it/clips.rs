//! Tests of an evaluation's episodes, of their clips (the data of the replay viewer), and of who may see them.

use crate::{
    html::texts,
    site::{ADMIN, Answer, Site, TestTeam, result},
};
use faceoff_airhockey::Interpolation;
use faceoff_airhockey::PREPARE;
use faceoff_airhockey::SimulationSetup;
use faceoff_episode::{AnswerTiming, RunningEpisode, StepSink};
use faceoff_replay::{Clip, ClipRecorder, join_packs};
use faceoff_types::{AgentFaultKind, Phase, Seed};
use flate2::read::GzDecoder;
use reqwest::Method;
use scraper::{Html, Selector};
use serde_json::{Value, json};
use std::{fs::File, io::Read, path::PathBuf};

/// Episodes of `prepare`. The agent holds its arm still; in the last episode it sends an invalid answer.
const EPISODES: u32 = 5;
/// The invalid answer.
const AGENT_OUTPUT: &str = "private output of the agent";

/// A day of two teams, of which Alpha's evaluation has clips.
pub(crate) struct RecordedDay {
    pub(crate) site: Site,
    pub(crate) alpha: TestTeam,
    beta: TestTeam,
    /// Path of Alpha's evaluation in the API.
    path: String,
    /// Path of the page that lists the evaluation's episodes.
    pub(crate) page: String,
}

/// Records the clips of a short evaluation. Returns the file that joins them.
pub(crate) fn record_clips(folder: &std::path::Path) -> PathBuf {
    let seed = Seed::from_number(3);
    let setup = SimulationSetup::new(
        faceoff_airhockey::EVALUATION.try_into().unwrap(),
        seed,
        seed.model_mismatch(),
    );
    let part = folder.join("part");
    let mut clips = ClipRecorder::new(
        PREPARE,
        faceoff_airhockey::simulator().competition(),
        File::create(&part).unwrap(),
    )
    .unwrap();
    for episode in 0..EPISODES {
        let layout = Some(Interpolation::Cubic.into());
        let mut running =
            RunningEpisode::begin(&setup, PREPARE, episode, layout, &mut clips).unwrap();
        // Entries 6 to 12 of an observation are the joint positions.
        let joint_positions = running.action_request().unwrap().observation[6..13].to_vec();
        let outcome = loop {
            if episode == EPISODES - 1 && running.steps() == 3 {
                let fault = AgentFaultKind::NotJson {
                    detail: AGENT_OUTPUT.to_owned(),
                };
                break running.outcome_after_fault(Phase::Step, fault, None);
            }
            // The answer of step 2 is late: a control step has 0.02 s.
            let timing = AnswerTiming {
                computation_time_s: if running.steps() == 2 { 0.03 } else { 0.001 },
                host_time_s: 0.0,
                cpu_time_s: None,
            };
            let action = [joint_positions.clone(), vec![0.0; 7]].concat();
            match running.answer(&action, timing) {
                Ok(None) => {}
                Ok(Some(outcome)) => break outcome,
                Err(fault) => break running.outcome_after_fault(Phase::Step, fault, None),
            }
        };
        running.sink().end(&outcome, 0).unwrap();
    }
    clips.finish().unwrap();
    let pack = folder.join("pack");
    join_packs(&[part], File::create(&pack).unwrap()).unwrap();
    pack
}

/// A released day of two teams. The first evaluation has clips.
pub(crate) async fn record_released_day() -> RecordedDay {
    record_day_on(Site::start().await, true).await
}

/// A day of two teams that is not released, because the second evaluation is still open. The first one has clips.
pub(crate) async fn record_open_day() -> RecordedDay {
    record_day_on(Site::start().await, false).await
}

/// A day of two teams. The first evaluation has clips; the second one is still open unless `is_over`.
async fn record_day_on(site: Site, is_over: bool) -> RecordedDay {
    let [alpha, beta] = [site.team("Alpha").await, site.team("Beta").await];
    let alpha_submission = site.valid_submission(&alpha, "striker").await;
    site.valid_submission(&beta, "striker").await;
    let path = site.start_evaluation(&alpha, &alpha_submission).await;
    let id = path.rsplit('/').next().unwrap().to_owned();
    let folder = tempfile::tempdir().unwrap();
    let pack = record_clips(folder.path());
    let key = faceoff_store::Artifacts::clips_key(&format!("datasets/{id}.zip"));
    let artifacts = site.store.artifacts();
    artifacts.put_file(&key, &pack).await.unwrap();
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    if is_over {
        site.finish_evaluation(&result([0.1, 0.2, 0.3], 10.0)).await;
    }
    RecordedDay {
        page: format!("/evaluations/{id}/episodes"),
        site,
        alpha,
        beta,
        path,
    }
}

impl RecordedDay {
    /// Gets a resource of Alpha's evaluation.
    async fn get(&self, path: &str, token: Option<&str>) -> Answer {
        self.site.get(&format!("{}/{path}", self.path), token).await
    }

    /// Headers and unprocessed body of a resource of Alpha's evaluation.
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

    /// The page of the evaluation's episodes, or one below it.
    async fn page(&self, path: &str) -> Html {
        let path = format!("{}{path}", self.page);
        self.site.get(&path, None).await.html(200)
    }
}

#[tokio::test]
async fn episodes_are_hidden_before_the_release() {
    let day = record_open_day().await;
    let alpha = Some(day.alpha.token.as_str());
    for path in [
        "episodes",
        "episodes/prepare/0/motion",
        "episodes/prepare/0/observed",
    ] {
        for token in [None, alpha, Some(ADMIN)] {
            let answer = day.get(path, token).await;
            answer.problem(409, "not-yet", &["queued or running"]);
        }
    }
    for path in ["", "/prepare/0/still.svg"] {
        let page = day.site.get(&format!("{}{path}", day.page), None).await;
        assert_eq!(page.status, 409, "{path}: {}", page.body);
    }
}

#[tokio::test]
async fn motion_is_public_and_observations_follow_the_dataset() {
    let day = record_released_day().await;
    let alpha = Some(day.alpha.token.as_str());
    let beta = Some(day.beta.token.as_str());
    for token in [None, beta, alpha, Some(ADMIN)] {
        let motion = day.get("episodes/prepare/1/motion", token).await;
        assert_eq!(motion.status, 200);
    }
    let observed = "episodes/prepare/1/observed";
    let refused = day.get(observed, None).await;
    refused.problem(401, "unauthenticated", &["the motion is public"]);
    let refused = day.get(observed, beta).await;
    refused.problem(403, "forbidden", &["the motion is public"]);
    for token in [alpha, Some(ADMIN)] {
        assert_eq!(day.get(observed, token).await.status, 200);
    }

    let view_and_last = |answer: Answer| {
        let view = answer.json(200);
        let last = view["episodes"][EPISODES as usize - 1].clone();
        (view, last)
    };
    let (view, last) = view_and_last(day.get("episodes", None).await);
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
    let (view, last) = view_and_last(day.get("episodes", alpha).await);
    assert!(
        last["why"].as_str().unwrap().contains(AGENT_OUTPUT),
        "{last}"
    );
    let steps: u64 = view["computation_times"]["prepare"]
        .as_array()
        .unwrap()
        .iter()
        .map(|bin| bin["steps"].as_u64().unwrap())
        .sum();
    let episodes = view["episodes"].as_array().unwrap().iter();
    let episode_steps: u64 = episodes.map(|line| line["steps"].as_u64().unwrap()).sum();
    assert_eq!(steps, episode_steps);
    assert!(last["longest_s"].as_f64().unwrap() > 0.0, "{last}");
    // The same data as CSV and as a chart.
    let evaluation = day.page.trim_end_matches("/episodes");
    for (token, is_visible) in [(None, false), (alpha, true)] {
        let site = &day.site;
        let table = site.get(&format!("{evaluation}/episodes.csv"), token).await;
        assert!(table.header("content-type").starts_with("text/csv"));
        let mut reader = csv::Reader::from_reader(table.body.as_bytes());
        let column = |name: &str| {
            let mut reader = csv::Reader::from_reader(table.body.as_bytes());
            let headers = reader.headers().unwrap();
            headers.iter().position(|header| header == name).unwrap()
        };
        let rows: Vec<_> = reader.records().map(Result::unwrap).collect();
        assert_eq!(rows.len(), EPISODES as usize);
        let last = &rows[EPISODES as usize - 1];
        assert_eq!(&last[column("end")], "agent_fault");
        assert_eq!(last[column("why")].contains(AGENT_OUTPUT), is_visible);
        assert_eq!(!last[column("longest_s")].is_empty(), is_visible);
        let times = site
            .get(&format!("{evaluation}/answer-times.csv"), token)
            .await;
        let page = site.get(evaluation, token).await;
        assert_eq!(page.body.contains("class=\"distribution\""), is_visible);
        if is_visible {
            let mut reader = csv::Reader::from_reader(times.body.as_bytes());
            // The fourth column is the number of steps.
            let bin_steps = reader.records().map(|row| row.unwrap()[3].parse::<u64>());
            assert_eq!(bin_steps.map(Result::unwrap).sum::<u64>(), steps);
        } else {
            assert_eq!(times.status, 401);
        }
    }
    let page = day.page("/prepare/4").await;
    assert!(!page.html().contains(AGENT_OUTPUT), "the page is public");
    for path in ["prepare/99/motion", "hit/0/motion", "juggle/0/motion"] {
        let missing = day.get(&format!("episodes/{path}"), alpha).await;
        assert_eq!(missing.status, 404, "{path}: {}", missing.body);
    }
}

#[tokio::test]
async fn blind_stage_hides_episodes() {
    let site = Site::start().await;
    site.change_first_stage(json!({ "blind": true }))
        .await
        .json(200);
    let day = record_day_on(site, true).await;
    for path in ["episodes", "episodes/prepare/0/motion"] {
        for token in [None, Some(day.alpha.token.as_str())] {
            let refused = day.get(path, token).await;
            refused.problem(409, "blind", &["blind"]);
        }
        assert_eq!(day.get(path, Some(ADMIN)).await.status, 200);
    }
}

#[tokio::test]
async fn clip_is_compressed_and_cached_by_etag() {
    let day = record_released_day().await;
    let path = "episodes/prepare/0/motion";
    let (headers, compressed) = day.bytes(path, "br, gzip").await;
    assert_eq!(headers["content-encoding"], "gzip");
    let (plain_headers, plain) = day.bytes(path, "identity").await;
    assert!(!plain_headers.contains_key("content-encoding"));
    let mut unpacked = Vec::new();
    GzDecoder::new(compressed.as_slice())
        .read_to_end(&mut unpacked)
        .unwrap();
    assert!(unpacked == plain);
    let clip = Clip::read(&compressed).unwrap();
    assert_eq!(clip.puck_positions().len(), clip.header.samples as usize);
    let url = format!("{}/{path}", day.path);
    let again = day.site.request(Method::GET, &url, None);
    let tag = headers["etag"].to_str().unwrap();
    let again = again.header("if-none-match", tag).send().await.unwrap();
    assert_eq!(again.status(), 304);
}

#[tokio::test]
async fn episode_list_shows_stills_with_long_cache_time() {
    let day = record_released_day().await;
    let page = day.page("").await;
    let image = Selector::parse(".episodes tbody img").unwrap();
    let addresses: Vec<_> = page
        .select(&image)
        .map(|image| {
            assert_eq!(image.attr("loading"), Some("lazy"));
            image.attr("src").unwrap().to_owned()
        })
        .collect();
    assert_eq!(addresses.len(), EPISODES as usize);
    let mut pictures = Vec::new();
    for address in &addresses {
        let picture = day.site.get(address, None).await;
        assert_eq!(picture.status, 200, "{}", picture.body);
        assert_eq!(picture.header("content-type"), "image/svg+xml");
        let caching = picture.header("cache-control");
        assert_eq!(caching, "private, max-age=31536000, immutable");
        assert!(picture.body.contains("class=\"trajectory puck\" d=\"M"));
        assert!(picture.body.len() < 8_000, "{}", picture.body.len());
        // Firefox applies the policy of a picture's own response to its styles.
        let policy = picture.header("content-security-policy");
        assert!(policy.contains("style-src 'unsafe-inline'"), "{policy}");
        // What the agent observed is not public.
        let for_own_team = day.site.get(address, Some(&day.alpha.token)).await;
        assert_eq!(for_own_team.body, picture.body);
        pictures.push(picture.body);
    }
    pictures.dedup();
    assert_eq!(pictures.len(), EPISODES as usize);

    let first = day.site.get(&addresses[0], None).await;
    let again = day.site.request(Method::GET, &addresses[0], None);
    let again = again.header("if-none-match", first.header("etag"));
    assert_eq!(again.send().await.unwrap().status(), 304);
    // Without its version the picture is asked for again: it could be another one.
    let (address, _) = addresses[0].split_once('?').unwrap();
    let unversioned = day.site.get(address, None).await;
    assert_eq!(unversioned.header("cache-control"), "private, no-cache");
    assert_eq!(unversioned.body, first.body);
    for missing in ["prepare/99", "juggle/0"] {
        let path = format!("{}/{missing}/still.svg", day.page);
        assert_eq!(day.site.get(&path, None).await.status, 404, "{missing}");
    }
}

#[tokio::test]
async fn frozen_boards_hide_stills() {
    let site = Site::start().await;
    let freeze = format!("/api/v1/stages/{}/freeze", site.stage().await);
    site.post(&freeze, Some(ADMIN), &json!({ "reason": "surprise" }))
        .await
        .json(200);
    site.next_day();
    let day = record_day_on(site, true).await;
    let episode = format!("{}/prepare/0", day.page);
    for path in [episode.clone(), format!("{episode}/still.svg")] {
        let hidden = day.site.get(&path, None).await;
        assert_eq!(hidden.status, 409, "{path}: {}", hidden.body);
        let for_own_team = day.site.get(&path, Some(&day.alpha.token)).await;
        assert_eq!(for_own_team.status, 200, "{path}: {}", for_own_team.body);
    }
}

#[tokio::test]
async fn table_map_marks_link_to_replays() {
    let day = record_released_day().await;
    let page = day.page("").await;
    let links = Selector::parse(".table-map a").unwrap();
    let found: Vec<_> = page
        .select(&links)
        .map(|link| {
            // The table has the same links for keyboards.
            assert_eq!(link.attr("tabindex"), Some("-1"));
            let name = link.text().collect::<String>();
            (link.attr("href").unwrap().to_owned(), name)
        })
        .collect();
    let view = day.get("episodes", None).await.json(200);
    let lines = view["episodes"].as_array().unwrap();
    for line in lines {
        let episode = &line["episode"];
        let outcome = match line["success"].as_bool() {
            Some(true) => "solved",
            _ => "not solved",
        };
        let link = (
            format!("episodes/prepare/{episode}"),
            format!("prepare {episode}: {outcome}"),
        );
        assert!(found.contains(&link), "{link:?} of {found:?}");
    }
    let (address, _) = &found[0];
    // Relative to the page of the episodes.
    let path = day.page.replace("episodes", address);
    assert_eq!(day.site.get(&path, None).await.status, 200);
}

#[tokio::test]
async fn evaluation_without_clips_has_no_replays() {
    let site = Site::start().await;
    let (_, _, path) = site.team_with_evaluation("Alpha", "striker").await;
    site.finish_evaluation(&result([0.5, 0.6, 0.7], 100.0))
        .await;
    let answer = site.get(&format!("{path}/episodes"), None).await;
    answer.problem(409, "conflict", &["no replays", "faceoff replay"]);
}

#[tokio::test]
async fn episodes_page_is_filtered_by_its_query() {
    let day = record_released_day().await;
    let view: Value = day.get("episodes", None).await.json(200);
    let lines = view["episodes"].as_array().unwrap();
    let unfiltered_page = day.page("").await;
    let rows = |html: &Html| texts(html, ".episodes tbody tr");
    assert_eq!(rows(&unfiltered_page).len(), EPISODES as usize);
    for (row, line) in rows(&unfiltered_page).iter().zip(lines) {
        assert!(row.contains(line["why"].as_str().unwrap()), "{row}");
        let verdict = if line["success"] == true {
            "✓"
        } else {
            "✕"
        };
        assert!(row.contains(verdict), "{row}");
    }
    let with_fault = day.page("?end=agent_fault").await;
    assert_eq!(rows(&with_fault).len(), 1);
    let failed = lines.iter().filter(|line| line["success"] == false).count();
    let failures_page = day.page("?task=prepare&outcome=failure").await;
    assert_eq!(rows(&failures_page).len(), failed);
    let with_violation = lines
        .iter()
        .filter(|line| line["broken"].is_array())
        .count();
    let violations_page = day.page("?violated=any").await;
    assert_eq!(rows(&violations_page).len(), with_violation);
    let empty_page = day.page("?task=hit").await;
    assert!(texts(&empty_page, "#table ~ p")[0].contains("No episode matches"));
    let maps = texts(&unfiltered_page, ".maps figcaption");
    assert!(
        maps.iter().any(|map| map.starts_with("prepare:")),
        "{maps:?}"
    );
    for unknown in [
        "?task=juggle",
        "?outcome=well",
        "?violated=everything",
        "?what=else",
    ] {
        let path = format!("{}{unknown}", day.page);
        let refused = day.site.get(&path, None).await;
        assert_eq!(refused.status, 400, "{unknown}: {}", refused.body);
    }
}

#[tokio::test]
async fn replay_page_is_complete_without_its_script() {
    let day = record_released_day().await;
    let view: Value = day.get("episodes", None).await.json(200);
    let page = day.page("/prepare/1").await;
    let cause = view["episodes"][1]["why"].as_str().unwrap();
    assert!(texts(&page, ".verdict")[0].contains(cause));
    let attribute = |selector: &str, name: &str| {
        let selector = Selector::parse(selector).unwrap();
        let found = page.select(&selector).next()?;
        found.attr(name).map(str::to_owned)
    };
    let puck_path = attribute(".trajectory.puck", "d").unwrap();
    let samples = view["episodes"][1]["steps"].as_u64().unwrap() + 1;
    assert_eq!(puck_path.matches(['M', 'L']).count() as u64, samples);
    let motion = attribute("#replay", "data-motion").unwrap();
    assert_eq!(day.site.get(&motion, None).await.status, 200);
    assert_eq!(attribute("#replay", "data-observed"), None);
    let script = attribute("script", "src").unwrap();
    let script = day.site.get(&script, None).await;
    assert_eq!(script.status, 200);
    assert!(script.header("content-type").starts_with("text/javascript"));
    for link in texts(&page, ".pages a") {
        assert!(link.contains("episode"), "{link}");
    }
    let embedded = day
        .site
        .get(&format!("{}/prepare/1/embed", day.page), None)
        .await;
    assert_eq!(embedded.status, 200);
    assert!(
        embedded
            .header("content-security-policy")
            .contains("frame-ancestors *")
    );
    assert!(embedded.headers.get("x-frame-options").is_none());
    let not_embeddable = day.site.get(&day.page, None).await;
    assert_eq!(not_embeddable.header("x-frame-options"), "DENY");
}
