//! Makes files reachable for an agent's user that cannot reach them by path, and gives the agent files of its own where several agents
//! would share the host's.
//!
//! If the process that starts agents (the *service*) is root, it keeps bundles in a folder closed to other users. bubblewrap runs as the
//! agent's user and looks its sources up by path. So the child, while it is still root, mounts them below `/tmp` of a private mount
//! namespace. No other process sees these mounts, and they end with the namespace.

use crate::{SandboxError, agent_user::AgentUser, error::IoContext, file_tree};
use rustix::{
    fs::{CWD, FileType, Mode, OFlags, chmodat, makedev, mkdir, mknodat, open},
    io::Errno,
    mount::{
        FsMountFlags, FsOpenFlags, MountAttrFlags, MountFlags, MountPropagationFlags,
        MoveMountFlags, OpenTreeFlags, fsconfig_create, fsconfig_set_string, fsmount, fsopen,
        mount, mount_bind, mount_change, move_mount, open_tree,
    },
    thread::{UnshareFlags, unshare_unsafe},
};
use std::{
    ffi::{CStr, CString, OsString},
    fs, io,
    os::{
        fd::{AsRawFd, OwnedFd},
        unix::ffi::OsStrExt,
    },
    path::{Path, PathBuf},
};

/// The folder over which the mounts' file system is mounted. Every host has it, and only the private namespace sees the change.
const MOUNT_FOLDER: &CStr = c"/tmp";

/// A larger bundle is not copied into memory for each start of its agent, since copying would take long.
const COPIED_BUNDLE_BYTES: u64 = 32 << 20;

/// The devices that bubblewrap shows, a name for them in [`MOUNT_FOLDER`], and their major and minor numbers. A lock of a device is a
/// lock of its file, which every agent could see. So each agent gets files of its own.
const DEVICES: [(&CStr, &CStr, u32, u32); 6] = [
    (c"/dev/null", c"/tmp/null", 1, 3),
    (c"/dev/zero", c"/tmp/zero", 1, 5),
    (c"/dev/full", c"/tmp/full", 1, 7),
    (c"/dev/random", c"/tmp/random", 1, 8),
    (c"/dev/urandom", c"/tmp/urandom", 1, 9),
    (c"/dev/tty", c"/tmp/tty", 5, 0),
];

/// The mounts for one agent's bubblewrap.
#[derive(Debug)]
pub(crate) struct PrivateMounts {
    sources: Vec<Source>,
    /// May this process make device nodes?
    can_make_device_nodes: bool,
}

#[derive(Debug)]
struct Source {
    /// The host's file or folder, which becomes a detached mount in the child; `None` for a copy.
    path: Option<CString>,
    mount_point: CString,
    is_folder: bool,
    /// The detached mount, until it is moved to `mount_point`.
    tree: Option<OwnedFd>,
}

impl PrivateMounts {
    pub(crate) fn new() -> Self {
        Self {
            sources: Vec::new(),
            // The root user of a container's user namespace may not make device nodes.
            can_make_device_nodes: AgentUser::is_host_root(),
        }
    }

    /// Adds `path` and returns the path at which bubblewrap will find it.
    pub(crate) fn add(&mut self, path: &Path) -> Result<OsString, SandboxError> {
        let failure = format!("cannot show {} to the agent", path.display());
        let path = fs::canonicalize(path).context(&failure)?;
        let is_folder = fs::metadata(&path).context(&failure)?.is_dir();
        let path = CString::new(path.as_os_str().as_bytes())
            .map_err(io::Error::other)
            .context(&failure)?;
        self.push(Some(path), None, is_folder)
    }

    /// Adds the folder `path` as a copy in a file system of its own, in memory, unless it is large: the numbers and times of its files
    /// depend on nothing else on the host. Returns the path at which bubblewrap will find it.
    pub(crate) fn add_bundle(&mut self, path: &Path) -> Result<OsString, SandboxError> {
        let mut bytes = 0;
        file_tree::add_size(path, COPIED_BUNDLE_BYTES, &mut bytes)
            .context(format_args!("cannot look into {}", path.display()))?;
        if bytes > COPIED_BUNDLE_BYTES {
            return self.add(path);
        }
        let mount = file_system_in_memory().context("cannot make a file system for the bundle")?;
        // The folder itself, not the link to it.
        let inside = PathBuf::from(format!("/proc/self/fd/{}/.", mount.as_raw_fd()));
        file_tree::copy(path, &inside)
            .context(format_args!("cannot copy {} into memory", path.display()))?;
        self.push(None, Some(mount), true)
    }

    fn push(
        &mut self,
        path: Option<CString>,
        tree: Option<OwnedFd>,
        is_folder: bool,
    ) -> Result<OsString, SandboxError> {
        let mount_point = format!("/tmp/{}", self.sources.len());
        self.sources.push(Source {
            path,
            tree,
            mount_point: CString::new(mount_point.clone())
                .map_err(io::Error::other)
                .context("cannot name a mount point")?,
            is_folder,
        });
        Ok(mount_point.into())
    }

    /// Makes all mounts. It is called between fork and exec, as root, and makes system calls only.
    pub(crate) fn mount_all(&mut self) -> Result<(), Errno> {
        #[expect(
            unsafe_code,
            reason = "rustix marks all unsharing unsafe, since some flags affect shared file descriptors"
        )]
        // SAFETY: NEWNS does not affect the table of file descriptors, and this process has one thread.
        unsafe {
            unshare_unsafe(UnshareFlags::NEWNS)?;
        }
        // Mounts made from here on do not propagate to the host.
        mount_change(
            c"/",
            MountPropagationFlags::DOWNSTREAM | MountPropagationFlags::REC,
        )?;
        // Detach all sources before the folder is covered, since some may be inside it.
        let clone_flags = OpenTreeFlags::OPEN_TREE_CLONE
            | OpenTreeFlags::OPEN_TREE_CLOEXEC
            | OpenTreeFlags::AT_RECURSIVE;
        for source in &mut self.sources {
            if let Some(path) = &source.path {
                source.tree = Some(open_tree(CWD, path, clone_flags)?);
            }
        }
        mount(
            c"tmpfs",
            MOUNT_FOLDER,
            c"tmpfs",
            MountFlags::NOSUID,
            c"mode=0755,size=64k",
        )?;
        if self.can_make_device_nodes {
            make_devices()?;
        }
        for source in &mut self.sources {
            if source.is_folder {
                mkdir(&source.mount_point, Mode::from_raw_mode(0o755))?;
            } else {
                let create_flags = OFlags::CREATE | OFlags::WRONLY | OFlags::CLOEXEC;
                drop(open(
                    &source.mount_point,
                    create_flags,
                    Mode::from_raw_mode(0o644),
                )?);
            }
            if let Some(tree) = source.tree.take() {
                move_mount(
                    tree,
                    c"",
                    CWD,
                    &source.mount_point,
                    MoveMountFlags::MOVE_MOUNT_F_EMPTY_PATH,
                )?;
            }
        }
        Ok(())
    }
}

/// Makes device nodes and mounts them over the host's, from which bubblewrap takes them.
fn make_devices() -> Result<(), Errno> {
    let everyone = Mode::from_raw_mode(0o666);
    for (device, file, major, minor) in DEVICES {
        mknodat(
            CWD,
            file,
            FileType::CharacterDevice,
            everyone,
            makedev(major, minor),
        )?;
        // The umask may have removed bits.
        chmodat(CWD, file, everyone, rustix::fs::AtFlags::empty())?;
        mount_bind(file, device)?;
    }
    Ok(())
}

/// A new file system in memory, mounted nowhere.
fn file_system_in_memory() -> Result<OwnedFd, Errno> {
    let settings = fsopen("tmpfs", FsOpenFlags::FSOPEN_CLOEXEC)?;
    fsconfig_set_string(&settings, "mode", "0755")?;
    // More than a bundle that is copied may have; it may change meanwhile, if it is a developer's folder.
    fsconfig_set_string(&settings, "size", (2 * COPIED_BUNDLE_BYTES).to_string())?;
    fsconfig_set_string(
        &settings,
        "nr_inodes",
        (2 * COPIED_BUNDLE_BYTES / 4096).to_string(),
    )?;
    fsconfig_create(&settings)?;
    fsmount(
        &settings,
        FsMountFlags::FSMOUNT_CLOEXEC,
        MountAttrFlags::MOUNT_ATTR_NOSUID | MountAttrFlags::MOUNT_ATTR_NODEV,
    )
}
