//! Words of texts and queries, and their stems: the part that the forms of a word share.

use std::ops::Range;

/// Words of questions that say nothing about the subject. A query of these words alone is searched as it is.
const STOP_WORDS: [&str; 62] = [
    "a", "about", "all", "an", "and", "any", "are", "as", "at", "be", "by", "can", "could", "do",
    "does", "for", "from", "get", "has", "have", "how", "i", "if", "in", "into", "is", "it", "its",
    "me", "my", "of", "on", "or", "our", "should", "so", "that", "the", "their", "there", "these",
    "they", "this", "to", "use", "was", "we", "what", "when", "where", "which", "who", "why",
    "will", "with", "work", "works", "would", "you", "your", "s", "t",
];

pub(super) fn is_stop_word(word: &str) -> bool {
    STOP_WORDS.contains(&word)
}

/// Ranges of the words of a text: letters and digits without anything between them.
pub(super) fn words(text: &str) -> impl Iterator<Item = Range<usize>> {
    let mut rest = text.char_indices().peekable();
    std::iter::from_fn(move || {
        let (start, _) = rest.find(|(_, c)| c.is_alphanumeric())?;
        while rest.next_if(|(_, c)| c.is_alphanumeric()).is_some() {}
        let end = rest.peek().map_or(text.len(), |(end, _)| *end);
        Some(start..end)
    })
}

/// Ranges of the parts of a name such as `BoardView` or `Baselines3`; empty for a word without such parts.
pub(super) fn parts(word: &str) -> Vec<Range<usize>> {
    let chars = word.char_indices().zip(word.chars().skip(1));
    let starts: Vec<usize> = chars
        .filter(|((_, c), next)| {
            (c.is_lowercase() && next.is_uppercase()) || (c.is_alphabetic() && next.is_numeric())
        })
        .map(|((index, c), _)| index + c.len_utf8())
        .collect();
    if starts.is_empty() {
        return Vec::new();
    }
    let ends = starts.iter().copied().chain([word.len()]);
    let starts = [0].into_iter().chain(starts.iter().copied());
    starts.zip(ends).map(|(start, end)| start..end).collect()
}

/// The stem of a word in lower case: without plural, `-ing`, `-ed`, `-ion` and a final `e`. It may be no word, and is only
/// compared with other stems.
pub(super) fn stem(word: &str) -> String {
    if word.len() < 3 || !word.bytes().all(|byte| byte.is_ascii_lowercase()) {
        return word.to_owned();
    }
    let mut stem = without_ending(without_plural(word));
    let ends_with =
        |stem: &str, end: char, min_len: usize| stem.len() >= min_len && stem.ends_with(end);
    if ends_with(&stem, 'e', 4) {
        stem.pop();
    }
    // stopp(ing) and stop
    let mut last = stem.bytes().rev();
    if stem.len() >= 4 && last.next() == last.next() {
        stem.pop();
    }
    // polici(es) and policy
    if ends_with(&stem, 'y', 3) && !is_vowel(stem.as_bytes()[stem.len() - 2]) {
        stem.pop();
        stem.push('i');
    }
    stem
}

fn without_plural(word: &str) -> &str {
    let is_singular = word.ends_with("ss")
        || word.ends_with("is")
        // status, but not CPUs
        || (word.ends_with("us") && word.len() >= 5);
    match word.strip_suffix('s') {
        Some(singular) if !is_singular => singular,
        _ => word,
    }
}

fn without_ending(word: &str) -> String {
    if let Some(rest) = word.strip_suffix("ion")
        && rest.len() >= 3
        && rest.ends_with(['s', 't'])
    {
        return rest.to_owned();
    }
    let rest = word.strip_suffix("ing").or_else(|| word.strip_suffix("ed"));
    match rest {
        // Not an ending: speed, string
        Some(rest) if rest.ends_with('e') || !rest.bytes().any(is_vowel) => word.to_owned(),
        // us(ed) and use
        Some(rest) if rest.len() < 3 => format!("{rest}e"),
        Some(rest) => rest.to_owned(),
        None => word.to_owned(),
    }
}

fn is_vowel(byte: u8) -> bool {
    b"aeiouy".contains(&byte)
}

/// Does one typo separate two words: a letter too many, too few or wrong, or two neighbours swapped?
pub(super) fn is_one_typo(a: &str, b: &str) -> bool {
    let (a, b) = (a.as_bytes(), b.as_bytes());
    if a.len().abs_diff(b.len()) > 1 {
        return false;
    }
    // What differs is left after the common beginning and the common end.
    let common_start = a.iter().zip(b).take_while(|(a, b)| a == b).count();
    let (a, b) = (&a[common_start..], &b[common_start..]);
    let pairs = a.iter().rev().zip(b.iter().rev());
    let common_end = pairs.take_while(|(a, b)| a == b).count();
    match (&a[..a.len() - common_end], &b[..b.len() - common_end]) {
        ([_], []) | ([], [_]) | ([_], [_]) => true,
        ([a1, a2], [b1, b2]) => a1 == b2 && a2 == b1,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_of_a_word_have_one_stem() {
        for forms in [
            &["board", "boards"][..],
            &["policy", "policies"],
            &["class", "classes"],
            &["match", "matches", "matched", "matching"],
            &[
                "evaluate",
                "evaluates",
                "evaluated",
                "evaluating",
                "evaluation",
                "evaluations",
            ],
            &["stop", "stops", "stopped", "stopping"],
            &["retry", "retries", "retried", "retrying"],
            &["use", "uses", "used", "using"],
            &["add", "adds", "added", "adding"],
            &["cpu", "cpus"],
            &["queue", "queues", "queued"],
            &["replay", "replays", "replayed"],
            &["kill", "kills", "killed"],
            &["tie", "ties", "tied"],
            &["id", "ids"],
        ] {
            let stems: Vec<String> = forms.iter().map(|form| stem(form)).collect();
            assert!(
                stems.iter().all(|other| *other == stems[0]),
                "{forms:?}: {stems:?}"
            );
        }
    }

    #[test]
    fn other_words_keep_their_stems_apart() {
        for (one, other) in [
            ("speed", "spe"),
            ("string", "str"),
            ("status", "statu"),
            ("seed", "se"),
            ("axis", "ax"),
            ("board", "boat"),
        ] {
            assert_ne!(stem(one), stem(other), "{one} and {other}");
        }
        for word in ["2023", "µm", "ee", "x", "é"] {
            assert_eq!(stem(word), word);
        }
    }

    #[test]
    fn words_and_names_are_split() {
        let text = "joint_vel-limit: ≤ 2.5 µm, BoardView.";
        let split: Vec<&str> = words(text).map(|word| &text[word]).collect();
        assert_eq!(
            split,
            ["joint", "vel", "limit", "2", "5", "µm", "BoardView"]
        );
        let split = |name: &'static str| -> Vec<&str> {
            parts(name).into_iter().map(|part| &name[part]).collect()
        };
        assert_eq!(split("BoardView"), ["Board", "View"]);
        assert_eq!(split("Baselines3"), ["Baselines", "3"]);
        assert_eq!(split("Board"), [""; 0]);
        assert_eq!(split("JSON"), [""; 0]);
    }

    #[test]
    fn one_typo_is_one_letter_or_one_swap() {
        for (word, typo) in [
            ("mallet", "malet"),
            ("mallet", "malllet"),
            ("mallet", "mellet"),
            ("mallet", "mlalet"),
            ("mallet", "mallets"),
        ] {
            assert!(is_one_typo(word, typo) && is_one_typo(typo, word), "{typo}");
        }
        for other in ["mallet", "malte", "wallets", "met", "mlaelt"] {
            assert!(!is_one_typo("mallet", other), "{other}");
        }
    }
}
