//! Pictures and reports of shapes that are known in closed form.

use std::{fs, path::PathBuf};

use graspmill::{
    geom::OccupancyGrid,
    release::picture::{Eye, Slices, VoxelPainter, centre_of_mass},
};

/// A solid shape of 40^3 cells, what a camera at -z sees of it (orthographic), and what that camera sees to be free.
fn shape(inside: impl Fn(f64, f64, f64) -> bool) -> [OccupancyGrid; 3] {
    let n = 40;
    let [mut partial, mut complete, mut free] = [0; 3].map(|_| OccupancyGrid::new(n));
    for x in 0..n {
        for y in 0..n {
            let mut seen = false;
            for z in 0..n {
                let [a, b, c] = [x, y, z].map(|index| f64::from(index) + 0.5);
                if inside(a - 20.0, b - 20.0, c - 20.0) {
                    complete.set([x, y, z]);
                    if !seen {
                        partial.set([x, y, z]);
                    }
                    seen = true;
                } else if !seen {
                    free.set([x, y, z]);
                }
            }
        }
    }
    [partial, complete, free]
}

fn mug(x: f64, y: f64, z: f64) -> bool {
    let r = x.hypot(z);
    let wall = r < 11.0 && r > 8.6 && y.abs() < 14.0;
    let floor = r < 11.0 && y > 11.5 && y < 14.0;
    let handle = ((x - 11.0).hypot(y) - 7.0).hypot(z) < 2.0 && x > 9.5;
    wall || floor || handle
}

#[test]
fn pictures() {
    let out = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("pictures");
    fs::create_dir_all(&out).unwrap();
    let turned = |f: fn(f64, f64, f64) -> bool| {
        move |x: f64, y: f64, z: f64| {
            let (x, z) = (0.6 * x + 0.8 * z, -0.8 * x + 0.6 * z);
            let (y, z) = (0.866 * y - 0.5 * z, 0.5 * y + 0.866 * z);
            f(x, y, z)
        }
    };
    for (name, grids) in [
        ("sphere", shape(|x, y, z| x * x + y * y + z * z < 16.0 * 16.0)),
        ("torus", shape(turned(|x, y, z| (x.hypot(y) - 12.0).hypot(z) < 4.5))),
        ("mug", shape(turned(mug))),
    ] {
        let [partial, complete, free] = grids;
        for (eye_name, eye) in [("front", Eye::CameraSide), ("behind", Eye::Behind)] {
            let painter = VoxelPainter::new(400, eye, &[&complete, &partial]);
            for (kind, p, c) in [
                ("overlay", Some(&partial), Some(&complete)),
                ("partial", Some(&partial), None),
                ("complete", None, Some(&complete)),
            ] {
                let png = painter.draw(p, c).with_few_colours().to_png();
                assert!(png.len() < 80_000, "{name} {eye_name} {kind}: {} bytes", png.len());
                fs::write(out.join(format!("{name}_{eye_name}_{kind}.png")), png).unwrap();
            }
        }
        let slices = Slices::new(&partial, &complete, Some(&free), centre_of_mass(&complete), 8);
        for (cut, picture) in [("front", slices.front), ("side", slices.side), ("top", slices.top)] {
            fs::write(out.join(format!("{name}_slice_{cut}.png")), picture.to_png()).unwrap();
        }
    }
}
