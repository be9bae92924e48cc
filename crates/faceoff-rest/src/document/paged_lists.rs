//! Paged lists in the OpenAPI document: routes with the query parameter `after` return a link to the next page.

use super::conditional_requests::inline_parameters;
use utoipa::openapi::{
    Header, Object, RefOr, Response, Type,
    path::{Operation, ParameterIn},
};

/// Adds the header `Link` and the response 422 to the operation, if it returns a paged list.
pub(super) fn complete(operation: &mut Operation) {
    let is_list = inline_parameters(operation)
        .any(|parameter| parameter.parameter_in == ParameterIn::Query && parameter.name == "after");
    if !is_list {
        return;
    }
    let responses = &mut operation.responses.responses;
    if let Some(RefOr::T(page)) = responses.get_mut("200") {
        let mut next = Header::new(Object::with_type(Type::String));
        let description = "`<PATH>; rel=\"next\"`: the next page; absent on the last one";
        next.description = Some(description.to_owned());
        page.headers.insert("Link".to_owned(), RefOr::T(next));
    }
    responses
        .entry("422".to_owned())
        .or_insert_with(|| Response::new("`limit` is out of range").into());
}
