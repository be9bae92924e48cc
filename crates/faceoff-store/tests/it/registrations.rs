//! Registrations of teams, which organisers approve or refuse; divisions (groups of teams with their own ranking);
//! announcements, and questions of teams.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::DivisionName;
use jiff::SignedDuration;

/// A team's registration. Its number makes the hash of its secret code.
fn registration(number: u8, team_name: &str) -> NewRegistration {
    NewRegistration {
        code_hash: [number; 32],
        team_name: team_name.parse().unwrap(),
        profile: TeamProfile::default(),
        contact: "ada@example.org".into(),
        accepted_terms: None,
    }
}

async fn open_registration(f: &TestStore) {
    f.store
        .change_season(Actor::Organiser, Some(true), None, f.now)
        .await
        .unwrap();
}

#[tokio::test]
async fn registration_link_is_valid_once_approved() {
    let f = TestStore::new().await;
    f.create_team("Alpha").await;
    let register = async |registration| f.store.register(registration, f.now).await;
    let closed = register(registration(1, "Beta")).await.unwrap_err();
    assert_contains(&closed, &["registration is closed"]);
    open_registration(&f).await;
    let refused = register(registration(1, "ALPHA")).await;
    assert!(matches!(refused, Err(StoreError::TeamNameTaken(_))));
    let beta = register(registration(1, "Beta")).await.unwrap();
    let refused = register(registration(2, "beta")).await;
    assert!(matches!(refused, Err(StoreError::TeamNameTaken(_))));

    let early = f.store.join(join_request([1; 32], "Ada"), f.now).await;
    assert_contains(&early.unwrap_err(), &["Beta", "is pending"]);
    let code_expires_at = f.now + SignedDuration::from_hours(1);
    let (approved, team) = f
        .store
        .approve_registration(Actor::Organiser, beta.id, code_expires_at, f.now)
        .await
        .unwrap();
    let state = RegistrationState::Approved {
        at: f.now,
        team: team.id,
    };
    assert_eq!(approved.state, state);
    let joined = f
        .store
        .join(join_request([1; 32], "Ada"), f.now)
        .await
        .unwrap();
    assert_eq!(joined.team, Some(team));
    let repeated = f
        .store
        .approve_registration(Actor::Organiser, beta.id, code_expires_at, f.now)
        .await;
    assert_contains(&repeated.unwrap_err(), &["was approved"]);

    let gamma = register(registration(3, "Gamma")).await.unwrap();
    let refuse = async || {
        f.store
            .refuse_registration(Actor::Organiser, gamma.id, "full", f.now)
            .await
    };
    refuse().await.unwrap();
    assert_contains(&refuse().await.unwrap_err(), &["was refused"]);
    let joined = f.store.join(join_request([3; 32], "Eve"), f.now).await;
    assert_contains(&joined.unwrap_err(), &["refused: full"]);
    register(registration(4, "Gamma")).await.unwrap();
}

#[tokio::test]
async fn pending_registrations_are_limited() {
    let f = TestStore::new().await;
    open_registration(&f).await;
    for number in 0..u8::try_from(MAX_PENDING_REGISTRATIONS).unwrap() {
        let registration = registration(number, &format!("Team {number}"));
        f.store.register(registration, f.now).await.unwrap();
    }
    let refused = f.store.register(registration(255, "Late"), f.now).await;
    assert_contains(&refused.unwrap_err(), &["which is the limit"]);
}

#[tokio::test]
async fn divisions_keep_their_order_and_teams() {
    let f = TestStore::new().await;
    let names = |names: &[&str]| -> Vec<DivisionName> {
        names.iter().map(|name| name.parse().unwrap()).collect()
    };
    let set_divisions = async |divisions: Vec<DivisionName>| {
        f.store
            .change_season(Actor::Organiser, None, Some(&divisions), f.now)
            .await
    };
    set_divisions(names(&["Open", "Students"])).await.unwrap();
    set_divisions(names(&["Students", "Open"])).await.unwrap();
    let stored = f.store.divisions().await.unwrap();
    assert_eq!(stored, names(&["Students", "Open"]));
    let error = set_divisions(names(&["Open", "OPEN"])).await.unwrap_err();
    assert_contains(&error, &["“OPEN” is listed twice"]);
    let mut registration = registration(1, "Beta");
    registration.profile.division = Some("open".parse().unwrap());
    open_registration(&f).await;
    let beta = f.store.register(registration, f.now).await.unwrap();
    assert_eq!(beta.division, Some("Open".parse().unwrap()));
    let code_expires_at = f.now + SignedDuration::from_hours(1);
    f.store
        .approve_registration(Actor::Organiser, beta.id, code_expires_at, f.now)
        .await
        .unwrap();
    let error = set_divisions(names(&["Students"])).await.unwrap_err();
    assert_contains(&error, &["“Open” has 1 teams"]);
    assert_eq!(f.store.divisions().await.unwrap(), stored);
}

#[tokio::test]
async fn announcements_and_questions_are_stored() {
    let mut f = TestStore::new().await;
    let alpha = f.create_team("Alpha").await;
    for title in ["first", "second"] {
        f.store
            .announce(Actor::Organiser, title, "text", f.now)
            .await
            .unwrap();
        f.advance_clock_s(1);
    }
    let newest = f.store.announcements(1).await.unwrap();
    assert_eq!((newest.len(), newest[0].title.as_str()), (1, "second"));

    let ask = async || {
        f.store
            .ask(
                Actor::Team(alpha.id),
                alpha.id,
                "When does the day start?",
                f.now,
            )
            .await
    };
    let question = ask().await.unwrap();
    for _ in 1..MAX_OPEN_QUESTIONS {
        ask().await.unwrap();
    }
    assert_contains(&ask().await.unwrap_err(), &["which is the limit"]);
    for is_public in [false, true] {
        let answered = f
            .store
            .answer(Actor::Organiser, question.id, "At 10:00.", is_public, f.now)
            .await
            .unwrap();
        let answer = answered.answer.unwrap();
        assert_eq!(
            (answer.text.as_str(), answer.is_public),
            ("At 10:00.", is_public)
        );
    }
    ask().await.unwrap();
}
