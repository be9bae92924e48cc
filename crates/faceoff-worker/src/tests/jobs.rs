//! The content of jobs from the local server, and the meaning of its responses.

use super::{
    fixture::*,
    intercepted_server::{InterceptedServer, Interception},
};
use crate::server::{ClaimResult, JobServer as _, LeaseStatus};
use faceoff_airhockey::{ABLATION_PROFILES, TASKS};
use faceoff_store::*;
use faceoff_testkit::{change_rules, six_shard_plan, valid_outcome};
use faceoff_types::Magnitude;
use faceoff_wire::job::{JobPayload, JobReport, JobSpec, OutputFiles};

/// Claims the next job.
async fn claim_next(server: &Server) -> Option<JobSpec> {
    let local = server.local();
    let claimed = blocking(move || local.claim("test").unwrap()).await;
    match claimed {
        ClaimResult::Job(job) => Some(*job),
        ClaimResult::Empty { .. } => None,
    }
}

async fn commit(server: &Server, job: &JobSpec, report: JobReport) -> LeaseStatus {
    let (local, lease) = (server.local(), job.lease.clone());
    blocking(move || local.commit(&lease, report).unwrap()).await
}

/// Stores the files of a completed job, and returns its report, as a slot would do.
async fn store_files_and_report(server: &Server, job: &JobSpec) -> JobReport {
    match &job.payload {
        JobPayload::Validation { .. } => {
            JobReport::Validation(valid_outcome("native", "scripted", ""))
        }
        JobPayload::Shard { spec, output, .. } => {
            let recording = match output {
                OutputFiles::Recording(key) => Some(key.clone()),
                OutputFiles::Clips(_) | OutputFiles::None => None,
            };
            if let Some(key) = &recording {
                server
                    .put_artifact(&format!("{key}/steps.parquet"), b"steps")
                    .await;
            }
            JobReport::Shard {
                outcomes: spec
                    .episodes
                    .clone()
                    .map(|episode| outcome(spec.task, episode))
                    .collect(),
                log: String::new(),
                stopped_by_faults: false,
                recording,
            }
        }
        JobPayload::Game { .. } => panic!("no game is queued"),
        JobPayload::Scoring { meta, dataset, .. } => {
            server.put_artifact(dataset, b"PK").await;
            JobReport::Scoring {
                dataset: dataset.clone(),
                blake3: blake3::hash(b"PK").to_string(),
                result: Box::new(result(meta)),
            }
        }
    }
}

async fn complete_and_commit(server: &Server, job: &JobSpec) {
    let report = store_files_and_report(server, job).await;
    assert_eq!(commit(server, job, report).await, LeaseStatus::Held);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn jobs_do_not_contain_the_season_secret() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let submission = server.store.evaluation(id).await.unwrap().submission;
    server.upload("Beta", VALID_ARCHIVE).await;
    let plan = RunPlan {
        tasks: TASKS.to_vec(),
        episodes_per_task: 3,
        episodes_per_shard: 3,
        max_faults: 0,
        ..six_shard_plan()
    };
    server
        .store
        .request_ablation(
            Actor::Operator,
            submission,
            faceoff_airhockey::RULESET,
            &plan,
            &ABLATION_PROFILES,
            server.now(),
        )
        .await
        .unwrap();
    let secret = server.store.season().await.unwrap().secret;
    let (mut validation, mut recorded, mut unrecorded, mut scored) = (0, 0, 0, 0);
    while let Some(job) = claim_next(&server).await {
        let text = serde_json::to_string(&job).unwrap();
        assert!(!text.contains(&secret.to_string()), "{text}");
        match &job.payload {
            JobPayload::Validation { .. } => validation += 1,
            JobPayload::Shard {
                output: OutputFiles::Recording(_),
                ..
            } => recorded += 1,
            JobPayload::Shard { .. } => unrecorded += 1,
            JobPayload::Game { .. } => panic!("no game is queued"),
            JobPayload::Scoring { recordings, .. } => {
                assert_eq!(recordings.len(), 6);
                scored += 1;
            }
        }
        complete_and_commit(&server, &job).await;
    }
    // The evaluation has 2 shards of each of 3 tasks, which are recorded. The ablation has 1 shard of each task in 6 profiles, which are
    // not recorded.
    assert_eq!((validation, recorded, unrecorded, scored), (1, 6, 18, 1));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn jobs_and_ablations_use_the_stages_variation() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    // Jobs of the started day keep the old rules.
    let stage = server.store.stages().await.unwrap()[0].clone();
    let mut changed_variation = stage.revision.rules.variation.clone();
    changed_variation.weights = Some(faceoff_types::TaskWeights::of(faceoff_airhockey::HIT));
    changed_variation
        .perturbations
        .set("tracking_loss", "probability", Magnitude::Number(0.25));
    let changed = change_rules(&server.store, stage.id, server.now(), |rules| {
        rules.variation = changed_variation.clone();
    });
    let plan = changed.await.unwrap().plan();
    assert_eq!(plan.variation, changed_variation);
    let job = claim_next(&server).await.unwrap();
    let JobPayload::Shard { spec, .. } = &job.payload else {
        panic!("expected a shard");
    };
    assert_eq!(spec.perturbations, Default::default());
    let submission = server.store.evaluation(id).await.unwrap().submission;
    let created = server.store.request_ablation(
        Actor::Operator,
        submission,
        faceoff_airhockey::RULESET,
        &plan,
        &ABLATION_PROFILES,
        server.now(),
    );
    created.await.unwrap();
    complete_and_commit(&server, &job).await;
    let mut changed_jobs = 0;
    while let Some(job) = claim_next(&server).await {
        match &job.payload {
            JobPayload::Shard {
                spec,
                output: OutputFiles::Clips(_),
                ..
            } => {
                assert_eq!(spec.perturbations, changed_variation.perturbations);
                changed_jobs += 1;
            }
            JobPayload::Scoring { meta, .. } => assert!(meta.variation.is_empty()),
            _ => {}
        }
        complete_and_commit(&server, &job).await;
    }
    assert!(changed_jobs > 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn stage_limits_apply_to_validation_and_later_days() {
    let server = Server::new().await;
    server.start_evaluation().await;
    let stage = server.store.stages().await.unwrap()[0].clone();
    let changed = change_rules(&server.store, stage.id, server.now(), |rules| {
        rules.limits.pids = Some(7);
        rules.limits.step_s = Some(0.25);
    });
    assert_eq!(changed.await.unwrap().plan().limits.pids, Some(7));
    server.upload("Beta", VALID_ARCHIVE).await;
    let (mut validation, mut shards) = (Vec::new(), Vec::new());
    while let Some(job) = claim_next(&server).await {
        match &job.payload {
            JobPayload::Validation { agent, .. } => validation.push(agent.limits.clone()),
            JobPayload::Shard { agent, .. } => shards.push(agent.limits.clone()),
            JobPayload::Game { .. } | JobPayload::Scoring { .. } => {}
        }
        complete_and_commit(&server, &job).await;
    }
    let [validation_limits] = &validation[..] else {
        panic!("expected one validation run: {validation:?}");
    };
    // Jobs of the day that started under the old rules have the server's limits.
    let server_limits = shards[0].clone();
    assert!(shards.iter().all(|limits| *limits == server_limits));
    assert_ne!(server_limits.resources.pids, 7);
    let mut expected = server_limits;
    expected.resources.pids = 7;
    expected.time.step_s = 0.25;
    assert_eq!(*validation_limits, expected, "the limits of the open stage");
}

/// Plays all shards of an evaluation and returns its scoring job.
async fn scoring_job(server: &Server) -> JobSpec {
    loop {
        let job = claim_next(server).await.unwrap();
        if matches!(job.payload, JobPayload::Scoring { .. }) {
            return job;
        }
        complete_and_commit(server, &job).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn dataset_is_kept_when_its_commit_fails() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let job = scoring_job(&server).await;
    let report = store_files_and_report(&server, &job).await;
    let JobReport::Scoring { dataset, .. } = report.clone() else {
        panic!("{report:?}")
    };
    // The database fails, and the slot cannot know whether the COMMIT succeeded.
    server.store.close().await;
    let (local, lease) = (server.local(), job.lease.clone());
    let failed = blocking(move || local.commit(&lease, report)).await;
    assert!(failed.is_err(), "{failed:?}");
    assert!(server.has_artifact(&dataset).await);

    // After a restart the evaluation is scored again, which removes the first dataset.
    let server = server.reopen().await;
    server.advance(i64::from(LEASE_S) + 1);
    let job = scoring_job(&server).await;
    complete_and_commit(&server, &job).await;
    let EvaluationState::Finished {
        dataset: current, ..
    } = server.wait_for_end(id).await
    else {
        panic!("the evaluation finishes")
    };
    assert_ne!(current, dataset);
    assert!(server.has_artifact(&current).await);
    assert!(!server.has_artifact(&dataset).await);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn dataset_of_a_lost_lease_is_removed() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let expired_job = scoring_job(&server).await;
    server.advance(i64::from(LEASE_S) + 1);
    let job = scoring_job(&server).await;
    assert_eq!(job.lease.job_id, expired_job.lease.job_id);
    let (report, late_report) = (
        store_files_and_report(&server, &job).await,
        store_files_and_report(&server, &expired_job).await,
    );
    assert_eq!(
        commit(&server, &expired_job, late_report.clone()).await,
        LeaseStatus::Lost
    );
    assert_eq!(commit(&server, &job, report).await, LeaseStatus::Held);
    let JobReport::Scoring { dataset, .. } = late_report else {
        panic!("{late_report:?}")
    };
    assert!(!server.has_artifact(&dataset).await);
    let EvaluationState::Finished {
        dataset: current, ..
    } = server.wait_for_end(id).await
    else {
        panic!("the evaluation finishes")
    };
    assert!(server.has_artifact(&current).await);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn lost_commit_response_keeps_the_dataset() {
    let server = Server::new().await;
    let id = server.start_evaluation().await;
    let evaluator = ScriptedEvaluator::new(|_, _| Ok(()));
    let running = server.start_intercepted_slots(2, &evaluator, |local| {
        InterceptedServer::wrap(local, |interception| match interception {
            Interception::Committed(JobReport::Scoring { .. }) => {
                anyhow::bail!("the connection broke")
            }
            _ => Ok(()),
        })
    });
    let EvaluationState::Finished { dataset, .. } = server.wait_for_end(id).await else {
        panic!("the evaluation finishes")
    };
    running.stop().await;
    assert!(server.has_artifact(&dataset).await);
}
