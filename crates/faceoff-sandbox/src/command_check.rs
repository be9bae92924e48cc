//! Checks the bundle's command before the start, so that common mistakes get a clear message.

use crate::{Runtime, program_file::ProgramFile};
use faceoff_types::AgentFaultKind;
use rustix::{
    fs::{FileType, Mode, OFlags, ResolveFlags, Stat, fstat, open, openat2},
    io::Errno,
};
use std::{collections::BTreeMap, path::Path};

/// Limits of a single argument or variable and of all together, far below the kernel's (128 KiB and 2 MiB), so that bubblewrap's
/// longer command line never exceeds those.
const MAX_WORD_BYTES: usize = 32 << 10;
const MAX_TOTAL_BYTES: usize = 256 << 10;

/// Refuses an empty command, arguments or variables that no program can be given, and a program of the bundle
/// that is missing, not executable or of another system. A program of the runtime is looked up inside the sandbox only.
///
/// Returns what may be missing for the start of the program, for the error if it fails.
pub(crate) fn check_command(
    bundle_dir: &Path,
    command: &[String],
    env: &BTreeMap<String, String>,
    runtime: &Runtime,
) -> Result<Option<String>, AgentFaultKind> {
    let refuse = |detail: String| Err(AgentFaultKind::CannotStart { detail });
    let Some(program) = command.first().filter(|program| !program.is_empty()) else {
        return refuse("the command is empty".into());
    };
    let words = || command.iter().chain(env.keys()).chain(env.values());
    if words().any(|word| word.contains('\0')) {
        return refuse("the command or its environment holds a zero byte".into());
    }
    if let Some(name) = env
        .keys()
        .find(|name| name.is_empty() || name.contains('='))
    {
        return refuse(format!(
            "`{name}` cannot be the name of an environment variable"
        ));
    }
    if words().any(|word| word.len() > MAX_WORD_BYTES)
        || words().map(String::len).sum::<usize>() > MAX_TOTAL_BYTES
    {
        return refuse(format!(
            "the command and its environment are too long: at most {MAX_WORD_BYTES} bytes a word, \
             {MAX_TOTAL_BYTES} in all"
        ));
    }
    let path_in_bundle = match program.strip_prefix("/agent/") {
        Some(rest) => rest.trim_start_matches('/'),
        None if program.starts_with('/') => return Ok(None),
        None if !program.contains('/') => {
            let search_path = env.get("PATH").unwrap_or(&runtime.path);
            return Ok(runtime.reason_program_is_missing(program, search_path));
        }
        None => program.as_str(),
    };
    if climbs_out(path_in_bundle) {
        return refuse(format!("`{program}` leads out of the bundle"));
    }
    let found = match stat_beneath(bundle_dir, path_in_bundle) {
        Ok(found) => found,
        Err(Errno::NOENT | Errno::NOTDIR | Errno::NAMETOOLONG) => {
            return refuse(format!("`{program}` is not in the bundle"));
        }
        // A link leads out of the bundle, or the kernel lacks the call: the start in the sandbox decides.
        Err(_) => return Ok(None),
    };
    match FileType::from_raw_mode(found.st_mode) {
        FileType::Directory => return refuse(format!("`{program}` is a folder")),
        FileType::RegularFile if found.st_mode & 0o111 == 0 => {
            return refuse(format!(
                "`{program}` is not executable (mode {:o})",
                found.st_mode & 0o777
            ));
        }
        _ => {}
    }
    match ProgramFile::read(bundle_dir, path_in_bundle) {
        Some(ProgramFile::Unusable(reason)) => refuse(format!("`{program}` {reason}")),
        Some(ProgramFile::MayStart(hint)) => Ok(hint),
        None => Ok(None),
    }
}

/// Does a relative path leave its starting folder?
fn climbs_out(path: &str) -> bool {
    let mut depth = 0_usize;
    for part in path.split('/').filter(|part| !matches!(*part, "" | ".")) {
        match (part, depth) {
            ("..", 0) => return true,
            ("..", _) => depth -= 1,
            _ => depth += 1,
        }
    }
    false
}

/// Metadata of a path in the bundle. Never resolves outside of the bundle, whatever its links say: that would
/// reveal the host's files to an agent. The last part is not followed if it is a link.
fn stat_beneath(bundle_dir: &Path, path: &str) -> Result<Stat, Errno> {
    let folder = open(
        bundle_dir,
        OFlags::PATH | OFlags::DIRECTORY | OFlags::CLOEXEC,
        Mode::empty(),
    )?;
    let found = openat2(
        folder,
        path,
        OFlags::PATH | OFlags::NOFOLLOW | OFlags::CLOEXEC,
        Mode::empty(),
        ResolveFlags::BENEATH | ResolveFlags::NO_MAGICLINKS,
    )?;
    fstat(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{
        fs,
        os::unix::fs::{PermissionsExt, symlink},
    };

    fn check(bundle_dir: &Path, program: &str) -> Option<String> {
        match check_command(
            bundle_dir,
            &[program.to_owned()],
            &BTreeMap::new(),
            &Runtime::native(),
        ) {
            Ok(_) => None,
            Err(AgentFaultKind::CannotStart { detail }) => Some(detail),
            Err(other) => panic!("{other:?}"),
        }
    }

    #[test]
    fn command_check_reveals_nothing_outside_the_bundle() {
        let host = tempfile::tempdir().unwrap();
        let bundle = host.path().join("bundle");
        fs::create_dir_all(bundle.join("bin")).unwrap();
        fs::write(bundle.join("agent"), "").unwrap();
        // An existing file with an unusual mode, and a missing one, must get the same answer.
        fs::write(host.path().join("secret"), "").unwrap();
        fs::set_permissions(
            host.path().join("secret"),
            fs::Permissions::from_mode(0o640),
        )
        .unwrap();
        symlink("..", bundle.join("up")).unwrap();
        symlink(host.path(), bundle.join("host")).unwrap();
        symlink("../secret", bundle.join("link")).unwrap();
        for path_prefix in [
            "../",
            "./../",
            "bin/../../",
            "bin/./../.././",
            "/agent/../",
            "/agent//../",
            "up/",
            "bin/../up/",
            "host/",
            "/agent/host/",
        ] {
            let messages = ["secret", "missing", "secret/x"].map(|name| {
                let message = check(&bundle, &format!("{path_prefix}{name}"));
                message.map(|message| message.replace(name, "NAME"))
            });
            assert_eq!(messages[0], messages[1], "{path_prefix}");
            assert_eq!(messages[0], messages[2], "{path_prefix}");
        }
        let absolute = host.path().join("secret").display().to_string();
        for program in [&*absolute, "/etc/shadow", "//agent/../etc/shadow", "./link"] {
            assert_eq!(check(&bundle, program), None, "{program}");
        }
        let beneath = check(&bundle, &format!("/agent/{absolute}")).unwrap();
        assert!(beneath.ends_with("is not in the bundle"), "{beneath}");
        assert_eq!(
            check(&bundle, "../secret").unwrap(),
            "`../secret` leads out of the bundle"
        );
    }

    #[test]
    fn command_check_names_mistakes_in_the_bundle() {
        let bundle = tempfile::tempdir().unwrap();
        fs::create_dir(bundle.path().join("bin")).unwrap();
        fs::write(bundle.path().join("bin/agent"), "").unwrap();
        let message = |program: &str| check(bundle.path(), program).unwrap();
        assert!(message("./bin").ends_with("is a folder"));
        assert!(message("bin/../bin/agent").ends_with("is not executable (mode 644)"));
        assert!(message("bin/agent/x").ends_with("is not in the bundle"));
        let agent = bundle.path().join("bin/agent");
        fs::set_permissions(agent, fs::Permissions::from_mode(0o755)).unwrap();
        assert_eq!(check(bundle.path(), "/agent/bin/agent"), None);
    }
}
