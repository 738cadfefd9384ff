//! Messages of naga, with source names in place of naga's indices.

use std::error::Error;

use naga::common::wgsl::TypeContext as _;
use naga::front::Typifier;
use naga::front::wgsl::ParseError;
use naga::proc::ResolveContext;
use naga::valid::ValidationError;
use naga::{Function, Module, Span, Type, WithSpan};

use super::compose::Source;
use super::functions::functions;

/// Names of scalar types in naga and in WGSL.
const SCALARS: [(&str, &str); 4] = [
    ("Scalar { kind: Float, width: 4 }", "f32"),
    ("Scalar { kind: Sint, width: 4 }", "i32"),
    ("Scalar { kind: Uint, width: 4 }", "u32"),
    ("Scalar { kind: Bool, width: 1 }", "bool"),
];

/// Returns the message of an error in a module parsed from `text`.
pub fn message(module: &Module, text: &str, error: &ValidationError) -> String {
    let (function, message) = match error {
        ValidationError::Function { handle, name, source } => (
            Some(&module.functions[*handle]),
            format!("in `{name}`: {}", chain(source)),
        ),
        ValidationError::EntryPoint { name, source, .. } => {
            let entry = module.entry_points.iter().find(|entry| entry.name == *name);
            (
                entry.map(|entry| &entry.function),
                format!("in `{name}`: {}", chain(source)),
            )
        }
        error => (None, chain(error)),
    };
    let scalars = SCALARS.iter();
    let message = scalars.fold(message, |message, (debug, name)| message.replace(debug, name));
    let names = Names { module, text, function };
    names.replaced(&message)
}

/// Returns a parse error's location and message.
pub fn parse_message(error: &ParseError, source: &Source) -> (Option<Span>, String) {
    let labels: Vec<(Span, &str)> = error.labels().collect();
    // The location of the wrong value is preferred to the location that explains the error.
    let has_type = |(_, label): &&(Span, &str)| label.starts_with("this expression has type");
    let best = labels.iter().find(has_type).or(labels.first());
    let mut message = without_debug(error.message());
    let label = best.map(|(_, label)| *label).unwrap_or_default();
    if !label.is_empty() && label != "see msg" && !message.contains(label) {
        message += &format!(" ({label})");
    }
    // The previous definition of a name may be in any file.
    let definition = labels
        .iter()
        .find(|(_, label)| label.starts_with("previous definition"));
    if let Some(location) = definition.and_then(|(span, _)| source.place(span.to_range()?.start)) {
        message += &format!("; the other definition is at {location}");
    }
    (best.map(|(span, _)| *span), message)
}

/// Returns a validation error's location.
pub fn location(text: &str, error: &WithSpan<ValidationError>) -> Option<Span> {
    let span = error.spans().map(|(span, _)| *span).last();
    span.or_else(|| match error.as_inner() {
        ValidationError::EntryPoint { name, .. } => {
            let function = functions(text).into_iter().find(|function| function.name == name)?;
            Some(Span::from(function.start..function.start + "fn ".len() + name.len()))
        }
        _ => None,
    })
}

/// Removes the fields of Rust structs, such as `Struct { members: … }`.
fn without_debug(message: &str) -> String {
    match (message.find(" { "), message.rfind('}')) {
        (Some(start), Some(end)) if start < end => [&message[..start], &message[end + 1..]].concat(),
        _ => message.to_string(),
    }
}

/// Returns an error's message with its causes.
pub fn chain(error: &dyn Error) -> String {
    let mut message = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        let cause_message = cause.to_string();
        if !message.ends_with(&cause_message) {
            message.push_str(": ");
            message.push_str(&cause_message);
        }
        source = cause.source();
    }
    message
}

/// Replaces naga's indices by names of a module, and of the function with an error.
struct Names<'a> {
    module: &'a Module,
    text: &'a str,
    function: Option<&'a Function>,
}

impl Names<'_> {
    /// Returns a message with names in place of indices such as `[3]`. The words before an index determine what the
    /// index refers to.
    fn replaced(&self, message: &str) -> String {
        let (mut out, mut rest) = (String::new(), message);
        while let Some(start) = rest.find('[') {
            let index = rest[start + 1..].split(']').next().unwrap_or_default();
            let Ok(i) = index.parse() else {
                out.push_str(&rest[..=start]);
                rest = &rest[start + 1..];
                continue;
            };
            let mut before = &rest[..start];
            rest = &rest[start + index.len() + 2..];
            if let (Some(outer), Some(inner)) = (before.strip_suffix("Some("), rest.strip_prefix(')')) {
                (before, rest) = (outer, inner);
            }
            out.push_str(before);
            if rest.starts_with(" '") {
                out.pop(); // the message contains the name
                continue;
            }
            let is_type = self.function.is_none()
                || before.ends_with("ty: ")
                || before.ends_with("zero value of ")
                || (before.ends_with("type ") && !before.ends_with("Base type "));
            let name = match before {
                _ if before.ends_with("Argument ") => Some(format!("[{i}]")), // the position of the argument
                _ if before.ends_with("Call to ") => self.called(i),
                _ if before.ends_with("Global variable ") || before.ends_with("Bindings for ") => self.global(i),
                _ if before.ends_with("xpression ") && self.function.is_none() => self.constant(i),
                _ if is_type => self.type_at(i),
                _ => self.value(i, !before.ends_with("Expression ")),
            };
            out.push_str(&name.unwrap_or_else(|| "a value".to_string()));
            rest = without_type(rest);
        }
        out + rest
    }

    fn called(&self, i: usize) -> Option<String> {
        let (_, function) = self.module.functions.iter().nth(i)?;
        Some(format!("`{}`", function.name.as_deref()?))
    }

    fn global(&self, i: usize) -> Option<String> {
        let (_, variable) = self.module.global_variables.iter().nth(i)?;
        Some(format!("`{}`", variable.name.as_deref()?))
    }

    fn type_at(&self, i: usize) -> Option<String> {
        let (handle, _) = self.module.types.iter().nth(i)?;
        Some(format!("`{}`", type_name(self.module, handle)))
    }

    fn constant(&self, i: usize) -> Option<String> {
        let (handle, _) = self.module.global_expressions.iter().nth(i)?;
        self.quoted(self.module.global_expressions.get_span(handle))
    }

    /// Returns a value's source text and type.
    fn value(&self, i: usize, with_type: bool) -> Option<String> {
        let function = self.function?;
        let (handle, _) = function.expressions.iter().nth(i)?;
        let quoted = self.quoted(function.expressions.get_span(handle));
        let quoted = quoted.unwrap_or_else(|| "a value".to_string());
        let mut types = Typifier::new();
        let context = ResolveContext::with_locals(self.module, &function.local_variables, &function.arguments);
        if !with_type || types.grow(handle, &function.expressions, &context).is_err() {
            return Some(quoted);
        }
        let mut ty = String::new();
        let written = self.module.to_ctx().write_type_resolution(&types[handle], &mut ty);
        Some(match written {
            Ok(()) => format!("{quoted} (`{ty}`)"),
            Err(_) => quoted,
        })
    }

    fn quoted(&self, span: Span) -> Option<String> {
        let written = self.text.get(span.to_range()?)?;
        (written.len() <= 60 && !written.contains('\n')).then(|| format!("`{written}`"))
    }
}

/// Removes a type in Rust's debug format, ` (of type …)`, from the start.
fn without_type(message: &str) -> &str {
    if !message.starts_with(" (of type ") {
        return message;
    }
    let mut depth = 0;
    let end = message.find(|c| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        c == ')' && depth == 0
    });
    end.map_or(message, |end| &message[end + 1..])
}

pub fn type_name(module: &Module, ty: naga::Handle<Type>) -> String {
    let mut out = String::new();
    let written = module.to_ctx().write_type(ty, &mut out);
    written.map_or_else(|_| "unknown".to_string(), |()| out)
}
