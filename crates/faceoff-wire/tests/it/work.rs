//! Work orders and reports survive the way through JSON.

use faceoff_types::*;
use faceoff_wire::game::GameSpec;
use faceoff_wire::work::*;
use serde::{Serialize, de::DeserializeOwned};
use std::{collections::BTreeMap, fmt::Debug};
use uuid::Uuid;

fn travels<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let text = serde_json::to_string(value).expect("it is JSON");
    assert_eq!(
        serde_json::from_str::<T>(&text)
            .as_ref()
            .expect("it comes back"),
        value,
        "{text}"
    );
}

fn order(assignment: Assignment) -> WorkOrder {
    WorkOrder {
        lease: Lease {
            unit: Uuid::from_u128(1),
            nonce: Uuid::from_u128(2),
            slot: "worker/slot-0".into(),
            expires_at: "2026-03-01T06:00:30.25Z".parse().expect("an instant"),
            duration_s: 30,
        },
        assignment,
    }
}

fn agent() -> AgentOrder {
    AgentOrder {
        bundle: BundleRef {
            key: "bundles/x".into(),
            bytes: 1 << 40,
            blake3: "ab".repeat(32),
            file_name: "agent é.tar.gz".into(),
        },
        limits: AgentLimits::default(),
    }
}

fn shard(recording: Option<&str>) -> Assignment {
    Assignment::Play {
        part_of: Uuid::from_u128(3),
        agent: agent(),
        spec: ShardSpec {
            ruleset: Ruleset::CURRENT,
            platform_retries: 1,
            task: Task::Defend,
            episodes: 100..u32::MAX,
            profile: Profile::TrackingLoss,
            seed: Seed::from_number(4),
            mismatch_seed: Seed::from_number(5),
            max_faults: 6,
            perturbations: Default::default(),
        },
        keeps: recording.map_or(Keeps::Nothing, |key| Keeps::Recording(key.to_owned())),
    }
}

fn game(recording: Option<&str>) -> Assignment {
    Assignment::Game {
        game: Uuid::from_u128(4).into(),
        attempt: 2,
        agents: Box::new([agent(), agent()]),
        spec: GameSpec {
            ruleset: Ruleset::CURRENT,
            steps: 45_000,
            profile: Profile::Evaluation,
            seed: Seed::from_number(6),
            mismatch_seed: Seed::from_number(5),
            limits: GameLimits::default(),
            platform_retries: 1,
            perturbations: Default::default(),
        },
        recording: recording.map(str::to_owned),
    }
}

#[test]
fn every_order_round_trips() {
    let finalise = Assignment::Finalise {
        evaluation: EvaluationId::new(),
        meta: EvaluationMeta {
            profile: Profile::Evaluation,
            seed: Seed::from_number(7),
            mismatch_seed: Seed::from_number(8),
            agent: "striker".into(),
            ruleset: Ruleset::CURRENT,
            variation: Default::default(),
        },
        recordings: vec!["recordings/a".into(), "recordings/b".into()],
        dataset: "datasets/c.zip".into(),
    };
    let smoke = Assignment::Smoke {
        submission: SubmissionId::new(),
        agent: agent(),
        spec: SmokeSpec {
            seed: Seed::from_number(3),
            mismatch_seed: Seed::from_number(4),
        },
        runtimes: vec![StageRuntimes {
            stage: "Qualifying".parse().unwrap(),
            runtimes: ["native".to_owned()].into_iter().collect(),
        }],
    };
    for assignment in [
        smoke,
        shard(Some("recordings/a")),
        shard(None),
        game(Some("games/a")),
        game(None),
        finalise,
    ] {
        travels(&order(assignment));
    }
}

#[test]
fn every_report_round_trips() {
    let outcome = EpisodeOutcome {
        task: Task::Hit,
        episode: 1,
        steps: 499,
        end: EpisodeEnd::AgentFault,
        success: false,
        violations: Violations::default(),
        computation_time: ComputationTime {
            mean_s: 0.1 + 0.2,
            max_s: 1e-7,
        },
        fault: Some(AgentFault {
            fault: AgentFaultKind::Exited { code: 3 },
            contest: Task::Hit.into(),
            episode: Some(1),
            step: None,
            line: Some("\u{fffd}".into()),
        }),
    };
    let result = EvaluationResult {
        ruleset: RULESET.into(),
        profile: Profile::Evaluation,
        seed: Seed::from_number(1),
        tasks: BTreeMap::new(),
        score: 54.9,
        penalty_points: 327.5,
        tier: Tier::Deployable,
        timing: Some(SlotTiming::default()),
        variation: Default::default(),
    };
    let reports = [
        WorkReport::Smoke(SmokeOutcome::Valid {
            runtime: "native".into(),
            agent_name: "striker".into(),
            timing: Vec::new(),
            log: "begun\n".into(),
        }),
        WorkReport::Smoke(SmokeOutcome::Invalid {
            runtime: None,
            agent_name: None,
            reason: "agent.toml is missing".into(),
            timing: Vec::new(),
            log: String::new(),
        }),
        WorkReport::Play {
            outcomes: vec![outcome],
            log: "begun\n".into(),
            stopped_by_faults: true,
            recording: Some("recordings/a".into()),
        },
        WorkReport::Game {
            score: serde_json::json!({"winner": null, "sides": [{"goals": 3}, {"goals": 3}]}),
            recording: Some(StoredGame {
                key: "games/a".into(),
                game_blake3: "ab".repeat(32),
                side_blake3: ["cd".repeat(32), "ef".repeat(32)],
            }),
            logs: ["begun\n".into(), String::new()],
        },
        WorkReport::Finalise {
            dataset: "datasets/c.zip".into(),
            blake3: "cd".repeat(32),
            result: Box::new(result),
        },
    ];
    for report in reports {
        travels(&report);
    }
}

#[test]
fn a_log_line_names_the_work() {
    let told = shard(None).to_string();
    assert_eq!(
        told,
        "defend episodes 100 to 4294967294 of 00000000-0000-0000-0000-000000000003, profile \
         tracking_loss"
    );
    let told = game(None).to_string();
    assert_eq!(
        told,
        "game 00000000-0000-0000-0000-000000000004, 45000 steps, profile evaluation, attempt 2"
    );
}

#[test]
fn orders_of_before_there_were_variations_are_read_and_written_as_they_were() {
    let Assignment::Play { spec, .. } = shard(None) else {
        unreachable!();
    };
    let text = serde_json::to_string(&spec).expect("it is JSON");
    assert!(!text.contains("perturbations"), "{text}");
    let read: ShardSpec = serde_json::from_str(&text).expect("it comes back");
    assert_eq!(*read.perturbations, PerturbationSettings::default());
    let mut wild = spec;
    wild.perturbations.disturbance.sigma_n_per_m_s = 1.0 / 3.0;
    travels(&wild);

    let meta = EvaluationMeta {
        profile: Profile::Evaluation,
        seed: Seed::from_number(1),
        mismatch_seed: Seed::from_number(2),
        agent: "a".into(),
        ruleset: Ruleset::CURRENT,
        variation: Variation::default(),
    };
    let text = serde_json::to_string(&meta).expect("it is JSON");
    for key in ["weights", "tier_bounds", "perturbations", "variation"] {
        assert!(!text.contains(key), "{text}");
    }
    let mut wild = meta;
    wild.variation.weights = "0.1,0.2,0.7".parse().expect("they sum to 1");
    wild.variation.perturbations.tracking_loss.steps = [1, 2];
    travels(&wild);
}
