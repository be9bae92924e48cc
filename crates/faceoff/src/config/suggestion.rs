//! Suggestions for unknown names in the configuration.

/// Smallest similarity of a suggestion (normalised Damerau–Levenshtein, 0 to 1).
const MIN_SIMILARITY: f64 = 0.5;

/// Appends the most similar known name to the message of an unknown field. The message lists the known names
/// in backquotes.
pub(super) fn with_suggestion(error: &str) -> String {
    let Some((_, rest)) = error.split_once("unknown field `") else {
        return error.to_owned();
    };
    let mut names = rest.split('`').step_by(2);
    let unknown = names.next().unwrap_or_default();
    let nearest = names
        .map(|known| {
            (
                strsim::normalized_damerau_levenshtein(unknown, known),
                known,
            )
        })
        .max_by(|one, other| one.0.total_cmp(&other.0))
        .filter(|(similarity, _)| *similarity >= MIN_SIMILARITY);
    match nearest {
        Some((_, known)) => format!("{}; did you mean `{known}`?", error.trim_end()),
        None => error.to_owned(),
    }
}
