//! OpenAPI schemas of JSON merge patches, which change some fields of an object.

use std::{borrow::Cow, marker::PhantomData};
use utoipa::{
    PartialSchema, ToSchema,
    openapi::{
        ObjectBuilder, RefOr, Schema,
        schema::{OneOfBuilder, Type},
    },
};

/// Schema of a JSON merge patch (RFC 7396) of a `T`: every field is optional and may be null, which restores its
/// default.
pub(super) struct MergePatch<T>(PhantomData<T>);

impl<T: ToSchema> PartialSchema for MergePatch<T> {
    fn schema() -> RefOr<Schema> {
        let mut schema = T::schema();
        if let RefOr::T(Schema::Object(object)) = &mut schema {
            for field in object.properties.values_mut() {
                let null = ObjectBuilder::new().schema_type(Type::Null);
                *field = OneOfBuilder::new().item(field.clone()).item(null).into();
            }
            object.required.clear();
        }
        schema
    }
}

impl<T: ToSchema> ToSchema for MergePatch<T> {
    fn name() -> Cow<'static, str> {
        format!("{}Change", T::name()).into()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        T::schemas(schemas);
    }
}
