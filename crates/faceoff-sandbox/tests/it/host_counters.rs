//! Counters of the whole host: nothing that an agent reads is changed by another agent, a visitor, an upload or another program. Entries of
//! the list in `docs/security.md` are tried in `tests/agents/host_counters.py`, which knows the system call numbers of this
//! architecture only.
#![cfg(target_arch = "x86_64")]

use crate::harness::{Subject, TIMEOUT, expect_line, is_root};
use faceoff_sandbox::{AgentProcess, Isolation, Layer};
use serde_json::{Map, Value};
use std::{
    fs,
    hash::{BuildHasher, RandomState},
    io::{Read, Write},
    net::{TcpListener, TcpStream, UdpSocket},
    path::Path,
    process::Command,
    time::Instant,
};

/// What the agent reads, by name.
type Readings = Map<String, Value>;

fn ask(agent: &mut AgentProcess, line: &str) -> Value {
    agent.send_line(format!("{line}\n").as_bytes()).unwrap();
    serde_json::from_str(&expect_line(agent)).unwrap()
}

fn read(agent: &mut AgentProcess) -> Readings {
    let readings = serde_json::from_value(ask(agent, "read"));
    let mut readings: Readings = readings.unwrap();
    if !is_root() {
        // A service without root's rights cannot make files of devices, nor close those of a network.
        readings.retain(|name, _| {
            !["network_files", "bundle"].contains(&name.as_str()) && !name.starts_with("lock ")
        });
    }
    readings
}

/// The names of the readings that differ.
fn differences<'a>(one: &'a Readings, other: &Readings) -> Vec<&'a str> {
    let names = one
        .iter()
        .filter(|(name, value)| other.get(*name) != Some(value));
    names.map(|(name, _)| name.as_str()).collect()
}

/// What a team, a visitor or another program can do: it fills the disk and memory, opens connections, sends packets, and starts
/// processes. It is undone on drop.
struct HostActivity {
    _folder: tempfile::TempDir,
    _memory: Vec<u8>,
    _connections: Vec<(TcpStream, TcpStream)>,
}

impl HostActivity {
    fn start(disk: &Path) -> Self {
        let folder = tempfile::tempdir_in(disk).unwrap();
        let mut upload = fs::File::create(folder.path().join("upload")).unwrap();
        upload.write_all(&vec![1; 4 << 20]).unwrap();
        upload.sync_all().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let connect = || {
            let mut visitor = TcpStream::connect(address).unwrap();
            let (mut server, _) = listener.accept().unwrap();
            visitor.write_all(&[1; 1000]).unwrap();
            server.read_exact(&mut [0; 1000]).unwrap();
            (visitor, server)
        };
        let connections = (0..8).map(|_| connect()).collect();
        let udp = UdpSocket::bind("127.0.0.1:0").unwrap();
        for _ in 0..100 {
            udp.send_to(&[1; 100], udp.local_addr().unwrap()).unwrap();
        }
        assert!(Command::new("true").status().unwrap().success());
        Self {
            _folder: folder,
            _memory: vec![1; 8 << 20],
            _connections: connections,
        }
    }
}

/// One agent tries to send 200 random bits to another one. For a 1 it changes all counters that it can, and the host is busy; for a 0
/// neither happens. The other agent reads the same values in all cases.
#[test]
fn agent_readings_do_not_depend_on_host_activity() {
    const BITS: usize = 200;
    let sender = Subject::new("host_counters", &[]);
    let receiver = Subject::new("host_counters", &[]);
    let mut sending = sender.spawn();
    let mut receiving = receiver.spawn();
    let expected = read(&mut receiving);
    assert!(expected.len() > 30, "{expected:?}");
    let random = RandomState::new();
    let mut sent = 0;
    for bit in 0..BITS {
        let host_activity = (random.hash_one(bit) % 2 == 1).then(|| {
            sent += 1;
            assert!(ask(&mut sending, "move").as_u64().unwrap() > 20);
            HostActivity::start(receiver.bundle.path().parent().unwrap())
        });
        let found = read(&mut receiving);
        assert_eq!(
            differences(&expected, &found),
            [] as [&str; 0],
            "bit {bit} is {}: {found:#?}",
            host_activity.is_some()
        );
        assert!(ask(&mut sending, "end").is_null());
    }
    assert!((50..150).contains(&sent), "{sent}");
    // Nothing survives either: a later agent reads the same.
    ask(&mut sending, "move");
    assert_eq!(sending.finish(TIMEOUT).unwrap().exit, None);
    let found = read(&mut receiver.spawn());
    assert_eq!(
        differences(&expected, &found),
        [] as [&str; 0],
        "{expected:#?} {found:#?}"
    );
}

#[test]
fn refused_calls_have_the_errors_of_older_kernels() {
    let subject = Subject::new("host_counters", &[]);
    let found = read(&mut subject.spawn());
    for (errno, names) in [
        (
            "ENOSYS",
            &[
                "memfd_create",
                "memfd_secret",
                "pidfd_open",
                "asynchronous_slots",
            ][..],
        ),
        (
            "ENOPROTOOPT",
            &[
                "socket_cookie",
                "network_cookie",
                "process_of_peer",
                "pass_processes",
            ],
        ),
        (
            "EINVAL",
            &["clone_pidfd", "mergeable", "merge_all", "named_socket"],
        ),
    ] {
        for name in names {
            assert_eq!(found[*name], errno, "{name}");
        }
    }
    for (errno, names) in [
        ("ENOSYS", &["statx", "statmount", "listmount"][..]),
        ("EPERM", &["ustat", "file_handle"]),
        (
            "ENOTTY",
            &[
                "xfs_counts",
                "btrfs_space",
                "namespace_request 1",
                "namespace_number",
                "mount_namespace_number",
                "place_on_disk",
                "entropy",
            ],
        ),
    ] {
        for name in names {
            assert_eq!(found[*name], serde_json::json!([errno, ""]), "{name}");
        }
    }
    // Libraries do not check whether this call fails.
    assert!(found["physical_pages"].as_u64().unwrap() > 0);
    assert_eq!(found["sysinfo"][0], 0);
    assert_eq!(found["statfs /agent"], found["fstatfs"]);
    assert_eq!(found["statfs /agent"][0], 0);
}

/// Control: without the seccomp filter the same agents can signal to each other, so the tests above are able to fail.
#[test]
fn without_seccomp_agents_can_signal_to_each_other() {
    let mut subject = Subject::new("host_counters", &[]);
    let Isolation::Sandboxed { disabled_layers } = &mut subject.spec.isolation else {
        unreachable!()
    };
    disabled_layers.push(Layer::Seccomp);
    let mut agent = subject.spawn();
    let before = read(&mut agent);
    let _host_activity = HostActivity::start(subject.bundle.path().parent().unwrap());
    ask(&mut subject.spawn(), "move");
    let after = read(&mut agent);
    let moved = differences(&before, &after);
    for name in ["sysinfo", "socket_cookie", "memfd_create"] {
        assert!(moved.contains(&name), "{name}: {moved:?}");
    }
    // The files of `/proc/net` stay closed: the network namespace does that, not the filter. The text of `dev` is reported as a hash.
    if is_root() {
        assert!(!moved.contains(&"network_files"), "{moved:?}");
        let closed = &before["network_files"];
        assert_eq!(closed["sockstat"], "EACCES");
        assert_eq!(closed["softnet_stat"], "EACCES");
        assert!(closed["dev"].as_str().unwrap().len() == 64, "{closed}");
    }
}

/// To send a 1, an agent starts many process sessions (`setsid`), which the kernel numbers for the whole host. A later agent guesses the
/// bit from the number of its own session.
#[test]
fn session_numbers_carry_no_message_to_a_later_agent() {
    const BITS: usize = 40;
    let sender = Subject::new("host_counters", &[]);
    let receiver = Subject::new("host_counters", &[]);
    let random = RandomState::new();
    let number = |agent: &mut AgentProcess| -> Option<i64> {
        ask(agent, "session").as_str().unwrap().parse().ok()
    };
    let mut last = number(&mut receiver.spawn()).unwrap();
    let mut increases = Vec::new();
    for bit in 0..BITS {
        let bit = random.hash_one(bit) % 2 == 1;
        let mut sending = sender.spawn();
        if bit {
            let started = (0..100).filter(|_| number(&mut sending).is_some()).count();
            // The sandbox allows 8 at once and one more every 10 s, and refuses the others.
            assert!((8..100).contains(&started), "{started} sessions");
        }
        sending.finish(TIMEOUT).unwrap();
        let next = number(&mut receiver.spawn()).unwrap();
        increases.push((next - last, bit));
        last = next;
    }
    let mut sorted: Vec<i64> = increases.iter().map(|(increase, _)| *increase).collect();
    sorted.sort_unstable();
    let median = sorted[BITS / 2];
    let right = increases
        .iter()
        .filter(|(increase, bit)| (*increase > median) == *bit)
        .count();
    // Chance is 20 of 40, with a standard deviation of about 3; a channel would give 40.
    assert!(right < 20 + 5 * 3, "{right} of {BITS}: {increases:?}");
}

#[test]
fn subprocess_in_a_session_of_its_own_works() {
    let subject = Subject::new("host_counters", &[]);
    let mut agent = subject.spawn();
    assert!(
        ask(&mut agent, "session")
            .as_str()
            .unwrap()
            .parse::<u64>()
            .is_ok()
    );
}

#[test]
fn user_ids_of_successive_agents_are_not_in_order() {
    if !is_root() {
        return;
    }
    let subject = Subject::new("host_counters", &[]);
    let user = || -> i64 {
        let user = ask(&mut subject.spawn(), "user");
        user.as_str().unwrap().parse().unwrap()
    };
    let users: Vec<i64> = (0..8).map(|_| user()).collect();
    let has_order = users
        .windows(2)
        .any(|pair| (1..=1000).contains(&(pair[1] - pair[0])));
    assert!(!has_order, "{users:?}");
}

#[test]
#[ignore = "it measures the channels that remain; `make channels` runs it alone and prints the rates"]
fn rates_of_remaining_channels() {
    const BITS: usize = 400;
    let subject = Subject::new("host_counters", &[]);
    for channel in [
        "file_numbers",
        "memory_numbers",
        "event_numbers",
        "mapped_pages",
        "memory_bandwidth",
    ] {
        let (mut sending, mut receiving) = (subject.spawn(), subject.spawn());
        let random = RandomState::new();
        let mut observed = Vec::new();
        let start = Instant::now();
        for bit in 0..BITS {
            let bit = random.hash_one(bit) % 2 == 1;
            if bit {
                let line = format!("signal {channel}\n");
                sending.send_line(line.as_bytes()).unwrap();
                if channel != "memory_bandwidth" {
                    expect_line(&mut sending);
                }
            }
            let value = ask(&mut receiving, &format!("observe {channel}"));
            observed.push((value.as_f64().unwrap(), bit));
            if bit && channel == "memory_bandwidth" {
                expect_line(&mut sending);
            }
            ask(&mut sending, "end");
        }
        let seconds = start.elapsed().as_secs_f64();
        // The best threshold for the first half decides the second half.
        let (training, test) = observed.split_at(BITS / 2);
        let errors = |threshold: f64, part: &[(f64, bool)]| {
            part.iter()
                .filter(|(value, bit)| (*value > threshold) != *bit)
                .count()
        };
        let thresholds = training.iter().map(|(value, _)| *value);
        let best = thresholds.min_by_key(|threshold| errors(*threshold, training));
        let error_rate = errors(best.unwrap(), test) as f64 / test.len() as f64;
        let entropy = |p: f64| if p > 0.0 { -p * p.log2() } else { 0.0 };
        let capacity = 1.0 - entropy(error_rate) - entropy(1.0 - error_rate);
        println!(
            "{channel}: {:.0} bits/s ({:.1} % of {:.0} bits/s are wrong)",
            capacity * BITS as f64 / seconds,
            100.0 * error_rate,
            BITS as f64 / seconds
        );
    }
}
