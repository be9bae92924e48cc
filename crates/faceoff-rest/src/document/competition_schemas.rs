//! Schemas that list the tasks of the competition, how their episodes end, the kinds of violations, and the profiles.

use faceoff_types::{
    Competition, EpisodeEnd, Magnitude, MagnitudeInfo, Magnitudes, Profile, Task, TaskWeights,
    ViolationCounts, ViolationName,
};
use serde_json::{Map, Value, json};
use utoipa::{PartialSchema, ToSchema};

/// Replaces the schemas of tasks, of their weights, of ends, of violations and of profiles by those of the competition.
pub(super) fn describe(document: &mut Value, competition: &Competition) {
    let names: Vec<&str> = competition
        .tasks
        .iter()
        .map(|info| info.task.as_str())
        .collect();
    let aims = competition
        .tasks
        .iter()
        .map(|info| format!("\n- `{}`: {}", info.task, info.aim));
    reference_task_keys(document);
    let schemas = &mut document["components"]["schemas"];
    schemas[&*Task::name()] = json!({
        "type": "string",
        "description": format!("A task of the competition.\n{}", aims.collect::<String>()),
        "enum": names,
    });
    let ends = competition
        .ends
        .iter()
        .map(|info| format!("\n- `{}`: {}", info.end, info.title));
    schemas[&*EpisodeEnd::name()] = json!({
        "type": "string",
        "description": format!("Why an episode ended.\n{}", ends.collect::<String>()),
        "enum": competition.ends.iter().map(|info| info.end.as_str()).collect::<Vec<_>>(),
    });
    let limits = competition.world_violations();
    let descriptions = competition
        .violations
        .iter()
        .filter(|info| info.name != ViolationName::COMPUTATION_TIME)
        .map(|info| format!("\n- `{}`: {}", info.name, info.description));
    schemas[&*ViolationName::name()] = json!({
        "type": "string",
        "description": format!("A kind of violation.\n{}", descriptions.collect::<String>()),
        "enum": limits.map(|name| name.to_string()).collect::<Vec<_>>(),
    });
    let profiles = competition
        .profiles
        .iter()
        .map(|info| format!("\n- `{}`: {}", info.profile, info.description));
    schemas[&*Profile::name()] = json!({
        "type": "string",
        "description": format!("A named set of perturbations.\n{}", profiles.collect::<String>()),
        "enum": competition.profile_names().map(|profile| profile.to_string()).collect::<Vec<_>>(),
    });
    let violations = competition.violations.iter();
    let counts = violations.map(|info| {
        let schema =
            json!({"type": "integer", "format": "int32", "minimum": 0, "description": info.description});
        (info.name.to_string(), schema)
    });
    let counts: Map<String, Value> = counts.collect();
    schemas[&*ViolationCounts::name()] = json!({
        "type": "object",
        "description": "For each kind of violation, the number of episodes with it.",
        "required": counts.keys().collect::<Vec<_>>(),
        "properties": &counts,
    });
    let list_of = |of: &str| json!({"type": "array", "items": {"$ref": format!("#/components/schemas/{of}")}});
    let lists = competition.violations.iter().map(|info| {
        let of = if info.name == ViolationName::COMPUTATION_TIME {
            "SlowEpisode"
        } else {
            "ConstraintViolation"
        };
        let mut schema = list_of(of);
        schema["description"] = info.measure.clone().into();
        (info.name.to_string(), schema)
    });
    schemas["TaskViolations"] = json!({
        "type": "object",
        "description": "The violations of one task: for each kind, the episodes with it.",
        "required": counts.keys().collect::<Vec<_>>(),
        "properties": lists.collect::<Map<String, Value>>(),
    });
    schemas[&*Magnitudes::name()] = magnitudes(competition);
    add_defaults(schemas, competition);
    let weight = |info: &faceoff_types::TaskInfo| {
        let schema = json!({
            "type": "number",
            "description": "From 0 to 1, with at most six decimals. All weights sum to 1.",
            "example": info.weight.as_f64(),
            "minimum": 0,
            "maximum": 1,
        });
        (info.task.to_string(), schema)
    };
    schemas[&*TaskWeights::name()] = json!({
        "type": "object",
        "properties": competition.tasks.iter().map(weight).collect::<Map<String, Value>>(),
        "required": names,
        "additionalProperties": false,
    });
}

/// Adds the competition's defaults to the schemas of a tournament's rules, and of changes of them.
fn add_defaults(schemas: &mut Value, competition: &Competition) {
    let rules = json!(competition.tournament_rules());
    for name in ["TournamentRules", "TournamentRulesChange"] {
        let properties = schemas[name]["properties"].as_object_mut();
        for (field, schema) in properties.into_iter().flatten() {
            if let (Some(default), Some(schema)) = (rules.get(field), schema.as_object_mut()) {
                schema.insert("default".to_owned(), default.clone());
            }
        }
    }
}

/// The schema of magnitudes of perturbations: an object for each group.
fn magnitudes(competition: &Competition) -> Value {
    let mut groups = Map::new();
    for info in &competition.magnitudes {
        let group = groups.entry(info.group.clone()).or_insert_with(
            || json!({"type": "object", "properties": {}, "additionalProperties": false}),
        );
        group["properties"][&info.name] = magnitude(info);
    }
    json!({
        "type": "object",
        "description": "Magnitudes of all perturbations; the defaults are the competition's. The profile decides which \
                        perturbations are active.",
        "properties": groups,
        "additionalProperties": false,
    })
}

fn magnitude(info: &MagnitudeInfo) -> Value {
    let [least, most] = info.bounds;
    let number = match info.default {
        Magnitude::Count(_) | Magnitude::Counts(_) => json!({
            "type": "integer", "format": "int32", "minimum": least as i64, "maximum": most as i64,
        }),
        Magnitude::Number(_) | Magnitude::Range(_) => json!({
            "type": "number", "format": "double", "minimum": least, "maximum": most,
        }),
    };
    let mut schema = match info.default {
        Magnitude::Count(_) | Magnitude::Number(_) => number,
        Magnitude::Counts(_) | Magnitude::Range(_) => {
            json!({"type": "array", "items": number, "minItems": 2, "maxItems": 2})
        }
    };
    schema["description"] = info.description.clone().into();
    schema["default"] = json!(info.default);
    schema
}

/// Lets the keys of maps by task refer to the schema of tasks.
fn reference_task_keys(value: &mut Value) {
    match value {
        Value::Object(object) => {
            // The keys of these maps have the schema of tasks before it is replaced.
            let any_task_schema = serde_json::to_value(Task::schema()).ok();
            if object.get("propertyNames") == any_task_schema.as_ref() && any_task_schema.is_some()
            {
                let task_reference =
                    json!({"$ref": format!("#/components/schemas/{}", Task::name())});
                object.insert("propertyNames".to_owned(), task_reference);
            }
            object.values_mut().for_each(reference_task_keys);
        }
        Value::Array(items) => items.iter_mut().for_each(reference_task_keys),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schemas_describe_the_competition() {
        let by_task = json!({"type": "object", "propertyNames": Task::schema()});
        let by_name = json!({"type": "object", "propertyNames": {"type": "string"}});
        let mut document = json!({"components": {"schemas": {"Task": {"type": "string"}, "ByTask": by_task, "ByName": by_name,
            "TournamentRules": {"properties": {"steps": {"type": "integer"}}}}}});
        describe(&mut document, &faceoff_airhockey::competition());
        let schemas = &document["components"]["schemas"];
        assert_eq!(schemas["Task"]["enum"], json!(["hit", "defend", "prepare"]));
        let keys = &schemas["ByTask"]["propertyNames"];
        assert_eq!(*keys, json!({"$ref": "#/components/schemas/Task"}));
        assert_eq!(
            schemas["ByName"]["propertyNames"],
            json!({"type": "string"})
        );
        let weights = &schemas["TaskWeights"];
        assert_eq!(weights["required"], schemas["Task"]["enum"]);
        assert_eq!(weights["properties"]["prepare"]["example"], 0.2);
        assert_eq!(schemas["Profile"]["enum"][6], "evaluation");
        let steps = &schemas["TournamentRules"]["properties"]["steps"];
        assert_eq!(steps["default"], 45_000);
        let loss = &schemas["PerturbationSettings"]["properties"]["tracking_loss"]["properties"];
        assert_eq!(loss["probability"]["maximum"], 1.0);
        assert_eq!(loss["steps"]["default"], json!([5, 20]));
        assert_eq!(loss["steps"]["items"]["type"], "integer");
    }
}
