//! The picture and its layers in tev, the viewer that rendering people use, over its own protocol.
//!
//! A thread of its own sends the latest state and none that it missed. A tev that is not there, or goes away, is told
//! about once; the render never waits for it, except that its end is given [`FAREWELL`] to arrive.

mod packet;
#[cfg(test)]
mod tests;

use super::spectator::{Shown, Spectator, Stage};
use crate::adaptive::statistics::picture_variance;
use crate::film::{Film, PixelFeatures};
use crate::output::channel;
use crate::poison::Unpoisoned as _;
use packet::Layer;
use std::io::Write;
use std::net::{SocketAddr, TcpStream};
use std::sync::{Arc, Condvar, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The port that tev listens on when nobody says otherwise.
pub const TEV_PORT: u16 = 14_158;
/// Time between two states at least, and this many times what making one took.
const INTERVAL: Duration = Duration::from_secs(1);
const TIMES_COST: u32 = 39;
/// For a tev that does not answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// For the last state.
const FAREWELL: Duration = Duration::from_secs(10);

/// What tev is to show.
struct Message {
    width: u32,
    height: u32,
    layers: Vec<Layer>,
}

#[derive(Default)]
struct Mailbox {
    latest: Option<Message>,
    /// No more will come.
    is_closed: bool,
    /// The sender is gone.
    has_ended: bool,
}

#[derive(Default)]
struct Post {
    mailbox: Mutex<Mailbox>,
    changed: Condvar,
}

/// A tev that is sent states of a picture.
pub struct Tev {
    post: Arc<Post>,
    sender: Option<JoinHandle<()>>,
    sent: Option<Instant>,
    cost: Duration,
}

impl Tev {
    /// Connects from a thread of its own. `name` is what tev lists; `warn` is told, once, if it cannot be
    /// reached, or not any more.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn new(addresses: Vec<SocketAddr>, name: String, warn: fn(&str)) -> std::io::Result<Self> {
        let post = Arc::new(Post::default());
        let of_sender = Arc::clone(&post);
        let work = move || {
            let sent =
                connect(&addresses).map_err(|error| format!("tev is not there to be shown the picture: {error}"));
            let sent = sent.and_then(|stream| {
                send(stream, &name, &of_sender)
                    .map_err(|error| format!("tev is not shown the picture any more: {error}"))
            });
            if let Err(problem) = sent {
                warn(&problem);
            }
            of_sender.mailbox.lock().unpoisoned().has_ended = true;
            of_sender.changed.notify_all();
        };
        let sender = std::thread::Builder::new().name("tev".to_owned()).spawn(work)?;
        Ok(Self { post, sender: Some(sender), sent: None, cost: Duration::ZERO })
    }

    /// Whether a state that is still changing would be taken.
    pub fn is_due(&self) -> bool {
        let wait = INTERVAL.max(self.cost * TIMES_COST);
        self.sent.is_none_or(|sent| sent.elapsed() >= wait) && !self.has_ended()
    }

    fn has_ended(&self) -> bool {
        self.post.mailbox.lock().unpoisoned().has_ended
    }

    /// Hands a state over if one is due.
    pub fn offer(&mut self, shown: &Shown<'_>) {
        let is_wanted = match shown.stage {
            Stage::AtRest => !self.has_ended(),
            Stage::UnderWay => self.is_due(),
        };
        // What is shown while the camera moves is too coarse to be looked into.
        if !is_wanted || shown.step != 1 {
            return;
        }
        let begun = Instant::now();
        let message = message(shown);
        self.post.mailbox.lock().unpoisoned().latest = Some(message);
        self.post.changed.notify_all();
        self.sent = Some(Instant::now());
        self.cost = begun.elapsed();
    }
}

impl Spectator for Tev {
    fn shown(&mut self, shown: &Shown<'_>) {
        self.offer(shown);
    }
}

impl Drop for Tev {
    fn drop(&mut self) {
        let mut mailbox = self.post.mailbox.lock().unpoisoned();
        mailbox.is_closed = true;
        self.post.changed.notify_all();
        let until = Instant::now() + FAREWELL;
        while !mailbox.has_ended {
            let Some(left) = until.checked_duration_since(Instant::now()) else { return };
            mailbox = self.post.changed.wait_timeout(mailbox, left).unpoisoned().0;
        }
        drop(mailbox);
        if let Some(sender) = self.sender.take() {
            // A thread that panicked has said so.
            let _ = sender.join();
        }
    }
}

/// Sends states as they come, until no more will.
fn send(mut stream: TcpStream, name: &str, post: &Post) -> std::io::Result<()> {
    stream.set_write_timeout(Some(PATIENCE))?;
    let mut size = None;
    while let Some(Message { width, height, layers }) = next(post) {
        // Channels come and go with the first look.
        let channels: Vec<&str> = layers.iter().flat_map(|layer| layer.names.iter().copied()).collect();
        let form = (width, height, channels.len());
        if size != Some(form) {
            stream.write_all(&packet::create(name, width, height, &channels))?;
            size = Some(form);
        }
        for layer in &layers {
            stream.write_all(&packet::update(name, width, height, layer))?;
        }
    }
    stream.flush()
}

fn connect(addresses: &[SocketAddr]) -> std::io::Result<TcpStream> {
    let mut last = std::io::Error::from(std::io::ErrorKind::AddrNotAvailable);
    for address in addresses {
        match TcpStream::connect_timeout(address, PATIENCE) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// The latest state, once there is one that was not sent.
fn next(post: &Post) -> Option<Message> {
    let mut mailbox = post.mailbox.lock().unpoisoned();
    loop {
        if let Some(message) = mailbox.latest.take() {
            return Some(message);
        }
        if mailbox.is_closed {
            return None;
        }
        mailbox = post.changed.wait(mailbox).unpoisoned();
    }
}

/// The picture in scene units and its layers.
fn message(shown: &Shown<'_>) -> Message {
    let Shown { film, rgb_cd_m2, looked, nits_per_unit, .. } = *shown;
    let to_units = (1.0 / nits_per_unit) as f32;
    let picture = |c: usize| rgb_cd_m2.iter().map(move |rgb| rgb[c] * to_units);
    let guide = |of: fn(&PixelFeatures) -> f32| film.features().iter().map(of);
    let layer = |names: &[&'static str], values: Vec<f32>| Layer { names: names.to_vec(), values };
    let mut layers = vec![
        layer(&channel::RGB, (0..3).flat_map(picture).collect()),
        layer(
            &channel::ALBEDO,
            guide(|g| g.albedo[0]).chain(guide(|g| g.albedo[1])).chain(guide(|g| g.albedo[2])).collect(),
        ),
        layer(
            &channel::NORMAL,
            guide(|g| g.normal[0]).chain(guide(|g| g.normal[1])).chain(guide(|g| g.normal[2])).collect(),
        ),
        layer(&[channel::DEPTH], guide(|g| g.depth).collect()),
        layer(&[channel::SAMPLES], counts(film)),
        layer(&[channel::VARIANCE], picture_variance(film, nits_per_unit).into_values()),
    ];
    if let Some(looked) = looked {
        layers.push(layer(&[channel::THRESHOLD], looked.threshold.values().to_vec()));
        layers.push(layer(&[channel::VISIBILITY], looked.visibility.values().to_vec()));
    }
    Message { width: film.width(), height: film.height(), layers }
}

fn counts(film: &Film) -> Vec<f32> {
    (0..film.pixel_count()).map(|pixel| film.samples(pixel) as f32).collect()
}
