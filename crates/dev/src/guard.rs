//! Checks requests. Other web pages in the user's browser must not reach the session, neither by DNS rebinding (foreign
//! Host) nor by a WebSocket (foreign Origin).

use std::net::IpAddr;

use axum::http::uri::Authority;
use axum::http::{HeaderMap, HeaderName, Uri, header};

#[derive(Clone, Debug)]
pub struct Guard {
    /// The host name that the server listens on; `None` if it listens on an IP address.
    pub name: Option<String>,
    /// True if the server listens only on loopback.
    pub loopback: bool,
}

impl Guard {
    /// Checks a request. `must_have_origin` is true for a request that can change the session.
    ///
    /// # Errors
    ///
    /// The reason, as text for the client.
    pub fn check(&self, target: &Uri, headers: &HeaderMap, must_have_origin: bool) -> Result<(), &'static str> {
        let host = single_value(headers, header::HOST).and_then(|host| host.parse::<Authority>().ok());
        let host = host
            .filter(|host| self.accepts(host))
            .ok_or("this Host is not allowed")?;
        if target.authority().is_some_and(|authority| *authority != host) {
            return Err("this Host is not allowed"); // an absolute URL of another host
        }
        match (
            single_value(headers, header::ORIGIN),
            headers.contains_key(header::ORIGIN),
        ) {
            // The scheme is not compared, because a tunnel or a proxy may use https.
            (Some(origin), _) => {
                let authority = origin
                    .strip_prefix("http://")
                    .or_else(|| origin.strip_prefix("https://"));
                if authority.is_some_and(|authority| authority.eq_ignore_ascii_case(host.as_str())) {
                    Ok(())
                } else {
                    Err("requests from other pages are not allowed")
                }
            }
            (None, true) => Err("requests from other pages are not allowed"),
            (None, false) if must_have_origin => Err("this request must have an Origin"),
            (None, false) => Ok(()),
        }
    }

    /// Returns true if a host may be used: an address, `localhost` or the name of the server. Other names may be
    /// redirected to this machine by DNS. Any port is accepted, because tunnels change the port.
    fn accepts(&self, host: &Authority) -> bool {
        if host.as_str().contains('@') {
            return false;
        }
        let name = host.host();
        let address = name
            .strip_prefix('[')
            .and_then(|name| name.strip_suffix(']'))
            .unwrap_or(name);
        if let Ok(address) = address.parse::<IpAddr>() {
            return !self.loopback || address.is_loopback();
        }
        name.eq_ignore_ascii_case("localhost")
            || self
                .name
                .as_ref()
                .is_some_and(|server| name.eq_ignore_ascii_case(server))
    }
}

/// Returns the value of a header that occurs exactly once.
fn single_value(headers: &HeaderMap, name: HeaderName) -> Option<&str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?;
    values.next().is_none().then(|| value.to_str().ok()).flatten()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn accepts(guard: &Guard, host: &str, origin: Option<&str>, must_have_origin: bool) -> bool {
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().unwrap());
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().unwrap());
        }
        guard.check(&Uri::from_static("/"), &headers, must_have_origin).is_ok()
    }

    #[test]
    fn only_loopback_names_reach_a_loopback_server() {
        let guard = Guard {
            name: None,
            loopback: true,
        };
        for host in [
            "localhost:7878",
            "LocalHost",
            "127.0.0.1:7878",
            "127.3.2.1",
            "[::1]:7878",
            "localhost:9000",
        ] {
            assert!(accepts(&guard, host, None, false), "{host}");
        }
        for host in [
            "evil.example:7878",
            "localhost.evil.example",
            "localhost.",
            "127.0.0.1.evil.example",
            "192.168.1.2:7878",
            "user@localhost",
            "localhost@evil.example",
            "",
            "[::1",
            "0.0.0.0:7878",
        ] {
            assert!(!accepts(&guard, host, None, false), "{host}");
        }
    }

    #[test]
    fn other_servers_accept_addresses_and_their_own_name() {
        let guard = Guard {
            name: Some("studio".to_string()),
            loopback: false,
        };
        for host in ["192.168.1.2:7878", "studio:7878", "[fe80::1]", "localhost"] {
            assert!(accepts(&guard, host, None, false), "{host}");
        }
        for host in ["studio.evil.example", "evil.example"] {
            assert!(!accepts(&guard, host, None, false), "{host}");
        }
    }

    #[test]
    fn the_origin_must_equal_the_host() {
        let guard = Guard {
            name: None,
            loopback: true,
        };
        let host = "localhost:7878";
        assert!(accepts(&guard, host, Some("http://localhost:7878"), true));
        assert!(accepts(&guard, host, Some("https://localhost:7878"), true));
        assert!(
            !accepts(&guard, host, None, true),
            "a socket without an origin is accepted"
        );
        for origin in [
            "http://localhost:3000",
            "http://127.0.0.1:7878",
            "https://evil.example",
            "null",
            "",
            "file://",
        ] {
            assert!(!accepts(&guard, host, Some(origin), true), "{origin}");
            assert!(!accepts(&guard, host, Some(origin), false), "{origin}");
        }
    }

    #[test]
    fn a_target_with_another_authority_is_rejected() {
        let guard = Guard {
            name: None,
            loopback: true,
        };
        let mut headers = HeaderMap::new();
        headers.append(header::HOST, "localhost:7878".parse().unwrap());
        assert!(
            guard
                .check(&Uri::from_static("http://LOCALHOST:7878/"), &headers, false)
                .is_ok()
        );
        for target in [
            "http://evil.example/",
            "http://localhost/",
            "http://localhost:7878@evil.example/",
        ] {
            assert!(
                guard.check(&target.parse().unwrap(), &headers, false).is_err(),
                "{target}"
            );
        }
    }

    #[test]
    fn a_missing_or_duplicate_host_is_rejected() {
        let guard = Guard {
            name: None,
            loopback: true,
        };
        assert!(guard.check(&Uri::from_static("/"), &HeaderMap::new(), false).is_err());
        let mut headers = HeaderMap::new();
        headers.append(header::HOST, "localhost".parse().unwrap());
        assert!(guard.check(&Uri::from_static("/"), &headers, false).is_ok());
        headers.append(header::HOST, "evil.example".parse().unwrap());
        assert!(guard.check(&Uri::from_static("/"), &headers, false).is_err());
    }
}
