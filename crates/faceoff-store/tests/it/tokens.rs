//! Tokens: validity, expiry, rotation and revocation.

use crate::{fixture::*, users::add_user};
use faceoff_store::*;
use faceoff_types::TokenId;
use jiff::{SignedDuration, Timestamp};

/// An API token; each byte of its secret's hash is `hash`.
fn new_token(hash: u8, owner: TokenOwner, expires_at: Option<Timestamp>) -> NewToken {
    NewToken {
        hash: [hash; 32],
        kind: TokenKind::ApiToken,
        owner,
        name: "laptop".into(),
        requester: Requester::default(),
        expires_at,
    }
}

/// All tokens and sessions, the newest first.
pub async fn all_tokens(f: &TestStore) -> Vec<Token> {
    let listed = f.store.tokens_after(TokenFilter::Everyone, None, u32::MAX);
    listed.await.unwrap().unwrap()
}

async fn all_invitations(f: &TestStore) -> Vec<Invitation> {
    let listed = f.store.invitations_after(None, None, u32::MAX);
    listed.await.unwrap().unwrap()
}

/// Why the token with this hash is rejected; `None` if it is valid.
async fn rejection(f: &TestStore, hash: u8) -> Option<TokenRejection> {
    let verified = f
        .store
        .verify_token([hash; 32], TokenKind::ApiToken, f.now)
        .await;
    verified.unwrap().err()
}

#[tokio::test]
async fn token_is_valid_until_expired_rotated_or_revoked() {
    let mut f = TestStore::new().await;
    let team = TokenOwner::Team(f.create_team("Alpha").await.id);
    let expires_at = f.now + SignedDuration::from_secs(60);
    let create = async |hash, expires_at| {
        f.store
            .create_token(Actor::Operator, new_token(hash, team, expires_at), f.now)
            .await
    };
    let expiring = create(1, Some(expires_at)).await.unwrap();
    let unlimited = create(2, None).await.unwrap();
    assert_eq!(
        (expiring.expires_at, unlimited.expires_at),
        (Some(expires_at), None)
    );
    let error = create(3, Some(f.now)).await.unwrap_err();
    assert!(error.to_string().contains("in the future"), "{error}");
    let repeated = create(2, None).await.unwrap_err();
    assert!(matches!(repeated, StoreError::Conflict(_)), "{repeated}");
    assert_eq!(rejection(&f, 1).await, None);
    assert_eq!(rejection(&f, 4).await, Some(TokenRejection::Unknown));
    let as_session = f
        .store
        .verify_token([1; 32], TokenKind::Session, f.now)
        .await;
    assert_eq!(as_session.unwrap().unwrap_err(), TokenRejection::WrongKind);

    f.store
        .rotate_token(
            Actor::Operator,
            unlimited.id,
            [5; 32],
            Requester::default(),
            f.now,
        )
        .await
        .unwrap();
    assert_eq!(rejection(&f, 2).await, Some(TokenRejection::Unknown));
    assert_eq!(rejection(&f, 5).await, None);
    f.advance_clock_s(60);
    assert_eq!(
        rejection(&f, 1).await,
        Some(TokenRejection::Expired(expires_at))
    );
    let rotated = f
        .store
        .rotate_token(
            Actor::Operator,
            expiring.id,
            [6; 32],
            Requester::default(),
            f.now,
        )
        .await;
    assert!(matches!(rotated, Err(StoreError::Conflict(_))));
    for _ in 0..2 {
        let revoked = f
            .store
            .revoke_token(
                Actor::Operator,
                unlimited.id,
                RevocationExtent::TokenOnly,
                f.now,
            )
            .await;
        assert_eq!(revoked.unwrap().token.revoked_at, Some(f.now));
    }
    assert_eq!(rejection(&f, 5).await, Some(TokenRejection::Revoked(f.now)));
    let unknown = f
        .store
        .revoke_token(
            Actor::Operator,
            TokenId::new(),
            RevocationExtent::TokenOnly,
            f.now,
        )
        .await;
    assert!(matches!(unknown, Err(StoreError::NotFound("token"))));
    let events = f.store.events_after(0, 100).await.unwrap();
    let revoked = events
        .iter()
        .filter(|record| matches!(record.event, Event::TokenRevoked { .. }));
    assert_eq!(revoked.count(), 1, "a revoked token is not revoked again");
}

#[tokio::test]
async fn token_use_is_recorded_and_tokens_are_limited() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let owner = TokenOwner::Team(team.id);
    for hash in 1..u8::try_from(MAX_TOKENS).unwrap() {
        f.store
            .create_token(Actor::Operator, new_token(hash, owner, None), f.now)
            .await
            .unwrap();
    }
    let error = f
        .store
        .create_token(Actor::Operator, new_token(200, owner, None), f.now)
        .await
        .unwrap_err();
    assert!(error.to_string().contains("which is the limit"), "{error}");
    let used = all_tokens(&f).await.remove(3);
    assert_eq!(used.last_used_at, None);
    f.advance_clock_s(90);
    f.store.record_token_use(&used, f.now).await.unwrap();
    let used = f.store.token(used.id).await.unwrap();
    assert_eq!(used.last_used_at, Some(f.now));
    // A revoked token does not count towards the limit.
    f.store
        .revoke_token(Actor::Operator, used.id, RevocationExtent::TokenOnly, f.now)
        .await
        .unwrap();
    f.store
        .create_token(Actor::Operator, new_token(200, owner, None), f.now)
        .await
        .unwrap();
}

#[tokio::test]
async fn operator_token_follows_its_file_and_stays_revoked() {
    let f = TestStore::new().await;
    assert!(f.store.set_operator_token([1; 32], f.now).await.unwrap());
    assert!(f.store.set_operator_token([1; 32], f.now).await.unwrap());
    let other_operator_token = f
        .store
        .create_token(
            Actor::Operator,
            new_token(9, TokenOwner::Operator, None),
            f.now,
        )
        .await
        .unwrap();
    assert!(f.store.set_operator_token([2; 32], f.now).await.unwrap());
    assert_eq!(rejection(&f, 1).await, Some(TokenRejection::Revoked(f.now)));
    assert_eq!(rejection(&f, 2).await, None);
    assert_eq!(
        rejection(&f, 9).await,
        None,
        "other tokens of the operator are not affected"
    );
    // The token whose secret is in a file cannot be rotated: the next start would restore the old secret from the file.
    let tokens = all_tokens(&f).await;
    let file_token = tokens
        .iter()
        .find(|token| token.name == "admin-token" && token.revoked_at.is_none());
    let rotate = async |id, hash| {
        f.store
            .rotate_token(Actor::Operator, id, [hash; 32], Requester::default(), f.now)
            .await
    };
    let error = rotate(file_token.unwrap().id, 3).await.unwrap_err();
    assert!(error.to_string().contains("revoke it"), "{error}");
    assert_eq!(rejection(&f, 2).await, None, "the token is unchanged");
    rotate(other_operator_token.id, 8).await.unwrap();
    rotate(other_operator_token.id, 9).await.unwrap();
    assert!(!f.store.set_operator_token([1; 32], f.now).await.unwrap());
    f.store
        .revoke_token(
            Actor::Operator,
            other_operator_token.id,
            RevocationExtent::TokenOnly,
            f.now,
        )
        .await
        .unwrap();
    assert!(!f.store.set_operator_token([9; 32], f.now).await.unwrap());
}

#[tokio::test]
async fn migration_takes_missing_creators_from_the_event_log() {
    let f = TestStore::new().await;
    let team = f.create_team("Alpha").await;
    let owner = TokenOwner::Team(team.id);
    let users = [1, 2].map(|code| (code, InvitationRole::Organiser));
    let mut ids = Vec::new();
    for (code, role) in users {
        let invitation = NewInvitation {
            code_hash: [code; 32],
            role,
            note: "an organiser".into(),
            requester: Requester::default(),
            expires_at: f.now + SignedDuration::from_hours(1),
        };
        let invited = f.store.invite(Actor::Operator, invitation, f.now).await;
        invited.unwrap();
        let request = join_request([code; 32], &format!("User {code}"));
        ids.push(f.store.join(request, f.now).await.unwrap().user.id);
    }
    let [first, second] = ids[..] else {
        unreachable!()
    };
    let create = async |hash, actor| {
        let created = f
            .store
            .create_token(actor, new_token(hash, owner, None), f.now);
        created.await.unwrap().id
    };
    let by_first = create(11, Actor::User(first)).await;
    let rotated_by_second = create(12, Actor::User(first)).await;
    let rotated_by_team = create(13, Actor::User(first)).await;
    let by_operator = create(14, Actor::Operator).await;
    for (token, actor, hash) in [
        (rotated_by_second, Actor::User(second), 22),
        (rotated_by_team, Actor::Team(team.id), 23),
    ] {
        let requester = Requester::default();
        let rotated = f
            .store
            .rotate_token(actor, token, [hash; 32], requester, f.now);
        rotated.await.unwrap();
    }
    let link = |code| NewInvitation {
        code_hash: [code; 32],
        role: InvitationRole::RestoreAccess(first),
        note: "a link".into(),
        requester: Requester::default(),
        expires_at: f.now + SignedDuration::from_hours(24 * 90),
    };
    let link = f.store.invite(Actor::User(second), link(30), f.now).await;
    let link = link.unwrap();

    // As an earlier version left them. The migration takes the creators from the log of events, and limits password links to a day.
    let mut connection = f.connection().await;
    let mut execute = async |sql: &str| {
        sqlx::raw_sql(sqlx::AssertSqlSafe(sql.to_owned()))
            .execute(&mut connection)
            .await
            .unwrap();
    };
    for table in ["tokens", "invitations", "webhooks"] {
        execute(&format!(
            "UPDATE {table} SET made_by = NULL, made_with = NULL"
        ))
        .await;
    }
    let migration = include_str!("../../../../migrations/0049_makers.sql");
    let (_, updates) = migration.split_once("UPDATE").unwrap();
    execute(&format!("UPDATE{updates}")).await;

    let tokens = all_tokens(&f).await;
    let creator = |id| {
        let token = tokens.iter().find(|token| token.id == id);
        token.unwrap().creator.user
    };
    assert_eq!(creator(by_first), Some(first));
    assert_eq!(creator(rotated_by_second), Some(second));
    assert_eq!(creator(rotated_by_team), Some(first));
    assert_eq!(creator(by_operator), None);
    let own = tokens
        .iter()
        .filter(|token| token.owner == TokenOwner::User(first));
    assert!(own.clone().count() == 1 && own.clone().all(|token| token.creator.user == Some(first)));
    let invitations = all_invitations(&f).await;
    let link = invitations.iter().find(|found| found.id == link.id);
    let link = link.unwrap();
    assert_eq!(link.creator.user, Some(second));
    assert_eq!(link.expires_at, f.now + SignedDuration::from_hours(24));
}

#[tokio::test]
async fn tokens_and_invitations_are_listed_page_by_page() {
    let mut f = TestStore::new().await;
    let teams = [
        f.create_team("Alpha").await.id,
        f.create_team("Beta").await.id,
    ];
    let ada = add_user(&f, 100, "Ada", InvitationRole::Member(teams[0])).await;
    let mut created = Vec::new();
    for hash in 1..=9 {
        // Some are created at the same time as the one before, where the order by time alone would not be unique.
        f.advance_clock_s(i64::from(hash % 2));
        let owner = match hash % 3 {
            0 => TokenOwner::User(ada.id),
            1 => TokenOwner::Team(teams[0]),
            _ => TokenOwner::Team(teams[1]),
        };
        let new = new_token(hash, owner, None);
        created.push(
            f.store
                .create_token(Actor::Operator, new, f.now)
                .await
                .unwrap(),
        );
    }
    let everyone = all_tokens(&f).await;
    for of in [
        TokenFilter::Everyone,
        TokenFilter::User(ada.id),
        TokenFilter::Member(ada.id, teams[0]),
    ] {
        let expected: Vec<TokenId> = everyone
            .iter()
            .filter(|token| of.includes(token))
            .map(|token| token.id)
            .collect();
        assert!(expected.len() > 2, "{of:?}");
        let mut found = Vec::new();
        loop {
            let page = f.store.tokens_after(of, found.last().copied(), 2);
            let page = page.await.unwrap().unwrap();
            assert!(page.len() <= 2);
            if page.is_empty() {
                break;
            }
            found.extend(page.iter().map(|token| token.id));
        }
        assert_eq!(found, expected, "{of:?}");
    }
    // A page cannot start after a token of another team, or after one that does not exist.
    let of_alpha = TokenFilter::Member(ada.id, teams[0]);
    for after in [created[1].id, TokenId::new()] {
        let page = f
            .store
            .tokens_after(of_alpha, Some(after), 2)
            .await
            .unwrap();
        assert_eq!(page, None);
    }

    let invited = async |hash: u8, role| {
        let invitation = NewInvitation {
            code_hash: [hash; 32],
            role,
            note: "Bob".into(),
            requester: Requester::default(),
            expires_at: f.now + SignedDuration::from_hours(1),
        };
        f.store
            .invite(Actor::Operator, invitation, f.now)
            .await
            .unwrap()
            .id
    };
    let to_beta = invited(101, InvitationRole::Member(teams[1])).await;
    let mut to_alpha = Vec::new();
    for hash in 102..=104 {
        to_alpha.insert(0, invited(hash, InvitationRole::Member(teams[0])).await);
    }
    let alpha = Some(teams[0]);
    let first = f
        .store
        .invitations_after(alpha, None, 2)
        .await
        .unwrap()
        .unwrap();
    let second = f.store.invitations_after(alpha, Some(first[1].id), 10);
    let second = second.await.unwrap().unwrap();
    let listed: Vec<_> = first
        .iter()
        .chain(&second)
        .map(|listed| listed.id)
        .collect();
    // The fourth and oldest is the invitation that Ada has accepted.
    assert_eq!(listed[..3], to_alpha);
    assert_eq!(listed.len(), 4);
    let page = f
        .store
        .invitations_after(alpha, Some(to_beta), 2)
        .await
        .unwrap();
    assert_eq!(page, None);
}

#[tokio::test]
async fn ended_credentials_are_deleted_after_a_month() {
    let mut f = TestStore::new().await;
    let team = f.create_team("Alpha").await.id;
    add_user(&f, 100, "Ada", InvitationRole::Member(team)).await;
    let create = async |f: &TestStore, hash, made_with: Option<(TokenId, [u8; 32])>| {
        let new = NewToken {
            requester: Requester {
                user: None,
                token: made_with,
            },
            ..new_token(hash, TokenOwner::Team(team), None)
        };
        f.store
            .create_token(Actor::Operator, new, f.now)
            .await
            .unwrap()
            .id
    };
    let root = create(&f, 1, None).await;
    let child = create(&f, 2, Some((root, [1; 32]))).await;
    let grandchild = create(&f, 9, Some((child, [2; 32]))).await;
    let leaf = create(&f, 3, Some((grandchild, [9; 32]))).await;
    for ended in [child, grandchild] {
        f.store
            .revoke_token(Actor::Operator, ended, RevocationExtent::TokenOnly, f.now)
            .await
            .unwrap();
    }
    // The revoked operator's token stays: if it were deleted, the next start would make its secret, which is in a file, valid again.
    assert!(f.store.set_operator_token([7; 32], f.now).await.unwrap());
    let of_operator = f.store.verify_token([7; 32], TokenKind::ApiToken, f.now);
    let of_operator = of_operator.await.unwrap().unwrap().token.id;
    f.store
        .revoke_token(
            Actor::Operator,
            of_operator,
            RevocationExtent::TokenOnly,
            f.now,
        )
        .await
        .unwrap();
    let expires_at = f.now + SignedDuration::from_hours(1);
    let expired = new_token(4, TokenOwner::Team(team), Some(expires_at));
    f.store
        .create_token(Actor::Operator, expired, f.now)
        .await
        .unwrap();
    let invitation = NewInvitation {
        code_hash: [5; 32],
        role: InvitationRole::Member(team),
        note: "Bob".into(),
        requester: Requester::default(),
        expires_at,
    };
    f.store
        .invite(Actor::Operator, invitation, f.now)
        .await
        .unwrap();

    // The two revoked tokens are deleted after 30 days. Token and invitation that expired an hour later follow an hour later.
    f.advance_clock_s(30 * 24 * 3600 - 1);
    assert_eq!(f.store.delete_ended_credentials(f.now).await.unwrap(), 0);
    f.advance_clock_s(1);
    assert_eq!(f.store.delete_ended_credentials(f.now).await.unwrap(), 2);
    f.advance_clock_s(3600);
    assert_eq!(f.store.delete_ended_credentials(f.now).await.unwrap(), 2);
    assert_eq!(f.store.delete_ended_credentials(f.now).await.unwrap(), 0);

    let tokens = all_tokens(&f).await;
    let of_team: Vec<TokenId> = tokens
        .iter()
        .filter(|token| token.owner == TokenOwner::Team(team))
        .map(|token| token.id)
        .collect();
    // The third one is the token that the team got when it was created.
    assert_eq!((of_team.len(), &of_team[..2]), (3, &[leaf, root][..]));
    let invitations = all_invitations(&f).await;
    let [accepted] = invitations.as_slice() else {
        panic!("{invitations:?}");
    };
    assert!(matches!(accepted.state, InvitationState::Accepted { .. }));
    assert!(!f.store.set_operator_token([7; 32], f.now).await.unwrap());
    // The tokens between them are deleted, and revoking the root with all that was created with it still revokes the leaf.
    f.store
        .revoke_token(
            Actor::Operator,
            root,
            RevocationExtent::WithCreatedExcept(None),
            f.now,
        )
        .await
        .unwrap();
    assert_eq!(rejection(&f, 3).await, Some(TokenRejection::Revoked(f.now)));
}
