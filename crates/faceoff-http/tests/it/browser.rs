//! A browser for tests of pages and forms: it opens pages, submits forms and keeps one cookie. It runs no scripts.

use crate::site::{ADMIN, Answer, Site, client_builder, string};
use reqwest::redirect::Policy;
use scraper::{Html, Selector};

/// A browser that follows no redirects, keeps one cookie, and sends the origin of its forms.
pub struct Browser<'a> {
    pub site: &'a Site,
    pub http: reqwest::Client,
    pub cookie: Option<String>,
}

impl<'a> Browser<'a> {
    pub fn new(site: &'a Site) -> Self {
        let http = client_builder().redirect(Policy::none());
        Self {
            site,
            http: http.build().unwrap(),
            cookie: None,
        }
    }

    pub async fn send(&mut self, request: reqwest::RequestBuilder) -> Answer {
        let request = match &self.cookie {
            Some(cookie) => request.header("cookie", cookie),
            None => request,
        };
        let answer = Answer::read(request.send().await.unwrap()).await;
        if let Some(set_cookie) = answer.headers.get("set-cookie") {
            let name_and_value = set_cookie.to_str().unwrap().split(';').next().unwrap();
            // The server deletes a cookie by an empty value.
            self.cookie = (!name_and_value.ends_with('=')).then(|| name_and_value.to_owned());
        }
        answer
    }

    /// Opens a page.
    pub async fn open(&mut self, path: &str) -> Answer {
        let request = self.http.get(format!("{}{path}", self.site.url));
        self.send(request.header("accept", "text/html")).await
    }

    /// Submits a form with these fields from a page of the site.
    pub async fn submit(&mut self, path: &str, fields: &[(&str, &str)]) -> Answer {
        let body: Vec<String> = fields
            .iter()
            .map(|(name, value)| format!("{name}={}", encode(value)))
            .collect();
        let media_type = "application/x-www-form-urlencoded";
        self.send_form(path, media_type, body.join("&")).await
    }

    /// Uploads a bundle as the upload form does.
    pub async fn upload(&mut self, path: &str, file_name: &str, bundle: &[u8]) -> Answer {
        let head = format!(
            "--X\r\nContent-Disposition: form-data; name=\"bundle\"; filename=\"{file_name}\"\r\n\
             Content-Type: application/octet-stream\r\n\r\n"
        );
        let body = [head.as_bytes(), bundle, b"\r\n--X--\r\n"].concat();
        let media_type = "multipart/form-data; boundary=X";
        self.send_form(path, media_type, body).await
    }

    async fn send_form(
        &mut self,
        path: &str,
        media_type: &str,
        body: impl Into<reqwest::Body>,
    ) -> Answer {
        let request = self
            .http
            .post(format!("{}{path}", self.site.url))
            .header("accept", "text/html")
            .header("origin", &self.site.url)
            .header("content-type", media_type)
            .body(body);
        self.send(request).await
    }

    /// Submits a form from a page of another site, once with each header by which a server can notice that. The cookie is
    /// sent along, as an old browser would do.
    pub async fn submit_from_foreign_page(&mut self, form: &Form) -> Vec<Answer> {
        let mut answers = Vec::new();
        for (name, value) in [
            ("origin", "https://evil.example"),
            ("origin", "null"),
            ("sec-fetch-site", "cross-site"),
            ("sec-fetch-site", "same-site"),
            ("accept", "text/html"),
        ] {
            let fields: Vec<String> = form
                .fields
                .iter()
                .map(|(name, value)| format!("{name}={}", encode(value)))
                .collect();
            let media_type = match form.is_multipart {
                true => "multipart/form-data; boundary=X",
                false => "application/x-www-form-urlencoded",
            };
            let request = self
                .http
                .post(format!("{}{}", self.site.url, form.action))
                .header(name, value)
                .header("content-type", media_type)
                .body(fields.join("&"));
            answers.push(self.send(request).await);
        }
        answers
    }

    /// A browser of a user who has accepted an invitation with this role.
    pub async fn join(site: &'a Site, name: &str, role: serde_json::Value) -> Self {
        let link = invite(site, role).await;
        let mut browser = Self::new(site);
        let fields = [("name", name), ("password", PASSWORD)];
        assert_eq!(browser.submit(&link, &fields).await.status, 303);
        browser
    }
}

/// The text in form encoding.
fn encode(text: &str) -> String {
    let encoded = text.bytes().map(|byte| match byte {
        b' ' => "+".to_owned(),
        byte if byte.is_ascii_alphanumeric() || b"-._".contains(&byte) => {
            char::from(byte).to_string()
        }
        byte => format!("%{byte:02X}"),
    });
    encoded.collect()
}

/// A form of a page, with the values of its fields.
#[derive(Debug, Clone, PartialEq)]
pub struct Form {
    pub action: String,
    pub is_post: bool,
    pub is_multipart: bool,
    pub fields: Vec<(String, String)>,
}

/// The forms of a page, which was the answer to a request of `path`.
pub fn forms(path: &str, answer: &Answer) -> Vec<Form> {
    let page = Html::parse_document(&answer.body);
    let select = |selector: &str| Selector::parse(selector).unwrap();
    let (forms, inputs) = (
        select("form"),
        select("input[name], textarea[name], select[name]"),
    );
    let options = select("option[selected], option:first-child");
    page.select(&forms)
        .map(|form| {
            let attr = |name| form.value().attr(name);
            let fields = form.select(&inputs).filter_map(|field| {
                let name = field.value().attr("name").unwrap().to_owned();
                let value = |element: scraper::ElementRef<'_>| {
                    let value = element.value().attr("value").map(str::to_owned);
                    value.unwrap_or_else(|| element.text().collect())
                };
                let is_checkbox = field.value().attr("type") == Some("checkbox");
                match field.value().name() {
                    "select" => {
                        let options: Vec<_> = field.select(&options).collect();
                        let selected = options
                            .iter()
                            .find(|option| option.value().attr("selected").is_some())
                            .or(options.first());
                        selected.map(|option| (name, value(*option)))
                    }
                    _ if is_checkbox => field
                        .value()
                        .attr("checked")
                        .map(|_| (name, field.value().attr("value").unwrap_or("on").to_owned())),
                    _ => Some((name, value(field))),
                }
            });
            Form {
                action: attr("action").unwrap_or(path).to_owned(),
                is_post: attr("method") == Some("post"),
                is_multipart: attr("enctype") == Some("multipart/form-data"),
                fields: fields.collect(),
            }
        })
        .collect()
}

/// The text of the first element that the selector finds.
pub fn first_text(answer: &Answer, selector: &str) -> String {
    let page = Html::parse_document(&answer.body);
    let found = page.select(&Selector::parse(selector).unwrap()).next();
    let found = found.unwrap_or_else(|| panic!("no {selector} in {}", answer.body));
    found.text().collect::<String>().trim().to_owned()
}

/// Creates an invitation. Returns the path of its page.
pub async fn invite(site: &Site, body: serde_json::Value) -> String {
    let invited = site.post("/api/v1/invitations", Some(ADMIN), &body).await;
    string(&invited.json(201)["link"])
}

/// The password of all users in tests.
pub const PASSWORD: &str = "correct horse battery";
