//! A live preview of a render in a browser.
//!
//! [`start`] renders on a thread of its own by the ordinary loop of [`crate::adaptive`], so that what stands at the end
//! has the bytes of `fechner render`, and shows it to any number of viewers over a WebSocket. The order of work:
//!
//! 1. while the camera moves, and at first, a `glimpse` of as many pixels as a frame has time for;
//! 2. the loop, in batches of about 25 ms, between which `session` obeys what viewers ask; its pilot goes from coarse
//!    to fine (`coarse`);
//! 3. `screen` turns film into encoded frames, at intervals that follow the picture's age and a frame's
//!    price, and never more than viewers look at.
//!
//! Viewers get the latest frame and none that they missed, so a slow one costs nobody else anything. Not for pictures
//! that should be kept or compared: `render` writes those, and so does "save" here.

mod audience;
mod coarse;
mod command;
mod composed;
mod files;
mod frame;
mod glimpse;
mod layer;
mod orbit;
mod porch;
mod screen;
mod server;
mod session;
mod shared;
mod spectator;
mod tev;
mod viewer;

pub use audience::Audience;
pub use screen::Looked;
pub use server::{Door, random_token};
pub use spectator::{Shown, Spectator, Stage};
pub use tev::{TEV_PORT, Tev};

use crate::adaptive::Rendered;
use crate::adaptive::settings::{Limits, LoopSettings};
use crate::checkpoint::SettingsRecord;
use crate::integrator::TraceSettings;
use crate::scene::Scene;
use fechner_perception::Plane;
use fechner_perception::tone::SceneLight;
use shared::Shared;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most pixels a side of a picture that is shown: a JPEG has 16 bits for them, and Chromium's canvas ends
/// there, other browsers' earlier.
pub const MAX_SIDE_PIXELS: u32 = u16::MAX as u32;

/// A loaded scene and how to render it.
pub struct Job {
    /// The scene.
    pub scene: Arc<Scene>,
    /// How its samples are traced.
    pub trace: TraceSettings,
    /// Settings: for whom, by which rule and operator.
    pub record: SettingsRecord,
    /// Area in deg² over which the eye sums contrast, on whichever display; none is the display's own.
    pub csf_area_deg2: Option<f64>,
    /// When to stop.
    pub limits: Limits,
    /// What thresholds are multiplied by.
    pub importance: Option<Plane>,
    /// How light the whole is of which the picture is a part, seen by the scene's camera: what the operator is
    /// fitted to, whichever it is.
    pub whole: Option<SceneLight>,
}

/// Who knows where the scene comes from and how pictures are written.
pub trait Host: Send + Sync {
    /// The scene as its file now is.
    ///
    /// # Errors
    /// In words for the user.
    fn load(&self) -> Result<Job, String>;

    /// The scene as it is so many seconds later, as the file now is; for its motion.
    ///
    /// # Errors
    /// In words for the user.
    fn later(&self, seconds: f64) -> Result<Scene, String>;

    /// Writes a picture in the format that the name's ending asks for.
    ///
    /// # Errors
    /// In words for the user.
    fn save(&self, path: &Path, rendered: &Rendered, settings: &LoopSettings) -> Result<(), String>;

    /// The scene's file, by whose name pictures are called.
    fn scene_file(&self) -> &Path;

    /// The files whose changes make the scene load again, whether or not they are there.
    fn watched_files(&self) -> Vec<PathBuf>;
}

/// What a preview does beside showing the picture to browsers.
#[derive(Default)]
pub struct Options {
    /// Whether viewers' pointers stand for their gaze: see [`LoopSettings::gazes`].
    pub is_foveated: bool,
    /// Who else is shown each frame.
    pub spectators: Vec<Box<dyn Spectator>>,
}

/// A preview under way.
pub struct Preview {
    shared: Arc<Shared>,
    threads: Vec<std::thread::JoinHandle<()>>,
}

/// A way to end a preview from elsewhere, such as from a signal's handler.
#[derive(Clone)]
pub struct Closer(Arc<Shared>);

impl Closer {
    /// Ends rendering and serving; returns at once.
    pub fn close(&self) {
        self.0.close();
    }
}

/// Renders `job` in `pool` on a thread of its own, and watches the scene's files from another.
///
/// # Errors
/// If the system gives no thread.
pub fn start(job: Job, host: Arc<dyn Host>, options: Options, pool: rayon::ThreadPool) -> std::io::Result<Preview> {
    let shared = Arc::new(Shared::new());
    let host_of_watch = Arc::clone(&host);
    let thread = |name: &str| std::thread::Builder::new().name(name.to_owned());
    let (of_render, of_watch) = (Arc::clone(&shared), Arc::clone(&shared));
    let render = thread("preview").spawn(move || pool.install(|| session::run(job, &host, options, &of_render)))?;
    let watch = thread("scene-files").spawn(move || files::watch(host_of_watch.as_ref(), &of_watch))?;
    Ok(Preview { shared, threads: vec![render, watch] })
}

impl Preview {
    /// A way to end it.
    pub fn closer(&self) -> Closer {
        Closer(Arc::clone(&self.shared))
    }

    /// Serves viewers at the door until the preview is closed, then waits for its threads.
    ///
    /// # Errors
    /// If the listener cannot be used.
    pub fn serve(self, listener: TcpListener, door: Door) -> std::io::Result<()> {
        let served = server::serve(listener, door, Arc::clone(&self.shared));
        self.shared.close();
        for thread in self.threads {
            // A thread that panicked has said so.
            let _ = thread.join();
        }
        served
    }
}
