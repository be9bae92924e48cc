//! Schemas of the OpenAPI document in words, with links to the ones that have names.

use super::super::markdown::{self, Prose};
use serde_json::Value;

/// A piece of what a value is.
#[derive(Debug, PartialEq, Eq)]
pub(in crate::docs) enum Part {
    Words(String),
    Code(String),
    /// The schema of this name.
    Schema(String),
}

/// A field of an object.
#[derive(Debug)]
pub(in crate::docs) struct Field {
    pub(in crate::docs) name: String,
    pub(in crate::docs) shape: Vec<Part>,
    pub(in crate::docs) is_required: bool,
    pub(in crate::docs) about: Prose,
}

/// What a value is: `integer (uint32)`, `list of Seed`.
pub(super) fn shape(schema: &Value) -> Vec<Part> {
    let mut parts = Vec::new();
    write(schema, &mut parts);
    parts
}

/// The fields of an object.
pub(super) fn fields(schema: &Value) -> Vec<Field> {
    let required = schema["required"].as_array();
    let is_required =
        |name: &str| required.is_some_and(|names| names.iter().any(|one| one == name));
    let fields = schema["properties"].as_object().into_iter().flatten();
    fields
        .map(|(name, field)| Field {
            name: name.clone(),
            shape: shape(field),
            is_required: is_required(name),
            about: about(field),
        })
        .collect()
}

/// What a schema says of itself; where null may be in its place, what the other says.
pub(super) fn about(schema: &Value) -> Prose {
    let own = schema["description"].as_str();
    let of_variant = || {
        let variants = schema["oneOf"].as_array().into_iter().flatten();
        variants
            .filter_map(|variant| variant["description"].as_str())
            .next()
    };
    markdown::prose(own.or_else(of_variant).unwrap_or_default())
}

fn write(schema: &Value, parts: &mut Vec<Part>) {
    if let Some(name) = schema["$ref"].as_str() {
        let name = name.rsplit('/').next().unwrap_or_default();
        parts.push(Part::Schema(name.to_owned()));
    } else if let Some(variants) = schema["oneOf"].as_array() {
        joined(variants, " or ", parts);
    } else if let Some(values) = schema["enum"].as_array() {
        for (at, value) in values.iter().enumerate() {
            if at > 0 {
                parts.push(words(" or "));
            }
            parts.push(Part::Code(value.to_string()));
        }
    } else {
        by_type(schema, parts);
    }
    match &schema["default"] {
        Value::Null => {}
        default @ (Value::Object(_) | Value::Array(_))
            if default.to_string().len() > LONGEST_DEFAULT => {}
        default => {
            parts.push(words("; left out: "));
            parts.push(Part::Code(default.to_string()));
        }
    }
}

/// Longer ones are told by the schema of the value.
const LONGEST_DEFAULT: usize = 60;

fn by_type(schema: &Value, parts: &mut Vec<Part>) {
    let names: Vec<&str> = match &schema["type"] {
        Value::String(name) => vec![name],
        Value::Array(names) => names.iter().filter_map(Value::as_str).collect(),
        _ => vec!["any value"],
    };
    for (at, name) in names.iter().enumerate() {
        if at > 0 {
            parts.push(words(" or "));
        }
        match *name {
            "array" => {
                parts.push(words(&format!(
                    "list{} of ",
                    sizes(schema, "minItems", "maxItems")
                )));
                write(&schema["items"], parts);
            }
            "object" => object(schema, parts),
            "string" | "integer" | "number" => {
                let format = schema["format"].as_str();
                let format = format
                    .map(|format| format!(" ({format})"))
                    .unwrap_or_default();
                let range = match *name {
                    "string" => sizes(schema, "minLength", "maxLength"),
                    _ => sizes(schema, "minimum", "maximum"),
                };
                parts.push(words(&format!("{name}{format}{range}")));
            }
            other => parts.push(words(other)),
        }
    }
}

fn object(schema: &Value, parts: &mut Vec<Part>) {
    if let Some(fields) = schema["properties"].as_object() {
        parts.push(words("object with "));
        for (at, (name, field)) in fields.iter().enumerate() {
            if at > 0 {
                parts.push(words(", "));
            }
            parts.push(Part::Code(name.clone()));
            parts.push(words(" ("));
            write(field, parts);
            parts.push(words(")"));
        }
    } else if schema["additionalProperties"].is_object() {
        parts.push(words("object whose values are "));
        write(&schema["additionalProperties"], parts);
    } else {
        parts.push(words("object"));
    }
}

/// The bounds, where they say something.
fn sizes(schema: &Value, least: &str, most: &str) -> String {
    // Not less than 0 are all that have no sign.
    let least = schema[least].as_f64().filter(|least| *least > 0.0);
    match (least, schema[most].as_f64()) {
        (Some(least), Some(most)) if least == most => format!(" of {least}"),
        (Some(least), Some(most)) => format!(", {least} to {most}"),
        (Some(least), None) => format!(", {least} or more"),
        (None, Some(most)) => format!(", up to {most}"),
        (None, None) => String::new(),
    }
}

fn joined(schemas: &[Value], between: &str, parts: &mut Vec<Part>) {
    for (at, schema) in schemas.iter().enumerate() {
        if at > 0 {
            parts.push(words(between));
        }
        write(schema, parts);
    }
}

fn words(text: &str) -> Part {
    Part::Words(text.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn told(schema: Value) -> String {
        let parts = shape(&schema);
        let parts = parts.iter().map(|part| match part {
            Part::Words(words) => words.clone(),
            Part::Code(code) => format!("`{code}`"),
            Part::Schema(name) => format!("[{name}]"),
        });
        parts.collect()
    }

    #[test]
    fn types_are_told_in_words() {
        let seed = json!({ "$ref": "#/components/schemas/Seed" });
        for (schema, words) in [
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
                "boolean; left out: `false`",
            ),
            (json!({}), "any value"),
        ] {
            assert_eq!(told(schema.clone()), words, "{schema}");
        }
    }

    #[test]
    fn what_may_be_null_is_described_by_what_it_is_otherwise() {
        let schema = json!({ "oneOf": [{ "type": "null" }, { "description": "A `seed`.", "type": "string" }] });
        assert_eq!(about(&schema).html, "<p>A <code>seed</code>.</p>\n");
    }
}
