//! The API reference, from the OpenAPI document of the server.

mod type_description;

use super::{
    markdown::{self, Prose},
    sections::{Section, SectionKind},
};
use serde_json::{Map, Value};
pub(super) use type_description::{Field, TypePart};
use type_description::{describe_type, description, fields};

pub(super) const PATH: &str = "/docs/api-reference";
pub(super) const SCHEMAS_PATH: &str = "/docs/api-reference/schemas";

#[derive(Debug)]
pub(super) struct Reference {
    pub(super) description: Prose,
    pub(super) groups: Vec<Group>,
    pub(super) schemas: Vec<Schema>,
    /// Responses shared by many operations, by name.
    pub(super) responses: Vec<ResponseDoc>,
    /// Kinds of tokens, by name.
    pub(super) tokens: Vec<(String, Prose)>,
}

/// The operations of a topic, an OpenAPI tag.
#[derive(Debug)]
pub(super) struct Group {
    pub(super) name: String,
    pub(super) description: Prose,
    pub(super) operations: Vec<Operation>,
}

/// An operation of the API: a method of a path.
#[derive(Debug)]
pub(super) struct Operation {
    /// The id in the OpenAPI document, which is the anchor on the page.
    pub(super) id: String,
    /// Method and path.
    pub(super) title: String,
    pub(super) method: String,
    pub(super) path: String,
    pub(super) summary: Prose,
    pub(super) description: Prose,
    pub(super) token: TokenRequirement,
    pub(super) parameters: Vec<Parameter>,
    pub(super) body: Option<Body>,
    pub(super) responses: Vec<ResponseDoc>,
    /// Shared responses: status, and name in [`Reference::responses`].
    pub(super) shared_responses: Vec<(String, String)>,
}

/// Does an operation need a token? With the names of the accepted kinds of tokens.
#[derive(Debug)]
pub(super) enum TokenRequirement {
    None,
    Optional(String),
    Required(String),
}

#[derive(Debug)]
pub(super) struct Parameter {
    /// `path` or `query`.
    pub(super) location: String,
    pub(super) field: Field,
}

#[derive(Debug)]
pub(super) struct Body {
    pub(super) is_required: bool,
    pub(super) description: Prose,
    pub(super) media: Vec<Media>,
}

#[derive(Debug)]
pub(super) struct ResponseDoc {
    /// The status; the name of a shared response.
    pub(super) name: String,
    pub(super) description: Prose,
    pub(super) media: Vec<Media>,
    pub(super) headers: Vec<String>,
}

/// A media type with its content.
#[derive(Debug)]
pub(super) struct Media {
    pub(super) name: String,
    pub(super) type_parts: Vec<TypePart>,
}

/// A named type.
#[derive(Debug)]
pub(super) struct Schema {
    pub(super) name: String,
    pub(super) description: Prose,
    pub(super) variants: Vec<Variant>,
}

/// A variant of a type.
#[derive(Debug)]
pub(super) struct Variant {
    /// Empty for a single variant; the description is that of the schema.
    pub(super) description: Prose,
    pub(super) type_parts: Vec<TypePart>,
    pub(super) fields: Vec<Field>,
}

impl Group {
    pub(super) fn path(&self) -> String {
        format!("{PATH}/{}", self.name)
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
    pub(super) fn new(document: &Value) -> Self {
        let groups = list(&document["tags"]).map(|tag| {
            let name = text(&tag["name"]);
            Group {
                operations: operations(document, &name),
                description: markdown::render_prose(&text(&tag["description"])),
                name,
            }
        });
        let components = &document["components"];
        let tokens = entries(&components["securitySchemes"]).map(|(name, scheme)| {
            (
                name.clone(),
                markdown::render_prose(&text(&scheme["description"])),
            )
        });
        Self {
            description: markdown::render_prose(&text(&document["info"]["description"])),
            groups: groups.collect(),
            schemas: entries(&components["schemas"])
                .map(|(name, schema)| Schema::new(name, schema))
                .collect(),
            responses: entries(&components["responses"])
                .map(|(name, response)| ResponseDoc::new(name, response))
                .collect(),
            tokens: tokens.collect(),
        }
    }

    /// Sections for the search.
    pub(super) fn sections(&self) -> Vec<Section> {
        let operations = self.groups.iter().flat_map(|group| {
            group.operations.iter().map(|operation| Section {
                kind: SectionKind::Operation,
                summary: String::new(),
                page: format!("API reference: {}", group.name),
                heading: operation.title.clone(),
                href: format!("{}#{}", group.path(), operation.id),
                text: operation.search_text(),
            })
        });
        let schemas = self.schemas.iter().map(|schema| Section {
            kind: SectionKind::Schema,
            summary: String::new(),
            page: "API reference: schemas".into(),
            heading: schema.name.clone(),
            href: schema.path(),
            text: schema.search_text(),
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
    all.filter(|(_, _, operation)| list(&operation["tags"]).any(|name| name == tag))
        .map(|(path, method, operation)| Operation::new(path, method, operation))
        .collect()
}

impl Operation {
    fn new(path: &str, method: &str, operation: &Value) -> Self {
        let parameters = list(&operation["parameters"]).map(|parameter| Parameter {
            location: text(&parameter["in"]),
            field: Field {
                name: text(&parameter["name"]),
                type_parts: describe_type(&parameter["schema"]),
                is_required: parameter["required"] == true,
                description: description(parameter),
            },
        });
        let body = operation.get("requestBody").map(|body| Body {
            is_required: body["required"] == true,
            description: description(body),
            media: media(body),
        });
        let (shared, own): (Vec<_>, Vec<_>) = entries(&operation["responses"])
            .partition(|(_, response)| response["$ref"].is_string());
        let shared = shared
            .into_iter()
            .map(|(status, response)| (status.clone(), reference_name(&response["$ref"])));
        let responses = own
            .into_iter()
            .map(|(status, response)| ResponseDoc::new(status, response));
        Self {
            id: text(&operation["operationId"]),
            title: format!("{} {path}", method.to_uppercase()),
            method: method.to_uppercase(),
            path: path.to_owned(),
            summary: markdown::render_prose(&text(&operation["summary"])),
            description: description(operation),
            token: TokenRequirement::new(&operation["security"]),
            parameters: parameters.collect(),
            body,
            responses: responses.collect(),
            shared_responses: shared.collect(),
        }
    }

    fn search_text(&self) -> String {
        let parameters = self.parameters.iter().map(|parameter| &parameter.field);
        let parameters =
            parameters.map(|field| format!("{}: {}", field.name, field.description.plain));
        let texts = [&self.summary, &self.description].map(|prose| prose.plain.clone());
        let texts = texts.into_iter().chain(parameters);
        texts.collect::<Vec<_>>().join(" ")
    }
}

impl ResponseDoc {
    fn new(name: &str, response: &Value) -> Self {
        let headers = entries(&response["headers"]).map(|(name, _)| name.clone());
        Self {
            name: name.to_owned(),
            description: description(response),
            media: media(response),
            headers: headers.collect(),
        }
    }
}

impl TokenRequirement {
    /// From OpenAPI security requirements: `[{}, {"team": []}]` is an optional token.
    fn new(security: &Value) -> Self {
        let names: Vec<&str> = list(security)
            .flat_map(|requirement| entries(requirement).map(|(name, _)| name.as_str()))
            .collect();
        let is_optional =
            list(security).any(|requirement| requirement.as_object().is_some_and(Map::is_empty));
        match (names.join(" or "), is_optional) {
            (names, _) if names.is_empty() => Self::None,
            (names, true) => Self::Optional(names),
            (names, false) => Self::Required(names),
        }
    }
}

impl Schema {
    fn new(name: &str, schema: &Value) -> Self {
        let variants = list(&schema["oneOf"]).map(|variant| Variant {
            description: description(variant),
            ..Variant::new(variant)
        });
        let mut variants: Vec<Variant> = variants.collect();
        if variants.is_empty() {
            variants.push(Variant::new(schema));
        }
        Self {
            name: name.to_owned(),
            description: description(schema),
            variants,
        }
    }

    fn search_text(&self) -> String {
        let fields = self.variants.iter().flat_map(|variant| &variant.fields);
        let fields = fields.map(|field| format!("{}: {}", field.name, field.description.plain));
        let description = std::iter::once(self.description.plain.clone());
        description.chain(fields).collect::<Vec<_>>().join(" ")
    }
}

impl Variant {
    fn new(schema: &Value) -> Self {
        let fields = fields(schema);
        Self {
            description: Prose::default(),
            // Fields are shown in a table instead.
            type_parts: if fields.is_empty() {
                describe_type(schema)
            } else {
                Vec::new()
            },
            fields,
        }
    }
}

/// Media types of a request or response body.
fn media(body: &Value) -> Vec<Media> {
    let media = entries(&body["content"]).map(|(name, content)| Media {
        name: name.clone(),
        type_parts: describe_type(&content["schema"]),
    });
    media.collect()
}

/// The last part of a `$ref`: the name of the component.
fn reference_name(reference: &Value) -> String {
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
