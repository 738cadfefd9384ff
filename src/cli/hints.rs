//! Better messages for common mistakes on the command line.

use std::path::Path;

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use wgray_image::sanitize::escape_control;

/// Options of other renderers, and the equivalent options of wgray.
const OPTIONS: [(&str, &str); 19] = [
    ("--width", "--size WIDTHxHEIGHT"),
    ("--height", "--size WIDTHxHEIGHT"),
    ("--resolution", "--size WIDTHxHEIGHT"),
    ("--res", "--size WIDTHxHEIGHT"),
    ("--bounces", "--max-depth N"),
    ("--depth", "--max-depth N"),
    ("--cpu", "--device cpu"),
    ("--gpu", "--device gpu"),
    ("--resolution-x", "--size WIDTHxHEIGHT"),
    ("-s", "--size WIDTHxHEIGHT' or '--spp N"),
    ("-w", "--size WIDTHxHEIGHT"),
    ("-n", "--spp N"),
    ("-r", "--size WIDTHxHEIGHT"),
    ("--transparent", "--background none"),
    ("--film-transparent", "--background none"),
    ("--hdri", "--environment FILE.hdr"),
    ("--hdr", "--environment FILE.hdr"),
    ("--envmap", "--environment FILE.hdr"),
    ("--out", "--output FILE"),
];

/// Extensions that suggest an omitted subcommand `render`.
const SCENE_EXTENSIONS: [&str; 7] = ["toml", "json", "gltf", "glb", "obj", "ply", "stl"];

/// Maximum length of a quoted argument, in characters.
const MAX_WORD_LEN: usize = 200;

/// Adds a hint to the error, and escapes and shortens quoted arguments.
pub fn improve(mut error: clap::Error) -> clap::Error {
    if let Some(hint) = hint(&error) {
        error.remove(ContextKind::SuggestedArg);
        error.remove(ContextKind::SuggestedSubcommand);
        error.insert(
            ContextKind::Suggested,
            ContextValue::StyledStrs(vec![StyledStr::from(hint)]),
        );
    }
    for kind in [
        ContextKind::InvalidArg,
        ContextKind::InvalidSubcommand,
        ContextKind::InvalidValue,
    ] {
        let Some(ContextValue::String(word)) = error.get(kind) else {
            continue;
        };
        let escaped = escape_control(word);
        let quoted = match escaped.chars().count() {
            0..=MAX_WORD_LEN => escaped.into_owned(),
            _ => escaped.chars().take(MAX_WORD_LEN).chain("...".chars()).collect(),
        };
        if quoted != *word {
            error.insert(kind, ContextValue::String(quoted));
            error.remove(ContextKind::Suggested); // the suggestion repeats the unescaped argument
        }
    }
    error
}

fn hint(error: &clap::Error) -> Option<String> {
    let word = |kind| match error.get(kind) {
        Some(ContextValue::String(word)) => Some(word.as_str()),
        _ => None,
    };
    match error.kind() {
        ErrorKind::UnknownArgument => {
            let word = word(ContextKind::InvalidArg)?;
            let (_, option) = OPTIONS.into_iter().find(|(name, _)| *name == word)?;
            Some(match option.split_once("; ") {
                Some((option, reason)) => format!("use '{option}'; {reason}"),
                None => format!("use '{option}'"),
            })
        }
        ErrorKind::InvalidSubcommand => {
            let word = word(ContextKind::InvalidSubcommand)?;
            let extension = Path::new(word).extension()?.to_str()?.to_lowercase();
            SCENE_EXTENSIONS
                .contains(&extension.as_str())
                .then(|| format!("to render it, use 'wgray render {word}'"))
        }
        _ => None,
    }
}
