//! The text of an interpolation in a recording. An interpolation is how the robot moves between an agent's actions.

use faceoff_types::Interpolation;

/// Parses the code of an interpolation: `1` … `5`, `-1` or `null`.
pub(crate) fn parse(text: &str) -> Option<Interpolation> {
    let code = match text {
        "null" => None,
        number => Some(number.parse().ok()?),
    };
    Interpolation::from_code(code).ok()
}
