//! All that a frame's file depends on, as a name: a frame whose record has another is made anew.

use super::Shot;
use fechner::adaptive::settings::LoopSettings;
use fechner::animate::FrameScenes;
use fechner::animate::eye::Eye;
use fechner::animate::track::TrackFrame;
use fechner::checkpoint::PROGRAM;
use fechner::denoise::Denoiser;
use fechner::scene::hash::content_hash;
use std::fmt::Debug;

impl Shot<'_> {
    /// The key of a frame that is made from these scenes and judged by these settings.
    pub(super) fn key(&self, settings: &LoopSettings, track: &TrackFrame, scenes: &FrameScenes) -> String {
        let follows_gaze = self.settings.eye == Eye::FollowsGaze;
        let gaze_velocity_deg_s = follows_gaze.then(|| self.settings.gaze_velocity_deg_s(track.frame));
        let denoiser = settings.denoiser.as_ref().map(Denoiser::name);
        // What the frame's own scene holds is part of its track.
        let parts: [(&str, &dyn Debug); 17] = [
            ("program", &PROGRAM),
            ("format", &self.format),
            ("track", track),
            ("scene of the frame before", &content_hash(&scenes.previous)),
            ("scene of the frame after", &content_hash(&scenes.next)),
            ("tracing", &self.settings.trace),
            ("sampling", &settings.sampling),
            ("denoiser", &denoiser),
            ("limits", &settings.limits),
            ("viewing", &settings.viewing),
            ("timing", &settings.frames),
            // What a picture says of itself, even where no eye sees frames follow one another.
            ("rate", &self.settings.frames_per_second),
            ("gazes", &settings.gazes),
            ("names of channels", &self.arguments.aov_names),
            ("velocity", &self.settings.velocity_of),
            ("eye", &(self.settings.eye, gaze_velocity_deg_s)),
            ("time", &self.arguments.time),
        ];
        let mut hasher = blake3::Hasher::new();
        for (name, value) in parts {
            hasher.update(format!("{name}: {value:?}\n").as_bytes());
        }
        hasher.finalize().to_hex()[..32].to_owned()
    }
}
