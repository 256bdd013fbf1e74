//! Mesh preparation against meshes and figures that are not ours.

use std::{path::Path, time::Instant};

use graspmill::assets::{MeshOrigin, MeshSource, ScaleRule, SizeRule, prepare};

fn source(path: &Path) -> MeshSource {
    MeshSource {
        name: path.file_stem().unwrap().to_string_lossy().into_owned(),
        origin: MeshOrigin::File(path.to_owned()),
        scale: ScaleRule::MetresPerUnit(1.0),
        size: SizeRule::default(),
        licence: None,
        citation: None,
        group: None,
    }
}

#[test]
#[ignore = "a timing; run by hand with --ignored --nocapture"]
fn time_to_prepare() {
    for name in ["048_hammer", "025_mug", "003_cracker_box"] {
        let source = source(Path::new(&format!(".deps/ycb/{name}.stl")));
        let times: Vec<f64> = (0..100)
            .map(|_| {
                let start = Instant::now();
                let prepared = prepare(&source).unwrap();
                assert_eq!(prepared.record.bodies, 1);
                start.elapsed().as_secs_f64()
            })
            .collect();
        println!("{name}: {:.3} ms", 1e3 * times.iter().copied().fold(f64::INFINITY, f64::min));
    }
}
