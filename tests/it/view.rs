//! The live preview as a browser meets it: over HTTP and a WebSocket.

use crate::support::command::{self, cornell_box, fechner};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Message, WebSocket};

mod requests;

/// Anything that takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(120);

/// `fechner view` under way; ended when dropped.
struct View {
    child: Child,
    address: String,
    token: String,
    /// What else it says.
    said: Option<JoinHandle<String>>,
}

impl View {
    fn of(scene: &Path, folder: &Path, arguments: &[&str]) -> Self {
        Self::of_size("32x32", scene, folder, arguments)
    }

    fn of_size(size: &str, scene: &Path, folder: &Path, arguments: &[&str]) -> Self {
        let mut command = fechner();
        command.arg("view").arg(scene).args(["--size", size, "--threads", "1"]).args(arguments);
        let mut child = command.current_dir(folder).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("runs");
        let said = child.stdout.take().expect("piped");
        Self::that_says(child, said)
    }

    /// `fechner render --view` under way.
    fn of_render(folder: &Path, arguments: &[&str]) -> Self {
        let mut command = fechner();
        command.arg("render").arg(cornell_box()).args(["--view", "--size", "32x32", "--threads", "1"]).args(arguments);
        let mut child = command.current_dir(folder).stderr(Stdio::piped()).spawn().expect("runs");
        let said = child.stderr.take().expect("piped");
        Self::that_says(child, said)
    }

    /// By the first line that has an address.
    fn that_says(child: Child, mut said: impl Read + Send + 'static) -> Self {
        let mut lines = BufReader::new(&mut said).lines().map_while(Result::ok);
        let line = lines.find(|line| line.contains("http://")).expect("an address");
        let (_, rest) = line.trim().split_once("http://").expect("an address");
        let (address, token) = rest.split_once("/?token=").expect("a token");
        let (address, token) = (address.to_owned(), token.to_owned());
        // What else it says must not fill the pipe.
        let said = std::thread::spawn(move || {
            let mut text = String::new();
            said.read_to_string(&mut text).map(|_| text).expect("UTF-8")
        });
        Self { child, address, token, said: Some(said) }
    }

    /// What it said once it has ended.
    fn said(&mut self) -> String {
        self.said.take().map(|said| said.join().expect("read")).expect("asked once")
    }

    /// The answer to a GET, from its status line on.
    fn get(&self, path: &str, host: &str) -> String {
        let mut stream = TcpStream::connect(&self.address).expect("listens");
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").expect("written");
        let mut answer = String::new();
        stream.read_to_string(&mut answer).expect("an answer");
        answer
    }

    fn socket(&self, token: &str, origin: Option<&str>) -> Result<Viewer, String> {
        let stream = TcpStream::connect(&self.address).expect("listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a time");
        let mut request = format!("ws://{}/ws?token={token}", self.address).into_client_request().expect("an address");
        if let Some(origin) = origin {
            request.headers_mut().insert("Origin", HeaderValue::from_str(origin).expect("an origin"));
        }
        let (socket, _) = tungstenite::client(request, stream).map_err(|error| error.to_string())?;
        Ok(Viewer { socket })
    }

    fn viewer(&self) -> Viewer {
        self.socket(&self.token, Some(&format!("http://{}", self.address))).expect("let in")
    }
}

impl Drop for View {
    fn drop(&mut self) {
        // Harmless if it has ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Viewer {
    socket: WebSocket<TcpStream>,
}

impl Viewer {
    fn send(&mut self, command: &Value) {
        self.socket.send(Message::text(command.to_string())).expect("sent");
    }

    /// The first message that is what `pick` looks for.
    fn until<T>(&mut self, what: &str, pick: impl Fn(&Message) -> Option<T>) -> T {
        let started = Instant::now();
        loop {
            let message = self.socket.read().unwrap_or_else(|error| panic!("{what}: {error}"));
            if let Some(found) = pick(&message) {
                return found;
            }
            assert!(started.elapsed() < PATIENCE, "{what} never came");
        }
    }

    /// The first JSON that fits.
    fn json(&mut self, what: &str, fits: impl Fn(&Value) -> bool) -> Value {
        self.until(what, |message| {
            let value = serde_json::from_str(message.to_text().ok().filter(|_| message.is_text())?).expect("JSON");
            Some(value).filter(&fits)
        })
    }

    fn status(&mut self, what: &str, fits: impl Fn(&Value) -> bool) -> Value {
        self.json(what, |value| value["kind"] == "status" && fits(value))
    }

    /// The next frame of a layer that fits.
    fn frame(&mut self, layer: u8, what: &str, fits: impl Fn(&image::RgbImage) -> bool) -> image::RgbImage {
        self.until(what, |message| {
            let Message::Binary(bytes) = message else { return None };
            let picture = &bytes[2 + usize::from(bytes[1])..];
            let picture = image::load_from_memory(picture).expect("a picture").into_rgb8();
            Some(picture).filter(|picture| bytes[0] == layer && fits(picture))
        })
    }

    /// The next word about what a layer's colours mean that fits.
    fn legend(&mut self, layer: u8, what: &str, fits: impl Fn(&str) -> bool) {
        self.until(what, |message| {
            let Message::Binary(bytes) = message else { return None };
            let legend = String::from_utf8_lossy(&bytes[2..2 + usize::from(bytes[1])]);
            (bytes[0] == layer && fits(&legend)).then_some(())
        });
    }

    /// Asks for a file and returns its bytes.
    fn saved(&mut self, folder: &Path, format: &str, name: &str) -> Vec<u8> {
        self.send(&json!({ "do": "save", "format": format }));
        self.status(name, |status| status["note"] == format!("saved {name}"));
        std::fs::read(folder.join(name)).expect("written")
    }
}

fn brightness(picture: &image::RgbImage) -> f64 {
    picture.as_raw().iter().map(|&byte| f64::from(byte)).sum::<f64>() / picture.as_raw().len() as f64
}

fn is_stopped(status: &Value) -> bool {
    status["phase"] == "stopped"
}

fn rendered(folder: &Path, arguments: &[&str], name: &str) -> Vec<u8> {
    let mut command = fechner();
    command.arg("render").arg(cornell_box()).args(["--size", "32x32", "-o", name]).args(arguments).current_dir(folder);
    command::run(&mut command);
    std::fs::read(folder.join(name)).expect("written")
}

#[test]
fn who_has_no_token_or_comes_from_elsewhere_stays_outside() {
    let folder = tempfile::tempdir().expect("a folder");
    let view = View::of(&cornell_box(), folder.path(), &["--visibility", "16"]);
    let (address, token) = (&view.address, &view.token);
    assert_eq!(token.len(), 32);
    let page = view.get(&format!("/?token={token}"), address);
    assert!(page.starts_with("HTTP/1.1 200") && page.contains("<canvas"), "{page}");
    let asks_elsewhere = ["http://", "https://", "src=", "@import", "url("].into_iter().find(|ask| page.contains(ask));
    assert_eq!(asks_elsewhere, None, "the page asks for something else");
    for path in ["/", "/?token=", "/?token=00000000000000000000000000000000", "/ws"] {
        let answer = view.get(path, address);
        assert!(answer.starts_with("HTTP/1.1 403") || path == "/ws", "{path}: {answer}");
        assert!(!answer.contains("<canvas"), "{path}");
    }
    assert!(view.get(&format!("/?token={token}"), "evil.example").starts_with("HTTP/1.1 403"));
    for (token, origin) in [("", None), (token.as_str(), Some("http://evil.example")), (token, Some("null"))] {
        let refusal = view.socket(token, origin).err().expect("refused");
        assert!(refusal.contains("403"), "{origin:?}: {refusal}");
    }
}

/// Stopped by itself, the preview has the bytes of `render`, whatever viewers did meanwhile; carried on to a lower
/// visibility, those of a render to there.
#[test]
fn a_finished_preview_is_what_render_writes() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let view = View::of(&cornell_box(), at, &["--visibility", "6", "--seed", "3"]);
    // One that never reads.
    let _slow = view.viewer();
    let mut viewer = view.viewer();
    viewer.frame(0, "a picture", |picture| picture.dimensions() == (32, 32) && brightness(picture) > 5.0);
    viewer.send(&json!({ "do": "pause" }));
    viewer.status("a rest", |status| status["phase"] == "paused" || is_stopped(status));
    viewer.send(&json!({ "do": "layer", "layer": "samples" }));
    viewer.frame(1, "samples", |_| true);
    viewer.send(&json!({ "do": "resume" }));
    let status = viewer.status("the end", |status| is_stopped(status) && status["visible_share"].is_number());
    assert!(status["visible_share"].as_f64() <= Some(0.001), "{status}");
    let until = |v: &str, name: &str| rendered(at, &["--seed", "3", "--visibility", v], name);
    assert!(viewer.saved(at, "png", "cornell-box-1.png") == until("6", "6.png"), "the PNG differs");
    assert!(viewer.saved(at, "exr", "cornell-box-1.exr") == until("6", "6.exr"), "the EXR differs");

    // Another viewer sees, exactly, what was saved.
    let saved = image::open(at.join("6.png")).expect("a picture").into_rgb8();
    view.viewer().frame(0, "the saved picture", |picture| *picture == saved);

    viewer.send(&json!({ "do": "visibility", "target": 3.0 }));
    viewer.send(&json!({ "do": "resume" }));
    let fits = |status: &Value| {
        is_stopped(status) && status["target"] == 3.0 && status["visible_share"].as_f64() <= Some(0.001)
    };
    viewer.status("the lower visibility", fits);
    assert!(viewer.saved(at, "png", "cornell-box-2.png") == until("3", "3.png"), "going on gives another picture");
}

/// A part is saved with its place in the whole, as `render` writes it.
#[test]
fn a_part_is_saved_where_it_lies() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["--visibility", "8", "--crop", "8,4,16,16"];
    let view = View::of(&cornell_box(), folder.path(), &arguments);
    let mut viewer = view.viewer();
    viewer.status("the end", |status| is_stopped(status) && status["visible_share"].is_number());
    let saved = viewer.saved(folder.path(), "exr", "cornell-box-1.exr");
    assert!(saved == rendered(folder.path(), &arguments, "part.exr"), "the EXR differs");
}

/// A part that is seen from elsewhere has the exposure that `render` gives it there, not the one from home.
#[test]
fn a_part_is_as_bright_as_its_whole_from_another_camera() {
    let folder = tempfile::tempdir().expect("a folder");
    let arguments = ["--visibility", "8", "--crop", "12,18,12,10", "--operator", "reinhard02"];
    let view = View::of(&cornell_box(), folder.path(), &arguments);
    let mut viewer = view.viewer();
    let home = viewer.status("the end", is_stopped);
    viewer.send(&json!({ "do": "camera", "by": "dolly", "steps": 6.0 }));
    let moved = viewer.status("another camera", |status| status["camera"] != home["camera"] && is_stopped(status));
    viewer.saved(folder.path(), "png", "cornell-box-1.png");

    let copied = with_camera(&cornell_box(), moved["camera"].as_str().expect("TOML"));
    std::fs::write(folder.path().join("moved.toml"), copied).expect("written");
    let mut command = fechner();
    command.args(["render", "moved.toml", "--size", "32x32", "-o", "moved.png"]).args(arguments);
    command::run(command.current_dir(folder.path()));
    let [saved, rendered] = ["cornell-box-1.png", "moved.png"]
        .map(|name| brightness(&image::open(folder.path().join(name)).expect("a picture").into_rgb8()));
    assert!((saved / rendered - 1.0).abs() < 0.02, "{saved} is not {rendered}");
}

/// The text of a scene with another `[camera]`.
fn with_camera(scene: &Path, camera: &str) -> String {
    let text = std::fs::read_to_string(scene).expect("a scene");
    let start = text.find("[camera]").expect("a camera");
    let end = start + 1 + text[start + 1..].find("\n[").expect("more after it");
    format!("{}{camera}{}", &text[..start], &text[end..])
}

/// The tone operator works on the samples that there are.
#[test]
fn exposure_changes_the_picture_and_takes_no_samples() {
    let folder = tempfile::tempdir().expect("a folder");
    let view = View::of(&cornell_box(), folder.path(), &["--visibility", "8"]);
    let mut viewer = view.viewer();
    let before = viewer.status("the end", is_stopped);
    let dark = view.viewer().frame(0, "a picture", |picture| brightness(picture) > 0.0);
    viewer.send(&json!({ "do": "exposure", "stops": 2.0 }));
    let after = viewer.status("the exposure", |status| status["exposure"] == 2.0 && is_stopped(status));
    assert_eq!(before["total_samples"], after["total_samples"]);
    let bright = view.viewer().frame(0, "a brighter picture", |picture| brightness(picture) > 1.2 * brightness(&dark));
    viewer.send(&json!({ "do": "operator", "name": "reinhard02" }));
    viewer.status("the operator", |status| status["operator"] == "reinhard02" && is_stopped(status));
    view.viewer().frame(0, "another picture", |picture| *picture != bright);
    viewer.send(&json!({ "do": "operator", "name": "nobody" }));
    let refused = viewer.status("a refusal", |status| !status["error"].is_null());
    assert!(refused["error"].as_str().is_some_and(|error| error.contains("nobody")), "{refused}");
    assert_eq!(refused["operator"], "reinhard02");
    viewer.send(&json!({ "do": "exposure", "stops": 1e9 }));
    let refused = viewer.status("another", |status| status["error"].as_str().is_some_and(|e| e.contains("100 stops")));
    assert_eq!(refused["exposure"], 2.0);

    viewer.send(&json!({ "do": "inspect", "x": 16, "y": 20 }));
    let pixel = viewer.json("a pixel", |value| value["kind"] == "inspected");
    assert!(pixel["samples"].as_u64() >= Some(16), "{pixel}");
    for figure in ["luminance_cd_m2", "threshold_cd_m2", "visibility"] {
        assert!(pixel[figure].as_f64() > Some(0.0), "{figure}: {pixel}");
    }
    viewer.send(&json!({ "do": "inspect", "x": 32, "y": u64::MAX }));
    viewer.send(&json!({ "do": "nonsense" }));
    viewer.json("a word about nonsense", |value| value["kind"] == "refused");
    for (index, name) in
        ["threshold", "visibility", "variance", "half-difference", "albedo", "normal", "depth"].iter().enumerate()
    {
        viewer.send(&json!({ "do": "layer", "layer": name }));
        viewer.frame(index as u8 + 2, name, |layer| layer.pixels().any(|pixel| pixel != layer.get_pixel(0, 0)));
    }
}

/// A camera that was moved starts anew, and its TOML in the scene file is the same camera; a broken scene file says
/// where and leaves the picture.
#[test]
fn the_camera_moves_and_the_scene_file_is_watched() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = folder.path().join("scene.toml");
    let text = std::fs::read_to_string(cornell_box()).expect("a scene");
    std::fs::write(&scene, &text).expect("written");
    let view = View::of(&scene, folder.path(), &["--visibility", "8"]);
    let mut viewer = view.viewer();
    let home = viewer.status("the end", is_stopped);
    viewer.send(&json!({ "do": "camera", "by": "orbit", "right": 0.2, "up": 0.1 }));
    let moved = viewer.status("another camera", |status| status["camera"] != home["camera"] && is_stopped(status));
    let seen = view.viewer().frame(0, "a picture", |picture| brightness(picture) > 5.0);

    std::fs::write(&scene, format!("{text}\n# The same camera.\n")).expect("written");
    let edited = viewer.status("the edited scene", |status| {
        status["note"] == "the scene was loaded again, seen from where you are" && is_stopped(status)
    });
    assert_eq!(edited["camera"], moved["camera"]);
    view.viewer().frame(0, "the same picture", |picture| *picture == seen);

    std::fs::write(&scene, text.replace("[camera]", "[camera]\nfoccus = 1")).expect("written");
    let broken = viewer.status("an error", |status| !status["error"].is_null());
    assert!(broken["error"].as_str().is_some_and(|error| error.contains("foccus")), "{broken}");
    assert_eq!(broken["total_samples"], moved["total_samples"]);
    view.viewer().frame(0, "the last good picture", |picture| *picture == seen);

    let copied = with_camera(&cornell_box(), moved["camera"].as_str().expect("TOML"));
    std::fs::write(&scene, copied).expect("written");
    let again = viewer.status("the scene again", |status| status["error"].is_null() && is_stopped(status));
    assert_eq!(again["note"], "the scene was loaded again");
    let difference = |picture: &image::RgbImage| {
        picture.as_raw().iter().zip(seen.as_raw()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / 3072.0
    };
    view.viewer().frame(0, "the same picture", |picture| difference(picture) < 3.0);
}

/// A render that is watched writes the same bytes; it can be stopped from the page, and not driven.
#[test]
fn a_render_shows_itself_and_is_not_driven() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let mut view = View::of_render(at, &["--visibility", "6", "-o", "watched.png"]);
    // It may be at an end before anybody has come.
    if let Ok(mut viewer) = view.socket(&view.token, None) {
        viewer.send(&json!({ "do": "exposure", "stops": 2.0 }));
    }
    assert!(view.child.wait().expect("ended").success());
    let watched = std::fs::read(at.join("watched.png")).expect("written");
    assert!(watched == rendered(at, &["--visibility", "6"], "alone.png"), "being watched changes the picture");

    let mut view = View::of_render(at, &["--visibility", "0.01", "-o", "stopped.png"]);
    let mut viewer = view.viewer();
    viewer.frame(0, "a picture", |picture| picture.dimensions() == (32, 32) && brightness(picture) > 5.0);
    viewer.send(&json!({ "do": "operator", "name": "reinhard02" }));
    let refused = viewer.status("a refusal", |status| !status["error"].is_null());
    assert!(refused["error"].as_str().is_some_and(|error| error.contains("running render")), "{refused}");
    assert_eq!(refused["is_driven"], false);
    viewer.status("no more of it", |status| status["error"].is_null());
    viewer.send(&json!({ "do": "stop" }));
    viewer.status("why it ended", |status| status["reason"] == "stopped from this page");
    assert!(view.child.wait().expect("ended").success());
    assert!(image::open(at.join("stopped.png")).is_ok());
    let said = view.said();
    assert!(said.contains("Stopped from the page of --view, after"), "{said}");

    let mut view = View::of_render(at, &["--visibility", "0.01", "--spp", "512", "-o", "spent.png"]);
    view.viewer().status("why it ended", |status| status["reason"] == "the samples are spent");
    assert!(view.child.wait().expect("ended").success());
}

/// A browser shows no picture of more pixels a side, and would stay empty.
#[test]
fn a_picture_too_wide_for_a_browser_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    for command in [&["view"][..], &["render", "--view", "-o", "a.png", "--spp", "1", "--sampling", "uniform"]] {
        let mut refused = fechner();
        refused.args(command).arg(cornell_box()).args(["--size", "65536x1"]).current_dir(folder.path());
        let mut child = refused.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("runs");
        let mut said = child.stderr.take().expect("piped");
        let started = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().expect("a child") {
                break status;
            }
            if started.elapsed() > Duration::from_secs(20) {
                let _ = child.kill();
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        let mut text = String::new();
        said.read_to_string(&mut text).expect("UTF-8");
        assert!(status.code() == Some(2) && text.contains("65535"), "{command:?}: {text}");
    }
}

/// A side file that comes to be or changes, and what a scene is made of, is the scene's edit too.
#[test]
fn all_files_of_a_scene_are_watched() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let object = |material: &str| format!("mtllib a.mtl\nusemtl {material}\nv -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    std::fs::write(at.join("a.mtl"), "newmtl red\nKd 0.8 0.1 0.1\n").expect("written");
    std::fs::write(at.join("a.obj"), object("red")).expect("written");
    std::fs::write(at.join("near.toml"), "name = 'near'\npixels_per_degree = 20.0").expect("written");
    let view = View::of(&at.join("a.obj"), at, &["--sampling", "uniform", "--spp", "1", "--display", "near.toml"]);
    let mut viewer = view.viewer();
    let home = viewer.status("the end", is_stopped);
    let side = |field_of_view: u32| {
        let text = format!("[camera]\nposition = [0, 0, 5]\nlook_at = [0, 0, 0]\nvertical_fov_deg = {field_of_view}\n");
        std::fs::write(at.join("a.fechner.toml"), text).expect("written");
    };
    side(40);
    let with_side = viewer.status("a side file", |status| status["camera"] != home["camera"] && is_stopped(status));
    side(7);
    viewer.status("its edit", |status| status["camera"] != with_side["camera"] && is_stopped(status));
    std::fs::write(at.join("near.toml"), "name = 'near'\npixels_per_degree = 33.0").expect("written");
    viewer.status("another display", |status| status["pixels_per_degree"] == 33.0 && is_stopped(status));
    std::fs::write(at.join("a.mtl"), "newmtl red\nKd 0.02 0.02 0.8\n").expect("written");
    let is_blue =
        |picture: &image::RgbImage| picture.pixels().any(|image::Rgb([red, _, blue])| *blue > red.saturating_add(60));
    viewer.frame(0, "another material", is_blue);
    std::fs::remove_file(at.join("a.fechner.toml")).expect("removed");
    viewer.status("no side file", |status| status["camera"] == home["camera"] && is_stopped(status));
}

/// A render whose tev is not there says so once and writes the same bytes; one whose tev is there sends it something.
#[test]
fn tev_changes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = folder.path();
    let render_for = |address: &str, name: &str| {
        let mut command = fechner();
        command.arg("render").arg(cornell_box()).args([
            "--size",
            "32x32",
            "--visibility",
            "8",
            "--tev",
            address,
            "-o",
            name,
        ]);
        let output = command::run(command.current_dir(at));
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        (said, std::fs::read(at.join(name)).expect("written"))
    };
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    let tev = std::thread::spawn(move || {
        let mut received = Vec::new();
        listener.accept().expect("a caller").0.read_to_end(&mut received).expect("all of it");
        received
    });
    let (said, there) = render_for(&address, "there.png");
    assert!(!said.contains("warning"), "{said}");
    let received = tev.join().expect("received");
    // An empty picture is created first, then filled.
    assert!(received.len() > 32 * 32 * 4 * 14 && received[4] == 4, "{} bytes", received.len());
    // Nobody listens there any more.
    let (said, gone) = render_for(&address, "gone.png");
    assert_eq!(said.matches("warning: tev is not there").count(), 1, "{said}");
    let alone = rendered(at, &["--visibility", "8"], "alone.png");
    assert!(there == alone && gone == alone, "tev changes the picture");
}

#[cfg(unix)]
#[test]
fn a_signal_ends_it_cleanly() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut view = View::of(&cornell_box(), folder.path(), &["--visibility", "0.01"]);
    let mut viewer = view.viewer();
    viewer.status("work", |status| status["phase"] == "rendering");
    let told = Command::new("kill").args(["-INT", &view.child.id().to_string()]).status().expect("kill");
    assert!(told.success());
    assert!(view.child.wait().expect("ended").success());
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
}
