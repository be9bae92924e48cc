//! `/docs`: the project's documentation, the API's reference and a search in both. Nothing of it changes while the server
//! runs.

mod images;
mod library;
mod markdown;
mod reference;
mod search;
mod sections;

use super::frame::{Frame, PageProblem};
use askama::Template;
use axum::{
    Extension, Router,
    extract::State,
    http::{HeaderValue, header},
    response::{Html, IntoResponse, Response},
    routing::get,
};
use faceoff_service::{
    app::App,
    conditions::{Conditions, ETag},
    extract::{PathParam, QueryParams},
    problem::{Problem, ProblemKind},
};
use library::{Group, LIBRARY, Page};
use reference::{Part, Reference, Schema, Tokens};
use search::{Found, Index, SHOWN};
use serde::Deserialize;
use serde_json::Value;
use std::sync::{Arc, OnceLock};

/// A browser asks again each time, by tag: the frame around a page tells of what is amiss.
const KEPT: &str = "public, no-cache";
const LONGEST_QUESTION: usize = 200;
/// What somebody new reads, in this order.
const NEWCOMERS: [(&str, &str); 4] = [
    ("start", "An agent on the board within an hour"),
    ("rules", "What counts, and what costs points"),
    ("robot", "What you control and what you see"),
    (
        "protocol",
        "What your program and the evaluator say to each other",
    ),
];

/// All that can be read.
#[derive(Debug)]
struct Shelf {
    api: Arc<Value>,
    reference: OnceLock<Reference>,
    index: OnceLock<Index>,
}

impl Shelf {
    fn reference(&self) -> &Reference {
        self.reference.get_or_init(|| Reference::of(&self.api))
    }

    fn index(&self) -> &Index {
        self.index.get_or_init(|| {
            let pages = LIBRARY.iter().flat_map(|group| &group.pages);
            let documents = pages.flat_map(|page| page.sections.iter().cloned());
            Index::new(documents.chain(self.reference().sections()))
        })
    }
}

/// The documentation's pages. `api` is the API's OpenAPI document.
pub(super) fn router(api: Arc<Value>) -> Router<App> {
    let shelf = Arc::new(Shelf {
        api,
        reference: OnceLock::new(),
        index: OnceLock::new(),
    });
    Router::new()
        .route("/docs", get(contents))
        .route("/docs/search", get(find))
        .route("/docs/images/{*name}", get(images::image))
        .route(reference::PATH, get(api_reference))
        .route("/docs/api-reference/schemas", get(schemas))
        .route("/docs/api-reference/schemas/{name}", get(schema))
        .route("/docs/api-reference/{group}", get(operations))
        .route("/docs/{page}", get(document))
        .layer(Extension(shelf))
}

#[derive(Template)]
#[template(path = "docs/contents.html")]
struct ContentsPage {
    frame: Frame,
    question: String,
    newcomers: Vec<(&'static Page, &'static str)>,
    groups: &'static [Group],
}

async fn contents(State(app): State<App>, conditions: Conditions) -> Result<Response, PageProblem> {
    let newcomers = NEWCOMERS.iter();
    answer(
        &conditions,
        &ContentsPage {
            frame: frame(&app),
            question: String::new(),
            newcomers: newcomers
                .filter_map(|(name, why)| Some((library::page(name)?, *why)))
                .collect(),
            groups: &LIBRARY,
        },
    )
}

#[derive(Template)]
#[template(path = "docs/document.html")]
struct DocumentPage {
    frame: Frame,
    question: String,
    page: &'static Page,
}

async fn document(
    State(app): State<App>,
    PathParam(name): PathParam<String>,
    conditions: Conditions,
) -> Result<Response, PageProblem> {
    let Some(page) = library::page(&name) else {
        return Err(nothing(format!(
            "the documentation has no page {name}; all of them are listed at /docs"
        )));
    };
    answer(
        &conditions,
        &DocumentPage {
            frame: frame(&app),
            question: String::new(),
            page,
        },
    )
}

#[derive(Template)]
#[template(path = "docs/reference.html")]
struct ReferencePage<'a> {
    frame: Frame,
    question: String,
    reference: &'a Reference,
}

async fn api_reference(
    State(app): State<App>,
    Extension(shelf): Extension<Arc<Shelf>>,
    conditions: Conditions,
) -> Result<Response, PageProblem> {
    answer(
        &conditions,
        &ReferencePage {
            frame: frame(&app),
            question: String::new(),
            reference: shelf.reference(),
        },
    )
}

#[derive(Template)]
#[template(path = "docs/operations.html")]
struct OperationsPage<'a> {
    frame: Frame,
    question: String,
    group: &'a reference::Group,
}

async fn operations(
    State(app): State<App>,
    Extension(shelf): Extension<Arc<Shelf>>,
    PathParam(name): PathParam<String>,
    conditions: Conditions,
) -> Result<Response, PageProblem> {
    let mut groups = shelf.reference().groups.iter();
    let Some(group) = groups.find(|group| group.name == name) else {
        return Err(nothing(format!(
            "the API has no operations named {name}; all of them are listed at {}",
            reference::PATH
        )));
    };
    answer(
        &conditions,
        &OperationsPage {
            frame: frame(&app),
            question: String::new(),
            group,
        },
    )
}

#[derive(Template)]
#[template(path = "docs/schemas.html")]
struct SchemasPage<'a> {
    frame: Frame,
    question: String,
    schemas: &'a [Schema],
}

async fn schemas(
    State(app): State<App>,
    Extension(shelf): Extension<Arc<Shelf>>,
    conditions: Conditions,
) -> Result<Response, PageProblem> {
    answer(
        &conditions,
        &SchemasPage {
            frame: frame(&app),
            question: String::new(),
            schemas: &shelf.reference().schemas,
        },
    )
}

#[derive(Template)]
#[template(path = "docs/schema.html")]
struct SchemaPage<'a> {
    frame: Frame,
    question: String,
    schema: &'a Schema,
}

async fn schema(
    State(app): State<App>,
    Extension(shelf): Extension<Arc<Shelf>>,
    PathParam(name): PathParam<String>,
    conditions: Conditions,
) -> Result<Response, PageProblem> {
    let mut schemas = shelf.reference().schemas.iter();
    let Some(schema) = schemas.find(|schema| schema.name == name) else {
        return Err(nothing(format!(
            "the API has no schema {name}; all of them are listed at {}/schemas",
            reference::PATH
        )));
    };
    answer(
        &conditions,
        &SchemaPage {
            frame: frame(&app),
            question: String::new(),
            schema,
        },
    )
}

/// What is looked for.
#[derive(Debug, Deserialize)]
struct Question {
    #[serde(default)]
    q: String,
}

#[derive(Template)]
#[template(path = "docs/search.html")]
struct SearchPage {
    frame: Frame,
    question: String,
    found: Vec<Found>,
    count: usize,
}

async fn find(
    State(app): State<App>,
    Extension(shelf): Extension<Arc<Shelf>>,
    query: Result<QueryParams<Question>, Problem>,
    conditions: Conditions,
) -> Result<Response, PageProblem> {
    let QueryParams(Question { q: question }) = query?;
    let chars = question.chars().count();
    if chars > LONGEST_QUESTION {
        let detail =
            format!("q: expected at most {LONGEST_QUESTION} characters to look for, got {chars}");
        return Err(Problem::new(ProblemKind::InvalidRequest, detail).into());
    }
    let question = question.trim().to_owned();
    let (found, count) = shelf.index().search(&question);
    answer(
        &conditions,
        &SearchPage {
            frame: frame(&app),
            question,
            found,
            count,
        },
    )
}

fn frame(app: &App) -> Frame {
    Frame::of(app, String::new(), "/docs")
}

fn nothing(detail: String) -> PageProblem {
    Problem::new(ProblemKind::NotFound, detail).into()
}

/// A page with its tag, or that its reader has it.
fn answer(conditions: &Conditions, page: &impl Template) -> Result<Response, PageProblem> {
    let html = page.render().map_err(Problem::internal)?;
    let tag = ETag::of("docs", &[&html]);
    let kept = [
        (header::ETAG, tag.header()),
        (header::CACHE_CONTROL, HeaderValue::from_static(KEPT)),
    ];
    Ok(match conditions.not_modified(&tag) {
        Some(known) => (kept, known).into_response(),
        None => (kept, Html(html)).into_response(),
    })
}
