"""Tries to connect to the outside: connects_out.py MARK PORT PATH NAME, with a TCP port, a socket path and an abstract socket name of
the host. MARK identifies its processes for the test. Reports `reached` or the error for each kind of socket."""
import json
import socket
import sys

port, path, abstract = int(sys.argv[2]), sys.argv[3], sys.argv[4]


def attempt(family, kind, address, protocol=0):
    try:
        with socket.socket(family, kind, protocol) as connection:
            connection.settimeout(60)
            connection.connect(address)
            connection.send(b"hello")
            return "reached"
    except OSError as error:
        return error.strerror or str(error)


def pair():
    """Sends a byte through a socket pair of its own."""
    left, right = socket.socketpair()
    left.send(b"x")
    return right.recv(1).decode()


AF_NETLINK, AF_PACKET, AF_ALG, AF_VSOCK = 16, 17, 38, 40
print(json.dumps({
    "tcp": attempt(socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", port)),
    "tcp6": attempt(socket.AF_INET6, socket.SOCK_STREAM, ("::1", port)),
    "udp": attempt(socket.AF_INET, socket.SOCK_DGRAM, ("127.0.0.1", port)),
    "raw": attempt(socket.AF_INET, socket.SOCK_RAW, ("127.0.0.1", port), 1),
    "reliable": attempt(socket.AF_INET, 4, ("127.0.0.1", port), 132),
    "diagnosis": attempt(AF_NETLINK, socket.SOCK_RAW, (0, 0), 4),
    "sctp": attempt(socket.AF_INET, socket.SOCK_SEQPACKET, ("127.0.0.1", port), 132),
    "mptcp": attempt(socket.AF_INET, socket.SOCK_STREAM, ("127.0.0.1", port), 262),
    "icmp": attempt(socket.AF_INET, socket.SOCK_DGRAM, ("127.0.0.1", 0), 1),
    "elsewhere": attempt(socket.AF_INET, socket.SOCK_STREAM, ("192.0.2.1", 80)),
    "elsewhere6": attempt(socket.AF_INET6, socket.SOCK_STREAM, ("2001:db8::1", 80)),
    "packet": attempt(AF_PACKET, socket.SOCK_RAW, ("lo", 0)),
    "alg": attempt(AF_ALG, socket.SOCK_SEQPACKET, ("hash", "sha256")),
    "vsock": attempt(AF_VSOCK, socket.SOCK_STREAM, (2, port)),
    "unix_path": attempt(socket.AF_UNIX, socket.SOCK_STREAM, path),
    "unix_abstract": attempt(socket.AF_UNIX, socket.SOCK_STREAM, "\0" + abstract),
    "own_pair": pair(),
}), flush=True)
