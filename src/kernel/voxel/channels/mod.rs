//! Optional channels of a sample, each a function of the sample alone: point cloud, signed distances, coverage,
//! samples for implicit networks. All are of class `exact`.

mod cloud;
mod coverage;
mod implicit;
mod surface;
mod tsdf;

pub use cloud::point_cloud;
pub use coverage::CoverageBlocks;
pub use implicit::{ImplicitPoints, implicit_points};
pub(crate) use surface::Neighbourhood;
pub use surface::{Closest, Surface};
pub use tsdf::{TSDF_STEPS, tsdf};

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::{surface::shapes, *};
    use crate::{geom::SimdLevel, seed::Stream};

    /// Processor time of this thread [ns], independent of other load.
    fn processor_time() -> u64 {
        let text = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux");
        text.split(' ').next().and_then(|first| first.parse().ok()).expect("a number")
    }

    fn min(mut work: impl FnMut()) -> Duration {
        let mut time = || {
            let start = processor_time();
            work();
            Duration::from_nanos(processor_time() - start)
        };
        (0..7).map(|_| time()).min().unwrap_or_default()
    }

    #[test]
    fn cost_of_a_view() {
        // Shown, not judged: machines and their load differ.
        let shape = shapes::sphere(0.05);
        let surface = Surface::new(&shape.mesh);
        let coverage = CoverageBlocks::new(SimdLevel::detect(), &shape.solid);
        let (pose, placement) = shapes::views(&shape).nth(1).expect("a view");
        println!("a ball of {} triangles, 40 cells a side:", shape.mesh.triangles.len());
        println!("surface, once an object: {:?}", min(|| drop(Surface::new(&shape.mesh))));
        println!(
            "coverage, once an object: {:?}",
            min(|| drop(CoverageBlocks::new(SimdLevel::detect(), &shape.solid)))
        );
        let mut out = Vec::new();
        for cells in [1.0, 3.0, 5.0] {
            let time = min(|| tsdf(&surface, &shape.solid, &pose, &placement, cells, &mut out));
            println!("tsdf cut at {cells} cells, a view: {time:?}");
        }
        let mut out = Vec::new();
        println!("coverage, a view: {:?}", min(|| coverage.coverage(&shape.solid, &pose, &placement, &mut out)));
        let (mut stream, mut out) = (Stream::of_job(1, b"", "cost"), ImplicitPoints::default());
        let counts = (2048, 2048);
        let time = min(|| implicit_points(&surface, &shape.solid, &pose, &placement, counts, &mut stream, &mut out));
        println!("2048 + 2048 implicit points, a view: {time:?}");
    }
}
