//! Agents that are container images: the unpacked image is the agent's root folder.

use crate::harness::{Subject, TIMEOUT, expect_echo, expect_line};
use faceoff_sandbox::{AgentProcess, Isolation, Layer, Runtime, SpawnError};
use faceoff_types::AgentFaultKind;
use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::{PermissionsExt, symlink},
    path::Path,
};

/// A root folder with a shell and its shared libraries.
struct ImageRoot(tempfile::TempDir);

impl ImageRoot {
    fn new() -> Self {
        let folder = tempfile::Builder::new()
            .prefix("image-")
            .permissions(fs::Permissions::from_mode(0o755))
            .tempdir()
            .unwrap();
        let root = Self(folder);
        for folder in ["agent", "dev", "etc", "opt/bin", "proc", "sys", "tmp"] {
            fs::create_dir_all(root.path_of(folder)).unwrap();
        }
        for file in ["passwd", "group", "own"] {
            root.write(&format!("etc/{file}"), "the image's", 0o644);
        }
        let shell = fs::canonicalize("/bin/sh").unwrap();
        let output = std::process::Command::new("ldd").arg(&shell).output();
        let output = String::from_utf8(output.unwrap().stdout).unwrap();
        let libraries = output
            .split_whitespace()
            .filter(|word| word.starts_with('/'));
        for library in libraries {
            let copy = root.path_of(&library[1..]);
            fs::create_dir_all(copy.parent().unwrap()).unwrap();
            fs::copy(library, copy).unwrap();
        }
        fs::copy(shell, root.path_of("opt/bin/the-shell")).unwrap();
        // Links are resolved in the root, whatever files the host has at these paths.
        symlink("opt/bin", root.path_of("bin")).unwrap();
        symlink("/bin/the-shell", root.path_of("opt/bin/sh")).unwrap();
        root
    }

    fn path_of(&self, path: &str) -> std::path::PathBuf {
        self.0.path().join(path)
    }

    fn write(&self, path: &str, content: &str, mode: u32) {
        fs::write(self.path_of(path), content).unwrap();
        fs::set_permissions(self.path_of(path), fs::Permissions::from_mode(mode)).unwrap();
    }

    /// An agent of this image that runs `command`, with a `PATH` as from an image's `ENV`.
    fn subject(&self, command: &[&str]) -> Subject {
        let mut subject = Subject::new("echo", &[]);
        subject.spec.bundle_dir = self.path_of("agent");
        subject.spec.runtime = Runtime::from_image(self.0.path(), "/opt/bin");
        subject.spec.command = command.iter().map(|&word| word.to_owned()).collect();
        subject.spec.command.push(subject.mark.clone());
        subject
    }

    /// Output lines of a script that uses shell built-ins only.
    fn output(&self, script: &str) -> Vec<String> {
        let subject = self.subject(&["sh", "-c", &format!("{script}\necho end")]);
        let mut agent = subject.spawn();
        let mut lines = Vec::new();
        loop {
            match expect_line(&mut agent) {
                line if line == "end" => break,
                line => lines.push(line),
            }
        }
        let usage = agent.finish(TIMEOUT).unwrap();
        assert_eq!(usage.exit, None, "{}", usage.stderr);
        subject.assert_nothing_left();
        lines
    }
}

/// The text of the platform fault with which the start was refused.
fn refusal(spawned: Result<AgentProcess, SpawnError>) -> String {
    match spawned {
        Err(SpawnError::Platform(error)) => error.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn image_starts_and_answers() {
    let root = ImageRoot::new();
    root.write(
        "agent/run",
        "#!/bin/sh\nwhile read -r line; do echo \"$line\"; done\n",
        0o755,
    );
    for program in ["./run", "/agent/run"] {
        let subject = root.subject(&[program]);
        let mut agent = subject.spawn();
        expect_echo(&mut agent, "hello");
        subject.finish(agent);
    }
}

#[test]
fn image_sees_only_its_own_files() {
    let root = ImageRoot::new();
    let hidden = tempfile::tempdir().unwrap();
    let host = [
        hidden.path().to_str().unwrap(),
        env!("CARGO_MANIFEST_DIR"),
        root.0.path().to_str().unwrap(),
        "/usr",
        "/home",
        "/var",
        "/oldroot",
        "/newroot",
        "/etc/shadow",
        "/sys/kernel",
        "/sys/fs",
        "/proc/sys/kernel",
    ];
    // Quoted, because a path may contain spaces.
    let script = format!(
        "echo $PWD\necho $PATH\nfor f in '{}'; do [ -e \"$f\" ] && echo \"host $f\"; done\n\
         while read -r l; do echo $l; done < /etc/passwd\n\
         while read -r l; do echo $l; done < /etc/group\n\
         read -r l < /etc/own; echo $l\n\
         while read -r a b c; do [ $a = Uid: ] && echo $b; done < /proc/self/status\n\
         read -r l < /sys/devices/system/cpu/online; echo cpus $l\n\
         [ -L /bin ] && echo link\necho /dev/shm/* /tmp/*",
        host.join("' '")
    );
    let output = root.output(&script);
    assert_eq!(
        output[..7],
        [
            "/agent",
            "/opt/bin",
            "agent:x:1000:1000:agent:/tmp:/bin/sh",
            "agent:x:1000:",
            "the image's",
            "1000",
            output[6].as_str(),
        ]
    );
    assert!(output[6].starts_with("cpus ") && output[6].len() > 5);
    assert_eq!(output[7..], ["link", "/dev/shm/* /tmp/*"]);
}

#[test]
fn image_writes_only_to_its_scratch_folders() {
    let root = ImageRoot::new();
    root.write("open", "", 0o666);
    fs::set_permissions(root.path_of("opt"), fs::Permissions::from_mode(0o777)).unwrap();
    let places = [
        "/x",
        "/open",
        "/opt/x",
        "/etc/x",
        "/etc/passwd",
        "/etc/own",
        "/agent/x",
        "/sys/x",
        "/sys/devices/system/cpu/online",
        "/dev/x",
        "/proc/x",
        "/tmp/x",
        "/dev/shm/x",
    ];
    let script = format!(
        "for f in {}; do (echo x > $f) 2>/tmp/null && echo $f; done; true",
        places.join(" ")
    );
    assert_eq!(root.output(&script), ["/tmp/x", "/dev/shm/x"]);
    assert_eq!(
        fs::read_to_string(root.path_of("etc/own")).unwrap(),
        "the image's"
    );
    assert_eq!(fs::read_dir(root.path_of("tmp")).unwrap().count(), 0);
}

#[test]
fn variables_of_the_spec_replace_defaults() {
    let root = ImageRoot::new();
    let mut subject = root.subject(&["sh", "-c", "echo $PATH $MODE $HOME"]);
    subject.spec.env = BTreeMap::from([
        ("PATH".to_owned(), "/bin:/opt".to_owned()),
        ("MODE".to_owned(), "fast".to_owned()),
    ]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "/bin:/opt fast /tmp");
    subject.finish(agent);
}

#[test]
fn image_has_the_limits_of_any_agent() {
    let root = ImageRoot::new();
    let mut subject = root.subject(&[
        "sh",
        "-c",
        "exec 3>&1; i=0; while [ $i -lt 20000 ]; do \
         echo 0123456789012345678901234567890123456789012345678901234567890123 || { echo full >&3; exit; }; \
         i=$((i+1)); done > /tmp/big; echo written",
    ]);
    subject.spec.limits.scratch_bytes = 1 << 20;
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "full");
    subject.finish(agent);
    // The agent is the only process beside the sandbox's first one. It has no capabilities, and its only network interface is `lo`.
    let output = root.output(
        "echo $$; echo /proc/[0-9]*; while read -r a b; do case $a in CapEff:|CapBnd:|NoNewPrivs:|Seccomp:) \
         echo $a $b;; esac; done < /proc/self/status\n\
         while read -r a b; do case $a in *:) echo $a;; esac; done < /proc/net/dev",
    );
    let last = &output[output.len() - 5..];
    assert_eq!(output[0], "2");
    assert_eq!(output[1], "/proc/1 /proc/2");
    assert!(
        last.contains(&"CapEff: 0000000000000000".to_owned()),
        "{output:?}"
    );
    assert!(
        last.contains(&"CapBnd: 0000000000000000".to_owned()),
        "{output:?}"
    );
    assert!(last.contains(&"NoNewPrivs: 1".to_owned()), "{output:?}");
    assert!(last.contains(&"Seccomp: 2".to_owned()), "{output:?}");
    assert_eq!(output.last().unwrap(), "lo:");
}

#[test]
fn links_at_mount_points_are_refused() {
    let host = tempfile::tempdir().unwrap();
    fs::write(host.path().join("passwd"), "host").unwrap();
    fs::set_permissions(host.path(), fs::Permissions::from_mode(0o777)).unwrap();
    for (place, kind) in [
        ("dev", "folder"),
        ("proc", "folder"),
        ("sys", "folder"),
        ("tmp", "folder"),
        ("etc", "folder"),
        ("etc/passwd", "file"),
        ("etc/group", "file"),
    ] {
        let root = ImageRoot::new();
        let mount_point = root.path_of(place);
        if kind == "folder" {
            fs::remove_dir_all(&mount_point).unwrap();
            symlink(host.path(), &mount_point).unwrap();
        } else {
            fs::remove_file(&mount_point).unwrap();
            symlink(host.path().join("passwd"), &mount_point).unwrap();
        }
        let error = refusal(AgentProcess::spawn(&root.subject(&["sh"]).spec));
        assert_eq!(
            error,
            format!("the agent's root has no {kind} /{place}: it is something else")
        );
    }
    let root = ImageRoot::new();
    fs::remove_dir(root.path_of("tmp")).unwrap();
    let error = refusal(AgentProcess::spawn(&root.subject(&["sh"]).spec));
    assert!(
        error.starts_with("the agent's root has no folder /tmp: "),
        "{error}"
    );
    assert_eq!(
        fs::read_to_string(host.path().join("passwd")).unwrap(),
        "host"
    );
    assert_eq!(fs::read_dir(host.path()).unwrap().count(), 1);
}

#[test]
fn image_without_namespaces_is_refused() {
    let root = ImageRoot::new();
    for isolation in [
        Isolation::None,
        Isolation::Sandboxed {
            disabled_layers: vec![Layer::Namespaces],
        },
    ] {
        let mut subject = root.subject(&["sh"]);
        subject.spec.isolation = isolation;
        let error = refusal(AgentProcess::spawn(&subject.spec));
        assert!(
            error.contains("namespaces") && error.contains("container image"),
            "{error}"
        );
    }
}

#[test]
fn command_is_looked_up_in_the_image_only() {
    let root = ImageRoot::new();
    let host = tempfile::tempdir().unwrap();
    fs::write(host.path().join("secret"), "").unwrap();
    symlink(host.path(), root.path_of("agent/host")).unwrap();
    symlink("/opt/bin/sh", root.path_of("agent/shell")).unwrap();
    root.write("agent/data", "", 0o644);
    let detail = |program: &str| {
        let subject = root.subject(&[program, "-c", "echo started"]);
        let mut agent = match AgentProcess::spawn(&subject.spec) {
            Ok(agent) => agent,
            Err(SpawnError::Agent(AgentFaultKind::CannotStart { detail })) => return detail,
            Err(other) => panic!("{other:?}"),
        };
        let AgentFaultKind::CannotStart { detail } = subject.wait_for_end(&mut agent) else {
            panic!("{program} started");
        };
        detail
    };
    assert_eq!(detail("./missing"), "`./missing` is not in the bundle");
    assert_eq!(detail("./data"), "`./data` is not executable (mode 644)");
    // The message is the same for existing and for missing files of the host.
    let messages =
        ["secret", "none"].map(|name| detail(&format!("./host/{name}")).replace(name, "NAME"));
    assert_eq!(messages[0], messages[1]);
    let subject = root.subject(&["./shell", "-c", "echo started"]);
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "started");
    subject.finish(agent);
}

#[test]
fn image_root_in_a_closed_folder_is_reachable() {
    let root = ImageRoot::new();
    let closed = tempfile::tempdir().unwrap();
    let inside = closed.path().join("root");
    let moved = std::process::Command::new("cp")
        .args([
            "-a",
            root.0.path().to_str().unwrap(),
            inside.to_str().unwrap(),
        ])
        .status();
    assert!(moved.unwrap().success());
    fs::set_permissions(closed.path(), fs::Permissions::from_mode(0o700)).unwrap();
    let mut subject = root.subject(&["sh", "-c", "echo started"]);
    subject.spec.bundle_dir = inside.join("agent");
    subject.spec.runtime = Runtime::from_image(&inside, "/opt/bin");
    let mut agent = subject.spawn();
    assert_eq!(expect_line(&mut agent), "started");
    subject.finish(agent);
    assert!(Path::new(&inside).exists());
}
