//! Commands of an ordinary user, who may not make control groups: their own agents run with the other layers of the sandbox.

use crate::without_times;
use faceoff_tests::{bundle::copy_folder, bundle::pack, program, repository};
use serde_json::Value;
use std::{
    fs::{self, Permissions},
    os::unix::fs::{PermissionsExt as _, chown},
    path::{Path, PathBuf},
    process::{Command, Output},
};
use tempfile::TempDir;

const USER: u32 = 1234;

/// A folder of an ordinary user, with the program: others may not be able to enter the target folder.
struct Home {
    folder: TempDir,
    program: PathBuf,
}

impl Home {
    fn create() -> Self {
        let folder = tempfile::tempdir().expect("a scratch folder can be made");
        fs::set_permissions(folder.path(), Permissions::from_mode(0o755)).expect("it is ours");
        chown(folder.path(), Some(USER), Some(USER)).expect("the tests run as root");
        let copy = folder.path().join("faceoff");
        let original = program("faceoff");
        if fs::hard_link(&original, &copy).is_err() {
            fs::copy(&original, &copy).expect("the program can be copied");
        }
        Self {
            program: copy,
            folder,
        }
    }

    /// Runs the program as the ordinary user.
    fn run(&self, args: &[&str]) -> Output {
        self.run_by(Command::new("setpriv"), args)
    }

    /// Runs the program as the ordinary user where bubblewrap, which makes namespaces, is not installed.
    fn run_without_bubblewrap(&self, args: &[&str]) -> Output {
        self.run_after(
            "for file in /usr/bin/bwrap /usr/local/bin/bwrap /bin/bwrap; do \
             if [ -f $file ]; then mount --bind /dev/null $file; fi; done",
            args,
        )
    }

    /// Runs the program as the ordinary user after root has changed mounts by these commands of the shell.
    fn run_after(&self, mounts: &str, args: &[&str]) -> Output {
        self.run_by(after_mounts(mounts, "setpriv"), args)
    }

    /// `command` ends with the program `setpriv`, without its arguments.
    fn run_by(&self, mut command: Command, args: &[&str]) -> Output {
        let user = USER.to_string();
        command
            .args(["--reuid", &user, "--regid", &user, "--clear-groups"])
            .arg(&self.program)
            .args(args)
            .current_dir(self.folder.path())
            .env("HOME", self.folder.path())
            .output()
            .expect("setpriv starts")
    }
}

/// A command that begins with `program`, in a mount namespace in which root has run these commands of the shell.
fn after_mounts(mounts: &str, program: &str) -> Command {
    let mut command = Command::new("unshare");
    command.args(["--mount", "--propagation", "private", "sh", "-ec"]);
    command.args([&format!("{mounts}\nexec \"$@\""), "sh", program]);
    command
}

/// Asserts success, and returns the output.
#[track_caller]
fn expect_success(output: &Output) -> String {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let (out, errors) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{out}{errors}");
    out
}

fn results(folder: &Path) -> Value {
    let text = fs::read(folder.join("results.json")).expect("there is a result");
    serde_json::from_slice(&text).expect("it is JSON")
}

#[test]
fn ordinary_user_evaluates_and_plays_own_agents() {
    let home = Home::create();
    let bundle = home.folder.path().join("hold");
    copy_folder(&repository().join("agents/hold"), &bundle);
    let bundle = bundle.to_str().expect("the path is text");
    let args = ["eval", bundle, "--task", "hit", "--episodes", "2"];
    let output = expect_success(&home.run(&args));
    let note = output
        .lines()
        .next()
        .expect("the first line names what is missing");
    assert!(
        note.contains("cgroup-memory") && note.contains("`faceoff doctor`"),
        "{output}"
    );
    // The same result as with the whole sandbox.
    let own = results(&home.folder.path().join("faceoff-eval"));
    let complete = tempfile::tempdir().expect("a scratch folder can be made");
    let done = Command::new(program("faceoff"))
        .args(args)
        .current_dir(complete.path())
        .output()
        .expect("the program starts");
    let output = expect_success(&done);
    assert!(!output.contains("cgroup-memory"), "{output}");
    assert_eq!(
        without_times(&own),
        without_times(&results(&complete.path().join("faceoff-eval")))
    );

    let output = home.run(&["play", bundle, bundle, "--steps", "500"]);
    let output = expect_success(&output);
    assert!(output.contains("cgroup-memory"), "{output}");

    // A server does not start without these layers, because it runs other people's agents.
    let output = home.run(&["serve", "--listen", "127.0.0.1:0"]);
    assert!(!output.status.success());
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(errors.contains("cgroup-memory"), "{errors}");
}

#[test]
fn other_teams_archives_need_namespaces() {
    let home = Home::create();
    let bundle = home.folder.path().join("hold");
    copy_folder(&repository().join("agents/hold"), &bundle);
    let archive = home.folder.path().join("rival.tar.gz");
    fs::write(&archive, pack(&bundle)).expect("a scratch file can be written");
    let [bundle, archive] = [&bundle, &archive].map(|path| path.to_str().expect("it is text"));
    for args in [
        &["play", bundle, archive, "--steps", "500"] as &[&str],
        &["eval", archive, "--task", "hit", "--episodes", "1"],
    ] {
        let refused = home.run_without_bubblewrap(args);
        let errors = String::from_utf8_lossy(&refused.stderr);
        assert!(!refused.status.success(), "{args:?}");
        assert!(
            errors.contains("namespaces") && errors.contains("--no-sandbox"),
            "{errors}"
        );
    }
    // The own folder of the user, whose programs the user could also run without a sandbox.
    let args = ["eval", bundle, "--task", "hit", "--episodes", "1"];
    let output = expect_success(&home.run_without_bubblewrap(&args));
    assert!(output.contains("namespaces"), "{output}");
}

#[test]
fn both_cgroup_versions_and_none_suffice_for_own_agents() {
    let home = Home::create();
    let bundle = home.folder.path().join("hold");
    copy_folder(&repository().join("agents/hold"), &bundle);
    let bundle = bundle.to_str().expect("the path is text");
    let args = ["eval", bundle, "--task", "hit", "--episodes", "1"];
    for mounts in [
        "mount --types tmpfs none /sys/fs/cgroup; mkdir /sys/fs/cgroup/memory; \
         mount --types cgroup --options memory none /sys/fs/cgroup/memory || true",
        "mount --types tmpfs none /sys/fs/cgroup; mount --types cgroup2 none /sys/fs/cgroup",
        "mount --types tmpfs --options ro none /sys/fs/cgroup",
    ] {
        let output = expect_success(&home.run_after(mounts, &args));
        let note = output.lines().next().unwrap_or_default();
        assert!(note.contains("cgroup-memory"), "{mounts}: {output}");
        assert!(!note.contains("namespaces"), "{mounts}: {output}");
    }
}

#[test]
fn container_without_privileges_evaluates_own_agents() {
    const DOCKER: &str = "-all,+chown,+dac_override,+fowner,+fsetid,+kill,+setgid,+setuid,+setpcap,\
        +net_bind_service,+net_raw,+sys_chroot,+mknod,+audit_write,+setfcap";
    let home = Home::create();
    let args = ["--task", "hit", "--episodes", "1"];
    let bundle = repository().join("agents/hold");
    // As root with the capabilities that Docker gives.
    let mut command = after_mounts(
        "mount --types tmpfs --options ro none /sys/fs/cgroup",
        "setpriv",
    );
    command.args([&format!("--bounding-set={DOCKER}"), "--inh-caps=-all"]);
    let output = command
        .arg(&home.program)
        .arg("eval")
        .arg(&bundle)
        .args(args);
    let output = output.current_dir(home.folder.path()).output();
    let output = expect_success(&output.expect("the program starts"));
    assert!(output.contains("namespaces"), "{output}");

    // As the root of a user namespace in which further user namespaces are forbidden.
    let forbidden = "exec unshare --user --map-root-user sh -ec \
        'echo 0 > /proc/sys/user/max_user_namespaces; exec unshare --user --map-user=1 true'";
    let nested = Command::new("sh").args(["-c", forbidden]).status();
    assert!(
        !nested.expect("unshare starts").success(),
        "the test's host can forbid them"
    );
    let forbid = "echo 0 > /proc/sys/user/max_user_namespaces; exec \"$@\"";
    let mut command = Command::new("unshare");
    command.args(["--user", "--map-root-user", "sh", "-ec", forbid, "sh"]);
    let output = command.arg(&home.program).arg("doctor").output();
    let output = output.expect("the program starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(
        text.contains("run it as an ordinary user, or map more ids"),
        "{text}"
    );
}

#[test]
fn doctor_names_the_fix_of_an_old_bubblewrap() {
    let home = Home::create();
    let old = home.folder.path().join("bwrap");
    let script =
        "#!/bin/sh\ncase $1 in --version) echo bubblewrap 0.3.0;; *) echo --as-pid-1;; esac\n";
    fs::write(&old, script).expect("a scratch file can be written");
    fs::set_permissions(&old, Permissions::from_mode(0o755)).expect("it is ours");
    let mounts = format!(
        "for file in /usr/bin/bwrap /usr/local/bin/bwrap /bin/bwrap; do \
         if [ -f $file ]; then mount --bind {} $file; fi; done",
        old.display()
    );
    let output = home.run_after(&mounts, &["doctor"]);
    let text = String::from_utf8_lossy(&output.stdout);
    for part in [
        "bubblewrap 0.3.0",
        "0.8 or newer is needed",
        "install a newer bubblewrap",
    ] {
        assert!(text.contains(part), "{text}");
    }
    assert!(!text.contains("apt-get install bubblewrap"), "{text}");
}
