use super::*;
use crate::output::{Picture, write_exr};
use std::time::{Duration, Instant};

/// Peak memory of this process in KiB, where the system tells.
fn peak_memory_kib() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

#[test]
fn damaged_files_end_in_an_error_or_a_picture_soon_and_in_little_memory() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/assets/faults/exr-damaged");
    let Ok(files) = std::fs::read_dir(&folder) else {
        println!("skipped: {} is not there", folder.display());
        return;
    };
    let mut readable = 0;
    let mut refused = 0;
    for file in files {
        let path = file.unwrap().path();
        let start = Instant::now();
        match read_exr(&path) {
            Ok(image) => {
                readable += 1;
                assert!(image.channels.iter().all(|(_, v)| v.len() == (image.width * image.height) as usize));
            }
            Err(error) => {
                refused += 1;
                let message = error.to_string();
                assert!(message.starts_with("cannot read ") && !message.contains('\n'), "{message}");
                println!("{message}");
            }
        }
        assert!(start.elapsed() < Duration::from_secs(5), "{} took {:?}", path.display(), start.elapsed());
    }
    println!("{readable} readable, {refused} refused, peak {:?} KiB", peak_memory_kib());
    assert!(refused > 50, "{refused} refused");
    if let Some(kib) = peak_memory_kib() {
        assert!(kib < 1 << 20, "peak memory {kib} KiB");
    }
}

/// A small sound file, to be damaged.
fn sound_file(folder: &Path) -> Vec<u8> {
    let path = folder.join("sound.exr");
    let mut picture = Picture::new(16, 16);
    let values: Vec<f32> = (0..256).map(|i| (i * i % 17) as f32).collect();
    picture.push_f32("R", &values[..]);
    picture.push_f16("G", &values[..]);
    write_exr(&path, &picture).unwrap();
    std::fs::read(path).unwrap()
}

#[test]
fn every_cut_of_a_file_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = sound_file(folder.path());
    let path = folder.path().join("cut.exr");
    for length in 0..bytes.len() {
        std::fs::write(&path, &bytes[..length]).unwrap();
        assert!(read_exr(&path).is_err(), "cut to {length} of {} bytes", bytes.len());
    }
}

#[test]
fn any_changed_byte_is_survived() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = sound_file(folder.path());
    let path = folder.path().join("changed.exr");
    for at in 0..bytes.len() {
        for value in [0x00, 0x7f, 0xff] {
            let mut changed = bytes.clone();
            changed[at] = value;
            std::fs::write(&path, changed).unwrap();
            if let Ok(image) = read_exr(&path) {
                assert!(u64::from(image.width) * u64::from(image.height) * 8 <= MEMORY_LIMIT_BYTES);
            }
        }
    }
}

#[test]
fn a_picture_too_large_for_memory_is_refused_by_its_size() {
    let folder = tempfile::tempdir().unwrap();
    let mut bytes = sound_file(folder.path());
    let name = b"dataWindow\0box2i\0";
    let at = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len() + 4;
    bytes[at + 8..at + 12].copy_from_slice(&99_999i32.to_le_bytes());
    bytes[at + 12..at + 16].copy_from_slice(&99_999i32.to_le_bytes());
    let path = folder.path().join("large.exr");
    std::fs::write(&path, bytes).unwrap();
    let message = read_exr(&path).unwrap_err().to_string();
    assert!(message.contains("100000×100000 pixels of 2 channels need 76293 MiB"), "{message}");
}

#[test]
fn what_is_no_exr_file_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let message = |path: &Path| read_exr(path).unwrap_err().to_string();
    assert!(message(folder.path()).contains("it is a folder"));
    assert!(message(&folder.path().join("none.exr")).contains("none.exr"));
    let path = folder.path().join("text.exr");
    std::fs::write(&path, "").unwrap();
    assert!(message(&path).contains("it is empty"));
    std::fs::write(&path, "not a picture").unwrap();
    assert!(message(&path).contains("damaged or no EXR file"));
}
