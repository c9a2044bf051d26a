//! Pictures between numpy and the crate.
//!
//! A C-contiguous, aligned `float32` array is read where it lies; anything else that numpy can turn into one is
//! converted first. Pictures in colour reach the crate without a copy, single-channel ones by one copy into its
//! [`Plane`]; results go back without.

use fechner_perception::Plane;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Rows and columns, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Shape {
    pub(crate) height: usize,
    pub(crate) width: usize,
}

/// An array's memory, borrowed for the length of a call.
pub(crate) struct Pixels<'py> {
    array: PyReadonlyArrayDyn<'py, f32>,
    what: &'static str,
}

impl<'py> Pixels<'py> {
    /// `what` names the argument in errors.
    pub(crate) fn borrow(what: &'static str, given: &Bound<'py, PyAny>) -> PyResult<Self> {
        check_unmasked(what, given)?;
        let in_place = given.cast::<PyArrayDyn<f32>>().ok().filter(|array| array.is_c_contiguous());
        let in_place = in_place.filter(|array| (array.data() as usize).is_multiple_of(align_of::<f32>())).cloned();
        let array = match in_place {
            Some(array) => array,
            None => converted(what, given)?,
        };
        let array = array
            .try_readonly()
            .map_err(|_| PyValueError::new_err(format!("{what} is being written to by another extension")))?;
        Ok(Self { array, what })
    }

    /// Rows and columns of a picture of `channels` values a pixel; 1 is an array of two dimensions.
    fn shape(&self, channels: usize) -> PyResult<Shape> {
        let (found, wanted) = match (self.array.shape(), channels) {
            (&[height, width], 1) => return self.with_pixels(Shape { height, width }),
            (&[height, width, 3], 3) => return self.with_pixels(Shape { height, width }),
            (found, 1) => (found, "(height, width)"),
            (found, _) => (found, "(height, width, 3)"),
        };
        Err(PyValueError::new_err(format!("{} has the shape {found:?}; it must have {wanted}", self.what)))
    }

    fn with_pixels(&self, shape: Shape) -> PyResult<Shape> {
        if shape.height == 0 || shape.width == 0 {
            return Err(PyValueError::new_err(format!("{} has no pixels", self.what)));
        }
        Ok(shape)
    }

    fn values(&self) -> PyResult<&[f32]> {
        self.array.as_slice().map_err(|error| PyValueError::new_err(format!("{}: {error}", self.what)))
    }

    /// Whether this is a picture in colour, by its number of dimensions.
    pub(crate) fn has_channels(&self) -> bool {
        self.array.shape().len() == 3
    }

    /// The picture as linear RGB, in place.
    pub(crate) fn rgb(&self) -> PyResult<(Shape, &[[f32; 3]])> {
        let shape = self.shape(3)?;
        Ok((shape, self.values()?.as_chunks::<3>().0))
    }

    /// The picture as one value a pixel, copied.
    pub(crate) fn plane(&self) -> PyResult<Plane> {
        let shape = self.shape(1)?;
        Plane::from_values(shape.width, shape.height, self.values()?.to_vec()).map_err(crate::errors::value_error)
    }
}

/// One value a pixel, copied.
pub(crate) fn plane(what: &'static str, given: &Bound<'_, PyAny>) -> PyResult<Plane> {
    Pixels::borrow(what, given)?.plane()
}

/// The same where it is given.
pub(crate) fn optional_plane(what: &'static str, given: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Plane>> {
    given.map(|given| plane(what, given)).transpose()
}

/// Refuses a masked array that hides something: what it hides would count.
fn check_unmasked(what: &'static str, given: &Bound<'_, PyAny>) -> PyResult<()> {
    let py = given.py();
    let masked = py.import("numpy")?.getattr("ma")?;
    if given.is_instance(&masked.getattr("MaskedArray")?)? && masked.call_method1("is_masked", (given,))?.is_truthy()? {
        let message = format!("{what} is a masked array; fill in what it hides, as by its filled()");
        return Err(PyValueError::new_err(message));
    }
    Ok(())
}

fn converted<'py>(what: &'static str, given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    let py = given.py();
    let kind = PyDict::new(py);
    kind.set_item("dtype", "float32")?;
    // Its own memory unless it is aligned as well, which `ascontiguousarray` does not see to.
    kind.set_item("requirements", "CA")?;
    let numpy = py.import("numpy")?;
    let array = numpy.call_method1("asarray", (given,)).map_err(|error| no_array(what, py, error))?;
    check_real(what, &array)?;
    let array = numpy.call_method("require", (array,), Some(&kind)).map_err(|error| no_array(what, py, error))?;
    Ok(array.cast_into::<PyArrayDyn<f32>>()?)
}

/// Refuses what numpy would make numbers of, dropping a part: complex numbers, words and dates.
fn check_real(what: &'static str, array: &Bound<'_, PyAny>) -> PyResult<()> {
    let dtype = array.getattr("dtype")?;
    if "cSTUmM".contains(&dtype.getattr("kind")?.extract::<String>()?) {
        return Err(PyValueError::new_err(format!("{what} is no array of numbers: {dtype} holds none that are real")));
    }
    Ok(())
}

/// What numpy could not convert is a `ValueError`; an interrupt or a lack of memory on the way stays what it is.
fn no_array(what: &'static str, py: Python<'_>, error: PyErr) -> PyErr {
    if !error.is_instance_of::<PyTypeError>(py) && !error.is_instance_of::<PyValueError>(py) {
        return error;
    }
    let named = PyValueError::new_err(format!("{what} is no array of numbers: {}", error.value(py)));
    named.set_cause(py, Some(error));
    named
}

/// A plane's memory as an array of shape (height, width).
pub(crate) fn plane_to_array(py: Python<'_>, plane: Plane) -> PyResult<Bound<'_, PyArray2<f32>>> {
    let shape = [plane.height(), plane.width()];
    PyArray1::from_vec(py, plane.into_values()).reshape(shape)
}

/// Linear RGB as an array of shape (height, width, 3).
pub(crate) fn rgb_to_array(py: Python<'_>, shape: Shape, rgb: Vec<[f32; 3]>) -> PyResult<Bound<'_, PyArray3<f32>>> {
    PyArray1::from_vec(py, rgb.into_flattened()).reshape([shape.height, shape.width, 3])
}
