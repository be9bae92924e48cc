//! What the local server puts into an order, and what its answers mean.

use super::{
    between::{Between, Moment},
    fixture::*,
};
use crate::server::{Claimed, Holding, WorkServer as _};
use faceoff_store::*;
use faceoff_types::{Profile, SmokeOutcome, Task};
use faceoff_wire::work::{Assignment, Keeps, WorkOrder, WorkReport};

async fn next(server: &Server) -> Option<WorkOrder> {
    let local = server.local();
    let claimed = blocking(move || local.claim("test").unwrap()).await;
    match claimed {
        Claimed::Order(order) => Some(*order),
        Claimed::Nothing { .. } => None,
    }
}

async fn commit(server: &Server, order: &WorkOrder, report: WorkReport) -> Holding {
    let (local, lease) = (server.local(), order.lease.clone());
    blocking(move || local.commit(&lease, report).unwrap()).await
}

/// What a slot would report.
async fn report(server: &Server, order: &WorkOrder) -> WorkReport {
    match &order.assignment {
        Assignment::Smoke { .. } => WorkReport::Smoke(SmokeOutcome::Valid {
            runtime: "native".into(),
            agent_name: "scripted".into(),
            timing: Vec::new(),
            log: String::new(),
        }),
        Assignment::Play { spec, keeps, .. } => {
            let recording = match keeps {
                Keeps::Recording(key) => Some(key.clone()),
                Keeps::Clips(_) | Keeps::Nothing => None,
            };
            if let Some(key) = &recording {
                server.put(&format!("{key}/steps.parquet"), b"steps").await;
            }
            WorkReport::Play {
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
        Assignment::Game { .. } => panic!("no game is queued"),
        Assignment::Finalise { meta, dataset, .. } => {
            server.put(dataset, b"PK").await;
            WorkReport::Finalise {
                dataset: dataset.clone(),
                blake3: blake3::hash(b"PK").to_string(),
                result: Box::new(result(meta)),
            }
        }
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_order_tells_the_seasons_secret() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let submission = server.store.evaluation(id).await.unwrap().submission;
    server.upload("Beta", b"archive").await;
    let plan = RunPlan {
        profile: Profile::Evaluation,
        tasks: Task::ALL.to_vec(),
        episodes_per_task: 3,
        episodes_per_shard: 3,
        max_faults: 0,
        variation: Default::default(),
        limits: Default::default(),
    };
    server
        .store
        .create_ablation(Actor::Organiser, submission, &plan, server.now())
        .await
        .unwrap();
    let secret = server.store.season().await.unwrap().secret;
    let (mut smoke, mut recorded, mut unrecorded, mut finalised) = (0, 0, 0, 0);
    while let Some(order) = next(&server).await {
        let text = serde_json::to_string(&order).unwrap();
        assert!(!text.contains(&secret.to_string()), "{text}");
        match &order.assignment {
            Assignment::Smoke { .. } => smoke += 1,
            Assignment::Play {
                keeps: Keeps::Recording(_),
                ..
            } => recorded += 1,
            Assignment::Play { .. } => unrecorded += 1,
            Assignment::Game { .. } => panic!("no game is queued"),
            Assignment::Finalise { recordings, .. } => {
                assert_eq!(recordings.len(), 6);
                finalised += 1;
            }
        }
        let report = report(&server, &order).await;
        assert_eq!(commit(&server, &order, report).await, Holding::Held);
    }
    assert_eq!((smoke, recorded, unrecorded, finalised), (1, 6, 18, 1));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stages_weights_bounds_and_magnitudes_go_with_its_orders_and_its_ablations() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    // Of the old rules is what was cut by them.
    let stage = server.store.stages().await.unwrap()[0].clone();
    let mut rules = stage.rules.rules.clone();
    rules.variation.weights = "1,0,0".parse().unwrap();
    rules.variation.perturbations.tracking_loss.probability = 0.25;
    let wild = rules.variation.clone();
    let change = StageChange {
        rules: Some(rules),
        ..StageChange::default()
    };
    let changed = server
        .store
        .change_stage(Actor::Organiser, stage.id, change, server.now());
    let plan = changed.await.unwrap().plan();
    assert_eq!(plan.variation, wild);
    let order = next(&server).await.unwrap();
    let Assignment::Play { spec, .. } = &order.assignment else {
        panic!("expected a shard");
    };
    assert_eq!(*spec.perturbations, Default::default());
    let submission = server.store.evaluation(id).await.unwrap().submission;
    let ordered = server
        .store
        .create_ablation(Actor::Organiser, submission, &plan, server.now());
    ordered.await.unwrap();
    let report_of = report(&server, &order).await;
    assert_eq!(commit(&server, &order, report_of).await, Holding::Held);
    let mut wildly_played = 0;
    while let Some(order) = next(&server).await {
        match &order.assignment {
            Assignment::Play {
                spec,
                keeps: Keeps::Clips(_),
                ..
            } => {
                assert_eq!(spec.perturbations, wild.perturbations);
                wildly_played += 1;
            }
            Assignment::Finalise { meta, .. } => assert!(meta.variation.is_none()),
            _ => {}
        }
        let report = report(&server, &order).await;
        assert_eq!(commit(&server, &order, report).await, Holding::Held);
    }
    assert!(wildly_played > 0);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_stages_limits_hold_for_smoke_runs_and_for_what_is_cut_by_its_rules() {
    let server = Server::new().await;
    server.evaluation().await;
    let stage = server.store.stages().await.unwrap()[0].clone();
    let mut rules = stage.rules.rules.clone();
    rules.limits.pids = Some(7);
    rules.limits.step_s = Some(0.25);
    let change = StageChange {
        rules: Some(rules),
        ..StageChange::default()
    };
    let changed = server
        .store
        .change_stage(Actor::Organiser, stage.id, change, server.now());
    assert_eq!(changed.await.unwrap().plan().limits.pids, Some(7));
    server.upload("Beta", b"archive").await;
    let (mut smoke, mut shards) = (Vec::new(), Vec::new());
    while let Some(order) = next(&server).await {
        match &order.assignment {
            Assignment::Smoke { agent, .. } => smoke.push(agent.limits.clone()),
            Assignment::Play { agent, .. } => shards.push(agent.limits.clone()),
            Assignment::Game { .. } | Assignment::Finalise { .. } => {}
        }
        let report = report(&server, &order).await;
        assert_eq!(commit(&server, &order, report).await, Holding::Held);
    }
    let [of_smoke] = &smoke[..] else {
        panic!("expected one smoke run: {smoke:?}");
    };
    // What was cut by the rules of before is held to the server's limits.
    let of_server = shards[0].clone();
    assert!(shards.iter().all(|limits| *limits == of_server));
    assert_ne!(of_server.resources.pids, 7);
    let mut expected = of_server;
    expected.resources.pids = 7;
    expected.time.step_s = 0.25;
    assert_eq!(*of_smoke, expected, "as in the stage that is open");
}

/// Plays all shards of an evaluation and returns the order to finalise it.
async fn finalisation(server: &Server) -> WorkOrder {
    loop {
        let order = next(server).await.unwrap();
        if matches!(order.assignment, Assignment::Finalise { .. }) {
            return order;
        }
        let report = report(server, &order).await;
        assert_eq!(commit(server, &order, report).await, Holding::Held);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_dataset_stays_when_its_commit_fails() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let order = finalisation(&server).await;
    let report = report(&server, &order).await;
    let WorkReport::Finalise { dataset, .. } = report.clone() else {
        panic!("{report:?}")
    };
    // the database fails; whether at the COMMIT or before it, nobody on this side can tell
    server.store.close().await;
    let (local, lease) = (server.local(), order.lease.clone());
    let failed = blocking(move || local.commit(&lease, report)).await;
    assert!(failed.is_err(), "{failed:?}");
    assert!(server.has(&dataset).await);

    // the next life finalises again, and then the stray goes
    let server = server.reopen().await;
    server.pass(i64::from(LEASE_S) + 1);
    let order = finalisation(&server).await;
    let report = self::report(&server, &order).await;
    assert_eq!(commit(&server, &order, report).await, Holding::Held);
    let EvaluationState::Finished { dataset: kept, .. } = server.over(id).await else {
        panic!("it finishes")
    };
    assert_ne!(kept, dataset);
    assert!(server.has(&kept).await);
    assert!(!server.has(&dataset).await);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_dataset_of_a_lost_lease_goes() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let late = finalisation(&server).await;
    server.pass(i64::from(LEASE_S) + 1);
    let order = finalisation(&server).await;
    assert_eq!(order.lease.unit, late.lease.unit);
    let (first, second) = (report(&server, &order).await, report(&server, &late).await);
    assert_eq!(commit(&server, &late, second.clone()).await, Holding::Lost);
    assert_eq!(commit(&server, &order, first).await, Holding::Held);
    let WorkReport::Finalise { dataset, .. } = second else {
        panic!("{second:?}")
    };
    assert!(!server.has(&dataset).await);
    let EvaluationState::Finished { dataset: kept, .. } = server.over(id).await else {
        panic!("it finishes")
    };
    assert!(server.has(&kept).await);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_answer_to_a_commit_that_is_lost_on_the_way_costs_no_dataset() {
    let server = Server::new().await;
    let id = server.evaluation().await;
    let healthy = Scripted::new(|_, _| Ok(()));
    let running = server.work_through(2, &healthy, |local| {
        Between::slots_and(local, |moment| match moment {
            Moment::Committed(WorkReport::Finalise { .. }) => {
                anyhow::bail!("the connection broke")
            }
            _ => Ok(()),
        })
    });
    let EvaluationState::Finished { dataset, .. } = server.over(id).await else {
        panic!("it finishes")
    };
    running.stop().await;
    assert!(server.has(&dataset).await);
}
