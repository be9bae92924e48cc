//! The names of what happens.

use super::Event;

impl Event {
    #[must_use]
    pub fn kind(&self) -> String {
        let told = serde_json::to_value(self).unwrap_or_default();
        told["kind"].as_str().unwrap_or_default().to_owned()
    }

    /// Is there an event of this name?
    ///
    /// # Errors
    /// If not, with the names that there are.
    pub fn check_kind(name: &str) -> Result<(), String> {
        let named = serde_json::json!({ "kind": name });
        match serde_json::from_value::<Self>(named) {
            Err(error) if error.to_string().starts_with("unknown variant") => {
                Err(error.to_string())
            }
            // There is, whether or not it has fields that are wanting here.
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_has_the_name_that_the_log_has() {
        assert_eq!(Event::SeasonClosed.kind(), "season_closed");
    }

    #[test]
    fn names_of_events_are_known_with_and_without_fields() {
        for kind in ["season_closed", "team_created", "day_started"] {
            assert_eq!(Event::check_kind(kind), Ok(()));
        }
        let unknown = Event::check_kind("day_start").unwrap_err();
        assert!(unknown.contains("day_started"), "{unknown}");
    }
}
