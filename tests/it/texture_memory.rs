//! `--texture-memory`: textures within a limit, and a note that says so.

use crate::support::command::{self, fechner, said};
use fechner::scene::load::{LoadOptions, load};
use fechner::scene::{Scene, Texels};
use std::path::PathBuf;
use std::sync::Arc;

fn textured_room() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("scenes/textured-room.toml")
}

fn within(limit: Option<u64>) -> Scene {
    let options = LoadOptions { texture_memory: limit, ..LoadOptions::default() };
    load(&textured_room(), &options).unwrap_or_else(|error| panic!("{error}"))
}

/// Bytes of all textures; pictures that several share count once.
fn bytes(scene: &Scene) -> u64 {
    let mut seen = Vec::new();
    let arrays = scene.textures.iter().map(|texture| match &texture.texels {
        Texels::Bytes(texels, _) => (Arc::as_ptr(texels).addr(), 4 * texels.len()),
        Texels::Floats(texels) => (Arc::as_ptr(texels).addr(), 16 * texels.len()),
    });
    arrays
        .filter(|(place, _)| {
            !seen.contains(place) && {
                seen.push(*place);
                true
            }
        })
        .map(|(_, size)| size as u64)
        .sum()
}

#[test]
fn textures_keep_to_the_limit() {
    let whole = within(None);
    let all = bytes(&whole);
    assert!(whole.notes.iter().all(|note| !note.contains("To keep textures")), "{:?}", whole.notes);
    assert!(within(Some(all)).notes == whole.notes);
    for limit in [all - 1, all / 3, 50_000, 100] {
        let scene = within(Some(limit));
        assert!(bytes(&scene) <= limit, "{} of {limit}", bytes(&scene));
        let notes: Vec<&String> = scene.notes.iter().filter(|note| note.contains("To keep textures")).collect();
        let [note] = notes.as_slice() else { panic!("{notes:?}") };
        for (texture, before) in scene.textures.iter().zip(&whole.textures) {
            let shrank = texture.width < before.width;
            assert_eq!(note.contains(&texture.name), shrank, "{}: {note}", texture.name);
        }
        assert_eq!(scene.notes, within(Some(limit)).notes);
    }
}

#[test]
fn render_takes_the_limit_in_megabytes() {
    let folder = tempfile::tempdir().unwrap();
    let render = |limit: &str| {
        let mut command = fechner();
        command.args([
            "render",
            "--size",
            "16x16",
            "--sampling",
            "uniform",
            "--spp",
            "1",
            "-o",
            "a.png",
            "--texture-memory",
        ]);
        command.arg(limit).arg(textured_room()).current_dir(folder.path());
        command
    };
    let said = said(&command::run(&mut render("1")));
    assert!(said.contains("To keep textures within 1 MB"), "{said}");
    assert_eq!(render("0").output().expect("runs").status.code(), Some(2));
}
