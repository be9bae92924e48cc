//! A store in a temporary folder, an adjustable clock, and shorthands for the steps of a competition.

use faceoff_store::*;
use faceoff_types::*;
use jiff::{SignedDuration, Timestamp};
use sqlx::{Connection, SqliteConnection};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

pub const LEASE_S: u32 = 15;

pub struct TestStore {
    pub store: Store,
    pub folder: tempfile::TempDir,
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

    pub async fn connection(&self) -> SqliteConnection {
        let file = self.folder.path().join("faceoff.sqlite3");
        let url = format!("sqlite://{}", file.display());
        SqliteConnection::connect(&url).await.unwrap()
    }

    pub fn later(&mut self, seconds: i64) {
        self.now += SignedDuration::from_secs(seconds);
    }

    pub async fn team(&self, name: &str) -> Team {
        let token_hash = *blake3::hash(name.as_bytes()).as_bytes();
        self.store
            .create_team(
                Actor::Organiser,
                &name.parse().unwrap(),
                token_hash,
                self.now,
            )
            .await
            .unwrap()
    }

    pub async fn upload(&self, team: &Team) -> Submission {
        self.store
            .create_submission(
                Actor::Team(team.id),
                team.id,
                bundle(),
                &UploadQuota::default(),
                self.now,
            )
            .await
            .unwrap()
    }

    pub async fn claim(&self) -> Option<ClaimedJob> {
        self.store.claim("slot 0", LEASE_S, self.now).await.unwrap()
    }

    /// Claims the next job, which must be a validation run, and reports the agent as valid.
    pub async fn validate(&self) -> Submission {
        let (claim, submission) = self.claim_validation().await;
        let outcome = ValidationOutcome::Valid {
            runtime: "native".into(),
            agent_name: "striker".into(),
            timing: Vec::new(),
            log: "hello\n".into(),
        };
        self.store
            .commit_validation(&claim, outcome, self.now)
            .await
            .unwrap();
        self.store.submission(submission.id).await.unwrap()
    }

    /// A team with a valid submission.
    pub async fn ready_team(&self, name: &str) -> Submission {
        let team = self.team(name).await;
        self.upload(&team).await;
        self.validate().await
    }

    /// The season's first stage, with this plan from now on.
    pub async fn stage(&self, plan: &RunPlan) -> StageId {
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

    /// Starts the day unless it has started already. Returns the submission's evaluation.
    pub async fn evaluate(&self, submission: SubmissionId, plan: &RunPlan) -> Evaluation {
        let stage = self.stage(plan).await;
        match self
            .store
            .start_day(Actor::Organiser, stage, self.now)
            .await
        {
            Ok(_) | Err(StoreError::CutoffPassed { .. }) => {}
            Err(error) => panic!("{error}"),
        }
        let today = Zone::UTC.date(self.now);
        let of_day = self.store.evaluations_on(today).await.unwrap();
        let found = of_day.into_iter().rfind(|one| one.submission == submission);
        found.expect("it was active at the cutoff")
    }

    /// Runs queued jobs until an evaluation is scored.
    pub async fn finish_next(&self) -> EvaluationId {
        loop {
            let ClaimedJob { claim, job } = self.claim().await.expect("a job is queued");
            match job {
                Job::Shard { shard, .. } => {
                    self.commit_shard(&claim, &shard, 0).await;
                }
                Job::Scoring { evaluation, .. } => {
                    self.finish(&claim, 1.0, "d").await;
                    return evaluation;
                }
                Job::Validation { .. } | Job::Game { .. } => {
                    panic!("expected a shard or a scoring job")
                }
            }
        }
    }

    /// Runs and scores all queued evaluations.
    pub async fn run_all(&self, score: f64) {
        while let Some(ClaimedJob { claim, job }) = self.claim().await {
            match job {
                Job::Shard { shard, .. } => {
                    self.commit_shard(&claim, &shard, 0).await;
                }
                Job::Scoring { .. } => {
                    self.finish(&claim, score, "d").await;
                }
                Job::Validation { .. } | Job::Game { .. } => {
                    panic!("expected no validation run and no game")
                }
            }
        }
    }

    /// Reports platform faults until an evaluation with one shard has ended. Returns its id.
    pub async fn fail_next(&mut self) -> EvaluationId {
        let mut broken = None;
        for _ in 0..MAX_ATTEMPTS {
            let Some(ClaimedJob { claim, job }) = self.claim().await else {
                panic!("a job is queued")
            };
            let Job::Shard {
                owner: RunOwner::Evaluation(id),
                ..
            } = job
            else {
                panic!("expected a shard of an evaluation, claimed {job:?}")
            };
            assert_eq!(*broken.get_or_insert(id), id);
            let failed = self.store.release_failed(&claim, "disk full", self.now);
            failed.await.unwrap();
            if !self.state(id).await.is_over() {
                self.later(60);
            }
        }
        broken.expect("it was claimed")
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

    pub async fn finish(&self, claim: &JobClaim, score: f64, dataset: &str) -> CommitOutcome {
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

    pub async fn commit_shard(
        &self,
        claim: &JobClaim,
        shard: &Shard,
        faults: u32,
    ) -> CommitOutcome {
        self.store
            .commit_shard(claim, commit(shard, faults), self.now)
            .await
            .unwrap()
    }

    pub async fn state(&self, id: EvaluationId) -> EvaluationState {
        self.store.evaluation(id).await.unwrap().state
    }
}

/// The first stage of the store's season, with this plan from now on.
pub async fn configure_first_stage(store: &Store, plan: &RunPlan, now: Timestamp) -> StageId {
    let (rules, settings) = rules_and_settings(plan);
    // Open for a long time, so that tests can set the clock back.
    let since = match store.stages().await.unwrap().is_empty() {
        true => now - SignedDuration::from_hours(24 * 90),
        false => now,
    };
    store
        .configure_stage(rules, settings, Zone::UTC, since)
        .await
        .unwrap();
    store.stages().await.unwrap()[0].id
}

/// Rules and settings of a stage with this plan.
pub fn rules_and_settings(plan: &RunPlan) -> (StageRules, StageSettings) {
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
        episodes_per_shard: plan.episodes_per_shard,
        ..StageSettings::default()
    };
    (rules, settings)
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

pub fn bundle() -> BundleRef {
    BundleRef {
        key: "bundles/abc".into(),
        bytes: 3,
        blake3: blake3::hash(b"abc").to_string(),
        file_name: "agent.tar.gz".into(),
    }
}

/// 3 tasks of 4 episodes in shards of 2: six shards.
pub fn plan() -> RunPlan {
    RunPlan {
        profile: Profile::Evaluation,
        tasks: vec![Task::Prepare, Task::Hit, Task::Defend],
        episodes_per_task: 4,
        episodes_per_shard: 2,
        max_faults: 3,
        variation: Default::default(),
        limits: Default::default(),
    }
}

/// One shard of one episode.
pub fn small() -> RunPlan {
    RunPlan {
        tasks: vec![Task::Hit],
        episodes_per_task: 1,
        ..plan()
    }
}

/// Commit of a worker that ran `shard`; its first `faults` episodes ended by an agent fault.
pub fn commit(shard: &Shard, faults: u32) -> ShardCommit {
    let outcomes = (shard.first_episode..shard.end_episode)
        .enumerate()
        .map(|(index, episode)| outcome(shard.task, episode, (index as u32) < faults))
        .collect();
    ShardCommit {
        outcomes,
        log: format!("log of {} {}\n", shard.task, shard.first_episode),
        stopped_by_faults: false,
        recording: Some(format!("recordings/{}", shard.id)),
    }
}

pub fn outcome(task: Task, episode: u32, faulty: bool) -> EpisodeOutcome {
    let fault = faulty.then(|| AgentFault {
        fault: AgentFaultKind::NonFinite,
        agent_task: task.into(),
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
        violations: Violations {
            ee: true,
            ..Violations::default()
        },
        computation_time: ComputationTime {
            mean_s: 0.1 + 0.2,
            max_s: 1e-3 / 3.0,
        },
        fault,
    }
}

pub fn result(score: f64) -> EvaluationResult {
    EvaluationResult {
        ruleset: RULESET.into(),
        profile: Profile::Evaluation,
        seed: Seed::from_number(1),
        tasks: BTreeMap::new(),
        score,
        penalty_points: 0.1 + 0.2,
        tier: Tier::Improvable,
        timing: None,
        variation: Default::default(),
    }
}

/// The acceptance of the invitation with this code. The hash of the user's token is the hash of the code's hash.
pub fn join_request(code_hash: [u8; 32], name: &str) -> JoinRequest {
    JoinRequest {
        code_hash,
        name: Some(name.parse().unwrap()),
        password: None,
        team: None,
        accepted_terms: None,
        token_hash: *blake3::hash(&code_hash).as_bytes(),
        token_kind: TokenKind::ApiToken,
        token_name: "first".into(),
        token_expires_at: None,
    }
}
