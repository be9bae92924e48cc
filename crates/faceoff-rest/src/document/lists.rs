//! Answers of lists that come page by page: what takes `after` tells where the next page is.

use utoipa::openapi::{
    Header, Object, RefOr, Response, Type,
    path::{Operation, ParameterIn},
};

/// Adds what follows from taking such a parameter.
pub(super) fn complete(operation: &mut Operation) {
    let parameters = operation.parameters.iter().flatten();
    let mut plain = parameters.filter_map(|parameter| match parameter {
        RefOr::T(parameter) => Some(parameter),
        RefOr::Ref(_) => None,
    });
    let is_list = plain
        .any(|parameter| parameter.parameter_in == ParameterIn::Query && parameter.name == "after");
    if !is_list {
        return;
    }
    let responses = &mut operation.responses.responses;
    if let Some(RefOr::T(page)) = responses.get_mut("200") {
        let mut next = Header::new(Object::with_type(Type::String));
        let told = "`<PATH>; rel=\"next\"`: the next page; absent of the last one";
        next.description = Some(told.to_owned());
        page.headers.insert("Link".to_owned(), RefOr::T(next));
    }
    responses
        .entry("422".to_owned())
        .or_insert_with(|| Response::new("`limit` is none").into());
}
