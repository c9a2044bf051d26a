//! What an eye can see in a picture.
