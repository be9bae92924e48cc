//! Lists that grow with the season, page by page. A page is named by the row that it comes behind, so that what is added
//! meanwhile shifts nothing: who walks a list meets every row once that was there when they began.

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

const PAGE: u32 = 100;
const LONGEST_PAGE: u32 = 200;

/// Which page of a list.
#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
pub(crate) struct PageQuery {
    /// Rows at most; without it 100.
    #[param(minimum = 1, maximum = 200)]
    limit: Option<u32>,
    /// Those behind a row: as the header `Link` of the page before says.
    after: Option<String>,
}

/// A page that is asked for, of rows that these ids name.
#[derive(Debug)]
pub(crate) struct Page<I> {
    pub(crate) limit: u32,
    pub(crate) after: Option<I>,
    /// The list, with what else is asked of it.
    list: String,
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
        let limit = limit.unwrap_or(PAGE);
        if !(1..=LONGEST_PAGE).contains(&limit) {
            let detail = format!("expected 1 to {LONGEST_PAGE}, got {limit}");
            return Err(Problem::invalid("limit", detail));
        }
        let uri = match OriginalUri::from_request_parts(parts, state).await {
            Ok(OriginalUri(uri)) => uri,
            Err(never) => match never {},
        };
        let after = after.map(|text| text.parse::<I>());
        let after = after.transpose().map_err(|error| {
            let detail = format!("after: {error}; follow the header Link of the page before");
            Problem::new(ProblemKind::InvalidRequest, detail)
        })?;
        let others = uri.query().unwrap_or_default().split('&');
        let others = others.filter(|one| !one.is_empty() && !one.starts_with("after="));
        let list = others.fold(format!("{}?", uri.path()), |list, one| {
            format!("{list}{one}&")
        });
        Ok(Self { limit, after, list })
    }
}

impl<I: Display + PartialEq> Page<I> {
    /// Of a list that is read whole, since it stays short.
    ///
    /// # Errors
    /// `InvalidRequest` if the row that the page comes behind is not in it.
    pub(crate) fn cut<T>(
        &self,
        rows: impl IntoIterator<Item = T>,
        id: impl Fn(&T) -> I,
    ) -> Result<Paged<T>, Problem> {
        let mut rows = rows.into_iter();
        if let Some(after) = &self.after
            && !rows.any(|row| id(&row) == *after)
        {
            return Err(self.unknown());
        }
        let rows: Vec<T> = rows.take(self.limit as usize + 1).collect();
        Ok(self.of_more(rows, id))
    }

    /// Of its rows, and one more if there are more.
    pub(crate) fn of_more<T>(&self, mut rows: Vec<T>, id: impl Fn(&T) -> I) -> Paged<T> {
        let has_more = rows.len() > self.limit as usize;
        rows.truncate(self.limit as usize);
        let last = rows.last().filter(|_| has_more);
        let next = last.map(|row| format!("<{}after={}>; rel=\"next\"", self.list, id(row)));
        Paged { rows, next }
    }

    /// Of a list that depends on the time: the pages to come are of the same.
    pub(crate) fn always_of(mut self, name: &str, value: impl Display) -> Self {
        self.list.push_str(&format!("{name}={value}&"));
        self
    }

    /// The row that it comes behind is none of the list.
    pub(crate) fn unknown(&self) -> Problem {
        Problem::new(
            ProblemKind::InvalidRequest,
            "after: there is no such row in the list, or none any more; begin again without it",
        )
    }
}

/// A page, and where the next one is.
#[derive(Debug)]
pub(crate) struct Paged<T> {
    rows: Vec<T>,
    next: Option<String>,
}

impl<T> Paged<T> {
    /// As it is shown.
    pub(crate) fn map<V>(self, view: impl FnMut(T) -> V) -> Paged<V> {
        Paged {
            rows: self.rows.into_iter().map(view).collect(),
            next: self.next,
        }
    }

    /// As they are shown together.
    pub(crate) async fn seen<V>(
        self,
        views: impl AsyncFnOnce(Vec<T>) -> Result<Vec<V>, Problem>,
    ) -> Result<Paged<V>, Problem> {
        Ok(Paged {
            rows: views(self.rows).await?,
            next: self.next,
        })
    }
}

impl<T: Serialize> IntoResponse for Paged<T> {
    fn into_response(self) -> Response {
        let mut answer = Json(&self.rows).into_response();
        // What cannot stand in a header came with the request, and did not get here.
        if let Some(next) = self.next.and_then(|next| HeaderValue::try_from(next).ok()) {
            answer.headers_mut().insert(header::LINK, next);
        }
        answer
    }
}

/// What a list's query says beside the page.
#[derive(Debug)]
pub(crate) struct BesidePage<T>(pub(crate) T);

impl<S, T> FromRequestParts<S> for BesidePage<T>
where
    S: Sync,
    T: DeserializeOwned,
{
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Problem> {
        let query = parts.uri.query().unwrap_or_default().split('&');
        let others: Vec<&str> = query
            .filter(|one| !one.starts_with("limit=") && !one.starts_with("after="))
            .collect();
        let uri = Uri::try_from(format!("/?{}", others.join("&"))).map_err(Problem::internal)?;
        Query::try_from_uri(&uri)
            .map(|Query(query)| Self(query))
            .map_err(|rejection| Problem::new(ProblemKind::InvalidRequest, rejection.body_text()))
    }
}
