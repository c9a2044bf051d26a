//! Tests what readers of several formats promise alike.

mod kinds;
mod over_time;
