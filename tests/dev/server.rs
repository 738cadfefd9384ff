//! The server answers only requests from its own page.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use wgray_dev::{Command, Listener, Move};

use super::running::{Files, SCENE, TIMEOUT, serve};

fn send_request(address: SocketAddr, request: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(TIMEOUT)).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut response = String::new();
    let mut buffer = [0; 4096];
    while !is_complete(&response) {
        let length = stream.read(&mut buffer).unwrap();
        assert_ne!(length, 0, "the response is incomplete: {response}");
        response.push_str(&String::from_utf8_lossy(&buffer[..length]));
    }
    (response.lines().next().unwrap_or_default().to_string(), response)
}

fn is_complete(response: &str) -> bool {
    let Some((head, body)) = response.split_once("\r\n\r\n") else {
        return false;
    };
    let length = head
        .lines()
        .find_map(|line| line.to_lowercase().strip_prefix("content-length: ")?.parse().ok());
    head.starts_with("HTTP/1.1 101") || body.len() >= length.unwrap_or(usize::MAX)
}

fn get_request(path: &str, host: &str, extra_headers: &str) -> String {
    format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{extra_headers}Connection: close\r\n\r\n")
}

fn upgrade_request(host: &str, origin: &str) -> String {
    format!(
        "GET /socket HTTP/1.1\r\nHost: {host}\r\n{origin}Connection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
}

#[test]
fn the_server_answers_only_requests_from_its_own_page() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let (session, address) = serve(session);
    let (own_host, port) = (address.to_string(), address.port());

    for path in [
        "/",
        "/style.css",
        "/page.js",
        "/picture.js",
        "/link.js",
        "/object.js",
        "/numbers.js",
        "/color.js",
        "/parts.js",
        "/touch.js",
    ] {
        let (status, text) = send_request(address, &get_request(path, &own_host, ""));
        assert_eq!(status, "HTTP/1.1 200 OK", "{path}");
        assert!(
            text.contains("default-src 'none'") && text.contains("nosniff"),
            "{text}"
        );
        assert!(
            !text.contains("://cdn") && !text.contains("src=\"http"),
            "the page loads from another origin"
        );
    }
    for path in [
        "/scene.toml",
        "/../scene.toml",
        "/shaders/phong.wgsl",
        "/%2e%2e/etc/passwd",
        "//etc/passwd",
    ] {
        assert_eq!(
            send_request(address, &get_request(path, &own_host, "")).0,
            "HTTP/1.1 404 Not Found",
            "{path}"
        );
    }
    let forbidden = "HTTP/1.1 403 Forbidden";
    for host in [
        "evil.example",
        &format!("evil.example:{port}"),
        "192.168.0.1",
        "127.0.0.1.evil.example",
    ] {
        assert_eq!(
            send_request(address, &get_request("/", host, "")).0,
            forbidden,
            "{host}"
        );
        assert_eq!(
            send_request(address, &get_request(&format!("http://{host}/"), &own_host, "")).0,
            forbidden,
            "{host}"
        );
        assert_eq!(
            send_request(address, &upgrade_request(host, &format!("Origin: http://{host}\r\n"))).0,
            forbidden,
            "{host}"
        );
    }
    for origin in [
        "Origin: http://evil.example\r\n",
        "Origin: null\r\n",
        "Origin: http://127.0.0.1:1\r\n",
        "",
    ] {
        assert_eq!(
            send_request(address, &upgrade_request(&own_host, origin)).0,
            forbidden,
            "{origin}"
        );
    }
    assert_eq!(
        send_request(address, &get_request("/", &own_host, "Origin: http://evil.example\r\n")).0,
        forbidden
    );
    let accepted = send_request(
        address,
        &upgrade_request(&own_host, &format!("Origin: http://{own_host}\r\n")),
    )
    .0;
    assert_eq!(accepted, "HTTP/1.1 101 Switching Protocols");

    // The number of viewers is limited; a viewer that disconnects makes room for another viewer.
    let request = upgrade_request(&own_host, &format!("Origin: http://{own_host}\r\n"));
    let mut connections = Vec::new();
    let status = loop {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(TIMEOUT)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut head = [0; 12];
        stream.read_exact(&mut head).unwrap();
        if head != *b"HTTP/1.1 101" {
            break head;
        }
        connections.push(stream);
        assert!(connections.len() <= 16, "the number of viewers is not limited");
    };
    assert_eq!(status, *b"HTTP/1.1 503");
    assert!(connections.len() >= 15, "{}", connections.len());
    // Viewers that read no messages do not block the session.
    for _ in 0..20 {
        let revision = session.revision();
        session.inner.send(Command::Move(Move::Orbit(0.1, 0.0)));
        session.wait_for_complete_image(revision);
    }
    // A text message of 5,000 bytes, masked with zeros, exceeds the limit and ends the connection.
    let mut large_message = vec![0x81, 0x80 | 126, 0x13, 0x88, 0, 0, 0, 0];
    large_message.resize(8 + 5000, b' ');
    let mut stream = connections.pop().unwrap();
    stream.write_all(&large_message).unwrap();
    let mut rest = Vec::new();
    let end = stream.read_to_end(&mut rest);
    assert!(end.is_ok() || end.is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionReset));
    drop(connections);
    session.wait("a free slot", |_| {
        (send_request(address, &request).0 == "HTTP/1.1 101 Switching Protocols").then_some(())
    });
}

#[test]
fn images_are_not_sent_to_foreign_origins_and_are_only_accepted_from_the_page() {
    let files = Files::new(SCENE);
    let session = files.start();
    session.wait_for_rendered_image(&files);
    let (session, address) = serve(session);
    let own_host = address.to_string();
    for (path, mime_type) in [("/picture.png", "image/png"), ("/picture.exr", "image/x-exr")] {
        let (status, text) = send_request(address, &get_request(path, &own_host, ""));
        assert_eq!(status, "HTTP/1.1 200 OK", "{path}");
        assert!(text.contains(mime_type) && text.contains("same-origin"), "{path}");
        let cross_origin_request = get_request(path, &own_host, "Origin: http://evil.example\r\n");
        assert_eq!(send_request(address, &cross_origin_request).0, "HTTP/1.1 403 Forbidden");
    }
    let upload = |origin: &str| {
        let request_head =
            format!("POST /reference/a%20b.png HTTP/1.1\r\nHost: {own_host}\r\n{origin}Content-Length: 10\r\n\r\n");
        send_request(address, &(request_head + "not image."))
    };
    let own_origin = format!("Origin: http://{own_host}\r\n");
    for origin in ["", "Origin: null\r\n", "Origin: http://evil.example\r\n"] {
        assert_eq!(upload(origin).0, "HTTP/1.1 403 Forbidden", "{origin}");
    }
    let (status, text) = upload(&own_origin);
    assert_eq!(status, "HTTP/1.1 422 Unprocessable Entity");
    assert!(text.contains("a b.png: "), "{text}");
    assert_eq!(session.state().comparable, (false, None));
    assert_eq!(
        send_request(address, &get_request("/reference/a", &own_host, "")).0,
        "HTTP/1.1 405 Method Not Allowed"
    );
}

#[test]
fn incomplete_requests_time_out_and_do_not_block_other_requests() {
    let files = Files::new(SCENE);
    let (_, address) = serve(files.start());
    let incomplete = [
        "",
        "GET / HTTP/1.1\r\nHost: ",
        &format!("POST / HTTP/1.1\r\nHost: {address}\r\nContent-Length: 9\r\n\r\nx"),
    ];
    let connections: Vec<TcpStream> = (0..200)
        .map(|i| {
            let mut stream = TcpStream::connect(address).unwrap();
            stream.set_read_timeout(Some(TIMEOUT)).unwrap();
            stream.write_all(incomplete[i % 3].as_bytes()).unwrap();
            stream
        })
        .collect();
    let start = Instant::now();
    assert_eq!(
        send_request(address, &get_request("/", &address.to_string(), "")).0,
        "HTTP/1.1 200 OK"
    );
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
    for mut stream in connections {
        let end = stream.read_to_end(&mut Vec::new());
        assert!(end.is_ok() || end.is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionReset));
    }
}

#[test]
fn an_address_that_is_in_use_or_invalid_is_reported() {
    let listener = Listener::open("127.0.0.1:0").unwrap();
    let address = listener.address().unwrap().to_string();
    let error = Listener::open(&address).err().unwrap().to_string();
    assert!(error.starts_with(&address), "{error}");
    assert!(Listener::open("nowhere").is_err());
}
