//! [`TestStore`], which tests call `f` (fixture): a store in a temporary folder with a clock that the test sets, and helpers for the
//! steps of a competition.
//!
//! A team submits an agent. A *validation run* checks it, and on each day it is evaluated: workers claim (lease) jobs from
//! the queue, which are the *shards* of a run (episodes that are run together), and a scoring job at the end.

use faceoff_airhockey::{EE, EVALUATION};
use faceoff_store::*;
pub use faceoff_testkit::{
    assert_conflict, assert_contains, one_shard_plan, rules_and_settings, six_shard_plan,
    two_shard_plan, valid_outcome,
};
use faceoff_testkit::{bundle_ref, shard_outcomes};
use faceoff_types::*;
use jiff::{SignedDuration, Timestamp};
use sqlx::{Connection, SqliteConnection};
use std::path::{Path, PathBuf};

/// Duration of the lease of a claimed job.
pub const LEASE_S: u32 = 15;

/// Key of the dataset (the published archive of an evaluation) where a test does not read it.
pub const DATASET_KEY: &str = "d";

pub struct TestStore {
    pub store: Store,
    /// The data folder of the store.
    pub folder: tempfile::TempDir,
    /// The test's clock, which all operations get as their time.
    pub now: Timestamp,
}

impl TestStore {
    pub async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let store = faceoff_testkit::new_store(folder.path()).await;
        Self {
            store,
            folder,
            now: "2026-03-01T10:00:00Z".parse().unwrap(),
        }
    }

    /// Another handle on the same folder, as another process would have.
    pub async fn reopen(&self) -> Store {
        Store::open(self.folder.path()).await.unwrap()
    }

    /// A connection to the database past the store.
    pub async fn connection(&self) -> SqliteConnection {
        let file = self.folder.path().join("faceoff.sqlite3");
        let url = format!("sqlite://{}", file.display());
        SqliteConnection::connect(&url).await.unwrap()
    }

    pub fn advance_clock_s(&mut self, seconds: i64) {
        self.now += SignedDuration::from_secs(seconds);
    }

    pub async fn create_team(&self, name: &str) -> Team {
        faceoff_testkit::create_team(&self.store, name, self.now).await
    }

    /// Submits [`bundle`] as a team's agent. Its validation run is queued.
    pub async fn upload(&self, team: &Team) -> Submission {
        faceoff_testkit::submit(&self.store, team.id, bundle(), self.now).await
    }

    /// Claims the next job of the queue, as a worker's slot.
    pub async fn claim(&self) -> Option<ClaimedJob> {
        self.store.claim("slot 0", LEASE_S, self.now).await.unwrap()
    }

    /// Claims the next job, which must be a validation run, and reports the agent as valid.
    pub async fn validate(&self) -> Submission {
        let outcome = valid_outcome("native", "striker", "hello\n");
        faceoff_testkit::finish_validation(&self.store, outcome, self.now).await
    }

    /// Creates a team and its valid submission.
    pub async fn valid_submission_of(&self, name: &str) -> Submission {
        let team = self.create_team(name).await;
        self.upload(&team).await;
        self.validate().await
    }

    /// Creates the teams Alpha and Beta, and a valid submission of each.
    pub async fn two_valid_submissions(&self) -> [Submission; 2] {
        [
            self.valid_submission_of("Alpha").await,
            self.valid_submission_of("Beta").await,
        ]
    }

    /// Configures the season's first stage with this plan, from now on.
    pub async fn configure_stage(&self, plan: &RunPlan) -> StageId {
        configure_first_stage(&self.store, plan, self.now).await
    }

    /// The board of the season's first stage, for the newest revision with results.
    pub async fn board(&self) -> Vec<BoardRecord> {
        let Some(stage) = self.store.stages().await.unwrap().into_iter().next() else {
            return Vec::new();
        };
        let revision = self.store.board_revision(&stage).await.unwrap();
        self.store.board(stage.id, revision).await.unwrap()
    }

    /// Starts a day of the season's first stage, which has this plan.
    pub async fn start_day(&self, plan: &RunPlan) -> Result<Vec<Evaluation>, StoreError> {
        let stage = self.configure_stage(plan).await;
        self.store.start_day(Actor::Operator, stage, self.now).await
    }

    /// Changes a stage so that it closes after this number of seconds, and advances the clock to that time.
    pub async fn close_stage_after_s(&mut self, stage: StageId, seconds: i64) {
        let closing = StageChange {
            closes_at: Some(Some(self.now + SignedDuration::from_secs(seconds))),
            ..StageChange::default()
        };
        self.store
            .change_stage(Actor::Operator, stage, closing, self.now)
            .await
            .unwrap();
        self.advance_clock_s(seconds);
    }

    /// A released day with a result of 1.0 for each of two teams.
    pub async fn released_day(&self) -> ([Submission; 2], StageDay) {
        let submissions = self.two_valid_submissions().await;
        let evaluation = self.evaluate(submissions[0].id, &one_shard_plan()).await;
        self.run_all_with_score(1.0).await;
        (submissions, evaluation.stage_day)
    }

    /// Kinds of the events after the one with this id, the oldest first.
    pub async fn event_kinds_since(&self, id: i64) -> Vec<String> {
        let events = self.store.events_after(id, 1000).await.unwrap();
        events.iter().map(event_kind).collect()
    }

    /// Creates a team with a valid submission, and starts its evaluation.
    pub async fn start_evaluation(&self, plan: &RunPlan) -> Evaluation {
        let submission = self.valid_submission_of("Alpha").await;
        self.evaluate(submission.id, plan).await
    }

    /// Starts the day unless it has started already. Returns the submission's evaluation.
    pub async fn evaluate(&self, submission: SubmissionId, plan: &RunPlan) -> Evaluation {
        match self.start_day(plan).await {
            Ok(_) | Err(StoreError::CutoffPassed { .. }) => {}
            Err(error) => panic!("{error}"),
        }
        let today = IanaTimeZone::UTC.date(self.now);
        let evaluations = self.store.evaluations_on(today).await.unwrap();
        let found = evaluations
            .into_iter()
            .rfind(|evaluation| evaluation.submission == submission);
        found.expect("the submission was active at the day's start")
    }

    /// Runs queued jobs until an evaluation is scored with 1.0. Returns its id.
    pub async fn finish_next_evaluation(&self) -> EvaluationId {
        loop {
            let ClaimedJob { claim, job } = self.claim().await.expect("a job is queued");
            match job {
                Job::Shard { shard, .. } => {
                    self.commit_shard(&claim, &shard).await;
                }
                Job::Scoring { evaluation, .. } => {
                    self.finish_scoring(&claim, 1.0, DATASET_KEY).await;
                    return evaluation;
                }
                Job::Validation { .. } | Job::Game { .. } => {
                    panic!("expected a shard or a scoring job")
                }
            }
        }
    }

    /// Runs all queued evaluations and scores each with `score`.
    pub async fn run_all_with_score(&self, score: f64) {
        while let Some(ClaimedJob { claim, job }) = self.claim().await {
            match job {
                Job::Shard { shard, .. } => {
                    self.commit_shard(&claim, &shard).await;
                }
                Job::Scoring { .. } => {
                    self.finish_scoring(&claim, score, DATASET_KEY).await;
                }
                Job::Validation { .. } | Job::Game { .. } => {
                    panic!("expected no validation run and no game")
                }
            }
        }
    }

    /// Reports platform faults until an evaluation with one shard has ended. Returns its id.
    pub async fn fail_next_evaluation(&mut self) -> EvaluationId {
        let mut failing = None;
        for _ in 0..MAX_PLATFORM_FAULTS {
            let Some(ClaimedJob { claim, job }) = self.claim().await else {
                panic!("a job is queued")
            };
            let Job::Shard {
                owner: RunOwner::Evaluation { id, .. },
                ..
            } = job
            else {
                panic!("expected a shard of an evaluation, claimed {job:?}")
            };
            assert_eq!(*failing.get_or_insert(id), id);
            let released = self
                .store
                .release_after_platform_fault(&claim, "disk full", self.now);
            released.await.unwrap();
            if !self.state(id).await.is_over() {
                // Past the delay before the next attempt.
                self.advance_clock_s(60);
            }
        }
        failing.expect("a shard was claimed")
    }

    pub async fn claim_validation(&self) -> (JobClaim, Submission) {
        match self.claim().await {
            Some(ClaimedJob {
                claim,
                job: Job::Validation { submission, .. },
            }) => (claim, submission),
            other => panic!("expected a validation run, claimed {other:?}"),
        }
    }

    pub async fn claim_shard(&self) -> (JobClaim, Run, Shard) {
        match self.claim().await {
            Some(ClaimedJob {
                claim,
                job: Job::Shard { run, shard, .. },
            }) => (claim, run, shard),
            other => panic!("expected a shard, claimed {other:?}"),
        }
    }

    pub async fn claim_scoring(&self) -> (JobClaim, EvaluationId) {
        match self.claim().await {
            Some(ClaimedJob {
                claim,
                job: Job::Scoring { evaluation, .. },
            }) => (claim, evaluation),
            other => panic!("expected a scoring job, claimed {other:?}"),
        }
    }

    /// Commits the evaluation of a claimed scoring job.
    pub async fn finish_scoring(
        &self,
        claim: &JobClaim,
        score: f64,
        dataset: &str,
    ) -> CommitOutcome {
        self.store
            .finish_evaluation(
                claim,
                &result(score),
                dataset,
                &blake3_of(dataset),
                self.now,
            )
            .await
            .unwrap()
    }

    /// Commits a claimed shard without agent faults.
    pub async fn commit_shard(&self, claim: &JobClaim, shard: &Shard) -> CommitOutcome {
        self.commit_shard_with_faults(claim, shard, 0).await
    }

    /// Commits a claimed shard, whose first `faults` episodes ended by an agent fault.
    pub async fn commit_shard_with_faults(
        &self,
        claim: &JobClaim,
        shard: &Shard,
        faults: u32,
    ) -> CommitOutcome {
        self.store
            .commit_shard(claim, shard_commit(shard, faults), self.now)
            .await
            .unwrap()
    }

    pub async fn state(&self, id: EvaluationId) -> EvaluationState {
        self.store.evaluation(id).await.unwrap().state
    }
}

/// The kind of an event, as it is stored.
pub fn event_kind(record: &EventRecord) -> String {
    let event = serde_json::to_value(&record.event).unwrap();
    event["kind"].as_str().unwrap().to_owned()
}

pub fn time(text: &str) -> Timestamp {
    text.parse().unwrap()
}

/// Configures the first stage of the store's season with this plan, from now on.
pub async fn configure_first_stage(store: &Store, plan: &RunPlan, now: Timestamp) -> StageId {
    // A new stage has been open for 90 days, so that tests can set the clock back.
    let configured_at = match store.stages().await.unwrap().is_empty() {
        true => now - SignedDuration::from_hours(24 * 90),
        false => now,
    };
    faceoff_testkit::configure_stage(store, plan, None, configured_at).await
}

/// The description of each query in `.sqlx/`, with its path.
pub fn query_data() -> Vec<(PathBuf, serde_json::Value)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../.sqlx");
    std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let path = entry.unwrap().path();
            let text = std::fs::read_to_string(&path).unwrap();
            (path, serde_json::from_str(&text).unwrap())
        })
        .collect()
}

/// Placeholder for the hash of a dataset's archive.
pub fn blake3_of(dataset: &str) -> String {
    blake3::hash(dataset.as_bytes()).to_string()
}

/// A submitted agent's archive.
pub fn bundle() -> BundleRef {
    bundle_ref("bundles/abc", b"abc")
}

/// Commit of a worker that ran `shard`; its first `faults` episodes ended by an agent fault.
pub fn shard_commit(shard: &Shard, faults: u32) -> ShardCommit {
    let first_valid = shard.first_episode + faults;
    let outcomes = shard_outcomes(shard, |task, episode| {
        outcome(task, episode, episode < first_valid)
    });
    let recording = format!("recordings/{}", shard.id);
    ShardCommit {
        log: format!("log of {} {}\n", shard.task, shard.first_episode),
        ..faceoff_testkit::shard_commit(outcomes, Some(recording))
    }
}

/// Outcome of an episode that ended by an agent fault, or in success. Its times are no short decimals, so that a test notices if the
/// database rounds them.
pub fn outcome(task: Task, episode: u32, is_faulty: bool) -> EpisodeOutcome {
    EpisodeOutcome {
        violations: [EE].into(),
        computation_time: ComputationTime {
            mean_s: 0.1 + 0.2,
            max_s: 1e-3 / 3.0,
        },
        ..faceoff_testkit::outcome(task, episode, is_faulty)
    }
}

/// Result of an evaluation. Its penalty points are no short decimal, so that a test notices if the database rounds them.
pub fn result(score: f64) -> EvaluationResult {
    EvaluationResult {
        ruleset: faceoff_airhockey::RULESET.to_string(),
        profile: EVALUATION,
        seed: Seed::from_number(1),
        tasks: Default::default(),
        score,
        penalty_points: 0.1 + 0.2,
        tier: Some(Tier::Improvable),
        timing: None,
        variation: Default::default(),
    }
}

/// The request to accept the invitation whose secret code has this hash. The hash of the user's token is the hash of this hash.
pub fn join_request(code_hash: [u8; 32], name: &str) -> JoinRequest {
    JoinRequest {
        code_hash,
        name: Some(name.parse().unwrap()),
        password_hash: None,
        team: None,
        accepted_terms: None,
        token_hash: *blake3::hash(&code_hash).as_bytes(),
        token_kind: TokenKind::ApiToken,
        token_name: "first".into(),
        token_expires_at: None,
    }
}
