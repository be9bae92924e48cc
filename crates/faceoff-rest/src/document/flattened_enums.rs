//! Schemas of types with flattened parts, rewritten in the OpenAPI document for client generators.
//!
//! The derived schema of a struct with a flattened enum is allOf(oneOf(variants), fields). This is correct, but generators
//! cannot make a class of it. The equivalent oneOf(variant with fields, …) works.

use std::{collections::BTreeMap, mem};
use utoipa::openapi::{
    Object, RefOr, Schema, Type,
    schema::{OneOf, SchemaType},
};

type Schemas = BTreeMap<String, RefOr<Schema>>;

/// Rewrites all composed schemas.
pub(super) fn flatten(schemas: &mut Schemas) {
    let composed: Vec<(String, RefOr<Schema>)> = schemas
        .iter()
        .filter(|(_, schema)| is_composed(schema))
        .filter_map(|(name, schema)| Some((name.clone(), flattened(schema, schemas)?)))
        .collect();
    schemas.extend(composed);
}

/// Whether the schema is an allOf, or a oneOf that contains one.
fn is_composed(schema: &RefOr<Schema>) -> bool {
    match schema {
        RefOr::T(Schema::AllOf(_)) => true,
        RefOr::T(Schema::OneOf(one)) => one.items.iter().any(is_composed),
        _ => false,
    }
}

fn flattened(schema: &RefOr<Schema>, schemas: &Schemas) -> Option<RefOr<Schema>> {
    let mut variants = variants(schema, schemas)?;
    let description = match schema {
        RefOr::T(Schema::AllOf(all)) => all.description.clone(),
        RefOr::T(Schema::OneOf(one)) => one.description.clone(),
        _ => None,
    };
    if variants.len() == 1 {
        let mut only_variant = variants.remove(0);
        only_variant.description = description.or(only_variant.description);
        return Some(only_variant.into());
    }
    let mut one = OneOf::new();
    one.description = description;
    one.items = variants
        .into_iter()
        .map(|object| RefOr::T(Schema::Object(object)))
        .collect();
    Some(RefOr::T(Schema::OneOf(one)))
}

/// The alternative objects of a schema; `None` if it also allows other types.
fn variants(schema: &RefOr<Schema>, schemas: &Schemas) -> Option<Vec<Object>> {
    match schema {
        RefOr::Ref(reference) => {
            let (_, name) = reference.ref_location.rsplit_once('/')?;
            variants(schemas.get(name)?, schemas)
        }
        RefOr::T(Schema::Object(object)) => {
            let is_object = object.schema_type == SchemaType::Type(Type::Object);
            is_object.then(|| vec![object.clone()])
        }
        RefOr::T(Schema::OneOf(one)) => {
            let parts = one.items.iter().map(|item| variants(item, schemas));
            Some(parts.collect::<Option<Vec<_>>>()?.concat())
        }
        RefOr::T(Schema::AllOf(all)) => {
            // Each alternative of one part is combined with each alternative of all others.
            let mut combined = vec![Object::new()];
            for part in &all.items {
                let alternatives = variants(part, schemas)?;
                combined = combined
                    .iter()
                    .flat_map(|left| alternatives.iter().map(move |right| merge(left, right)))
                    .collect();
            }
            Some(combined)
        }
        RefOr::T(_) => None,
    }
}

/// An object with the fields of both schemas.
fn merge(left: &Object, right: &Object) -> Object {
    let mut both = left.clone();
    both.required.extend(right.required.iter().cloned());
    both.properties.extend(right.properties.clone());
    let left_description = mem::take(&mut both.description);
    both.description = left_description.or_else(|| right.description.clone());
    both
}
