//! The facts of a dataset as text.

use std::fmt;

use super::inspection::{CompletionInspection, CompletionObjectFacts};
use crate::{
    chart::{grouped, percent},
    inspection::{InspectionHeader, remark_in_words},
    tally::SpreadRow,
};
use kernel::words::Show;

impl fmt::Display for CompletionInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rejected = self.rejected.values().sum::<u64>();
        self.header.write_names(f)?;
        for (class, root) in &self.header.classes {
            writeln!(f, "  {:<9} {root}", class.name())?;
        }
        writeln!(f, "  job       {}", self.header.job)?;
        let [planned, kept, lost] = [self.planned, self.kept, rejected].map(grouped);
        writeln!(f, "  samples   {planned} planned = {kept} kept + {lost} rejected")?;
        InspectionHeader::write_rejected(f, &self.rejected)?;
        self.header.write_shards(f)?;
        let each = self.header.shard_bytes.checked_div(self.kept).unwrap_or(0);
        writeln!(f, ", {} bytes per kept sample", grouped(each))?;
        writeln!(f, "  channels  {}", self.channels.join(", "))?;
        if let Some(setup) = &self.setup {
            let (n, width, height) = (setup.resolution, setup.width, setup.height);
            writeln!(
                f,
                "  grid      {n} x {n} x {n} cells; image {width} x {height} px, focal length {:.2} px",
                setup.fx
            )?;
        }
        if let Some(sensor) = &self.sensor {
            writeln!(f, "  sensor    {}: its noise is in the depth", sensor.shown())?;
        }
        if let Some(speed) = &self.header.notes.speed {
            let rate = grouped(speed.rate().round() as u64);
            writeln!(f, "  speed     {rate} samples/s: {:.1} s on {} threads", speed.seconds, speed.threads)?;
        }
        writeln!(f, "\nkept samples             min        5 %     median       95 %        max       mean")?;
        for (name, spread, digits) in [
            ("partial cells", &self.partial_cells, 0),
            ("complete cells", &self.complete_cells, 0),
            ("partial / complete", &self.seen_ratio, 3),
            ("solid inside grid", &self.solid_share, 3),
        ] {
            writeln!(f, "{}", SpreadRow::new(name, digits, spread))?;
        }
        if self.kept > 0 {
            let share = percent(self.cut_off as f64 / self.kept as f64);
            writeln!(f, "  {share} of the kept samples have less than 99 % of the solid inside the grid")?;
        }
        if let Some(hidden) = &self.hidden_share {
            writeln!(f, "{}", SpreadRow::new("hidden, occluded views", 3, hidden))?;
            let share = percent(self.occluded as f64 / self.kept.max(1) as f64);
            writeln!(f, "  something is in front of the object in {share} of the kept samples")?;
        }
        if let Some(touch) = &self.touch {
            writeln!(f, "{touch}")?;
        }
        self.splits_and_leaks(f)?;
        self.objects_and_warnings(f)
    }
}

impl CompletionInspection {
    fn splits_and_leaks(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nsplit                samples    objects")?;
        for row in &self.splits {
            writeln!(f, "  {:<16} {:>9} {:>10}", row.split.name(), grouped(row.samples), row.objects)?;
        }
        if !self.training_subsets.is_empty() {
            let sizes: Vec<String> = self.training_subsets.iter().map(u32::to_string).collect();
            writeln!(f, "  nested training subsets of {} objects", sizes.join(", "))?;
        }
        for names in &self.leaking_geometry {
            writeln!(f, "  LEAK: equal geometry on different sides: {}", names.join(", ").shown())?;
        }
        let notes = &self.header.notes;
        for (name, count) in &notes.leaks {
            writeln!(f, "  {:>9} {}", grouped(*count), notes.leak_in_words(name).shown())?;
        }
        Ok(())
    }

    fn objects_and_warnings(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let wide = self.objects.iter().map(|object| object.name.chars().count()).max().unwrap_or(0).clamp(6, 40);
        writeln!(f, "\n{:<wide$}   triangles  longest side  closed  kept/planned  split", "object")?;
        for object in &self.objects {
            let CompletionObjectFacts { name, triangles, watertight, kept, planned, split, .. } = object;
            let triangles = triangles.map_or_else(|| "?".to_owned(), grouped);
            let side = object.longest_side().map_or_else(|| "?".to_owned(), |side| format!("{:.1} mm", side * 1e3));
            let closed = watertight.map_or("?", |closed| if closed { "yes" } else { "no" });
            let counts = format!("{kept}/{planned}");
            let split = split.map_or("?", |split| split.name());
            let name = name.shown();
            writeln!(f, "{name:<wide$}   {triangles:>9}  {side:>12}  {closed:>6}  {counts:>12}  {split}")?;
            let repairs = object.repairs.iter().map(|repair| format!("repaired: {}", repair.shown()));
            for line in repairs.chain(object.warnings.iter().map(|warning| remark_in_words(warning))) {
                writeln!(f, "{:wide$}     {line}", "")?;
            }
        }
        for line in &self.refused {
            writeln!(f, "refused: {}", line.shown())?;
        }
        self.header.write_warnings(f)
    }
}
