//! The documents' Markdown as HTML of this site: headings that can be linked to, tables and code that scroll by themselves,
//! and links that lead somewhere here. HTML within Markdown is shown as text; styles are classes, never attributes, as the
//! pages' policy demands.

use super::sections::{Section, Sections};
use askama::filters::{Escaper, Html};
use pulldown_cmark::{
    Alignment, CodeBlockKind, CowStr, Event, HeadingLevel, Options, Parser, Tag, TagEnd, html,
};
use std::collections::HashSet;

/// What a document becomes.
#[derive(Debug)]
pub(super) struct Rendered {
    pub(super) html: String,
    /// Of its sections, as "On this page" lists them.
    pub(super) contents: Vec<Entry>,
    pub(super) sections: Vec<Section>,
}

/// A heading of the second level.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) id: String,
    pub(super) title: String,
}

/// Where links and pictures of a document lead on this site.
pub(super) trait Site {
    /// The title of the page that a Markdown file is, and its path.
    fn page(&self, file: &str) -> Option<(&str, String)>;
    /// The path of a picture.
    fn picture(&self, file: &str) -> Option<String>;
}

/// A whole document. `path` is its own.
pub(super) fn document(markdown: &str, path: &str, title: &str, site: &impl Site) -> Rendered {
    let options = Options::ENABLE_TABLES | Options::ENABLE_FOOTNOTES;
    let mut writer = Writer {
        site,
        out: Vec::new(),
        ids: HashSet::new(),
        contents: Vec::new(),
        sections: Sections::new(path, title),
        heading: title.to_owned(),
        tables: 0,
        listings: 0,
        columns: Vec::new(),
        column: 0,
        is_head: false,
        left_out: Vec::new(),
    };
    let mut events = Parser::new_ext(markdown, options);
    while let Some(event) = events.next() {
        writer.write(event, &mut events);
    }
    let mut written = String::with_capacity(markdown.len() * 3 / 2);
    html::push_html(&mut written, writer.out.into_iter());
    Rendered {
        html: written,
        contents: writer.contents,
        sections: writer.sections.done(),
    }
}

/// What a program says of something.
#[derive(Debug, Default)]
pub(super) struct Prose {
    pub(super) html: String,
    pub(super) plain: String,
}

/// What a program says of itself: paragraphs without links, since they would lead into its source.
pub(super) fn prose(markdown: &str) -> Prose {
    // Rust's way to name another item.
    let markdown = markdown.replace("[`", "`").replace("`]", "`");
    let linked = |event: &Event<'_>| {
        let links = [TagEnd::Link, TagEnd::Image];
        match event {
            Event::Start(tag) => links.contains(&tag.to_end()),
            Event::End(tag) => links.contains(tag),
            _ => false,
        }
    };
    let events = Parser::new(&markdown).filter(|event| !linked(event));
    let events: Vec<Event<'_>> = events.map(without_html).collect();
    let plain = said(&events);
    let mut html = String::new();
    html::push_html(&mut html, events.into_iter());
    Prose { html, plain }
}

/// The first of Markdown's lines that is a heading: its title.
pub(super) fn title(markdown: &str) -> &str {
    let mut lines = markdown.lines();
    lines
        .find_map(|line| line.strip_prefix("# "))
        .unwrap_or_default()
}

/// What GitHub makes of a heading, which is what the documents' links name.
pub(super) fn slug(heading: &str) -> String {
    let kept = heading.chars().filter_map(|c| match c {
        ' ' => Some('-'),
        '-' | '_' => Some(c),
        _ => c.is_alphanumeric().then_some(c),
    });
    kept.flat_map(char::to_lowercase).collect()
}

pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    Html.write_escaped_str(&mut out, text)
        .expect("a String takes everything");
    out
}

struct Writer<'a, S> {
    site: &'a S,
    out: Vec<Event<'a>>,
    ids: HashSet<String>,
    contents: Vec<Entry>,
    sections: Sections,
    /// The nearest heading above.
    heading: String,
    tables: usize,
    listings: usize,
    columns: Vec<Alignment>,
    column: usize,
    is_head: bool,
    /// Ends of the links that are open.
    left_out: Vec<String>,
}

impl<'a, S: Site> Writer<'a, S> {
    fn html(&mut self, html: impl Into<String>) {
        self.out.push(Event::Html(CowStr::from(html.into())));
    }

    fn write(&mut self, event: Event<'a>, rest: &mut Parser<'a>) {
        match event {
            Event::Start(Tag::Heading { level, .. }) => self.heading(level, rest),
            Event::Start(Tag::Image { dest_url, .. }) => self.picture(&dest_url, rest),
            Event::Start(Tag::Link { dest_url, .. }) => self.link(&dest_url, rest),
            Event::End(TagEnd::Link) => {
                let end = self.left_out.pop().unwrap_or_default();
                self.html(end);
            }
            Event::Start(Tag::CodeBlock(kind)) => self.listing(&kind),
            Event::End(TagEnd::CodeBlock) => {
                self.sections.pause();
                self.html("</code></pre>\n");
            }
            Event::Start(Tag::Table(columns)) => self.table(columns),
            Event::End(TagEnd::Table) => self.html("</tbody></table></div>\n"),
            Event::Start(Tag::TableHead) => {
                (self.is_head, self.column) = (true, 0);
                self.html("<thead><tr>");
            }
            Event::End(TagEnd::TableHead) => {
                self.is_head = false;
                self.html("</tr></thead><tbody>\n");
            }
            Event::Start(Tag::TableRow) => {
                self.column = 0;
                self.html("<tr>");
            }
            Event::End(TagEnd::TableRow) => self.html("</tr>\n"),
            Event::Start(Tag::TableCell) => self.cell(),
            Event::End(TagEnd::TableCell) => {
                self.column += 1;
                self.sections.pause();
                self.html(if self.is_head { "</th>" } else { "</td>" });
            }
            Event::Html(text) | Event::InlineHtml(text) => self.text(Event::Text(text)),
            Event::Text(_) | Event::Code(_) => self.text(event),
            Event::SoftBreak | Event::HardBreak => {
                self.sections.pause();
                self.out.push(event);
            }
            Event::End(_) => {
                self.sections.pause_after(&event);
                self.out.push(event);
            }
            other => self.out.push(other),
        }
    }

    fn text(&mut self, event: Event<'a>) {
        if let Event::Text(text) | Event::Code(text) = &event {
            self.sections.say(text);
        }
        self.out.push(event);
    }

    fn heading(&mut self, level: HeadingLevel, rest: &mut Parser<'a>) {
        let end = Event::End(TagEnd::Heading(level));
        let inner = until(&end, rest);
        let title = said(&inner);
        self.heading.clone_from(&title);
        if level == HeadingLevel::H1 {
            self.html("<h1>");
            self.out.extend(inner);
            return self.html("</h1>\n");
        }
        let id = self.unique(slug(&title));
        if level == HeadingLevel::H2 {
            let (id, title) = (id.clone(), title.clone());
            self.contents.push(Entry { id, title });
        }
        if level <= HeadingLevel::H3 {
            self.sections.begin(&title, &id);
        } else {
            self.sections.say(&title);
            self.sections.pause();
        }
        let (id, name) = (escaped(&id), escaped(&title));
        self.html(format!("<div class=\"titled\"><{level} id=\"{id}\">"));
        self.out.extend(inner);
        // Beside the heading and not in it, where it would be a part of its name.
        self.html(format!(
            "</{level}><a class=\"anchor\" href=\"#{id}\" aria-label=\"Link to the section {name}\">#</a></div>\n"
        ));
    }

    fn unique(&mut self, slug: String) -> String {
        let numbered = (1..).map(|number| format!("{slug}-{number}"));
        let id = std::iter::once(slug.clone())
            .chain(numbered)
            .find(|id| !self.ids.contains(id))
            .expect("there is always another number");
        self.ids.insert(id.clone());
        id
    }

    fn picture(&mut self, file: &str, rest: &mut Parser<'a>) {
        let inner = until(&Event::End(TagEnd::Image), rest);
        let shown = said(&inner);
        self.sections.say(&shown);
        let alt = escaped(&shown);
        match self.site.picture(file) {
            Some(path) => self.html(format!(
                "<img src=\"{}\" alt=\"{alt}\" loading=\"lazy\">",
                escaped(&path)
            )),
            None => self.html(alt),
        }
    }

    fn link(&mut self, to: &str, rest: &mut Parser<'a>) {
        if to.starts_with('#') || to.starts_with("https://") || to.starts_with("http://") {
            self.html(format!("<a href=\"{}\">", escaped(to)));
            return self.left_out.push("</a>".into());
        }
        let (file, anchor) = to
            .split_once('#')
            .map_or((to, None), |(file, anchor)| (file, Some(anchor)));
        let inner = until(&Event::End(TagEnd::Link), rest);
        let shown = said(&inner);
        self.sections.say(if shown == file {
            self.site.page(file).map_or(file, |(title, _)| title)
        } else {
            &shown
        });
        match self.site.page(file) {
            Some((title, path)) => {
                let anchor = anchor
                    .map(|anchor| format!("#{anchor}"))
                    .unwrap_or_default();
                self.html(format!(
                    "<a href=\"{}\">",
                    escaped(&format!("{path}{anchor}"))
                ));
                // Here pages have titles, no file names.
                if shown == file {
                    self.html(escaped(title));
                } else {
                    self.out.extend(inner);
                }
                self.html("</a>");
            }
            // A file of the repository, which the site does not have: its name.
            None => {
                let path = file.trim_start_matches("../");
                if path.contains(&shown) {
                    self.html(format!("<code>{}</code>", escaped(path)));
                } else {
                    self.out.extend(inner);
                    self.html(format!(" (<code>{}</code>)", escaped(path)));
                }
            }
        }
    }

    fn listing(&mut self, kind: &CodeBlockKind<'_>) {
        self.listings += 1;
        let what = match kind {
            CodeBlockKind::Fenced(language) if matches!(&**language, "sh" | "console") => {
                "Commands"
            }
            CodeBlockKind::Fenced(_) | CodeBlockKind::Indented => "Listing",
        };
        let label = escaped(&format!("{what} {}: {}", self.listings, self.heading));
        self.html(format!(
            "<pre tabindex=\"0\" role=\"group\" aria-label=\"{label}\"><code>"
        ));
    }

    fn table(&mut self, columns: Vec<Alignment>) {
        self.tables += 1;
        self.columns = columns;
        let label = escaped(&format!("Table {}: {}", self.tables, self.heading));
        self.html(format!(
            "<div class=\"wide\" role=\"region\" aria-label=\"{label}\" tabindex=\"0\"><table class=\"plain\">"
        ));
    }

    fn cell(&mut self) {
        let name = if self.is_head {
            "th scope=\"col\""
        } else {
            "td"
        };
        let class = match self.columns.get(self.column) {
            Some(Alignment::Right) => " class=\"number\"",
            _ => "",
        };
        self.html(format!("<{name}{class}>"));
    }
}

/// What comes before `end`, which goes with it.
fn until<'a>(end: &Event<'_>, rest: &mut Parser<'a>) -> Vec<Event<'a>> {
    let inner = rest.by_ref().take_while(|event| event != end);
    inner.map(without_html).collect()
}

fn without_html(event: Event<'_>) -> Event<'_> {
    match event {
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        other => other,
    }
}

/// The words of some events.
fn said(events: &[Event<'_>]) -> String {
    let words = events.iter().map(|event| match event {
        Event::Text(text) | Event::Code(text) => text,
        Event::SoftBreak | Event::HardBreak | Event::End(TagEnd::Paragraph) => " ",
        _ => "",
    });
    words.collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests;
