//! The agent's network namespace, in which nothing of the host's network shows.
//!
//! bubblewrap could make the namespace as well. But files of `/proc/PID/net` show counters of the whole host, such as the number of its
//! connections and packets, which visitors change. All processes of a namespace see these files with the same permissions. So the child,
//! while it is still root, makes the namespace and removes all permissions once: they stay removed for the agent, who is not root.

use crate::{SandboxError, error::IoContext};
use rustix::{
    fs::{AtFlags, CWD, Mode, OFlags, chmodat, open},
    io::{Errno, write},
    net::{AddressFamily, SocketFlags, SocketType, socket_with},
    thread::{UnshareFlags, unshare_unsafe},
};
use std::{
    ffi::{CStr, CString},
    fs, io,
    mem::MaybeUninit,
    os::{fd::AsRawFd, unix::ffi::OsStrExt},
};

/// The kernel's files about the network namespace of the process that opens them.
const FOLDER: &str = "/proc/self/net";
/// Files that show the namespace's own state only, and that programs read to list interfaces.
const READABLE_FILES: [&str; 4] = ["dev", "if_inet6", "ipv6_route", "route"];

/// Buffers of a connection: least, usual and most bytes. All networks of the host share the memory for them.
const BUFFER_LIMITS: &[(&CStr, &[u8])] = &[
    (c"/proc/sys/net/ipv4/tcp_rmem", b"4096 131072 262144"),
    (c"/proc/sys/net/ipv4/tcp_wmem", b"4096 16384 262144"),
];

/// The network of one agent.
#[derive(Debug)]
pub(crate) struct PrivateNetwork {
    /// Paths below [`FOLDER`] that lose their permissions: all but [`READABLE_FILES`]. They are listed before the fork, since listing
    /// allocates.
    hidden_files: Vec<CString>,
}

impl PrivateNetwork {
    pub(crate) fn new() -> Result<Self, SandboxError> {
        Ok(Self {
            hidden_files: hidden_files().context(format_args!("cannot read {FOLDER}"))?,
        })
    }

    /// Makes the namespace. It is called between fork and exec, as root, and makes system calls only.
    pub(crate) fn enter(&self) -> Result<(), Errno> {
        #[expect(
            unsafe_code,
            reason = "rustix marks all unsharing unsafe, since some flags affect shared file descriptors"
        )]
        // SAFETY: NEWNET does not affect the table of file descriptors.
        unsafe {
            unshare_unsafe(UnshareFlags::NEWNET)?;
        }
        start_loopback()?;
        for (setting, value) in BUFFER_LIMITS {
            // A failure is ignored, since a container may have a read-only `/proc/sys`; the number of sockets is limited in any case.
            let file = open(*setting, OFlags::WRONLY | OFlags::CLOEXEC, Mode::empty());
            let _ = file.and_then(|file| write(&file, value));
        }
        for file in &self.hidden_files {
            match chmodat(CWD, file, Mode::empty(), AtFlags::empty()) {
                // A module of the kernel may have been loaded or unloaded since the names were read.
                Ok(()) | Err(Errno::NOENT) => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

/// Starts the loopback interface, which programs expect.
fn start_loopback() -> Result<(), Errno> {
    // The request below needs any socket of the namespace, and does not use it otherwise.
    let socket = socket_with(
        AddressFamily::INET,
        SocketType::DGRAM,
        SocketFlags::CLOEXEC,
        None,
    )?;
    #[expect(unsafe_code, reason = "rustix cannot change an interface")]
    // SAFETY: the structure consists of integers, for which zero is a value. The kernel reads it during the call.
    let result = unsafe {
        let mut request: libc::ifreq = MaybeUninit::zeroed().assume_init();
        request.ifr_name[0] = b'l' as libc::c_char;
        request.ifr_name[1] = b'o' as libc::c_char;
        request.ifr_ifru.ifru_flags = (libc::IFF_UP | libc::IFF_RUNNING) as libc::c_short;
        libc::ioctl(
            socket.as_raw_fd(),
            libc::SIOCSIFFLAGS as _,
            &raw const request,
        )
    };
    if result == 0 {
        return Ok(());
    }
    let error = io::Error::last_os_error();
    Err(Errno::from_io_error(&error).unwrap_or(Errno::INVAL))
}

/// Paths of the files and folders whose permissions are removed.
fn hidden_files() -> io::Result<Vec<CString>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(FOLDER)? {
        let entry = entry?;
        if READABLE_FILES.iter().any(|name| entry.file_name() == *name) {
            continue;
        }
        let path = entry.path();
        files.push(CString::new(path.as_os_str().as_bytes()).map_err(io::Error::other)?);
    }
    Ok(files)
}
