//! A submission's way from the upload to the board, with the operations that the HTTP server and the workers use.

use crate::fixture::*;
use faceoff_airhockey::TASKS;
use faceoff_store::*;

/// Shards of [`six_shard_plan`].
const SHARDS: u32 = 6;
const EPISODES_PER_SHARD: u32 = 2;

#[tokio::test]
async fn submission_reaches_board_after_upload_and_runs() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let submission = f.upload(&team).await;
    assert_eq!(submission.state, SubmissionState::Validating);
    assert_eq!(submission.bundle, bundle());
    for error in [
        f.store
            .activate_submission(Actor::Team(team.id), submission.id, f.now)
            .await
            .unwrap_err(),
        f.start_day(&six_shard_plan()).await.unwrap_err(),
    ] {
        assert!(matches!(error, StoreError::Conflict(_)), "{error}");
    }

    let valid = f.validate().await;
    assert_eq!(valid.agent_name.as_deref(), Some("striker"));
    assert_eq!(valid.state, SubmissionState::Valid);
    let log = f.store.submission_log(submission.id).await.unwrap();
    assert_eq!(log.as_deref(), Some("hello\n"));

    let evaluation = f.evaluate(submission.id, &six_shard_plan()).await;
    assert_eq!(evaluation.state, EvaluationState::Queued);
    assert_eq!(evaluation.stage_day.date, jiff::civil::date(2026, 3, 1));
    assert_eq!(evaluation.plan, six_shard_plan());

    let mut played = Vec::new();
    for shards_done in 0..SHARDS {
        let (claim, run, shard) = f.claim_shard().await;
        assert_eq!(run.id, evaluation.run);
        assert_eq!(run.plan, six_shard_plan());
        let progress = running(f.state(evaluation.id).await);
        assert_eq!(progress.episodes_done, EPISODES_PER_SHARD * shards_done);
        assert_eq!(progress.commits.len(), shards_done as usize);
        // The worker reports that it has completed one episode. Teams see only episodes of committed shards.
        assert!(f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap());
        let progress = running(f.state(evaluation.id).await);
        assert_eq!(progress.episodes_done, EPISODES_PER_SHARD * shards_done + 1);
        let an_hour_later = f.now + jiff::SignedDuration::from_hours(1);
        assert_eq!(
            progress.episodes_visible_to_team(an_hour_later),
            EPISODES_PER_SHARD * shards_done
        );
        f.advance_clock_s(1);
        assert_eq!(f.commit_shard(&claim, &shard).await, CommitOutcome::Stored);
        played.push((shard.task, shard.first_episode, shard.end_episode));
    }
    // Shards are claimed in a random order, so they are sorted before the comparison.
    let all: Vec<_> = TASKS
        .into_iter()
        .flat_map(|task| [(task, 0, 2), (task, 2, 4)])
        .collect();
    played.sort_unstable_by_key(|played| all.iter().position(|other| other == played));
    assert_eq!(played, all);
    let outcomes = f.store.outcomes(evaluation.run).await.unwrap();
    let expected = TASKS
        .into_iter()
        .flat_map(|task| (0..4).map(move |episode| outcome(task, episode, false)));
    assert!(
        outcomes.into_iter().eq(expected),
        "outcomes are read exactly as they were stored"
    );

    assert_eq!(f.state(evaluation.id).await, EvaluationState::Scoring);
    assert!(f.board().await.is_empty());
    let Some(ClaimedJob {
        claim,
        job:
            Job::Scoring {
                evaluation: scored,
                run,
                recordings,
                agent_name,
                seeds,
            },
    }) = f.claim().await
    else {
        panic!("expected a scoring job")
    };
    assert_eq!((scored, run.id), (evaluation.id, evaluation.run));
    assert_eq!(agent_name, "striker");
    let shards = f.store.shards(run.id).await.unwrap();
    let expected: Vec<_> = shards
        .into_iter()
        .filter_map(|shard| shard.recording)
        .collect();
    assert_eq!((recordings.len(), recordings), (SHARDS as usize, expected));
    let secret = f.store.season().await.unwrap().secret;
    assert_eq!(
        seeds.episodes,
        secret
            .stage(evaluation.stage_day.stage)
            .day(evaluation.stage_day.date)
    );
    assert_eq!(seeds.mismatch, secret.model_mismatch());
    assert!(f.claim().await.is_none(), "the job is claimed only once");
    f.advance_clock_s(1);
    let finished = f.finish_scoring(&claim, 51.2, "datasets/x.zip").await;
    assert_eq!(finished, CommitOutcome::Stored);
    let repeated = f.finish_scoring(&claim, 0.0, "datasets/y.zip").await;
    assert_eq!(repeated, CommitOutcome::AlreadyStored);
    assert_eq!(
        f.state(evaluation.id).await,
        EvaluationState::Finished {
            finished_at: f.now,
            result: Box::new(result(51.2)),
            dataset: "datasets/x.zip".into(),
            dataset_blake3: Some(blake3_of("datasets/x.zip")),
        }
    );

    let board = f.board().await;
    assert_eq!(board.len(), 1);
    assert_eq!(board[0].team, team);
    assert_eq!(board[0].submission, submission.id);
    assert_eq!(board[0].agent_name.as_deref(), Some("striker"));
    assert_eq!(board[0].run, evaluation.run);
    assert_eq!(board[0].result, result(51.2));
}

/// The progress of an evaluation, which must be running with [`SHARDS`] shards.
fn running(state: EvaluationState) -> RunProgress {
    let EvaluationState::Running {
        progress,
        episodes_total,
    } = state
    else {
        panic!("{state:?}")
    };
    assert_eq!(episodes_total, SHARDS * EPISODES_PER_SHARD);
    progress
}

#[tokio::test]
async fn shards_are_claimed_in_an_order_drawn_for_each_run() {
    let f = TestStore::new().await;
    let mut submissions = Vec::new();
    for number in 0..8 {
        let submission = f.valid_submission_of(&format!("Team {number}")).await;
        submissions.push(submission.id);
    }
    f.evaluate(submissions[0], &six_shard_plan()).await;
    let mut order_by_run = std::collections::HashMap::<_, Vec<_>>::new();
    while let Some(ClaimedJob { claim, job }) = f.claim().await {
        if let Job::Shard { run, shard, .. } = job {
            f.commit_shard(&claim, &shard).await;
            let order = order_by_run.entry(run.id).or_default();
            order.push((shard.task, shard.first_episode));
        }
    }
    assert_eq!(order_by_run.len(), submissions.len());
    let orders: std::collections::HashSet<_> = order_by_run.into_values().collect();
    // With 720 orders of six shards, eight equal ones would be a miracle.
    assert!(orders.len() > 1, "{orders:?}");
}
