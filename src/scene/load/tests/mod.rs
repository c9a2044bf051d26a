//! What readers of several formats promise alike.

mod over_time;
