//! A store in a temporary folder, a clock that tests turn, and shorthands for a competition's steps.

use faceoff_store::*;
use faceoff_types::*;
use jiff::{SignedDuration, Timestamp};
use sqlx::{Connection, SqliteConnection};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

pub const LEASE_S: u32 = 15;

pub struct Fixture {
    pub store: Store,
    pub folder: tempfile::TempDir,
    pub now: Timestamp,
}

impl Fixture {
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

    pub async fn claim(&self) -> Option<Claimed> {
        self.store.claim("slot 0", LEASE_S, self.now).await.unwrap()
    }

    /// Claims the next unit, which must be a smoke run, and finds the agent valid.
    pub async fn validate(&self) -> Submission {
        let (claim, submission) = self.claim_smoke().await;
        let outcome = SmokeOutcome::Valid {
            runtime: "native".into(),
            agent_name: "striker".into(),
            timing: Vec::new(),
            log: "hello\n".into(),
        };
        self.store
            .commit_smoke(&claim, outcome, self.now)
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

    /// The season's first stage, which plays by this plan from now on.
    pub async fn stage(&self, plan: &RunPlan) -> StageId {
        stage_of(&self.store, plan, self.now).await
    }

    /// The board of the season's first stage, by the newest rules with results.
    pub async fn board(&self) -> Vec<BoardRecord> {
        let Some(stage) = self.store.stages().await.unwrap().into_iter().next() else {
            return Vec::new();
        };
        let revision = self.store.board_revision(&stage).await.unwrap();
        self.store.board(stage.id, revision).await.unwrap()
    }

    /// Starts the day with what all teams have active, unless that was done; the submission's evaluation.
    pub async fn evaluate(&self, submission: SubmissionId, plan: &RunPlan) -> Evaluation {
        let stage = self.stage(plan).await;
        match self
            .store
            .start_day(Actor::Organiser, stage, self.now)
            .await
        {
            Ok(_) | Err(StoreError::DayHasCut { .. }) => {}
            Err(error) => panic!("{error}"),
        }
        let today = Zone::UTC.date(self.now);
        let of_day = self.store.evaluations_on(today).await.unwrap();
        let found = of_day.into_iter().rfind(|one| one.submission == submission);
        found.expect("it was active at the cut")
    }

    /// Plays what comes next in the queue until an evaluation is scored.
    pub async fn finish_next(&self) -> EvaluationId {
        loop {
            let Claimed { claim, work } = self.claim().await.expect("work is queued");
            match work {
                Work::Shard { shard, .. } => {
                    self.play(&claim, &shard, 0).await;
                }
                Work::Finalise { evaluation, .. } => {
                    self.finish(&claim, 1.0, "d").await;
                    return evaluation;
                }
                Work::Smoke { .. } | Work::Game { .. } => {
                    panic!("expected a shard or a finalisation")
                }
            }
        }
    }

    /// Plays and scores all that is queued.
    pub async fn play_to(&self, score: f64) {
        while let Some(Claimed { claim, work }) = self.claim().await {
            match work {
                Work::Shard { shard, .. } => {
                    self.play(&claim, &shard, 0).await;
                }
                Work::Finalise { .. } => {
                    self.finish(&claim, score, "d").await;
                }
                Work::Smoke { .. } | Work::Game { .. } => panic!("no upload waits, no game"),
            }
        }
    }

    /// Our fault, as often as it takes to end an evaluation of one shard; its id.
    pub async fn break_next(&mut self) -> EvaluationId {
        let mut broken = None;
        for _ in 0..MAX_ATTEMPTS {
            let Some(Claimed { claim, work }) = self.claim().await else {
                panic!("work is queued")
            };
            let Work::Shard {
                owner: RunOwner::Evaluation(id),
                ..
            } = work
            else {
                panic!("expected a shard of an evaluation, claimed {work:?}")
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

    pub async fn claim_smoke(&self) -> (Claim, Submission) {
        match self.claim().await {
            Some(Claimed {
                claim,
                work: Work::Smoke { submission, .. },
            }) => (claim, submission),
            other => panic!("expected a smoke run, claimed {other:?}"),
        }
    }

    pub async fn claim_shard(&self) -> (Claim, Run, Shard) {
        match self.claim().await {
            Some(Claimed {
                claim,
                work: Work::Shard { run, shard, .. },
            }) => (claim, run, shard),
            other => panic!("expected a shard, claimed {other:?}"),
        }
    }

    pub async fn claim_scoring(&self) -> (Claim, EvaluationId) {
        match self.claim().await {
            Some(Claimed {
                claim,
                work: Work::Finalise { evaluation, .. },
            }) => (claim, evaluation),
            other => panic!("expected a finalisation, claimed {other:?}"),
        }
    }

    pub async fn finish(&self, claim: &Claim, score: f64, dataset: &str) -> Committed {
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

    pub async fn play(&self, claim: &Claim, shard: &Shard, faults: u32) -> Committed {
        self.store
            .commit_shard(claim, commit(shard, faults), self.now)
            .await
            .unwrap()
    }

    pub async fn state(&self, id: EvaluationId) -> EvaluationState {
        self.store.evaluation(id).await.unwrap().state
    }
}

/// The first stage of the store's season, which plays by this plan from now on.
pub async fn stage_of(store: &Store, plan: &RunPlan, now: Timestamp) -> StageId {
    let (rules, settings) = rules_of(plan);
    // Open for long, so that a clock may be set back.
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

/// What a stage that plays by this plan is told.
pub fn rules_of(plan: &RunPlan) -> (StageRules, StageSettings) {
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

/// What `.sqlx/` holds of each query, and where.
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

/// What stands for the hash of a dataset's archive.
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

/// What a worker that played `shard` commits; its first `faults` episodes ended by an agent fault.
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

/// What somebody brings who follows the link of this code. Their token has the code's hash, hashed.
pub fn joining(code_hash: [u8; 32], name: &str) -> Joining {
    Joining {
        code_hash,
        name: Some(name.parse().unwrap()),
        password: None,
        team: None,
        accepted_terms: None,
        token_hash: *blake3::hash(&code_hash).as_bytes(),
        token_kind: TokenKind::Key,
        token_name: "first".into(),
        token_expires_at: None,
    }
}
