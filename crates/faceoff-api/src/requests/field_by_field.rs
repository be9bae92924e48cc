use std::{borrow::Cow, marker::PhantomData};
use utoipa::{
    PartialSchema, ToSchema,
    openapi::{
        ObjectBuilder, RefOr, Schema,
        schema::{OneOfBuilder, Type},
    },
};

/// The schema of what is sent of a `T` that is changed field by field: each may be null, which brings back the default.
pub(super) struct FieldByField<T>(PhantomData<T>);

impl<T: ToSchema> PartialSchema for FieldByField<T> {
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

impl<T: ToSchema> ToSchema for FieldByField<T> {
    fn name() -> Cow<'static, str> {
        format!("{}Change", T::name()).into()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        T::schemas(schemas);
    }
}
