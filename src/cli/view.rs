//! `fechner view`: a render in a browser, while it is made. What its page shows is left to `fechner::preview`.

use super::finished::{Finished, PictureTarget};
use super::in_a_line;
use super::job::{JobArguments, Prepared};
use super::report::Report;
use super::signals;
use super::tev::TevArguments;
use anyhow::{Context, bail};
use clap::Args;
use fechner::adaptive::Rendered;
use fechner::adaptive::settings::LoopSettings;
use fechner::checkpoint::SettingsRecord;
use fechner::integrator::{Crop, TraceSettings};
use fechner::output::{self, PartOf};
use fechner::poison::Unpoisoned as _;
use fechner::preview::{self, Audience, Door, Host, Job, MAX_SIDE_PIXELS, Options, Spectator};
use fechner::scene::{Scene, load};
use fechner_perception::model;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, TcpListener, UdpSocket};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

/// Arguments of `view`.
#[derive(Debug, Args)]
pub(super) struct ViewArguments {
    #[command(flatten)]
    job: JobArguments,
    /// Port to listen on; 0 takes a free one.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true, help_heading = "Serving")]
    port: u16,
    /// Address to listen on. Others than this machine's own let everybody in who has the printed address.
    #[arg(long, value_name = "IP", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST), help_heading = "Serving")]
    host: IpAddr,
    /// Take the pointer for the gaze: thresholds rise away from it, as castleCSF says, and samples go where one looks
    /// first. Outside the picture it stands for nothing, and the whole picture counts as looked at.
    #[arg(long, help_heading = "Seeing")]
    foveated: bool,
    #[command(flatten)]
    tev: TevArguments,
}

/// The scene file and the arguments that say how to render it.
struct FileHost {
    job: JobArguments,
    /// Where the picture lies in the whole, if it is a crop of it.
    part_of: Mutex<Option<PartOf>>,
    /// Whether a picture was written.
    has_saved: AtomicBool,
}

impl Host for FileHost {
    fn load(&self) -> Result<Job, String> {
        let prepared = self.job.prepare().and_then(shown_in_browsers).map_err(|error| in_a_line(&error))?;
        *self.part_of.lock().unpoisoned() = PartOf::of(&prepared.trace);
        Ok(job_of(prepared, &self.job))
    }

    fn later(&self, seconds: f64) -> Result<Scene, String> {
        self.job.scene_later(seconds).map_err(|error| in_a_line(&error))
    }

    fn save(&self, path: &Path, rendered: &Rendered, settings: &LoopSettings) -> Result<(), String> {
        let write = || {
            let format = output::check_target(path)?;
            let report = Report::new(&self.job.scene_name(), &[self.job.seed()], settings, rendered);
            let part_of = *self.part_of.lock().unpoisoned();
            let target = PictureTarget { path, format, background: self.job.background(), part_of };
            target.write(Finished { rendered, settings, report: &report })
        };
        write().map_err(|error| in_a_line(&error))?;
        self.has_saved.store(true, Ordering::Relaxed);
        Ok(())
    }

    fn scene_file(&self) -> &Path {
        self.job.scene_file()
    }

    fn watched_files(&self) -> Vec<PathBuf> {
        let named = self.job.files().into_iter().filter_map(|(_, path)| path.map(Path::to_owned));
        named.chain([load::side_file(self.job.scene_file())]).chain(load::files_read()).collect()
    }
}

fn job_of(prepared: Prepared, arguments: &JobArguments) -> Job {
    let Prepared { scene, trace, record, settings, whole } = prepared;
    let (csf_area_deg2, limits) = (arguments.csf_area_deg2(), settings.limits);
    Job { scene, trace, record, csf_area_deg2, limits, importance: settings.importance, whole }
}

/// Refuses a picture that no browser shows.
fn shown_in_browsers(prepared: Prepared) -> anyhow::Result<Prepared> {
    check_shown(&prepared.trace)?;
    Ok(prepared)
}

fn check_shown(trace: &TraceSettings) -> anyhow::Result<()> {
    let Crop { width, height, .. } = trace.film_area();
    if width.max(height) > MAX_SIDE_PIXELS {
        bail!(
            "a browser shows pictures of at most {MAX_SIDE_PIXELS} pixels a side, and this one has {width}x{height}: choose a smaller \
             --size, or a --crop of it"
        );
    }
    Ok(())
}

/// A running render, open to viewers on this machine at a free port; says where.
pub(super) fn audience<'a>(
    scene: &Scene,
    trace: &TraceSettings,
    settings: &'a LoopSettings,
    record: &SettingsRecord,
) -> anyhow::Result<Audience<'a>> {
    check_shown(trace)?;
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).context("no port to show the render at")?;
    let (address, token) = door_of(&listener)?;
    say!("Watch it at http://{address}/?token={token}");
    Audience::open(listener, Door { address, token }, scene, settings, record)
        .context("the thread for viewers could not be started")
}

fn door_of(listener: &TcpListener) -> anyhow::Result<(SocketAddr, String)> {
    let address = listener.local_addr().context("the listener has no address")?;
    Ok((address, preview::random_token().context("the system gives no random numbers for a token")?))
}

/// Where somebody who listens on all addresses of this machine is found: at the one that others see it by, or else at
/// its own.
fn reachable(listener: SocketAddr) -> SocketAddr {
    // Nothing is sent: the system says which address it would send from to one of documentation's.
    let (any, elsewhere, own) = match listener.ip() {
        IpAddr::V4(ip) => (ip.is_unspecified(), "192.0.2.1:9", IpAddr::V4(Ipv4Addr::LOCALHOST)),
        IpAddr::V6(ip) => (ip.is_unspecified(), "[2001:db8::1]:9", IpAddr::V6(Ipv6Addr::LOCALHOST)),
    };
    if !any {
        return listener;
    }
    let seen_by_others = || {
        let socket = UdpSocket::bind((listener.ip(), 0))?;
        socket.connect(elsewhere)?;
        socket.local_addr()
    };
    let ip = seen_by_others().map_or(own, |address: SocketAddr| address.ip());
    SocketAddr::new(ip, listener.port())
}

/// Serves until a signal comes.
pub(super) fn run(arguments: &ViewArguments) -> anyhow::Result<()> {
    let pool = arguments.job.thread_pool()?;
    let asked = SocketAddr::new(arguments.host, arguments.port);
    let listener = TcpListener::bind(asked)
        .with_context(|| format!("cannot listen on {asked}: choose another --port, or an address of this machine"))?;
    let (address, token) = door_of(&listener)?;
    let prepared = pool.install(|| arguments.job.prepare().and_then(shown_in_browsers))?;
    let host = Arc::new(FileHost {
        job: arguments.job.clone(),
        part_of: Mutex::new(PartOf::of(&prepared.trace)),
        has_saved: AtomicBool::new(false),
    });
    let job = job_of(prepared, &arguments.job);
    if arguments.foveated && job.record.model != model::DEFAULT {
        bail!("--foveated is for --model {}: {} does not know where one looks", model::DEFAULT, job.record.model);
    }
    let tev = arguments.tev.open(&arguments.job.scene_name())?;
    let spectators = tev.into_iter().map(|tev| Box::new(tev) as Box<dyn Spectator>).collect();
    let options = Options { is_foveated: arguments.foveated, spectators };
    let preview = preview::start(job, Arc::clone(&host) as Arc<dyn Host>, options, pool)
        .context("the threads could not be started")?;
    let closer = preview.closer();
    signals::listen(move || closer.close())?;
    if !address.ip().is_loopback() {
        say!("note: {address} can be reached from other machines; whoever has the address can drive this preview");
    }
    answer!("http://{}/?token={token}", reachable(address));
    preview.serve(listener, Door { address, token }).with_context(|| format!("cannot serve on {address}"))?;
    if !host.has_saved.load(Ordering::Relaxed) {
        say!(
            "note: no picture was saved: the page's \"Save PNG\" and \"Save EXR\" do that before the end, `render -o` at the end"
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An address that can be opened, with the listener's port.
    #[test]
    fn all_addresses_are_told_as_one() {
        for (listener, is_kept) in [("127.0.0.1:80", true), ("0.0.0.0:81", false), ("[::]:82", false)] {
            let listener: SocketAddr = listener.parse().expect("an address");
            let told = reachable(listener);
            assert!(told.port() == listener.port() && !told.ip().is_unspecified(), "{told}");
            assert_eq!(told == listener, is_kept);
        }
    }
}
