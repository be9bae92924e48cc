//! Text of an archive's hash.

/// The hash of an archive as the end of a sentence; empty for a folder.
pub(super) fn hash_text(blake3: Option<&String>) -> String {
    blake3.map_or_else(String::new, |hash| format!("; BLAKE3 {hash}"))
}
