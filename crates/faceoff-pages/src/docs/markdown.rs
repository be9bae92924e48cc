//! Markdown of the documents as HTML of this site: headings with anchors, scrollable tables and listings, and links to pages of
//! this site. HTML in Markdown is shown as text. Styles are classes, never attributes: the content security policy demands it.

use super::{
    escape::escape,
    listing::render_listing,
    sections::{Section, Sections},
};
use pulldown_cmark::{
    Alignment, CodeBlockKind, CowStr, Event, HeadingLevel, Options, Parser, Tag, TagEnd, html,
};
use std::collections::HashSet;

#[derive(Debug)]
pub(super) struct Document {
    pub(super) html: String,
    /// Entries of "On this page".
    pub(super) contents: Vec<ContentsEntry>,
    pub(super) sections: Vec<Section>,
}

/// A heading of the second level.
#[derive(Debug)]
pub(super) struct ContentsEntry {
    pub(super) id: String,
    pub(super) title: String,
}

/// Finds the pages and pictures of this site that a document links to.
pub(super) trait LinkResolver {
    /// Title and path of the page of a Markdown file.
    fn page(&self, file: &str) -> Option<(&str, String)>;
    /// The path of a picture.
    fn picture(&self, file: &str) -> Option<String>;
}

/// Renders a whole document. `path` and `summary`: path of its page, and its content in one line.
pub(super) fn render_document(
    markdown: &str,
    path: &str,
    title: &str,
    summary: &str,
    links: &impl LinkResolver,
) -> Document {
    let options = Options::ENABLE_TABLES | Options::ENABLE_FOOTNOTES;
    let mut writer = Writer {
        links,
        out: Vec::new(),
        ids: HashSet::new(),
        contents: Vec::new(),
        sections: Sections::new(path, title, summary),
        heading: title.to_owned(),
        tables: 0,
        listings: 0,
        columns: Vec::new(),
        column: 0,
        is_head: false,
        link_ends: Vec::new(),
    };
    let mut events = Parser::new_ext(markdown, options);
    while let Some(event) = events.next() {
        writer.write(event, &mut events);
    }
    let mut rendered = String::with_capacity(markdown.len() * 3 / 2);
    html::push_html(&mut rendered, writer.out.into_iter());
    Document {
        html: rendered,
        contents: writer.contents,
        sections: writer.sections.finish(),
    }
}

/// A description from the OpenAPI document.
#[derive(Debug, Default)]
pub(super) struct Prose {
    pub(super) html: String,
    /// The text without markup.
    pub(super) plain: String,
}

/// Renders a description without links, which would point into the source code.
pub(super) fn render_prose(markdown: &str) -> Prose {
    // Doc links to other items of the code.
    let markdown = markdown.replace("[`", "`").replace("`]", "`");
    let is_link = |event: &Event<'_>| {
        let links = [TagEnd::Link, TagEnd::Image];
        match event {
            Event::Start(tag) => links.contains(&tag.to_end()),
            Event::End(tag) => links.contains(tag),
            _ => false,
        }
    };
    let events = Parser::new(&markdown).filter(|event| !is_link(event));
    let events: Vec<Event<'_>> = events.map(without_html).collect();
    let plain = plain_text(&events);
    let mut html = String::new();
    html::push_html(&mut html, events.into_iter());
    Prose { html, plain }
}

/// The first heading of a Markdown text.
pub(super) fn title(markdown: &str) -> &str {
    let mut lines = markdown.lines();
    lines
        .find_map(|line| line.strip_prefix("# "))
        .unwrap_or_default()
}

/// Anchor of a heading by the rules of GitHub, which links in the documents use.
pub(super) fn slug(heading: &str) -> String {
    let anchor = heading.chars().filter_map(|c| match c {
        ' ' => Some('-'),
        '-' | '_' => Some(c),
        _ => c.is_alphanumeric().then_some(c),
    });
    anchor.flat_map(char::to_lowercase).collect()
}

/// Replaces events of the Markdown parser by HTML of this site, and collects the headings and sections on the way.
struct Writer<'a, S> {
    links: &'a S,
    /// The events from which the page is rendered.
    out: Vec<Event<'a>>,
    /// Ids of the headings so far.
    ids: HashSet<String>,
    contents: Vec<ContentsEntry>,
    sections: Sections,
    /// The nearest heading above.
    heading: String,
    /// Number of tables and listings so far.
    tables: usize,
    listings: usize,
    /// Of the current table: the alignment of its columns, the current column, and whether the row is the head.
    columns: Vec<Alignment>,
    column: usize,
    is_head: bool,
    /// Closing tags of open links.
    link_ends: Vec<String>,
}

impl<'a, S: LinkResolver> Writer<'a, S> {
    fn html(&mut self, html: impl Into<String>) {
        self.out.push(Event::Html(CowStr::from(html.into())));
    }

    fn write(&mut self, event: Event<'a>, rest: &mut Parser<'a>) {
        match event {
            Event::Start(Tag::Heading { level, .. }) => self.heading(level, rest),
            Event::Start(Tag::Image { dest_url, .. }) => self.picture(&dest_url, rest),
            Event::Start(Tag::Link { dest_url, .. }) => self.link(&dest_url, rest),
            Event::End(TagEnd::Link) => {
                let end = self.link_ends.pop().unwrap_or_default();
                self.html(end);
            }
            Event::Start(Tag::CodeBlock(kind)) => self.listing(&kind, rest),
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
                self.sections.push_space();
                self.html(if self.is_head { "</th>" } else { "</td>" });
            }
            Event::Html(text) | Event::InlineHtml(text) => self.text(Event::Text(text)),
            Event::Text(_) | Event::Code(_) => self.text(event),
            Event::SoftBreak | Event::HardBreak => {
                self.sections.push_space();
                self.out.push(event);
            }
            Event::End(_) => {
                self.sections.push_space_after(&event);
                self.out.push(event);
            }
            other => self.out.push(other),
        }
    }

    fn text(&mut self, event: Event<'a>) {
        if let Event::Text(text) | Event::Code(text) = &event {
            self.sections.push_text(text);
        }
        self.out.push(event);
    }

    fn heading(&mut self, level: HeadingLevel, rest: &mut Parser<'a>) {
        let end = Event::End(TagEnd::Heading(level));
        let inner = take_until(&end, rest);
        let title = plain_text(&inner);
        self.heading.clone_from(&title);
        if level == HeadingLevel::H1 {
            self.html("<h1>");
            self.out.extend(inner);
            return self.html("</h1>\n");
        }
        let id = self.unique_id(slug(&title));
        if level == HeadingLevel::H2 {
            let (id, title) = (id.clone(), title.clone());
            self.contents.push(ContentsEntry { id, title });
        }
        if level <= HeadingLevel::H3 {
            self.sections.start(&title, &id);
        } else {
            self.sections.push_text(&title);
            self.sections.push_space();
        }
        let (id, name) = (escape(&id), escape(&title));
        self.html(format!("<div class=\"titled\"><{level} id=\"{id}\">"));
        self.out.extend(inner);
        // The anchor is next to the heading: inside, it would be part of its accessible name.
        self.html(format!(
            "</{level}><a class=\"anchor\" href=\"#{id}\" aria-label=\"Link to the section {name}\">#</a></div>\n"
        ));
    }

    /// The slug, with a number if an earlier heading has the same one.
    fn unique_id(&mut self, slug: String) -> String {
        let numbered = (1..).map(|number| format!("{slug}-{number}"));
        let id = std::iter::once(slug.clone())
            .chain(numbered)
            .find(|id| !self.ids.contains(id))
            .expect("the sequence of numbers is infinite");
        self.ids.insert(id.clone());
        id
    }

    fn picture(&mut self, file: &str, rest: &mut Parser<'a>) {
        let inner = take_until(&Event::End(TagEnd::Image), rest);
        let alt = plain_text(&inner);
        self.sections.push_text(&alt);
        let alt = escape(&alt);
        match self.links.picture(file) {
            Some(path) => self.html(format!(
                "<img src=\"{}\" alt=\"{alt}\" loading=\"lazy\">",
                escape(&path)
            )),
            None => self.html(alt),
        }
    }

    fn link(&mut self, to: &str, rest: &mut Parser<'a>) {
        if to.starts_with('#') || to.starts_with("https://") || to.starts_with("http://") {
            self.html(format!("<a href=\"{}\">", escape(to)));
            return self.link_ends.push("</a>".into());
        }
        let (file, anchor) = to
            .split_once('#')
            .map_or((to, None), |(file, anchor)| (file, Some(anchor)));
        let inner = take_until(&Event::End(TagEnd::Link), rest);
        let link_text = plain_text(&inner);
        self.sections.push_text(if link_text == file {
            self.links.page(file).map_or(file, |(title, _)| title)
        } else {
            &link_text
        });
        match self.links.page(file) {
            Some((title, path)) => {
                let anchor = anchor
                    .map(|anchor| format!("#{anchor}"))
                    .unwrap_or_default();
                self.html(format!(
                    "<a href=\"{}\">",
                    escape(&format!("{path}{anchor}"))
                ));
                // Links that show a file name show the title of the page instead.
                if link_text == file {
                    self.html(escape(title));
                } else {
                    self.out.extend(inner);
                }
                self.html("</a>");
            }
            // The site has no page for this file of the repository: show its path.
            None => {
                let path = file.trim_start_matches("../");
                if path.contains(&link_text) {
                    self.html(format!("<code>{}</code>", escape(path)));
                } else {
                    self.out.extend(inner);
                    self.html(format!(" (<code>{}</code>)", escape(path)));
                }
            }
        }
    }

    fn listing(&mut self, kind: &CodeBlockKind<'_>, rest: &mut Parser<'a>) {
        self.listings += 1;
        let language = match kind {
            CodeBlockKind::Fenced(language) => &**language,
            CodeBlockKind::Indented => "",
        };
        let label = if matches!(language, "sh" | "console") {
            "Commands"
        } else {
            "Listing"
        };
        let label = escape(&format!("{label} {}: {}", self.listings, self.heading));
        let inner = take_until(&Event::End(TagEnd::CodeBlock), rest);
        let code = text_of(&inner);
        self.sections.push_text(&code);
        self.sections.push_space();
        let code = render_listing(language, &code);
        self.html(format!(
            "<div class=\"listing\"><pre tabindex=\"0\" role=\"group\" aria-label=\"{label}\"><code>{code}</code></pre></div>\n"
        ));
    }

    fn table(&mut self, columns: Vec<Alignment>) {
        self.tables += 1;
        self.columns = columns;
        let label = escape(&format!("Table {}: {}", self.tables, self.heading));
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

/// Events before `end`; consumes `end`.
fn take_until<'a>(end: &Event<'_>, rest: &mut Parser<'a>) -> Vec<Event<'a>> {
    let inner = rest.by_ref().take_while(|event| event != end);
    inner.map(without_html).collect()
}

fn without_html(event: Event<'_>) -> Event<'_> {
    match event {
        Event::Html(text) | Event::InlineHtml(text) => Event::Text(text),
        other => other,
    }
}

/// The text of events, without spaces around it.
fn plain_text(events: &[Event<'_>]) -> String {
    text_of(events).trim().to_owned()
}

fn text_of(events: &[Event<'_>]) -> String {
    let texts = events.iter().map(|event| match event {
        Event::Text(text) | Event::Code(text) => text,
        Event::SoftBreak | Event::HardBreak | Event::End(TagEnd::Paragraph) => " ",
        _ => "",
    });
    texts.collect()
}

#[cfg(test)]
mod tests;
