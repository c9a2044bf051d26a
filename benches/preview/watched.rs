//! A preview that somebody watches over a socket, and what was shown when.

use crate::support::CpuClock;
use anyhow::{Context, Result};
use fechner::adaptive::Rendered;
use fechner::adaptive::settings::LoopSettings;
use fechner::preview::{Closer, Door, Host, Job, Options, Shown, Spectator, Stage, start};
use fechner::scene::Scene;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest;

/// A scene that never changes, and pictures that nobody keeps.
struct Nowhere(PathBuf);

impl Host for Nowhere {
    fn load(&self) -> Result<Job, String> {
        Err("there is no file".to_owned())
    }

    fn later(&self, _: f64) -> Result<Scene, String> {
        Err("there is no file".to_owned())
    }

    fn save(&self, _: &Path, _: &Rendered, _: &LoopSettings) -> Result<(), String> {
        Err("nothing is kept".to_owned())
    }

    fn scene_file(&self) -> &Path {
        &self.0
    }

    fn watched_files(&self) -> Vec<PathBuf> {
        Vec::new()
    }
}

/// What a preview's time is measured by.
pub(super) enum Clock {
    /// The processor time of the one thread that renders.
    OfThread(CpuClock),
    /// The wall's, where several do.
    Wall(Instant),
}

impl Clock {
    pub(super) fn start(pool: &rayon::ThreadPool) -> Self {
        match pool.current_num_threads() {
            1 => Self::OfThread(pool.install(CpuClock::of_thread)),
            _ => Self::Wall(Instant::now()),
        }
    }

    pub(super) fn seconds(&self) -> f64 {
        match self {
            Self::OfThread(clock) => clock.seconds(),
            Self::Wall(begun) => begun.elapsed().as_secs_f64(),
        }
    }
}

/// A moment of a picture.
pub(super) struct Moment {
    pub(super) seconds: f64,
    pub(super) samples: u64,
    /// Pixels of the picture to each of these, each way.
    pub(super) step: u32,
    pub(super) width: usize,
    /// Where it was asked for.
    pub(super) rgb_cd_m2: Vec<[f32; 3]>,
    pub(super) is_at_rest: bool,
}

/// Tells of every frame; its own time does not count.
struct Watcher {
    clock: Clock,
    own_seconds: f64,
    keeps_pictures: bool,
    moments: Sender<Moment>,
}

impl Spectator for Watcher {
    fn shown(&mut self, shown: &Shown<'_>) {
        let begun = self.clock.seconds();
        let moment = Moment {
            seconds: begun - self.own_seconds,
            samples: shown.film.total_samples(),
            step: shown.step,
            width: shown.film.width() as usize,
            rgb_cd_m2: if self.keeps_pictures { shown.rgb_cd_m2.to_vec() } else { Vec::new() },
            is_at_rest: shown.stage == Stage::AtRest,
        };
        // Nobody listens any more at the end.
        let _ = self.moments.send(moment);
        self.own_seconds += self.clock.seconds() - begun;
    }
}

/// A preview that somebody watches over a socket, ended when dropped.
pub(super) struct Watched {
    pub(super) moments: Receiver<Moment>,
    closer: Closer,
    threads: Vec<std::thread::JoinHandle<()>>,
}

impl Watched {
    /// Starts to render a job, and somebody's watching. The clock starts before anything is made of the loaded scene.
    pub(super) fn start(pool: rayon::ThreadPool, job: Job, keeps_pictures: bool) -> Result<Self> {
        let (sender, moments) = channel();
        let watcher = Watcher { clock: Clock::start(&pool), own_seconds: 0.0, keeps_pictures, moments: sender };
        let options = Options { is_foveated: false, spectators: vec![Box::new(watcher)] };
        let host = Arc::new(Nowhere(PathBuf::from("nowhere.toml")));
        let listener = TcpListener::bind("127.0.0.1:0")?;
        let address = listener.local_addr()?;
        let viewer = move || {
            let stream = TcpStream::connect(address)?;
            let request = format!("ws://{address}/ws?token=bench").into_client_request()?;
            let (mut socket, _) = tungstenite::client(request, stream).map_err(|error| anyhow::anyhow!("{error}"))?;
            while socket.read().is_ok() {}
            anyhow::Ok(())
        };
        let viewer = std::thread::spawn(move || drop(viewer()));
        let preview = start(job, host, options, pool)?;
        let closer = preview.closer();
        let door = Door { address, token: "bench".to_owned() };
        let server = std::thread::spawn(move || drop(preview.serve(listener, door)));
        Ok(Self { moments, closer, threads: vec![server, viewer] })
    }

    /// All moments up to the first that is `last`.
    pub(super) fn until(&self, last: impl Fn(&Moment) -> bool) -> Result<Vec<Moment>> {
        let mut moments = Vec::new();
        loop {
            let moment = self.moments.recv_timeout(Duration::from_secs(300)).context("the preview says nothing")?;
            let is_last = last(&moment);
            moments.push(moment);
            if is_last {
                return Ok(moments);
            }
        }
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        self.closer.close();
        self.threads.drain(..).for_each(|thread| drop(thread.join()));
    }
}
