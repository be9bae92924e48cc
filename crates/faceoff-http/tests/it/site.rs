//! A running server for tests: axum on a loopback port, SQLite in a temporary folder, a clock that tests set, and helpers that
//! take the steps of a worker (a process that runs jobs): they claim a job and commit its outcome.

use faceoff_airhockey::{AirHockey, EVALUATION, HIT, TASKS};
use faceoff_api::token::hash_token;
use faceoff_episode::Simulator;
use faceoff_http::{
    AgentResources, Capacity, CapacityMonitor, ConnectionLimits, Download, Downloads, HttpConfig,
    HttpLimits, LinkKey, MinTransferRate, RateLimits, router,
};
use faceoff_live::LiveState;
use faceoff_metrics::{Metrics, Process};
use faceoff_notify::WebhookRules;
use faceoff_store::*;
pub use faceoff_testkit::outcome;
use faceoff_testkit::{
    configure_stage, shard_commit, shard_outcomes, six_shard_plan, valid_outcome,
};
use faceoff_types::*;
use faceoff_wire::grant::GrantKey;
use jiff::{SignedDuration, Timestamp};
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use scraper::Html;
use serde_json::{Value, json};
use std::{
    collections::BTreeMap,
    fmt::Display,
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
    time::Duration,
};
use tokio::{net::TcpListener, sync::oneshot, task::JoinHandle};

/// The operator's token, which has an organiser's rights.
pub const ADMIN: &str = "fo_admin_0123456789abcdef";
/// Largest bundle that the site accepts.
pub const MAX_BUNDLE_BYTES: u64 = 64 * 1024;
/// How long a claimed job is leased.
pub const LEASE_S: u32 = 60;
/// The dataset of all evaluations: begins like a zip file.
pub const DATASET: &str = "PK the recorded dataset";
/// The first bytes of a gzip stream. The web side checks no more of a bundle.
pub const GZIP: [u8; 4] = [0x1f, 0x8b, 8, 0];

/// Clients of tests do not use TLS, so they do not load the system's certificate authorities.
pub fn client_builder() -> reqwest::ClientBuilder {
    reqwest::Client::builder()
        .no_proxy()
        .tls_backend_preconfigured(no_tls())
}

/// A TLS configuration that trusts no certificate, since no test uses TLS.
pub fn no_tls() -> rustls::ClientConfig {
    rustls::ClientConfig::builder()
        .with_root_certificates(rustls::RootCertStore::empty())
        .with_no_client_auth()
}

/// A server, its data, and a client of it.
pub struct Site {
    pub url: String,
    pub store: Store,
    pub live: LiveState,
    /// The server's data folder.
    pub folder: tempfile::TempDir,
    config: HttpConfig,
    /// The time of the server's clock.
    now: Arc<Mutex<Timestamp>>,
    /// How far the system clock is ahead of `now`; only a site [`with_steady_clock`](Self::with_steady_clock) notices it.
    system_ahead: Arc<Mutex<SignedDuration>>,
    http: reqwest::Client,
    server: JoinHandle<()>,
    /// Sends the signal for an orderly shutdown.
    shutdown: Option<oneshot::Sender<()>>,
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

/// A response with its whole body.
#[derive(Debug)]
pub struct Answer {
    pub status: StatusCode,
    pub headers: reqwest::header::HeaderMap,
    pub body: String,
}

impl Answer {
    pub async fn read(response: Response) -> Self {
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

    /// Asserts the status, and returns the JSON body.
    #[track_caller]
    pub fn json(&self, status: u16) -> Value {
        assert_eq!(self.status.as_u16(), status, "{}", self.body);
        assert_eq!(self.header("content-type"), "application/json");
        serde_json::from_str(&self.body).unwrap()
    }

    /// Asserts the status, and parses the body, which must be valid HTML.
    #[track_caller]
    pub fn html(&self, status: u16) -> Html {
        assert_eq!(self.status.as_u16(), status, "{}", self.body);
        let html = Html::parse_document(&self.body);
        assert!(html.errors.is_empty(), "{:?}\n{}", html.errors, self.body);
        html
    }

    /// Asserts that the body is a problem document of the kind `slug`, and that its detail contains all `words`.
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

/// Copies the files below one folder into another one, which exists.
fn copy_folder(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let (source, target) = (entry.path(), to.join(entry.file_name()));
        if source.is_dir() {
            std::fs::create_dir(&target).unwrap();
            copy_folder(&source, &target);
        } else {
            std::fs::copy(&source, &target).unwrap();
        }
    }
}

/// The default limits, with time limits that no working machine reaches.
pub fn generous_limits() -> HttpLimits {
    HttpLimits {
        request_timeout: Duration::from_secs(600),
        min_upload_rate: MinTransferRate {
            bytes_per_s: 1,
            grace: Duration::from_secs(600),
        },
        ..HttpLimits::default()
    }
}

/// Two runtimes that work, and one, “wrong”, that is broken. A package name contains HTML, which pages must escape.
fn agent_resources() -> AgentResources {
    let python = PythonInventory {
        implementation: "CPython".into(),
        version: "3.11.2".into(),
        libc: Some("2.36".into()),
        packages: [("numpy", "2.4.6"), ("<b>odd</b>", "1")]
            .map(|(name, version)| (name.into(), version.into()))
            .into(),
        unusable_packages: BTreeMap::new(),
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
    AgentResources::with_inventories(
        AgentLimits::default(),
        machine,
        vec![
            inventory("native", RuntimeContent::Native { libc: None }),
            inventory("python3", RuntimeContent::Python(python)),
            inventory(
                "wrong",
                RuntimeContent::Failed {
                    reason: "/secret/folder does not exist".into(),
                },
            ),
        ],
    )
}

/// The configuration of a server that runs no agents.
fn config_without_slots(upload_dir: PathBuf, clock: Clock) -> HttpConfig {
    HttpConfig {
        simulator: faceoff_airhockey::simulator(),
        max_bundle_bytes: MAX_BUNDLE_BYTES,
        downloads: Arc::default(),
        source_url: None,
        public_url: None,
        upload_dir,
        clock,
        limits: generous_limits(),
        capacity: Capacity {
            longest_episode_s: faceoff_airhockey::competition().longest_episode_s(),
            slots: 0,
            runtimes: Vec::new(),
            time: TimeLimits::default(),
        },
        agent_resources: AgentResources::none(),
        rate_limits: RateLimits::default(),
        link_key: LinkKey::generate().unwrap(),
        metrics: Metrics::new("0.0.0"),
        process: Process::default,
        webhooks: WebhookRules::default(),
    }
}

impl Site {
    pub async fn start() -> Self {
        Self::start_with(generous_limits()).await
    }

    /// A site whose first stage has a daily schedule. No scheduler runs.
    pub async fn start_with_schedule(daily_at: &str) -> Self {
        Self::start_configured(generous_limits(), Some(daily_at.parse().unwrap())).await
    }

    /// Restarts the server with these rate limits.
    pub async fn with_rate_limits(mut self, rates: RateLimits) -> Self {
        self.config.rate_limits = rates;
        self.restart().await;
        self
    }

    /// Restarts the server with a clock that compares the system clock with a monotonic clock.
    /// [`advance`](Self::advance) moves both clocks, [`set_system_clock`](Self::set_system_clock) only the system clock.
    pub async fn with_steady_clock(mut self, start: ClockStart) -> Self {
        let (system, monotonic) = (Arc::clone(&self.now), Arc::clone(&self.now));
        let ahead = Arc::clone(&self.system_ahead);
        self.config.clock = Clock::steady(
            move || *system.lock().unwrap() + *ahead.lock().unwrap(),
            move || monotonic.lock().unwrap().as_duration(),
            start,
        );
        self.restart().await;
        self
    }

    /// Sets the system clock to be this far ahead of the right time.
    pub fn set_system_clock(&self, ahead: SignedDuration) {
        *self.system_ahead.lock().unwrap() = ahead;
    }

    /// Restarts the server with a public URL.
    pub async fn with_public_url(mut self, public_url: &str) -> Self {
        self.config.public_url = Some(public_url.to_owned());
        self.restart().await;
        self
    }

    /// Restarts the server with a competition that has no tiers.
    pub async fn without_tiers(self) -> Self {
        let competition = Competition {
            tiers: None,
            ..faceoff_airhockey::competition()
        };
        let simulator = AirHockey::with_competition(competition);
        self.with_simulator(Arc::new(simulator)).await
    }

    /// Restarts the server with these downloads and this address of the source code.
    pub async fn with_downloads(mut self, downloads: Vec<Download>, source_url: &str) -> Self {
        self.config.downloads = Arc::new(Downloads::new(downloads));
        self.config.source_url = Some(source_url.to_owned());
        self.restart().await;
        self
    }

    /// Restarts the server with another competition.
    pub async fn with_simulator(mut self, simulator: Arc<dyn Simulator>) -> Self {
        self.config.simulator = simulator;
        self.restart().await;
        self
    }

    /// A site with these limits, and without a schedule.
    pub async fn start_with(limits: HttpLimits) -> Self {
        Self::start_configured(limits, None).await
    }

    async fn start_configured(limits: HttpLimits, daily_at: Option<jiff::civil::Time>) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let upload_dir = folder.path().join("uploads");
        std::fs::create_dir(&upload_dir).unwrap();
        let store = faceoff_testkit::new_store(folder.path()).await;
        let start: Timestamp = "2026-03-01T10:00:00Z".parse().unwrap();
        assert!(
            store
                .set_operator_token(hash_token(ADMIN), start)
                .await
                .unwrap()
        );
        store
            .name_season(Actor::Operator, "Test season", start)
            .await
            .unwrap();
        let schedule = daily_at.map(Schedule::daily);
        configure_stage(&store, &plan(), schedule, start).await;
        let now = Arc::new(Mutex::new(start));
        let clock = Arc::clone(&now);
        let clock = Clock::new(move || *clock.lock().unwrap());
        let config = HttpConfig {
            limits,
            capacity: Capacity {
                longest_episode_s: faceoff_airhockey::competition().longest_episode_s(),
                slots: 2,
                time: TimeLimits::default(),
                runtimes: ["native", "python3"].map(str::to_owned).to_vec(),
            },
            agent_resources: agent_resources(),
            webhooks: WebhookRules {
                enabled: true,
                allow_http: true,
                ports: Vec::new(),
                allow_private: vec!["127.0.0.0/8".parse().unwrap()],
            },
            ..config_without_slots(upload_dir, clock)
        };
        Self::serve(store, folder, config, now).await
    }

    async fn serve(
        store: Store,
        folder: tempfile::TempDir,
        config: HttpConfig,
        now: Arc<Mutex<Timestamp>>,
    ) -> Self {
        let live = LiveState::default();
        let (url, server, shutdown) = serve(&store, &live, &config).await;
        Self {
            url,
            store,
            live,
            folder,
            config,
            now,
            system_ahead: Arc::default(),
            http: client_builder().build().unwrap(),
            server,
            shutdown: Some(shutdown),
        }
    }

    /// A server on a data folder with an imported archive. Its clock shows the time at which the archive was made.
    pub async fn open_archive(folder: tempfile::TempDir) -> Self {
        let upload_dir = folder.path().join("uploads");
        std::fs::create_dir(&upload_dir).unwrap();
        let store = Store::open(folder.path()).await.unwrap();
        let made_at = store.archived_season().unwrap().made_at;
        assert!(
            store
                .set_operator_token(hash_token(ADMIN), made_at)
                .await
                .unwrap()
        );
        let config = config_without_slots(upload_dir, Clock::new(move || made_at));
        Self::serve(store, folder, config, Arc::new(Mutex::new(made_at))).await
    }

    /// Shuts the server down and closes its season, so that [`copy`](Self::copy) can copy it.
    pub async fn close(&mut self) {
        self.shut_down().await;
        self.store.close().await;
    }

    /// Another server on a copy of a closed season, with the same clock.
    pub async fn copy(&self) -> Self {
        let folder = tempfile::tempdir().unwrap();
        copy_folder(self.folder.path(), folder.path());
        let store = Store::open(folder.path()).await.unwrap();
        let config = HttpConfig {
            upload_dir: folder.path().join("uploads"),
            ..self.config.clone()
        };
        Self::serve(store, folder, config, Arc::clone(&self.now)).await
    }

    /// The metrics of the server.
    pub fn metrics(&self) -> &Metrics {
        &self.config.metrics
    }

    /// Replaces the server by a new one on the same folder, with empty caches.
    pub async fn restart(&mut self) {
        self.server.abort();
        let (url, server, shutdown) = serve(&self.store, &self.live, &self.config).await;
        (self.url, self.server, self.shutdown) = (url, server, Some(shutdown));
    }

    /// Shuts the server down as a signal does, and waits for its end.
    pub async fn shut_down(&mut self) {
        self.shutdown.take().unwrap().send(()).unwrap();
        (&mut self.server).await.unwrap();
    }

    /// The key that seals the grants of jobs.
    pub fn grant_key(&self) -> GrantKey {
        self.config.link_key.grant_key()
    }

    /// A monitor that warns if a day will not finish in time, and that has not checked any day yet.
    pub fn capacity_monitor(&self) -> CapacityMonitor {
        let HttpConfig {
            clock, capacity, ..
        } = self.config.clone();
        CapacityMonitor::new(
            self.store.clone(),
            self.live.workers.clone(),
            clock,
            capacity,
        )
    }

    pub fn clock(&self) -> Clock {
        self.config.clock.clone()
    }

    pub fn now(&self) -> Timestamp {
        *self.now.lock().unwrap()
    }

    pub fn advance(&self, seconds: i64) {
        *self.now.lock().unwrap() += SignedDuration::from_secs(seconds);
    }

    pub fn set_time(&self, now: Timestamp) {
        *self.now.lock().unwrap() = now;
    }

    pub fn next_day(&self) {
        *self.now.lock().unwrap() += SignedDuration::from_hours(24);
    }

    /// A request to this path of the site, which is used unchanged.
    pub fn request(&self, method: Method, path: &str, token: Option<&str>) -> RequestBuilder {
        let request = self.http.request(method, format!("{}{path}", self.url));
        match token {
            Some(token) => request.bearer_auth(token),
            None => request,
        }
    }

    pub async fn get(&self, path: &str, token: Option<&str>) -> Answer {
        Answer::read(self.request(Method::GET, path, token).send().await.unwrap()).await
    }

    /// Sends a JSON body by this method.
    pub async fn send(
        &self,
        method: Method,
        path: &str,
        token: Option<&str>,
        body: &Value,
    ) -> Answer {
        let request = self.request(method, path, token).json(body);
        Answer::read(request.send().await.unwrap()).await
    }

    pub async fn post(&self, path: &str, token: Option<&str>, body: &Value) -> Answer {
        self.send(Method::POST, path, token, body).await
    }

    pub async fn patch(&self, path: &str, token: Option<&str>, body: &Value) -> Answer {
        self.send(Method::PATCH, path, token, body).await
    }

    /// Changes a stage as an organiser.
    pub async fn change_stage(&self, stage: impl Display, body: Value) -> Answer {
        let path = format!("/api/v1/stages/{stage}");
        self.patch(&path, Some(ADMIN), &body).await
    }

    /// Changes the season's first stage as an organiser.
    pub async fn change_first_stage(&self, body: Value) -> Answer {
        self.change_stage(self.stage().await, body).await
    }

    /// Uploads `body` as the bundle of a submission.
    pub async fn upload(&self, token: &str, body: impl Into<reqwest::Body>) -> Answer {
        let request = self
            .request(
                Method::POST,
                "/api/v1/submissions?file_name=striker.tar.gz",
                Some(token),
            )
            .header("content-type", "application/octet-stream")
            .body(body);
        Answer::read(request.send().await.unwrap()).await
    }

    /// Creates a team.
    pub async fn team(&self, name: &str) -> TestTeam {
        let answer = self
            .post("/api/v1/teams", Some(ADMIN), &json!({ "name": name }))
            .await;
        let team = answer.json(201);
        TestTeam {
            id: string(&team["id"]),
            token: string(&team["token"]),
        }
    }

    /// Uploads a bundle and commits a successful validation run of it, so that it becomes the team's active submission.
    /// Returns the submission's path in the API.
    pub async fn valid_submission(&self, team: &TestTeam, agent_name: &str) -> String {
        let submission = self.upload(&team.token, GZIP.to_vec()).await.json(201);
        let outcome = valid_outcome("native", agent_name, "ready\n");
        self.finish_validation(outcome).await;
        format!("/api/v1/submissions/{}", string(&submission["id"]))
    }

    /// Claims the next validation run and commits its outcome.
    pub async fn finish_validation(&self, outcome: ValidationOutcome) {
        faceoff_testkit::finish_validation(&self.store, outcome, self.now()).await;
    }

    /// Claims the next job.
    pub async fn claim(&self) -> ClaimedJob {
        self.store
            .claim("slot 0", LEASE_S, self.now())
            .await
            .unwrap()
            .expect("a job is queued")
    }

    /// Claims the next job, which must be a shard: some episodes of a task.
    pub async fn claim_shard(&self) -> (JobClaim, Run, Shard) {
        let ClaimedJob { claim, job } = self.claim().await;
        match job {
            Job::Shard { run, shard, .. } => (claim, run, shard),
            other => panic!("expected a shard, claimed {other:?}"),
        }
    }

    /// Runs the shards of the next evaluation (one of each task), with `faults` agent faults in each. The plan allows one fault, so with
    /// more the first shard ends the evaluation as failed.
    pub async fn run_shards_with_faults(&self, faults: usize) {
        for _ in TASKS {
            let (claim, run, shard) = self.claim_shard().await;
            let outcomes = shard_outcomes(&shard, |task, episode| {
                outcome(task, episode, (episode as usize) < faults)
            });
            let commit = ShardCommit {
                log: format!("log of {}\n", shard.task),
                ..shard_commit(outcomes, Some(claim.recording_key(run.id)))
            };
            self.store
                .commit_shard(&claim, commit, self.now())
                .await
                .unwrap();
            if faults > 0 {
                // The evaluation has failed, so its other shards do not run.
                return;
            }
        }
    }

    /// Runs the next evaluation without faults and commits this result.
    pub async fn finish_evaluation(&self, result: &EvaluationResult) {
        self.run_shards_with_faults(0).await;
        let ClaimedJob { claim, job } = self.claim().await;
        let Job::Scoring { evaluation, .. } = job else {
            panic!("expected a scoring job");
        };
        self.commit_evaluation(&claim, evaluation, result).await;
    }

    /// The season's first stage.
    pub async fn stage(&self) -> StageId {
        self.store.stages().await.unwrap()[0].id
    }

    /// Starts the evaluation day with the active submissions of all teams, unless it has started. Returns the API path of the
    /// team's evaluation, which must be of `submission`.
    pub async fn start_evaluation(&self, team: &TestTeam, submission: &str) -> String {
        match self
            .store
            .start_day(Actor::Operator, self.stage().await, self.now())
            .await
        {
            Ok(_) | Err(StoreError::CutoffPassed { .. }) => {}
            Err(error) => panic!("{error}"),
        }
        let evaluations = self.store.evaluations_of(team.id.parse().unwrap()).await;
        let newest = &evaluations.unwrap()[0];
        assert!(submission.ends_with(&newest.submission.to_string()));
        format!("/api/v1/evaluations/{}", newest.id)
    }

    /// Creates a team with a valid submission, and starts its evaluation. Returns also the paths of both in the API.
    pub async fn team_with_evaluation(
        &self,
        name: &str,
        agent_name: &str,
    ) -> (TestTeam, String, String) {
        let team = self.team(name).await;
        let submission = self.valid_submission(&team, agent_name).await;
        let evaluation = self.start_evaluation(&team, &submission).await;
        (team, submission, evaluation)
    }

    /// Runs the next evaluation with the outcomes that `outcome_fn` returns for its episodes, and scores it by the rules.
    /// Returns the evaluation's id.
    pub async fn run_evaluation(
        &self,
        outcome_fn: impl Fn(Task, u32) -> EpisodeOutcome,
    ) -> EvaluationId {
        let mut outcomes = Vec::new();
        loop {
            let ClaimedJob { claim, job } = self.claim().await;
            match job {
                Job::Shard { run, shard, .. } => {
                    let new_outcomes = shard_outcomes(&shard, &outcome_fn);
                    outcomes.extend(new_outcomes.iter().cloned());
                    let commit = shard_commit(new_outcomes, Some(claim.recording_key(run.id)));
                    let committed = self.store.commit_shard(&claim, commit, self.now());
                    assert_eq!(committed.await.unwrap(), CommitOutcome::Stored);
                }
                Job::Scoring {
                    evaluation,
                    run,
                    seeds,
                    ..
                } => {
                    let result = score_outcomes(&run, seeds.episodes, &outcomes);
                    self.commit_evaluation(&claim, evaluation, &result).await;
                    return evaluation;
                }
                other => panic!("expected a shard or a scoring job, claimed {other:?}"),
            }
        }
    }

    /// Commits the result of an evaluation with [`DATASET`] as its dataset.
    pub async fn commit_evaluation(
        &self,
        claim: &JobClaim,
        id: EvaluationId,
        result: &EvaluationResult,
    ) {
        let dataset = self.folder.path().join("dataset.zip");
        std::fs::write(&dataset, DATASET).unwrap();
        let hash = blake3::hash(DATASET.as_bytes()).to_string();
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

    /// Adds these teams, and evaluates a day with `episodes` of each task. The function beside a team's name gives its outcomes;
    /// teams that exist already use the first function. Returns the evaluations of the new teams.
    pub async fn run_day<const N: usize>(
        &self,
        episodes: u32,
        teams: [(&str, OutcomeFn<'_>); N],
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
        let stage = configure_stage(&self.store, &plan, None, self.now()).await;
        let started = self.store.start_day(Actor::Operator, stage, self.now());
        let started = started.await.unwrap();
        let mut ids_by_team = BTreeMap::new();
        for evaluation in &started {
            let name = self.store.team(evaluation.team).await.unwrap().name;
            let outcome_fn = teams
                .iter()
                .find(|(new_name, _)| *new_name == name.as_str());
            let (_, outcome_fn) = outcome_fn.unwrap_or(&teams[0]);
            assert_eq!(self.run_evaluation(outcome_fn).await, evaluation.id);
            ids_by_team.insert(name.to_string(), evaluation.id);
        }
        teams.map(|(name, _)| ids_by_team[name])
    }

    /// Publishes an announcement, which is an event of the kind `announced`.
    pub async fn announce(&self) {
        let announcement = json!({ "title": "News", "text": "of this test" });
        let path = "/api/v1/announcements";
        self.post(path, Some(ADMIN), &announcement).await.json(201);
    }

    /// Starts the evaluation day as an organiser. Returns the response.
    pub async fn start_day(&self) -> Value {
        let started = self.post("/api/v1/days", Some(ADMIN), &json!({})).await;
        started.json(200)
    }

    /// Runs an evaluation day on which the teams have these success rates in all tasks.
    pub async fn run_day_with_rates(&self, rates: &[f64]) {
        self.start_day().await;
        for rate in rates {
            self.finish_evaluation(&result([*rate; 3], 10.0)).await;
        }
    }

    /// Adds these teams, and evaluates a day on which they get these results. All teams must be new.
    pub async fn add_ranked_teams(&self, teams: &[(&str, EvaluationResult)]) {
        for (name, _) in teams {
            let team = self.team(name).await;
            self.valid_submission(&team, &format!("{name}-agent")).await;
        }
        self.start_day().await;
        for (_, result) in teams {
            self.finish_evaluation(result).await;
        }
    }
}

/// The result of these episodes of a run, by the rules.
pub fn score_outcomes(run: &Run, seed: Seed, outcomes: &[EpisodeOutcome]) -> EvaluationResult {
    let plan = &run.plan;
    let tasks = plan.tasks.iter().map(|task| {
        let task_outcomes: Vec<_> = outcomes
            .iter()
            .filter(|outcome| outcome.task == *task)
            .cloned()
            .collect();
        let bounds = faceoff_airhockey::competition().tier_bounds(&plan.variation);
        (
            *task,
            faceoff_scoring::score_task(
                &faceoff_airhockey::competition(),
                &task_outcomes,
                &Default::default(),
                bounds,
            ),
        )
    });
    faceoff_scoring::score_evaluation(
        run.ruleset,
        plan.profile,
        seed,
        &plan.variation,
        &faceoff_airhockey::competition().weights(&plan.variation),
        faceoff_airhockey::competition().tier_bounds(&plan.variation),
        tasks.collect(),
    )
}

/// The run plan of the first stage: one shard for each task, and one agent fault is allowed.
fn plan() -> RunPlan {
    RunPlan {
        tasks: TASKS.to_vec(),
        episodes_per_shard: 4,
        max_faults: 1,
        ..six_shard_plan()
    }
}

/// The outcome of an agent in an episode.
pub type OutcomeFn<'a> = &'a dyn Fn(Task, u32) -> EpisodeOutcome;

/// The default limits, with time limits that no working machine reaches.
fn connection_limits() -> ConnectionLimits {
    ConnectionLimits {
        head_timeout: Duration::from_secs(600),
        min_read_rate: MinTransferRate {
            bytes_per_s: 1,
            grace: Duration::from_secs(600),
        },
        ..ConnectionLimits::default()
    }
}

/// Starts a server. Returns its URL, its task, and the sender that shuts it down.
async fn serve(
    store: &Store,
    live: &LiveState,
    config: &HttpConfig,
) -> (String, JoinHandle<()>, oneshot::Sender<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let url = format!("http://{}", listener.local_addr().unwrap());
    let site = router(store.clone(), live.clone(), config.clone());
    let (shutdown_sender, shutdown_receiver) = oneshot::channel();
    let server = tokio::spawn(async move {
        let shutdown_signal = async move {
            // A sender that is dropped without a signal does not end the server.
            if shutdown_receiver.await.is_err() {
                std::future::pending().await
            }
        };
        faceoff_http::serve(listener, site, connection_limits(), shutdown_signal).await;
    });
    (url, server, shutdown_sender)
}

/// The outcome of the validation run of an agent that did not start.
pub fn invalid_outcome(reason: &str, log: &str) -> ValidationOutcome {
    ValidationOutcome::Invalid {
        runtime: None,
        agent_name: None,
        reason: reason.into(),
        timing: Vec::new(),
        log: log.into(),
    }
}

/// The text of a JSON string.
pub fn string(value: &Value) -> String {
    value
        .as_str()
        .unwrap_or_else(|| panic!("{value} is not a string"))
        .to_owned()
}

/// A result over 1000 episodes with these success rates (hit, defend, prepare) and these overall penalty points, all of
/// them from `hit`. Tier and score follow by the default bounds and weights; the other numbers are arbitrary.
pub fn result(rates: [f64; 3], penalty_points: f64) -> EvaluationResult {
    let tier = match penalty_points {
        points if points <= 500.0 => Tier::Deployable,
        points if points <= 1500.0 => Tier::Improvable,
        _ => Tier::NonDeployable,
    };
    let tasks = TASKS
        .into_iter()
        .zip(rates)
        .map(|(task, rate)| {
            let is_hit = task == HIT;
            let result = TaskResult {
                episodes: 1000,
                successes: (1000.0 * rate) as u32,
                success_rate: rate,
                success_ci95: [(rate - 0.03).max(0.0), (rate + 0.03).min(1.0)],
                penalty_points: if is_hit { penalty_points } else { 0.0 },
                violations: faceoff_airhockey::competition()
                    .violation_counts(&[(faceoff_airhockey::EE, 7)]),
                tier: Some(if is_hit { tier } else { Tier::Deployable }),
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
        ruleset: faceoff_airhockey::RULESET.to_string(),
        profile: EVALUATION,
        seed: Seed::from_number(7),
        tasks,
        score: 100.0 * (0.4 * rates[0] + 0.4 * rates[1] + 0.2 * rates[2]),
        penalty_points,
        tier: Some(tier),
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
            max_host_interference_s: 0.0305,
            host_interference_reruns: 2,
            platform_retries: 1,
        }),
        variation: Default::default(),
    }
}
