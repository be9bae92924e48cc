//! The texts of the form of a stage, as typed.

use serde::Deserialize;
use std::collections::BTreeMap;

/// Texts by the name of their input.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(transparent)]
pub(in crate::organiser) struct StageForm(pub(super) BTreeMap<String, String>);

impl StageForm {
    /// Text of an input; empty if it is not in the form, like a checkbox that is not ticked.
    pub(in crate::organiser) fn text(&self, input: &str) -> &str {
        self.0.get(input).map_or("", String::as_str)
    }

    /// Name of the time zone of all times in the form.
    pub(in crate::organiser) fn zone(&self) -> &str {
        match self.text("zone").trim() {
            "" => "UTC",
            zone => zone,
        }
    }

    pub(in crate::organiser) fn is_ticked(&self, checkbox: &str) -> bool {
        !self.text(checkbox).is_empty()
    }
}
