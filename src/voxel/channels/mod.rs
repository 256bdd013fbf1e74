//! Optional channels of a sample, each a function of the sample alone: point cloud, signed distances, coverage,
//! samples for implicit networks. All are of class `exact`.

mod cloud;
mod coverage;
mod implicit;
mod surface;
mod tsdf;

pub use cloud::point_cloud;
pub use coverage::CoverageSolid;
pub use implicit::{ImplicitPoints, implicit_points};
pub use surface::{Closest, Surface};
pub use tsdf::{TSDF_FULL, tsdf};

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use super::{surface::shapes, *};
    use crate::seed::Stream;

    fn least(mut work: impl FnMut()) -> Duration {
        let time = |()| {
            let start = Instant::now();
            work();
            start.elapsed()
        };
        std::iter::repeat_n((), 7).map(time).min().unwrap_or_default()
    }

    #[test]
    #[expect(clippy::print_stdout, reason = "shows its figures; machines and their load differ, so none is judged")]
    fn cost_of_a_view() {
        let shape = shapes::sphere(0.05);
        let surface = Surface::new(&shape.mesh);
        let coverage = CoverageSolid::new(&shape.solid);
        let (pose, placement) = shapes::views(&shape).nth(1).expect("a view");
        println!("a ball of {} triangles, 40 cells a side:", shape.mesh.triangles.len());
        println!("surface, once an object: {:?}", least(|| drop(Surface::new(&shape.mesh))));
        println!("coverage, once an object: {:?}", least(|| drop(CoverageSolid::new(&shape.solid))));
        let mut out = Vec::new();
        for cells in [1.0, 3.0, 5.0] {
            let time = least(|| tsdf(&surface, &shape.solid, &pose, &placement, cells, &mut out));
            println!("tsdf cut at {cells} cells, a view: {time:?}");
        }
        let mut out = Vec::new();
        println!("coverage, a view: {:?}", least(|| coverage.coverage(&pose, &placement, &mut out)));
        let (mut stream, mut out) = (Stream::of_job(1, b"", "cost"), ImplicitPoints::default());
        let counts = (2048, 2048);
        let time = least(|| implicit_points(&surface, &shape.solid, &pose, &placement, counts, &mut stream, &mut out));
        println!("2048 + 2048 implicit points, a view: {time:?}");
    }
}
