//! Both desks in a real browser: joining, an agent that is dropped onto the page, and a day that is started by a button.

use crate::{CONFIG, Team};
use base64::{Engine, engine::general_purpose::STANDARD};
use faceoff_tests::{
    browser::{Browser, Page},
    bundle, repository,
    server::Server,
};
use serde_json::{Value, json};

/// Somebody who is invited.
pub struct Person<'a> {
    name: &'a str,
    invitation: Value,
}

impl<'a> Person<'a> {
    pub fn organiser(name: &'a str) -> Self {
        Self {
            name,
            invitation: json!({ "role": "organiser", "note": name }),
        }
    }

    pub fn member(name: &'a str, team: &str) -> Self {
        Self {
            name,
            invitation: json!({ "role": "member", "note": name, "team": team }),
        }
    }
}

/// A window of somebody who has followed an invitation.
pub fn signed_in<'a>(browser: &'a Browser, server: &Server, person: Person<'_>) -> Page<'a> {
    let invited = server.post(
        "/api/v1/invitations",
        &server.admin_token,
        &person.invitation,
    );
    let invited: Value = invited.json().expect("the API speaks JSON");
    let code = invited["code"].as_str().expect("an invitation has a code");
    let page = browser.open(&format!("{}/join/{code}", server.url));
    let fields = [("name", person.name), ("password", "correct horse battery")];
    page.send_form("main form", &fields);
    assert!(
        !page.html().contains("Become an organiser") && !page.html().contains("Join the team"),
        "{}",
        page.text("main")
    );
    page
}

/// Lets go of a file above the upload's form.
fn drop_file(page: &Page, name: &str, bytes: &[u8]) {
    let _ = page.evaluate(&format!(
        "(() => {{
            const bytes = Uint8Array.from(atob({}), letter => letter.charCodeAt(0));
            const dataTransfer = new DataTransfer();
            dataTransfer.items.add(new File([bytes], {}));
            const form = document.querySelector('form[data-upload]');
            form.dispatchEvent(new DragEvent('drop', {{ dataTransfer, cancelable: true }}));
        }})()",
        json!(STANDARD.encode(bytes)),
        json!(name)
    ));
}

#[test]
fn a_season_is_entered_and_started_from_the_desks_alone() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let _alpha = Team::create(&server, "Alpha");
    let teams: Value = server
        .get("/api/v1/teams", Some(&server.admin_token))
        .json()
        .expect("the API speaks JSON");
    let teams = teams.as_array().or_else(|| teams["teams"].as_array());
    let team = &teams.expect("a list of teams")[0]["id"];
    let browser = Browser::start(scratch.path());

    let ada = signed_in(
        &browser,
        &server,
        Person::member("Ada", team.as_str().expect("an id is text")),
    );
    ada.go(&format!("{}/desk", server.url));
    // What is no agent is told on the page, which stays as it is.
    drop_file(&ada, "agent.zip", b"no archive at all");
    ada.wait_for(".refused");
    assert!(
        ada.text(".refused").contains("archive"),
        "{}",
        ada.text(".refused")
    );
    assert_eq!(ada.text("form[data-upload] [role=status]"), "Not uploaded.");
    let hold = bundle::packed(&repository().join("agents/hold"));
    drop_file(&ada, "hold.tar.gz", &hold);
    ada.wait_for(".done");
    assert!(
        ada.text(".done").contains("Uploaded"),
        "{}",
        ada.text(".done")
    );
    // Its verdict comes by itself.
    ada.wait_until(
        "document.querySelector('#submissions').parentElement.textContent.includes('plays')",
    );
    ada.wait_until("document.querySelector('.state.good') !== null");

    let grace = signed_in(&browser, &server, Person::organiser("Grace"));
    grace.go(&format!("{}/organiser/day", server.url));
    grace.leave_by("document.querySelector('a[href^=\"/organiser/decide/start-day\"]').click()");
    assert!(grace.text("h1").starts_with("Start the day"));
    grace.send_form("main form", &[]);
    assert_eq!(grace.text(".done"), "The day was started.");
    // The script tells of what goes on; in the end the day is over.
    grace.wait_until("document.body.textContent.includes('finished')");

    ada.go(&format!("{}/desk", server.url));
    ada.wait_until("[...document.querySelectorAll('a')].some(link => link.pathname.startsWith('/evaluations/'))");
    for page in [&ada, &grace] {
        let errors = page.console_errors();
        // The refused upload is one of the browser's, too.
        let unexpected = errors
            .iter()
            .filter(|error| !error.contains("/desk/upload"));
        assert_eq!(unexpected.count(), 0, "{errors:?}");
    }
}
