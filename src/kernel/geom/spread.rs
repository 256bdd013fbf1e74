//! Points spread out among others.

use nalgebra::Point3;

/// Indices of `count` points of a list, the first one and then always the one farthest from those before; of equals the first.
/// Where the points are used up, the first again.
///
/// # Panics
/// When there is no point.
pub fn farthest_first(points: &[Point3<f64>], count: u32) -> Vec<usize> {
    // How far each is from the nearest one that was taken.
    let mut apart = vec![f64::INFINITY; points.len()];
    let mut next = 0;
    (0..count)
        .map(|_| {
            let taken = next;
            for (point, apart) in points.iter().zip(&mut apart) {
                *apart = apart.min((point - points[taken]).norm_squared());
            }
            next = (0..points.len()).fold(0, |best, index| if apart[index] > apart[best] { index } else { best });
            taken
        })
        .collect()
}
