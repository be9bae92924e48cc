use faceoff_types::Interpolation;

/// Parses an interpolation of a table: `1` … `5`, `-1` or `null`.
pub(crate) fn parse(text: &str) -> Option<Interpolation> {
    let code = match text {
        "null" => None,
        number => Some(number.parse().ok()?),
    };
    Interpolation::from_code(code).ok()
}
