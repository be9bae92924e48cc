//! Control groups for an ordinary user: systemd gives each signed-in user a manager, which starts commands in a *scope* of their own
//! with delegated control groups.

use std::{
    env,
    os::unix::process::CommandExt as _,
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

/// Environment variable that marks a command inside a scope, so that it does not start another scope.
const IN_SCOPE_VARIABLE: &str = "FACEOFF_IN_USER_SCOPE";

/// Longest time until a manager has started a command.
const PROBE_TIMEOUT: Duration = Duration::from_secs(5);

/// Continues this command in a scope, if there is a manager that offers one. Otherwise returns.
pub fn enter() {
    if env::var_os(IN_SCOPE_VARIABLE).is_some() {
        return;
    }
    let Some(runtime_folder) = env::var_os("XDG_RUNTIME_DIR") else {
        return;
    };
    let cgroups = Path::new("/sys/fs/cgroup");
    let Ok(program) = env::current_exe() else {
        return;
    };
    if is_offered(cgroups, Path::new(&runtime_folder), "systemd-run") {
        let mut command = scope("systemd-run");
        let command = command.arg(program).args(env::args_os().skip(1));
        // `exec` replaces this process, so it returns only if the command cannot be started.
        let error = command.env(IN_SCOPE_VARIABLE, "1").exec();
        tracing::debug!(%error, "the command runs without a scope");
    }
}

/// Whether a command can be started in a scope. systemd delegates only control groups of version 2.
fn is_offered(cgroups: &Path, runtime_folder: &Path, systemd_run: &str) -> bool {
    if !cgroups.join("cgroup.controllers").exists()
        || !runtime_folder.join("systemd/private").exists()
    {
        return false;
    }
    let mut probe = scope(systemd_run);
    let probe = probe.arg("true").stdin(Stdio::null());
    let probe = probe.stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    probe.is_ok_and(|mut probe| succeeds(&mut probe))
}

/// Waits for the end of a probe; one that takes too long has failed.
fn succeeds(probe: &mut Child) -> bool {
    let give_up_at = Instant::now() + PROBE_TIMEOUT;
    while Instant::now() < give_up_at {
        match probe.try_wait() {
            Ok(Some(status)) => return status.success(),
            Ok(None) => std::thread::sleep(Duration::from_millis(10)),
            Err(_) => return false,
        }
    }
    // The probe may have ended meanwhile.
    let _ = probe.kill();
    let _ = probe.wait();
    false
}

fn scope(systemd_run: &str) -> Command {
    let mut command = Command::new(systemd_run);
    command.args([
        "--user",
        "--scope",
        "--quiet",
        "--property=Delegate=yes",
        "--",
    ]);
    command
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{fs, os::unix::fs::PermissionsExt as _};

    #[test]
    fn scope_needs_cgroup_version_2_and_a_manager_that_works() {
        let folder = tempfile::tempdir().unwrap();
        let (cgroups, runtime) = (folder.path().join("cgroup"), folder.path().join("run"));
        fs::create_dir_all(&cgroups).unwrap();
        fs::create_dir_all(runtime.join("systemd")).unwrap();
        let program = |name: &str, script: &str| {
            let path = folder.path().join(name);
            fs::write(&path, format!("#!/bin/sh\n{script}\n")).unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).unwrap();
            path.to_str().unwrap().to_owned()
        };
        // Drops the options that `scope` passes to systemd-run, and runs the rest.
        let works = program("works", "shift 4; [ \"$1\" = -- ] && shift; exec \"$@\"");
        let fails = program("fails", "echo Failed to connect to bus >&2; exit 1");
        assert!(!is_offered(&cgroups, &runtime, &works), "version 1");
        fs::write(cgroups.join("cgroup.controllers"), "memory pids").unwrap();
        assert!(!is_offered(&cgroups, &runtime, &works), "no manager");
        fs::write(runtime.join("systemd/private"), "").unwrap();
        assert!(is_offered(&cgroups, &runtime, &works));
        assert!(!is_offered(&cgroups, &runtime, &fails));
        assert!(!is_offered(&cgroups, &runtime, "/nonexistent/systemd-run"));
    }
}
