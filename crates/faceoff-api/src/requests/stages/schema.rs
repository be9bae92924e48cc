//! The OpenAPI schema of a new stage: that of a change, with a name and without a confirmation.

use super::{NewStage, StagePatch};
use std::borrow::Cow;
use utoipa::{
    PartialSchema, ToSchema,
    openapi::{RefOr, Schema, Type},
};

impl PartialSchema for NewStage {
    fn schema() -> RefOr<Schema> {
        let mut schema = StagePatch::schema();
        if let RefOr::T(Schema::Object(object)) = &mut schema {
            object.description = Some(
                "A stage to create. Fields that are left out are copied from the open stage, or from the stage nearest in time,\n\
                 unless their description says otherwise."
                    .to_owned(),
            );
            object.properties.remove("confirm");
            object.required = vec!["name".to_owned()];
            object.properties.values_mut().for_each(remove_default);
            if let Some(RefOr::T(Schema::Object(name))) = object.properties.get_mut("name") {
                name.schema_type = Type::String.into();
            }
        }
        schema
    }
}

/// Removes the default of the field of a change, null. That of a new stage is in the field's description.
fn remove_default(field: &mut RefOr<Schema>) {
    match field {
        RefOr::T(Schema::Object(object)) => object.default = None,
        RefOr::T(Schema::Array(array)) => array.default = None,
        RefOr::T(Schema::OneOf(one_of)) => one_of.default = None,
        _ => {}
    }
}

impl ToSchema for NewStage {
    fn name() -> Cow<'static, str> {
        "NewStage".into()
    }

    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        StagePatch::schemas(schemas);
    }
}
