use std::{
    fs,
    path::{Path, PathBuf},
    thread,
};

use kernel::seed::Stream;
use surface::CubeField;

use super::*;

fn thicken() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/models/thicken")
}

/// A folder with the model, to be changed.
fn copied() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for entry in fs::read_dir(thicken()).expect("the model of the tests") {
        let path = entry.expect("an entry").path();
        fs::copy(&path, folder.path().join(path.file_name().expect("a name"))).expect("a copy");
    }
    folder
}

fn model() -> CompletionModel {
    CompletionModel::open(&thicken()).expect("the model of the tests")
}

/// Noise at a density, or one of the degenerate inputs.
fn field(draw: &mut Stream, index: u64) -> CubeField {
    let density = match index % 8 {
        0 => 0.0,
        1 => 1.0,
        _ => draw.unit(),
    };
    let mut values: Vec<f32> = (0..64_000).map(|_| f32::from(draw.unit() < density)).collect();
    if index % 8 == 2 {
        let at = draw.below(64_000) as usize;
        values[at] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][(index / 8 % 3) as usize];
    }
    if index % 8 == 3 {
        values.iter_mut().for_each(|value| *value *= 1e30);
    }
    CubeField::from_values(40, values).expect("a cube")
}

#[test]
fn the_model_answers_as_onnx_runtime_did() {
    let check = model().check_golden().expect("samples");
    assert!(check.agrees() && check.samples == 2, "{check:?}");
    assert!(check.occupancy < 1e-5 && check.coverage < 1e-5, "{check:?}");
}

#[test]
fn what_is_behind_a_seen_cell_is_filled_unless_it_was_seen_through() {
    let (mut partial, mut free) = (CubeField::filled(40, 0.0), CubeField::filled(40, 0.0));
    for x in 10..30 {
        for y in 10..30 {
            *partial.at_mut([x, y, 8]) = 1.0;
            (0..8).for_each(|z| *free.at_mut([x, y, z]) = 1.0);
            *free.at_mut([x, y, 15]) = 1.0;
        }
    }
    let answer =
        model().predict(&Inputs { partial: Some(&partial), free: Some(&free), touch: None }).expect("an answer");
    let coverage = answer.coverage.expect("the model has that output");
    let at = |z: usize| (answer.occupancy.at([20, 20, z]), coverage.at([20, 20, z]));
    for (z, is_filled) in [(5, false), (8, true), (12, true), (15, false), (18, true), (24, false), (39, false)] {
        let (occupancy, coverage) = at(z);
        assert_eq!((occupancy > 0.5, coverage > 0.5), (is_filled, is_filled), "{z}: {occupancy} {coverage}");
    }
}

/// Runs `count` inputs of all kinds; returns the number of successful runs.
fn run_all_kinds(count: u64) -> u64 {
    let model = model();
    let mut draw = Stream::of_job(11, b"", "inputs");
    let mut answers = 0;
    for index in 0..count {
        let (partial, free) = (field(&mut draw, index), field(&mut draw, index + 4));
        let inputs = Inputs { partial: Some(&partial), free: Some(&free), touch: None };
        match model.predict(&inputs) {
            Ok(answer) => {
                assert!(answer.occupancy.values().iter().all(|value| (0.0..=1.0).contains(value)));
                answers += 1;
            }
            Err(PredictError::NotFinite(InputName::Partial | InputName::Free)) => {
                assert!([2, 6].contains(&(index % 8)), "{index}");
            }
            // Numbers of 1e30 may overflow inside.
            Err(PredictError::NoProbability { .. }) => assert!([3, 7].contains(&(index % 8)), "{index}"),
            Err(error) => panic!("{index}: {error}"),
        }
    }
    answers
}

#[test]
fn every_input_gives_an_answer_or_a_reason() {
    assert!(run_all_kinds(64) >= 32);
}

#[test]
#[ignore = "slow: a minute"]
fn ten_thousand_inputs_give_an_answer_or_a_reason() {
    assert!(run_all_kinds(10_000) >= 5_000);
}

#[test]
fn missing_inputs_and_other_grids_are_refused() {
    let (model, partial, small) = (model(), CubeField::filled(40, 0.0), CubeField::filled(32, 0.0));
    let predict = |partial, free| model.predict(&Inputs { partial, free, touch: None });
    assert_eq!(predict(Some(&partial), None), Err(PredictError::MissingInput(InputName::Free)));
    let other = PredictError::Resolution { input: InputName::Free, found: 32, wanted: 40 };
    assert_eq!(predict(Some(&partial), Some(&small)), Err(other));
}

#[test]
fn threads_share_a_model_and_give_the_same_bits() {
    let model = model();
    let mut draw = Stream::of_job(12, b"", "inputs");
    let fields: Vec<CubeField> = (0..6).map(|_| field(&mut draw, 4)).collect();
    let run = |index: usize| {
        let inputs = Inputs { partial: Some(&fields[index]), free: Some(&fields[(index + 1) % 6]), touch: None };
        model.predict(&inputs).expect("an answer")
    };
    let alone: Vec<Prediction> = (0..6).map(run).collect();
    let together: Vec<Prediction> = thread::scope(|scope| {
        let workers: Vec<_> = (0..6).map(|index| scope.spawn(move || run(index))).collect();
        workers.into_iter().map(|worker| worker.join().expect("a thread")).collect()
    });
    assert!(alone == together);
}

#[test]
fn folders_that_are_no_model_are_refused_with_file_and_remedy() {
    let replace = |folder: &Path, from: &str, to: &str| {
        let path = folder.join("model.json");
        let text = fs::read_to_string(&path).expect("text");
        assert!(text.contains(from), "{from}");
        fs::write(&path, text.replace(from, to)).expect("written");
    };
    type Change<'a> = &'a dyn Fn(&Path);
    let changes: [(&str, &str, Change<'_>); 17] = [
        ("model.json", "a model folder must contain", &|folder| {
            fs::remove_file(folder.join("model.json")).expect("gone")
        }),
        ("model.json", "unknown field `colour`", &|folder| replace(folder, "\"seed\"", "\"colour\": 1, \"seed\"")),
        ("model.json", "missing field `steps`", &|folder| replace(folder, "\"steps\": 0,", "")),
        ("model.json", "format = \"graspmill model 2\"", &|folder| replace(folder, "model 1", "model 2")),
        // A model of another kind, with keys of its own.
        ("model.json", "format = \"graspmill heatmap model 1\"", &|folder| {
            replace(folder, "graspmill model 1", "graspmill heatmap model 1");
            replace(folder, "\"resolution\"", "\"stride\"");
        }),
        ("model.json", "resolution = 32; this program supports 40", &|folder| {
            replace(folder, "\"resolution\": 40", "\"resolution\": 32");
        }),
        ("model.json", "in this order", &|folder| replace(folder, "\"partial\"", "\"touch\"")),
        ("model.json", "outputs = ", &|folder| replace(folder, "\"coverage\"\n  ]", "\"other\"\n  ]")),
        ("model.json", "placement = ", &|folder| replace(folder, "0.45", "0.5")),
        ("model.json", "between 0 and 1", &|folder| replace(folder, "\"coverage\": 0.5", "\"coverage\": 1.0")),
        ("model.json", "'../card.md' is listed", &|folder| replace(folder, "\"card.md\"", "\"../card.md\"")),
        ("model.json", "'golden.npz' is missing", &|folder| replace(folder, "\"golden.npz\"", "\"other.npz\"")),
        ("model.json", "'more.md' is missing", &|folder| fs::write(folder.join("more.md"), "more").expect("written")),
        ("card.md", "cannot be read", &|folder| fs::remove_file(folder.join("card.md")).expect("gone")),
        ("card.md", "fetch the model again", &|folder| fs::write(folder.join("card.md"), "other").expect("written")),
        ("model.onnx", "fetch the model again", &|folder| {
            let mut bytes = fs::read(folder.join("model.onnx")).expect("bytes");
            let middle = bytes.len() / 2;
            bytes[middle] ^= 1;
            fs::write(folder.join("model.onnx"), bytes).expect("written");
        }),
        ("model.json", "bytes", &|folder| fs::write(folder.join("model.json"), vec![b' '; 2 << 20]).expect("written")),
    ];
    for (file, says, change) in changes {
        let folder = copied();
        change(folder.path());
        let error = CompletionModel::open(folder.path()).expect_err(says);
        let text = error.to_string();
        assert!(error.file.ends_with(file) && text.contains(says), "{says}: {text}");
    }
}

#[test]
fn stored_answers_of_another_network_do_not_agree() {
    let folder = copied();
    let golden = folder.path().join("golden.npz");
    let rewrite = |bytes: &[u8]| {
        fs::write(&golden, bytes).expect("written");
        let path = folder.path().join("model.json");
        let text = fs::read_to_string(&path).expect("text");
        let at = text.find("\"golden.npz\": \"").expect("a digest") + 15;
        let text = format!("{}{}{}", &text[..at], folder::sha256(bytes), &text[at + 64..]);
        fs::write(path, text).expect("written");
        CompletionModel::open(folder.path()).expect("a model").check_golden()
    };
    let whole = fs::read(&golden).expect("bytes");
    assert!(rewrite(&whole).expect("samples").agrees());
    let said = rewrite(b"no archive").expect_err("no archive").to_string();
    assert!(said.contains("golden.npz") && said.contains("not a ZIP archive"), "{said}");
    let said = rewrite(include_bytes!("test_data/stored.npz")).expect_err("other arrays").to_string();
    assert!(said.contains("the array 'a' is not one of partial, free, occupancy, coverage"), "{said}");
}

#[test]
fn the_network_in_the_program_is_the_folder_next_to_it() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tabletop");
    let (opened, bundled) = (CompletionModel::open(&folder).expect("a model"), CompletionModel::bundled());
    assert_eq!((opened.digest(), opened.facts()), (bundled.digest(), bundled.facts()));
    let golden = bundled.check_golden().expect("its samples");
    assert!(golden.samples > 0 && golden.agrees(), "{golden:?}");
}
