//! Directions and colours of many pairs: structures of arrays.

/// Directions as slices of x, y and z.
pub type Directions<'a> = [&'a [f32]; 3];
/// Linear RGB as slices of red, green and blue.
pub type Colours<'a> = [&'a mut [f32]; 3];
