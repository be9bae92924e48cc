//! From an upload to the board, as the HTTP server and the worker use the store.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::*;

#[tokio::test]
async fn submission_travels_from_upload_to_board() {
    let mut f = TestStore::new().await;
    let team = f.team("Alpha").await;
    let submission = f.upload(&team).await;
    assert_eq!(submission.state, SubmissionState::Validating);
    assert_eq!(submission.bundle, bundle());
    for error in [
        f.store
            .activate_submission(Actor::Team(team.id), submission.id, f.now)
            .await
            .unwrap_err(),
        f.store
            .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
            .await
            .unwrap_err(),
    ] {
        assert!(matches!(error, StoreError::Conflict(_)), "{error}");
    }

    let valid = f.validate().await;
    assert_eq!(valid.agent_name.as_deref(), Some("striker"));
    assert_eq!(valid.state, SubmissionState::Valid);
    let log = f.store.submission_log(submission.id).await.unwrap();
    assert_eq!(log.as_deref(), Some("hello\n"));

    let evaluation = f.evaluate(submission.id, &plan()).await;
    assert_eq!(evaluation.state, EvaluationState::Queued);
    assert_eq!(evaluation.stage_day.date, jiff::civil::date(2026, 3, 1));
    assert_eq!(evaluation.plan, plan());

    let mut played = Vec::new();
    for index in 0..6 {
        let (claim, running, shard) = f.claim_shard().await;
        assert_eq!(running.id, evaluation.run);
        assert_eq!(running.plan, plan());
        assert_eq!(
            f.state(evaluation.id).await,
            EvaluationState::Running {
                episodes_done: 2 * index,
                episodes_total: 12
            }
        );
        assert!(f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap());
        assert_eq!(
            f.state(evaluation.id).await,
            EvaluationState::Running {
                episodes_done: 2 * index + 1,
                episodes_total: 12
            }
        );
        f.later(1);
        assert_eq!(
            f.commit_shard(&claim, &shard, 0).await,
            CommitOutcome::Stored
        );
        played.push((shard.task, shard.first_episode, shard.end_episode));
    }
    let in_order = Task::ALL
        .into_iter()
        .flat_map(|task| [(task, 0, 2), (task, 2, 4)]);
    assert!(
        played.into_iter().eq(in_order),
        "shards come in (task, first episode) order"
    );
    let outcomes = f.store.outcomes(evaluation.run).await.unwrap();
    let expected = Task::ALL
        .into_iter()
        .flat_map(|task| (0..4).map(move |e| outcome(task, e, false)));
    assert!(
        outcomes.into_iter().eq(expected),
        "outcomes come back to the bit"
    );

    assert_eq!(f.state(evaluation.id).await, EvaluationState::Finalising);
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
    let in_order: Vec<_> = shards.into_iter().filter_map(|s| s.recording).collect();
    assert_eq!((recordings.len(), recordings), (6, in_order));
    let secret = f.store.season().await.unwrap().secret;
    assert_eq!(
        seeds.episodes,
        secret
            .stage(evaluation.stage_day.stage)
            .day(evaluation.stage_day.date)
    );
    assert_eq!(seeds.mismatch, secret.model_mismatch());
    assert!(f.claim().await.is_none(), "it is claimed once");
    f.later(1);
    let finished = f.finish(&claim, 51.2, "datasets/x.zip").await;
    assert_eq!(finished, CommitOutcome::Stored);
    let repeated = f.finish(&claim, 0.0, "datasets/y.zip").await;
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
