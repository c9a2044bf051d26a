//! The slope widths of a coat and of the metal beneath for which there are tables.

use super::anisotropic_table::{NodesBeside, WidthRange};
use super::microfacets::Microfacets;
use crate::scene::Distribution;

/// Widths at which a texture's range is tabulated where all facets are isotropic.
const ISOTROPIC_NODES: usize = 12;
/// The same along each axis where they are not, with one, two and three textures of widths.
const ANISOTROPIC_NODES: [usize; 3] = [12, 9, 8];

/// Which slope widths the facets of a layer may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LayerWidths {
    /// Facets of the same width along every azimuth; a model of other facets takes their mean width for all.
    Isotropic(WidthRange),
    /// Such along x and along y.
    Anisotropic([WidthRange; 2]),
}

impl LayerWidths {
    /// How many textures give them.
    fn textures(self) -> usize {
        match self {
            Self::Isotropic(range) => usize::from(range == WidthRange::Textured),
            Self::Anisotropic(ranges) => ranges.iter().filter(|range| **range == WidthRange::Textured).count(),
        }
    }
}

/// Something by its number, and how much it counts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weighed {
    pub(super) index: usize,
    pub(super) weight: f32,
}

impl Weighed {
    pub(super) const NOTHING: Self = Self { index: 0, weight: 0.0 };
}

/// The widths of one layer for which there are tables.
#[derive(Clone, Debug)]
pub(super) struct WidthNodes {
    /// Along x and y; `None` along y where facets are isotropic.
    along: (Vec<f32>, Option<Vec<f32>>),
}

impl WidthNodes {
    /// Widths of coat and metal for which there are tables. Where textures give all four widths, the coat's are of the
    /// mean: tables over four widths would be too many to compute.
    pub(super) fn of_layers([coat, base]: [LayerWidths; 2]) -> [Self; 2] {
        let textures = coat.textures() + base.textures();
        let coat = if textures > ANISOTROPIC_NODES.len() { LayerWidths::Isotropic(WidthRange::Textured) } else { coat };
        let count = match (coat, base) {
            (LayerWidths::Isotropic(_), LayerWidths::Isotropic(_)) => ISOTROPIC_NODES,
            _ => ANISOTROPIC_NODES[textures.clamp(1, ANISOTROPIC_NODES.len()) - 1],
        };
        [coat, base].map(|widths| match widths {
            LayerWidths::Isotropic(range) => Self { along: (range.nodes(count), None) },
            LayerWidths::Anisotropic([x, y]) => Self { along: (x.nodes(count), Some(y.nodes(count))) },
        })
    }

    pub(super) fn is_anisotropic(&self) -> bool {
        self.along.1.is_some()
    }

    pub(super) fn count(&self) -> usize {
        self.along.0.len() * self.count_along_y()
    }

    fn count_along_y(&self) -> usize {
        self.along.1.as_ref().map_or(1, Vec::len)
    }

    /// Facets of all nodes, by width along x, then y.
    pub(super) fn facets(&self, distribution: Distribution) -> impl Iterator<Item = Microfacets> + '_ {
        let (x, y) = &self.along;
        x.iter().flat_map(move |&alpha_x| {
            let along_y = y.as_deref().unwrap_or(std::slice::from_ref(&alpha_x)).to_vec();
            along_y.into_iter().map(move |alpha_y| Microfacets::new(alpha_x, alpha_y, distribution))
        })
    }

    /// The nodes beside such facets and how much each counts.
    pub(super) fn beside(&self, facets: &Microfacets) -> [Weighed; 4] {
        if !self.is_anisotropic() {
            let NodesBeside { low, high, fraction } = NodesBeside::of(facets.mean_alpha(), self.along.0.len());
            let (low, high) =
                (Weighed { index: low, weight: 1.0 - fraction }, Weighed { index: high, weight: fraction });
            return [low, high, Weighed::NOTHING, Weighed::NOTHING];
        }
        let [alpha_x, alpha_y] = facets.alphas();
        let along_y = self.count_along_y();
        let x = NodesBeside::of(alpha_x, self.along.0.len());
        let y = NodesBeside::of(alpha_y, along_y);
        [
            Weighed { index: x.low * along_y + y.low, weight: (1.0 - x.fraction) * (1.0 - y.fraction) },
            Weighed { index: x.low * along_y + y.high, weight: (1.0 - x.fraction) * y.fraction },
            Weighed { index: x.high * along_y + y.low, weight: x.fraction * (1.0 - y.fraction) },
            Weighed { index: x.high * along_y + y.high, weight: x.fraction * y.fraction },
        ]
    }
}
