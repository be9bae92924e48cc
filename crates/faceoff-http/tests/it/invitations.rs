//! Tests of invitations and registrations: whose link is valid, until when and how often, and what it requires.

use crate::{
    site::{ADMIN, Answer, Site, string},
    users::{get, invite, join, post},
};
use faceoff_store::{MAX_OPEN_INVITATIONS, MAX_PENDING_REGISTRATIONS};
use reqwest::Method;
use serde_json::{Value, json};

/// Accepts an invitation, or tries to.
async fn accept(site: &Site, request: Value) -> Answer {
    site.post("/api/v1/invitations/accept", None, &request)
        .await
}

async fn number_of(site: &Site, path: &str) -> usize {
    get(site, path, ADMIN).await.as_array().unwrap().len()
}

/// The registration of a team, or the attempt.
async fn register(site: &Site, team_name: &str) -> Answer {
    let request = json!({ "team": { "name": team_name }, "contact": "ada@example.org" });
    site.post("/api/v1/registrations", None, &request).await
}

#[tokio::test]
async fn invitation_creates_one_user_with_its_role() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let member = json!({ "role": "member", "team": alpha.id, "note": "Ada" });
    let organiser = json!({ "role": "organiser", "note": "an organiser" });
    let used = invite(&site, ADMIN, &member).await;
    let ada = join(&site, &used, "Ada").await;
    let caller = get(&site, "/whoami", &ada.token).await;
    assert_eq!(
        (&caller["role"], &caller["team"]["id"]),
        (&json!("member"), &json!(alpha.id))
    );
    let grace = invite(&site, ADMIN, &organiser).await;
    let grace = join(&site, &grace, "Grace").await;
    let caller = get(&site, "/whoami", &grace.token).await;
    assert_eq!(caller["role"], "organiser");

    let join_as = async |code: &str, name: &str| {
        let request = json!({ "code": code, "name": name });
        accept(&site, request).await
    };
    join_as(&used, "Eve")
        .await
        .problem(409, "invitation-spent", &["was accepted", "only once"]);
    join_as("fo_invite_unknown", "Eve").await.problem(
        409,
        "invitation-spent",
        &["no such invitation"],
    );
    let revoked = post(&site, "/invitations", ADMIN, &organiser)
        .await
        .json(201);
    let path = format!("/api/v1/invitations/{}", string(&revoked["id"]));
    site.send(Method::DELETE, &path, Some(ADMIN), &Value::Null)
        .await
        .json(200);
    join_as(&string(&revoked["code"]), "Eve").await.problem(
        409,
        "invitation-spent",
        &["was revoked"],
    );
    let in_an_hour = (site.now() + jiff::SignedDuration::from_hours(1)).to_string();
    let brief = json!({ "role": "organiser", "note": "brief", "expires_at": in_an_hour });
    let brief = invite(&site, ADMIN, &brief).await;
    join_as(&brief, "ADA")
        .await
        .problem(409, "person-name-taken", &["Ada"]);
    // The first letter is a Cyrillic one.
    join_as(&brief, "Аda")
        .await
        .problem(409, "person-name-taken", &["Ada", "look alike"]);
    site.advance(3600);
    join_as(&brief, "Eve")
        .await
        .problem(409, "invitation-spent", &["expired on"]);
    assert_eq!(number_of(&site, "/people").await, 2, "no other user joined");
}

#[tokio::test]
async fn founder_invitation_requires_a_team_name() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let founder = json!({ "role": "founder", "note": "a founder" });
    let code = invite(&site, ADMIN, &founder).await;
    for (request, slug, words) in [
        (
            json!({ "code": code, "name": "Ada" }),
            "conflict",
            "expected the team's name",
        ),
        (
            json!({ "code": code, "name": "Ada", "team": { "name": "ALPHA" } }),
            "team-name-taken",
            "Alpha",
        ),
        (
            json!({ "code": code, "team": { "name": "Beta" } }),
            "conflict",
            "name: expected",
        ),
    ] {
        accept(&site, request).await.problem(409, slug, &[words]);
    }
    assert_eq!(
        number_of(&site, "/teams").await,
        1,
        "a failed request changes nothing"
    );
    let request = json!({ "code": code, "name": "Ada", "team": { "name": "Beta" } });
    let joined = accept(&site, request).await.json(201);
    assert_eq!(joined["team"]["name"], "Beta");
    let caller = get(&site, "/whoami", &string(&joined["secret"])).await;
    assert_eq!(caller["team"]["id"], joined["team"]["id"]);

    let member = json!({ "role": "member", "team": alpha.id, "note": "Eve" });
    let code = invite(&site, ADMIN, &member).await;
    let request = json!({ "code": code, "name": "Eve", "team": { "name": "Gamma" } });
    accept(&site, request)
        .await
        .problem(409, "conflict", &["leave it out"]);
}

#[tokio::test]
async fn invalid_invitations_are_refused() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let expired = json!({ "role": "organiser", "note": "x", "expires_at": site.now().to_string() });
    post(&site, "/invitations", ADMIN, &expired)
        .await
        .problem(409, "conflict", &["in the future"]);
    let unknown_team = json!({ "role": "member", "team": uuid::Uuid::nil(), "note": "x" });
    post(&site, "/invitations", ADMIN, &unknown_team)
        .await
        .problem(404, "not-found", &["team"]);
    let member = json!({ "role": "member", "team": alpha.id, "note": "a user" });
    for _ in 0..MAX_OPEN_INVITATIONS {
        invite(&site, ADMIN, &member).await;
    }
    post(&site, "/invitations", ADMIN, &member).await.problem(
        409,
        "conflict",
        &["which is the limit"],
    );
    let organiser = json!({ "role": "organiser", "note": "x" });
    invite(&site, ADMIN, &organiser).await;
}

#[tokio::test]
async fn registration_link_is_valid_once_approved() {
    let site = Site::start().await;
    site.team("Alpha").await;
    register(&site, "Beta")
        .await
        .problem(409, "conflict", &["registration is closed"]);
    let open = json!({ "takes_registrations": true });
    site.patch("/api/v1/season", Some(ADMIN), &open)
        .await
        .json(200);
    register(&site, "ALPHA")
        .await
        .problem(409, "team-name-taken", &["Alpha"]);
    let beta = register(&site, "Beta").await.json(201);
    register(&site, "beta")
        .await
        .problem(409, "team-name-taken", &["Beta"]);

    let join_by = async |registration: &Value, name: &str| {
        let request = json!({ "code": registration["code"], "name": name });
        accept(&site, request).await
    };
    join_by(&beta, "Ada")
        .await
        .problem(409, "invitation-spent", &["Beta", "is pending"]);
    let approve = format!("/registrations/{}/approve", string(&beta["id"]));
    let approved = post(&site, &approve, ADMIN, &json!({})).await.json(200);
    assert_eq!(
        (&approved["state"], &approved["decided_at"]),
        (&json!("approved"), &json!(site.now().to_string()))
    );
    let joined = join_by(&beta, "Ada").await.json(201);
    assert_eq!(joined["team"]["id"], approved["team"]);
    assert_eq!(joined["team"]["name"], "Beta");
    post(&site, &approve, ADMIN, &json!({}))
        .await
        .problem(409, "conflict", &["was approved"]);

    let gamma = register(&site, "Gamma").await.json(201);
    let refuse = format!("/registrations/{}/refuse", string(&gamma["id"]));
    let reason = json!({ "reason": "full" });
    post(&site, &refuse, ADMIN, &reason).await.json(200);
    post(&site, &refuse, ADMIN, &reason)
        .await
        .problem(409, "conflict", &["was refused"]);
    join_by(&gamma, "Eve")
        .await
        .problem(409, "invitation-spent", &["refused: full"]);
    register(&site, "Gamma").await.json(201);
}

#[tokio::test]
async fn pending_registrations_are_limited() {
    let site = Site::start().await;
    let open = json!({ "takes_registrations": true });
    site.patch("/api/v1/season", Some(ADMIN), &open)
        .await
        .json(200);
    for number in 0..MAX_PENDING_REGISTRATIONS {
        register(&site, &format!("Team {number}")).await.json(201);
    }
    register(&site, "Late")
        .await
        .problem(409, "conflict", &["which is the limit"]);
}
