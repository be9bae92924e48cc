//! A second competition on the real server: agents are uploaded, validated in the sandbox, evaluated, ranked, recorded, verified and
//! browsed. It exists only in this test.

mod point_mass;

use crate::site::{ADMIN, Site, TestTeam, string};
use faceoff_dataset::{Dataset, verify::verify};
use faceoff_episode::Simulator;
use faceoff_metrics::Metrics;
use faceoff_runner::{AgentEnvironment, Supervision, TimeLimits, bundle::BundleLimits};
use faceoff_sandbox::{Isolation, Limits, Runtime};
use faceoff_store::JobFilter;
use faceoff_types::EvaluationId;
use faceoff_worker::{CpuLayout, SlotThreads, SlotsConfig, WorkerConfig};
use flate2::{Compression, write::GzEncoder};
use point_mass::PointMass;
use scraper::Selector;
use serde_json::{Value, json};
use std::{collections::BTreeMap, num::NonZero, sync::Arc};
use tokio_util::sync::CancellationToken;

/// An agent of three styles: “steady” brakes in time, “idle” does nothing, and “hasty” accelerates too much.
const AGENT: &str = r#"
import json, os, sys

STYLE = os.environ["STYLE"]
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "hello":
        assert message["env"] == {"step_s": 0.1}, message
        answer = {"type": "ready", "protocol": 1}
    elif message["type"] == "reset":
        answer = {"type": "ready", "episode": message["episode"]}
    elif message["type"] == "step":
        position, velocity = message["obs"]
        action = {
            "steady": 8 * (max(-0.8, min(0.8, -2 * position)) - velocity),
            "idle": 0,
            "hasty": -40 * position - 12 * velocity,
        }[STYLE]
        answer = {"type": "act", "step": message["step"], "action": [action]}
    elif message["type"] == "bye":
        break
    else:
        continue
    print(json.dumps(answer), flush=True)
"#;

/// A bundle with the agent in one of its styles.
fn bundle(style: &str) -> Vec<u8> {
    let manifest = format!(
        "name = \"{style}\"\ncommand = [\"python3\", \"agent.py\"]\nruntime = \"python3\"\n[env]\nSTYLE = \"{style}\"\n"
    );
    let mut archive = tar::Builder::new(GzEncoder::new(Vec::new(), Compression::fast()));
    for (name, content) in [("agent.toml", manifest.as_str()), ("agent.py", AGENT)] {
        let mut header = tar::Header::new_gnu();
        header.set_size(content.len() as u64);
        header.set_mode(0o644);
        archive
            .append_data(&mut header, name, content.as_bytes())
            .unwrap();
    }
    archive.into_inner().unwrap().finish().unwrap()
}

/// The settings of a worker of this site, with two slots.
fn worker_config(site: &Site, simulator: Arc<dyn Simulator>) -> WorkerConfig {
    // So long that a busy machine does not affect the agents.
    let time = TimeLimits {
        startup_s: 600.0,
        reset_s: 600.0,
        step_s: 600.0,
        bye_s: 600.0,
        mean_s: 600.0,
        episode_extra_s: 600.0,
        resets_extra_s: 600.0,
        ..TimeLimits::default()
    };
    WorkerConfig {
        slots: SlotsConfig {
            cpus: CpuLayout::for_server(2, &[]),
            threads: SlotThreads::from_caller(),
            scratch_dir: site.folder.path().join("scratch"),
            agent: AgentEnvironment {
                limits: Limits::default(),
                time,
                isolation: Isolation::Sandboxed {
                    disabled_layers: Vec::new(),
                },
                runtimes: BTreeMap::from([(
                    "python3".to_owned(),
                    Runtime::python3().expect("this machine has Python"),
                )]),
                images: false,
                agent_cpus: Vec::new(),
                supervision: Supervision::default(),
                simulator,
            },
            metrics: Metrics::new("0.0.0"),
        },
        job_filter: JobFilter::All,
        lease_s: 3600,
        bundle_limits: BundleLimits::default(),
    }
}

/// The text of the elements that a CSS selector finds, with single spaces.
fn texts(html: &scraper::Html, selector: &str) -> Vec<String> {
    let selector = Selector::parse(selector).unwrap();
    let found = html.select(&selector);
    let text = |element: scraper::ElementRef<'_>| {
        let text: String = element.text().collect();
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    found.map(text).collect()
}

#[tokio::test]
async fn second_competition_runs_on_the_real_server() {
    let simulator = PointMass::new();
    let site = Site::start().await;
    let site = site.with_simulator(simulator.clone()).await;
    let too_strong = json!({
        "tasks": ["reach"], "profile": "windy", "perturbations": { "wind": { "strength_m_s2": 2 } },
    });
    site.change_first_stage(too_strong).await.problem(
        422,
        "invalid-content",
        &["wind.strength_m_s2", "a number from 0 to 1", "got 2"],
    );
    let rules = json!({
        "tasks": ["settle", "reach"], "profile": "windy", "episodes_per_task": 6, "episodes_per_shard": 3,
        "perturbations": { "wind": { "strength_m_s2": 0.5 } }, "confirm": "Qualifying",
    });
    let changed = site.change_first_stage(rules).await.json(200);
    let tasks = &changed["tasks"];
    assert_eq!(tasks, &json!(["reach", "settle"]), "{changed}");
    assert_eq!(changed["ruleset"], "points-1");

    let shutdown = CancellationToken::new();
    let worker = tokio::spawn(faceoff_worker::run(
        site.store.clone(),
        site.live.clone(),
        site.clock(),
        worker_config(&site, simulator.clone()),
        shutdown.clone(),
    ));
    let mut teams: Vec<TestTeam> = Vec::new();
    for style in ["idle", "hasty", "steady"] {
        let team = site.team(style).await;
        let uploaded = site.upload(&team.token, bundle(style)).await.json(201);
        let id = string(&uploaded["id"]).parse().unwrap();
        let state = faceoff_testkit::wait_for_validation(&site.store, id)
            .await
            .state;
        let path = format!("/api/v1/submissions/{id}");
        let submission = site.get(&path, Some(&team.token)).await.json(200);
        assert_eq!(submission["state"], "valid", "{state:?} {submission}");
        teams.push(team);
    }
    site.start_day().await;
    let mut evaluations: Vec<EvaluationId> = Vec::new();
    for team in &teams {
        let own_evaluations = site.store.evaluations_of(team.id.parse().unwrap()).await;
        let id = own_evaluations.unwrap()[0].id;
        faceoff_testkit::wait_for_evaluation(&site.store, id).await;
        evaluations.push(id);
    }

    // The board ranks by score and penalty points, without tiers.
    let board = site.get("/api/v1/board", Some(ADMIN)).await.json(200);
    let rows = board["rows"].as_array().unwrap();
    let cell = |index: usize, field: &str| rows[index][field].clone();
    let ranked: Vec<Value> = (0..3).map(|index| cell(index, "team")).collect();
    assert_eq!(ranked, ["steady", "hasty", "idle"], "{board}");
    assert_eq!(
        (cell(0, "score"), cell(0, "penalty_points")),
        (json!(100.0), json!(0.0))
    );
    assert_eq!(cell(2, "score"), 0.0);
    assert_eq!(rows[0].get("tier"), None);
    let violations = &rows[1]["tasks"]["settle"]["violations"];
    assert_eq!(violations, &json!({ "speeding": 6 }), "{board}");
    // Overall penalty points are the largest of the tasks: two points in each of the six episodes.
    assert_eq!(cell(1, "penalty_points"), 2.0 * 6.0);

    // An ablation compares each profile with the ideal one.
    let submission = site.store.evaluations_of(teams[2].id.parse().unwrap());
    let submission = submission.await.unwrap()[0].submission;
    let ablation = format!("/api/v1/submissions/{submission}/ablation");
    let request = json!({ "episodes_per_task": 4 });
    site.post(&ablation, Some(ADMIN), &request).await.json(201);
    let finished = faceoff_testkit::wait_for(&site.store, async || {
        let view = site.get(&ablation, Some(ADMIN)).await.json(200);
        (view["state"] == "finished").then_some(view)
    });
    let effects = finished.await["tasks"]["settle"].clone();
    let profiles: Vec<String> = effects
        .as_array()
        .unwrap()
        .iter()
        .map(|effect| string(&effect["profile"]))
        .collect();
    assert_eq!(profiles, ["calm", "windy"], "{effects}");

    // The pages show this competition, and no words of air hockey.
    let board_page = site.get("/", Some(ADMIN)).await.html(200);
    let headings = texts(&board_page, "main table th").join(" ");
    assert!(
        headings.contains("Reach") && headings.contains("Settle"),
        "{headings}"
    );
    let task_page = site.get("/tasks/settle", Some(ADMIN)).await;
    assert!(task_page.body.contains("too fast"), "{}", task_page.body);
    let csv = site.get("/api/v1/board?format=csv", Some(ADMIN)).await;
    assert!(
        csv.body.contains("speeding") && !csv.body.contains("tier"),
        "{}",
        csv.body
    );
    let evaluation = evaluations[1];
    for path in [
        "/".to_owned(),
        "/tasks/reach".to_owned(),
        format!("/evaluations/{evaluation}"),
        format!("/evaluations/{evaluation}/episodes"),
        format!("/evaluations/{evaluation}/compare/{}", evaluations[2]),
        format!("/submissions/{submission}/ablation"),
        format!("/teams/{}", teams[1].id),
    ] {
        let page = site.get(&path, Some(&teams[1].token)).await;
        page.html(200);
        let text = page.body.to_lowercase();
        for word in [
            "defend",
            "prepare",
            "puck",
            "mallet",
            "deployable",
            "air hockey",
            "airhockey",
        ] {
            assert!(!text.contains(word), "{word} is on {path}: {text}");
        }
    }
    let path = format!("/evaluations/{evaluation}/episodes?violated=speeding&task=reach");
    let episodes = site.get(&path, Some(&teams[1].token)).await.html(200);
    let rows = texts(&episodes, "table.episodes tbody tr");
    assert_eq!(rows.len(), 6, "{rows:?}");
    assert!(
        rows[0].contains("arrived") && rows[0].contains("speed: by up to"),
        "{rows:?}"
    );
    let path = format!("/api/v1/evaluations/{evaluation}/episodes");
    let listed = site.get(&path, Some(&teams[1].token)).await.json(200);
    let first = &listed["episodes"][0];
    assert_eq!(
        (&first["task"], &first["end"]),
        (&json!("reach"), &json!("arrived"))
    );
    assert_eq!(
        (first.get("start"), &first["broken"][0]["group"]),
        (None, &json!("speeding"))
    );
    let missing = site.get("/nothing-here", None).await;
    assert!(!missing.body.contains("airhockey"), "{}", missing.body);
    let cup = json!({ "name": "Cup", "teams": ["idle", "hasty"] });
    site.post("/api/v1/tournaments", Some(ADMIN), &cup)
        .await
        .problem(422, "invalid-content", &["no games of two agents"]);
    let document = site.get("/api/v1/openapi.json", None).await.json(200);
    let names = &document["components"]["schemas"]["Task"]["enum"];
    assert_eq!(names, &json!(["reach", "settle"]));

    // The dataset can be downloaded and verified.
    let path = format!("/api/v1/evaluations/{evaluation}/dataset");
    let request = site.request(reqwest::Method::GET, &path, Some(&teams[1].token));
    let bytes = request.send().await.unwrap().bytes().await.unwrap();
    let archive = site.folder.path().join("downloaded.zip");
    std::fs::write(&archive, bytes).unwrap();
    let read = archive.clone();
    let verified = tokio::task::spawn_blocking(move || {
        let dataset = Dataset::open(&read, simulator.competition()).unwrap();
        let episodes = dataset.episodes().unwrap();
        assert_eq!(episodes[0].interpolation, None);
        assert_eq!(episodes[0].initial_state.len(), 2);
        let workers = NonZero::new(2).unwrap();
        verify(&dataset, simulator.as_ref(), workers, &|| ()).unwrap()
    });
    let verified = verified.await.unwrap();
    assert_eq!((verified.episodes, verified.result.tier), (12, None));
    assert_eq!(verified.result.penalty_points, 12.0);
    // With the simulator of another competition it is refused.
    let other = faceoff_airhockey::simulator();
    let opened = Dataset::open(&archive, other.competition()).unwrap();
    let refused = verify(&opened, other.as_ref(), NonZero::new(1).unwrap(), &|| ());
    let error = refused.unwrap_err().to_string();
    assert!(error.contains("unknown ruleset \"points-1\""), "{error}");

    shutdown.cancel();
    worker.await.unwrap().unwrap();
}
