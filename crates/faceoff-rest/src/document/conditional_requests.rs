//! Conditional and range requests in the OpenAPI document: routes with the header `If-None-Match` can return 304, routes with
//! `Range` also 206 and 416.

use utoipa::{
    IntoParams,
    openapi::{
        Header, Object, RefOr, Required, Response, Type,
        path::{Operation, Parameter, ParameterBuilder, ParameterIn},
    },
};

const IF_NONE_MATCH: &str = "If-None-Match";
const RANGE: &str = "Range";

/// Request header `If-None-Match` of a route whose response has an `ETag`.
pub(crate) struct IfNoneMatchHeader;

impl IntoParams for IfNoneMatchHeader {
    fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let description = "tags (`ETag`) that the client already has; if the response has one of them, it is 304 without a body";
        vec![header(IF_NONE_MATCH, description)]
    }
}

/// Request headers of a route that sends a file.
pub(crate) struct FileHeaders;

impl IntoParams for FileHeaders {
    fn into_params(parameter_in: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let mut params = IfNoneMatchHeader::into_params(parameter_in);
        let description = "`bytes=FIRST-LAST`, `bytes=FIRST-` or `bytes=-LENGTH`; the response is 206 with this range. Several \
                           ranges and malformed ones return the whole file";
        params.push(header(RANGE, description));
        let description = "tag of the file that the range continues; if the file has another tag, the whole file is returned";
        params.push(header("If-Range", description));
        params
    }
}

fn header(name: &str, description: &str) -> Parameter {
    ParameterBuilder::new()
        .name(name)
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(description))
        .schema(Some(Object::with_type(Type::String)))
        .build()
}

/// Adds the responses that the operation can return because of its request headers.
pub(super) fn complete(operation: &mut Operation) {
    if !has_header_parameter(operation, IF_NONE_MATCH) {
        return;
    }
    let responses = &mut operation.responses.responses;
    let mut not_modified =
        Response::new("not modified; the client already has the current response");
    add_header(&mut not_modified, "ETag", "tag of the response");
    let Some(RefOr::T(whole)) = responses.get_mut("200") else {
        return;
    };
    add_header(whole, "ETag", "tag of the response");
    let whole = whole.clone();
    responses.insert("304".to_owned(), not_modified.into());
    if !has_header_parameter(operation, RANGE) {
        return;
    }
    let mut whole = whole;
    add_header(&mut whole, "Accept-Ranges", "`bytes`");
    add_header(
        &mut whole,
        "Content-Disposition",
        "file name for the download",
    );
    add_header(
        &mut whole,
        "X-Content-BLAKE3",
        "BLAKE3 hash of the whole file, 64 hexadecimal digits; absent if it is unknown",
    );
    let mut part = whole.clone();
    part.description = "the requested range".to_owned();
    add_header(&mut part, "Content-Range", "`bytes FIRST-LAST/LENGTH`");
    let mut unsatisfiable =
        Response::new("the range begins behind the end; `bytes` states the length of the file");
    add_header(&mut unsatisfiable, "Content-Range", "`bytes */LENGTH`");
    let responses = &mut operation.responses.responses;
    responses.insert("200".to_owned(), whole.into());
    responses.insert("206".to_owned(), part.into());
    responses.insert("416".to_owned(), unsatisfiable.into());
}

/// The parameters of an operation that are not references.
pub(super) fn inline_parameters(operation: &Operation) -> impl Iterator<Item = &Parameter> {
    let parameters = operation.parameters.iter().flatten();
    parameters.filter_map(|parameter| match parameter {
        RefOr::T(parameter) => Some(parameter),
        RefOr::Ref(_) => None,
    })
}

fn has_header_parameter(operation: &Operation, name: &str) -> bool {
    inline_parameters(operation)
        .any(|parameter| parameter.parameter_in == ParameterIn::Header && parameter.name == name)
}

fn add_header(response: &mut Response, name: &str, description: &str) {
    let mut header = Header::new(Object::with_type(Type::String));
    header.description = Some(description.to_owned());
    response.headers.insert(name.to_owned(), RefOr::T(header));
}
