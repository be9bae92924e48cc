use serde::Serialize;

/// Something that is as it should be, or has a cure.
#[derive(Debug, PartialEq, Eq, Serialize)]
pub struct Checked {
    pub name: &'static str,
    pub found: String,
    pub cure: Option<String>,
}
