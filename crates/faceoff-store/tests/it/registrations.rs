//! Team registrations, divisions, announcements and questions.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::DivisionName;
use jiff::SignedDuration;

fn registration(code: u8, name: &str) -> NewRegistration {
    NewRegistration {
        code_hash: [code; 32],
        team_name: name.parse().unwrap(),
        profile: TeamProfile::default(),
        contact: "ada@example.org".into(),
        accepted_terms: None,
    }
}

fn words(error: &StoreError, words: &[&str]) {
    let text = error.to_string();
    for word in words {
        assert!(text.contains(word), "{word:?} is not in {text:?}");
    }
}

async fn open(f: &TestStore) {
    f.store
        .change_season(Actor::Organiser, Some(true), None, f.now)
        .await
        .unwrap();
}

#[tokio::test]
async fn registration_link_is_valid_once_approved() {
    let f = TestStore::new().await;
    f.team("Alpha").await;
    let register = async |new| f.store.register(new, f.now).await;
    let closed = register(registration(1, "Beta")).await.unwrap_err();
    words(&closed, &["registration is closed"]);
    open(&f).await;
    let taken = register(registration(1, "ALPHA")).await;
    assert!(matches!(taken, Err(StoreError::TeamNameTaken(_))));
    let beta = register(registration(1, "Beta")).await.unwrap();
    let taken = register(registration(2, "beta")).await;
    assert!(matches!(taken, Err(StoreError::TeamNameTaken(_))));

    let early = f.store.join(join_request([1; 32], "Ada"), f.now).await;
    words(&early.unwrap_err(), &["Beta", "is pending"]);
    let until = f.now + SignedDuration::from_hours(1);
    let (approved, team) = f
        .store
        .approve_registration(Actor::Organiser, beta.id, until, f.now)
        .await
        .unwrap();
    let at = f.now;
    let state = RegistrationState::Approved { at, team: team.id };
    assert_eq!(approved.state, state);
    let joined = f
        .store
        .join(join_request([1; 32], "Ada"), f.now)
        .await
        .unwrap();
    assert_eq!(joined.team, Some(team));
    let twice = f
        .store
        .approve_registration(Actor::Organiser, beta.id, until, f.now)
        .await;
    words(&twice.unwrap_err(), &["was approved"]);

    let gamma = register(registration(3, "Gamma")).await.unwrap();
    let refuse = async || {
        f.store
            .refuse_registration(Actor::Organiser, gamma.id, "full", f.now)
            .await
    };
    refuse().await.unwrap();
    words(&refuse().await.unwrap_err(), &["was refused"]);
    let refused = f.store.join(join_request([3; 32], "Eve"), f.now).await;
    words(&refused.unwrap_err(), &["refused: full"]);
    register(registration(4, "Gamma")).await.unwrap();
}

#[tokio::test]
async fn pending_registrations_are_limited() {
    let f = TestStore::new().await;
    open(&f).await;
    for number in 0..u8::try_from(MAX_PENDING_REGISTRATIONS).unwrap() {
        let new = registration(number, &format!("Team {number}"));
        f.store.register(new, f.now).await.unwrap();
    }
    let many = f.store.register(registration(255, "Late"), f.now).await;
    words(&many.unwrap_err(), &["which is the limit"]);
}

#[tokio::test]
async fn divisions_keep_their_order_and_teams() {
    let f = TestStore::new().await;
    let names = |names: &[&str]| -> Vec<DivisionName> {
        names.iter().map(|name| name.parse().unwrap()).collect()
    };
    let set = async |divisions: Vec<DivisionName>| {
        f.store
            .change_season(Actor::Organiser, None, Some(&divisions), f.now)
            .await
    };
    set(names(&["Open", "Students"])).await.unwrap();
    set(names(&["Students", "Open"])).await.unwrap();
    let stored = f.store.divisions().await.unwrap();
    assert_eq!(stored, names(&["Students", "Open"]));
    let twice = set(names(&["Open", "OPEN"])).await.unwrap_err();
    words(&twice, &["“OPEN” is listed twice"]);
    let mut new = registration(1, "Beta");
    new.profile.division = Some("open".parse().unwrap());
    open(&f).await;
    let beta = f.store.register(new, f.now).await.unwrap();
    assert_eq!(beta.division, Some("Open".parse().unwrap()));
    let until = f.now + SignedDuration::from_hours(1);
    f.store
        .approve_registration(Actor::Organiser, beta.id, until, f.now)
        .await
        .unwrap();
    let in_use = set(names(&["Students"])).await.unwrap_err();
    words(&in_use, &["“Open” has 1 teams"]);
    assert_eq!(f.store.divisions().await.unwrap(), stored);
}

#[tokio::test]
async fn announcements_and_questions_are_stored() {
    let mut f = TestStore::new().await;
    let alpha = f.team("Alpha").await;
    for title in ["first", "second"] {
        f.store
            .announce(Actor::Organiser, title, "text", f.now)
            .await
            .unwrap();
        f.later(1);
    }
    let newest = f.store.announcements(1).await.unwrap();
    assert_eq!((newest.len(), newest[0].title.as_str()), (1, "second"));

    let ask = async || {
        f.store
            .ask(Actor::Team(alpha.id), alpha.id, "Why?", f.now)
            .await
    };
    let question = ask().await.unwrap();
    for _ in 1..MAX_OPEN_QUESTIONS {
        ask().await.unwrap();
    }
    words(&ask().await.unwrap_err(), &["which is the limit"]);
    for is_public in [false, true] {
        let answered = f
            .store
            .answer(Actor::Organiser, question.id, "So.", is_public, f.now)
            .await
            .unwrap();
        let answer = answered.answer.unwrap();
        assert_eq!((answer.text.as_str(), answer.is_public), ("So.", is_public));
    }
    ask().await.unwrap();
}
