//! The HTTP server: the files of the page, the image as a file, and the WebSocket of each viewer.

use std::collections::VecDeque;
use std::io;
use std::net::{SocketAddr, TcpListener, ToSocketAddrs};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::Router;
use axum::body::Bytes;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{DefaultBodyLimit, Path as UrlPath, Request, State};
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use hyper::body::Incoming;
use hyper::server::conn::http1;
use hyper::service::{Service as _, service_fn};
use hyper_util::rt::TokioIo;
use hyper_util::service::TowerToHyperService;
use tokio::sync::Semaphore;
use tokio::task::AbortHandle;

use super::download::{encode_exr, encode_png};
use super::guard::Guard;
use super::picture::Frame;
use super::reference::Reference;
use super::session::Session;
use super::shared::Shared;
use super::viewer;

/// Maximum number of concurrent viewers.
const MAX_VIEWERS: usize = 16;
/// Maximum number of requests that are received or answered concurrently.
const MAX_REQUESTS: usize = 64;
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);
/// Maximum size of a viewer's message in bytes; a command is far smaller.
const MAX_MESSAGE_BYTES: usize = 4096;
/// Maximum size of a reference file in bytes.
const MAX_FILE_BYTES: usize = 256 << 20;
const MAX_NAME_LEN: usize = 80;

/// An open listening address.
pub struct Listener {
    listener: TcpListener,
    guard: Guard,
}

impl Listener {
    /// Opens an address such as `127.0.0.1:7878` or `localhost:0`; port 0 selects a free port.
    ///
    /// # Errors
    ///
    /// The address does not exist, is not on this machine or is in use.
    pub fn open(address: &str) -> io::Result<Listener> {
        let with_address = |error: io::Error| io::Error::new(error.kind(), format!("{address}: {error}"));
        let addresses: Vec<SocketAddr> = address.to_socket_addrs().map_err(with_address)?.collect();
        let listener = TcpListener::bind(addresses.as_slice()).map_err(with_address)?;
        listener.set_nonblocking(true)?;
        let name = address.rsplit_once(':').map_or(address, |(name, _)| name).to_string();
        let guard = Guard {
            name: Some(name),
            loopback: listener.local_addr()?.ip().is_loopback(),
        };
        Ok(Listener { listener, guard })
    }

    /// Returns the address, with the selected port.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Serves a session; returns only on errors.
    ///
    /// # Errors
    ///
    /// Errors of the operating system.
    pub fn serve(self, session: &Session) -> io::Result<()> {
        let shared = Shared {
            guard: self.guard,
            state: session.state.clone(),
            frames: session.frames.clone(),
            times: session.times.clone(),
            scene_views: session.scene_views.clone(),
            send_command: Arc::new(session.commands()),
            submit_reference: Arc::new(session.references()),
            viewer_slots: Arc::new(Semaphore::new(MAX_VIEWERS)),
            viewers: session.viewers(),
        };
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            answer_all(&listener, routes(shared)).await
        })
    }
}

/// A connection on which no complete request header has arrived yet.
struct WaitingConnection {
    task: AbortHandle,
    has_header: Arc<AtomicBool>,
}

/// Answers each request on a separate connection and in limited time. If there are too many connections, a new
/// connection replaces the connection that has waited longest for a request.
async fn answer_all(listener: &tokio::net::TcpListener, routes: Router) -> io::Result<()> {
    let requests = Arc::new(Semaphore::new(MAX_REQUESTS));
    let mut waiting: VecDeque<WaitingConnection> = VecDeque::new();
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            tokio::time::sleep(Duration::from_millis(50)).await; // too many open files, or the client disconnected
            continue;
        };
        waiting.retain(|entry| !entry.task.is_finished() && !entry.has_header.load(Ordering::Relaxed));
        if requests.available_permits() == 0
            && let Some(oldest) = waiting.pop_front()
        {
            oldest.task.abort();
        }
        let permit = requests.clone().acquire_owned().await.map_err(io::Error::other)?;
        let (routes, has_header) = (
            TowerToHyperService::new(routes.clone()),
            Arc::new(AtomicBool::new(false)),
        );
        let header_arrived = Arc::clone(&has_header);
        let service = service_fn(move |request: hyper::Request<Incoming>| {
            header_arrived.store(true, Ordering::Relaxed);
            routes.call(request)
        });
        let task = tokio::spawn(async move {
            let mut http = http1::Builder::new();
            let connection = http.keep_alive(false).serve_connection(TokioIo::new(stream), service);
            // On failure, the connection ends.
            let _answered = tokio::time::timeout(REQUEST_TIMEOUT, connection.with_upgrades()).await;
            drop(permit);
        });
        let task = task.abort_handle();
        waiting.push_back(WaitingConnection { task, has_header });
    }
}

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
            post(reference).layer(DefaultBodyLimit::max(MAX_FILE_BYTES)),
        )
        .route("/socket", get(socket))
        .layer(middleware::from_fn_with_state(shared.clone(), check_origin))
        .with_state(shared)
}

async fn picture(shared: Shared, kind: &'static str, encode: fn(&Frame) -> io::Result<Vec<u8>>) -> Response {
    let frame = shared.frames.borrow().clone();
    let Some(frame) = frame.filter(|frame| frame.header.sent == frame.header.finest) else {
        return (StatusCode::CONFLICT, "the image is not complete yet").into_response();
    };
    match tokio::task::spawn_blocking(move || encode(&frame)).await {
        Ok(Ok(file)) => ([(header::CONTENT_TYPE, kind)], file).into_response(),
        Ok(Err(error)) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}

async fn picture_png(State(shared): State<Shared>) -> Response {
    picture(shared, "image/png", |frame| Ok(encode_png(frame))).await
}

async fn picture_exr(State(shared): State<Shared>) -> Response {
    picture(shared, "image/x-exr", encode_exr).await
}

/// Receives a reference file from the viewer's machine.
async fn reference(State(shared): State<Shared>, UrlPath(name): UrlPath<String>, body: Bytes) -> Response {
    let frame = shared.frames.borrow().clone();
    let view = frame.map(|frame| frame.display.view).unwrap_or_default();
    let name: String = name.chars().filter(|c| !c.is_control()).take(MAX_NAME_LEN).collect();
    let decode = move || Reference::decode(name, body.to_vec(), view);
    match tokio::task::spawn_blocking(decode).await {
        Ok(Ok(reference)) => match (shared.submit_reference)(reference) {
            true => StatusCode::NO_CONTENT.into_response(),
            false => (StatusCode::SERVICE_UNAVAILABLE, "busy: the file was dropped").into_response(),
        },
        Ok(Err(error)) => (StatusCode::UNPROCESSABLE_ENTITY, error).into_response(),
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
    }
}

/// Rejects requests from other origins and prevents the browser from loading external resources.
async fn check_origin(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    // Requests that change anything must come from the page itself.
    let must_have_origin = request.uri().path() == "/socket" || request.method() != Method::GET;
    let mut response = match shared.guard.check(request.uri(), request.headers(), must_have_origin) {
        Ok(()) => next.run(request).await,
        Err(reason) => (StatusCode::FORBIDDEN, reason).into_response(),
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
    let Ok(slot) = shared.viewer_slots.clone().try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "too many viewers").into_response();
    };
    let upgrade = upgrade
        .max_message_size(MAX_MESSAGE_BYTES)
        .max_frame_size(MAX_MESSAGE_BYTES);
    upgrade.on_upgrade(async move |socket| {
        let viewer = shared.viewers.enter();
        let _end = viewer::serve(socket, &shared).await; // the reason for the end does not matter
        drop(viewer);
        drop(slot);
    })
}
