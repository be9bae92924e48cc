//! Old names of response fields in the OpenAPI document. Each is optional and deprecated, with the schema of the new name.

use faceoff_api::views::{
    attempt::GameAttemptView,
    baseline::BaselineRow,
    board::BoardRow,
    day::DayView,
    evaluation::EvaluationView,
    game::{GameView, PurposeView, TestGamesView},
    me::MeView,
    proposal::ProposalView,
    queue::QueueView,
    season::{SeasonDay, SeasonView},
    stage::StageView,
    storage::StorageView,
    submission::SubmissionView,
    tournament::{EntrantView, RoundView},
    webhook::DeliveryStateView,
    workers::{BusySlotView, WorkersView},
};
use faceoff_scoring::{OverallComparison, TaskComparison};
use faceoff_types::DeprecatedNames;
use serde_json::Value;
use utoipa::ToSchema;

/// Name of a schema, and the old and new name of each of its renamed fields.
type SchemaRenames = (String, &'static [(&'static str, &'static str)]);

/// The renamed fields of `T`, in its own schema.
fn renamed<T: DeprecatedNames + ToSchema>() -> SchemaRenames {
    (T::name().into_owned(), T::DEPRECATED_NAMES)
}

/// The renamed fields of `T`, in the schema `container`, into which they are flattened.
fn flattened<T: DeprecatedNames>(container: &str) -> SchemaRenames {
    (container.to_owned(), T::DEPRECATED_NAMES)
}

fn renamed_fields() -> Vec<SchemaRenames> {
    vec![
        renamed::<BaselineRow>(),
        renamed::<BoardRow>(),
        renamed::<BusySlotView>(),
        renamed::<DayView>(),
        renamed::<DeliveryStateView>(),
        flattened::<DeliveryStateView>("DeliveryView"),
        renamed::<EntrantView>(),
        renamed::<EvaluationView>(),
        renamed::<GameAttemptView>(),
        renamed::<GameView>(),
        flattened::<PurposeView>("GameView"),
        renamed::<MeView>(),
        renamed::<OverallComparison>(),
        renamed::<ProposalView>(),
        renamed::<PurposeView>(),
        renamed::<QueueView>(),
        renamed::<RoundView>(),
        renamed::<SeasonDay>(),
        renamed::<SeasonView>(),
        renamed::<StageView>(),
        renamed::<StorageView>(),
        renamed::<SubmissionView>(),
        renamed::<TaskComparison>(),
        renamed::<TestGamesView>(),
        renamed::<WorkersView>(),
    ]
}

/// Adds the old names to the schemas of all types with renamed fields.
pub(super) fn add(document: &mut Value) {
    let schemas = document["components"]["schemas"].as_object_mut();
    let schemas = schemas.expect("the document has schemas");
    for (name, fields) in renamed_fields() {
        // A type that is only flattened into others may have no schema of its own.
        if let Some(schema) = schemas.get_mut(&name) {
            add_names(schema, fields);
        }
    }
}

/// Adds the old names to an object's properties, or to those of each alternative.
fn add_names(schema: &mut Value, fields: &[(&str, &str)]) {
    if let Some(Value::Array(alternatives)) = schema.get_mut("oneOf") {
        for alternative in alternatives {
            add_names(alternative, fields);
        }
    }
    if let Some(Value::Object(properties)) = schema.get_mut("properties") {
        for (old, new) in fields {
            if let Some(property) = properties.get(*new) {
                let old_property = deprecated_property(property, new);
                properties.insert((*old).to_owned(), old_property);
            }
        }
    }
}

/// The schema of a renamed field under its old name.
fn deprecated_property(property: &Value, new_name: &str) -> Value {
    let mut schema = property.clone();
    schema["deprecated"] = true.into();
    schema["description"] = format!("Deprecated: the old name of `{new_name}`.").into();
    schema
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn old_name_is_deprecated_and_optional() {
        // The field `job` of the second alternative was once named `unit`.
        let mut schema = json!({"oneOf": [
            {"properties": {"state": {"type": "string"}}, "required": ["state"]},
            {"properties": {"job": {"$ref": "#/components/schemas/Job"}}, "required": ["job"]},
        ]});
        add_names(&mut schema, &[("unit", "job")]);
        let old = &schema["oneOf"][1]["properties"]["unit"];
        assert_eq!(old["deprecated"], true);
        assert_eq!(old["$ref"], "#/components/schemas/Job");
        assert_eq!(schema["oneOf"][1]["required"], json!(["job"]));
        assert_eq!(
            schema["oneOf"][0]["properties"].as_object().unwrap().len(),
            1
        );
    }
}
