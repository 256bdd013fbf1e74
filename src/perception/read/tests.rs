use std::fs;

use proptest::prelude::*;

use super::*;

const CAMERA: [f64; 4] = [20.0, 21.0, 5.2, 3.9];
const WIDTH: u32 = 11;
const HEIGHT: u32 = 7;

/// Depth by pixel [m]: whole millimetres; some pixels have no return.
fn depths() -> Vec<f32> {
    let depth = |pixel: u32| if pixel % 9 == 4 { f32::NAN } else { (700 + 13 * (pixel % 17)) as f32 * 0.001 };
    (0..WIDTH * HEIGHT).map(depth).collect()
}

fn points() -> Vec<[f32; 3]> {
    let [fx, fy, cx, cy] = CAMERA;
    let camera = Intrinsics { width: WIDTH, height: HEIGHT, fx, fy, cx, cy, near: 0.01 };
    let frame = DepthFrame::new(camera, depths());
    (0..WIDTH * HEIGHT).map(|pixel| frame.point(pixel).coords.map(|value| value as f32).into()).collect()
}

fn pcd_head(data: &str) -> Vec<u8> {
    format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z label\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH {WIDTH}\n\
         HEIGHT {HEIGHT}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {}\nDATA {data}\n",
        WIDTH * HEIGHT
    )
    .into_bytes()
}

/// The head of an organised PLY with one more line.
fn ply_head(line: &str) -> Vec<u8> {
    let info = format!("obj_info num_cols {WIDTH}\nobj_info num_rows {HEIGHT}\n");
    format!("ply\nformat ascii 1.0\n{info}{line}element vertex {}\nend_header\n", WIDTH * HEIGHT).into_bytes()
}

fn png_of(depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, WIDTH, HEIGHT);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(depth);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(data)?;
        writer.finish()
    });
    written.expect("an image");
    bytes
}

fn millimetres() -> Vec<u16> {
    depths().iter().map(|depth| if depth.is_nan() { 0 } else { (depth * 1000.0).round() as u16 }).collect()
}

fn npy_of(kind: &str, data: &[u8]) -> Vec<u8> {
    let head = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({HEIGHT}, {WIDTH}), }}\n");
    [b"\x93NUMPY\x01\x00", &(head.len() as u16).to_le_bytes()[..], head.as_bytes(), data].concat()
}

/// A stream of literals alone.
fn lzf_of(plain: &[u8]) -> Vec<u8> {
    plain.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect()
}

/// The picture in every kind of file, with the extension.
fn files_of_the_picture() -> Vec<(&'static str, Vec<u8>)> {
    let (points, depths) = (points(), depths());
    let floats = |values: &[f32]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>();
    let ascii: String =
        points.iter().enumerate().map(|(index, [x, y, z])| format!("{x} {y} {z} {}\n", index % 5)).collect();
    let rows: Vec<u8> = points
        .iter()
        .enumerate()
        .flat_map(|(index, point)| [&floats(point)[..], &[(index % 5) as u8]].concat())
        .collect();
    let columns: Vec<u8> = (0..3)
        .flat_map(|axis| floats(&points.iter().map(|point| point[axis]).collect::<Vec<_>>()))
        .chain((0..points.len()).map(|index| (index % 5) as u8))
        .collect();
    let packed = lzf_of(&columns);
    let lengths = [packed.len() as u32, columns.len() as u32].map(u32::to_le_bytes).concat();
    let ply = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nobj_info num_cols {WIDTH}\nobj_info num_rows {HEIGHT}\nelement vertex {}\n\
             property float x\nproperty float y\nproperty float z\nend_header\n",
            WIDTH * HEIGHT
        )
    };
    let lines: String = points.iter().map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    vec![
        ("pcd", [pcd_head("ascii"), ascii.into_bytes()].concat()),
        ("pcd", [pcd_head("binary"), rows].concat()),
        ("pcd", [pcd_head("binary_compressed"), lengths, packed].concat()),
        ("ply", [ply("ascii"), lines].concat().into_bytes()),
        ("ply", [ply("binary_little_endian").into_bytes(), floats(&points.concat())].concat()),
        (
            "png",
            png_of(
                png::BitDepth::Sixteen,
                &millimetres().iter().flat_map(|value| value.to_be_bytes()).collect::<Vec<_>>(),
            ),
        ),
        ("npy", npy_of("<f4", &floats(&depths))),
        ("npy", npy_of("<u2", &millimetres().iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>())),
    ]
}

fn read(kind: &str, bytes: &[u8], rule: &FrameRule) -> Result<LabelledFrame, FrameError> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(format!("frame.{kind}"));
    fs::write(&path, bytes).expect("a file");
    read_frame(&path, rule)
}

fn with_camera() -> FrameRule {
    FrameRule { camera: Some(CameraDescription::pinhole(CAMERA)), ..FrameRule::default() }
}

#[test]
fn every_kind_of_file_gives_the_same_picture() {
    for (index, (kind, bytes)) in files_of_the_picture().iter().enumerate() {
        let is_cloud = ["pcd", "ply"].contains(kind);
        // A cloud determines its camera; an image does not.
        let rule = if is_cloud { FrameRule::default() } else { with_camera() };
        let LabelledFrame { frame, labels, .. } = read(kind, bytes, &rule).expect("a picture");
        let camera = frame.camera;
        assert_eq!((camera.width, camera.height), (WIDTH, HEIGHT));
        for (found, given) in [camera.fx, camera.fy, camera.cx, camera.cy].iter().zip(CAMERA) {
            assert!((found - given).abs() < 1e-4, "file {index}: {camera:?}");
        }
        for (found, given) in frame.depth.iter().zip(depths()) {
            assert!(found.is_nan() && given.is_nan() || (found - given).abs() < 1e-6, "file {index}: {found} {given}");
        }
        assert_eq!(labels.is_some(), *kind == "pcd");
        assert!(labels.into_iter().flatten().enumerate().all(|(pixel, label)| label == pixel as u32 % 5));
    }
    let (kind, png) = &files_of_the_picture()[5];
    assert!(matches!(
        read(kind, png, &FrameRule::default()),
        Err(FrameError { problem: FrameProblem::NoIntrinsics, .. })
    ));
}

#[test]
fn wrong_files_are_refused_with_place_and_remedy() {
    let half = |kind: &'static str, index: usize| {
        let bytes = &files_of_the_picture()[index].1;
        (kind, bytes[..bytes.len() - 40].to_vec())
    };
    let pixels = (WIDTH * HEIGHT) as usize;
    let metres = |value: f32| npy_of("<f4", &value.to_le_bytes().repeat(pixels));
    let unorganised = String::from_utf8_lossy(&files_of_the_picture()[0].1)
        .replace("HEIGHT 7", "HEIGHT 1")
        .replace("WIDTH 11", "WIDTH 77");
    let huge = String::from_utf8_lossy(&pcd_head("binary")).replace("WIDTH 11", "WIDTH 4294967295");
    let mut turned = points();
    turned.iter_mut().for_each(|point| point.swap(0, 1));
    let turned: String = turned.iter().map(|[x, y, z]| format!("{x} {y} {z} 0\n")).collect();
    for ((kind, bytes), says) in [
        (half("pcd", 0), "one number per field"),
        (half("pcd", 1), "cut short"),
        (half("pcd", 2), "cut short"),
        (half("ply", 3), "cut short"),
        (half("ply", 4), "cut short"),
        (half("png", 5), "save the picture again"),
        (half("npy", 6), "numbers for 7 x 11 pixels"),
        (("png", png_of(png::BitDepth::Eight, &vec![9; pixels])), "16 bits"),
        (("npy", metres(700.0)), "in units of 0.001 m it would fit"),
        (("npy", metres(0.0)), "no pixel has a depth"),
        (("npy", metres(f32::NAN)), "no pixel has a depth"),
        (("npy", metres(-1.0)), "behind the camera"),
        (("npy", npy_of("<i8", &[])), "'<i8'"),
        (("npy", b"text".to_vec()), "no NPY file"),
        (("pcd", unorganised.into_bytes()), "organised"),
        (("pcd", huge.into_bytes()), "16,777,216"),
        (("pcd", [pcd_head("ascii"), turned.into_bytes()].concat()), "pinhole"),
        (("pcd", b"DATA ascii\n".to_vec()), "pixels"),
        (("pcd", b"# .PCD\nVERSION 0.7\nZOOM 2\nDATA ascii\n".to_vec()), "line 3 of the head: ZOOM; a PCD's head has"),
        (("ply", ply_head("zoom 2\n")), "zoom 2"),
        (("txt", Vec::new()), "kind is unknown"),
    ] {
        let rule = FrameRule {
            camera: if ["pcd", "ply"].contains(&kind) { None } else { with_camera().camera },
            depth_scale: Some(1.0),
            ..FrameRule::default()
        };
        let error = read(kind, &bytes, &rule).expect_err(says);
        let text = error.to_string();
        assert!(text.contains(says), "{says}: {text}");
        assert!(text.contains(&format!("frame.{kind}")), "{text}");
    }
    let png = &files_of_the_picture()[5].1;
    let other =
        FrameRule { camera: Some(CameraDescription::pinhole([500.0, 500.0, 320.0, 240.0])), ..FrameRule::default() };
    let said = read("png", png, &other).expect_err("another image").to_string();
    assert!(said.contains("(320.0, 240.0) lies outside of the image of 11 x 7 px: are the intrinsics"), "{said}");
    let flat = FrameRule { camera: Some(CameraDescription::pinhole([0.0, 500.0, 5.0, 3.0])), ..FrameRule::default() };
    assert!(
        read("png", png, &flat)
            .expect_err("no focal length")
            .to_string()
            .contains("fx = 0.0 px: must lie between 0.11")
    );
    let mut large = with_camera();
    large.camera.as_mut().expect("a camera").image_size = Some([640, 480]);
    let said = read("png", png, &large).expect_err("another size").to_string();
    assert!(said.contains("11 x 7 px") && said.contains("640 x 480 px"), "{said}");
    let cloud = &files_of_the_picture()[0].1;
    assert!(read("pcd", cloud, &with_camera()).expect_err("a camera").to_string().contains("leave intrinsics"));
}

#[test]
fn a_part_of_a_larger_picture_has_its_principal_point_outside_where_its_size_is_stated() {
    let png = &files_of_the_picture()[5].1;
    let [fx, fy, _, cy] = CAMERA;
    let part = CameraDescription::pinhole([fx, fy, -30.0, cy]);
    let rule = |camera| FrameRule { camera: Some(camera), ..FrameRule::default() };
    let said = read("png", png, &rule(part)).expect_err("of no stated size").to_string();
    assert!(said.contains("for a part of a larger picture, give a file with this width and height"), "{said}");
    let stated = CameraDescription { image_size: Some([WIDTH, HEIGHT]), ..part };
    assert_eq!(read("png", png, &rule(stated)).expect("a picture").frame.camera.cx, -30.0);
    let far = CameraDescription { numbers: [fx, fy, -60.0, cy], ..stated };
    let said = read("png", png, &rule(far)).expect_err("too far").to_string();
    assert!(said.contains("cx = -60.0 px: must lie between -49.5 and 60.5 px"), "{said}");
    // The points of a cloud determine it.
    let camera = Intrinsics { width: WIDTH, height: HEIGHT, fx, fy, cx: -30.0, cy, near: 0.01 };
    let frame = DepthFrame::new(camera, depths());
    let line = |pixel: u32| frame.point(pixel).coords.map(|value| value.to_string()).as_slice().join(" ") + " 0\n";
    let cloud = [pcd_head("ascii"), (0..WIDTH * HEIGHT).map(line).collect::<String>().into_bytes()].concat();
    let found = read("pcd", &cloud, &FrameRule::default()).expect("a cloud").frame.camera;
    assert!((found.cx + 30.0).abs() < 1e-6 && (found.fx - fx).abs() < 1e-6, "{found:?}");
}

#[test]
fn ranges_become_depths_along_the_axis() {
    let [fx, fy, cx, cy] = CAMERA;
    let range = |pixel: u32| {
        let (x, y) = ((f64::from(pixel % WIDTH) + 0.5 - cx) / fx, (f64::from(pixel / WIDTH) + 0.5 - cy) / fy);
        (0.8 * (1.0 + x * x + y * y).sqrt()) as f32
    };
    let bytes: Vec<u8> = (0..WIDTH * HEIGHT).flat_map(|pixel| range(pixel).to_le_bytes()).collect();
    let rule = FrameRule { is_range: true, ..with_camera() };
    let frame = read("npy", &npy_of("<f4", &bytes), &rule).expect("a picture").frame;
    assert!(frame.depth.iter().all(|depth| (depth - 0.8).abs() < 1e-6), "{:?}", frame.depth);
}

/// A number of a type of PLY, as bytes.
fn ply_number(kind: &str, value: f64, is_big_endian: bool) -> Vec<u8> {
    let mut bytes = match kind {
        "char" => (value as i8).to_le_bytes().to_vec(),
        "uchar" => (value as u8).to_le_bytes().to_vec(),
        "short" => (value as i16).to_le_bytes().to_vec(),
        "ushort" => (value as u16).to_le_bytes().to_vec(),
        "int" => (value as i32).to_le_bytes().to_vec(),
        "uint32" => (value as u32).to_le_bytes().to_vec(),
        "float" | "float32" => (value as f32).to_le_bytes().to_vec(),
        "double" | "float64" => value.to_le_bytes().to_vec(),
        other => panic!("no type {other}"),
    };
    if is_big_endian {
        bytes.reverse();
    }
    bytes
}

/// The picture as a PLY whose coordinates have this type, each behind a number of another type, in units of `scale` metres.
fn ply_of(format: &str, kind: &str, scale: f64, line_end: &str) -> Vec<u8> {
    let mut bytes =
        format!("ply\nformat {format} 1.0\ncomment a scan\nobj_info num_cols {WIDTH}\nobj_info num_rows {HEIGHT}\n");
    bytes += &format!("element vertex {}\n", WIDTH * HEIGHT);
    let others = ["uchar", "short", "double"];
    for (axis, other) in ["x", "y", "z"].iter().zip(others) {
        bytes += &format!("property {other} before_{axis}\nproperty {kind} {axis}\n");
    }
    bytes += "element face 0\nproperty list uchar int vertex_indices\nend_header\n";
    let mut bytes = bytes.replace('\n', line_end).into_bytes();
    for point in points() {
        for (value, other) in point.iter().zip(others) {
            let value = f64::from(*value) / scale;
            match format {
                "ascii" => bytes.extend(format!("7 {value} ").into_bytes()),
                _ => {
                    let is_big_endian = format == "binary_big_endian";
                    bytes.extend(
                        [ply_number(other, 7.0, is_big_endian), ply_number(kind, value, is_big_endian)].concat(),
                    );
                }
            }
        }
        bytes.extend(if format == "ascii" { line_end } else { "" }.bytes());
    }
    bytes
}

#[test]
fn a_ply_may_have_numbers_of_any_type() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for (kind, scale, tolerance) in [
            ("double", 1.0, 1e-6),
            ("float64", 1.0, 1e-6),
            ("float", 1.0, 1e-6),
            ("short", 1e-4, 1e-4),
            ("int", 1e-6, 1e-6),
        ] {
            for line_end in ["\n", "\r\n"] {
                // Whole numbers have no NaN: a hole is 0.
                let bytes = ply_of(format, kind, scale, line_end);
                let rule = FrameRule { depth_scale: Some(scale), ..FrameRule::default() };
                let frame =
                    read("ply", &bytes, &rule).unwrap_or_else(|error| panic!("{format}, {kind}: {error}")).frame;
                for (found, given) in frame.depth.iter().zip(depths()) {
                    let is_alike = found.is_nan() && given.is_nan() || (found - given).abs() < tolerance;
                    assert!(is_alike, "{format}, {kind}: {found} {given}");
                }
                assert!((frame.camera.fx / CAMERA[0] - 1.0).abs() < 0.01, "{format}, {kind}: {:?}", frame.camera);
            }
        }
    }
    for (bytes, words) in [
        (ply_of("ascii", "half", 1.0, "\n"), "property half x"),
        (ply_of("binary_middle_endian", "float", 1.0, "\n"), "neither ascii"),
    ] {
        let found = read("ply", &bytes, &FrameRule::default()).expect_err(words).to_string();
        assert!(found.contains(words), "{words}: {found}");
    }
}

#[test]
fn units_are_of_the_rule_then_of_the_camera_then_of_the_kind() {
    let camera = |depth_scale| Some(CameraDescription { depth_scale, ..CameraDescription::pinhole(CAMERA) });
    let whole = |scale: f32| -> Vec<u8> {
        let units = depths().into_iter().map(|depth| if depth.is_nan() { 0 } else { (depth / scale).round() as u16 });
        npy_of("<u2", &units.flat_map(u16::to_le_bytes).collect::<Vec<_>>())
    };
    let real = |scale: f32| -> Vec<u8> {
        npy_of("<f4", &depths().into_iter().flat_map(|depth| (depth / scale).to_le_bytes()).collect::<Vec<_>>())
    };
    for (bytes, depth_scale, of_camera) in [
        (whole(1e-3), None, None),
        (whole(1e-4), Some(1e-4), None),
        (whole(1e-4), None, Some(1e-4)),
        (whole(1e-4), Some(1e-4), Some(1e-3)),
        (real(1.0), None, None),
        // The unit of a camera's whole numbers is not that of floats.
        (real(1.0), None, Some(1e-4)),
        (real(1e-3), Some(1e-3), None),
    ] {
        let rule = FrameRule { camera: camera(of_camera), depth_scale, ..FrameRule::default() };
        let frame =
            read("npy", &bytes, &rule).unwrap_or_else(|error| panic!("{depth_scale:?} {of_camera:?}: {error}")).frame;
        for (found, given) in frame.depth.iter().zip(depths()) {
            assert!(found.is_nan() && given.is_nan() || (found - given).abs() < 6e-5, "{found} {given}");
        }
    }
    for scale in [0.0, -1.0, f64::NAN, 1e-9, 11.0] {
        let rule = FrameRule { depth_scale: Some(scale), ..with_camera() };
        let words = read("npy", &real(1.0), &rule).expect_err("no unit").to_string();
        assert!(words.contains("give one from 0.0000001 to 10 m per unit"), "{words}");
    }
}

/// Remedies about units and saturated pixels, each followed to the picture.
#[test]
fn what_the_median_s_remedies_advise_leads_to_the_picture() {
    let whole = |values: Vec<u16>| npy_of("<u2", &values.into_iter().flat_map(u16::to_le_bytes).collect::<Vec<_>>());
    let real = |values: &[f32]| npy_of("<f4", &values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>());
    let is_same = |frame: &DepthFrame, tolerance: f32| {
        let same = |(found, given): (&f32, f32)| found.is_nan() && given.is_nan() || (found - given).abs() < tolerance;
        frame.depth.iter().zip(depths()).all(same)
    };
    // Floats in millimetres, in centimetres; clouds in millimetres.
    let scaled = |scale: f32| depths().iter().map(|depth| depth / scale).collect::<Vec<f32>>();
    let lines: String = points()
        .iter()
        .map(|point| {
            let [x, y, z] = point.map(|value| 1e3 * value);
            format!("{x} {y} {z} 0\n")
        })
        .collect();
    let cloud = [pcd_head("ascii"), lines.into_bytes()].concat();
    for (kind, bytes, rule, words, remedy) in [
        ("npy", real(&scaled(1e-3)), with_camera(), "in units of 0.001 m it would fit: give --depth-scale 0.001", 1e-3),
        ("npy", real(&scaled(1e-2)), with_camera(), "give --depth-scale 0.0", 0.0),
        ("pcd", cloud, FrameRule::default(), "give --depth-scale 0.001", 1e-3),
        (
            "npy",
            whole(scaled(1e-4).iter().map(|value| if value.is_nan() { 0 } else { value.round() as u16 }).collect()),
            FrameRule { depth_scale: Some(0.01), ..with_camera() },
            "give --depth-scale 0.0",
            0.0,
        ),
    ] {
        let found = read(kind, &bytes, &rule).expect_err(words).to_string();
        assert!(found.contains(words), "{words}: {found}");
        let advised: f64 = found.rsplit(' ').next().expect("a word").parse().expect("a number");
        assert!(remedy == 0.0 || advised == remedy, "{found}");
        read(kind, &bytes, &FrameRule { depth_scale: Some(advised), ..rule }).unwrap_or_else(|error| panic!("{error}"));
    }
    // Two thirds of the pixels saturated: whole numbers are read, since no sensor measures their largest value.
    let is_saturated = |pixel: usize| !pixel.is_multiple_of(3);
    let saturated: Vec<u16> =
        (0..).zip(millimetres()).map(|(pixel, value)| if is_saturated(pixel) { u16::MAX } else { value }).collect();
    let frame = read("npy", &whole(saturated.clone()), &with_camera()).expect("a picture").frame;
    assert!((0..frame.depth.len()).all(|pixel| !is_saturated(pixel) || frame.depth[pixel].is_nan()));
    // As floats, the largest value has no known meaning: the message names it and the remedy.
    for (scale, words) in
        [(1e-3, "save 0 there"), (1.0, "save 0 there, and in units of 0.001 m it would fit: give --depth-scale 0.001")]
    {
        let floats: Vec<f32> = saturated.iter().map(|value| f32::from(*value) * scale).collect();
        let found = read("npy", &real(&floats), &with_camera()).expect_err(words).to_string();
        assert!(found.contains("67 % of the depths are 65") || found.contains("% of the depths are 65"), "{found}");
        assert!(found.ends_with(words), "{words}: {found}");
        let cleared: Vec<f32> =
            (0..).zip(&floats).map(|(pixel, value)| if is_saturated(pixel) { 0.0 } else { *value }).collect();
        let depth_scale = (scale == 1.0).then_some(1e-3);
        let frame = read("npy", &real(&cleared), &FrameRule { depth_scale, ..with_camera() }).expect("a picture").frame;
        assert!(frame.depth.iter().any(|depth| *depth > 0.0));
    }
    // No unit of a list: the metres per unit of the file, whatever they are.
    let feet = real(&scaled(1e-6));
    let found = read("npy", &feet, &with_camera()).expect_err("micrometres").to_string();
    assert!(found.contains("give --depth-scale with the metres per unit of this file"), "{found}");
    let frame = read("npy", &feet, &FrameRule { depth_scale: Some(1e-6), ..with_camera() }).expect("a picture").frame;
    assert!(is_same(&frame, 1e-5));
}

#[test]
fn a_cloud_that_looks_along_minus_z_is_mirrored_when_it_is_said_to() {
    let text = |mirror: fn([f32; 3]) -> [f32; 3]| {
        let lines = points().into_iter().map(mirror).map(|[x, y, z]| format!("{x} {y} {z} 0\n"));
        [pcd_head("ascii"), lines.collect::<String>().into_bytes()].concat()
    };
    let opengl = text(|[x, y, z]| [x, -y, -z]);
    let found = read("pcd", &opengl, &FrameRule::default()).expect_err("behind").to_string();
    assert!(found.contains("which looks along +z") && found.contains("give --flip"), "{found}");
    let flipped = FrameRule { is_flipped: true, ..FrameRule::default() };
    let frame = read("pcd", &opengl, &flipped).expect("a picture").frame;
    let plain = read("pcd", &text(|point| point), &FrameRule::default()).expect("a picture").frame;
    assert_eq!(frame.camera, plain.camera);
    assert!(frame.depth.iter().zip(&plain.depth).all(|(a, b)| a == b || a.is_nan() && b.is_nan()));
    // Where mirroring does not help, it is not advised; where it is wrong, the way back is.
    let found = read("pcd", &text(|[x, y, z]| [x, y, -z]), &FrameRule::default()).expect_err("behind").to_string();
    assert!(found.contains("in the camera's own frame") && !found.contains("--flip"), "{found}");
    let found = read("pcd", &text(|point| point), &flipped).expect_err("behind").to_string();
    assert!(found.contains("leave --flip out"), "{found}");
    let image = &files_of_the_picture()[6].1;
    let found = read("npy", image, &FrameRule { is_flipped: true, ..with_camera() }).expect_err("no axes").to_string();
    assert!(found.contains("leave --flip out"), "{found}");
    let negative: Vec<u8> = depths().iter().flat_map(|depth| (-depth).to_le_bytes()).collect();
    let found = read("npy", &npy_of("<f4", &negative), &with_camera()).expect_err("behind").to_string();
    assert!(found.contains("save the depths with the other sign"), "{found}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn damaged_files_never_panic(
        file in 0_usize..8,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
        keep in any::<prop::sample::Index>(),
        is_cut in any::<bool>(),
    ) {
        let files = files_of_the_picture();
        let (kind, bytes) = &files[file];
        let mut bytes = bytes.clone();
        for (index, value) in changes {
            let index = index.index(bytes.len());
            bytes[index] = value;
        }
        if is_cut {
            bytes.truncate(keep.index(bytes.len()));
        }
        // Either a picture of as many depths as pixels, or a refusal.
        if let Ok(read) = read(kind, &bytes, &with_camera()) {
            prop_assert_eq!(read.frame.depth.len(), (read.frame.camera.width * read.frame.camera.height) as usize);
        }
    }
}
