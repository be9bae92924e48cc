//! Addresses with a query string, for links of the pages.

use serde::Serialize;

/// The path with `query` as its query string; the path alone if the query is empty.
pub(crate) fn with_query(path: &str, query: &impl Serialize) -> String {
    match serde_urlencoded::to_string(query) {
        Ok(query) if !query.is_empty() => format!("{path}?{query}"),
        // Queries of pages are flat lists of texts and numbers: writing them cannot fail.
        Ok(_) | Err(_) => path.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_characters_in_a_query_are_escaped() {
        let query = [("next", Some("/dashboard?a=b&c d")), ("omitted", None)];
        assert_eq!(
            with_query("/sign-in", &query),
            "/sign-in?next=%2Fdashboard%3Fa%3Db%26c+d"
        );
        assert_eq!(with_query("/", &[("omitted", None::<&str>)]), "/");
    }
}
