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
            let pixels = colour.rgb_of(point).iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect();
            let picture = Picture { width: colour.side, height: colour.side, pixels };
            figure(&mut html, &enlarged(&picture), patch, point, "colours");
        }
    }
    let crop = |point: usize| DepthCrop {
        left: 0,
        top: 0,
        width: patch.side,
        height: patch.side,
        depth: patch.depth_of(point).to_vec(),
    };
    let whole = DepthCrop { width: patch.side, height: 4 * patch.side, depth: patch.depth.clone(), ..crop(0) };
    let range = DepthRange::of(&whole).unwrap_or(DepthRange { near: 0.0, far: 1.0 });
    for point in 0..PATCH_POINTS {
        figure(&mut html, &depth_picture(&crop(point), range, ZOOM), patch, point, "depth");
    }
    html.push_str("</div></article>\n");
    html
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
