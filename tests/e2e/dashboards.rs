//! Both dashboards (signed-in start pages of teams and organisers) in a real browser: accepting an invitation, uploading by
//! drag and drop, starting an evaluation day by a button.

use crate::{CONFIG, Team};
use base64::{Engine, engine::general_purpose::STANDARD};
use faceoff_tests::{
    browser::{Browser, LAN_HOST, Page},
    bundle, repository,
    server::Server,
};
use serde_json::{Value, json};
use std::{
    io::{BufRead as _, BufReader, Write as _},
    net::TcpListener,
    thread,
};

/// A user and the invitation that is created for them.
pub struct InvitedUser<'a> {
    name: &'a str,
    invitation: Value,
}

impl<'a> InvitedUser<'a> {
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

/// Invites the user. Returns a page on which the user has accepted the invitation and is signed in.
pub fn sign_in<'a>(browser: &'a Browser, server: &Server, user: InvitedUser<'_>) -> Page<'a> {
    sign_in_at(browser, server, &server.url, user)
}

/// [`sign_in`] on a server under this URL.
fn sign_in_at<'a>(
    browser: &'a Browser,
    server: &Server,
    url: &str,
    user: InvitedUser<'_>,
) -> Page<'a> {
    let answer = server.post("/api/v1/invitations", &server.admin_token, &user.invitation);
    let invitation: Value = answer.json().expect("the API speaks JSON");
    let code = invitation["code"]
        .as_str()
        .expect("an invitation has a code");
    let page = browser.open(&format!("{url}/join/{code}"));
    let fields = [("name", user.name), ("password", "correct horse battery")];
    page.send_form("main form", &fields);
    assert!(
        !page.html().contains("Become an organiser") && !page.html().contains("Join the team"),
        "{}",
        page.text("main")
    );
    page
}

/// Drops a file with this name and content onto the upload form.
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
fn dashboards_suffice_to_join_upload_and_start_a_day() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    // The team has no members yet.
    let _alpha = Team::create(&server, "Alpha");
    let teams: Value = server
        .get("/api/v1/teams", Some(&server.admin_token))
        .json()
        .expect("the API speaks JSON");
    let teams = teams.as_array().or_else(|| teams["teams"].as_array());
    let team = &teams.expect("a list of teams")[0]["id"];
    let browser = Browser::start(scratch.path());

    let ada = sign_in(
        &browser,
        &server,
        InvitedUser::member("Ada", team.as_str().expect("an id is text")),
    );
    ada.go_to(&format!("{}/dashboard", server.url));
    // A file that is no bundle is refused on the page, which is not reloaded.
    drop_file(&ada, "agent.zip", b"no archive at all");
    ada.wait_for(".refused");
    assert!(
        ada.text(".refused").contains(".zip bundle"),
        "{}",
        ada.text(".refused")
    );
    assert_eq!(
        ada.text("form[data-upload] [role=status]"),
        "Upload failed."
    );
    let hold = bundle::pack(&repository().join("agents/hold"));
    drop_file(&ada, "hold.tar.gz", &hold);
    ada.wait_for(".done");
    assert!(
        ada.text(".done").contains("Uploaded"),
        "{}",
        ada.text(".done")
    );
    // The verdict appears without a reload.
    ada.wait_until(
        "document.querySelector('#submissions').parentElement.textContent.includes('active at the next cutoff')",
    );
    ada.wait_until("document.querySelector('.state.good') !== null");

    let grace = sign_in(&browser, &server, InvitedUser::organiser("Grace"));
    grace.go_to(&format!("{}/organiser/day", server.url));
    grace.navigate_by("document.querySelector('a[href^=\"/organiser/decide/start-day\"]').click()");
    assert!(grace.text("h1").starts_with("Start the evaluation day"));
    grace.send_form("main form", &[]);
    assert_eq!(grace.text(".done"), "The evaluation day has started.");
    // The page updates without a reload until the day is finished.
    grace.wait_until("document.body.textContent.includes('finished')");

    ada.go_to(&format!("{}/dashboard", server.url));
    ada.wait_until("[...document.querySelectorAll('a')].some(link => link.pathname.startsWith('/evaluations/'))");
    for page in [&ada, &grace] {
        let errors = page.console_errors();
        // The browser logs the refused upload as an error, too.
        let unexpected = errors
            .iter()
            .filter(|error| !error.contains("/dashboard/upload"));
        assert_eq!(unexpected.count(), 0, "{errors:?}");
    }
}

#[test]
fn forms_work_without_tls_in_the_local_network() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let url = server.url.replace("127.0.0.1", LAN_HOST);
    assert_ne!(url, server.url);
    let browser = Browser::start(scratch.path());
    let grace = sign_in_at(&browser, &server, &url, InvitedUser::organiser("Grace"));
    assert_eq!(
        grace.evaluate("window.isSecureContext"),
        json!(false),
        "the browser does not treat {url} as the loopback"
    );
    grace.go_to(&format!("{url}/organiser/messages"));
    let announcement = [("title", "Welcome"), ("text", "The season begins.")];
    grace.send_form("form[action='/organiser/messages']", &announcement);
    let view: Value = server
        .get("/api/v1/announcements", Some(&server.admin_token))
        .json()
        .expect("the API speaks JSON");
    assert_eq!(view[0]["title"], "Welcome", "{}", grace.text("main"));
    grace.go_to(&format!("{url}/account"));
    grace.send_form("form[action='/sign-out']", &[]);
    grace.go_to(&format!("{url}/sign-in"));
    grace.send_form(
        "main form",
        &[("name", "Grace"), ("password", "correct horse battery")],
    );
    grace.go_to(&format!("{url}/organiser"));
    assert!(
        grace.text("body").contains("Grace"),
        "{}",
        grace.text("body")
    );
}

/// A server of one empty page. Returns its URL.
fn start_other_site() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let address = listener.local_addr().expect("it listens");
    thread::spawn(move || {
        for connection in listener.incoming().flatten() {
            let mut reader = BufReader::new(&connection);
            let mut line = String::new();
            while reader.read_line(&mut line).is_ok_and(|read| read > 2) {
                line.clear();
            }
            let answer = "HTTP/1.1 200 OK\r\nContent-Type: text/html\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
            let _ = (&connection).write_all(answer.as_bytes());
        }
    });
    format!("http://{address}")
}

#[test]
fn scripts_of_other_sites_read_what_visitors_may() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let browser = Browser::start(scratch.path());
    let grace = sign_in(&browser, &server, InvitedUser::organiser("Grace"));
    grace.go_to(&start_other_site());
    let fetch = |path: &str, options: Value| {
        grace.evaluate(&format!(
            "fetch('{}{path}', {options}).then(answer => answer.text(), () => 'refused')",
            server.url
        ))
    };
    let text = |path: &str, options: Value| fetch(path, options).to_string();
    assert!(text("/api/v1/season", json!({})).contains("commitment"));
    assert!(text("/api/v1/no-such-resource", json!({})).contains("problems#"));
    // The API refuses such a script's requests with a token or cookie and its changes; pages cannot be read at all.
    let token = json!({ "headers": { "Authorization": format!("Bearer {}", server.admin_token) } });
    let cookie = json!({ "credentials": "include" });
    let change = json!({ "method": "POST", "body": "{}", "headers": { "Content-Type": "application/json" } });
    for (path, options) in [
        ("/api/v1/season", token),
        ("/api/v1/season", cookie),
        ("/api/v1/days", change),
        ("/", json!({})),
        ("/organiser", json!({})),
    ] {
        assert_eq!(
            fetch(path, options.clone()),
            json!("refused"),
            "{path} {options}"
        );
    }
}
