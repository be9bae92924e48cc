//! Responses in the OpenAPI document that many routes share. They are derived from the routes' parameters, bodies and
//! security; a route itself describes only its specific responses.

use super::{
    conditional_requests::{self, inline_parameters},
    paged_lists,
};
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

/// A response that many routes share.
struct CommonResponse {
    status: StatusCode,
    /// Name of the component in the document.
    name: &'static str,
    description: &'static str,
    /// Whether an operation can return this response, even if its own description does not mention it.
    applies_to: fn(&OperationTraits<'_>) -> bool,
    headers: &'static [ResponseHeader],
}

/// A header of a response.
struct ResponseHeader {
    name: &'static str,
    kind: Type,
    description: &'static str,
}

const RETRY_AFTER: ResponseHeader = ResponseHeader {
    name: "Retry-After",
    kind: Type::Integer,
    description: "seconds to wait before the next attempt",
};

const COMMON_RESPONSES: &[CommonResponse] = &[
    CommonResponse {
        status: StatusCode::BAD_REQUEST,
        name: "Malformed",
        description: "the query, a header or the JSON is malformed; the detail says where",
        applies_to: |traits| traits.has_query() || traits.has_json(),
        headers: &[],
    },
    CommonResponse {
        status: StatusCode::UNAUTHORIZED,
        name: "Unauthenticated",
        description: "the request has no token, or an invalid one",
        applies_to: |traits| traits.accepts_tokens(),
        headers: &[ResponseHeader {
            name: "WWW-Authenticate",
            kind: Type::String,
            description: "how to send a token",
        }],
    },
    CommonResponse {
        status: StatusCode::FORBIDDEN,
        name: "Forbidden",
        description: "not allowed with this token or for this team, or on a server that shows an archive",
        applies_to: |traits| traits.is_restricted() || traits.changes_state(),
        headers: &[],
    },
    CommonResponse {
        status: StatusCode::NOT_FOUND,
        name: "NotFound",
        description: "the resource does not exist, or belongs to another team",
        applies_to: |traits| traits.has_path_parameters(),
        headers: &[],
    },
    CommonResponse {
        status: StatusCode::PAYLOAD_TOO_LARGE,
        name: "TooLarge",
        description: "the body is larger than `limit_bytes`",
        applies_to: |traits| traits.has_json(),
        headers: &[],
    },
    CommonResponse {
        status: StatusCode::UNSUPPORTED_MEDIA_TYPE,
        name: "NoJson",
        description: "the body is not sent as JSON",
        applies_to: |traits| traits.has_json(),
        headers: &[],
    },
    CommonResponse {
        status: StatusCode::UNPROCESSABLE_ENTITY,
        name: "NotAcceptable",
        description: "a field has an invalid value; the detail names it",
        applies_to: |traits| traits.has_json(),
        headers: &[],
    },
    CommonResponse {
        status: StatusCode::TOO_MANY_REQUESTS,
        name: "TooMany",
        description: "the address has too many connections, or the address or the token exceeds its rate limit",
        applies_to: |_| true,
        headers: &[RETRY_AFTER],
    },
    CommonResponse {
        status: StatusCode::INTERNAL_SERVER_ERROR,
        name: "OurFault",
        description: "an error of the server; the request is fine",
        applies_to: |_| true,
        headers: &[ResponseHeader {
            name: "X-Request-Id",
            kind: Type::String,
            description: "id of the request, for a report to the organisers; every response has one",
        }],
    },
    CommonResponse {
        status: StatusCode::SERVICE_UNAVAILABLE,
        name: "Busy",
        description: "the server is handling as many requests as it may, or took too long",
        applies_to: |_| true,
        headers: &[RETRY_AFTER],
    },
    CommonResponse {
        status: StatusCode::INSUFFICIENT_STORAGE,
        name: "NoRoom",
        description: "the server's disk has too little free space",
        applies_to: |traits| traits.changes_state(),
        headers: &[RETRY_AFTER],
    },
];

/// The properties of an operation that determine its responses.
struct OperationTraits<'o> {
    method: HttpMethod,
    operation: &'o Operation,
}

impl OperationTraits<'_> {
    fn changes_state(&self) -> bool {
        self.method != HttpMethod::Get
    }

    fn has_parameter_in(&self, location: &ParameterIn) -> bool {
        inline_parameters(self.operation).any(|parameter| parameter.parameter_in == *location)
    }

    fn has_query(&self) -> bool {
        self.has_parameter_in(&ParameterIn::Query)
    }

    fn has_path_parameters(&self) -> bool {
        self.has_parameter_in(&ParameterIn::Path)
    }

    fn has_json(&self) -> bool {
        let body = self.operation.request_body.as_ref();
        body.is_some_and(|body| match body {
            RefOr::T(RequestBody { content, .. }) => content.contains_key("application/json"),
            RefOr::Ref(_) => false,
        })
    }

    fn accepts_tokens(&self) -> bool {
        let security = self.operation.security.as_ref();
        security.is_some_and(|alternatives| !alternatives.is_empty())
    }

    /// Whether only one kind of token is accepted.
    fn is_restricted(&self) -> bool {
        let security = self.operation.security.as_ref();
        security.is_some_and(|alternatives| alternatives.len() == 1)
    }
}

/// Adds the common responses to all operations.
pub(super) fn complete(document: &mut openapi::OpenApi) {
    let components = document.components.get_or_insert_default();
    for common in COMMON_RESPONSES {
        let mut response = Response::new(common.description);
        finish(&mut response, common.status.as_str());
        components
            .responses
            .insert(common.name.to_owned(), response.into());
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
    conditional_requests::complete(operation);
    paged_lists::complete(operation);
    let traits = OperationTraits {
        method,
        operation: &*operation,
    };
    let applicable: Vec<StatusCode> = COMMON_RESPONSES
        .iter()
        .filter(|common| (common.applies_to)(&traits))
        .map(|common| common.status)
        .collect();
    let responses = &mut operation.responses.responses;
    for common in COMMON_RESPONSES {
        let status = common.status.as_str();
        let is_common = match responses.get(status) {
            // A status without a description has its common meaning.
            Some(RefOr::T(specific)) => specific.description.is_empty(),
            Some(RefOr::Ref(_)) => false,
            None => applicable.contains(&common.status),
        };
        if is_common {
            let reference = Ref::from_response_name(common.name);
            responses.insert(status.to_owned(), RefOr::Ref(reference));
        }
    }
    for (status, response) in responses {
        if let RefOr::T(response) = response {
            finish(response, status);
        }
    }
}

fn common_response(status: &str) -> Option<&'static CommonResponse> {
    COMMON_RESPONSES
        .iter()
        .find(|common| common.status.as_str() == status)
}

/// Adds a default description; errors get the problem schema and the headers of their status.
fn finish(response: &mut Response, status: &str) {
    if response.description.is_empty() {
        response.description = match status {
            "201" => "created",
            "204" => "done, without content",
            _ => "success",
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
    for common_header in common_response(status).map_or(&[][..], |common| common.headers) {
        let mut header = Header::new(Object::with_type(common_header.kind.clone()));
        header.description = Some(common_header.description.to_owned());
        response
            .headers
            .insert(common_header.name.to_owned(), RefOr::T(header));
    }
}
