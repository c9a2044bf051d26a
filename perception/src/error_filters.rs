//! The eye's filters over an error, band by band: what [`crate::visibility`] is measured by.

use crate::bands::RadialTable;
use crate::fft::{PictureTransform, Spectrum, Workspace};
use crate::frame::{Frame, enlarged, reduction};
use crate::plane::Plane;
use crate::threshold::{POOLING_SIGMA_DEG, ThresholdMap};

/// An error of this many times the adaptation luminance is hopelessly visible; more would only cost the rest of the
/// transform its precision, and counts by its logarithm ([`compressed`]).
pub(crate) const MAX_RELATIVE_ERROR: f32 = 1e3;
/// Standard deviation of what counts as slow at a picture's border, degrees: as wide as it may be before gradients have
/// edges at borders, which they have from 2° on (waves of 2 % over some 5° are at 0.73, not 0.66). Measured on 256×256
/// pixels at 60 a degree, v of a square of 9 and of 31 pixels in a corner, half brighter: amid equal pictures 14.40 and
/// 25.1; mirrored 21.9 and 23.1; by a σ of 0.25° 13.3 and 20.7, of 0.5° 14.0 and 21.7, of 1° 14.3 and 23.8, of 2° 14.4
/// and 24.7.
const SURROUND_SIGMA_DEG: f64 = 1.0;
/// How far the pooling window reaches, in its standard deviations: three boxes of about one on each side.
const POOLING_REACH: f64 = 3.0;

/// The eye's filters over one threshold map's errors, band by band, with the buffers that they share.
pub(crate) struct ErrorFilters<'a> {
    map: &'a ThresholdMap,
    transform: PictureTransform,
    workspace: Workspace,
    positions: Plane,
    surround: Surround,
}

/// What is taken to lie around an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Surround {
    /// The error's mirror image.
    Mirror,
    /// What changes slowly of the error's mirror image.
    SmoothMirror,
}

/// `V_b` / `m_b`: an error in one band, in threshold units, at every `factor`-th pixel and a frame of one around them.
pub(crate) struct BandResponse {
    pub(crate) amplitude: Plane,
    factor: usize,
    /// Columns and rows of the field that [`ErrorFilters`] look at.
    width: usize,
    height: usize,
}

impl BandResponse {
    /// `of` the amplitude at every pixel; twice the band's frequencies are sampled, so it may be a square.
    pub(crate) fn enlarged(&self, of: impl Fn(f32) -> f32 + Sync) -> Plane {
        enlarged(&self.amplitude.map(of), self.factor, self.width, self.height)
    }

    /// `of` this amplitude and another one's of the same band.
    pub(crate) fn enlarged_with(&self, other: &Self, of: impl Fn(f32, f32) -> f32 + Sync) -> Plane {
        enlarged(&self.amplitude.combined(&other.amplitude, of), self.factor, self.width, self.height)
    }
}

/// An error over the adaptation luminance up to [`MAX_RELATIVE_ERROR`], and beyond it what grows with its
/// logarithm: cut off there, a texture would be one value all over, which nobody sees. Measured on a texture of 50 to
/// 100 cd/m² on black: cut off, v 0.00, and 47.6 for a tenth of it.
fn compressed(error: f32, adaptation: f32) -> f32 {
    let relative = error / adaptation;
    if relative.abs() <= MAX_RELATIVE_ERROR {
        return relative;
    }
    let excess = f64::from(error.abs()) / f64::from(MAX_RELATIVE_ERROR * adaptation);
    (MAX_RELATIVE_ERROR * (1.0 + excess.ln() as f32)).copysign(error)
}

impl<'a> ErrorFilters<'a> {
    /// Filters for errors that go on beyond the picture as they are in it, such as noise: mirrored. The field that
    /// responses are given for is the picture.
    pub(crate) fn new(map: &'a ThresholdMap) -> Self {
        Self::with_surround(map, Surround::Mirror)
    }

    /// Filters for differences of two pictures that have nothing different around them. The field that responses are
    /// given for is the picture and as much around it as the pooling window reaches over: what an error at the border
    /// does to the eye, it does on both sides.
    ///
    /// What changes slowly, the difference through a Gaussian of 1°, is mirrored all the same. With nothing at all
    /// outside, a picture that is brighter as a whole would have an edge where it ends, which nobody sees: the
    /// display's surround is there, not a picture that is equal.
    pub(crate) fn amid_equals(map: &'a ThresholdMap) -> Self {
        Self::with_surround(map, Surround::SmoothMirror)
    }

    fn with_surround(map: &'a ThresholdMap, surround: Surround) -> Self {
        let density = map.viewing.display.pixel_density();
        Self {
            map,
            transform: PictureTransform::new(map.width(), map.height(), density),
            workspace: Workspace::default(),
            positions: map.adaptation_cd_m2.map(|adaptation| map.level_position(adaptation)),
            surround,
        }
    }

    /// Spectrum of an error, display cd/m², over the adaptation luminance.
    pub(crate) fn spectrum(&mut self, error: &Plane) -> Spectrum {
        let relative = error.combined(&self.map.adaptation_cd_m2, |difference, adaptation| {
            if difference.is_finite() { compressed(difference, adaptation) } else { 0.0 }
        });
        match self.surround {
            Surround::Mirror => self.plain_spectrum(&relative),
            Surround::SmoothMirror => self.transform.forward_amid(
                &mut self.workspace,
                &relative,
                &self.map.blurred(&relative, SURROUND_SIGMA_DEG),
            ),
        }
    }

    /// Pixels beside and above the picture that belong to the field: a multiple of every band's reduction.
    fn margin(&self) -> (usize, usize) {
        if self.surround == Surround::Mirror {
            return (0, 0);
        }
        let density = self.map.viewing.display.pixel_density();
        // The lowest band's, at most 1/4°: it leaves room in the transform's own margin of at least 1°.
        let step = self.reduction_of(0);
        let pixels =
            |density: f64| ((POOLING_REACH * POOLING_SIGMA_DEG * density).ceil() as usize).next_multiple_of(step);
        (pixels(density.horizontal), pixels(density.vertical))
    }

    fn reduction_of(&self, band: usize) -> usize {
        // The energy reaches twice as far in frequency as the amplitude.
        reduction(self.map.viewing.display.pixel_density(), 2.0 * self.map.bands.limit_cpd(band))
    }

    /// 0 at every pixel of the field.
    pub(crate) fn nothing(&self) -> Plane {
        let (beside, above) = self.margin();
        Plane::filled(self.map.width() + 2 * beside, self.map.height() + 2 * above, 0.0)
    }

    /// Σ_b (`V_b` / `m_b`)² of an error at every pixel of the field.
    pub(crate) fn energy(&mut self, error: &Plane) -> Plane {
        let spectrum = self.spectrum(error);
        let mut energy = self.nothing();
        for band in 0..self.map.band_count() {
            let whole = self.response(&spectrum, band).enlarged(|amplitude| amplitude * amplitude);
            energy.for_each_row_mut(|y, row| {
                row.iter_mut().zip(whole.row(y)).for_each(|(value, more)| *value += more);
            });
        }
        energy
    }

    /// v of an error at every pixel of the picture; for errors that are finite.
    pub(crate) fn visibility(&mut self, error: &Plane) -> Plane {
        let energy = self.energy(error);
        self.visibility_of(&energy)
    }

    /// Bands of the map.
    pub(crate) fn band_count(&self) -> usize {
        self.map.band_count()
    }

    /// v at every pixel of the picture, from an energy over the field.
    pub(crate) fn visibility_of(&self, energy: &Plane) -> Plane {
        let pooled = self.map.pooled(energy);
        let (beside, above) = self.margin();
        Plane::from_fn(self.map.width(), self.map.height(), |x, y| (2.0 * pooled.get(x + beside, y + above)).sqrt())
    }

    /// Amplitude gain of a band's filter at one of the map's adaptation levels.
    pub(crate) fn gain(&self, band: usize, level: usize) -> RadialTable {
        let density = self.map.viewing.display.pixel_density();
        RadialTable::new(density, |freq| self.map.bands.gain(band, freq)).times(&self.map.levels[level].sensitivity)
    }

    /// What of an error stands in a band.
    pub(crate) fn response(&mut self, spectrum: &Spectrum, band: usize) -> BandResponse {
        let (width, height) = (self.map.width(), self.map.height());
        let limit_cpd = self.map.bands.limit_cpd(band);
        let factor = self.reduction_of(band);
        let (beside, above) = self.margin();
        let frame = Frame { factor, beside: beside / factor, above: above / factor };
        let columns = frame.columns(width);
        let mut amplitude = Plane::filled(columns.len(), frame.samples_down(height), 0.0);
        for index in 0..self.map.levels.len() {
            let gain = self.gain(band, index);
            let filtered =
                self.transform.filtered_reduced(&mut self.workspace, spectrum, limit_cpd, frame, |freq| gain.at(freq));
            let positions = &self.positions;
            amplitude.for_each_row_mut(|y, row| {
                let positions = positions.row(frame.row(y, height));
                for ((value, filtered), x) in row.iter_mut().zip(filtered.row(y)).zip(&columns) {
                    *value += filtered * (1.0 - (positions[*x] - index as f32).abs()).max(0.0);
                }
            });
        }
        let elevation = &self.map.elevations[band];
        amplitude.for_each_row_mut(|y, row| {
            let mut elevations = vec![0.0; width];
            elevation.row_into(frame.row(y, height), &mut Vec::new(), &mut elevations);
            row.iter_mut().zip(&columns).for_each(|(value, x)| *value /= elevations[*x]);
        });
        BandResponse { amplitude, factor, width: width + 2 * beside, height: height + 2 * above }
    }

    /// The error itself in a band, without the eye's sensitivity: the bands add up to it.
    pub(crate) fn share_of_band(&mut self, spectrum: &Spectrum, band: usize) -> Plane {
        let (width, height) = (self.map.width(), self.map.height());
        let limit_cpd = self.map.bands.limit_cpd(band);
        let frame = Frame::narrow(self.reduction_of(band));
        let bands = &self.map.bands;
        let gain = RadialTable::new(self.map.viewing.display.pixel_density(), |freq| bands.gain(band, freq).powi(2));
        let filtered =
            self.transform.filtered_reduced(&mut self.workspace, spectrum, limit_cpd, frame, |freq| gain.at(freq));
        enlarged(&filtered, frame.factor, width, height)
    }

    /// Spectrum of any plane, as it stands.
    pub(crate) fn plain_spectrum(&mut self, plane: &Plane) -> Spectrum {
        self.transform.forward(&mut self.workspace, |y, row| row.copy_from_slice(plane.row(y)))
    }
}

impl ThresholdMap {
    /// Where an adaptation luminance stands between the levels: 1.25 is a quarter of the way, in luminance, from the
    /// second level to the third.
    fn level_position(&self, adaptation_cd_m2: f32) -> f32 {
        let above = self.levels.partition_point(|level| level.luminance_cd_m2 <= adaptation_cd_m2);
        match (above.checked_sub(1), self.levels.get(above)) {
            (Some(below), Some(upper)) => {
                let lower = self.levels[below].luminance_cd_m2;
                below as f32 + (adaptation_cd_m2 - lower) / (upper.luminance_cd_m2 - lower)
            }
            (Some(last), None) => last as f32,
            (None, _) => 0.0,
        }
    }
}
