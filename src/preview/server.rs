//! The door: one page and one WebSocket, for who has the token and comes from the page itself.

use super::porch::{Porch, Stranger};
use super::shared::Shared;
use super::viewer::attend;
use axum::Router;
use axum::extract::{ConnectInfo, Query, State, WebSocketUpgrade};
use axum::http::{HeaderMap, HeaderName, StatusCode, header};
use axum::response::{Html, IntoResponse, Response};
use axum::routing::get;
use serde::Deserialize;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::Semaphore;

/// The page, whole: it asks for nothing else.
const PAGE: &str = include_str!("page.html");
/// Commands are small.
const MAX_MESSAGE_BYTES: usize = 1 << 14;
/// Viewers at a time; more are refused.
const MAX_VIEWERS: u32 = 64;
/// Time that viewers may take for the last frame when the preview closes.
const FAREWELL: Duration = Duration::from_secs(1);

/// Who is let in.
#[derive(Clone, Debug)]
pub struct Door {
    /// Where the server listens.
    pub address: SocketAddr,
    /// What an address must carry.
    pub token: String,
}

#[derive(Deserialize)]
struct Ticket {
    #[serde(default)]
    token: String,
}

#[derive(Clone)]
struct House {
    door: Arc<Door>,
    shared: Arc<Shared>,
    /// Seats that are free.
    seats: Arc<Semaphore>,
}

/// 128 bits from the system, in hexadecimal.
///
/// # Errors
/// If the system has none.
pub fn random_token() -> Result<String, getrandom::Error> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Serves until the preview closes and its viewers have the last frame.
pub(super) fn serve(listener: TcpListener, door: Door, shared: Arc<Shared>) -> std::io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build()?;
    let mut closing = shared.until_closing();
    let seats = Arc::new(Semaphore::new(MAX_VIEWERS as usize));
    let house = House { door: Arc::new(door), shared, seats: Arc::clone(&seats) };
    let served = runtime.block_on(async {
        listener.set_nonblocking(true)?;
        let porch = Porch::before(tokio::net::TcpListener::from_std(listener)?);
        let rooms = Router::new().route("/", get(page)).route("/ws", get(socket)).with_state(house);
        let rooms = rooms.into_make_service_with_connect_info::<Stranger>();
        tokio::select! {
            served = async { axum::serve(porch, rooms).await } => served?,
            _ = closing.wait_for(|&closing| closing) => {}
        }
        // All seats are free when everybody has left; who reads nothing is not waited for.
        let _ = tokio::time::timeout(FAREWELL, seats.acquire_many(MAX_VIEWERS)).await;
        Ok(())
    });
    runtime.shutdown_background();
    served
}

impl Door {
    /// Whether a request may come in. The token keeps other users and programs out; the origin other hosts' pages,
    /// which a browser that knows the token would otherwise let in; the host's name those that have their name point
    /// here.
    fn admits(&self, headers: &HeaderMap, ticket: &Ticket) -> bool {
        let text = |name: HeaderName| headers.get(name).and_then(|value| value.to_str().ok());
        let Some(host) = text(header::HOST) else { return false };
        let named_right = !self.address.ip().is_loopback() || is_local(host, self.address);
        let from_here = match headers.contains_key(header::ORIGIN) {
            false => true,
            true => text(header::ORIGIN).is_some_and(|origin| origin.strip_prefix("http://") == Some(host)),
        };
        named_right && from_here && is_same(ticket.token.as_bytes(), self.token.as_bytes())
    }
}

fn is_local(host: &str, address: SocketAddr) -> bool {
    let port = format!(":{}", address.port());
    let name = host.strip_suffix(&port).unwrap_or(if address.port() == 80 { host } else { "" });
    name == "localhost" || name.trim_matches(['[', ']']) == address.ip().to_string()
}

/// In a time that does not tell where they differ.
fn is_same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |different, (a, b)| different | (a ^ b)) == 0
}

fn refusal() -> Response {
    (StatusCode::FORBIDDEN, "403: open the address that fechner view printed, token included\n").into_response()
}

async fn page(State(house): State<House>, headers: HeaderMap, Query(ticket): Query<Ticket>) -> Response {
    if !house.door.admits(&headers, &ticket) {
        return refusal();
    }
    let policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; connect-src 'self' ws:; \
                  img-src blob: data:; frame-ancestors 'none'";
    let headers = [
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    (headers, Html(PAGE)).into_response()
}

async fn socket(
    State(house): State<House>,
    ConnectInfo(stranger): ConnectInfo<Stranger>,
    headers: HeaderMap,
    Query(ticket): Query<Ticket>,
    upgrade: WebSocketUpgrade,
) -> Response {
    if !house.door.admits(&headers, &ticket) {
        return refusal();
    }
    let Ok(seat) = house.seats.try_acquire_owned() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "503: there are too many viewers\n").into_response();
    };
    let shared = house.shared;
    upgrade.max_message_size(MAX_MESSAGE_BYTES).on_upgrade(move |socket| async move {
        stranger.let_in();
        attend(socket, shared).await;
        drop(seat);
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn admits(host: &str, origin: Option<&str>, token: &str) -> bool {
        let door = Door { address: "127.0.0.1:4000".parse().expect("an address"), token: "abc".to_owned() };
        let mut headers = HeaderMap::new();
        headers.insert(header::HOST, host.parse().expect("a host"));
        if let Some(origin) = origin {
            headers.insert(header::ORIGIN, origin.parse().expect("an origin"));
        }
        door.admits(&headers, &Ticket { token: token.to_owned() })
    }

    #[test]
    fn only_the_own_page_with_the_token_comes_in() {
        let (host, own) = ("127.0.0.1:4000", Some("http://127.0.0.1:4000"));
        assert!(admits(host, own, "abc") && admits(host, None, "abc"));
        assert!(admits("localhost:4000", Some("http://localhost:4000"), "abc"));
        for token in ["", "ab", "abd", "abcd"] {
            assert!(!admits(host, own, token), "{token}");
        }
        for origin in ["http://evil.example", "https://127.0.0.1:4000", "null", "http://127.0.0.1:4001"] {
            assert!(!admits(host, Some(origin), "abc"), "{origin}");
        }
        assert!(!admits("evil.example:4000", Some("http://evil.example:4000"), "abc"), "a name that points here");
        assert!(!admits("127.0.0.1:80", None, "abc"));
    }
}
