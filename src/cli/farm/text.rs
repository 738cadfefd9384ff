//! Quoting of names and values for shell scripts and YAML.

use std::ffi::OsStr;

use crate::cli::Usage;

/// Returns a value as text that can be written to a script; error messages name it `what`.
pub fn plain(what: &str, value: &OsStr) -> Result<String, Usage> {
    // Line breaks, and characters that YAML excludes.
    let is_excluded =
        |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}' | '\u{feff}' | '\u{fffe}' | '\u{ffff}');
    let text = value.to_str().filter(|text| !text.contains(is_excluded));
    text.map(str::to_owned).ok_or_else(|| {
        Usage(format!(
            "{what}: {value:?}: must be UTF-8 without line breaks or control characters to be written to a script"
        ))
    })
}

/// Quotes a word for a shell, with doubled braces split because Open Job Description would expand them.
pub fn word(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-./:=,@%+".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text.to_owned();
    }
    let (mut quoted, mut before) = (String::from("'"), ' ');
    for c in text.chars() {
        match c {
            '\'' => quoted.push_str(r"'\''"),
            '{' | '}' if c == before => {
                quoted.push_str("''");
                quoted.push(c);
            }
            c => quoted.push(c),
        }
        before = c;
    }
    quoted + "'"
}

/// Quotes a YAML scalar.
pub fn scalar(text: &str) -> String {
    serde_json::Value::from(text).to_string() // every JSON string is valid YAML
}

#[cfg(test)]
mod tests {
    use super::*;

    const ODD: [&str; 14] = [
        "",
        "a b",
        "-x",
        "$HOME",
        "`id`",
        "it's",
        "\"",
        "\\",
        "é",
        "#",
        "!",
        "{{Param.X}}",
        "{{{{a}}}}}",
        "~",
    ];

    #[test]
    fn words_mean_themselves() {
        assert_eq!(word("a/b-c_1.toml"), "a/b-c_1.toml");
        assert_eq!(word("it's"), r"'it'\''s'");
        for text in ODD {
            let word = word(text);
            assert!(!word.contains("{{") && !word.contains("}}"), "{word}");
            #[cfg(unix)]
            {
                let line = format!("printf %s/ {word}");
                let printed = std::process::Command::new("sh").args(["-c", &line]).output().unwrap();
                assert_eq!(String::from_utf8(printed.stdout).unwrap(), format!("{text}/"));
            }
        }
    }

    #[test]
    fn what_a_line_has_no_room_for_is_refused() {
        for text in ODD {
            assert_eq!(plain("x", text.as_ref()).unwrap(), text);
        }
        for text in [
            "a\nb",
            "\t",
            "\r",
            "\u{1b}",
            "\u{7f}",
            "\u{85}",
            "\u{2028}",
            "\u{feff}a",
        ] {
            let message = plain("--define", text.as_ref()).unwrap_err().to_string();
            assert!(
                message.starts_with("--define: \"") && !message.contains(text),
                "{message}"
            );
        }
    }
}
