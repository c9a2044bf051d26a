//! From a material and a surface point to a BSDF in its frame ([`super::frames`]).

use super::PathTracer;
use super::frames::Frames;
use super::media::{Crossed, Crossing, Medium};
use super::tables::{SurfaceTables, slope_width};
use crate::bsdf::{
    self, Bsdf, CoatedDiffuse, Conductor, Dielectric, HeTorrance, MetalRoughnessParameters, Microfacets, Phong,
    Saturation, Varnish, Varnished, Ward,
};
use crate::geometry::SurfacePoint;
use crate::geometry::surface::Frame;
use crate::light::LightReceiver;
use crate::scene::{ColorInput, MetalRoughness, Roughness, ScalarInput, Surface, Texture};
use glam::{Mat3, Vec2, Vec3};
use std::cell::{Cell, OnceCell};

/// A BSDF and the frame in which it works.
pub(super) struct Shading<'a> {
    /// Stays where it was made: it takes hundreds of bytes, and to move them takes 3 % of the Cornell box's time.
    pub(super) bsdf: &'a Bsdf<'a>,
    pub(super) frame: Frame,
    /// Normal of what has the material's relief: a smooth coat over it shows less of what is there.
    pub(super) normal: Vec3,
    pub(super) geometric_normal: Vec3,
    /// Whether light can come from the other side.
    pub(super) transmits: bool,
    /// The volume behind the surface, if any volume of the scene absorbs.
    pub(super) medium: Option<Medium>,
}

/// Components of a mix, two for each of its nodes: a place to stay for what the mix refers to, on the stack of the
/// path.
pub(super) struct Components<'a> {
    cells: [OnceCell<Bsdf<'a>>; 2 * (Surface::MAX_COMPONENTS - 1)],
    used: Cell<usize>,
}

impl<'a> Components<'a> {
    pub(super) fn new() -> Self {
        // Not `[const { .. }; N]`: that copies kilobytes of empty cells at every hit, which takes 17 % of the Cornell
        // box's time.
        Self { cells: std::array::from_fn(|_| OnceCell::new()), used: Cell::new(0) }
    }

    /// Keeps a component. Of more than fit, which loaders refuse, the last stands for the rest.
    fn keep(&'a self, bsdf: Bsdf<'a>) -> &'a Bsdf<'a> {
        let place = self.used.get().min(self.cells.len() - 1);
        self.used.set(place + 1);
        self.cells[place].get_or_init(|| bsdf)
    }
}

/// Where the inputs of a material are read.
struct Reader<'a> {
    textures: &'a [Texture],
    uv: Vec2,
    vertex_color: Vec3,
    /// From the frame of the coat to that of what lies beneath it.
    beneath_coat: Option<Mat3>,
}

impl Reader<'_> {
    /// A share of light in [0, 1]: pictures and their factors may go beyond, and what reflects more than comes in, or
    /// less than nothing, breaks every model.
    fn color(&self, input: &ColorInput) -> Vec3 {
        input.evaluate(self.textures, self.uv).clamp(Vec3::ZERO, Vec3::ONE)
    }

    /// The base colour, which the vertices' colours multiply.
    fn base(&self, input: &ColorInput) -> Vec3 {
        (input.evaluate(self.textures, self.uv) * self.vertex_color).clamp(Vec3::ZERO, Vec3::ONE)
    }

    fn scalar(&self, input: &ScalarInput) -> f32 {
        input.evaluate(self.textures, self.uv)
    }

    /// Two albedos, scaled down where their sum exceeds 1.
    fn shares(&self, first: &ColorInput, second: &ColorInput) -> [Vec3; 2] {
        let (first, second) = (self.color(first), self.color(second));
        let scale = 1.0 / (first + second).max_element().max(1.0);
        [first * scale, second * scale]
    }

    /// What a thin sheet reflects and lets through: a channel that would make light is scaled down, and no other.
    fn of_sheet(&self, reflectance: &ColorInput, transmittance: &ColorInput) -> [Vec3; 2] {
        let (reflected, transmitted) = (self.color(reflectance), self.color(transmittance));
        let excess = (reflected + transmitted).max(Vec3::ONE);
        [reflected / excess, transmitted / excess]
    }

    fn facets(&self, roughness: &Roughness) -> Microfacets {
        let u = slope_width(roughness.scale, self.scalar(&roughness.u));
        let v = roughness.v.as_ref().map_or(u, |v| slope_width(roughness.scale, self.scalar(v)));
        Microfacets::new(u, v, roughness.distribution)
    }

    /// glTF's model; with a volume, what it transmits is a dielectric's boundary, mixed in by its share.
    fn metal_roughness<'a>(
        &self,
        model: &MetalRoughness,
        tables: &'a SurfaceTables,
        components: &'a Components<'a>,
    ) -> Bsdf<'a> {
        let transmission = self.scalar(&model.transmission).clamp(0.0, 1.0);
        let parameters = MetalRoughnessParameters {
            base_color: self.base(&model.base_color),
            metallic: self.scalar(&model.metallic),
            roughness: self.scalar(&model.roughness),
            anisotropy: self.scalar(&model.anisotropy),
            ior: model.ior,
            specular: self.scalar(&model.specular),
            // Above 1 it is a stronger tint, which the model takes.
            specular_color: model.specular_color.evaluate(self.textures, self.uv).max(Vec3::ZERO),
            transmission: if model.volume.is_some() { 0.0 } else { transmission },
        };
        let base = bsdf::MetalRoughness::new(&parameters);
        let boundary = match tables {
            SurfaceTables::Dielectric(tables) => {
                let boundary = Bsdf::dielectric(model.ior, parameters.roughness, parameters.base_color, Some(tables));
                let amount = transmission * (1.0 - parameters.metallic.clamp(0.0, 1.0));
                let opaque = components.keep(Bsdf::MetalRoughness(base));
                Some(Bsdf::mix(opaque, components.keep(boundary), amount))
            }
            _ => None,
        };
        let (clearcoat, sheen) = (self.scalar(&model.clearcoat), self.color(&model.sheen_color));
        if clearcoat > 0.0 || sheen != Vec3::ZERO || self.beneath_coat.is_some() {
            let base =
                boundary.map_or(Varnished::Sheet(base), |boundary| Varnished::Boundary(components.keep(boundary)));
            let clearcoat_roughness = self.scalar(&model.clearcoat_roughness);
            let sheen_roughness = self.scalar(&model.sheen_roughness);
            let varnish = Varnish::new(base, clearcoat, clearcoat_roughness, sheen, sheen_roughness);
            return Bsdf::Varnish(varnish.over_relief(self.beneath_coat));
        }
        boundary.unwrap_or(Bsdf::MetalRoughness(base))
    }

    fn bsdf<'a>(&self, surface: &Surface, tables: &'a SurfaceTables, components: &'a Components<'a>) -> Bsdf<'a> {
        match (surface, tables) {
            (Surface::Diffuse { reflectance }, _) => Bsdf::lambert(self.base(reflectance)),
            (Surface::OrenNayar { reflectance, roughness }, _) => {
                Bsdf::oren_nayar(self.base(reflectance), self.scalar(roughness))
            }
            (Surface::DiffuseTransmission { reflectance, transmittance }, _) => {
                let [reflected, transmitted] = self.of_sheet(reflectance, transmittance);
                Bsdf::diffuse_transmission(reflected, transmitted)
            }
            (Surface::Mirror { reflectance }, _) => Bsdf::mirror(self.color(reflectance)),
            (Surface::Conductor { eta, k, tint, roughness }, tables) => {
                let table = match tables {
                    SurfaceTables::Conductor(table) => Some(&**table),
                    _ => None,
                };
                Bsdf::Conductor(Conductor::new(*eta, *k, self.color(tint), self.facets(roughness), table))
            }
            (Surface::Dielectric { ior, roughness, transmittance, .. }, tables) => {
                let tables = match tables {
                    SurfaceTables::Dielectric(tables) => Some(&**tables),
                    _ => None,
                };
                Bsdf::Dielectric(Dielectric::new(*ior, self.facets(roughness), self.color(transmittance), tables))
            }
            (Surface::ThinDielectric { ior, transmittance }, _) => {
                Bsdf::thin_dielectric(*ior, self.color(transmittance))
            }
            (Surface::CoatedDiffuse { reflectance, roughness, saturates, .. }, tables) => {
                let facets = self.facets(roughness);
                let saturation = if *saturates { Saturation::Repeated } else { Saturation::None };
                Bsdf::CoatedDiffuse(CoatedDiffuse::new(self.base(reflectance), facets, saturation, tables.coat()))
            }
            (Surface::CoatedConductor { eta, k, roughness, coat_roughness, .. }, tables) => {
                Bsdf::coated_conductor(*eta, *k, self.facets(roughness), self.facets(coat_roughness), tables.layers())
            }
            (Surface::Phong { diffuse, specular, exponent }, _) => {
                let [diffuse, specular] = self.shares(diffuse, specular);
                Bsdf::Phong(Phong::new(diffuse, specular, self.scalar(exponent)))
            }
            (Surface::Ward { diffuse, specular, roughness }, _) => {
                let [diffuse, specular] = self.shares(diffuse, specular);
                Bsdf::Ward(Ward::new(diffuse, specular, self.facets(roughness).alphas()))
            }
            (Surface::HeTorrance { eta, k, height_nm, correlation_nm, diffuse }, _) => {
                Bsdf::HeTorrance(HeTorrance::new(*eta, *k, *height_nm, *correlation_nm, self.color(diffuse)))
            }
            (Surface::MetalRoughness(model), tables) => self.metal_roughness(model, tables, components),
            (Surface::Mix { first, second, amount }, tables) => {
                let tables = tables.of_components();
                let first = components.keep(self.bsdf(first, &tables[0], components));
                let second = components.keep(self.bsdf(second, &tables[1], components));
                Bsdf::mix(first, second, self.scalar(amount))
            }
        }
    }
}

impl Shading<'_> {
    /// What the choice of a light may know of this point: surfaces that transmit receive from both sides.
    pub(super) fn receiver(&self, point: &SurfacePoint, wo: Vec3) -> LightReceiver {
        let side = if wo.dot(self.geometric_normal) >= 0.0 { 1.0 } else { -1.0 };
        let normal = if self.transmits { Vec3::ZERO } else { side * self.geometric_normal };
        LightReceiver { position: point.position, normal }
    }

    /// The volume whose boundary a path crosses that came along `wo` and goes on along `wi`, and which way; `None`
    /// where it stays on its side, or no volume absorbs.
    pub(super) fn crossed_medium(&self, wo: Vec3, wi: Vec3) -> Option<Crossed> {
        let medium = self.medium?;
        let (from_front, to_front) = (wo.dot(self.geometric_normal) > 0.0, wi.dot(self.geometric_normal) > 0.0);
        let crossing = if from_front { Crossing::In } else { Crossing::Out };
        (from_front != to_front).then_some(Crossed { medium, crossing })
    }

    /// Share of light from behind that goes straight on in the direction `wo`: 0 at the boundary of a volume.
    pub(super) fn straight_through(&self, wo: Vec3) -> Vec3 {
        if self.medium.is_some() { Vec3::ZERO } else { self.bsdf.straight_through(self.frame.to_local(wo)) }
    }

    /// Whether two world directions are on the same side of the surface by both normals, or on opposite sides by both.
    /// Where shading and geometric normal disagree, light would leak through: such pairs scatter nothing.
    pub(super) fn sides_agree(&self, a: Vec3, b: Vec3) -> bool {
        let geometric = a.dot(self.geometric_normal) * b.dot(self.geometric_normal);
        let shading = a.dot(self.frame.normal()) * b.dot(self.frame.normal());
        geometric * shading > 0.0
    }
}

impl PathTracer {
    /// The BSDF at a point.
    pub(super) fn bsdf<'a>(
        &'a self,
        point: &SurfacePoint,
        frames: &Frames,
        components: &'a Components<'a>,
    ) -> Bsdf<'a> {
        let scene = self.world.scene();
        let material = self.world.material_of(point.object).0 as usize;
        let reader = Reader {
            textures: &scene.textures,
            uv: point.uv,
            vertex_color: point.color,
            beneath_coat: frames.beneath_coat,
        };
        reader.bsdf(&scene.materials[material].surface, &self.surface_tables[material], components)
    }

    /// What a point with such a BSDF in such frames does to light.
    #[inline(always)]
    pub(super) fn shading<'a>(&self, bsdf: &'a Bsdf<'a>, point: &SurfacePoint, frames: &Frames) -> Shading<'a> {
        let surface = &self.world.material(point.object).surface;
        let medium = || Medium::behind(self.world.material_of(point.object), surface);
        Shading {
            bsdf,
            frame: frames.frame,
            normal: frames.normal,
            geometric_normal: point.geometric_normal,
            transmits: surface.transmits(),
            medium: if self.absorbs { medium() } else { None },
        }
    }
}
