//! Packages of Python: in the runtime that the organiser made, and in the bundle.

use crate::{CONFIG, commands::faceoff};
use faceoff_tests::{
    packages::{python3_ml, test_bundle, vendor},
    server::Server,
};
use serde_json::{Value, json};
use std::{
    fs,
    path::{Path, PathBuf},
};

/// A configuration that offers `python3-ml`, of agents with all the CPU time that there is.
pub fn with_python3_ml(scratch: &Path) -> PathBuf {
    let file = scratch.join("python3-ml.toml");
    fs::write(&file, offering_python3_ml()).expect("a scratch file can be written");
    file
}

pub fn offering_python3_ml() -> String {
    format!(
        "{CONFIG}\n[limits]\ncpus = 64.0\n[runtimes.python3-ml]\nfolder = {:?}\n",
        python3_ml()
    )
}

fn text(path: &Path) -> &str {
    path.to_str().expect("scratch paths are text")
}

/// Plays two episodes of `defend` with more arguments; what is in `results.json`.
fn played(bundle: &Path, out: &Path, more: &[&str]) -> Value {
    let args = ["eval", text(bundle), "--out", text(out)];
    let what = ["--task", "defend", "--episodes", "2"];
    let told = faceoff(&[&args[..], &what, more].concat(), "").done();
    assert!(!told.contains("fault:"), "{told}");
    let results = fs::read(out.join("results.json")).expect("an evaluation leaves results");
    serde_json::from_slice(&results).expect("results are JSON")
}

#[test]
fn a_network_plays_in_the_runtime_that_the_organiser_made() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = with_python3_ml(scratch.path());
    let bundle = test_bundle("onnx", scratch.path());
    // On a CPU of its own where there are two, and on all of them at once.
    for workers in ["1", "2"] {
        let out = scratch.path().join(workers);
        let more = ["--config", text(&config), "--workers", workers];
        let results = played(&bundle, &out, &more);
        let task = &results["tasks"]["defend"];
        assert_eq!(task["episodes"], 2, "{results:#}");
        // It all but holds still: the arm breaks nothing.
        assert_eq!(task["violations"]["joint_vel"], 0, "{results:#}");
    }
}

#[test]
fn a_server_tells_what_it_found_in_its_runtimes_and_so_does_the_doctor() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), &offering_python3_ml());
    let told: Value = server
        .get("/api/v1/runtimes", None)
        .json()
        .expect("the API speaks JSON");
    let of = |name: &str| {
        let runtimes = told["runtimes"].as_array().expect("a list");
        let found = runtimes.iter().find(|runtime| runtime["name"] == name);
        found
            .unwrap_or_else(|| panic!("{name} is offered: {told:#}"))
            .clone()
    };
    let (python, ml, native) = (of("python3"), of("python3-ml"), of("native"));
    assert_eq!(
        (&python["kind"], &ml["kind"]),
        (&json!("python"), &json!("python"))
    );
    assert_eq!(python["version"], ml["version"], "one is made of the other");
    assert_eq!(
        (&native["kind"], &native["libc"]),
        (&json!("native"), &ml["libc"])
    );
    assert_ne!(native["libc"], Value::Null);
    let pinned = include_str!("../../docker/python3-ml/requirements.txt");
    let mut packages = 0;
    for line in pinned.lines() {
        if let Some((name, version)) = line.trim_end_matches(" \\").split_once("==") {
            assert_eq!(ml["packages"][name], version, "{name}");
            packages += 1;
        }
    }
    let found = ml["packages"].as_object().expect("an object");
    assert_eq!(
        found.len(),
        packages,
        "the host's packages are not there: {ml:#}"
    );

    let config = with_python3_ml(scratch.path());
    let doctor = faceoff(&["doctor", "--config", text(&config)], "").done();
    assert!(doctor.contains("numpy 2"), "{doctor}");
    let gone = scratch.path().join("gone.toml");
    fs::write(&gone, "[runtimes.python3-ml]\nfolder = \"/nowhere\"\n").expect("a scratch file");
    let doctor = faceoff(&["doctor", "--config", text(&gone)], "").done();
    for words in [
        "/nowhere/bin/python3 does not exist",
        "docker/runtime.sh /nowhere",
    ] {
        assert!(doctor.contains(words), "{doctor}");
    }
    let data = scratch.path().join("unused");
    let serve = ["serve", "--config", text(&gone), "--data-dir", text(&data)];
    faceoff(&serve, "").not_done(1, &["runtimes.python3-ml", "docker/runtime.sh /nowhere"]);
}

#[test]
fn a_bundle_brings_a_compiled_package_of_its_own() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = scratch.path().join("patient.toml");
    fs::write(&config, CONFIG).expect("a scratch file can be written");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let told: Value = server
        .get("/api/v1/runtimes", None)
        .json()
        .expect("the API speaks JSON");
    let runtimes = told["runtimes"].as_array().expect("a list");
    let python = runtimes.iter().find(|runtime| runtime["name"] == "python3");
    let version = python.expect("python3 is offered")["version"].as_str();
    let mut parts = version.expect("it has a version").splitn(3, '.');
    let minor = [parts.next(), parts.next()].map(|part| part.expect("three numbers"));
    let bundle = test_bundle("vendored", scratch.path());
    vendor(&bundle, &minor.join("."));
    let compiled = fs::read_dir(bundle.join("vendor/markupsafe")).expect("it was installed");
    let mut names = compiled.map(|entry| entry.expect("a folder can be read").file_name());
    assert!(names.any(|name| name.to_string_lossy().ends_with(".so")));
    let results = played(
        &bundle,
        &scratch.path().join("out"),
        &["--config", text(&config)],
    );
    assert_eq!(results["tasks"]["defend"]["episodes"], 2, "{results:#}");
}
