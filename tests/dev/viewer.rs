//! A WebSocket client that stands in for the page.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::running::TIMEOUT;

/// A connection of a viewer.
pub struct Viewer {
    stream: TcpStream,
    /// Maximum rate of received bytes per second.
    rate: Option<f64>,
}

/// A message from the server.
pub enum Received {
    /// A text message.
    Text(Value),
    /// The header of a frame, and the size of its message in bytes.
    Frame(Value, usize),
}

impl Viewer {
    pub fn new(address: SocketAddr) -> Viewer {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(TIMEOUT)).unwrap();
        let request = format!(
            "GET /socket HTTP/1.1\r\nHost: {address}\r\nOrigin: http://{address}\r\nConnection: Upgrade\r\n\
             Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).unwrap();
        let mut response_head = Vec::new();
        while !response_head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            response_head.push(byte[0]);
        }
        assert!(response_head.starts_with(b"HTTP/1.1 101"));
        Viewer { stream, rate: None }
    }

    /// Connects a viewer that reads at most `rate` bytes per second.
    pub fn slow(address: SocketAddr, rate: f64) -> Viewer {
        Viewer {
            rate: Some(rate),
            ..Viewer::new(address)
        }
    }

    /// Sends bytes as a text message, masked with zeros.
    pub fn send_text(&mut self, text: &[u8]) -> std::io::Result<()> {
        let mut bytes = vec![0x81, 0x80 | 127];
        bytes.extend((text.len() as u64).to_be_bytes());
        bytes.extend([0; 4]);
        bytes.extend(text);
        self.stream.write_all(&bytes)
    }

    /// Returns a second handle of the connection, for sending only.
    pub fn sender(&self) -> Viewer {
        Viewer {
            stream: self.stream.try_clone().unwrap(),
            rate: None,
        }
    }

    /// Acknowledges a frame.
    pub fn acknowledge(&mut self, header: &Value) {
        let message = json!({ "shown": header["number"] }).to_string();
        self.send_text(message.as_bytes()).unwrap();
    }

    /// Sets the maximum time to wait for each message.
    pub fn set_timeout(&self, timeout: Duration) {
        self.stream.set_read_timeout(Some(timeout)).unwrap();
    }

    /// Returns the next message, or `None` at the end of the connection or after the timeout.
    pub fn receive(&mut self) -> Option<Received> {
        loop {
            let [opcode, short_length] = self.read::<2>()?;
            let length = match short_length {
                126 => u64::from(u16::from_be_bytes(self.read()?)),
                127 => u64::from_be_bytes(self.read()?),
                length => u64::from(length),
            };
            let mut body = vec![0; length as usize];
            self.fill(&mut body)?;
            match opcode & 0xf {
                1 => return Some(Received::Text(serde_json::from_slice(&body).unwrap())),
                2 => {
                    let header_length = u32::from_le_bytes(body[..4].try_into().unwrap()) as usize;
                    let header = serde_json::from_slice(&body[4..4 + header_length]).unwrap();
                    return Some(Received::Frame(header, body.len()));
                }
                8 => return None,
                _ => {}
            }
        }
    }

    /// Returns the next text message, or `None` in the cases of [`Viewer::receive`].
    pub fn receive_text(&mut self) -> Option<Value> {
        loop {
            if let Received::Text(message) = self.receive()? {
                return Some(message);
            }
        }
    }

    fn read<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Some(bytes)
    }

    fn fill(&mut self, bytes: &mut [u8]) -> Option<()> {
        let Some(rate) = self.rate else {
            return self.stream.read_exact(bytes).ok();
        };
        for chunk in bytes.chunks_mut(4096) {
            let start = Instant::now();
            self.stream.read_exact(chunk).ok()?;
            let min_time = Duration::from_secs_f64(chunk.len() as f64 / rate);
            std::thread::sleep(min_time.saturating_sub(start.elapsed()));
        }
        Some(())
    }

    /// Sends a message that must be rejected. Returns the reason, which is in the answer or in a later state.
    #[track_caller]
    pub fn send_rejected(&mut self, text: &str) -> String {
        self.send_text(text.as_bytes()).unwrap();
        let mut command = None;
        loop {
            let message = self.receive_text().unwrap();
            if let Some(reason) = message.get("refused") {
                return reason.as_str().unwrap().to_owned();
            }
            command = message.get("asked").and_then(Value::as_u64).or(command);
            let notice = &message["state"]["notice"];
            if command.is_some() && notice["command"].as_u64() == command {
                assert_eq!(notice["bad"], json!(true), "{text}: {notice}");
                return notice["text"].as_str().unwrap().to_owned();
            }
            let executed = message["state"]["executed"].as_u64();
            assert!(command.is_none() || executed < command, "{text} was executed");
        }
    }
}
