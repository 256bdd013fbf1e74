//! Several kinds of touch stored with one pair, in readers, reports, previews and exports.

use std::{collections::BTreeMap, fs};

use graspmill::{
    export::{ExportFormat, ExportSelection, export},
    files::Folder,
    format::Channel,
    preview::{preview_samples, write_preview},
    publish::{TouchKind, inspect_completion, report},
    runtime::{DatasetReader, Selection},
};

use crate::support::{files::read_text, small_dataset::SmallDataset, workspace::Workspace};
use crate::support::{files::repository_path, program::Program, robots::GRIPPER};

#[test]
fn each_kind_is_counted_and_drawn_and_all_are_exported_together() {
    let folder = Workspace::new();
    let data = folder.make_folder("data");
    let kinds = [Channel::TOUCH_RAYS, Channel::TOUCH_EXPLORATION, Channel::TOUCH_GRASP];
    let channels = [Channel::PAIR, Channel::VISIBILITY].into_iter().chain(kinds).collect();
    SmallDataset { resolution: 16, channels, ..SmallDataset::default() }.finish(&data);
    let reader = DatasetReader::open(&Folder::at(&data)).expect("a dataset");
    let (mut sums, mut forces, mut cells) = (BTreeMap::<Channel, TouchKind>::new(), Vec::new(), 0);
    for sample in reader.iter(Selection::default()) {
        let touched = sample.expect("a sample").touched().expect("sound records").expect("touch");
        cells += touched.tactile.count();
        for (channel, touch) in touched.touch {
            let kind = sums.entry(channel).or_default();
            kind.probes += u64::from(touch.probes);
            kind.contacts += touch.contacts.len() as u64;
            kind.visible += u64::from(touch.visible());
            if channel == Channel::TOUCH_GRASP {
                forces.extend(touch.hand.expect("a hand").contacts.iter().map(|contact| contact.force));
            }
        }
    }
    let kept = reader.manifest().counts.kept;
    let facts = inspect_completion(&Folder::at(&data)).expect("facts");
    let touch = facts.touch.as_ref().expect("touch");
    assert_eq!((touch.samples, touch.cells), (kept, u64::from(cells)));
    assert_eq!(touch.contacts(), sums.values().map(|kind| kind.contacts).sum::<u64>());
    for (found, channel) in touch.kinds.iter().zip(kinds) {
        let sum = &sums[&channel];
        assert_eq!(found.channel, channel.name());
        assert_eq!((found.probes, found.contacts, found.visible), (sum.probes, sum.contacts, sum.visible));
        assert!(found.contacts > 0 && found.hand.is_some() == channel.is_touch_by_hand());
    }
    let felt = touch.kinds[2].hand.as_ref().expect("a hand");
    forces.sort_by(f32::total_cmp);
    let median = f64::from(forces[forces.len().div_ceil(2) - 1]);
    assert_eq!((felt.hand.as_str(), felt.force.median), ("claw", median));
    assert_eq!((felt.gap.min, felt.gap.max), (f64::from(-1e-5f32), f64::from(-1e-5f32)));
    let ends = [("at_rest", kept), ("missed", kept), ("overloaded", 0), ("timed_out", 0), ("unstable", kept)];
    assert_eq!(felt.ends, ends.map(|(end, count)| (end.to_owned(), count)).into());
    let text = facts.to_string();
    let [exact, physics] = facts.header.classes.values().collect::<Vec<_>>()[..] else { panic!("two classes") };
    for part in [
        &format!("\n  exact     {exact}\n  physics   {physics}\n"),
        "touch_exploration by claw",
        "of 3.0 approaches per sample",
        "gaps: median -0.010 mm, from -0.010 to -0.010",
        &format!("approaches: {kept} at rest, 0 timed out, {kept} missed, {kept} unstable, 0 overloaded"),
    ] {
        assert!(text.contains(part), "{part} is missing in\n{text}");
    }
    let page = read_text(report(&Folder::at(&data), None).expect("a report").path);
    for part in ["by exploration (light blue)", "by the grasp (red)", "Class physics", "touch_grasp by claw"] {
        assert!(page.contains(part), "{part} is missing");
    }

    let preview =
        write_preview(&Folder::at(folder.folder()), &preview_samples(&reader, 4).expect("samples")).expect("a preview");
    let bytes = fs::read(preview).expect("a preview");
    let messages = mcap::MessageStream::new(&bytes).expect("MCAP").map(|message| message.expect("a message"));
    let scenes: Vec<_> = messages.filter(|message| message.channel.topic == "/preview/touch").collect();
    assert_eq!(scenes.len(), 4);
    for scene in scenes {
        for id in ["touch_exploration", "touch_grasp"] {
            assert!(scene.data.windows(id.len()).any(|word| word == id.as_bytes()), "{id}");
        }
    }

    let arrays = folder.path("npy");
    export(&Folder::at(&data), ExportFormat::from_name("npy").expect("a format"), &arrays, &ExportSelection::default())
        .expect("arrays");
    let tactile = fs::read(arrays.join("tactile.npy")).expect("an array");
    let begin = 10 + usize::from(u16::from_le_bytes([tactile[8], tactile[9]]));
    assert_eq!(tactile[begin..].iter().map(|byte| byte.count_ones()).sum::<u32>(), cells);
}

#[test]
fn an_estimate_measures_touch_by_hands() {
    let folder = Workspace::new();
    let hand = repository_path(GRIPPER);
    let job = format!(
        "seed = 1\nviews = {{ even = 3 }}\n[[objects]]\nbuilt_in = [\"can-01\"]\n[touch]\nexploration = true\n\
         grasp = true\nhand = {{ model = {hand:?} }}\n"
    );
    let file = folder.write("job.toml", job);
    let estimate = |settings: &[&str]| Program::on("estimate", &file).set(settings).read_json();
    let (with, without) = (estimate(&[]), estimate(&["touch.exploration=false", "touch.grasp=false"]));
    assert_eq!(with["pilot"]["samples"], 3);
    assert!(with["core_hours"].as_f64() > without["core_hours"].as_f64());
    assert!(with["bytes"].as_f64() > without["bytes"].as_f64());
}
