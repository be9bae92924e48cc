//! The kind of an event: the name under which its variant is stored.

use super::Event;

impl Event {
    #[must_use]
    pub fn kind(&self) -> String {
        let json = serde_json::to_value(self).unwrap_or_default();
        json["kind"].as_str().unwrap_or_default().to_owned()
    }

    /// Checks that an event kind of this name exists.
    ///
    /// # Errors
    /// A text that lists all kinds, if there is none of this name.
    pub fn check_kind(name: &str) -> Result<(), String> {
        let kind_only = serde_json::json!({ "kind": name });
        match serde_json::from_value::<Self>(kind_only) {
            Err(error) if error.to_string().starts_with("unknown variant") => {
                Err(error.to_string())
            }
            // The kind exists; other errors are about missing fields.
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn event_kind_is_its_stored_name() {
        assert_eq!(Event::SeasonClosed.kind(), "season_closed");
    }

    #[test]
    fn check_kind_accepts_kinds_with_and_without_fields() {
        for kind in ["season_closed", "team_created", "day_started"] {
            assert_eq!(Event::check_kind(kind), Ok(()));
        }
        let unknown = Event::check_kind("day_start").unwrap_err();
        assert!(unknown.contains("day_started"), "{unknown}");
    }
}
