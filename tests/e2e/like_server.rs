//! `faceoff eval --like-server`: a server's rules and limits at home.

use crate::{
    CONFIG,
    commands::{FAILED, MISUSED, UNREACHABLE, admin, faceoff},
    packages::offering_python3_ml,
};
use faceoff_tests::{
    bundle::{python_agent, python_bundle, reference},
    packages::test_bundle,
    server::Server,
};
use serde_json::Value;
use std::{
    fs,
    io::{Read as _, Write as _},
    net::TcpListener,
    path::Path,
    thread,
};

fn text(path: &Path) -> &str {
    path.to_str().expect("scratch paths are text")
}

/// `faceoff eval` of one episode like a server.
fn eval<'a>(bundle: &'a Path, url: &'a str, out: &'a Path, more: &[&'a str]) -> Vec<String> {
    let args = [
        "eval",
        text(bundle),
        "--like-server",
        url,
        "--out",
        text(out),
        "--episodes",
        "1",
    ];
    [&args[..], more]
        .concat()
        .into_iter()
        .map(str::to_owned)
        .collect()
}

fn run(args: &[String]) -> crate::commands::Told {
    faceoff(&args.iter().map(String::as_str).collect::<Vec<_>>(), "")
}

fn change(server: &Server, more: &[&str]) -> String {
    let args = ["stage", "change", "Qualifying", "--confirm", "Qualifying"];
    admin(server, &[&args[..], more].concat()).done()
}

#[test]
fn a_bundle_is_played_by_the_rules_and_limits_of_a_servers_stage() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let out = scratch.path().join("out");
    let hold = reference("hold", scratch.path());
    let told = run(&eval(&hold, &server.url, &out, &["--task", "hit"])).done();
    for words in [
        "stage “Qualifying”, revision 1",
        "600 s to start",
        "nothing that can be compared differs",
    ] {
        assert!(told.contains(words), "{told}");
    }
    change(
        &server,
        &[
            "--tasks",
            "defend",
            "--profile",
            "ideal",
            "--limits",
            r#"{"memory_bytes":67108864}"#,
        ],
    );
    // Its tasks and its profile, unless others are named.
    let bundle = python_bundle(
        scratch.path(),
        "hungry",
        &python_agent("kept = b\"x\" * (128 << 20)\nsay(hold)"),
    );
    let told = run(&eval(&bundle, &server.url, &out, &["--allow-faults"])).done();
    let fault = "exceeded its memory limit: 67108864 bytes used";
    assert!(told.contains(fault), "{told}");
    let log = run(&eval(&hold, &server.url, &out, &[])).done();
    assert!(
        log.contains("revision 2") && log.contains("64 MiB"),
        "{log}"
    );
    let results = fs::read(out.join("results.json")).expect("an evaluation leaves results");
    let results: Value = serde_json::from_slice(&results).expect("results are JSON");
    assert_eq!(results["profile"], "ideal");
    let tasks: Vec<_> = results["tasks"]
        .as_object()
        .expect("an object")
        .keys()
        .collect();
    assert_eq!(tasks, ["defend"]);
}

#[test]
fn what_the_server_does_not_take_or_cannot_tell_is_refused_in_words() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), &offering_python3_ml());
    let out = scratch.path().join("out");
    let hold = reference("hold", scratch.path());
    let ended = |code, bundle: &Path, url: &str, more: &[&str], words: &[&str]| {
        let told = run(&eval(bundle, url, &out, more)).failed(code);
        for word in words {
            assert!(told.contains(word), "{word:?} is not in {told:?}");
        }
    };
    let refused = |bundle: &Path, url: &str, more: &[&str], words: &[&str]| {
        ended(FAILED, bundle, url, more, words);
    };
    let onnx = test_bundle("onnx", scratch.path());
    refused(
        &onnx,
        &server.url,
        &[],
        &["python3-ml", "this machine does not", "docker/runtime.sh"],
    );
    refused(
        &hold,
        &server.url,
        &["--stage", "Finals"],
        &["no stage “Finals”", "“Qualifying”"],
    );
    change(&server, &["--runtimes", "native"]);
    refused(
        &hold,
        &server.url,
        &[],
        &["names the runtime python3", "“Qualifying”", "takes native"],
    );

    let free = TcpListener::bind("127.0.0.1:0").expect("there is a free port");
    let nobody = format!("http://{}", free.local_addr().expect("it has an address"));
    drop(free);
    ended(
        UNREACHABLE,
        &hold,
        &nobody,
        &[],
        &["cannot evaluate like the server", "talking to"],
    );
    run(&["eval", text(&hold), "--stage", "Qualifying"].map(str::to_owned))
        .not_done(MISUSED, &["--like-server"]);

    let told = server
        .get("/api/v1/runtimes", None)
        .text()
        .expect("the API speaks text");
    let other = told.replace("airhockey-2023.3", "airhockey-2031.1");
    assert_ne!(told, other);
    refused(
        &hold,
        &answering(vec![other]),
        &[],
        &["airhockey-2031.1", "airhockey-2023.3", "version of faceoff"],
    );
    // A server of this version, whose stage began under the ruleset before.
    let stages = server
        .get("/api/v1/stages", None)
        .text()
        .expect("the API speaks text");
    let earlier = stages.replace("airhockey-2023.3", "airhockey-2023.2");
    assert_ne!(stages, earlier);
    refused(
        &hold,
        &answering(vec![told, earlier]),
        &[],
        &[
            "“Qualifying” still plays by airhockey-2023.2",
            "airhockey-2023.3",
            "--stage",
        ],
    );
    // What was never played leaves nothing behind.
    assert!(!out.join("results.json").exists());
}

/// The address of a server that gives these answers, one after the other.
fn answering(bodies: Vec<String>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("there is a free port");
    let address = listener.local_addr().expect("it has an address");
    thread::spawn(move || {
        for body in bodies {
            let (mut client, _) = listener.accept().expect("somebody asks");
            let mut asked = Vec::new();
            let mut byte = [0];
            while !asked.ends_with(b"\r\n\r\n")
                && client.read(&mut byte).is_ok_and(|read| read == 1)
            {
                asked.push(byte[0]);
            }
            let answer = format!(
                "HTTP/1.1 200 OK\r\ncontent-type: application/json\r\ncontent-length: {}\r\nconnection: close\r\n\r\n{body}",
                body.len()
            );
            client.write_all(answer.as_bytes()).expect("it listens");
        }
    });
    format!("http://{address}")
}
