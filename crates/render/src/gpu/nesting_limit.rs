//! Nesting limits of shaders: on deeper expressions, naga's recursion would overflow the stack.

use std::ops::Range;

use super::functions::without_comments;

/// Maximum depth of operators, brackets and member accesses.
const MAX_OPERATOR_DEPTH: usize = 1000;
/// Maximum number of `else if` in all enclosing blocks.
const MAX_ELSE_IFS: usize = 400;

/// Returns the location of code that is nested too deeply, and the violated rule.
pub fn too_deep(text: &str) -> Option<(Range<usize>, String)> {
    let code = without_comments(text);
    let bytes = code.as_bytes();
    let violation = |offset: usize, construct: &str, max: usize| {
        Some((
            offset..offset + 1,
            format!("{construct} must be nested at most {max} levels deep here"),
        ))
    };
    let mut depth = 0;
    let mut brackets: Vec<usize> = Vec::new();
    let mut alternatives = vec![0];
    for (offset, byte) in bytes.iter().enumerate() {
        match byte {
            b'(' | b'[' => {
                depth += 1;
                brackets.push(depth);
            }
            b')' | b']' => depth = brackets.pop().unwrap_or(0),
            b',' => depth = brackets.last().copied().unwrap_or(0),
            b'+' | b'-' | b'*' | b'/' | b'%' | b'&' | b'|' | b'^' | b'~' | b'!' | b'<' | b'>' | b'=' => depth += 1,
            b'.' if bytes.get(offset + 1).is_some_and(u8::is_ascii_alphabetic) => depth += 1,
            b';' => (depth, brackets) = (0, Vec::new()),
            b'{' => {
                (depth, brackets) = (0, Vec::new());
                alternatives.push(0);
            }
            b'}' => {
                (depth, brackets) = (0, Vec::new());
                if alternatives.len() > 1 {
                    alternatives.pop();
                }
                let rest = code[offset + 1..].trim_start();
                let is_else_if = rest
                    .strip_prefix("else")
                    .is_some_and(|rest| rest.trim_start().starts_with("if"));
                if let Some(count) = alternatives.last_mut() {
                    *count = if is_else_if { *count + 1 } else { 0 };
                }
                if alternatives.iter().sum::<usize>() > MAX_ELSE_IFS {
                    return violation(offset, "`else if`", MAX_ELSE_IFS);
                }
            }
            _ => {}
        }
        if depth > MAX_OPERATOR_DEPTH {
            return violation(offset, "operators", MAX_OPERATOR_DEPTH);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::compose::Shaders;

    #[test]
    fn built_in_shaders_and_long_flat_code_are_accepted() {
        for (name, text) in Shaders::built_in().files() {
            assert_eq!(too_deep(text), None, "{name}");
        }
        let list = format!("const A = array<f32, 9999>({});", "-(1.0 + 2.5), ".repeat(9999));
        assert_eq!(too_deep(&list), None);
        assert_eq!(
            too_deep(&"fn f() { if a { x = 1; } else { y = 2; } } ".repeat(2000)),
            None
        );
        assert_eq!(too_deep(&"x = (1 + 2) * 3; ".repeat(2000)), None);
        assert_eq!(too_deep(&format!("// {}\n", "+".repeat(9999))), None);
    }

    #[test]
    fn deeply_nested_code_is_rejected() {
        let code = |part: &str, count: usize| format!("fn f() {{ let y = x{}; }}", part.repeat(count));
        for part in ["+x", ".x", "[0]", "<x", "+(x", "-f(x)", "+1.5"] {
            assert_eq!(too_deep(&code(part, 300)), None, "{part}");
            let (range, message) = too_deep(&code(part, 1001)).expect(part);
            assert!(range.start > 500 && message.starts_with("operators must be nested at most 1000 levels deep"));
        }
        let chain = |count: usize| format!("if a {{}} {} else {{}}", "else if b { x(); }\n ".repeat(count));
        assert_eq!(too_deep(&chain(400)), None);
        assert!(too_deep(&chain(401)).is_some());
        // The lengths of nested chains add up.
        let inner = chain(300);
        assert!(too_deep(&format!("{}if c {{ {inner} }}", "if a {} else if b { ".repeat(101))).is_some());
    }
}
