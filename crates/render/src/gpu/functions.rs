//! Locations of functions in a WGSL text, found without a parser because the text may contain errors.

use std::ops::Range;

/// A function, with byte offsets.
pub struct FunctionText<'a> {
    /// Name.
    pub name: &'a str,
    /// Offset of `fn`.
    pub start: usize,
    /// Return type as written in the text; empty if the function returns nothing.
    pub result: &'a str,
    /// The body, including both braces.
    pub body: Range<usize>,
}

/// Returns the functions up to the first unmatched brace.
pub fn functions(text: &str) -> Vec<FunctionText<'_>> {
    let code = without_comments(text);
    let mut found = Vec::new();
    let mut offset = 0;
    while let Some(start) = next_word(&code, offset, "fn") {
        let name = text[start + 2..].trim_start();
        let name = &name[..name
            .find(|c: char| !c.is_alphanumeric() && c != '_')
            .unwrap_or(name.len())];
        let Some(open) = code[start..].find('{').map(|i| start + i) else {
            break;
        };
        let Some(close) = closing(&code, open) else { break };
        let head = &code[start..open];
        let result = head.rfind("->").map_or("", |arrow| &text[start + arrow + 2..open]);
        // The attributes of a result precede the type.
        let result = result.rsplit(')').next().unwrap_or_default().trim();
        found.push(FunctionText {
            name,
            start,
            result,
            body: open..close + 1,
        });
        offset = close + 1;
    }
    found
}

/// Blanks out comments; byte offsets do not change.
pub fn without_comments(text: &str) -> String {
    let mut code = text.as_bytes().to_vec();
    let mut i = 0;
    while i < code.len() {
        let rest = &text.as_bytes()[i..];
        let length = if rest.starts_with(b"//") {
            rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len())
        } else if rest.starts_with(b"/*") {
            let end = rest.windows(2).skip(2).position(|pair| pair == b"*/");
            end.map_or(rest.len(), |end| end + 4)
        } else {
            i += 1;
            continue;
        };
        for byte in &mut code[i..i + length] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
        i += length;
    }
    String::from_utf8(code).unwrap_or_default() // never invalid: only complete characters were replaced
}

/// Returns true if only comments and white space differ.
pub fn is_same_code(a: &str, b: &str) -> bool {
    // WGSL nests block comments, and ends line comments at more characters than `\n`.
    let is_simple =
        |text: &str| !text.contains(['\u{b}', '\u{c}', '\u{85}', '\u{2028}', '\u{2029}']) && !text.contains("/*");
    let code = |text: &str| without_comments(&text.replace('\r', "\n"));
    a == b || (is_simple(a) && is_simple(b) && code(a).split_whitespace().eq(code(b).split_whitespace()))
}

fn next_word(text: &str, start: usize, word: &str) -> Option<usize> {
    let is_name_char = |c: char| c.is_alphanumeric() || c == '_';
    text[start..]
        .match_indices(word)
        .map(|(i, _)| start + i)
        .find(|&i| !text[..i].ends_with(is_name_char) && !text[i + word.len()..].starts_with(is_name_char))
}

/// Returns the closing brace that matches the opening brace at `open`.
fn closing(text: &str, open: usize) -> Option<usize> {
    let mut depth = 0usize;
    for (i, byte) in text.bytes().enumerate().skip(open) {
        match byte {
            b'{' => depth += 1,
            b'}' if depth == 1 => return Some(i),
            b'}' => depth -= 1,
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_are_not_code() {
        let text = "const a: f32 = 0.5; // slider 0..1\nfn f() -> f32 { return a; } // one\n";
        for edited in [
            text.to_owned(),
            format!("// a line\n\n{text}"),
            text.replace("one", "another"),
            text.replace("0..1", "0..2"),
            text.replace("// slider 0..1", ""),
            text.replace("{ return", "{\n    return"),
            text.replace('\n', "\r\n"),
        ] {
            assert!(is_same_code(text, &edited), "{edited}");
        }
        for edited in [
            text.replace("0.5", "0.25"),
            text.replace("fn f", "// fn f"),
            text.replace("one", "one\u{2028}fn g() {}"),
            format!("/* /* */ // */ fn g() {{}}\n{text}"),
            text.replace("return a", "returna"),
        ] {
            assert!(!is_same_code(text, &edited), "{edited}");
        }
    }

    #[test]
    fn braces_and_functions_in_comments_are_ignored() {
        let text = "// fn no() {\nfn one(a: f32) -> vec3f { if a > 1.0 { /* } */ } return v; }\n\
            @compute @workgroup_size(8) /* fn */ fn two(){}\nfn ä() -> @builtin(position) vec4f { } fn open() { {";
        let found = functions(text);
        let parsed: Vec<_> = found
            .iter()
            .map(|f| (f.name, f.result, &text[f.body.clone()]))
            .collect();
        assert_eq!(
            parsed,
            [
                ("one", "vec3f", "{ if a > 1.0 { /* } */ } return v; }"),
                ("two", "", "{}"),
                ("ä", "vec4f", "{ }")
            ]
        );
        assert!(found.iter().all(|f| text[f.start..].starts_with("fn ")));
    }
}
