//! A day has one cut: what each team has active then plays it.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{SmokeOutcome, SubmissionId, Zone};
use jiff::civil::date;

fn had_its_cut<T: std::fmt::Debug>(result: Result<T, StoreError>) -> jiff::civil::Date {
    match result {
        Err(StoreError::DayHasCut { day, .. }) => day,
        other => panic!("expected that the day had its cut, got {other:?}"),
    }
}

#[tokio::test]
async fn a_day_has_one_cut() {
    let mut f = Fixture::new().await;
    let first = f.ready_team("Alpha").await;
    f.now = "2026-03-01T23:59:59.998Z".parse().unwrap();
    let cut_at = f.now;
    let evaluation = f.evaluate(first.id, &plan()).await;
    // neither the same nor a new submission, nor another team's, gets a second one
    f.now = "2026-03-01T23:59:59.999Z".parse().unwrap();
    let team = f.store.team(first.team).await.unwrap();
    f.upload(&team).await;
    let second = f.validate().await;
    f.ready_team("Beta").await;
    let again = f
        .store
        .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
        .await;
    assert_eq!(had_its_cut(again), date(2026, 3, 1));
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
        (day.of.date, day.cut_at, day.released_at),
        (date(2026, 3, 1), cut_at, None)
    );
    // but the next day comes a millisecond later
    f.now = "2026-03-02T00:00:00Z".parse().unwrap();
    let next = f.evaluate(second.id, &plan()).await;
    assert_eq!(next.of.date, date(2026, 3, 2));
    assert_eq!(f.store.evaluations_on(next.of.date).await.unwrap().len(), 2);
    // and a clock that was set back starts nothing
    f.now = "2026-02-27T00:00:00Z".parse().unwrap();
    let again = f
        .store
        .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
        .await;
    assert_eq!(had_its_cut(again), date(2026, 3, 2));
}

#[tokio::test]
async fn of_many_at_once_one_makes_the_cut() {
    let f = Fixture::new().await;
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
    let mut cuts = 0;
    for attempt in attempts.collect::<Vec<_>>() {
        match attempt.await.unwrap() {
            Ok(started) => cuts += started.len(),
            Err(StoreError::DayHasCut { .. }) => {}
            Err(error) => panic!("{error}"),
        }
    }
    assert_eq!(cuts, 1);
}

#[tokio::test]
async fn a_day_that_nobody_can_play_keeps_its_cut_unless_it_is_the_schedules() {
    let mut f = Fixture::new().await;
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
    // who comes later plays the next day
    f.upload(&team).await;
    let submission = f.validate().await;
    had_its_cut(
        f.store
            .start_day(Actor::Organiser, f.stage(&plan()).await, f.now)
            .await,
    );
    f.later(86_400);
    f.evaluate(submission.id, &plan()).await;
}

async fn active(f: &Fixture, team: &Team) -> SubmissionId {
    let of_team = f.store.submissions_of(team.id).await.unwrap();
    let active: Vec<_> = of_team.iter().filter(|one| one.active).collect();
    assert_eq!(active.len(), 1, "{of_team:?}");
    active[0].id
}

#[tokio::test]
async fn an_upload_takes_its_place_when_it_is_valid_unless_a_newer_one_or_a_choice_has() {
    let mut f = Fixture::new().await;
    let old = f.ready_team("Alpha").await;
    let team = f.store.team(old.team).await.unwrap();
    // Two uploads, the newer of which is valid first.
    f.later(1);
    let slow = f.upload(&team).await;
    let (slow_claim, _) = f.claim_smoke().await;
    f.later(1);
    f.upload(&team).await;
    let quick = f.validate().await;
    assert!(quick.active);
    let valid = || SmokeOutcome::Valid {
        runtime: "native".into(),
        agent_name: "late".into(),
        timing: Vec::new(),
        log: String::new(),
    };
    let late = f.store.commit_smoke(&slow_claim, valid(), f.now).await;
    assert_eq!(late.unwrap(), Committed::Now);
    assert_eq!(active(&f, &team).await, quick.id, "a newer one is active");

    // A choice stays against what was uploaded before it.
    f.later(1);
    f.upload(&team).await;
    let (claim, uploaded_before) = f.claim_smoke().await;
    f.later(1);
    let choose = |id| f.store.activate_submission(Actor::Team(team.id), id, f.now);
    assert!(matches!(
        choose(uploaded_before.id).await,
        Err(StoreError::Conflict(_))
    ));
    assert!(choose(old.id).await.unwrap().active);
    f.store.commit_smoke(&claim, valid(), f.now).await.unwrap();
    assert_eq!(active(&f, &team).await, old.id);
    choose(slow.id).await.unwrap();
    assert_eq!(active(&f, &team).await, slow.id);
    // What comes later takes its place.
    f.later(1);
    f.upload(&team).await;
    let newest = f.validate().await;
    assert_eq!(active(&f, &team).await, newest.id);
    assert_eq!(f.evaluate(newest.id, &plan()).await.submission, newest.id);
}

#[tokio::test]
async fn a_choice_after_the_cut_is_one_for_the_next() {
    let mut f = Fixture::new().await;
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
async fn a_cancelled_run_loses_its_workers_and_can_be_played_again() {
    let f = Fixture::new().await;
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
    assert_eq!(f.play(&claim, &shard, 0).await, Committed::LeaseLost);
    assert!(f.claim().await.is_none());
    assert_eq!(
        f.state(evaluation.id).await,
        EvaluationState::Cancelled {
            finished_at: f.now,
            reason: "power cut announced".into()
        }
    );
    let again = f
        .store
        .cancel_evaluation(Actor::Organiser, evaluation.id, "", f.now)
        .await;
    assert!(matches!(again, Err(StoreError::Conflict(_))));
    assert!(f.claim().await.is_none(), "not by itself");
    let again = f
        .store
        .rerun_evaluation(Actor::Organiser, evaluation.id, f.now);
    assert_eq!(again.await.unwrap().submission, submission.id);
}

#[tokio::test]
async fn the_cut_takes_the_newest_valid_submission_of_each_team() {
    let mut f = Fixture::new().await;
    let alpha = f.ready_team("Alpha").await;
    let beta = f.ready_team("Beta").await;
    let silent = f.team("Never uploaded").await;
    let broken = f.team("Broken").await;
    f.upload(&broken).await;
    let (claim, _) = f.claim_smoke().await;
    let outcome = SmokeOutcome::Invalid {
        runtime: None,
        agent_name: None,
        reason: "no agent.toml".into(),
        timing: Vec::new(),
        log: String::new(),
    };
    f.store.commit_smoke(&claim, outcome, f.now).await.unwrap();
    f.later(1);
    let team = f.store.team(alpha.team).await.unwrap();
    f.upload(&team).await;
    let newer = f.validate().await;
    f.upload(&team).await; // still validating: the one before it counts

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
async fn the_schedule_starts_a_day_once_whoever_asks() {
    let mut f = Fixture::new().await;
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
    had_its_cut(
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
async fn an_empty_plan_is_refused() {
    let f = Fixture::new().await;
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
        let (rules, settings) = rules_of(&plan);
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
async fn the_board_shows_each_teams_newest_finished_day() {
    let mut f = Fixture::new().await;
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
            // on day 3 Beta's agent breaks down
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
async fn what_a_team_withdraws_enters_no_further_day_until_it_is_chosen_again() {
    let mut f = Fixture::new().await;
    let team = f.team("Alpha").await;
    let other = f.ready_team("Beta").await;
    f.upload(&team).await;
    let first = f.validate().await;
    let withdraw = async |f: &Fixture, id| {
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
    let again = withdraw(&f, first.id).await;
    assert!(matches!(again, Err(StoreError::Conflict(_))), "{again:?}");
    // The day that had its cut goes on, the next one is without it.
    f.play_to(1.0).await;
    assert_eq!(f.board().await.len(), 2);
    f.later(24 * 3600);
    let stage = f.stage(&small()).await;
    let started = f
        .store
        .start_day(Actor::Organiser, stage, f.now)
        .await
        .unwrap();
    let plays: Vec<_> = started.iter().map(|one| one.submission).collect();
    assert_eq!(plays, [other.id]);
    f.play_to(2.0).await;

    // Withdrawn before its verdict, a submission does not become active by it.
    let second = f.upload(&team).await;
    assert_eq!(second.same_as, Some(first.id), "the same archive");
    withdraw(&f, second.id).await.unwrap();
    assert!(!f.validate().await.active);
    let chosen = f
        .store
        .activate_submission(Actor::Team(team.id), first.id, f.now);
    let chosen = chosen.await.unwrap();
    assert_eq!((chosen.active, chosen.withdrawn_at), (true, None));
    let says = async |words| {
        let said = f
            .store
            .describe_submission(Actor::Team(team.id), first.id, words, f.now);
        let said = said.await.unwrap();
        (said.label, said.note)
    };
    let label = Some("baseline".to_owned());
    let note = Some("before the fix".to_owned());
    let labelled = SubmissionWords {
        label: Some(Some("baseline")),
        note: None,
    };
    assert_eq!(says(labelled).await, (label.clone(), None));
    let noted = SubmissionWords {
        label: None,
        note: Some(Some("before the fix")),
    };
    assert_eq!(says(noted).await, (label, note.clone()));
    let unnamed = SubmissionWords {
        label: Some(None),
        note: None,
    };
    assert_eq!(says(unnamed).await, (None, note));
}
