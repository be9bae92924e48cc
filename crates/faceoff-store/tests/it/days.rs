//! The cutoff of a day: each team's active submission is evaluated.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{SubmissionId, ValidationOutcome, Zone};
use jiff::civil::date;

fn expect_cutoff_passed<T: std::fmt::Debug>(result: Result<T, StoreError>) -> jiff::civil::Date {
    match result {
        Err(StoreError::CutoffPassed { day, .. }) => day,
        other => panic!("expected that the cutoff has passed, got {other:?}"),
    }
}

#[tokio::test]
async fn day_has_one_cutoff() {
    let mut f = TestStore::new().await;
    let first = f.ready_team("Alpha").await;
    f.now = "2026-03-01T23:59:59.998Z".parse().unwrap();
    let cutoff_at = f.now;
    let evaluation = f.evaluate(first.id, &plan()).await;
    // neither the same nor a new submission, nor another team's, gets a second cutoff
    f.now = "2026-03-01T23:59:59.999Z".parse().unwrap();
    let team = f.store.team(first.team).await.unwrap();
    f.upload(&team).await;
    let second = f.validate().await;
    f.ready_team("Beta").await;
    let repeated = f
        .store
        .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
        .await;
    assert_eq!(expect_cutoff_passed(repeated), date(2026, 3, 1));
    assert_eq!(
        f.store.evaluations_on(date(2026, 3, 1)).await.unwrap(),
        [evaluation]
    );
    let day = f
        .store
        .newest_day(f.stage(&plan()).await)
        .await
        .unwrap()
        .unwrap();
    assert_eq!(
        (day.stage_day.date, day.cutoff_at, day.released_at),
        (date(2026, 3, 1), cutoff_at, None)
    );
    // but the next day comes a millisecond later
    f.now = "2026-03-02T00:00:00Z".parse().unwrap();
    let next = f.evaluate(second.id, &plan()).await;
    assert_eq!(next.stage_day.date, date(2026, 3, 2));
    assert_eq!(
        f.store
            .evaluations_on(next.stage_day.date)
            .await
            .unwrap()
            .len(),
        2
    );
    // and a clock that was set back starts nothing
    f.now = "2026-02-27T00:00:00Z".parse().unwrap();
    let repeated = f
        .store
        .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
        .await;
    assert_eq!(expect_cutoff_passed(repeated), date(2026, 3, 2));
}

#[tokio::test]
async fn concurrent_day_starts_make_one_cutoff() {
    let f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let other = f.reopen().await;
    let stage = f.stage(&plan()).await;
    let attempts = (0..20).map(|index| {
        let store = if index % 2 == 0 {
            f.store.clone()
        } else {
            other.clone()
        };
        let now = f.now;
        tokio::spawn(async move { store.start_day(Actor::Organiser, stage, now).await })
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
async fn empty_day_keeps_its_cutoff_unless_scheduled() {
    let mut f = TestStore::new().await;
    let team = f.team("Alpha").await;
    let refused = f
        .store
        .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
        .await;
    assert!(
        matches!(refused, Err(StoreError::Conflict(_))),
        "{refused:?}"
    );
    assert_eq!(
        f.store.newest_day(f.stage(&plan()).await).await.unwrap(),
        None
    );
    let started = f
        .store
        .start_scheduled_day(f.stage(&plan()).await, f.now)
        .await;
    assert_eq!(started.unwrap(), Some(Vec::new()));
    let day = f
        .store
        .newest_day(f.stage(&plan()).await)
        .await
        .unwrap()
        .unwrap();
    assert_eq!(day.released_at, Some(f.now), "there is nothing to wait for");
    // a later submission is evaluated on the next day
    f.upload(&team).await;
    let submission = f.validate().await;
    expect_cutoff_passed(
        f.store
            .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
            .await,
    );
    f.later(86_400);
    f.evaluate(submission.id, &plan()).await;
}

async fn active(f: &TestStore, team: &Team) -> SubmissionId {
    let of_team = f.store.submissions_of(team.id).await.unwrap();
    let active: Vec<_> = of_team.iter().filter(|one| one.active).collect();
    assert_eq!(active.len(), 1, "{of_team:?}");
    active[0].id
}

#[tokio::test]
async fn valid_upload_becomes_active_unless_superseded() {
    let mut f = TestStore::new().await;
    let old = f.ready_team("Alpha").await;
    let team = f.store.team(old.team).await.unwrap();
    // Two uploads, the newer of which is valid first.
    f.later(1);
    let slow = f.upload(&team).await;
    let (slow_claim, _) = f.claim_validation().await;
    f.later(1);
    f.upload(&team).await;
    let quick = f.validate().await;
    assert!(quick.active);
    let valid = || ValidationOutcome::Valid {
        runtime: "native".into(),
        agent_name: "late".into(),
        timing: Vec::new(),
        log: String::new(),
    };
    let late = f.store.commit_validation(&slow_claim, valid(), f.now).await;
    assert_eq!(late.unwrap(), CommitOutcome::Stored);
    assert_eq!(active(&f, &team).await, quick.id, "a newer one is active");

    // A choice is kept when an earlier upload turns valid.
    f.later(1);
    f.upload(&team).await;
    let (claim, uploaded_before) = f.claim_validation().await;
    f.later(1);
    let choose = |id| f.store.activate_submission(Actor::Team(team.id), id, f.now);
    assert!(matches!(
        choose(uploaded_before.id).await,
        Err(StoreError::Conflict(_))
    ));
    assert!(choose(old.id).await.unwrap().active);
    f.store
        .commit_validation(&claim, valid(), f.now)
        .await
        .unwrap();
    assert_eq!(active(&f, &team).await, old.id);
    choose(slow.id).await.unwrap();
    assert_eq!(active(&f, &team).await, slow.id);
    // A later upload replaces the choice.
    f.later(1);
    f.upload(&team).await;
    let newest = f.validate().await;
    assert_eq!(active(&f, &team).await, newest.id);
    assert_eq!(f.evaluate(newest.id, &plan()).await.submission, newest.id);
}

#[tokio::test]
async fn choice_after_cutoff_applies_to_next_day() {
    let mut f = TestStore::new().await;
    let first = f.ready_team("Alpha").await;
    let team = f.store.team(first.team).await.unwrap();
    f.later(1);
    f.upload(&team).await;
    let second = f.validate().await;
    let today = f.evaluate(second.id, &small()).await;
    f.later(1);
    let choice = f
        .store
        .activate_submission(Actor::Team(team.id), first.id, f.now);
    choice.await.unwrap();
    f.finish_next().await;
    assert_eq!(
        f.store.evaluation(today.id).await.unwrap().submission,
        second.id
    );
    f.later(86_400);
    assert_eq!(f.evaluate(first.id, &small()).await.submission, first.id);
}

#[tokio::test]
async fn cancelled_evaluation_loses_leases_and_can_be_rerun() {
    let f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    let evaluation = f.evaluate(submission.id, &plan()).await;
    let (claim, _, shard) = f.claim_shard().await;
    f.store
        .cancel_evaluation(
            Actor::Organiser,
            evaluation.id,
            "power cut announced",
            f.now,
        )
        .await
        .unwrap();
    assert!(!f.store.heartbeat(&claim, 1, LEASE_S, f.now).await.unwrap());
    assert_eq!(
        f.commit_shard(&claim, &shard, 0).await,
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
        .cancel_evaluation(Actor::Organiser, evaluation.id, "", f.now)
        .await;
    assert!(matches!(repeated, Err(StoreError::Conflict(_))));
    assert!(f.claim().await.is_none(), "there is no automatic rerun");
    let rerun = f
        .store
        .rerun_evaluation(Actor::Organiser, evaluation.id, f.now);
    assert_eq!(rerun.await.unwrap().submission, submission.id);
}

#[tokio::test]
async fn cutoff_takes_newest_valid_submission_of_each_team() {
    let mut f = TestStore::new().await;
    let alpha = f.ready_team("Alpha").await;
    let beta = f.ready_team("Beta").await;
    let silent = f.team("Never uploaded").await;
    let broken = f.team("Broken").await;
    f.upload(&broken).await;
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
    f.later(1);
    let team = f.store.team(alpha.team).await.unwrap();
    f.upload(&team).await;
    let newer = f.validate().await;
    f.upload(&team).await; // still validating: the previous one counts

    let started = f
        .store
        .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
        .await
        .unwrap();
    let submissions: Vec<_> = started.iter().map(|e| e.submission).collect();
    assert_eq!(
        submissions,
        [beta.id, newer.id],
        "earliest submission first"
    );
    assert!(f.store.evaluations_of(silent.id).await.unwrap().is_empty());
    assert!(f.store.evaluations_of(broken.id).await.unwrap().is_empty());
}

#[tokio::test]
async fn scheduled_day_starts_once() {
    let mut f = TestStore::new().await;
    f.ready_team("Alpha").await;
    let started = f
        .store
        .start_scheduled_day(f.stage(&plan()).await, f.now)
        .await
        .unwrap()
        .unwrap();
    assert_eq!(started.len(), 1);
    let other = f.reopen().await;
    assert!(
        other
            .start_scheduled_day(f.stage(&plan()).await, f.now)
            .await
            .unwrap()
            .is_none()
    );
    expect_cutoff_passed(
        other
            .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
            .await,
    );
    f.later(86_400);
    assert_eq!(
        other
            .start_scheduled_day(f.stage(&plan()).await, f.now)
            .await
            .unwrap()
            .unwrap()
            .len(),
        1
    );
    // a clock that was set back starts nothing
    f.later(-86_400);
    assert!(
        f.store
            .start_scheduled_day(f.stage(&plan()).await, f.now)
            .await
            .unwrap()
            .is_none()
    );
}

#[tokio::test]
async fn empty_plan_is_refused() {
    let f = TestStore::new().await;
    let submission = f.ready_team("Alpha").await;
    let bad = [
        RunPlan {
            tasks: vec![],
            ..plan()
        },
        RunPlan {
            tasks: vec![plan().tasks[0]; 2],
            ..plan()
        },
        RunPlan {
            episodes_per_task: 0,
            ..plan()
        },
        RunPlan {
            episodes_per_shard: 0,
            ..plan()
        },
    ];
    for plan in bad {
        let (rules, settings) = rules_and_settings(&plan);
        let error = f
            .store
            .configure_stage(rules, settings, Zone::UTC, f.now)
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
    f.ready_team("Alpha").await;
    f.ready_team("Beta").await;
    let small = RunPlan {
        tasks: vec![faceoff_types::Task::Hit],
        episodes_per_task: 1,
        ..plan()
    };
    for (day, score) in [(1, 10.0), (2, 20.0), (3, 30.0)] {
        f.now = format!("2026-03-0{day}T12:00:00Z").parse().unwrap();
        assert_eq!(
            f.store
                .start_day(Actor::Organiser, f.stage(&small).await, f.now)
                .await
                .unwrap()
                .len(),
            2
        );
        for team in 0..2 {
            let (claim, _, shard) = f.claim_shard().await;
            // on day 3 Beta's agent fails
            let faults = u32::from(day == 3 && team == 1);
            let mut commit = commit(&shard, faults);
            commit.stopped_by_faults = faults > 0;
            f.store.commit_shard(&claim, commit, f.now).await.unwrap();
            if faults == 0 {
                let (claim, _) = f.claim_scoring().await;
                f.finish(&claim, score, "d").await;
            }
        }
    }
    let board = f.board().await;
    let rows: Vec<_> = board
        .iter()
        .map(|r| (r.team.name.as_str(), r.day, r.result.score))
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
    let team = f.team("Alpha").await;
    let other = f.ready_team("Beta").await;
    f.upload(&team).await;
    let first = f.validate().await;
    let withdraw = async |f: &TestStore, id| {
        f.store
            .withdraw_submission(Actor::Team(team.id), id, f.now)
            .await
    };
    f.evaluate(first.id, &small()).await;
    let withdrawn = withdraw(&f, first.id).await.unwrap();
    assert_eq!(
        (withdrawn.active, withdrawn.withdrawn_at),
        (false, Some(f.now))
    );
    let repeated = withdraw(&f, first.id).await;
    assert!(
        matches!(repeated, Err(StoreError::Conflict(_))),
        "{repeated:?}"
    );
    // The day past its cutoff continues, the next one excludes it.
    f.run_all(1.0).await;
    assert_eq!(f.board().await.len(), 2);
    f.later(24 * 3600);
    let stage = f.stage(&small()).await;
    let started = f
        .store
        .start_day(Actor::Organiser, stage, f.now)
        .await
        .unwrap();
    let evaluated: Vec<_> = started.iter().map(|one| one.submission).collect();
    assert_eq!(evaluated, [other.id]);
    f.run_all(2.0).await;

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
