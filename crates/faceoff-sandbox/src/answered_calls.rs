//! System calls of agents that the service answers in place of the kernel (*user notification* of seccomp).
//!
//! `statfs`, `fstatfs` and `sysinfo` show counters of the whole host, which an upload, a visitor or another agent moves. They cannot
//! fail: C libraries do not check `sysinfo`, and old ones find `/dev/shm` by `statfs`. So every agent gets the same figures at any
//! time. `setsid` is executed, but only now and then ([`crate::session_numbers`]).
//!
//! A call waits until this service has answered it. Only the calling thread waits, and the answers are slower the more there are, so
//! that no agent can keep the evaluator's CPUs busy.

use crate::{
    SandboxError,
    cpu_clock::own_cpu_time,
    error::IoContext,
    seccomp,
    session_numbers::{self, SessionBudget},
};
use rustix::{
    event::{PollFd, PollFlags, poll},
    io::Errno,
    net::{
        AddressFamily, RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer,
        SendAncillaryMessage, SendFlags, SocketFlags, SocketType, recvmsg, sendmsg, socketpair,
    },
    system::sysinfo,
    thread::set_no_new_privs,
};
use seccompiler::BpfProgram;
use std::{
    fs::File,
    io::{self, IoSlice, IoSliceMut},
    mem::MaybeUninit,
    os::{
        fd::{AsFd, AsRawFd, FromRawFd, OwnedFd},
        unix::fs::FileExt,
    },
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

/// CPU time of all answers without a pause.
const QUICK_ANSWERS: Duration = Duration::from_millis(20);
/// Minimum pause before each further answer.
const PAUSE: Duration = Duration::from_millis(1);
/// The pause is at least this multiple of the CPU time of the last answer: an agent can make an answer expensive, by memory that has no
/// pages yet.
const PAUSE_PER_CPU_TIME: u32 = 20;

/// The filter, and the socket through which the child sends the *listener* (the file descriptor that reports its calls).
#[derive(Debug)]
pub(crate) struct AnsweredCalls {
    program: BpfProgram,
    child_socket: OwnedFd,
}

/// The service's side before the agent has started.
#[derive(Debug)]
pub(crate) struct CallAnswerer {
    socket: OwnedFd,
    answers: FixedAnswers,
}

impl AnsweredCalls {
    /// Both sides for one agent, whose scratch folder has `scratch_bytes`.
    pub(crate) fn new(scratch_bytes: u64) -> Result<(Self, CallAnswerer), SandboxError> {
        let (socket, child_socket) = socketpair(
            AddressFamily::UNIX,
            SocketType::STREAM,
            SocketFlags::CLOEXEC,
            None,
        )
        .context("cannot make a socket for the agent's system calls")?;
        let answers = FixedAnswers {
            blocks: free_blocks(scratch_bytes),
        };
        // Read before the first agent starts.
        FixedAnswers::host();
        Ok((
            Self {
                program: seccomp::answered_calls()?,
                child_socket,
            },
            CallAnswerer { socket, answers },
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
            &[IoSlice::new(b"l")],
            &mut message,
            SendFlags::empty(),
        )?;
        Ok(())
    }
}

impl CallAnswerer {
    /// Starts the thread that answers, once the child has installed its filter.
    pub(crate) fn start(self) -> Result<AnswerThread, SandboxError> {
        const ACTION: &str = "cannot watch the agent's system calls";
        let listener = receive_listener(&self.socket).context(ACTION)?;
        let answers = self.answers;
        let thread = std::thread::Builder::new()
            .name("agent-calls".into())
            .spawn(move || {
                block_signals();
                let sessions = answer_calls(&listener, answers);
                session_numbers::skip_some(sessions);
            })
            .context(ACTION)?;
        Ok(AnswerThread(thread))
    }
}

/// The thread that answers, which ends after the last process of the agent.
#[derive(Debug)]
pub(crate) struct AnswerThread(JoinHandle<()>);

impl AnswerThread {
    /// Waits until sessions have been skipped, before another agent starts. Call it when the process tree is dead.
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

/// The figures that all agents get.
#[derive(Debug, Clone, Copy)]
struct FixedAnswers {
    /// Size of every file system, in blocks.
    blocks: u64,
}

impl FixedAnswers {
    /// The answer of `statfs` and `fstatfs`: an empty file system of the scratch folder's size. On 64-bit machines the fields of the
    /// kernel's structure are 64-bit integers in this order; the last four are unused.
    fn file_system(self) -> [u64; 15] {
        let (size, free, available) = (self.blocks, self.blocks, self.blocks);
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

    /// The answer of `sysinfo`: the host's figures before the first agent started. On 64-bit machines that put the lower byte first, the
    /// fields of the kernel's structure and their padding are these integers.
    fn host() -> &'static [u64; 14] {
        static FIGURES: OnceLock<[u64; 14]> = OnceLock::new();
        FIGURES.get_or_init(|| {
            let host = sysinfo();
            let [load_1, load_5, load_15] = host.loads;
            [
                host.uptime.cast_unsigned(),
                load_1,
                load_5,
                load_15,
                host.totalram,
                host.freeram,
                host.sharedram,
                host.bufferram,
                host.totalswap,
                host.freeswap,
                host.procs.into(),
                host.totalhigh,
                host.freehigh,
                host.mem_unit.into(),
            ]
        })
    }
}

/// How a call is answered.
enum Reply {
    /// It returns zero.
    Done,
    Failed(Errno),
    /// The kernel executes it.
    Execute,
}

/// Answers the calls until the last process with the filter has ended. Returns the number of its sessions.
fn answer_calls(listener: &OwnedFd, answers: FixedAnswers) -> u32 {
    let mut sessions = SessionBudget::new(Instant::now());
    let mut last_answer = Duration::ZERO;
    loop {
        let mut fds = [PollFd::new(listener, PollFlags::IN)];
        match poll(&mut fds, None) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(_) => return sessions.started,
        }
        let events = fds[0].revents();
        if !events.contains(PollFlags::IN) {
            if events.is_empty() {
                continue;
            }
            return sessions.started;
        }
        let begin = own_cpu_time();
        if begin > QUICK_ANSWERS {
            std::thread::sleep(PAUSE.max(last_answer * PAUSE_PER_CPU_TIME));
        }
        let call = match receive_call(listener) {
            Ok(call) => call,
            // The thread was killed or got a signal meanwhile.
            Err(Errno::NOENT | Errno::INTR) => continue,
            Err(_) => return sessions.started,
        };
        let reply = answer(listener, &call, answers, &mut sessions);
        // Fails if the thread is dead, or has got a signal; then it repeats its call.
        let _ = send_reply(listener, call.id, &reply);
        last_answer = own_cpu_time().saturating_sub(begin);
    }
}

fn answer(
    listener: &OwnedFd,
    call: &libc::seccomp_notif,
    answers: FixedAnswers,
    sessions: &mut SessionBudget,
) -> Reply {
    let [first, second, ..] = call.data.args;
    let written = match i64::from(call.data.nr) {
        libc::SYS_statfs | libc::SYS_fstatfs => {
            write_to_caller(listener, call, second, &answers.file_system())
        }
        libc::SYS_sysinfo => write_to_caller(listener, call, first, FixedAnswers::host()),
        libc::SYS_setsid if sessions.take(Instant::now()) => return Reply::Execute,
        libc::SYS_setsid => return Reply::Failed(Errno::PERM),
        _ => return Reply::Failed(Errno::NOSYS),
    };
    let error = match written {
        Ok(()) => return Reply::Done,
        Err(error) => error,
    };
    if matches!(
        error.kind(),
        io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem
    ) {
        static WARNED: OnceLock<()> = OnceLock::new();
        WARNED.get_or_init(|| {
            tracing::error!(%error, "cannot answer an agent's system call: a root service needs CAP_SYS_PTRACE");
        });
        return Reply::Failed(Errno::NOSYS);
    }
    // There is no memory at this address, or the thread has ended meanwhile.
    Reply::Failed(Errno::FAULT)
}

/// Writes into the memory of the calling thread.
fn write_to_caller(
    listener: &OwnedFd,
    call: &libc::seccomp_notif,
    address: u64,
    figures: &[u64],
) -> io::Result<()> {
    let memory = File::options()
        .write(true)
        .open(format!("/proc/{}/mem", call.pid))?;
    // If the call still waits now, its pid belonged to the caller when the file was opened.
    check_waiting(listener, call.id)?;
    let bytes: Vec<u8> = figures
        .iter()
        .flat_map(|figure| figure.to_ne_bytes())
        .collect();
    memory.write_all_at(&bytes, address)
}

/// Installs a filter in the calling process and returns its listener. With `WAIT_KILLABLE_RECV` (Linux 5.19) a call that this service has
/// received is not repeated because of a signal.
fn install_with_listener(program: &BpfProgram) -> Result<OwnedFd, Errno> {
    const NEW_LISTENER: libc::c_ulong = 1 << 3;
    const WAIT_KILLABLE_RECV: libc::c_ulong = 1 << 5;
    let filter = libc::sock_fprog {
        len: program.len() as libc::c_ushort,
        filter: program.as_ptr().cast_mut().cast(),
    };
    let install = |flags: libc::c_ulong| {
        #[expect(unsafe_code, reason = "no library installs a filter with a listener")]
        // SAFETY: the kernel reads the program at this address during the call; the new descriptor has no other owner.
        unsafe {
            let fd = libc::syscall(
                libc::SYS_seccomp,
                libc::SECCOMP_SET_MODE_FILTER,
                flags,
                &raw const filter,
            );
            if fd < 0 {
                return Err(last_error());
            }
            Ok(OwnedFd::from_raw_fd(fd as libc::c_int))
        }
    };
    match install(NEW_LISTENER | WAIT_KILLABLE_RECV) {
        Err(Errno::INVAL) => install(NEW_LISTENER),
        result => result,
    }
}

fn receive_call(listener: &OwnedFd) -> Result<libc::seccomp_notif, Errno> {
    #[expect(unsafe_code, reason = "the kernel requires a zeroed structure")]
    // SAFETY: the structure consists of integers, for which zero is a value.
    let mut call: libc::seccomp_notif = unsafe { MaybeUninit::zeroed().assume_init() };
    control(listener, NOTIF_RECV, (&raw mut call).cast()).map(|()| call)
}

fn send_reply(listener: &OwnedFd, id: u64, reply: &Reply) -> Result<(), Errno> {
    let (error, flags) = match reply {
        Reply::Done => (0, 0),
        Reply::Failed(error) => (-error.raw_os_error(), 0),
        Reply::Execute => (0, EXECUTE),
    };
    let mut answer = libc::seccomp_notif_resp {
        id,
        val: 0,
        error,
        flags,
    };
    control(listener, NOTIF_SEND, (&raw mut answer).cast())
}

fn check_waiting(listener: &OwnedFd, mut id: u64) -> Result<(), Errno> {
    control(listener, NOTIF_ID_VALID, (&raw mut id).cast())
}

/// Requests of a listener (`SECCOMP_IOCTL_NOTIF_*`): direction, size, type `!` and number.
const NOTIF_RECV: u32 = notification_request(3, size_of::<libc::seccomp_notif>(), 0);
const NOTIF_SEND: u32 = notification_request(3, size_of::<libc::seccomp_notif_resp>(), 1);
const NOTIF_ID_VALID: u32 = notification_request(1, size_of::<u64>(), 2);
/// The flag `SECCOMP_USER_NOTIF_FLAG_CONTINUE`.
const EXECUTE: u32 = 1;

const fn notification_request(direction: u32, size: usize, number: u32) -> u32 {
    (direction << 30) | ((size as u32) << 16) | ((b'!' as u32) << 8) | number
}

fn control(listener: &OwnedFd, request: u32, argument: *mut libc::c_void) -> Result<(), Errno> {
    #[expect(unsafe_code, reason = "no library has the requests of a listener")]
    // SAFETY: each caller passes a structure of the size that the request contains, which lives during the call.
    let result = unsafe { libc::ioctl(listener.as_raw_fd(), request as _, argument) };
    if result == -1 {
        Err(last_error())
    } else {
        Ok(())
    }
}

fn last_error() -> Errno {
    Errno::from_io_error(&io::Error::last_os_error()).unwrap_or(Errno::INVAL)
}
