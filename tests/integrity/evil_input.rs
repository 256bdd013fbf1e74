//! Malicious job files, settings and arguments: each ends at once with the documented exit code and a message about the
//! mistake, and no work is started.

use std::fs;

use crate::support::{
    files::repository_path,
    jobs::{fetch_table, small_job},
    program::{Outcome, Program},
    robots::{BARRETT, FETCH},
    workspace::Workspace,
};

/// A job that is in order.
const SOUND: &str = "views = { even = 1 }\n[[objects]]\nbuilt_in = [\"box-01\"]\n[grid]\nresolution = 12\n[gate]\n\
                     min_partial_cells = 1\n";

/// Lines on top of a job of pairs, and a word of the error.
const LINES: [(&str, &str); 108] = [
    (r#"seed = "x""#, "seed"),
    ("seed = 1.5", "seed"),
    ("seed = -1", "seed"),
    ("seed = 18446744073709551616", "seed"),
    ("seed = true", "seed"),
    ("name = 1", "name"),
    ("profile = 3", "profile"),
    (r#"profile = "thesiss""#, "did you mean"),
    (r#"product = "xyz""#, "product"),
    ("product = 1", "product"),
    ("overrides = 3", "overrides"),
    (r#"nmae = "x""#, "did you mean `name`"),
    (r#""" = 1"#, "unknown key"),
    (r#""a\nb" = 1"#, "unknown key"),
    ("seed = 1\nseed = 2", "duplicate"),
    ("seed = ", ""),
    ("= 3", ""),
    ("[grid", ""),
    (r#"a = "x"#, ""),
    ("a = '''x", ""),
    ("[grid]\n[grid]", ""),
    ("grid = 1\n[grid]", ""),
    ("seed = 1979-05-27", "seed"),
    ("seed = 0x_1", ""),
    ("views = 1", "views"),
    (r#"views = "x""#, "views"),
    ("views = {}", "views"),
    ("views = { even = 0 }", "even"),
    ("views = { even = -1 }", "even"),
    ("views = { even = 1000001 }", "even"),
    ("views = { even = 1e9 }", "even"),
    ("views = { even = 1, rpy = [] }", "views"),
    ("views = { rpy = [] }", "rpy"),
    ("views = { rpy = [[1, 2]] }", "rpy"),
    ("views = { rpy = [[nan, 0, 0]] }", "rpy"),
    ("views = { rpy = [[inf, 0, 0]] }", "rpy"),
    ("views = { matrices = [[[1, 0, 0], [0, 1, 0], [0, 0, 2]]] }", "rotation matrix"),
    ("views = { matrices = [[[1, 0, 0], [0, 1, 0], [0, 0, -1]]] }", "rotation matrix"),
    ("views = { quaternions_wxyz = [[0, 0, 0, 0]] }", "length"),
    ("views = { quaternions_wxyz = [[1e300, 0, 0, 0]] }", "length"),
    ("views = { roll = [], pitch = [0.0], yaw = [0.0] }", "roll"),
    (
        "views = { roll = { from = 0, to = 1, count = 1001 }, pitch = { from = 0, to = 1, count = 1000 }, yaw = [0] }",
        "at most 1000000 views",
    ),
    ("camera = { width = 0 }", "width"),
    ("camera = { width = 16385 }", "width"),
    ("camera = { height = -1 }", "height"),
    ("camera = { width = 1.5 }", "width"),
    ("camera = { horizontal_fov = 0 }", "horizontal_fov"),
    ("camera = { horizontal_fov = 3.15 }", "horizontal_fov"),
    ("camera = { horizontal_fov = nan }", "horizontal_fov"),
    ("camera = { fx = 0 }", "fx"),
    ("camera = { fx = 1e-300 }", "fx = 1e-300 px: must lie between 6.4 and 64000 px"),
    ("camera = { fx = 1e300 }", "camera.fx"),
    ("camera = { fx = 500, fy = 1e9 }", "camera.fy"),
    ("camera = { cx = 1e300 }", "camera.cx"),
    ("camera = { cy = -2161 }", "cy = -2161.0 px: must lie between -2160 and 2640 px"),
    ("camera = { horizontal_fov = 1e-9 }", "camera.horizontal_fov"),
    ("camera = { horizontal_fov = 3.14159 }", "camera.horizontal_fov"),
    ("camera = { fx = 500, horizontal_fov = 1 }", "fx"),
    ("camera = { fy = 500 }", "fx"),
    ("camera = { near = 0 }", "near"),
    ("camera = { near = inf }", "near"),
    (r#"camera = { scene = "nowhere.xml", camera = "x" }"#, "nowhere.xml"),
    (r#"camera = { camera = "x" }"#, "scene"),
    (r#"camera = { scene = ".", camera = "x" }"#, "camera.scene"),
    ("distance = 0", "distance"),
    ("distance = -1", "distance"),
    ("distance = nan", "distance"),
    ("distance = inf", "distance"),
    ("distance = 0.05", "near"),
    ("distance = 1e300", "pixel wide"),
    ("distance = 1200", "pixel wide"),
    ("distance = { min = 0.5, max = 1e300 }", "pixel wide"),
    ("distance = { min = 1 }", "max"),
    ("distance = { min = 2, max = 1 }", "max"),
    ("distance = { fit = 0 }", "fit"),
    ("distance = { fit = 2 }", "fit"),
    ("grid = { resolution = 0 }", "resolution"),
    ("grid = { resolution = 129 }", "resolution"),
    ("grid = { resolution = 1.5 }", "resolution"),
    (r#"grid = { resolution = "40" }"#, "resolution"),
    ("grid = 3", "grid"),
    (r#"truth = { rule = "x" }"#, "rule"),
    ("truth = { fraction = 0.5 }", "fraction"),
    (r#"truth = { rule = "fraction" }"#, "fraction"),
    (r#"truth = { rule = "fraction", fraction = 0 }"#, "fraction"),
    ("gate = { min_partial_cells = -1 }", "min_partial_cells"),
    ("gate = { min_partial_cells = 1099511627776 }", "min_partial_cells"),
    ("gate = { min_partial_cells = 64001 }", "min_partial_cells"),
    ("gate = { min_overlap = 2 }", "min_overlap"),
    ("gate = { min_overlap = nan }", "min_overlap"),
    ("split = { test_objects = -1 }", "test_objects"),
    ("split = { test_objects = 1.5 }", "test_objects"),
    (r#"split = { test_objects = ["nope"] }"#, "nope"),
    ("split = { training_subsets = [0] }", "training_subsets"),
    ("split = { holdout_items = 2 }", "holdout_items"),
    (r#"channels = { depth = "u8" }"#, "depth"),
    (r#"channels = { tsdf = "yes" }"#, "tsdf"),
    ("channels = { smell = true }", "smell"),
    ("touch = { random_rays = true, rays = 0 }", "rays"),
    ("touch = { exploration = true }", "hand"),
    ("touch = { smell = true }", "smell"),
    ("shards = { samples = 0 }", "samples"),
    ("shards = { samples = 1000001 }", "samples"),
    (r#"sensor = { profile = "x" }"#, "profile"),
    ("sensor = { constants = { baseline = 0.1 } }", "sensor"),
    (r#"sensor = { profile = "kinect-v1", constants = { nope = 1 } }"#, "nope"),
    (r#"renderer = "x""#, "renderer"),
    (r#"pivot = "x""#, "pivot"),
];

/// Whole jobs, and a word of the error. Capitals are replaced by the tables and files of the repository.
const JOBS: [(&str, &str); 61] = [
    ("", "objects"),
    ("\n\n", "objects"),
    ("objects = []", "objects"),
    ("objects = 1", "objects"),
    ("objects = [1]", "objects"),
    ("objects = [{}]", "objects"),
    (r#"objects = [{ folder = "nowhere" }]"#, "nowhere"),
    (r#"objects = [{ folder = "job.toml" }]"#, "folder"),
    (r#"objects = [{ list = ["nope.stl"] }]"#, "nope.stl"),
    ("objects = [{ list = [] }]", "list"),
    (r#"objects = [{ list = [""] }]"#, "list"),
    (r#"objects = [{ list = ["/dev/zero"] }]"#, ""),
    ("objects = [{ built_in = [] }]", "built_in"),
    ("objects = [{ built_in = 0 }]", "built_in"),
    ("objects = [{ built_in = -1 }]", "built_in"),
    ("objects = [{ built_in = 100001 }]", "built_in"),
    (r#"objects = [{ built_in = ["zzz"] }]"#, "zzz"),
    (r#"objects = [{ built_in = ["box-99999999999999999999"] }]"#, "box-9"),
    (r#"objects = [{ built_in = ["box-01"], folder = "." }]"#, "folder"),
    (r#"objects = [{ built_in = ["box-01"], unit = "mm" }]"#, "unit"),
    (r#"objects = [{ folder = ".", unit = "parsec" }]"#, "unit"),
    (r#"objects = [{ folder = ".", scale = 0 }]"#, "scale"),
    (r#"objects = [{ folder = ".", size = -1 }]"#, "size"),
    (r#"objects = [{ folder = ".", scale = 1, size = 1 }]"#, "size"),
    (r#"objects = [{ folder = ".", table = "nope.csv" }]"#, "nope.csv"),
    (r#"objects = [{ package = "nope" }]"#, "package"),
    (r#"objects = [{ built_in = ["box-01"], limits = { min = 2, max = 1 } }]"#, "limits"),
    ("objects = [{ built_in = { half_shapes_mm = [10] } }]", "half_shapes_mm"),
    ("product = \"grasps\"\nobjects = [{ built_in = [\"box-01\"] }]\n", "hand"),
    ("product = \"grasps\"\nhand = { model = \"nope.xml\" }\nobjects = [{ built_in = [\"box-01\"] }]\n", "nope.xml"),
    ("product = \"grasps\"\nhand = { model = \".\" }\nobjects = [{ built_in = [\"box-01\"] }]\n", "hand"),
    ("product = \"grasps\"\nhand = { model = \"job.toml\" }\nobjects = [{ built_in = [\"box-01\"] }]\n", "hand"),
    (
        "product = \"grasps\"\nhand = { model = \"BARRETT\" }\nobjects = [{ built_in = [\"box-01\"] }]\n[grasps]\n\
     seeds = 0",
        "seeds",
    ),
    (
        "product = \"grasps\"\nhand = { model = \"BARRETT\" }\nobjects = [{ built_in = [\"box-01\"] }]\n\
     [annealing]\nsteps = 0",
        "steps",
    ),
    (
        "product = \"grasps\"\nhand = { model = \"BARRETT\" }\nobjects = [{ built_in = [\"box-01\"] }]\n[keep]\n\
     space = \"x\"",
        "space",
    ),
    (
        "product = \"grasps\"\nhand = { model = \"BARRETT\" }\nobjects = [{ built_in = [\"box-01\"] }]\n[keep]\n\
     friction = -1",
        "friction",
    ),
    (
        "product = \"grasps\"\nhand = { model = \"BARRETT\" }\nobjects = [{ built_in = [\"box-01\"] }]\n[physics]\n\
     perturbed_runs = -1",
        "perturbed",
    ),
    (
        "product = \"grasps\"\nhand = { model = \"BARRETT\" }\nobjects = [{ built_in = [\"box-01\"] }]\n[grasps]\n\
     sampler = \"antipodal\"\n[antipodal]\ndepth = \"middle\"",
        "only a gripper has middles of pads",
    ),
    (r#"product = "reachability""#, "robot"),
    ("product = \"reachability\"\nROBOT", "poses"),
    (
        "product = \"reachability\"\nROBOT[poses]\nx = { from = 0, to = 1, step = 0 }\n\
     y = { from = 0, to = 1, step = 1 }\nz = { from = 0, to = 1, step = 1 }\nroll = 1\npitch = 1\n\
     yaw = 1",
        "step",
    ),
    (
        "product = \"reachability\"\nROBOT[poses]\nx = { from = 1, to = 0, step = 0.1 }\n\
     y = { from = 0, to = 1, step = 1 }\nz = { from = 0, to = 1, step = 1 }\nroll = 1\npitch = 1\n\
     yaw = 1",
        "poses.x",
    ),
    (
        "product = \"reachability\"\nROBOT[poses]\nx = { from = 0, to = 1, step = 1e-9 }\n\
     y = { from = 0, to = 1, step = 1e-9 }\nz = { from = 0, to = 1, step = 1e-9 }\nroll = 1\npitch = 1\n\
     yaw = 1",
        "poses",
    ),
    (
        "product = \"reachability\"\nROBOT[poses]\nx = { from = 0, to = 1, step = 1 }\n\
     y = { from = 0, to = 1, step = 1 }\nz = { from = 0, to = 1, step = 1 }\nroll = 0\npitch = 1\n\
     yaw = 1",
        "roll",
    ),
    (
        "product = \"reachability\"\nROBOT[poses]\nx = { from = 0, to = 1, step = 1 }\n\
     y = { from = 0, to = 1, step = 1 }\nz = { from = 0, to = 1, step = 1 }\nroll = 2\n\
     directions = { healpix = 0 }",
        "healpix",
    ),
    (
        "product = \"reachability\"\nROBOT[poses]\nx = { from = 0, to = 1, step = 1 }\n\
     y = { from = 0, to = 1, step = 1 }\nz = { from = 0, to = 1, step = 1 }\nroll = 2\npitch = 2\n\
     directions = { healpix = 2 }",
        "pitch",
    ),
    ("product = \"reachability\"\n[robot]\nmodel = \"FETCH\"\njoints = []\ntarget = \"x\"", "joints"),
    (
        "product = \"reachability\"\n[robot]\nmodel = \"FETCH\"\njoints = [\"nope\"]\n\
     target = \"wrist_roll_link\"\n[poses]\nx = { from = 0, to = 1, step = 1 }\n\
     y = { from = 0, to = 1, step = 1 }\nz = { from = 0, to = 1, step = 1 }\nroll = 2\npitch = 2\n\
     yaw = 2",
        "nope",
    ),
    (r#"product = "patches""#, "hand"),
    ("product = \"patches\"\nhand = { model = \"BARRETT\" }\ngrasps = { dataset = \"nowhere\" }", "nowhere"),
    ("product = \"patches\"\nhand = { model = \"BARRETT\" }\ngrasps = { dataset = \".\" }", "dataset"),
    (r#"product = "set""#, "jobs"),
    ("product = \"set\"\njobs = []", "jobs"),
    ("product = \"set\"\njobs = [{ name = \"../x\", job = \"job.toml\" }]", "name"),
    ("product = \"set\"\njobs = [{ name = \"a/b\", job = \"job.toml\" }]", "name"),
    ("product = \"set\"\njobs = [{ name = \"\", job = \"job.toml\" }]", "name"),
    ("product = \"set\"\njobs = [{ name = \"a\", job = \"nope.toml\" }]", "nope.toml"),
    ("product = \"set\"\njobs = [{ name = \"a\", job = \"job.toml\" }]", "set"),
    ("product = \"set\"\njobs = [{ name = \"a\", job = \"ok.toml\" }, { name = \"a\", job = \"ok.toml\" }]", "name"),
    ("product = \"set\"\njobs = [{ name = \"a\", job = \"ok.toml\", inputs = { grasps = \"b\" } }]", "inputs"),
    ("product = \"set\"\njobs = [{ name = \"a\", job = \"ok.toml\", set = [\"nope=1\"] }]", "nope"),
];

/// Settings laid over a job that is in order, and a word of the error.
const SETTINGS: [(&str, &str); 19] = [
    ("x", "--set"),
    ("=1", "--set"),
    ("seed=", "seed"),
    ("a..b=1", "--set"),
    (".a=1", "--set"),
    ("a.=1", "--set"),
    ("seed=\n", ""),
    ("grid.resolution=[", "resolution"),
    ("nope=1", "nope"),
    ("grid=3", "grid"),
    ("objects=[]", "objects"),
    ("seed.x=1", "seed"),
    ("views.even.x=1", "views"),
    ("objects[0].built_in=2", ""),
    ("seed=1 2", ""),
    (r#""seed=1"#, ""),
    ("grid.resolution=9999999999999999999999", "resolution"),
    ("=", ""),
    ("", ""),
];

/// Arguments, the exit code, and a word of the error. Capitals are replaced by files of the repository and of the
/// workspace.
const ARGUMENTS: [(&[&str], i32, &str); 103] = [
    (&[], 2, "Usage"),
    (&["fly"], 2, "fly"),
    (&["run"], 2, "JOB"),
    (&["run", "ok.toml"], 2, "--out"),
    (&["run", "ok.toml", "--out"], 2, "--out"),
    (&["run", "ok.toml", "--out", ""], 2, "--out"),
    (&["run", "nope.toml", "--out", "OUT"], 2, "nope.toml"),
    (&["run", ".", "--out", "OUT"], 2, "regular file"),
    (&["run", "/dev/null", "--out", "OUT"], 2, "regular file"),
    (&["run", "ok.toml", "--out", "s3://a/b"], 2, "s3"),
    (&["run", "ok.toml", "--out", "ok.toml"], 2, "is a file"),
    (&["run", "ok.toml", "--out", "ok.toml/x"], 74, "Not a directory"),
    (&["run", "ok.toml", "--out", "OUT", "--threads", "0"], 2, "--threads"),
    (&["run", "ok.toml", "--out", "OUT", "--threads", "65536"], 2, "--threads"),
    (&["run", "ok.toml", "--out", "OUT", "--threads", "-1"], 2, ""),
    (&["run", "ok.toml", "--out", "OUT", "--threads", "x"], 2, "--threads"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "3/3"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "1/0"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "a/b"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "1"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "/"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "1/2/3"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "99999999999/99999999999"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", ""], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "env/0"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "env/x"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", " 1/2"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "1/ 2"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task", "0x1/2"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--task=-1/2"], 2, "--task"),
    (&["run", "ok.toml", "--out", "OUT", "--progress", "none", "--quiet"], 2, "--quiet"),
    (&["run", "ok.toml", "--out", "OUT", "--progress", "loud"], 2, "loud"),
    (&["estimate", "nope.toml"], 2, "nope.toml"),
    (&["estimate", "ok.toml", "--json", "--json"], 2, "--json"),
    (&["status", "nowhere"], 2, "no such folder"),
    (&["verify", "nowhere"], 2, "no such folder"),
    (&["inspect", "nowhere"], 2, "no such folder"),
    (&["report", "nowhere"], 2, "no such folder"),
    (&["digest", "nowhere"], 2, "no such folder"),
    (&["merge", "nowhere"], 2, "no such folder"),
    (&["status", "ok.toml"], 2, "is a file"),
    (&["verify", "ok.toml"], 2, "is a file"),
    (&["inspect", "ok.toml"], 2, "is a file"),
    (&["report", "ok.toml"], 2, "is a file"),
    (&["digest", "ok.toml"], 2, "is a file"),
    (&["merge", "ok.toml"], 2, "is a file"),
    (&["status", "."], 2, "holds no dataset"),
    (&["verify", "."], 2, "holds no dataset"),
    (&["inspect", "."], 2, "holds no dataset"),
    (&["report", "."], 2, "holds no dataset"),
    (&["digest", "."], 2, "holds no dataset"),
    (&["merge", "."], 2, "holds no dataset"),
    (&["diff", "nowhere"], 2, ""),
    (&["diff", "nowhere", "nowhere"], 2, "no such folder"),
    (&["export", "nowhere", "--to", "npy", "--out", "OUT"], 2, "no such folder"),
    (&["export", "DATA", "--to", "nope", "--out", "OUT"], 2, "nope"),
    (&["export", "DATA", "--to", "npy", "--out", "OUT", "--limit", "-1"], 2, ""),
    (&["export", "DATA", "--to", "npy", "--out", "OUT", "--split", "x"], 2, "x"),
    (&["export", "DATA", "--to", "npy", "--out", "OUT", "--object", "x"], 2, "x"),
    (&["export", "DATA", "--to", "npy", "--out", "DATA"], 2, "not empty"),
    (&["export", "DATA", "--to", "acronym", "--out", "OUT"], 2, ""),
    (&["export", "DATA", "--to", "graspit", "--out", "OUT"], 2, ""),
    (&["export", "DATA", "--to", "npy", "--out", "OUT", "--limit", "0"], 2, "is selected; leave out"),
    (&["verify", "DATA", "--regenerate", "x"], 2, "--regenerate"),
    (&["verify", "DATA", "--set", "a=b"], 2, "--regenerate"),
    (&["verify", "DATA", "--seed", "-1"], 2, ""),
    (&["verify", "DATA", "--regenerate", "1", "--set", "seed=4"], 4, "cannot be made again"),
    (&["verify", "DATA", "--regenerate", "1", "--set", "nope=4"], 2, ""),
    (&["query", "reach", "DATA", "--pose", "1,2,3,4,5,6"], 2, "a dataset of completion"),
    (&["query", "reach", "MAP", "--pose", "1,2"], 2, ""),
    (&["query", "reach", "MAP", "--pose", "a,b,c,d,e,f"], 2, ""),
    (&["query", "reach", "MAP", "--pose", "nan,0,0,0,0,0"], 2, ""),
    (&["query", "reach", "MAP"], 2, "--csv"),
    (&["query", "reach", "MAP", "--csv", "nope.csv"], 2, "nope.csv"),
    (&["query", "reach", "MAP", "--csv", "ok.toml"], 2, ""),
    (&["meshes", "check"], 2, ""),
    (&["meshes", "check", "nope.stl"], 3, "no such file"),
    (&["meshes", "check", "ok.toml"], 3, ".toml is not read"),
    (&["meshes", "check", ".", "--unit", "furlong"], 2, "furlong"),
    (&["meshes", "check", ".", "--size", "0"], 2, ""),
    (&["meshes", "check", ".", "--size", "nan"], 2, ""),
    (&["meshes", "check", ".", "--unit", "-1"], 2, ""),
    (&["meshes", "check", ".", "--unit", "m", "--size", "1"], 2, ""),
    (&["robot", "check", "nope.xml", "--joints", "a", "--target", "b"], 2, "nope.xml"),
    (&["robot", "check", "FETCH", "--joints", "a", "--target", "b"], 2, "no site or body is named"),
    (&["robot", "check", "FETCH"], 2, "--joints"),
    (&["robot", "check", "FETCH", "--joints", "shoulder_pan_joint", "--target", "nope"], 2, "nope"),
    (&["robot", "check", "FETCH", "--joints", "", "--target", "wrist_roll_link"], 2, "no joint is named"),
    (
        &["robot", "check", "FETCH", "--joints", "shoulder_pan_joint", "--target", "wrist_roll_link", "--fixed", "x"],
        2,
        "",
    ),
    (
        &[
            "robot",
            "check",
            "FETCH",
            "--joints",
            "shoulder_pan_joint",
            "--target",
            "wrist_roll_link",
            "--fixed",
            "torso_lift_joint=nan",
        ],
        2,
        "torso_lift_joint",
    ),
    (&["hand", "check", "nope.xml"], 2, "nope.xml"),
    (&["hand", "check", "ok.toml"], 2, "ok.xml"),
    (&["completions", "ksh"], 2, "ksh"),
    (&["man"], 2, "--out"),
    (&["submit", "ok.toml", "--out", "OUT"], 2, "--backend"),
    (&["submit", "ok.toml", "--out", "OUT", "--backend", "abacus"], 2, "abacus"),
    (&["submit", "ok.toml", "--out", "OUT", "--backend", "slurm", "--tasks", "0"], 2, "--tasks"),
    (&["submit", "--retry", "--out", "nowhere"], 2, "submit JOB"),
    (&["submit", "ok.toml", "--out", "OUT", "--backend", "kubernetes"], 2, "--image"),
    (&["release", "nowhere", "--out", "OUT", "--about", "about.toml"], 2, ""),
    (&["release", "DATA", "--out", "OUT", "--about", "nope.toml"], 2, "nope.toml"),
    (&["release", "DATA", "--out", "OUT", "--about", "ok.toml"], 2, ""),
    (&["release", "DATA", "--out", "OUT"], 2, "--about"),
];

/// A workspace with the job `ok.toml`, a dataset `DATA` of it, and a map of poses `MAP`.
fn make_workspace() -> Workspace {
    let workspace = Workspace::new();
    workspace.write("ok.toml", SOUND);
    Program::run_job(workspace.path("ok.toml"), workspace.path("DATA")).succeed();
    workspace.make_dataset("MAP", &small_job("reachability"), &["poses.x.step=0.4", "poses.z.step=0.4", "poses.yaw=1"]);
    workspace
}

/// Replaces capitals in a text by their tables and files.
fn fill(text: &str) -> String {
    let scene = |name: &str| repository_path(name).display().to_string();
    let robot = fetch_table(&repository_path(FETCH));
    text.replace("ROBOT", &robot).replace("BARRETT", &scene(BARRETT)).replace("FETCH", &scene(FETCH))
}

/// Checks an end: the exit code, and a word of the message.
#[track_caller]
fn check(outcome: &Outcome, code: i32, word: &str, label: &str) {
    let (said, label) = (outcome.text(), label.chars().take(200).collect::<String>());
    assert_eq!(outcome.code, Some(code), "{label}: {said}");
    assert!(said.contains(word) && !said.contains("panicked"), "'{word}' is not in the message for {label}: {said}");
}

/// Runs a job that must be refused before anything is begun.
#[track_caller]
fn refuse_job(workspace: &Workspace, text: impl AsRef<[u8]>, word: &str) {
    let label = String::from_utf8_lossy(text.as_ref()).into_owned();
    workspace.write("job.toml", text);
    check(&workspace.run_job("job", "out").finish(), 2, word, &label);
    assert!(!workspace.path("out").exists(), "nothing is begun for a bad job: {label}");
}

#[expect(clippy::print_stdout, reason = "the figures that the test checks")]
fn print(group: &str, tried: usize) {
    println!("{group:20} tried {tried:4} passed {tried:4}");
}

#[test]
fn evil_jobs_are_refused_with_their_mistake() {
    let workspace = Workspace::new();
    workspace.write("ok.toml", SOUND);
    for (lines, word) in LINES {
        refuse_job(&workspace, format!("{lines}\n[[objects]]\nbuilt_in = [\"box-01\"]\n"), word);
    }
    for (text, word) in JOBS {
        refuse_job(&workspace, fill(text), word);
    }
    // Depth and length that a careless reader would follow to the end of its stack.
    let deep = [
        format!("a = {}", "[".repeat(20_000)),
        format!("a = {}1{}", "{a=".repeat(5_000), "}".repeat(5_000)),
        format!("{} = 1", vec!["a"; 20_000].join(".")),
        format!("[{}]", vec!["a"; 5_000].join(".")),
        format!("a = \"{}\"\n{SOUND}", "x".repeat(1_000_000)),
        "\0".repeat(10),
    ];
    for text in &deep {
        refuse_job(&workspace, text, "");
    }
    refuse_job(&workspace, [b"\xff\xfe", SOUND.as_bytes()].concat(), "UTF-8");
    print("job files", LINES.len() + JOBS.len() + deep.len() + 1);
}

#[test]
fn evil_settings_are_refused_with_their_mistake() {
    let workspace = Workspace::new();
    workspace.write("ok.toml", SOUND);
    let deep = [format!("{}=1", vec!["a"; 3_000].join(".")), format!("seed={}", "[".repeat(20_000))];
    let settings = SETTINGS.into_iter().chain(deep.iter().map(|setting| (setting.as_str(), "")));
    for (setting, word) in settings {
        let outcome = workspace.run_job("ok", "out").set([setting]).finish();
        check(&outcome, 2, word, setting);
        assert!(!workspace.path("out").exists(), "nothing is begun: {setting}");
    }
    print("settings", SETTINGS.len() + deep.len());
}

#[test]
fn evil_arguments_end_with_the_code_that_the_documents_say() {
    let workspace = make_workspace();
    for (arguments, code, word) in ARGUMENTS {
        let filled = arguments.iter().map(|argument| fill(argument));
        let outcome =
            Program::of_system(env!("CARGO_BIN_EXE_graspmill")).args(filled).current_dir(workspace.folder()).finish();
        check(&outcome, code, word, &arguments.join(" "));
        assert!(!workspace.path("OUT").exists(), "nothing is made: {arguments:?}");
    }
    // What was there is as it was.
    assert_eq!(workspace.read("ok.toml"), SOUND);
    Program::on("verify", workspace.path("DATA")).succeed();
    print("arguments", ARGUMENTS.len());
}

#[test]
fn a_camera_that_sees_nothing_is_refused_and_so_is_a_dataset_without_a_sample() {
    let workspace = Workspace::new();
    refuse_job(&workspace, format!("distance = 1e300\n{SOUND}"), "one pixel wide");
    // Each view is rejected, for a reason that no job shows before it runs: the dataset is complete, and of no use.
    let job = SOUND.replace("min_partial_cells = 1\n", "min_partial_cells = 1728\n");
    workspace.write("job.toml", job);
    for said in ["all rejected (1 few_partial_cells)", "is already complete"] {
        let found = workspace.run_job("job", "out").expect_code(3).stdout;
        assert!(found.contains(said) && found.contains("no sample was kept"), "{found}");
    }
    Program::on("verify", workspace.path("out")).succeed();
    assert!(fs::metadata(workspace.path("out/manifest.json")).expect("a manifest").is_file());
    workspace.run_job("job", "tasks").option("--task", "0/1").succeed();
    Program::on("merge", workspace.path("tasks")).expect_code(3);
}
