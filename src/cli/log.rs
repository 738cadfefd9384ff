//! Messages on standard error: lines of text, or JSON objects, one per line.

use std::fmt;
use std::io::{self, IsTerminal as _, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::SystemTime;

use clap::ValueEnum;
use serde::Serialize;
use serde_json::{Map, Value};
use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id};
use tracing::{Event, Subscriber};
use tracing_subscriber::layer::{Context, Layer};
use tracing_subscriber::registry::LookupSpan;
use wgray_image::sanitize::{escape_control, escape_control_in_lines};

/// The format of messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum Format {
    // Lines of text.
    #[default]
    Text,
    // JSON objects, one per line.
    Json,
}

/// The kind of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    Error,
    Warning,
    Note,
    /// The progress of a render.
    Progress,
    /// Additional messages with `--verbose`, and the summary after a render.
    Info,
    Debug,
}

impl Level {
    /// Returns the prefix of a message in text format.
    fn prefix(self) -> &'static str {
        match self {
            Level::Error => "error: ",
            Level::Warning => "warning: ",
            Level::Note => "note: ",
            Level::Progress | Level::Info | Level::Debug => "",
        }
    }
}

/// Additional fields of a JSON message, not printed as text.
pub type Facts = Map<String, Value>;

static JSON: AtomicBool = AtomicBool::new(false);

/// Sets the format of messages.
pub fn set_format(format: Format) {
    JSON.store(format == Format::Json, Ordering::Relaxed);
}

/// Returns true if messages are JSON.
pub fn is_json() -> bool {
    JSON.load(Ordering::Relaxed)
}

/// Returns the message format that the arguments request, even if the command line is invalid.
pub fn requested_format(arguments: impl Iterator<Item = std::ffi::OsString>) -> Format {
    let mut format = Format::default();
    let mut arguments = arguments.take_while(|argument| argument != "--");
    while let Some(argument) = arguments.next() {
        let value = match argument.to_str() {
            Some("--log-format") => arguments.next().and_then(|value| value.into_string().ok()),
            Some(option) => option.strip_prefix("--log-format=").map(str::to_owned),
            None => None,
        };
        if let Some(requested) = value.and_then(|value| Format::from_str(&value, false).ok()) {
            format = requested;
        }
    }
    format
}

/// Prints a message.
pub fn print(level: Level, message: &str) {
    print_with(level, message, Facts::new());
}

/// Prints a message with additional JSON fields.
pub fn print_with(level: Level, message: &str, facts: Facts) {
    if !is_json() {
        write(&escape_control(&format!("{}{message}", level.prefix())));
        return;
    }
    #[derive(Serialize)]
    struct Line<'a> {
        level: Level,
        message: &'a str,
        /// Unix time in seconds.
        time: f64,
        #[serde(flatten)]
        facts: Facts,
    }
    let time = SystemTime::now()
        .duration_since(SystemTime::UNIX_EPOCH)
        .unwrap_or_default();
    let line = Line {
        level,
        message,
        time: time.as_millis() as f64 / 1000.0,
        facts,
    };
    // Strings and numbers serialize without errors.
    write(&serde_json::to_string(&line).unwrap_or_default());
}

/// Prints text that continues the previous message. Prints nothing in JSON format, because the message has a field with
/// this text.
pub fn print_continuation(text: &str) {
    if !is_json() {
        write(&escape_control_in_lines(text));
    }
}

/// Prints a line to standard error. Ignores failures, because they cannot be reported and must not end a render.
fn write(line: &str) {
    let _ = io::stderr().lock().write_all(format!("{line}\n").as_bytes());
}

/// Installs a hook that prints panics as JSON, if messages are JSON.
pub fn install_panic_hook() {
    if is_json() {
        std::panic::set_hook(Box::new(|panic| {
            let facts = Facts::from_iter([("exit_code".to_owned(), Value::from(101))]);
            print_with(Level::Error, &panic.to_string(), facts);
        }));
    }
}

/// Prints the `tracing` events of this program, and the warnings and errors of libraries.
pub fn print_events() {
    use tracing_subscriber::filter::{LevelFilter, Targets};
    use tracing_subscriber::prelude::*;
    let targets = Targets::new()
        .with_target("wgray", LevelFilter::DEBUG)
        .with_target("wgray::renderer", LevelFilter::WARN) // the program itself reports the selected device
        .with_default(LevelFilter::WARN);
    let lines = (!is_json()).then(|| {
        tracing_subscriber::fmt::layer()
            .with_writer(io::stderr)
            .with_target(false)
            .without_time()
            .with_ansi(io::stderr().is_terminal())
    });
    let objects = is_json().then_some(JsonLayer);
    tracing_subscriber::registry()
        .with(lines)
        .with(objects)
        .with(targets)
        .init();
}

/// Prints `tracing` events as JSON messages, with the fields of their spans.
struct JsonLayer;

impl<S: Subscriber + for<'a> LookupSpan<'a>> Layer<S> for JsonLayer {
    fn on_new_span(&self, attributes: &Attributes<'_>, id: &Id, context: Context<'_, S>) {
        let mut fields = Fields::default();
        attributes.record(&mut fields);
        if let Some(span) = context.span(id) {
            span.extensions_mut().insert(fields);
        }
    }

    fn on_event(&self, event: &Event<'_>, context: Context<'_, S>) {
        let mut fields = Fields::default();
        for span in context.event_scope(event).into_iter().flatten() {
            if let Some(span_fields) = span.extensions().get::<Fields>() {
                fields.0.extend(span_fields.0.clone());
            }
        }
        event.record(&mut fields);
        let message = match fields.0.remove("message") {
            Some(Value::String(message)) => message,
            _ => String::new(),
        };
        let level = match *event.metadata().level() {
            tracing::Level::ERROR => Level::Error,
            tracing::Level::WARN => Level::Warning,
            tracing::Level::INFO => Level::Info,
            _ => Level::Debug,
        };
        print_with(level, &message, fields.0);
    }
}

/// The fields of an event or a span.
#[derive(Default)]
struct Fields(Facts);

impl Fields {
    fn insert(&mut self, field: &Field, value: impl Into<Value>) {
        self.0.insert(field.name().to_owned(), value.into());
    }
}

impl Visit for Fields {
    fn record_f64(&mut self, field: &Field, value: f64) {
        self.insert(field, value);
    }

    fn record_i64(&mut self, field: &Field, value: i64) {
        self.insert(field, value);
    }

    fn record_u64(&mut self, field: &Field, value: u64) {
        self.insert(field, value);
    }

    fn record_bool(&mut self, field: &Field, value: bool) {
        self.insert(field, value);
    }

    fn record_str(&mut self, field: &Field, value: &str) {
        self.insert(field, value);
    }

    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        self.insert(field, format!("{value:?}"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_format_is_found_in_an_invalid_command_line() {
        let format = |line: &str| requested_format(line.split(' ').map(Into::into));
        assert_eq!(format("render --log-format json --bad"), Format::Json);
        assert_eq!(format("--log-format=json --log-format text"), Format::Text);
        assert_eq!(format("--log-format xml"), Format::Text);
        assert_eq!(format("check -- --log-format json"), Format::Text);
        assert_eq!(format("check --log-format"), Format::Text);
    }
}
