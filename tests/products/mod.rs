//! Jobs that make little of everything, in a second or two each.

use std::path::Path;

/// Name and text of a job of each product; that of patches takes the dataset `grasps` in `place`. `root` is the repository.
pub fn jobs(root: &Path, place: &Path) -> Vec<(&'static str, String)> {
    let hand = root.join("scenes/barrett_bh8_280.xml");
    let fetch = root.join("scenes/fetch.xml");
    let joints =
        ["shoulder_pan", "shoulder_lift", "upperarm_roll", "elbow_flex", "forearm_roll", "wrist_flex", "wrist_roll"];
    let joints = joints.map(|joint| format!("{joint}_joint"));
    let split = "[split]\nvalidation_models = 0\ntest_models = 0\n";
    let completion = format!(
        "objects = [{{ built_in = [\"box-01\"] }}]\nviews = {{ even = 3 }}\n[grid]\nresolution = 12\n[gate]\n\
         min_partial_cells = 1\n[channels]\ndepth = \"u16\"\ncloud = true\ntsdf = true\ncoverage = true\nimplicit = true\n\
         implicit_surface = 20\nimplicit_space = 20\n[touch]\nrandom_rays = true\nexploration = true\napproaches = 2\n\
         grasp = true\nhand = {{ scene = {hand:?} }}\n[shards]\nsamples = 2\n{split}"
    );
    let reachability = format!(
        "product = \"reachability\"\n[robot]\nscene = {fetch:?}\njoints = {joints:?}\ntarget = \"wrist_roll_link\"\n[poses]\n\
         x = {{ from = 0.4, to = 0.8, step = 0.2 }}\ny = {{ from = 0.0, to = 0.2, step = 0.2 }}\n\
         z = {{ from = 0.6, to = 1.0, step = 0.2 }}\nroll = 2\npitch = 2\nyaw = 4\n[shards]\npositions = 3\n"
    );
    let grasps = format!(
        "product = \"grasps\"\nhand = {{ scene = {hand:?} }}\nobjects = [{{ built_in = [\"box-01\"] }}]\n[grasps]\nseeds = 2\n\
         [annealing]\nsteps = 1500\n[keep]\nspace = \"force\"\n[physics]\n{split}"
    );
    let patches = format!(
        "product = \"patches\"\nhand = {{ scene = {hand:?} }}\n[grasps]\ndataset = {:?}\n[patches]\nside = 4\n[images]\n\
         full = true\nheatmaps = true\n[render]\ncolour = false\n",
        place.join("grasps")
    );
    vec![("completion", completion), ("reachability", reachability), ("grasps", grasps), ("patches", patches)]
}
