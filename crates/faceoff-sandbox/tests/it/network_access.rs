//! An agent reaches neither the network nor a socket of the host.

use crate::harness::Subject;
use std::{
    io,
    net::{TcpListener, UdpSocket},
    os::{
        linux::net::SocketAddrExt,
        unix::net::{SocketAddr, UnixListener},
    },
};

#[test]
fn agent_reaches_no_network_and_no_host_socket() {
    let tcp = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = tcp.local_addr().unwrap().port();
    let udp = UdpSocket::bind(("127.0.0.1", port)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("socket");
    let unix = UnixListener::bind(&path).unwrap();
    let name = format!("faceoff-test-{}", std::process::id());
    let abstract_address = SocketAddr::from_abstract_name(&name).unwrap();
    let abstract_socket = UnixListener::bind_addr(&abstract_address).unwrap();

    let report = Subject::new(
        "connects_out",
        &[&port.to_string(), path.to_str().unwrap(), &name],
    )
    .report();
    // The listeners are active, so only the sandbox can prevent a connection.
    for kind in [
        "raw",
        "reliable",
        "diagnosis",
        "sctp",
        "mptcp",
        "icmp",
        "packet",
        "alg",
        "vsock",
    ] {
        assert_eq!(report[kind], "Operation not permitted", "{kind}");
    }
    // Its loopback interface is its own, and nothing listens there.
    for kind in ["tcp", "tcp6"] {
        assert_eq!(report[kind], "Connection refused", "{kind}");
    }
    for kind in ["elsewhere", "elsewhere6"] {
        assert_eq!(report[kind], "Network is unreachable", "{kind}");
    }
    assert_eq!(report["unix_path"], "No such file or directory");
    assert_eq!(report["unix_abstract"], "Connection refused");
    assert_eq!(report["own_pair"], "x");

    tcp.set_nonblocking(true).unwrap();
    udp.set_nonblocking(true).unwrap();
    unix.set_nonblocking(true).unwrap();
    abstract_socket.set_nonblocking(true).unwrap();
    let would_block = |error: io::Error| error.kind() == io::ErrorKind::WouldBlock;
    assert!(tcp.accept().is_err_and(would_block));
    assert!(udp.recv(&mut [0; 8]).is_err_and(would_block));
    assert!(unix.accept().is_err_and(would_block));
    assert!(abstract_socket.accept().is_err_and(would_block));
}

#[test]
fn network_namespace_isolates_without_the_filter() {
    use faceoff_sandbox::{Isolation, Layer};
    let tcp = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = tcp.local_addr().unwrap().port().to_string();
    let name = format!("faceoff-test-{}", std::process::id());
    let abstract_address = SocketAddr::from_abstract_name(&name).unwrap();
    let _abstract_socket = UnixListener::bind_addr(&abstract_address).unwrap();
    let mut subject = Subject::new("connects_out", &[&port, "/nowhere", &name]);
    let Isolation::Sandboxed { disabled_layers } = &mut subject.spec.isolation else {
        unreachable!()
    };
    disabled_layers.push(Layer::Seccomp);
    let report = subject.report();
    assert_eq!(report["tcp"], "Connection refused");
    assert_eq!(report["unix_abstract"], "Connection refused");
}

#[test]
fn connections_succeed_without_the_sandbox() {
    use faceoff_sandbox::Isolation;
    let tcp = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = tcp.local_addr().unwrap().port().to_string();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("socket");
    let _unix = UnixListener::bind(&path).unwrap();
    let mut subject = Subject::new("connects_out", &[&port, path.to_str().unwrap(), "unused"]);
    subject.spec.isolation = Isolation::None;
    let report = subject.report();
    assert_eq!(report["tcp"], "reached");
    assert_eq!(report["unix_path"], "reached");
}
