//! Descriptions made to take memory, time or the stack: each ends at once, with its file and line, or is read without
//! cost.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use crate::support::{
    program::{Outcome, Program},
    workspace::Workspace,
};

/// Address space of the program [KiB]: far more than a robot takes, far less than these need.
const MEMORY: u32 = 3_000_000;

/// A bound under load; each takes a fraction of a second.
const AT_ONCE: Duration = Duration::from_secs(60);

/// A hand that is sound, with `HEAD` before and `BODY`, `TAIL` in and after its world.
const HAND: &str = r#"<mujoco>HEAD
<worldbody><body name="palm"><geom name="palm" size="0.02"/><site name="s"/>
<body name="finger" pos="0.1 0 0"><joint name="j" range="-60 60" limited="true"/><geom name="finger" size="0.01"/><site name="t"/></body></body>BODY
</worldbody>TAIL
</mujoco>"#;

const TABLE: &str =
    "approach = { site = \"s\" }\n[[driven]]\njoint = \"j\"\nopened = 0.0\nclosed = 0.5\nspeed = 1.0\ntorque = 1.0\n";

struct Attack {
    name: &'static str,
    head: String,
    body: String,
    tail: String,
    /// Words of the refusal; empty if the statement has no cost.
    refused: &'static str,
}

fn attack(name: &'static str, [head, body, tail]: [&str; 3], refused: &'static str) -> Attack {
    Attack { name, head: head.to_owned(), body: body.to_owned(), tail: tail.to_owned(), refused }
}

fn tail(name: &'static str, tail: &str, refused: &'static str) -> Attack {
    attack(name, ["", "", tail], refused)
}

fn body(name: &'static str, body: &str, refused: &'static str) -> Attack {
    attack(name, ["", body, ""], refused)
}

fn attacks() -> Vec<Attack> {
    let cycle = "leads back to itself";
    let assets = |content: &str| format!("<asset>{content}</asset>");
    let texture = "<texture type=\"2d\" builtin=\"flat\" width=\"4096\" height=\"4096\"/>";
    let nested =
        |tag: &str, count: usize| format!("{}{}", format!("<{tag}>").repeat(count), format!("</{tag}>").repeat(count));
    let replicate =
        |count: &str, content: &str| format!("<replicate count=\"{count}\" offset=\"1 0 0\">{content}</replicate>");
    let attach = "<attach model=\"m\" prefix=\"p\"/>";
    vec![
        // What leads back to itself.
        attack("attach of itself", ["", attach, "<asset><model name=\"m\" file=\"hand.xml\"/></asset>"], cycle),
        attack(
            "attach of what attaches it",
            ["", attach, "<asset><model name=\"m\" file=\"back.xml\"/></asset>"],
            cycle,
        ),
        attack(
            "attach of what includes it",
            ["", attach, "<asset><model name=\"m\" file=\"including.xml\"/></asset>"],
            cycle,
        ),
        tail("include of itself", "<include file=\"hand.xml\"/>", cycle),
        tail("include of what attaches it", "<include file=\"back.xml\"/>", cycle),
        attack(
            "doubled ten times",
            ["", attach, "<asset><model name=\"m\" file=\"twice0.xml\"/></asset>"],
            "elements with all copies",
        ),
        // Copies and counts.
        body("a billion replicas", &replicate("1000000000", "<geom size=\"1\"/>"), "`count` of <replicate>"),
        body(
            "replicas of replicas",
            &replicate("1000", &replicate("1000", "<geom size=\"1\"/>")),
            "elements with all copies",
        ),
        body("less than no replica", &replicate("-1", "<geom size=\"1\"/>"), "1 to 1000"),
        tail("keyframes", &format!("<keyframe>{}</keyframe>", "<key/>".repeat(15_000)), "elements keyframe/key"),
        tail("more keyframes", &format!("<keyframe>{}</keyframe>", "<key/>".repeat(300_000)), "elements"),
        tail(
            "equalities",
            &format!("<equality>{}</equality>", "<joint joint1=\"j\"/>".repeat(1001)),
            "elements equality/*",
        ),
        body("joints", &"<body><joint/><geom size=\"1\"/></body>".repeat(1001), "elements body/joint"),
        body("a cable", "<composite type=\"cable\" count=\"1000000 1 1\" size=\"1 0 0\" prefix=\"c\"/>", "copies"),
        body("a cloth", "<flexcomp name=\"f\" type=\"grid\" count=\"1000 1000 1000\" spacing=\"1 1 1\"/>", "copies"),
        body(
            "a cube of cells",
            "<flexcomp name=\"f\" type=\"grid\" count=\"2 2 2\" cellcount=\"1000 1 1\" spacing=\"1 1 1\"/>",
            "`cellcount`",
        ),
        body("nested bodies", &nested("body", 100_000), "within each other"),
        attack("nested defaults", [&nested("default", 100_000), "", ""], "within each other"),
        body(
            "many attributes",
            &format!("<geom{}/>", (0..100_000).map(|index| format!(" a{index}=\"1\"")).collect::<String>()),
            "attributes",
        ),
        // Sizes.
        tail("a user's sensor", "<sensor><user dim=\"1000000000\"/></sensor>", "`dim` of <user>"),
        tail(
            "many users' sensors",
            &format!("<sensor>{}</sensor>", "<user dim=\"1000\"/>".repeat(15_000)),
            "MiB of memory",
        ),
        tail("a history", "<sensor><jointpos joint=\"j\" nsample=\"16000000\"/></sensor>", "`nsample`"),
        tail(
            "a motor's history",
            "<actuator><motor joint=\"j\" nsample=\"16000000\" delay=\"1\"/></actuator>",
            "`nsample`",
        ),
        tail(
            "activations",
            "<actuator><general joint=\"j\" dyntype=\"user\" actdim=\"100000000\"/></actuator>",
            "`actdim`",
        ),
        tail("contacts", "<sensor><contact geom1=\"palm\" num=\"100000000\"/></sensor>", "`num`"),
        attack(
            "rays of pixels",
            ["", "<camera name=\"c\" resolution=\"16000 16000\"/>", "<sensor><rangefinder camera=\"c\"/></sensor>"],
            "a ray for each pixel",
        ),
        body("pixels", "<camera name=\"c\" resolution=\"1000000000 2\"/>", "`resolution`"),
        tail("a texture", &assets("<texture type=\"2d\" builtin=\"flat\" width=\"1000000\" height=\"1\"/>"), "`width`"),
        tail("many textures", &assets(&texture.repeat(100)), "MiB of memory"),
        attack(
            "textures by default",
            [
                &format!("<default>{texture}</default>").replace(" type=\"2d\" builtin=\"flat\"", ""),
                "",
                &assets(&"<texture type=\"2d\" builtin=\"flat\"/>".repeat(100)),
            ],
            "MiB of memory",
        ),
        tail(
            "a height field",
            &assets("<hfield name=\"h\" nrow=\"100000\" ncol=\"100000\" size=\"1 1 1 1\"/>"),
            "`nrow`",
        ),
        tail(
            "many height fields",
            &assets(&"<hfield nrow=\"2000\" ncol=\"2000\" size=\"1 1 1 1\"/>".repeat(10)),
            "MiB of memory",
        ),
        tail("a built-in mesh", &assets("<mesh name=\"m\" builtin=\"plate\" params=\"30000 30000\"/>"), "`params`"),
        tail("numbers", "<custom><numeric name=\"n\" size=\"1000000000\"/></custom>", "`size` of <numeric>"),
        attack("user data", ["<size nuser_geom=\"1000000000\"/>", "", ""], "`nuser_geom`"),
        body(
            "user data of one",
            &format!("<geom size=\"1\" user=\"{}\"/>", "1 ".repeat(1_000_000)),
            "`user` of <geom>",
        ),
        attack("more user data", ["<size nuserdata=\"1000000000\"/>", "", ""], "`nuserdata`"),
        attack("keys", ["<size nkey=\"1000000000\"/>", "", ""], "`nkey`"),
        attack("steps of the solver", ["<option iterations=\"2000000000\" tolerance=\"0\"/>", "", ""], "`iterations`"),
        attack("steps of a distance field", ["<option sdf_initpoints=\"2000000000\"/>", "", ""], "`sdf_initpoints`"),
        // What MuJoCo itself does not survive.
        body(
            "a plugin of a cloth",
            "<flexcomp name=\"f\" type=\"grid\" count=\"2 2 1\" spacing=\"1 1 1\"><plugin/></flexcomp>",
            "refused",
        ),
        // Statements without cost here.
        attack("constraints", ["<size njmax=\"1000000000\" nconmax=\"1000000000\"/>", "", ""], ""),
        attack("an arena", ["<size memory=\"900G\"/>", "", ""], ""),
        attack(
            "lengths of muscles",
            [
                "<compiler><lengthrange inttotal=\"1e9\" timestep=\"1e-9\" interval=\"0\"/></compiler>",
                "",
                "<actuator><muscle joint=\"j\"/></actuator>",
            ],
            "",
        ),
    ]
}

fn limited(verb: &str, file: &Path) -> Program {
    let line = format!("ulimit -v {MEMORY}; exec \"$0\" \"$@\"");
    let program = Program::of_system("sh")
        .option("-c", line)
        .arg(env!("CARGO_BIN_EXE_graspmill"))
        .arg(verb)
        .arg("check")
        .arg(file);
    let program = program.option("--samples", "10");
    if verb == "robot" { program.args(["--joints", "j", "--target", "t"]) } else { program }
}

fn check(verb: &str, file: &Path, Attack { name, refused, .. }: &Attack) {
    let began = Instant::now();
    let Outcome { code, stdout, stderr, .. } = limited(verb, file).finish();
    let told = format!("{verb} check of {name}: {code:?} {stdout}{stderr}");
    assert!(began.elapsed() < AT_ONCE, "{told}");
    match *refused {
        "" => assert_eq!(code, Some(0), "{told}"),
        words => {
            assert_eq!(code, Some(2), "{told}");
            assert!(stderr.contains(words) && stderr.contains(".xml:") && stderr.len() < 5000, "{told}");
        }
    }
}

#[test]
fn descriptions_that_ask_for_much_are_refused_at_once() {
    let workspace = Workspace::new();
    workspace.write("hand.toml", TABLE);
    let attaching = |file: &str| {
        format!(
            "<mujoco><asset><model name=\"n\" file=\"{file}\"/></asset><worldbody><attach model=\"n\" prefix=\"a\"/><attach model=\"n\" prefix=\"b\"/></worldbody></mujoco>"
        )
    };
    workspace.write("back.xml", attaching("hand.xml"));
    workspace.write("including.xml", "<mujoco><include file=\"hand.xml\"/></mujoco>");
    for index in 0..12 {
        workspace.write(format!("twice{index}.xml"), attaching(&format!("twice{}.xml", index + 1)));
    }
    let many = "<site size=\"0.01\"/>".repeat(10);
    workspace.write("twice12.xml", format!("<mujoco><worldbody>{many}</worldbody></mujoco>"));
    let attacks = attacks();
    for attack in &attacks {
        let Attack { head, body, tail, .. } = attack;
        let text = HAND.replace("HEAD", head).replace("BODY", body).replace("TAIL", tail);
        let file = workspace.write("hand.xml", text);
        for verb in ["hand", "robot"] {
            check(verb, &file, attack);
        }
    }
    println!("{} attacks", attacks.len());
    // Without any of them the hand is sound.
    let sound = workspace.write("hand.xml", HAND.replace("HEAD", "").replace("BODY", "").replace("TAIL", ""));
    for verb in ["hand", "robot"] {
        check(verb, &sound, &attack("nothing", ["", "", ""], ""));
    }
}

/// Whatever memory is left, the file is not blamed for its lack.
#[test]
fn too_little_memory_is_not_blamed_on_a_description() {
    let workspace = Workspace::new();
    workspace.write("hand.toml", TABLE);
    let file = workspace.write("hand.xml", HAND.replace("HEAD", "").replace("BODY", "").replace("TAIL", ""));
    let (mut short, mut enough) = (0, 0);
    for megabytes in (56..400).step_by(4) {
        for verb in ["hand", "robot"] {
            let line = format!("ulimit -v {}; exec \"$0\" \"$@\"", megabytes * 1024);
            let program = Program::of_system("sh").option("-c", line).arg(env!("CARGO_BIN_EXE_graspmill"));
            let program = program.args([verb, "check"]).arg(&file).option("--samples", "10");
            let program = if verb == "robot" { program.args(["--joints", "j", "--target", "t"]) } else { program };
            let Outcome { code, stderr, .. } = program.finish();
            let told = format!("{verb} with {megabytes} MB: {code:?} {stderr}");
            assert!(!stderr.contains("MuJoCo refuses") && code != Some(2), "{told}");
            short += u32::from(stderr.contains("of memory are left"));
            enough += u32::from(code == Some(0));
        }
    }
    println!("{short} too short, {enough} enough");
    assert!(short > 0 && enough > 0, "{short} {enough}");
}
