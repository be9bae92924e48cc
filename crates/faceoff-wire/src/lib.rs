//! What Faceoff promises to outsiders: the agent protocol, the bundle's `agent.toml`, the files of a
//! dataset and the work orders of slots, which may be on other machines.
//!
//! Everything here is versioned, size-capped and free of I/O: bytes come in and go out as slices,
//! and the crate neither reads a clock nor knows a process. What an agent says is parsed once, into
//! types; whatever does not fit becomes an [`AgentFaultKind`](faceoff_types::AgentFaultKind) that
//! says what was expected and what came.
//!
//! * [`message`]: what the evaluator says (`hello`, `reset`, `step`, `end`, `bye`);
//! * [`answer`]: what the agent answers (`ready`, `act`);
//! * [`Manifest`][]: `agent.toml`;
//! * [`dataset`]: `manifest.json` and `violations.json` of a recorded evaluation;
//! * [`work`]: what a worker slot is told to do and reports back.

pub mod answer;
pub mod dataset;
mod interpolation;
mod manifest;
pub mod message;
pub mod work;

pub use interpolation::{InterpolationCode, UnknownInterpolation};
pub use manifest::{MANIFEST_MAX_BYTES, Manifest, ManifestError};
pub use message::{Env, Message, ProtocolTask};

/// Version of the agent protocol, the `protocol` of `hello` and `ready`.
pub const PROTOCOL_VERSION: u32 = 1;

/// Longest line in either direction, in bytes, the newline not counted.
pub const MAX_LINE_BYTES: usize = 64 * 1024;

/// Joints of the arm: the innermost length of every action.
pub const JOINTS: usize = 7;

/// Substeps of a control step: the outermost length of a whole-trajectory action.
pub const SUBSTEPS: usize = 20;

/// Characters of an offending line that are kept in a fault.
const QUOTED_CHARS: usize = 400;

/// An offending line as a fault shows it: lossy UTF-8, cut to 400 characters.
#[must_use]
pub fn quote_line(line: &[u8]) -> String {
    // Four bytes hold any character, so that a long line is not decoded as a whole.
    let head = &line[..line.len().min(4 * QUOTED_CHARS)];
    let text = String::from_utf8_lossy(head);
    let mut quoted: String = text.chars().take(QUOTED_CHARS).collect();
    if quoted.len() < text.len() || head.len() < line.len() {
        quoted.push('…');
        if quoted.chars().count() > QUOTED_CHARS {
            quoted = quoted.chars().take(QUOTED_CHARS - 1).chain(['…']).collect();
        }
    }
    quoted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quoted_line_is_cut_to_400_characters_and_says_so() {
        assert_eq!(quote_line(b"{}"), "{}");
        assert_eq!(quote_line(&[b'a'; 400]), "a".repeat(400));
        let cut = quote_line(&[b'a'; 401]);
        assert_eq!(cut.chars().count(), 400);
        assert!(cut.ends_with("a…"));
        assert_eq!(
            quote_line("é".repeat(50_000).as_bytes()).chars().count(),
            400
        );
        assert_eq!(quote_line(&[0xff]), "\u{fffd}");
    }
}
