//! People: how they join, what they may do, and how they leave.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::{PersonId, TeamId};
use jiff::SignedDuration;

async fn invite(f: &Fixture, code: u8, invited_as: InvitedAs) -> Invitation {
    let new = NewInvitation {
        code_hash: [code; 32],
        invited_as,
        note: "somebody".into(),
        expires_at: f.now + SignedDuration::from_hours(1),
    };
    f.store.invite(Actor::Organiser, new, f.now).await.unwrap()
}

/// Somebody who has joined by a link of this code.
async fn somebody(f: &Fixture, code: u8, name: &str, invited_as: InvitedAs) -> Person {
    invite(f, code, invited_as).await;
    let joined = f.store.join(joining([code; 32], name), f.now).await;
    joined.unwrap().person
}

fn words(error: &StoreError, words: &[&str]) {
    let text = error.to_string();
    for word in words {
        assert!(text.contains(word), "{word:?} is not in {text:?}");
    }
}

async fn who(f: &Fixture, code: u8) -> Result<Who, Refusal> {
    let hash = *blake3::hash(&[code; 32]).as_bytes();
    let holder = f.store.holder(hash, TokenKind::Key, f.now).await;
    holder.unwrap().map(|holder| holder.who)
}

#[tokio::test]
async fn a_link_makes_one_person_what_it_says() {
    let mut f = Fixture::new().await;
    let alpha = f.team("Alpha").await;
    let member = somebody(&f, 1, "Ada", InvitedAs::Member(alpha.id)).await;
    assert_eq!(member.team, Some(alpha.id));
    assert_eq!(who(&f, 1).await, Ok(Who::Member(member.clone(), alpha)));
    let organiser = somebody(&f, 2, "Grace", InvitedAs::Organiser).await;
    assert_eq!(who(&f, 2).await, Ok(Who::Organiser(organiser)));

    let spent = f.store.join(joining([1; 32], "Eve"), f.now).await;
    words(&spent.unwrap_err(), &["was accepted", "one person"]);
    let none = f.store.join(joining([9; 32], "Eve"), f.now).await;
    words(&none.unwrap_err(), &["no such invitation"]);
    let revoked = invite(&f, 3, InvitedAs::Organiser).await;
    f.store
        .revoke_invitation(Actor::Organiser, revoked.id, f.now)
        .await
        .unwrap();
    let error = f.store.join(joining([3; 32], "Eve"), f.now).await;
    words(&error.unwrap_err(), &["taken back"]);
    invite(&f, 4, InvitedAs::Organiser).await;
    let taken = f.store.join(joining([4; 32], "ADA"), f.now).await;
    assert!(matches!(taken, Err(StoreError::PersonNameTaken(name)) if name == "ADA"));
    f.later(3600);
    let late = f.store.join(joining([4; 32], "Eve"), f.now).await;
    words(&late.unwrap_err(), &["was good until"]);
    assert_eq!(f.store.people().await.unwrap().len(), 2, "nobody else came");
}

#[tokio::test]
async fn a_founder_names_a_team_and_nobody_else_does() {
    let f = Fixture::new().await;
    let alpha = f.team("Alpha").await;
    invite(&f, 1, InvitedAs::Founder).await;
    let founder = |name: &str| Joining {
        team: Some((name.parse().unwrap(), TeamProfile::default())),
        ..joining([1; 32], "Ada")
    };
    let without = f.store.join(joining([1; 32], "Ada"), f.now).await;
    words(&without.unwrap_err(), &["expected the team's name"]);
    let taken = f.store.join(founder("ALPHA"), f.now).await;
    assert!(matches!(taken, Err(StoreError::TeamNameTaken(_))));
    let mut nameless = founder("Beta");
    nameless.name = None;
    let error = f.store.join(nameless, f.now).await.unwrap_err();
    words(&error, &["name: expected"]);
    assert_eq!(f.store.teams().await.unwrap().len(), 1, "nothing half done");
    let joined = f.store.join(founder("Beta"), f.now).await.unwrap();
    let team = joined.team.unwrap();
    assert_eq!(team.name.as_str(), "Beta");
    assert_eq!(joined.person.team, Some(team.id));
    invite(&f, 2, InvitedAs::Member(alpha.id)).await;
    let member = Joining {
        team: founder("Gamma").team,
        ..joining([2; 32], "Eve")
    };
    let error = f.store.join(member, f.now).await.unwrap_err();
    words(&error, &["leave it out"]);
}

#[tokio::test]
async fn who_comes_back_is_who_they_were_and_has_new_tokens_only() {
    let f = Fixture::new().await;
    let alpha = f.team("Alpha").await;
    let ada = somebody(&f, 1, "Ada", InvitedAs::Member(alpha.id)).await;
    invite(&f, 2, InvitedAs::Return(ada.id)).await;
    let other = f.store.join(joining([2; 32], "Eve"), f.now).await;
    words(&other.unwrap_err(), &["Ada's"]);
    let back = Joining {
        name: None,
        password: Some("$argon2id$…".into()),
        ..joining([2; 32], "Ada")
    };
    let joined = f.store.join(back, f.now).await.unwrap();
    assert_eq!(joined.person.id, ada.id);
    assert!(joined.person.has_password);
    assert_eq!(who(&f, 1).await, Err(Refusal::Revoked(f.now)));
    assert!(who(&f, 2).await.is_ok());
    let password = f.store.password_of("aDA").await.unwrap();
    assert_eq!(password, Some((ada.id, "$argon2id$…".into())));

    let by = joined.token.id;
    f.store
        .set_password(Actor::Person(ada.id), ada.id, "other", by, f.now)
        .await
        .unwrap();
    assert!(who(&f, 2).await.is_ok(), "with what they did it");
}

#[tokio::test]
async fn who_is_removed_may_do_nothing_from_then_on() {
    let f = Fixture::new().await;
    let alpha = f.team("Alpha").await;
    let ada = somebody(&f, 1, "Ada", InvitedAs::Member(alpha.id)).await;
    let grace = somebody(&f, 2, "Grace", InvitedAs::Organiser).await;
    let remove = async |id| f.store.remove_person(Actor::Organiser, id, f.now).await;
    let last = remove(grace.id).await.unwrap_err();
    words(&last, &["Grace", "the last who can organise"]);
    f.store.set_host_token([7; 32], f.now).await.unwrap();
    remove(grace.id).await.unwrap();
    let left = remove(ada.id).await.unwrap();
    assert_eq!(left.left_at, Some(f.now));
    for code in [1, 2] {
        assert_eq!(who(&f, code).await, Err(Refusal::Revoked(f.now)));
    }
    assert_eq!(f.store.password_of("Ada").await.unwrap(), None);
    words(&remove(ada.id).await.unwrap_err(), &["has left"]);
    let unknown = remove(PersonId::new()).await;
    assert!(matches!(unknown, Err(StoreError::NotFound("person"))));
    let back = NewInvitation {
        code_hash: [3; 32],
        invited_as: InvitedAs::Return(ada.id),
        note: "Ada".into(),
        expires_at: f.now + SignedDuration::from_hours(1),
    };
    let error = f.store.invite(Actor::Organiser, back, f.now).await;
    words(&error.unwrap_err(), &["has left"]);
    let log = f.store.events_after(0, 100).await.unwrap();
    let left = log
        .iter()
        .find(|record| record.subject == Subject::Person(ada.id) && record.id > 1)
        .unwrap();
    assert!(matches!(left.event, Event::PersonJoined { .. }));
}

#[tokio::test]
async fn invitations_that_would_be_worth_nothing_are_not_made() {
    let f = Fixture::new().await;
    let alpha = f.team("Alpha").await;
    let new = |code, invited_as, expires_at| NewInvitation {
        code_hash: [code; 32],
        invited_as,
        note: "somebody".into(),
        expires_at,
    };
    let soon = f.now + SignedDuration::from_hours(1);
    let invite = async |new| -> Result<Invitation, StoreError> {
        f.store.invite(Actor::Organiser, new, f.now).await
    };
    let past = invite(new(1, InvitedAs::Organiser, f.now)).await;
    words(&past.unwrap_err(), &["in the future"]);
    let nobody = invite(new(1, InvitedAs::Member(TeamId::new()), soon)).await;
    assert!(matches!(nobody, Err(StoreError::NotFound("team"))));
    for code in 0..u8::try_from(MAX_OPEN_INVITATIONS).unwrap() {
        invite(new(code, InvitedAs::Member(alpha.id), soon))
            .await
            .unwrap();
    }
    let many = invite(new(99, InvitedAs::Member(alpha.id), soon)).await;
    words(&many.unwrap_err(), &["no more than that"]);
    invite(new(100, InvitedAs::Organiser, soon)).await.unwrap();
}

#[tokio::test]
async fn other_terms_stop_uploads_until_a_member_accepts_them() {
    let mut f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let alpha = f.store.team(submission.team).await.unwrap();
    let publish = async |text| f.store.publish_terms(Actor::Organiser, text, f.now).await;
    assert_eq!(publish("Be fair.").await.unwrap().version, 1);
    words(
        &publish("Be fair.").await.unwrap_err(),
        &["nothing was changed"],
    );
    f.upload(&alpha).await;
    f.validate().await;
    // A team without members has nobody who could accept; with one it owes its consent.
    invite(&f, 1, InvitedAs::Member(alpha.id)).await;
    let none = f.store.join(joining([1; 32], "Ada"), f.now).await;
    words(&none.unwrap_err(), &["accepted_terms", "version 1", "none"]);
    let consents = |version| Joining {
        accepted_terms: Some(version),
        ..joining([1; 32], "Ada")
    };
    let wrong = f.store.join(consents(2), f.now).await;
    words(&wrong.unwrap_err(), &["version 1", "got 2"]);
    let ada = f.store.join(consents(1), f.now).await.unwrap().person;
    assert_eq!(ada.accepted_terms, Some(1));
    f.upload(&alpha).await;
    f.validate().await;
    publish("Be fair and kind.").await.unwrap();
    let owed = f
        .store
        .activate_submission(Actor::Team(alpha.id), submission.id, f.now)
        .await;
    assert!(matches!(owed, Err(StoreError::TermsOwed { version: 2 })));
    let upload = f
        .store
        .create_submission(
            Actor::Team(alpha.id),
            alpha.id,
            bundle(),
            &UploadQuota::default(),
            f.now,
        )
        .await;
    assert!(matches!(upload, Err(StoreError::TermsOwed { version: 2 })));
    // What is active plays on.
    let stage = f.stage(&plan()).await;
    let started = f.store.start_day(Actor::Organiser, stage, f.now).await;
    assert_eq!(started.unwrap().len(), 1);
    let accept = async |version| {
        f.store
            .accept_terms(Actor::Person(ada.id), ada.id, version, f.now)
            .await
    };
    words(&accept(1).await.unwrap_err(), &["expected 2"]);
    accept(2).await.unwrap();
    f.later(1);
    f.upload(&alpha).await;
}

#[tokio::test]
async fn a_team_is_renamed_and_described_and_retires() {
    let f = Fixture::new().await;
    let submission = f.ready_team("Alpha").await;
    let id = submission.team;
    f.team("Beta").await;
    let change = async |change| {
        f.store
            .change_team(Actor::Team(id), id, change, f.now)
            .await
    };
    let named = |name: &str| TeamChange {
        name: Some(name.parse().unwrap()),
        ..TeamChange::default()
    };
    let taken = change(named("beta")).await;
    assert!(matches!(taken, Err(StoreError::TeamNameTaken(_))));
    assert_eq!(change(named("ALPHA")).await.unwrap().name.as_str(), "ALPHA");
    let described = |division: &str| TeamChange {
        name: Some("Gamma".parse().unwrap()),
        profile: Some(TeamProfile {
            affiliation: Some("TU".into()),
            link: Some("https://example.org".into()),
            division: Some(division.parse().unwrap()),
        }),
        ..TeamChange::default()
    };
    words(
        &change(described("Students")).await.unwrap_err(),
        &["division", "no divisions"],
    );
    let unchanged = f.store.team(id).await.unwrap();
    assert_eq!(unchanged.name.as_str(), "ALPHA", "nothing half done");
    let divisions = ["Students".parse().unwrap(), "Open".parse().unwrap()];
    f.store
        .change_season(Actor::Organiser, None, Some(&divisions), f.now)
        .await
        .unwrap();
    words(
        &change(described("Pupils")).await.unwrap_err(),
        &["expected “Students” or “Open”, got “Pupils”"],
    );
    let team = change(described("students")).await.unwrap();
    assert_eq!(team.profile.division, Some("Students".parse().unwrap()));

    f.store
        .retire_team(Actor::Team(id), id, f.now)
        .await
        .unwrap();
    let stage = f.stage(&plan()).await;
    let nobody = f.store.start_day(Actor::Organiser, stage, f.now).await;
    words(&nobody.unwrap_err(), &["no team has a valid submission"]);
    let chosen = f
        .store
        .activate_submission(Actor::Team(id), submission.id, f.now)
        .await;
    assert!(matches!(chosen, Err(StoreError::Retired { at }) if at == f.now));
    let again = f.store.retire_team(Actor::Team(id), id, f.now).await;
    words(&again.unwrap_err(), &["already"]);
    f.store
        .return_team(Actor::Team(id), id, f.now)
        .await
        .unwrap();
    let started = f.store.start_day(Actor::Organiser, stage, f.now).await;
    assert_eq!(started.unwrap().len(), 1);
}
