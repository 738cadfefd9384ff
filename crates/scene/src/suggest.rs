//! Suggestions for misspelled names and keys.

use std::cell::Cell;

use super::key_path::cut;
use super::key_path::list;

/// Maximum length in bytes of a compared name. Longer names are skipped, because comparison time is proportional to the
/// product of both lengths.
const MAX_LEN: usize = 64;

/// Minimum length in bytes of an abbreviation.
const MIN_START_LEN: usize = 3;

/// Returns the most similar name, if it is similar enough.
fn closest<'a>(misspelled: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if misspelled.len() > MAX_LEN {
        return None;
    }
    let similar = names.into_iter().filter(|name| name.len() <= MAX_LEN).map(|name| {
        let (a, b) = (misspelled.to_lowercase(), name.to_lowercase());
        (strsim::damerau_levenshtein(&a, &b), name)
    });
    // One edit is allowed for every three letters: "fovv" is similar to "fov", but "red" is not similar to "blue".
    let limit = |name: &str| misspelled.chars().count().max(name.chars().count()).div_ceil(3);
    let similar = similar.filter(|(edits, name)| {
        // "pos" is short for "position".
        let is_abbreviation =
            misspelled.len() >= MIN_START_LEN && name.to_lowercase().starts_with(&misspelled.to_lowercase());
        is_abbreviation || (*edits <= limit(name) && *edits < name.chars().count())
    });
    similar.min_by_key(|(edits, _)| *edits).map(|(_, name)| name)
}

/// Returns `; did you mean "NAME"?`, or nothing if no name is similar.
pub(super) fn hint<'a>(misspelled: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    closest(misspelled, names).map_or_else(String::new, |name| format!("; did you mean {name:?}?"))
}

/// Maximum number of searches: a scene may have 100,000 materials and as many unknown names.
const MAX_SEARCHES: usize = 40;

/// Messages about unknown names, with a limited number of searches.
#[derive(Debug, Default)]
pub(super) struct Suggestions(Cell<usize>);

impl Suggestions {
    /// Returns the message about an unknown name; the first [`MAX_SEARCHES`] messages suggest or list available names.
    pub fn unknown<'a>(&self, kind: &str, misspelled: &str, names: impl Iterator<Item = &'a str> + Clone) -> String {
        let searches = self.0.get();
        self.0.set(searches.saturating_add(1));
        match searches < MAX_SEARCHES {
            true => unknown(kind, misspelled, names),
            false => format!("there is no {kind} {:?}", cut(misspelled)),
        }
    }
}

/// Returns the message about an unknown name, with the most similar name or a list of the available names.
pub(super) fn unknown<'a>(kind: &str, misspelled: &str, names: impl Iterator<Item = &'a str> + Clone) -> String {
    let suggestion = match hint(misspelled, names.clone()) {
        hint if !hint.is_empty() => hint,
        _ if names.clone().next().is_none() => "; the scene has none".to_owned(),
        _ => format!("; the scene has {}", list(names)),
    };
    format!("there is no {kind} {:?}{suggestion}", cut(misspelled))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn similar_names_are_suggested_and_others_are_not() {
        let names = ["yellow", "red", "fov", "look_at"];
        for (misspelled, expected) in [
            ("yellwo", Some("yellow")),
            ("Yellow", Some("yellow")),
            ("fovv", Some("fov")),
            ("lookat", Some("look_at")),
            ("ofv", Some("fov")),
            ("rde", Some("red")),
            ("yel", Some("yellow")),
            ("ye", None),
            ("blue", None),
            ("x", None),
            ("", None),
        ] {
            assert_eq!(closest(misspelled, names), expected, "{misspelled}");
        }
        assert_eq!(closest(&"y".repeat(1000), names), None);
    }

    #[test]
    fn messages_about_unknown_names_suggest_or_list_available_names() {
        let message = |misspelled, names: &[&'static str]| unknown("material", misspelled, names.iter().copied());
        assert_eq!(message("a", &[]), "there is no material \"a\"; the scene has none");
        assert_eq!(
            message("yellwo", &["red", "yellow"]),
            "there is no material \"yellwo\"; did you mean \"yellow\"?"
        );
        assert_eq!(
            message("blue", &["red", "yellow"]),
            "there is no material \"blue\"; the scene has \"red\", \"yellow\""
        );
    }
}
