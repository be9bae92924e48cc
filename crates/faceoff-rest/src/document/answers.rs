//! What any route can answer, by what it takes. What is particular about an answer a route says itself.

use super::{files, lists};
use axum::http::StatusCode;
use faceoff_service::problem::{Problem, ProblemBody};
use utoipa::{
    ToSchema,
    openapi::{
        self, Content, HttpMethod, Object, Ref, RefOr, Response, Type,
        header::Header,
        path::{Operation, ParameterIn},
        request_body::RequestBody,
    },
};

/// An answer that many routes share.
struct Shared {
    status: StatusCode,
    /// Its name among the document's components.
    name: &'static str,
    description: &'static str,
    /// Can this operation give it, whatever it says itself?
    is_of: fn(&Asked<'_>) -> bool,
    headers: &'static [Told],
}

/// A header of an answer.
struct Told {
    name: &'static str,
    of: Type,
    description: &'static str,
}

const RETRY_AFTER: Told = Told {
    name: "Retry-After",
    of: Type::Integer,
    description: "seconds after which to try again",
};

const SHARED: &[Shared] = &[
    Shared {
        status: StatusCode::BAD_REQUEST,
        name: "Malformed",
        description: "the query, a header or the JSON is malformed; the detail names the place",
        is_of: |asked| asked.has_query() || asked.has_json(),
        headers: &[],
    },
    Shared {
        status: StatusCode::UNAUTHORIZED,
        name: "Unauthenticated",
        description: "no token came, or one that is worth nothing",
        is_of: |asked| asked.looks_at_tokens(),
        headers: &[Told {
            name: "WWW-Authenticate",
            of: Type::String,
            description: "how to send a token",
        }],
    },
    Shared {
        status: StatusCode::FORBIDDEN,
        name: "Forbidden",
        description: "not with this token, not for this team, or not on a server that shows an archive",
        is_of: |asked| asked.is_for_some() || asked.changes_something(),
        headers: &[],
    },
    Shared {
        status: StatusCode::NOT_FOUND,
        name: "NotFound",
        description: "there is no such thing, or it is another team's",
        is_of: |asked| asked.names_something(),
        headers: &[],
    },
    Shared {
        status: StatusCode::PAYLOAD_TOO_LARGE,
        name: "TooLarge",
        description: "the body is too large; `limit_bytes` says how large it may be",
        is_of: |asked| asked.has_json(),
        headers: &[],
    },
    Shared {
        status: StatusCode::UNSUPPORTED_MEDIA_TYPE,
        name: "NoJson",
        description: "the body is not sent as JSON",
        is_of: |asked| asked.has_json(),
        headers: &[],
    },
    Shared {
        status: StatusCode::UNPROCESSABLE_ENTITY,
        name: "NotAcceptable",
        description: "a field has a value that cannot be used; the detail names it",
        is_of: |asked| asked.has_json(),
        headers: &[],
    },
    Shared {
        status: StatusCode::TOO_MANY_REQUESTS,
        name: "TooMany",
        description: "the address has too many connections at a time, or it or the token makes too many requests",
        is_of: |_| true,
        headers: &[RETRY_AFTER],
    },
    Shared {
        status: StatusCode::INTERNAL_SERVER_ERROR,
        name: "OurFault",
        description: "the server failed; nothing is wrong with what was sent",
        is_of: |_| true,
        headers: &[Told {
            name: "X-Request-Id",
            of: Type::String,
            description: "what to tell the organiser; every answer has one",
        }],
    },
    Shared {
        status: StatusCode::SERVICE_UNAVAILABLE,
        name: "Busy",
        description: "the server answers as many requests as it may, or took too long",
        is_of: |_| true,
        headers: &[RETRY_AFTER],
    },
    Shared {
        status: StatusCode::INSUFFICIENT_STORAGE,
        name: "NoRoom",
        description: "the server's disk has too little room",
        is_of: |asked| asked.changes_something(),
        headers: &[RETRY_AFTER],
    },
];

/// An operation as far as its answers depend on it.
struct Asked<'o> {
    method: HttpMethod,
    operation: &'o Operation,
}

impl Asked<'_> {
    fn changes_something(&self) -> bool {
        self.method != HttpMethod::Get
    }

    fn has(&self, place: &ParameterIn) -> bool {
        let parameters = self.operation.parameters.iter().flatten();
        let mut plain = parameters.filter_map(|parameter| match parameter {
            RefOr::T(parameter) => Some(parameter),
            RefOr::Ref(_) => None,
        });
        plain.any(|parameter| parameter.parameter_in == *place)
    }

    fn has_query(&self) -> bool {
        self.has(&ParameterIn::Query)
    }

    fn names_something(&self) -> bool {
        self.has(&ParameterIn::Path)
    }

    fn has_json(&self) -> bool {
        let body = self.operation.request_body.as_ref();
        body.is_some_and(|body| match body {
            RefOr::T(RequestBody { content, .. }) => content.contains_key("application/json"),
            RefOr::Ref(_) => false,
        })
    }

    fn looks_at_tokens(&self) -> bool {
        let security = self.operation.security.as_ref();
        security.is_some_and(|alternatives| !alternatives.is_empty())
    }

    /// Is it for one kind of token alone?
    fn is_for_some(&self) -> bool {
        let security = self.operation.security.as_ref();
        security.is_some_and(|alternatives| alternatives.len() == 1)
    }
}

/// Adds what the routes have not said.
pub(super) fn complete(document: &mut openapi::OpenApi) {
    let components = document.components.get_or_insert_default();
    for shared in SHARED {
        let mut response = Response::new(shared.description);
        finish(&mut response, shared.status.as_str());
        components
            .responses
            .insert(shared.name.to_owned(), response.into());
    }
    for item in document.paths.paths.values_mut() {
        let operations = [
            (HttpMethod::Get, &mut item.get),
            (HttpMethod::Post, &mut item.post),
            (HttpMethod::Put, &mut item.put),
            (HttpMethod::Patch, &mut item.patch),
            (HttpMethod::Delete, &mut item.delete),
        ];
        for (method, operation) in operations {
            if let Some(operation) = operation {
                complete_operation(method, operation);
            }
        }
    }
}

fn complete_operation(method: HttpMethod, operation: &mut Operation) {
    files::complete(operation);
    lists::complete(operation);
    let asked = Asked {
        method,
        operation: &*operation,
    };
    let given: Vec<StatusCode> = SHARED
        .iter()
        .filter(|shared| (shared.is_of)(&asked))
        .map(|shared| shared.status)
        .collect();
    let responses = &mut operation.responses.responses;
    for shared in SHARED {
        let status = shared.status.as_str();
        let is_common = match responses.get(status) {
            // A status alone says no more than what all routes mean by it.
            Some(RefOr::T(own)) => own.description.is_empty(),
            Some(RefOr::Ref(_)) => false,
            None => given.contains(&shared.status),
        };
        if is_common {
            let common = Ref::from_response_name(shared.name);
            responses.insert(status.to_owned(), RefOr::Ref(common));
        }
    }
    for (status, response) in responses {
        if let RefOr::T(response) = response {
            finish(response, status);
        }
    }
}

fn shared_of(status: &str) -> Option<&'static Shared> {
    SHARED
        .iter()
        .find(|shared| shared.status.as_str() == status)
}

/// Every error is a problem, with the headers of its status; every answer has a description.
fn finish(response: &mut Response, status: &str) {
    if response.description.is_empty() {
        response.description = match status {
            "201" => "made",
            "204" => "done",
            _ => "as asked",
        }
        .to_owned();
    }
    if !status.starts_with(['4', '5']) {
        return;
    }
    let problem = Content::new(Some(Ref::from_schema_name(ProblemBody::name())));
    response
        .content
        .insert(Problem::MEDIA_TYPE.to_owned(), RefOr::T(problem));
    for told in shared_of(status).map_or(&[][..], |shared| shared.headers) {
        let mut header = Header::new(Object::with_type(told.of.clone()));
        header.description = Some(told.description.to_owned());
        response
            .headers
            .insert(told.name.to_owned(), RefOr::T(header));
    }
}
