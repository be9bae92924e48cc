//! Words that visitors search for, with words of the documentation for the same subject. A test checks that the documentation
//! has all of the latter.

/// A searched word and the words that are searched beside it. Forms of a word, such as its plural, need no entry.
pub(super) const SYNONYMS: &[(&str, &[&str])] = &[
    ("ban", &["disqualify", "disqualification", "exclude"]),
    ("cheat", &["disqualify", "disqualification", "security"]),
    ("disqualify", &["disqualification"]),
    ("disqualification", &["disqualify"]),
    ("kick", &["disqualify", "disqualification"]),
    ("leaderboard", &["board"]),
    ("scoreboard", &["board"]),
    ("ranking", &["board"]),
    ("table", &["standings"]),
    ("league", &["tournament", "standings"]),
    ("match", &["game"]),
    ("bracket", &["tournament", "pairings"]),
    ("submit", &["submission", "upload"]),
    ("submission", &["submit", "upload"]),
    ("upload", &["submit", "submission"]),
    ("deadline", &["cutoff"]),
    ("quota", &["limit"]),
    ("limit", &["quota"]),
    ("cuda", &["gpu"]),
    ("nvidia", &["gpu"]),
    ("hardware", &["cpu", "gpu", "memory"]),
    ("ram", &["memory"]),
    ("cores", &["cpu"]),
    ("processor", &["cpu"]),
    ("internet", &["network"]),
    ("latency", &["answer", "time"]),
    ("timeout", &["limit", "time"]),
    ("pip", &["packages"]),
    ("libraries", &["packages"]),
    ("dependencies", &["packages"]),
    ("docker", &["image", "container"]),
    ("dockerfile", &["image", "container"]),
    ("login", &["sign", "token"]),
    ("signup", &["registration", "invitation"]),
    ("register", &["registration"]),
    ("registration", &["register"]),
    ("password", &["sign", "token"]),
    ("key", &["token"]),
    ("secret", &["token"]),
    ("account", &["user"]),
    ("group", &["team"]),
    ("admin", &["organiser"]),
    ("administrator", &["organiser"]),
    ("organizer", &["organiser"]),
    ("install", &["installation"]),
    ("setup", &["install", "installing"]),
    ("deploy", &["install", "installing"]),
    ("hosting", &["install", "installing"]),
    ("update", &["upgrade"]),
    ("restore", &["backup"]),
    ("settings", &["configuration"]),
    ("config", &["configuration"]),
    ("options", &["configuration"]),
    ("metrics", &["monitoring"]),
    ("prometheus", &["metrics", "monitoring"]),
    ("cluster", &["workers"]),
    ("distributed", &["workers", "remote"]),
    ("scale", &["capacity"]),
    ("performance", &["capacity", "time"]),
    ("video", &["replay", "clip"]),
    ("watch", &["replay", "live"]),
    ("recording", &["dataset", "replay"]),
    ("data", &["dataset"]),
    ("download", &["dataset"]),
    ("csv", &["parquet", "dataset"]),
    ("reproduce", &["verify", "verifying"]),
    ("reproducibility", &["verify", "verifying"]),
    ("cite", &["paper"]),
    ("publication", &["paper"]),
    ("reward", &["score", "penalty"]),
    ("points", &["score", "penalty"]),
    ("foul", &["penalty"]),
    ("violation", &["limits", "penalty"]),
    ("noise", &["perturbation"]),
    ("disturbance", &["perturbation"]),
    ("randomization", &["perturbation"]),
    ("sim", &["simulator"]),
    ("simulation", &["simulator"]),
    ("mujoco", &["simulator"]),
    ("physics", &["simulator"]),
    ("gym", &["gymnasium"]),
    ("rl", &["train", "python"]),
    ("ppo", &["train"]),
    ("sb3", &["baselines3"]),
    ("kuka", &["robot", "arm"]),
    ("iiwa", &["robot", "arm"]),
    ("striker", &["mallet"]),
    ("paddle", &["mallet"]),
    ("opponent", &["game", "games"]),
    ("endpoint", &["api"]),
    ("rest", &["api"]),
    ("swagger", &["openapi"]),
    ("isolation", &["sandbox"]),
    ("jail", &["sandbox"]),
    ("kubernetes", &["containers"]),
    ("k8s", &["kubernetes", "containers"]),
    ("bug", &["problem"]),
    ("error", &["problem"]),
    ("crash", &["fault"]),
    ("faq", &["start"]),
    ("tutorial", &["start"]),
    ("beginner", &["start"]),
    ("quickstart", &["start"]),
];

#[cfg(test)]
mod tests {
    use super::{
        super::{
            library::LIBRARY,
            words::{stem, words},
        },
        *,
    };
    use std::collections::HashSet;

    #[test]
    fn synonyms_are_words_of_the_documentation() {
        let pages = LIBRARY.iter().flat_map(|group| &group.pages);
        let sections = pages.flat_map(|page| &page.sections);
        let texts = sections.flat_map(|section| [&section.heading, &section.text]);
        let stems: HashSet<String> = texts
            .flat_map(|text| words(text).map(|word| stem(&text[word].to_lowercase())))
            .collect();
        for (word, others) in SYNONYMS {
            for other in *others {
                assert!(stems.contains(&stem(other)), "{word}: {other}");
            }
        }
    }

    #[test]
    fn each_word_has_one_entry() {
        let mut stems = HashSet::new();
        for (word, others) in SYNONYMS {
            assert!(stems.insert(stem(word)), "{word}");
            assert!(
                others.iter().all(|other| stem(other) != stem(word)),
                "{word}"
            );
        }
    }
}
