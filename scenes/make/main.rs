//! Writes the meshes, textures and skies under `scenes/`.
fn main() {}
