//! A running site: axum on a loopback port, SQLite in a temporary folder, a clock that tests turn,
//! and the steps that a worker would take.

use faceoff_api::token::hash_token;
use faceoff_http::{
    Capacity, CapacityWatch, ConnectionLimits, HttpConfig, HttpLimits, LeastRate, LinkKey, Offer,
    RateLimits, router,
};
use faceoff_metrics::{Metrics, Process};
use faceoff_notify::WebhookRules;
use faceoff_store::*;
use faceoff_types::*;
use faceoff_wire::grant::GrantKey;
use jiff::{SignedDuration, Timestamp};
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use serde_json::{Value, json};
use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
    time::Duration,
};
use tokio::{net::TcpListener, sync::oneshot, task::JoinHandle};

pub const ADMIN: &str = "fo_admin_0123456789abcdef";
pub const MAX_BUNDLE: u64 = 64 * 1024;
/// The first bytes of a gzip stream; the web side looks no further.
pub const GZIP: [u8; 4] = [0x1f, 0x8b, 8, 0];

/// Of whatever makes clients. None speaks TLS, so none asks for the machine's certificate authorities.
pub fn http() -> reqwest::ClientBuilder {
    reqwest::Client::builder()
        .no_proxy()
        .tls_backend_preconfigured(no_tls())
}

/// Nothing here speaks TLS, so nobody's certificate is believed.
pub fn no_tls() -> rustls::ClientConfig {
    rustls::ClientConfig::builder()
        .with_root_certificates(rustls::RootCertStore::empty())
        .with_no_client_auth()
}

pub struct Site {
    pub url: String,
    pub store: Store,
    pub folder: tempfile::TempDir,
    config: HttpConfig,
    now: Arc<Mutex<Timestamp>>,
    http: reqwest::Client,
    server: JoinHandle<()>,
    /// What makes it end in an orderly way.
    ends: Option<oneshot::Sender<()>>,
}

impl Drop for Site {
    fn drop(&mut self) {
        self.server.abort();
    }
}

pub struct TestTeam {
    pub id: String,
    pub token: String,
}

/// An answer, read to its end.
#[derive(Debug)]
pub struct Answer {
    pub status: StatusCode,
    pub headers: reqwest::header::HeaderMap,
    pub body: String,
}

impl Answer {
    pub async fn of(response: Response) -> Self {
        let (status, headers) = (response.status(), response.headers().clone());
        let body = response.text().await.unwrap();
        Self {
            status,
            headers,
            body,
        }
    }

    pub fn header(&self, name: &str) -> &str {
        self.headers
            .get(name)
            .unwrap_or_else(|| panic!("no {name} in {self:?}"))
            .to_str()
            .unwrap()
    }

    #[track_caller]
    pub fn json(&self, status: u16) -> Value {
        assert_eq!(self.status.as_u16(), status, "{}", self.body);
        assert_eq!(self.header("content-type"), "application/json");
        serde_json::from_str(&self.body).unwrap()
    }

    /// Asserts a whole problem document of this kind, whose detail contains `words`.
    #[track_caller]
    pub fn problem(&self, status: u16, slug: &str, words: &[&str]) -> Value {
        assert_eq!(self.status.as_u16(), status, "{}", self.body);
        assert_eq!(
            self.header("content-type"),
            "application/problem+json",
            "{}",
            self.body
        );
        let problem: Value = serde_json::from_str(&self.body).unwrap();
        assert_eq!(problem["status"], status);
        assert_eq!(problem["type"], format!("/problems#{slug}"), "{problem}");
        assert!(!problem["title"].as_str().unwrap().is_empty());
        let detail = problem["detail"].as_str().unwrap();
        for word in words {
            assert!(detail.contains(word), "{word:?} is not in {detail:?}");
        }
        problem
    }
}

/// As usual, but with a patience that only a dead machine wears out.
pub fn patient() -> HttpLimits {
    HttpLimits {
        answer: Duration::from_secs(600),
        upload_rate: LeastRate {
            bytes_per_s: 1,
            grace: Duration::from_secs(600),
        },
        ..HttpLimits::default()
    }
}

/// Two runtimes, as they might have been found.
fn offer() -> Offer {
    let python = PythonInventory {
        implementation: "CPython".into(),
        version: "3.11.2".into(),
        libc: Some("2.36".into()),
        packages: [("numpy", "2.4.6"), ("<b>odd</b>", "1")]
            .map(|(name, version)| (name.into(), version.into()))
            .into(),
    };
    let inventory = |name: &str, content| RuntimeInventory {
        name: name.into(),
        content,
    };
    let machine = AgentMachine {
        architecture: "x86_64".into(),
        cpu_model: Some("A CPU".into()),
        cpus_per_agent: 1,
    };
    Offer::of(
        AgentLimits::default(),
        machine,
        vec![
            inventory("native", RuntimeContent::Native { libc: None }),
            inventory("python3", RuntimeContent::Python(python)),
            inventory(
                "wrong",
                RuntimeContent::Broken {
                    why: "/secret/folder does not exist".into(),
                },
            ),
        ],
    )
}

impl Site {
    pub async fn start() -> Self {
        Self::start_with(patient()).await
    }

    /// With a schedule, as far as the web side shows it.
    pub async fn start_daily(at: &str) -> Self {
        Self::configured(patient(), Some(at.parse().unwrap())).await
    }

    /// The same server, whose callers may ask so often only.
    pub async fn with_rates(mut self, rates: RateLimits) -> Self {
        self.config.rates = rates;
        self.restart().await;
        self
    }

    /// The same server, which knows the address that others know it by.
    pub async fn at(mut self, public_url: &str) -> Self {
        self.config.public_url = Some(public_url.to_owned());
        self.restart().await;
        self
    }

    pub async fn start_with(limits: HttpLimits) -> Self {
        Self::configured(limits, None).await
    }

    async fn configured(limits: HttpLimits, daily_at: Option<jiff::civil::Time>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let upload_dir = folder.path().join("uploads");
        std::fs::create_dir(&upload_dir).unwrap();
        let store = faceoff_testkit::new_store(folder.path()).await;
        let start: Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
        assert!(
            store
                .set_host_token(hash_token(ADMIN), start)
                .await
                .unwrap()
        );
        store
            .name_season(Actor::Organiser, "Test season", start)
            .await
            .unwrap();
        let schedule = daily_at.map(Schedule::daily);
        stage_by(&store, &plan(), schedule, start).await;
        let now = Arc::new(Mutex::new(start));
        let clock = Arc::clone(&now);
        let config = HttpConfig {
            max_bundle_bytes: MAX_BUNDLE,
            public_url: None,
            upload_dir,
            clock: Clock::new(move || *clock.lock().unwrap()),
            limits,
            capacity: Capacity {
                slots: 2,
                time: TimeLimits::default(),
                runtimes: ["native", "python3"].map(str::to_owned).to_vec(),
            },
            offer: offer(),
            rates: RateLimits::default(),
            link_key: LinkKey::generate().unwrap(),
            metrics: Metrics::new("0.0.0"),
            process: Process::default,
            webhooks: WebhookRules {
                enabled: true,
                allow_http: true,
                ports: Vec::new(),
                allow_private: vec!["127.0.0.0/8".parse().unwrap()],
            },
        };
        let (url, server, ends) = serve(&store, &config).await;
        let http = http().build().unwrap();
        Self {
            url,
            store,
            folder,
            config,
            now,
            http,
            server,
            ends: Some(ends),
        }
    }

    /// A server on a data folder that an archive was imported into, at the moment that it shows.
    pub async fn showing(folder: tempfile::TempDir) -> Self {
        let upload_dir = folder.path().join("uploads");
        std::fs::create_dir(&upload_dir).unwrap();
        let store = Store::open(folder.path()).await.unwrap();
        let made_at = store.archived().unwrap().made_at;
        assert!(
            store
                .set_host_token(hash_token(ADMIN), made_at)
                .await
                .unwrap()
        );
        let config = HttpConfig {
            max_bundle_bytes: MAX_BUNDLE,
            public_url: None,
            upload_dir,
            clock: Clock::new(move || made_at),
            limits: patient(),
            capacity: Capacity {
                slots: 0,
                runtimes: Vec::new(),
                time: TimeLimits::default(),
            },
            offer: Offer::nothing(),
            rates: RateLimits::default(),
            link_key: LinkKey::generate().unwrap(),
            metrics: Metrics::new("0.0.0"),
            process: Process::default,
            webhooks: WebhookRules::default(),
        };
        let (url, server, ends) = serve(&store, &config).await;
        Self {
            url,
            store,
            folder,
            config,
            now: Arc::new(Mutex::new(made_at)),
            http: http().build().unwrap(),
            server,
            ends: Some(ends),
        }
    }

    /// What the server counts of itself.
    pub fn metrics(&self) -> &Metrics {
        &self.config.metrics
    }

    /// Another server on the same folder, which remembers nothing.
    pub async fn restart(&mut self) {
        self.server.abort();
        let (url, server, ends) = serve(&self.store, &self.config).await;
        (self.url, self.server, self.ends) = (url, server, Some(ends));
    }

    /// Ends the server as a signal does, and waits until it has ended.
    pub async fn end(&mut self) {
        self.ends.take().unwrap().send(()).unwrap();
        (&mut self.server).await.unwrap();
    }

    /// What warns of days that do not fit, with nothing seen yet.
    /// What it seals grants of work orders with.
    pub fn grant_key(&self) -> GrantKey {
        self.config.link_key.of_grants()
    }

    pub fn capacity_watch(&self) -> CapacityWatch {
        let HttpConfig {
            clock, capacity, ..
        } = self.config.clone();
        CapacityWatch::new(self.store.clone(), clock, capacity)
    }

    pub fn clock(&self) -> Clock {
        self.config.clock.clone()
    }

    pub fn now(&self) -> Timestamp {
        *self.now.lock().unwrap()
    }

    pub fn later(&self, seconds: i64) {
        *self.now.lock().unwrap() += SignedDuration::from_secs(seconds);
    }

    pub fn turn_to(&self, now: Timestamp) {
        *self.now.lock().unwrap() = now;
    }

    pub fn next_day(&self) {
        *self.now.lock().unwrap() += SignedDuration::from_hours(24);
    }

    /// A request; paths that begin with `/api` or not are taken as they are.
    pub fn request(&self, method: Method, path: &str, token: Option<&str>) -> RequestBuilder {
        let request = self.http.request(method, format!("{}{path}", self.url));
        match token {
            Some(token) => request.bearer_auth(token),
            None => request,
        }
    }

    pub async fn get(&self, path: &str, token: Option<&str>) -> Answer {
        Answer::of(self.request(Method::GET, path, token).send().await.unwrap()).await
    }

    pub async fn post(&self, path: &str, token: Option<&str>, body: &Value) -> Answer {
        let request = self.request(Method::POST, path, token).json(body);
        Answer::of(request.send().await.unwrap()).await
    }

    pub async fn upload(&self, token: &str, body: impl Into<reqwest::Body>) -> Answer {
        let request = self
            .request(
                Method::POST,
                "/api/v1/submissions?file_name=striker.tar.gz",
                Some(token),
            )
            .header("content-type", "application/octet-stream")
            .body(body);
        Answer::of(request.send().await.unwrap()).await
    }

    pub async fn team(&self, name: &str) -> TestTeam {
        let answer = self
            .post("/api/v1/teams", Some(ADMIN), &json!({ "name": name }))
            .await;
        let team = answer.json(201);
        TestTeam {
            id: text(&team["id"]),
            token: text(&team["token"]),
        }
    }

    /// Uploads a bundle and finds it valid, as a worker's smoke run would; the submission's path.
    pub async fn valid_submission(&self, team: &TestTeam, agent: &str) -> String {
        let submission = self.upload(&team.token, GZIP.to_vec()).await.json(201);
        let outcome = SmokeOutcome::Valid {
            runtime: "native".into(),
            agent_name: agent.into(),
            timing: Vec::new(),
            log: "ready\n".into(),
        };
        self.smoke(outcome).await;
        format!("/api/v1/submissions/{}", text(&submission["id"]))
    }

    /// Ends the next smoke run.
    pub async fn smoke(&self, outcome: SmokeOutcome) {
        let Claimed { claim, work } = self.claim().await;
        assert!(matches!(work, Work::Smoke { .. }), "claimed {work:?}");
        self.store
            .commit_smoke(&claim, outcome, self.now())
            .await
            .unwrap();
    }

    pub async fn claim(&self) -> Claimed {
        self.store
            .claim("slot 0", 60, self.now())
            .await
            .unwrap()
            .expect("work is queued")
    }

    pub async fn claim_shard(&self) -> (Claim, Run, Shard) {
        let Claimed { claim, work } = self.claim().await;
        match work {
            Work::Shard { run, shard, .. } => (claim, run, shard),
            other => panic!("expected a shard, claimed {other:?}"),
        }
    }

    /// Plays the shards of the evaluation that comes next, with `faults` agent faults in each.
    pub async fn play_shards(&self, faults: usize) {
        for _ in Task::ALL {
            let (claim, run, shard) = self.claim_shard().await;
            let commit = ShardCommit {
                outcomes: (shard.first_episode..shard.end_episode)
                    .map(|episode| outcome(shard.task, episode, (episode as usize) < faults))
                    .collect(),
                log: format!("log of {}\n", shard.task),
                stopped_by_faults: false,
                recording: Some(claim.recording_key(run.id)),
            };
            self.store
                .commit_shard(&claim, commit, self.now())
                .await
                .unwrap();
            if faults > 0 {
                // one shard's faults are more than the plan forgives
                return;
            }
        }
    }

    /// Plays the evaluation that comes next and scores it as given.
    pub async fn finish(&self, result: &EvaluationResult) {
        self.play_shards(0).await;
        let Claimed { claim, work } = self.claim().await;
        let Work::Finalise { evaluation, .. } = work else {
            panic!("expected a finalisation");
        };
        self.publish(&claim, evaluation, result).await;
    }

    /// The season's first stage.
    pub async fn stage(&self) -> StageId {
        self.store.stages().await.unwrap()[0].id
    }

    /// Starts the day with what all teams have active, unless that was done; the path in the API of the
    /// team's evaluation, which plays this submission.
    pub async fn evaluate(&self, team: &TestTeam, submission: &str) -> String {
        match self
            .store
            .start_day(Actor::Organiser, self.stage().await, self.now())
            .await
        {
            Ok(_) | Err(StoreError::DayHasCut { .. }) => {}
            Err(error) => panic!("{error}"),
        }
        let of_team = self.store.evaluations_of(team.id.parse().unwrap()).await;
        let newest = &of_team.unwrap()[0];
        assert!(submission.ends_with(&newest.submission.to_string()));
        format!("/api/v1/evaluations/{}", newest.id)
    }

    /// Plays the evaluation that comes next, episode by episode as `played` says, and scores it by the
    /// rules; the evaluation's id.
    pub async fn finish_as(&self, played: impl Fn(Task, u32) -> EpisodeOutcome) -> EvaluationId {
        let mut outcomes = Vec::new();
        loop {
            let Claimed { claim, work } = self.claim().await;
            match work {
                Work::Shard { run, shard, .. } => {
                    let of_shard: Vec<_> = (shard.first_episode..shard.end_episode)
                        .map(|episode| played(shard.task, episode))
                        .collect();
                    outcomes.extend(of_shard.iter().cloned());
                    let commit = ShardCommit {
                        outcomes: of_shard,
                        log: String::new(),
                        stopped_by_faults: false,
                        recording: Some(claim.recording_key(run.id)),
                    };
                    let committed = self.store.commit_shard(&claim, commit, self.now());
                    assert_eq!(committed.await.unwrap(), Committed::Now);
                }
                Work::Finalise {
                    evaluation,
                    run,
                    seeds,
                    ..
                } => {
                    let result = scored(&run, seeds.episodes, &outcomes);
                    self.publish(&claim, evaluation, &result).await;
                    return evaluation;
                }
                other => panic!("expected a shard or a finalisation, claimed {other:?}"),
            }
        }
    }

    /// Ends an evaluation with its score and a dataset.
    pub async fn publish(&self, claim: &Claim, id: EvaluationId, result: &EvaluationResult) {
        let dataset = self.folder.path().join("dataset.zip");
        let archive = b"PK the recorded dataset";
        std::fs::write(&dataset, archive).unwrap();
        let hash = blake3::hash(archive).to_string();
        let key = format!("datasets/{id}.zip");
        self.store
            .artifacts()
            .put_file(&key, &dataset)
            .await
            .unwrap();
        self.store
            .finish_evaluation(claim, result, &key, &hash, self.now())
            .await
            .unwrap();
    }

    /// A day of `episodes` of each task on which these new teams' agents played as the functions say, and
    /// those of older teams as the first one; the new teams' evaluations.
    pub async fn played_day<const N: usize>(
        &self,
        episodes: u32,
        teams: [(&str, Played<'_>); N],
    ) -> [EvaluationId; N] {
        for (name, _) in &teams {
            let team = self.team(name).await;
            self.valid_submission(&team, name).await;
        }
        let plan = RunPlan {
            episodes_per_task: episodes,
            episodes_per_shard: 50,
            max_faults: 0,
            ..plan()
        };
        let stage = stage_by(&self.store, &plan, None, self.now()).await;
        let started = self.store.start_day(Actor::Organiser, stage, self.now());
        let started = started.await.unwrap();
        let mut by_name = BTreeMap::new();
        for evaluation in &started {
            let name = self.store.team(evaluation.team).await.unwrap().name;
            let of_team = teams.iter().find(|(new, _)| *new == name.as_str());
            let (_, played) = of_team.unwrap_or(&teams[0]);
            assert_eq!(self.finish_as(played).await, evaluation.id);
            by_name.insert(name.to_string(), evaluation.id);
        }
        teams.map(|(name, _)| by_name[name])
    }

    /// A day of new teams with these scores.
    pub async fn ranked_teams(&self, teams: &[(&str, EvaluationResult)]) {
        for (name, _) in teams {
            let team = self.team(name).await;
            self.valid_submission(&team, &format!("{name}-agent")).await;
        }
        let started = self.post("/api/v1/days", Some(ADMIN), &json!({})).await;
        started.json(200);
        for (_, result) in teams {
            self.finish(result).await;
        }
    }
}

/// What these episodes of a run come to, by the rules.
pub fn scored(run: &Run, seed: Seed, outcomes: &[EpisodeOutcome]) -> EvaluationResult {
    let plan = &run.plan;
    let tasks = plan.tasks.iter().map(|task| {
        let of_task: Vec<_> = outcomes
            .iter()
            .filter(|outcome| outcome.task == *task)
            .cloned()
            .collect();
        let bounds = &plan.variation.tier_bounds;
        (
            *task,
            faceoff_scoring::score_task(&of_task, &Default::default(), bounds),
        )
    });
    faceoff_scoring::score_evaluation(
        run.ruleset,
        plan.profile,
        seed,
        &plan.variation,
        tasks.collect(),
    )
}

/// What the first stage plays.
fn plan() -> RunPlan {
    RunPlan {
        profile: Profile::Evaluation,
        tasks: Task::ALL.to_vec(),
        episodes_per_task: 4,
        episodes_per_shard: 4,
        max_faults: 1,
        variation: Default::default(),
        limits: Default::default(),
    }
}

/// The season's first stage, which plays by this plan from now on.
async fn stage_by(
    store: &Store,
    plan: &RunPlan,
    schedule: Option<Schedule>,
    now: Timestamp,
) -> StageId {
    let rules = StageRules {
        runtimes: None,
        ruleset: Ruleset::CURRENT,
        profile: plan.profile,
        tasks: plan.tasks.clone(),
        episodes_per_task: plan.episodes_per_task,
        max_faults: plan.max_faults,
        variation: Default::default(),
        limits: Default::default(),
    };
    let settings = StageSettings {
        schedule,
        episodes_per_shard: plan.episodes_per_shard,
        ..StageSettings::default()
    };
    store
        .configure_stage(rules, settings, Zone::UTC, now)
        .await
        .unwrap();
    store.stages().await.unwrap()[0].id
}

/// How an agent played.
pub type Played<'a> = &'a dyn Fn(Task, u32) -> EpisodeOutcome;

/// A patience that only a dead machine wears out.
fn connections() -> ConnectionLimits {
    ConnectionLimits {
        head: Duration::from_secs(600),
        reading: LeastRate {
            bytes_per_s: 1,
            grace: Duration::from_secs(600),
        },
        ..ConnectionLimits::default()
    }
}

async fn serve(
    store: &Store,
    config: &HttpConfig,
) -> (String, JoinHandle<()>, oneshot::Sender<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let site = router(store.clone(), config.clone());
    let (ends, end) = oneshot::channel();
    let server = tokio::spawn(async move {
        let until = async move {
            // Without a word it goes on: who sends none has dropped it.
            if end.await.is_err() {
                std::future::pending().await
            }
        };
        faceoff_http::serve(listener, site, connections(), until).await;
    });
    (url, server, ends)
}

pub fn text(value: &Value) -> String {
    value
        .as_str()
        .unwrap_or_else(|| panic!("{value} is no text"))
        .to_owned()
}

pub fn outcome(task: Task, episode: u32, faulty: bool) -> EpisodeOutcome {
    let fault = faulty.then(|| AgentFault {
        fault: AgentFaultKind::NonFinite,
        contest: task.into(),
        episode: Some(episode),
        step: Some(3),
        line: Some("{\"type\":\"act\"}".into()),
    });
    EpisodeOutcome {
        task,
        episode,
        steps: 17,
        end: if faulty {
            EpisodeEnd::AgentFault
        } else {
            EpisodeEnd::LeftTable
        },
        success: !faulty,
        violations: Violations::default(),
        computation_time: ComputationTime {
            mean_s: 1e-4,
            max_s: 1e-3,
        },
        fault,
    }
}

/// A result with these success rates (hit, defend, prepare) over 1000 episodes and these overall
/// penalty points, all of them from `hit`.
pub fn result(rates: [f64; 3], penalty_points: f64) -> EvaluationResult {
    let tier = match penalty_points {
        points if points <= 500.0 => Tier::Deployable,
        points if points <= 1500.0 => Tier::Improvable,
        _ => Tier::NonDeployable,
    };
    let tasks = Task::ALL
        .into_iter()
        .zip(rates)
        .map(|(task, rate)| {
            let is_hit = task == Task::Hit;
            let result = TaskResult {
                episodes: 1000,
                successes: (1000.0 * rate) as u32,
                success_rate: rate,
                success_ci95: [(rate - 0.03).max(0.0), (rate + 0.03).min(1.0)],
                penalty_points: if is_hit { penalty_points } else { 0.0 },
                violations: ViolationCounts {
                    ee: 7,
                    ..ViolationCounts::default()
                },
                tier: if is_hit { tier } else { Tier::Deployable },
                steps: 123_456,
                computation_time_s: ComputationTimeSummary {
                    mean: 2e-4,
                    p99: 9e-4,
                    max: 0.012,
                },
            };
            (task, result)
        })
        .collect();
    EvaluationResult {
        ruleset: RULESET.into(),
        profile: Profile::Evaluation,
        seed: Seed::from_number(7),
        tasks,
        score: 100.0 * (0.4 * rates[0] + 0.4 * rates[1] + 0.2 * rates[2]),
        penalty_points,
        tier,
        timing: Some(SlotTiming {
            before_s: RoundTrips {
                count: 200,
                p50: 21e-6,
                p99: 83e-6,
                max: 4.2e-4,
            },
            during_s: RoundTrips {
                count: 3000,
                p50: 22e-6,
                p99: 95e-6,
                max: 0.0312,
            },
            longest_stall_s: 0.0305,
            host_noise_reruns: 2,
            platform_retries: 1,
        }),
        variation: Default::default(),
    }
}
