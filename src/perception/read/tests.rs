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
    let frame = DepthFrame { camera, depth: depths() };
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
        // A cloud says where its camera is; an image does not.
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
        (("txt", Vec::new()), "kind is unknown"),
    ] {
        let rule = FrameRule {
            camera: if ["pcd", "ply"].contains(&kind) { None } else { with_camera().camera },
            depth_scale: 1.0,
            is_range: false,
        };
        let error = read(kind, &bytes, &rule).expect_err(says);
        let text = error.to_string();
        assert!(text.contains(says), "{says}: {text}");
        assert!(text.contains(&format!("frame.{kind}")), "{text}");
    }
    let png = &files_of_the_picture()[5].1;
    let other =
        FrameRule { camera: Some(CameraDescription::pinhole([500.0, 500.0, 320.0, 240.0])), ..FrameRule::default() };
    assert!(read("png", png, &other).expect_err("another image").to_string().contains("another image size"));
    let flat = FrameRule { camera: Some(CameraDescription::pinhole([0.0, 500.0, 5.0, 3.0])), ..FrameRule::default() };
    assert!(read("png", png, &flat).expect_err("no focal length").to_string().contains("fx"));
    let mut large = with_camera();
    large.camera.as_mut().expect("a camera").image_size = Some([640, 480]);
    let said = read("png", png, &large).expect_err("another size").to_string();
    assert!(said.contains("11 x 7 px") && said.contains("640 x 480 px"), "{said}");
    let cloud = &files_of_the_picture()[0].1;
    assert!(read("pcd", cloud, &with_camera()).expect_err("a camera").to_string().contains("leave intrinsics"));
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
