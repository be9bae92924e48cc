//! Trials and proposed re-evaluations, which do not count unless they are applied.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

const REASON: &str = "the camera was dirty";

#[track_caller]
fn refused<T: std::fmt::Debug>(done: Result<T, StoreError>, words: &[&str]) {
    let Err(StoreError::Conflict(why)) = done else {
        panic!("expected a conflict with {words:?}: {done:?}");
    };
    for word in words {
        assert!(why.contains(word), "{word:?} is not in {why:?}");
    }
}

async fn trial(f: &TestStore, stage: StageId) -> Result<Proposal, StoreError> {
    f.store
        .propose_trial(Actor::Organiser, stage, None, REASON, f.now)
        .await
}

async fn propose(f: &TestStore, scope: Reevaluation) -> Result<Proposal, StoreError> {
    f.store
        .propose_reevaluation(Actor::Organiser, scope, REASON, f.now)
        .await
}

async fn apply(f: &TestStore, id: ProposalId) -> Result<Proposal, StoreError> {
    f.store.apply_proposal(Actor::Organiser, id, f.now).await
}

async fn discard(f: &TestStore, id: ProposalId) -> Result<Proposal, StoreError> {
    f.store.drop_proposal(Actor::Organiser, id, f.now).await
}

async fn evaluations(f: &TestStore, id: ProposalId) -> Vec<ProposedEvaluation> {
    f.store.proposal(id).await.unwrap().1
}

async fn rows(f: &TestStore) -> Vec<(String, f64)> {
    let board = f.board().await;
    let row = |row: &BoardRecord| (row.team.name.to_string(), row.result.score);
    board.iter().map(row).collect()
}

fn row(name: &str, score: f64) -> (String, f64) {
    (name.to_owned(), score)
}

/// Two teams, each with a result of 1.0 on a released day.
async fn played_day(f: &TestStore) -> ([Submission; 2], StageDay) {
    let agents = [f.ready_team("Alpha").await, f.ready_team("Beta").await];
    let of = f.evaluate(agents[0].id, &small()).await.stage_day;
    f.run_all(1.0).await;
    (agents, of)
}

#[tokio::test]
async fn trial_runs_last_and_reaches_no_board() {
    let mut f = TestStore::new().await;
    let agents = [f.ready_team("Alpha").await, f.ready_team("Beta").await];
    let stage = f.stage(&small()).await;
    let tried = trial(&f, stage).await.unwrap();
    assert_eq!((tried.kind, tried.outcome), (ProposalKind::Trial, None));
    let states: Vec<_> = evaluations(&f, tried.id).await;
    assert_eq!(states.len(), 2);
    assert!(
        states
            .iter()
            .all(|one| one.state == EvaluationState::Queued)
    );
    assert!(
        f.store.days().await.unwrap().is_empty(),
        "no day has started"
    );
    // The evaluations of the day run first.
    let day = f.evaluate(agents[0].id, &small()).await;
    for _ in 0..2 {
        let (claim, run, shard) = f.claim_shard().await;
        assert_eq!(run.seed, SeedLabel::StageDay(day.stage_day));
        f.commit_shard(&claim, &shard, 0).await;
        let (claim, _) = f.claim_scoring().await;
        f.finish(&claim, 1.0, "d").await;
    }
    assert!(f.store.days().await.unwrap()[0].0.released_at.is_some());
    for score in [8.0, 9.0] {
        let (claim, run, shard) = f.claim_shard().await;
        assert_eq!(run.seed, SeedLabel::Trial(tried.id), "episodes of its own");
        f.commit_shard(&claim, &shard, 0).await;
        let (claim, _) = f.claim_scoring().await;
        f.finish(&claim, score, "t").await;
    }
    assert!(f.claim().await.is_none());
    let scores: Vec<f64> = evaluations(&f, tried.id)
        .await
        .into_iter()
        .map(|evaluation| match evaluation.state {
            EvaluationState::Finished { result, .. } => result.score,
            state => panic!("{state:?}"),
        })
        .collect();
    assert_eq!(scores, [8.0, 9.0]);
    assert_eq!(rows(&f).await, [row("Alpha", 1.0), row("Beta", 1.0)]);
    for agent in &agents {
        let own = f.store.evaluations_of(agent.team).await.unwrap();
        assert_eq!(own.len(), 1, "the trial is not visible to its team");
    }
    refused(apply(&f, tried.id).await, &["cannot be applied"]);
    discard(&f, tried.id).await.unwrap();
    refused(discard(&f, tried.id).await, &["was dropped at"]);
    // Its datasets and recordings are deleted a day later, like those of evaluations.
    assert_eq!(f.store.remove_dropped_datasets(f.now).await.unwrap(), 0);
    f.later(25 * 3600);
    assert_eq!(f.store.remove_dropped_datasets(f.now).await.unwrap(), 2);
    assert_eq!(f.store.remove_dropped_datasets(f.now).await.unwrap(), 0);
    assert_eq!(f.store.remove_old_recordings(f.now).await.unwrap(), 4);
}

#[tokio::test]
async fn impossible_trial_is_refused() {
    let mut f = TestStore::new().await;
    let stage = f.stage(&small()).await;
    refused(trial(&f, stage).await, &["no team has a valid submission"]);
    let team = f.team("Alpha").await;
    let upload = f.upload(&team).await;
    let one = f
        .store
        .propose_trial(Actor::Organiser, stage, Some(upload.id), REASON, f.now);
    refused(one.await, &["valid"]);
    f.validate().await;
    let one = f
        .store
        .propose_trial(Actor::Organiser, stage, Some(upload.id), REASON, f.now);
    let one = one.await.unwrap();
    refused(
        f.store.close_season(Actor::Organiser, f.now).await,
        &["1", "trials"],
    );
    // It is dropped while a shard runs, and the worker is notified.
    let (claim, _, shard) = f.claim_shard().await;
    discard(&f, one.id).await.unwrap();
    assert_eq!(
        f.commit_shard(&claim, &shard, 0).await,
        CommitOutcome::LeaseLost
    );
    assert!(f.claim().await.is_none());
    let closing = StageChange {
        closes_at: Some(Some(f.now + jiff::SignedDuration::from_secs(1))),
        ..StageChange::default()
    };
    let closing = f
        .store
        .change_stage(Actor::Organiser, stage, closing, f.now);
    closing.await.unwrap();
    f.later(1);
    refused(trial(&f, stage).await, &["closed"]);
    f.store.close_season(Actor::Organiser, f.now).await.unwrap();
}

#[tokio::test]
async fn reevaluation_counts_only_once_applied() {
    let mut f = TestStore::new().await;
    let (agents, of) = played_day(&f).await;
    let first = f.store.evaluations_of_day(of).await.unwrap();
    let proposed = propose(&f, Reevaluation::Day(of)).await.unwrap();
    assert_eq!(proposed.kind, ProposalKind::Day(of.date));
    refused(apply(&f, proposed.id).await, &["2 of its evaluations"]);
    let mut labels = Vec::new();
    let mut score = 2.0;
    while let Some(ClaimedJob { claim, job }) = f.claim().await {
        match job {
            Job::Shard { run, shard, .. } => {
                labels.push(run.seed);
                f.commit_shard(&claim, &shard, 0).await;
            }
            _ => {
                f.finish(&claim, score, "again").await;
                score += 1.0;
            }
        }
    }
    assert_eq!(labels, [SeedLabel::StageDay(of); 2], "the same episodes");
    let counted = [row("Alpha", 1.0), row("Beta", 1.0)];
    assert_eq!(rows(&f).await, counted, "not before it is applied");

    f.later(60);
    let frozen = f
        .store
        .freeze_boards(Actor::Organiser, of.stage, REASON, f.now);
    frozen.await.unwrap();
    refused(apply(&f, proposed.id).await, &["frozen"]);
    let live = f.store.unfreeze_boards(Actor::Organiser, of.stage, f.now);
    live.await.unwrap();
    let applied = apply(&f, proposed.id).await.unwrap();
    assert_eq!(applied.outcome, Some(ProposalOutcome::Applied(f.now)));
    assert_eq!(rows(&f).await, [row("Alpha", 2.0), row("Beta", 3.0)]);
    for (old, agent) in first.iter().zip(&agents) {
        let old = f.store.evaluation(old.id).await.unwrap();
        let why = format!("evaluated again: {REASON}");
        assert_eq!(old.voided.unwrap().reason, why);
        let own = f.store.evaluations_of(agent.team).await.unwrap();
        let new = own.iter().find(|one| one.voided.is_none()).unwrap();
        assert_eq!(
            (new.rerun_of, new.stage_day, new.submission),
            (Some(old.id), of, agent.id)
        );
        let EvaluationState::Finished { finished_at, .. } = new.state else {
            panic!("{new:?}")
        };
        assert_eq!(finished_at, f.now, "it counts from now on");
    }
    refused(apply(&f, proposed.id).await, &["was applied at"]);
    refused(discard(&f, proposed.id).await, &["was applied at"]);
}

#[tokio::test]
async fn proposal_with_voided_original_is_refused_whole() {
    let f = TestStore::new().await;
    let (agents, of) = played_day(&f).await;
    let proposed = propose(&f, Reevaluation::Day(of)).await.unwrap();
    f.run_all(2.0).await;
    let of_beta = f.store.evaluations_of(agents[1].team).await.unwrap()[0].id;
    let voided = f
        .store
        .void_evaluation(Actor::Organiser, of_beta, REASON, f.now);
    voided.await.unwrap();
    refused(apply(&f, proposed.id).await, &["does not count any more"]);
    assert_eq!(
        rows(&f).await,
        [row("Alpha", 1.0)],
        "it is not applied in part"
    );
    // A new proposal covers what counts now.
    discard(&f, proposed.id).await.unwrap();
    let proposed = propose(&f, Reevaluation::Day(of)).await.unwrap();
    f.run_all(2.0).await;
    apply(&f, proposed.id).await.unwrap();
    assert_eq!(rows(&f).await, [row("Alpha", 2.0)]);
    refused(
        propose(&f, Reevaluation::Evaluation(of_beta)).await,
        &["no result counts"],
    );
}

#[tokio::test]
async fn reevaluation_replaces_result_by_agent_failure() {
    let mut f = TestStore::new().await;
    let (agents, _) = played_day(&f).await;
    let of_alpha = f.store.evaluations_of(agents[0].team).await.unwrap()[0].id;
    let proposed = propose(&f, Reevaluation::Evaluation(of_alpha))
        .await
        .unwrap();
    assert_eq!(evaluations(&f, proposed.id).await.len(), 1);
    let (claim, _, shard) = f.claim_shard().await;
    let stopped = ShardCommit {
        stopped_by_faults: true,
        ..commit(&shard, 1)
    };
    f.store.commit_shard(&claim, stopped, f.now).await.unwrap();
    let state = evaluations(&f, proposed.id).await.remove(0).state;
    assert!(
        matches!(state, EvaluationState::AgentFailed { .. }),
        "{state:?}"
    );
    apply(&f, proposed.id).await.unwrap();
    assert_eq!(
        rows(&f).await,
        [row("Beta", 1.0)],
        "Alpha has no result any more"
    );

    // Platform faults in a proposal change nothing.
    let of_beta = f.store.evaluations_of(agents[1].team).await.unwrap()[0].id;
    let proposed = propose(&f, Reevaluation::Evaluation(of_beta))
        .await
        .unwrap();
    for _ in 0..MAX_ATTEMPTS {
        let claimed = f.claim().await.unwrap();
        let failed = f.store.release_failed(&claimed.claim, "disk full", f.now);
        failed.await.unwrap();
        f.later(60);
    }
    let state = evaluations(&f, proposed.id).await.remove(0).state;
    assert!(
        matches!(state, EvaluationState::PlatformFailed { .. }),
        "{state:?}"
    );
    apply(&f, proposed.id).await.unwrap();
    assert_eq!(rows(&f).await, [row("Beta", 1.0)]);
    assert_eq!(f.store.evaluation(of_beta).await.unwrap().voided, None);
}

#[tokio::test]
async fn reevaluation_by_new_rules_has_its_own_board() {
    let f = TestStore::new().await;
    let (_, of) = played_day(&f).await;
    refused(
        propose(&f, Reevaluation::Rules(of)).await,
        &["stage's newest rules"],
    );
    let other = RunPlan {
        max_faults: 9,
        ..small()
    };
    let stage = f.stage(&other).await;
    let proposed = propose(&f, Reevaluation::Rules(of)).await.unwrap();
    assert_eq!(proposed.revision, 2);
    let (claim, run, shard) = f.claim_shard().await;
    assert_eq!(
        (run.plan.max_faults, run.seed),
        (9, SeedLabel::StageDay(of))
    );
    f.commit_shard(&claim, &shard, 0).await;
    f.run_all(5.0).await;
    apply(&f, proposed.id).await.unwrap();
    let scores = async |revision| -> Vec<f64> {
        let board = f.store.board(stage, revision).await.unwrap();
        board.iter().map(|row| row.result.score).collect()
    };
    assert_eq!(
        scores(1).await,
        [1.0, 1.0],
        "the board of the old rules stays"
    );
    assert_eq!(scores(2).await, [5.0, 5.0]);
    refused(
        propose(&f, Reevaluation::Rules(of)).await,
        &["stage's newest rules"],
    );
}

#[tokio::test]
async fn open_day_is_not_reevaluated() {
    let f = TestStore::new().await;
    let agent = f.ready_team("Alpha").await;
    let of = f.evaluate(agent.id, &small()).await.stage_day;
    refused(propose(&f, Reevaluation::Day(of)).await, &["not released"]);
    let none = StageDay {
        date: of.date.tomorrow().unwrap(),
        ..of
    };
    let no_day = propose(&f, Reevaluation::Day(none)).await;
    assert!(
        matches!(no_day, Err(StoreError::NotFound("day"))),
        "{no_day:?}"
    );
    let unknown = propose(&f, Reevaluation::Evaluation(EvaluationId::new())).await;
    assert!(
        matches!(unknown, Err(StoreError::NotFound("evaluation"))),
        "{unknown:?}"
    );
    let unknown = apply(&f, ProposalId::new()).await;
    assert!(
        matches!(unknown, Err(StoreError::NotFound("proposal"))),
        "{unknown:?}"
    );
}
