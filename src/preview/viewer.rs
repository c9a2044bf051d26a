//! One viewer: what a browser is sent, and what it says. What it asks for is done by the session.

use super::command::{Command, Inspected};
use super::layer::Layer;
use super::shared::{Encoded, Pointer, Seat, Shared};
use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket};
use fechner_perception::eccentricity::Gaze;
use fechner_perception::photometry::luminance;
use std::sync::Arc;
use tokio::sync::watch;

/// A layer that a viewer looks at.
struct Look {
    /// Held, so that frames of the layer are made.
    _seat: Seat,
    frames: watch::Receiver<Encoded>,
}

impl Look {
    fn at(shared: &Arc<Shared>, layer: Layer) -> Self {
        let seat = Seat::take(shared, layer);
        let mut frames = seat.frames();
        frames.mark_changed();
        Self { _seat: seat, frames }
    }

    /// A frame that has not been sent.
    fn unsent(&mut self) -> Option<Bytes> {
        let is_new = self.frames.has_changed().unwrap_or(false);
        is_new.then(|| self.frames.borrow_and_update().bytes.clone()).filter(|bytes| !bytes.is_empty())
    }
}

/// The next frame of a layer; never, if none is looked at.
async fn next_frame(look: &mut Option<Look>) -> Bytes {
    if let Some(Look { frames, .. }) = look
        && frames.changed().await.is_ok()
    {
        return frames.borrow_and_update().bytes.clone();
    }
    std::future::pending().await
}

/// What one viewer looks at and points to.
struct Viewer {
    shared: Arc<Shared>,
    look: Option<Look>,
    beside: Option<Look>,
    pointer: Pointer,
}

impl Viewer {
    fn of(shared: Arc<Shared>) -> Self {
        let look = Some(Look::at(&shared, Layer::Picture));
        Self { look, beside: None, pointer: Pointer::of(&shared), shared }
    }

    /// Does what it says; what it is answered.
    fn heed(&mut self, text: &str) -> Option<String> {
        match serde_json::from_str(text) {
            Ok(Command::Layer { layer }) => self.look = Some(Look::at(&self.shared, layer)),
            Ok(Command::Beside { layer }) => self.beside = layer.map(|layer| Look::at(&self.shared, layer)),
            Ok(Command::Gaze { at }) => {
                let is_place = |at: &[f64; 2]| at.iter().all(|place| place.is_finite());
                self.pointer.look_at(at.filter(is_place).map(|[x_px, y_px]| Gaze { x_px, y_px }));
            }
            Ok(Command::Inspect { x, y }) => return inspected(&self.shared, x, y),
            Ok(command) => self.shared.send(command),
            Err(error) => return Some(not_understood(&error)),
        }
        None
    }
}

/// Serves one viewer until it goes, or the preview closes and it has the last frame. It is sent the latest frame
/// whenever it has taken the one before.
pub(super) async fn attend(mut socket: WebSocket, shared: Arc<Shared>) {
    let mut status = shared.status();
    let mut closing = shared.until_closing();
    let mut viewer = Viewer::of(shared);
    status.mark_changed();
    loop {
        let answer = tokio::select! {
            said = socket.recv() => match said {
                Some(Ok(Message::Text(text))) => viewer.heed(&text).map(|answer| Message::Text(answer.into())),
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => None,
            },
            frame = next_frame(&mut viewer.look) => (!frame.is_empty()).then_some(Message::Binary(frame)),
            frame = next_frame(&mut viewer.beside) => (!frame.is_empty()).then_some(Message::Binary(frame)),
            Ok(()) = status.changed() => {
                let text = status.borrow_and_update().to_string();
                (!text.is_empty()).then(|| Message::Text(text.into()))
            }
            _ = closing.wait_for(|&closing| closing) => break,
        };
        if let Some(answer) = answer
            && socket.send(answer).await.is_err()
        {
            return;
        }
    }
    let looks = [&mut viewer.look, &mut viewer.beside];
    let last_frames = looks.into_iter().flatten().filter_map(Look::unsent).map(Message::Binary);
    let last_status = status.borrow_and_update().to_string();
    let last_status = Some(last_status).filter(|text| !text.is_empty()).map(|text| Message::Text(text.into()));
    for message in last_frames.chain(last_status).chain([Message::Close(None)]) {
        if socket.send(message).await.is_err() {
            return;
        }
    }
}

fn not_understood(error: &serde_json::Error) -> String {
    serde_json::json!({ "kind": "refused", "problem": error.to_string() }).to_string()
}

fn inspected(shared: &Shared, x: usize, y: usize) -> Option<String> {
    let snapshot = shared.snapshot()?;
    let (column, row) = (x / snapshot.step, y / snapshot.step);
    let pixel = row.checked_mul(snapshot.width)?.checked_add(column)?;
    let rgb_cd_m2 = *snapshot.composed.rgb_cd_m2.get(pixel).filter(|_| column < snapshot.width)?;
    let looked = snapshot.looked.as_ref();
    serde_json::to_string(&Inspected {
        kind: "inspected",
        x,
        y,
        rgb: rgb_cd_m2.map(|value| (f64::from(value) / snapshot.nits_per_unit) as f32),
        luminance_cd_m2: luminance(rgb_cd_m2),
        samples: snapshot.composed.samples[pixel],
        threshold_cd_m2: looked.map(|looked| looked.threshold.values()[pixel]),
        visibility: looked.map(|looked| looked.visibility.values()[pixel]),
    })
    .ok()
}
