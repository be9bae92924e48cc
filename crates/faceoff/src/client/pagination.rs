//! Paginated lists: the server sends one page at a time, and the `Link` header of a response names the next page.

use super::{Client, read_json};
use anyhow::Context;
use faceoff_api::API_BASE;
use reqwest::{
    Method, RequestBuilder,
    header::{HeaderMap, LINK},
};
use serde::de::DeserializeOwned;

impl Client {
    /// Reads all pages of a list.
    pub(super) async fn list<T: DeserializeOwned>(
        &self,
        request: RequestBuilder,
    ) -> anyhow::Result<Vec<T>> {
        let mut rows: Vec<T> = Vec::new();
        let mut request = request;
        loop {
            let response = self.send(request).await?;
            let next = next_page(response.headers())?;
            let page: Vec<T> = read_json(response).await?;
            let is_last = page.is_empty();
            rows.extend(page);
            match next {
                Some(path) if !is_last => request = self.request(Method::GET, &path),
                _ => return Ok(rows),
            }
        }
    }
}

/// The path of the next page, relative to [`API_BASE`].
fn next_page(headers: &HeaderMap) -> anyhow::Result<Option<String>> {
    let links = headers.get_all(LINK).into_iter();
    let mut links = links.filter_map(|value| value.to_str().ok());
    let Some(link) = links.find(|link| link.contains("rel=\"next\"")) else {
        return Ok(None);
    };
    let target = link.strip_prefix('<').and_then(|link| link.split_once('>'));
    let path = target.and_then(|(target, _)| target.strip_prefix(API_BASE));
    let path = path.with_context(|| {
        format!(
            "the server links to the next page of a list as {link:?}, which is no path of its API"
        )
    })?;
    Ok(Some(path.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn next_page_is_a_path_of_the_api() {
        let parse = |link: &str| {
            let headers = HeaderMap::from_iter([(LINK, link.parse().unwrap())]);
            next_page(&headers)
        };
        let link = "</api/v1/teams?limit=2&after=x>; rel=\"next\"";
        assert_eq!(
            parse(link).unwrap().as_deref(),
            Some("/teams?limit=2&after=x")
        );
        assert_eq!(parse("</other>; rel=\"help\"").unwrap(), None);
        assert!(parse("<http://elsewhere/>; rel=\"next\"").is_err());
        assert_eq!(next_page(&HeaderMap::new()).unwrap(), None);
    }
}
