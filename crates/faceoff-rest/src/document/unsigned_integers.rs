//! Formats of unsigned integers in the OpenAPI document: `uint32` and `uint64`. The derived schemas have the formats of signed
//! integers, which exclude the upper half of the valid values.

use serde_json::Value;

/// Corrects the format of all unsigned integers in the document.
pub(super) fn mark_unsigned(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(mark_unsigned),
        Value::Object(fields) => {
            let is_unsigned = fields.get("minimum").and_then(Value::as_f64) >= Some(0.0);
            if let Some(Value::String(format)) = fields.get_mut("format")
                && is_unsigned
                && ["int32", "int64"].contains(&format.as_str())
            {
                format.insert(0, 'u');
            }
            fields.values_mut().for_each(mark_unsigned);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn only_unsigned_integers_are_marked() {
        let mut document = json!({"properties": {
            "waiting": {"type": ["integer", "null"], "format": "int32", "minimum": 0},
            "round": {"oneOf": [{"type": "integer", "format": "int64", "minimum": 1, "maximum": 100}]},
            "before": {"type": "integer", "format": "int64"},
            "share": {"type": "number", "format": "double", "minimum": 0},
        }});
        mark_unsigned(&mut document);
        let format = |pointer| document.pointer(pointer).unwrap();
        assert_eq!(format("/properties/waiting/format"), "uint32");
        assert_eq!(format("/properties/round/oneOf/0/format"), "uint64");
        assert_eq!(format("/properties/before/format"), "int64");
        assert_eq!(format("/properties/share/format"), "double");
    }
}
