//! Tests of access control: every route of the API with every role of callers.

use crate::{
    site::{ADMIN, Answer, GZIP, Site, TestTeam, string},
    tournament::fake_worker::{self, GameOutcome},
};
use reqwest::Method;
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// The roles, in the order of the table's columns. The last role is the operator of the server, whose token belongs to no user.
const ROLES: [&str; 7] = [
    "visitor",
    "another team's token",
    "another team's member",
    "the team's token",
    "the team's member",
    "an organiser",
    "the operator",
];

/// For each route, the result of a request by each role: `+` allowed (done, or refused for its content), `?` a token is
/// required, `-` forbidden, `0` not found.
///
/// The ids in paths are those of the team Alpha, its member, its submission, its evaluation, and so on.
const ACCESS_TABLE: &[(&str, &str)] = &[
    ("GET /announcements", "+++++++"),
    ("POST /announcements", "?----++"),
    ("GET /board", "+++++++"),
    ("GET /board/history", "+++++++"),
    ("GET /board/{task}", "+++++++"),
    ("POST /clock/accept", "?----++"),
    ("POST /days", "?----++"),
    ("GET /evaluations", "?++++++"),
    ("GET /evaluations/{id}", "?00++++"),
    ("POST /evaluations/{id}/cancel", "?----++"),
    ("GET /evaluations/{id}/compare/{other}", "+++++++"),
    ("GET /evaluations/{id}/dataset", "?00++++"),
    ("POST /evaluations/{id}/dataset/link", "?00++++"),
    ("POST /evaluations/{id}/rerun", "?----++"),
    ("GET /evaluations/{id}/episodes", "+++++++"),
    (
        "GET /evaluations/{id}/episodes/{task}/{episode}/motion",
        "+++++++",
    ),
    (
        "GET /evaluations/{id}/episodes/{task}/{episode}/observed",
        "+++++++",
    ),
    ("GET /evaluations/{id}/violations", "?00++++"),
    ("POST /evaluations/{id}/void", "?----++"),
    ("GET /events", "?----++"),
    ("GET /events/stream", "+++++++"),
    ("GET /health", "+++++++"),
    ("GET /health/live", "+++++++"),
    ("GET /invitations", "?++++++"),
    ("POST /invitations", "?-+-+++"),
    ("POST /invitations/accept", "+++++++"),
    ("DELETE /invitations/{id}", "?000+++"),
    ("GET /me", "?++++--"),
    ("GET /people", "?++++++"),
    ("PATCH /people/{id}", "?00-+++"),
    ("PUT /people/{id}/password", "?00-+--"),
    ("POST /people/{id}/remove", "?00-+++"),
    ("GET /questions", "+++++++"),
    ("POST /questions", "?++++--"),
    ("PUT /questions/{id}/answer", "?----++"),
    ("POST /queue/pause", "?----++"),
    ("POST /queue/resume", "?----++"),
    ("GET /registrations", "?----++"),
    ("POST /registrations", "+++++++"),
    ("POST /registrations/{id}/approve", "?----++"),
    ("POST /registrations/{id}/refuse", "?----++"),
    ("GET /runtimes", "+++++++"),
    ("GET /season", "+++++++"),
    ("PATCH /season", "?----++"),
    ("GET /season/archive", "?----++"),
    ("POST /season/close", "?----++"),
    ("POST /sessions", "+++++++"),
    ("DELETE /sessions/current", "?++++++"),
    ("GET /stages", "+++++++"),
    ("POST /stages", "?----++"),
    ("GET /stages/{id}", "+++++++"),
    ("PATCH /stages/{id}", "?----++"),
    ("POST /stages/{id}/days/{day}/void", "?----++"),
    ("GET /submissions", "?++++--"),
    ("POST /submissions", "?++++--"),
    ("GET /submissions/{id}", "?00++++"),
    ("PATCH /submissions/{id}", "?00++--"),
    ("GET /submissions/{id}/ablation", "?00++++"),
    ("POST /submissions/{id}/ablation", "?----++"),
    (
        "GET /submissions/{id}/ablation/{profile}/{task}/{episode}/motion",
        "+++++++",
    ),
    (
        "GET /submissions/{id}/ablation/{profile}/{task}/{episode}/observed",
        "?--++++",
    ),
    ("POST /submissions/{id}/activate", "?00++--"),
    ("POST /submissions/{id}/evaluations", "+++++++"),
    ("POST /submissions/{id}/withdraw", "?00++--"),
    ("GET /submissions/{id}/archive", "?00++++"),
    ("POST /submissions/{id}/archive/link", "?00++++"),
    ("GET /submissions/{id}/bundle", "?00++++"),
    ("POST /submissions/{id}/bundle/link", "?00++++"),
    ("DELETE /submissions/{id}", "?00++++"),
    ("GET /storage", "?----++"),
    ("GET /workers", "?----++"),
    ("POST /workers/{name}/ban", "?----++"),
    ("POST /workers/{name}/readmit", "?----++"),
    ("GET /teams/{id}/storage", "?00++++"),
    ("GET /teams", "?----++"),
    ("POST /teams", "?----++"),
    ("GET /teams/{id}", "+++++++"),
    ("PATCH /teams/{id}", "?00-+++"),
    ("POST /teams/{id}/disqualify", "?----++"),
    ("POST /teams/{id}/reinstate", "?----++"),
    ("POST /teams/{id}/retire", "?00-+++"),
    ("POST /teams/{id}/return", "?00-+++"),
    ("POST /teams/{id}/token", "?----++"),
    ("GET /terms", "+++++++"),
    ("DELETE /uploads/{blake3}", "?++++--"),
    ("GET /uploads/{blake3}", "?++++--"),
    ("PATCH /uploads/{blake3}", "?++++--"),
    ("POST /terms", "?----++"),
    ("POST /terms/{version}/accept", "?-+-++-"),
    ("GET /tokens", "?++++++"),
    ("POST /tokens", "?-+-+++"),
    ("DELETE /tokens/{id}", "?00++++"),
    ("POST /tokens/{id}/rotate", "?00++++"),
    ("POST /evaluations/{id}/publish", "?00++--"),
    ("GET /proposals", "?----++"),
    ("GET /proposals/{id}", "?----++"),
    ("POST /proposals/{id}/apply", "?----++"),
    ("POST /proposals/{id}/drop", "?----++"),
    ("GET /stages/{id}/capacity", "?----++"),
    ("POST /stages/{id}/days", "?----++"),
    ("POST /stages/{id}/days/{day}/extra-evaluation", "?----++"),
    ("POST /stages/{id}/days/{day}/extra-turn", "?----++"),
    ("POST /stages/{id}/final", "?----++"),
    ("POST /stages/{id}/finalise", "?----++"),
    ("POST /stages/{id}/freeze", "?----++"),
    ("POST /stages/{id}/proposals", "?----++"),
    ("POST /stages/{id}/trial", "?----++"),
    ("POST /stages/{id}/unfreeze", "?----++"),
    ("GET /webhooks", "?++++++"),
    ("POST /webhooks", "?-+-+++"),
    ("DELETE /webhooks/{id}", "?00-+++"),
    ("GET /webhooks/{id}", "?00++++"),
    ("PATCH /webhooks/{id}", "?00-+++"),
    ("GET /webhooks/{id}/deliveries", "?00++++"),
    ("POST /webhooks/{id}/rotate", "?00-+--"),
    ("POST /webhooks/{id}/test", "?00-+++"),
    ("GET /whoami", "?++++++"),
    // The game of these routes is a test game of the team against the organisers' baseline.
    ("DELETE /games/{id}", "?00++++"),
    ("DELETE /tournaments/{id}/replays", "?----++"),
    ("GET /games/{id}", "000++++"),
    ("GET /games/{id}/attempts", "?----++"),
    ("GET /games/{id}/live", "000++++"),
    ("GET /games/{id}/motion/{chunk}", "000++++"),
    ("GET /games/{id}/recording", "000--++"),
    ("POST /games/{id}/recording/link", "?00--++"),
    ("GET /games/{id}/sides/{side}", "000++++"),
    ("POST /games/{id}/sides/{side}/link", "?00++++"),
    ("GET /games/{id}/sides/{side}/log", "?00++++"),
    ("GET /games/{id}/sides/{side}/observed/{chunk}", "000++++"),
    ("GET /tournaments", "+++++++"),
    ("GET /tournaments/{id}", "+++++++"),
    ("GET /tournaments/{id}/certainty", "+++++++"),
    ("GET /tournaments/{id}/free-games", "?++++++"),
    ("GET /tournaments/{id}/games", "+++++++"),
    ("GET /tournaments/{id}/head-to-head", "+++++++"),
    ("GET /tournaments/{id}/ratings", "+++++++"),
    ("GET /tournaments/{id}/uncounted-games", "?++++++"),
    ("PATCH /tournaments/{id}", "?----++"),
    ("POST /games/{id}/rerun", "?----++"),
    ("POST /games/{id}/void", "?----++"),
    ("POST /tournaments", "?----++"),
    ("POST /tournaments/{id}/close", "?----++"),
    ("POST /tournaments/{id}/departures", "?----++"),
    ("POST /tournaments/{id}/entrants", "?----++"),
    ("POST /tournaments/{id}/friendly-games", "?++++--"),
    ("POST /tournaments/{id}/pause", "?----++"),
    ("POST /tournaments/{id}/replays", "?----++"),
    ("POST /tournaments/{id}/resume", "?----++"),
    ("POST /tournaments/{id}/rounds", "?----++"),
    ("POST /tournaments/{id}/test-games", "?++++++"),
    ("POST /tournaments/{id}/withdrawal", "?-+-+--"),
];

/// A body that can be parsed, but changes nothing that affects the requests of the next role.
fn harmless_body(route: &str) -> Value {
    match route {
        "POST /announcements" => json!({ "title": "", "text": "" }),
        "POST /days" => json!({ "stage": "00000000-0000-7000-8000-000000000000" }),
        "POST /evaluations/{id}/cancel" | "POST /registrations/{id}/refuse" => {
            json!({ "reason": "" })
        }
        "POST /evaluations/{id}/void"
        | "POST /stages/{id}/days/{day}/void"
        | "POST /teams/{id}/disqualify"
        | "POST /teams/{id}/reinstate"
        | "POST /queue/pause"
        | "POST /workers/{name}/ban"
        | "POST /stages/{id}/freeze"
        | "POST /stages/{id}/trial"
        | "POST /stages/{id}/proposals" => json!({ "reason": "" }),
        "POST /stages/{id}/days" => json!({ "day": "2020-01-01", "reason": "" }),
        "POST /stages/{id}/days/{day}/extra-evaluation"
        | "POST /stages/{id}/days/{day}/extra-turn" => {
            json!({ "team": "00000000-0000-7000-8000-000000000000", "reason": "" })
        }
        "POST /invitations" => json!({ "role": "member", "note": "" }),
        "POST /invitations/accept" => json!({ "code": "" }),
        "PUT /people/{id}/password" => json!({ "old": "", "password": "" }),
        "POST /questions" | "POST /terms" => json!({ "text": "" }),
        "PUT /questions/{id}/answer" => json!({ "text": "", "public": false }),
        "POST /registrations" => json!({ "team": { "name": "A" }, "contact": "" }),
        "POST /season/close" => json!({ "confirm": "" }),
        "POST /sessions" => json!({ "name": "", "password": "" }),
        "POST /stages" => json!({ "name": "" }),
        "POST /submissions/{id}/ablation" => json!({ "episodes_per_task": 0 }),
        "PATCH /people/{id}" => json!({ "name": "Another Name" }),
        "PATCH /submissions/{id}" => json!({ "label": "" }),
        "POST /teams" | "POST /tokens" | "POST /tournaments" => json!({ "name": "" }),
        "POST /webhooks" => json!({ "name": "", "url": "" }),
        "POST /games/{id}/void"
        | "POST /tournaments/{id}/pause"
        | "POST /tournaments/{id}/withdrawal" => {
            json!({ "reason": "" })
        }
        "POST /tournaments/{id}/departures" => {
            json!({ "team": "Alpha", "as": "withdrawn", "reason": "" })
        }
        "POST /tournaments/{id}/entrants" => json!({ "teams": [] }),
        "POST /tournaments/{id}/friendly-games" => json!({ "opponent": "Unknown" }),
        "POST /tournaments/{id}/replays" => json!({ "times": 0 }),
        _ => json!({}),
    }
}

/// Plays a test game of the team against the organisers' baseline. Returns the ids of tournament and game.
async fn played_test_game(site: &Site, team: &TestTeam) -> [String; 2] {
    let baseline_team = site.team("Organisers").await;
    let baseline = site.valid_submission(&baseline_team, "baseline").await;
    let cup = json!({ "name": "Cup", "teams": ["Alpha"] });
    let opened = site.post("/api/v1/tournaments", Some(ADMIN), &cup).await;
    let path = opened.header("location").to_owned();
    let baseline = json!({ "baseline": baseline.rsplit('/').next().unwrap() });
    site.patch(&path, Some(ADMIN), &baseline).await.json(200);
    let created = site
        .post(&format!("{path}/test-games"), Some(&team.token), &json!({}))
        .await
        .json(201);
    let played = fake_worker::play_next(site, |_, _| GameOutcome::goals(1, 0)).await;
    assert!(played.is_some());
    let id = path.rsplit('/').next().unwrap().to_owned();
    [id, string(&created["queued"][0]["id"])]
}

/// A site with a caller of each role, and the resources that the routes need.
struct RoleFixture {
    site: Site,
    /// In the order of [`ROLES`].
    tokens: Vec<Option<String>>,
    /// The values of `{id}` in paths, by the first part of the path.
    ids: BTreeMap<&'static str, String>,
}

impl RoleFixture {
    async fn create() -> Self {
        let site = Site::start().await;
        let (alpha, beta) = (site.team("Alpha").await, site.team("Beta").await);
        // Tokens by the name of their user, and two ids by the name of their resource.
        let mut values = Vec::new();
        for (name, role) in [
            (
                "Ada",
                json!({ "role": "member", "team": alpha.id, "note": "Ada" }),
            ),
            (
                "Bob",
                json!({ "role": "member", "team": beta.id, "note": "Bob" }),
            ),
            ("Grace", json!({ "role": "organiser", "note": "Grace" })),
            (
                "not joined",
                json!({ "role": "member", "team": alpha.id, "note": "Carl" }),
            ),
        ] {
            let invitation = site
                .post("/api/v1/invitations", Some(ADMIN), &role)
                .await
                .json(201);
            if name == "not joined" {
                values.push(("invitations", string(&invitation["id"])));
                continue;
            }
            let join = json!({ "code": invitation["code"], "name": name });
            let joined = site
                .post("/api/v1/invitations/accept", None, &join)
                .await
                .json(201);
            values.push((name, string(&joined["secret"])));
            if name == "Ada" {
                values.push(("people", string(&joined["person"]["id"])));
            }
        }
        let value_of = |key: &str| {
            let found = values.iter().find(|(name, _)| *name == key);
            found.unwrap().1.clone()
        };
        let submission = site.valid_submission(&alpha, "a").await;
        let evaluation = site.start_evaluation(&alpha, &submission).await;
        site.finish_evaluation(&crate::site::result([0.5; 3], 10.0))
            .await;
        let game = played_test_game(&site, &alpha).await;
        let question = site
            .post(
                "/api/v1/questions",
                Some(&alpha.token),
                &json!({ "text": "?" }),
            )
            .await
            .json(201);
        let tokens = site.get("/api/v1/tokens", Some(ADMIN)).await.json(200);
        let alpha_token = tokens
            .as_array()
            .unwrap()
            .iter()
            .find(|token| token["team"] == json!(alpha.id));
        let webhook = json!({ "name": "test hook", "url": "https://example.org/faceoff" });
        let webhook = site
            .post("/api/v1/webhooks", Some(&value_of("Ada")), &webhook)
            .await
            .json(201);
        let id_in = |path: &str| path.rsplit('/').next().unwrap().to_owned();
        let ids = BTreeMap::from([
            ("evaluations", id_in(&evaluation)),
            ("submissions", id_in(&submission)),
            ("teams", alpha.id.clone()),
            ("stages", site.stage().await.to_string()),
            ("questions", string(&question["id"])),
            ("tokens", string(&alpha_token.unwrap()["id"])),
            ("people", value_of("people")),
            ("invitations", value_of("invitations")),
            (
                "registrations",
                "00000000-0000-7000-8000-000000000000".into(),
            ),
            ("proposals", "00000000-0000-7000-8000-000000000000".into()),
            ("webhooks", string(&webhook["id"])),
            ("tournaments", game[0].clone()),
            ("games", game[1].clone()),
        ]);
        let tokens = vec![
            None,
            Some(beta.token),
            Some(value_of("Bob")),
            Some(alpha.token),
            Some(value_of("Ada")),
            Some(value_of("Grace")),
            Some(ADMIN.to_owned()),
        ];
        Self { site, tokens, ids }
    }

    /// The same roles and resources on a copy of the site, which must be closed. That is quicker than to create them.
    async fn copy(&self) -> Self {
        Self {
            site: self.site.copy().await,
            tokens: self.tokens.clone(),
            ids: self.ids.clone(),
        }
    }

    /// The path of a route with all its parameters filled in.
    fn path(&self, route: &str) -> String {
        let (_, path) = route.split_once(' ').unwrap();
        let resource = path.split('/').nth(1).unwrap();
        let no_id = String::new();
        let id = self.ids.get(resource).unwrap_or(&no_id);
        let path = path
            .replace("{id}", id)
            .replace("{other}", id)
            .replace("{task}", "hit")
            .replace("{day}", "2020-01-01")
            .replace("{side}", "1")
            .replace("{name}", "unknown")
            .replace("{episode}", "0")
            .replace("{profile}", "ideal")
            .replace("{chunk}", "0")
            .replace("{blake3}", "unknown")
            .replace("{version}", "7");
        format!("/api/v1{path}")
    }

    /// Sends a request as the role with this index in [`ROLES`].
    async fn send(&self, route: &str, role: usize) -> Answer {
        let (method, _) = route.split_once(' ').unwrap();
        let method: Method = method.parse().unwrap();
        let token = self.tokens[role].as_deref();
        let mut request = self.site.request(method.clone(), &self.path(route), token);
        request = match route {
            "POST /submissions" => request
                .header("content-type", "text/plain")
                .body(GZIP.to_vec()),
            _ if method == Method::GET => request,
            _ => request.json(&harmless_body(route)),
        };
        let response = request.send().await.unwrap();
        if route == "GET /events/stream" {
            // The stream has no end, so the body is not read.
            let (status, headers) = (response.status(), response.headers().clone());
            let body = String::new();
            return Answer {
                status,
                headers,
                body,
            };
        }
        Answer::read(response).await
    }
}

/// The answer as a character of [`ACCESS_TABLE`].
fn access(route: &str, answer: &Answer) -> char {
    let problem: Value = serde_json::from_str(&answer.body).unwrap_or_default();
    match (answer.status.as_u16(), problem["type"].as_str()) {
        (401, Some("/problems#unauthenticated")) => '?',
        (403, Some("/problems#forbidden")) => '-',
        (404, Some("/problems#not-found")) => '0',
        // The dataset of this test cannot be read: a caller that gets this error has access.
        (500, _) if route.ends_with("/violations") => '+',
        (500.., _) => panic!("{route}: {answer:?}"),
        _ => '+',
    }
}

#[tokio::test]
async fn access_to_routes_follows_the_table() {
    let site = Site::start().await;
    let document = site.get("/api/v1/openapi.json", None).await.json(200);
    let mut routes: Vec<String> = Vec::new();
    for (path, item) in document["paths"].as_object().unwrap() {
        for method in item.as_object().unwrap().keys() {
            let path = path.strip_prefix("/api/v1").unwrap();
            routes.push(format!("{} {path}", method.to_uppercase()));
        }
    }
    routes.sort();
    let mut listed: Vec<&str> = ACCESS_TABLE.iter().map(|(route, _)| *route).collect();
    listed.sort_unstable();
    assert_eq!(routes, listed, "the table has a row for every route");

    let mut wrong = Vec::new();
    let mut template = RoleFixture::create().await;
    template.site.close().await;
    // Reading routes change nothing, so they share one fixture.
    let mut shared_fixture: Option<RoleFixture> = None;
    for (route, expected) in ACCESS_TABLE {
        // After signing out, rotating or revoking, the next role needs a new fixture.
        let is_destructive = ["DELETE", "rotate", "/token", "accept", "withdraw", "retire"]
            .iter()
            .any(|word| route.contains(word));
        let only_reads = route.starts_with("GET ");
        let mut fixture = match shared_fixture.take() {
            Some(fixture) if only_reads => fixture,
            unused => {
                shared_fixture = unused;
                template.copy().await
            }
        };
        for (role, expected) in expected.chars().enumerate() {
            if is_destructive && role > 0 {
                fixture = template.copy().await;
            }
            let answer = fixture.send(route, role).await;
            let mut access = access(route, &answer);
            // The fixture has none of these resources; a caller with access gets 404.
            if access == '0' && expected == '+' && answer.body.contains("no such") {
                let missing_resources = [
                    "registrations",
                    "proposals/",
                    "POST /days",
                    "days/{day}/void",
                    "/ablation",
                ];
                if missing_resources.iter().any(|part| route.contains(part)) {
                    access = '+';
                }
            }
            // Sign-in is allowed for all, and answers 401 to a wrong password.
            if access == '?' && *route == "POST /sessions" {
                access = '+';
            }
            if access != expected {
                wrong.push(format!(
                    "{route} for {}: expected {expected}, got {access}: {} {}",
                    ROLES[role], answer.status, answer.body
                ));
            }
        }
        if only_reads {
            shared_fixture = Some(fixture);
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
