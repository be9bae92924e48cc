//! Advice for operators: how to make the host provide a layer of the sandbox, from the error with which it refused it.

use crate::{
    Layer, Limits,
    bubblewrap_program::BubblewrapProgram,
    cgroup::{NOT_MOUNTED, NOT_OFFERED},
};
use std::{fs, path::Path};

const DOCKER_WITH_CGROUPS: &str = "in Docker: docker run --privileged --cgroupns=private";

/// How to provide `layer`, which the host refused with `error`.
pub(crate) fn fix(layer: Layer, error: &str) -> String {
    match layer {
        Layer::Namespaces => match BubblewrapProgram::find() {
            Err(problem) => problem.fix(),
            Ok(_) => namespace_fix(error, blocking_setting()),
        },
        Layer::Seccomp => {
            "use a kernel with CONFIG_SECCOMP_FILTER=y (every distribution's since 2014), and give a root service in a container \
             CAP_SYS_PTRACE; in Docker: docker run --cap-add SYS_PTRACE"
                .into()
        }
        Layer::CgroupMemory | Layer::CgroupPids | Layer::CgroupCpu => {
            let is_version_2 = Path::new("/sys/fs/cgroup/cgroup.controllers").exists();
            cgroup_fix(error, is_version_2)
        }
        Layer::Rlimits => {
            format!(
                "raise the service's own hard limits, e.g. ulimit -Hn {}",
                Limits::default().open_files
            )
        }
    }
}

/// A missing permission has different fixes: systemd can delegate cgroups of version 2 to an ordinary user; version 1 needs root.
fn cgroup_fix(error: &str, is_version_2: bool) -> String {
    if error.contains(NOT_MOUNTED) {
        return format!(
            "mount the control groups, as root: mount -t cgroup2 cgroup2 /sys/fs/cgroup; {DOCKER_WITH_CGROUPS}"
        );
    }
    if error.contains("Read-only file system") {
        return format!(
            "mount the control groups writable, as root: mount -o remount,rw /sys/fs/cgroup (version 1: each folder in it); \
             {DOCKER_WITH_CGROUPS}"
        );
    }
    if error.contains(NOT_OFFERED) {
        return "enable the controllers memory, pids and cpu for this cgroup in cgroup.subtree_control of each cgroup above it; with \
                systemd: Delegate=cpu memory pids in the unit (user@.service for a signed-in user). If the root cgroup does not offer \
                a controller, the kernel was started without it (cgroup_disable=), or version 1 uses it"
            .into();
    }
    if is_version_2 {
        format!(
            "run the service as root, or as a systemd service whose unit says [Service] Delegate=yes; from a \
             shell: systemd-run --user --scope -p Delegate=yes faceoff serve; {DOCKER_WITH_CGROUPS}"
        )
    } else {
        format!(
            "run the service as root, or let root give it a cgroup: for c in memory pids cpu cpuacct freezer; do mkdir \
             -p /sys/fs/cgroup/$c/agents; chown -R USER /sys/fs/cgroup/$c/agents; echo PID > \
             /sys/fs/cgroup/$c/agents/cgroup.procs; done; {DOCKER_WITH_CGROUPS}"
        )
    }
}

/// The command that changes the first setting of this host that prevents an ordinary user from creating namespaces, if one does.
fn blocking_setting() -> Option<&'static str> {
    /// File of a setting, the value that blocks namespaces, and the command that changes it, in the order in which they take effect.
    const SETTINGS: [(&str, &str, &str); 3] = [
        (
            "/proc/sys/kernel/unprivileged_userns_clone",
            "0",
            "sysctl -w kernel.unprivileged_userns_clone=1",
        ),
        (
            "/proc/sys/user/max_user_namespaces",
            "0",
            "sysctl -w user.max_user_namespaces=15000",
        ),
        (
            "/proc/sys/kernel/apparmor_restrict_unprivileged_userns",
            "1",
            "sysctl -w kernel.apparmor_restrict_unprivileged_userns=0",
        ),
    ];
    SETTINGS
        .iter()
        .find(|(file, blocking_value, _)| {
            fs::read_to_string(file).is_ok_and(|value| value.trim() == *blocking_value)
        })
        .map(|(.., command)| *command)
}

/// `blocking_setting`: the command that changes a setting which blocks namespaces.
fn namespace_fix(error: &str, blocking_setting: Option<&str>) -> String {
    /// Messages of bubblewrap if it may make namespaces, but has no privileges in them.
    const WITHOUT_PRIVILEGES: [&str; 2] = [
        "setting up uid map: Permission denied",
        "Failed RTM_NEWADDR: Operation not permitted",
    ];
    if error.contains("CAP_") || error.contains("file system for the bundle") {
        return "give the root service CAP_SYS_ADMIN, CAP_MKNOD and CAP_SYS_PTRACE (in Docker: docker run --privileged \
                --cgroupns=private), or run it as an ordinary user"
            .into();
    }
    // With this error the namespaces were created, and only the mount of /proc was refused.
    if error.contains("mount proc") {
        return "provide a /proc without masked files, so that agents can mount their own; in Docker: docker run \
                --security-opt systempaths=unconfined"
            .into();
    }
    if let Some(command) = blocking_setting {
        return command.into();
    }
    if WITHOUT_PRIVILEGES.iter().any(|part| error.contains(part)) {
        return "let the security policy of this host (AppArmor, SELinux) allow bubblewrap its user namespaces, as its administrator; \
                Ubuntu 24.04 and newer: an AppArmor profile for bwrap with the rule `userns,`, or for all programs: \
                sysctl -w kernel.apparmor_restrict_unprivileged_userns=0"
            .into();
    }
    "allow user namespaces; in Docker: docker run --security-opt seccomp=docker/seccomp.json --security-opt \
     apparmor=unconfined --security-opt systempaths=unconfined"
        .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fix_of_cgroups_fits_the_error() {
        let denied = "cannot make a cgroup in /sys/fs/cgroup/: Permission denied (os error 13)";
        for (error, is_version_2, expected) in [
            (denied, true, "systemd-run --user --scope"),
            (denied, false, "let root give it a cgroup"),
            (
                "no mounted cgroup hierarchy has the controller memory",
                false,
                "mount -t cgroup2",
            ),
            (
                "cannot make a cgroup in /sys/fs/cgroup/: Read-only file system (os error 30)",
                true,
                "remount,rw",
            ),
            (
                "cannot make a cgroup in /sys/fs/cgroup/: /sys/fs/cgroup/ does not offer the controller memory",
                true,
                "Delegate=cpu memory pids",
            ),
        ] {
            let fix = cgroup_fix(error, is_version_2);
            assert!(fix.contains(expected), "{error}: {fix}");
            // Root is refused for the same reason, except if only the permission is missing.
            assert_eq!(
                fix.contains("run the service as root"),
                error == denied,
                "{error}: {fix}"
            );
        }
    }

    #[test]
    fn fix_of_namespaces_fits_the_message_of_bubblewrap() {
        const SETTING: &str = "sysctl -w kernel.apparmor_restrict_unprivileged_userns=0";
        for (error, setting, expected) in [
            (
                "bwrap: setting up uid map: Permission denied",
                None,
                "AppArmor",
            ),
            (
                "bwrap: loopback: Failed RTM_NEWADDR: Operation not permitted",
                None,
                "AppArmor",
            ),
            (
                "bwrap: setting up uid map: Permission denied",
                Some(SETTING),
                SETTING,
            ),
            (
                "bwrap: Can't mount proc on /newroot/proc: Operation not permitted",
                Some(SETTING),
                "systempaths=unconfined",
            ),
            (
                "bwrap: No permissions to create new namespace",
                None,
                "allow user namespaces",
            ),
        ] {
            let fix = namespace_fix(error, setting);
            assert!(fix.contains(expected), "{error}: {fix}");
            assert!(!fix.contains("install"), "{error}: {fix}");
        }
    }
}
