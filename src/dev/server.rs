//! The page and what it is told: a small server of its files, the picture as a file, and one WebSocket.

use std::io;
use std::net::{SocketAddr, TcpListener, ToSocketAddrs};
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{DefaultBodyLimit, Path as UrlPath, Request, State};
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use hyper::server::conn::http1;
use hyper_util::rt::TokioIo;
use hyper_util::service::TowerToHyperService;
use serde::{Deserialize, Serialize};
use tokio::sync::{Semaphore, watch};
use tokio::time::MissedTickBehavior;

use super::download::{exr_file, png_file};
use super::guard::Guard;
use super::messages::{self, Command};
use super::object::{Listed, Object, Seen};
use super::picture::Frame;
use super::reference::Reference;
use super::session::{Session, Viewers};
use super::times::{Time, Times};

/// So many may look at once.
const VIEWERS: usize = 16;
/// So many requests are answered at once; others wait.
const REQUESTS: usize = 64;
/// A request that is not made and answered within this time is given up.
const REQUEST: Duration = Duration::from_secs(10);
/// The largest message of a viewer, in bytes: a command is far smaller.
const LARGEST_MESSAGE: usize = 4096;
/// The largest file to compare with, in bytes.
const LARGEST_FILE: usize = 256 << 20;
/// The longest name of one, in characters.
const LONGEST_NAME: usize = 80;
/// A viewer that takes nothing for so long is gone.
const SEND: Duration = Duration::from_secs(30);
/// So often a viewer is told where the time goes, while that changes.
const TIMES: Duration = Duration::from_millis(500);
/// So often a viewer is asked whether it is there; after three times without a word it is gone.
const BEAT: Duration = Duration::from_secs(15);

/// A place to listen that is open.
pub struct Listener {
    listener: TcpListener,
    guard: Guard,
}

impl Listener {
    /// Opens a place such as `127.0.0.1:7878` or `localhost:0`; port 0 is any that is free.
    ///
    /// # Errors
    ///
    /// Places that do not exist, are not this machine's or are taken.
    pub fn open(place: &str) -> io::Result<Listener> {
        let named = |error: io::Error| io::Error::new(error.kind(), format!("{place}: {error}"));
        let addresses: Vec<SocketAddr> = place.to_socket_addrs().map_err(named)?.collect();
        let listener = TcpListener::bind(addresses.as_slice()).map_err(named)?;
        listener.set_nonblocking(true)?;
        let name = place.rsplit_once(':').map_or(place, |(name, _)| name).to_string();
        let guard = Guard {
            name: Some(name),
            loopback: listener.local_addr()?.ip().is_loopback(),
        };
        Ok(Listener { listener, guard })
    }

    /// Where it is.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Shows a session to whoever comes, for ever.
    ///
    /// # Errors
    ///
    /// What the system does not allow.
    pub fn serve(self, session: &Session) -> io::Result<()> {
        let shared = Shared {
            guard: self.guard,
            state: session.state.clone(),
            frames: session.frames.clone(),
            times: session.times.clone(),
            seen: session.seen.clone(),
            send: Arc::new(session.commands()),
            give: Arc::new(session.references()),
            seats: Arc::new(Semaphore::new(VIEWERS)),
            viewers: session.viewers(),
        };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            answer_all(&listener, routes(shared)).await
        })
    }
}

/// Answers requests, each on a connection of its own and in bounded time; a viewer's connection then lives on elsewhere.
async fn answer_all(listener: &tokio::net::TcpListener, routes: Router) -> io::Result<()> {
    let requests = Arc::new(Semaphore::new(REQUESTS));
    loop {
        let place = requests.clone().acquire_owned().await.map_err(io::Error::other)?;
        let Ok((stream, _)) = listener.accept().await else {
            tokio::time::sleep(Duration::from_millis(50)).await; // too many files are open, or the peer has gone
            continue;
        };
        let service = TowerToHyperService::new(routes.clone());
        tokio::spawn(async move {
            let mut http = http1::Builder::new();
            let connection = http.keep_alive(false).serve_connection(TokioIo::new(stream), service);
            // Whoever asked hears of a failure by the end of the connection.
            let _answered = tokio::time::timeout(REQUEST, connection.with_upgrades()).await;
            drop(place);
        });
    }
}

#[derive(Clone)]
struct Shared {
    guard: Guard,
    state: watch::Receiver<Arc<messages::State>>,
    frames: watch::Receiver<Option<Arc<Frame>>>,
    times: Times,
    seen: watch::Receiver<Option<Arc<Seen>>>,
    send: Arc<dyn Fn(Command) -> Option<u64> + Send + Sync>,
    give: Arc<dyn Fn(Reference) -> bool + Send + Sync>,
    seats: Arc<Semaphore>,
    viewers: Viewers,
}

/// The page's modules.
const MODULES: [(&str, &str); 22] = [
    ("/camera.js", include_str!("page/camera.js")),
    ("/color.js", include_str!("page/color.js")),
    ("/compare.js", include_str!("page/compare.js")),
    ("/controls.js", include_str!("page/controls.js")),
    ("/editor.js", include_str!("page/editor.js")),
    ("/focus.js", include_str!("page/focus.js")),
    ("/invalid.js", include_str!("page/invalid.js")),
    ("/link.js", include_str!("page/link.js")),
    ("/motion.js", include_str!("page/motion.js")),
    ("/numbers.js", include_str!("page/numbers.js")),
    ("/object.js", include_str!("page/object.js")),
    ("/overlay.js", include_str!("page/overlay.js")),
    ("/page.js", include_str!("page/page.js")),
    ("/parts.js", include_str!("page/parts.js")),
    ("/picture.js", include_str!("page/picture.js")),
    ("/probes.js", include_str!("page/probes.js")),
    ("/problems.js", include_str!("page/problems.js")),
    ("/render.js", include_str!("page/render.js")),
    ("/shader.js", include_str!("page/shader.js")),
    ("/times.js", include_str!("page/times.js")),
    ("/touch.js", include_str!("page/touch.js")),
    ("/view.js", include_str!("page/view.js")),
];

fn routes(shared: Shared) -> Router {
    let file =
        |kind: &'static str, text: &'static str| get(move || async move { ([(header::CONTENT_TYPE, kind)], text) });
    let modules = MODULES.into_iter().fold(Router::new(), |router, (path, text)| {
        router.route(path, file("text/javascript; charset=utf-8", text))
    });
    modules
        .route("/", file("text/html; charset=utf-8", include_str!("page/index.html")))
        .route(
            "/style.css",
            file("text/css; charset=utf-8", include_str!("page/style.css")),
        )
        .route("/picture.png", get(picture_png))
        .route("/picture.exr", get(picture_exr))
        .route(
            "/reference/{name}",
            post(reference).layer(DefaultBodyLimit::max(LARGEST_FILE)),
        )
        .route("/socket", get(socket))
        .layer(middleware::from_fn_with_state(shared.clone(), guarded))
        .with_state(shared)
}

/// The picture that is shown, as a file of a kind.
async fn picture(shared: Shared, kind: &'static str, make: fn(&Frame) -> io::Result<Vec<u8>>) -> Response {
    let frame = shared.frames.borrow().clone();
    let Some(frame) = frame.filter(|frame| frame.header.sent == frame.header.finest) else {
        return (StatusCode::CONFLICT, "there is no whole picture yet").into_response();
    };
    match tokio::task::spawn_blocking(move || make(&frame)).await {
        Ok(Ok(file)) => ([(header::CONTENT_TYPE, kind)], file).into_response(),
        Ok(Err(error)) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}

async fn picture_png(State(shared): State<Shared>) -> Response {
    picture(shared, "image/png", |frame| Ok(png_file(frame))).await
}

async fn picture_exr(State(shared): State<Shared>) -> Response {
    picture(shared, "image/x-exr", exr_file).await
}

/// Takes a file to compare with. It comes from the viewer's machine: nothing of this one is read.
async fn reference(State(shared): State<Shared>, UrlPath(name): UrlPath<String>, body: Bytes) -> Response {
    let frame = shared.frames.borrow().clone();
    let view = frame.map(|frame| frame.look.view).unwrap_or_default();
    let name: String = name.chars().filter(|c| !c.is_control()).take(LONGEST_NAME).collect();
    let work = move || Reference::decode(name, body.to_vec(), view);
    match tokio::task::spawn_blocking(work).await {
        Ok(Ok(reference)) => match (shared.give)(reference) {
            true => StatusCode::NO_CONTENT.into_response(),
            false => (StatusCode::SERVICE_UNAVAILABLE, "busy: the file was dropped").into_response(),
        },
        Ok(Err(error)) => (StatusCode::UNPROCESSABLE_ENTITY, error).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}

/// Refuses what comes from elsewhere, and tells the browser to load nothing from there.
async fn guarded(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    // What changes anything must come from the page itself.
    let acts = request.uri().path() == "/socket" || request.method() != Method::GET;
    let mut response = match shared.guard.check(request.headers(), acts) {
        Ok(()) => next.run(request).await,
        Err(why) => (StatusCode::FORBIDDEN, why).into_response(),
    };
    let policy = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
                  base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    let headers: [(HeaderName, &'static str); 5] = [
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ];
    for (name, value) in headers {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

async fn socket(State(shared): State<Shared>, upgrade: WebSocketUpgrade) -> Response {
    let Ok(seat) = shared.seats.clone().try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many viewers").into_response();
    };
    let upgrade = upgrade
        .max_message_size(LARGEST_MESSAGE)
        .max_frame_size(LARGEST_MESSAGE);
    upgrade.on_upgrade(async move |socket| {
        let looking = shared.viewers.enter();
        let _gone = view(socket, &shared).await; // how a viewer goes does not matter
        drop(looking);
        drop(seat);
    })
}

/// What a viewer may say.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Ask {
    /// What is known of a pixel?
    Pixel([u32; 2]),
    /// What is at a pixel?
    Object([u32; 2]),
    /// What is said of the object of this name?
    Inspect(Inspect),
    /// Which objects have this in their names?
    Objects(String),
    /// The viewer has displayed this frame and all before it.
    Shown(u64),
    #[serde(untagged)]
    Command(Command),
}

/// An object by its name.
#[derive(Deserialize)]
struct Inspect {
    name: String,
    #[serde(default)]
    material: Option<String>,
}

/// What a viewer is told, beside frames.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum Tell<'a> {
    State(&'a messages::State),
    Pixel {
        x: u32,
        y: u32,
        values: Vec<(&'static str, String)>,
    },
    Object(Box<Object>),
    Objects(Listed),
    /// The number of a command that was given; the state says when it has been followed.
    Asked(u64),
    Refused(String),
    /// Where the time goes.
    Times(&'a [Time]),
}

/// Tells one viewer what there is to tell, as fast as it takes it: it gets the newest frame, not every frame.
async fn view(mut socket: WebSocket, shared: &Shared) -> Option<()> {
    let (mut state, mut frames) = (shared.state.clone(), shared.frames.clone());
    state.mark_changed();
    frames.mark_changed();
    let mut beat = tokio::time::interval(BEAT);
    let mut clock = tokio::time::interval(TIMES);
    clock.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut times = Vec::new();
    let mut heard = Instant::now();
    loop {
        let message = tokio::select! {
            changed = state.changed() => {
                changed.ok()?;
                let state = state.borrow_and_update().clone();
                text(&Tell::State(&state))?
            }
            changed = frames.changed() => {
                changed.ok()?;
                match frames.borrow_and_update().clone() {
                    Some(frame) => Message::Binary(bytes(&frame)?.into()),
                    None => continue,
                }
            }
            message = socket.recv() => {
                heard = Instant::now();
                match message?.ok()? {
                    Message::Text(asked) => match answer(&asked, shared).await {
                        Some(answer) => text(&answer)?,
                        None => continue,
                    },
                    Message::Binary(_) | Message::Close(_) => return None,
                    Message::Ping(_) | Message::Pong(_) => continue,
                }
            }
            _ = clock.tick() => {
                let told = shared.times.told();
                if told == times {
                    continue;
                }
                times = told;
                text(&Tell::Times(&times))?
            }
            _ = beat.tick() => {
                if heard.elapsed() > 3 * BEAT {
                    return None;
                }
                Message::Ping(Vec::new().into())
            }
        };
        let is_frame = matches!(message, Message::Binary(_));
        let start = Instant::now();
        tokio::time::timeout(SEND, socket.send(message)).await.ok()?.ok()?;
        if is_frame {
            shared.times.part("send", start.elapsed());
        }
    }
}

async fn answer(asked: &str, shared: &Shared) -> Option<Tell<'static>> {
    match serde_json::from_str(asked) {
        Ok(Ask::Pixel([x, y])) => {
            let frame = shared.frames.borrow().clone();
            let values = frame.and_then(|frame| frame.pixel(x, y)).unwrap_or_default();
            Some(Tell::Pixel { x, y, values })
        }
        Ok(Ask::Object(pixel)) => {
            let nothing = move || Object::none("", Some(pixel));
            let found = of_scene(shared, nothing, move |seen| seen.at(pixel)).await;
            Some(Tell::Object(Box::new(found)))
        }
        Ok(Ask::Inspect(Inspect { name, material })) => {
            let nothing = || Object::none(&name, None);
            let wanted = name.clone();
            let found = of_scene(shared, nothing, move |seen| seen.object(&wanted, material.as_deref())).await;
            Some(Tell::Object(Box::new(found)))
        }
        Ok(Ask::Objects(part)) => {
            let found = of_scene(shared, Listed::default, move |seen| seen.objects(&part)).await;
            Some(Tell::Objects(found))
        }
        Ok(Ask::Shown(frame)) => {
            let _ = frame; // frames are not counted yet
            None
        }
        Ok(Ask::Command(command)) => {
            let dropped = || Tell::Refused("busy: a command was dropped".to_string());
            Some((shared.send)(command).map_or_else(dropped, Tell::Asked))
        }
        Err(error) => Some(Tell::Refused(format!("not understood: {error}"))),
    }
}

/// What is found in the scene, on a thread of its own: it may be large. Or what is told where there is none.
async fn of_scene<T: Send + 'static>(
    shared: &Shared,
    nothing: impl Fn() -> T,
    find: impl FnOnce(&Seen) -> T + Send + 'static,
) -> T {
    let seen = shared.seen.borrow().clone();
    let Some(seen) = seen else { return nothing() };
    let found = tokio::task::spawn_blocking(move || find(&seen)).await;
    found.unwrap_or_else(|_| nothing())
}

fn text(tell: &Tell) -> Option<Message> {
    Some(Message::Text(serde_json::to_string(tell).ok()?.into()))
}

/// A frame: the length of its header as four bytes, little-endian, the header as JSON, and the pictures.
fn bytes(frame: &Frame) -> Option<Vec<u8>> {
    let header = serde_json::to_vec(&frame.header).ok()?;
    let mut bytes = u32::try_from(header.len()).ok()?.to_le_bytes().to_vec();
    bytes.extend(header);
    frame.pictures.iter().for_each(|picture| bytes.extend(picture));
    Some(bytes)
}
