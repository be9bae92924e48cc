//! Integers without a sign are told by their own names of the registry of formats: derived, they have those of signed
//! ones, whose upper half would be said to be wrong and is taken.

use serde_json::Value;

/// Renames them wherever they stand.
pub(super) fn tell_unsigned(told: &mut Value) {
    match told {
        Value::Array(items) => items.iter_mut().for_each(tell_unsigned),
        Value::Object(fields) => {
            let is_unsigned = fields.get("minimum").and_then(Value::as_f64) >= Some(0.0);
            if let Some(Value::String(format)) = fields.get_mut("format")
                && is_unsigned
                && ["int32", "int64"].contains(&format.as_str())
            {
                format.insert(0, 'u');
            }
            fields.values_mut().for_each(tell_unsigned);
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn only_integers_without_a_sign_are_renamed() {
        let mut told = json!({"properties": {
            "waiting": {"type": ["integer", "null"], "format": "int32", "minimum": 0},
            "round": {"oneOf": [{"type": "integer", "format": "int64", "minimum": 1, "maximum": 100}]},
            "before": {"type": "integer", "format": "int64"},
            "share": {"type": "number", "format": "double", "minimum": 0},
        }});
        tell_unsigned(&mut told);
        let format = |pointer| told.pointer(pointer).unwrap();
        assert_eq!(format("/properties/waiting/format"), "uint32");
        assert_eq!(format("/properties/round/oneOf/0/format"), "uint64");
        assert_eq!(format("/properties/before/format"), "int64");
        assert_eq!(format("/properties/share/format"), "double");
    }
}
