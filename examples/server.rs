//! An HTTP server that renders models: POST the bytes of a glTF file, and receive a PNG. Listens on the loopback
//! interface only.
//!
//! ```sh
//! cargo run --release --example server -- 8080
//! curl --data-binary @model.glb http://127.0.0.1:8080/320/240/16 > image.png
//! ```
//!
//! With `--test`, the server sends itself a request and exits.

use std::error::Error;
use std::io::{Cursor, Read as _, Write as _};
use std::net::{Ipv4Addr, TcpStream};

use axum::Router;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Path, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::post;
use tokio::net::TcpListener;
use wgray::image::{Format, SaveOptions};
use wgray::scene::{LoadOptions, SceneFormat};
use wgray::{CancelToken, Context, Options, Overrides, Scene, Session};

/// Maximum number of pixels of an image.
const MAX_PIXELS: u64 = 4 << 20;
/// Maximum number of samples over all pixels.
const MAX_SAMPLES: u64 = 256 << 20;

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let argument = std::env::args().nth(1).unwrap_or("--test".to_string());
    let is_test = argument == "--test";
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, if is_test { 0 } else { argument.parse()? })).await?;
    let address = listener.local_addr()?;
    println!("http://{address}/");
    let router = Router::new()
        .route("/{width}/{height}/{spp}", post(answer))
        .layer(DefaultBodyLimit::max(256 << 20))
        .with_state(Context::new());
    let server = axum::serve(listener, router);
    if is_test {
        return tokio::select! {
            result = server => Ok(result?),
            result = tokio::task::spawn_blocking(move || request(address.port())) => result?,
        };
    }
    Ok(server.await?)
}

/// Renders the model in the body of a request. If the client disconnects, the render is cancelled.
async fn answer(State(context): State<Context>, Path(settings): Path<[u32; 3]>, model: Bytes) -> Response {
    match render(&context, settings, &model).await {
        Ok(png) => ([(header::CONTENT_TYPE, "image/png")], png).into_response(),
        Err(error) => (StatusCode::BAD_REQUEST, format!("{error}\n")).into_response(),
    }
}

async fn render(
    context: &Context,
    [width, height, spp]: [u32; 3],
    model: &[u8],
) -> Result<Vec<u8>, Box<dyn Error + Send + Sync>> {
    let pixels = u64::from(width) * u64::from(height);
    if pixels > MAX_PIXELS || pixels * u64::from(spp) > MAX_SAMPLES {
        return Err("the image has too many pixels or samples".into());
    }
    let overrides = Overrides {
        size: Some((width, height)),
        pixel_samples: Some(spp),
        ..Overrides::default()
    };
    // The options have no source of files, so files to which the model refers cannot be read.
    let options = LoadOptions::new().with_name("model").with_overrides(overrides);
    let scene = Scene::from_slice(model, SceneFormat::Gltf, &options)?;
    let mut session = Session::new(context, scene);
    let image = session.render_async(&Options::default(), &CancelToken::new()).await?;
    let mut png = Cursor::new(Vec::new());
    image.write_to(&mut png, Format::Png, &SaveOptions::default())?;
    Ok(png.into_inner())
}

/// Sends a model to the server, and checks that the response is an image.
fn request(port: u16) -> Result<(), Box<dyn Error + Send + Sync>> {
    // A triangle, with its buffer in a data URI: three positions of three 32-bit floats.
    let model = r#"{
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }
        ],
        "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
        "buffers": [{ "byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }]
    }"#;
    let mut stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port))?;
    let length = model.len();
    write!(
        stream,
        "POST /32/24/1 HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
    )?;
    write!(stream, "Content-Length: {length}\r\n\r\n{model}")?;
    let mut response = Vec::new();
    stream.read_to_end(&mut response)?;
    let text = String::from_utf8_lossy(&response);
    match text.starts_with("HTTP/1.1 200") && text.contains("PNG") {
        true => {
            println!("received an image: {} bytes", response.len());
            Ok(())
        }
        false => Err(text.into()),
    }
}
