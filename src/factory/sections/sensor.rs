//! Sensors of jobs that measure depth: their keys, checked and written.

use serde_json::{Map, Value, json};

use super::spec::SensorSpec;
use form::{Checker, Path};
use kernel::render::{SENSOR_CONSTANTS, SensorConstant, SensorModel};

/// The model; `None` for a perfect sensor. Mistakes are reported.
pub fn check_sensor(checker: &mut Checker, spec: &SensorSpec) -> Option<SensorModel> {
    let name = spec.profile.as_str();
    if name == "none" {
        if let Some(key) = spec.constants.keys().next() {
            let because = "a perfect sensor has no constants";
            checker.contradiction(&format!("sensor.constants.{key}"), "sensor.profile = \"none\"", because);
        }
        return None;
    }
    // The schema lists the profiles.
    let mut model = SensorModel::profile(name)?;
    for (key, value) in &spec.constants {
        if let Err(error) = model.set(key, *value) {
            let path = Path::from("sensor.constants").key(key);
            checker.invalid(path, "a constant that fits the sensor", error.to_string());
        }
    }
    Some(model)
}

impl SensorSpec {
    /// A sensor with every constant.
    pub fn from_model(model: &SensorModel) -> Self {
        let constants = model.canonical().into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        Self { profile: model.profile_name().to_owned(), constants }
    }
}

/// Lists the sensor model's own profiles and constants in the schema of its section.
pub fn describe_sensors(sensor: &mut Value) {
    let profiles: Vec<&str> = ["none"].into_iter().chain(SensorModel::profiles()).collect();
    sensor["profile"]["enum"] = json!(profiles);
    let models: Vec<SensorModel> = SensorModel::profiles().filter_map(SensorModel::profile).collect();
    let constant = |(index, constant): (usize, &SensorConstant)| {
        let SensorConstant { key, unit, min, max, meaning } = constant;
        let value_of = |model: &SensorModel| format!("{}: {}", model.profile_name(), model.canonical()[index].1);
        let values: Vec<String> = models.iter().map(value_of).collect();
        let description = format!("{meaning}. {}.", values.join(", "));
        let mut schema = json!({ "type": "number", "minimum": min, "maximum": max, "description": description });
        schema["examples"] = json!([models[0].canonical()[index].1]);
        if *unit != "1" {
            schema["x-unit"] = json!(unit);
        }
        ((*key).to_owned(), schema)
    };
    let constants: Map<String, Value> = SENSOR_CONSTANTS.iter().enumerate().map(constant).collect();
    sensor["constants"]["properties"] = Value::Object(constants);
    sensor["constants"]["additionalProperties"] = json!(false);
}
