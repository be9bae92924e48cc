//! System calls of agents that the *service*, the process that starts agents, answers in place of the kernel (*user notification* of
//! seccomp).
//!
//! - `statfs`, `fstatfs` and `sysinfo` show counters of the whole host, which an upload, a visitor or another agent moves. They cannot
//!   fail: C libraries do not check `sysinfo`, and old ones find `/dev/shm` by `statfs`. So every agent gets the same figures at any
//!   time.
//! - `setsid` is executed, but only now and then ([`crate::session_numbers`]).
//! - `flock` is executed on an agent's own files ([`crate::file_locks`]).
//! - `socket` of the internet's families and `connect` are executed up to a number of sockets, whose buffers are memory that all programs of
//!   the host share.
//! - `socket` of `NETLINK_ROUTE` gives a socket that the service has made ([`crate::route_sockets`]).
//! - `sched_getaffinity` and `sched_setaffinity` translate the agent's numbers of its CPUs ([`crate::cpu_numbers`]).
//!
//! A call waits until this service has answered it. Only the calling thread waits, and the answers are slower the more there are, so
//! that no agent can keep the evaluator's CPUs busy.

use crate::{
    Layer, SandboxError, SpawnSpec,
    call_listener::{install_with_listener, let_execute, receive_call, send_file, send_reply},
    caller::Caller,
    cpu_clock::own_cpu_time,
    cpu_numbers::CpuNumbers,
    error::IoContext,
    file_locks::{FileLocks, LockOutcome},
    memory_view::MemoryView,
    route_sockets, seccomp,
    session_numbers::{self, SessionBudget},
};
use rustix::{
    event::{PollFd, PollFlags, Timespec, poll},
    fs::{FlockOperation, flock},
    io::Errno,
    net::{
        AddressFamily, RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer,
        SendAncillaryMessage, SendFlags, SocketFlags, SocketType, recvmsg, sendmsg, socketpair,
    },
    system::{Sysinfo, sysinfo},
    thread::{sched_getaffinity, sched_setaffinity, set_no_new_privs},
};
use seccompiler::BpfProgram;
use std::{
    io::{self, IoSlice, IoSliceMut},
    mem::MaybeUninit,
    os::fd::{AsFd, OwnedFd},
    sync::OnceLock,
    thread::JoinHandle,
    time::{Duration, Instant},
};

/// Type of a file system in memory, in `statfs`.
const TMPFS_MAGIC: u64 = 0x0102_1994;
const BLOCK_BYTES: u64 = 4096;
/// Free files in `statfs`, arbitrary.
const FREE_FILES: u64 = 65_536;
/// Longest name of a file in `statfs`.
const MAX_NAME_BYTES: u64 = 255;
/// Flags in `statfs`: the flags are valid, no set-id programs, no devices.
const MOUNT_FLAGS: u64 = 0x20 | 0x2 | 0x4;

/// Sockets that an agent may have open when it makes another one of the internet's families, or a connection, which makes one, too.
const MAX_SOCKETS: i32 = 256;
/// Longest mask of CPUs that is read, in bytes.
const MAX_MASK_BYTES: usize = 128;

/// CPU time after which the thread pauses before each further answer.
const UNTHROTTLED_CPU_TIME: Duration = Duration::from_millis(20);
/// Minimum pause before each further answer.
const PAUSE: Duration = Duration::from_millis(1);
/// The pause is at least this multiple of the CPU time of the last answer: an agent can make an answer expensive, by memory that has no
/// pages yet.
const PAUSE_PER_CPU_TIME: u32 = 20;

/// The filter, and the socket through which the child sends the *listener* (the file descriptor that reports its calls).
#[derive(Debug)]
pub(crate) struct CallFilter {
    program: BpfProgram,
    child_socket: OwnedFd,
}

/// The service's side before the agent has started.
#[derive(Debug)]
pub(crate) struct CallHandlerSetup {
    socket: OwnedFd,
    values: EmulatedValues,
}

impl CallFilter {
    /// The child's and the service's side for one agent.
    pub(crate) fn new(spec: &SpawnSpec) -> Result<(Self, CallHandlerSetup), SandboxError> {
        let (socket, child_socket) = socketpair(
            AddressFamily::UNIX,
            SocketType::STREAM,
            SocketFlags::CLOEXEC,
            None,
        )
        .context("cannot make a socket for the agent's system calls")?;
        let cpus = CpuNumbers::new(spec);
        let program = seccomp::answered_calls(cpus.is_renumbered())?;
        let values = EmulatedValues {
            statfs_fields: statfs_fields(free_blocks(spec.limits.scratch_bytes)),
            sysinfo_fields: sysinfo_fields(MemoryView::new(spec)),
            cpus,
            has_namespaces: spec.isolation.enforces(Layer::Namespaces),
        };
        Ok((
            Self {
                program,
                child_socket,
            },
            CallHandlerSetup { socket, values },
        ))
    }

    /// Installs the filter in the calling process. Called between fork and exec, where only system calls are allowed.
    pub(crate) fn install(&self) -> Result<(), Errno> {
        set_no_new_privs(true)?;
        let listener = install_with_listener(&self.program)?;
        let listener = [listener.as_fd()];
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
        let mut message = SendAncillaryBuffer::new(&mut space);
        if !message.push(SendAncillaryMessage::ScmRights(&listener)) {
            return Err(Errno::NOBUFS);
        }
        sendmsg(
            &self.child_socket,
            // A descriptor is sent along with at least one byte, which has no meaning.
            &[IoSlice::new(b"l")],
            &mut message,
            SendFlags::empty(),
        )?;
        Ok(())
    }
}

impl CallHandlerSetup {
    /// Starts the thread that answers, once the child has installed its filter.
    pub(crate) fn start(self) -> Result<CallHandlerThread, SandboxError> {
        const ACTION: &str = "cannot watch the agent's system calls";
        let listener = receive_listener(&self.socket).context(ACTION)?;
        let values = self.values;
        let thread = std::thread::Builder::new()
            .name("agent-calls".into())
            .spawn(move || {
                block_signals();
                let mut call_handler = CallHandler {
                    listener: &listener,
                    values,
                    sessions: SessionBudget::new(Instant::now()),
                    locks: FileLocks::default(),
                };
                call_handler.answer_calls();
                session_numbers::skip_some(call_handler.sessions.started);
            })
            .context(ACTION)?;
        Ok(CallHandlerThread(thread))
    }
}

/// The thread that answers, which ends after the last process of the agent.
#[derive(Debug)]
pub(crate) struct CallHandlerThread(JoinHandle<()>);

impl CallHandlerThread {
    /// Waits until the thread has used up some session numbers of the host ([`session_numbers::skip_some`]), before another agent
    /// starts. Call it when the process tree is dead.
    pub(crate) fn join(self, deadline: Instant) {
        while !self.0.is_finished() && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

/// Free blocks of every file system, as agents with so large a scratch folder see it.
pub(crate) const fn free_blocks(scratch_bytes: u64) -> u64 {
    scratch_bytes / BLOCK_BYTES
}

/// Lets other threads handle the signals of this process. One that arrives here would end the waiting for a call, and its handler could
/// run in a process that shares this process's memory ([`session_numbers::skip_some`]).
fn block_signals() {
    let mut all = MaybeUninit::uninit();
    #[expect(unsafe_code, reason = "no library of this crate has masks of signals")]
    // SAFETY: the first call initialises the set, which the second one reads; both only change this thread's mask.
    unsafe {
        libc::sigfillset(all.as_mut_ptr());
        libc::pthread_sigmask(libc::SIG_SETMASK, all.as_ptr(), std::ptr::null_mut());
    }
}

fn receive_listener(socket: &OwnedFd) -> io::Result<OwnedFd> {
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(1))];
    let mut message = RecvAncillaryBuffer::new(&mut space);
    let mut byte = [0];
    // The child has sent it before its exec, which has succeeded.
    let flags = RecvFlags::DONTWAIT | RecvFlags::CMSG_CLOEXEC;
    recvmsg(
        socket,
        &mut [IoSliceMut::new(&mut byte)],
        &mut message,
        flags,
    )?;
    let mut fds = message.drain().filter_map(|part| match part {
        RecvAncillaryMessage::ScmRights(mut fds) => fds.next(),
        _ => None,
    });
    fds.next()
        .ok_or_else(|| io::Error::other("the child has sent no descriptor"))
}

/// Values that calls return to an agent in place of the host's.
#[derive(Debug)]
struct EmulatedValues {
    statfs_fields: [u64; 15],
    sysinfo_fields: [u64; 14],
    cpus: CpuNumbers,
    /// Are its scratch folders and its network its own?
    has_namespaces: bool,
}

/// The answer of `statfs` and `fstatfs`: an empty file system of so many blocks. On 64-bit machines the fields of the kernel's structure
/// are 64-bit integers in this order; the last four are unused.
const fn statfs_fields(blocks: u64) -> [u64; 15] {
    let (size, free, available) = (blocks, blocks, blocks);
    let (files, free_files) = (FREE_FILES, FREE_FILES);
    let id = 0;
    [
        TMPFS_MAGIC,
        BLOCK_BYTES,
        size,
        free,
        available,
        files,
        free_files,
        id,
        MAX_NAME_BYTES,
        BLOCK_BYTES,
        MOUNT_FLAGS,
        0,
        0,
        0,
        0,
    ]
}

/// The answer of `sysinfo`: the host's figures before the first agent started, and the agent's memory. On 64-bit machines that put the
/// lower byte first, the fields of the kernel's structure and their padding are these integers.
fn sysinfo_fields(memory: MemoryView) -> [u64; 14] {
    static HOST: OnceLock<Sysinfo> = OnceLock::new();
    let host = HOST.get_or_init(sysinfo);
    let unit = u64::from(host.mem_unit).max(1);
    let own = memory.bytes(host.totalram.saturating_mul(unit));
    let [load_1, load_5, load_15] = host.loads;
    let of_host = [
        host.totalram,
        host.freeram,
        host.sharedram,
        host.bufferram,
        host.totalswap,
        host.freeswap,
    ];
    let [total, free, shared, buffers, swap, free_swap] =
        own.map_or(of_host, |bytes| [bytes / unit, bytes / unit, 0, 0, 0, 0]);
    [
        host.uptime.cast_unsigned(),
        load_1,
        load_5,
        load_15,
        total,
        free,
        shared,
        buffers,
        swap,
        free_swap,
        host.procs.into(),
        host.totalhigh,
        host.freehigh,
        host.mem_unit.into(),
    ]
}

/// How a call is answered.
enum Reply {
    /// It returns this number.
    Value(i64),
    /// This file is locked.
    Locked(OwnedFd),
    /// It returns a descriptor of this file.
    File {
        file: OwnedFd,
        closes_on_exec: bool,
    },
    Failed(Errno),
    /// The kernel executes it.
    Execute,
    /// It is answered later, when the lock that it waits for is free.
    Waits,
}

impl From<LockOutcome> for Reply {
    fn from(outcome: LockOutcome) -> Self {
        match outcome {
            LockOutcome::Done => Self::Value(0),
            LockOutcome::Locked(file) => Self::Locked(file),
            LockOutcome::Failed(error) => Self::Failed(error),
            LockOutcome::Waits => Self::Waits,
        }
    }
}

/// Answers the calls of one agent.
struct CallHandler<'a> {
    listener: &'a OwnedFd,
    values: EmulatedValues,
    sessions: SessionBudget,
    locks: FileLocks,
}

impl CallHandler<'_> {
    /// Answers until the last process with the filter has ended.
    fn answer_calls(&mut self) {
        let mut last_answer_cpu_time = Duration::ZERO;
        loop {
            let events = {
                let mut fds = [PollFd::new(self.listener, PollFlags::IN)];
                match poll(&mut fds, self.time_until_retry().as_ref()) {
                    Ok(_) | Err(Errno::INTR) => fds[0].revents(),
                    Err(_) => return,
                }
            };
            let is_asked = events.contains(PollFlags::IN);
            if !is_asked && !events.is_empty() {
                return;
            }
            let cpu_time_before = own_cpu_time();
            if cpu_time_before > UNTHROTTLED_CPU_TIME {
                std::thread::sleep(PAUSE.max(last_answer_cpu_time * PAUSE_PER_CPU_TIME));
            }
            self.retry_locks();
            if is_asked && !self.answer_next() {
                return;
            }
            last_answer_cpu_time = own_cpu_time().saturating_sub(cpu_time_before);
        }
    }

    /// `None` if no lock is waited for.
    fn time_until_retry(&self) -> Option<Timespec> {
        let time_left = self
            .locks
            .next_try_at()?
            .saturating_duration_since(Instant::now());
        Timespec::try_from(time_left).ok()
    }

    fn retry_locks(&mut self) {
        for (call, outcome) in self.locks.retry(self.listener.as_fd(), Instant::now()) {
            self.reply(call, outcome.into());
        }
    }

    /// Answers the next call; `false` if the last process has ended.
    fn answer_next(&mut self) -> bool {
        let call = match receive_call(self.listener) {
            Ok(call) => call,
            // The thread was killed or got a signal meanwhile.
            Err(Errno::NOENT | Errno::INTR) => return true,
            Err(_) => return false,
        };
        let reply = self
            .answer(&call)
            .unwrap_or_else(|error| Reply::Failed(errno_of(&error)));
        self.reply(call.id, reply);
        true
    }

    /// Sending fails if the thread is dead, or has got a signal; then it repeats its call.
    fn reply(&self, call: u64, reply: Reply) {
        let _ = match reply {
            Reply::Value(value) => send_reply(self.listener, call, Ok(value)),
            Reply::Locked(file) => {
                let sent = send_reply(self.listener, call, Ok(0));
                if sent.is_err() {
                    // The caller does not know of its lock.
                    let _ = flock(&file, FlockOperation::NonBlockingUnlock);
                }
                sent
            }
            Reply::File {
                file,
                closes_on_exec,
            } => send_file(self.listener, call, file, closes_on_exec),
            Reply::Failed(error) => send_reply(self.listener, call, Err(error)),
            Reply::Execute => let_execute(self.listener, call),
            Reply::Waits => Ok(()),
        };
    }

    /// # Errors
    /// When the caller's memory or files are not accessible.
    fn answer(&mut self, call: &libc::seccomp_notif) -> io::Result<Reply> {
        let caller = Caller {
            listener: self.listener.as_fd(),
            id: call.id,
            host_thread: call.pid,
        };
        let [first, second, third, ..] = call.data.args;
        // The lower half of an argument, as the kernel takes it for an `int`.
        let as_int = |argument: u64| argument as i32;
        match i64::from(call.data.nr) {
            libc::SYS_statfs | libc::SYS_fstatfs => {
                write_figures(caller, second, &self.values.statfs_fields)
            }
            libc::SYS_sysinfo => write_figures(caller, first, &self.values.sysinfo_fields),
            libc::SYS_setsid if self.sessions.take(Instant::now()) => Ok(Reply::Execute),
            libc::SYS_setsid => Ok(Reply::Failed(Errno::PERM)),
            libc::SYS_socket if as_int(first) == libc::AF_NETLINK => {
                let kind = as_int(second);
                let socket = route_sockets::make(caller, kind & libc::SOCK_NONBLOCK != 0)?;
                Ok(Reply::File {
                    file: socket,
                    closes_on_exec: kind & libc::SOCK_CLOEXEC != 0,
                })
            }
            // Without namespaces the network is the host's, and only local sockets are allowed.
            libc::SYS_connect if !self.values.has_namespaces => Ok(Reply::Execute),
            libc::SYS_socket | libc::SYS_connect => Ok(match caller.socket_count() {
                Ok(sockets) if sockets < MAX_SOCKETS => Reply::Execute,
                Ok(_) => Reply::Failed(Errno::NFILE),
                Err(error) => {
                    tracing::error!(%error, "cannot count an agent's sockets");
                    Reply::Failed(Errno::NFILE)
                }
            }),
            libc::SYS_flock => {
                let has_own_files = self.values.has_namespaces;
                let outcome =
                    self.locks
                        .lock(caller, as_int(first), as_int(second), has_own_files)?;
                Ok(outcome.into())
            }
            libc::SYS_sched_getaffinity => self.affinity(caller, as_int(first), second, third),
            libc::SYS_sched_setaffinity => self.set_affinity(caller, as_int(first), second, third),
            _ => Ok(Reply::Failed(Errno::NOSYS)),
        }
    }

    /// Answers `sched_getaffinity` for the thread that the agent names `number`.
    fn affinity(
        &self,
        caller: Caller<'_>,
        number: i32,
        bytes: u64,
        address: u64,
    ) -> io::Result<Reply> {
        let Some(thread) = caller.thread(number)? else {
            return Ok(Reply::Failed(Errno::SRCH));
        };
        let mask = self
            .values
            .cpus
            .agent_mask(&sched_getaffinity(Some(thread))?);
        if !bytes.is_multiple_of(8) || bytes < mask.len() as u64 {
            return Ok(Reply::Failed(Errno::INVAL));
        }
        caller.write(address, &mask)?;
        Ok(Reply::Value(mask.len() as i64))
    }

    /// Executes `sched_setaffinity` for the thread that the agent names `number`.
    fn set_affinity(
        &self,
        caller: Caller<'_>,
        number: i32,
        bytes: u64,
        address: u64,
    ) -> io::Result<Reply> {
        let Some(thread) = caller.thread(number)? else {
            return Ok(Reply::Failed(Errno::SRCH));
        };
        let mut mask = [0; MAX_MASK_BYTES];
        let read = &mut mask[..MAX_MASK_BYTES.min(bytes as usize)];
        caller.read(address, read)?;
        let set = self.values.cpus.host_set(read);
        if set.count() == 0 {
            return Ok(Reply::Failed(Errno::INVAL));
        }
        let affinity_before = sched_getaffinity(Some(thread))?;
        sched_setaffinity(Some(thread), &set)?;
        if caller.thread(number)? != Some(thread) {
            // It ended meanwhile, and another process may have its number.
            let _ = sched_setaffinity(Some(thread), &affinity_before);
            return Ok(Reply::Failed(Errno::SRCH));
        }
        Ok(Reply::Value(0))
    }
}

fn write_figures(caller: Caller<'_>, address: u64, figures: &[u64]) -> io::Result<Reply> {
    let bytes: Vec<u8> = figures
        .iter()
        .flat_map(|figure| figure.to_ne_bytes())
        .collect();
    caller.write(address, &bytes)?;
    Ok(Reply::Value(0))
}

/// The error that the caller gets when the service cannot answer.
fn errno_of(error: &io::Error) -> Errno {
    if matches!(
        error.kind(),
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem
    ) {
        static WARNED: OnceLock<()> = OnceLock::new();
        WARNED.get_or_init(|| {
            tracing::error!(%error, "cannot answer an agent's system call: a root service needs CAP_SYS_PTRACE, and no filter above it may refuse pidfd_getfd");
        });
        return Errno::NOSYS;
    }
    match Errno::from_io_error(error) {
        // A file number that is not open, an unknown CPU.
        Some(error @ (Errno::BADF | Errno::INVAL | Errno::SRCH)) => error,
        // There is no memory at this address, or the thread has ended meanwhile.
        _ => Errno::FAULT,
    }
}
