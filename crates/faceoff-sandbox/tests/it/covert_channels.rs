//! Covert channels: no agent sees any effect of another agent on shared files, at the same time or later. The test
//! program knows the system call numbers of this architecture only.
#![cfg(target_arch = "x86_64")]

use crate::harness::{Subject, TIMEOUT, expect_echo, expect_line};
use std::{
    collections::BTreeMap,
    fs::{self, File, FileTimes},
    os::unix::fs::MetadataExt,
    path::Path,
    process::Command,
    time::{Duration, SystemTime},
};

/// The argument by which the test agent examines a file of Python's library, which every agent sees.
const LIBRARY_FILE: &str = "library";

/// Results of the test agent's calls: an error, a value or `ok`.
type Answers = BTreeMap<String, String>;

fn parsed(line: &str) -> Answers {
    serde_json::from_str(line).unwrap()
}

/// Refused calls and their errors: the calls could leave a trace, or find one.
const REFUSED: [(&str, &[&str]); 6] = [
    (
        "ENOSYS",
        &[
            "exclusive_lock_of_file",
            "inotify_init",
            "inotify_init1",
            "asynchronous_slots",
            "mincore",
            "cachestat",
        ],
    ),
    (
        "EINVAL",
        &[
            "open_file_lock",
            "open_file_lock_waiting",
            "open_file_lock_query",
            "lease",
            "lease_query",
            "directory_notification",
            "write_hint",
            "write_hint_query",
            "open_file_write_hint",
            "collapse",
        ],
    ),
    (
        "ENOTSUP",
        &["read_if_in_memory", "read_and_drop", "read_high_priority"],
    ),
    ("EPERM", &["fanotify_init", "keys", "kcmp"]),
    (
        "EROFS",
        &["change_mode", "change_times", "extended_attribute"],
    ),
    ("EACCES", &["system_locks", "memory_counters"]),
];

/// Calls that seem to work: a lock that no other agent can see, a lock query without an answer, and advice without
/// effect.
const WITHOUT_EFFECT: [&str; 8] = [
    "lock",
    "shared_lock_of_file",
    "lock_query",
    "advice_will_need",
    "advice_do_not_need",
    "readahead",
    "mapped_will_need",
    "mapped_page_out",
];

fn assert_no_traces(mut found: Answers) {
    for (errno, calls) in REFUSED {
        for call in calls {
            assert_eq!(found.remove(*call).as_deref(), Some(errno), "{call}");
        }
    }
    for call in WITHOUT_EFFECT
        .into_iter()
        .chain(["read_vector", "mapped_cold"])
    {
        assert_eq!(found.remove(call).as_deref(), Some("ok"), "{call}");
    }
    // What the test agent finds of terminals, settings, message queues and files that others may have left.
    for (name, answer) in [
        ("new_terminal", "ENOENT"),
        ("host_settings", ""),
        ("shared_segments", "0"),
        ("semaphores", "0"),
        ("queues", "0"),
        ("leftover_files", ""),
        ("leftover_queue", "gone"),
        ("system_forks", "same"),
    ] {
        assert_eq!(found.remove(name).as_deref(), Some(answer), "{name}");
    }
    // Write access to another user's file is refused before the kernel checks the mount.
    let written = found.remove("open_to_write").unwrap();
    assert!(["EROFS", "EACCES"].contains(&&*written), "{written}");
    assert_eq!(found, Answers::new(), "not checked by this test");
}

#[test]
fn traces_of_one_agent_are_invisible_to_others() {
    let first = Subject::new("covert_channel", &[LIBRARY_FILE, "hold"]);
    let second = Subject::new("covert_channel", &[LIBRARY_FILE]);
    let mut agent = first.spawn();
    assert_no_traces(parsed(&expect_line(&mut agent)));
    assert_eq!(expect_line(&mut agent), "held");

    let mut concurrent = second.spawn();
    assert_no_traces(parsed(&expect_line(&mut concurrent)));
    assert_eq!(concurrent.finish(TIMEOUT).unwrap().exit, None);
    expect_echo(&mut agent, "still there");
    drop(agent);
    assert_no_traces(parsed(&expect_line(&mut second.spawn())));
    first.assert_nothing_left();
    second.assert_nothing_left();
}

/// Number of pages of a file in memory, as the host sees it.
fn pages_in_memory(path: &Path) -> usize {
    const COUNT: &str = "import ctypes, mmap, os, sys\n\
        fd = os.open(sys.argv[1], os.O_RDONLY); size = os.fstat(fd).st_size\n\
        libc = ctypes.CDLL(None); libc.mmap.restype = ctypes.c_void_p\n\
        libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t] + [ctypes.c_int] * 3 + [ctypes.c_long]\n\
        at = libc.mmap(None, size, 1, 1, fd, 0)\n\
        pages = ctypes.create_string_buffer(-(-size // mmap.PAGESIZE))\n\
        assert libc.mincore(ctypes.c_void_p(at), ctypes.c_size_t(size), pages) == 0\n\
        print(sum(page & 1 for page in pages.raw))";
    python(COUNT, path).trim().parse().unwrap()
}

fn python(script: &str, path: &Path) -> String {
    let output = Command::new("python3")
        .args(["-c", script, path.to_str().unwrap()])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Removes the file's pages from the page cache.
fn drop_from_memory(path: &Path) {
    const DROP: &str = "import os, sys\n\
        fd = os.open(sys.argv[1], os.O_RDWR); os.fsync(fd)\n\
        os.posix_fadvise(fd, 0, 0, os.POSIX_FADV_DONTNEED)";
    python(DROP, path);
}

/// Advice about the page cache, by `posix_fadvise`.
#[test]
fn advice_neither_loads_nor_drops_a_shared_file() {
    let subject = Subject::new("covert_channel", &["big"]).with_large_bundle();
    let file = subject.bundle.path().join("big");
    // Larger than the read-ahead of a single page.
    fs::write(&file, vec![7; 8 << 20]).unwrap();
    let pages = (8 << 20) / 4096;
    drop_from_memory(&file);
    if pages_in_memory(&file) > 0 {
        println!(
            "this test checks only half on this host: the temporary folder is always in memory"
        );
    } else {
        subject.report();
        let found = pages_in_memory(&file);
        assert!(found < pages / 2, "{found} of {pages} pages were loaded");
    }
    // Only most of the pages must be in memory: a host may reclaim a page at any time, as hosts that share memory do.
    // An agent that could drop the file would drop all of it.
    let is_in_memory = |file: &Path| pages_in_memory(file) > pages / 2;
    let is_cached = (0..100).any(|_| {
        assert_eq!(fs::read(&file).unwrap().len(), 8 << 20);
        is_in_memory(&file)
    });
    assert!(
        is_cached,
        "this host does not cache a file that was just read"
    );
    subject.report();
    assert!(is_in_memory(&file), "the agent dropped the file");
}

#[test]
fn reading_leaves_no_access_time() {
    let subject = Subject::new("covert_channel", &["covert_channel.py"]).with_large_bundle();
    let file = subject.bundle.path().join("covert_channel.py");
    let long_ago = SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000);
    File::open(&file)
        .unwrap()
        .set_times(FileTimes::new().set_accessed(long_ago))
        .unwrap();
    subject.report();
    assert_eq!(fs::metadata(&file).unwrap().atime(), 1_000_000);
}

#[test]
fn ordinary_python_libraries_work() {
    let report = Subject::new("uses_libraries", &[]).report();
    let answers: BTreeMap<String, serde_json::Value> = serde_json::from_value(report).unwrap();
    for (library, answer) in &answers {
        assert_eq!(answer, "ok", "{library}");
    }
    assert!(answers.len() >= 15, "{answers:?}");
}

/// The test agent tries to open the ends of its channel by every path in `/proc` (a socket cannot be opened by a path: `ENXIO`), and to
/// change their buffer sizes.
#[test]
fn channel_ends_cannot_be_reopened_or_shrunk() {
    let report = Subject::new("reopens_channel", &[]).report();
    let answers: Answers = serde_json::from_value(report).unwrap();
    for (name, answer) in &answers {
        if name == "send_buffer" {
            assert_eq!(answer, "stays");
        } else if name.starts_with("shrink") {
            assert_eq!(answer, "EPERM", "{name}");
        } else {
            assert_eq!(answer, "ENXIO", "{name}");
        }
    }
    assert!(answers.len() >= 30, "{answers:?}");
}

#[test]
fn simultaneous_timers_are_bounded() {
    let report = Subject::new("makes_timers", &[]).report();
    let made = report["timers"].as_u64().unwrap();
    assert!((1..=256).contains(&made), "{report}");
    assert_eq!(report["refused"], "EAGAIN");
}
