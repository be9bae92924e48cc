//! `faceoff eval --like-server`: local evaluation of a bundle with the rules and limits of a server's *stage*. A stage is a part
//! of the season with its own tasks, simulator profile, limits and ruleset.

use crate::{
    CONFIG,
    commands::{CommandOutput, FAILED, UNREACHABLE, USAGE_ERROR, admin, faceoff},
    python_packages::python3_ml_config,
};
use faceoff_tests::{
    bundle::{example_agent, python_agent, python_bundle},
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

/// The current ruleset: the version of the competition's rules that this program implements.
const RULESET: &str = "airhockey-2023.3";

fn path_text(path: &Path) -> &str {
    path.to_str().expect("scratch paths are text")
}

/// Arguments of `faceoff eval --like-server` for one episode.
fn eval_args<'a>(
    bundle: &'a Path,
    url: &'a str,
    out: &'a Path,
    options: &[&'a str],
) -> Vec<String> {
    let args = [
        "eval",
        path_text(bundle),
        "--like-server",
        url,
        "--out",
        path_text(out),
        "--episodes",
        "1",
    ];
    [&args[..], options]
        .concat()
        .into_iter()
        .map(str::to_owned)
        .collect()
}

fn run(args: &[String]) -> CommandOutput {
    faceoff(&args.iter().map(String::as_str).collect::<Vec<_>>(), "")
}

fn change_stage(server: &Server, options: &[&str]) -> String {
    let args = ["stage", "change", "Qualifying", "--confirm", "Qualifying"];
    admin(server, &[&args[..], options].concat()).expect_success()
}

#[test]
fn local_evaluation_uses_rules_and_limits_of_server_stage() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let out = scratch.path().join("out");
    let hold = example_agent("hold", scratch.path());
    let output = run(&eval_args(&hold, &server.url, &out, &["--task", "hit"])).expect_success();
    for text in [
        "stage “Qualifying”, revision 1",
        "600 s to start",
        "no differences found",
    ] {
        assert!(output.contains(text), "{output}");
    }
    change_stage(
        &server,
        &[
            "--tasks",
            "defend",
            "--profile",
            "ideal",
            "--limits",
            // 64 MiB
            r#"{"memory_bytes":67108864}"#,
        ],
    );
    // Without options, the stage's tasks and profile are used. The agent allocates twice the memory that the stage allows.
    let bundle = python_bundle(
        scratch.path(),
        "memory-hungry",
        &python_agent("ballast = b\"x\" * (128 << 20)\nsay(hold)"),
    );
    let output = run(&eval_args(&bundle, &server.url, &out, &["--allow-faults"])).expect_success();
    let fault = "exceeded its memory limit: 67108864 bytes used";
    assert!(output.contains(fault), "{output}");
    let output = run(&eval_args(&hold, &server.url, &out, &[])).expect_success();
    assert!(
        output.contains("revision 2") && output.contains("64 MiB"),
        "{output}"
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
fn unsupported_bundle_or_server_is_refused_with_reason() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), &python3_ml_config());
    let out = scratch.path().join("out");
    let hold = example_agent("hold", scratch.path());
    let assert_failure = |code, bundle: &Path, url: &str, options: &[&str], words: &[&str]| {
        let errors = run(&eval_args(bundle, url, &out, options)).expect_failure(code);
        for word in words {
            assert!(errors.contains(word), "{word:?} is not in {errors:?}");
        }
    };
    let assert_refused = |bundle: &Path, url: &str, options: &[&str], words: &[&str]| {
        assert_failure(FAILED, bundle, url, options, words);
    };
    // The test bundle `onnx` needs the runtime python3-ml, which only the server has.
    let onnx = test_bundle("onnx", scratch.path());
    assert_refused(
        &onnx,
        &server.url,
        &[],
        &["python3-ml", "this machine does not", "docker/runtime.sh"],
    );
    assert_refused(
        &hold,
        &server.url,
        &["--stage", "Finals"],
        &["no stage “Finals”", "“Qualifying”"],
    );
    change_stage(&server, &["--runtimes", "native"]);
    assert_refused(
        &hold,
        &server.url,
        &[],
        &["names the runtime python3", "“Qualifying”", "allows native"],
    );

    let unused_port = TcpListener::bind("127.0.0.1:0").expect("there is a free port");
    let unreachable_url = format!(
        "http://{}",
        unused_port.local_addr().expect("it has an address")
    );
    drop(unused_port);
    assert_failure(
        UNREACHABLE,
        &hold,
        &unreachable_url,
        &[],
        &["cannot evaluate like the server", "talking to"],
    );
    run(&["eval", path_text(&hold), "--stage", "Qualifying"].map(str::to_owned))
        .expect_refusal(USAGE_ERROR, &["--like-server"]);

    let runtimes = server
        .get("/api/v1/runtimes", None)
        .text()
        .expect("the API speaks text");
    let with_later_ruleset = runtimes.replace(RULESET, "airhockey-2031.1");
    assert_ne!(runtimes, with_later_ruleset);
    assert_refused(
        &hold,
        &fake_server(vec![with_later_ruleset]),
        &[],
        &["airhockey-2031.1", RULESET, "version of faceoff"],
    );
    // A server of this version with a stage of an earlier ruleset.
    let stages = server
        .get("/api/v1/stages", None)
        .text()
        .expect("the API speaks text");
    let with_earlier_ruleset = stages.replace(RULESET, "airhockey-2023.2");
    assert_ne!(stages, with_earlier_ruleset);
    assert_refused(
        &hold,
        &fake_server(vec![runtimes, with_earlier_ruleset]),
        &[],
        &[
            "“Qualifying” still uses the ruleset airhockey-2023.2",
            RULESET,
            "--stage",
        ],
    );
    // A refused evaluation writes no results.
    assert!(!out.join("results.json").exists());
}

/// The address of a server that sends these bodies, one for each request.
fn fake_server(bodies: Vec<String>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").expect("there is a free port");
    let address = listener.local_addr().expect("it has an address");
    thread::spawn(move || {
        for body in bodies {
            let (mut client, _) = listener.accept().expect("the program connects");
            let mut request = Vec::new();
            let mut byte = [0];
            while !request.ends_with(b"\r\n\r\n")
                && client.read(&mut byte).is_ok_and(|read| read == 1)
            {
                request.push(byte[0]);
            }
            let answer = format!(
                "HTTP/1.1 200 OK\r\ncontent-type: application/json\r\ncontent-length: {}\r\nconnection: close\r\n\r\n{body}",
                body.len()
            );
            client
                .write_all(answer.as_bytes())
                .expect("the program reads the answer");
        }
    });
    format!("http://{address}")
}
