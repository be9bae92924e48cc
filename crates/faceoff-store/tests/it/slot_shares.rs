//! Fair shares of slot time. Tests set the clock and the duration of each job, and check the order of claims.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{EvaluationId, Task, TeamId};
use sqlx::{Row, SqlSafeStr};
use std::collections::BTreeMap;

/// Longer than any job of these tests: no lease is renewed.
const LONG_LEASE_S: u32 = 100_000;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Validation,
    Shard,
    Scoring,
    Ablation,
}

/// A job that a slot has run.
#[derive(Debug, Clone, PartialEq, Eq)]
struct RunJob {
    team: &'static str,
    kind: Kind,
    /// Start and end, seconds since the beginning.
    from: i64,
    to: i64,
}

struct Slots {
    f: TestStore,
    teams: BTreeMap<TeamId, &'static str>,
    evaluations: BTreeMap<EvaluationId, TeamId>,
    /// When each slot becomes free, and the job that it runs until then.
    slots: Vec<(i64, Option<(JobClaim, Job)>)>,
    started_at: jiff::Timestamp,
    served: Vec<RunJob>,
}

impl Slots {
    async fn new(slots: usize) -> Self {
        let f = TestStore::new().await;
        let started_at = f.now;
        Self {
            f,
            teams: BTreeMap::new(),
            evaluations: BTreeMap::new(),
            slots: (0..slots).map(|_| (0, None)).collect(),
            started_at,
            served: Vec::new(),
        }
    }

    fn at(&self, second: i64) -> jiff::Timestamp {
        self.started_at + jiff::SignedDuration::from_secs(second)
    }

    async fn team(&mut self, name: &'static str) -> Team {
        let team = self.f.team(name).await;
        self.teams.insert(team.id, name);
        team
    }

    /// Teams with a valid submission each, whose evaluations with the given numbers of shards are queued in this order.
    async fn evaluations(&mut self, teams: &[(&'static str, u32)]) {
        let mut submissions = Vec::new();
        for (name, shards) in teams {
            let team = self.team(name).await;
            self.f.upload(&team).await;
            let submission = self.f.validate().await;
            submissions.push((team.id, submission.id, *shards));
        }
        for (team, submission, shards) in submissions {
            let plan = RunPlan {
                tasks: vec![Task::Hit],
                episodes_per_task: shards,
                episodes_per_shard: 1,
                ..plan()
            };
            // on separate days, so that their lengths can differ
            let evaluation = self.f.evaluate_alone(submission, &plan).await;
            self.evaluations.insert(evaluation, team);
        }
        self.started_at = self.f.now;
    }

    /// Team and kind of a job; scoring and ablations have no team here.
    async fn team_and_kind(&self, job: &Job) -> (&'static str, Kind) {
        match job {
            Job::Validation { submission, .. } => (self.teams[&submission.team], Kind::Validation),
            Job::Shard {
                owner: RunOwner::Evaluation(id),
                ..
            } => (self.teams[&self.evaluations[id]], Kind::Shard),
            Job::Shard { .. } => ("", Kind::Ablation),
            Job::Scoring { .. } => ("", Kind::Scoring),
            Job::Game { .. } => panic!("no game is queued"),
        }
    }

    /// Runs the slots until no job is left or `until` is true. A job takes `cost` seconds.
    async fn run(
        &mut self,
        cost: impl Fn(&'static str, Kind) -> i64,
        until: impl Fn(&[RunJob]) -> bool,
    ) {
        loop {
            let index = (0..self.slots.len())
                .min_by_key(|slot| self.slots[*slot].0)
                .unwrap();
            let (second, done) = std::mem::take(&mut self.slots[index]);
            self.f.now = self.at(second);
            if let Some((claim, job)) = done {
                self.commit(&claim, job).await;
            }
            let next = match until(&self.served) {
                true => None,
                false => self
                    .f
                    .store
                    .claim("slot", LONG_LEASE_S, self.f.now)
                    .await
                    .unwrap(),
            };
            match next {
                Some(ClaimedJob { claim, job }) => {
                    let (team, kind) = self.team_and_kind(&job).await;
                    let to = second + cost(team, kind);
                    self.served.push(RunJob {
                        team,
                        kind,
                        from: second,
                        to,
                    });
                    self.slots[index] = (to, Some((claim, job)));
                }
                None => {
                    // until another slot is free, which can make a job claimable
                    let others = self
                        .slots
                        .iter()
                        .enumerate()
                        .filter(|(_, slot)| slot.1.is_some());
                    let Some(next) = others.map(|(_, slot)| slot.0).min() else {
                        self.slots[index].0 = second;
                        return;
                    };
                    self.slots[index].0 = next.max(second) + 1;
                }
            }
        }
    }

    async fn commit(&self, claim: &JobClaim, job: Job) {
        let (store, now) = (&self.f.store, self.f.now);
        let committed = match job {
            Job::Validation { .. } => {
                let refused = faceoff_types::ValidationOutcome::Invalid {
                    runtime: None,
                    agent_name: None,
                    reason: "it does not answer".into(),
                    timing: Vec::new(),
                    log: String::new(),
                };
                store.commit_validation(claim, refused, now).await
            }
            Job::Shard { run, shard, .. } => {
                let mut played = commit(&shard, 0);
                played.recording = played.recording.filter(|_| run.keeps_recordings);
                store.commit_shard(claim, played, now).await
            }
            Job::Scoring { .. } => Ok(self.f.finish(claim, 1.0, "d").await),
            Job::Game { .. } => panic!("no game is queued"),
        };
        assert_eq!(committed.unwrap(), CommitOutcome::Stored);
    }

    fn order(&self) -> Vec<(&'static str, Kind)> {
        self.served.iter().map(|one| (one.team, one.kind)).collect()
    }

    /// Total slot time of the matching jobs, seconds.
    fn slot_time(served: &[RunJob], matches: impl Fn(&RunJob) -> bool) -> i64 {
        served
            .iter()
            .filter(|one| matches(one))
            .map(|one| one.to - one.from)
            .sum()
    }
}

impl TestStore {
    /// An evaluation of this submission only, on its own day.
    async fn evaluate_alone(
        &mut self,
        submission: faceoff_types::SubmissionId,
        plan: &RunPlan,
    ) -> EvaluationId {
        self.later(24 * 3600);
        let stage = self.stage(plan).await;
        let started = self
            .store
            .start_day(Actor::Organiser, stage, self.now)
            .await
            .unwrap();
        let mut of_submission = None;
        for evaluation in started {
            if evaluation.submission == submission {
                of_submission = Some(evaluation.id);
            } else {
                let cancelled = self.store.cancel_evaluation(
                    Actor::Organiser,
                    evaluation.id,
                    "not part of this test",
                    self.now,
                );
                cancelled.await.unwrap();
            }
        }
        // Days are run one after the other; these represent parts of one day.
        sqlx::query("UPDATE jobs SET batch = 0")
            .execute(&mut self.connection().await)
            .await
            .unwrap();
        of_submission.expect("it was active at the cutoff")
    }
}

const NEVER: fn(&[RunJob]) -> bool = |_| false;

#[tokio::test]
async fn slow_uploads_do_not_delay_other_teams() {
    for uploads in [2, 5] {
        for slots in [1, 2] {
            let mut s = Slots::new(slots).await;
            s.evaluations(&[("Quick", 40)]).await;
            let sleeper = s.team("Sleeper").await;
            for _ in 0..uploads {
                s.f.upload(&sleeper).await;
            }
            let cost = |_, kind| if kind == Kind::Validation { 100 } else { 10 };
            s.run(cost, NEVER).await;
            let validations: Vec<usize> = (0..s.served.len())
                .filter(|at| s.served[*at].kind == Kind::Validation)
                .collect();
            assert_eq!(validations.len(), uploads);
            // Ten shards take as long as one validation run.
            for pair in validations.windows(2) {
                let left = s.served[pair[1]..]
                    .iter()
                    .filter(|one| one.kind == Kind::Shard)
                    .count();
                let between = s.served[pair[0]..pair[1]]
                    .iter()
                    .filter(|one| one.kind == Kind::Shard)
                    .count();
                assert!(
                    between >= 10 - slots || left == 0,
                    "{slots} slots: {:?}",
                    s.order()
                );
            }
        }
    }
}

#[tokio::test]
async fn upload_flood_delays_other_upload_by_one() {
    let mut s = Slots::new(1).await;
    let flood = s.team("Flood").await;
    for _ in 0..20 {
        s.f.upload(&flood).await;
    }
    s.run(|_, _| 60, |served| served.len() == 3).await;
    let other = s.team("Other").await;
    s.f.upload(&other).await;
    s.f.upload(&other).await;
    s.run(|_, _| 60, |served| served.len() == 7).await;
    let teams: Vec<_> = s.served.iter().map(|one| one.team).collect();
    assert_eq!(
        teams,
        [
            "Flood", "Flood", "Flood", "Flood", "Other", "Flood", "Other"
        ]
    );
}

#[tokio::test]
async fn slot_time_is_equal_for_waiting_teams() {
    // in several orders, so that being first is no advantage
    let teams = [("Slow", 3, 600), ("Middle", 15, 120), ("Quick", 60, 30)];
    for slots in [1, 3] {
        for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let mut s = Slots::new(slots).await;
            s.evaluations(&order.map(|index| (teams[index].0, teams[index].1)))
                .await;
            let cost = |team, kind| match kind {
                Kind::Shard => teams.iter().find(|one| one.0 == team).unwrap().2,
                _ => 1,
            };
            s.run(cost, NEVER).await;
            assert_eq!(
                s.served
                    .iter()
                    .filter(|one| one.kind == Kind::Shard)
                    .count(),
                78
            );
            // While all three teams have queued jobs, none is ahead by more than one job per slot.
            for end in 1..s.served.len() {
                let (before, after) = s.served.split_at(end);
                let is_waiting = |name| after.iter().any(|one| one.team == name);
                if !teams.iter().all(|one| is_waiting(one.0)) {
                    break;
                }
                let times =
                    teams.map(|one| Slots::slot_time(before, |served| served.team == one.0));
                let apart = times.iter().max().unwrap() - times.iter().min().unwrap();
                assert!(
                    apart <= 600 * (1 + slots as i64),
                    "{slots} slots, {times:?} after {end}"
                );
            }
        }
    }
}

#[tokio::test]
async fn running_jobs_count_as_slot_time() {
    let mut s = Slots::new(4).await;
    s.evaluations(&[("A", 9), ("B", 9), ("C", 9)]).await;
    s.run(|_, _| 1000, |served| served.len() == 6).await;
    let mut first: Vec<_> = s.served[..3].iter().map(|one| one.team).collect();
    first.sort_unstable();
    assert_eq!(first, ["A", "B", "C"]);
    let mut shares = BTreeMap::new();
    for one in &s.served {
        *shares.entry(one.team).or_insert(0) += 1;
    }
    assert!(shares.values().all(|count| *count == 2), "{:?}", s.order());
}

#[tokio::test]
async fn slot_time_credit_expires_after_a_pause() {
    let mut s = Slots::new(1).await;
    s.evaluations(&[("Busy", 60)]).await;
    s.run(|_, _| 60, |served| served.len() == 30).await;
    // From now on they share equally. A team without jobs for half an hour does not catch up, and the other one has no
    // debt.
    s.evaluations(&[("New", 30)]).await;
    s.run(|_, _| 60, |served| served.len() == 50).await;
    let since = &s.served[30..];
    let runs = since.chunk_by(|a, b| a.team == b.team).map(<[_]>::len);
    assert_eq!(runs.max(), Some(1), "alternating: {:?}", s.order());
    // The same between kinds of jobs: a third team's uploads share with both.
    let third = s.team("Third").await;
    for _ in 0..10 {
        s.f.upload(&third).await;
    }
    s.run(|_, _| 60, |served| served.len() == 70).await;
    let since = &s.served[50..];
    let runs = since.chunk_by(|a, b| a.kind == b.kind).map(<[_]>::len);
    assert_eq!(runs.max(), Some(1), "alternating: {:?}", s.order());
    let validations = since.iter().filter(|one| one.kind == Kind::Validation);
    assert_eq!(validations.count(), 10);
}

#[tokio::test]
async fn ablations_run_last_and_scoring_first() {
    let mut s = Slots::new(1).await;
    s.evaluations(&[("A", 3), ("B", 6)]).await;
    let sleeper = s.team("Sleeper").await;
    let valid =
        s.f.store
            .evaluation(*s.evaluations.keys().next().unwrap())
            .await
            .unwrap()
            .submission;
    let small = RunPlan {
        episodes_per_task: 1,
        ..plan()
    };
    s.f.store
        .request_ablation(Actor::Organiser, valid, &small, s.f.now)
        .await
        .unwrap();
    for _ in 0..3 {
        s.f.upload(&sleeper).await;
    }
    s.run(
        |_, kind| if kind == Kind::Validation { 50 } else { 10 },
        NEVER,
    )
    .await;
    let order = s.order();
    let first_ablation = order
        .iter()
        .position(|one| one.1 == Kind::Ablation)
        .unwrap();
    assert!(
        order[first_ablation..]
            .iter()
            .all(|one| one.1 == Kind::Ablation),
        "{order:?}"
    );
    for (team, shards) in [("A", 3), ("B", 6)] {
        let of_team: Vec<_> = (0..order.len())
            .filter(|at| order[*at] == (team, Kind::Shard))
            .collect();
        assert_eq!(of_team.len(), shards);
        assert_eq!(
            order[of_team[shards - 1] + 1],
            ("", Kind::Scoring),
            "{order:?}"
        );
    }
}

#[tokio::test]
async fn slot_time_lost_by_the_platform_is_not_charged() {
    let mut s = Slots::new(1).await;
    s.evaluations(&[("A", 4), ("B", 4)]).await;
    // The first team's jobs fail by a platform fault, are released at a shutdown, or are lost with their worker, each
    // after a long time. The team stays first.
    let first = s.f.claim().await.unwrap();
    let (first_team, _) = s.team_and_kind(&first.job).await;
    s.f.later(500);
    s.f.store
        .release_failed(&first.claim, "disk full", s.f.now)
        .await
        .unwrap();
    for ending in ["shutdown", "dead worker", "lease runs out"] {
        let next =
            s.f.store
                .claim("dead", LEASE_S, s.f.now)
                .await
                .unwrap()
                .unwrap();
        assert_eq!(
            s.team_and_kind(&next.job).await.0,
            first_team,
            "before the {ending}"
        );
        match ending {
            "shutdown" => {
                assert!(
                    s.f.store
                        .heartbeat(&next.claim, 0, 1000, s.f.now)
                        .await
                        .unwrap()
                );
                s.f.later(500);
                s.f.store.release(&next.claim, s.f.now).await.unwrap();
            }
            "dead worker" => assert_eq!(s.f.store.end_leases_of("dead", s.f.now).await.unwrap(), 1),
            _ => s.f.later(i64::from(LEASE_S)),
        }
    }
    // The lost job is claimed again, and only its new lease is charged.
    let reclaimed = s.f.claim().await.unwrap();
    let other = s.f.claim().await.unwrap();
    let teams = [
        s.team_and_kind(&reclaimed.job).await.0,
        s.team_and_kind(&other.job).await.0,
    ];
    assert!(teams[0] != teams[1], "{teams:?}");
}

#[tokio::test]
async fn slot_time_charged_is_time_used() {
    let mut s = Slots::new(1).await;
    s.evaluations(&[("A", 3), ("B", 3)]).await;
    let charged = async |s: &Slots| -> Vec<i64> {
        let mut connection = s.f.connection().await;
        let rows = sqlx::query(
            "SELECT served_ms FROM accounts WHERE lane = 'shard' ORDER BY served_ms DESC",
        );
        let rows = rows.fetch_all(&mut connection).await.unwrap();
        let lane: i64 = sqlx::query_scalar("SELECT served_ms FROM lanes WHERE lane = 'shard'")
            .fetch_one(&mut connection)
            .await
            .unwrap();
        let accounts: Vec<i64> = rows.iter().map(|row| row.get(0)).collect();
        [vec![lane], accounts].concat()
    };
    let before = charged(&s).await;
    let lane = before[0];
    let since = async |s: &Slots| {
        let now = charged(s).await;
        (now[0] - lane, now[1] - before[1])
    };
    let (claim, run, shard) = s.f.claim_shard().await;
    assert_eq!(since(&s).await, (15_000, 15_000), "a whole lease at once");
    for _ in 0..7 {
        s.f.later(5);
        assert!(
            s.f.store
                .heartbeat(&claim, 0, LEASE_S, s.f.now)
                .await
                .unwrap()
        );
    }
    assert_eq!(since(&s).await, (50_000, 50_000));
    s.f.later(3);
    assert!(run.keeps_recordings);
    s.f.commit_shard(&claim, &shard, 0).await;
    assert_eq!(
        since(&s).await,
        (38_000, 38_000),
        "at the end the time used"
    );
    // A lease that expired before the commit: the time used, too.
    let (claim, _, shard) = s.f.claim_shard().await;
    s.f.later(100);
    s.f.commit_shard(&claim, &shard, 0).await;
    assert_eq!(since(&s).await, (138_000, 100_000));
    // A cancelled job is charged until its cancellation.
    let (claim, _, _) = s.f.claim_shard().await;
    s.f.later(4);
    let evaluation = *s.evaluations.keys().next().unwrap();
    s.f.store
        .cancel_evaluation(Actor::Organiser, evaluation, "no", s.f.now)
        .await
        .unwrap();
    s.f.later(4);
    let is_held =
        s.f.store
            .heartbeat(&claim, 0, LEASE_S, s.f.now)
            .await
            .unwrap();
    let expected = if is_held {
        138_000 + 19_000
    } else {
        138_000 + 4_000
    };
    assert_eq!(since(&s).await.0, expected);
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
    let of_units: Vec<_> = steps
        .iter()
        .filter(|step| [" j ", " f ", " jobs "].iter().any(|of| step.contains(of)))
        .collect();
    assert!(of_units.len() >= 2, "{steps:#?}");
    for step in of_units {
        let by_index = step.contains("jobs_open (account_no=?")
            || step.contains("INTEGER PRIMARY KEY (rowid=?)");
        assert!(by_index, "{step} in {steps:#?}");
    }
}

/// A simple pseudo-random number generator.
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
    const NAMES: [&str; 6] = ["A", "B", "C", "D", "E", "F"];
    for seed in 0..4 {
        let mut random = Random(seed);
        let slots = 1 + seed as usize;
        let mut s = Slots::new(slots).await;
        let shards = NAMES.map(|name| (name, 5 + random.below(20) as u32));
        s.evaluations(&shards).await;
        let teams: Vec<TeamId> = s.teams.keys().copied().collect();
        for _ in 0..40 {
            let team = teams[random.below(6) as usize];
            let quota = UploadQuota::default();
            let uploaded =
                s.f.store
                    .create_submission(Actor::Team(team), team, bundle(), &quota, s.f.now);
            uploaded.await.unwrap();
        }
        let costs: BTreeMap<(&str, Kind), i64> = NAMES
            .into_iter()
            .flat_map(|name| [(name, Kind::Validation), (name, Kind::Shard)])
            .map(|key| (key, 1 + random.below(200) as i64))
            .collect();
        s.run(
            |team, kind| costs.get(&(team, kind)).copied().unwrap_or(1),
            NEVER,
        )
        .await;
        let bound = 200 * (1 + slots as i64);
        for end in 1..s.served.len() {
            let (before, after) = s.served.split_at(end);
            let is_waiting = |kind| after.iter().any(|one| one.kind == kind);
            let time = |kind| Slots::slot_time(before, |one| one.kind == kind);
            if is_waiting(Kind::Validation) && is_waiting(Kind::Shard) {
                let apart = time(Kind::Validation) - time(Kind::Shard);
                assert!(apart.abs() <= bound, "seed {seed}, after {end}: {apart}");
            }
            for kind in [Kind::Validation, Kind::Shard] {
                let times: Vec<i64> = NAMES
                    .into_iter()
                    .filter(|name| {
                        after
                            .iter()
                            .any(|one| (one.team, one.kind) == (*name, kind))
                    })
                    .map(|name| {
                        Slots::slot_time(before, |one| (one.team, one.kind) == (name, kind))
                    })
                    .collect();
                let apart = times
                    .iter()
                    .max()
                    .zip(times.iter().min())
                    .map(|(most, least)| most - least);
                assert!(
                    apart.unwrap_or_default() <= bound,
                    "seed {seed}, {kind:?} after {end}: {times:?}"
                );
            }
        }
    }
}
