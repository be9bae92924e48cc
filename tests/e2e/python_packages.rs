//! Python packages that an agent imports: from a runtime (a folder with an interpreter and packages) of the organiser, here
//! `python3-ml`, or from the team's own bundle.

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

/// Writes [`python3_ml_config`] to a file.
fn python3_ml_config_file(scratch: &Path) -> PathBuf {
    let file = scratch.join("python3-ml.toml");
    fs::write(&file, python3_ml_config()).expect("a scratch file can be written");
    file
}

/// A configuration that offers the runtime `python3-ml` and does not limit CPU time.
pub fn python3_ml_config() -> String {
    format!(
        "{CONFIG}\n[limits]\ncpus = 64.0\n[runtimes.python3-ml]\nfolder = {:?}\n",
        python3_ml()
    )
}

fn path_text(path: &Path) -> &str {
    path.to_str().expect("scratch paths are text")
}

/// Evaluates two episodes of `defend` and returns `results.json`.
fn evaluate(bundle: &Path, out: &Path, options: &[&str]) -> Value {
    let args = ["eval", path_text(bundle), "--out", path_text(out)];
    let size = ["--task", "defend", "--episodes", "2"];
    let output = faceoff(&[&args[..], &size, options].concat(), "").expect_success();
    assert!(!output.contains("fault:"), "{output}");
    let results = fs::read(out.join("results.json")).expect("an evaluation leaves results");
    serde_json::from_slice(&results).expect("results are JSON")
}

#[test]
fn neural_network_runs_in_organiser_runtime() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = python3_ml_config_file(scratch.path());
    let bundle = test_bundle("onnx", scratch.path());
    // One worker gets separate CPUs if there are at least two; two workers share all CPUs.
    for workers in ["1", "2"] {
        let out = scratch.path().join(workers);
        let options = ["--config", path_text(&config), "--workers", workers];
        let results = evaluate(&bundle, &out, &options);
        let task = &results["tasks"]["defend"];
        assert_eq!(task["episodes"], 2, "{results:#}");
        // The arm almost holds still, so it violates no limit.
        assert_eq!(task["violations"]["joint_vel"], 0, "{results:#}");
    }
}

#[test]
fn server_and_doctor_report_contents_of_runtimes() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let server = Server::start(&scratch.path().join("data"), &python3_ml_config());
    let inventory: Value = server
        .get("/api/v1/runtimes", None)
        .json()
        .expect("the API speaks JSON");
    let runtime = |name: &str| {
        let runtimes = inventory["runtimes"].as_array().expect("a list");
        let found = runtimes.iter().find(|runtime| runtime["name"] == name);
        found
            .unwrap_or_else(|| panic!("{name} is offered: {inventory:#}"))
            .clone()
    };
    let (python, python_ml, native) =
        (runtime("python3"), runtime("python3-ml"), runtime("native"));
    assert_eq!(
        (&python["kind"], &python_ml["kind"]),
        (&json!("python"), &json!("python"))
    );
    assert_eq!(
        python["version"], python_ml["version"],
        "python3-ml is based on python3"
    );
    assert_eq!(
        (&native["kind"], &native["libc"]),
        (&json!("native"), &python_ml["libc"])
    );
    assert_ne!(native["libc"], Value::Null);
    let requirements = include_str!("../../docker/python3-ml/requirements.txt");
    let mut package_count = 0;
    for line in requirements.lines() {
        if let Some((name, version)) = line.trim_end_matches(" \\").split_once("==") {
            assert_eq!(python_ml["packages"][name], version, "{name}");
            package_count += 1;
        }
    }
    let packages = python_ml["packages"].as_object().expect("an object");
    assert_eq!(
        packages.len(),
        package_count,
        "packages of the host are not visible: {python_ml:#}"
    );

    let config = python3_ml_config_file(scratch.path());
    let doctor = faceoff(&["doctor", "--config", path_text(&config)], "").expect_success();
    assert!(doctor.contains("numpy 2"), "{doctor}");
    let missing_runtime = scratch.path().join("missing-runtime.toml");
    fs::write(
        &missing_runtime,
        "[runtimes.python3-ml]\nfolder = \"/nowhere\"\n",
    )
    .expect("a scratch file");
    let doctor = faceoff(&["doctor", "--config", path_text(&missing_runtime)], "").expect_success();
    for text in [
        "/nowhere/bin/python3 does not exist",
        "docker/runtime.sh /nowhere",
    ] {
        assert!(doctor.contains(text), "{doctor}");
    }
    let data = scratch.path().join("unused");
    let serve = [
        "serve",
        "--config",
        path_text(&missing_runtime),
        "--data-dir",
        path_text(&data),
    ];
    faceoff(&serve, "").expect_refusal(1, &["runtimes.python3-ml", "docker/runtime.sh /nowhere"]);
}

#[test]
fn bundle_with_compiled_package_is_evaluated() {
    let scratch = tempfile::tempdir().expect("a scratch folder can be made");
    let config = scratch.path().join("long_time_limits.toml");
    fs::write(&config, CONFIG).expect("a scratch file can be written");
    let server = Server::start(&scratch.path().join("data"), CONFIG);
    let inventory: Value = server
        .get("/api/v1/runtimes", None)
        .json()
        .expect("the API speaks JSON");
    let runtimes = inventory["runtimes"].as_array().expect("a list");
    let python = runtimes.iter().find(|runtime| runtime["name"] == "python3");
    let version = python.expect("python3 is offered")["version"].as_str();
    let mut parts = version.expect("it has a version").splitn(3, '.');
    let major_and_minor =
        [parts.next(), parts.next()].map(|part| part.expect("a version has three numbers"));
    let bundle = test_bundle("vendored", scratch.path());
    // Installs packages for this version of Python into the bundle's folder `vendor`.
    vendor(&bundle, &major_and_minor.join("."));
    let installed_files = fs::read_dir(bundle.join("vendor/markupsafe")).expect("it was installed");
    let mut names = installed_files.map(|entry| entry.expect("a folder can be read").file_name());
    assert!(names.any(|name| name.to_string_lossy().ends_with(".so")));
    let results = evaluate(
        &bundle,
        &scratch.path().join("out"),
        &["--config", path_text(&config)],
    );
    assert_eq!(results["tasks"]["defend"]["episodes"], 2, "{results:#}");
}
