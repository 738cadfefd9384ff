//! The server only answers requests of its own pages.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use wgray_dev::{Command, Listener, Move};

use super::running::{Files, LONGEST, SCENE, serve};

fn ask(address: SocketAddr, request: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(LONGEST)).unwrap();
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    let mut buffer = [0; 4096];
    while !is_whole(&answer) {
        let n = stream.read(&mut buffer).unwrap();
        assert_ne!(n, 0, "the answer breaks off: {answer}");
        answer.push_str(&String::from_utf8_lossy(&buffer[..n]));
    }
    (answer.lines().next().unwrap_or_default().to_string(), answer)
}

fn is_whole(answer: &str) -> bool {
    let Some((head, body)) = answer.split_once("\r\n\r\n") else {
        return false;
    };
    let length = head
        .lines()
        .find_map(|line| line.to_lowercase().strip_prefix("content-length: ")?.parse().ok());
    head.starts_with("HTTP/1.1 101") || body.len() >= length.unwrap_or(usize::MAX)
}

fn get(path: &str, host: &str, more: &str) -> String {
    format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{more}Connection: close\r\n\r\n")
}

fn upgrade(host: &str, origin: &str) -> String {
    format!(
        "GET /socket HTTP/1.1\r\nHost: {host}\r\n{origin}Connection: Upgrade\r\nUpgrade: websocket\r\n\
         Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
    )
}

#[test]
fn the_server_answers_its_own_pages_only() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let (session, address) = serve(running);
    let (own, port) = (address.to_string(), address.port());

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
        let (status, text) = ask(address, &get(path, &own, ""));
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
        assert_eq!(ask(address, &get(path, &own, "")).0, "HTTP/1.1 404 Not Found", "{path}");
    }
    let refused = "HTTP/1.1 403 Forbidden";
    for host in [
        "evil.example",
        &format!("evil.example:{port}"),
        "192.168.0.1",
        "127.0.0.1.evil.example",
    ] {
        assert_eq!(ask(address, &get("/", host, "")).0, refused, "{host}");
        assert_eq!(
            ask(address, &get(&format!("http://{host}/"), &own, "")).0,
            refused,
            "{host}"
        );
        assert_eq!(
            ask(address, &upgrade(host, &format!("Origin: http://{host}\r\n"))).0,
            refused,
            "{host}"
        );
    }
    for origin in [
        "Origin: http://evil.example\r\n",
        "Origin: null\r\n",
        "Origin: http://127.0.0.1:1\r\n",
        "",
    ] {
        assert_eq!(ask(address, &upgrade(&own, origin)).0, refused, "{origin}");
    }
    assert_eq!(
        ask(address, &get("/", &own, "Origin: http://evil.example\r\n")).0,
        refused
    );
    let accepted = ask(address, &upgrade(&own, &format!("Origin: http://{own}\r\n"))).0;
    assert_eq!(accepted, "HTTP/1.1 101 Switching Protocols");

    // The number of viewers is limited; one that disconnects makes room.
    let request = upgrade(&own, &format!("Origin: http://{own}\r\n"));
    let mut open = Vec::new();
    let full = loop {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(LONGEST)).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        let mut head = [0; 12];
        stream.read_exact(&mut head).unwrap();
        if head != *b"HTTP/1.1 101" {
            break head;
        }
        open.push(stream);
        assert!(open.len() <= 16, "the number of viewers is not limited");
    };
    assert_eq!(full, *b"HTTP/1.1 503");
    assert!(open.len() >= 15, "{}", open.len());
    // Viewers that read no messages do not block the session.
    for _ in 0..20 {
        let revision = session.revision();
        session.session.send(Command::Move(Move::Orbit(0.1, 0.0)));
        session.wait_done(revision);
    }
    // Too large, which ends the connection: 5,000 bytes of text, masked with zeros.
    let mut large = vec![0x81, 0x80 | 126, 0x13, 0x88, 0, 0, 0, 0];
    large.resize(8 + 5000, b' ');
    let mut stream = open.pop().unwrap();
    stream.write_all(&large).unwrap();
    let mut rest = Vec::new();
    let end = stream.read_to_end(&mut rest);
    assert!(end.is_ok() || end.is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionReset));
    drop(open);
    session.wait("a free place", |_| {
        (ask(address, &request).0 == "HTTP/1.1 101 Switching Protocols").then_some(())
    });
}

#[test]
fn images_are_not_sent_to_foreign_origins_and_accepted_from_the_page_only() {
    let files = Files::new(SCENE);
    let running = files.start();
    running.wait_rendered(&files);
    let (session, address) = serve(running);
    let own = address.to_string();
    for (path, kind) in [("/picture.png", "image/png"), ("/picture.exr", "image/x-exr")] {
        let (status, text) = ask(address, &get(path, &own, ""));
        assert_eq!(status, "HTTP/1.1 200 OK", "{path}");
        assert!(text.contains(kind) && text.contains("same-origin"), "{path}");
        let foreign = get(path, &own, "Origin: http://evil.example\r\n");
        assert_eq!(ask(address, &foreign).0, "HTTP/1.1 403 Forbidden");
    }
    let give = |origin: &str| {
        let head = format!("POST /reference/a%20b.png HTTP/1.1\r\nHost: {own}\r\n{origin}Content-Length: 10\r\n\r\n");
        ask(address, &(head + "not image."))
    };
    let page = format!("Origin: http://{own}\r\n");
    for origin in ["", "Origin: null\r\n", "Origin: http://evil.example\r\n"] {
        assert_eq!(give(origin).0, "HTTP/1.1 403 Forbidden", "{origin}");
    }
    let (status, text) = give(&page);
    assert_eq!(status, "HTTP/1.1 422 Unprocessable Entity");
    assert!(text.contains("a b.png: "), "{text}");
    assert_eq!(session.state().comparable, (false, None));
    assert_eq!(
        ask(address, &get("/reference/a", &own, "")).0,
        "HTTP/1.1 405 Method Not Allowed"
    );
}

#[test]
fn incomplete_requests_time_out_and_do_not_block_others() {
    let files = Files::new(SCENE);
    let (_, address) = serve(files.start());
    let halves = [
        "",
        "GET / HTTP/1.1\r\nHost: ",
        &format!("POST / HTTP/1.1\r\nHost: {address}\r\nContent-Length: 9\r\n\r\nx"),
    ];
    let open: Vec<TcpStream> = (0..200)
        .map(|i| {
            let mut stream = TcpStream::connect(address).unwrap();
            stream.set_read_timeout(Some(LONGEST)).unwrap();
            stream.write_all(halves[i % 3].as_bytes()).unwrap();
            stream
        })
        .collect();
    let start = Instant::now();
    assert_eq!(ask(address, &get("/", &address.to_string(), "")).0, "HTTP/1.1 200 OK");
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
    for mut stream in open {
        let end = stream.read_to_end(&mut Vec::new());
        assert!(end.is_ok() || end.is_err_and(|error| error.kind() == std::io::ErrorKind::ConnectionReset));
    }
}

#[test]
fn an_address_that_is_in_use_or_invalid_is_reported() {
    let listener = Listener::open("127.0.0.1:0").unwrap();
    let place = listener.address().unwrap().to_string();
    let error = Listener::open(&place).err().unwrap().to_string();
    assert!(error.starts_with(&place), "{error}");
    assert!(Listener::open("nowhere").is_err());
}
