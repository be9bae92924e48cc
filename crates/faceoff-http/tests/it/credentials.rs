//! Tests of the end of credentials (tokens, invitations, webhooks) with the rights of the user who made them.

use crate::{
    browser::{Browser, PASSWORD},
    site::{ADMIN, Answer, Site, string},
    users::{User, get, invite, join, member, organiser, post},
};
use jiff::SignedDuration;
use reqwest::Method;
use serde_json::{Value, json};

async fn remove(site: &Site, token: &str, user: &User, name: &str) -> Value {
    let path = format!("/people/{}/remove", user.id);
    let removed = post(site, &path, token, &json!({ "confirm": name })).await;
    removed.json(200)
}

async fn delete(site: &Site, path: &str, token: &str) -> Answer {
    let path = format!("/api/v1{path}");
    site.send(Method::DELETE, &path, Some(token), &Value::Null)
        .await
}

/// A new token, with its secret.
async fn new_token(site: &Site, token: &str, body: Value) -> Value {
    post(site, "/tokens", token, &body).await.json(201)
}

async fn new_webhook(site: &Site, token: &str) -> Value {
    let webhook = json!({ "name": "chat", "url": "https://example.org/hook" });
    post(site, "/webhooks", token, &webhook).await.json(201)
}

/// Asserts that the token with this secret is revoked.
async fn assert_revoked(site: &Site, secret: &str) {
    let refused = site.get("/api/v1/whoami", Some(secret)).await;
    refused.problem(401, "unauthenticated", &["revoked"]);
}

/// Asserts that the invitation with this code is revoked.
async fn assert_invitation_revoked(site: &Site, code: &str) {
    let request = json!({ "code": code, "name": "Eve", "team": { "name": "Eves" } });
    let refused = site
        .post("/api/v1/invitations/accept", None, &request)
        .await;
    refused.problem(409, "invitation-spent", &["was revoked"]);
}

/// The values of this field of a list.
fn field(list: &Value, name: &str) -> Vec<String> {
    let entries = list.as_array().unwrap().iter();
    entries.map(|entry| string(&entry[name])).collect()
}

#[tokio::test]
async fn removing_an_organiser_ends_their_credentials() {
    let site = Site::start().await;
    let grace = organiser(&site, "Grace").await;
    let linus = organiser(&site, "Linus").await;
    let by_grace = |role: &str, note: &str| json!({ "role": role, "note": note });
    let organiser_code = invite(&site, &grace.token, &by_grace("organiser", "again")).await;
    let founder_code = invite(&site, &grace.token, &by_grace("founder", "a team")).await;
    let return_link = json!({ "role": "return", "person": linus.id, "note": "Linus" });
    let return_code = invite(&site, &grace.token, &return_link).await;
    let accepted = invite(&site, &grace.token, &by_grace("organiser", "Barbara")).await;
    let barbara = join(&site, &accepted, "Barbara").await;
    let team = post(&site, "/teams", &grace.token, &json!({ "name": "Alpha" })).await;
    let team = team.json(201);
    let laptop = new_token(&site, &grace.token, json!({ "name": "laptop" })).await;
    let by_operator = new_token(&site, ADMIN, json!({ "name": "second" })).await;
    let webhook = new_webhook(&site, &grace.token).await;
    // The secret of the operator's token would outlive the account.
    let rotate = format!("/tokens/{}/rotate", string(&by_operator["id"]));
    post(&site, &rotate, &grace.token, &json!({}))
        .await
        .problem(403, "forbidden", &["only with a token of the operator"]);

    let removed = remove(&site, &linus.token, &grace, "Grace").await;
    let ended = &removed["ended"];
    assert_eq!(field(&ended["tokens"], "name"), ["first"], "{ended:#}");
    assert_eq!(ended["tokens"][0]["team"], team["id"]);
    assert_eq!(
        field(&ended["invitations"], "note"),
        ["again", "a team", "Linus"]
    );
    assert_eq!(field(&ended["webhooks"], "name"), ["chat"]);
    assert_eq!(field(&ended["remaining_people"], "name"), ["Barbara"]);
    for secret in [
        &grace.token,
        &string(&laptop["secret"]),
        &string(&team["token"]),
    ] {
        assert_revoked(&site, secret).await;
    }
    for code in [organiser_code, founder_code, return_code] {
        assert_invitation_revoked(&site, &code).await;
    }
    // What others made stays, and so do accounts.
    for secret in [
        &linus.token,
        &barbara.token,
        &string(&by_operator["secret"]),
    ] {
        get(&site, "/whoami", secret).await;
    }
    let path = format!("/webhooks/{}", string(&webhook["id"]));
    let disabled = get(&site, &path, ADMIN).await;
    assert_eq!(disabled["state"], "dead", "{disabled:#}");
    let log = get(&site, "/events?kind=invitation_revoked", ADMIN).await;
    assert_eq!(log["events"].as_array().unwrap().len(), 3);

    // The organiser who enables the webhook again becomes its owner.
    let enable = json!({ "state": "alive" });
    site.patch(&format!("/api/v1{path}"), Some(&linus.token), &enable)
        .await
        .json(200);
    let removed = remove(&site, ADMIN, &linus, "Linus").await;
    assert_eq!(field(&removed["ended"]["webhooks"], "name"), ["chat"]);
}

#[tokio::test]
async fn removed_member_leaves_no_team_token_behind() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let bob = member(&site, &alpha.id, "Bob").await;
    let of_team = |name: &str| json!({ "name": name, "team": alpha.id });
    let by_ada = new_token(&site, &ada.token, of_team("ci")).await;
    assert_eq!(by_ada["made_by"], json!(ada.id));
    let by_bob = new_token(&site, &bob.token, of_team("robot")).await;
    // The user who rotates a token knows its secret.
    let rotate = format!("/tokens/{}/rotate", string(&by_bob["id"]));
    let rotated = post(&site, &rotate, &ada.token, &json!({})).await.json(200);
    let own = json!({ "role": "member", "note": "a friend" });
    let code = invite(&site, &ada.token, &own).await;
    let webhook = new_webhook(&site, &ada.token).await;
    let removed = remove(&site, &ada.token, &ada, "Ada").await;
    let ended = &removed["ended"];
    assert_eq!(field(&ended["tokens"], "name"), ["ci", "robot"]);
    assert_eq!(field(&ended["webhooks"], "id"), [string(&webhook["id"])]);
    assert_revoked(&site, &string(&by_ada["secret"])).await;
    assert_revoked(&site, &string(&rotated["secret"])).await;
    assert_invitation_revoked(&site, &code).await;
    get(&site, "/whoami", &bob.token).await;
    get(&site, "/whoami", &alpha.token).await;
}

#[tokio::test]
async fn team_token_renews_and_ends_only_itself() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let in_an_hour = site.now() + SignedDuration::from_hours(1);
    let brief = json!({ "name": "ci", "team": alpha.id, "expires_at": in_an_hour });
    let brief = new_token(&site, &ada.token, brief).await;
    let secret = string(&brief["secret"]);
    let own = format!("/tokens/{}", string(&brief["id"]));
    let listed = get(&site, "/tokens", &secret).await;
    assert_eq!(field(&listed, "id"), [string(&brief["id"])]);
    let all = get(&site, "/tokens", &ada.token).await;
    let ids = all.as_array().unwrap().iter();
    let ids = ids.map(|token| string(&token["id"]));
    let others: Vec<String> = ids.filter(|id| !own.ends_with(id)).collect();
    assert_eq!(others.len(), 2, "the team's first token, and Ada's");
    for id in others {
        post(&site, &format!("/tokens/{id}/rotate"), &secret, &json!({}))
            .await
            .problem(404, "not-found", &[]);
        delete(&site, &format!("/tokens/{id}"), &secret)
            .await
            .problem(404, "not-found", &[]);
    }
    let renewed = post(&site, &format!("{own}/rotate"), &secret, &json!({})).await;
    let renewed = renewed.json(200);
    assert_eq!(renewed["expires_at"], brief["expires_at"]);
    assert_eq!(renewed["made_by"], json!(ada.id));
    let secret = string(&renewed["secret"]);
    delete(&site, &own, &secret).await.json(200);
    assert_revoked(&site, &secret).await;
    get(&site, "/whoami", &alpha.token).await;
}

#[tokio::test]
async fn return_link_replaces_older_one_and_expires_in_24_h() {
    let site = Site::start().await;
    let ada = organiser(&site, "Ada").await;
    let link = json!({ "role": "return", "person": ada.id, "note": "Ada" });
    let first = post(&site, "/invitations", ADMIN, &link).await.json(201);
    let day = SignedDuration::from_hours(24);
    assert_eq!(first["expires_at"], (site.now() + day).to_string());
    let second = invite(&site, ADMIN, &link).await;
    assert_invitation_revoked(&site, &string(&first["code"])).await;
    let later = site.now() + day + SignedDuration::from_secs(1);
    let long = json!({ "role": "return", "person": ada.id, "note": "Ada", "expires_at": later });
    post(&site, "/invitations", ADMIN, &long).await.problem(
        422,
        "invalid-content",
        &["expires_at", "24 hours"],
    );
    site.advance(24 * 3600);
    let request = json!({ "code": second });
    site.post("/api/v1/invitations/accept", None, &request)
        .await
        .problem(409, "invitation-spent", &["expired"]);
}

#[tokio::test]
async fn new_password_or_return_ends_credentials_user_made() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let of_team = json!({ "name": "ci", "team": alpha.id });
    let ci = new_token(&site, &ada.token, of_team.clone()).await;
    let path = format!("/api/v1/people/{}/password", ada.id);
    let set_password = async |old: &str| {
        let change = json!({ "old": old, "password": "a new long password" });
        site.send(Method::PUT, &path, Some(&ada.token), &change)
            .await
    };
    set_password("wrong")
        .await
        .problem(403, "forbidden", &["nothing was changed"]);
    get(&site, "/whoami", &string(&ci["secret"])).await;
    let changed = set_password(PASSWORD).await.json(200);
    assert_eq!(field(&changed["ended"]["tokens"], "name"), ["ci"]);
    assert_revoked(&site, &string(&ci["secret"])).await;
    get(&site, "/whoami", &ada.token).await;

    let second = new_token(&site, &ada.token, of_team).await;
    let link = json!({ "role": "return", "person": ada.id, "note": "Ada" });
    let code = invite(&site, ADMIN, &link).await;
    let request = json!({ "code": code, "password": "another long password" });
    let joined = site.post("/api/v1/invitations/accept", None, &request);
    let joined = joined.await.json(201);
    assert_eq!(
        field(&joined["ended"]["tokens"], "id"),
        [string(&second["id"])]
    );
    assert_revoked(&site, &string(&second["secret"])).await;
}

#[tokio::test]
async fn token_revoked_by_others_ends_credentials_it_made() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let of_team = |name: &str| json!({ "name": name, "team": alpha.id });
    // A stolen token makes another one, which makes a third.
    let stolen = new_token(&site, &ada.token, json!({ "name": "stolen" })).await;
    let stolen_secret = string(&stolen["secret"]);
    let next = new_token(&site, &stolen_secret, json!({ "name": "next" })).await;
    let last = new_token(&site, &string(&next["secret"]), of_team("last")).await;
    let own = new_token(&site, &ada.token, of_team("own")).await;
    let path = format!("/tokens/{}", string(&stolen["id"]));
    let revoked = delete(&site, &path, ADMIN).await.json(200);
    assert_eq!(revoked["name"], "stolen");
    assert_eq!(field(&revoked["ended"]["tokens"], "name"), ["next", "last"]);
    for token in [&stolen, &next, &last] {
        assert_revoked(&site, &string(&token["secret"])).await;
    }
    get(&site, "/whoami", &string(&own["secret"])).await;
    // Another choice is possible.
    let path = format!("/tokens/{}?made=keep", string(&own["id"]));
    let revoked = delete(&site, &path, ADMIN).await.json(200);
    assert_eq!(revoked.get("ended"), None, "{revoked:#}");
    let refused = delete(&site, &path.replace("keep", "all"), ADMIN).await;
    refused.problem(400, "invalid-request", &["made"]);
    // A user who ends an own token or session keeps what was made with it.
    let laptop = new_token(&site, &ada.token, json!({ "name": "laptop" })).await;
    let robot = new_token(&site, &string(&laptop["secret"]), of_team("robot")).await;
    let path = format!("/tokens/{}", string(&laptop["id"]));
    let revoked = delete(&site, &path, &ada.token).await.json(200);
    assert_eq!(revoked.get("ended"), None, "{revoked:#}");
    get(&site, "/whoami", &string(&robot["secret"])).await;
}

#[tokio::test]
async fn revoked_token_ends_credentials_made_through_others() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let make = async |token: &str, name: &str| {
        let made = new_token(&site, token, json!({ "name": name })).await;
        (string(&made["id"]), string(&made["secret"]))
    };
    let (stolen_id, stolen) = make(&ada.token, "stolen").await;
    // Deleting or rotating a token does not detach it from the token that made it.
    let (middle_id, middle) = make(&stolen, "middle").await;
    let (_, last) = make(&middle, "last").await;
    delete(&site, &format!("/tokens/{middle_id}"), &middle)
        .await
        .json(200);
    let (rotated_id, rotated) = make(&stolen, "rotated").await;
    let rotate = format!("/tokens/{rotated_id}/rotate");
    let rotated = post(&site, &rotate, &rotated, &json!({})).await.json(200);
    let own = json!({ "role": "member", "note": "Eve" });
    let eve = join(&site, &invite(&site, &stolen, &own).await, "Eve").await;
    let puppet = join(&site, &invite(&site, &eve.token, &own).await, "Puppet").await;
    remove(&site, ADMIN, &eve, "Eve").await;

    let path = format!("/tokens/{stolen_id}");
    let revoked = delete(&site, &path, ADMIN).await.json(200);
    let ended = &revoked["ended"];
    assert_eq!(field(&ended["tokens"], "name"), ["rotated", "last"]);
    assert_eq!(field(&ended["remaining_people"], "name"), ["Puppet"]);
    assert_revoked(&site, &last).await;
    assert_revoked(&site, &string(&rotated["secret"])).await;
    get(&site, "/whoami", &puppet.token).await;
}

#[tokio::test]
async fn restored_users_are_listed() {
    let site = Site::start().await;
    let alice = organiser(&site, "Alice").await;
    let mallory = organiser(&site, "Mallory").await;
    let link = |user: &User| json!({ "role": "return", "person": user.id, "note": "a link" });
    let code = invite(&site, &mallory.token, &link(&alice)).await;
    let request = json!({ "code": code, "password": PASSWORD });
    site.post("/api/v1/invitations/accept", None, &request)
        .await
        .json(201);
    // A link for oneself works.
    let code = invite(&site, &mallory.token, &link(&mallory)).await;
    let request = json!({ "code": code, "password": PASSWORD });
    let restored = site
        .post("/api/v1/invitations/accept", None, &request)
        .await;
    let restored = restored.json(201);
    get(&site, "/whoami", &string(&restored["secret"])).await;
    let removed = remove(&site, ADMIN, &mallory, "Mallory").await;
    let ended = &removed["ended"];
    assert_eq!(
        field(&ended["restored_people"], "name"),
        ["Alice"],
        "{ended:#}"
    );
    assert_eq!(ended["remaining_people"], json!([]));
}

#[tokio::test]
async fn approved_registration_ends_with_its_organiser() {
    let site = Site::start().await;
    let grace = organiser(&site, "Grace").await;
    site.patch(
        "/api/v1/season",
        Some(ADMIN),
        &json!({ "takes_registrations": true }),
    )
    .await
    .json(200);
    let request = json!({ "team": { "name": "Own" }, "contact": "grace@example.org" });
    let registered = site.post("/api/v1/registrations", None, &request).await;
    let registered = registered.json(201);
    let approve = format!("/registrations/{}/approve", string(&registered["id"]));
    post(&site, &approve, &grace.token, &json!({}))
        .await
        .json(200);
    let removed = remove(&site, ADMIN, &grace, "Grace").await;
    let notes = field(&removed["ended"]["invitations"], "note");
    assert_eq!(notes, ["grace@example.org"]);
    assert_invitation_revoked(&site, &string(&registered["code"])).await;
}

#[tokio::test]
async fn removal_page_lists_revoked_credentials() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let of_team = json!({ "name": "robot", "team": alpha.id });
    new_token(&site, &ada.token, of_team).await;
    let role = json!({ "role": "organiser", "note": "Grace" });
    let mut browser = Browser::join(&site, "Grace", role).await;
    let path = format!("/organiser/access/people/{}/remove", ada.id);
    let page = browser.submit(&path, &[("confirm", "Ada")]).await;
    for words in [
        "What this change also revoked",
        "revoked: token robot",
        "User removed",
    ] {
        assert!(
            page.body.contains(words),
            "{words:?} is not in {}",
            page.body
        );
    }
}
