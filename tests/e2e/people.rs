//! The commands for people: who is invited, joins and leaves, what tokens are worth, how teams register, and what
//! everybody is told. Each wrong value ends in a sentence and a status that says so.

use crate::{
    CONFIG,
    commands::{FAILED, MISUSED, NOT_ALLOWED, REFUSED, Told, admin, admin_as, faceoff, member},
};
use faceoff_tests::server::{Server, http};
use serde_json::{Value, json};
use std::{fs, os::unix::fs::PermissionsExt, path::Path};

const NOBODY: &str = "00000000-0000-7000-8000-000000000000";

fn join(server: &Server, link: &str, args: &[&str]) -> Told {
    faceoff(
        &[&["join", link, "--server", &server.url], args].concat(),
        "",
    )
}

/// The word that begins so.
#[track_caller]
fn word(text: &str, beginning: &str) -> String {
    let found = text
        .split_whitespace()
        .find(|word| word.contains(beginning));
    found
        .unwrap_or_else(|| panic!("no {beginning} in {text:?}"))
        .to_owned()
}

fn id(value: &Value) -> String {
    value["id"].as_str().expect("it has an id").to_owned()
}

/// Invites as the arguments say, and joins by the link; the person's token.
#[track_caller]
pub fn joined(server: &Server, invite: &[&str], name: &str) -> String {
    let invited = admin(server, &[&["people"], invite].concat()).done();
    assert!(invited.contains("It is not shown again"), "{invited}");
    let link = word(&invited, "/join/fo_invite_");
    word(&join(server, &link, &["--name", name]).done(), "fo_person_")
}

#[test]
fn people_are_invited_join_and_leave_by_the_commands() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let people = |args: &[&str]| admin(&server, &[&["people"], args].concat());
    assert!(people(&["list"]).done().contains("nobody yet"));
    assert!(
        people(&["invitations"])
            .done()
            .contains("nobody was invited yet")
    );

    // An organiser, by a link that is good for one person, once.
    let invited = people(&["invite-organiser", "Grace"]).done();
    let link = word(&invited, "/join/fo_invite_");
    join(&server, "nonsense", &["--name", "Grace"]).not_done(FAILED, &["expected a link like"]);
    join(&server, &format!("{link}x"), &["--name", "Grace"])
        .not_done(REFUSED, &["the server refused"]);
    join(&server, &link, &["--name", "<b>"]).not_done(MISUSED, &["--name", "letters, digits"]);
    join(&server, &link, &[]).not_done(REFUSED, &["name: expected the name"]);
    join(&server, &link, &["--name", "Grace", "--accept-terms", "1"])
        .not_done(REFUSED, &["this season has no terms"]);
    let said = join(&server, &link, &["--name", "Grace"]).done();
    assert!(
        said.contains("organiser") && said.contains("not shown again"),
        "{said}"
    );
    let grace = word(&said, "fo_person_");
    join(&server, &link, &["--name", "Grace again"]).not_done(REFUSED, &["409"]);
    people(&["invite-organiser", ""]).not_done(REFUSED, &["note", "1 to"]);
    let who = member(&server, &grace, "whoami", &[]).done();
    assert!(who.contains("Grace") && who.contains("organiser"), "{who}");

    // A member of a team, with a password.
    let team = admin_as(&server, &grace, &["create-team", "Alpha"]).done();
    word(&team, "fo_team_");
    people(&["invite-member", "Nobodies", "Ada"]).not_done(
        FAILED,
        &["no team is named \"Nobodies\"", "faceoff admin teams"],
    );
    let invited = people(&["invite-member", "Alpha", "Ada"]).done();
    let link = word(&invited, "/join/fo_invite_");
    let with_password = |password: &str| {
        let args = [
            "join",
            &link,
            "--server",
            &server.url,
            "--name",
            "Ada",
            "--password-stdin",
        ];
        faceoff(&args, password)
    };
    with_password("too short\n").not_done(REFUSED, &["password", "12"]);
    let said = with_password("a dozen characters, and more\n").done();
    let ada = word(&said, "fo_person_");
    assert!(said.contains("of the team Alpha"), "{said}");
    let members = member(&server, &ada, "team", &["members"]).done();
    assert!(
        members.contains("Ada") && !members.contains("Grace"),
        "{members}"
    );
    // What organisers do is not a member's to do.
    for args in [
        &["people", "invite-organiser", "Eve"][..],
        &["registration", "list"],
        &["announce", "a", "b"],
        &["create-team", "Eve"],
    ] {
        admin_as(&server, &ada, args).not_done(NOT_ALLOWED, &["403"]);
    }
    admin_as(&server, "fo_person_nobody", &["people", "list"]).not_done(NOT_ALLOWED, &["401"]);

    // The founder of a team.
    let invited = people(&["invite-team", "a founder"]).done();
    let link = word(&invited, "/join/fo_invite_");
    let founder = ["--name", "Bob", "--affiliation", "TU"];
    join(&server, &link, &founder).not_done(MISUSED, &["--team"]);
    join(&server, &link, &["--name", "Bob"]).not_done(REFUSED, &["expected the team's name"]);
    let taken = [&founder[..], &["--team", "alpha"]].concat();
    join(&server, &link, &taken).not_done(REFUSED, &["exists already"]);
    let right = [&founder[..], &["--team", "Beta"]].concat();
    let said = join(&server, &link, &right).done();
    assert!(said.contains("of the team Beta"), "{said}");

    // A link that is taken back.
    let invited = people(&["invite-member", "Beta", "Carl"]).done();
    let (uninvited, link) = (word(&invited, "-"), word(&invited, "/join/fo_invite_"));
    let taken_back = people(&["uninvite", &uninvited]).done();
    assert!(taken_back.contains("revoked"), "{taken_back}");
    join(&server, &link, &["--name", "Carl"]).not_done(REFUSED, &["409"]);
    people(&["uninvite", NOBODY]).not_done(REFUSED, &["404", "invitation"]);
    people(&["uninvite", "Carl"]).not_done(MISUSED, &["Carl"]);
    let all = people(&["invitations"]).done();
    for note in ["Grace", "Ada", "a founder", "Carl"] {
        assert!(all.contains(&format!("for {note},")), "{note}: {all}");
    }

    // Who has lost everything comes back as who they were.
    people(&["invite-back", "Nobody"]).not_done(FAILED, &["nobody is named \"Nobody\""]);
    let invited = people(&["invite-back", "Ada"]).done();
    let link = word(&invited, "/join/fo_invite_");
    join(&server, &link, &["--name", "Eve"]).not_done(REFUSED, &["leave the name out"]);
    let ada = word(&join(&server, &link, &[]).done(), "fo_person_");
    let who = member(&server, &ada, "whoami", &["--json"]).json();
    assert_eq!(
        (&who["role"], &who["person"]["name"]),
        (&json!("member"), &json!("Ada"))
    );

    // Somebody is removed only when that is meant.
    people(&["remove", "Nobody"]).not_done(FAILED, &["nobody is named"]);
    for args in [
        &["remove", "Ada"][..],
        &["remove", "Ada", "--confirm", "ada"],
    ] {
        people(args).not_done(REFUSED, &["nothing is done yet", "\"Ada\""]);
    }
    member(&server, &ada, "whoami", &[]).done();
    let removed = people(&["remove", "Ada", "--confirm", "Ada"]).done();
    assert!(removed.contains("left"), "{removed}");
    member(&server, &ada, "whoami", &[]).not_done(NOT_ALLOWED, &["401"]);
    people(&["invite-back", "Ada"]).not_done(REFUSED, &["has left"]);
    let list = admin(&server, &["people", "list", "--json"]).json();
    let names: Vec<_> = list.as_array().expect("a list").iter().collect();
    assert_eq!(names.len(), 3, "{list:#}");
}

#[test]
fn tokens_are_made_listed_rotated_and_revoked_by_the_commands() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let grace = joined(&server, &["invite-organiser", "Grace"], "Grace");
    let tokens = |args: &[&str]| admin_as(&server, &grace, &[&["token"], args].concat());
    let is_good = |token: &str| member(&server, token, "whoami", &[]).code == Some(0);

    let made = tokens(&["create", "laptop", "--days", "30"]).done();
    let laptop = word(&made, "fo_person_");
    assert!(
        made.contains("not shown again") && is_good(&laptop),
        "{made}"
    );
    for days in ["0", "-1", "many", "70000"] {
        let days = format!("--days={days}");
        tokens(&["create", "x", &days]).not_done(MISUSED, &["--days"]);
    }
    tokens(&["create", ""]).not_done(REFUSED, &["name", "1 to"]);
    tokens(&["create", "ci", "--team", "Alpha"]).not_done(MISUSED, &["--team"]);
    tokens(&["create", "ci", "--team", NOBODY]).not_done(REFUSED, &["404"]);
    let team = admin(&server, &["create-team", "Alpha", "--json"]).json();
    let made = tokens(&["create", "ci", "--team", &id(&team), "--json"]).json();
    let ci = made["secret"]
        .as_str()
        .expect("it is shown once")
        .to_owned();
    let who = member(&server, &ci, "whoami", &[]).done();
    assert!(who.contains("a program of the team Alpha"), "{who}");

    let list = tokens(&["list"]).done();
    let of_laptop = list.lines().find(|line| line.contains("laptop"));
    let of_laptop = of_laptop.expect("it is listed").to_owned();
    assert!(of_laptop.contains("good until"), "{of_laptop}");
    for secret in [&laptop, &ci, &grace, &server.admin_token] {
        assert!(!list.contains(secret.as_str()), "a list tells no secret");
    }
    let id_of_laptop = of_laptop
        .split_whitespace()
        .next()
        .expect("its id comes first");

    // Of the rotated one nothing is left, at once.
    let rotated = tokens(&["rotate", id_of_laptop]).done();
    let fresh = word(&rotated, "fo_person_");
    assert!(!is_good(&laptop) && is_good(&fresh));
    member(&server, &laptop, "whoami", &[]).not_done(NOT_ALLOWED, &["401"]);
    let by_host = admin(&server, &["token", "rotate", id_of_laptop]);
    by_host.not_done(NOT_ALLOWED, &["403", "that person alone"]);
    for verb in ["rotate", "revoke"] {
        tokens(&[verb, NOBODY]).not_done(REFUSED, &["404"]);
        tokens(&[verb, "laptop"]).not_done(MISUSED, &["laptop"]);
    }
    let revoked = admin(&server, &["token", "revoke", id_of_laptop]).done();
    assert!(revoked.contains("revoked 2"), "{revoked}");
    assert!(!is_good(&fresh) && is_good(&grace));
    member(&server, &fresh, "whoami", &[]).not_done(NOT_ALLOWED, &["401", "revoked"]);
    tokens(&["rotate", id_of_laptop]).not_done(REFUSED, &["make another one"]);
    // Again it is no change.
    tokens(&["revoke", id_of_laptop]).done();
    // People and teams have the same without `admin`.
    let own = |args: &[&str]| member(&server, &grace, "token", args);
    let desk = own(&["create", "desk"]).done();
    let list = own(&["list"]).done();
    let of_desk = list.lines().find(|line| line.contains(" desk "));
    let of_desk = word(of_desk.expect("it is listed"), "-");
    let fresh = word(&own(&["rotate", &of_desk]).done(), "fo_person_");
    assert!(!is_good(&word(&desk, "fo_person_")) && is_good(&fresh));
    own(&["revoke", &of_desk]).done();
    assert!(!is_good(&fresh));
    own(&["revoke", "desk"]).not_done(MISUSED, &["desk"]);
    let revoke = tokens(&["revoke", &id(&made)]).done();
    assert!(revoke.contains("ci") && !is_good(&ci));
}

#[test]
fn teams_register_and_everybody_is_told_by_the_commands() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let registration = |args: &[&str]| admin(&server, &[&["registration"], args].concat());
    let http = http().build().expect("a client needs nothing");
    let register = |body: &Value| {
        let url = format!("{}/api/v1/registrations", server.url);
        let answer = http
            .post(url)
            .json(body)
            .send()
            .expect("the server answers");
        let status = answer.status().as_u16();
        (status, answer.json::<Value>().expect("the API speaks JSON"))
    };
    let team = |name: &str| json!({ "team": { "name": name }, "contact": "ada@example.org", "accepted_terms": 1 });

    // Terms first: what taking part needs.
    let terms = scratch.path().join("terms.txt");
    let publish = |file: &Path| admin(&server, &["publish-terms", &file.to_string_lossy()]);
    publish(&terms).not_done(FAILED, &["reading the terms from", "terms.txt"]);
    fs::write(&terms, " \n").expect("a scratch file can be written");
    publish(&terms).not_done(REFUSED, &["text", "1 to"]);
    fs::write(&terms, b"\xff\xfe").expect("a scratch file can be written");
    publish(&terms).not_done(FAILED, &["reading the terms from"]);
    fs::write(&terms, "Be fair.").expect("a scratch file can be written");
    assert!(publish(&terms).done().contains("published as version 1"));
    publish(&terms).not_done(REFUSED, &["these are the terms"]);

    // Registrations are taken while they are open.
    assert!(
        registration(&["list"])
            .done()
            .contains("no team has registered")
    );
    let (status, problem) = register(&team("Alpha"));
    assert_eq!(status, 409, "{problem:#}");
    let open = registration(&["open"]).done();
    assert!(
        open.contains("registration is open; divisions: none"),
        "{open}"
    );
    registration(&["divisions", "Open", "open"]).not_done(REFUSED, &["there twice"]);
    registration(&["divisions", "<b>"]).not_done(MISUSED, &["letters, digits"]);
    let divided = registration(&["divisions", "Open", "Students"]).done();
    assert!(divided.contains("divisions: Open, Students"), "{divided}");
    let mut students = team("Alpha");
    students["team"]["division"] = json!("Students");
    let (_, alpha) = register(&students);
    let (_, beta) = register(&team("Beta"));
    let list = registration(&["list"]).done();
    assert!(
        list.contains("Alpha") && list.contains("ada@example.org, waiting"),
        "{list}"
    );

    let link = alpha["join_link"].as_str().expect("it is shown once");
    let consenting = ["--name", "Ada", "--accept-terms", "1"];
    join(&server, link, &consenting).not_done(REFUSED, &["waits for the organisers"]);
    registration(&["approve", NOBODY]).not_done(REFUSED, &["404", "registration"]);
    registration(&["approve", "Alpha"]).not_done(MISUSED, &["Alpha"]);
    let approved = registration(&["approve", &id(&alpha)]).done();
    assert!(approved.contains("approved"), "{approved}");
    registration(&["approve", &id(&alpha)]).not_done(REFUSED, &["was approved"]);
    registration(&["refuse", &id(&beta), ""]).not_done(REFUSED, &["reason"]);
    let refused = registration(&["refuse", &id(&beta), "one team each"]).done();
    assert!(refused.contains("refused: one team each"), "{refused}");
    registration(&["refuse", &id(&beta), "again"]).not_done(REFUSED, &["was refused"]);
    let of_beta = beta["join_link"].as_str().expect("it is shown once");
    join(&server, of_beta, &consenting).not_done(REFUSED, &["one team each"]);
    join(&server, link, &["--name", "Ada"]).not_done(REFUSED, &["consent to version 1"]);
    let said = join(&server, link, &consenting).done();
    let ada = word(&said, "fo_person_");
    assert!(
        member(&server, &ada, "team", &["show"])
            .done()
            .contains("Students")
    );
    registration(&["divisions", "Open"]).not_done(REFUSED, &["teams are in “Students”"]);
    assert!(
        registration(&["close"])
            .done()
            .contains("registration is closed")
    );
    assert_eq!(register(&team("Gamma")).0, 409);

    // Other terms stop uploads until a member has accepted them.
    fs::write(&terms, "Be fair, and quick.").expect("a scratch file can be written");
    assert!(publish(&terms).done().contains("version 2"));
    let of_team = |args: &[&str]| member(&server, &ada, "team", args);
    let upload = || server.upload(&ada, vec![0x1f, 0x8b, 8, 0]).status();
    assert_eq!(upload(), 403);
    assert!(of_team(&["terms"]).done().contains("Be fair, and quick."));
    of_team(&["terms", "--accept", "7"]).not_done(REFUSED, &["expected 2", "got 7"]);
    of_team(&["terms", "--accept", "two"]).not_done(MISUSED, &["--accept"]);
    of_team(&["terms", "--accept", "2"]).done();
    assert_eq!(upload(), 201);

    // Announcements, questions and their answers.
    admin(&server, &["announce", "", "text"]).not_done(REFUSED, &["title"]);
    admin(&server, &["announce", "title", " "]).not_done(REFUSED, &["text"]);
    admin(&server, &["announce", "title"]).not_done(MISUSED, &["<TEXT>"]);
    admin(
        &server,
        &["announce", "No day on Sunday", "The power is off."],
    )
    .done();
    assert!(
        admin(&server, &["questions"])
            .done()
            .contains("nobody has asked yet")
    );
    of_team(&["ask", ""]).not_done(REFUSED, &["text"]);
    of_team(&["ask", "May we use two arms?"]).done();
    let questions = admin(&server, &["questions", "--json"]).json();
    let asked = id(&questions[0]);
    admin(&server, &["answer", NOBODY, "No."]).not_done(REFUSED, &["404", "question"]);
    admin(&server, &["answer", "first", "No."]).not_done(MISUSED, &["first"]);
    admin(&server, &["answer", &asked, ""]).not_done(REFUSED, &["text"]);
    admin(&server, &["answer", &asked, "No.", "--public"]).done();
    let news = of_team(&["news"]).done();
    for part in [
        "No day on Sunday",
        "The power is off.",
        "May we use two arms?",
        "→ No.",
    ] {
        assert!(news.contains(part), "{part:?} is not in {news}");
    }
}

#[test]
fn a_start_makes_another_host_token_when_the_one_in_the_file_was_revoked() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data = scratch.path().join("data");
    let file = data.join("admin-token");
    let by_file = |server: &Server, args: &[&str]| {
        let folder = data.to_string_lossy();
        let who = ["admin", "--server", &server.url, "--data-dir", &folder];
        faceoff(&[&who[..], args].concat(), "")
    };
    let server = Server::start(&data, CONFIG);
    let first = server.admin_token.clone();
    let grace = joined(&server, &["invite-organiser", "Grace"], "Grace");
    // A start that finds it good keeps it.
    server.kill();
    let server = Server::start(&data, CONFIG);
    assert_eq!(server.admin_token, first);
    by_file(&server, &["people", "list"]).done();

    let list = admin_as(&server, &grace, &["token", "list", "--json"]).json();
    let list = list.as_array().expect("a list");
    let of_host = list.iter().find(|token| token["name"] == "admin-token");
    let of_host = id(of_host.expect("the host has a token"));
    // Rotated, the file would still have the old one, which the next start would take for the host's.
    admin_as(&server, &grace, &["token", "rotate", &of_host])
        .not_done(REFUSED, &["data folder", "revoke it"]);
    admin_as(&server, &grace, &["token", "revoke", &of_host]).done();
    by_file(&server, &["people", "list"]).not_done(NOT_ALLOWED, &["401", "revoked"]);
    server.kill();

    let server = Server::start(&data, CONFIG);
    assert_ne!(server.admin_token, first);
    server.wait_for_log("was revoked; making another one", 1);
    let mode = fs::metadata(&file)
        .expect("the file is there")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o600);
    by_file(&server, &["people", "list"]).done();
    admin_as(&server, &first, &["people", "list"]).not_done(NOT_ALLOWED, &["401", "revoked"]);
    admin_as(&server, &grace, &["people", "list"]).done();
    // The revoked one stays worth nothing, even if somebody puts it back.
    server.kill();
    fs::write(&file, format!("{first}\n")).expect("the file can be written");
    let server = Server::start(&data, CONFIG);
    assert_ne!(server.admin_token, first);
    admin_as(&server, &first, &["people", "list"]).not_done(NOT_ALLOWED, &["401", "revoked"]);
    // No token at all is a sentence, too.
    fs::remove_file(&file).expect("the file can be removed");
    by_file(&server, &["people", "list"]).not_done(
        NOT_ALLOWED,
        &["reading the organiser's token from", "--data-dir"],
    );
}
