//! The API's reference, from the OpenAPI document that the server answers with.

mod shape;

use super::{
    markdown::{self, Prose},
    sections::Section,
};
use serde_json::{Map, Value};
pub(super) use shape::{Field, Part};
use shape::{about, fields, shape};

pub(super) const PATH: &str = "/docs/api-reference";
const SCHEMAS_PATH: &str = "/docs/api-reference/schemas";

#[derive(Debug)]
pub(super) struct Reference {
    pub(super) about: Prose,
    pub(super) groups: Vec<Group>,
    pub(super) schemas: Vec<Schema>,
    /// The answers of many operations, by name.
    pub(super) answers: Vec<Answer>,
    /// How to show that one may ask, by name.
    pub(super) tokens: Vec<(String, Prose)>,
}

/// The operations for somebody.
#[derive(Debug)]
pub(super) struct Group {
    pub(super) name: String,
    pub(super) about: Prose,
    pub(super) operations: Vec<Operation>,
}

#[derive(Debug)]
pub(super) struct Operation {
    pub(super) id: String,
    pub(super) method: String,
    pub(super) path: String,
    pub(super) summary: Prose,
    pub(super) about: Prose,
    pub(super) tokens: Tokens,
    pub(super) parameters: Vec<Parameter>,
    pub(super) body: Option<Body>,
    pub(super) answers: Vec<Answer>,
    /// Those that other operations have, too: by status the name in [`Reference::answers`].
    pub(super) shared: Vec<(String, String)>,
}

#[derive(Debug)]
pub(super) enum Tokens {
    None,
    Optional(String),
    Required(String),
}

#[derive(Debug)]
pub(super) struct Parameter {
    pub(super) place: String,
    pub(super) field: Field,
}

#[derive(Debug)]
pub(super) struct Body {
    pub(super) is_required: bool,
    pub(super) about: Prose,
    pub(super) media: Vec<Media>,
}

#[derive(Debug)]
pub(super) struct Answer {
    /// Its status; of one that many operations have, its name.
    pub(super) name: String,
    pub(super) about: Prose,
    pub(super) media: Vec<Media>,
    pub(super) headers: Vec<String>,
}

/// Bytes of a media type, and what they are.
#[derive(Debug)]
pub(super) struct Media {
    pub(super) name: String,
    pub(super) shape: Vec<Part>,
}

/// A type that has a name.
#[derive(Debug)]
pub(super) struct Schema {
    pub(super) name: String,
    pub(super) about: Prose,
    pub(super) variants: Vec<Variant>,
}

/// One of the forms that a value may have.
#[derive(Debug)]
pub(super) struct Variant {
    /// Empty where there is one form alone, which its schema tells of.
    pub(super) about: Prose,
    pub(super) shape: Vec<Part>,
    pub(super) fields: Vec<Field>,
}

impl Group {
    pub(super) fn path(&self) -> String {
        format!("{PATH}/{}", self.name)
    }
}

impl Operation {
    /// Without the base that all have.
    pub(super) fn title(&self) -> String {
        format!("{} {}", self.method, self.path)
    }
}

impl Schema {
    pub(super) fn path(&self) -> String {
        schema_path(&self.name)
    }
}

pub(super) fn schema_path(name: &str) -> String {
    format!("{SCHEMAS_PATH}/{name}")
}

impl Reference {
    pub(super) fn of(document: &Value) -> Self {
        let groups = list(&document["tags"]).map(|tag| {
            let name = text(&tag["name"]);
            Group {
                operations: operations(document, &name),
                about: markdown::prose(&text(&tag["description"])),
                name,
            }
        });
        let components = &document["components"];
        let tokens = entries(&components["securitySchemes"])
            .map(|(name, scheme)| (name.clone(), markdown::prose(&text(&scheme["description"]))));
        Self {
            about: markdown::prose(&text(&document["info"]["description"])),
            groups: groups.collect(),
            schemas: entries(&components["schemas"])
                .map(|(name, schema)| Schema::of(name, schema))
                .collect(),
            answers: entries(&components["responses"])
                .map(|(name, answer)| Answer::of(name, answer))
                .collect(),
            tokens: tokens.collect(),
        }
    }

    /// As the search finds it.
    pub(super) fn sections(&self) -> Vec<Section> {
        let operations = self.groups.iter().flat_map(|group| {
            group.operations.iter().map(|operation| Section {
                page: format!("API reference: {}", group.name),
                heading: operation.title(),
                href: format!("{}#{}", group.path(), operation.id),
                text: operation.said(),
            })
        });
        let schemas = self.schemas.iter().map(|schema| Section {
            page: "API reference: schemas".into(),
            heading: schema.name.clone(),
            href: schema.path(),
            text: schema.said(),
        });
        operations.chain(schemas).collect()
    }
}

fn operations(document: &Value, tag: &str) -> Vec<Operation> {
    let paths = entries(&document["paths"]);
    let all = paths.flat_map(|(path, item)| {
        let methods = entries(item);
        methods.map(move |(method, operation)| (path, method, operation))
    });
    all.filter(|(_, _, operation)| list(&operation["tags"]).any(|one| one == tag))
        .map(|(path, method, operation)| Operation::of(path, method, operation))
        .collect()
}

impl Operation {
    fn of(path: &str, method: &str, operation: &Value) -> Self {
        let parameters = list(&operation["parameters"]).map(|parameter| Parameter {
            place: text(&parameter["in"]),
            field: Field {
                name: text(&parameter["name"]),
                shape: shape(&parameter["schema"]),
                is_required: parameter["required"] == true,
                about: about(parameter),
            },
        });
        let body = operation.get("requestBody").map(|body| Body {
            is_required: body["required"] == true,
            about: about(body),
            media: media(body),
        });
        let (shared, own): (Vec<_>, Vec<_>) =
            entries(&operation["responses"]).partition(|(_, answer)| answer["$ref"].is_string());
        let shared = shared
            .into_iter()
            .map(|(status, answer)| (status.clone(), last(&answer["$ref"])));
        let answers = own
            .into_iter()
            .map(|(status, answer)| Answer::of(status, answer));
        Self {
            id: text(&operation["operationId"]),
            method: method.to_uppercase(),
            path: path.to_owned(),
            summary: markdown::prose(&text(&operation["summary"])),
            about: about(operation),
            tokens: Tokens::of(&operation["security"]),
            parameters: parameters.collect(),
            body,
            answers: answers.collect(),
            shared: shared.collect(),
        }
    }

    fn said(&self) -> String {
        let parameters = self.parameters.iter().map(|one| &one.field);
        let parameters = parameters.map(|field| format!("{}: {}", field.name, field.about.plain));
        let told = [&self.summary, &self.about].map(|told| told.plain.clone());
        let told = told.into_iter().chain(parameters);
        told.collect::<Vec<_>>().join(" ")
    }
}

impl Answer {
    fn of(name: &str, answer: &Value) -> Self {
        let headers = entries(&answer["headers"]).map(|(name, _)| name.clone());
        Self {
            name: name.to_owned(),
            about: about(answer),
            media: media(answer),
            headers: headers.collect(),
        }
    }
}

impl Tokens {
    /// `[{}, {"team": []}]`: without a token, or with one of these.
    fn of(security: &Value) -> Self {
        let names: Vec<&str> = list(security)
            .flat_map(|one| entries(one).map(|(name, _)| name.as_str()))
            .collect();
        let is_optional = list(security).any(|one| one.as_object().is_some_and(Map::is_empty));
        match (names.join(" or "), is_optional) {
            (names, _) if names.is_empty() => Self::None,
            (names, true) => Self::Optional(names),
            (names, false) => Self::Required(names),
        }
    }
}

impl Schema {
    fn of(name: &str, schema: &Value) -> Self {
        let forms = list(&schema["oneOf"]).map(|form| Variant {
            about: about(form),
            ..Variant::of(form)
        });
        let mut variants: Vec<Variant> = forms.collect();
        if variants.is_empty() {
            variants.push(Variant::of(schema));
        }
        Self {
            name: name.to_owned(),
            about: about(schema),
            variants,
        }
    }

    fn said(&self) -> String {
        let fields = self.variants.iter().flat_map(|variant| &variant.fields);
        let fields = fields.map(|field| format!("{}: {}", field.name, field.about.plain));
        let told = std::iter::once(self.about.plain.clone());
        told.chain(fields).collect::<Vec<_>>().join(" ")
    }
}

impl Variant {
    fn of(schema: &Value) -> Self {
        let fields = fields(schema);
        Self {
            about: Prose::default(),
            // Fields have a table of their own.
            shape: if fields.is_empty() {
                shape(schema)
            } else {
                Vec::new()
            },
            fields,
        }
    }
}

/// What a body or an answer may be.
fn media(body: &Value) -> Vec<Media> {
    let media = entries(&body["content"]).map(|(name, content)| Media {
        name: name.clone(),
        shape: shape(&content["schema"]),
    });
    media.collect()
}

/// Of a reference the name that it ends with.
fn last(reference: &Value) -> String {
    let name = reference.as_str().and_then(|path| path.rsplit('/').next());
    name.unwrap_or_default().to_owned()
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn entries(value: &Value) -> impl Iterator<Item = (&String, &Value)> {
    value.as_object().into_iter().flatten()
}

fn text(value: &Value) -> String {
    value.as_str().unwrap_or_default().to_owned()
}
