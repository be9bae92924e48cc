//! Runtimes: which files of the host programs find, natively, with Python, and with a copy of the files in memory.

use crate::harness::{Subject, expect_echo, expect_line};
use faceoff_sandbox::{MemoryImage, Runtime};
use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
};

#[test]
fn native_program_finds_its_libraries_only() {
    let mut subject = Subject::new("echo", &[]);
    let program = subject.bundle.path().join("agent");
    fs::copy("/usr/bin/cat", &program).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    subject.spec.runtime = Runtime::native();
    subject.spec.command = vec!["./agent".into()];
    let mut agent = subject.spawn();
    expect_echo(&mut agent, "hello");
    subject.finish(agent);
    assert!(
        !subject
            .spec
            .runtime
            .read_only_paths
            .iter()
            .any(|path| path.starts_with("/usr/bin"))
    );
}

#[test]
fn script_finds_its_interpreter() {
    let mut subject = Subject::new("echo", &[]);
    let text = fs::read_to_string(subject.bundle.path().join("echo.py")).unwrap();
    for (name, first_line) in [("env", "#!/usr/bin/env python3"), ("direct", "#!/bin/sh")] {
        let program = subject.bundle.path().join(name);
        let body = if name == "env" {
            text.clone()
        } else {
            "exec python3 echo.py \"$@\"".into()
        };
        fs::write(&program, format!("{first_line}\n{body}\n")).unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
        subject.spec.command = vec![format!("./{name}"), subject.mark.clone()];
        let mut agent = subject.spawn();
        expect_echo(&mut agent, "hello");
        subject.finish(agent);
    }
}

#[test]
fn python_outside_of_usr_shows_only_its_prefix() {
    // A copy of the host's Python in its own prefix, as pyenv lays it out. Not in /tmp: the agent would not see it
    // there, and the underlying Python would start instead.
    let host = tempfile::tempdir_in("/var/tmp").unwrap();
    fs::set_permissions(host.path(), fs::Permissions::from_mode(0o755)).unwrap();
    let prefix = host.path().join("python");
    fs::write(host.path().join("secret"), "secret").unwrap();
    let host_python = Runtime::python3().unwrap().interpreter().unwrap();
    let venv = std::process::Command::new(&host_python)
        .args(["-m", "venv", "--without-pip", prefix.to_str().unwrap()])
        .output()
        .unwrap();
    assert!(venv.status.success(), "{venv:?}");
    let runtime = Runtime::python3_at(&prefix.join("bin/python3")).unwrap();
    assert!(
        runtime.read_only_paths.iter().any(|path| path == &prefix),
        "{runtime:?}"
    );
    assert!(
        !runtime
            .read_only_paths
            .iter()
            .any(|path| host.path().starts_with(path)),
        "{runtime:?}"
    );
    let mut subject = Subject::new("echo", &[]);
    subject.spec.runtime = runtime;
    let mut agent = subject.spawn();
    expect_echo(&mut agent, "hello");
    subject.finish(agent);
    let question = "import sys; print(sys.prefix)";
    subject.spec.command = ["python3", "-c", question, subject.mark.as_str()]
        .map(str::to_owned)
        .to_vec();
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), prefix.to_str().unwrap());
    subject.finish(agent);
}

#[test]
fn runtime_in_memory_replaces_the_hosts_files() {
    let mut subject = Subject::new("echo", &[]);
    let program = subject.bundle.path().join("agent");
    fs::copy("/usr/bin/cat", &program).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    // Only the libraries that this program needs: all libraries of a developer's host are too many to copy.
    let output = std::process::Command::new("ldd")
        .arg(&program)
        .output()
        .unwrap();
    let output = String::from_utf8(output.stdout).unwrap();
    let needed: Vec<&Path> = output
        .split_whitespace()
        .filter(|word| word.starts_with('/'))
        .map(Path::new)
        .collect();
    let mut paths = vec!["/lib".into(), "/lib64".into(), "/usr/lib64".into()];
    paths
        .retain(|path: &PathBuf| path.is_symlink() || path.ends_with("usr/lib64") && path.exists());
    paths.extend(needed.iter().map(|path| fs::canonicalize(path).unwrap()));
    let runtime = Runtime {
        read_only_paths: paths,
        ..Runtime::native()
    };
    let mut runtimes = BTreeMap::from([("native".to_owned(), runtime)]);
    let image = MemoryImage::make(&mut runtimes, 1 << 30).unwrap();
    subject.spec.runtime = runtimes.remove("native").unwrap();
    subject.spec.command = vec!["./agent".into(), "/proc/self/mountinfo".into(), "-".into()];
    let mut agent = subject.spawn();
    let library = fs::canonicalize(needed[0]).unwrap();
    let library = format!(" {} ", library.display());
    let mount = loop {
        let line = expect_line(&mut agent);
        if line.contains(&library) {
            break line;
        }
    };
    assert!(
        mount.contains(" - tmpfs ") && mount.contains("/faceoff-runtime-"),
        "{mount}"
    );
    subject.finish(agent);
    drop(image);
}

#[test]
fn program_that_is_no_python_is_refused() {
    assert!(Runtime::python3_at(Path::new("/no/such/python3")).is_err());
    assert!(Runtime::python3_at(Path::new("/usr/bin/cat")).is_err());
}
