//! Tests of users in the API: invitations, sessions, removal, tokens, terms, registrations, questions and announcements.

use crate::{
    browser::{Browser, PASSWORD},
    site::{ADMIN, Answer, Site, string},
};
use reqwest::Method;
use serde_json::{Value, json};

async fn send(
    site: &Site,
    method: Method,
    path: &str,
    token: Option<&str>,
    body: &Value,
) -> Answer {
    let path = format!("/api/v1{path}");
    site.send(method, &path, token, body).await
}

pub async fn post(site: &Site, path: &str, token: &str, body: &Value) -> Answer {
    send(site, Method::POST, path, Some(token), body).await
}

pub async fn get(site: &Site, path: &str, token: &str) -> Value {
    let answer = send(site, Method::GET, path, Some(token), &Value::Null).await;
    answer.json(200)
}

/// The code of a new invitation.
pub async fn invite(site: &Site, token: &str, body: &Value) -> String {
    string(&post(site, "/invitations", token, body).await.json(201)["code"])
}

/// A user with a token of theirs.
pub struct User {
    pub id: String,
    pub token: String,
}

/// Accepts the invitation with this code.
pub async fn join(site: &Site, code: &str, name: &str) -> User {
    let body = json!({ "code": code, "name": name, "password": PASSWORD });
    let joined = send(site, Method::POST, "/invitations/accept", None, &body).await;
    let joined = joined.json(201);
    User {
        id: string(&joined["person"]["id"]),
        token: string(&joined["secret"]),
    }
}

/// Adds a member to a team.
pub async fn member(site: &Site, team: &str, name: &str) -> User {
    let invitation = json!({ "role": "member", "team": team, "note": name });
    join(site, &invite(site, ADMIN, &invitation).await, name).await
}

pub async fn organiser(site: &Site, name: &str) -> User {
    let invitation = json!({ "role": "organiser", "note": name });
    join(site, &invite(site, ADMIN, &invitation).await, name).await
}

#[tokio::test]
async fn member_acts_for_the_team_under_own_name() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    assert!(ada.token.starts_with("fo_person_"));
    let caller = get(&site, "/whoami", &ada.token).await;
    assert_eq!(
        (&caller["role"], &caller["team"]["name"]),
        (&json!("member"), &json!("Alpha"))
    );
    assert_eq!(get(&site, "/me", &ada.token).await["team"]["name"], "Alpha");
    site.upload(&ada.token, crate::site::GZIP.to_vec())
        .await
        .json(201);
    let log = get(&site, "/events?kind=submission_uploaded", ADMIN).await;
    assert_eq!(log["events"][0]["actor"], format!("person:{}", ada.id));
    assert_eq!(log["events"][0]["actor_name"], "Ada");
    // Members can invite others, but only into their own team.
    let beta = site.team("Beta").await;
    let invitation = json!({ "role": "member", "note": "Bob" });
    let code = invite(&site, &ada.token, &invitation).await;
    let bob = join(&site, &code, "Bob").await;
    let people = get(&site, "/people", &bob.token).await;
    let names: Vec<_> = people
        .as_array()
        .unwrap()
        .iter()
        .map(|user| &user["name"])
        .collect();
    assert_eq!(names, ["Ada", "Bob"]);
    for (body, status, slug) in [
        (
            json!({ "role": "member", "team": beta.id, "note": "x" }),
            404,
            "not-found",
        ),
        (
            json!({ "role": "organiser", "note": "x" }),
            403,
            "forbidden",
        ),
        (json!({ "role": "founder", "note": "x" }), 403, "forbidden"),
        (
            json!({ "role": "return", "person": bob.id, "note": "x" }),
            403,
            "forbidden",
        ),
        (
            json!({ "role": "founder", "team": beta.id, "note": "x" }),
            422,
            "invalid-content",
        ),
        (
            json!({ "role": "member", "note": "" }),
            422,
            "invalid-content",
        ),
        (
            json!({ "role": "owner", "note": "x" }),
            422,
            "invalid-content",
        ),
    ] {
        post(&site, "/invitations", &ada.token, &body)
            .await
            .problem(status, slug, &[]);
    }
    let by_team_token = post(&site, "/invitations", &alpha.token, &invitation).await;
    by_team_token.problem(403, "forbidden", &["cannot invite"]);
}

#[tokio::test]
async fn organiser_acts_under_own_name_and_can_be_removed() {
    let site = Site::start().await;
    let grace = organiser(&site, "Grace").await;
    let linus = organiser(&site, "Linus").await;
    let create = json!({ "name": "Alpha" });
    post(&site, "/teams", &grace.token, &create).await.json(201);
    let log = get(&site, "/events?kind=team_created", &linus.token).await;
    assert_eq!(log["events"][0]["actor_name"], "Grace");
    let by_grace = format!("/events?actor=person:{}", grace.id);
    let log = get(&site, &by_grace, ADMIN).await;
    assert!(log["events"].as_array().unwrap().len() >= 2, "{log}");

    let remove = format!("/people/{}/remove", grace.id);
    post(&site, &remove, &linus.token, &json!({}))
        .await
        .problem(409, "not-confirmed", &["Grace", "at once and for good"]);
    get(&site, "/whoami", &grace.token).await;
    let confirmed = json!({ "confirm": "Grace" });
    post(&site, &remove, &linus.token, &confirmed)
        .await
        .json(200);
    post(&site, "/teams", &grace.token, &json!({ "name": "Beta" }))
        .await
        .problem(401, "unauthenticated", &["revoked"]);
}

#[tokio::test]
async fn tokens_are_created_rotated_and_revoked_at_once() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let beta = site.team("Beta").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let bob = member(&site, &beta.id, "Bob").await;
    let created = post(&site, "/tokens", &ada.token, &json!({ "name": "laptop" }))
        .await
        .json(201);
    let (id, old_secret) = (string(&created["id"]), string(&created["secret"]));
    get(&site, "/whoami", &old_secret).await;
    let token = format!("/tokens/{id}");
    for other in [&bob.token, &beta.token, &alpha.token] {
        let revoked = send(&site, Method::DELETE, &token, Some(other), &Value::Null).await;
        revoked.problem(404, "not-found", &[]);
    }
    let rotate = format!("{token}/rotate");
    post(&site, &rotate, ADMIN, &json!({}))
        .await
        .problem(403, "forbidden", &["only by that user"]);
    let rotated = post(&site, &rotate, &ada.token, &json!({})).await.json(200);
    let new_secret = string(&rotated["secret"]);
    assert_eq!(
        (&rotated["id"], &rotated["name"]),
        (&created["id"], &created["name"])
    );
    let refused = send(
        &site,
        Method::GET,
        "/whoami",
        Some(&old_secret),
        &Value::Null,
    )
    .await;
    refused.problem(401, "unauthenticated", &["unknown"]);
    get(&site, "/whoami", &new_secret).await;
    send(&site, Method::DELETE, &token, Some(ADMIN), &Value::Null)
        .await
        .json(200);
    let refused = send(
        &site,
        Method::GET,
        "/whoami",
        Some(&new_secret),
        &Value::Null,
    )
    .await;
    refused.problem(401, "unauthenticated", &["revoked"]);

    // A team token cannot create tokens. A member can create one for the team's API clients.
    post(&site, "/tokens", &alpha.token, &json!({ "name": "more" }))
        .await
        .problem(403, "forbidden", &["cannot create tokens"]);
    let soon = (site.now() + jiff::SignedDuration::from_secs(60)).to_string();
    let team_token = json!({ "name": "ci", "team": alpha.id, "expires_at": soon });
    let ci = post(&site, "/tokens", &ada.token, &team_token)
        .await
        .json(201);
    let ci_token = string(&ci["secret"]);
    assert!(ci_token.starts_with("fo_team_"));
    assert_eq!(get(&site, "/whoami", &ci_token).await["role"], "team");
    site.advance(60);
    let expired = send(&site, Method::GET, "/whoami", Some(&ci_token), &Value::Null).await;
    expired.problem(401, "unauthenticated", &["expired"]);
    post(&site, "/tokens", &bob.token, &team_token)
        .await
        .problem(404, "not-found", &[]);
    for (body, field) in [
        (json!({ "name": "" }), "name"),
        (json!({ "name": "a\u{202e}b" }), "name"),
        (json!({ "name": "x".repeat(81) }), "name"),
        (
            json!({ "name": "x", "expires_at": "tomorrow" }),
            "expires_at",
        ),
        (json!({ "name": "x", "scope": "all" }), "scope"),
    ] {
        post(&site, "/tokens", &ada.token, &body)
            .await
            .problem(422, "invalid-content", &[field]);
    }
    let past = json!({ "name": "x", "expires_at": "2020-01-01T00:00:00Z" });
    post(&site, "/tokens", &ada.token, &past)
        .await
        .problem(409, "conflict", &["in the future"]);

    // The last use is recorded (a moment later, so the test waits), and tokens of others are not listed.
    let mut last_use = Value::Null;
    while last_use.is_null() {
        let tokens = get(&site, "/tokens", &ada.token).await;
        let tokens = tokens.as_array().unwrap().clone();
        assert!(tokens.iter().all(|token| token["person"] != json!(bob.id)));
        let first_token = tokens
            .into_iter()
            .find(|token| token["name"] == "first" && token["person"] == json!(ada.id));
        last_use = first_token.unwrap()["last_used_at"].clone();
    }
    assert!(
        !get(&site, "/tokens", ADMIN)
            .await
            .to_string()
            .contains("fo_")
    );
}

#[tokio::test]
async fn operator_token_is_replaced_without_a_restart() {
    let site = Site::start().await;
    let created = post(&site, "/tokens", ADMIN, &json!({ "name": "second" }))
        .await
        .json(201);
    let second_token = string(&created["secret"]);
    assert!(second_token.starts_with("fo_admin_"));
    let tokens = get(&site, "/tokens", &second_token).await;
    let first_token = tokens
        .as_array()
        .unwrap()
        .iter()
        .find(|token| token["name"] == "admin-token");
    let path = format!("/tokens/{}", string(&first_token.unwrap()["id"]));
    let revoke = send(
        &site,
        Method::DELETE,
        &path,
        Some(&second_token),
        &Value::Null,
    );
    revoke.await.json(200);
    let refused = send(&site, Method::GET, "/whoami", Some(ADMIN), &Value::Null).await;
    refused.problem(401, "unauthenticated", &["revoked"]);
    assert_eq!(get(&site, "/whoami", &second_token).await["role"], "host");
}

#[tokio::test]
async fn session_works_from_pages_of_the_server_only() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let sign_in = async |name: &str, password: &str| {
        let body = json!({ "name": name, "password": password });
        send(&site, Method::POST, "/sessions", None, &body).await
    };
    for (name, password) in [("Ada", "wrong"), ("Unknown", PASSWORD)] {
        let wrong = sign_in(name, password).await;
        wrong.problem(401, "unauthenticated", &["wrong name or password"]);
    }
    let signed_in = sign_in("ADA", PASSWORD).await;
    signed_in.json(201);
    let cookie = signed_in.header("set-cookie").to_owned();
    for part in [
        "faceoff_session=fo_session_",
        "HttpOnly",
        "SameSite=Lax",
        "Path=/",
        "Max-Age=",
    ] {
        assert!(cookie.contains(part), "{part} is not in {cookie}");
    }
    let session = cookie.split(';').next().unwrap().to_owned();
    let with_cookie = async |method: Method, path: &str, origin: Option<&str>| {
        let path = format!("/api/v1{path}");
        let mut request = site.request(method, &path, None).header("cookie", &session);
        if let Some(origin) = origin {
            request = request.header("origin", origin);
        }
        Answer::read(request.send().await.unwrap()).await
    };
    assert_eq!(
        with_cookie(Method::GET, "/whoami", None).await.json(200)["role"],
        "member"
    );
    let return_path = format!("/teams/{}/return", alpha.id);
    for foreign in [None, Some("https://evil.example")] {
        let refused = with_cookie(Method::POST, &return_path, foreign).await;
        refused.problem(403, "forbidden", &["from a page of this server"]);
    }
    let own_origin = site.url.clone();
    let allowed = with_cookie(Method::POST, &return_path, Some(&own_origin)).await;
    allowed.problem(409, "conflict", &["has not retired"]);
    // A session is no bearer token, and a token no session cookie.
    let secret = session.split_once('=').unwrap().1;
    let bearer = send(&site, Method::GET, "/whoami", Some(secret), &Value::Null).await;
    bearer.problem(401, "unauthenticated", &["session cookie"]);
    let as_cookie = site
        .request(Method::GET, "/api/v1/whoami", None)
        .header("cookie", format!("faceoff_session={}", ada.token));
    let answer = Answer::read(as_cookie.send().await.unwrap()).await;
    answer.problem(401, "unauthenticated", &[]);
    let ended = with_cookie(Method::DELETE, "/sessions/current", Some(&own_origin)).await;
    assert_eq!(ended.status, 204);
    let after = with_cookie(Method::GET, "/whoami", None).await;
    after.problem(401, "unauthenticated", &[]);
}

#[tokio::test]
async fn session_cookie_is_bound_to_its_host_over_tls() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    member(&site, &alpha.id, "Ada").await;
    let site = site.with_public_url("https://faceoff.example.org").await;
    let body = json!({ "name": "Ada", "password": PASSWORD });
    let signed_in = send(&site, Method::POST, "/sessions", None, &body).await;
    let cookie = signed_in.header("set-cookie").to_owned();
    let (pair, attributes) = cookie.split_once(';').unwrap();
    let secret = pair.strip_prefix("__Host-faceoff_session=").unwrap();
    // Browsers require these attributes for the prefix.
    let assert_attributes = |attributes: &str| {
        assert!(attributes.contains("; Secure"), "{attributes}");
        assert!(attributes.contains(" Path=/;"), "{attributes}");
        assert!(!attributes.contains("Domain"), "{attributes}");
    };
    assert_attributes(attributes);
    let send_cookie = async |method: Method, path: &str, name: &str| {
        let request = site
            .request(method, &format!("/api/v1{path}"), None)
            .header("cookie", format!("{name}={secret}"))
            .header("origin", &site.url);
        Answer::read(request.send().await.unwrap()).await
    };
    let (name, plain_name) = ("__Host-faceoff_session", "faceoff_session");
    let whoami = send_cookie(Method::GET, "/whoami", name).await.json(200);
    assert_eq!(whoami["role"], "member");
    let refused = send_cookie(Method::GET, "/whoami", plain_name).await;
    refused.problem(401, "unauthenticated", &[]);
    let ended = send_cookie(Method::DELETE, "/sessions/current", name).await;
    let removed = ended.header("set-cookie");
    assert!(removed.starts_with("__Host-faceoff_session=;"), "{removed}");
    assert!(removed.contains("Max-Age=0"), "{removed}");
    assert_attributes(removed);
}

#[tokio::test]
async fn sign_in_over_plain_http_is_refused_with_https_url() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    member(&site, &alpha.id, "Ada").await;
    let site = site.with_public_url("https://faceoff.example.org").await;
    let sign_in = async |scheme: &str, host: &str| {
        let browser = Browser::new(&site);
        let request = browser
            .http
            .post(format!("{}/sign-in", site.url))
            .header("accept", "text/html")
            .header("host", host)
            .header("origin", format!("{scheme}://{host}"))
            .header("content-type", "application/x-www-form-urlencoded")
            .body(format!("name=Ada&password={}", PASSWORD.replace(' ', "+")));
        Answer::read(request.send().await.unwrap()).await
    };
    // The browser would not keep the cookie.
    let refused = sign_in("http", "192.0.2.1:8080").await;
    refused.html(403);
    assert!(
        refused
            .body
            .contains("open this page at https://faceoff.example.org/sign-in"),
        "{}",
        refused.body
    );
    assert!(!refused.headers.contains_key("set-cookie"));
    for (scheme, host) in [("https", "faceoff.example.org"), ("http", "127.0.0.1:8080")] {
        let signed_in = sign_in(scheme, host).await;
        assert!(
            signed_in.headers.contains_key("set-cookie"),
            "{signed_in:?}"
        );
    }
}

#[tokio::test]
async fn session_expires_and_ends_with_a_new_password() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let sign_in = async |password: &str| {
        let body = json!({ "name": "Ada", "password": password });
        let answer = send(&site, Method::POST, "/sessions", None, &body).await;
        answer.json(201);
        let cookie = answer.header("set-cookie").to_owned();
        cookie.split(';').next().unwrap().to_owned()
    };
    let whoami = async |session: &str| {
        let request = site
            .request(Method::GET, "/api/v1/whoami", None)
            .header("cookie", session);
        Answer::read(request.send().await.unwrap())
            .await
            .status
            .as_u16()
    };
    let first_session = sign_in(PASSWORD).await;
    assert_eq!(whoami(&first_session).await, 200);
    let path = format!("/people/{}/password", ada.id);
    let set_password =
        async |token: &str, body: Value| send(&site, Method::PUT, &path, Some(token), &body).await;
    let new = json!({ "old": PASSWORD, "password": "battery horse correct" });
    set_password(
        &ada.token,
        json!({ "old": "wrong", "password": "battery horse correct" }),
    )
    .await
    .problem(403, "forbidden", &["old"]);
    set_password(&ada.token, json!({ "old": PASSWORD, "password": "short" }))
        .await
        .problem(422, "invalid-content", &["password", "12"]);
    set_password(ADMIN, new.clone())
        .await
        .problem(403, "forbidden", &["only the user", "return"]);
    set_password(&ada.token, new).await.json(200);
    assert_eq!(
        whoami(&first_session).await,
        401,
        "earlier sessions have ended"
    );
    get(&site, "/whoami", &ada.token).await;
    let second = sign_in("battery horse correct").await;
    // A session lasts two weeks.
    site.advance(14 * 24 * 3600 - 1);
    assert_eq!(whoami(&second).await, 200);
    site.advance(1);
    assert_eq!(whoami(&second).await, 401);
}

#[tokio::test]
async fn registered_team_joins_after_its_approval() {
    let site = Site::start().await;
    let body =
        json!({ "team": { "name": "Alpha", "affiliation": "TU" }, "contact": "ada@example.org" });
    let register =
        async |body: &Value| send(&site, Method::POST, "/registrations", None, body).await;
    register(&body)
        .await
        .problem(409, "conflict", &["registration is closed"]);
    let open = json!({ "takes_registrations": true, "divisions": ["Open", "Students"] });
    let season = send(&site, Method::PATCH, "/season", Some(ADMIN), &open)
        .await
        .json(200);
    assert_eq!(
        (&season["takes_registrations"], &season["divisions"]),
        (&json!(true), &json!(["Open", "Students"]))
    );
    let terms = post(&site, "/terms", ADMIN, &json!({ "text": "Be fair." }))
        .await
        .json(201);
    assert_eq!(terms["version"], 1);
    register(&body)
        .await
        .problem(409, "conflict", &["accepted_terms", "version 1"]);
    for (field, value, words) in [
        ("name", json!("<b>"), "name"),
        ("link", json!("javascript:alert(1)"), "https://"),
        ("affiliation", json!("a\u{202e}b"), "affiliation"),
        ("division", json!("Pupils"), "Pupils"),
    ] {
        let mut wrong = body.clone();
        wrong["accepted_terms"] = json!(1);
        wrong["team"][field] = value;
        let refused = register(&wrong).await;
        assert!([409, 422].contains(&refused.status.as_u16()), "{refused:?}");
        assert!(refused.body.contains(words), "{refused:?}");
    }
    let mut with_terms = body.clone();
    with_terms["accepted_terms"] = json!(1);
    with_terms["team"]["division"] = json!("Students");
    let registered = register(&with_terms).await.json(201);
    let (id, code) = (string(&registered["id"]), string(&registered["code"]));
    assert_eq!(registered["join_link"], format!("/join/{code}"));
    let accept = json!({ "code": code, "name": "Ada", "accepted_terms": 1 });
    let before_approval = send(&site, Method::POST, "/invitations/accept", None, &accept).await;
    before_approval.problem(409, "invitation-spent", &["is pending"]);
    let listed = get(&site, "/registrations", ADMIN).await;
    assert_eq!(listed[0]["contact"], "ada@example.org");
    assert!(!listed.to_string().contains("fo_invite_"));
    let approve = format!("/registrations/{id}/approve");
    post(&site, &approve, ADMIN, &json!({})).await.json(200);
    let joined = send(&site, Method::POST, "/invitations/accept", None, &accept)
        .await
        .json(201);
    assert_eq!(joined["team"]["division"], "Students");
    post(&site, &approve, ADMIN, &json!({}))
        .await
        .problem(409, "conflict", &["was approved"]);
    let refuse = format!("/registrations/{id}/refuse");
    post(&site, &refuse, ADMIN, &json!({ "reason": "" }))
        .await
        .problem(422, "invalid-content", &["reason"]);
    post(&site, &refuse, ADMIN, &json!({ "reason": "no" }))
        .await
        .problem(409, "conflict", &[]);
}

#[tokio::test]
async fn team_is_renamed_and_retired_by_members_only() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    let path = format!("/teams/{}", alpha.id);
    let patch = async |token: &str, body: Value| {
        send(&site, Method::PATCH, &path, Some(token), &body).await
    };
    let change = json!({ "name": "Omega", "affiliation": "TU", "link": "https://example.org" });
    patch(&alpha.token, change.clone()).await.problem(
        403,
        "forbidden",
        &["cannot change the team"],
    );
    let changed = patch(&ada.token, change).await.json(200);
    assert_eq!(
        (&changed["name"], &changed["affiliation"]),
        (&json!("Omega"), &json!("TU"))
    );
    let changed = patch(&ada.token, json!({ "affiliation": null }))
        .await
        .json(200);
    assert_eq!(
        (&changed["affiliation"], &changed["link"]),
        (&Value::Null, &json!("https://example.org"))
    );
    patch(&ada.token, json!({ "division": "Open" }))
        .await
        .problem(403, "forbidden", &["division"]);
    patch(ADMIN, json!({ "division": "Open" }))
        .await
        .problem(409, "conflict", &["no divisions"]);
    for body in [
        json!({ "name": "" }),
        json!({ "link": "ftp://x" }),
        json!({ "owner": "me" }),
    ] {
        patch(&ada.token, body)
            .await
            .problem(422, "invalid-content", &[]);
    }
    // A team's view is public.
    let public = send(&site, Method::GET, &path, None, &Value::Null)
        .await
        .json(200);
    assert_eq!(public["name"], "Omega");
    let retire = format!("{path}/retire");
    post(&site, &retire, &ada.token, &json!({}))
        .await
        .problem(409, "not-confirmed", &["Omega"]);
    post(&site, &retire, &ada.token, &json!({ "confirm": "Alpha" }))
        .await
        .problem(409, "not-confirmed", &[]);
    post(&site, &retire, &ada.token, &json!({ "confirm": "Omega" }))
        .await
        .json(200);
    let upload = site.upload(&alpha.token, crate::site::GZIP.to_vec()).await;
    upload.problem(403, "retired", &["retired on"]);
    post(&site, &format!("{path}/return"), ADMIN, &json!({}))
        .await
        .json(200);
    site.upload(&alpha.token, crate::site::GZIP.to_vec())
        .await
        .json(201);
}

#[tokio::test]
async fn new_terms_are_accepted_by_a_member() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let ada = member(&site, &alpha.id, "Ada").await;
    post(&site, "/terms", &ada.token, &json!({ "text": "mine" }))
        .await
        .problem(403, "forbidden", &[]);
    post(&site, "/terms", ADMIN, &json!({ "text": " " }))
        .await
        .problem(422, "invalid-content", &["text"]);
    post(&site, "/terms", ADMIN, &json!({ "text": "Be fair." }))
        .await
        .json(201);
    let refused = site.upload(&alpha.token, crate::site::GZIP.to_vec()).await;
    let refused = refused.problem(403, "terms-owed", &["version 1", "/accept"]);
    assert_eq!(refused["version"], 1);
    post(&site, "/terms/1/accept", &alpha.token, &json!({}))
        .await
        .problem(403, "forbidden", &["user's token"]);
    post(&site, "/terms/2/accept", &ada.token, &json!({}))
        .await
        .problem(409, "conflict", &["expected 1"]);
    post(&site, "/terms/1/accept", &ada.token, &json!({}))
        .await
        .json(200);
    site.upload(&alpha.token, crate::site::GZIP.to_vec())
        .await
        .json(201);
    let public = send(&site, Method::GET, "/terms", None, &Value::Null)
        .await
        .json(200);
    assert_eq!(public[0]["text"], "Be fair.");
}

#[tokio::test]
async fn public_answers_are_anonymous() {
    let site = Site::start().await;
    let alpha = site.team("Alpha").await;
    let beta = site.team("Beta").await;
    let asked = post(
        &site,
        "/questions",
        &alpha.token,
        &json!({ "text": "May I?\nReally?" }),
    )
    .await
    .json(201);
    let visible_questions = async |token: Option<&str>| {
        let answer = send(&site, Method::GET, "/questions", token, &Value::Null).await;
        answer.json(200).as_array().unwrap().clone()
    };
    assert_eq!(visible_questions(Some(&alpha.token)).await.len(), 1);
    assert_eq!(visible_questions(Some(ADMIN)).await.len(), 1);
    assert_eq!(visible_questions(Some(&beta.token)).await.len(), 0);
    let path = format!("/questions/{}/answer", string(&asked["id"]));
    let answer =
        async |token: &str, body: Value| send(&site, Method::PUT, &path, Some(token), &body).await;
    answer(&alpha.token, json!({ "text": "Yes.", "public": true }))
        .await
        .problem(403, "forbidden", &[]);
    answer(ADMIN, json!({ "text": "Yes." }))
        .await
        .problem(422, "invalid-content", &["public"]);
    answer(ADMIN, json!({ "text": "Yes.", "public": false }))
        .await
        .json(200);
    assert_eq!(visible_questions(None).await.len(), 0);
    answer(ADMIN, json!({ "text": "Yes.", "public": true }))
        .await
        .json(200);
    let public = visible_questions(None).await;
    assert_eq!(public[0]["answer"], "Yes.");
    assert!(public[0].get("team").is_none(), "{public:?}");
    post(&site, "/questions", ADMIN, &json!({ "text": "?" }))
        .await
        .problem(403, "forbidden", &[]);

    post(
        &site,
        "/announcements",
        ADMIN,
        &json!({ "title": "Pause", "text": "On Sunday.\nAll day." }),
    )
    .await
    .json(201);
    post(
        &site,
        "/announcements",
        ADMIN,
        &json!({ "title": "two\nlines", "text": "x" }),
    )
    .await
    .problem(422, "invalid-content", &["title", "one line"]);
    let announcements = send(&site, Method::GET, "/announcements", None, &Value::Null)
        .await
        .json(200);
    assert_eq!(announcements[0]["title"], "Pause");
    let page = site.get("/announcements", None).await;
    for words in ["Pause", "On Sunday.", "Really?", "Yes."] {
        assert!(page.body.contains(words), "{words} is not on the page");
    }
}
