//! Fair shares of slot time: a worker has *slots*, each of which runs one job at a time, and the time of all slots is shared
//! equally by the teams, and by the kinds of jobs. Tests set the clock and the duration of each job, and check the order in
//! which jobs are claimed.

use crate::fixture::*;
use faceoff_airhockey::ABLATION_PROFILES;
use faceoff_store::*;
use faceoff_types::{EvaluationId, TeamId};
use sqlx::{Row, SqlSafeStr};
use std::collections::BTreeMap;

/// Duration of a lease that is longer than any job of these tests, so that no lease needs to be renewed.
const LONG_LEASE_S: u32 = 100_000;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum JobKind {
    Validation,
    Shard,
    Scoring,
    Ablation,
}

/// A job that a slot has claimed, with its simulated start and end.
#[derive(Debug, Clone, PartialEq, Eq)]
struct JobRecord {
    /// Name of the team; empty for a scoring or an ablation.
    team: &'static str,
    kind: JobKind,
    /// Start, in seconds since [`SlotSimulation::started_at`].
    start_s: i64,
    end_s: i64,
}

/// Simulated slots of a worker, and the store whose jobs they run.
struct SlotSimulation {
    f: TestStore,
    /// Names of the teams.
    teams: BTreeMap<TeamId, &'static str>,
    /// The evaluations' teams.
    evaluations: BTreeMap<EvaluationId, TeamId>,
    /// When each slot becomes free, in seconds since `started_at`, and the job that it runs until then.
    slots: Vec<(i64, Option<(JobClaim, Job)>)>,
    started_at: jiff::Timestamp,
    /// The claimed jobs, in the order of their claims.
    job_records: Vec<JobRecord>,
}

impl SlotSimulation {
    async fn new(slot_count: usize) -> Self {
        let f = TestStore::new().await;
        let started_at = f.now;
        Self {
            f,
            teams: BTreeMap::new(),
            evaluations: BTreeMap::new(),
            slots: (0..slot_count).map(|_| (0, None)).collect(),
            started_at,
            job_records: Vec::new(),
        }
    }

    fn time_at(&self, second: i64) -> jiff::Timestamp {
        self.started_at + jiff::SignedDuration::from_secs(second)
    }

    async fn create_team(&mut self, name: &'static str) -> Team {
        let team = self.f.create_team(name).await;
        self.teams.insert(team.id, name);
        team
    }

    /// Creates teams with a valid submission each, and queues their evaluations with these numbers of shards in this order.
    async fn queue_evaluations(&mut self, teams: &[(&'static str, u32)]) {
        let mut submissions = Vec::new();
        for (name, shards) in teams {
            let team = self.create_team(name).await;
            self.f.upload(&team).await;
            let submission = self.f.validate().await;
            submissions.push((team.id, submission.id, *shards));
        }
        for (team, submission, shards) in submissions {
            let plan = RunPlan {
                episodes_per_task: shards,
                episodes_per_shard: 1,
                ..two_shard_plan()
            };
            // Each evaluation has its own day, so that their numbers of shards can differ.
            let evaluation = self.f.evaluate_alone(submission, &plan).await;
            self.evaluations.insert(evaluation, team);
        }
        self.started_at = self.f.now;
    }

    /// Team and kind of a job; scoring and ablations have no team here.
    async fn team_and_kind(&self, job: &Job) -> (&'static str, JobKind) {
        match job {
            Job::Validation { submission, .. } => {
                (self.teams[&submission.team], JobKind::Validation)
            }
            Job::Shard {
                owner: RunOwner::Evaluation { id, .. },
                ..
            } => (self.teams[&self.evaluations[id]], JobKind::Shard),
            Job::Shard { .. } => ("", JobKind::Ablation),
            Job::Scoring { .. } => ("", JobKind::Scoring),
            Job::Game { .. } => panic!("no game is queued"),
        }
    }

    /// Runs the slots until no job is left, or `stops` is true for the jobs so far. `duration_s` gives a job's duration.
    async fn run(
        &mut self,
        duration_s: impl Fn(&'static str, JobKind) -> i64,
        stops: impl Fn(&[JobRecord]) -> bool,
    ) {
        loop {
            let index = (0..self.slots.len())
                .min_by_key(|slot| self.slots[*slot].0)
                .unwrap();
            let (second, completed_job) = std::mem::take(&mut self.slots[index]);
            self.f.now = self.time_at(second);
            if let Some((claim, job)) = completed_job {
                self.commit(&claim, job).await;
            }
            let next_job = match stops(&self.job_records) {
                true => None,
                false => self
                    .f
                    .store
                    .claim("slot", LONG_LEASE_S, self.f.now)
                    .await
                    .unwrap(),
            };
            match next_job {
                Some(ClaimedJob { claim, job }) => {
                    let (team, kind) = self.team_and_kind(&job).await;
                    let end_s = second + duration_s(team, kind);
                    self.job_records.push(JobRecord {
                        team,
                        kind,
                        start_s: second,
                        end_s,
                    });
                    self.slots[index] = (end_s, Some((claim, job)));
                }
                None => {
                    // The slot waits until another slot completes its job, which can make a job claimable.
                    let busy_slots = self
                        .slots
                        .iter()
                        .enumerate()
                        .filter(|(_, slot)| slot.1.is_some());
                    let Some(next_free) = busy_slots.map(|(_, slot)| slot.0).min() else {
                        self.slots[index].0 = second;
                        return;
                    };
                    self.slots[index].0 = next_free.max(second) + 1;
                }
            }
        }
    }

    async fn commit(&self, claim: &JobClaim, job: Job) {
        let (store, now) = (&self.f.store, self.f.now);
        let committed = match job {
            Job::Validation { .. } => {
                let invalid = faceoff_types::ValidationOutcome::Invalid {
                    runtime: None,
                    agent_name: None,
                    reason: "it does not answer".into(),
                    timing: Vec::new(),
                    log: String::new(),
                };
                store.commit_validation(claim, invalid, now).await
            }
            Job::Shard { run, shard, .. } => {
                let mut commit = shard_commit(&shard, 0);
                commit.recording = commit.recording.filter(|_| run.keeps_recordings);
                store.commit_shard(claim, commit, now).await
            }
            Job::Scoring { .. } => Ok(self.f.finish_scoring(claim, 1.0, DATASET_KEY).await),
            Job::Game { .. } => panic!("no game is queued"),
        };
        assert_eq!(committed.unwrap(), CommitOutcome::Stored);
    }

    /// Teams and kinds of the jobs, in the order of their claims.
    fn claim_order(&self) -> Vec<(&'static str, JobKind)> {
        self.job_records
            .iter()
            .map(|job| (job.team, job.kind))
            .collect()
    }

    /// Total slot time of the matching jobs, in seconds.
    fn slot_time_s(job_records: &[JobRecord], matches: impl Fn(&JobRecord) -> bool) -> i64 {
        job_records
            .iter()
            .filter(|job| matches(job))
            .map(|job| job.end_s - job.start_s)
            .sum()
    }
}

impl TestStore {
    /// Starts a day with an evaluation of this submission only.
    async fn evaluate_alone(
        &mut self,
        submission: faceoff_types::SubmissionId,
        plan: &RunPlan,
    ) -> EvaluationId {
        self.advance_clock_s(24 * 3600);
        let stage = self.configure_stage(plan).await;
        let started = self
            .store
            .start_day(Actor::Operator, stage, self.now)
            .await
            .unwrap();
        let mut evaluation_of_submission = None;
        for evaluation in started {
            if evaluation.submission == submission {
                evaluation_of_submission = Some(evaluation.id);
            } else {
                let cancelled = self.store.cancel_evaluation(
                    Actor::Operator,
                    evaluation.id,
                    "not part of this test",
                    self.now,
                );
                cancelled.await.unwrap();
            }
        }
        // Workers run days (batches) one after the other; in these tests all days are parts of one batch.
        sqlx::query("UPDATE jobs SET batch = 0")
            .execute(&mut self.connection().await)
            .await
            .unwrap();
        evaluation_of_submission.expect("the submission was active at the cutoff")
    }
}

/// As `stops` of [`SlotSimulation::run`]: the slots run until no job is left.
const NEVER: fn(&[JobRecord]) -> bool = |_| false;

#[tokio::test]
async fn slow_uploads_do_not_delay_other_teams() {
    for uploads in [2, 5] {
        for slots in [1, 2] {
            let mut sim = SlotSimulation::new(slots).await;
            sim.queue_evaluations(&[("Quick", 40)]).await;
            let slow_validations = sim.create_team("Slow validations").await;
            for _ in 0..uploads {
                sim.f.upload(&slow_validations).await;
            }
            let duration_s = |_, kind| if kind == JobKind::Validation { 100 } else { 10 };
            sim.run(duration_s, NEVER).await;
            let validations: Vec<usize> = (0..sim.job_records.len())
                .filter(|index| sim.job_records[*index].kind == JobKind::Validation)
                .collect();
            assert_eq!(validations.len(), uploads);
            // Ten shards take as long as one validation run.
            for pair in validations.windows(2) {
                let shards_left = sim.job_records[pair[1]..]
                    .iter()
                    .filter(|job| job.kind == JobKind::Shard)
                    .count();
                let shards_between = sim.job_records[pair[0]..pair[1]]
                    .iter()
                    .filter(|job| job.kind == JobKind::Shard)
                    .count();
                assert!(
                    shards_between >= 10 - slots || shards_left == 0,
                    "{slots} slots: {:?}",
                    sim.claim_order()
                );
            }
        }
    }
}

#[tokio::test]
async fn upload_flood_delays_other_team_by_one_job() {
    let mut sim = SlotSimulation::new(1).await;
    let flood = sim.create_team("Flood").await;
    for _ in 0..20 {
        sim.f.upload(&flood).await;
    }
    sim.run(|_, _| 60, |job_records| job_records.len() == 3)
        .await;
    let other = sim.create_team("Other").await;
    sim.f.upload(&other).await;
    sim.f.upload(&other).await;
    sim.run(|_, _| 60, |job_records| job_records.len() == 7)
        .await;
    let teams: Vec<_> = sim.job_records.iter().map(|job| job.team).collect();
    assert_eq!(
        teams,
        [
            "Flood", "Flood", "Flood", "Flood", "Other", "Flood", "Other"
        ]
    );
}

#[tokio::test]
async fn slot_time_is_equal_for_waiting_teams() {
    /// The longest duration of a job.
    const MAX_DURATION_S: i64 = 600;
    // Names, numbers of shards and durations of a shard in seconds: each team needs 1800 s.
    let teams = [("Slow", 3, 600), ("Middle", 15, 120), ("Quick", 60, 30)];
    for slots in [1, 3] {
        // In several orders, so that being first is no advantage.
        for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let mut sim = SlotSimulation::new(slots).await;
            sim.queue_evaluations(&order.map(|index| (teams[index].0, teams[index].1)))
                .await;
            let duration_s = |team, kind| match kind {
                JobKind::Shard => teams.iter().find(|(name, ..)| *name == team).unwrap().2,
                _ => 1,
            };
            sim.run(duration_s, NEVER).await;
            assert_eq!(
                sim.job_records
                    .iter()
                    .filter(|job| job.kind == JobKind::Shard)
                    .count(),
                3 + 15 + 60
            );
            // While all three teams have queued jobs, none is ahead by more than one job per slot and one more.
            for end in 1..sim.job_records.len() {
                let (before, after) = sim.job_records.split_at(end);
                let is_waiting = |name| after.iter().any(|job| job.team == name);
                if !teams.iter().all(|(name, ..)| is_waiting(*name)) {
                    break;
                }
                let times = teams
                    .map(|(name, ..)| SlotSimulation::slot_time_s(before, |job| job.team == name));
                let difference = times.iter().max().unwrap() - times.iter().min().unwrap();
                assert!(
                    difference <= MAX_DURATION_S * (1 + slots as i64),
                    "{slots} slots, {times:?} after {end}"
                );
            }
        }
    }
}

#[tokio::test]
async fn running_jobs_count_as_slot_time() {
    let mut sim = SlotSimulation::new(4).await;
    sim.queue_evaluations(&[("A", 9), ("B", 9), ("C", 9)]).await;
    sim.run(|_, _| 1000, |job_records| job_records.len() == 6)
        .await;
    let mut first_teams: Vec<_> = sim.job_records[..3].iter().map(|job| job.team).collect();
    first_teams.sort_unstable();
    assert_eq!(first_teams, ["A", "B", "C"]);
    let mut job_counts = BTreeMap::new();
    for job in &sim.job_records {
        *job_counts.entry(job.team).or_insert(0) += 1;
    }
    assert!(
        job_counts.values().all(|count| *count == 2),
        "{:?}",
        sim.claim_order()
    );
}

#[tokio::test]
async fn slot_time_credit_expires_after_a_pause() {
    let mut sim = SlotSimulation::new(1).await;
    sim.queue_evaluations(&[("Busy", 60)]).await;
    sim.run(|_, _| 60, |job_records| job_records.len() == 30)
        .await;
    // From now on two teams share equally: the new team does not catch up on the half hour that it had no jobs.
    sim.queue_evaluations(&[("New", 30)]).await;
    sim.run(|_, _| 60, |job_records| job_records.len() == 50)
        .await;
    let with_new = &sim.job_records[30..];
    let sequences = with_new.chunk_by(|a, b| a.team == b.team).map(<[_]>::len);
    assert_eq!(
        sequences.max(),
        Some(1),
        "the teams alternate: {:?}",
        sim.claim_order()
    );
    // The same holds for kinds of jobs: the validation runs of a third team alternate with the shards of both teams.
    let third = sim.create_team("Third").await;
    for _ in 0..10 {
        sim.f.upload(&third).await;
    }
    sim.run(|_, _| 60, |job_records| job_records.len() == 70)
        .await;
    let with_third = &sim.job_records[50..];
    let sequences = with_third.chunk_by(|a, b| a.kind == b.kind).map(<[_]>::len);
    assert_eq!(
        sequences.max(),
        Some(1),
        "the kinds alternate: {:?}",
        sim.claim_order()
    );
    let validations = with_third
        .iter()
        .filter(|job| job.kind == JobKind::Validation);
    assert_eq!(validations.count(), 10);
}

#[tokio::test]
async fn ablations_run_last_and_scoring_first() {
    let mut sim = SlotSimulation::new(1).await;
    sim.queue_evaluations(&[("A", 3), ("B", 6)]).await;
    let slow_validations = sim.create_team("Slow validations").await;
    let valid_submission = sim
        .f
        .store
        .evaluation(*sim.evaluations.keys().next().unwrap())
        .await
        .unwrap()
        .submission;
    let one_episode_plan = RunPlan {
        episodes_per_task: 1,
        ..six_shard_plan()
    };
    sim.f
        .store
        .request_ablation(
            Actor::Operator,
            valid_submission,
            faceoff_airhockey::RULESET,
            &one_episode_plan,
            &ABLATION_PROFILES,
            sim.f.now,
        )
        .await
        .unwrap();
    for _ in 0..3 {
        sim.f.upload(&slow_validations).await;
    }
    sim.run(
        |_, kind| if kind == JobKind::Validation { 50 } else { 10 },
        NEVER,
    )
    .await;
    let order = sim.claim_order();
    let first_ablation = order
        .iter()
        .position(|(_, kind)| *kind == JobKind::Ablation)
        .unwrap();
    assert!(
        order[first_ablation..]
            .iter()
            .all(|(_, kind)| *kind == JobKind::Ablation),
        "{order:?}"
    );
    for (team, shards) in [("A", 3), ("B", 6)] {
        let team_shards: Vec<_> = (0..order.len())
            .filter(|index| order[*index] == (team, JobKind::Shard))
            .collect();
        assert_eq!(team_shards.len(), shards);
        assert_eq!(
            order[team_shards[shards - 1] + 1],
            ("", JobKind::Scoring),
            "{order:?}"
        );
    }
}

#[tokio::test]
async fn slot_time_lost_by_the_platform_is_not_charged() {
    let mut sim = SlotSimulation::new(1).await;
    sim.queue_evaluations(&[("A", 4), ("B", 4)]).await;
    // The first team's jobs fail by a platform fault, are released at a shutdown, or lose their lease, each after a long time.
    // The team's jobs stay the first in the queue.
    let first = sim.f.claim().await.unwrap();
    let (first_team, _) = sim.team_and_kind(&first.job).await;
    sim.f.advance_clock_s(500);
    sim.f
        .store
        .release_after_platform_fault(&first.claim, "disk full", sim.f.now)
        .await
        .unwrap();
    for ending in ["shutdown", "killed worker", "expired lease"] {
        let next = sim
            .f
            .store
            .claim("worker", LEASE_S, sim.f.now)
            .await
            .unwrap()
            .unwrap();
        assert_eq!(
            sim.team_and_kind(&next.job).await.0,
            first_team,
            "before the {ending}"
        );
        match ending {
            "shutdown" => {
                assert!(
                    sim.f
                        .store
                        .heartbeat(&next.claim, 0, 1000, sim.f.now)
                        .await
                        .unwrap()
                );
                sim.f.advance_clock_s(500);
                sim.f.store.release(&next.claim, sim.f.now).await.unwrap();
            }
            "killed worker" => {
                assert_eq!(
                    sim.f
                        .store
                        .end_leases_of("worker", sim.f.now)
                        .await
                        .unwrap(),
                    1
                );
            }
            _ => sim.f.advance_clock_s(i64::from(LEASE_S)),
        }
    }
    // The lost job is claimed again, and only its new lease is charged.
    let reclaimed = sim.f.claim().await.unwrap();
    let other = sim.f.claim().await.unwrap();
    let teams = [
        sim.team_and_kind(&reclaimed.job).await.0,
        sim.team_and_kind(&other.job).await.0,
    ];
    assert!(teams[0] != teams[1], "{teams:?}");
}

#[tokio::test]
async fn slot_time_charged_is_time_used() {
    let mut sim = SlotSimulation::new(1).await;
    sim.queue_evaluations(&[("A", 3), ("B", 3)]).await;
    // Charged times in ms: that of all shards first, then those of the teams, the largest first.
    let charged_ms = async |sim: &SlotSimulation| -> Vec<i64> {
        let mut connection = sim.f.connection().await;
        let rows = sqlx::query(
            "SELECT served_ms FROM accounts WHERE lane = 'shard' ORDER BY served_ms DESC",
        );
        let rows = rows.fetch_all(&mut connection).await.unwrap();
        let of_all_shards: i64 =
            sqlx::query_scalar("SELECT served_ms FROM lanes WHERE lane = 'shard'")
                .fetch_one(&mut connection)
                .await
                .unwrap();
        let accounts: Vec<i64> = rows.iter().map(|row| row.get(0)).collect();
        [vec![of_all_shards], accounts].concat()
    };
    let before = charged_ms(&sim).await;
    // What was charged since then: for all shards, and at most for one team.
    let newly_charged_ms = async |sim: &SlotSimulation| {
        let now = charged_ms(sim).await;
        (now[0] - before[0], now[1] - before[1])
    };
    let (claim, run, shard) = sim.f.claim_shard().await;
    assert_eq!(
        newly_charged_ms(&sim).await,
        (15_000, 15_000),
        "a claim is charged its lease"
    );
    for _ in 0..7 {
        sim.f.advance_clock_s(5);
        assert!(
            sim.f
                .store
                .heartbeat(&claim, 0, LEASE_S, sim.f.now)
                .await
                .unwrap()
        );
    }
    assert_eq!(newly_charged_ms(&sim).await, (50_000, 50_000));
    sim.f.advance_clock_s(3);
    assert!(run.keeps_recordings);
    sim.f.commit_shard(&claim, &shard).await;
    assert_eq!(
        newly_charged_ms(&sim).await,
        (38_000, 38_000),
        "a commit leaves the time used"
    );
    // A commit after the lease expired is charged the time used, too.
    let (claim, _, shard) = sim.f.claim_shard().await;
    sim.f.advance_clock_s(100);
    sim.f.commit_shard(&claim, &shard).await;
    assert_eq!(newly_charged_ms(&sim).await, (138_000, 100_000));
    // A cancelled job is charged until its cancellation.
    let (claim, _, _) = sim.f.claim_shard().await;
    sim.f.advance_clock_s(4);
    let evaluation = *sim.evaluations.keys().next().unwrap();
    sim.f
        .store
        .cancel_evaluation(Actor::Operator, evaluation, "no", sim.f.now)
        .await
        .unwrap();
    sim.f.advance_clock_s(4);
    let is_leased = sim
        .f
        .store
        .heartbeat(&claim, 0, LEASE_S, sim.f.now)
        .await
        .unwrap();
    let expected = if is_leased {
        138_000 + 19_000
    } else {
        138_000 + 4_000
    };
    assert_eq!(newly_charged_ms(&sim).await.0, expected);
}

#[tokio::test]
async fn claim_query_reads_open_jobs_only() {
    let f = TestStore::new().await;
    let mut connection = f.connection().await;
    let claims: Vec<String> = query_data()
        .into_iter()
        .map(|(_, data)| data["query"].as_str().unwrap().to_owned())
        .filter(|sql| sql.starts_with("UPDATE jobs") && sql.contains("FROM accounts a"))
        .collect();
    assert_eq!(claims.len(), 1, "a claim is one statement");
    let explain = sqlx::AssertSqlSafe(format!("EXPLAIN QUERY PLAN {}", claims[0])).into_sql_str();
    let plan = sqlx::raw_sql(explain)
        .fetch_all(&mut connection)
        .await
        .unwrap();
    let steps: Vec<String> = plan.iter().map(|step| step.get("detail")).collect();
    // Steps that read the table of jobs, by its name or its aliases in the query.
    let job_steps: Vec<_> = steps
        .iter()
        .filter(|step| {
            [" j ", " f ", " jobs "]
                .iter()
                .any(|name| step.contains(name))
        })
        .collect();
    assert!(job_steps.len() >= 2, "{steps:#?}");
    for step in job_steps {
        let by_index = step.contains("jobs_open (account_no=?")
            || step.contains("INTEGER PRIMARY KEY (rowid=?)");
        assert!(by_index, "{step} in {steps:#?}");
    }
}

/// A linear congruential generator of pseudo-random numbers (with Knuth's multiplier for 64 bits), in its current state.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 33) % bound
    }
}

#[tokio::test]
async fn slot_time_is_shared_by_teams_and_job_kinds() {
    /// The longest duration of a job.
    const MAX_DURATION_S: i64 = 200;
    const NAMES: [&str; 6] = ["A", "B", "C", "D", "E", "F"];
    for seed in 0..4 {
        let mut random = Random(seed);
        let slots = 1 + seed as usize;
        let mut sim = SlotSimulation::new(slots).await;
        let shards = NAMES.map(|name| (name, 5 + random.below(20) as u32));
        sim.queue_evaluations(&shards).await;
        let teams: Vec<TeamId> = sim.teams.keys().copied().collect();
        for _ in 0..40 {
            let team = teams[random.below(6) as usize];
            let quota = UploadQuota::default();
            let uploaded =
                sim.f
                    .store
                    .create_submission(Actor::Team(team), team, bundle(), &quota, sim.f.now);
            uploaded.await.unwrap();
        }
        let durations_s: BTreeMap<(&str, JobKind), i64> = NAMES
            .into_iter()
            .flat_map(|name| [(name, JobKind::Validation), (name, JobKind::Shard)])
            .map(|key| (key, 1 + random.below(MAX_DURATION_S as u64) as i64))
            .collect();
        sim.run(
            |team, kind| durations_s.get(&(team, kind)).copied().unwrap_or(1),
            NEVER,
        )
        .await;
        let max_difference = MAX_DURATION_S * (1 + slots as i64);
        for end in 1..sim.job_records.len() {
            let (before, after) = sim.job_records.split_at(end);
            let is_waiting = |kind| after.iter().any(|job| job.kind == kind);
            let time_s = |kind| SlotSimulation::slot_time_s(before, |job| job.kind == kind);
            if is_waiting(JobKind::Validation) && is_waiting(JobKind::Shard) {
                let difference = time_s(JobKind::Validation) - time_s(JobKind::Shard);
                assert!(
                    difference.abs() <= max_difference,
                    "seed {seed}, after {end}: {difference}"
                );
            }
            for kind in [JobKind::Validation, JobKind::Shard] {
                let times: Vec<i64> = NAMES
                    .into_iter()
                    .filter(|name| {
                        after
                            .iter()
                            .any(|job| (job.team, job.kind) == (*name, kind))
                    })
                    .map(|name| {
                        SlotSimulation::slot_time_s(before, |job| {
                            (job.team, job.kind) == (name, kind)
                        })
                    })
                    .collect();
                let difference = times
                    .iter()
                    .max()
                    .zip(times.iter().min())
                    .map(|(most, least)| most - least);
                assert!(
                    difference.unwrap_or_default() <= max_difference,
                    "seed {seed}, {kind:?} after {end}: {times:?}"
                );
            }
        }
    }
}
