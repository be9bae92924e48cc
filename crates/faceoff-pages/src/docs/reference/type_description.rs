//! Types of the API as text, from their OpenAPI schemas, with links to named schemas.

use super::super::markdown::{self, Prose};
use serde_json::Value;

/// A part of the description of a type.
#[derive(Debug, PartialEq, Eq)]
pub(in crate::docs) enum TypePart {
    Text(String),
    Code(String),
    /// A link to a named schema.
    Schema(String),
}

/// A field of an object.
#[derive(Debug)]
pub(in crate::docs) struct Field {
    pub(in crate::docs) name: String,
    pub(in crate::docs) type_parts: Vec<TypePart>,
    pub(in crate::docs) is_required: bool,
    pub(in crate::docs) description: Prose,
}

/// Describes a type: `integer (uint32)`, `list of Seed`.
pub(super) fn describe_type(schema: &Value) -> Vec<TypePart> {
    let mut parts = Vec::new();
    write(schema, &mut parts);
    parts
}

/// The fields of an object.
pub(super) fn fields(schema: &Value) -> Vec<Field> {
    let required = schema["required"].as_array();
    let is_required = |name: &str| {
        required.is_some_and(|names| names.iter().any(|required_name| required_name == name))
    };
    let fields = schema["properties"].as_object().into_iter().flatten();
    fields
        .map(|(name, field)| Field {
            name: name.clone(),
            type_parts: describe_type(field),
            is_required: is_required(name),
            description: description(field),
        })
        .collect()
}

/// The description of a schema; for a nullable schema, the description of the other variant.
pub(super) fn description(schema: &Value) -> Prose {
    let own = schema["description"].as_str();
    let variant_description = || {
        let variants = schema["oneOf"].as_array().into_iter().flatten();
        variants
            .filter_map(|variant| variant["description"].as_str())
            .next()
    };
    markdown::render_prose(own.or_else(variant_description).unwrap_or_default())
}

fn write(schema: &Value, parts: &mut Vec<TypePart>) {
    if let Some(name) = schema["$ref"].as_str() {
        let name = name.rsplit('/').next().unwrap_or_default();
        parts.push(TypePart::Schema(name.to_owned()));
    } else if let Some(variants) = schema["oneOf"].as_array() {
        write_alternatives(variants, parts);
    } else if let Some(values) = schema["enum"].as_array() {
        for (index, value) in values.iter().enumerate() {
            if index > 0 {
                parts.push(text(" or "));
            }
            parts.push(TypePart::Code(value.to_string()));
        }
    } else {
        write_type(schema, parts);
    }
    match &schema["default"] {
        Value::Null => {}
        default @ (Value::Object(_) | Value::Array(_))
            if default.to_string().len() > MAX_DEFAULT_LENGTH => {}
        default => {
            parts.push(text("; default: "));
            parts.push(TypePart::Code(default.to_string()));
        }
    }
}

/// Longer defaults are omitted; the schema of the value lists them.
const MAX_DEFAULT_LENGTH: usize = 60;

fn write_type(schema: &Value, parts: &mut Vec<TypePart>) {
    let names: Vec<&str> = match &schema["type"] {
        Value::String(name) => vec![name],
        Value::Array(names) => names.iter().filter_map(Value::as_str).collect(),
        _ => vec!["any value"],
    };
    for (index, name) in names.iter().enumerate() {
        if index > 0 {
            parts.push(text(" or "));
        }
        match *name {
            "array" => {
                parts.push(text(&format!(
                    "list{} of ",
                    bounds(schema, "minItems", "maxItems")
                )));
                write(&schema["items"], parts);
            }
            "object" => write_object(schema, parts),
            "string" | "integer" | "number" => {
                let format = schema["format"].as_str();
                let format = format
                    .map(|format| format!(" ({format})"))
                    .unwrap_or_default();
                let range = match *name {
                    "string" => bounds(schema, "minLength", "maxLength"),
                    _ => bounds(schema, "minimum", "maximum"),
                };
                parts.push(text(&format!("{name}{format}{range}")));
            }
            other => parts.push(text(other)),
        }
    }
}

fn write_object(schema: &Value, parts: &mut Vec<TypePart>) {
    if let Some(fields) = schema["properties"].as_object() {
        parts.push(text("object with "));
        for (index, (name, field)) in fields.iter().enumerate() {
            if index > 0 {
                parts.push(text(", "));
            }
            parts.push(TypePart::Code(name.clone()));
            parts.push(text(" ("));
            write(field, parts);
            parts.push(text(")"));
        }
    } else if schema["additionalProperties"].is_object() {
        parts.push(text("object whose values are "));
        write(&schema["additionalProperties"], parts);
    } else {
        parts.push(text("object"));
    }
}

/// Bounds of a value or length; empty without bounds.
fn bounds(schema: &Value, min: &str, max: &str) -> String {
    // A minimum of 0 only repeats that the type is unsigned.
    let min = schema[min].as_f64().filter(|min| *min > 0.0);
    match (min, schema[max].as_f64()) {
        (Some(min), Some(max)) if min == max => format!(" of {min}"),
        (Some(min), Some(max)) => format!(", {min} to {max}"),
        (Some(min), None) => format!(", {min} or more"),
        (None, Some(max)) => format!(", up to {max}"),
        (None, None) => String::new(),
    }
}

fn write_alternatives(schemas: &[Value], parts: &mut Vec<TypePart>) {
    for (index, schema) in schemas.iter().enumerate() {
        if index > 0 {
            parts.push(text(" or "));
        }
        write(schema, parts);
    }
}

fn text(text: &str) -> TypePart {
    TypePart::Text(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn type_text(schema: Value) -> String {
        let parts = describe_type(&schema);
        let parts = parts.iter().map(|part| match part {
            TypePart::Text(text) => text.clone(),
            TypePart::Code(code) => format!("`{code}`"),
            TypePart::Schema(name) => format!("[{name}]"),
        });
        parts.collect()
    }

    #[test]
    fn types_are_described_as_text() {
        let seed = json!({ "$ref": "#/components/schemas/Seed" });
        for (schema, expected) in [
            (json!({ "type": "string" }), "string"),
            (
                json!({ "type": ["integer", "null"], "format": "uint32", "minimum": 0 }),
                "integer (uint32) or null",
            ),
            (
                json!({ "type": "integer", "minimum": 1, "maximum": 1000 }),
                "integer, 1 to 1000",
            ),
            (
                json!({ "oneOf": [seed, { "type": "null" }] }),
                "[Seed] or null",
            ),
            (
                json!({ "type": "array", "items": seed, "minItems": 2, "maxItems": 2 }),
                "list of 2 of [Seed]",
            ),
            (
                json!({ "enum": ["best", "latest"], "type": "string" }),
                "`\"best\"` or `\"latest\"`",
            ),
            (
                json!({ "type": "object", "additionalProperties": seed }),
                "object whose values are [Seed]",
            ),
            (
                json!({ "type": "object", "properties": { "x": { "type": "number" }, "of": seed } }),
                "object with `of` ([Seed]), `x` (number)",
            ),
            (
                json!({ "type": "boolean", "default": false }),
                "boolean; default: `false`",
            ),
            (json!({}), "any value"),
        ] {
            assert_eq!(type_text(schema.clone()), expected, "{schema}");
        }
    }

    #[test]
    fn nullable_schema_has_the_description_of_its_variant() {
        let schema = json!({ "oneOf": [{ "type": "null" }, { "description": "A `seed`.", "type": "string" }] });
        assert_eq!(description(&schema).html, "<p>A <code>seed</code>.</p>\n");
    }
}
