//! What a scene is, in 32 bytes: equal content gives equal hashes, whatever its files, objects and materials are
//! called.
//!
//! Not for comparing machines of different byte order: large arrays are hashed as they stand in memory.

use super::{FilmDefaults, Light, PhotometricWeb, Scene, Texels, ViewingDefaults};
use bytemuck::NoUninit;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::io::{BufWriter, Write};
use std::mem::take;
use std::sync::Arc;

/// BLAKE3 of everything in a scene that samples depend on.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct ContentHash([u8; 32]);

/// Hexadecimal where people read it, bytes elsewhere.
impl Serialize for ContentHash {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            serializer.serialize_str(blake3::Hash::from_bytes(self.0).to_hex().as_str())
        } else {
            self.0.serialize(serializer)
        }
    }
}

impl<'de> Deserialize<'de> for ContentHash {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            let hash = blake3::Hash::from_hex(String::deserialize(deserializer)?).map_err(serde::de::Error::custom)?;
            Ok(Self(*hash.as_bytes()))
        } else {
            <[u8; 32]>::deserialize(deserializer).map(Self)
        }
    }
}

impl std::fmt::Display for ContentHash {
    /// The first 16 hexadecimal digits.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0[..8].iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl std::fmt::Debug for ContentHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Display::fmt(self, f)
    }
}

impl ContentHash {
    /// Hash of bytes.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Hash of an array of numbers.
    pub fn of_values(values: &[f32]) -> Self {
        let mut hasher = blake3::Hasher::new();
        hash_array(&mut hasher, values);
        Self(*hasher.finalize().as_bytes())
    }
}

/// Hashes a scene, less what no sample depends on: its name, its parts' names and its notes, the seconds of a
/// shutter that motions hold already, and what it asks for when the command line does not. Objects are numbered by
/// their order, not by name.
///
/// Large arrays are hashed as bytes, and all else as its `Debug` text, which is exact for floats and holds every field:
/// one that is added to a type is covered without a word here. Takes a copy of the scene's arrays while it runs.
pub fn content_hash(scene: &Scene) -> ContentHash {
    let mut rest = scene.clone();
    rest.name.clear();
    names_of_parts(&mut rest).for_each(String::clear);
    rest.notes.clear();
    rest.shutter_s = 0.0;
    rest.film = FilmDefaults { width: 0, height: 0 };
    rest.viewing = ViewingDefaults::default();

    let mut hasher = blake3::Hasher::new();
    for mesh in &mut rest.meshes {
        hash_array(&mut hasher, &take(&mut mesh.positions));
        hash_array(&mut hasher, &take(&mut mesh.normals));
        hash_array(&mut hasher, &take(&mut mesh.uvs));
        hash_array(&mut hasher, &take(&mut mesh.tangents));
        hash_array(&mut hasher, &take(&mut mesh.colors));
        hash_array(&mut hasher, &take(&mut mesh.triangles));
    }
    for texture in &mut rest.textures {
        match &mut texture.texels {
            Texels::Bytes(texels, _) => hash_array(&mut hasher, &take(texels)),
            Texels::Floats(texels) => hash_array(&mut hasher, &take(texels)),
        }
    }
    if let Some(environment) = &mut rest.environment {
        hash_array(&mut hasher, &take(&mut environment.texels));
    }
    let dark = Arc::<PhotometricWeb>::default();
    for light in &mut rest.lights {
        if let Light::Photometric { web, .. } = light {
            web.arrays().into_iter().for_each(|array| hash_array(&mut hasher, array));
            *web = Arc::clone(&dark);
        }
    }
    let mut text = BufWriter::with_capacity(1 << 16, &mut hasher);
    write!(text, "{rest:?}").and_then(|()| text.flush()).expect("a hasher takes all bytes");
    drop(text);
    ContentHash(*hasher.finalize().as_bytes())
}

/// What the parts of a scene are called, for messages: in the file, or by a file's name.
fn names_of_parts(scene: &mut Scene) -> impl Iterator<Item = &mut String> {
    let Scene { meshes, instances, spheres, materials, textures, .. } = scene;
    let of_shapes =
        meshes.iter_mut().map(|mesh| &mut mesh.name).chain(spheres.iter_mut().map(|sphere| &mut sphere.name));
    let of_instances = instances.iter_mut().map(|instance| &mut instance.name);
    let of_surfaces = materials.iter_mut().map(|material| &mut material.name);
    of_shapes.chain(of_instances).chain(of_surfaces).chain(textures.iter_mut().map(|texture| &mut texture.name))
}

fn hash_array<T: NoUninit>(hasher: &mut blake3::Hasher, values: &[T]) {
    hasher.update(&(values.len() as u64).to_le_bytes());
    hasher.update(bytemuck::cast_slice(values));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::{LoadOptions, load};
    use std::path::Path;

    fn scene(file: &str) -> Scene {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(file);
        load(&path, &LoadOptions::default()).expect("one of our own scenes loads")
    }

    /// A lamp of two planes whose last one begins at `vertical_deg`, of 1 cd but for the last value.
    fn photometric(vertical_deg: f32, last_cd: f32) -> Light {
        let mut intensity_cd = vec![1.0; 4];
        intensity_cd[3] = last_cd;
        let web = Arc::new(PhotometricWeb::new(vec![vertical_deg, 180.0], vec![0.0, 360.0], intensity_cd));
        let (position, per_candela) = (glam::Vec3::ZERO, glam::Vec3::ONE);
        Light::Photometric { position, from_world: glam::Mat3::IDENTITY, web, per_candela }
    }

    #[test]
    fn the_same_content_has_the_same_hash_under_another_name() {
        let mut renamed = scene("still-life.toml");
        renamed.name = "another".to_owned();
        renamed.notes.push("a note".to_owned());
        renamed.film.width += 1;
        names_of_parts(&mut renamed).for_each(|name| name.push_str(" under another name"));
        assert_eq!(content_hash(&renamed), content_hash(&scene("still-life.toml")));
    }

    /// Whatever changes, however little, gives a hash of its own.
    #[test]
    fn every_change_changes_the_hash() {
        type Change = fn(&mut Scene);
        let changes: [Change; 19] = [
            |_| {},
            |s| s.nits_per_unit *= 1.0 + f64::EPSILON,
            |s| s.camera.position.x += 1e-6,
            |s| s.camera.aperture_radius += 1e-7,
            |s| s.meshes[0].positions[0].y += 1e-6,
            |s| s.meshes[0].triangles[0].swap(0, 1),
            |s| s.meshes[0].triangles[0].rotate_left(1),
            |s| s.instances[0].to_world.translation.z += 1e-6,
            |s| s.materials[0].emits_both_sides ^= true,
            |s| s.materials[0].emission.factor.x += 1e-9 + f32::EPSILON * s.materials[0].emission.factor.x,
            |s| s.textures[0].nearest ^= true,
            |s| match &mut s.textures[0].texels {
                Texels::Bytes(texels, _) => Arc::make_mut(texels)[0][0] ^= 1,
                Texels::Floats(texels) => Arc::make_mut(texels)[0][0] += 1e-6,
            },
            |s| s.meshes.swap(0, 1),
            |s| s.meshes[0].uvs.clear(),
            |s| s.lights.push(Light::Point { position: glam::Vec3::ZERO, intensity: glam::Vec3::ONE }),
            |s| s.lights.push(photometric(0.0, 1.0)),
            |s| s.lights.push(photometric(0.0, 1.0 + f32::EPSILON)),
            |s| s.lights.push(photometric(f32::EPSILON, 1.0)),
            |s| s.environment.iter_mut().for_each(|e| e.scale *= 1.0 + f32::EPSILON),
        ];
        let base = scene("still-life.toml");
        let mut hashes: Vec<_> = changes
            .iter()
            .map(|change| {
                let mut changed = base.clone();
                change(&mut changed);
                content_hash(&changed).0
            })
            .collect();
        hashes.sort_unstable();
        hashes.dedup();
        assert!(base.environment.is_some(), "nothing to change about light from everywhere");
        assert_eq!(hashes.len(), changes.len());
    }
}
