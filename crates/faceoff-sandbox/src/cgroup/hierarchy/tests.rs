use super::*;

const HYBRID_MOUNTS: &str = "\
23 27 0:22 / /sys rw,relatime - sysfs sysfs rw
32 31 0:29 / /sys/fs/cgroup/cpu,cpuacct rw,relatime shared:9 - cgroup cgroup rw,cpu,cpuacct
35 31 0:32 / /sys/fs/cgroup/memory rw,relatime - cgroup cgroup rw,memory
41 31 0:38 / /sys/fs/cgroup/unified rw,relatime - cgroup2 cgroup2 rw
";
const HYBRID_OWN: &str = "4:memory:/no-such-cgroup\n2:cpu,cpuacct:/\n0::/\n";

#[test]
fn each_controller_is_found_where_it_is_on_a_hybrid_host() {
    let find = |controller| Home::find(controller, HYBRID_MOUNTS, HYBRID_OWN).expect(controller);
    // The kernel's name for our cgroup is not visible here: the mount itself is all there is.
    assert_eq!(
        find("memory"),
        Home {
            version: Version::V1,
            top: "/sys/fs/cgroup/memory".into(),
            own: "/sys/fs/cgroup/memory".into()
        }
    );
    assert_eq!(find("cpuacct"), find("cpu"));
    assert_eq!(find("cpu").version, Version::V1);
    assert_eq!(
        find("pids"),
        Home {
            version: Version::V2,
            top: "/sys/fs/cgroup/unified".into(),
            own: "/sys/fs/cgroup/unified".into()
        }
    );
}

#[test]
fn a_unified_host_has_all_controllers_in_the_services_own_cgroup() {
    let host = tempfile::tempdir().unwrap();
    let own = host.path().join("system.slice/faceoff.service");
    std::fs::create_dir_all(own.join(SERVICE_LEAF)).unwrap();
    let mounts = format!(
        "29 22 0:26 / {} rw - cgroup2 cgroup2 rw,nsdelegate\n",
        host.path().display()
    );
    for cgroup in [
        "/system.slice/faceoff.service",
        "/system.slice/faceoff.service/faceoff-service",
    ] {
        let home = Home::find("memory", &mounts, &format!("0::{cgroup}\n")).unwrap();
        assert_eq!(
            home,
            Home {
                version: Version::V2,
                top: host.path().into(),
                own: own.clone()
            }
        );
    }
}

#[test]
fn a_container_that_mounts_its_own_part_finds_itself() {
    let host = tempfile::tempdir().unwrap();
    std::fs::create_dir(host.path().join("inner")).unwrap();
    let mounts = format!(
        "29 22 0:26 /docker/abc {} rw - cgroup cgroup rw,pids\n",
        host.path().display()
    );
    let home = Home::find("pids", &mounts, "8:pids:/docker/abc/inner\n").unwrap();
    assert_eq!(home.own, host.path().join("inner"));
}

#[test]
fn no_hierarchy_no_home() {
    assert_eq!(
        Home::find(
            "memory",
            "23 27 0:22 / /sys rw - sysfs sysfs rw\n",
            "0::/\n"
        ),
        None
    );
}

#[test]
fn agents_weigh_ten_times_as_much_as_others() {
    let host = tempfile::tempdir().unwrap();
    let home = Home {
        version: Version::V1,
        top: host.path().into(),
        own: host.path().into(),
    };
    let folder = home.prepare_folder(&["memory"]).unwrap();
    assert!(!folder.join("cpu.shares").exists(), "another controller's");
    assert_eq!(home.prepare_folder(&["cpu"]).unwrap(), folder);
    let written = std::fs::read_to_string(folder.join("cpu.shares")).unwrap();
    assert_eq!(written, "10240");
}
