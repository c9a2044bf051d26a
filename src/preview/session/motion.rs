//! Motion in the picture, for who looks at it: the scenes a frame before and after are read beside the render.

use super::Session;
use crate::animate::USUAL_FRAMES_PER_SECOND;
use crate::animate::velocity::VelocityMap;
use crate::preview::Host;
use crate::preview::command::Command;
use crate::preview::layer::Layer;
use crate::preview::screen::Motion;
use crate::preview::shared::Shared;
use crate::scene::Scene;
use std::sync::{Arc, OnceLock};

/// The scenes a frame before and a frame after, as soon as they are read.
pub(super) struct Neighbours(Arc<OnceLock<Result<[Scene; 2], String>>>);

impl Neighbours {
    /// Reads them on a thread of their own, and has the picture shown again.
    fn read(host: &Arc<dyn Host>, shared: &Arc<Shared>) -> Self {
        let slot = Arc::new(OnceLock::new());
        let (filled, host, shared) = (Arc::clone(&slot), Arc::clone(host), Arc::clone(shared));
        let read = move || {
            let frame = 1.0 / USUAL_FRAMES_PER_SECOND;
            let scenes = host.later(-frame).and_then(|before| Ok([before, host.later(frame)?]));
            // Nobody else fills it.
            let _ = filled.set(scenes);
            shared.send(Command::Redraw);
        };
        // Without a thread there is no answer, and the layer says that it waits for one.
        let _ = std::thread::Builder::new().name("neighbours".to_owned()).spawn(read);
        Self(slot)
    }
}

impl Session<'_> {
    /// Forgets what moves, as it is not known any more of another camera or scene.
    pub(super) fn forget_motion(&mut self) {
        self.screen.motion = Motion::Unknown("the scenes a frame before and after are being read");
    }

    /// Finds motion if somebody looks at it and it is not known.
    pub(super) fn find_motion(&mut self) {
        if matches!(self.screen.motion, Motion::Known { .. }) || !self.shared.is_watched(Layer::Velocity) {
            return;
        }
        let neighbours = self.neighbours.get_or_insert_with(|| Neighbours::read(self.host, self.shared));
        self.screen.motion = match neighbours.0.get() {
            None => return,
            Some(Err(_)) => Motion::Unknown("the scenes a frame before and after cannot be read"),
            Some(Ok([before, after])) => {
                // A camera in somebody's hand rests.
                let cameras = if self.hand.held.stands_like(&self.job.scene.camera) {
                    [&before.camera, &self.job.scene.camera, &after.camera]
                } else {
                    [&self.hand.held.camera; 3]
                };
                let VelocityMap { to_next, .. } = VelocityMap::seen_by(cameras, &self.tracer, before, after);
                Motion::Known { to_next_px: to_next, frames_per_second: USUAL_FRAMES_PER_SECOND }
            }
        };
    }
}
