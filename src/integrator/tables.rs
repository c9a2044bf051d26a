//! Tables that materials need, computed once before tracing and shared where parameters are equal. What is in them is
//! left to `bsdf`.

use crate::bsdf::{AnisotropicTable, CoatTables, DielectricTables, LayerTables, LayerWidths, WidthRange};
use crate::scene::{Distribution, Material, Roughness, RoughnessScale, ScalarInput, Surface};
use std::collections::HashMap;
use std::sync::Arc;

/// The tables of one surface.
pub(super) enum SurfaceTables {
    /// No tables: the surface needs none.
    None,
    /// Tables of a metal of anisotropic roughness.
    Conductor(Box<AnisotropicTable>),
    /// Tables of a rough dielectric.
    Dielectric(Arc<DielectricTables>),
    /// Tables of a coat over a diffuse base.
    Coat(Arc<CoatTables>),
    /// Tables of a coat over a metal.
    Layers(Arc<LayerTables>),
    /// Tables of both components of a mix.
    Mix(Box<[SurfaceTables; 2]>),
}

/// Tables without which a surface cannot be evaluated. A surface and tables that [`of_materials`] did not
/// make for it are a mistake in this crate, which no scene file can bring about: that ends the program rather
/// than paint the surface black.
impl SurfaceTables {
    pub(super) fn coat(&self) -> &CoatTables {
        let Self::Coat(tables) = self else { unreachable!("a coated diffuse surface has tables of its coat") };
        tables
    }

    pub(super) fn layers(&self) -> &LayerTables {
        let Self::Layers(tables) = self else { unreachable!("a coated metal has tables of its layers") };
        tables
    }

    pub(super) fn of_components(&self) -> &[Self; 2] {
        let Self::Mix(tables) = self else { unreachable!("a mix has tables of both components") };
        tables
    }
}

/// Makes tables; equal ones only once.
#[derive(Default)]
struct Maker {
    dielectrics: HashMap<(u32, Distribution), Arc<DielectricTables>>,
    coats: HashMap<(u32, Distribution), Arc<CoatTables>>,
}

/// The tables of each material.
pub(super) fn of_materials(materials: &[Material]) -> Vec<SurfaceTables> {
    let mut maker = Maker::default();
    materials.iter().map(|material| maker.tables_of(&material.surface)).collect()
}

impl Maker {
    fn tables_of(&mut self, surface: &Surface) -> SurfaceTables {
        match surface {
            Surface::Conductor { roughness, .. } => match widths(roughness) {
                Some(ranges) => {
                    SurfaceTables::Conductor(Box::new(AnisotropicTable::missing(ranges, roughness.distribution)))
                }
                None => SurfaceTables::None,
            },
            Surface::Dielectric { ior, roughness, .. } if !roughness.is_smooth() => {
                SurfaceTables::Dielectric(self.dielectric(*ior, roughness))
            }
            Surface::MetalRoughness(model) if model.volume.is_some() => {
                SurfaceTables::Dielectric(self.dielectric(model.ior, &Roughness::isotropic(model.roughness)))
            }
            Surface::CoatedDiffuse { ior, roughness, .. } => SurfaceTables::Coat(self.coat(*ior, roughness)),
            Surface::CoatedConductor { coat_ior, roughness, coat_roughness, .. } => {
                let distributions = [coat_roughness.distribution, roughness.distribution];
                let widths = [layer_widths(coat_roughness), layer_widths(roughness)];
                SurfaceTables::Layers(Arc::new(LayerTables::new(*coat_ior, distributions, widths)))
            }
            Surface::Mix { first, second, .. } => {
                SurfaceTables::Mix(Box::new([self.tables_of(first), self.tables_of(second)]))
            }
            Surface::Dielectric { .. }
            | Surface::MetalRoughness(_)
            | Surface::Diffuse { .. }
            | Surface::OrenNayar { .. }
            | Surface::DiffuseTransmission { .. }
            | Surface::Mirror { .. }
            | Surface::ThinDielectric { .. }
            | Surface::Phong { .. }
            | Surface::Ward { .. }
            | Surface::HeTorrance { .. } => SurfaceTables::None,
        }
    }

    fn dielectric(&mut self, ior: f32, roughness: &Roughness) -> Arc<DielectricTables> {
        let key = (ior.to_bits(), roughness.distribution);
        let make = || Arc::new(DielectricTables::new(ior, roughness.distribution));
        let shared = self.dielectrics.entry(key).or_insert_with(make);
        match widths(roughness) {
            Some(ranges) => Arc::new(DielectricTables::clone(shared).with_anisotropy(ranges)),
            None => shared.clone(),
        }
    }

    fn coat(&mut self, ior: f32, roughness: &Roughness) -> Arc<CoatTables> {
        let key = (ior.to_bits(), roughness.distribution);
        let make = || Arc::new(CoatTables::new(ior, roughness.distribution));
        let shared = self.coats.entry(key).or_insert_with(make);
        match widths(roughness) {
            Some(ranges) => Arc::new(CoatTables::clone(shared).with_anisotropy(ranges)),
            None => shared.clone(),
        }
    }
}

/// The slope widths that an anisotropic roughness may take along each axis.
fn widths(roughness: &Roughness) -> Option<[WidthRange; 2]> {
    roughness.v.as_ref().map(|v| [width(roughness, &roughness.u), width(roughness, v)])
}

fn width(roughness: &Roughness, input: &ScalarInput) -> WidthRange {
    match input.texture {
        None => WidthRange::Constant(slope_width(roughness.scale, input.factor)),
        Some(_) => WidthRange::Textured,
    }
}

/// The slope widths that a layer of such roughness may take.
fn layer_widths(roughness: &Roughness) -> LayerWidths {
    match widths(roughness) {
        None => LayerWidths::Isotropic(width(roughness, &roughness.u)),
        Some([WidthRange::Constant(u), WidthRange::Constant(v)]) if u == v => {
            LayerWidths::Isotropic(WidthRange::Constant(u))
        }
        Some(ranges) => LayerWidths::Anisotropic(ranges),
    }
}

/// The slope width α in [0, 1] for a number on a scale.
pub(super) fn slope_width(scale: RoughnessScale, value: f32) -> f32 {
    let value = value.clamp(0.0, 1.0);
    match scale {
        RoughnessScale::Perceptual => value * value,
        RoughnessScale::Alpha => value,
        RoughnessScale::SquareRoot => value.sqrt(),
    }
}
