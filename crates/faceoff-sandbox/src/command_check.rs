//! Looks at the bundle's command before anything is started, so that the usual mistakes get a clear word.

use faceoff_types::AgentFaultKind;
use std::{collections::BTreeMap, fs, os::unix::fs::PermissionsExt, path::Path};

/// Far below what the kernel takes (128 KiB and 2 MiB), so that it is never our command line that is too
/// long.
const MAX_WORD_BYTES: usize = 32 << 10;
const MAX_TOTAL_BYTES: usize = 256 << 10;

/// Refuses an empty command, what cannot be passed to a program, and a program of the bundle that is missing or not executable. A program
/// of the runtime is looked up inside the sandbox only.
pub(crate) fn check_command(
    bundle_dir: &Path,
    command: &[String],
    env: &BTreeMap<String, String>,
) -> Result<(), AgentFaultKind> {
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
    let in_bundle = match program.strip_prefix("/agent/") {
        Some(rest) => rest,
        None if program.starts_with('/') || !program.contains('/') => return Ok(()),
        None => program.as_str(),
    };
    // Links are followed inside the sandbox, where they cannot leave the bundle.
    let Ok(meta) = fs::symlink_metadata(bundle_dir.join(in_bundle)) else {
        return refuse(format!("`{program}` is not in the bundle"));
    };
    if meta.is_dir() {
        return refuse(format!("`{program}` is a folder"));
    }
    if meta.is_file() && meta.permissions().mode() & 0o111 == 0 {
        return refuse(format!(
            "`{program}` is not executable (mode {:o})",
            meta.permissions().mode() & 0o777
        ));
    }
    Ok(())
}
