//! What goes wrong, as Python sees it; and the work itself, off Python's lock.

use std::panic::{AssertUnwindSafe, catch_unwind};

use fechner_perception::{Error, Plane};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::marker::Ungil;
use pyo3::prelude::*;

use crate::threads;

/// The crate's message as a `ValueError`, places and sizes in the order of numpy.
pub(crate) fn value_error(error: Error) -> PyErr {
    PyValueError::new_err(match error {
        Error::SizeMismatch { what, width, height, found_width, found_height } => {
            format!("{what} has the shape ({found_height}, {found_width}), but ({height}, {width}) is needed")
        }
        Error::BadPixel { what, value, x, y } => {
            format!("{what} holds {value} at [{y}, {x}]; it must be finite and not negative")
        }
        other => other.to_string(),
    })
}

/// Runs `task` while other Python threads run. A panic, which would be a fault of the crate, becomes a `RuntimeError`.
pub(crate) fn work<T: Send + Ungil>(py: Python<'_>, task: impl FnOnce() -> T + Send + Ungil) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(|| threads::in_this_process(task))))
        .map_err(|_| PyRuntimeError::new_err("fechner-perception failed; this is a fault of its own, please report it"))
}

/// [`work`] that can find its input wanting.
pub(crate) fn try_work<T: Send + Ungil>(
    py: Python<'_>,
    task: impl FnOnce() -> Result<T, Error> + Send + Ungil,
) -> PyResult<T> {
    work(py, task)?.map_err(value_error)
}

/// Rejects a plane of another size, as the crate does where it can fail.
pub(crate) fn check_size(what: &'static str, plane: &Plane, width: usize, height: usize) -> PyResult<()> {
    if plane.width() == width && plane.height() == height {
        return Ok(());
    }
    let (found_width, found_height) = (plane.width(), plane.height());
    Err(value_error(Error::SizeMismatch { what, width, height, found_width, found_height }))
}
