//! Solid glass.

use crate::lathe::turn;
use crate::mesh::Part;

/// A thick tumbler of solid glass, 0.1 m tall; one closed surface, so that a ray knows inside from outside.
pub(super) fn tumbler() -> Vec<Part> {
    turn(
        "tumbler",
        "glaze",
        (64, 56),
        "0,0 30,0 34.5,2 36,7 37,30 39.5,70 42,99 41.2,101 39.5,99.5 37,70 34.5,30 31,21 22,17.8 0,17",
    )
}

/// A pawn 0.09 m tall, one closed surface.
pub(super) fn pawn() -> Vec<Part> {
    turn(
        "pawn",
        "glaze",
        (48, 70),
        "0,0 26,0 27.5,3 26.5,8 22.5,11 22.5,14 19.5,18 12.5,30 9.5,46 10,54 16.5,57.5 16.5,60 11,62 13.5,65.5 16,73 14,83 8,88.5 0,90",
    )
}
