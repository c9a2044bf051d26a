//! What the render's thread and the viewers have in common. Nobody waits for a viewer: each slot holds the latest only.

use super::command::Command;
use super::layer::Layer;
use super::screen::Snapshot;
use crate::poison::Unpoisoned as _;
use axum::body::Bytes;
use fechner_perception::eccentricity::Gaze;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::Duration;
use tokio::sync::watch;

/// Commands that may wait; more are dropped, as only a broken page sends them.
const MAX_COMMANDS: usize = 1024;

/// A frame as viewers are sent it; without bytes before the first.
#[derive(Default)]
pub(super) struct Encoded {
    /// Number of the frame in the order in which frames are made; they may be encoded by several threads.
    pub(super) number: u64,
    pub(super) bytes: Bytes,
}

pub(super) struct Shared {
    commands: Mutex<VecDeque<Command>>,
    arrived: Condvar,
    /// Whether a command that waits throws the picture away.
    is_cancelled: AtomicBool,
    /// Viewers of each layer.
    viewers: [AtomicUsize; Layer::ALL.len()],
    frames: [watch::Sender<Encoded>; Layer::ALL.len()],
    /// Frames that were given a number.
    numbered: AtomicU64,
    status: watch::Sender<Arc<str>>,
    snapshot: Mutex<Option<Arc<Snapshot>>>,
    /// Where somebody looks, and whose pointer says so.
    gaze: Mutex<Option<(u64, Gaze)>>,
    /// Pointers that were given a number.
    pointers: AtomicU64,
    is_closing: AtomicBool,
    closing: watch::Sender<bool>,
}

impl Shared {
    pub(super) fn new() -> Self {
        Self {
            commands: Mutex::default(),
            arrived: Condvar::new(),
            is_cancelled: AtomicBool::new(false),
            viewers: std::array::from_fn(|_| AtomicUsize::new(0)),
            frames: std::array::from_fn(|_| watch::Sender::default()),
            numbered: AtomicU64::new(0),
            status: watch::Sender::new(Arc::from("")),
            snapshot: Mutex::default(),
            gaze: Mutex::default(),
            pointers: AtomicU64::new(0),
            is_closing: AtomicBool::new(false),
            closing: watch::Sender::new(false),
        }
    }

    pub(super) fn send(&self, command: Command) {
        let mut commands = self.commands.lock().unpoisoned();
        if let Some(earlier) = commands.back_mut().filter(|earlier| command.replaces(earlier)) {
            *earlier = command;
        } else if commands.len() < MAX_COMMANDS {
            // What is to be kept is kept first.
            let is_of_no_use = command.throws_the_picture_away() && !commands.iter().any(Command::keeps_the_picture);
            self.is_cancelled.fetch_or(is_of_no_use, Ordering::SeqCst);
            commands.push_back(command);
        }
        self.arrived.notify_all();
    }

    /// Whether the render should look up.
    pub(super) fn has_news(&self) -> bool {
        self.is_closing() || !self.commands.lock().unpoisoned().is_empty()
    }

    /// Takes all commands that have come.
    pub(super) fn take_commands(&self) -> VecDeque<Command> {
        let mut commands = self.commands.lock().unpoisoned();
        self.is_cancelled.store(false, Ordering::SeqCst);
        std::mem::take(&mut *commands)
    }

    /// Whether work on the picture is of no use any more.
    pub(super) fn is_cancelled(&self) -> bool {
        self.is_closing() || self.is_cancelled.load(Ordering::SeqCst)
    }

    /// Waits until a command comes, the preview closes or the time is up.
    pub(super) fn wait(&self, most: Duration) {
        let commands = self.commands.lock().unpoisoned();
        if commands.is_empty() && !self.is_closing() {
            drop(self.arrived.wait_timeout(commands, most));
        }
    }

    pub(super) fn close(&self) {
        self.is_closing.store(true, Ordering::SeqCst);
        self.closing.send_replace(true);
        // With the lock held, so that nobody is between looking and waiting.
        let _commands = self.commands.lock().unpoisoned();
        self.arrived.notify_all();
    }

    pub(super) fn is_closing(&self) -> bool {
        self.is_closing.load(Ordering::SeqCst)
    }

    pub(super) fn until_closing(&self) -> watch::Receiver<bool> {
        self.closing.subscribe()
    }

    pub(super) fn is_watched(&self, layer: Layer) -> bool {
        self.viewers[layer.index()].load(Ordering::SeqCst) > 0
    }

    pub(super) fn has_viewers(&self) -> bool {
        self.viewers.iter().any(|viewers| viewers.load(Ordering::SeqCst) > 0)
    }

    /// A frame's place in the order in which frames are made.
    pub(super) fn number_a_frame(&self) -> u64 {
        self.numbered.fetch_add(1, Ordering::SeqCst) + 1
    }

    /// Leaves out a frame that comes after one of a higher number.
    pub(super) fn publish_frame(&self, layer: Layer, frame: Encoded) {
        self.frames[layer.index()].send_if_modified(|latest| {
            let is_later = frame.number > latest.number;
            if is_later {
                *latest = frame;
            }
            is_later
        });
    }

    pub(super) fn publish_status(&self, status: String) {
        self.status.send_replace(Arc::from(status));
    }

    pub(super) fn status(&self) -> watch::Receiver<Arc<str>> {
        self.status.subscribe()
    }

    /// Somebody looks elsewhere.
    fn change_gaze(&self, change: impl FnOnce(&mut Option<(u64, Gaze)>)) {
        change(&mut self.gaze.lock().unpoisoned());
        let _commands = self.commands.lock().unpoisoned();
        self.arrived.notify_all();
    }

    pub(super) fn gaze(&self) -> Option<Gaze> {
        self.gaze.lock().unpoisoned().map(|(_, gaze)| gaze)
    }

    pub(super) fn publish_snapshot(&self, snapshot: Snapshot) {
        *self.snapshot.lock().unpoisoned() = Some(Arc::new(snapshot));
    }

    pub(super) fn snapshot(&self) -> Option<Arc<Snapshot>> {
        self.snapshot.lock().unpoisoned().clone()
    }
}

/// A viewer's pointer, which may stand for a gaze: the latest place of all viewers counts, while its viewer is there.
pub(super) struct Pointer {
    shared: Arc<Shared>,
    number: u64,
}

impl Pointer {
    pub(super) fn of(shared: &Arc<Shared>) -> Self {
        Self { shared: Arc::clone(shared), number: shared.pointers.fetch_add(1, Ordering::SeqCst) }
    }

    /// Where its viewer looks; `None` where that is known no longer, which is no word about others.
    pub(super) fn look_at(&mut self, place: Option<Gaze>) {
        let own = place.map(|place| (self.number, place));
        self.shared.change_gaze(|gaze| *gaze = own.or(gaze.filter(|(owner, _)| *owner != self.number)));
    }
}

impl Drop for Pointer {
    fn drop(&mut self) {
        self.look_at(None);
    }
}

/// A viewer's place before one layer; frames of layers before which nobody sits are not made.
pub(super) struct Seat {
    shared: Arc<Shared>,
    layer: Layer,
}

impl Seat {
    pub(super) fn take(shared: &Arc<Shared>, layer: Layer) -> Self {
        shared.viewers[layer.index()].fetch_add(1, Ordering::SeqCst);
        shared.send(Command::Redraw);
        Self { shared: Arc::clone(shared), layer }
    }

    /// The latest frame and those to come; empty before the first.
    pub(super) fn frames(&self) -> watch::Receiver<Encoded> {
        self.shared.frames[self.layer.index()].subscribe()
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.shared.viewers[self.layer.index()].fetch_sub(1, Ordering::SeqCst);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::PictureFormat;

    /// Of a slider's ticks the last counts, and nothing that came between two of them is passed over.
    #[test]
    fn settings_replace_their_like() {
        let shared = Shared::new();
        let exposure = |stops: f64| Command::Exposure { stops: Some(stops) };
        let sent = [exposure(1.0), exposure(2.0), Command::Pause, exposure(3.0), Command::Visibility { target: 2.0 }];
        sent.into_iter().chain([exposure(4.0), exposure(5.0)]).for_each(|command| shared.send(command));
        let stops = |command: &Command| if let Command::Exposure { stops } = command { *stops } else { None };
        let left: Vec<Option<f64>> = shared.take_commands().iter().map(stops).collect();
        assert_eq!(left, [Some(2.0), None, Some(3.0), None, Some(5.0)]);
    }

    /// A camera that moved right after a save came, while the picture was looked at, threw away the picture that was to
    /// be saved, and its own was. Saves that wait for a first picture still take the next camera's.
    #[test]
    fn what_is_to_be_saved_is_not_thrown_away() {
        let save = || Command::Save { format: PictureFormat::Png };
        for (commands, is_cancelled) in
            [(vec![save(), Command::CameraHome], false), (vec![Command::CameraHome, save()], true)]
        {
            let shared = Shared::new();
            commands.into_iter().for_each(|command| shared.send(command));
            assert_eq!(shared.is_cancelled(), is_cancelled);
            shared.take_commands();
            shared.send(Command::CameraHome);
            assert!(shared.is_cancelled());
        }
    }

    /// Who leaves looks nowhere, and takes no other's gaze along.
    #[test]
    fn a_gaze_goes_with_its_viewer() {
        let shared = Arc::new(Shared::new());
        let place = |x_px: f64| Some(Gaze { x_px, y_px: 2.0 });
        let (mut first, mut second) = (Pointer::of(&shared), Pointer::of(&shared));
        first.look_at(place(1.0));
        second.look_at(place(5.0));
        first.look_at(None);
        assert_eq!(shared.gaze(), place(5.0));
        drop(first);
        assert_eq!(shared.gaze(), place(5.0));
        drop(second);
        assert_eq!(shared.gaze(), None);
    }
}
