//! Tests with a listener that reads packets as tev does.

use super::*;
use crate::integrator::{BlockWork, PathTracer, SamplePlan, TraceSettings};
use crate::sampler::Half;
use crate::scene::Scene;
use std::io::Read;
use std::net::TcpListener;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Reads a packet's fields one after the other.
struct Fields(std::collections::VecDeque<u8>);

impl Fields {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        std::array::from_fn(|_| self.0.pop_front().expect("a whole packet"))
    }

    fn integer(&mut self) -> usize {
        i32::from_le_bytes(self.bytes()).try_into().expect("not negative")
    }

    fn long(&mut self) -> usize {
        i64::from_le_bytes(self.bytes()).try_into().expect("not negative")
    }

    fn text(&mut self) -> String {
        let text: Vec<u8> = std::iter::from_fn(|| self.0.pop_front().filter(|&byte| byte != 0)).collect();
        String::from_utf8(text).expect("text")
    }
}

/// A picture as tev would have it.
#[derive(Default)]
struct Received {
    size: (usize, usize),
    channels: Vec<(String, Vec<f32>)>,
    creations: usize,
    updates: usize,
}

/// Reads packets until the sender hangs up.
fn receive(mut stream: TcpStream) -> Received {
    let mut received = Received::default();
    let mut length = [0; 4];
    while stream.read_exact(&mut length).is_ok() {
        let length = u32::from_le_bytes(length) as usize;
        let mut packet = vec![0; length - 4];
        stream.read_exact(&mut packet).expect("the rest of the packet");
        let mut fields = Fields(packet.into());
        let ([kind], [grabs_focus], name) = (fields.bytes(), fields.bytes(), fields.text());
        assert_eq!((grabs_focus, name.as_str()), (0, "scene"));
        match kind {
            4 => {
                received.creations += 1;
                received.size = (fields.integer(), fields.integer());
                let count = fields.integer();
                received.channels = (0..count).map(|_| (fields.text(), Vec::new())).collect();
            }
            6 => {
                received.updates += 1;
                let count = fields.integer();
                let names: Vec<String> = (0..count).map(|_| fields.text()).collect();
                let [x, y, width, height] = std::array::from_fn(|_| fields.integer());
                assert_eq!((x, y, (width, height)), (0, 0, received.size));
                let offsets: Vec<usize> = names.iter().map(|_| fields.long()).collect();
                let strides: Vec<usize> = names.iter().map(|_| fields.long()).collect();
                let pixels = width * height;
                let values: Vec<f32> = (0..count * pixels).map(|_| f32::from_le_bytes(fields.bytes())).collect();
                for (name, (offset, stride)) in names.iter().zip(offsets.iter().zip(strides)) {
                    let channel = received.channels.iter_mut().find(|(of, _)| of == name).expect("a known channel");
                    channel.1 = (0..pixels).map(|pixel| values[offset + pixel * stride]).collect();
                }
            }
            other => panic!("a packet of kind {other}"),
        }
        assert!(fields.0.is_empty(), "{} bytes too many", fields.0.len());
    }
    received
}

/// A film of an empty scene, one sample everywhere but in the first pixel, which has two.
fn film() -> Film {
    let tracer = PathTracer::new(Arc::new(Scene::default()), TraceSettings::new(7, 5, 1));
    let one = |pixel, half| BlockWork { samples: 1, ..BlockWork::whole(pixel, half, 0) };
    let mut blocks: Vec<BlockWork> = (0..35).map(|pixel| one(pixel, Half::A)).collect();
    blocks.push(one(0, Half::B));
    let mut film = Film::new(7, 5);
    tracer.trace(&SamplePlan { blocks }, &mut film, &|_| {});
    film
}

#[test]
fn tev_receives_the_picture_and_its_layers() {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let tev = std::thread::spawn(move || receive(listener.accept().expect("a caller").0));
    let film = film();
    let rgb_cd_m2: Vec<[f32; 3]> = (0..35).map(|pixel| [pixel as f32, 2.0, -3.0]).collect();
    let shown =
        Shown { film: &film, rgb_cd_m2: &rgb_cd_m2, step: 1, looked: None, nits_per_unit: 2.0, stage: Stage::AtRest };
    let mut sender = Tev::new(vec![address], "scene".to_owned(), |warning| panic!("{warning}")).expect("a thread");
    sender.offer(&Shown { step: 2, ..shown });
    sender.offer(&shown);
    drop(sender);
    let received = tev.join().expect("every packet is sound");
    assert_eq!((received.size, received.creations, received.updates), ((7, 5), 1, 6));
    let channel = |name: &str| &received.channels.iter().find(|(of, _)| of == name).expect("sent").1;
    assert_eq!(*channel("R"), (0..35).map(|pixel| pixel as f32 / 2.0).collect::<Vec<f32>>());
    assert_eq!((channel("G")[34], channel("B")[0]), (1.0, -1.5));
    assert_eq!((channel("samples.Y")[0], channel("samples.Y")[1]), (2.0, 1.0));
    assert_eq!(received.channels.len(), 12);
}

/// Nobody there, and somebody who hangs up: one warning each, and whoever renders does not notice.
#[test]
fn a_tev_that_is_not_there_is_told_once() {
    static WARNINGS: AtomicUsize = AtomicUsize::new(0);
    let count = |_: &str| {
        WARNINGS.fetch_add(1, Ordering::SeqCst);
    };
    let film = film();
    let rgb_cd_m2 = vec![[1.0; 3]; 35];
    let shown =
        Shown { film: &film, rgb_cd_m2: &rgb_cd_m2, step: 1, looked: None, nits_per_unit: 1.0, stage: Stage::AtRest };
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address");
    let mut sender = Tev::new(vec![address], "scene".to_owned(), count).expect("a thread");
    drop(listener.accept().expect("a caller"));
    drop(listener);
    let started = Instant::now();
    while WARNINGS.load(Ordering::SeqCst) == 0 {
        sender.offer(&shown);
        assert!(started.elapsed() < Duration::from_secs(60), "nobody says that tev has gone");
    }
    drop(sender);
    let mut sender = Tev::new(vec![address], "scene".to_owned(), count).expect("a thread");
    (0..100).for_each(|_| sender.offer(&shown));
    drop(sender);
    assert_eq!(WARNINGS.load(Ordering::SeqCst), 2);
}
