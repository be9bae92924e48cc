use faceoff_types::Interpolation;

/// An interpolation as tables have it: `1` … `5`, `-1` or `null`.
pub(crate) fn parse(text: &str) -> Option<Interpolation> {
    let code = match text {
        "null" => None,
        number => Some(number.parse().ok()?),
    };
    Interpolation::from_code(code).ok()
}
