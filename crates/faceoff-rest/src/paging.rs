//! Paging of lists. A page is identified by the row before it, so rows that are added meanwhile do not shift the pages: a
//! client that reads all pages gets every row that existed at the beginning exactly once.

use axum::{
    Json,
    extract::{FromRequestParts, OriginalUri, Query},
    http::{HeaderValue, Uri, header, request::Parts},
    response::{IntoResponse, Response},
};
use faceoff_service::{
    extract::QueryParams,
    problem::{Problem, ProblemKind},
};
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::{fmt::Display, str::FromStr};
use utoipa::IntoParams;

/// Default and maximum number of rows of a page.
const DEFAULT_LIMIT: u32 = 100;
const MAX_LIMIT: u32 = 200;

/// Query parameters of a paged list.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub(crate) struct PageQuery {
    /// Maximum number of rows. Default: 100.
    #[param(minimum = 1, maximum = 200)]
    limit: Option<u32>,
    /// Return the rows after this one. Taken from the header `Link` of the previous page.
    after: Option<String>,
}

/// A requested page of a list whose rows have ids of type `I`.
#[derive(Debug)]
pub(crate) struct Page<I> {
    /// Maximum number of rows.
    pub(crate) limit: u32,
    /// Id of the row before the page; `None` for the first page.
    pub(crate) after: Option<I>,
    /// Path and query of the list without `after`; it ends with `?` or `&`.
    list_uri: String,
}

impl<S, I> FromRequestParts<S> for Page<I>
where
    S: Send + Sync,
    I: FromStr<Err: Display> + Send,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        let QueryParams(PageQuery { limit, after }) =
            QueryParams::from_request_parts(parts, state).await?;
        let limit = limit.unwrap_or(DEFAULT_LIMIT);
        if !(1..=MAX_LIMIT).contains(&limit) {
            let detail = format!("expected 1 to {MAX_LIMIT}, got {limit}");
            return Err(Problem::invalid("limit", detail));
        }
        let uri = match OriginalUri::from_request_parts(parts, state).await {
            Ok(OriginalUri(uri)) => uri,
            Err(never) => match never {},
        };
        let after = after.map(|text| text.parse::<I>());
        let after = after.transpose().map_err(|error| {
            let detail = format!("after: {error}; use the header Link of the previous page");
            Problem::new(ProblemKind::InvalidRequest, detail)
        })?;
        let params = uri.query().unwrap_or_default().split('&');
        let other_params = params.filter(|param| !param.is_empty() && !param.starts_with("after="));
        let list_uri = other_params.fold(format!("{}?", uri.path()), |list_uri, param| {
            format!("{list_uri}{param}&")
        });
        Ok(Self {
            limit,
            after,
            list_uri,
        })
    }
}

impl<I: Display + PartialEq> Page<I> {
    /// The requested page of `rows`, all rows of a list that is short enough to be read completely.
    ///
    /// # Errors
    /// `InvalidRequest` if `after` is not in the list.
    pub(crate) fn select<T>(
        &self,
        rows: impl IntoIterator<Item = T>,
        id: impl Fn(&T) -> I,
    ) -> Result<Paged<T>, Problem> {
        let mut rows = rows.into_iter();
        if let Some(after) = &self.after
            && !rows.any(|row| id(&row) == *after)
        {
            return Err(self.unknown_row());
        }
        let rows: Vec<T> = rows.take(self.limit as usize + 1).collect();
        Ok(self.page(rows, id))
    }

    /// The page with these rows. If there is one row more than `limit`, it is dropped, and the page links to a next one.
    pub(crate) fn page<T>(&self, mut rows: Vec<T>, id: impl Fn(&T) -> I) -> Paged<T> {
        let has_more = rows.len() > self.limit as usize;
        rows.truncate(self.limit as usize);
        let last = rows.last().filter(|_| has_more);
        let next_link =
            last.map(|row| format!("<{}after={}>; rel=\"next\"", self.list_uri, id(row)));
        Paged { rows, next_link }
    }

    /// Adds a query parameter to the link of the next page, for a list whose default depends on the time.
    pub(crate) fn with_parameter(mut self, name: &str, value: impl Display) -> Self {
        self.list_uri.push_str(&format!("{name}={value}&"));
        self
    }

    /// The problem that `after` is not in the list.
    pub(crate) fn unknown_row(&self) -> Problem {
        Problem::new(
            ProblemKind::InvalidRequest,
            "after: expected a row of the list, got an unknown or removed one; start again without it",
        )
    }
}

/// A page with the link to the next one.
#[derive(Debug)]
pub(crate) struct Paged<T> {
    rows: Vec<T>,
    /// Value of the header `Link`; `None` on the last page.
    next_link: Option<String>,
}

impl<T> Paged<T> {
    /// Converts each row.
    pub(crate) fn map<V>(self, view: impl FnMut(T) -> V) -> Paged<V> {
        Paged {
            rows: self.rows.into_iter().map(view).collect(),
            next_link: self.next_link,
        }
    }

    /// Converts all rows together.
    pub(crate) async fn map_all<V>(
        self,
        views: impl AsyncFnOnce(Vec<T>) -> Result<Vec<V>, Problem>,
    ) -> Result<Paged<V>, Problem> {
        Ok(Paged {
            rows: views(self.rows).await?,
            next_link: self.next_link,
        })
    }
}

impl<T: Serialize> IntoResponse for Paged<T> {
    fn into_response(self) -> Response {
        let mut response = Json(&self.rows).into_response();
        // The link consists of parts of the request's URI, so it is always valid in a header.
        let next_link = self.next_link.map(HeaderValue::try_from);
        if let Some(Ok(next_link)) = next_link {
            response.headers_mut().insert(header::LINK, next_link);
        }
        response
    }
}

/// The query parameters of a list other than those of the page.
#[derive(Debug)]
pub(crate) struct ListQuery<T>(pub(crate) T);

impl<S, T> FromRequestParts<S> for ListQuery<T>
where
    S: Sync,
    T: DeserializeOwned,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let query = parts.uri.query().unwrap_or_default().split('&');
        let others: Vec<&str> = query
            .filter(|param| !param.starts_with("limit=") && !param.starts_with("after="))
            .collect();
        let uri = Uri::try_from(format!("/?{}", others.join("&"))).map_err(Problem::internal)?;
        Query::try_from_uri(&uri)
            .map(|Query(query)| Self(query))
            .map_err(|rejection| Problem::new(ProblemKind::InvalidRequest, rejection.body_text()))
    }
}
