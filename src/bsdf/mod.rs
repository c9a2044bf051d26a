//! How surfaces scatter light, one file a model.
