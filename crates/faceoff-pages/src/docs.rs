//! `/docs`: the documentation of the project, the API reference and a search in both. The content is fixed while the server
//! runs.

mod escape;
mod images;
mod library;
mod listing;
mod markdown;
mod outline;
mod reference;
mod search;
mod sections;
mod synonyms;
mod words;

use super::{
    assets,
    frame::{Frame, PageProblem},
};
use askama::Template;
use axum::{
    Extension, Router,
    extract::State,
    http::{HeaderValue, header},
    response::{Html, IntoResponse, Response},
    routing::get,
};
use faceoff_service::{
    api_document::ApiDocument,
    app::App,
    extract::{PathParam, QueryParams},
    problem::{Problem, ProblemKind},
    request_preconditions::{ETag, RequestPreconditions},
};
use library::{LIBRARY, Page};
use outline::{OutlineGroup, SideList, outline};
use reference::{Reference, Schema, TokenRequirement, TypePart};
use search::{Index, SearchResults};
use serde::Deserialize;
use std::sync::{Arc, OnceLock};
use tokio::sync::Mutex;

/// Browsers revalidate each page by its ETag, since the frame of a page shows problems of the server. The frame also names the signed-in
/// user, so shared caches must not store pages.
const CACHE_CONTROL: &str = "private, no-cache";
/// Longest search query, in characters.
const MAX_QUERY_CHARS: usize = 200;
/// Pages for newcomers in reading order, each with its topic.
const NEWCOMERS: [(&str, &str); 4] = [
    ("start", "An agent on the board within an hour"),
    ("rules", "What counts and what costs points"),
    ("robot", "What the agent controls and observes"),
    ("protocol", "Messages between agent and evaluator"),
];

/// Id and title of headings of the API reference; its other headings are pages.
const REFERENCE_HEADINGS: [(&str, &str); 2] =
    [("tokens", "Tokens"), ("responses", "Shared responses")];

/// Content of the documentation, built on first use.
#[derive(Debug)]
struct Documentation {
    api: ApiDocument,
    reference: OnceLock<Reference>,
    outline: OnceLock<Vec<OutlineGroup>>,
    index: OnceLock<Index>,
    /// Held during a search.
    search_lock: Arc<Mutex<()>>,
}

impl Documentation {
    fn reference(&self) -> &Reference {
        self.reference
            .get_or_init(|| Reference::new(self.api.value()))
    }

    fn outline(&self) -> &[OutlineGroup] {
        self.outline.get_or_init(|| outline(self.reference()))
    }

    /// Head of the page with this path. `headings`: id and title of each of its headings.
    fn head<'a>(&'a self, path: String, headings: Vec<(&'a str, String)>) -> DocsHead<'a> {
        DocsHead {
            side: Some(SideList::new(self.outline(), path, headings)),
            ..DocsHead::new()
        }
    }

    fn index(&self) -> &Index {
        self.index.get_or_init(|| {
            let pages = LIBRARY.iter().flat_map(|group| &group.pages);
            let documents = pages.flat_map(|page| page.sections.iter().cloned());
            Index::new(documents.chain(self.reference().sections()))
        })
    }
}

/// The pages of the documentation. `api` is the OpenAPI document of the API.
pub(super) fn router(api: ApiDocument) -> Router<App> {
    let documentation = Arc::new(Documentation {
        api,
        reference: OnceLock::new(),
        outline: OnceLock::new(),
        index: OnceLock::new(),
        search_lock: Arc::default(),
    });
    Router::new()
        .route("/docs", get(contents))
        .route("/docs/search", get(search_page))
        .route("/docs/images/{*name}", get(images::image))
        .route(reference::PATH, get(api_reference))
        .route("/docs/api-reference/schemas", get(schemas))
        .route("/docs/api-reference/schemas/{name}", get(schema))
        .route("/docs/api-reference/{group}", get(operations))
        .route("/docs/{page}", get(document))
        .layer(Extension(documentation))
}

/// What every page of the documentation has beside its content: style, script, search field and list of pages.
struct DocsHead<'a> {
    style: &'static str,
    script: &'static str,
    /// Text in the search field; empty except on the page of the results.
    search_query: String,
    /// The list of all pages beside the page; `None` on the contents page, which is such a list itself.
    side: Option<SideList<'a>>,
}

impl DocsHead<'_> {
    fn new() -> Self {
        Self {
            style: assets::DOCS_STYLE.url(),
            script: assets::DOCS_SCRIPT.url(),
            search_query: String::new(),
            side: None,
        }
    }
}

#[derive(Template)]
#[template(path = "docs/contents.html")]
struct ContentsPage<'a> {
    frame: Frame,
    docs: DocsHead<'a>,
    newcomers: Vec<(&'static Page, &'static str)>,
    groups: &'a [OutlineGroup],
}

async fn contents(
    State(app): State<App>,
    Extension(documentation): Extension<Arc<Documentation>>,
    conditions: RequestPreconditions,
) -> Result<Response, PageProblem> {
    let newcomers = NEWCOMERS.iter();
    respond(
        &conditions,
        &ContentsPage {
            frame: frame(&app),
            docs: DocsHead::new(),
            newcomers: newcomers
                .filter_map(|(name, topic)| Some((library::page(name)?, *topic)))
                .collect(),
            groups: documentation.outline(),
        },
    )
}

#[derive(Template)]
#[template(path = "docs/document.html")]
struct DocumentPage<'a> {
    frame: Frame,
    docs: DocsHead<'a>,
    page: &'static Page,
    previous: Option<&'static Page>,
    next: Option<&'static Page>,
}

async fn document(
    State(app): State<App>,
    Extension(documentation): Extension<Arc<Documentation>>,
    PathParam(name): PathParam<String>,
    conditions: RequestPreconditions,
) -> Result<Response, PageProblem> {
    let Some(page) = library::page(&name) else {
        return Err(not_found(format!(
            "the documentation has no page {name}; all of them are listed at /docs"
        )));
    };
    let headings = page.contents.iter();
    let headings = headings.map(|entry| (&*entry.id, entry.title.clone()));
    let (previous, next) = library::neighbours(page);
    respond(
        &conditions,
        &DocumentPage {
            frame: frame(&app),
            docs: documentation.head(page.path(), headings.collect()),
            page,
            previous,
            next,
        },
    )
}

#[derive(Template)]
#[template(path = "docs/reference.html")]
struct ReferencePage<'a> {
    frame: Frame,
    docs: DocsHead<'a>,
    reference: &'a Reference,
}

async fn api_reference(
    State(app): State<App>,
    Extension(documentation): Extension<Arc<Documentation>>,
    conditions: RequestPreconditions,
) -> Result<Response, PageProblem> {
    let headings = REFERENCE_HEADINGS.map(|(id, title)| (id, title.to_owned()));
    respond(
        &conditions,
        &ReferencePage {
            frame: frame(&app),
            docs: documentation.head(reference::PATH.into(), headings.into()),
            reference: documentation.reference(),
        },
    )
}

#[derive(Template)]
#[template(path = "docs/operations.html")]
struct OperationsPage<'a> {
    frame: Frame,
    docs: DocsHead<'a>,
    group: &'a reference::Group,
}

async fn operations(
    State(app): State<App>,
    Extension(documentation): Extension<Arc<Documentation>>,
    PathParam(name): PathParam<String>,
    conditions: RequestPreconditions,
) -> Result<Response, PageProblem> {
    let mut groups = documentation.reference().groups.iter();
    let Some(group) = groups.find(|group| group.name == name) else {
        return Err(not_found(format!(
            "the API has no operations named {name}; all of them are listed at {}",
            reference::PATH
        )));
    };
    let headings = group.operations.iter();
    // Without the base, which all paths have.
    let headings = headings.map(|operation| {
        let title = operation.title.replacen(" /api/v1/", " /", 1);
        (&*operation.id, title)
    });
    respond(
        &conditions,
        &OperationsPage {
            frame: frame(&app),
            docs: documentation.head(group.path(), headings.collect()),
            group,
        },
    )
}

#[derive(Template)]
#[template(path = "docs/schemas.html")]
struct SchemasPage<'a> {
    frame: Frame,
    docs: DocsHead<'a>,
    schemas: &'a [Schema],
}

async fn schemas(
    State(app): State<App>,
    Extension(documentation): Extension<Arc<Documentation>>,
    conditions: RequestPreconditions,
) -> Result<Response, PageProblem> {
    respond(
        &conditions,
        &SchemasPage {
            frame: frame(&app),
            docs: documentation.head(reference::SCHEMAS_PATH.into(), Vec::new()),
            schemas: &documentation.reference().schemas,
        },
    )
}

#[derive(Template)]
#[template(path = "docs/schema.html")]
struct SchemaPage<'a> {
    frame: Frame,
    docs: DocsHead<'a>,
    schema: &'a Schema,
}

async fn schema(
    State(app): State<App>,
    Extension(documentation): Extension<Arc<Documentation>>,
    PathParam(name): PathParam<String>,
    conditions: RequestPreconditions,
) -> Result<Response, PageProblem> {
    let mut schemas = documentation.reference().schemas.iter();
    let Some(schema) = schemas.find(|schema| schema.name == name) else {
        return Err(not_found(format!(
            "the API has no schema {name}; all of them are listed at {}/schemas",
            reference::PATH
        )));
    };
    respond(
        &conditions,
        &SchemaPage {
            frame: frame(&app),
            docs: documentation.head(schema.path(), Vec::new()),
            schema,
        },
    )
}

#[derive(Debug, Deserialize)]
struct SearchQuery {
    #[serde(default)]
    q: String,
}

#[derive(Template)]
#[template(path = "docs/search.html")]
struct SearchPage<'a> {
    frame: Frame,
    docs: DocsHead<'a>,
    found: SearchResults,
}

async fn search_page(
    State(app): State<App>,
    Extension(documentation): Extension<Arc<Documentation>>,
    query: Result<QueryParams<SearchQuery>, Problem>,
    conditions: RequestPreconditions,
) -> Result<Response, PageProblem> {
    let QueryParams(SearchQuery { q: search_query }) = query?;
    let chars = search_query.chars().count();
    if chars > MAX_QUERY_CHARS {
        let detail = format!("q: expected at most {MAX_QUERY_CHARS} characters, got {chars}");
        return Err(Problem::new(ProblemKind::InvalidRequest, detail).into());
    }
    let search_query = search_query.trim().to_owned();
    // The first search builds the index, which takes CPU time. Searches run one at a time on a blocking thread, so that they do
    // not delay other requests.
    let guard = Arc::clone(&documentation.search_lock).lock_owned().await;
    let search_documentation = Arc::clone(&documentation);
    let query = search_query.clone();
    let search = tokio::task::spawn_blocking(move || {
        // Held until the search has ended, even if the visitor does not wait for it.
        let _guard = guard;
        search_documentation.index().search(&query)
    });
    let found = search.await.map_err(Problem::internal)?;
    respond(
        &conditions,
        &SearchPage {
            frame: frame(&app),
            docs: DocsHead {
                search_query,
                ..documentation.head("/docs/search".into(), Vec::new())
            },
            found,
        },
    )
}

fn frame(app: &App) -> Frame {
    Frame::for_app(app, String::new(), "/docs")
}

fn not_found(detail: String) -> PageProblem {
    Problem::new(ProblemKind::NotFound, detail).into()
}

/// The page with an ETag, or 304 if the client has this version.
fn respond(
    conditions: &RequestPreconditions,
    page: &impl Template,
) -> Result<Response, PageProblem> {
    let html = page.render().map_err(Problem::internal)?;
    let tag = ETag::new("docs", &[&html]);
    let headers = [
        (header::ETAG, tag.header()),
        (
            header::CACHE_CONTROL,
            HeaderValue::from_static(CACHE_CONTROL),
        ),
        (
            header::VARY,
            HeaderValue::from_static("authorization, cookie"),
        ),
    ];
    Ok(match conditions.not_modified(&tag) {
        Some(not_modified) => (headers, not_modified).into_response(),
        None => (headers, Html(html)).into_response(),
    })
}
