//! A form that was submitted after the session had expired. What was typed is kept in the page on which the user signs in, and shown
//! once more afterwards, to be sent. A form that failed by a fault of the server is shown once more with the problem. It is kept in the
//! pages only, never on the server or in an address, and secrets are not kept.

use crate::{
    format,
    frame::{Frame, NO_ENTRY, PageProblem, ServerFault, render},
    page_auth::form_path,
};
use askama::Template;
use axum::{
    http::header,
    response::{Html, IntoResponse, Response},
};
use faceoff_service::app::App;
use uuid::Uuid;

/// A form with what was typed.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct KeptForm {
    /// Path to which the form is sent.
    pub(super) path: String,
    pub(super) fields: Vec<KeptField>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct KeptField {
    pub(super) name: String,
    pub(super) value: String,
}

/// Words in the names of fields that are not kept: secrets, and the confirmation of a decision, which has to be given in view of its
/// effects.
const NOT_KEPT: [&str; 6] = ["password", "secret", "token", "code", "old", "confirm"];

/// Prefix of a kept field's name in the form of the sign-in page, whose own fields are thus distinct.
const PREFIX: &str = "kept.";

/// Name of the field with the path of the kept form.
const PATH_FIELD: &str = "form";

impl KeptField {
    /// The name as a label.
    pub(super) fn label(&self) -> String {
        format::capitalised(&self.name.replace('_', " "))
    }

    /// Was it a hidden field, whose value the user did not type? Hidden are ids, versions, and the role `return`, the invitation with
    /// which a user gets access again.
    pub(super) fn is_hidden(&self) -> bool {
        let restores_access = self.name == "role" && self.value == "return";
        restores_access || self.name == "version" || self.value.parse::<Uuid>().is_ok()
    }

    /// Is it a ticked checkbox?
    pub(super) fn is_ticked(&self) -> bool {
        self.value == "on"
    }

    /// Does it need more than one line?
    pub(super) fn is_long(&self) -> bool {
        self.value.chars().count() > 60 || self.value.contains('\n')
    }
}

impl KeptForm {
    /// The form that was sent to `path`; `None` if nothing was typed.
    pub(super) fn new(path: &str, fields: Vec<(String, String)>) -> Option<Self> {
        let is_kept = |name: &str| NOT_KEPT.iter().all(|word| !name.contains(word));
        let fields: Vec<KeptField> = fields
            .into_iter()
            .filter(|(name, _)| is_kept(name))
            .map(|(name, value)| KeptField { name, value })
            .collect();
        // The form is refused without any of its fields, so empty ones are kept with the others.
        let is_typed = fields.iter().any(|field| !field.value.is_empty());
        is_typed.then(|| Self {
            path: path.to_owned(),
            fields,
        })
    }

    /// The form that the fields of the sign-in page keep; `None` if they keep none.
    pub(super) fn from_sign_in_fields(fields: &[(String, String)]) -> Option<Self> {
        let (_, path) = fields.iter().find(|(name, _)| name == PATH_FIELD)?;
        let kept = fields.iter().filter_map(|(name, value)| {
            let name = name.strip_prefix(PREFIX)?;
            Some((name.to_owned(), value.clone()))
        });
        Self::new(form_path(path)?, kept.collect())
    }

    /// The fields that the sign-in page needs to keep the form.
    pub(super) fn hidden_fields(&self) -> impl Iterator<Item = (String, &str)> {
        let path = std::iter::once((PATH_FIELD.to_owned(), self.path.as_str()));
        let fields = self.fields.iter();
        path.chain(fields.map(|field| (format!("{PREFIX}{}", field.name), field.value.as_str())))
    }
}

#[derive(Template)]
#[template(path = "kept_form.html")]
struct Page {
    frame: Frame,
    form: KeptForm,
    /// Why the form was not processed; `None`: the session had expired.
    fault: Option<ServerFault>,
}

/// The page from which a user who has signed in sends the form.
pub(super) async fn page(app: &App, form: KeptForm) -> Result<Response, PageProblem> {
    render(&Page {
        frame: Frame::load(app, NO_ENTRY).await?,
        form,
        fault: None,
    })
}

/// The page of a fault of the server, from which the user can send the form again. It has status and headers of `response`, which
/// showed the fault alone. Nothing of it is read from the database, which may be what failed.
pub(super) fn page_after_fault(
    app: &App,
    form: KeptForm,
    fault: ServerFault,
    response: Response,
) -> Response {
    let page = Page {
        frame: Frame::for_app(app, String::new(), NO_ENTRY),
        form,
        fault: Some(fault),
    };
    match page.render() {
        Ok(html) => {
            let (mut parts, _) = response.into_parts();
            parts.headers.remove(header::CONTENT_LENGTH);
            parts.headers.remove(header::CONTENT_TYPE);
            (parts.status, parts.headers, Html(html)).into_response()
        }
        Err(_) => response,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(fields: &[(&str, &str)]) -> Vec<(String, String)> {
        let owned = |(name, value): &(&str, &str)| ((*name).to_owned(), (*value).to_owned());
        fields.iter().map(owned).collect()
    }

    #[test]
    fn secrets_and_confirmations_are_not_kept() {
        let typed = [
            ("text", "a <b>\r\nc"),
            ("password", "x"),
            ("new_password", "x"),
            ("old", "x"),
            ("api_token", "x"),
            ("confirm", "Alpha"),
            ("empty", ""),
        ];
        let form = KeptForm::new("/dashboard/questions", pairs(&typed)).unwrap();
        let names: Vec<&str> = form.fields.iter().map(|field| &*field.name).collect();
        assert_eq!(names, ["text", "empty"]);
        assert_eq!(KeptForm::new("/dashboard", pairs(&typed[1..])), None);
    }

    #[test]
    fn id_and_version_fields_are_hidden() {
        let field = |(name, value): (&str, &str)| KeptField {
            name: name.to_owned(),
            value: value.to_owned(),
        };
        let id = "6b1f0a1e-6f0b-4d3a-9b57-0d8f2f3f7a11";
        for hidden in [
            ("person", id),
            ("stage", id),
            ("version", "2"),
            ("role", "return"),
        ] {
            assert!(field(hidden).is_hidden(), "{hidden:?}");
        }
        for shown in [("role", "member"), ("stage", "Qualifying"), ("text", "")] {
            assert!(!field(shown).is_hidden(), "{shown:?}");
        }
    }

    #[test]
    fn kept_form_round_trips_and_foreign_paths_are_refused() {
        let typed = [
            ("next", "mine"),
            ("form", "A"),
            ("opens_at", "2026-03-01T10:00"),
        ];
        let form = KeptForm::new("/organiser/stages", pairs(&typed)).unwrap();
        let hidden = form.hidden_fields();
        let hidden: Vec<_> = hidden
            .map(|(name, value)| (name, value.to_owned()))
            .collect();
        assert_eq!(KeptForm::from_sign_in_fields(&hidden), Some(form));
        for foreign in [
            "https://evil.example/organiser",
            "//evil.example",
            "/sign-in",
            "/account",
        ] {
            let hidden = pairs(&[("form", foreign), ("kept.text", "a")]);
            assert_eq!(KeptForm::from_sign_in_fields(&hidden), None, "{foreign}");
        }
    }
}
