//! Renamed keys and values: an old name is refused with the new one, and a job that follows the advice is read.

use graspmill::{
    factory::job::{RENAMED_KEYS, RENAMED_VALUES, RenamedKey, RenamedValue, schema},
    form::{FormError, FormProblem},
};
use serde_json::Value;

use super::read;

/// The new path of each key, with a job that has it as KEY, and the value.
const JOBS: [(&str, &str, &str); 21] = [
    ("antipodal.resting_pose", ON_A_TABLE, "\"sampled\""),
    ("container.inner_size", "mode = \"bin\"\n[container]\nKEY\n", "[0.3, 0.3, 0.1]"),
    ("fusion.support_height", "product = \"volumes\"\n[fusion]\nKEY\n", "0.04"),
    ("fusion.per_scene", "product = \"volumes\"\n[fusion]\nKEY\n", "2"),
    ("hand.model", "product = \"grasps\"\n[hand]\nKEY\n", "\"../scenes/barrett_bh8_280.xml\""),
    ("heatmaps.max_angle", "product = \"heatmaps\"\n[heatmaps]\nKEY\n", "0.3"),
    ("keep.cone_edges", "product = \"grasps\"\nhand.model = \"../scenes/barrett_bh8_280.xml\"\n[keep]\nKEY\n", "8"),
    ("objects.limit", "", "1"),
    ("physics.settle_timeout", "[physics]\nKEY\n", "3.0"),
    ("physics.substeps", "[physics]\nKEY\n", "2"),
    ("physics.perturbed_runs", TRIED, "1"),
    ("physics.max_redrops", "mode = \"heap\"\n[physics]\nKEY\n", "1"),
    ("physics.stability_time", "[physics]\nKEY\n", "1.0"),
    ("physics.release_interval", "mode = \"heap\"\n[physics]\nKEY\n", "0.2"),
    ("physics.rollout_share", TRIED, "0.1"),
    ("physics.rollouts", TRIED, "5"),
    ("picks.movable", "product = \"picks\"\n[picks]\nKEY\n", "\"all\""),
    ("picks.grasps", "product = \"picks\"\n[picks]\nKEY\n", "\"kept\""),
    ("region", "KEY\n", "{ x = [0.0, 0.1], y = [0.0, 0.1] }"),
    ("robot.model", REACHING, "\"../scenes/fetch.xml\""),
    ("touch.hand.model", EXPLORING, "\"../scenes/barrett_bh8_280.xml\""),
];

const ON_A_TABLE: &str = "product = \"grasps\"\nhand.model = \"../scenes/parallel_gripper.xml\"\n\
    grasps.sampler = \"antipodal\"\n[antipodal]\nsupport = \"table\"\nKEY\n";
const TRIED: &str = "product = \"grasps\"\nhand.model = \"../scenes/barrett_bh8_280.xml\"\n[physics]\nKEY\n";
const EXPLORING: &str = "product = \"completion\"\n[touch]\ngrasp = true\n[touch.hand]\nKEY\n";
const REACHING: &str = "product = \"reachability\"\n[poses]\nx = { from = 0.5, to = 0.6, step = 0.1 }\n\
    y = { from = 0.0, to = 0.1, step = 0.1 }\nz = { from = 0.5, to = 0.6, step = 0.1 }\nroll = 2\npitch = 2\nyaw = 2\n[robot]\n\
    joints = [\"shoulder_pan_joint\"]\ntarget = \"wrist_roll_link\"\nKEY\n";

/// The job for a key, without the key where there is no line for it.
fn job(text: &str, line: Option<String>) -> String {
    let scenes = if text.contains("product") { "" } else { "product = \"scenes\"\nscenes.training = 1\n" };
    let has_objects = ["grasps", "completion", "scenes"].iter().any(|product| {
        let named = format!("product = \"{product}\"");
        text.contains(&named) || scenes.contains(&named)
    });
    let own = text.contains("KEY");
    let in_objects = line.clone().filter(|_| !own).unwrap_or_default();
    let objects =
        if has_objects { format!("[[objects]]\nbuilt_in = [\"can-*\"]\n{in_objects}\n") } else { String::new() };
    format!("{scenes}{}{objects}", text.replace("KEY", &line.unwrap_or_default()))
}

fn mistakes(text: &str, overrides: &[&str]) -> Vec<FormError> {
    read(text, overrides).err().map(|errors| errors.list().to_vec()).unwrap_or_default()
}

fn last(path: &str) -> &str {
    path.rsplit('.').next().unwrap_or(path)
}

/// Whether jobs of a product have a dotted key.
fn has(product: &Value, path: &str) -> bool {
    let below = |level: &Value, key: &str| {
        let level = if level["items"].is_object() { &level["items"] } else { level };
        level["properties"].get(key).cloned()
    };
    path.split('.').try_fold(product.clone(), |level, key| below(&level, key)).is_some()
}

#[test]
fn an_old_key_is_refused_with_the_new_one_and_following_that_helps() {
    assert_eq!(JOBS.map(|(new, ..)| new).to_vec(), RENAMED_KEYS.iter().map(|key| key.new).collect::<Vec<_>>());
    for (RenamedKey { old, new }, (_, text, value)) in RENAMED_KEYS.iter().zip(JOBS) {
        let with = |key: &str| job(text, Some(format!("{} = {value}", last(key))));
        let mut found = mistakes(&with(old), &[]);
        let at = found.iter().position(|error| matches!(error.problem, FormProblem::UnknownKey { .. }));
        let error = found.remove(at.unwrap_or_else(|| panic!("{old} is unknown: {found:?}")));
        assert_eq!(error.key.replace("[0]", ""), *old);
        assert_eq!(error.location.file, "test.toml");
        assert!(error.location.line > 1 && error.to_string().contains("renamed to `"), "{error}");
        // The advice names the key that the job then has: what else is wrong, such as a dataset that is not there, stays.
        let advice = error.help.expect("a remedy").replace("[0]", "");
        let followed = advice.split('`').nth(1).expect("a key");
        assert_eq!(followed, *new);
        let keys = |found: &[FormError]| found.iter().map(|error| error.key.clone()).collect::<Vec<_>>();
        let rest = mistakes(&with(followed), &[]);
        assert_eq!(keys(&found), keys(&rest), "{old}");
        let reads_datasets = ["volumes", "heatmaps", "picks"].iter().any(|product| text.contains(product));
        assert_eq!(rest.is_empty(), !reads_datasets, "{new}: {rest:?}");
        // The same from an override, which the message names.
        if *old != "objects.first" {
            let found = mistakes(&job(text, None), &[&format!("{old}={value}")]);
            let shown = found.iter().map(FormError::to_string).find(|shown| shown.contains("unknown key"));
            let shown = shown.expect("the old key");
            assert!(shown.starts_with("--set:1:") && shown.ends_with(&format!("renamed to `{new}`")), "{shown}");
            assert_eq!(keys(&mistakes(&job(text, None), &[&format!("{new}={value}")])), keys(&rest), "{new}");
        }
    }
}

#[test]
fn an_old_value_is_refused_with_the_new_one() {
    for RenamedValue { key, old, new } in RENAMED_VALUES {
        let text = if key.starts_with("physics") { TRIED } else { ON_A_TABLE };
        let text =
            if *key == "antipodal.support" { text.replace("support = \"table\"\n", "") } else { text.to_owned() };
        let with = |value: &str| mistakes(&job(&text, Some(format!("{} = \"{value}\"", last(key)))), &[]);
        let shown: Vec<String> = with(old).iter().map(FormError::to_string).collect();
        assert_eq!(shown.len(), 1, "{shown:?}");
        assert!(shown[0].contains(&format!("; renamed to `\"{new}\"`")), "{shown:?}");
        assert_eq!(with(new), [], "{new}");
    }
}

#[test]
fn no_product_has_a_key_by_an_old_name() {
    let products = schema()["oneOf"].as_array().expect("one schema per product");
    for RenamedKey { old, new } in RENAMED_KEYS {
        assert!(products.iter().any(|product| has(product, new)), "{new}");
        assert!(!products.iter().any(|product| has(product, old)), "{old}");
    }
}
