//! Answers that depend on what the client has: what takes the header `If-None-Match` may answer that nothing has changed,
//! what takes `Range` a part.

use utoipa::{
    IntoParams,
    openapi::{
        Header, Object, RefOr, Required, Response, Type,
        path::{Operation, Parameter, ParameterBuilder, ParameterIn},
    },
};

const IF_NONE_MATCH: &str = "If-None-Match";
const RANGE: &str = "Range";

/// What a route takes whose answer has a tag.
pub(crate) struct TagHeader;

impl IntoParams for TagHeader {
    fn into_params(_: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let told = "tags (`ETag`) of what the client has: if the answer has one of them, it is 304, without a body";
        vec![header(IF_NONE_MATCH, told)]
    }
}

/// What a route takes that sends a file.
pub(crate) struct FileHeaders;

impl IntoParams for FileHeaders {
    fn into_params(place: impl Fn() -> Option<ParameterIn>) -> Vec<Parameter> {
        let mut params = TagHeader::into_params(place);
        let told = "`bytes=FIRST-LAST`, `bytes=FIRST-` or `bytes=-LAST_SO_MANY`; the answer is 206 with these. Of several ranges, \
                    and of what is none, it is the whole file";
        params.push(header(RANGE, told));
        let told = "the tag of the file that a range is to go on with; of another one the answer is the whole file";
        params.push(header("If-Range", told));
        params
    }
}

fn header(name: &str, told: &str) -> Parameter {
    ParameterBuilder::new()
        .name(name)
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(told))
        .schema(Some(Object::with_type(Type::String)))
        .build()
}

/// Adds the answers that follow from such headers, and what those that are there tell in theirs.
pub(super) fn complete(operation: &mut Operation) {
    if !takes(operation, IF_NONE_MATCH) {
        return;
    }
    let responses = &mut operation.responses.responses;
    let mut not_modified = Response::new("it is as the client has it");
    tell(&mut not_modified, "ETag", "the tag of the answer");
    let Some(RefOr::T(whole)) = responses.get_mut("200") else {
        return;
    };
    tell(whole, "ETag", "the tag of the answer");
    let whole = whole.clone();
    responses.insert("304".to_owned(), not_modified.into());
    if !takes(operation, RANGE) {
        return;
    }
    let mut whole = whole;
    tell(&mut whole, "Accept-Ranges", "`bytes`");
    tell(&mut whole, "Content-Disposition", "a name to store it as");
    tell(
        &mut whole,
        "X-Content-BLAKE3",
        "BLAKE3 of the whole file, 64 hexadecimal digits; absent where it is not known",
    );
    let mut part = whole.clone();
    part.description = "the bytes that were asked for".to_owned();
    tell(
        &mut part,
        "Content-Range",
        "`bytes FIRST-LAST/LENGTH_OF_ALL`",
    );
    let mut behind = Response::new("the range begins behind the end; `bytes` says where that is");
    tell(&mut behind, "Content-Range", "`bytes */LENGTH_OF_ALL`");
    let responses = &mut operation.responses.responses;
    responses.insert("200".to_owned(), whole.into());
    responses.insert("206".to_owned(), part.into());
    responses.insert("416".to_owned(), behind.into());
}

fn takes(operation: &Operation, name: &str) -> bool {
    let parameters = operation.parameters.iter().flatten();
    let mut plain = parameters.filter_map(|parameter| match parameter {
        RefOr::T(parameter) => Some(parameter),
        RefOr::Ref(_) => None,
    });
    plain.any(|parameter| parameter.parameter_in == ParameterIn::Header && parameter.name == name)
}

fn tell(response: &mut Response, name: &str, told: &str) {
    let mut header = Header::new(Object::with_type(Type::String));
    header.description = Some(told.to_owned());
    response.headers.insert(name.to_owned(), RefOr::T(header));
}
