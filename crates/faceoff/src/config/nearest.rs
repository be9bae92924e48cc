//! What was meant by a name that is unknown.

/// How alike two names must be for one to be taken for the other (Damerau–Levenshtein, 0 to 1).
const ALIKE: f64 = 0.5;

/// An error's words, and the name that was probably meant if it is about an unknown one: the parser lists
/// those that it knows, between backquotes.
pub(super) fn told(error: &str) -> String {
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
        .filter(|(alike, _)| *alike >= ALIKE);
    match nearest {
        Some((_, known)) => format!("{}; did you mean `{known}`?", error.trim_end()),
        None => error.to_owned(),
    }
}
