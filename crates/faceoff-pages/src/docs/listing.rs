//! Code of a listing as HTML: comments, strings, numbers, keywords and keys with a class each, and prompts apart from their
//! commands. It knows no grammar: what it does not recognise has no class.

use super::escape::escape;

/// The prompt of a command; other lines of a session are output.
const PROMPT: &str = "$ ";

/// How a language writes the tokens that are coloured.
struct Language {
    comment: &'static str,
    /// Delimiters of strings, long ones first.
    strings: &'static [&'static str],
    /// Delimiter of strings without escapes.
    raw_string: Option<char>,
    keywords: &'static [&'static str],
    /// The character after a key; `None` if keys are not coloured.
    key_end: Option<char>,
    has_numbers: bool,
    /// A comment begins after a space only, and strings may have several lines.
    is_shell: bool,
}

/// The base of the languages below, which change some fields.
const DEFAULTS: Language = Language {
    comment: "#",
    strings: &["\"", "'"],
    raw_string: Some('\''),
    keywords: &[],
    key_end: None,
    has_numbers: true,
    is_shell: false,
};
const SHELL: Language = Language {
    keywords: &[
        "if", "then", "elif", "else", "fi", "for", "while", "do", "done", "case", "esac", "export",
    ],
    has_numbers: false,
    is_shell: true,
    ..DEFAULTS
};
const TOML: Language = Language {
    strings: &["\"\"\"", "'''", "\"", "'"],
    keywords: &["true", "false"],
    key_end: Some('='),
    ..DEFAULTS
};
const JSON: Language = Language {
    comment: "//",
    strings: &["\""],
    keywords: &["true", "false", "null"],
    key_end: Some(':'),
    ..DEFAULTS
};
const YAML: Language = Language {
    keywords: &["true", "false"],
    ..DEFAULTS
};
const PYTHON: Language = Language {
    strings: &["\"\"\"", "'''", "\"", "'"],
    raw_string: None,
    keywords: &[
        "and", "as", "assert", "break", "class", "continue", "def", "elif", "else", "except",
        "False", "finally", "for", "from", "if", "import", "in", "is", "lambda", "None", "not",
        "or", "pass", "raise", "return", "True", "try", "while", "with", "yield",
    ],
    ..DEFAULTS
};
const RUST: Language = Language {
    comment: "//",
    // An apostrophe also begins a lifetime.
    strings: &["\""],
    raw_string: None,
    keywords: &[
        "as", "async", "await", "const", "else", "enum", "false", "fn", "for", "if", "impl", "in",
        "let", "loop", "match", "mod", "move", "mut", "pub", "ref", "return", "self", "Self",
        "static", "struct", "trait", "true", "type", "use", "where", "while",
    ],
    ..DEFAULTS
};

/// The HTML of a listing. `language`: the word after its fence.
pub(super) fn render_listing(language: &str, code: &str) -> String {
    match Language::named(language) {
        Some(shell) if language == "console" => render_session(shell, code),
        Some(language) => colour(language, code),
        None => escape(code),
    }
}

/// Commands and their output.
fn render_session(shell: &Language, code: &str) -> String {
    let lines = code.split_inclusive('\n').map(|line| {
        let Some(command) = line.strip_prefix(PROMPT) else {
            return escape(line);
        };
        let (command, end) = command
            .strip_suffix('\n')
            .map_or((command, ""), |command| (command, "\n"));
        let command = colour(shell, command);
        format!(
            "<span class=\"prompt\">{PROMPT}</span><span class=\"command\">{command}</span>{end}"
        )
    });
    lines.collect()
}

/// The HTML of code, with a span of a class around each token that is coloured.
fn colour(language: &Language, code: &str) -> String {
    let mut out = String::with_capacity(code.len() * 3 / 2);
    // Up to `done` the code is written; up to `position` it is read.
    let (mut done, mut position) = (0, 0);
    while position < code.len() {
        let (length, class) = language.token(code, position);
        let end = position + length;
        if let Some(class) = class {
            out.push_str(&escape(&code[done..position]));
            let token = escape(&code[position..end]);
            out.push_str(&format!("<span class=\"code-{class}\">{token}</span>"));
            done = end;
        }
        position = end;
    }
    out.push_str(&escape(&code[done..]));
    out
}

impl Language {
    /// The language by the word after the fence of a Markdown listing.
    fn named(name: &str) -> Option<&'static Self> {
        Some(match name {
            "sh" | "console" => &SHELL,
            "toml" => &TOML,
            "json" => &JSON,
            "yaml" => &YAML,
            "python" => &PYTHON,
            "rust" => &RUST,
            _ => return None,
        })
    }

    /// Length in bytes and class of the token at `position`, which is before the end of the code.
    fn token(&self, code: &str, position: usize) -> (usize, Option<&'static str>) {
        let (before, rest) = code.split_at(position);
        let follows_space = before.is_empty() || before.ends_with(char::is_whitespace);
        if rest.starts_with(self.comment) && (follows_space || !self.is_shell) {
            return (rest.find('\n').unwrap_or(rest.len()), Some("comment"));
        }
        if let Some(length) = self.string(rest) {
            let is_key = self.is_key(before, &rest[length..]);
            return (length, Some(if is_key { "key" } else { "string" }));
        }
        let first = rest.chars().next().expect("the position is before the end");
        if !is_of_word(first) {
            return (first.len_utf8(), None);
        }
        if first.is_ascii_digit() {
            let end = rest.find(|c| !is_of_word(c) && c != '.');
            return (
                end.unwrap_or(rest.len()),
                self.has_numbers.then_some("number"),
            );
        }
        let length = rest.find(|c| !is_of_word(c)).unwrap_or(rest.len());
        let (word, after) = rest.split_at(length);
        let is_keyword = self.keywords.contains(&word) && self.may_have_keyword(before);
        let class = if is_keyword {
            Some("keyword")
        } else {
            self.is_key(before, after).then_some("key")
        };
        (length, class)
    }

    /// Length of the string at the beginning; `None` without one, or if it has no end.
    fn string(&self, rest: &str) -> Option<usize> {
        let mut delimiters = self.strings.iter();
        let delimiter = delimiters.find(|delimiter| rest.starts_with(**delimiter))?;
        let has_lines = self.is_shell || delimiter.len() > 1;
        let has_escapes = self
            .raw_string
            .is_none_or(|raw| !delimiter.starts_with(raw));
        let mut end = delimiter.len();
        while !rest[end..].starts_with(delimiter) {
            let c = rest[end..].chars().next()?;
            if c == '\n' && !has_lines {
                return None;
            }
            end += c.len_utf8();
            if c == '\\' && has_escapes {
                end += rest[end..].chars().next()?.len_utf8();
            }
        }
        Some(end + delimiter.len())
    }

    /// Is the token between the texts `before` and `after` a key, or a part of a key such as `a.b`?
    fn is_key(&self, before: &str, after: &str) -> bool {
        match self.key_end {
            Some(':') => after.trim_start().starts_with(':'),
            Some(end) => {
                let line = before.rsplit('\n').next().unwrap_or_default();
                let after = after.trim_start_matches(|c| is_of_word(c) || " .-".contains(c));
                after.starts_with(if line.starts_with('[') { ']' } else { end })
            }
            None => false,
        }
    }

    /// In a shell, a keyword stands where a command could.
    fn may_have_keyword(&self, before: &str) -> bool {
        let before = before.trim_end_matches([' ', '\t']);
        !self.is_shell || before.is_empty() || before.ends_with(['\n', ';', '|', '&'])
    }
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The coloured tokens with their classes.
    fn tokens(language: &str, code: &str) -> Vec<String> {
        let html = render_listing(language, code);
        let spans = html.split("<span class=\"").skip(1).map(|span| {
            let (class, rest) = span.split_once("\">").unwrap();
            let (token, _) = rest.split_once("</span>").unwrap();
            let token = token.replace("&#34;", "\"").replace("&#39;", "'");
            format!("{} {token}", class.trim_start_matches("code-"))
        });
        spans.collect()
    }

    #[test]
    fn tokens_of_each_language_have_classes() {
        for (language, code, expected) in [
            (
                "sh",
                "for f in *.md; do\n  echo \"a # b\" 'c\nd' 12 # it's\ndone x#y do",
                &[
                    "keyword for",
                    "keyword do",
                    "string \"a # b\"",
                    "string 'c\nd'",
                    "comment # it's",
                    "keyword done",
                ][..],
            ),
            (
                "toml",
                "[a.b]   # no key = here\nc = { d = 1.5 }\ne = [\"f\", true]",
                &[
                    "key a",
                    "key b",
                    "comment # no key = here",
                    "key c",
                    "key d",
                    "number 1.5",
                    "key e",
                    "string \"f\"",
                    "keyword true",
                ],
            ),
            (
                "json",
                r#"{"a": ["b:", -2e3, null], "c\"d" : …}"#,
                &[
                    "key \"a\"",
                    "string \"b:\"",
                    "number 2e3",
                    "keyword null",
                    r#"key "c\"d""#,
                ],
            ),
            (
                "python",
                "def f(x1):\n  return '''it\n's''' + 'a' # \"b\"\nisnot = \"open\n",
                &[
                    "keyword def",
                    "keyword return",
                    "string '''it\n's'''",
                    "string 'a'",
                    "comment # \"b\"",
                ],
            ),
            (
                "rust",
                "fn f<'a>(x: &'a str) -> u8 { 7 } // \"c\"",
                &["keyword fn", "number 7", "comment // \"c\""],
            ),
            ("yaml", "image: \"a\" # b", &["string \"a\"", "comment # b"]),
            ("", "# \"plain\" 1", &[]),
        ] {
            assert_eq!(tokens(language, code), expected, "{language}");
        }
    }

    #[test]
    fn code_is_complete_and_escaped() {
        let code = "a < b && 'c>' # é \"\n\t… \\";
        for language in [
            "sh", "toml", "json", "python", "rust", "yaml", "console", "",
        ] {
            let html = render_listing(language, code);
            let text: String = html
                .split('<')
                .map(|part| part.split_once('>').map_or(part, |(_, text)| text))
                .collect();
            assert_eq!(text, escape(code), "{language}");
        }
    }

    #[test]
    fn prompts_are_apart_from_their_commands() {
        assert_eq!(
            render_listing("console", "$ faceoff whoami # me\nAda & co\n$ ls\n"),
            "<span class=\"prompt\">$ </span><span class=\"command\">faceoff whoami \
             <span class=\"code-comment\"># me</span></span>\nAda &#38; co\n\
             <span class=\"prompt\">$ </span><span class=\"command\">ls</span>\n"
        );
    }
}
