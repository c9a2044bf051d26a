//! A flask, a lipstick and the paper behind them.

use crate::lathe::{turn, turn_bent};
use crate::mesh::Part;
use std::f64::consts::TAU;

/// A lacquered flask with a golden collar and a black stopper.
pub(super) fn flask() -> Vec<Part> {
    let mut parts = turn("flask", "lacquer", (64, 36), "0,0 36,0 42,4 56,35 61,65 54,100 34,125 17,136 14,141");
    parts.extend(turn(
        "collar",
        "gold",
        (48, 18),
        "14,140 17.5,140.5 18.5,143.5 17.5,146.5 15,147 / 15,147 15,153 / 15,153 16.5,153.5 16.5,155.5 0,156",
    ));
    parts.extend(turn("stopper", "black", (48, 26), "0,155.5 10,155.5 13,160 21,174 23.5,188 19,203 9,211 0,213"));
    parts
}

/// A lipstick: black case, golden ring, slanted bullet.
pub(super) fn lipstick() -> Vec<Part> {
    let mut parts =
        turn("case", "black", (40, 12), "0,0 11.5,0 / 11.5,0 12.2,0.8 12.5,2 12.5,20 12.5,38 / 12.5,38 10.5,38");
    parts.extend(turn("ring", "gold", (40, 4), "10.5,37 10.5,58 / 10.5,58 0,58"));
    let bullet = "8.8,57 8.8,66 8.8,76 8,83 5.5,87 0,88";
    parts.push(turn_bent("bullet", "lacquer", (32, 18), bullet, |[x, y, z], _| {
        [x, y + 0.75 * x * ((y - 0.066) / 0.02).clamp(0.0, 1.0), z]
    }));
    parts
}

/// Paper that runs forward on the table and bends up behind.
pub(super) fn backdrop() -> Part {
    let (floor, radius, wall) = (0.9, 0.25, 0.8);
    let bend = radius * TAU / 4.0;
    let total = floor + bend + wall;
    Part::surface("backdrop", "backdrop", (1, 72), [1.0, 1.0], move |u, v| {
        let s = v * total;
        let x = -1.2 + 2.4 * u;
        if s < floor {
            [x, 0.0, 0.6 - s]
        } else if s < floor + bend {
            let angle = (s - floor) / radius;
            [x, radius * (1.0 - angle.cos()), 0.6 - floor - radius * angle.sin()]
        } else {
            [x, radius + s - floor - bend, 0.6 - floor - radius]
        }
    })
}
