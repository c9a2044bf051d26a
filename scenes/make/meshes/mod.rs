//! Everything turned, grown and draped in the scenes, in metres, standing on y = 0.

mod fruit;
mod furniture;
mod glass;
mod product;
mod tableware;

use crate::mesh::{Part, write_obj};
use std::path::Path;

/// Materials of all meshes, with the physically based extension (`Pr` roughness, `Pm` metallic).
const MATERIALS: &str = "\
# Made by fechner's make-scenes. Colours are linear Rec.709.
newmtl table\nKd 1 1 1\nmap_Kd ../textures/wood.png\nPr 1\nmap_Pr ../textures/wood-roughness.png\nPm 0\n
newmtl tiles\nKd 1 1 1\nmap_Kd ../textures/tiles.png\nPr 1\nmap_Pr ../textures/tiles-roughness.png\nnorm ../textures/tiles-normal.png\nPm 0\n
newmtl linen\nKd 1 1 1\nmap_Kd ../textures/linen.png\nnorm ../textures/linen-normal.png\nPr 0.9\nPm 0\n
newmtl vase\nKd 1 1 1\nmap_Kd ../textures/vase.png\nPr 0.12\nPm 0\n
newmtl glaze\nKd 0.80 0.79 0.74\nPr 0.12\nPm 0\n
newmtl stoneware\nKd 0.13 0.17 0.20\nPr 0.35\nPm 0\n
newmtl copper\nKd 0.94 0.60 0.46\nPr 0.24\nPm 1\n
newmtl brass\nKd 0.90 0.72 0.36\nPr 0.30\nPm 1\n
newmtl apple\nKd 1 1 1\nmap_Kd ../textures/apple.png\nPr 0.28\nPm 0\n
newmtl orange\nKd 0.85 0.27 0.025\nPr 0.36\nPm 0\nnorm ../textures/peel-normal.png\n
newmtl lemon\nKd 0.88 0.62 0.06\nPr 0.34\nPm 0\nnorm ../textures/peel-normal.png\n
newmtl pear\nKd 0.50 0.50 0.10\nPr 0.40\nPm 0\n
newmtl stem\nKd 0.10 0.06 0.03\nPr 0.8\nPm 0\n
newmtl wax\nKd 0.86 0.80 0.66\nPr 0.45\nPm 0\n
newmtl backdrop\nKd 0.62 0.62 0.64\nPr 0.7\nPm 0\n
newmtl lacquer\nKd 0.42 0.015 0.03\nPr 0.10\nPm 0\n
newmtl black\nKd 0.012 0.012 0.014\nPr 0.14\nPm 0\n
newmtl gold\nKd 1.00 0.77 0.34\nPr 0.16\nPm 1\n
newmtl steel\nKd 0.60 0.58 0.56\nPr 0.20\nPm 1\n
";

/// Writes every mesh and `materials.mtl`.
pub(crate) fn write_all(folder: &Path) -> anyhow::Result<()> {
    std::fs::write(folder.join("materials.mtl"), MATERIALS)?;
    let write = |name: &str, parts: Vec<Part>| write_obj(folder, name, &parts, is_textured);
    write("table", furniture::table())?;
    write("cloth", vec![furniture::cloth()])?;
    write("vase", tableware::vase())?;
    write("bowl", tableware::bowl())?;
    write("jug", tableware::jug())?;
    write("candle", tableware::candle())?;
    write("apple", fruit::apple())?;
    write("orange", vec![fruit::orange()])?;
    write("lemon", vec![fruit::lemon()])?;
    write("pear", fruit::pear())?;
    write("tumbler", glass::tumbler())?;
    write("chess-pawn", glass::pawn())?;
    write("flask", product::flask())?;
    write("lipstick", product::lipstick())?;
    write("backdrop", vec![product::backdrop()])
}

/// Whether a material of [`MATERIALS`] uses a picture.
fn is_textured(material: &str) -> bool {
    let name = format!("newmtl {material}\n");
    let entry = MATERIALS.split_once(&name).expect("every part uses one of our materials").1;
    let entry = entry.split_once("newmtl").map_or(entry, |(entry, _)| entry);
    entry.contains("map_") || entry.contains("norm ")
}
