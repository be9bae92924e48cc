//! Jobs and reports survive a round trip through JSON.

use faceoff_airhockey::TASKS;
use faceoff_airhockey::{DEFEND, EVALUATION, HIT, TRACKING_LOSS};
use faceoff_types::*;
use faceoff_wire::game::GameSpec;
use faceoff_wire::job::*;
use serde::{Serialize, de::DeserializeOwned};
use std::fmt::Debug;
use uuid::Uuid;

fn assert_round_trips<T: Serialize + DeserializeOwned + PartialEq + Debug>(value: &T) {
    let text = serde_json::to_string(value).expect("the value is written as JSON");
    assert_eq!(
        serde_json::from_str::<T>(&text)
            .as_ref()
            .expect("the JSON is read back"),
        value,
        "{text}"
    );
}

/// A job with an arbitrary lease. Numbers and ids in these helpers are arbitrary, but differ, so that a test notices swapped fields.
fn job(payload: JobPayload) -> JobSpec {
    JobSpec {
        lease: Lease {
            job_id: Uuid::from_u128(1),
            nonce: Uuid::from_u128(2),
            holder: "worker/slot-0".into(),
            expires_at: "2026-03-01T06:00:30.25Z".parse().expect("an instant"),
            duration_s: 30,
        },
        payload,
    }
}

fn agent() -> AgentSpec {
    AgentSpec {
        bundle: BundleRef {
            key: "bundles/x".into(),
            bytes: 1 << 40,
            blake3: "ab".repeat(32),
            file_name: "agent é.tar.gz".into(),
        },
        limits: AgentLimits::default(),
    }
}

fn shard(recording: Option<&str>) -> JobPayload {
    JobPayload::Shard {
        part_of: Uuid::from_u128(3),
        agent: agent(),
        spec: ShardSpec {
            ruleset: faceoff_airhockey::RULESET,
            platform_retries: 1,
            task: DEFEND,
            episodes: 100..u32::MAX,
            profile: TRACKING_LOSS,
            seed: Seed::from_number(4),
            mismatch_seed: Seed::from_number(5),
            max_faults: 6,
            perturbations: Default::default(),
        },
        output: recording.map_or(OutputFiles::None, |key| {
            OutputFiles::Recording(key.to_owned())
        }),
    }
}

fn game(recording: Option<&str>) -> JobPayload {
    JobPayload::Game {
        game: Uuid::from_u128(4).into(),
        attempt: 2,
        agents: Box::new([agent(), agent()]),
        spec: GameSpec {
            ruleset: faceoff_airhockey::RULESET,
            steps: 45_000,
            profile: EVALUATION,
            seed: Seed::from_number(6),
            mismatch_seed: Seed::from_number(5),
            limits: GameLimits::default(),
            platform_retries: 1,
            perturbations: Default::default(),
            forfeit_score: Default::default(),
        },
        recording: recording.map(str::to_owned),
    }
}

fn weights() -> TaskWeights {
    TaskWeights::parse("0.1,0.2,0.7", TASKS.into_iter()).expect("they sum to 1")
}

#[test]
fn all_jobs_round_trip() {
    let scoring = JobPayload::Scoring {
        evaluation: EvaluationId::new(),
        meta: EvaluationMeta {
            profile: EVALUATION,
            seed: Seed::from_number(7),
            mismatch_seed: Seed::from_number(8),
            agent: "striker".into(),
            ruleset: faceoff_airhockey::RULESET,
            variation: Default::default(),
            task_weights: weights(),
            tiers: None,
        },
        recordings: vec!["recordings/a".into(), "recordings/b".into()],
        dataset: "datasets/c.zip".into(),
    };
    let validation = JobPayload::Validation {
        submission: SubmissionId::new(),
        agent: agent(),
        spec: ValidationSpec {
            ruleset: faceoff_airhockey::RULESET,
            profile: faceoff_airhockey::EVALUATION,
            perturbations: Default::default(),
            episodes_per_task: 1000,
            episodes_per_shard: 50,
            tasks: TASKS.to_vec(),
            seed: Seed::from_number(3),
            mismatch_seed: Seed::from_number(4),
        },
        runtimes: vec![StageRuntimes {
            stage: "Qualifying".parse().unwrap(),
            runtimes: ["native".to_owned()].into_iter().collect(),
        }],
    };
    for payload in [
        validation,
        shard(Some("recordings/a")),
        shard(None),
        game(Some("games/a")),
        game(None),
        scoring,
    ] {
        assert_round_trips(&job(payload));
    }
}

#[test]
fn all_reports_round_trip() {
    let outcome = EpisodeOutcome {
        task: HIT,
        episode: 1,
        steps: 499,
        end: EpisodeEnd::AGENT_FAULT,
        success: false,
        violations: Violations::default(),
        computation_time: ComputationTime {
            mean_s: 0.1 + 0.2,
            max_s: 1e-7,
        },
        fault: Some(AgentFault {
            fault: AgentFaultKind::Exited { code: 3 },
            agent_task: HIT.into(),
            episode: Some(1),
            step: None,
            line: Some("\u{fffd}".into()),
        }),
    };
    let result = EvaluationResult {
        ruleset: faceoff_airhockey::RULESET.to_string(),
        profile: EVALUATION,
        seed: Seed::from_number(1),
        tasks: Default::default(),
        score: 54.9,
        penalty_points: 327.5,
        tier: Some(Tier::Deployable),
        timing: Some(SlotTiming::default()),
        variation: Default::default(),
    };
    let reports = [
        JobReport::Validation(ValidationOutcome::Valid {
            runtime: "native".into(),
            agent_name: "striker".into(),
            timing: Vec::new(),
            log: "begun\n".into(),
        }),
        JobReport::Validation(ValidationOutcome::Invalid {
            runtime: None,
            agent_name: None,
            reason: "agent.toml is missing".into(),
            timing: Vec::new(),
            log: String::new(),
        }),
        JobReport::Shard {
            outcomes: vec![outcome],
            log: "begun\n".into(),
            stopped_by_faults: true,
            recording: Some("recordings/a".into()),
        },
        JobReport::Game {
            score: serde_json::json!({"winner": null, "sides": [{"goals": 3}, {"goals": 3}]}),
            recording: Some(GameFiles {
                key: "games/a".into(),
                game_blake3: "ab".repeat(32),
                side_blake3: ["cd".repeat(32), "ef".repeat(32)],
            }),
            logs: ["begun\n".into(), String::new()],
        },
        JobReport::Scoring {
            dataset: "datasets/c.zip".into(),
            blake3: "cd".repeat(32),
            result: Box::new(result),
        },
    ];
    for report in reports {
        assert_round_trips(&report);
    }
}

#[test]
fn job_description_names_the_job() {
    let description = shard(None).to_string();
    assert_eq!(
        description,
        "defend episodes 100 to 4294967294 of 00000000-0000-0000-0000-000000000003, profile \
         tracking_loss"
    );
    let description = game(None).to_string();
    assert_eq!(
        description,
        "game 00000000-0000-0000-0000-000000000004, 45000 steps, profile evaluation, attempt 2"
    );
}

#[test]
fn jobs_without_variation_round_trip_unchanged() {
    let JobPayload::Shard { spec, .. } = shard(None) else {
        unreachable!();
    };
    let text = serde_json::to_string(&spec).expect("it is JSON");
    assert!(!text.contains("perturbations"), "{text}");
    let read: ShardSpec = serde_json::from_str(&text).expect("it is read back");
    assert_eq!(read.perturbations, Magnitudes::default());
    let mut changed = spec;
    let magnitude = Magnitude::Number(1.0 / 3.0);
    changed
        .perturbations
        .set("disturbance", "sigma_n_per_m_s", magnitude);
    assert_round_trips(&changed);

    let legacy_tiers: TierBounds = "0.5,1.5".parse().expect("bounds");
    let meta = EvaluationMeta {
        profile: EVALUATION,
        seed: Seed::from_number(1),
        mismatch_seed: Seed::from_number(2),
        agent: "a".into(),
        ruleset: faceoff_airhockey::RULESET,
        variation: Variation::default(),
        task_weights: weights(),
        tiers: Some(legacy_tiers),
    };
    let text = serde_json::to_string(&meta).expect("it is JSON");
    for key in ["\"weights", "tier_bounds", "perturbations", "variation"] {
        assert!(!text.contains(key), "{text}");
    }
    let mut changed = meta;
    changed.variation.weights = Some(weights());
    let perturbations = &mut changed.variation.perturbations;
    perturbations.set("tracking_loss", "steps", Magnitude::Counts([1, 2]));
    assert_round_trips(&changed);
}

#[test]
fn scoring_job_names_the_tiers_of_its_competition() {
    let meta = EvaluationMeta {
        profile: faceoff_airhockey::EVALUATION,
        seed: Seed::from_number(1),
        mismatch_seed: Seed::from_number(2),
        agent: "a".into(),
        ruleset: faceoff_airhockey::RULESET,
        variation: Variation::default(),
        task_weights: weights(),
        tiers: None,
    };
    assert_eq!(meta.tier_bounds(), None);
    assert_round_trips(&meta);
    let legacy_tiers: TierBounds = "0.5,1.5".parse().expect("bounds");
    let mut json = serde_json::to_value(&meta).expect("it is JSON");
    json.as_object_mut().expect("an object").remove("tiers");
    let mut earlier: EvaluationMeta = serde_json::from_value(json).expect("it is read");
    assert_eq!(earlier.tier_bounds(), Some(legacy_tiers));
    let stage_bounds: TierBounds = "0.1,0.2".parse().expect("bounds");
    earlier.variation.tier_bounds = Some(stage_bounds);
    assert_eq!(earlier.tier_bounds(), Some(stage_bounds));
    assert_round_trips(&earlier);
}
