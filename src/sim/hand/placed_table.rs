//! The table of a simulated hand: placed under the object, and removed.

use nalgebra::IsometryMatrix3;

use crate::{
    convert::quaternion,
    hand::closing::HandWorker,
    objects::table::{self, Table},
};

impl HandWorker {
    /// Puts the table, where the model has one, at a pose expressed in the hand's base frame, its z out of the table, until the
    /// next [`HandWorker::start`] takes it away.
    pub(crate) fn put_table(&mut self, base_from_table: &IsometryMatrix3<f64>) {
        if let Some(Table { mocap, .. }) = self.sim.table {
            self.data.mocap_pos_mut()[mocap] = base_from_table.translation.vector.into();
            self.data.mocap_quat_mut()[mocap] = quaternion(base_from_table);
        }
    }

    /// Takes the table away, where the model has one.
    pub(crate) fn take_table_away(&mut self) {
        self.put_table(&table::away());
    }

    /// Depth of the lowest point of the hand at the start of a run below a table [m]; 0 where it is above.
    pub(crate) fn depth_below(&self, base_from_table: &IsometryMatrix3<f64>) -> f64 {
        let depth = |table: &Table| table.depth_of_hand(base_from_table, self.data.geom_xpos(), self.data.geom_xmat());
        self.sim.table.as_ref().map_or(0.0, depth)
    }
}
