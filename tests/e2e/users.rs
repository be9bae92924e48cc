//! Commands about users (organisers and members of teams): invitations, tokens, team registration, announcements and questions.
//! Each also gets invalid values, which end with a message and the matching exit status.

use crate::{
    CONFIG,
    commands::{
        CommandOutput, FAILED, NOT_ALLOWED, REFUSED, USAGE_ERROR, admin, admin_as, faceoff,
        join_args, member,
    },
};
use faceoff_tests::{
    program,
    server::{Server, http},
};
use serde_json::{Value, json};
use std::{
    fs,
    io::Write as _,
    os::unix::fs::PermissionsExt,
    path::Path,
    process::{Command, Stdio},
};

const UNKNOWN_ID: &str = "00000000-0000-7000-8000-000000000000";

/// `faceoff join`: accepts an invitation.
fn join(server: &Server, link: &str, args: &[&str]) -> CommandOutput {
    faceoff(&join_args(server, link, args), "")
}

/// The first word of a text that contains this part, such as the prefix of a token.
#[track_caller]
fn find_word(text: &str, part: &str) -> String {
    let found = text.split_whitespace().find(|word| word.contains(part));
    found
        .unwrap_or_else(|| panic!("no {part} in {text:?}"))
        .to_owned()
}

fn id(value: &Value) -> String {
    value["id"].as_str().expect("it has an id").to_owned()
}

/// Invites a user with these arguments of `faceoff admin people`, and accepts the invitation with this name. Returns the user's
/// token.
#[track_caller]
pub fn invite_and_join(server: &Server, invite_args: &[&str], name: &str) -> String {
    let invited = admin(server, &[&["people"], invite_args].concat()).expect_success();
    assert!(invited.contains("is not shown again"), "{invited}");
    let link = find_word(&invited, "/join/fo_invite_");
    find_word(
        &join(server, &link, &["--name", name]).expect_success(),
        "fo_person_",
    )
}

/// Runs a command at a terminal of its own, and types a line at each prompt.
const TYPIST: &str = r#"
import os, pty, sys, termios, time

answers = sys.stdin.read().splitlines()
child, terminal = pty.fork()
if child == 0:
    os.execv(sys.argv[1], sys.argv[1:])
output = b""
while True:
    try:
        chunk = os.read(terminal, 4096)
    except OSError:
        break
    output += chunk
    if output.rstrip().endswith(b"):") or output.rstrip().endswith(b"password:"):
        # A user does not type before the prompt is complete, with the echo off.
        while termios.tcgetattr(terminal)[3] & termios.ECHO:
            time.sleep(0.001)
        os.write(terminal, answers.pop(0).encode() + b"\n")
        output += b"\n."
print(output.decode())
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"#;

/// `faceoff join` at a terminal, where the user types these lines.
fn join_at_terminal(link: &str, name: &str, lines: &str) -> (bool, String) {
    let mut child = Command::new("python3")
        .args(["-c", TYPIST])
        .arg(program("faceoff"))
        .args(["join", link, "--name", name])
        .env("XDG_CONFIG_HOME", "/nonexistent")
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python is installed");
    let mut input = child.stdin.take().expect("it is a pipe");
    input.write_all(lines.as_bytes()).expect("it reads");
    drop(input);
    let output = child.wait_with_output().expect("it ends");
    let text = String::from_utf8(output.stdout).expect("it prints text");
    (output.status.success(), text)
}

#[test]
fn join_asks_for_a_password_at_the_terminal() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let invite = |name: &str| {
        let invited = admin(&server, &["people", "invite-organiser", name]).expect_success();
        find_word(&invited, "/join/fo_invite_")
    };
    let sign_in = |name: &str, password: &str| {
        let url = format!("{}/api/v1/sessions", server.url);
        let body = json!({ "name": name, "password": password });
        let request = http().build().expect("it needs nothing");
        let answer = request.post(url).json(&body).send().expect("it answers");
        answer.status().as_u16()
    };
    let link = invite("Grace");
    let (is_done, text) = join_at_terminal(&link, "Grace", "a good password\nanother one\n");
    assert!(!is_done && text.contains("can still be used"), "{text}");
    // A mail program has put the link into angle brackets.
    let quoted = format!("<{link}>.");
    let (is_done, text) = join_at_terminal(&quoted, "Grace", "a good password\na good password\n");
    assert!(is_done && text.contains("fo_person_"), "{text}");
    assert!(!text.contains("a good password"), "it is not shown: {text}");
    assert_eq!(sign_in("Grace", "a good password"), 201);
    // The accent as macOS types it, upper case, and a space from copying.
    let (is_done, text) =
        join_at_terminal(&invite("Zoë"), "Zoë", "a good password\na good password\n");
    assert!(is_done, "{text}");
    assert_eq!(sign_in(" ZOE\u{308}", "a good password"), 201);
    let (is_done, text) = join_at_terminal(&invite("Ada"), "Ada", "\n");
    assert!(is_done && text.contains("fo_person_"), "{text}");
    assert_eq!(sign_in("Ada", ""), 401);
}

#[test]
fn commands_invite_and_remove_users() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let people = |args: &[&str]| admin(&server, &[&["people"], args].concat());
    assert!(people(&["list"]).expect_success().contains("no users yet"));
    assert!(
        people(&["invitations"])
            .expect_success()
            .contains("no invitations yet")
    );

    // An organiser, by a link that is valid once.
    let invited = people(&["invite-organiser", "Grace"]).expect_success();
    let link = find_word(&invited, "/join/fo_invite_");
    assert!(link.starts_with(&server.url), "{link} leads to the server");
    join(&server, "nonsense", &["--name", "Grace"])
        .expect_refusal(FAILED, &["expected a link like"]);
    join(&server, &format!("{link}x"), &["--name", "Grace"])
        .expect_refusal(REFUSED, &["the server refused"]);
    join(&server, &link, &["--name", "<b>"])
        .expect_refusal(USAGE_ERROR, &["--name", "letters and digits"]);
    join(&server, &link, &[]).expect_refusal(REFUSED, &["name: expected the name"]);
    join(&server, &link, &["--name", "Grace", "--accept-terms", "1"])
        .expect_refusal(REFUSED, &["this season has no terms"]);
    let output = join(&server, &link, &["--name", "Grace"]).expect_success();
    assert!(
        output.contains("organiser") && output.contains("not shown again"),
        "{output}"
    );
    let grace = find_word(&output, "fo_person_");
    join(&server, &link, &["--name", "Grace again"]).expect_refusal(REFUSED, &["409"]);
    people(&["invite-organiser", ""]).expect_refusal(REFUSED, &["note", "1 to"]);
    let account = member(&server, &grace, "whoami", &[]).expect_success();
    assert!(
        account.contains("Grace") && account.contains("organiser"),
        "{account}"
    );

    // A member of a team, with a password.
    let team = admin_as(&server, &grace, &["create-team", "Alpha"]).expect_success();
    find_word(&team, "fo_team_");
    people(&["invite-member", "Unknown", "Ada"]).expect_refusal(
        FAILED,
        &["there is no team \"Unknown\"", "faceoff admin teams"],
    );
    let invited = people(&["invite-member", "Alpha", "Ada"]).expect_success();
    let link = find_word(&invited, "/join/fo_invite_");
    let with_password = |password: &str| {
        let options = ["--name", "Ada", "--password-stdin"];
        faceoff(&join_args(&server, &link, &options), password)
    };
    with_password("too short\n").expect_refusal(REFUSED, &["password", "12"]);
    let output = with_password("a dozen characters, and more\n").expect_success();
    let ada = find_word(&output, "fo_person_");
    assert!(output.contains("of the team Alpha"), "{output}");
    let members = member(&server, &ada, "team", &["members"]).expect_success();
    assert!(
        members.contains("Ada") && !members.contains("Grace"),
        "{members}"
    );
    // A member may not run organisers' commands.
    for args in [
        &["people", "invite-organiser", "Eve"][..],
        &["registration", "list"],
        &["announce", "a", "b"],
        &["create-team", "Eve"],
    ] {
        admin_as(&server, &ada, args).expect_refusal(NOT_ALLOWED, &["403"]);
    }
    admin_as(&server, "fo_person_unknown", &["people", "list"])
        .expect_refusal(NOT_ALLOWED, &["401"]);

    // The founder of a team.
    let invited = people(&["invite-team", "a founder"]).expect_success();
    let link = find_word(&invited, "/join/fo_invite_");
    let founder_args = ["--name", "Bob", "--affiliation", "TU"];
    join(&server, &link, &founder_args).expect_refusal(USAGE_ERROR, &["--team"]);
    join(&server, &link, &["--name", "Bob"]).expect_refusal(REFUSED, &["expected the team's name"]);
    let with_taken_name = [&founder_args[..], &["--team", "alpha"]].concat();
    join(&server, &link, &with_taken_name).expect_refusal(REFUSED, &["exists already"]);
    let with_new_name = [&founder_args[..], &["--team", "Beta"]].concat();
    let output = join(&server, &link, &with_new_name).expect_success();
    assert!(output.contains("of the team Beta"), "{output}");

    // A revoked link.
    let invited = people(&["invite-member", "Beta", "Carl"]).expect_success();
    let (invitation, link) = (
        find_word(&invited, "-"),
        find_word(&invited, "/join/fo_invite_"),
    );
    let revoked = people(&["uninvite", &invitation]).expect_success();
    assert!(revoked.contains("revoked"), "{revoked}");
    join(&server, &link, &["--name", "Carl"]).expect_refusal(REFUSED, &["409"]);
    people(&["uninvite", UNKNOWN_ID]).expect_refusal(REFUSED, &["404", "invitation"]);
    people(&["uninvite", "Carl"]).expect_refusal(USAGE_ERROR, &["Carl"]);
    let all = people(&["invitations"]).expect_success();
    for note in ["Grace", "Ada", "a founder", "Carl"] {
        assert!(all.contains(&format!("for {note},")), "{note}: {all}");
    }

    // A user who has lost password and token gets a link to the same account.
    people(&["invite-back", "Zoe"]).expect_refusal(FAILED, &["there is no user \"Zoe\""]);
    let invited = people(&["invite-back", "Ada"]).expect_success();
    let link = find_word(&invited, "/join/fo_invite_");
    join(&server, &link, &["--name", "Eve"]).expect_refusal(REFUSED, &["leave the name out"]);
    let ada = find_word(&join(&server, &link, &[]).expect_success(), "fo_person_");
    let account = member(&server, &ada, "whoami", &["--json"]).json();
    assert_eq!(
        (&account["role"], &account["person"]["name"]),
        (&json!("member"), &json!("Ada"))
    );

    // Removing a user needs a confirmation.
    people(&["remove", "Zoe"]).expect_refusal(FAILED, &["there is no user"]);
    for args in [
        &["remove", "Ada"][..],
        &["remove", "Ada", "--confirm", "ada"],
    ] {
        people(args).expect_refusal(REFUSED, &["nothing is done yet", "\"Ada\""]);
    }
    member(&server, &ada, "whoami", &[]).expect_success();
    let removed = people(&["remove", "Ada", "--confirm", "Ada"]).expect_success();
    assert!(removed.contains("left"), "{removed}");
    member(&server, &ada, "whoami", &[]).expect_refusal(NOT_ALLOWED, &["401"]);
    people(&["invite-back", "Ada"]).expect_refusal(REFUSED, &["has left"]);
    let list = admin(&server, &["people", "list", "--json"]).json();
    // Grace, Bob, and Ada, who has left.
    assert_eq!(list.as_array().map(Vec::len), Some(3), "{list:#}");
}

#[test]
fn commands_create_list_rotate_and_revoke_tokens() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let grace = invite_and_join(&server, &["invite-organiser", "Grace"], "Grace");
    let tokens = |args: &[&str]| admin_as(&server, &grace, &[&["token"], args].concat());
    let is_valid = |token: &str| member(&server, token, "whoami", &[]).code == Some(0);

    let made = tokens(&["create", "laptop", "--days", "30"]).expect_success();
    let laptop = find_word(&made, "fo_person_");
    assert!(
        made.contains("not shown again") && is_valid(&laptop),
        "{made}"
    );
    for days in ["0", "-1", "many", "70000"] {
        let days = format!("--days={days}");
        tokens(&["create", "x", &days]).expect_refusal(USAGE_ERROR, &["--days"]);
    }
    tokens(&["create", ""]).expect_refusal(REFUSED, &["name", "1 to"]);
    tokens(&["create", "ci", "--team", "Alpha"]).expect_refusal(USAGE_ERROR, &["--team"]);
    tokens(&["create", "ci", "--team", UNKNOWN_ID]).expect_refusal(REFUSED, &["404"]);
    let team = admin(&server, &["create-team", "Alpha", "--json"]).json();
    let made = tokens(&["create", "ci", "--team", &id(&team), "--json"]).json();
    let ci_token = made["secret"]
        .as_str()
        .expect("it is shown once")
        .to_owned();
    let account = member(&server, &ci_token, "whoami", &[]).expect_success();
    assert!(
        account.contains("API client of the team Alpha"),
        "{account}"
    );

    let list = tokens(&["list"]).expect_success();
    let laptop_line = list.lines().find(|line| line.contains("laptop"));
    let laptop_line = laptop_line.expect("it is listed").to_owned();
    assert!(laptop_line.contains("valid until"), "{laptop_line}");
    for secret in [&laptop, &ci_token, &grace, &server.admin_token] {
        assert!(!list.contains(secret.as_str()), "a list shows no secret");
    }
    let laptop_id = laptop_line
        .split_whitespace()
        .next()
        .expect("its id comes first");

    // A rotated token is invalid at once.
    let rotated = tokens(&["rotate", laptop_id]).expect_success();
    let new_laptop = find_word(&rotated, "fo_person_");
    assert!(!is_valid(&laptop) && is_valid(&new_laptop));
    member(&server, &laptop, "whoami", &[]).expect_refusal(NOT_ALLOWED, &["401"]);
    // The token of the server's operator may revoke the tokens of users, and not rotate them.
    let refused_rotation = admin(&server, &["token", "rotate", laptop_id]);
    refused_rotation.expect_refusal(NOT_ALLOWED, &["403", "only by that user"]);
    for verb in ["rotate", "revoke"] {
        tokens(&[verb, UNKNOWN_ID]).expect_refusal(REFUSED, &["404"]);
        tokens(&[verb, "laptop"]).expect_refusal(USAGE_ERROR, &["laptop"]);
    }
    let revoked = admin(&server, &["token", "revoke", laptop_id]).expect_success();
    assert!(revoked.contains("revoked 2"), "{revoked}");
    assert!(!is_valid(&new_laptop) && is_valid(&grace));
    member(&server, &new_laptop, "whoami", &[]).expect_refusal(NOT_ALLOWED, &["401", "revoked"]);
    tokens(&["rotate", laptop_id]).expect_refusal(REFUSED, &["create another one"]);
    // A second revocation changes nothing.
    tokens(&["revoke", laptop_id]).expect_success();
    // Users have the same commands for their own tokens without `admin`.
    let own_tokens = |args: &[&str]| member(&server, &grace, "token", args);
    let created = own_tokens(&["create", "office"]).expect_success();
    let list = own_tokens(&["list"]).expect_success();
    let office_line = list.lines().find(|line| line.contains(" office "));
    let office_id = find_word(office_line.expect("it is listed"), "-");
    let new_office = find_word(
        &own_tokens(&["rotate", &office_id]).expect_success(),
        "fo_person_",
    );
    assert!(!is_valid(&find_word(&created, "fo_person_")) && is_valid(&new_office));
    own_tokens(&["revoke", &office_id]).expect_success();
    assert!(!is_valid(&new_office));
    own_tokens(&["revoke", "office"]).expect_refusal(USAGE_ERROR, &["office"]);
    let revoked = tokens(&["revoke", &id(&made)]).expect_success();
    assert!(revoked.contains("ci") && !is_valid(&ci_token));
}

#[test]
fn commands_register_teams_and_publish_announcements() {
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

    // Teams must accept the terms, so these are published first.
    let terms = scratch.path().join("terms.txt");
    let publish = |file: &Path| admin(&server, &["publish-terms", &file.to_string_lossy()]);
    publish(&terms).expect_refusal(FAILED, &["reading the terms from", "terms.txt"]);
    fs::write(&terms, " \n").expect("a scratch file can be written");
    publish(&terms).expect_refusal(REFUSED, &["text", "1 to"]);
    fs::write(&terms, b"\xff\xfe").expect("a scratch file can be written");
    publish(&terms).expect_refusal(FAILED, &["reading the terms from"]);
    fs::write(&terms, "Be fair.").expect("a scratch file can be written");
    assert!(
        publish(&terms)
            .expect_success()
            .contains("published as version 1")
    );
    publish(&terms).expect_refusal(REFUSED, &["the same as the current ones"]);

    // Teams can register while registration is open.
    assert!(
        registration(&["list"])
            .expect_success()
            .contains("no team has registered")
    );
    let (status, problem) = register(&team("Alpha"));
    assert_eq!(status, 409, "{problem:#}");
    let open = registration(&["open"]).expect_success();
    assert!(
        open.contains("registration is open; divisions: none"),
        "{open}"
    );
    registration(&["divisions", "Open", "open"]).expect_refusal(REFUSED, &["listed twice"]);
    registration(&["divisions", "<b>"]).expect_refusal(USAGE_ERROR, &["letters and digits"]);
    let with_divisions = registration(&["divisions", "Open", "Students"]).expect_success();
    assert!(
        with_divisions.contains("divisions: Open, Students"),
        "{with_divisions}"
    );
    let mut students = team("Alpha");
    students["team"]["division"] = json!("Students");
    let (_, alpha) = register(&students);
    let (_, beta) = register(&team("Beta"));
    let list = registration(&["list"]).expect_success();
    assert!(
        list.contains("Alpha") && list.contains("ada@example.org, waiting"),
        "{list}"
    );

    let link = alpha["join_link"].as_str().expect("it is shown once");
    let join_args = ["--name", "Ada", "--accept-terms", "1"];
    join(&server, link, &join_args).expect_refusal(REFUSED, &["is pending"]);
    registration(&["approve", UNKNOWN_ID]).expect_refusal(REFUSED, &["404", "registration"]);
    registration(&["approve", "Alpha"]).expect_refusal(USAGE_ERROR, &["Alpha"]);
    let approved = registration(&["approve", &id(&alpha)]).expect_success();
    assert!(approved.contains("approved"), "{approved}");
    registration(&["approve", &id(&alpha)]).expect_refusal(REFUSED, &["was approved"]);
    registration(&["refuse", &id(&beta), ""]).expect_refusal(REFUSED, &["reason"]);
    let refused = registration(&["refuse", &id(&beta), "one team each"]).expect_success();
    assert!(refused.contains("refused: one team each"), "{refused}");
    registration(&["refuse", &id(&beta), "again"]).expect_refusal(REFUSED, &["was refused"]);
    let beta_link = beta["join_link"].as_str().expect("it is shown once");
    join(&server, beta_link, &join_args).expect_refusal(REFUSED, &["one team each"]);
    join(&server, link, &["--name", "Ada"]).expect_refusal(REFUSED, &["consent to version 1"]);
    let output = join(&server, link, &join_args).expect_success();
    let ada = find_word(&output, "fo_person_");
    assert!(
        member(&server, &ada, "team", &["show"])
            .expect_success()
            .contains("Students")
    );
    registration(&["divisions", "Open"]).expect_refusal(REFUSED, &["“Students” has"]);
    assert!(
        registration(&["close"])
            .expect_success()
            .contains("registration is closed")
    );
    assert_eq!(register(&team("Gamma")).0, 409);

    // New terms stop uploads until a member has accepted them.
    fs::write(&terms, "Be fair, and quick.").expect("a scratch file can be written");
    assert!(publish(&terms).expect_success().contains("version 2"));
    let team_command = |args: &[&str]| member(&server, &ada, "team", args);
    let upload = || server.upload(&ada, vec![0x1f, 0x8b, 8, 0]).status();
    assert_eq!(upload(), 403);
    assert!(
        team_command(&["terms"])
            .expect_success()
            .contains("Be fair, and quick.")
    );
    team_command(&["terms", "--accept", "7"]).expect_refusal(REFUSED, &["expected 2", "got 7"]);
    team_command(&["terms", "--accept", "two"]).expect_refusal(USAGE_ERROR, &["--accept"]);
    team_command(&["terms", "--accept", "2"]).expect_success();
    assert_eq!(upload(), 201);

    // Announcements, questions and their answers.
    admin(&server, &["announce", "", "text"]).expect_refusal(REFUSED, &["title"]);
    admin(&server, &["announce", "title", " "]).expect_refusal(REFUSED, &["text"]);
    admin(&server, &["announce", "title"]).expect_refusal(USAGE_ERROR, &["<TEXT>"]);
    admin(
        &server,
        &["announce", "No day on Sunday", "The power is off."],
    )
    .expect_success();
    assert!(
        admin(&server, &["questions"])
            .expect_success()
            .contains("no questions yet")
    );
    team_command(&["ask", ""]).expect_refusal(REFUSED, &["text"]);
    team_command(&["ask", "May we use two arms?"]).expect_success();
    let questions = admin(&server, &["questions", "--json"]).json();
    let question_id = id(&questions[0]);
    admin(&server, &["answer", UNKNOWN_ID, "No."]).expect_refusal(REFUSED, &["404", "question"]);
    admin(&server, &["answer", "first", "No."]).expect_refusal(USAGE_ERROR, &["first"]);
    admin(&server, &["answer", &question_id, ""]).expect_refusal(REFUSED, &["text"]);
    admin(&server, &["answer", &question_id, "No.", "--public"]).expect_success();
    let news = team_command(&["news"]).expect_success();
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
fn server_start_replaces_revoked_operator_token() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let data = scratch.path().join("data");
    let token_file = data.join("admin-token");
    // Runs an organiser's command with the token in the data folder.
    let with_token_file = |server: &Server, args: &[&str]| {
        let folder = data.to_string_lossy();
        let options = ["admin", "--server", &server.url, "--data-dir", &folder];
        faceoff(&[&options[..], args].concat(), "")
    };
    let server = Server::start(&data, CONFIG);
    let first_token = server.admin_token.clone();
    let grace = invite_and_join(&server, &["invite-organiser", "Grace"], "Grace");
    // A start with a valid token keeps the token.
    server.kill();
    let server = Server::start(&data, CONFIG);
    assert_eq!(server.admin_token, first_token);
    with_token_file(&server, &["people", "list"]).expect_success();

    let list = admin_as(&server, &grace, &["token", "list", "--json"]).json();
    let list = list.as_array().expect("a list");
    let operator_token = list.iter().find(|token| token["name"] == "admin-token");
    let operator_token_id = id(operator_token.expect("the operator has a token"));
    // The operator's token cannot be rotated: the file would keep the old one, and the next start would use it.
    with_token_file(&server, &["token", "rotate", &operator_token_id])
        .expect_refusal(REFUSED, &["data folder", "revoke it"]);
    admin_as(&server, &grace, &["token", "rotate", &operator_token_id])
        .expect_refusal(NOT_ALLOWED, &["only with a token of the operator"]);
    admin_as(&server, &grace, &["token", "revoke", &operator_token_id]).expect_success();
    with_token_file(&server, &["people", "list"]).expect_refusal(NOT_ALLOWED, &["401", "revoked"]);
    server.kill();

    let server = Server::start(&data, CONFIG);
    assert_ne!(server.admin_token, first_token);
    server.wait_for_log("was revoked; creating a new one", 1);
    let mode = fs::metadata(&token_file)
        .expect("the file exists")
        .permissions()
        .mode();
    assert_eq!(mode & 0o777, 0o600);
    with_token_file(&server, &["people", "list"]).expect_success();
    admin_as(&server, &first_token, &["people", "list"])
        .expect_refusal(NOT_ALLOWED, &["401", "revoked"]);
    admin_as(&server, &grace, &["people", "list"]).expect_success();
    // A revoked token stays revoked, even if it is written back to the file.
    server.kill();
    fs::write(&token_file, format!("{first_token}\n")).expect("the file can be written");
    let server = Server::start(&data, CONFIG);
    assert_ne!(server.admin_token, first_token);
    admin_as(&server, &first_token, &["people", "list"])
        .expect_refusal(NOT_ALLOWED, &["401", "revoked"]);
    // A missing token is reported, too.
    fs::remove_file(&token_file).expect("the file can be removed");
    with_token_file(&server, &["people", "list"]).expect_refusal(
        NOT_ALLOWED,
        &["reading the operator's token from", "--data-dir"],
    );
}
