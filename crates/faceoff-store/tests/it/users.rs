//! Users: how they return, leave, and accept new terms; their teams. In these tests each byte of
//! a code's hash is the same number.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::UserId;
use jiff::SignedDuration;

async fn invite(f: &TestStore, code: u8, role: InvitationRole) -> Invitation {
    let invitation = NewInvitation {
        code_hash: [code; 32],
        role,
        note: "a user".into(),
        requester: Requester::default(),
        expires_at: f.now + SignedDuration::from_hours(1),
    };
    f.store
        .invite(Actor::Operator, invitation, f.now)
        .await
        .unwrap()
}

/// A user who has joined with this code.
pub async fn add_user(f: &TestStore, code: u8, name: &str, role: InvitationRole) -> User {
    invite(f, code, role).await;
    let joined = f.store.join(join_request([code; 32], name), f.now).await;
    joined.unwrap().user
}

/// As whom the token of the user who joined with this code acts.
async fn principal(f: &TestStore, code: u8) -> Result<Principal, TokenRejection> {
    let hash = *blake3::hash(&[code; 32]).as_bytes();
    let verified = f.store.verify_token(hash, TokenKind::ApiToken, f.now).await;
    verified.unwrap().map(|token| token.principal)
}

#[tokio::test]
async fn returning_user_keeps_identity_and_gets_new_tokens() {
    let f = TestStore::new().await;
    let alpha = f.create_team("Alpha").await;
    let ada = add_user(&f, 1, "Ada", InvitationRole::Member(alpha.id)).await;
    invite(&f, 2, InvitationRole::RestoreAccess(ada.id)).await;
    let other_name = f.store.join(join_request([2; 32], "Eve"), f.now).await;
    assert_contains(&other_name.unwrap_err(), &["belongs to Ada"]);
    let request = JoinRequest {
        name: None,
        password_hash: Some("$argon2id$…".into()),
        ..join_request([2; 32], "Ada")
    };
    let joined = f.store.join(request, f.now).await.unwrap();
    assert_eq!(joined.user.id, ada.id);
    assert!(joined.user.has_password);
    assert_eq!(principal(&f, 1).await, Err(TokenRejection::Revoked(f.now)));
    assert!(principal(&f, 2).await.is_ok());
    let password = f.store.password_hash_of("aDA").await.unwrap();
    assert_eq!(password, Some((ada.id, "$argon2id$…".into())));

    let request_token = joined.token.id;
    f.store
        .set_password(Actor::User(ada.id), ada.id, "other", request_token, f.now)
        .await
        .unwrap();
    assert!(
        principal(&f, 2).await.is_ok(),
        "the token of the request stays valid"
    );
}

#[tokio::test]
async fn renamed_user_keeps_access_and_signs_in_by_the_new_name() {
    let f = TestStore::new().await;
    let alpha = f.create_team("Alpha").await;
    let ada = add_user(&f, 1, "Ada", InvitationRole::Member(alpha.id)).await;
    let eve = add_user(&f, 2, "Eve", InvitationRole::Member(alpha.id)).await;
    let (actor, now) = (Actor::User(ada.id), f.now);
    let hash = *blake3::hash(&[1; 32]).as_bytes();
    let verified = f.store.verify_token(hash, TokenKind::ApiToken, now).await;
    let token = verified.unwrap().unwrap().token.id;
    f.store
        .set_password(actor.clone(), ada.id, "hash", token, now)
        .await
        .unwrap();
    let rename = async |id, name: &str| {
        let name = name.parse().unwrap();
        f.store.rename_user(actor.clone(), id, name, now).await
    };
    assert_eq!(rename(ada.id, "Ada").await.unwrap().name, ada.name);
    // The own name in another spelling is free, another user's is not.
    assert_eq!(rename(ada.id, "ADA").await.unwrap().name.as_str(), "ADA");
    let taken = rename(ada.id, "eVE").await.unwrap_err();
    assert!(matches!(taken, StoreError::UserNameTaken(name) if name == "Eve"));
    let renamed = rename(ada.id, "Ada Lovelace").await.unwrap();
    assert_eq!(renamed.name.as_str(), "Ada Lovelace");
    assert!(principal(&f, 1).await.is_ok());
    assert_eq!(f.store.password_hash_of("Ada").await.unwrap(), None);
    let signs_in = f.store.password_hash_of("ada lovelace").await.unwrap();
    assert_eq!(signs_in.map(|(id, _)| id), Some(ada.id));
    let events = f.store.events_after(0, 1000).await.unwrap();
    let renames = events.iter().filter_map(|record| match &record.event {
        Event::UserRenamed { from, to } => Some((from.as_str(), to.as_str())),
        _ => None,
    });
    let expected = [("Ada", "ADA"), ("ADA", "Ada Lovelace")];
    assert_eq!(renames.collect::<Vec<_>>(), expected);

    f.store
        .remove_user(actor.clone(), eve.id, now)
        .await
        .unwrap();
    assert_contains(&rename(eve.id, "Eva").await.unwrap_err(), &["Eve has left"]);
    let former = rename(ada.id, "Eve").await.unwrap_err();
    assert!(
        matches!(former, StoreError::UserNameTaken(_)),
        "the log shows it"
    );
}

#[tokio::test]
async fn removed_user_loses_all_access() {
    let f = TestStore::new().await;
    let alpha = f.create_team("Alpha").await;
    let ada = add_user(&f, 1, "Ada", InvitationRole::Member(alpha.id)).await;
    let grace = add_user(&f, 2, "Grace", InvitationRole::Organiser).await;
    let remove = async |id| f.store.remove_user(Actor::Operator, id, f.now).await;
    let error = remove(grace.id).await.unwrap_err();
    assert_contains(&error, &["Grace", "the last who can organise"]);
    f.store.set_operator_token([7; 32], f.now).await.unwrap();
    remove(grace.id).await.unwrap();
    let (removed, _) = remove(ada.id).await.unwrap();
    assert_eq!(removed.left_at, Some(f.now));
    for code in [1, 2] {
        assert_eq!(
            principal(&f, code).await,
            Err(TokenRejection::Revoked(f.now))
        );
    }
    assert_eq!(f.store.password_hash_of("Ada").await.unwrap(), None);
    assert_contains(&remove(ada.id).await.unwrap_err(), &["has left"]);
    let unknown = remove(UserId::new()).await;
    assert!(matches!(unknown, Err(StoreError::NotFound("user"))));
    let invitation = NewInvitation {
        code_hash: [3; 32],
        role: InvitationRole::RestoreAccess(ada.id),
        note: "Ada".into(),
        requester: Requester::default(),
        expires_at: f.now + SignedDuration::from_hours(1),
    };
    let error = f.store.invite(Actor::Operator, invitation, f.now).await;
    assert_contains(&error.unwrap_err(), &["has left"]);
    let events = f.store.events_after(0, 100).await.unwrap();
    let joined = events
        .iter()
        .find(|record| record.subject == Subject::User(ada.id) && record.id > 1)
        .unwrap();
    assert!(matches!(joined.event, Event::UserJoined { .. }));
}

#[tokio::test]
async fn new_terms_block_uploads_until_accepted() {
    let mut f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let alpha = f.store.team(submission.team).await.unwrap();
    let publish = async |text| f.store.publish_terms(Actor::Operator, text, f.now).await;
    assert_eq!(publish("Be fair.").await.unwrap().version, 1);
    assert_contains(
        &publish("Be fair.").await.unwrap_err(),
        &["nothing was changed"],
    );
    f.upload(&alpha).await;
    f.validate().await;
    // A team without members does not need to accept the terms; a member must accept them.
    invite(&f, 1, InvitationRole::Member(alpha.id)).await;
    let without_consent = f.store.join(join_request([1; 32], "Ada"), f.now).await;
    assert_contains(
        &without_consent.unwrap_err(),
        &["accepted_terms", "version 1", "none"],
    );
    let accepting = |version| JoinRequest {
        accepted_terms: Some(version),
        ..join_request([1; 32], "Ada")
    };
    let wrong_version = f.store.join(accepting(2), f.now).await;
    assert_contains(&wrong_version.unwrap_err(), &["version 1", "got 2"]);
    let ada = f.store.join(accepting(1), f.now).await.unwrap().user;
    assert_eq!(ada.accepted_terms, Some(1));
    f.upload(&alpha).await;
    f.validate().await;
    publish("Be fair and kind.").await.unwrap();
    let not_accepted = f
        .store
        .activate_submission(Actor::Team(alpha.id), submission.id, f.now)
        .await;
    assert!(matches!(
        not_accepted,
        Err(StoreError::TermsNotAccepted { version: 2 })
    ));
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
    assert!(matches!(
        upload,
        Err(StoreError::TermsNotAccepted { version: 2 })
    ));
    // The active submission is still evaluated.
    let stage = f.configure_stage(&six_shard_plan()).await;
    let started = f.store.start_day(Actor::Operator, stage, f.now).await;
    assert_eq!(started.unwrap().len(), 1);
    let accept = async |version| {
        f.store
            .accept_terms(Actor::User(ada.id), ada.id, version, f.now)
            .await
    };
    assert_contains(&accept(1).await.unwrap_err(), &["expected 2"]);
    accept(2).await.unwrap();
    f.advance_clock_s(1);
    f.upload(&alpha).await;
}

#[tokio::test]
async fn team_can_be_renamed_described_and_retired() {
    let f = TestStore::new().await;
    let submission = f.valid_submission_of("Alpha").await;
    let id = submission.team;
    f.create_team("Beta").await;
    let change_team = async |change| {
        f.store
            .change_team(Actor::Team(id), id, change, f.now)
            .await
    };
    let new_name = |name: &str| TeamChange {
        name: Some(name.parse().unwrap()),
        ..TeamChange::default()
    };
    let refused = change_team(new_name("beta")).await;
    assert!(matches!(refused, Err(StoreError::TeamNameTaken(_))));
    assert_eq!(
        change_team(new_name("ALPHA")).await.unwrap().name.as_str(),
        "ALPHA"
    );
    let new_description = |division: &str| TeamChange {
        name: Some("Gamma".parse().unwrap()),
        profile: Some(TeamProfile {
            affiliation: Some("TU".into()),
            link: Some("https://example.org".into()),
            division: Some(division.parse().unwrap()),
        }),
        ..TeamChange::default()
    };
    assert_contains(
        &change_team(new_description("Students")).await.unwrap_err(),
        &["division", "no divisions"],
    );
    let unchanged = f.store.team(id).await.unwrap();
    assert_eq!(
        unchanged.name.as_str(),
        "ALPHA",
        "a failed request changes nothing"
    );
    let divisions = ["Students".parse().unwrap(), "Open".parse().unwrap()];
    f.store
        .change_season(Actor::Operator, None, Some(&divisions), f.now)
        .await
        .unwrap();
    assert_contains(
        &change_team(new_description("Pupils")).await.unwrap_err(),
        &["expected “Students” or “Open”, got “Pupils”"],
    );
    let team = change_team(new_description("students")).await.unwrap();
    assert_eq!(team.profile.division, Some("Students".parse().unwrap()));

    f.store
        .retire_team(Actor::Team(id), id, f.now)
        .await
        .unwrap();
    let stage = f.configure_stage(&six_shard_plan()).await;
    let empty = f.store.start_day(Actor::Operator, stage, f.now).await;
    assert_contains(&empty.unwrap_err(), &["no team has a valid submission"]);
    let chosen = f
        .store
        .activate_submission(Actor::Team(id), submission.id, f.now)
        .await;
    assert!(matches!(chosen, Err(StoreError::TeamRetired { at }) if at == f.now));
    let repeated = f.store.retire_team(Actor::Team(id), id, f.now).await;
    assert_contains(&repeated.unwrap_err(), &["already"]);
    f.store
        .return_team(Actor::Team(id), id, f.now)
        .await
        .unwrap();
    let started = f.store.start_day(Actor::Operator, stage, f.now).await;
    assert_eq!(started.unwrap().len(), 1);
}

#[tokio::test]
async fn requests_under_way_end_with_the_rights_of_their_user() {
    let f = TestStore::new().await;
    f.store.set_operator_token([7; 32], f.now).await.unwrap();
    let grace = add_user(&f, 1, "Grace", InvitationRole::Organiser).await;
    let hash = *blake3::hash(&[1; 32]).as_bytes();
    let verified = f.store.verify_token(hash, TokenKind::ApiToken, f.now).await;
    let token = verified.unwrap().unwrap().token.id;
    let requester = Requester {
        user: Some(grace.id),
        token: Some((token, hash)),
    };
    let new_token = |hash: u8, requester| NewToken {
        hash: [hash; 32],
        kind: TokenKind::ApiToken,
        owner: TokenOwner::Operator,
        name: "late".into(),
        requester,
        expires_at: None,
    };
    let create = async |hash, requester| {
        let new = new_token(hash, requester);
        let created = f
            .store
            .create_token(Actor::User(grace.id), new, f.now)
            .await;
        created.map(drop)
    };
    let invite = async |code: u8| {
        let invitation = NewInvitation {
            code_hash: [code; 32],
            role: InvitationRole::Organiser,
            note: "again".into(),
            requester,
            expires_at: f.now + SignedDuration::from_hours(1),
        };
        let invited = f
            .store
            .invite(Actor::User(grace.id), invitation, f.now)
            .await;
        invited.map(drop)
    };
    create(20, requester).await.unwrap();
    invite(21).await.unwrap();
    // The secret was replaced.
    let rotated = f
        .store
        .rotate_token(Actor::User(grace.id), token, [8; 32], requester, f.now)
        .await;
    rotated.unwrap();
    for refused in [create(22, requester).await, invite(23).await] {
        assert!(
            matches!(refused, Err(StoreError::TokenInvalid)),
            "{refused:?}"
        );
    }
    let requester = Requester {
        token: Some((token, [8; 32])),
        ..requester
    };
    create(24, requester).await.unwrap();
    f.store
        .remove_user(Actor::Operator, grace.id, f.now)
        .await
        .unwrap();
    let without_token = Requester {
        token: None,
        ..requester
    };
    for requester in [requester, without_token] {
        let refused = create(25, requester).await;
        assert!(
            matches!(refused, Err(StoreError::TokenInvalid)),
            "{refused:?}"
        );
    }
}

#[tokio::test]
async fn sign_in_under_way_fails_after_a_new_password() {
    let f = TestStore::new().await;
    let alpha = f.create_team("Alpha").await;
    let ada = add_user(&f, 1, "Ada", InvitationRole::Member(alpha.id)).await;
    let token = crate::tokens::all_tokens(&f).await[0].id;
    let set_password_hash = async |password_hash| {
        f.store
            .set_password(Actor::User(ada.id), ada.id, password_hash, token, f.now)
            .await
            .unwrap();
    };
    set_password_hash("old").await;
    // `verified_hash`: the stored hash with which the typed password agreed, before another one was set.
    let sign_in = async |token_hash: u8, verified_hash: &str| {
        let new = NewToken {
            hash: [token_hash; 32],
            kind: TokenKind::Session,
            owner: TokenOwner::User(ada.id),
            name: "browser".into(),
            requester: Requester::default(),
            expires_at: Some(f.now + SESSION_LIFETIME),
        };
        f.store
            .sign_in(ada.id, verified_hash, new, f.now)
            .await
            .unwrap()
    };
    assert!(sign_in(30, "old").await);
    set_password_hash("new").await;
    assert!(!sign_in(31, "old").await);
    assert!(sign_in(32, "new").await);
    f.store
        .remove_user(Actor::Operator, ada.id, f.now)
        .await
        .unwrap();
    assert!(!sign_in(33, "new").await);
}
