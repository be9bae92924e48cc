//! The start of a day of a stage, its *cutoff*: an evaluation of each team's active submission is queued. A team's newest valid
//! submission is active, unless the team chooses another or withdraws it.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{IanaTimeZone, SubmissionId, ValidationOutcome};
use jiff::civil::date;

/// The day of the error that a day's cutoff has passed already.
fn expect_cutoff_passed<T: std::fmt::Debug>(result: Result<T, StoreError>) -> jiff::civil::Date {
    match result {
        Err(StoreError::CutoffPassed { day, .. }) => day,
        other => panic!("expected that the cutoff has passed, got {other:?}"),
    }
}

#[tokio::test]
async fn day_has_one_cutoff() {
    let mut f = TestStore::new().await;
    let first = f.valid_submission_of("Alpha").await;
    f.now = "2026-03-01T23:59:59.998Z".parse().unwrap();
    let cutoff_at = f.now;
    let evaluation = f.evaluate(first.id, &six_shard_plan()).await;
    // There is no second cutoff: neither for the same submission, nor for a new one, nor for another team's.
    f.now = "2026-03-01T23:59:59.999Z".parse().unwrap();
    let team = f.store.team(first.team).await.unwrap();
    f.upload(&team).await;
    let second = f.validate().await;
    f.valid_submission_of("Beta").await;
    let repeated = f.start_day(&six_shard_plan()).await;
    assert_eq!(expect_cutoff_passed(repeated), date(2026, 3, 1));
    assert_eq!(
        f.store.evaluations_on(date(2026, 3, 1)).await.unwrap(),
        [evaluation]
    );
    let day = f
        .store
        .newest_day(f.configure_stage(&six_shard_plan()).await)
        .await
        .unwrap()
        .unwrap();
    assert_eq!(
        (day.stage_day.date, day.cutoff_at, day.released_at),
        (date(2026, 3, 1), cutoff_at, None)
    );
    // The next day comes a millisecond later.
    f.now = "2026-03-02T00:00:00Z".parse().unwrap();
    let next = f.evaluate(second.id, &six_shard_plan()).await;
    assert_eq!(next.stage_day.date, date(2026, 3, 2));
    assert_eq!(
        f.store
            .evaluations_on(next.stage_day.date)
            .await
            .unwrap()
            .len(),
        2
    );
    // A clock that was set back starts nothing.
    f.now = "2026-02-27T00:00:00Z".parse().unwrap();
    let repeated = f.start_day(&six_shard_plan()).await;
    assert_eq!(expect_cutoff_passed(repeated), date(2026, 3, 2));
}

#[tokio::test]
async fn concurrent_day_starts_make_one_cutoff() {
    let f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let other = f.reopen().await;
    let stage = f.configure_stage(&six_shard_plan()).await;
    let attempts = (0..20).map(|index| {
        let store = if index % 2 == 0 {
            f.store.clone()
        } else {
            other.clone()
        };
        let now = f.now;
        tokio::spawn(async move { store.start_day(Actor::Operator, stage, now).await })
    });
    let mut evaluations = 0;
    for attempt in attempts.collect::<Vec<_>>() {
        match attempt.await.unwrap() {
            Ok(started) => evaluations += started.len(),
            Err(StoreError::CutoffPassed { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
    assert_eq!(evaluations, 1);
}

#[tokio::test]
async fn day_without_submissions_starts_only_by_schedule() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let refused = f.start_day(&six_shard_plan()).await;
    assert_conflict(refused, &[]);
    assert_eq!(
        f.store
            .newest_day(f.configure_stage(&six_shard_plan()).await)
            .await
            .unwrap(),
        None
    );
    let started = f
        .store
        .start_scheduled_day(f.configure_stage(&six_shard_plan()).await, f.now)
        .await;
    assert_eq!(started.unwrap(), Some(Vec::new()));
    let day = f
        .store
        .newest_day(f.configure_stage(&six_shard_plan()).await)
        .await
        .unwrap()
        .unwrap();
    assert_eq!(day.released_at, Some(f.now), "there is nothing to wait for");
    // A later submission is evaluated on the next day.
    f.upload(&team).await;
    let submission = f.validate().await;
    expect_cutoff_passed(f.start_day(&six_shard_plan()).await);
    f.advance_clock_s(86_400);
    f.evaluate(submission.id, &six_shard_plan()).await;
}

async fn active_submission(f: &TestStore, team: &Team) -> SubmissionId {
    let submissions = f.store.submissions_of(team.id).await.unwrap();
    let active: Vec<_> = submissions
        .iter()
        .filter(|submission| submission.active)
        .collect();
    assert_eq!(active.len(), 1, "{submissions:?}");
    active[0].id
}

#[tokio::test]
async fn valid_upload_becomes_active_unless_superseded() {
    let mut f = TestStore::new().await;
    let old = f.valid_submission_of("Alpha").await;
    let team = f.store.team(old.team).await.unwrap();
    // Two uploads: the validation of the newer one ends first.
    f.advance_clock_s(1);
    let slow = f.upload(&team).await;
    let (slow_claim, _) = f.claim_validation().await;
    f.advance_clock_s(1);
    f.upload(&team).await;
    let quick = f.validate().await;
    assert!(quick.active);
    let valid_outcome = || valid_outcome("native", "late", "");
    let late = f
        .store
        .commit_validation(&slow_claim, valid_outcome(), f.now)
        .await;
    assert_eq!(late.unwrap(), CommitOutcome::Stored);
    assert_eq!(
        active_submission(&f, &team).await,
        quick.id,
        "a newer submission is active"
    );

    // The team's choice is kept when an upload from before the choice becomes valid.
    f.advance_clock_s(1);
    f.upload(&team).await;
    let (claim, uploaded_before) = f.claim_validation().await;
    f.advance_clock_s(1);
    let choose = |id| f.store.activate_submission(Actor::Team(team.id), id, f.now);
    assert!(matches!(
        choose(uploaded_before.id).await,
        Err(StoreError::Conflict(_))
    ));
    assert!(choose(old.id).await.unwrap().active);
    f.store
        .commit_validation(&claim, valid_outcome(), f.now)
        .await
        .unwrap();
    assert_eq!(active_submission(&f, &team).await, old.id);
    choose(slow.id).await.unwrap();
    assert_eq!(active_submission(&f, &team).await, slow.id);
    // A later upload replaces the choice.
    f.advance_clock_s(1);
    f.upload(&team).await;
    let newest = f.validate().await;
    assert_eq!(active_submission(&f, &team).await, newest.id);
    assert_eq!(
        f.evaluate(newest.id, &six_shard_plan()).await.submission,
        newest.id
    );
}

#[tokio::test]
async fn choice_after_cutoff_applies_to_next_day() {
    let mut f = TestStore::new().await;
    let first = f.valid_submission_of("Alpha").await;
    let team = f.store.team(first.team).await.unwrap();
    f.advance_clock_s(1);
    f.upload(&team).await;
    let second = f.validate().await;
    let today = f.evaluate(second.id, &one_shard_plan()).await;
    f.advance_clock_s(1);
    let choice = f
        .store
        .activate_submission(Actor::Team(team.id), first.id, f.now);
    choice.await.unwrap();
    f.finish_next_evaluation().await;
    assert_eq!(
        f.store.evaluation(today.id).await.unwrap().submission,
        second.id
    );
    f.advance_clock_s(86_400);
    assert_eq!(
        f.evaluate(first.id, &one_shard_plan()).await.submission,
        first.id
    );
}

#[tokio::test]
async fn cancelled_evaluation_loses_leases_and_can_be_rerun() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let evaluation = f.evaluate(submission.id, &six_shard_plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.store
        .cancel_evaluation(Actor::Operator, evaluation.id, "power cut announced", f.now)
        .await
        .unwrap();
    assert!(!f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap());
    assert_eq!(
        f.commit_shard(&claim, &shard).await,
        CommitOutcome::LeaseLost
    );
    assert!(f.claim().await.is_none());
    assert_eq!(
        f.state(evaluation.id).await,
        EvaluationState::Cancelled {
            finished_at: f.now,
            reason: "power cut announced".into()
        }
    );
    let repeated = f
        .store
        .cancel_evaluation(Actor::Operator, evaluation.id, "", f.now)
        .await;
    assert!(matches!(repeated, Err(StoreError::Conflict(_))));
    assert!(f.claim().await.is_none(), "there is no automatic rerun");
    let rerun = f
        .store
        .rerun_evaluation(Actor::Operator, evaluation.id, f.now);
    assert_eq!(rerun.await.unwrap().submission, submission.id);
}

#[tokio::test]
async fn cutoff_takes_newest_valid_submission_of_each_team() {
    let mut f = TestStore::new().await;
    let [alpha, beta] = f.two_valid_submissions().await;
    let without_upload = f.create_team("Without upload").await;
    let invalid = f.create_team("Invalid").await;
    f.upload(&invalid).await;
    let (claim, _) = f.claim_validation().await;
    let outcome = ValidationOutcome::Invalid {
        runtime: None,
        agent_name: None,
        reason: "no agent.toml".into(),
        timing: Vec::new(),
        log: String::new(),
    };
    f.store
        .commit_validation(&claim, outcome, f.now)
        .await
        .unwrap();
    f.advance_clock_s(1);
    let team = f.store.team(alpha.team).await.unwrap();
    f.upload(&team).await;
    let newer = f.validate().await;
    f.upload(&team).await; // not validated yet: the previous submission is evaluated

    let started = f.start_day(&six_shard_plan()).await.unwrap();
    let submissions: Vec<_> = started
        .iter()
        .map(|evaluation| evaluation.submission)
        .collect();
    assert_eq!(
        submissions,
        [beta.id, newer.id],
        "earliest submission first"
    );
    assert!(
        f.store
            .evaluations_of(without_upload.id)
            .await
            .unwrap()
            .is_empty()
    );
    assert!(f.store.evaluations_of(invalid.id).await.unwrap().is_empty());
}

#[tokio::test]
async fn scheduled_day_starts_once() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    let started = f
        .store
        .start_scheduled_day(f.configure_stage(&six_shard_plan()).await, f.now)
        .await
        .unwrap()
        .unwrap();
    assert_eq!(started.len(), 1);
    let other = f.reopen().await;
    assert!(
        other
            .start_scheduled_day(f.configure_stage(&six_shard_plan()).await, f.now)
            .await
            .unwrap()
            .is_none()
    );
    expect_cutoff_passed(
        other
            .start_day(
                Actor::Operator,
                f.configure_stage(&six_shard_plan()).await,
                f.now,
            )
            .await,
    );
    f.advance_clock_s(86_400);
    assert_eq!(
        other
            .start_scheduled_day(f.configure_stage(&six_shard_plan()).await, f.now)
            .await
            .unwrap()
            .unwrap()
            .len(),
        1
    );
    // A clock that was set back starts nothing.
    f.advance_clock_s(-86_400);
    assert!(
        f.store
            .start_scheduled_day(f.configure_stage(&six_shard_plan()).await, f.now)
            .await
            .unwrap()
            .is_none()
    );
}

#[tokio::test]
async fn empty_plan_is_refused() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let refused_plans = [
        RunPlan {
            tasks: vec![],
            ..six_shard_plan()
        },
        RunPlan {
            tasks: vec![six_shard_plan().tasks[0]; 2],
            ..six_shard_plan()
        },
        RunPlan {
            episodes_per_task: 0,
            ..six_shard_plan()
        },
        RunPlan {
            episodes_per_shard: 0,
            ..six_shard_plan()
        },
    ];
    for plan in refused_plans {
        let (rules, settings) = rules_and_settings(&plan);
        let error = f
            .store
            .configure_stage(rules, settings, IanaTimeZone::UTC, f.now)
            .await
            .unwrap_err();
        assert!(matches!(error, StoreError::Conflict(_)), "{error}");
    }
    assert!(
        f.store
            .evaluations_of(submission.team)
            .await
            .unwrap()
            .is_empty()
    );
}

#[tokio::test]
async fn board_shows_newest_finished_day_of_each_team() {
    let mut f = TestStore::new().await;
    f.valid_submission_of("Alpha").await;
    f.valid_submission_of("Beta").await;
    let one_shard = one_shard_plan();
    for (day, score) in [(1, 10.0), (2, 20.0), (3, 30.0)] {
        f.now = format!("2026-03-0{day}T12:00:00Z").parse().unwrap();
        assert_eq!(f.start_day(&one_shard).await.unwrap().len(), 2);
        for team in 0..2 {
            let (claim, _, shard) = f.claim_shard().await;
            // On day 3 Beta's agent fails.
            let faults = u32::from(day == 3 && team == 1);
            let mut commit = shard_commit(&shard, faults);
            commit.stopped_by_faults = faults > 0;
            f.store.commit_shard(&claim, commit, f.now).await.unwrap();
            if faults == 0 {
                let (claim, _) = f.claim_scoring().await;
                f.finish_scoring(&claim, score, DATASET_KEY).await;
            }
        }
    }
    let board = f.board().await;
    let rows: Vec<_> = board
        .iter()
        .map(|row| (row.team.name.as_str(), row.day, row.result.score))
        .collect();
    assert_eq!(
        rows,
        [
            ("Alpha", date(2026, 3, 3), 30.0),
            ("Beta", date(2026, 3, 2), 20.0)
        ]
    );
}

#[tokio::test]
async fn withdrawn_submission_skips_days_until_chosen_again() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let other = f.valid_submission_of("Beta").await;
    f.upload(&team).await;
    let first = f.validate().await;
    let withdraw = async |f: &TestStore, id| {
        f.store
            .withdraw_submission(Actor::Team(team.id), id, f.now)
            .await
    };
    f.evaluate(first.id, &one_shard_plan()).await;
    let withdrawn = withdraw(&f, first.id).await.unwrap();
    assert_eq!(
        (withdrawn.active, withdrawn.withdrawn_at),
        (false, Some(f.now))
    );
    let repeated = withdraw(&f, first.id).await;
    assert_conflict(repeated, &[]);
    // The day whose cutoff has passed continues with the submission; the next day excludes it.
    f.run_all_with_score(1.0).await;
    assert_eq!(f.board().await.len(), 2);
    f.advance_clock_s(24 * 3600);
    let stage = f.configure_stage(&one_shard_plan()).await;
    let started = f
        .store
        .start_day(Actor::Operator, stage, f.now)
        .await
        .unwrap();
    let evaluated: Vec<_> = started
        .iter()
        .map(|evaluation| evaluation.submission)
        .collect();
    assert_eq!(evaluated, [other.id]);
    f.run_all_with_score(2.0).await;

    // A submission that was withdrawn before its validation does not become active.
    let second = f.upload(&team).await;
    assert_eq!(second.duplicate_of, Some(first.id), "the same bundle");
    withdraw(&f, second.id).await.unwrap();
    assert!(!f.validate().await.active);
    let chosen = f
        .store
        .activate_submission(Actor::Team(team.id), first.id, f.now);
    let chosen = chosen.await.unwrap();
    assert_eq!((chosen.active, chosen.withdrawn_at), (true, None));
    let describe = async |description| {
        let described =
            f.store
                .describe_submission(Actor::Team(team.id), first.id, description, f.now);
        let described = described.await.unwrap();
        (described.label, described.note)
    };
    let label = Some("baseline".to_owned());
    let note = Some("before the fix".to_owned());
    let labelled = SubmissionDescription {
        label: Some(Some("baseline")),
        note: None,
    };
    assert_eq!(describe(labelled).await, (label.clone(), None));
    let noted = SubmissionDescription {
        label: None,
        note: Some(Some("before the fix")),
    };
    assert_eq!(describe(noted).await, (label, note.clone()));
    let unnamed = SubmissionDescription {
        label: Some(None),
        note: None,
    };
    assert_eq!(describe(unnamed).await, (None, note));
}
