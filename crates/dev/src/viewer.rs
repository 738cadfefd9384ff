//! The WebSocket of one viewer: receives commands and queries, sends states, answers and frames.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use axum::extract::ws::{Message, WebSocket};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt as _, StreamExt as _};
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use tokio::sync::{mpsc, watch};
use tokio::time::{MissedTickBehavior, sleep, timeout};

use super::messages::{self, Command};
use super::object::{Object, ObjectList, SceneView};
use super::picture::Frame;
use super::shared::Shared;
use super::times::Time;
use wgray_image::sanitize::escape_control;
use wgray_scene::cut;

/// Maximum number of unacknowledged frames: one frame is drawn while the next one arrives. More frames would delay all
/// messages on a slow connection.
const MAX_FRAMES_IN_FLIGHT: usize = 2;
/// Minimum time between states while [`MAX_FRAMES_IN_FLIGHT`] frames are in flight, as on slow connections.
const STATE_INTERVAL: Duration = Duration::from_millis(100);
/// Maximum number of answers that wait to be sent.
const MAX_ANSWERS: usize = 64;
const SEND_TIMEOUT: Duration = Duration::from_secs(30);
/// Interval between reports of timings, while the timings change.
const TIMES_INTERVAL: Duration = Duration::from_millis(500);
/// Interval between pings. A viewer that sends nothing for three intervals is disconnected.
const PING_INTERVAL: Duration = Duration::from_secs(15);

#[derive(Debug, PartialEq)]
enum Request {
    /// Acknowledges this frame and all earlier frames; the server does not reply.
    Acknowledge(u64),
    Query(Query),
    Command(Command),
}

/// A query, which changes nothing.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Query {
    Pixel([u32; 2]),
    Object([u32; 2]),
    Inspect(Inspect),
    /// Requests the objects whose name, type, file or material contains the string.
    Objects(String),
}

#[derive(Deserialize)]
struct Acknowledgement {
    shown: u64,
}

const QUERIES: [&str; 4] = ["pixel", "object", "inspect", "objects"];

#[derive(Debug, PartialEq, Deserialize)]
struct Inspect {
    name: String,
    #[serde(default)]
    material: Option<String>,
}

impl Request {
    /// Parses a message: the name of a command, or an object with that name as its only key.
    fn parse(message: &str) -> Result<Request, String> {
        let sanitized = |error: serde_json::Error| escape_control(&cut(&error.to_string())).into_owned();
        let value: Json = serde_json::from_str(message).map_err(|error| format!("not JSON: {}", sanitized(error)))?;
        let name = match &value {
            Json::String(name) => Some(name),
            Json::Object(object) if object.len() == 1 => object.keys().next(),
            _ => None,
        };
        let name =
            name.ok_or("a message must be the name of a command, or an object with that name as its only key")?;
        // The text is parsed again, because the JSON value does not contain duplicate keys.
        let parsed = match name.as_str() {
            "shown" => serde_json::from_str(message).map(|Acknowledgement { shown }| Request::Acknowledge(shown)),
            name if QUERIES.contains(&name) => serde_json::from_str(message).map(Request::Query),
            _ => serde_json::from_str(message).map(Request::Command),
        };
        parsed.map_err(|error| {
            let name_for_display = escape_control(&cut(name)).into_owned();
            match error.to_string().starts_with(&format!("unknown variant `{name}`")) {
                true => format!("unknown command \"{name_for_display}\""),
                false => format!("invalid arguments of \"{name_for_display}\": {}", sanitized(error)),
            }
        })
    }
}

/// A message to a viewer, other than a frame.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Reply<'a> {
    State(&'a messages::State),
    Pixel {
        x: u32,
        y: u32,
        values: Vec<(&'static str, String)>,
    },
    Object(Box<Object>),
    Objects(ObjectList),
    /// The number of an accepted command: [`messages::State::executed`] reaches this number after the command.
    #[serde(rename = "asked")]
    Accepted(u64),
    #[serde(rename = "refused")]
    Refusal(String),
    Times(&'a [Time]),
}

/// Serves a viewer until it disconnects or an error occurs. Sending never blocks the receipt of commands.
pub(super) async fn serve(socket: WebSocket, shared: &Shared) -> Option<()> {
    let (sink, stream) = socket.split();
    let (answer, answers) = mpsc::channel(MAX_ANSWERS);
    let (acknowledge, acknowledged) = watch::channel(0);
    tokio::select! {
        end = send(sink, answers, acknowledged, shared) => end,
        end = receive(stream, &answer, &acknowledge, shared) => end,
    }
}

/// Receives and handles messages, and queues the answers for sending.
async fn receive(
    mut stream: SplitStream<WebSocket>,
    answers: &mpsc::Sender<Reply<'static>>,
    acknowledged: &watch::Sender<u64>,
    shared: &Shared,
) -> Option<()> {
    loop {
        let text = match timeout(3 * PING_INTERVAL, stream.next()).await.ok()??.ok()? {
            Message::Text(text) => text,
            Message::Binary(_) | Message::Close(_) => return None,
            Message::Ping(_) | Message::Pong(_) => continue,
        };
        let reply = match Request::parse(&text) {
            Ok(Request::Acknowledge(number)) => {
                acknowledged.send_replace(number);
                continue;
            }
            Ok(Request::Query(query)) => answer(query, shared).await,
            Ok(Request::Command(command)) => {
                let busy = || Reply::Refusal("busy: the command was dropped".to_string());
                (shared.send_command)(command).map_or_else(busy, Reply::Accepted)
            }
            Err(error) => Reply::Refusal(format!("not understood: {error}")),
        };
        answers.send(reply).await.ok()?;
    }
}

/// Sends updates: the newest state and the newest frame, skipping older ones.
async fn send(
    mut sink: SplitSink<WebSocket, Message>,
    mut answers: mpsc::Receiver<Reply<'static>>,
    mut acknowledged: watch::Receiver<u64>,
    shared: &Shared,
) -> Option<()> {
    let (mut state, mut frames) = (shared.state.clone(), shared.frames.clone());
    state.mark_changed();
    frames.mark_changed();
    let mut ping = tokio::time::interval(PING_INTERVAL);
    let mut times_tick = tokio::time::interval(TIMES_INTERVAL);
    times_tick.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut times = Vec::new();
    let mut in_flight = VecDeque::new();
    let mut last_state: Option<Instant> = None;
    loop {
        let can_send_frame = in_flight.len() < MAX_FRAMES_IN_FLIGHT;
        let pause = last_state.map_or(Duration::ZERO, |last| STATE_INTERVAL.saturating_sub(last.elapsed()));
        let must_pause = !can_send_frame && !pause.is_zero();
        let message = tokio::select! {
            biased;
            reply = answers.recv() => text(&reply?)?,
            changed = acknowledged.changed() => {
                changed.ok()?;
                let last = *acknowledged.borrow_and_update();
                in_flight.retain(|number| *number > last);
                continue;
            }
            changed = state.changed(), if !must_pause => {
                changed.ok()?;
                last_state = Some(Instant::now());
                let state = state.borrow_and_update().clone();
                text(&Reply::State(&state))?
            }
            () = sleep(pause), if must_pause => continue,
            _ = ping.tick() => Message::Ping(Vec::new().into()),
            changed = frames.changed(), if can_send_frame => {
                changed.ok()?;
                let Some(frame) = frames.borrow_and_update().clone() else { continue };
                in_flight.push_back(frame.header.number);
                let start = Instant::now();
                timeout(SEND_TIMEOUT, sink.send(Message::Binary(bytes(&frame)?.into()))).await.ok()?.ok()?;
                shared.times.record_stage("send", start.elapsed());
                continue;
            }
            _ = times_tick.tick() => {
                let new = shared.times.timings();
                if new == times {
                    continue;
                }
                times = new;
                text(&Reply::Times(&times))?
            }
        };
        timeout(SEND_TIMEOUT, sink.send(message)).await.ok()?.ok()?;
    }
}

async fn answer(query: Query, shared: &Shared) -> Reply<'static> {
    match query {
        Query::Pixel([x, y]) => {
            let frame = shared.frames.borrow().clone();
            let values = frame.and_then(|frame| frame.pixel(x, y)).unwrap_or_default();
            Reply::Pixel { x, y, values }
        }
        Query::Object(pixel) => {
            let default = move || Object::without_scene("", Some(pixel));
            let object = query_scene(shared, default, move |view| view.at(pixel)).await;
            Reply::Object(Box::new(object))
        }
        Query::Inspect(Inspect { name, material }) => {
            let default = || Object::without_scene(&name, None);
            let object_name = name.clone();
            let query = move |view: &SceneView| view.object(&object_name, material.as_deref());
            let object = query_scene(shared, default, query).await;
            Reply::Object(Box::new(object))
        }
        Query::Objects(name) => {
            Reply::Objects(query_scene(shared, ObjectList::default, move |view| view.objects(&name)).await)
        }
    }
}

/// Runs a query on a separate thread, because the scene may be large. Returns `default()` if no scene is loaded.
async fn query_scene<T: Send + 'static>(
    shared: &Shared,
    default: impl Fn() -> T,
    query: impl FnOnce(&SceneView) -> T + Send + 'static,
) -> T {
    let view = shared.scene_views.borrow().clone();
    let Some(view) = view else { return default() };
    let answer = tokio::task::spawn_blocking(move || query(&view)).await;
    answer.unwrap_or_else(|_| default())
}

fn text(reply: &Reply) -> Option<Message> {
    Some(Message::Text(serde_json::to_string(reply).ok()?.into()))
}

/// Returns a frame as a message: the length of the header (four bytes, little-endian), the header as JSON, and the
/// images.
fn bytes(frame: &Frame) -> Option<Vec<u8>> {
    let header = serde_json::to_vec(&frame.header).ok()?;
    let mut bytes = u32::try_from(header.len()).ok()?.to_le_bytes().to_vec();
    bytes.extend(header);
    frame.pictures.iter().for_each(|picture| bytes.extend(picture));
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_parsed_and_errors_name_the_command() {
        assert_eq!(Request::parse("\"grab\""), Ok(Request::Command(Command::Grab)));
        assert_eq!(Request::parse("{\"shown\":7}"), Ok(Request::Acknowledge(7)));
        let pixel = Request::Query(Query::Pixel([1, 2]));
        assert_eq!(Request::parse("{\"pixel\":[1,2]}"), Ok(pixel));
        for (message, error) in [
            ("{\"fly\":1}", "unknown command \"fly\""),
            ("\"f\u{1b}ly\"", "not JSON: control character"),
            (
                "{\"gain\":\"x\"}",
                "invalid arguments of \"gain\": invalid type: string \"x\"",
            ),
            ("{\"shown\":-1}", "invalid arguments of \"shown\": "),
            ("{\"gain\":1,\"marks\":true}", "a message must be the name of a command"),
            ("7", "a message must be the name of a command"),
            ("{", "not JSON: EOF"),
        ] {
            let found = Request::parse(message).unwrap_err();
            assert!(
                found.starts_with(error) && !found.contains("enum"),
                "{message}: {found}"
            );
        }
    }
}
