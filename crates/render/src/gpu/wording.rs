//! Messages of naga, rewritten with the names of the source: naga refers to types, values and functions by index.

use std::error::Error;

use naga::common::wgsl::TypeContext as _;
use naga::front::Typifier;
use naga::front::wgsl::ParseError;
use naga::proc::ResolveContext;
use naga::valid::{
    CallError, ComposeError, EntryPointError, ExpressionError, FunctionError, GlobalVariableError, LocalVariableError,
    ValidationError,
};
use naga::{Expression, Function, Handle, Module, Span, Type, TypeInner, WithSpan};

use super::compose::Source;
use super::functions::functions;

/// The message of an error in a module that was parsed from `text`.
pub fn message(module: &Module, text: &str, error: &ValidationError) -> String {
    let words = Naming { module, text };
    match error {
        ValidationError::Function { handle, name, source } => {
            format!("in `{name}`: {}", words.inside(&module.functions[*handle], source))
        }
        ValidationError::EntryPoint { name, source, .. } => {
            let entry = module.entry_points.iter().find(|entry| entry.name == *name);
            match (source, entry) {
                (EntryPointError::Function(source), Some(entry)) => {
                    format!("in `{name}`: {}", words.inside(&entry.function, source))
                }
                _ => format!(
                    "entry point `{name}`: {}",
                    named(&chain(source), |i| words.nth_global(i))
                ),
            }
        }
        ValidationError::Type { name, source, .. } => {
            format!("type `{name}`: {}", named(&chain(source), |i| words.nth_type(i)))
        }
        ValidationError::GlobalVariable {
            handle,
            name,
            source: GlobalVariableError::MissingTypeFlags { .. },
        } => {
            let ty = words.name(module.global_variables[*handle].ty);
            format!("`{name}`: type `{ty}` is not allowed for a variable in this address space")
        }
        ValidationError::GlobalVariable { name, source, .. } => {
            format!("`{name}`: {}", named(&chain(source), |i| words.nth_type(i)))
        }
        ValidationError::Constant { name, source, .. } => format!("`{name}`: {}", chain(source)),
        ValidationError::Override { name, source, .. } => {
            format!(
                "`{name}`: {}",
                named(&chain(source), |i| words.nth_value(&module.global_expressions, i))
            )
        }
        ValidationError::ConstExpression { .. } | ValidationError::ArraySizeError { .. } => {
            named(&chain(error), |i| words.nth_value(&module.global_expressions, i))
        }
        error => named(&chain(error), |i| words.nth_type(i)),
    }
}

/// Returns the location and the message of a parse error.
pub fn parse_message(error: &ParseError, source: &Source) -> (Option<Span>, String) {
    let labels: Vec<(Span, &str)> = error.labels().collect();
    // Prefers the location with the wrong value, not the one that gives the reason.
    let has_type = |(_, label): &&(Span, &str)| label.starts_with("this expression has type");
    let chosen = labels.iter().find(has_type).or(labels.first());
    let said = without_debug(error.message());
    let label = chosen.map(|(_, label)| *label).unwrap_or_default();
    let mut message = match label.is_empty() || label == "see msg" || said.contains(label) {
        true => said,
        false => format!("{said} ({label})"),
    };
    // A name that is defined twice: the other definition may be in any file.
    let other = labels
        .iter()
        .find(|(_, label)| label.starts_with("previous definition"));
    if let Some(place) = other.and_then(|(span, _)| source.place(span.to_range()?.start)) {
        message += &format!("; the other definition is at {place}");
    }
    (chosen.map(|(span, _)| *span), message)
}

/// Returns the location of a validation error.
pub fn place(text: &str, error: &WithSpan<ValidationError>) -> Option<Span> {
    let span = error.spans().map(|(span, _)| *span).last();
    span.or_else(|| match error.as_inner() {
        ValidationError::EntryPoint { name, .. } => {
            let function = functions(text).into_iter().find(|function| function.name == name)?;
            Some(Span::from(function.start..function.start + "fn ".len() + name.len()))
        }
        _ => None,
    })
}

/// A message without what Rust's records hold, `Vector { size: Tri }`.
fn without_debug(message: &str) -> String {
    let mut depth = 0;
    let mut out = String::new();
    for c in message.replace(" { ", "{ ").chars() {
        match c {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            c if depth == 0 => out.push(c),
            _ => {}
        }
    }
    if depth == 0 { out } else { message.to_string() }
}

/// An error's message with those of its causes.
pub fn chain(error: &dyn Error) -> String {
    let mut message = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        let said = cause.to_string();
        if !message.ends_with(&said) {
            message.push_str(": ");
            message.push_str(&said);
        }
        source = cause.source();
    }
    message
}

/// A message with names in place of numbers in brackets.
fn named(message: &str, name: impl Fn(usize) -> Option<String>) -> String {
    let message = without_debug(message);
    let mut out = String::new();
    let mut rest = message.as_str();
    while let Some(start) = rest.find('[') {
        let number = rest[start + 1..].split(']').next().unwrap_or_default();
        let Ok(i) = number.parse() else {
            out.push_str(&rest[..=start]);
            rest = &rest[start + 1..];
            continue;
        };
        out.push_str(&rest[..start]);
        out.push_str(&name(i).unwrap_or_else(|| "a value".to_string()));
        rest = &rest[start + number.len() + 2..];
    }
    out + rest
}

struct Naming<'a> {
    module: &'a Module,
    text: &'a str,
}

impl Naming<'_> {
    /// Returns the message of an error in a function.
    fn inside(&self, function: &Function, error: &FunctionError) -> String {
        let value = |handle: Handle<Expression>| self.value(function, handle);
        let typed =
            |handle: Handle<Expression>| format!("{} of type `{}`", value(handle), self.type_of(function, handle));
        match error {
            FunctionError::InvalidStoreTypes { pointer, value } => format!(
                "{} cannot be stored in {} of type `{}`",
                typed(*value),
                self.value(function, *pointer),
                self.stored_in(function, *pointer)
            ),
            FunctionError::InvalidReturnType {
                expression,
                expected_ty,
            } => match (expression, expected_ty) {
                (Some(value), Some(ty)) => {
                    format!("{} is returned where `{}` is declared", typed(*value), self.name(*ty))
                }
                (Some(value), None) => format!("{} is returned, but no return type is declared", typed(*value)),
                (None, Some(ty)) => format!("not every path returns a `{}`, as declared", self.name(*ty)),
                (None, None) => chain(error),
            },
            FunctionError::InvalidIfType(handle) => format!("the condition {} must be `bool`", typed(*handle)),
            FunctionError::InvalidSwitchType(handle) => {
                format!("the selector of `switch`, {}, must be an integer", typed(*handle))
            }
            FunctionError::LocalVariable { name, source, .. } => match source {
                LocalVariableError::InvalidType(ty) => {
                    format!("`{name}`: type `{}` cannot be that of a variable", self.name(*ty))
                }
                _ => format!("`{name}`: {}", chain(source)),
            },
            FunctionError::InvalidCall {
                function: called,
                error,
            } => {
                let called = self.module.functions[*called].name.as_deref().unwrap_or("a function");
                match error {
                    CallError::ArgumentType {
                        index,
                        required,
                        seen_expression,
                    } => format!(
                        "`{called}`: argument {}, {}, must be `{}`",
                        index + 1,
                        typed(*seen_expression),
                        self.name(*required)
                    ),
                    _ => format!(
                        "`{called}`: {}",
                        named(&chain(error), |i| self.nth_value(&function.expressions, i))
                    ),
                }
            }
            FunctionError::Expression { handle, source } => {
                let types = match source {
                    ExpressionError::InvalidBinaryOperandTypes { lhs_expr, rhs_expr, .. } => Some(format!(
                        "{} and {} are incompatible",
                        typed(*lhs_expr),
                        typed(*rhs_expr)
                    )),
                    ExpressionError::InvalidUnaryOperandType(_, operand) => {
                        Some(format!("{} cannot be the operand", typed(*operand)))
                    }
                    ExpressionError::SelectValuesTypeMismatch { accept, reject } => Some(format!(
                        "the values of `select` must have one type, not `{}` and `{}`",
                        self.inner(reject),
                        self.inner(accept)
                    )),
                    ExpressionError::SelectConditionNotABool { actual } => Some(format!(
                        "the condition of `select` must be `bool`, not `{}`",
                        self.inner(actual)
                    )),
                    ExpressionError::ShiftAmountTooLarge { lhs_type, .. } => {
                        Some(format!("a shift by more bits than `{}` has", self.inner(lhs_type)))
                    }
                    ExpressionError::Compose(ComposeError::ComponentType { index }) => {
                        Some(format!("value {} has a type that does not fit", index + 1))
                    }
                    _ => None,
                };
                let why = types.unwrap_or_else(|| {
                    named(&chain(source), |i| match source {
                        ExpressionError::Compose(_) | ExpressionError::InvalidZeroValue(_) => self.nth_type(i),
                        _ => self.nth_value(&function.expressions, i),
                    })
                });
                format!("{}: {why}", value(*handle))
            }
            error => named(&chain(error), |i| self.nth_value(&function.expressions, i)),
        }
    }

    /// A value as it is written in the source, in backquotes.
    fn value(&self, function: &Function, handle: Handle<Expression>) -> String {
        self.quoted(function.expressions.get_span(handle))
    }

    fn quoted(&self, span: Span) -> String {
        let written = span.to_range().and_then(|range| self.text.get(range));
        match written.filter(|written| written.len() <= 60 && !written.contains('\n')) {
            Some(written) => format!("`{written}`"),
            None => "a value".to_string(),
        }
    }

    fn nth_value(&self, values: &naga::Arena<Expression>, i: usize) -> Option<String> {
        let (handle, _) = values.iter().nth(i)?;
        Some(self.quoted(values.get_span(handle)))
    }

    fn nth_type(&self, i: usize) -> Option<String> {
        let (handle, _) = self.module.types.iter().nth(i)?;
        Some(format!("`{}`", self.name(handle)))
    }

    fn nth_global(&self, i: usize) -> Option<String> {
        let (_, variable) = self.module.global_variables.iter().nth(i)?;
        Some(format!("`{}`", variable.name.as_deref()?))
    }

    fn name(&self, ty: Handle<Type>) -> String {
        type_name(self.module, ty)
    }

    fn inner(&self, inner: &TypeInner) -> String {
        let mut out = String::new();
        let written = self.module.to_ctx().write_type_inner(inner, &mut out);
        written.map_or_else(|_| "unknown".to_string(), |()| out)
    }

    fn type_of(&self, function: &Function, handle: Handle<Expression>) -> String {
        self.resolved(function, handle, |types| {
            let mut out = String::new();
            let written = self.module.to_ctx().write_type_resolution(&types[handle], &mut out);
            written.map_or_else(|_| "unknown".to_string(), |()| out)
        })
    }

    /// The type of what a pointer points at.
    fn stored_in(&self, function: &Function, pointer: Handle<Expression>) -> String {
        self.resolved(function, pointer, |types| {
            match types[pointer].inner_with(&self.module.types) {
                TypeInner::Pointer { base, .. } => self.name(*base),
                TypeInner::ValuePointer {
                    size: Some(size),
                    scalar,
                    ..
                } => self.inner(&TypeInner::Vector {
                    size: *size,
                    scalar: *scalar,
                }),
                TypeInner::ValuePointer { scalar, .. } => self.inner(&TypeInner::Scalar(*scalar)),
                other => self.inner(other),
            }
        })
    }

    fn resolved(&self, function: &Function, handle: Handle<Expression>, say: impl Fn(&Typifier) -> String) -> String {
        let mut types = Typifier::new();
        let context = ResolveContext::with_locals(self.module, &function.local_variables, &function.arguments);
        match types.grow(handle, &function.expressions, &context) {
            Ok(()) => say(&types),
            Err(_) => "unknown".to_string(),
        }
    }
}

/// A type as WGSL writes it.
pub fn type_name(module: &Module, ty: Handle<Type>) -> String {
    let mut out = String::new();
    let written = module.to_ctx().write_type(ty, &mut out);
    written.map_or_else(|_| "unknown".to_string(), |()| out)
}
