//! Extracts secrets and invitation links from text as people copy it: with quotes, a full stop, line breaks of a mail program, or
//! inside the URL of a link scanner.

use percent_encoding::percent_decode_str;

/// Prefixes of all secrets.
const PREFIX: &str = "fo_";

/// Hexadecimal digits of a secret.
const DIGITS: usize = 64;

/// The secret in a text that may have something around it, or the trimmed text if there is none. A secret that is broken into lines is not
/// found; see [`InvitationLink`].
#[must_use]
pub fn extract_secret(text: &str) -> &str {
    let found = text.match_indices(PREFIX).find_map(|(start, _)| {
        let rest = &text[start + PREFIX.len()..];
        let (kind, after_kind) = rest.split_once('_')?;
        let is_kind = !kind.is_empty() && kind.bytes().all(|byte| byte.is_ascii_lowercase());
        let digits = after_kind.get(..DIGITS)?;
        let is_longer = after_kind[DIGITS..].starts_with(|c: char| c.is_ascii_alphanumeric());
        let len = PREFIX.len() + kind.len() + 1 + DIGITS;
        (is_kind && is_hex(digits) && !is_longer).then(|| &text[start..start + len])
    });
    found.unwrap_or_else(|| text.trim())
}

fn is_hex(text: &str) -> bool {
    text.bytes()
        .all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// An invitation link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InvitationLink {
    /// The server's address, if the link has one.
    pub server: Option<String>,
    /// The invitation's code.
    pub code: String,
}

impl InvitationLink {
    /// Finds the link, or the code alone, in a text; `None` if there is none.
    #[must_use]
    pub fn find(text: &str) -> Option<Self> {
        let plain = without_wrapping(text);
        // A link scanner has the link as a parameter, possibly behind another scanner.
        let once = percent_decode_str(&plain).decode_utf8_lossy();
        let twice = percent_decode_str(&once).decode_utf8_lossy();
        let found = [plain.as_str(), &once, &twice].map(Self::find_plain);
        // An encoded link has a readable code, but no readable server.
        let with_server = found.iter().flatten().find(|link| link.server.is_some());
        with_server.or(found[0].as_ref()).cloned()
    }

    fn find_plain(text: &str) -> Option<Self> {
        const CODE_PREFIX: &str = "fo_invite_";
        let start = text.find(CODE_PREFIX)?;
        let rest = &text[start + CODE_PREFIX.len()..];
        let digits_len = rest
            .find(|c: char| !c.is_ascii_alphanumeric())
            .unwrap_or(rest.len());
        let code = &text[start..start + CODE_PREFIX.len() + digits_len];
        let server = text[..start].strip_suffix("/join/").and_then(|before| {
            let scheme = before.rfind("https://").or_else(|| before.rfind("http://"));
            scheme.map(|scheme| before[scheme..].to_owned())
        });
        (digits_len > 0).then(|| Self {
            server,
            code: code.to_owned(),
        })
    }
}

/// The text without line breaks that mail programs add, marks of quoted lines, and invisible characters.
fn without_wrapping(text: &str) -> String {
    let is_invisible = |c| {
        matches!(
            c,
            '\u{ad}' | '\u{200b}'..='\u{200f}' | '\u{2060}' | '\u{feff}'
        )
    };
    let mut plain = String::with_capacity(text.len());
    for line in text.lines() {
        let line = line.trim_start_matches(['>', ' ', '\t']).trim_end();
        // The soft line break of quoted-printable mails.
        let line = line.strip_suffix('=').unwrap_or(line);
        plain.extend(line.chars().filter(|c| !is_invisible(*c)));
    }
    // Quoted-printable mails may escape the underscore, and JSON the slash.
    plain.replace("=5F", "_").replace("\\/", "/")
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEX: &str = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

    #[test]
    fn invitation_links_are_found_in_every_form() {
        let code = format!("fo_invite_{HEX}");
        let (first, last) = code.split_at(40);
        let link = format!("https://faceoff.example.org/join/{code}");
        for text in [
            link.clone(),
            format!("  {link}\n"),
            format!("<{link}>"),
            format!("\"{link}\""),
            format!("“{link}”"),
            format!("({link})."),
            format!("Join us: {link}, it is valid for a week!"),
            format!("[Join]({link})"),
            format!("{link}/"),
            format!("{link}?utm_source=mail#top"),
            format!("https://faceoff.example.org/join/{first}\n{last}"),
            format!("> https://faceoff.example.org/join/{first}=\r\n> {last}"),
            format!("{link}\u{200b}"),
            format!("\u{feff}{link}"),
            link.replace("fo_invite_", "fo=5Finvite=5F"),
            link.replace('/', "\\/"),
            format!(
                "https://eur01.safelinks.protection.outlook.com/?url=https%3A%2F%2Ffaceoff.example.org%2Fjoin%2F{code}&data=05"
            ),
            format!("https://www.google.com/url?q={link}&sa=D"),
            format!("https://urldefense.com/v3/__{link}__;!!abc$"),
            format!(
                "https://scan.example/?u=https%253A%252F%252Ffaceoff.example.org%252Fjoin%252F{code}"
            ),
        ] {
            let found = InvitationLink::find(&text).unwrap_or_else(|| panic!("{text:?}"));
            let expected = Some("https://faceoff.example.org");
            assert_eq!(found.server.as_deref(), expected, "{text:?}");
            assert_eq!(found.code, code, "{text:?}");
        }
        for text in [code.clone(), format!("/join/{code}"), format!("`{code}`,")] {
            let found = InvitationLink::find(&text).unwrap_or_else(|| panic!("{text:?}"));
            assert_eq!((found.server, &found.code), (None, &code), "{text:?}");
        }
        for text in [
            "",
            "https://faceoff.example.org/",
            "fo_team_abc",
            "fo_invite_",
        ] {
            assert_eq!(InvitationLink::find(text), None, "{text:?}");
        }
    }

    #[test]
    fn secrets_are_found_in_every_form() {
        for kind in ["team", "person", "admin", "session", "invite"] {
            let secret = format!("fo_{kind}_{HEX}");
            for text in [
                secret.clone(),
                format!(" {secret}\r\n"),
                format!("\"{secret}\""),
                format!("Bearer {secret}"),
                format!("Authorization: Bearer {secret}"),
                format!("token {secret}"),
                format!("FACEOFF_TOKEN='{secret}'"),
                format!("\u{feff}{secret}"),
                format!("<{secret}>."),
            ] {
                assert_eq!(extract_secret(&text), secret, "{text:?}");
            }
        }
        for (text, expected) in [
            (" fo_unknown ", "fo_unknown"),
            ("fo_team_123", "fo_team_123"),
            ("fo_", "fo_"),
            ("größer fo_team_ö", "größer fo_team_ö"),
        ] {
            assert_eq!(extract_secret(text), expected, "{text:?}");
        }
        let longer = format!("fo_team_{HEX}0");
        assert_eq!(
            extract_secret(&longer),
            longer,
            "no other secret is made of it"
        );
    }
}
