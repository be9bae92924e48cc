#![cfg(target_arch = "x86_64")]
//! Nothing that one agent does to what agents share is seen by another, beside it or after it. The program
//! knows the numbers of this architecture only.

use crate::harness::{PATIENCE, Subject, expect_echo, expect_line};
use std::{
    collections::BTreeMap,
    fs::{self, File, FileTimes},
    os::unix::fs::MetadataExt,
    path::Path,
    process::Command,
    time::{Duration, SystemTime},
};

/// A file of Python's library, which each agent is shown.
const SHARED: &str = "library";

type Answers = BTreeMap<String, String>;

fn parsed(line: &str) -> Answers {
    serde_json::from_str(line).unwrap()
}

/// What is refused, and how: no mark can be left with it, or none be found.
const REFUSED: [(&str, &[&str]); 6] = [
    (
        "ENOSYS",
        &[
            "flock",
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
            "open_file_lock_is_asked_for",
            "lease",
            "lease_is_asked_for",
            "directory_notice",
            "write_hint",
            "write_hint_is_asked_for",
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
    ("EACCES", &["locks_of_all", "counters_of_memory"]),
];

/// What seems to work: a lock that nobody is told of, a question about one that is not answered, and advice that is
/// not followed.
const WITHOUT_EFFECT: [&str; 7] = [
    "lock",
    "lock_is_asked_for",
    "advice_will_need",
    "advice_do_not_need",
    "readahead",
    "mapped_will_need",
    "mapped_page_out",
];

fn assert_nothing_is_there(mut found: Answers) {
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
    for (what, answer) in [
        ("new_terminal", "ENOENT"),
        ("settings_of_the_host", ""),
        ("shared_segments", "0"),
        ("semaphores", "0"),
        ("queues", "0"),
        ("files_left", ""),
        ("named_queue_left", "gone"),
        ("forks_of_all", "same"),
    ] {
        assert_eq!(found.remove(what).as_deref(), Some(answer), "{what}");
    }
    // Another user's file is refused before the mount is looked at.
    let written = found.remove("open_to_write").unwrap();
    assert!(["EROFS", "EACCES"].contains(&&*written), "{written}");
    assert_eq!(found, Answers::new(), "not judged by this test");
}

#[test]
fn of_what_one_agent_leaves_another_beside_it_or_after_it_finds_nothing() {
    let leaves = Subject::new("notice_board", &[SHARED, "hold"]);
    let looks = Subject::new("notice_board", &[SHARED]);
    let mut agent = leaves.spawn();
    assert_nothing_is_there(parsed(&expect_line(&mut agent)));
    assert_eq!(expect_line(&mut agent), "held");

    let mut beside = looks.spawn();
    assert_nothing_is_there(parsed(&expect_line(&mut beside)));
    assert_eq!(beside.finish(PATIENCE).unwrap().exit, None);
    expect_echo(&mut agent, "still there");
    drop(agent);
    assert_nothing_is_there(parsed(&expect_line(&mut looks.spawn())));
    leaves.assert_nothing_left();
    looks.assert_nothing_left();
}

/// How many pages of a file are in memory, by the host's own eyes.
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
    let said = Command::new("python3")
        .args(["-c", script, path.to_str().unwrap()])
        .output()
        .unwrap();
    assert!(said.status.success(), "{said:?}");
    String::from_utf8(said.stdout).unwrap()
}

fn drop_from_memory(path: &Path) {
    const DROP: &str = "import os, sys\n\
        fd = os.open(sys.argv[1], os.O_RDWR); os.fsync(fd)\n\
        os.posix_fadvise(fd, 0, 0, os.POSIX_FADV_DONTNEED)";
    python(DROP, path);
}

#[test]
fn no_advice_brings_a_shared_file_into_memory_or_drops_it() {
    let subject = Subject::new("notice_board", &["big"]);
    let file = subject.bundle.path().join("big");
    // Larger than what reading one page of it brings along.
    fs::write(&file, vec![7; 8 << 20]).unwrap();
    let pages = 2048;
    drop_from_memory(&file);
    if pages_in_memory(&file) > 0 {
        println!("this test shows half on this host: the temporary folder is always in memory");
    } else {
        subject.report();
        let found = pages_in_memory(&file);
        assert!(
            found < pages / 2,
            "{found} of {pages} pages were brought in"
        );
    }
    // Most of them: a host may take a page back at any time, as some do that lend memory to others. Who could drop the
    // file would drop all of it.
    let is_in_memory = |file: &Path| pages_in_memory(file) > pages / 2;
    let read = (0..100).any(|_| {
        assert_eq!(fs::read(&file).unwrap().len(), 8 << 20);
        is_in_memory(&file)
    });
    assert!(read, "this host keeps nothing in memory that was just read");
    subject.report();
    assert!(is_in_memory(&file), "it was dropped");
}

#[test]
fn reading_leaves_no_access_time() {
    let subject = Subject::new("notice_board", &["notice_board.py"]);
    let file = subject.bundle.path().join("notice_board.py");
    let long_ago = SystemTime::UNIX_EPOCH + Duration::from_secs(1_000_000);
    File::open(&file)
        .unwrap()
        .set_times(FileTimes::new().set_accessed(long_ago))
        .unwrap();
    subject.report();
    assert_eq!(fs::metadata(&file).unwrap().atime(), 1_000_000);
}

#[test]
fn ordinary_libraries_of_python_work() {
    let report = Subject::new("uses_libraries", &[]).report();
    let answers: BTreeMap<String, serde_json::Value> = serde_json::from_value(report).unwrap();
    for (what, answer) in &answers {
        assert_eq!(answer, "ok", "{what}");
    }
    assert!(answers.len() >= 15, "{answers:?}");
}

/// The ends of the channel, by every name that `/proc` has for them, and its size.
#[test]
fn no_end_of_the_channel_can_be_opened_anew_or_shrunk() {
    let report = Subject::new("reopens", &[]).report();
    let answers: Answers = serde_json::from_value(report).unwrap();
    for (name, answer) in &answers {
        if name == "room" {
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
fn few_timers_can_be_made_to_expire_at_one_instant() {
    let report = Subject::new("makes_timers", &[]).report();
    let made = report["timers"].as_u64().unwrap();
    assert!((1..=256).contains(&made), "{report}");
    assert_eq!(report["refused"], "EAGAIN");
}
