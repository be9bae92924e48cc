//! Teams: their API tokens, and ids that do not exist.

use crate::fixture::*;
use faceoff_store::*;
use faceoff_types::TeamId;

const TOKEN_HASH: [u8; 32] = [7; 32];
const OTHER_TOKEN_HASH: [u8; 32] = [8; 32];

#[tokio::test]
async fn team_token_is_valid_until_replaced() {
    let f = TestStore::new().await;
    let name = "Zoë".parse().unwrap();
    let team = f
        .store
        .create_team(
            Actor::Operator,
            &name,
            TOKEN_HASH,
            Requester::default(),
            f.now,
        )
        .await
        .unwrap();
    assert_eq!(f.store.team(team.id).await.unwrap(), team);
    let principal = async |hash| {
        let verified = f.store.verify_token(hash, TokenKind::ApiToken, f.now).await;
        verified.unwrap().map(|token| token.principal)
    };
    assert_eq!(
        principal(TOKEN_HASH).await,
        Ok(Principal::Team(team.clone()))
    );
    f.store
        .set_team_token(
            Actor::Operator,
            team.id,
            OTHER_TOKEN_HASH,
            Requester::default(),
            f.now,
        )
        .await
        .unwrap();
    assert_eq!(
        principal(TOKEN_HASH).await,
        Err(TokenRejection::Revoked(f.now))
    );
    assert_eq!(principal(OTHER_TOKEN_HASH).await, Ok(Principal::Team(team)));
}

#[tokio::test]
async fn two_teams_cannot_share_a_token() {
    let f = TestStore::new().await;
    f.store
        .create_team(
            Actor::Operator,
            &"Alpha".parse().unwrap(),
            TOKEN_HASH,
            Requester::default(),
            f.now,
        )
        .await
        .unwrap();
    let beta = f
        .store
        .create_team(
            Actor::Operator,
            &"Beta".parse().unwrap(),
            OTHER_TOKEN_HASH,
            Requester::default(),
            f.now,
        )
        .await
        .unwrap();
    let error = f
        .store
        .create_team(
            Actor::Operator,
            &"Gamma".parse().unwrap(),
            TOKEN_HASH,
            Requester::default(),
            f.now,
        )
        .await
        .unwrap_err();
    assert!(matches!(error, StoreError::Conflict(_)), "{error}");
    let error = f
        .store
        .set_team_token(
            Actor::Operator,
            beta.id,
            TOKEN_HASH,
            Requester::default(),
            f.now,
        )
        .await
        .unwrap_err();
    assert!(matches!(error, StoreError::Conflict(_)), "{error}");
}

#[tokio::test]
async fn unknown_ids_are_not_found() {
    let f = TestStore::new().await;
    let id = TeamId::new();
    assert!(matches!(
        f.store.team(id).await,
        Err(StoreError::NotFound("team"))
    ));
    assert!(matches!(
        f.store
            .set_team_token(Actor::Operator, id, [1; 32], Requester::default(), f.now)
            .await,
        Err(StoreError::NotFound("team"))
    ));
    let upload = f
        .store
        .create_submission(
            Actor::Operator,
            id,
            bundle(),
            &UploadQuota::default(),
            f.now,
        )
        .await;
    assert!(matches!(upload, Err(StoreError::NotFound("team"))));
    let submission = uuid::Uuid::now_v7().into();
    let activated = f
        .store
        .activate_submission(Actor::Operator, submission, f.now)
        .await;
    assert!(matches!(activated, Err(StoreError::NotFound("submission"))));
    let evaluation = uuid::Uuid::now_v7().into();
    assert!(matches!(
        f.store.evaluation(evaluation).await,
        Err(StoreError::NotFound("evaluation"))
    ));
    let rerun = f.store.rerun_evaluation(Actor::Operator, evaluation, f.now);
    assert!(matches!(
        rerun.await,
        Err(StoreError::NotFound("evaluation"))
    ));
}
