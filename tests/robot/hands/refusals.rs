//! Hands that are refused: by the true cause, with a remedy that works, and by `hand check` as by the run.

use std::path::Path;

use serde_json::Value;

use crate::support::{
    jobs::NO_SPLIT,
    meshes::{centred_block, off_of},
    program::Program,
    workspace::Workspace,
};

/// A gripper of two fingers of two links; a case replaces `PALM`, `TIP`, `MORE` and `END`.
const HAND: &str = r#"<mujoco model="fingers">
  <compiler angle="degree" autolimits="true"/>
  <worldbody>
    <body name="palm">
      <geom name="palm" type="box" pos="0 0 0.01" size="0.03 0.05 0.01" mass="0.3"/>PALM
      <site name="approach" pos="0 0 0.02"/>
      <body name="left" pos="0 0.04 0.029">
        <joint name="left" axis="1 0 0" range="-20 80"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.05" size="0.008" mass="0.05" TIP/>
        <site name="left_pad" pos="0 -0.008 0.04" zaxis="0 -1 0"/>
        <body name="left_tip" pos="0 0 0.05">
          <joint name="left_tip" axis="1 0 0" range="-20 60"/>
          <geom type="capsule" fromto="0 0 0 0 0 0.03" size="0.008" mass="0.03"/>
          <site name="left_end" pos="0 -0.008 0.02" zaxis="0 -1 0"/>
        </body>
      </body>
      <body name="right" pos="0 -0.04 0.029">
        <joint name="right" axis="-1 0 0" range="-20 80"/>
        <geom type="capsule" fromto="0 0 0 0 0 0.05" size="0.008" mass="0.05"/>
        <site name="right_pad" pos="0 0.008 0.04" zaxis="0 1 0"/>
      </body>
    </body>
  </worldbody>
  <equality>
    COUPLING
  </equality>MORE
</mujoco>
"#;

const COUPLING: &str = r#"<joint joint1="left_tip" joint2="left" polycoef="0 0.5 0 0 0"/>"#;

const TABLE: &str = r#"approach = { site = "APPROACH" }
contacts = [{ site = "left_pad" }, { site = "left_end" }, { site = "right_pad" }]
[[driven]]
joint = "left"
opened = 0.0
closed = 1.2
speed = 2.0
torque = 0.5
[[driven]]
joint = "right"
opened = 0.0
closed = 1.2
speed = 2.0
torque = 0.5
[eigengrasps]
origin = [0.2, ORIGIN]
directions = [[1.0, 1.0]]
"#;

/// A case: what it puts in the place of the words in capitals.
#[derive(Clone, Copy)]
struct Case {
    palm: &'static str,
    tip: &'static str,
    coupling: &'static str,
    more: &'static str,
    approach: &'static str,
    origin: &'static str,
}

const SOUND: Case = Case { palm: "", tip: "", coupling: COUPLING, more: "", approach: "approach", origin: "0.2" };

impl Case {
    fn write(self, workspace: &Workspace) -> std::path::PathBuf {
        self.write_with(workspace, "")
    }

    /// With shapes in the palm.
    fn write_with(self, workspace: &Workspace, shapes: &str) -> std::path::PathBuf {
        let Self { palm, tip, coupling, more, approach, origin } = self;
        workspace.write("hand.toml", TABLE.replace("APPROACH", approach).replace("ORIGIN", origin));
        let text = HAND.replace("PALM", &format!("{palm}{shapes}")).replace("TIP", tip);
        workspace.write("hand.xml", text.replace("COUPLING", coupling).replace("MORE", more))
    }
}

fn check(hand: &Path) -> Program {
    Program::new("hand").arg("check").arg(hand).option("--samples", "200")
}

/// Small balls in the palm.
fn balls(count: usize) -> String {
    (0..count)
        .map(|index| format!("<geom size=\"0.001\" pos=\"0 {} 0.01\" mass=\"0.001\"/>", 1e-4 * index as f64))
        .collect()
}

/// Knuckles that reach into the fixed palm.
const KNUCKLES: Case =
    Case { palm: r#"<geom type="box" pos="0 0.04 0.03" size="0.01 0.01 0.01" mass="0.01"/>"#, ..SOUND };

/// Settings with jobs of each kind that use a hand.
fn jobs() -> Vec<(&'static str, String)> {
    let grasps = |sampler: &str, keys: &str| {
        format!(
            "product = \"grasps\"\n[hand]\nmodel = \"hand.xml\"\n[[objects]]\nfolder = \"meshes\"\n[grasps]\nseeds = 1\n\
             sampler = \"{sampler}\"\n{keys}\n{NO_SPLIT}"
        )
    };
    let touch = |kind: &str| {
        format!(
            "views = {{ even = 1 }}\n[[objects]]\nfolder = \"meshes\"\n[touch]\n{kind}\nhand = {{ model = \"hand.xml\" }}\n{NO_SPLIT}"
        )
    };
    let antipodal = "[antipodal]\ndepth = \"any\"\npairs = 5\nbest = 1";
    vec![
        ("touch.exploration = true", touch("exploration = true\napproaches = 1")),
        ("touch.grasp = true", touch("grasp = true")),
        ("grasps.sampler = \"annealing\"", grasps("annealing", "[annealing]\nsteps = 50\nmax_failures = 50")),
        ("grasps.sampler = \"uniform\"", grasps("uniform", "[uniform]\ngrasps = 2")),
        ("grasps.sampler = \"antipodal\"", grasps("antipodal", antipodal)),
        ("grasps.sampler = \"approach\"", grasps("approach", "[approach]\ndraws = 5\nbest = 1")),
        ("[physics]", grasps("antipodal", &format!("{antipodal}\n[physics]"))),
    ]
}

fn without_space(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// `hand check` and the jobs themselves: each setting is refused by both or by neither, in the same words.
#[test]
fn hand_check_lists_the_jobs_that_run_and_no_others() {
    let cases: [(&str, Case, String, usize); 7] = [
        ("sound", SOUND, String::new(), 0),
        ("a hundred shapes", SOUND, balls(96), 0),
        ("too many shapes", SOUND, balls(130), 5),
        ("approach on a joint", Case { approach: "left_pad", ..SOUND }, String::new(), 5),
        ("knuckles in the palm", KNUCKLES, String::new(), 5),
        ("a finger that no object touches", Case { tip: r#"contype="2" conaffinity="2""#, ..SOUND }, String::new(), 7),
        ("a finger that is only drawn", Case { tip: r#"contype="0" conaffinity="0""#, ..SOUND }, String::new(), 0),
    ];
    let workspace = Workspace::new();
    workspace.write("meshes/box.off", off_of(&centred_block([0.02, 0.02, 0.03])));
    let mut tried = 0;
    for (name, case, shapes, refusals) in cases {
        let hand = case.write_with(&workspace, &shapes);
        let report = check(&hand).read_json();
        let refusal = |setting: &str| {
            let mut uses = report["uses"].as_array().expect("uses").iter();
            let row = uses.find(|row| row["setting"] == setting).unwrap_or_else(|| panic!("no row {setting}"));
            row["refusal"].as_str().map(without_space)
        };
        let mut refused = 0;
        for (setting, job) in jobs() {
            workspace.write("job.toml", &job);
            let out = workspace.path("out");
            _ = std::fs::remove_dir_all(&out);
            let outcome = workspace.run_job("job", "out").finish();
            let told = without_space(&outcome.stderr);
            match refusal(setting) {
                Some(reason) => {
                    assert_eq!(outcome.code, Some(2), "{name}, {setting}: {told}");
                    assert!(told.contains(&reason), "{name}, {setting}: {reason} is not in {told}");
                    assert!(!out.exists(), "{name}, {setting}: nothing is begun");
                    refused += 1;
                }
                // 3: no sample was kept, which is no refusal of the hand.
                None => assert!(matches!(outcome.code, Some(0 | 3)), "{name}, {setting}: {told}"),
            }
            tried += 1;
        }
        assert_eq!(refused, refusals, "{name}: {:?}", report["uses"]);
    }
    println!("{tried} jobs");
}

#[test]
fn a_palm_that_overlaps_its_knuckles_is_mended_by_the_lines_that_are_printed() {
    let workspace = Workspace::new();
    let hand = KNUCKLES.write(&workspace);
    let said = check(&hand).succeed().stdout;
    for words in ["always touch: 1", "palm - left", "opened, these touch: palm and left", "palm and left in 100 %"] {
        assert!(said.contains(words), "{words} is not in\n{said}");
    }
    let report: Value = check(&hand).read_json();
    let lines = report["exclude"].as_array().expect("lines");
    assert_eq!(lines, &[r#"<exclude body1="palm" body2="left"/>"#]);
    // The refusal of jobs has the same line.
    assert!(said.matches(lines[0].as_str().expect("a line")).count() == 2, "{said}");
    let contact: String = lines.iter().filter_map(Value::as_str).collect();
    let mended = Case { more: "\n<contact><exclude body1=\"palm\" body2=\"left\"/></contact>", ..KNUCKLES };
    assert!(mended.more.contains(&contact));
    let said = check(&mended.write(&workspace)).succeed().stdout;
    assert!(said.contains("opened, nothing touches") && !said.contains("jobs that cannot"), "{said}");
}

/// A bar above the palm that the fingers pass through unless they are almost closed. What else overlaps then is excluded.
const BAR: Case = Case {
    palm: r#"<geom type="box" pos="0 0 0.06" size="0.01 0.06 0.01" mass="0.01"/>"#,
    more: "\n<contact><exclude body1=\"left\" body2=\"right\"/><exclude body1=\"left_tip\" body2=\"right\"/>\
           <exclude body1=\"palm\" body2=\"left_tip\"/></contact>",
    ..SOUND
};

#[test]
fn a_run_without_a_legal_state_names_the_overlap_and_the_line_that_excludes_it() {
    let workspace = Workspace::new();
    workspace.write("meshes/box.off", off_of(&centred_block([0.02, 0.02, 0.03])));
    let (_, job) = jobs().swap_remove(2);
    workspace.write("job.toml", job);
    // The detail of the reject, with the job's one run.
    let detail = |lines: &str| {
        let hand = BAR.write(&workspace);
        let text = workspace.read("hand.xml").replace("</mujoco>", &format!("{lines}</mujoco>"));
        workspace.write("hand.xml", text);
        // Some postures are clear: no refusal before the run.
        assert!(!check(&hand).succeed().stdout.contains("jobs that cannot"));
        _ = std::fs::remove_dir_all(workspace.path("out"));
        let outcome = workspace.run_job("job", "out").finish();
        let reject: Option<Value> = workspace.read("out/rejects.jsonl").lines().next().map(|line| {
            assert!(outcome.stderr.contains("the first: ") || outcome.stdout.contains("the first: "), "{outcome:?}");
            serde_json::from_str(line).expect("a row")
        });
        reject.map(|row| row["detail"].as_str().expect("a detail").to_owned()).unwrap_or_default()
    };
    let (mut lines, mut followed) = (String::new(), Vec::new());
    let last = loop {
        let detail = detail(&lines);
        let Some((_, remedy)) = detail.split_once(" put ") else { break detail };
        let line = remedy.split_once(" into the description").expect("a line").0.to_owned();
        assert!(detail.contains("the hand overlaps itself in ") && !followed.contains(&line), "{detail}");
        lines += &line;
        followed.push(line);
    };
    followed.sort();
    let line = |body: &str| format!("<contact><exclude body1=\"palm\" body2=\"{body}\"/></contact>");
    assert_eq!(followed, [line("left"), line("right")]);
    assert!(!last.contains("overlaps itself"), "{last}");
}

/// Refused with place, statement and remedy; the remedy works.
#[test]
fn what_ties_joints_beside_the_table_is_the_cause_that_is_named() {
    let workspace = Workspace::new();
    let tendon = "\n  <tendon>\n    <fixed name=\"cable\"><joint joint=\"left\" coef=\"1\"/><joint joint=\"left_tip\" coef=\"1\"/></fixed>\n  \
                  </tendon>\n  <actuator><motor tendon=\"cable\"/></actuator>";
    let cases: [(&str, Case, &[&str]); 3] = [
        (
            "a chain",
            Case { coupling: "<connect name=\"bar\" body1=\"left_tip\" body2=\"palm\" anchor=\"0 0.01 0\"/>", ..SOUND },
            &[
                "hand.xml:25: <connect name=\"bar\" body1=\"left_tip\" body2=\"palm\"",
                "ties links that move against each other",
            ],
        ),
        (
            "a weld",
            Case { coupling: "<weld body1=\"left_tip\" body2=\"left\"/>", ..SOUND },
            &["hand.xml:25: <weld body1=\"left_tip\" body2=\"left\">", "take out the joint that does not move"],
        ),
        (
            "a tendon with a motor",
            Case { coupling: "", more: tendon, ..SOUND },
            &["hand.xml:28: <fixed name=\"cable\">", "moves, ties, limits or loads joints of the hand"],
        ),
    ];
    for (name, case, parts) in cases {
        let told = check(&case.write(&workspace)).expect_code(2).stderr;
        for part in parts {
            assert!(told.contains(part), "{name}: {part} is not in\n{told}");
        }
        assert!(!told.contains("nothing moves"), "{name}: {told}");
    }
    // As the remedy has it: the joint that follows, by an equality.
    check(&SOUND.write(&workspace)).succeed();
    // One that is switched off ties nothing, nor a tendon that only measures.
    let off = "<connect body1=\"left_tip\" body2=\"palm\" anchor=\"0 0 0\" active=\"false\"/>\n    \
               <joint joint1=\"left_tip\" joint2=\"left\" polycoef=\"0 0.5 0 0 0\"/>";
    let measuring = "\n  <tendon><fixed name=\"cable\"><joint joint=\"left\" coef=\"1\"/></fixed></tendon>\n  \
                     <sensor><tendonpos tendon=\"cable\"/></sensor>";
    check(&Case { coupling: off, more: measuring, ..SOUND }.write(&workspace)).succeed();
}

#[test]
fn eigengrasps_keep_to_the_ranges_of_the_joints() {
    let workspace = Workspace::new();
    let told = check(&Case { origin: "5.0", ..SOUND }.write(&workspace)).expect_code(2).stderr;
    for part in ["hand.toml:16", "eigengrasps.origin[1]", "the range of joint `right`", "1.396"] {
        assert!(told.contains(part), "{part} is not in\n{told}");
    }
    let zeros = TABLE
        .replace("APPROACH", "approach")
        .replace("ORIGIN", "0.2")
        .replace("[[1.0, 1.0]]", "[[1.0, 1.0], [0.0, 0.0]]");
    let hand = SOUND.write(&workspace);
    workspace.write("hand.toml", zeros);
    let told = check(&hand).expect_code(2).stderr;
    assert!(told.contains("eigengrasps.directions[1]") && told.contains("a direction that moves a joint"), "{told}");
}

/// Only parts that a user can see must be moved.
#[test]
fn contacts_within_rounding_of_the_surface_are_on_it() {
    let workspace = Workspace::new();
    let hand = SOUND.write(&workspace);
    let moved = |depth: f64| {
        let text =
            workspace.read("hand.xml").replace("pos=\"0 -0.008 0.04\"", &format!("pos=\"0 {} 0.04\"", -0.008 + depth));
        let path = workspace.write("moved.xml", text);
        workspace.write("moved.toml", workspace.read("hand.toml"));
        check(&path).succeed().stdout
    };
    assert!(!check(&hand).succeed().stdout.contains("move it to the surface"));
    assert!(!moved(5e-5).contains("move it to the surface"));
    assert!(moved(2e-4).contains("0.20 mm inside its link: move it to the surface"));
}

/// Tables that would take memory or a deep stack to read are refused.
#[test]
fn tables_are_bounded() {
    let workspace = Workspace::new();
    let hand = SOUND.write(&workspace);
    let sound = workspace.read("hand.toml");
    let contact = "{ name = \"c\", body = \"palm\", position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] },";
    for (name, table) in [
        ("contacts", sound.replace("contacts = [", &format!("contacts = [{}", contact.repeat(1001)))),
        (
            "motors",
            format!("{sound}{}", "[[driven]]\njoint = \"left\"\nopened = 0.0\nspeed = 1.0\ntorque = 1.0\n".repeat(101)),
        ),
        ("directions", sound.replace("[[1.0, 1.0]]", &format!("[{}]", "[1.0, 1.0],".repeat(101)))),
        ("nesting", format!("{sound}deep = {}{}\n", "[".repeat(100_000), "]".repeat(100_000))),
        ("nested tables", format!("{sound}deep = {}1{}\n", "{a = ".repeat(50_000), "}".repeat(50_000))),
    ] {
        workspace.write("hand.toml", table);
        let told = check(&hand).expect_code(2).stderr;
        assert!(
            told.contains("hand.toml") && told.len() < 20_000 && !told.contains("panicked"),
            "{name}: {} bytes",
            told.len()
        );
    }
}
