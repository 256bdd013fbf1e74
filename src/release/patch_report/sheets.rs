//! Sheets of patches as in the thesis's figure 4.3: colours above depth, a column each for the palm and the fingertips.

use std::{collections::BTreeMap, fmt::Write as _};

use crate::{
    dataset::{DatasetError, DatasetReader},
    geom::DepthCrop,
    ids::{ObjectId, SampleIndex},
    record::{HeatmapPatch, PATCH_POINTS, POINT_NAMES, PatchColour},
    release::{
        page::escaped,
        patches::PatchSurvey,
        picture::{DepthRange, Picture, depth_picture},
    },
};

/// Pixels of a picture for each of a patch.
const ZOOM: u32 = 2;

/// The section, and how many grasps it shows: of each type the best of a few objects.
pub(super) fn sheets(reader: &DatasetReader, survey: &PatchSurvey) -> Result<(String, usize), DatasetError> {
    let names: BTreeMap<ObjectId, &str> =
        survey.facts.objects.iter().map(|object| (object.object, object.name.as_str())).collect();
    let mut html = String::from(concat!(
        "<section id=\"gallery\"><h2>Patches</h2><p>Of each type the grasp with the highest epsilon, of up to three objects. Each ",
        "patch lies around the projection of the palm or of a fingertip of the closed hand, which itself is not drawn. Near is ",
        "light, far is dark; the patches of a grasp share their scale. Where nothing is seen, depth is clear.</p>"
    ));
    let mut shown = 0;
    for index in survey.picks.iter().flatten() {
        let Some(sample) = reader.sample(*index)? else { continue };
        let patch = sample.heatmap_patch()?;
        let name = names.get(&sample.id.subject).copied().unwrap_or("?");
        html.push_str(&card(*index, &patch, sample.patch_colour()?.as_ref(), name));
        shown += 1;
    }
    html.push_str("</section>");
    Ok((html, shown))
}

fn card(index: SampleIndex, patch: &HeatmapPatch, colour: Option<&PatchColour>, name: &str) -> String {
    let mut html = format!(
        concat!(
            "<article class=\"card\"><header><h3>{}</h3><p class=\"figures\">type {} (place {}), epsilon {:.4}, energy {:.3}, ",
            "sample {}, run {}, rank {}</p></header><div class=\"pictures\">"
        ),
        escaped(name),
        patch.kind(),
        patch.type_index,
        patch.epsilon,
        patch.energy,
        index,
        patch.run,
        patch.rank,
    );
    for point in 0..PATCH_POINTS {
        if let Some(colour) = colour {
            figure(&mut html, &enlarged(&in_colour(colour, point)), patch, point, "colours");
        }
    }
    let range = range_of(patch);
    for point in 0..PATCH_POINTS {
        figure(&mut html, &depth_picture(&crop_of(patch, point), range, ZOOM), patch, point, "depth");
    }
    html.push_str("</div></article>\n");
    html
}

/// The patches of a grasp in one picture: palm and fingertips from left to right, in colour where there is any, else depth.
pub(in crate::release) fn picture_of(patch: &HeatmapPatch, colour: Option<&PatchColour>) -> Picture {
    let range = range_of(patch);
    let of_point = |point: usize| {
        let picture = match colour {
            Some(colour) => enlarged(&in_colour(colour, point)),
            None => depth_picture(&crop_of(patch, point), range, ZOOM),
        };
        picture.framed()
    };
    let pictures: Vec<Picture> = (0..PATCH_POINTS).map(of_point).collect();
    Picture::row(&pictures, 4 * ZOOM).with_few_colours()
}

fn in_colour(colour: &PatchColour, point: usize) -> Picture {
    let pixels = colour.rgb_of(point).iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect();
    Picture { width: colour.side, height: colour.side, pixels }
}

fn crop_of(patch: &HeatmapPatch, point: usize) -> DepthCrop {
    let depth = patch.depth_of(point).to_vec();
    DepthCrop { left: 0, top: 0, width: patch.side, height: patch.side, depth }
}

/// The range of depth of all four patches, which share their scale.
fn range_of(patch: &HeatmapPatch) -> DepthRange {
    let (width, height) = (patch.side, 4 * patch.side);
    let whole = DepthCrop { left: 0, top: 0, width, height, depth: patch.depth.clone() };
    DepthRange::of(&whole).unwrap_or(DepthRange { near: 0.0, far: 1.0 })
}

fn figure(html: &mut String, picture: &Picture, patch: &HeatmapPatch, point: usize, what: &str) {
    let [u, v] = patch.points[point].pixel;
    let _ = write!(
        html,
        concat!(
            "<figure><img width=\"{}\" height=\"{}\" loading=\"lazy\" alt=\"{} around {}\" src=\"{}\">",
            "<figcaption>{}, {} <span class=\"quiet\">{} at ({:.1}, {:.1}) px</span></figcaption></figure>"
        ),
        picture.width,
        picture.height,
        what,
        POINT_NAMES[point],
        picture.clone().with_few_colours().to_data_uri(),
        POINT_NAMES[point],
        what,
        escaped(&patch.points[point].name),
        u,
        v,
    );
}

fn enlarged(picture: &Picture) -> Picture {
    let mut large = Picture::filled(picture.width * ZOOM, picture.height * ZOOM, [0; 4]);
    for row in 0..picture.height {
        for column in 0..picture.width {
            let pixel = picture.at(column, row);
            large.fill(column * ZOOM..(column + 1) * ZOOM, row * ZOOM..(row + 1) * ZOOM, pixel);
        }
    }
    large
}
