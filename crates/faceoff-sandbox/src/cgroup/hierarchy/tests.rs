//! Hosts with cgroup version 1, version 2 and both (*hybrid*), as `/proc/self/mountinfo` and `/proc/self/cgroup` show them.
//! The *service* is the process that starts agents.

use super::*;

const HYBRID_MOUNTS: &str = "\
23 27 0:22 / /sys rw,relatime - sysfs sysfs rw
32 31 0:29 / /sys/fs/cgroup/cpu,cpuacct rw,relatime shared:9 - cgroup cgroup rw,cpu,cpuacct
35 31 0:32 / /sys/fs/cgroup/memory rw,relatime - cgroup cgroup rw,memory
41 31 0:38 / /sys/fs/cgroup/unified rw,relatime - cgroup2 cgroup2 rw
";
const HYBRID_OWN_CGROUPS: &str = "4:memory:/no-such-cgroup\n2:cpu,cpuacct:/\n0::/\n";

#[test]
fn controllers_are_found_on_a_hybrid_host() {
    let find = |controller| {
        Hierarchy::find(controller, HYBRID_MOUNTS, HYBRID_OWN_CGROUPS).expect(controller)
    };
    // The kernel's name of the service's cgroup is not visible here, so the mount point is used.
    assert_eq!(
        find("memory"),
        Hierarchy {
            version: Version::V1,
            mount_point: "/sys/fs/cgroup/memory".into(),
            service_dir: "/sys/fs/cgroup/memory".into()
        }
    );
    assert_eq!(find("cpuacct"), find("cpu"));
    assert_eq!(find("cpu").version, Version::V1);
    assert_eq!(
        find("pids"),
        Hierarchy {
            version: Version::V2,
            mount_point: "/sys/fs/cgroup/unified".into(),
            service_dir: "/sys/fs/cgroup/unified".into()
        }
    );
}

#[test]
fn unified_host_has_all_controllers_in_one_cgroup() {
    let host = tempfile::tempdir().unwrap();
    let service_dir = host.path().join("system.slice/faceoff.service");
    std::fs::create_dir_all(service_dir.join(SERVICE_LEAF)).unwrap();
    let mounts = format!(
        "29 22 0:26 / {} rw - cgroup2 cgroup2 rw,nsdelegate\n",
        host.path().display()
    );
    for cgroup in [
        "/system.slice/faceoff.service",
        "/system.slice/faceoff.service/faceoff-service",
    ] {
        let hierarchy = Hierarchy::find("memory", &mounts, &format!("0::{cgroup}\n")).unwrap();
        assert_eq!(
            hierarchy,
            Hierarchy {
                version: Version::V2,
                mount_point: host.path().into(),
                service_dir: service_dir.clone()
            }
        );
    }
}

#[test]
fn container_with_a_partial_mount_finds_its_cgroup() {
    let host = tempfile::tempdir().unwrap();
    std::fs::create_dir(host.path().join("inner")).unwrap();
    let mounts = format!(
        "29 22 0:26 /docker/abc {} rw - cgroup cgroup rw,pids\n",
        host.path().display()
    );
    let hierarchy = Hierarchy::find("pids", &mounts, "8:pids:/docker/abc/inner\n").unwrap();
    assert_eq!(hierarchy.service_dir, host.path().join("inner"));
}

#[test]
fn missing_hierarchy_is_not_found() {
    assert_eq!(
        Hierarchy::find(
            "memory",
            "23 27 0:22 / /sys rw - sysfs sysfs rw\n",
            "0::/\n"
        ),
        None
    );
}

#[test]
fn agents_have_ten_times_the_default_weight() {
    let host = tempfile::tempdir().unwrap();
    let hierarchy = Hierarchy {
        version: Version::V1,
        mount_point: host.path().into(),
        service_dir: host.path().into(),
    };
    let folder = hierarchy.create_agents_folder(&["memory"]).unwrap();
    assert!(
        !folder.join("cpu.shares").exists(),
        "only with the controller cpu"
    );
    assert_eq!(hierarchy.create_agents_folder(&["cpu"]).unwrap(), folder);
    let written = std::fs::read_to_string(folder.join("cpu.shares")).unwrap();
    assert_eq!(written, "10240");
}
