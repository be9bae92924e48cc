//! Looks at the bundle's command before anything is started, so that the usual mistakes get a clear word.

use faceoff_types::AgentFaultKind;
use std::{fs, os::unix::fs::PermissionsExt, path::Path};

/// Refuses an empty command and a program of the bundle that is missing or not executable. A program
/// of the runtime is looked up inside the sandbox only.
pub(crate) fn check_command(bundle_dir: &Path, command: &[String]) -> Result<(), AgentFaultKind> {
    let refuse = |detail: String| Err(AgentFaultKind::CannotStart { detail });
    let Some(program) = command.first().filter(|program| !program.is_empty()) else {
        return refuse("the command is empty".into());
    };
    if command.iter().any(|word| word.contains('\0')) {
        return refuse("the command holds a zero byte".into());
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
