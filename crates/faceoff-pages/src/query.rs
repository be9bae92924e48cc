//! Addresses with a query, as the pages' links have them.

use serde::Serialize;

/// A path with what asks for something below it; without anything to ask, the path alone.
pub(crate) fn asking(path: &str, query: &impl Serialize) -> String {
    match serde_urlencoded::to_string(query) {
        Ok(query) if !query.is_empty() => format!("{path}?{query}"),
        // All that pages ask are texts and numbers by name, which can be written.
        Ok(_) | Err(_) => path.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_a_meaning_in_a_query_is_written_as_text() {
        let asked = [("next", Some("/desk?a=b&c d")), ("left", None)];
        assert_eq!(
            asking("/sign-in", &asked),
            "/sign-in?next=%2Fdesk%3Fa%3Db%26c+d"
        );
        assert_eq!(asking("/", &[("left", None::<&str>)]), "/");
    }
}
