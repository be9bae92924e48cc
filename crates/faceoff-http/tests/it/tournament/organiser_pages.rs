//! Tests of the organisers' pages of tournaments: opening, running and closing one with forms alone.

use super::{
    cup::{TestTournament, first_by_name_wins, team_names},
    fake_worker,
};
use crate::{
    browser::{Browser, Form, forms},
    html::{links, rows, texts},
    site::{ADMIN, Site, string},
    team_dashboard::{dashboard_page, redirect_target},
};
use serde_json::{Value, json};

const PATH: &str = "/organiser/tournaments";

async fn organiser<'a>(site: &'a Site, name: &str) -> Browser<'a> {
    let role = json!({ "role": "organiser", "note": name });
    Browser::join(site, name, role).await
}

/// Opens the page at `path` and the first decision on it whose path contains `decision`, and submits its form with a reason. Returns
/// the stated effects and the target of the redirect.
async fn decide(grace: &mut Browser<'_>, path: &str, decision: &str) -> (String, String) {
    let page = dashboard_page(&grace.open(path).await, 200);
    let link = links(&page, "a[href*='/organiser/decide/']")
        .into_iter()
        .find(|link| link.contains(&format!("/{decision}/")));
    let link = link.unwrap_or_else(|| panic!("no {decision} on {path}"));
    let preview = grace.open(&link).await;
    let effects = texts(&dashboard_page(&preview, 200), "#effects").remove(0);
    let form = forms(&link, &preview).remove(0);
    let fields: Vec<(&str, &str)> = form
        .fields
        .iter()
        .map(|(name, value)| match name.as_str() {
            "reason" => ("reason", "the lamp fell"),
            name => (name, value.as_str()),
        })
        .collect();
    let target = redirect_target(&grace.submit(&form.action, &fields).await);
    (effects, target)
}

/// The form for a new tournament with these fields changed.
async fn new_tournament(
    grace: &mut Browser<'_>,
    changed: &[(&str, &str)],
) -> Vec<(String, String)> {
    let page = grace.open(PATH).await;
    let form = forms(PATH, &page).into_iter().find(|form| form.is_post);
    let mut fields = form.unwrap().fields;
    for (name, value) in changed {
        let field = fields.iter_mut().find(|(field, _)| field == name);
        field.unwrap_or_else(|| panic!("no field {name}")).1 = (*value).to_owned();
    }
    fields
}

fn borrowed(fields: &[(String, String)]) -> Vec<(&str, &str)> {
    fields
        .iter()
        .map(|(name, value)| (name.as_str(), value.as_str()))
        .collect()
}

#[tokio::test]
async fn tournament_is_run_with_forms_alone() {
    let site = Site::start().await;
    for name in ["A", "B", "C"] {
        let team = site.team(name).await;
        site.valid_submission(&team, "agent").await;
    }
    let mut grace = organiser(&site, "Grace").await;
    let changed = [("name", "Cup"), ("teams", "A\r\n B \r\n"), ("rounds", "1")];
    let fields = new_tournament(&mut grace, &changed).await;
    let opened = redirect_target(&grace.submit(PATH, &borrowed(&fields)).await);
    let (page, done) = opened.split_once("?done=").unwrap();
    assert_eq!(done, "tournament-opened");
    let view = site
        .get(&page.replace("/organiser", "/api/v1"), None)
        .await
        .json(200);
    assert_eq!(view["rules"]["format"]["rounds"], 1, "{view}");
    assert_eq!(view["entrants"].as_array().unwrap().len(), 2);

    let added = grace
        .submit(&format!("{page}/teams"), &[("teams", "C")])
        .await;
    assert_eq!(
        redirect_target(&added),
        format!("{page}?done=teams-entered")
    );
    let (effects, target) = decide(&mut grace, page, "start-round").await;
    assert!(effects.contains("pairings of the 3 teams"), "{effects}");
    assert_eq!(target, format!("{page}?done=round-started"));
    let html = dashboard_page(&grace.open(&target).await, 200);
    assert!(texts(&html, "[role=status]")[0].contains("The round has started"));
    let status = texts(&html, ".facts").remove(0);
    assert!(status.contains("round in progress"), "{status}");
    assert!(status.contains("0 of 3"), "{status}");

    let (_, target) = decide(&mut grace, page, "pause-tournament").await;
    assert_eq!(target, format!("{page}?done=tournament-paused"));
    let html = dashboard_page(&grace.open(page).await, 200);
    assert!(texts(&html, ".facts")[0].contains("paused"));
    let (_, target) = decide(&mut grace, page, "resume-tournament").await;
    assert_eq!(target, format!("{page}?done=tournament-resumed"));

    while fake_worker::play_next(&site, first_by_name_wins)
        .await
        .is_some()
    {}
    let (effects, target) = decide(&mut grace, page, "void-game").await;
    assert!(effects.contains("will be voided at once"), "{effects}");
    assert_eq!(target, format!("{page}?done=game-voided"));
    let overview = dashboard_page(&grace.open("/organiser").await, 200);
    let items = texts(&overview, ".attention li");
    assert!(
        items
            .iter()
            .any(|item| item.contains("Cup") && item.contains("1 game has no result")),
        "{items:?}"
    );
    assert_eq!(texts(&overview, ".badge"), ["1 pending decision"]);
    let list = dashboard_page(&grace.open(PATH).await, 200);
    let row = rows(&list, "tbody tr").remove(0);
    assert!(row.contains("2 of 3 1 game has no result"), "{row}");
    let (_, target) = decide(&mut grace, page, "rerun-game").await;
    assert_eq!(target, format!("{page}?done=game-rerun"));
    fake_worker::play_next(&site, first_by_name_wins)
        .await
        .unwrap();

    let list = dashboard_page(&grace.open(PATH).await, 200);
    let row = rows(&list, "tbody tr").remove(0);
    assert!(row.contains("champion: A"), "{row}");
    assert!(row.contains("can be closed"), "{row}");
    // The sentence about the organisers is for everyone else.
    let pending = "the organisers still have to close the tournament";
    let public = site.get(&page.replace("/organiser", ""), None).await;
    assert!(public.body.contains(pending), "{}", public.body);
    assert!(!grace.open(page).await.body.contains(pending));
    let (effects, target) = decide(&mut grace, page, "close-tournament").await;
    assert!(effects.contains("closed for good"), "{effects}");
    assert_eq!(target, format!("{page}?done=tournament-closed"));
    let html = dashboard_page(&grace.open(page).await, 200);
    assert!(links(&html, "main a[href*='/decide/']").is_empty());
    let overview = dashboard_page(&grace.open("/organiser").await, 200);
    assert!(texts(&overview, ".badge").is_empty());
}

#[tokio::test]
async fn stale_page_does_not_start_the_next_round() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    let mut grace = organiser(&cup.site, "Grace").await;
    let page = cup.path.replace("/api/v1", "/organiser");
    let id = cup.path.rsplit('/').next().unwrap();
    for (number, other) in [(1, 2), (2, 1)] {
        let path = |round: u32| format!("/organiser/decide/start-round/{id}/{round}");
        let decision = path(number);
        let html = dashboard_page(&grace.open(&page).await, 200);
        assert_eq!(
            links(&html, "main a[href*='/start-round/']"),
            [decision.as_str()]
        );
        let of_other_round = grace.submit(&path(other), &[]).await;
        assert_eq!(of_other_round.status, 409, "{}", of_other_round.body);
        let started = redirect_target(&grace.submit(&decision, &[]).await);
        assert_eq!(started, format!("{page}?done=round-started"));
        // A second click on the button, while the round is running and after it.
        for is_over in [false, true] {
            if is_over {
                assert_eq!(cup.play(first_by_name_wins).await, 1);
            }
            for again in [
                grace.submit(&decision, &[]).await,
                grace.open(&decision).await,
            ] {
                let text = texts(&again.html(409), "main").remove(0);
                let expected = format!("Round {number} has started already");
                assert!(text.contains(&expected), "{text}");
                assert!(!again.body.contains("Start round"), "{}", again.body);
            }
        }
        let rounds = cup.view().await["rounds"].as_array().unwrap().len();
        assert_eq!(rounds, number as usize);
    }
}

#[tokio::test]
async fn final_preview_names_the_teams_that_advanced() {
    let format = json!({ "kind": "groups", "groups": 2, "advance": 1 });
    let body = json!({ "rules": { "format": format } });
    let cup = TestTournament::open(&["A", "B", "C", "D"], body).await;
    let mut grace = organiser(&cup.site, "Grace").await;
    let page = cup.path.replace("/api/v1", "/organiser");
    let (effects, _) = decide(&mut grace, &page, "start-round").await;
    assert!(
        effects.contains("The pairings of the 4 teams will be decided"),
        "{effects}"
    );
    assert_eq!(cup.play(first_by_name_wins).await, 2);
    let (effects, target) = decide(&mut grace, &page, "start-round").await;
    assert!(
        effects.contains("The pairings of the teams that advanced from the groups will be decided"),
        "{effects}"
    );
    assert_eq!(target, format!("{page}?done=round-started"));
    let view = cup.view().await;
    assert_eq!(
        view["rounds"][1]["submissions"].as_array().unwrap().len(),
        2
    );
}

#[tokio::test]
async fn withdrawn_team_can_be_disqualified_on_the_page() {
    let cup = TestTournament::open(&["A", "B", "C"], json!({})).await;
    cup.start_round().await;
    let mut grace = organiser(&cup.site, "Grace").await;
    let page = cup.path.replace("/api/v1", "/organiser");
    let link_of_a = format!("main a[href$='/{}'][href*='-team/']", cup.teams["A"].id);
    let id = cup.path.rsplit('/').next().unwrap();
    let path = |decision: &str| {
        let team = &cup.teams["A"].id;
        format!("/organiser/decide/{decision}-team/{id}/{team}")
    };
    let html = dashboard_page(&grace.open(&page).await, 200);
    let both = [path("withdraw"), path("disqualify")];
    assert_eq!(links(&html, &link_of_a), both);
    decide(&mut grace, &page, "withdraw-team").await;
    let html = dashboard_page(&grace.open(&page).await, 200);
    assert_eq!(links(&html, &link_of_a), [path("disqualify")]);
    let (_, target) = decide(&mut grace, &page, "disqualify-team").await;
    assert_eq!(target, format!("{page}?done=team-left"));
    let html = dashboard_page(&grace.open(&page).await, 200);
    assert!(links(&html, &link_of_a).is_empty());
    let view = cup.view().await;
    let departure = &view["entrants"][0]["departure"];
    assert_eq!(departure["as"], "disqualified", "{view}");
}

#[tokio::test]
async fn refused_tournament_form_keeps_what_was_typed() {
    let site = Site::start().await;
    let mut grace = organiser(&site, "Grace").await;
    let page = dashboard_page(&grace.open(PATH).await, 200);
    let label = texts(&page, "label[for=teams]").remove(0);
    assert!(
        label.contains("for all deployable and improvable teams of the stage"),
        "{label}"
    );
    for (changed, expected) in [
        (("teams", "Unknown"), "no team"),
        (("rounds", "many"), "expected a number"),
        (("rounds", "0"), "expected 1 to 100"),
        (("name", "?"), "name"),
    ] {
        let mut all = vec![("name", "Cup"), ("teams", "")];
        all.retain(|(name, _)| *name != changed.0);
        all.push(changed);
        let fields = new_tournament(&mut grace, &all).await;
        let refused = grace.submit(PATH, &borrowed(&fields)).await;
        let html = dashboard_page(&refused, 422);
        let alert = texts(&html, "[role=alert]").remove(0);
        assert!(alert.contains(expected), "{alert}");
        let form = forms(PATH, &refused).into_iter().find(|form| form.is_post);
        let kept = form.unwrap().fields;
        let typed = (changed.0.to_owned(), changed.1.to_owned());
        assert!(kept.contains(&typed), "{kept:?}");
    }
    let tournaments = site.get("/api/v1/tournaments", None).await.json(200);
    assert_eq!(tournaments, json!([]));
}

#[tokio::test]
async fn teams_leave_by_a_decision_of_organisers() {
    let cup = TestTournament::open(&["A", "B", "C"], json!({})).await;
    cup.start_round().await;
    let mut grace = organiser(&cup.site, "Grace").await;
    let page = cup.path.replace("/api/v1", "/organiser");
    let (effects, target) = decide(&mut grace, &page, "disqualify-team").await;
    let outcome = "The team A will be disqualified for good and will rank below all others. ";
    assert!(effects.starts_with(outcome), "{effects}");
    assert!(effects.contains(". 2 of its games, and"), "{effects}");
    assert_eq!(target, format!("{page}?done=team-left"));
    let (_, _) = decide(&mut grace, &page, "withdraw-team").await;
    let departures: Vec<(Value, Value)> = cup.view().await["entrants"]
        .as_array()
        .unwrap()
        .iter()
        .map(|entrant| {
            let departure = &entrant["departure"];
            (departure["as"].clone(), departure["reason"].clone())
        })
        .collect();
    assert_eq!(
        departures[0],
        (json!("disqualified"), json!("the lamp fell"))
    );
    assert_eq!(departures[1].0, "withdrawn");
    assert_eq!(departures[2].0, Value::Null);
}

#[tokio::test]
async fn tournament_decisions_are_for_organisers_only() {
    let cup = TestTournament::open(&["A", "B"], json!({})).await;
    cup.start_round().await;
    assert_eq!(cup.play(first_by_name_wins).await, 1);
    let site = &cup.site;
    site.team("C").await;
    let role = json!({ "role": "member", "team": cup.teams["A"].id, "note": "Ada" });
    let mut ada = Browser::join(site, "Ada", role).await;
    let mut visitor = Browser::new(site);
    let id = cup.path.rsplit('/').next().unwrap();
    let page = format!("{PATH}/{id}");
    for path in [PATH, &page] {
        assert_eq!(ada.open(path).await.status, 403, "{path}");
        let asked = redirect_target(&visitor.open(path).await);
        assert!(asked.starts_with("/sign-in?next=%2Forganiser"), "{asked}");
    }
    let before = (cup.view().await, cup.games().await);
    let team = string(&before.0["entrants"][0]["team"]);
    let game = string(&before.1[0]["id"]);
    let (home, away) = team_names(&before.1[0]);
    let pairing = format!("{home} - {away}");
    let mut grace = organiser(site, "Grace").await;
    for (path, fields) in [
        (PATH.to_owned(), vec![("name", "Mine")]),
        (format!("{page}/teams"), vec![("teams", "C")]),
        (format!("/organiser/decide/start-round/{id}/2"), Vec::new()),
        (
            format!("/organiser/decide/pause-tournament/{id}"),
            vec![("reason", "mine")],
        ),
        (
            format!("/organiser/decide/resume-tournament/{id}"),
            Vec::new(),
        ),
        (
            format!("/organiser/decide/close-tournament/{id}"),
            vec![("confirm", "Cup")],
        ),
        (
            format!("/organiser/decide/withdraw-team/{id}/{team}"),
            vec![("reason", "mine"), ("confirm", "A")],
        ),
        (
            format!("/organiser/decide/disqualify-team/{id}/{team}"),
            vec![("reason", "mine"), ("confirm", "A")],
        ),
        (
            format!("/organiser/decide/void-game/{game}"),
            vec![("reason", "mine"), ("confirm", pairing.as_str())],
        ),
        (format!("/organiser/decide/rerun-game/{game}"), Vec::new()),
    ] {
        let refused = ada.submit(&path, &fields).await;
        assert_eq!(refused.status, 403, "{path}: {}", refused.body);
        let asked = visitor.submit(&path, &fields).await;
        assert!(asked.status == 401 || asked.status == 303, "{path}");
        let fields = fields.iter();
        let form = Form {
            action: path,
            is_post: true,
            is_multipart: false,
            fields: fields
                .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
                .collect(),
        };
        for refused in grace.submit_from_foreign_page(&form).await {
            assert_eq!(refused.status, 403, "{form:?}: {}", refused.body);
        }
    }
    assert_eq!((cup.view().await, cup.games().await), before);
    let all = site.get("/api/v1/tournaments", Some(ADMIN)).await.json(200);
    assert_eq!(all.as_array().unwrap().len(), 1);
}
